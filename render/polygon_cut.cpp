#include "render/polygon_cut.h"

#include <algorithm>
#include <utility>

#include <Eigen/Geometry>

namespace offstage::render {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Greatest number of corners. The time grows with its square, in the worst case with its cube.
constexpr std::size_t kMostCorners = 1024;
/// Areas below this fraction of the square of the polygon's extent count as zero.
constexpr double kNoArea = 1e-12;

/// Returns twice the area of a triangle; > 0 if it is counter-clockwise.
double doubled_area(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  const Vector2d u = b - a, v = c - a;
  return u.x() * v.y() - u.y() * v.x();
}

/// Cuts ears off a polygon; its members are the remaining polygon.
class EarCutter {
 public:
  explicit EarCutter(std::vector<Vector2d> corners) : at_(std::move(corners)), left_(at_.size()) {
    Vector2d low = at_[0], high = at_[0];
    for (std::size_t i = 0; i < left_; ++i) {
      before_.push_back(static_cast<uint32_t>((i + left_ - 1) % left_));
      after_.push_back(static_cast<uint32_t>((i + 1) % left_));
      low = low.cwiseMin(at_[i]);
      high = high.cwiseMax(at_[i]);
    }
    no_area_ = kNoArea * (high - low).squaredNorm();
    fitness_.resize(left_);
  }

  std::vector<uint32_t> cut() {
    std::vector<uint32_t> triangles;
    uint32_t any = 0;
    rate_all(any);
    for (; left_ > 2; --left_) {
      uint32_t best = fittest(any);
      if (!(fitness_[best] > 0)) {  // a corner may have become an ear when others were cut off
        rate_all(any);
        best = fittest(any);
        if (!(fitness_[best] > 0)) return {};
      }
      const uint32_t a = before_[best], c = after_[best];
      triangles.insert(triangles.end(), {a, best, c});
      after_[a] = c;
      before_[c] = a;
      any = a;
      fitness_[a] = fitness(a);
      fitness_[c] = fitness(c);
    }
    return triangles;
  }

 private:
  void rate_all(uint32_t any) {
    uint32_t i = any;
    do fitness_[i] = fitness(i);
    while ((i = after_[i]) != any);
  }

  uint32_t fittest(uint32_t any) const {
    uint32_t best = any;
    for (uint32_t i = after_[any]; i != any; i = after_[i])
      if (fitness_[i] > fitness_[best]) best = i;
    return best;
  }

  /// Returns the quality of an ear: its area divided by the square of its longest side. The corner is an ear
  /// if no other corner is inside its triangle or on its sides; otherwise the result is 0.
  double fitness(uint32_t corner) const {
    const Vector2d &a = at_[before_[corner]], &b = at_[corner], &c = at_[after_[corner]];
    const double area = doubled_area(a, b, c);
    if (!(area > no_area_)) return 0;
    for (uint32_t i = after_[after_[corner]]; i != before_[corner]; i = after_[i]) {
      const Vector2d& p = at_[i];
      if (p == a || p == b || p == c) continue;
      if (doubled_area(a, b, p) >= -no_area_ && doubled_area(b, c, p) >= -no_area_ &&
          doubled_area(c, a, p) >= -no_area_)
        return 0;
    }
    return area / std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  }

  std::vector<Vector2d> at_;
  std::size_t left_;
  std::vector<uint32_t> before_, after_;
  std::vector<double> fitness_;
  double no_area_ = 0;
};

}  // namespace

std::vector<uint32_t> cut_polygon(std::span<const Vector3d> corners) {
  if (corners.size() < 3 || corners.size() > kMostCorners) return {};
  Vector3d normal = Vector3d::Zero();
  for (std::size_t i = 1; i + 1 < corners.size(); ++i)
    normal += (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]);
  if (!normal.allFinite() || normal.isZero(0)) return {};
  const Vector3d u = normal.unitOrthogonal(), v = normal.normalized().cross(u);
  std::vector<Vector2d> flat;
  for (const Vector3d& p : corners) flat.emplace_back(u.dot(p - corners[0]), v.dot(p - corners[0]));
  return EarCutter(std::move(flat)).cut();
}

}  // namespace offstage::render
