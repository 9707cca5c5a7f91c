#pragma once
/// The parts of read_model() that handle untrusted data. Private to render.
/// In the child: assimp, and the conversion of its scene, which may crash or hang on a hostile file.
/// In the caller: the answer of the child, which a hostile file may have taken over.

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "render/input_folders.h"
#include "render/model.h"
#include "render/mtl_file.h"

struct aiScene;

namespace offstage::render {

/// Imports a model with one part per material; parts whose file has no normals have none. With `node`, only
/// the triangles of this node, in its frame; empty: all. `with_rig`: see read_model(). Files outside of
/// `folders` are treated as missing. Throws FileError.
Model import_model(const std::filesystem::path& path, const std::string& node, const InputFolders& folders,
                   bool with_rig = false);

/// Fills `materials` and `textures`, with a warning for each texture that is not found. Textures are searched
/// by the name given, then by file name beside the model. `mtl` completes the materials of OBJ files by name.
/// Returns for each material the number of its set of
/// texture coordinates.
std::vector<unsigned> import_materials(const aiScene& scene, const std::filesystem::path& folder,
                                       const InputFolders& folders,
                                       const std::map<std::string, MtlMaterial>& mtl, Model& model);

/// Writes a model to a file, for decode_model(). `model` is not changed. Throws std::bad_alloc if the file
/// takes no more.
void write_model(Model& model, int fd);

/// Returns the model that write_model() wrote. Whatever the bytes are, the model that is returned is
/// consistent: all its indices refer to something, its sizes agree and its coordinates are finite; and the
/// memory taken stays within a small multiple of the bytes. Throws FileError for all other bytes.
Model decode_model(std::span<const uint8_t> bytes);

}  // namespace offstage::render
