#include "effects/cloth.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>

namespace offstage::effects {
namespace {

using sim::ClothDef;
using sim::ClothSpring;
using sim::SpringKind;
using sim::Triangle;
using sim::Vec3;

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("cloth: " + what);
}

void check(const char* field, Real value, bool zero_allowed) {
  if (std::isfinite(value) && (value > 0 || (zero_allowed && value == 0))) return;
  refuse(std::string(field) + " is " + std::to_string(value) + ", allowed is a finite number " +
         (zero_allowed ? ">= 0" : "> 0"));
}

void check(const Fabric& f) {
  check("areal_density", f.areal_density, false);
  check("stretch", f.stretch, false);
  check("shear", f.shear, true);
  check("bend", f.bend, true);
  check("damping", f.damping, true);
  check("bend_damping", f.bend_damping, true);
}

ClothDef with_fabric(const Fabric& f) {
  ClothDef def;
  def.thickness = f.thickness;
  def.friction = f.friction;
  def.self_friction = f.self_friction;
  def.max_stretch = f.max_stretch;
  def.max_shear = f.max_shear;
  def.air = {.drag = f.drag, .lift = f.lift};
  if (f.bend_model == BendModel::plate) {
    def.bend = f.bend;
    def.bend_damping = f.bend_damping;
  }
  return def;
}

/// Distributes each triangle's mass equally to its corners.
void spread_mass(ClothDef& def, Real areal_density) {
  def.masses.assign(def.vertices.size(), 0);
  for (const Triangle& t : def.triangles) {
    const Vec3& a = def.vertices[t[0]];
    const Real area = (def.vertices[t[1]] - a).cross(def.vertices[t[2]] - a).norm() / 2;
    for (uint32_t corner : t) def.masses[corner] += areal_density * area / 3;
  }
}

/// Adds a spring with its share of the critical damping of its two points, if it has any stiffness.
void add_spring(ClothDef& def, uint32_t a, uint32_t b, Real stiffness, Real damping, SpringKind kind,
                std::array<uint32_t, 2> counterpart = {}) {
  const auto distance = [&](uint32_t i, uint32_t j) { return (def.vertices[i] - def.vertices[j]).norm(); };
  const Real length = distance(a, b);
  if (!(stiffness > 0) || !(length > 0)) return;
  const Real reduced = def.masses[a] * def.masses[b] / (def.masses[a] + def.masses[b]);
  def.springs.push_back({a, b, length, stiffness, 2 * damping * std::sqrt(stiffness * reduced), kind,
                         counterpart, distance(counterpart[0], counterpart[1])});
}

/// A spring over two cells of length h that bends by an angle theta gets shorter by h theta^2 / 4, so it
/// resists bending only by its compression. Its stiffness is chosen for a strip of width w that is bent to
/// the angle of a fold between cells, theta = 1/2: its energy then is that of the bending moment, B w theta^2
/// / (2 h).
Real bend_stiffness(Real bend, Real w, Real h) {
  constexpr Real kAngle = 0.5;
  return 16 * bend * w / (h * h * h * kAngle * kAngle);
}

}  // namespace

ClothDef grid_cloth(const GridSize& size, const sim::Pose& pose, const Fabric& fabric) {
  check("width", size.width, false);
  check("height", size.height, false);
  if (size.columns < 1 || size.columns > 1000) refuse("columns must be 1 to 1000");
  if (size.rows < 1 || size.rows > 1000) refuse("rows must be 1 to 1000");
  check(fabric);
  ClothDef def = with_fabric(fabric);
  const uint32_t nx = size.columns, nz = size.rows;
  const Real dx = size.width / nx, dz = size.height / nz;
  for (uint32_t r = 0; r <= nz; ++r)
    for (uint32_t c = 0; c <= nx; ++c)
      def.vertices.push_back(pose.point_to_world({c * dx - size.width / 2, 0, r * dz - size.height / 2}));
  const auto at = [&](uint32_t c, uint32_t r) { return grid_vertex(size, c, r); };
  for (uint32_t r = 0; r < nz; ++r)
    for (uint32_t c = 0; c < nx; ++c) {
      const uint32_t a = at(c, r), b = at(c + 1, r), d = at(c, r + 1), e = at(c + 1, r + 1);
      if ((r + c) % 2 == 0)
        def.triangles.insert(def.triangles.end(), {Triangle{a, d, e}, Triangle{a, e, b}});
      else
        def.triangles.insert(def.triangles.end(), {Triangle{a, d, b}, Triangle{b, d, e}});
    }
  spread_mass(def, fabric.areal_density);
  const Real damping = fabric.damping;
  // Along a thread a spring represents the width between its neighbours, at the border half of it.
  const auto width = [](uint32_t k, uint32_t last, Real step) {
    return k == 0 || k == last ? step / 2 : step;
  };
  for (uint32_t r = 0; r <= nz; ++r)
    for (uint32_t c = 0; c <= nx; ++c) {
      const Real wz = width(r, nz, dz), wx = width(c, nx, dx);
      if (c < nx)
        add_spring(def, at(c, r), at(c + 1, r), fabric.stretch * wz / dx, damping, SpringKind::stretch);
      if (r < nz)
        add_spring(def, at(c, r), at(c, r + 1), fabric.stretch * wx / dz, damping, SpringKind::stretch);
      if (fabric.bend_model != BendModel::springs) continue;
      if (c + 2 <= nx)
        add_spring(def, at(c, r), at(c + 2, r), bend_stiffness(fabric.bend, wz, dx), damping,
                   SpringKind::bend);
      if (r + 2 <= nz)
        add_spring(def, at(c, r), at(c, r + 2), bend_stiffness(fabric.bend, wx, dz), damping,
                   SpringKind::bend);
    }
  // A shear of gamma changes the diagonals of a cell by gamma dx dz / |d|. The energy of both springs equals
  // that of the shear modulus over the cell's area.
  // Each of the two is the other's counterpart.
  const Real shear = fabric.shear * (dx * dx + dz * dz) / (2 * dx * dz);
  for (uint32_t r = 0; r < nz; ++r)
    for (uint32_t c = 0; c < nx; ++c) {
      const std::array<uint32_t, 2> one = {at(c, r), at(c + 1, r + 1)}, other = {at(c + 1, r), at(c, r + 1)};
      for (const auto& [own, across] : {std::pair(one, other), std::pair(other, one)})
        add_spring(def, own[0], own[1], shear, damping, SpringKind::shear, across);
    }
  return def;
}

ClothDef mesh_cloth(const sim::TriangleMesh& mesh, const sim::Pose& pose, const Fabric& fabric,
                    bool keep_vertices) {
  check(fabric);
  ClothDef def = with_fabric(fabric);
  sim::TriangleMesh joined = keep_vertices ? mesh : sim::weld(mesh);
  if (joined.triangles.empty()) refuse("the mesh has no face");
  for (const Vec3& v : joined.vertices) def.vertices.push_back(pose.point_to_world(v));
  def.triangles = std::move(joined.triangles);
  spread_mass(def, fabric.areal_density);
  for (std::size_t i = 0; i < def.masses.size(); ++i)
    if (!(def.masses[i] > 0))
      refuse("vertex " + std::to_string(i) + " of the mesh belongs to no face with an area");
  struct Sides {
    Real area = 0;  // total area of the faces at an edge [m^2]
    std::vector<uint32_t> opposite;
  };
  std::map<std::pair<uint32_t, uint32_t>, Sides> edges;
  for (const Triangle& t : def.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3& a = def.vertices[t[0]];
      Sides& sides = edges[std::minmax(t[k], t[(k + 1) % 3])];
      sides.area += (def.vertices[t[1]] - a).cross(def.vertices[t[2]] - a).norm() / 2;
      sides.opposite.push_back(t[(k + 2) % 3]);
    }
  for (const auto& [edge, sides] : edges) {
    // A third of each face belongs to each of its edges, as a strip as long as the edge. For a sheet of
    // equilateral triangles whose edges have the stiffness k, Young's modulus (per width) is 2 k / sqrt(3).
    const Real length = (def.vertices[edge.first] - def.vertices[edge.second]).norm();
    if (!(length > 0)) continue;
    const Real width = 2 * sides.area / (3 * length) * 1.5;
    add_spring(def, edge.first, edge.second, fabric.stretch * width / length, fabric.damping,
               SpringKind::stretch);
    if (fabric.bend_model != BendModel::springs) continue;
    if (sides.opposite.size() != 2 || sides.opposite[0] == sides.opposite[1]) continue;
    const Real across = (def.vertices[sides.opposite[0]] - def.vertices[sides.opposite[1]]).norm();
    if (!(across > 0)) continue;
    add_spring(def, sides.opposite[0], sides.opposite[1], bend_stiffness(fabric.bend, length, across / 2),
               fabric.damping, SpringKind::bend);
  }
  return def;
}

}  // namespace offstage::effects
