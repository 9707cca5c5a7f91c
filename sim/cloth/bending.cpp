#include "sim/cloth/bending.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include <Eigen/QR>

namespace offstage::sim {
namespace {

/// Limit of the gradient's greatest weight times the size of the fan. With a greater weight, the points lie
/// so near to a conic that they do not determine a quadratic polynomial.
constexpr Real kLargestWeight = 4;
/// Weight of the energy of the jump patches, relative to the weight of the energy of the recovered patches.
/// The second derivatives by jumps resist shapes that alternate from point to point. Second derivatives by
/// recovered gradients are zero for such shapes.
constexpr Real kJumpFraction = 0.05;
/// Divisor of the curvature that is computed from the weights of a jump patch. The weights contain the factor
/// sqrt(kJumpFraction), and the other factor 2 makes the curvature of such patches count half. Next to a
/// border or a crease of a smooth surface, the curvature by jumps can be too large by as much as the
/// curvature itself.
const Real kRoughCounts = 2 * std::sqrt(kJumpFraction);
/// Weight of the energy of a clamp patch, relative to the weight of the energy of the recovered patches. In a
/// beam whose deflection is a cubic polynomial in each cell, it is 12. A cantilever of 10 cells sags by the
/// same with 3 and 12, within 0.1 %, but 12 would need shorter steps.
constexpr Real kClampFraction = 3;
constexpr int kFilterIterations = 80;
/// If the square of the step times the fastest frequency is above this, conjugate gradients need so many
/// iterations that a factorisation is faster. It is used up to kMostFactorized points.
constexpr Real kManyIterations = 20;
constexpr std::size_t kMostFactorized = 30000;
/// Square of the accepted residual, as a fraction of the square of the right side.
constexpr Real kFilterTolerance2 = 1e-14;
/// A triangle is flat at rest if its curvature times its size is below this.
constexpr Real kFlatAtRest = 1e-7;
constexpr uint32_t kNoTriangle = ~0u, kNoPoint = ~0u;

using Vec2 = Eigen::Vector2d;
/// Weight of each point in a gradient, and in the second derivatives (xx, yy, sqrt(2) xy).
using GradientWeights = std::map<uint32_t, Vec2>;
using HessianWeights = std::map<uint32_t, Vec3>;

struct FlatPoint {
  uint32_t point;
  Vec2 place;
};
/// A triangle after it was unfolded into a plane.
struct FlatTriangle {
  uint32_t triangle;
  std::array<Vec2, 3> corners;
};

/// Adds `scale` times the gradient of the linear function on a triangle.
void add_gradient(const Triangle& t, const std::array<Vec2, 3>& corners, Real scale,
                  GradientWeights& weights) {
  const Vec2 b = corners[1] - corners[0], c = corners[2] - corners[0];
  const Real doubled = b.x() * c.y() - b.y() * c.x();
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2 side = corners[(k + 2) % 3] - corners[(k + 1) % 3];
    weights.try_emplace(t[k], Vec2::Zero()).first->second += scale / doubled * Vec2(-side.y(), side.x());
  }
}

/// A cloth at rest. Its triangles can be unfolded into the plane of any one of them.
class Unfolding {
 public:
  Unfolding(std::span<const Vec3> rest, std::span<const Triangle> triangles)
      : rest_(rest), triangles_(triangles) {
    struct Side {
      std::pair<uint32_t, uint32_t> ends;
      uint32_t triangle, corner;
    };
    std::vector<Side> sides;
    sides.reserve(3 * triangles.size());
    first_at_.assign(rest.size(), kNoTriangle);
    for (uint32_t t = 0; t < triangles.size(); ++t)
      for (uint32_t k = 0; k < 3; ++k) {
        sides.push_back({std::minmax(triangles[t][k], triangles[t][(k + 1) % 3]), t, k});
        if (first_at_[triangles[t][k]] == kNoTriangle) first_at_[triangles[t][k]] = t;
      }
    std::ranges::sort(sides, {}, [](const Side& s) { return std::pair(s.ends, s.triangle); });
    neighbours_.assign(triangles.size(), {kNoTriangle, kNoTriangle, kNoTriangle});
    for (std::size_t i = 0, end; i < sides.size(); i = end) {
      for (end = i + 1; end < sides.size() && sides[end].ends == sides[i].ends; ++end) {
      }
      if (end - i != 2) continue;
      neighbours_[sides[i].triangle][sides[i].corner] = sides[i + 1].triangle;
      neighbours_[sides[i + 1].triangle][sides[i + 1].corner] = sides[i].triangle;
    }
  }

  /// Returns a triangle in its own plane: the first corner is at the origin, and the first edge is along x.
  FlatTriangle own_plane(uint32_t t) const {
    const Triangle& own = triangles_[t];
    const Vec3 ab = rest_[own[1]] - rest_[own[0]], ac = rest_[own[2]] - rest_[own[0]];
    const Real length = ab.norm(), along = ab.dot(ac) / length;
    return {t, {Vec2::Zero(), Vec2(length, 0), Vec2(along, ab.cross(ac).norm() / length)}};
  }
  uint32_t neighbour(uint32_t t, std::size_t k) const { return neighbours_[t][k]; }

  /// Returns the triangles around a point, unfolded into the plane of one of them. With `wide` it adds the
  /// triangles around their points.
  std::vector<FlatTriangle> fan(uint32_t point, bool wide) const {
    std::vector<FlatTriangle> found;
    if (first_at_[point] == kNoTriangle) return found;
    std::vector<uint32_t> around = {point};
    found.push_back(own_plane(first_at_[point]));
    for (int ring = 0; ring < (wide ? 2 : 1); ++ring) {
      for (std::size_t i = 0; i < found.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
          const uint32_t u = neighbours_[found[i].triangle][k];
          if (u == kNoTriangle || std::ranges::find(found, u, &FlatTriangle::triangle) != found.end())
            continue;
          const auto is_near = [&](uint32_t p) { return std::ranges::find(around, p) != around.end(); };
          if (std::ranges::none_of(triangles_[u], is_near)) continue;
          found.push_back(unfold(u, found[i], k));
        }
      for (const FlatTriangle& f : found)
        for (uint32_t p : triangles_[f.triangle])
          if (std::ranges::find(around, p) == around.end()) around.push_back(p);
    }
    return found;
  }

  /// Unfolds triangle u, the neighbour across edge k of the unfolded triangle `from`.
  FlatTriangle unfold(uint32_t u, const FlatTriangle& from, std::size_t k) const {
    const Triangle& t = triangles_[from.triangle];
    FlatTriangle result{u, {}};
    const std::size_t next = (k + 1) % 3, last = (k + 2) % 3;
    const Vec2 origin = from.corners[k], edge = (from.corners[next] - origin).normalized();
    Vec2 outward(edge.y(), -edge.x());
    if (outward.dot(from.corners[last] - origin) > 0) outward = -outward;
    for (std::size_t j = 0; j < 3; ++j) {
      const uint32_t point = triangles_[u][j];
      if (point == t[k] || point == t[next]) {
        result.corners[j] = from.corners[point == t[k] ? k : next];
        continue;
      }
      const Vec3 side = (rest_[t[next]] - rest_[t[k]]).normalized(), to = rest_[point] - rest_[t[k]];
      const Real along = side.dot(to), away = side.cross(to).norm();
      result.corners[j] = origin + along * edge + away * outward;
    }
    return result;
  }

 private:
  std::span<const Vec3> rest_;
  std::span<const Triangle> triangles_;
  std::vector<std::array<uint32_t, 3>> neighbours_;
  std::vector<uint32_t> first_at_;  // by point: one of its triangles
};

/// The weights of the gradient at a point, in the plane of the first triangle of its fan.
struct Recovered {
  std::vector<FlatTriangle> fan;
  GradientWeights weights;
  bool clamped = false;  // whether it is the gradient of clamped triangles
};

/// Fits a quadratic polynomial to the values at the points. Returns the weights of the points in its gradient
/// at the first point, or nothing if the points do not determine a polynomial.
std::optional<GradientWeights> polynomial_gradient(std::span<const FlatPoint> points) {
  if (points.size() < 6) return {};
  Real size = 0;
  for (const FlatPoint& p : points) size = std::max(size, (p.place - points[0].place).norm());
  Eigen::MatrixXd basis(points.size(), 6);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec2 p = (points[i].place - points[0].place) / size;
    basis.row(static_cast<Eigen::Index>(i)) << 1, p.x(), p.y(), p.x() * p.x(), p.y() * p.y(), p.x() * p.y();
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(basis);
  if (qr.rank() < 6) return {};
  const Eigen::MatrixXd inverse = qr.solve(Eigen::MatrixXd::Identity(basis.rows(), basis.rows()));
  if (inverse.middleRows(1, 2).cwiseAbs().maxCoeff() > kLargestWeight) return {};
  GradientWeights weights;
  for (std::size_t i = 0; i < points.size(); ++i)
    weights[points[i].point] = inverse.col(static_cast<Eigen::Index>(i)).segment<2>(1) / size;
  return weights;
}

/// Recovers the gradient at a point. `clamped`: by triangle, whether it is clamped. If any triangle at the
/// point is clamped, the result is the mean of the gradients on the clamped triangles alone.
Recovered recover(const Unfolding& unfolding, std::span<const Triangle> triangles,
                  std::span<const uint8_t> clamped, uint32_t point) {
  Recovered result{unfolding.fan(point, false), {}};
  const auto average = [&](auto&& counts) {
    Real sum = 0;
    for (const FlatTriangle& f : result.fan) sum += counts(f.triangle) ? 1 : 0;
    for (const FlatTriangle& f : result.fan)
      if (counts(f.triangle)) add_gradient(triangles[f.triangle], f.corners, 1 / sum, result.weights);
  };
  const auto is_clamped = [&](const FlatTriangle& f) { return clamped[f.triangle] != 0; };
  if (std::ranges::any_of(result.fan, is_clamped)) {
    average([&](uint32_t t) { return clamped[t] != 0; });
    result.clamped = true;
    return result;
  }
  for (const bool wide : {false, true}) {
    if (wide) result.fan = unfolding.fan(point, true);
    std::vector<FlatPoint> points;
    for (const FlatTriangle& f : result.fan)
      for (std::size_t k = 0; k < 3; ++k)
        if (const uint32_t p = triangles[f.triangle][k];
            std::ranges::find(points, p, &FlatPoint::point) == points.end())
          points.push_back({p, f.corners[k]});
    if (points.empty()) return result;
    std::swap(points.front(), *std::ranges::find(points, point, &FlatPoint::point));
    if (auto weights = polynomial_gradient(points)) {
      result.weights = std::move(*weights);
      return result;
    }
  }
  result.fan = unfolding.fan(point, false);  // the strip is too narrow for a polynomial
  average([](uint32_t) { return true; });
  return result;
}

void add_outer_product(const Vec2& a, const Vec2& b, uint32_t point, HessianWeights& weights) {
  weights.try_emplace(point, Vec3::Zero()).first->second +=
      Vec3(a.x() * b.x(), a.y() * b.y(), (a.x() * b.y() + a.y() * b.x()) / std::numbers::sqrt2);
}

/// Returns the weights of a recovered gradient in the plane of a triangle at its point.
GradientWeights gradient_in_plane(const FlatTriangle& own, const Recovered& at) {
  const auto in_fan = std::ranges::find(at.fan, own.triangle, &FlatTriangle::triangle);
  if (in_fan == at.fan.end()) return {};  // another sheet touches only at this point
  // The rotation from the fan's plane to the triangle's own plane.
  const Vec2 there = (in_fan->corners[1] - in_fan->corners[0]).normalized();
  const Vec2 here = (own.corners[1] - own.corners[0]).normalized();
  Eigen::Matrix2d turn;
  turn.col(0) = here * there.x() - Vec2(-here.y(), here.x()) * there.y();
  turn.col(1) = here * there.y() + Vec2(-here.y(), here.x()) * there.x();
  GradientWeights weights = at.weights;
  for (auto& [point, w] : weights) w = (turn * w).eval();
  return weights;
}

/// Returns the second derivatives on a triangle. They are the derivatives of the linear function that has the
/// recovered gradients at the three corners.
HessianWeights recovered_hessian(const FlatTriangle& own, const Triangle& t,
                                 std::span<const std::optional<Recovered>> recovered) {
  HessianWeights weights;
  GradientWeights shape;
  add_gradient(t, own.corners, 1, shape);
  for (std::size_t k = 0; k < 3; ++k)
    for (const auto& [point, w] : gradient_in_plane(own, *recovered[t[k]]))
      add_outer_product(shape[t[k]], w, point, weights);
  return weights;
}

/// Returns the patch of a triangle that has corners at a clamp and free corners. The gradient at a clamp does
/// not depend on the free points next to it. Without this patch, hardly anything would hold these points, and
/// the cloth would bend too much. Along an edge, a quadratic shape rises by the mean of the gradients at its
/// ends. The patch resists the difference on both edges between the clamp and the free points. Its first two
/// components are these differences, divided by the square of the distance from the clamp [1/m]. Returns
/// nothing if the triangle is not at a clamp.
std::optional<HessianWeights> clamp_patch(const FlatTriangle& own, const Triangle& t,
                                          std::span<const std::optional<Recovered>> recovered) {
  const auto clamped = [&](std::size_t k) { return recovered[t[k]]->clamped; };
  const std::size_t count = std::size_t{clamped(0)} + clamped(1) + clamped(2);
  if (count == 0 || count == 3) return {};
  std::size_t lone = 0;  // the only clamped corner, or the only free one
  while (clamped(lone) != (count == 1)) ++lone;
  const std::array<std::size_t, 2> others = {(lone + 1) % 3, (lone + 2) % 3};
  const Vec2 base = own.corners[others[1]] - own.corners[others[0]],
             side = own.corners[others[0]] - own.corners[lone];
  const Real doubled = std::abs(base.x() * side.y() - base.y() * side.x());
  const Real scale = std::sqrt(kClampFraction / 2) * base.squaredNorm() / (doubled * doubled);
  HessianWeights weights;
  const auto add = [&](std::size_t row, uint32_t point, Real w) {
    weights.try_emplace(point, Vec3::Zero()).first->second[static_cast<int>(row)] += scale * w;
  };
  for (std::size_t row = 0; row < 2; ++row) {
    const Vec2 edge = own.corners[others[row]] - own.corners[lone];
    for (const std::size_t end : {lone, others[row]})
      for (const auto& [point, w] : gradient_in_plane(own, *recovered[t[end]]))
        add(row, point, w.dot(edge) / 2);
    add(row, t[others[row]], -1);
    add(row, t[lone], 1);
  }
  return weights;
}

/// Returns the second derivatives from the jumps of the gradients at the edges: a boundary integral of the
/// mean of both sides, divided by the area (Onate and Zarate, "Rotation-free triangular plate and shell
/// elements", 2000).
HessianWeights jump_hessian(const Unfolding& unfolding, const FlatTriangle& own,
                            std::span<const Triangle> triangles) {
  HessianWeights weights;
  const Vec2 b = own.corners[1] - own.corners[0], c = own.corners[2] - own.corners[0];
  const Real doubled = b.x() * c.y() - b.y() * c.x();
  for (std::size_t k = 0; k < 3; ++k) {
    const uint32_t u = unfolding.neighbour(own.triangle, k);
    if (u == kNoTriangle) continue;
    const Vec2 edge = own.corners[(k + 1) % 3] - own.corners[k], outward(edge.y(), -edge.x());
    GradientWeights jump;
    const FlatTriangle other = unfolding.unfold(u, own, k);
    // The triangle on the other side may have the opposite winding, which does not change its gradient.
    add_gradient(triangles[u], other.corners, 1 / doubled, jump);
    add_gradient(triangles[own.triangle], own.corners, -1 / doubled, jump);
    for (const auto& [point, w] : jump) add_outer_product(outward, w, point, weights);
  }
  return weights;
}

/// The two patches of a triangle: one by recovered gradients, the other by jumps of gradients or, at a clamp,
/// a clamp patch.
struct TrianglePatches {
  Real area;
  Vec3 rest;  // unstressed curvature of the first patch
  HessianWeights smooth, rough;
};

TrianglePatches triangle_patches(const Unfolding& unfolding, std::span<const Vec3> rest,
                                 std::span<const Triangle> triangles, Real rest_fraction, uint32_t t,
                                 std::span<const std::optional<Recovered>> recovered) {
  const Triangle& own = triangles[t];
  const Vec3 normal = (rest[own[1]] - rest[own[0]]).cross(rest[own[2]] - rest[own[0]]);
  const FlatTriangle flat = unfolding.own_plane(t);
  TrianglePatches result{normal.norm() / 2, Vec3::Zero(), recovered_hessian(flat, own, recovered),
                         jump_hessian(unfolding, flat, triangles)};
  for (const auto& [point, w] : result.smooth) {
    result.rest += rest_fraction * normal.normalized().dot(rest[point] - rest[own[0]]) * w;
    result.rough.try_emplace(point, Vec3::Zero()).first->second -= w;
  }
  if (result.rest.norm() * std::sqrt(result.area) < kFlatAtRest) result.rest.setZero();
  for (auto& [point, w] : result.rough) w *= std::sqrt(kJumpFraction);
  if (auto at_clamp = clamp_patch(flat, own, recovered)) result.rough = std::move(*at_clamp);
  return result;
}

bool has_area(std::span<const Vec3> rest, const Triangle& t) {
  return (rest[t[1]] - rest[t[0]]).cross(rest[t[2]] - rest[t[0]]).norm() > 0;
}

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
  const Unfolding unfolding(rest_, triangles_);
  std::vector<std::optional<Recovered>> recovered(rest_.size());
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
    if (!builds[t] || clamped_[t] || !has_area(rest_, triangles_[t])) continue;
    for (uint32_t corner : triangles_[t])
      if (!recovered[corner]) recovered[corner] = recover(unfolding, triangles_, clamped_, corner);
    const auto [area, rest, smooth, rough] =
        triangle_patches(unfolding, rest_, triangles_, rest_fraction_, t, recovered);
    for (const HessianWeights* of_kind : {&smooth, &rough}) {
      std::vector<uint32_t> points;
      std::vector<Vec3> weights;
      for (const auto& [point, w] : *of_kind) {
        points.push_back(point);
        weights.push_back(w);
        rows[point] = 1;
      }
      const bool is_rough = of_kind == &rough;
      add_patch(
          {.triangle = t, .area = area, .rest = is_rough ? Vec3(Vec3::Zero()) : rest, .rough = is_rough},
          points, weights);
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

void ClothBending::add_damped_forces(std::span<const Vec4> x, std::span<const Vec4> v, std::span<Vec4> f) {
  if (damping_ == 0) return add_forces(x, 1, f);
  image_.resize(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) image_[i] = x[i] + damping_ * v[i];
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
  return patch.rough ? norm / kRoughCounts : norm;
}

void ClothBending::add_gradient(std::size_t index, std::span<const Vec4> x,
                                std::vector<std::pair<uint32_t, Vec4>>& gradient) const {
  const Patch& patch = patches_[index];
  const Triangle& own = triangles_[patch.triangle];
  const Vec3 cross = cross_of(own, x), n = cross.stableNormalized();
  const Mat3 excess = excess_curvature(patch, x, n);
  const Real norm = excess.norm();
  if (!(norm > 0)) return;
  const Mat3 direction = excess / (patch.rough ? norm * kRoughCounts : norm);
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
