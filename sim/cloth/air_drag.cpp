#include "sim/cloth/air_drag.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace offstage::sim {
namespace {

/// Greatest product of the rate at which the air changes velocities and the time for which a linearisation is
/// kept.
constexpr Real kMostChange = 0.1;
/// Longest time for which a linearisation is kept, because normals turn [s].
constexpr Real kLongestHold = 1.0 / 240;
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
  const Real hold = std::min(kLongestHold, rate > 0 ? kMostChange / rate : kLongestHold);
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
  // N implicit steps of a linear force -J v let v fall by J t (1 - fraction J t (N + 1) / 2N): of second
  // order with this fraction of J.
  fraction_ = static_cast<Real>(held) * steps / (static_cast<Real>(held) * steps + 1);
  for (std::size_t k = first_; k < first_ + n; ++k) points.acceleration[k] = points.outer[k];
  const ClothDef& def = cloth_->def;
  const bool blows = def.air.density > 0 && (def.air.drag > 0 || def.ram_pressure > 0);
  is_active_ = blows || std::any_of(points.field_drag.begin() + static_cast<std::ptrdiff_t>(first_),
                                    points.field_drag.begin() + static_cast<std::ptrdiff_t>(first_ + n),
                                    [](Real rate) { return rate > 0; });
  if (!is_active_) return;
  resistance_.assign(n, Columns::Zero());
  from_.assign(points.velocity.begin() + static_cast<std::ptrdiff_t>(first_),
               points.velocity.begin() + static_cast<std::ptrdiff_t>(first_ + n));
  prepared_for_ = -1;
  drag_points(points);
  if (!blows) return;
  if (def.air.drag > 0) drag_triangles(points);
  if (def.ram_pressure > 0) catch_air(points);
}

void AirDrag::begin(Real h) {
  if (h == prepared_for_) return;
  prepared_for_ = h;
  response_.resize(resistance_.size());
  for (std::size_t i = 0; i < resistance_.size(); ++i) {
    response_[i].row(3).setZero();
    response_[i].topRows<3>() = (Mat3::Identity() + h * resistance(i)).inverse();
  }
}

/// Linear drag of fields and hands.
void AirDrag::drag_points(ClothPoints& points) {
  for (std::size_t i = 0; i < from_.size(); ++i) {
    const Real rate = points.field_drag[first_ + i];
    points.acceleration[first_ + i] -= rate * from_[i];
    resistance_[i].topRows<3>().diagonal().setConstant(fraction_ * rate);
  }
}

/// F = c |u| D u with D = (C_D - C_L) 1 + C_L n n^T, a third to each corner. Its derivative is c (|u| D + D u
/// u^T / |u|); with D u u^T D / u.D u in place of D u u^T it is symmetric, and exact for air along the normal
/// and along the cloth. Where air stops the triangle within the time of the linearisation, the implicit
/// fraction of the first term is increased, so that the triangle does not rebound. Together they are the
/// exact c |u| D of u / (1 + k u t) along u then as well.
void AirDrag::drag_triangles(ClothPoints& points) {
  const ClothAir& air = cloth_->def.air;
  const Vec4* const x = points.position.data();
  for (const Triangle& t : cloth_->triangles) {
    const std::size_t i = first_ + t[0], j = first_ + t[1], k = first_ + t[2];
    const Vec4 doubled = (x[j] - x[i]).cross3(x[k] - x[i]);
    const Real size = doubled.norm();
    const Vec4 wind = points.flow[i] + points.flow[j] + points.flow[k] - points.velocity[i] -
                      points.velocity[j] - points.velocity[k];
    const Vec4 u = wind / 3;
    const Real speed = u.norm();
    if (!(size > 0) || !(speed > 0)) continue;
    const Vec4 n = doubled / size;
    const Real scale = air.density * size / 4 * speed;  // c |u|
    const Vec4 along = (air.drag - air.lift) * u + air.lift * u.dot(n) * n;
    const Real braked =
        kValence * span_ * scale * air.drag / (points.mass[i] + points.mass[j] + points.mass[k]);
    const Real even = braked > 1 ? std::max(fraction_, 1 - 1 / braked) : fraction_;
    const Real power = u.dot(along), rank = power > 0 ? (2 * fraction_ - even) / power : 0;
    const Vec4 by_normal = even * air.lift * n, by_along = rank * along;
    std::array<Vec4, 3> slope;  // columns
    for (int c = 0; c < 3; ++c) slope[static_cast<std::size_t>(c)] = n[c] * by_normal + along[c] * by_along;
    for (int c = 0; c < 3; ++c) slope[static_cast<std::size_t>(c)][c] += even * (air.drag - air.lift);
    for (const std::size_t corner : {i, j, k}) {
      const Real third = scale / 3 / points.mass[corner];
      points.acceleration[corner] += third * along;
      for (int c = 0; c < 3; ++c)
        resistance_[corner - first_].col(c) += third * slope[static_cast<std::size_t>(c)];
    }
  }
}

/// An open cloth that faces the air stops the air that enters its mouth. Inside, the stagnation pressure
/// builds up, everywhere the same. A fan over its border would close the surface, whose area vectors then add
/// up to zero: the area vector of the mouth is the opposite of the cloth's. The pressure follows the mean
/// velocity; each corner has the part of its slope that belongs to its area.
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
      resistance_[corner].topRows<3>() += area.norm() * third * along;
    }
  }
}

}  // namespace offstage::sim
