#include "sim/cloth/bending.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "sim/cloth/bending_patches.h"

namespace offstage::sim {
namespace {

constexpr int kFilterIterations = 80;
/// If the square of the step times the fastest frequency is above this, conjugate gradients need so many
/// iterations that a factorisation is faster. It is used up to kMostFactorized points.
constexpr Real kManyIterations = 20;
constexpr std::size_t kMostFactorized = 30000;
/// Square of the accepted residual, as a fraction of the square of the right side.
constexpr Real kFilterTolerance2 = 1e-14;
constexpr uint32_t kNoPoint = ~0u;

/// Returns the cross product of two edges of a triangle: a vector along its normal, twice its area long.
Vec3 cross_of(const Triangle& t, std::span<const Vec4> x) {
  const Vec3 a = x[t[0]].head<3>();
  return (x[t[1]].head<3>() - a).cross(x[t[2]].head<3>() - a);
}

Real filter_dot(std::span<const Vec4> a, std::span<const Vec4> b) {
  Real sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
  return sum;
}

}  // namespace

void ClothBending::assign(std::span<const Vec3> rest, std::span<const Triangle> triangles,
                          std::span<const Real> masses, Real rigidity, Real damping, Real rest_fraction,
                          bool measures) {
  const bool needed = rigidity > 0 || measures;
  const bool known = needed && rigidity == rigidity_ && rest_fraction == rest_fraction_ &&
                     measures == measures_ && triangles.size() == triangles_.size() &&
                     rest.size() >= rest_.size() && std::equal(rest_.begin(), rest_.end(), rest.begin());
  if (!known) *this = {};
  rigidity_ = rigidity;
  damping_ = damping;
  rest_fraction_ = rest_fraction;
  measures_ = measures;
  if (!needed) return;
  if (known && std::ranges::equal(triangles, triangles_) && std::ranges::equal(masses, masses_)) return;
  std::vector<uint8_t> changed(triangles.size(), 1), moved(rest.size(), 0);
  for (std::size_t t = 0; known && t < triangles.size(); ++t) {
    changed[t] = triangles[t] != triangles_[t];
    for (uint32_t corner : triangles_[t]) moved[corner] |= changed[t];
  }
  rest_.assign(rest.begin(), rest.end());
  triangles_.assign(triangles.begin(), triangles.end());
  masses_.assign(masses.begin(), masses.end());
  clamped_.resize(triangles.size(), 0);
  build(changed, std::move(moved));
}

void ClothBending::set_clamps(std::span<const uint32_t> clamp) {
  std::vector<uint8_t> changed(triangles_.size(), 0);
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const Triangle& own = triangles_[t];
    const uint32_t holder = clamp[own[0]];
    const bool clamped = holder != 0 && clamp[own[1]] == holder && clamp[own[2]] == holder;
    changed[t] = std::exchange(clamped_[t], uint8_t{clamped}) != uint8_t{clamped};
  }
  if (std::ranges::count(changed, 1) > 0) build(changed, std::vector<uint8_t>(rest_.size(), 0));
}

/// Returns by triangle whether its patches depend on changed triangles. `near`: by point, whether it was a
/// corner of a changed triangle before the change. Gradients are recovered from up to two rings of triangles
/// around a point.
std::vector<uint8_t> ClothBending::affected(std::span<const uint8_t> changed,
                                            std::vector<uint8_t> near) const {
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    for (uint32_t corner : triangles_[t]) near[corner] |= changed[t];
  std::vector<uint8_t> result(triangles_.size(), 0);
  for (int ring = 0; ring < 3; ++ring) {
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      for (uint32_t corner : triangles_[t]) result[t] |= near[corner];
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      for (uint32_t corner : triangles_[t]) near[corner] |= result[t];
  }
  return result;
}

/// Builds the patches of changed triangles and of those that depend on them, and keeps the others. The result
/// is the same to the last bit as after building all patches. `moved_corners` is the argument `near` of
/// affected().
void ClothBending::build(std::span<const uint8_t> changed, std::vector<uint8_t> moved_corners) {
  const std::vector<uint8_t> builds = affected(changed, std::move(moved_corners));
  const auto old_patches = std::exchange(patches_, {});
  const auto old_points = std::exchange(points_, {});
  const auto old_weights = std::exchange(weights_, {});
  factor_.reset();
  BendingPatches patches(rest_, triangles_, clamped_, rest_fraction_);
  std::vector<uint8_t> rows(rest_.size(), 0);  // by point: whether its row of the matrix changes
  std::size_t old = 0;
  for (uint32_t t = 0; t < triangles_.size(); ++t) {
    for (; old < old_patches.size() && old_patches[old].triangle == t; ++old) {
      const Patch& patch = old_patches[old];
      const auto points = std::span(old_points).subspan(patch.first, patch.count);
      if (builds[t])
        for (uint32_t point : points) rows[point] = 1;
      else
        add_patch(patch, points, std::span(old_weights).subspan(patch.first, patch.count));
    }
    if (!builds[t]) continue;
    const std::optional<TrianglePatches> made = patches.of(t);
    if (!made) continue;
    for (const TrianglePatch* patch : {&made->smooth, &made->rough}) {
      std::vector<uint32_t> points;
      std::vector<Vec3> weights;
      for (const auto& [point, w] : patch->weights) {
        points.push_back(point);
        weights.push_back(w);
        rows[point] = 1;
      }
      add_patch({.triangle = t, .area = made->area, .rest = patch->rest, .divisor = patch->divisor}, points,
                weights);
    }
  }
  curved_ = std::ranges::any_of(patches_, [](const Patch& p) { return p.rest != Vec3::Zero(); });
  build_matrix(rows);
}

void ClothBending::add_patch(Patch patch, std::span<const uint32_t> points, std::span<const Vec3> weights) {
  patch.first = static_cast<uint32_t>(points_.size());
  patch.count = static_cast<uint32_t>(points.size());
  patches_.push_back(patch);
  points_.insert(points_.end(), points.begin(), points.end());
  weights_.insert(weights_.end(), weights.begin(), weights.end());
}

/// Computes the given rows of the matrix, and keeps the others. Both halves of the symmetric matrix add up
/// their entries in the order of the patches, and so stay equal to the last bit.
void ClothBending::build_matrix(std::span<const uint8_t> rows) {
  const std::size_t n = masses_.size();
  // The places of each point in points_ and weights_, and the patch of each place.
  std::vector<std::size_t> first(n + 1, 0);
  for (uint32_t point : points_) ++first[point + 1];
  for (std::size_t i = 0; i < n; ++i) first[i + 1] += first[i];
  std::vector<uint32_t> places(points_.size()), patch_of(points_.size());
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  for (uint32_t p = 0; p < patches_.size(); ++p)
    for (uint32_t a = patches_[p].first; a < patches_[p].first + patches_[p].count; ++a) {
      places[next[points_[a]]++] = a;
      patch_of[a] = p;
    }
  const auto old_row = std::exchange(row_, {0});
  const auto old_column = std::exchange(column_, {});
  const auto old_value = std::exchange(value_, {});
  diagonal_.resize(n, 0);
  row_sum_.resize(n, 0);
  std::vector<Real> entry(n, 0);
  std::vector<uint32_t> seen_in(n, kNoPoint), columns;
  for (uint32_t i = 0; i < n; ++i) {
    if (!rows[i] && i + 1 < old_row.size()) {
      for (std::size_t k = old_row[i]; k < old_row[i + 1]; ++k) {
        column_.push_back(old_column[k]);
        value_.push_back(old_value[k]);
      }
      row_.push_back(column_.size());
      continue;
    }
    columns.clear();
    diagonal_[i] = row_sum_[i] = 0;
    for (std::size_t at = first[i]; at < first[i + 1]; ++at) {
      const uint32_t a = places[at];
      const Patch& patch = patches_[patch_of[a]];
      for (uint32_t b = patch.first; b < patch.first + patch.count; ++b) {
        const uint32_t column = points_[b];
        if (std::exchange(seen_in[column], i) != i) {
          entry[column] = 0;
          columns.push_back(column);
        }
        entry[column] += rigidity_ * patch.area * weights_[a].dot(weights_[b]);
      }
    }
    std::ranges::sort(columns);
    for (uint32_t column : columns) {
      row_sum_[i] += std::abs(entry[column]);
      if (column == i) {
        diagonal_[i] = entry[i];
      } else if (entry[column] != 0) {
        column_.push_back(column);
        value_.push_back(entry[column]);
      }
    }
    row_.push_back(column_.size());
  }
  upper_column_.clear();
  upper_value_.clear();
  upper_row_ = {0};
  for (uint32_t i = 0; i < n; ++i) {
    for (std::size_t k = row_[i]; k < row_[i + 1]; ++k) {
      if (column_[k] < i) continue;
      upper_column_.push_back(column_[k]);
      upper_value_.push_back(value_[k]);
    }
    upper_row_.push_back(upper_column_.size());
  }
  fastest_ = 0;
  for (std::size_t i = 0; i < n; ++i) fastest_ = std::max(fastest_, row_sum_[i] / masses_[i]);
}

void ClothBending::multiply(std::span<const Vec4> p, Real scale, std::span<Vec4> y) const {
  for (std::size_t i = 0; i + 1 < upper_row_.size(); ++i) {
    // Differences of positions make the result independent of the cloth's place. There are two sums, because
    // each addition to a single sum would wait for the previous one.
    const Vec4 own = p[i];
    Vec4 a = Vec4::Zero(), b = a;
    const auto couple = [&](std::size_t k, Vec4& sum) {
      const uint32_t other = upper_column_[k];
      const Vec4 force = scale * upper_value_[k] * (p[other] - own);
      sum += force;
      y[other] -= force;
    };
    std::size_t k = upper_row_[i];
    for (const std::size_t end = upper_row_[i + 1]; k + 2 <= end; k += 2) {
      couple(k, a);
      couple(k + 1, b);
    }
    if (k < upper_row_[i + 1]) couple(k, a);
    y[i] += a + b;
  }
}

void ClothBending::add_forces(std::span<const Vec4> x, Real scale, std::span<Vec4> f) const {
  multiply(x, -scale, f);
  if (curved_) add_rest_forces(x, scale, f);
}

void ClothBending::add_damped_forces(std::span<const Vec4> x, std::span<const Vec4> v, Real rate,
                                     std::span<Vec4> f) {
  if (damping_ == 0) return add_forces(x, 1, f);
  image_.resize(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) image_[i] = x[i] + damping_ * rate * v[i];
  multiply(image_, -1, f);
  if (curved_) add_rest_forces(x, 1, f);
}

/// Adds the forces by the term -n b0 of the energy. They act along the normal: on all points of a patch, and
/// on the triangle's own corners because its normal turns with them.
void ClothBending::add_rest_forces(std::span<const Vec4> x, Real scale, std::span<Vec4> f) const {
  for (const Patch& patch : patches_) {
    if (patch.rest == Vec3::Zero()) continue;
    const Triangle& own = triangles_[patch.triangle];
    const Vec3 a = x[own[0]].head<3>(), b = x[own[1]].head<3>(), c = x[own[2]].head<3>();
    const Vec3 cross = (b - a).cross(c - a);
    const Real size2 = cross.squaredNorm();
    if (!(size2 > 0)) continue;
    const Vec3 n = cross / std::sqrt(size2);
    const Real moment = scale * rigidity_ * patch.area;
    Vec3 curvature = Vec3::Zero();  // b0 : H x
    for (uint32_t k = patch.first; k < patch.first + patch.count; ++k) {
      const Real weight = patch.rest.dot(weights_[k]);
      curvature += weight * (x[points_[k]].head<3>() - a);
      f[points_[k]] += padded(moment * weight * n);
    }
    // The gradient of a corner's barycentric coordinate in the plane is n x (opposite edge) / |cross|.
    const std::array<Vec3, 3> edges = {c - b, a - c, b - a};
    for (std::size_t k = 0; k < 3; ++k)
      f[own[k]] -= padded(moment * n.cross(edges[k]).dot(curvature) / std::sqrt(size2) * n);
  }
}

/// Returns the curvature H x - n b0 of a patch, where n is the normal of its triangle.
Mat3 ClothBending::excess_curvature(const Patch& patch, std::span<const Vec4> x, const Vec3& normal) const {
  const Vec3 a = x[triangles_[patch.triangle][0]].head<3>();
  Mat3 h = Mat3::Zero();
  for (uint32_t k = patch.first; k < patch.first + patch.count; ++k)
    h += (x[points_[k]].head<3>() - a) * weights_[k].transpose();
  return h - normal * patch.rest.transpose();
}

Real ClothBending::energy(std::span<const Vec4> x) const {
  Real sum = 0;
  for (const Patch& patch : patches_) {
    const Vec3 normal = cross_of(triangles_[patch.triangle], x).stableNormalized();
    sum += rigidity_ * patch.area / 2 * excess_curvature(patch, x, normal).squaredNorm();
  }
  return sum;
}

Real ClothBending::curvature(std::size_t index, std::span<const Vec4> x) const {
  const Patch& patch = patches_[index];
  const bool flat = patch.rest == Vec3::Zero();
  const Vec3 normal = flat ? Vec3(Vec3::Zero()) : cross_of(triangles_[patch.triangle], x).stableNormalized();
  const Real norm = excess_curvature(patch, x, normal).norm();
  return norm / patch.divisor;
}

void ClothBending::add_gradient(std::size_t index, std::span<const Vec4> x,
                                std::vector<std::pair<uint32_t, Vec4>>& gradient) const {
  const Patch& patch = patches_[index];
  const Triangle& own = triangles_[patch.triangle];
  const Vec3 cross = cross_of(own, x), n = cross.stableNormalized();
  const Mat3 excess = excess_curvature(patch, x, n);
  const Real norm = excess.norm();
  if (!(norm > 0)) return;
  const Mat3 direction = excess / (norm * patch.divisor);
  for (uint32_t k = patch.first; k < patch.first + patch.count; ++k)
    gradient.emplace_back(points_[k], padded(direction * weights_[k]));
  if (patch.rest == Vec3::Zero() || !(cross.squaredNorm() > 0)) return;
  // This part is due to the rotation of the normal, as in add_rest_forces().
  const Vec3 turning = direction * patch.rest;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 edge = (x[own[(k + 2) % 3]] - x[own[(k + 1) % 3]]).head<3>();
    gradient.emplace_back(own[k], padded(n.cross(edge).dot(turning) / cross.norm() * n));
  }
}

/// Factorizes M + stiff K, unless the last factor has the same values. Lengths of equal steps may differ by
/// rounding, so `stiff` is compared in single precision.
void ClothBending::factorize(std::span<const Real> masses, std::span<const Real> inverse_masses, Real stiff) {
  const auto rounded = static_cast<float>(stiff);
  if (factor_ && factor_stiff_ == rounded && std::ranges::equal(factor_masses_, inverse_masses)) return;
  factor_stiff_ = rounded;
  factor_masses_.assign(inverse_masses.begin(), inverse_masses.end());
  const auto moves = [&](std::size_t i) { return inverse_masses[i] > 0; };
  std::vector<Eigen::Triplet<Real>> entries;
  for (std::size_t i = 0; i < masses.size(); ++i) {
    const auto row = static_cast<int>(i);
    entries.emplace_back(row, row, moves(i) ? masses[i] + Real{rounded} * diagonal_[i] : 1);
    for (std::size_t k = row_[i]; moves(i) && k < row_[i + 1]; ++k)
      if (moves(column_[k]))
        entries.emplace_back(row, static_cast<int>(column_[k]), Real{rounded} * value_[k]);
  }
  Eigen::SparseMatrix<Real> matrix(static_cast<int>(masses.size()), static_cast<int>(masses.size()));
  matrix.setFromTriplets(entries.begin(), entries.end());
  factor_ = std::make_shared<Factor>(matrix);
}

void ClothBending::filter_directly(std::span<const Real> inverse_masses, std::span<Vec4> moves) {
  Eigen::Matrix<Real, Eigen::Dynamic, 3> right(moves.size(), 3);
  right.setZero();
  for (std::size_t i = 0; i < moves.size(); ++i)
    if (inverse_masses[i] > 0) right.row(static_cast<Eigen::Index>(i)) = residual_[i].head<3>().transpose();
  right = factor_->solve(right).eval();
  for (std::size_t i = 0; i < moves.size(); ++i)
    moves[i].head<3>() += right.row(static_cast<Eigen::Index>(i)).transpose();
}

bool ClothBending::filter(std::span<const Real> masses, std::span<const Real> inverse_masses, Real stiff,
                          std::span<Vec4> moves) {
  const std::size_t n = moves.size();
  residual_.assign(n, Vec4::Zero());
  image_.resize(n);
  direction_.resize(n);
  multiply(moves, -stiff, residual_);  // M moves - (M + stiff K) moves
  if (stiff * fastest_ > kManyIterations && n <= kMostFactorized) {
    factorize(masses, inverse_masses, stiff);
    filter_directly(inverse_masses, moves);
    return true;
  }
  Real scale = 0, rr = 0;
  // The masses alone are the preconditioner, so that every iteration keeps the momentum.
  const auto precondition = [&](const Vec4& r, std::size_t i) { return Vec4(r / masses[i]); };
  for (std::size_t i = 0; i < n; ++i) {
    if (!(inverse_masses[i] > 0)) residual_[i].setZero();
    direction_[i] = precondition(residual_[i], i);
    rr += residual_[i].dot(direction_[i]);
    scale += masses[i] * moves[i].squaredNorm();
  }
  for (int iteration = 0; iteration < kFilterIterations; ++iteration) {
    if (!(rr > kFilterTolerance2 * scale)) return true;
    for (std::size_t i = 0; i < n; ++i) image_[i] = masses[i] * direction_[i];
    multiply(direction_, stiff, image_);
    for (std::size_t i = 0; i < n; ++i)
      if (!(inverse_masses[i] > 0)) image_[i].setZero();
    const Real step = rr / filter_dot(direction_, image_);
    Real next = 0;
    for (std::size_t i = 0; i < n; ++i) {
      moves[i] += step * direction_[i];
      residual_[i] -= step * image_[i];
      image_[i] = precondition(residual_[i], i);
      next += residual_[i].dot(image_[i]);
    }
    for (std::size_t i = 0; i < n; ++i) direction_[i] = image_[i] + next / rr * direction_[i];
    rr = next;
  }
  return false;
}

}  // namespace offstage::sim
