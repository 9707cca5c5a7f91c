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
  check("stretch_damping", f.stretch_damping.value_or(0), true);
  check("shear_damping", f.shear_damping.value_or(0), true);
  check("bend_spring_damping", f.bend_spring_damping.value_or(0), true);
  check("bend_damping", f.bend_damping, true);
  check("min_bend_radius", f.min_bend_radius, true);
}

ClothDef with_fabric(const Fabric& f) {
  ClothDef def;
  def.thickness = f.thickness;
  def.friction = f.friction;
  def.self_friction = f.self_friction;
  def.max_stretch = f.max_stretch;
  def.max_shear = f.max_shear;
  def.min_bend_radius = f.min_bend_radius;
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

/// Returns the damping of springs of a kind, as a fraction of the critical damping.
Real damping_of(const Fabric& f, SpringKind kind) {
  const std::optional<Real>& own = kind == SpringKind::stretch ? f.stretch_damping
                                   : kind == SpringKind::shear ? f.shear_damping
                                                               : f.bend_spring_damping;
  return own.value_or(f.damping);
}

/// Adds a spring if its stiffness is not 0. Its damping is a fraction of the critical damping for the masses
/// of its two points.
void add_spring(ClothDef& def, uint32_t a, uint32_t b, Real stiffness, const Fabric& fabric, SpringKind kind,
                std::array<uint32_t, 2> counterpart = {}) {
  const auto distance = [&](uint32_t i, uint32_t j) { return (def.vertices[i] - def.vertices[j]).norm(); };
  const Real length = distance(a, b);
  if (!(stiffness > 0) || !(length > 0)) return;
  const Real reduced = def.masses[a] * def.masses[b] / (def.masses[a] + def.masses[b]);
  const Real damping = 2 * damping_of(fabric, kind) * std::sqrt(stiffness * reduced);
  def.springs.push_back(
      {a, b, length, stiffness, damping, kind, counterpart, distance(counterpart[0], counterpart[1])});
}

/// Returns the stiffness of a spring that resists bending over two cells of length h. If the cloth bends by
/// an angle theta, the spring gets shorter by h theta^2 / 4, and resists bending only by its compression. The
/// stiffness is chosen for a strip of width w and the angle theta = 1/2 of a fold between cells: the energy
/// then equals the energy of the bending moment, B w theta^2 / (2 h).
Real bend_stiffness(Real bend, Real w, Real h) {
  constexpr Real kAngle = 0.5;
  return 16 * bend * w / (h * h * h * kAngle * kAngle);
}

/// Returns an icosahedron inscribed in a sphere with radius 1.
sim::TriangleMesh icosahedron() {
  // Corners of three rectangles whose sides are in the golden ratio.
  const Real golden = (1 + std::sqrt(5.0)) / 2, size = std::sqrt(1 + golden * golden);
  sim::TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (int k = 0; k < 4; ++k) {
      Vec3 v = Vec3::Zero();
      v[axis] = k & 1 ? golden : -golden;
      v[(axis + 1) % 3] = k & 2 ? 1 : -1;
      mesh.vertices.push_back(v / size);
    }
  const Real edge = 2 / size;
  const auto joined = [&](uint32_t a, uint32_t b) {
    return (mesh.vertices[a] - mesh.vertices[b]).norm() < 1.01 * edge;
  };
  for (uint32_t a = 0; a < 12; ++a)
    for (uint32_t b = a + 1; b < 12; ++b)
      for (uint32_t c = b + 1; c < 12; ++c) {
        if (!joined(a, b) || !joined(b, c) || !joined(c, a)) continue;
        const auto &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
        const bool outwards = (q - p).cross(r - p).dot(p) > 0;
        mesh.triangles.push_back(outwards ? Triangle{a, b, c} : Triangle{a, c, b});
      }
  return mesh;
}

/// Divides each triangle into four; the new vertices are on the sphere with radius 1.
sim::TriangleMesh divided(const sim::TriangleMesh& mesh) {
  sim::TriangleMesh finer{mesh.vertices, {}};
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> middles;
  const auto middle = [&](uint32_t a, uint32_t b) {
    const auto [at, is_new] =
        middles.try_emplace(std::minmax(a, b), static_cast<uint32_t>(finer.vertices.size()));
    if (is_new) finer.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]).normalized());
    return at->second;
  };
  for (const Triangle& t : mesh.triangles) {
    const uint32_t ab = middle(t[0], t[1]), bc = middle(t[1], t[2]), ca = middle(t[2], t[0]);
    finer.triangles.insert(finer.triangles.end(), {Triangle{t[0], ab, ca}, Triangle{ab, t[1], bc},
                                                   Triangle{ca, bc, t[2]}, Triangle{ab, bc, ca}});
  }
  return finer;
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
  // A spring along a thread represents a strip that is as wide as the distance between threads. At the border
  // the strip is half as wide.
  const auto width = [](uint32_t k, uint32_t last, Real step) {
    return k == 0 || k == last ? step / 2 : step;
  };
  for (uint32_t r = 0; r <= nz; ++r)
    for (uint32_t c = 0; c <= nx; ++c) {
      const Real wz = width(r, nz, dz), wx = width(c, nx, dx);
      if (c < nx)
        add_spring(def, at(c, r), at(c + 1, r), fabric.stretch * wz / dx, fabric, SpringKind::stretch);
      if (r < nz)
        add_spring(def, at(c, r), at(c, r + 1), fabric.stretch * wx / dz, fabric, SpringKind::stretch);
      if (fabric.bend_model != BendModel::springs) continue;
      if (c + 2 <= nx)
        add_spring(def, at(c, r), at(c + 2, r), bend_stiffness(fabric.bend, wz, dx), fabric,
                   SpringKind::bend);
      if (r + 2 <= nz)
        add_spring(def, at(c, r), at(c, r + 2), bend_stiffness(fabric.bend, wx, dz), fabric,
                   SpringKind::bend);
    }
  // A shear of gamma changes the diagonals of a cell by gamma dx dz / |d|. The energy of both springs
  // together equals the energy by the shear modulus over the cell's area. The two diagonals of a cell are
  // counterparts (ClothSpring).
  const Real shear = fabric.shear * (dx * dx + dz * dz) / (2 * dx * dz);
  for (uint32_t r = 0; r < nz; ++r)
    for (uint32_t c = 0; c < nx; ++c) {
      const std::array<uint32_t, 2> one = {at(c, r), at(c + 1, r + 1)}, other = {at(c + 1, r), at(c, r + 1)};
      for (const auto& [own, across] : {std::pair(one, other), std::pair(other, one)})
        add_spring(def, own[0], own[1], shear, fabric, SpringKind::shear, across);
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
    add_spring(def, edge.first, edge.second, fabric.stretch * width / length, fabric, SpringKind::stretch);
    if (fabric.bend_model != BendModel::springs) continue;
    if (sides.opposite.size() != 2 || sides.opposite[0] == sides.opposite[1]) continue;
    const Real across = (def.vertices[sides.opposite[0]] - def.vertices[sides.opposite[1]]).norm();
    if (!(across > 0)) continue;
    add_spring(def, sides.opposite[0], sides.opposite[1], bend_stiffness(fabric.bend, length, across / 2),
               fabric, SpringKind::bend);
  }
  return def;
}

sim::ClothDef sphere_cloth(Real radius, uint32_t divisions, const sim::Pose& pose, const Fabric& fabric) {
  check("radius", radius, false);
  if (divisions > 6) refuse("divisions must be 0 to 6");
  sim::TriangleMesh mesh = icosahedron();
  for (uint32_t i = 0; i < divisions; ++i) mesh = divided(mesh);
  for (Vec3& v : mesh.vertices) v *= radius;
  return mesh_cloth(mesh, pose, fabric, true);
}

uint32_t add_cord(ClothDef& def, const Cord& cord) {
  check("length of a cord", cord.length, true);
  check("stiffness of a cord", cord.stiffness, false);
  check("mass_per_length of a cord", cord.mass_per_length, false);
  check("damping of a cord", cord.damping, true);
  if (cord.segments < 1 || cord.segments > 1000) refuse("segments of a cord must be 1 to 1000");
  if (cord.vertex >= def.vertices.size()) refuse("a cord begins at a vertex that does not exist");
  const Vec3 start = def.vertices[cord.vertex], across = cord.end - start;
  const Real distance = across.norm(), length = cord.length > 0 ? cord.length : distance;
  if (!(length > 0)) refuse("the ends of a cord are at the same place; give it a length");
  const Real count = cord.segments, rest = length / count, segment_mass = cord.mass_per_length * rest;
  // The two parts of a slack cord meet at its middle, or half a segment from it if the number of segments is
  // odd.
  const Real first = std::floor(count / 2) * rest, second = length - first;
  Real along = 0, down = 0;
  const Vec3 u = distance > 0 ? Vec3(across / distance) : Vec3(Vec3::UnitX());
  Vec3 n = -Vec3::UnitY() + u.y() * u;
  n = n.squaredNorm() > 1e-6 ? n.normalized() : Vec3(Vec3::UnitX());
  const bool slack = length > distance && cord.segments > 1;
  if (slack && distance > second - first) {
    along = (first * first - second * second + distance * distance) / (2 * distance);
    down = std::sqrt(std::max(first * first - along * along, 0.0));
  }
  const Vec3 middle = start + along * u + down * n;
  uint32_t last = cord.vertex;
  def.masses[last] += segment_mass / 2;
  for (uint32_t i = 1; i <= cord.segments; ++i) {
    const Real s = rest * i;
    Vec3 place = start + i / count * across;
    if (slack && down > 0)
      place = s <= first ? Vec3(start + s / first * (middle - start))
                         : Vec3(middle + (s - first) / second * (cord.end - middle));
    const auto next = static_cast<uint32_t>(def.vertices.size());
    def.vertices.push_back(place);
    if (!def.rest_vertices.empty()) def.rest_vertices.push_back(place);
    def.masses.push_back(i < cord.segments ? segment_mass : segment_mass / 2);
    const Real stiffness = cord.stiffness / rest;
    const Real reduced = def.masses[last] * def.masses[next] / (def.masses[last] + def.masses[next]);
    def.springs.push_back(
        {last, next, rest, stiffness, 2 * cord.damping * std::sqrt(stiffness * reduced), SpringKind::cord});
    last = next;
  }
  return last;
}

}  // namespace offstage::effects
