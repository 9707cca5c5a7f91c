/// The part of ClothSystem that stores the result of a step in the cloths: motion, tears and reports. It also
/// stops cloths that diverged.

#include <algorithm>
#include <cmath>

#include "sim/cloth/cloth_system.h"
#include "sim/cloth/tearing.h"

namespace offstage::sim {
namespace {

/// A cloth diverges if one of its points is faster than this [m/s]. Waves along a thread are ten times
/// slower.
constexpr Real kLostSpeed = 5000;

}  // namespace

void ClothSystem::write_back() {
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    Cloth& cloth = *cloths_[c];
    bool finite = true;
    for (std::size_t i = 0; i < cloth.points.size(); ++i) {
      finite &= points_.position[first_[c] + i].allFinite() && points_.velocity[first_[c] + i].allFinite();
    }
    if (!finite) {
      stop(cloth, first_[c]);
      continue;
    }
    for (std::size_t i = 0; i < cloth.points.size(); ++i) {
      cloth.points[i] = points_.at(first_[c] + i);
      cloth.velocities[i] = points_.velocity[first_[c] + i].head<3>();
    }
    const uint32_t torn = tear_at(c, time_);
    cloth.report.torn += torn;
    changed_ |= torn > 0;
  }
}

bool ClothSystem::any_tears() const {
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    const Real tear = cloths_[c]->def.tear;
    if (tear == 0 || cloths_[c]->stopped) continue;
    for (const ClothSpring& s : springs_of(c)) {
      const Real longest = tear * s.rest_length;
      if (s.kind == SpringKind::stretch &&
          (points_.position[s.a] - points_.position[s.b]).squaredNorm() > longest * longest)
        return true;
    }
  }
  return false;
}

/// Tears cloths after a fraction of the world's sub-step. The rest of the sub-step uses the torn cloths.
void ClothSystem::tear_within(const ClothWeather& weather, Real fraction) {
  time_ = weather.time + fraction * weather.h;
  write_back();
  time_ = weather.time + weather.h;
  if (!changed_) return;
  assemble();
  points_.inverse_mass.resize(points_.size());
  ClothWeather now = weather;
  now.time += fraction * weather.h;
  for (std::size_t c = 0; c < cloths_.size(); ++c) add_outer_forces(*cloths_[c], first_[c], now, points_);
  adapt_springs();
  find_held(weather.time, bodies_);
  find_pin_steps();
  contacts_.find(points_, collides_, bodies_, weather.h, fraction);
}

/// Tears the threads of a cloth that are too long, and reports its first tear. Returns the number of torn
/// springs.
uint32_t ClothSystem::tear_at(std::size_t c, Real time) {
  Cloth& cloth = *cloths_[c];
  ClothTear first{.time = time};
  first.by_pressure = cloth.def.pressure != 0;
  const uint32_t torn = tear(cloth, first);
  if (torn > 0 && cloth.first_tear->time == time && !cloth.first_tear->body) {
    const ClothBody* const body = touching_body(c, cloth.first_tear->place);
    cloth.first_tear->touches_body = body != nullptr;
    if (body) cloth.first_tear->body.index = body->obstacle().body;
  }
  cloth.report.first_tear = cloth.first_tear;
  return torn;
}

/// Returns the body nearest to `place` of those that touched cloth in this sub-step of the world and reach to
/// this cloth; null: none. A body that only holds its pins does not count.
const ClothBody* ClothSystem::touching_body(std::size_t c, const Vec3& place) const {
  Aabb around;
  for (const Vec3& p : cloths_[c]->points) around.extend(p);
  const Vec3 margin = Vec3::Constant(2 * cloths_[c]->def.thickness);
  around = Aabb(around.min() - margin, around.max() + margin);
  const ClothBody* nearest = nullptr;
  Real least = kInfinity;
  for (const ClothBody& body : bodies_) {
    const bool reaches = std::holds_alternative<Plane>(*body.solid().shape) ||
                         body.obstacle().swept_bounds().intersects(around);
    if (!body.touched || !body.collides || !reaches) continue;
    if (std::ranges::find(points_.holder, &body) != points_.holder.end()) continue;
    const Real distance = signed_distance(body.solid(), body.end().point_to_body(place)).distance;
    if (distance >= least) continue;
    least = distance;
    nearest = &body;
  }
  return nearest;
}

void ClothSystem::count_penetration() {
  std::vector<Real> deepest(cloths_.size(), 0);
  contacts_.measure(points_, deepest);
  for (std::size_t c = 0; c < cloths_.size(); ++c)
    cloths_[c]->report.penetration = std::max(cloths_[c]->report.penetration, deepest[c]);
}

void ClothSystem::measure() {
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    Cloth& cloth = *cloths_[c];
    if (!changed_ && c < springs_.size() && cloth.def.integrator == ClothIntegrator::relaxed) {
      cloth.report.clamped = springs_[c].clamped();
      cloth.report.least_stiffness = springs_[c].least_stiffness();
      cloth.report.spring_steps = spring_steps(c, dt_);
    }
    Eigen::ArrayXd length2(cloth.springs.size()), rest(cloth.springs.size());
    Eigen::Index count = 0;
    for (const ClothSpring& s : cloth.springs) {
      if (s.kind != SpringKind::stretch) continue;
      length2[count] = (cloth.points[s.a] - cloth.points[s.b]).squaredNorm();
      rest[count++] = s.rest_length;
    }
    const Eigen::ArrayXd strain = length2.head(count).sqrt() / rest.head(count) - 1;
    cloth.report.max_strain = count > 0 ? std::max(cloth.report.max_strain, strain.maxCoeff()) : 0;
    cloth.report.mean_strain = count > 0 ? strain.abs().mean() : 0;
    if (const auto limit = std::ranges::find(bend_limits_, c, &BendLimit::cloth);
        !changed_ && limit != bend_limits_.end())
      cloth.report.max_bend = limit->greatest(points_);
    if (c < contacts_.active().size()) cloth.report.contacts = contacts_.active()[c];
    if (c < self_contacts_.active().size()) cloth.report.self_contacts = self_contacts_.active()[c];
  }
}

/// Stops cloths that diverge, before their contacts are searched: in a scattered cloth nearly all pairs of
/// triangles may touch, and the search would take too long.
void ClothSystem::stop_diverged(Real dt) {
  const Real farthest2 = kLostSpeed * kLostSpeed * dt * dt;
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    if (cloths_[c]->stopped) continue;
    bool lost = false;
    for (std::size_t i = first_[c], end = i + cloths_[c]->points.size(); i < end; ++i)
      lost |= points_.inverse_mass[i] > 0 &&
              !((points_.position[i] - points_.start[i]).squaredNorm() <= farthest2);
    if (lost) stop(*cloths_[c], first_[c]);
  }
}

/// Stops a cloth with non-finite numbers, and puts it back to its last finite state.
void ClothSystem::stop(Cloth& cloth, std::size_t first) {
  cloth.stopped = true;
  cloth.report.finite = false;
  for (std::size_t i = 0; i < cloth.points.size(); ++i) {
    cloth.velocities[i].setZero();
    points_.position[first + i] = padded(cloth.points[i]);
    points_.velocity[first + i].setZero();
    points_.start[first + i] = points_.position[first + i];
    points_.inverse_mass[first + i] = 0;
    kick_[first + i].setZero();
  }
  changed_ = true;
}

}  // namespace offstage::sim
