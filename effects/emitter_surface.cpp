#include "effects/emitter_surface.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace offstage::effects {
namespace {

constexpr Real kPi = std::numbers::pi;
/// Angle between consecutive points of a golden spiral, in units of 2^-64 of a circle: the golden ratio minus
/// 1.
constexpr uint64_t kGoldenTurn = 0x9e3779b97f4a7c15u;

// Smallest distances between points of the golden spirals, times sqrt(n). They are for the unit sphere from 5
// points on, for the unit sphere with fewer points, and for a disc of radius sqrt(n), where the first and the
// fourth point are closest.
constexpr Real kSphereGap = 3.078, kSphereGapOfFew = 2.685, kDiscGap = 1.546;

Real golden_angle(uint64_t i) {
  return 2 * kPi * 0x1p-64 * static_cast<Real>(i * kGoldenTurn);
}

uint64_t at_least_one(Real n) {
  return static_cast<uint64_t>(std::clamp(std::floor(n + 1e-9), 1.0, 1e12));
}

/// Returns a uniformly distributed random rotation (Shoemake, "Uniform random rotations", Graphics Gems III).
sim::Quat random_rotation(const std::array<Real, 3>& u) {
  const SinCos a = sincos(2 * kPi * u[1]), b = sincos(2 * kPi * u[2]);
  const Real p = std::sqrt(1 - u[0]), q = std::sqrt(u[0]);
  return {q * b.cos, p * a.sin, p * a.cos, q * b.sin};
}

}  // namespace

Vec3 perpendicular(const Vec3& n) {
  const Real sign = std::copysign(1.0, n.y()), a = -1 / (sign + n.y());
  return {1 + sign * n.x() * n.x() * a, -sign * n.x(), sign * n.x() * n.z() * a};
}

ReleaseSurface::ReleaseSurface(const EmitterSurface& surface)
    : kind_(surface.kind), size_(surface.size), radius_(surface.radius) {
  switch (kind_) {
    case SurfaceKind::plane:
      if (!(size_.x() > 0 && size_.y() > 0)) throw std::invalid_argument("surface.size must be > 0");
      area_ = size_.prod();
      reach_ = size_.norm() / 2;
      break;
    case SurfaceKind::sphere:
    case SurfaceKind::disc:
      if (!(radius_ > 0)) throw std::invalid_argument("surface.radius must be > 0");
      area_ = (kind_ == SurfaceKind::sphere ? 4 : 1) * kPi * radius_ * radius_;
      reach_ = radius_;
      break;
    case SurfaceKind::mesh:
      add_faces(surface.mesh);
      if (!(area_ > 0)) throw std::invalid_argument("surface.mesh has no area");
  }
  if (!std::isfinite(area_)) throw std::invalid_argument("surface must be finite");
}

void ReleaseSurface::add_faces(const sim::TriangleMesh& mesh) {
  for (const sim::Triangle& t : mesh.triangles) {
    for (uint32_t corner : t)
      if (corner >= mesh.vertices.size())
        throw std::invalid_argument("surface.mesh has a vertex index out of range");
    const Vec3& p = mesh.vertices[t[0]];
    const Vec3 e1 = mesh.vertices[t[1]] - p, e2 = mesh.vertices[t[2]] - p, cross = e1.cross(e2);
    const Real twice = cross.norm();
    if (!(twice > 0)) continue;
    for (uint32_t corner : t) reach_ = std::max(reach_, mesh.vertices[corner].norm());
    faces_.push_back({p, e1, e2, cross / twice, area_});
    area_ += twice / 2;
  }
}

Cells ReleaseSurface::cells(Real diameter) const {
  if (kind_ == SurfaceKind::plane)
    return {diameter, at_least_one(size_.x() / diameter), at_least_one(size_.y() / diameter)};
  if (kind_ == SurfaceKind::disc) {
    const Real gaps = kDiscGap * (radius_ / diameter - 0.5);
    return {diameter, at_least_one(gaps > 0 ? gaps * gaps : 0)};
  }
  const Real ratio = radius_ / diameter, many = std::pow(kSphereGap * ratio, 2);
  return {diameter, at_least_one(many >= 5 ? many : std::min(4.0, std::pow(kSphereGapOfFew * ratio, 2)))};
}

Place ReleaseSurface::cell(const Cells& cells, uint64_t i, const std::array<Real, 3>& turn) const {
  const auto n = static_cast<Real>(cells.nx), middle = static_cast<Real>(i) + 0.5;
  if (kind_ == SurfaceKind::disc) {
    const Real reach = std::max(0.0, radius_ - cells.diameter / 2);
    return on_disc(n > 1 ? reach * std::sqrt(middle / n) : 0, golden_angle(i) + 2 * kPi * turn[0]);
  }
  if (kind_ == SurfaceKind::sphere) {
    const sim::Quat rotation = random_rotation(turn);
    const Place p = on_sphere(1 - 2 * middle / n, golden_angle(i));
    return {rotation * p.point, rotation * p.normal, rotation * p.tangent};
  }
  const auto along = [](uint64_t k, uint64_t of, Real length) {
    return ((static_cast<Real>(k) + 0.5) / static_cast<Real>(of) - 0.5) * length;
  };
  return {Vec3(along(i % cells.nx, cells.nx, size_.x()), 0, along(i / cells.nx, cells.nz, size_.y())),
          Vec3::UnitY(), Vec3::UnitX()};
}

Place ReleaseSurface::anywhere(const std::array<Real, 3>& u, Real margin) const {
  const auto inner = [&](Real width) { return std::max(0.0, width - 2 * margin); };
  switch (kind_) {
    case SurfaceKind::plane:
      return {Vec3((u[0] - 0.5) * inner(size_.x()), 0, (u[1] - 0.5) * inner(size_.y())), Vec3::UnitY(),
              Vec3::UnitX()};
    case SurfaceKind::sphere:
      return on_sphere(1 - 2 * u[0], 2 * kPi * u[1]);
    case SurfaceKind::disc:
      return on_disc(inner(2 * radius_) / 2 * std::sqrt(u[0]), 2 * kPi * u[1]);
    default:
      return on_mesh(u);
  }
}

/// On a sphere, equal steps of height correspond to equal areas (Archimedes).
Place ReleaseSurface::on_sphere(Real height, Real angle) const {
  const SinCos a = sincos(angle);
  const Real r = std::sqrt(std::max(0.0, 1 - height * height));
  const Vec3 n(r * a.cos, height, r * a.sin);
  return {radius_ * n, n, perpendicular(n)};
}

Place ReleaseSurface::on_disc(Real r, Real angle) const {
  const SinCos a = sincos(angle);
  return {Vec3(r * a.cos, 0, r * a.sin), Vec3::UnitY(), Vec3::UnitX()};
}

Place ReleaseSurface::on_mesh(const std::array<Real, 3>& u) const {
  const auto after = std::upper_bound(faces_.begin(), faces_.end(), u[0] * area_,
                                      [](Real x, const Face& face) { return x < face.area_before; });
  const Face& face = *(after - 1);
  const Real from_corner = std::sqrt(u[1]);
  return {face.corner + from_corner * ((1 - u[2]) * face.edge1 + u[2] * face.edge2), face.normal,
          face.edge1.normalized()};
}

}  // namespace offstage::effects
