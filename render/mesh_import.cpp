#include "render/mesh_import.h"

#include <algorithm>
#include <map>
#include <set>
#include <tuple>

#include <assimp/Importer.hpp>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include "render/error.h"
#include "render/file_io.h"
#include "render/model_files.h"

namespace offstage::render {
namespace {

using Eigen::Affine3d;
using Eigen::Vector3d;

constexpr uint32_t kUnused = 0xffffffff;

constexpr unsigned kSteps = aiProcess_Triangulate | aiProcess_RemoveComponent | aiProcess_GenUVCoords |
                            aiProcess_TransformUVCoords | aiProcess_JoinIdenticalVertices;
constexpr int kIgnored = aiComponent_ANIMATIONS | aiComponent_BONEWEIGHTS | aiComponent_LIGHTS |
                         aiComponent_CAMERAS | aiComponent_TANGENTS_AND_BITANGENTS | aiComponent_COLORS;

/// Omitted elements, counted over the whole file.
struct Dropped {
  std::size_t no_triangle = 0, bad_index = 0, not_finite = 0, no_area = 0, bad_normals = 0;

  std::vector<std::string> describe() const {
    std::vector<std::string> lines;
    const auto add = [&lines](std::size_t count, const char* what) {
      if (count > 0) lines.push_back(std::to_string(count) + what);
    };
    add(no_triangle, " points or lines left out");
    add(bad_index, " faces left out: their indices are out of range");
    add(not_finite, " faces left out: a vertex is not finite");
    add(no_area, " faces left out: they have no area");
    add(bad_normals, " meshes have unusable normals, replaced");
    return lines;
  }
};

Vector3d to_eigen(const aiVector3D& v) {
  return {v.x, v.y, v.z};
}

Affine3d to_eigen(const aiMatrix4x4& m) {
  Affine3d result;
  result.matrix() << m.a1, m.a2, m.a3, m.a4, m.b1, m.b2, m.b3, m.b4, m.c1, m.c2, m.c3, m.c4, 0, 0, 0, 1;
  return result;
}

/// FBX has a unit, in centimetres; the readers of other formats convert to metres, or the formats have no
/// unit.
double metres_per_unit(const aiScene& scene) {
  double centimetres = 100;
  float single = 0;
  if (scene.mMetaData && !scene.mMetaData->Get("UnitScaleFactor", centimetres) &&
      scene.mMetaData->Get("UnitScaleFactor", single)) {
    centimetres = single;
  }
  return centimetres > 1e-6 && centimetres < 1e6 ? centimetres / 100 : 1;
}

std::vector<Vector3f> transformed_positions(const aiMesh& mesh, const Affine3d& world_from_mesh) {
  std::vector<Vector3f> positions(mesh.mNumVertices);
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    positions[i] = (world_from_mesh * to_eigen(mesh.mVertices[i])).cast<float>();
  }
  return positions;
}

/// Transformed normals; empty if the mesh has none, or an invalid one.
std::vector<Vector3f> transformed_normals(const aiMesh& mesh, const Affine3d& world_from_mesh) {
  if (!mesh.HasNormals()) return {};
  const Eigen::Matrix3d linear = world_from_mesh.linear();
  const double determinant = linear.determinant();
  // The cofactor matrix is the inverse transpose times the determinant; the sign compensates that of the
  // determinant for mirrored nodes.
  Eigen::Matrix3d cofactor;
  cofactor << linear.col(1).cross(linear.col(2)), linear.col(2).cross(linear.col(0)),
      linear.col(0).cross(linear.col(1));
  if (determinant < 0) cofactor = -cofactor;
  std::vector<Vector3f> normals(mesh.mNumVertices);
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    const Vector3d normal = cofactor * to_eigen(mesh.mNormals[i]);
    const double length = normal.norm();
    if (!(length > 0) || !std::isfinite(length)) return {};
    normals[i] = (normal / length).cast<float>();
  }
  return normals;
}

bool has_area(const Vector3f& a, const Vector3f& b, const Vector3f& c) {
  const Vector3d ab = (b - a).cast<double>(), ac = (c - a).cast<double>();
  return ab.cross(ac).norm() > 1e-10 * std::max(ab.squaredNorm(), ac.squaredNorm());
}

/// Collects the meshes of the scene, transformed by their nodes, in one part per material and kind of vertex.
class PartBuilder {
 public:
  PartBuilder(const aiScene& scene, std::vector<unsigned> uv_sets, Model& model)
      : scene_(scene), uv_sets_(std::move(uv_sets)), model_(model) {}

  void add(unsigned mesh_index, const Affine3d& world_from_mesh) {
    if (mesh_index >= scene_.mNumMeshes) return;
    const aiMesh& mesh = *scene_.mMeshes[mesh_index];
    const std::size_t material = std::min<std::size_t>(mesh.mMaterialIndex, model_.materials.size() - 1);
    const unsigned uv_set =
        material < uv_sets_.size() && mesh.HasTextureCoords(uv_sets_[material]) ? uv_sets_[material] : 0;
    const aiVector3D* uvs = mesh.HasTextureCoords(uv_set) ? mesh.mTextureCoords[uv_set] : nullptr;

    const std::vector<Vector3f> positions = transformed_positions(mesh, world_from_mesh);
    const std::vector<Vector3f> normals = transformed_normals(mesh, world_from_mesh);
    if (mesh.HasNormals() && normals.empty()) ++dropped_.bad_normals;

    Mesh& out = part(static_cast<int>(material), !normals.empty(), uvs != nullptr);
    std::vector<uint32_t> new_index(mesh.mNumVertices, kUnused);
    const auto use = [&](uint32_t v) {
      if (new_index[v] == kUnused) {
        new_index[v] = static_cast<uint32_t>(out.positions.size());
        out.positions.push_back(positions[v]);
        if (!normals.empty()) out.normals.push_back(normals[v]);
        if (uvs) out.uvs.push_back(top_down(uvs[v]));
      }
      out.indices.push_back(new_index[v]);
    };
    const bool mirrored = world_from_mesh.linear().determinant() < 0;
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (!accept(face, positions)) continue;
      use(face.mIndices[0]);
      use(face.mIndices[mirrored ? 2 : 1]);
      use(face.mIndices[mirrored ? 1 : 2]);
    }
  }

  const Dropped& dropped() const { return dropped_; }

 private:
  Mesh& part(int material, bool normals, bool uvs) {
    const auto [entry, is_new] = parts_.try_emplace({material, normals, uvs}, model_.parts.size());
    if (is_new) model_.parts.push_back({{}, material});
    return model_.parts[entry->second].mesh;
  }

  bool accept(const aiFace& face, const std::vector<Vector3f>& positions) {
    if (face.mNumIndices != 3) {
      ++dropped_.no_triangle;
      return false;
    }
    const unsigned* v = face.mIndices;
    if (std::max({v[0], v[1], v[2]}) >= positions.size()) {
      ++dropped_.bad_index;
      return false;
    }
    const Vector3f &a = positions[v[0]], &b = positions[v[1]], &c = positions[v[2]];
    if (!a.allFinite() || !b.allFinite() || !c.allFinite()) {
      ++dropped_.not_finite;
      return false;
    }
    if (!has_area(a, b, c)) {
      ++dropped_.no_area;
      return false;
    }
    return true;
  }

  /// assimp's v increases upwards for every format.
  static Vector2f top_down(const aiVector3D& uv) {
    const Vector2f result(static_cast<float>(uv.x), 1 - static_cast<float>(uv.y));
    return result.allFinite() ? result : Vector2f(0, 0);
  }

  const aiScene& scene_;
  std::vector<unsigned> uv_sets_;
  Model& model_;
  std::map<std::tuple<int, bool, bool>, std::size_t> parts_;
  Dropped dropped_;
};

/// Makes the names of nodes unique.
class NodeNames {
 public:
  std::string next(const aiNode& node) {
    const std::string name = node.mName.length > 0 ? node.mName.C_Str() : "node";
    std::string unique = name;
    for (int& count = counts_[name]; !taken_.insert(unique).second;)
      unique = name + "_" + std::to_string(++count + 1);
    return unique;
  }

 private:
  std::map<std::string, int> counts_;
  std::set<std::string> taken_;
};

/// Rotation and translation without the scale, which is applied to the triangles. For a node that is flat or
/// mirrored, the nearest rotation.
Affine3d turned_and_moved(const Affine3d& m) {
  const Eigen::Matrix3d rotation = m.rotation();
  if (!rotation.allFinite() || !m.translation().allFinite()) return Affine3d::Identity();
  return Eigen::Translation3d(m.translation()) * rotation;
}

/// Lists the nodes that have meshes, and adds the meshes of all of them, or of the node `wanted`. Depth first
/// with an explicit stack, because the depth depends on the file.
void place_nodes(const aiScene& scene, const std::string& wanted, PartBuilder& builder, Model& model) {
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
      model.nodes.push_back({names.next(node), item.parent, rigid.translation().cast<float>(),
                             Eigen::Quaternionf(rigid.linear().cast<float>()).normalized()});
      item.parent = static_cast<int>(model.nodes.size() - 1);
      for (unsigned i = 0; i < node.mNumMeshes; ++i) {
        if (wanted.empty())
          builder.add(node.mMeshes[i], world_from_node);
        else if (wanted == model.nodes.back().name)
          builder.add(node.mMeshes[i], rigid.inverse() * world_from_node);
      }
    }
    for (unsigned i = node.mNumChildren; i-- > 0;)
      stack.push_back({node.mChildren[i], world_from_node, item.parent});
  }
}

std::string reason(const Assimp::Importer& importer) {
  const std::string error = one_line(importer.GetErrorString());
  if (error == "std::bad_alloc") throw std::bad_alloc();
  if (error.starts_with("No suitable reader")) return "it is in no format known here";
  return error.empty() ? "no reason given" : error;
}

}  // namespace

Model import_model(const std::filesystem::path& path, const std::string& node, const InputFolders& folders) {
  Assimp::Importer importer;
  importer.SetIOHandler(make_model_files(folders).release());  // the importer takes ownership
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS, kIgnored);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_NO_SKELETON_MESHES, true);
  importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_READ_ANIMATIONS, false);
  const aiScene* scene = importer.ReadFile(path.string(), kSteps);
  if (!scene) throw FileError(path.string() + ": cannot be read as a model: " + reason(importer));

  Model model;
  std::vector<unsigned> uv_sets = import_materials(*scene, path.parent_path(), folders, model);
  if (model.materials.empty()) model.materials.emplace_back();
  PartBuilder builder(*scene, std::move(uv_sets), model);
  place_nodes(*scene, node, builder, model);
  if (!node.empty() && std::ranges::find(model.nodes, node, &Model::Node::name) == model.nodes.end()) {
    std::string why = path.string() + ": has no node '" + node + "' with triangles; known:";
    for (std::size_t i = 0; i < std::min<std::size_t>(model.nodes.size(), 20); ++i)
      why += " '" + model.nodes[i].name + "'";
    throw FileError(why);
  }
  std::erase_if(model.parts, [](const Model::Part& part) { return part.mesh.indices.empty(); });

  const std::vector<std::string> dropped = builder.dropped().describe();
  if (model.parts.empty()) {
    std::string why = path.string() + ": holds no triangle";
    for (const std::string& line : dropped) why += "; " + line;
    throw FileError(why);
  }
  model.warnings.insert(model.warnings.end(), dropped.begin(), dropped.end());
  return model;
}

}  // namespace offstage::render
