#pragma once
/// Reads model files and textures. offstage has its own reader for glTF 2.0 (docs/models.md lists its
/// features); assimp reads OBJ, PLY, STL, Collada, FBX and others. Files are read in a confined child
/// (confined_child.h), because readers may crash or hang on hostile files. The caller then gets an error
/// message.

#include <filesystem>
#include <string>
#include <vector>

#include "render/file_io.h"
#include "render/image_io.h"
#include "render/input_folders.h"
#include "render/model.h"

namespace offstage::render {

struct ModelPath {
  std::filesystem::path file;
  std::string node;  ///< name of the node; empty: the whole file
};
/// Splits FILE#NODE, unless a file with the whole name exists.
ModelPath split_node(const std::filesystem::path& path);

/// Reads a model and its textures, embedded in it or beside it. Applies the transforms of its nodes, and
/// removes elements that cannot be drawn (points, lines, faces with bad indices or no area, non-finite
/// vertices) with a warning. Cameras and lights are ignored; in glTF files, with a warning. `with_rig`: also
/// reads the animations of a glTF file and the surfaces that they move, into Model::rig. There is one part
/// per material and kind of vertex, with normals (by compute_normals() if the file has none; flat for glTF).
/// Texture coordinates start at the image's top left, with v downwards. Up axis and unit are converted to Y
/// and metres if the format defines them (FBX, Collada). Colours of classic materials (diffuse, specular,
/// shininess) are treated as sRGB, those of physically based materials as linear. For a path that ends in
/// #NODE, only the triangles of that node, in its frame (Model::Node). The model and all files that it names
/// must be in `folders`; if there are none, in the model's own folder. Throws FileError with one line for a
/// file that is missing, broken, or without triangles; UnavailableError if no process can be started;
/// StoppedError after a request by `stop`.
Model read_model(const std::filesystem::path& path, const InputFolders& folders = {},
                 const StopTest& stop = {}, bool with_rig = false);

/// Returns the longest side of the bounding box of a model file [m]. For a path that ends in #NODE, it is
/// also that of the whole file. Reads and throws as read_model() does.
float read_file_size(const std::filesystem::path& path, const InputFolders& folders = {},
                     const StopTest& stop = {});

/// Reads an image of up to kMaxTexturePixels. Throws as read_model() does.
Image read_texture(const std::filesystem::path& path, const InputFolders& folders = {},
                   const StopTest& stop = {});

/// Reads a picture in linear light; see decode_light_image(). Throws as read_model() does.
LightImage read_light_image(const std::filesystem::path& path, const InputFolders& folders = {},
                            const StopTest& stop = {});

/// Returns the packages of the optional libraries for compressed glTF files that this build lacks.
std::vector<std::string> missing_model_libraries();

/// Returns the message for a file outside of the folders that may be read.
std::string outside_of_folders(const std::filesystem::path& path);

}  // namespace offstage::render
