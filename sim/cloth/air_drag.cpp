#include "sim/cloth/air_drag.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sim/cloth/cloth_springs.h"
#include "sim/cloth/four_vectors.h"

namespace offstage::sim {
namespace {

/// A linearisation is kept until the air may have changed the velocities by this fraction.
constexpr Real kMostChange = 0.1;
/// Longest time for which a linearisation is kept, because normals turn [s]; and the greatest angle by which
/// a triangle may turn in this time [rad]. Lift with an old normal does work on the rotation.
constexpr Real kLongestHold = 1.0 / 240, kHeldTurn = 1;
/// Number of triangles at a point of a regular mesh.
constexpr Real kValence = 6;

}  // namespace

void AirDrag::assign(const Cloth& cloth, std::size_t first) {
  cloth_ = &cloth;
  first_ = first;
  left_ = 0;
  is_active_ = false;
  std::vector<Real> area(cloth.points.size(), 0);
  for (const Triangle& t : cloth.triangles) {
    const Vec3& a = cloth.points[t[0]];
    const Real third = (cloth.points[t[1]] - a).cross(cloth.points[t[2]] - a).norm() / 6;
    for (uint32_t corner : t) area[corner] += third;
  }
  mobility_.clear();
  for (const Triangle& t : cloth.triangles)
    mobility_.push_back(kValence / (cloth.masses[t[0]] + cloth.masses[t[1]] + cloth.masses[t[2]]));
  lightness_ = 0;
  for (std::size_t i = 0; i < area.size(); ++i) lightness_ = std::max(lightness_, area[i] / cloth.masses[i]);
}

uint32_t AirDrag::substeps_until_change(const ClothPoints& points, Real dt) const {
  const ClothDef& def = cloth_->def;
  Real speed2 = 0, field = 0;
  for (std::size_t k = first_; k < first_ + cloth_->points.size(); ++k) {
    speed2 = std::max(speed2, (points.flow[k] - points.velocity[k]).squaredNorm());
    field = std::max(field, points.field_drag[k]);
  }
  const Real rate =
      std::max(def.air.drag, def.ram_pressure) * def.air.density / 2 * std::sqrt(speed2) * lightness_ + field;
  const Real turning = fastest_spring_rate(points, cloth_->springs, first_);
  Real hold = std::min(kLongestHold, rate > 0 ? kMostChange / rate : kLongestHold);
  if (turning > 0) hold = std::min(hold, kHeldTurn / turning);
  return static_cast<uint32_t>(std::max(1.0, std::floor(hold / dt * (1 + 1e-9))));
}

void AirDrag::renew(ClothPoints& points, Real dt, uint32_t substeps, uint32_t steps) {
  if (left_ > 0) {
    --left_;
    return;
  }
  const std::size_t n = cloth_->points.size();
  const uint32_t held = std::min(substeps, substeps_until_change(points, dt));
  left_ = held - 1;
  span_ = held * dt;
  // N implicit steps of a linear force -J v reduce v by the factor 1 - J t (1 - fraction J t (N + 1) / 2N).
  // The reduction is of second order with this fraction of J.
  fraction_ = static_cast<Real>(held) * steps / (static_cast<Real>(held) * steps + 1);
  for (std::size_t k = first_; k < first_ + n; ++k) points.acceleration[k] = points.outer[k];
  const ClothDef& def = cloth_->def;
  const bool blows = def.air.density > 0 && (def.air.drag > 0 || def.ram_pressure > 0);
  is_active_ = blows || std::any_of(points.field_drag.begin() + static_cast<std::ptrdiff_t>(first_),
                                    points.field_drag.begin() + static_cast<std::ptrdiff_t>(first_ + n),
                                    [](Real rate) { return rate > 0; });
  if (!is_active_) return;
  resistance_.assign(n, {});
  from_.assign(points.velocity.begin() + static_cast<std::ptrdiff_t>(first_),
               points.velocity.begin() + static_cast<std::ptrdiff_t>(first_ + n));
  prepared_for_ = -1;
  if (blows && def.air.drag > 0) drag_triangles(points);
  drag_points(points);
  if (blows && def.ram_pressure > 0) catch_air(points);
}

void AirDrag::begin(Real h) {
  if (h == prepared_for_) return;
  prepared_for_ = h;
  loss_.resize(resistance_.size());
  for (std::size_t i = 0; i < resistance_.size(); ++i) {
    const auto& r = resistance_[i].at;
    const Real xx = 1 + h * r[0], yy = 1 + h * r[1], zz = 1 + h * r[2], xy = h * r[4], yz = h * r[5],
               zx = h * r[6];
    // The inverse is computed from cofactors.
    const Real a = yy * zz - yz * yz, b = zx * yz - xy * zz, c = xy * yz - yy * zx;
    const Real scale = 1 / (xx * a + xy * b + zx * c);
    const auto loss = [&](Real cofactor) { return static_cast<float>(1 - scale * cofactor); };
    const auto across = [&](Real cofactor) { return static_cast<float>(-scale * cofactor); };
    loss_[i].at = {loss(a),
                   loss(xx * zz - zx * zx),
                   loss(xx * yy - xy * xy),
                   0,
                   across(b),
                   across(xy * zx - xx * yz),
                   across(c),
                   0};
  }
}

/// Adds the linear drag of fields.
void AirDrag::drag_points(ClothPoints& points) {
  for (std::size_t i = 0; i < from_.size(); ++i) {
    const Real rate = points.field_drag[first_ + i];
    if (!(rate > 0)) continue;
    points.acceleration[first_ + i] -= rate * from_[i];
    resistance_[i].add(fraction_ * rate * Mat3::Identity());
  }
}

/// Adds the force of the air on each triangle: F = c |u| D u with D = (C_D - C_L) 1 + C_L n n^T, a third to
/// each corner. The exact derivative is c (|u| D + D u u^T / |u|). Here D u u^T D / u.D u replaces D u u^T,
/// which makes the derivative symmetric, and keeps it exact for air along the normal and along the cloth.
/// Where air stops the triangle within the time of the linearisation, the implicit fraction of the first term
/// is increased, so that the triangle does not rebound. With both terms the result is exact along u, too: the
/// velocity falls as u / (1 + k u t). Four triangles are computed at a time, one in each lane of a register.
void AirDrag::drag_triangles(ClothPoints& points) {
  const std::size_t n = from_.size();
  wind_.resize(n);
  force_.assign(n, Vec4::Zero());
  for (std::size_t i = 0; i < n; ++i) wind_[i] = points.flow[first_ + i] - points.velocity[first_ + i];
  const auto& triangles = cloth_->triangles;
  for (std::size_t t = 0; t < triangles.size(); t += 4)
    drag_triangles(points, t, std::min<std::size_t>(4, triangles.size() - t));
  for (std::size_t i = 0; i < n; ++i) {
    const Real inverse = 1 / points.mass[first_ + i];
    points.acceleration[first_ + i] += inverse * force_[i];
    for (float& entry : resistance_[i].at) entry *= static_cast<float>(inverse);
  }
}

/// Adds the forces on `count` triangles, from index `first` on, and their derivatives to their corners.
void AirDrag::drag_triangles(const ClothPoints& points, std::size_t first, std::size_t count) {
  const ClothAir& air = cloth_->def.air;
  const auto& triangles = cloth_->triangles;
  std::array<std::array<uint32_t, 4>, 3> corner;
  Lanes mobility = {};
  for (std::size_t lane = 0; lane < 4; ++lane) {
    const std::size_t t = first + std::min(lane, count - 1);
    for (std::size_t k = 0; k < 3; ++k) corner[k][lane] = triangles[t][k];
    mobility[static_cast<int>(lane)] = mobility_[t];
  }
  const auto place = [&](std::size_t k) {
    return FourVectors::of(points.position.data() + first_, corner[k]);
  };
  const auto wind = [&](std::size_t k) { return FourVectors::of(wind_.data(), corner[k]); };
  const Lanes none = {}, one = none + 1.0;
  const FourVectors doubled = (place(1) - place(0)).cross(place(2) - place(0));
  const FourVectors u = (wind(0) + wind(1) + wind(2)) * (one / 3);
  const Lanes size = lane_root(doubled.dot(doubled)), speed = lane_root(u.dot(u));
  const FourVectors n = doubled * (size > none ? one / size : none);
  const Lanes scale = air.density / 4 * size * speed;  // c |u|
  const FourVectors along = u * (none + (air.drag - air.lift)) + n * (air.lift * u.dot(n));
  const Lanes braked = span_ * air.drag * scale * mobility;
  const Lanes even = lane_max(one - one / braked, none + fraction_);
  const Lanes power = u.dot(along), rank = power > none ? (2 * fraction_ - even) / power : none;
  const Lanes third = scale / 3, by_normal = third * even * air.lift, by_along = third * rank,
              by_all = third * even * (air.drag - air.lift);
  const auto slope = [&](Lanes n1, Lanes n2, Lanes along1, Lanes along2) {
    return by_normal * n1 * n2 + by_along * along1 * along2;
  };
  const auto force = (along * third).apart();
  const auto diagonal =
      FourVectors{slope(n.x, n.x, along.x, along.x) + by_all, slope(n.y, n.y, along.y, along.y) + by_all,
                  slope(n.z, n.z, along.z, along.z) + by_all}
          .apart();
  const auto beside = FourVectors{slope(n.x, n.y, along.x, along.y), slope(n.y, n.z, along.y, along.z),
                                  slope(n.z, n.x, along.z, along.x)}
                          .apart();
  for (std::size_t lane = 0; lane < count; ++lane) {
    const __m256 slopes = _mm256_set_m128(_mm256_cvtpd_ps(beside[lane]), _mm256_cvtpd_ps(diagonal[lane]));
    for (std::size_t k = 0; k < 3; ++k) {
      Real* const sum = force_[corner[k][lane]].data();
      _mm256_store_pd(sum, _mm256_load_pd(sum) + force[lane]);
      float* const at = resistance_[corner[k][lane]].at.data();
      _mm256_store_ps(at, _mm256_add_ps(_mm256_load_ps(at), slopes));
    }
  }
}

/// Adds the pressure inside an open cloth that faces the air. Its mouth stops the air that enters, and the
/// stagnation pressure builds up, equal everywhere inside. A fan over the border would close the surface, and
/// the area vectors of a closed surface add up to zero. So the area vector of the mouth is the opposite of
/// the cloth's. The pressure follows the mean velocity; its derivative is distributed over the corners by
/// their areas.
void AirDrag::catch_air(ClothPoints& points) {
  const ClothDef& def = cloth_->def;
  Vec3 cap = Vec3::Zero();
  Real total = 0, mass = 0;
  const auto area_of = [&](const Triangle& t) -> Vec3 {
    const Vec3 a = points.at(first_ + t[0]);
    return (points.at(first_ + t[1]) - a).cross(points.at(first_ + t[2]) - a) / 2;
  };
  for (const Triangle& t : cloth_->triangles) {
    const Vec3 area = area_of(t);
    cap += area;
    total += area.norm();
  }
  Vec4 stream = Vec4::Zero();
  for (std::size_t i = 0; i < from_.size(); ++i) {
    stream += points.mass[first_ + i] * (points.flow[first_ + i] - from_[i]);
    mass += points.mass[first_ + i];
  }
  const Real mouth = cap.norm();
  if (!(mouth > 0)) return;
  const Vec3 m = cap / mouth;
  const Real speed = m.dot(stream.head<3>()) / mass;
  if (!(speed > 0)) return;
  const Real slope = def.ram_pressure * def.air.density / 2 * speed, pressure = slope * speed;
  const Mat3 along = 2 * fraction_ * slope * mouth / total * m * m.transpose();
  for (const Triangle& t : cloth_->triangles) {
    const Vec3 area = area_of(t);
    for (const uint32_t corner : t) {
      const Real third = 1 / (3 * points.mass[first_ + corner]);
      points.acceleration[first_ + corner] += padded(pressure * third * area);
      resistance_[corner].add(area.norm() * third * along);
    }
  }
}

}  // namespace offstage::sim
