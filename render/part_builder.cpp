#include "render/part_builder.h"

#include <algorithm>

namespace offstage::render {
namespace {

constexpr uint32_t kUnusedVertex = 0xffffffff;

std::vector<Vector3f> moved_positions(const Mesh& mesh, const Eigen::Affine3d& world_from_mesh) {
  std::vector<Vector3f> positions;
  positions.reserve(mesh.positions.size());
  for (const Vector3f& p : mesh.positions)
    positions.push_back((world_from_mesh * p.cast<double>()).cast<float>());
  return positions;
}

/// Returns, for each vertex, the mean normal of the faces around it, weighted by area; zero if there are no
/// faces.
std::vector<Eigen::Vector3d> face_normals(const Mesh& mesh) {
  std::vector<Eigen::Vector3d> sums(mesh.positions.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const uint32_t* t = mesh.indices.data() + i;
    if (std::max({t[0], t[1], t[2]}) >= sums.size()) continue;
    const Eigen::Vector3d a = mesh.positions[t[0]].cast<double>();
    const Eigen::Vector3d area =
        (mesh.positions[t[1]].cast<double>() - a).cross(mesh.positions[t[2]].cast<double>() - a);
    if (!area.allFinite()) continue;
    for (int k = 0; k < 3; ++k) sums[t[k]] += area;
  }
  return sums;
}

/// Returns the transformed normals; empty if the mesh has none. A normal without a direction is replaced by
/// the mean normal of the faces around its vertex, and counted in `replaced`.
std::vector<Vector3f> moved_normals(const Mesh& mesh, const Eigen::Affine3d& world_from_mesh,
                                    std::size_t& replaced) {
  if (mesh.normals.empty() || mesh.normals.size() != mesh.positions.size()) return {};
  const Eigen::Matrix3d linear = world_from_mesh.linear();
  // The cofactor matrix is the inverse transpose times the determinant. For mirrored nodes the determinant is
  // negative, which the sign compensates.
  Eigen::Matrix3d cofactor;
  cofactor << linear.col(1).cross(linear.col(2)), linear.col(2).cross(linear.col(0)),
      linear.col(0).cross(linear.col(1));
  if (linear.determinant() < 0) cofactor = -cofactor;
  std::vector<Vector3f> normals;
  normals.reserve(mesh.normals.size());
  const auto is_direction = [](const Eigen::Vector3d& v) { return v.norm() > 0 && std::isfinite(v.norm()); };
  std::vector<Eigen::Vector3d> faces;
  for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
    Eigen::Vector3d normal = cofactor * mesh.normals[i].cast<double>();
    if (!is_direction(normal)) {
      if (faces.empty()) faces = face_normals(mesh);
      ++replaced;
      normal = cofactor * faces[i];
      if (!is_direction(normal)) normal = Eigen::Vector3d::UnitY();  // no face with an area uses the vertex
    }
    normals.push_back(normal.normalized().cast<float>());
  }
  return normals;
}

/// Transforms a tangent. A mirroring transform reverses the side to which v increases.
Vector4f moved_tangent(const Vector4f& tangent, const Eigen::Affine3d& world_from_mesh, bool mirrored) {
  const Eigen::Vector3d t = world_from_mesh.linear() * tangent.head<3>().cast<double>();
  const double length = t.norm();
  if (!(length > 0) || !std::isfinite(length)) return {0, 0, 0, 1};  // the shader derives the tangent
  Vector4f result;
  result << (t / length).cast<float>(), (tangent.w() < 0) != mirrored ? -1.0f : 1.0f;
  return result;
}

bool has_area(const Vector3f& a, const Vector3f& b, const Vector3f& c) {
  const Eigen::Vector3d ab = (b - a).cast<double>(), ac = (c - a).cast<double>();
  return ab.cross(ac).norm() > 1e-10 * std::max(ab.squaredNorm(), ac.squaredNorm());
}

Vector2f finite_uv(const Vector2f& uv) {
  return uv.allFinite() ? uv : Vector2f(0, 0);
}

/// Colours above 1 are kept, because they make a surface brighter.
Vector4f finite_color(const Vector4f& color) {
  constexpr float kBrightest = 1e4f;
  return color.allFinite() ? Vector4f(color.cwiseMax(0).cwiseMin(kBrightest)) : Vector4f(1, 1, 1, 1);
}

}  // namespace

std::vector<std::string> PartBuilder::left_out() const {
  std::vector<std::string> lines;
  const auto add = [&lines](std::size_t count, const char* what) {
    if (count > 0) lines.push_back(std::to_string(count) + what);
  };
  add(points_, " points left out: only triangles are drawn");
  add(lines_, " lines left out: only triangles are drawn");
  add(bad_index_, " faces left out: their indices are out of range");
  add(not_finite_, " faces left out: a vertex is not finite");
  add(no_area_, " faces left out: they have no area");
  add(bad_normals_, " normals have no direction; they are replaced by the mean normal of their faces");
  return lines;
}

void PartBuilder::add(const FileSurface& surface, const Eigen::Affine3d& world_from_mesh) {
  const Mesh& mesh = surface.mesh;
  const std::vector<Vector3f> positions = moved_positions(mesh, world_from_mesh);
  const std::vector<Vector3f> normals = moved_normals(mesh, world_from_mesh, bad_normals_);

  Mesh& out = part(surface, !normals.empty());
  const bool mirrored = world_from_mesh.linear().determinant() < 0;
  std::vector<uint32_t> new_index(mesh.positions.size(), kUnusedVertex);
  const auto use = [&](uint32_t v) {
    if (new_index[v] == kUnusedVertex) {
      new_index[v] = static_cast<uint32_t>(out.positions.size());
      out.positions.push_back(positions[v]);
      if (!normals.empty()) out.normals.push_back(normals[v]);
      if (!mesh.uvs.empty()) out.uvs.push_back(finite_uv(mesh.uvs[v]));
      if (!mesh.second_uvs.empty()) out.second_uvs.push_back(finite_uv(mesh.second_uvs[v]));
      if (!mesh.colors.empty()) out.colors.push_back(finite_color(mesh.colors[v]));
      if (!mesh.tangents.empty())
        out.tangents.push_back(moved_tangent(mesh.tangents[v], world_from_mesh, mirrored));
    }
    out.indices.push_back(new_index[v]);
  };
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const uint32_t* corners = mesh.indices.data() + i;
    if (!accept(corners, positions)) continue;
    use(corners[0]);
    use(corners[mirrored ? 2 : 1]);
    use(corners[mirrored ? 1 : 2]);
  }
}

Mesh& PartBuilder::part(const FileSurface& surface, bool normals) {
  const Mesh& mesh = surface.mesh;
  const auto [entry, is_new] =
      parts_.try_emplace({surface.material, normals, !mesh.uvs.empty(), !mesh.second_uvs.empty(),
                          !mesh.colors.empty(), !mesh.tangents.empty()},
                         model_.parts.size());
  if (is_new) model_.parts.push_back({{}, surface.material});
  return model_.parts[entry->second].mesh;
}

bool PartBuilder::accept(const uint32_t* corners, const std::vector<Vector3f>& positions) {
  if (std::max({corners[0], corners[1], corners[2]}) >= positions.size()) {
    ++bad_index_;
    return false;
  }
  const Vector3f &a = positions[corners[0]], &b = positions[corners[1]], &c = positions[corners[2]];
  if (!a.allFinite() || !b.allFinite() || !c.allFinite()) {
    ++not_finite_;
    return false;
  }
  if (!has_area(a, b, c)) {
    ++no_area_;
    return false;
  }
  return true;
}

std::string NodeNames::next(const std::string& name) {
  std::string unique = name;
  for (int& count = counts_[name]; !taken_.insert(unique).second;)
    unique = name + "_" + std::to_string(++count + 1);
  return unique;
}

Eigen::Affine3d turned_and_moved(const Eigen::Affine3d& m) {
  const Eigen::Matrix3d rotation = m.rotation();
  if (!rotation.allFinite() || !m.translation().cast<float>().allFinite()) return Eigen::Affine3d::Identity();
  return Eigen::Translation3d(m.translation()) * rotation;
}

Model::Node model_node(std::string name, int parent, const Eigen::Affine3d& rigid) {
  return {std::move(name), parent, rigid.translation().cast<float>(),
          Eigen::Quaternionf(rigid.linear().cast<float>()).normalized()};
}

}  // namespace offstage::render
