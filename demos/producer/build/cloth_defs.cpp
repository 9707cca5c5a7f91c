#include "producer/build/cloth_defs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include "effects/cloth.h"
#include "producer/base/suggest.h"
#include "producer/build/models.h"

namespace offstage::producer {
namespace {

using Eigen::Vector2f;

constexpr std::array kSpringKinds = {"stretch", "shear", "bend", "cord"};

effects::GridSize grid_size(const GridShape& grid) {
  return {.width = grid.size.x(),
          .height = grid.size.y(),
          .columns = static_cast<uint32_t>(grid.cells.x()),
          .rows = static_cast<uint32_t>(grid.cells.y())};
}

const GridShape& grid_of(const Cloth& cloth, const char* what) {
  if (const auto* grid = std::get_if<GridShape>(&cloth.shape)) return *grid;
  throw std::invalid_argument(
      fmt::format("only a grid has {}; for a mesh, select vertices by \"nearest\" or \"box\"", what));
}

std::vector<uint32_t> side_vertices(const GridShape& grid, Side side) {
  const effects::GridSize size = grid_size(grid);
  const bool upright = side == Side::left || side == Side::right;
  const uint32_t last = side == Side::right ? size.columns : side == Side::bottom ? size.rows : 0;
  std::vector<uint32_t> vertices;
  for (uint32_t i = 0; i <= (upright ? size.rows : size.columns); ++i)
    vertices.push_back(upright ? effects::grid_vertex(size, last, i) : effects::grid_vertex(size, i, last));
  return vertices;
}

uint32_t nearest_vertex(const std::vector<Vec3>& places, const Vec3& point) {
  const auto nearer = [&](const Vec3& a, const Vec3& b) {
    return (a - point).squaredNorm() < (b - point).squaredNorm();
  };
  return static_cast<uint32_t>(std::ranges::min_element(places, nearer) - places.begin());
}

/// Returns the coordinates of the places along the two longest axes of their bounding box.
std::vector<Vector2f> projected(const std::vector<Vec3>& places) {
  sim::Aabb box;
  for (const Vec3& p : places) box.extend(p);
  Eigen::Index thin = 0;
  box.sizes().minCoeff(&thin);
  const Eigen::Index u = thin == 0 ? 2 : 0, v = thin == 1 ? 2 : 1;
  std::vector<Vector2f> uvs;
  for (const Vec3& p : places)
    uvs.emplace_back(static_cast<float>(p[u] - box.min()[u]), static_cast<float>(p[v] - box.min()[v]));
  return uvs;
}

/// Returns the texture coordinates of a model [m]. They are scaled so that edges have their actual length on
/// average. Empty if a triangle has no texture coordinates.
std::vector<Vector2f> model_uvs(const render::Model& model, const sim::ClothDef& def) {
  std::vector<Vector2f> corners;
  for (const render::Model::Part& part : model.parts) {
    if (part.mesh.uvs.size() != part.mesh.positions.size()) return {};
    for (const uint32_t index : part.mesh.indices) corners.push_back(part.mesh.uvs[index]);
  }
  if (corners.size() != 3 * def.triangles.size()) return {};  // some triangles were removed by welding
  std::vector<Vector2f> uvs(def.vertices.size(), Vector2f::Zero());
  double in_space = 0, in_plane = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const std::size_t next = i % 3 == 2 ? i - 2 : i + 1;
    const sim::Triangle& t = def.triangles[i / 3];
    in_space += (def.vertices[t[i % 3]] - def.vertices[t[next % 3]]).norm();
    in_plane += static_cast<double>((corners[i] - corners[next]).norm());
    uvs[t[i % 3]] = corners[i];
  }
  if (!(in_plane > 0)) return {};
  for (Vector2f& uv : uvs) uv *= static_cast<float>(in_space / in_plane);
  return uvs;
}

void add_cords(const Cloth& cloth, const sim::Pose& pose, FlatCloth& flat) {
  for (const ClothCord& cord : cloth.cords) {
    const uint32_t vertex = nearest_vertex(flat.places, cord.from);
    flat.cord_ends.push_back(effects::add_cord(flat.def, {.vertex = vertex,
                                                          .end = pose.point_to_world(cord.to),
                                                          .length = cord.length,
                                                          .segments = static_cast<uint32_t>(cord.segments),
                                                          .stiffness = cord.stiffness,
                                                          .mass_per_length = cord.mass_per_length,
                                                          .damping = cord.damping}));
    flat.uvs.resize(flat.def.vertices.size(), flat.uvs[vertex]);
  }
}

}  // namespace

std::vector<uint32_t> FlatCloth::triangles() const {
  std::vector<uint32_t> indices;
  for (const sim::Triangle& t : def.triangles) indices.insert(indices.end(), t.begin(), t.end());
  return indices;
}

std::vector<std::string> fabric_names() {
  std::vector<std::string> names;
  for (const effects::FabricPreset& preset : effects::fabric_presets()) names.push_back(preset.name);
  return names;
}

effects::Fabric fabric_of(const Cloth& cloth) {
  const effects::FabricPreset* preset = effects::find_fabric(cloth.fabric);
  if (!preset)
    throw std::invalid_argument("there is no fabric '" + cloth.fabric + "'" +
                                suggestion(cloth.fabric, fabric_names()));
  effects::Fabric f = preset->fabric;
  const FabricChanges& c = cloth.changes;
  const auto change = [](const std::optional<double>& to, double& value) { value = to.value_or(value); };
  change(c.areal_density, f.areal_density);
  change(c.stretch, f.stretch);
  change(c.shear, f.shear);
  change(c.bend, f.bend);
  change(c.damping, f.damping);
  change(c.friction, f.friction);
  change(c.self_friction, f.self_friction);
  change(c.thickness, f.thickness);
  change(c.drag, f.drag);
  change(c.lift, f.lift);
  change(c.max_stretch, f.max_stretch);
  change(c.max_shear, f.max_shear);
  change(c.bend_damping, f.bend_damping);
  change(c.min_bend_radius, f.min_bend_radius);
  const auto set = [](const std::optional<double>& to, std::optional<double>& value) {
    if (to) value = to;
  };
  set(c.stretch_damping, f.stretch_damping);
  set(c.shear_damping, f.shear_damping);
  set(c.bend_spring_damping, f.bend_spring_damping);
  f.bend_model = c.bend_model.value_or(f.bend_model);
  return f;
}

std::size_t vertex_count(const Cloth& cloth, const render::Model* model) {
  if (const auto* grid = std::get_if<GridShape>(&cloth.shape))
    return static_cast<std::size_t>(grid->cells.x() + 1) * static_cast<std::size_t>(grid->cells.y() + 1);
  if (const auto* sphere = std::get_if<SphereCloth>(&cloth.shape))
    return 10 * (std::size_t{1} << 2 * sphere->divisions) + 2;
  return model->vertex_count();
}

FlatCloth flat_cloth(const Cloth& cloth, const render::Model* model) {
  const effects::Fabric fabric = fabric_of(cloth);
  const sim::Pose pose{cloth.position, cloth.orientation};
  FlatCloth flat;
  const auto* grid = std::get_if<GridShape>(&cloth.shape);
  const std::size_t vertices = vertex_count(cloth, model);
  if (vertices > kMaxClothVertices)
    throw std::invalid_argument(
        fmt::format("has {} vertices; a cloth has at most {}", vertices, kMaxClothVertices));
  if (grid) {
    flat.def = effects::grid_cloth(grid_size(*grid), pose, fabric);
  } else if (const auto* sphere = std::get_if<SphereCloth>(&cloth.shape)) {
    flat.def = effects::sphere_cloth(sphere->radius, static_cast<uint32_t>(sphere->divisions), pose, fabric);
  } else {
    const MeshFile& file = std::get<MeshFile>(cloth.shape);
    flat.def =
        effects::mesh_cloth(collision_mesh(*model, fitted_scale(file.scale, file.fit, *model)), pose, fabric);
  }
  for (const Vec3& v : flat.def.vertices) flat.places.push_back(pose.point_to_body(v));
  if (grid) {
    for (const Vec3& p : flat.places)
      flat.uvs.emplace_back(static_cast<float>(p.x() + 0.5 * grid->size.x()),
                            static_cast<float>(p.z() + 0.5 * grid->size.y()));
  } else {
    if (model) flat.uvs = model_uvs(*model, flat.def);
    if (flat.uvs.empty()) flat.uvs = projected(flat.places);
  }
  add_cords(cloth, pose, flat);
  sim::ClothDef& def = flat.def;
  def.name = cloth.name;
  for (const ClothSeam& seam : cloth.seams)
    for (const sim::ClothSeam& pair : sewn_vertices(seam, cloth, flat)) def.seams.push_back(pair);
  def.seam_time = cloth.seam_time;
  def.velocity = cloth.velocity;
  def.collides = cloth.collides;
  def.self_collision = cloth.self_collision;
  def.tear = cloth.tear;
  def.pressure = cloth.pressure;
  def.inflate_time = cloth.inflate_time;
  def.gas_density = cloth.gas_density;
  def.ram_pressure = cloth.ram_pressure;
  def.air.density = cloth.air_density;
  def.integrator = cloth.integrator;
  def.substep = cloth.substep;
  def.soften = cloth.soften;
  def.appear_at = cloth.appear_at;
  def.remove_at = cloth.remove_at;
  return flat;
}

const PinScope& scope_of(const ClothPin& pin) {
  return std::visit([](const PinScope& scope) -> const PinScope& { return scope; }, pin);
}

std::vector<uint32_t> pinned_vertices(const ClothPin& pin, const Cloth& cloth, const FlatCloth& flat) {
  std::vector<uint32_t> vertices;
  if (const auto* corners = std::get_if<CornerPin>(&pin)) {
    const effects::GridSize size = grid_size(grid_of(cloth, "corners"));
    for (const Corner corner : corners->corners) {
      const bool right = corner == Corner::top_right || corner == Corner::bottom_right;
      const bool bottom = corner == Corner::bottom_left || corner == Corner::bottom_right;
      vertices.push_back(effects::grid_vertex(size, right ? size.columns : 0, bottom ? size.rows : 0));
    }
  } else if (const auto* side = std::get_if<SidePin>(&pin)) {
    const std::vector<uint32_t> all = side_vertices(grid_of(cloth, "sides"), side->side);
    for (std::size_t i = 0; i < all.size(); i += static_cast<std::size_t>(side->every))
      vertices.push_back(all[i]);
  } else if (const auto* nearest = std::get_if<NearestPin>(&pin)) {
    vertices.push_back(nearest_vertex(flat.places, nearest->point));
  } else {
    const auto& box = std::get<BoxPin>(pin);
    for (uint32_t i = 0; i < flat.places.size(); ++i)
      if (((flat.places[i] - box.centre).cwiseAbs().array() <= 0.5 * box.size.array()).all())
        vertices.push_back(i);
  }
  return vertices;
}

std::vector<sim::ClothSeam> sewn_vertices(const ClothSeam& seam, const Cloth& cloth, const FlatCloth& flat) {
  if (const auto* points = std::get_if<PointSeam>(&seam)) {
    const uint32_t a = nearest_vertex(flat.places, points->a), b = nearest_vertex(flat.places, points->b);
    if (a == b)
      throw std::invalid_argument("joins a vertex to itself: both points have the same nearest vertex");
    return {{a, b}};
  }
  const auto& sides = std::get<SideSeam>(seam);
  const GridShape& grid = grid_of(cloth, "sides");
  const std::vector<uint32_t> a = side_vertices(grid, sides.a);
  std::vector<uint32_t> b = side_vertices(grid, sides.b);
  if (a.size() != b.size())
    throw std::invalid_argument(fmt::format(
        "joins a side of {} vertices to a side of {}; the numbers must be equal", a.size(), b.size()));
  if (sides.reversed) std::ranges::reverse(b);
  std::vector<sim::ClothSeam> pairs;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (a[i] != b[i]) pairs.push_back({a[i], b[i]});
  return pairs;
}

render::Material fabric_look(const std::string& fabric) {
  using enum render::Weave;
  render::Material m{.name = fabric, .color = {0.72f, 0.70f, 0.65f, 1}, .roughness = 0.9f};
  m.fabric = {.weave = plain, .thread = 0.0008f, .relief = 0.5f, .sheen = 0.2f, .translucency = 0.2f};
  if (fabric == "silk") {
    m.color = {0.62f, 0.47f, 0.30f, 1};
    m.roughness = 0.36f;
    m.fabric = {.weave = satin, .thread = 0.0003f, .relief = 0.2f, .sheen = 0.1f, .translucency = 0.3f};
  } else if (fabric == "denim") {
    m.color = {0.035f, 0.075f, 0.20f, 1};
    m.fabric = {.weave = twill,
                .thread = 0.0012f,
                .relief = 0.7f,
                .sheen = 0.15f,
                .translucency = 0.02f,
                .back_color = Eigen::Vector3f(0.30f, 0.36f, 0.48f)};
  } else if (fabric == "leather") {
    m.color = {0.16f, 0.07f, 0.03f, 1};
    m.roughness = 0.45f;
    m.fabric = {
        .weave = none, .sheen = 0, .translucency = 0, .back_color = Eigen::Vector3f(0.30f, 0.20f, 0.13f)};
  } else if (fabric == "rubber") {
    m.color = {0.035f, 0.035f, 0.04f, 1};
    m.roughness = 0.38f;
    m.fabric = {.weave = none, .sheen = 0, .translucency = 0};
  } else if (fabric == "balloon") {
    m.color = {0.62f, 0.03f, 0.04f, 1};
    m.roughness = 0.18f;
    m.fabric = {.weave = none, .sheen = 0, .translucency = 0.25f};
  }
  return m;
}

std::string selects_nothing(const FlatCloth& flat) {
  sim::Aabb box;
  for (const Vec3& p : flat.places) box.extend(p);
  const auto &a = box.min(), &b = box.max();
  return fmt::format(
      "the pin selects no vertex; in its own frame the cloth extends from ({:g}, {:g}, {:g}) to ({:g}, {:g}, "
      "{:g})",
      a.x(), a.y(), a.z(), b.x(), b.y(), b.z());
}

std::optional<std::string> instability_of(const Scene& scene, const sim::ClothDef& cloth) {
  const sim::StableStep stable = sim::largest_stable_step(cloth);
  const Real used = std::min({cloth.substep, scene.world.max_step, scene.output.fps.seconds(1)});
  if (used < stable.step) return {};
  if (stable.bending)
    return fmt::format(
        "its bending is too stiff for an explicit integrator: it needs a substep less than {:.3g} s, got "
        "{:.3g} s; or use \"relaxed\" or \"implicit\"",
        0.995 * stable.step, used);
  const sim::ClothSpring& spring = cloth.springs[stable.spring];
  return fmt::format(
      "its springs are too stiff for an explicit integrator: the {} spring between vertices {} and {} "
      "({:.3g} "
      "N/m) needs a substep less than {:.3g} s, got {:.3g} s; or use \"relaxed\" or \"implicit\"",
      kSpringKinds.at(static_cast<std::size_t>(spring.kind)), spring.a, spring.b, spring.stiffness,
      0.995 * stable.step, used);
}

}  // namespace offstage::producer
