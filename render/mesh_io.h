#pragma once
/// Model files through assimp: OBJ, PLY, STL, glTF/GLB, Collada, FBX and what else it reads. assimp runs in a forked
/// child with limits of time (8 s of processor time and 1 s more for each MiB of the file) and memory (4 GiB), because
/// it crashes or hangs on hostile files; the caller gets a message instead.

#include <filesystem>

#include "render/model.h"

namespace offstage::render {

/// Reads a model, applies its nodes' transforms, drops what cannot be drawn (points, lines, faces with bad
/// indices or no area, non-finite vertices) with a warning, and reads its textures, embedded or beside it.
/// Animation is ignored. Throws FileError with one line for a file that is missing, broken, or has no
/// triangle left.
Model read_model(const std::filesystem::path& path);

}  // namespace offstage::render
