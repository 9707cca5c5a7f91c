#include "sim/collision/convex.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace offstage::sim {
namespace {

// For at most this many vertices, a search of all of them is faster than climbing from neighbour to
// neighbour.
constexpr std::size_t kScanned = 24;
// Fraction of the polyhedron's size by which it may deviate from convexity, because hulls merge faces that
// are this close to one plane.
constexpr Real kLevel = 1e-9;

uint32_t highest(const ConvexPolyhedron& p, const Vec3& d) {
  const std::span<const Vec3> vertices = p.vertices();
  uint32_t best = 0;
  Real height = d.dot(vertices[0]);
  for (uint32_t v = 1; v < vertices.size(); ++v)
    if (const Real h = d.dot(vertices[v]); h > height) {
      height = h;
      best = v;
    }
  return best;
}

/// Returns the corner of a box; bit i is set if coordinate i is positive.
Vec3 corner(const Vec3& half, uint32_t bits) {
  return {bits & 1 ? half.x() : -half.x(), bits & 2 ? half.y() : -half.y(), bits & 4 ? half.z() : -half.z()};
}

/// Returns the support point of a disc about the Y axis at y = `height`. If d is along Y, all points of the
/// disc are equally far along d, and the centre is returned.
Vec3 rim(const Vec3& d, Real radius, Real height) {
  const Real rho = std::sqrt(d.x() * d.x() + d.z() * d.z());
  if (!(rho > 0)) return {0, height, 0};
  return {radius * (d.x() / rho), height, radius * (d.z() / rho)};
}

/// Returns the support point of a cone or frustum. It is a point of the top if that reaches farther along d
/// than the base, otherwise a point of the base's rim.
Vec3 cone_support(const Vec3& half, const Vec3& d) {
  if (half.z() > 0) {
    const Real rho = std::sqrt(d.x() * d.x() + d.z() * d.z());
    const bool up = 2 * half.y() * d.y() > (half.x() - half.z()) * rho;
    return rim(d, up ? half.z() : half.x(), up ? half.y() : -half.y());
  }
  const Real rho2 = d.x() * d.x() + d.z() * d.z(), rise = 2 * half.y() * d.y();
  if (rise > 0 && rise * rise >= half.x() * half.x() * rho2) return {0, half.y(), 0};
  return rim(d, half.x(), -half.y());
}

/// Returns the support point of an ellipsoid. The ellipsoid is the unit ball scaled by `half` along the axes,
/// so its support point is the scaled support point of the ball.
Vec3 ellipsoid_support(const Vec3& half, const Vec3& d) {
  const Vec3 scaled = half.cwiseProduct(d);
  const Real length = scaled.norm();
  return length > 0 ? Vec3(half.cwiseProduct(scaled) / length) : Vec3(half.x(), 0, 0);
}

struct ConvexOf {
  Convex operator()(const Sphere& s) const { return {.core = Convex::Core::point, .radius = s.radius}; }
  Convex operator()(const Box& b) const { return {.core = Convex::Core::box, .half = b.size / 2}; }
  Convex operator()(const Capsule& c) const {
    return {.core = Convex::Core::segment, .half = Vec3(0, c.height / 2, 0), .radius = c.radius};
  }
  Convex operator()(const Cylinder& c) const {
    return {.core = Convex::Core::cylinder, .half = Vec3(c.radius, c.height / 2, 0)};
  }
  Convex operator()(const Cone& c) const {
    return {.core = Convex::Core::cone, .half = Vec3(c.radius, c.height / 2, 0)};
  }
  Convex operator()(const Frustum& c) const {
    return {.core = Convex::Core::cone, .half = Vec3(c.radius, c.height / 2, c.top_radius)};
  }
  Convex operator()(const Ellipsoid& e) const { return {.core = Convex::Core::ellipsoid, .half = e.radii}; }
  Convex operator()(const Plane&) const { return none(); }
  Convex operator()(const MeshShape&) const { return none(); }

  static Convex none() {
    assert(false && "a plane and a mesh are not convex solids");
    return {};
  }
};

}  // namespace

// On a convex polyhedron a vertex above its neighbours is above all others, because the edges at it span a
// cone around the polyhedron. If the polyhedron is convex only within rounding, a vertex that wrongly seems
// to be the top has a neighbour of almost the same height.
uint32_t support_vertex(const ConvexPolyhedron& p, const Vec3& d, uint32_t start) {
  const std::span<const Vec3> vertices = p.vertices();
  if (vertices.size() <= kScanned) return highest(p, d);
  uint32_t top = start < vertices.size() ? start : 0;
  Real height = d.dot(vertices[top]);
  for (;;) {  // the loop ends because the height grows
    uint32_t next = top;
    Real best = -std::numeric_limits<Real>::infinity();
    for (uint32_t v : p.vertex_neighbours(top))
      if (const Real h = d.dot(vertices[v]); h > best) {
        best = h;
        next = v;
      }
    if (best > height) {
      top = next;
      height = best;
      continue;
    }
    const Real drop = height - best, level = kLevel * p.reach();
    return drop * drop > level * level * d.squaredNorm() ? top : highest(p, d);
  }
}

Vec3 Convex::support(const Vec3& d, uint32_t& number) const {
  return place ? place->point_to_world(core_support(place->vector_to_body(d), number))
               : core_support(d, number);
}

Vec3 Convex::core_support(const Vec3& d, uint32_t& number) const {
  switch (core) {
    case Core::point:
      break;
    case Core::segment:
      number = d.y() > 0;
      return core_vertex(number);
    case Core::triangle:
      number = 0;
      for (uint32_t k = 1; k < 3; ++k)
        if (d.dot(*corners[k]) > d.dot(*corners[number])) number = k;
      return *corners[number];
    case Core::box:
      number = (d.x() > 0 ? 1u : 0u) | (d.y() > 0 ? 2u : 0u) | (d.z() > 0 ? 4u : 0u);
      return corner(half, number);
    case Core::cylinder:
      return rim(d, half.x(), std::copysign(half.y(), d.y()));
    case Core::cone:
      return cone_support(half, d);
    case Core::ellipsoid:
      return ellipsoid_support(half, d);
    case Core::sector:
      return sector_support(d);
    case Core::polyhedron:
      number = support_vertex(*polyhedron, d, number);
      return polyhedron->vertex(number);
  }
  return Vec3::Zero();
}

/// Returns the support point of a sector of a ring: a point of the arc, or of one of the two ends.
Vec3 Convex::sector_support(const Vec3& d) const {
  const Real y = std::copysign(half.y(), d.y()), side = std::copysign(sine, d.z());
  if (faces_arc(d)) return rim(d, half.x(), y);
  const Real r = d.x() * cosine + d.z() * side >= 0 ? half.x() : half.z();
  return {r * cosine, y, r * side};
}

Vec3 Convex::vertex(uint32_t number) const {
  return place ? place->point_to_world(core_vertex(number)) : core_vertex(number);
}

Vec3 Convex::core_vertex(uint32_t number) const {
  switch (core) {
    case Core::segment:
      return {0, number & 1 ? half.y() : -half.y(), 0};
    case Core::triangle:
      return *corners[number < 3 ? number : 0];
    case Core::box:
      return corner(half, number);
    case Core::polyhedron:
      return polyhedron->vertex(number < polyhedron->vertices().size() ? number : 0);
    default:
      return Vec3::Zero();
  }
}

Vec3 Convex::centre() const {
  if (core == Core::triangle) return (*corners[0] + *corners[1] + *corners[2]) / 3;
  const Vec3 own = core == Core::polyhedron ? polyhedron->centre()
                   : core == Core::sector   ? Vec3((half.x() + half.z()) / 2 * cosine, 0, 0)
                                            : Vec3::Zero();
  return place ? place->point_to_world(own) : own;
}

Real Convex::reach() const {
  if (core == Core::triangle)
    return radius + std::sqrt(std::max(
                        {corners[0]->squaredNorm(), corners[1]->squaredNorm(), corners[2]->squaredNorm()}));
  const Real offset = radius + (place ? place->position.norm() : 0);
  if (core == Core::cone) return offset + std::hypot(std::max(half.x(), half.z()), half.y());
  if (core == Core::ellipsoid) return offset + half.maxCoeff();
  if (core == Core::sector) return offset + std::hypot(half.x(), half.y());
  return offset + (core == Core::polyhedron ? polyhedron->reach() : half.norm());
}

Convex convex(const Shape& primitive) {
  return std::visit(ConvexOf{}, primitive);
}

Convex convex(const RoundSolid& round) {
  Convex solid;
  if (const auto* shape = std::get_if<Shape>(&round.shape)) solid = convex(*shape);
  if (const auto* s = std::get_if<RingSector>(&round.shape))
    solid = {.core = Convex::Core::sector,
             .half = Vec3(s->radius, s->half_height, s->inner),
             .sine = s->sine,
             .cosine = s->cosine,
             .radius = s->around};
  if (const auto* disc = std::get_if<RoundedDisc>(&round.shape))
    solid = {.core = Convex::Core::cylinder, .half = Vec3(disc->radius, 0, 0), .radius = disc->around};
  solid.place = &round.pose;
  return solid;
}

Convex convex(const ConvexPolyhedron& polyhedron, Real radius) {
  return {.core = Convex::Core::polyhedron, .radius = radius, .polyhedron = &polyhedron};
}

Convex convex_triangle(const Vec3& a, const Vec3& b, const Vec3& c) {
  return {.core = Convex::Core::triangle, .corners = {&a, &b, &c}};
}

}  // namespace offstage::sim
