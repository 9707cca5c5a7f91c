#include "render/opacity_grid.h"

#include <algorithm>
#include <cmath>

namespace offstage::render {
namespace {

constexpr int kOpacityCells = 72;  // number of cells along the longest side
// Greatest number of cells per radius of a typical puff. Finer cells would show single puffs.
constexpr float kCellsPerRadius = 2;

// Corners of a tetrahedron: four points that represent the volume of a puff.
const std::array<Vector3f, 4> kCorners = {Vector3f(1, 1, 1), Vector3f(1, -1, -1), Vector3f(-1, 1, -1),
                                          Vector3f(-1, -1, 1)};

Eigen::Matrix3f axes_along(const Vector3f& away) {
  const Vector3f other = std::abs(away.y()) < 0.99f ? Vector3f::UnitY() : Vector3f::UnitX();
  Eigen::Matrix3f axes;
  axes.row(0) = other.cross(away).normalized().transpose();
  axes.row(1) = away.cross(Vector3f(axes.row(0).transpose())).transpose();
  axes.row(2) = away.transpose();
  return axes;
}

}  // namespace

void OpacityGrid::fit(std::span<const Absorber> absorbers, const Vector3f& away) {
  axes_ = axes_along(away);
  Eigen::AlignedBox3f box;
  double area = 0, volume = 0;
  for (const Absorber& a : absorbers) {
    const Vector3f center = axes_ * a.position, reach = Vector3f::Constant(a.radius);
    box.extend(center - reach).extend(center + reach);
    area += static_cast<double>(a.radius) * static_cast<double>(a.radius);
    volume += static_cast<double>(a.radius) * static_cast<double>(a.radius) * static_cast<double>(a.radius);
  }
  const float typical = static_cast<float>(volume / area);
  const float needed = std::max(box.sizes().maxCoeff() / (kOpacityCells - 4), typical / kCellsPerRadius);
  // The cell size changes in steps, and the corner is at a multiple of the cell size. Otherwise the shadow
  // would flicker while the smoke grows.
  cell_ = std::exp2(std::ceil(4 * std::log2(needed)) / 4);
  const Vector3f low = ((box.min() / cell_).array().floor() - 1).matrix();
  const Vector3f high = ((box.max() / cell_).array().ceil() + 1).matrix();
  origin_ = axes_.transpose() * (low * cell_);
  const Eigen::Vector3i count = (high - low).cast<int>().cwiseMax(3).cwiseMin(2 * kOpacityCells);
  nx_ = count.x();
  ny_ = count.y();
  nz_ = count.z();
}

void OpacityGrid::deposit(const Vector3f& place, float depth) {
  const Vector3f p = local(place) - Vector3f::Constant(0.5f);  // relative to the cell centres
  const int x = std::clamp(static_cast<int>(p.x()), 0, nx_ - 2),
            y = std::clamp(static_cast<int>(p.y()), 0, ny_ - 2),
            z = std::clamp(static_cast<int>(p.z()), 0, nz_ - 2);
  const Vector3f f = (p - Vector3f(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)))
                         .cwiseMax(0.0f)
                         .cwiseMin(1.0f);
  for (int k = 0; k < 2; ++k) {
    for (int j = 0; j < 2; ++j) {
      const float fraction = depth * (k != 0 ? f.z() : 1 - f.z()) * (j != 0 ? f.y() : 1 - f.y());
      float* row = amounts_.data() + (static_cast<std::ptrdiff_t>(z + k) * ny_ + y + j) * nx_ + x;
      row[0] += fraction * (1 - f.x());
      row[1] += fraction * f.x();
    }
  }
}

float sun_fraction_in_smoke(float depth, float albedo) {
  return 0.68f * std::exp(-depth) +
         albedo * (0.3f * std::exp(-0.35f * depth) + 0.12f * albedo * std::exp(-0.1f * depth));
}

void OpacityGrid::build(std::span<const Absorber> absorbers, const Vector3f& away) {
  sums_.clear();
  amounts_.clear();
  if (absorbers.empty()) return;
  fit(absorbers, away);
  const auto layer = static_cast<std::size_t>(nx_ * ny_);
  amounts_.assign(layer * static_cast<std::size_t>(nz_), 0);
  const float per_area = 1 / (cell_ * cell_);
  for (const Absorber& a : absorbers) {
    const float depth = a.section * per_area;
    if (a.radius < 0.6f * cell_) {
      deposit(a.position, depth);
    } else {
      for (const Vector3f& corner : kCorners) deposit(a.position + 0.35f * a.radius * corner, 0.25f * depth);
    }
  }
  sums_.assign(layer * static_cast<std::size_t>(nz_ + 1), 0);
  for (std::size_t i = 0; i < amounts_.size(); ++i) sums_[i + layer] = sums_[i] + amounts_[i];
}

float OpacityGrid::trilinear(const std::vector<float>& values, int slices, Vector3f p) const {
  p = p.cwiseMax(0.0f).cwiseMin(
      Vector3f(static_cast<float>(nx_ - 1), static_cast<float>(ny_ - 1), static_cast<float>(slices - 1)));
  const int x = std::min(static_cast<int>(p.x()), nx_ - 2), y = std::min(static_cast<int>(p.y()), ny_ - 2),
            z = std::min(static_cast<int>(p.z()), slices - 2);
  const float fx = p.x() - static_cast<float>(x), fy = p.y() - static_cast<float>(y),
              fz = p.z() - static_cast<float>(z);
  const float* v = values.data() + (static_cast<std::ptrdiff_t>(z) * ny_ + y) * nx_ + x;
  const auto mix = [](float a, float b, float t) { return a + t * (b - a); };
  const auto face = [&](const float* c) { return mix(mix(c[0], c[1], fx), mix(c[nx_], c[nx_ + 1], fx), fy); };
  return mix(face(v), face(v + static_cast<std::ptrdiff_t>(nx_) * ny_), fz);
}

float OpacityGrid::depth(const Vector3f& place) const {
  return empty() ? 0 : trilinear(sums_, nz_ + 1, local(place) - Vector3f(0.5f, 0.5f, 0));
}

float OpacityGrid::density(const Vector3f& place) const {
  return empty() ? 0 : trilinear(amounts_, nz_, local(place) - Vector3f::Constant(0.5f)) / cell_;
}

}  // namespace offstage::render
