#pragma once
/// The parts of read_model() that handle untrusted data. Private to render.
/// import_model() runs in a confined child, because assimp may crash or hang on a hostile file.
/// decode_model() runs in the caller. It does not trust its input, because a hostile file may have taken over
/// the child.

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

/// Imports a model with one part per material. Parts have normals only if the file has them. `node`: imports
/// only the triangles of this node, in its frame; empty: imports the whole file. `with_rig`: see
/// read_model(). Files outside of `folders` are treated as missing. Throws FileError.
Model import_model(const std::filesystem::path& path, const std::string& node, const InputFolders& folders,
                   bool with_rig = false);

/// Fills Model::materials and Model::textures, with a warning for each texture that is not found. Textures
/// are searched by the path in the file, then by file name beside the model. `mtl`: further properties of the
/// materials of OBJ files, by name. Returns for each material the number of its set of texture coordinates.
std::vector<unsigned> import_materials(const aiScene& scene, const std::filesystem::path& folder,
                                       const InputFolders& folders,
                                       const std::map<std::string, MtlMaterial>& mtl, Model& model);

/// Writes a model to a file, for decode_model(). `model` is not changed. Throws std::bad_alloc if a write
/// fails.
void write_model(Model& model, int fd);

/// Returns the model that write_model() wrote. The result is consistent for any input: indices are in range,
/// sizes agree and coordinates are finite. The used memory is at most a small multiple of the input. Throws
/// FileError if the input is not a consistent model.
Model decode_model(std::span<const uint8_t> bytes);

}  // namespace offstage::render
