#include "render/gltf_geometry.h"

#include <algorithm>

#include "render/error.h"
#include "render/gltf_packed.h"

namespace offstage::render {
namespace {

enum GltfMode { kPoints, kLines, kLineLoop, kLineStrip, kTriangles, kTriangleStrip, kTriangleFan };

template <int N>
std::vector<Eigen::Matrix<float, N, 1>> vectors(const GltfNumbers& numbers) {
  std::vector<Eigen::Matrix<float, N, 1>> result(numbers.count);
  for (std::size_t i = 0; i < numbers.count; ++i)
    result[i] = Eigen::Map<const Eigen::Matrix<float, N, 1>>(numbers.at(i));
  return result;
}

/// Converts strips and fans to triangles with the orientation of section 3.7.2.1.
std::vector<uint32_t> as_triangles(const std::vector<uint32_t>& indices, std::size_t mode) {
  std::vector<uint32_t> result;
  const std::size_t n = indices.size();
  if (mode == kTriangles) return {indices.begin(), indices.begin() + static_cast<std::ptrdiff_t>(n / 3 * 3)};
  for (std::size_t i = 0; i + 2 < n; ++i) {
    const bool odd = mode == kTriangleStrip && i % 2 == 1;
    const std::size_t first = mode == kTriangleFan ? 0 : i;
    const uint32_t corners[] = {indices[first], indices[i + (odd ? 2 : 1)], indices[i + (odd ? 1 : 2)]};
    result.insert(result.end(), std::begin(corners), std::end(corners));
  }
  return result;
}

/// Scales the integers of a normalised accessor to [0, 1] or [-1, 1] (section 3.11).
void normalize(const GltfValue& accessor, std::vector<float>& values) {
  if (!accessor.flag("normalized")) return;
  const std::size_t type = accessor.size("componentType", 0);
  const float largest = type == 5120   ? 127.0f
                        : type == 5121 ? 255.0f
                        : type == 5122 ? 32767.0f
                        : type == 5123 ? 65535.0f
                                       : 1.0f;
  for (float& value : values) value = std::max(value / largest, -1.0f);
}

}  // namespace

/// The source of a primitive's attributes: accessors, and Draco data for some attributes.
struct GltfGeometry::Source {
  const GltfValue& primitive;
  std::optional<DracoMesh> draco;
  std::size_t vertices = 0;

  /// Returns the numbers of an attribute; empty if the primitive does not have it. `width`: expected number
  /// of components; 0 allows any.
  GltfNumbers attribute(GltfFile& file, const std::string& name, int width) const {
    const GltfValue attributes = primitive.child("attributes");
    GltfNumbers result;
    if (draco && draco->attributes.contains(name)) {
      const DracoMesh::Attribute& packed = draco->attributes.at(name);
      if (width > 0 && packed.width != width)
        throw attributes.wrong(name, "has " + std::to_string(packed.width) + " components in its Draco data");
      result = {packed.values.size() / static_cast<std::size_t>(packed.width), packed.width, packed.values};
      const auto accessor = attributes.index(name.c_str(), file.count("accessors"));
      // The flag of the accessor is valid (section 3.6.2.2), because encoders do not always set the flag in
      // the data.
      if (accessor && !packed.normalized) normalize(file.item("accessors", *accessor), result.values);
    } else if (const auto accessor = attributes.index(name.c_str(), file.count("accessors"))) {
      result = file.numbers(*accessor, width);
    }
    if (vertices > 0 && result.count > 0 && result.count != vertices)
      throw attributes.wrong(name, "has " + std::to_string(result.count) + " elements for " +
                                       std::to_string(vertices) + " vertices");
    return result;
  }
};

const GltfPrimitive& GltfGeometry::primitive(std::size_t mesh, std::size_t index) {
  const auto found = primitives_.find({mesh, index});
  if (found != primitives_.end()) return found->second;
  primitives_.clear();  // frees memory: primitives often share one large vertex buffer, and each primitive
                        // has a copy of it
  return primitives_
      .emplace(std::pair(mesh, index), read(file_.item("meshes", mesh).item("primitives", index)))
      .first->second;
}

GltfPrimitive GltfGeometry::read(const GltfValue& primitive) {
  GltfPrimitive result;
  const std::optional<std::size_t> material = primitive.index("material", file_.count("materials"));
  result.surface.material = static_cast<int>(material.value_or(file_.count("materials")));
  Source source{primitive, std::nullopt};
  const GltfValue draco = primitive.extension("KHR_draco_mesh_compression");
  if (draco.exists() && has_draco()) {
    const auto view = draco.index("bufferView", file_.count("bufferViews"));
    if (!view) throw draco.wrong("bufferView", "is missing");
    const GltfValue attributes = draco.child("attributes");
    std::map<std::string, uint32_t> ids;
    if (attributes.exists())
      for (const auto& [name, id] : attributes.json()->items())
        ids[name] = static_cast<uint32_t>(attributes.index(name.c_str(), 0xffffffff).value_or(0));
    source.draco = unpack_draco(file_.view(*view), ids, draco.place());
  }
  read_attributes(source, result);
  read_triangles(source, result);
  if (!result.surface.mesh.indices.empty()) read_joints(source, result);
  mark_colors(result.surface);
  return result;
}

void GltfGeometry::read_attributes(const Source& given, GltfPrimitive& result) {
  Source source = given;
  Mesh& mesh = result.surface.mesh;
  mesh.positions = vectors<3>(source.attribute(file_, "POSITION", 3));
  if (mesh.positions.empty()) {
    file_.warn(source.primitive.place() + " is not drawn: it has no POSITION attribute");
    return;
  }
  source.vertices = mesh.positions.size();
  mesh.normals = vectors<3>(source.attribute(file_, "NORMAL", 3));
  if (!mesh.normals.empty()) mesh.tangents = vectors<4>(source.attribute(file_, "TANGENT", 4));
  const auto material = static_cast<std::size_t>(result.surface.material);
  const auto sets = materials_.uv_sets(material);
  const auto uvs = [&](int set) {
    if (set < 0) return std::vector<Vector2f>{};
    const std::string name = "TEXCOORD_" + std::to_string(set);
    std::vector<Vector2f> found = vectors<2>(source.attribute(file_, name, 2));
    const int which = set == sets[0] ? 0 : 1;
    bool used = false;
    for_each_texture(model_.materials[material],
                     [&](const TextureMap& map) { used |= map.image >= 0 && map.uv_set == which; });
    if (found.empty() && used)
      file_.warn(source.primitive.place() + " has no " + name + " for the textures of its material");
    return found;
  };
  mesh.uvs = uvs(sets[0]);
  mesh.second_uvs = uvs(sets[1]);
  if (source.primitive.child("attributes").has("COLOR_1"))
    file_.warn(source.primitive.place() + ": COLOR_1 is ignored; COLOR_0 colours vertices");
  const GltfNumbers colors = source.attribute(file_, "COLOR_0", 0);
  if (colors.count == 0) return;
  if (colors.width != 3 && colors.width != 4)
    throw FileError(source.primitive.place() + ": COLOR_0 must have 3 or 4 components");
  for (std::size_t i = 0; i < colors.count; ++i) {
    const float* c = colors.at(i);
    mesh.colors.emplace_back(c[0], c[1], c[2], colors.width == 4 ? c[3] : 1.0f);
  }
}

void GltfGeometry::read_triangles(const Source& source, GltfPrimitive& result) {
  Mesh& mesh = result.surface.mesh;
  std::vector<uint32_t> indices;
  if (source.draco) {
    indices = source.draco->indices;
  } else if (const auto accessor = source.primitive.index("indices", file_.count("accessors"))) {
    indices = file_.indices(*accessor);
  } else {
    indices.resize(mesh.positions.size());
    for (std::size_t i = 0; i < indices.size(); ++i) indices[i] = static_cast<uint32_t>(i);
  }
  const std::size_t mode = source.draco ? std::size_t{kTriangles} : source.primitive.size("mode", kTriangles);
  if (mode > kTriangleFan)
    throw source.primitive.wrong("mode", "is " + std::to_string(mode) + "; 0 to 6 are defined");
  const std::size_t n = indices.size();
  if (mode == kPoints)
    result.points = n;
  else if (mode < kTriangles)  // section 3.7.2.1
    result.lines = mode == kLines ? n / 2 : n < 2 ? 0 : mode == kLineLoop ? n : n - 1;
  else
    mesh.indices = as_triangles(indices, mode);
}

void GltfGeometry::read_joints(const Source& source, GltfPrimitive& result) {
  constexpr int kMostSets = 4;
  constexpr uint32_t kNoJoint = 0xffffffff;  // posed() skips indices outside of the skin
  const std::size_t n = result.surface.mesh.positions.size();
  std::vector<GltfNumbers> joints, weights;
  for (int k = 0; k < kMostSets; ++k) {
    const std::string end = "_" + std::to_string(k);
    GltfNumbers joint = source.attribute(file_, "JOINTS" + end, 4),
                weight = source.attribute(file_, "WEIGHTS" + end, 4);
    if (joint.count == 0 && weight.count == 0) break;
    if (joint.count != n || weight.count != n)
      throw FileError(source.primitive.place() + ": JOINTS" + end + " and WEIGHTS" + end +
                      " must have one element for each vertex");
    joints.push_back(std::move(joint));
    weights.push_back(std::move(weight));
  }
  if (source.primitive.child("attributes").has("JOINTS_4"))
    file_.warn(source.primitive.place() + ": only the first sixteen joints of each vertex are used");
  result.influences = 4 * joints.size();
  result.joints.reserve(n * result.influences);
  result.weights.reserve(n * result.influences);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t set = 0; set < joints.size(); ++set)
      for (std::size_t k = 0; k < 4; ++k) {
        const float joint = joints[set].at(i)[k], weight = weights[set].at(i)[k];
        result.joints.push_back(joint >= 0 && joint < 1e6f ? static_cast<uint32_t>(joint) : kNoJoint);
        result.weights.push_back(weight > 0 && weight < 1e6f ? weight : 0);
      }
}

void GltfGeometry::mark_colors(FileSurface& surface) {
  if (surface.mesh.colors.empty()) return;
  Material& look = model_.materials[static_cast<std::size_t>(surface.material)];
  look.vertex_colors = true;
  const bool is_default = static_cast<std::size_t>(surface.material) == file_.count("materials");
  const auto states_look = [&] {
    const GltfValue source = file_.item("materials", static_cast<std::size_t>(surface.material));
    return source.has("pbrMetallicRoughness") || source.has("extensions");
  };
  if (is_default || !states_look()) look.color = Vector4f::Ones();
  const bool blends =
      look.alpha_cutoff == 0 && !is_default &&
      file_.item("materials", static_cast<std::size_t>(surface.material)).text("alphaMode") == "BLEND";
  look.vertex_alpha |=
      blends && std::ranges::any_of(surface.mesh.colors, [](const Vector4f& c) { return c.w() < 1; });
  if (blends || look.alpha_cutoff > 0) return;
  for (Vector4f& color : surface.mesh.colors) color.w() = 1;
}

std::optional<FileSurface> GltfGeometry::morphed(std::size_t mesh, std::size_t index, const GltfValue& node) {
  const GltfValue source = file_.item("meshes", mesh), primitive = source.item("primitives", index);
  const GltfValue& owner = node.count("weights") > 0 ? node : source;
  const std::size_t targets = std::min(primitive.count("targets"), owner.count("weights"));
  std::optional<FileSurface> result;
  for (std::size_t t = 0; t < targets; ++t) {
    const auto weight = static_cast<float>(owner.number_at("weights", t));
    if (weight == 0) continue;
    if (!result) result = this->primitive(mesh, index).surface;
    Mesh& out = result->mesh;
    const GltfValue target = primitive.item("targets", t);
    const auto add = [&](const char* name, auto&& each) {
      const auto accessor = target.index(name, file_.count("accessors"));
      if (!accessor) return;
      const GltfNumbers offsets = file_.numbers(*accessor, 3);
      if (offsets.count != out.positions.size())
        throw target.wrong(name, "must have one element for each vertex");
      for (std::size_t i = 0; i < offsets.count; ++i)
        each(i, Vector3f(weight * Eigen::Map<const Vector3f>(offsets.at(i))));
    };
    add("POSITION", [&](std::size_t i, const Vector3f& d) { out.positions[i] += d; });
    if (!out.normals.empty()) add("NORMAL", [&](std::size_t i, const Vector3f& d) { out.normals[i] += d; });
    if (!out.tangents.empty())
      add("TANGENT", [&](std::size_t i, const Vector3f& d) { out.tangents[i].head<3>() += d; });
    if (target.has("COLOR_0") || target.has("TEXCOORD_0") || target.has("TEXCOORD_1"))
      file_.warn("morph targets of colours and texture coordinates are ignored");
  }
  return result;
}

FileSurface GltfGeometry::posed(const FileSurface& surface, const GltfPrimitive& source,
                                const std::vector<Eigen::Affine3d>& joints) const {
  FileSurface result = surface;
  Mesh& mesh = result.mesh;
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
    double total = 0;
    for (std::size_t k = i * source.influences; k < (i + 1) * source.influences; ++k) {
      if (source.weights[k] == 0 || source.joints[k] >= joints.size()) continue;
      sum += double{source.weights[k]} * joints[source.joints[k]].matrix();
      total += double{source.weights[k]};
    }
    if (!(total > 0)) continue;  // no joint moves this vertex
    Eigen::Affine3d pose;
    pose.matrix() = sum / total;
    mesh.positions[i] = (pose * mesh.positions[i].cast<double>()).cast<float>();
    const Eigen::Matrix3d m = pose.linear();
    const double sign = m.determinant() < 0 ? -1 : 1;
    if (!mesh.normals.empty()) {
      Eigen::Matrix3d cofactor;
      cofactor << m.col(1).cross(m.col(2)), m.col(2).cross(m.col(0)), m.col(0).cross(m.col(1));
      mesh.normals[i] = (sign * (cofactor * mesh.normals[i].cast<double>())).normalized().cast<float>();
    }
    if (!mesh.tangents.empty()) {
      mesh.tangents[i].head<3>() = (m * mesh.tangents[i].head<3>().cast<double>()).cast<float>();
      mesh.tangents[i].w() *= static_cast<float>(sign);
    }
  }
  return result;
}

}  // namespace offstage::render
