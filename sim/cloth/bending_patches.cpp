#include "sim/cloth/bending_patches.h"

#include <algorithm>
#include <cmath>
#include <numbers>
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
/// Weight of the energy of a clamp patch, relative to the weight of the energy of the recovered patches. In a
/// beam whose deflection is a cubic polynomial in each cell, it is 12. A cantilever of 10 cells sags by the
/// same with 3 and 12, within 0.1 %, but 12 would need shorter steps.
constexpr Real kClampFraction = 3;
/// A triangle is flat at rest if its curvature times its size is below this.
constexpr Real kFlatAtRest = 1e-7;

using Vec2 = Eigen::Vector2d;
/// Weight of each point in a gradient, and in the second derivatives (xx, yy, sqrt(2) xy).
using GradientWeights = std::map<uint32_t, Vec2>;
using HessianWeights = std::map<uint32_t, Vec3>;

struct FlatPoint {
  uint32_t point;
  Vec2 place;
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
RecoveredGradient recover(const Unfolding& unfolding, std::span<const uint8_t> clamped, uint32_t point) {
  const std::span<const Triangle> triangles = unfolding.triangles();
  RecoveredGradient result{unfolding.fan(point, false), {}};
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
GradientWeights gradient_in_plane(const FlatTriangle& own, const RecoveredGradient& at) {
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
                                 std::span<const std::optional<RecoveredGradient>> recovered) {
  HessianWeights weights;
  GradientWeights shape;
  add_gradient(t, own.corners, 1, shape);
  for (std::size_t k = 0; k < 3; ++k)
    for (const auto& [point, w] : gradient_in_plane(own, *recovered[t[k]]))
      add_outer_product(shape[t[k]], w, point, weights);
  return weights;
}

/// Returns the rough patch of a triangle that has corners at a clamp and free corners. The gradient at a
/// clamp does not depend on the free points next to it. Without this patch, hardly anything would hold these
/// points, and the cloth would bend too much. Along an edge, a quadratic shape rises by the mean of the
/// gradients at its ends. The patch resists the difference on both edges between the clamp and the free
/// points. Its first two components are these differences, divided by the square of the distance from the
/// clamp [1/m]. Returns nothing if the triangle is not at a clamp.
std::optional<TrianglePatch> clamp_patch(const FlatTriangle& own, const Triangle& t,
                                         std::span<const std::optional<RecoveredGradient>> recovered) {
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
  TrianglePatch patch;
  patch.divisor = std::sqrt(kClampFraction / 2);
  const auto add = [&](std::size_t row, uint32_t point, Real w) {
    patch.weights.try_emplace(point, Vec3::Zero()).first->second[static_cast<int>(row)] += scale * w;
  };
  for (std::size_t row = 0; row < 2; ++row) {
    const Vec2 edge = own.corners[others[row]] - own.corners[lone];
    for (const std::size_t end : {lone, others[row]})
      for (const auto& [point, w] : gradient_in_plane(own, *recovered[t[end]]))
        add(row, point, w.dot(edge) / 2);
    add(row, t[others[row]], -1);
    add(row, t[lone], 1);
  }
  return patch;
}

/// Returns the second derivatives from the jumps of the gradients at the edges: a boundary integral of the
/// mean of both sides, divided by the area (Onate and Zarate, "Rotation-free triangular plate and shell
/// elements", 2000).
HessianWeights jump_hessian(const Unfolding& unfolding, const FlatTriangle& own) {
  const std::span<const Triangle> triangles = unfolding.triangles();
  HessianWeights weights;
  const Vec2 b = own.corners[1] - own.corners[0], c = own.corners[2] - own.corners[0];
  const Real doubled = b.x() * c.y() - b.y() * c.x();
  for (std::size_t k = 0; k < 3; ++k) {
    const uint32_t u = unfolding.neighbour(own.triangle, k);
    if (u == Unfolding::kNone) continue;
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

/// Returns the rough patch of a triangle by jumps of gradients. `smooth`: second derivatives of its smooth
/// patch, which are subtracted.
TrianglePatch jump_patch(const Unfolding& unfolding, const FlatTriangle& own, const HessianWeights& smooth) {
  TrianglePatch patch{.weights = jump_hessian(unfolding, own), .divisor = 2 * std::sqrt(kJumpFraction)};
  for (const auto& [point, w] : smooth) patch.weights.try_emplace(point, Vec3::Zero()).first->second -= w;
  for (auto& [point, w] : patch.weights) w *= std::sqrt(kJumpFraction);
  return patch;
}

}  // namespace

std::optional<TrianglePatches> BendingPatches::of(uint32_t t) {
  const std::span<const Vec3> rest = unfolding_.rest();
  const Triangle& own = unfolding_.triangles()[t];
  const Vec3 normal = (rest[own[1]] - rest[own[0]]).cross(rest[own[2]] - rest[own[0]]);
  if (clamped_[t] || !(normal.norm() > 0)) return {};
  for (uint32_t corner : own)
    if (!recovered_[corner]) recovered_[corner] = recover(unfolding_, clamped_, corner);
  const FlatTriangle flat = unfolding_.own_plane(t);
  TrianglePatches result{.area = normal.norm() / 2};
  TrianglePatch& smooth = result.smooth;
  smooth.weights = recovered_hessian(flat, own, recovered_);
  for (const auto& [point, w] : smooth.weights)
    smooth.rest += rest_fraction_ * normal.normalized().dot(rest[point] - rest[own[0]]) * w;
  if (smooth.rest.norm() * std::sqrt(result.area) < kFlatAtRest) smooth.rest.setZero();
  auto at_clamp = clamp_patch(flat, own, recovered_);
  result.rough = at_clamp ? std::move(*at_clamp) : jump_patch(unfolding_, flat, smooth.weights);
  return result;
}

}  // namespace offstage::sim
