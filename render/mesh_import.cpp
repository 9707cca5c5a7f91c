#include "render/mesh_import.h"

#include <algorithm>
#include <map>
#include <optional>
#include <span>

#include <assimp/Importer.hpp>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include "render/error.h"
#include "render/file_io.h"
#include "render/gltf_file.h"
#include "render/gltf_import.h"
#include "render/model_files.h"
#include "render/part_builder.h"
#include "render/polygon_cut.h"
#include "render/tone_map.h"

namespace offstage::render {
namespace {

using Eigen::Affine3d;
using Eigen::Vector3d;

constexpr unsigned kSteps = aiProcess_Triangulate | aiProcess_RemoveComponent | aiProcess_GenUVCoords |
                            aiProcess_TransformUVCoords | aiProcess_JoinIdenticalVertices;
constexpr int kIgnored = aiComponent_ANIMATIONS | aiComponent_BONEWEIGHTS | aiComponent_LIGHTS |
                         aiComponent_CAMERAS | aiComponent_TANGENTS_AND_BITANGENTS;

Vector3f to_eigen(const aiVector3D& v) {
  return Vector3d(v.x, v.y, v.z).cast<float>();
}

Affine3d to_eigen(const aiMatrix4x4& m) {
  Affine3d result;
  result.matrix() << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, 0, 0, 0, 1;
  return result;
}

/// Returns the unit of a file [m]. Files of FBX state their unit in centimetres. For other formats the reader
/// converts to metres, or the format has no unit.
double metres_per_unit(const aiScene& scene) {
  double centimetres = 100;
  float single = 0;
  if (scene.mMetaData && !scene.mMetaData->Get("UnitScaleFactor", centimetres) &&
      scene.mMetaData->Get("UnitScaleFactor", single)) {
    centimetres = single;
  }
  return centimetres > 1e-6 && centimetres < 1e6 ? centimetres / 100 : 1;
}

Model::UnitSource unit_source_of(const std::filesystem::path& path) {
  using Source = Model::UnitSource;
  if (has_ending(path, ".dae") || has_ending(path, ".fbx") || is_gltf(path)) return Source::stated;
  return has_ending(path, ".stl") || has_ending(path, ".3mf") ? Source::millimetres : Source::none;
}

/// Returns the unit of a file in words; for formats without units, the unit that is assumed.
std::string unit_of(const aiScene& scene, const std::filesystem::path& path) {
  if (is_gltf(path)) return "1 m, as the format defines (glTF)";
  if (has_ending(path, ".dae")) return "stated by the file (Collada) and converted to metres";
  if (has_ending(path, ".fbx")) {
    char text[64];
    std::snprintf(text, sizeof text, "%.6g m, as the file states (FBX)", metres_per_unit(scene));
    return text;
  }
  return "none in this format; 1 m is assumed";
}

/// Converts texture coordinates: v increases upwards in assimp, and downwards here.
Vector2f top_down(const aiVector3D& uv) {
  return {static_cast<float>(uv.x), 1 - static_cast<float>(uv.y)};
}

/// Converts a colour of a classic format from sRGB to linear light.
Vector4f linear_color(const aiColor4D& c) {
  const auto decode = [](float value) { return srgb_decode(std::clamp(value, 0.0f, 1.0f)); };
  return {decode(static_cast<float>(c.r)), decode(static_cast<float>(c.g)), decode(static_cast<float>(c.b)),
          std::clamp(static_cast<float>(c.a), 0.0f, 1.0f)};
}

/// Converts a colour that was stored as bytes. assimp reads the bytes of Blender's files as signed numbers,
/// so 255 arrives as -1.
aiColor4D from_bytes(const aiColor4D& c) {
  const auto fraction = [](ai_real value) { return (value < 0 ? value + 256 : value) / 255; };
  return {fraction(c.r), fraction(c.g), fraction(c.b), fraction(c.a)};
}

/// Converts the meshes of assimp's scene, each when it is used first.
class AssimpSurfaces {
 public:
  /// `byte_colors`: see from_bytes().
  AssimpSurfaces(const aiScene& scene, std::vector<unsigned> uv_sets, bool byte_colors, Model& model,
                 PartBuilder& builder)
      : scene_(scene),
        uv_sets_(std::move(uv_sets)),
        byte_colors_(byte_colors),
        model_(model),
        builder_(builder) {}

  void add(unsigned mesh_index, const Affine3d& world_from_mesh) {
    if (mesh_index >= scene_.mNumMeshes) return;
    const aiMesh& mesh = *scene_.mMeshes[mesh_index];
    const std::size_t material = std::min<std::size_t>(mesh.mMaterialIndex, model_.materials.size() - 1);
    const auto [entry, is_new] = surfaces_.try_emplace(mesh_index);
    FileSurface& surface = entry->second;
    if (is_new) {
      surface.material = static_cast<int>(material);
      convert(mesh, material, surface.mesh);
    }
    builder_.add(surface, world_from_mesh);
    const auto points = static_cast<std::size_t>(std::count_if(
        mesh.mFaces, mesh.mFaces + mesh.mNumFaces, [](const aiFace& face) { return face.mNumIndices == 1; }));
    builder_.count_skipped(points, mesh.mNumFaces - surface.mesh.indices.size() / 3 - points);
  }

 private:
  void convert(const aiMesh& mesh, std::size_t material, Mesh& out) {
    const unsigned uv_set =
        material < uv_sets_.size() && mesh.HasTextureCoords(uv_sets_[material]) ? uv_sets_[material] : 0;
    const bool has_uvs = mesh.HasTextureCoords(uv_set), has_colors = mesh.HasVertexColors(0);
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      out.positions.push_back(to_eigen(mesh.mVertices[i]));
      if (mesh.HasNormals()) out.normals.push_back(to_eigen(mesh.mNormals[i]));
      if (has_uvs) out.uvs.push_back(top_down(mesh.mTextureCoords[uv_set][i]));
      if (has_colors)
        out.colors.push_back(
            linear_color(byte_colors_ ? from_bytes(mesh.mColors[0][i]) : mesh.mColors[0][i]));
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices == 3) out.indices.insert(out.indices.end(), face.mIndices, face.mIndices + 3);
    }
    if (has_colors) add_colors(material, out);
  }

  /// Adds the vertex colours. If a file has no colours or no alpha, some readers of assimp leave the colours
  /// empty or the alpha at 0.
  void add_colors(std::size_t material, Mesh& out) {
    if (std::ranges::all_of(out.colors, [](const Vector4f& c) { return c.isZero(); }))
      return out.colors.clear();
    if (std::ranges::all_of(out.colors, [](const Vector4f& c) { return c.w() == 0; })) {
      for (Vector4f& color : out.colors) color.w() = 1;
      const std::string warning = "material '" + model_.materials[material].name +
                                  "': all vertex colours have opacity 0; drawn opaque";
      if (std::ranges::find(model_.warnings, warning) == model_.warnings.end())
        model_.warnings.push_back(warning);
    }
    Material& look = model_.materials[material];
    look.vertex_colors = true;
    // Files without materials, such as scans, get a grey material. Its grey would darken the vertex colours.
    if (look.name.empty() || look.name == AI_DEFAULT_MATERIAL_NAME) look.color = Vector4f::Ones();
    look.vertex_alpha |= std::ranges::any_of(out.colors, [](const Vector4f& c) { return c.w() < 1; });
  }

  const aiScene& scene_;
  std::vector<unsigned> uv_sets_;
  bool byte_colors_;
  Model& model_;
  PartBuilder& builder_;
  std::map<unsigned, FileSurface> surfaces_;
};

/// Lists the nodes that have meshes, and adds the meshes of all of them, or of the node `wanted`. The search
/// is depth-first with an explicit stack, because the depth depends on the file.
void place_nodes(const aiScene& scene, const std::string& wanted, AssimpSurfaces& surfaces, Model& model) {
  struct Item {
    const aiNode* node;
    Affine3d world_from_parent;
    int parent;
  };
  NodeNames names;
  std::vector<Item> stack = {{scene.mRootNode, Affine3d(Eigen::Scaling(metres_per_unit(scene))), -1}};
  while (!stack.empty()) {
    Item item = stack.back();
    stack.pop_back();
    if (!item.node) continue;
    const aiNode& node = *item.node;
    const Affine3d world_from_node = item.world_from_parent * to_eigen(node.mTransformation);
    if (node.mNumMeshes > 0) {
      const Affine3d rigid = turned_and_moved(world_from_node);
      const std::string name = node.mName.length > 0 ? node.mName.C_Str() : "node";
      model.nodes.push_back(model_node(names.next(name), item.parent, rigid));
      item.parent = static_cast<int>(model.nodes.size() - 1);
      for (unsigned i = 0; i < node.mNumMeshes; ++i) {
        if (wanted.empty())
          surfaces.add(node.mMeshes[i], world_from_node);
        else if (wanted == model.nodes.back().name)
          surfaces.add(node.mMeshes[i], rigid.inverse() * world_from_node);
      }
    }
    for (unsigned i = node.mNumChildren; i-- > 0;)
      stack.push_back({node.mChildren[i], world_from_node, item.parent});
  }
}

std::string reason(const Assimp::Importer& importer) {
  const std::string error = one_line(importer.GetErrorString());
  if (error == "std::bad_alloc") throw std::bad_alloc();
  if (error.starts_with("No suitable reader")) return "its format is not supported";
  return error.empty() ? "no reason given" : error;
}

/// Returns one message for each kind of content that is ignored, such as animations.
std::vector<std::string> ignored_by_assimp(const aiScene& scene) {
  std::vector<std::string> lines;
  const auto add = [&lines](std::size_t count, const char* what) {
    if (count > 0) lines.push_back(std::to_string(count) + what);
  };
  const std::span<aiMesh* const> meshes(scene.mMeshes, scene.mNumMeshes);
  add(scene.mNumAnimations, " animations are ignored: only animations of glTF 2.0 files are played");
  add(static_cast<std::size_t>(
          std::ranges::count_if(meshes, [](const aiMesh* m) { return m->mNumBones > 0; })),
      " mesh(es) with bones: the bones are ignored, and the meshes have the pose that the file stores");
  add(static_cast<std::size_t>(
          std::ranges::count_if(meshes, [](const aiMesh* m) { return m->mNumAnimMeshes > 0; })),
      " meshes have morph targets, which are ignored");
  add(scene.mNumCameras, " cameras are ignored: only cameras of glTF 2.0 files can be used");
  add(scene.mNumLights, " lights are ignored: only lights of glTF 2.0 files can be used");
  return lines;
}

/// Divides the polygons with more than four corners into triangles, if cut_polygon() can.
void cut_polygons(aiMesh& mesh) {
  const std::span faces(mesh.mFaces, mesh.mNumFaces);
  if (std::ranges::all_of(faces, [](const aiFace& face) { return face.mNumIndices < 5; })) return;
  std::vector<std::vector<unsigned>> cut;
  for (const aiFace& face : faces) {
    const std::span corners(face.mIndices, face.mNumIndices);
    std::vector<uint32_t> triangles;
    const bool is_valid = std::ranges::all_of(corners, [&](unsigned v) { return v < mesh.mNumVertices; });
    if (corners.size() > 4 && is_valid) {
      std::vector<Vector3d> points;
      for (const unsigned v : corners)
        points.emplace_back(mesh.mVertices[v].x, mesh.mVertices[v].y, mesh.mVertices[v].z);
      triangles = cut_polygon(points);
    }
    if (triangles.empty()) cut.emplace_back(corners.begin(), corners.end());
    for (std::size_t i = 0; i < triangles.size(); i += 3)
      cut.push_back({corners[triangles[i]], corners[triangles[i + 1]], corners[triangles[i + 2]]});
  }
  delete[] mesh.mFaces;
  mesh.mFaces = new aiFace[cut.size()];
  mesh.mNumFaces = static_cast<unsigned>(cut.size());
  for (std::size_t f = 0; f < cut.size(); ++f) {
    aiFace& face = mesh.mFaces[f];
    face.mNumIndices = static_cast<unsigned>(cut[f].size());
    face.mIndices = new unsigned[cut[f].size()];
    std::ranges::copy(cut[f], face.mIndices);
  }
  // assimp aborts the program if the types of a mesh include polygons but the mesh has none.
  mesh.mPrimitiveTypes |= aiPrimitiveType_TRIANGLE;
  if (std::ranges::all_of(cut, [](const auto& face) { return face.size() < 4; }))
    mesh.mPrimitiveTypes &= ~static_cast<unsigned>(aiPrimitiveType_POLYGON);
}

Model import_by_assimp(const std::filesystem::path& path, const std::string& node,
                       const InputFolders& folders) {
  Assimp::Importer importer;
  importer.SetIOHandler(make_model_files(folders).release());  // the importer takes ownership
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS, kIgnored);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_ANIMATIONS, false);
  const aiScene* scene = importer.ReadFile(path.string(), 0);
  Model model;
  if (scene) {
    model.warnings = ignored_by_assimp(*scene);
    for (aiMesh* mesh : std::span(scene->mMeshes, scene->mNumMeshes)) cut_polygons(*mesh);
    scene = importer.ApplyPostProcessing(kSteps);
  }
  if (!scene) throw FileError("cannot be read as a model: " + reason(importer));

  const bool obj = has_ending(path, ".obj");
  std::vector<unsigned> uv_sets = import_materials(
      *scene, path.parent_path(), folders,
      obj ? read_mtl_of(path, folders, model.warnings) : std::map<std::string, MtlMaterial>{}, model);
  model.unit = unit_of(*scene, path);
  model.unit_source = unit_source_of(path);
  if (model.materials.empty()) model.materials.emplace_back();
  PartBuilder builder(model);
  AssimpSurfaces surfaces(*scene, std::move(uv_sets), has_ending(path, ".blend"), model, builder);
  place_nodes(*scene, node, surfaces, model);
  const std::vector<std::string> left_out = builder.left_out();
  model.warnings.insert(model.warnings.end(), left_out.begin(), left_out.end());
  return model;
}

}  // namespace

Model import_model(const std::filesystem::path& path, const std::string& node, const InputFolders& folders,
                   bool with_rig) {
  const auto fail = [&path](const std::string& why) { return FileError(path.string() + ": " + why); };
  Model model;
  try {
    std::optional<Model> gltf = is_gltf(path) ? import_gltf(path, node, folders, with_rig) : std::nullopt;
    model = gltf ? std::move(*gltf) : import_by_assimp(path, node, folders);
  } catch (const FileError& error) {
    throw fail(error.what());
  }
  if (!node.empty() && std::ranges::find(model.nodes, node, &Model::Node::name) == model.nodes.end()) {
    std::string why = "has no node '" + node + "' with triangles; known:";
    for (std::size_t i = 0; i < std::min<std::size_t>(model.nodes.size(), 20); ++i)
      why += " '" + model.nodes[i].name + "'";
    throw fail(why);
  }
  std::erase_if(model.parts, [](const Model::Part& part) { return part.mesh.indices.empty(); });
  if (model.parts.empty()) {
    std::string why = "holds no triangle";
    for (const std::string& line : model.warnings) why += "; " + line;
    throw fail(why);
  }
  return model;
}

}  // namespace offstage::render
