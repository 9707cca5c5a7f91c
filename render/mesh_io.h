#pragma once
/// Model files through assimp: OBJ, PLY, STL, glTF/GLB, Collada, FBX and what else it reads; and textures.
/// Both are read in a confined child (confined_child.h has its limits of time and memory), because readers
/// crash or hang on hostile files; the caller gets a message instead.

#include <filesystem>

#include "render/file_io.h"
#include "render/input_folders.h"
#include "render/model.h"

namespace offstage::render {

struct ModelPath {
  std::filesystem::path file;
  std::string node;  ///< empty: all of it
};
/// Takes FILE#NODE apart, unless there is a file of that whole name.
ModelPath split_node(const std::filesystem::path& path);

/// Reads a model, applies its nodes' transforms, drops what cannot be drawn (points, lines, faces with bad
/// indices or no area, non-finite vertices) with a warning, and reads its textures, embedded or beside it.
/// Animation, skins, cameras, lights and vertex colours are ignored. There is one part per material, with
/// normals (compute_normals where the file has none). Texture coordinates start at the image's top left, v
/// down, as its rows run. Up axis and unit become Y and metres where the format states them (FBX, Collada).
/// Colours of classic materials (diffuse, specular, shininess) are taken as sRGB, those of physically based
/// ones as linear. Throws FileError with one line for a file that is missing, broken, or has no triangle
/// left; UnavailableError if no process can be started.
/// Of a path that ends in #NODE only that node's own triangles, from where it is (Model::Node).
/// The model and all that it names must lie in `folders`; without any, in the model's own folder. `stop` ends
/// the work with StoppedError.
Model read_model(const std::filesystem::path& path, const InputFolders& folders = {},
                 const StopTest& stop = {});

/// Reads a picture of up to kMaxTexturePixels. Throws as read_model does.
Image read_texture(const std::filesystem::path& path, const InputFolders& folders = {},
                   const StopTest& stop = {});

/// The message for a file that is in none of the folders that may be read.
std::string outside_of_folders(const std::filesystem::path& path);

}  // namespace offstage::render
