#include "sim/geometry/solid_mesh.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <numbers>

#include "sim/geometry/convex_hull.h"

namespace offstage::sim {
namespace {

using Vec2 = Eigen::Vector2d;

constexpr uint32_t kRoundSides = 48;  // flat sides around an axis of revolution
constexpr uint32_t kTubeSides = 24;   // flat sides around the tube of a torus
constexpr uint32_t kBallSides = 32;   // flat sides around a ball

/// Returns `count` evenly spaced points of the unit circle. `count` must be a multiple of 4, and 4 or 6 times
/// a power of two: angles are halved with square roots, which gives the same bits on every machine.
std::vector<Vec2> unit_circle(uint32_t count) {
  const bool by_sixths = count % 3 == 0;
  Real cosine = by_sixths ? 0.5 : 0;
  uint32_t sides = by_sixths ? 6 : 4;
  for (; sides < count; sides *= 2) cosine = std::sqrt((1 + cosine) / 2);
  assert(sides == count && count % 4 == 0);
  const Real sine = std::sqrt(1 - cosine * cosine);
  std::vector<Vec2> points(count);
  points[0] = Vec2::UnitX();
  for (uint32_t k = 1; k < count; ++k) {
    const Vec2& last = points[k - 1];
    points[k] = k % (count / 4) == 0
                    ? Vec2(-points[k - count / 4].y(), points[k - count / 4].x())
                    : Vec2(cosine * last.x() - sine * last.y(), sine * last.x() + cosine * last.y());
  }
  return points;
}

/// Revolves a profile of (radius, height) about Y. An open profile goes from the bottom of the axis to its
/// top; a closed one goes upwards on the outside. Points of radius 0 are single vertices.
TriangleMesh revolved_mesh(const std::vector<Vec2>& profile, bool closed, uint32_t sides) {
  const std::vector<Vec2> circle = unit_circle(sides);
  TriangleMesh mesh;
  std::vector<uint32_t> first;
  for (const Vec2& p : profile) {
    first.push_back(static_cast<uint32_t>(mesh.vertices.size()));
    if (p.x() == 0)
      mesh.vertices.push_back(Vec3(0, p.y(), 0));
    else
      for (const Vec2& c : circle) mesh.vertices.push_back(Vec3(p.x() * c.x(), p.y(), -p.x() * c.y()));
  }
  const std::size_t bands = closed ? profile.size() : profile.size() - 1;
  for (std::size_t i = 0; i < bands; ++i) {
    const std::size_t next = (i + 1) % profile.size();
    const auto at = [&](std::size_t ring, uint32_t k) {
      return profile[ring].x() == 0 ? first[ring] : first[ring] + k % sides;
    };
    for (uint32_t k = 0; k < sides; ++k) {
      const uint32_t a = at(i, k), b = at(i, k + 1), c = at(next, k + 1), d = at(next, k);
      if (a != b) mesh.triangles.push_back({a, b, c});
      if (c != d) mesh.triangles.push_back({a, c, d});
    }
  }
  return mesh;
}

SolidMesh convex_solid(TriangleMesh mesh) {
  SolidMesh solid{std::move(mesh), {}};
  solid.parts.push_back(convex_hull(solid.mesh.vertices));
  return solid;
}

/// Divides a ring into convex sectors; each is the hull of the profile at two neighbouring sides. `sector`:
/// the exact solid of a sector, without its angle.
SolidMesh ring(const std::vector<Vec2>& profile, RingSector sector) {
  SolidMesh solid{revolved_mesh(profile, true, kRoundSides), {}};
  const Vec2 half_angle = unit_circle(2 * kRoundSides)[1];
  sector.cosine = half_angle.x();
  sector.sine = half_angle.y();
  const std::vector<Vec2> half_turns = unit_circle(4 * kRoundSides);
  for (uint32_t k = 0; k < kRoundSides; ++k) {
    std::vector<Vec3> corners;
    for (std::size_t i = 0; i < profile.size(); ++i)
      for (const uint32_t side : {k, (k + 1) % kRoundSides})
        corners.push_back(solid.mesh.vertices[i * kRoundSides + side]);
    solid.parts.push_back(convex_hull(corners));
    const Vec2& half_turn = half_turns[2 * k + 1];
    solid.round_parts.push_back(RoundSolid{sector, {Vec3::Zero(), Quat(half_turn.x(), 0, half_turn.y(), 0)}});
  }
  return solid;
}

/// Returns half of a circle about the origin, from the bottom to the top.
std::vector<Vec2> half_circle(Real radius, uint32_t sides) {
  const std::vector<Vec2> circle = unit_circle(sides);
  std::vector<Vec2> points;
  for (uint32_t k = 0; k <= sides / 2; ++k) {
    const Vec2& c = circle[(k + 3 * sides / 4) % sides];
    points.push_back({k == 0 || k == sides / 2 ? 0 : radius * c.x(), radius * c.y()});
  }
  return points;
}

void add_cuboid(const Vec3& low, const Vec3& high, TriangleMesh& mesh) {
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  for (uint32_t k = 0; k < 8; ++k)
    mesh.vertices.push_back(
        {k & 1 ? high.x() : low.x(), k & 2 ? high.y() : low.y(), k & 4 ? high.z() : low.z()});
  constexpr std::array<std::array<uint32_t, 4>, 6> kSides = {
      {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
  for (const auto& s : kSides) {
    mesh.triangles.push_back({first + s[0], first + s[1], first + s[2]});
    mesh.triangles.push_back({first + s[0], first + s[2], first + s[3]});
  }
}

TriangleMesh mesh_of(const Sphere& s) {
  return revolved_mesh(half_circle(s.radius, kBallSides), false, kBallSides);
}
TriangleMesh mesh_of(const Ellipsoid& e) {
  TriangleMesh mesh = mesh_of(Sphere{1});
  for (Vec3& v : mesh.vertices) v = v.cwiseProduct(e.radii);
  return mesh;
}
TriangleMesh mesh_of(const Box& b) {
  TriangleMesh mesh;
  add_cuboid(-b.size / 2, b.size / 2, mesh);
  return mesh;
}
TriangleMesh mesh_of(const Capsule& c) {
  std::vector<Vec2> profile;
  for (const Vec2& p : half_circle(c.radius, kBallSides)) {
    if (p.y() <= 0) profile.push_back(p - Vec2(0, c.height / 2));
    if (p.y() >= 0 && (p.y() > 0 || c.height > 0)) profile.push_back(p + Vec2(0, c.height / 2));
  }
  return revolved_mesh(profile, false, kBallSides);
}
TriangleMesh mesh_of(const Frustum& c) {
  const Real half = c.height / 2;
  return revolved_mesh({{0, -half}, {c.radius, -half}, {c.top_radius, half}, {0, half}}, false, kRoundSides);
}
TriangleMesh mesh_of(const Cylinder& c) {
  return mesh_of(Frustum{c.radius, c.radius, c.height});
}
TriangleMesh mesh_of(const Cone& c) {
  const Real half = c.height / 2;
  return revolved_mesh({{0, -half}, {c.radius, -half}, {0, half}}, false, kRoundSides);
}
TriangleMesh mesh_of(const Plane&) {
  assert(false && "a plane is not a bounded solid");
  return {};
}
TriangleMesh mesh_of(const MeshShape&) {
  assert(false && "a mesh shape needs its mesh");
  return {};
}

/// Returns the inertia of a point mass at `arm` about the origin of the arm [kg m^2].
Mat3 point_inertia(Real mass, const Vec3& arm) {
  return mass * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
}

Mat3 about_y(Real across, Real along) {
  return Vec3(across, along, across).asDiagonal();
}

/// Returns the floor and the walls of an open box. They do not overlap, because the walls along z stand
/// between the walls along x.
std::array<Aabb, 5> slabs(const OpenBox& b) {
  const Vec3 out = b.size / 2, in = out - Vec3::Constant(b.thickness);
  return {Aabb(-out, Vec3(out.x(), -in.y(), out.z())),
          Aabb(Vec3(-out.x(), -in.y(), -out.z()), Vec3(-in.x(), out.y(), out.z())),
          Aabb(Vec3(in.x(), -in.y(), -out.z()), out),
          Aabb(Vec3(-in.x(), -in.y(), -out.z()), Vec3(in.x(), out.y(), -in.z())),
          Aabb(Vec3(-in.x(), -in.y(), in.z()), Vec3(in.x(), out.y(), out.z()))};
}

}  // namespace

MassProperties mass_properties(const Torus& t) {
  const Real R2 = t.radius * t.radius, r2 = t.tube_radius * t.tube_radius;
  const Real volume = 2 * std::numbers::pi * std::numbers::pi * t.radius * r2;
  return {volume, Vec3::Zero(), about_y(volume * (R2 / 2 + 5 * r2 / 8), volume * (R2 + 3 * r2 / 4))};
}

MassProperties mass_properties(const Tube& t) {
  const Real inner = t.radius - t.thickness, R2 = t.radius * t.radius, r2 = inner * inner;
  const Real volume = std::numbers::pi * (R2 - r2) * t.height;
  return {volume, Vec3::Zero(),
          about_y(volume * (3 * (R2 + r2) + t.height * t.height) / 12, volume * (R2 + r2) / 2)};
}

MassProperties mass_properties(const OpenBox& box) {
  std::vector<MassPart> parts;
  for (const Aabb& slab : slabs(box))
    parts.push_back({mass_properties(Shape(Box{slab.sizes()})), {slab.center(), Quat::Identity()}, 1});
  const BodyMass sum = sum_of(parts);
  return {sum.mass, sum.centre, sum.inertia};
}

SolidMesh solid_mesh(const Torus& torus) {
  std::vector<Vec2> profile;
  for (const Vec2& c : unit_circle(kTubeSides))
    profile.push_back(Vec2(torus.radius, 0) + torus.tube_radius * c);
  SolidMesh solid =
      ring(profile, {.radius = torus.radius, .inner = torus.radius, .around = torus.tube_radius});
  solid.round_hull = RoundSolid{RoundedDisc{torus.radius, torus.tube_radius}, {}};
  return solid;
}

SolidMesh solid_mesh(const Tube& tube) {
  const Real half = tube.height / 2, inner = tube.radius - tube.thickness;
  SolidMesh solid = ring({{tube.radius, -half}, {tube.radius, half}, {inner, half}, {inner, -half}},
                         {.radius = tube.radius, .inner = inner, .half_height = half});
  solid.round_hull = RoundSolid{Shape(Cylinder{tube.radius, tube.height}), {}};
  return solid;
}

SolidMesh solid_mesh(const OpenBox& box) {
  const Vec3 out = box.size / 2, in = out - Vec3::Constant(box.thickness);
  SolidMesh solid;
  // The mesh consists of the outside without its top, the inside with reversed faces, and the rim between
  // them.
  add_cuboid(-out, out, solid.mesh);
  add_cuboid(-in, Vec3(in.x(), out.y(), in.z()), solid.mesh);
  std::vector<Triangle> kept;
  const auto is_top = [](const Triangle& t, uint32_t first) {
    return std::ranges::all_of(t, [&](uint32_t v) { return ((v - first) & 2) != 0; });
  };
  for (std::size_t i = 0; i < solid.mesh.triangles.size(); ++i) {
    Triangle t = solid.mesh.triangles[i];
    const bool inside = i >= solid.mesh.triangles.size() / 2;
    if (is_top(t, inside ? 8 : 0)) continue;
    if (inside) std::swap(t[1], t[2]);
    kept.push_back(t);
  }
  // Corners of the top, counter-clockwise seen from above.
  constexpr std::array<uint32_t, 4> kTop = {2, 6, 7, 3};
  for (std::size_t k = 0; k < 4; ++k) {
    const uint32_t a = kTop[k], b = kTop[(k + 1) % 4];
    kept.push_back({a, b, b + 8});
    kept.push_back({a, b + 8, a + 8});
  }
  solid.mesh.triangles = std::move(kept);
  for (const Aabb& slab : slabs(box)) {
    TriangleMesh cuboid;
    add_cuboid(slab.min(), slab.max(), cuboid);
    solid.parts.push_back(convex_hull(cuboid.vertices));
  }
  return solid;
}

SolidMesh solid_mesh(const Shape& primitive) {
  SolidMesh solid = convex_solid(std::visit([](const auto& shape) { return mesh_of(shape); }, primitive));
  if (std::holds_alternative<Box>(primitive)) return solid;
  solid.round_hull = RoundSolid{primitive, {}};
  solid.round_parts.push_back(solid.round_hull);
  return solid;
}

SolidMesh placed(SolidMesh solid, const Pose& pose) {
  for (Vec3& v : solid.mesh.vertices) v = pose.point_to_world(v);
  for (ConvexPolyhedron& part : solid.parts) {
    std::vector<Vec3> corners(part.vertices().begin(), part.vertices().end());
    for (Vec3& v : corners) v = pose.point_to_world(v);
    part = convex_hull(corners);
  }
  const auto place = [&](std::optional<RoundSolid>& round) {
    if (!round) return;
    Pose& own = round->pose;
    own = {pose.point_to_world(own.position), (pose.orientation * own.orientation).normalized()};
  };
  std::ranges::for_each(solid.round_parts, place);
  place(solid.round_hull);
  return solid;
}

BodyMass sum_of(const std::vector<MassPart>& parts) {
  BodyMass sum;
  for (const MassPart& part : parts) {
    const Real mass = part.density * part.solid.volume;
    sum.mass += mass;
    sum.centre += mass * part.pose.point_to_world(part.solid.centre);
  }
  if (!(sum.mass > 0)) return sum;
  sum.centre /= sum.mass;
  for (const MassPart& part : parts) {
    const Mat3 axes = part.pose.orientation.toRotationMatrix();
    const Vec3 arm = part.pose.point_to_world(part.solid.centre) - sum.centre;
    sum.inertia += part.density * axes * part.solid.inertia * axes.transpose() +
                   point_inertia(part.density * part.solid.volume, arm);
  }
  return sum;
}

}  // namespace offstage::sim
