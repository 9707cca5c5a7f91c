#pragma once
<<<<<<< ours
/// Model files through assimp: OBJ, PLY, STL, glTF/GLB, Collada, FBX and what else it reads. assimp runs in a
/// forked child with limits of time (8 s of processor time and 1 s more for each MiB of the file) and memory
/// (4 GiB), because it crashes or hangs on hostile files; the caller gets a message instead.
=======
/// Reads model files through assimp (OBJ, PLY, STL, glTF/GLB, Collada, FBX and its other formats), and
/// textures. Both are read in a confined child (confined_child.h states its limits of time and memory),
/// because readers may crash or hang on hostile files. The caller then gets an error message.
>>>>>>> theirs

#include <filesystem>

#include "render/model.h"

namespace offstage::render {

struct ModelPath {
  std::filesystem::path file;
  std::string node;  ///< name of a node; empty: the whole model
};
/// Splits FILE#NODE, unless a file of that whole name exists.
ModelPath split_node(const std::filesystem::path& path);

<<<<<<< ours
/// Reads a model, applies its nodes' transforms, drops what cannot be drawn (points, lines, faces with bad
/// indices or no area, non-finite vertices) with a warning, and reads its textures, embedded or beside it.
/// Animation, skins, cameras, lights and vertex colours are ignored. There is one part per material, with
/// normals (compute_normals where the file has none). Texture coordinates start at the image's top left, v
/// down, as its rows run. Up axis and unit become Y and metres where the format states them (FBX, Collada).
/// Colours of classic materials (diffuse, specular, shininess) are taken as sRGB, those of physically based
/// ones as linear. Throws FileError with one line for a file that is missing, broken, or has no triangle
/// left; UnavailableError if no process can be started.
/// Of a path that ends in #NODE only that node's own triangles, from where it is (Model::Node).
Model read_model(const std::filesystem::path& path);
=======
/// Reads a model and its textures, embedded or beside it, and applies the transforms of its nodes. Elements
/// that cannot be drawn are dropped with a warning: points, lines, faces with bad indices or no area,
/// non-finite vertices. Animation, skins, cameras, lights and vertex colours are ignored. There is one part
/// per material, with normals (compute_normals where the file has none). Texture coordinates start at the
/// image's top left, with v pointing down, as its rows run. Up axis and unit become Y and metres where the
/// format states them (FBX, Collada). Colours of classic materials (diffuse, specular, shininess) are taken
/// as sRGB, those of physically based ones as linear.
/// For a path that ends in #NODE, only that node's own triangles are read, in the node's frame (Model::Node).
/// The model and all files that it names must lie in `folders`; without any, in the model's own folder.
/// `stop` ends the work with StoppedError.
/// Throws FileError with one line for a file that is missing, broken, or has no triangle left;
/// UnavailableError if no process can be started.
Model read_model(const std::filesystem::path& path, const InputFolders& folders = {},
                 const StopTest& stop = {});

/// Reads a picture of at most kMaxTexturePixels. Throws as read_model does.
Image read_texture(const std::filesystem::path& path, const InputFolders& folders = {},
                   const StopTest& stop = {});

/// The error message for a file outside the folders that may be read.
std::string outside_of_folders(const std::filesystem::path& path);
>>>>>>> theirs

}  // namespace offstage::render
