/// Collisions of particles with cloth in both directions (physics F6). After both have moved, a particle that
/// has passed a triangle, or is nearer to it than its radius, is moved back. It exchanges an impulse with the
/// corners of the triangle.

#include <algorithm>
#include <cmath>
#include <map>

#include "sim/geometry/closest_points.h"
#include "sim/world/cloth_motion.h"

namespace offstage::sim {
namespace {

/// A particle also hits a triangle up to this distance beyond its border, in radii, because triangles bend as
/// they move.
constexpr Real kSlack = 0.1;

struct ClothTriangle {
  Cloth* cloth;
  Triangle corners;
};

struct ClothHit {
  const ClothTriangle* triangle;
  Real fraction = 2;  // time of the hit as a fraction of the sub-step; above 1: no hit
  Vec3 weights;       // weights of the corners
  Vec3 normal;        // towards the particle
  Real overlap;       // overlap at the end [m]
};

Vec3 unit_normal(const Vec3& a, const Vec3& b, const Vec3& c) {
  return (b - a).cross(c - a).stableNormalized();
}

/// Finds the earliest hit of a sphere with a triangle, if that is earlier than `first`. The sphere moves
/// straight from p0 to p1; the corners of the triangle move straight, too.
void find_hit(const ClothTriangle& t, const Vec3& p0, const Vec3& p1, Real radius, ClothHit& first) {
  const auto from = [&](std::size_t k) { return t.cloth->before[t.corners[k]]; };
  const auto to = [&](std::size_t k) { return t.cloth->points[t.corners[k]]; };
  const Vec3 n0 = unit_normal(from(0), from(1), from(2)), n1 = unit_normal(to(0), to(1), to(2));
  const Real height0 = n0.dot(p0 - from(0)), side = height0 < 0 ? -1 : 1;
  const Real gap0 = side * height0 - radius, gap1 = side * n1.dot(p1 - to(0)) - radius;
  if (gap1 >= 0) return;
  // First the surface of the particle is tested. At a crease it may miss every triangle, so its centre is
  // tested next.
  for (const Real reach : {radius, 0.0}) {
    const Real before = gap0 + radius - reach, after = gap1 + radius - reach;
    if (after >= 0) return;
    const Real fraction = before > 0 ? before / (before - after) : 0;
    if (fraction >= first.fraction) return;
    const auto at = [&](std::size_t k) { return Vec3(from(k) + fraction * (to(k) - from(k))); };
    const Vec3 p = p0 + fraction * (p1 - p0);
    const TrianglePoint nearest = closest_on_triangle(p, at(0), at(1), at(2));
    const Real slack = kSlack * radius + std::abs(std::min(before, 0.0));
    if ((p - nearest.point).norm() > reach + slack) continue;
    first = {&t, fraction, {nearest.weights[0], nearest.weights[1], nearest.weights[2]}, side * n1, -gap1};
    return;
  }
}

}  // namespace

void collide_particles_with_cloths(WorldState& world, Real start, Real h,
                                   std::vector<ParticleEvent>& events) {
  bool wanted = false;
  world.systems.for_each(
      [&](ParticleSystemHandle, ParticleSystem& s) { wanted |= s.def.collides && s.arrays.size() > 0; });
  if (!wanted) return;
  std::vector<ClothTriangle> triangles;
  std::vector<Aabb> boxes;
  std::map<const Cloth*, std::vector<uint8_t>> held;
  world.cloths.for_each([&](ClothHandle, const std::unique_ptr<Cloth>& cloth) {
    if (cloth->absent || !cloth->def.collides) return;
    for (const Triangle& t : cloth->triangles) {
      triangles.push_back({cloth.get(), t});
      Aabb& box = boxes.emplace_back();
      for (uint32_t corner : t) box.extend(cloth->points[corner]).extend(cloth->before[corner]);
    }
    std::vector<uint8_t>& fixed = held[cloth.get()];
    fixed.assign(cloth->points.size(), cloth->stopped);
    for (const ClothPin& pin : cloth->pins) fixed[pin.vertex] = 1;
  });
  const AabbTree tree(boxes);
  world.systems.for_each([&](ParticleSystemHandle handle, ParticleSystem& system) {
    if (!system.def.collides) return;
    ParticleArrays& p = system.arrays;
    for (std::size_t i = 0; i < p.size(); ++i) {
      if (!system.whole_step(i)) continue;
      const Vec3 from = p.position[i] - h * p.velocity[i];
      Aabb around(from.cwiseMin(p.position[i]), from.cwiseMax(p.position[i]));
      around.min().array() -= p.radius[i];
      around.max().array() += p.radius[i];
      ClothHit hit;
      tree.overlapping(around, [&](uint32_t k) {
        if (boxes[k].intersects(around)) find_hit(triangles[k], from, p.position[i], p.radius[i], hit);
      });
      if (hit.fraction > 1) continue;
      Cloth& cloth = *hit.triangle->cloth;
      Vec3 velocity = p.velocity[i];
      Real mobility = 1 / p.mass[i];
      std::array<Real, 3> gain;  // changes of the corners' velocities by a unit impulse
      for (std::size_t k = 0; k < 3; ++k) {
        const uint32_t corner = hit.triangle->corners[k];
        const Real weight = hit.weights[static_cast<Eigen::Index>(k)];
        gain[k] = held[&cloth][corner] ? 0 : weight / cloth.masses[corner];
        mobility += weight * gain[k];
        velocity -= weight * cloth.velocities[corner];
      }
      p.position[i] += hit.overlap * hit.normal;
      if (velocity.dot(hit.normal) >= 0) continue;
      const Vec3 impulse = collision_impulse(1 / mobility, velocity, hit.normal, p.restitution[i],
                                             std::sqrt(p.friction[i] * cloth.def.friction));
      p.velocity[i] += impulse / p.mass[i];
      for (std::size_t k = 0; k < 3; ++k) cloth.velocities[hit.triangle->corners[k]] -= gain[k] * impulse;
      ++cloth.report.particle_hits;
      if (system.def.report_collisions)
        events.push_back({ParticleEvent::Kind::collision, handle, p.id[i], start + hit.fraction * h,
                          p.position[i], p.velocity[i], hit.normal, p.mass[i], p.radius[i], p.age[i]});
      if (system.def.dies_on_hit) p.lifespan[i] = std::min(p.lifespan[i], p.age[i]);
    }
  });
}

}  // namespace offstage::sim
