#include "sim/geometry/winding_number.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace offstage::sim {
namespace {

constexpr uint32_t kLeaf = 8;
/// Clusters at a distance of more than this many of their radii are approximated by dipoles.
constexpr Real kFar = 2.3;

/// Returns the solid angle of a triangle seen from the origin [sr] (van Oosterom and Strackee, "The solid
/// angle of a plane triangle", 1983).
Real solid_angle(const Vec3& a, const Vec3& b, const Vec3& c) {
  const Real la = a.norm(), lb = b.norm(), lc = c.norm();
  const Real y = a.dot(b.cross(c)), x = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
  return y == 0 && x == 0 ? 0 : 2 * std::atan2(y, x);
}

}  // namespace

WindingNumber::WindingNumber(const TriangleMesh& mesh) {
  for (const Triangle& t : mesh.triangles)
    triangles_.push_back({mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]});
  nodes_.reserve(triangles_.size() / 2 + 1);
  if (!triangles_.empty()) build(0, static_cast<uint32_t>(triangles_.size()));
}

void WindingNumber::build(uint32_t first, uint32_t count) {
  const std::span<Corners> own(triangles_.data() + first, count);
  Vec3 weighted = Vec3::Zero(), area_normal = Vec3::Zero();
  Real area = 0;
  Aabb box, middles;
  for (const Corners& t : own) {
    const Vec3 n = (t[1] - t[0]).cross(t[2] - t[0]) / 2, middle = (t[0] + t[1] + t[2]) / 3;
    area_normal += n;
    area += n.norm();
    weighted += n.norm() * middle;
    middles.extend(middle);
    for (const Vec3& v : t) box.extend(v);
  }
  const Vec3 centre = area > 0 ? Vec3(weighted / area) : Vec3(box.center());
  Real radius2 = 0;
  for (const Corners& t : own)
    for (const Vec3& v : t) radius2 = std::max(radius2, (v - centre).squaredNorm());

  const std::size_t at = nodes_.size();
  nodes_.push_back({centre, area_normal, std::sqrt(radius2), 0, first, count});
  if (count > kLeaf) {
    Eigen::Index axis = 0;
    middles.sizes().maxCoeff(&axis);
    std::nth_element(own.begin(), own.begin() + count / 2, own.end(),
                     [&](const Corners& s, const Corners& t) {
                       return s[0][axis] + s[1][axis] + s[2][axis] < t[0][axis] + t[1][axis] + t[2][axis];
                     });
    nodes_[at].count = 0;
    build(first, count / 2);
    build(first + count / 2, count - count / 2);
  }
  nodes_[at].next = static_cast<uint32_t>(nodes_.size());
}

Real WindingNumber::at(const Vec3& p) const {
  Real angle = 0;
  for (uint32_t i = 0; i < nodes_.size();) {
    const Node& node = nodes_[i];
    const Vec3 d = node.centre - p;
    const Real distance2 = d.squaredNorm();
    if (distance2 > kFar * kFar * node.radius * node.radius) {
      angle += node.area_normal.dot(d) / (distance2 * std::sqrt(distance2));
      i = node.next;
      continue;
    }
    for (const Corners& t : std::span(triangles_).subspan(node.first, node.count))
      angle += solid_angle(t[0] - p, t[1] - p, t[2] - p);
    ++i;
  }
  return angle / (4 * std::numbers::pi);
}

}  // namespace offstage::sim
