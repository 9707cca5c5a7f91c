#include "sim/collision/contact_frame.h"

#include <cmath>

namespace offstage::sim {
namespace {

/// Two points closer than this have no defined direction [m].
constexpr Real kCoincident = 1e-12;

/// Returns the time derivative of n = +-(u x w) / |u x w|, where the direction u turns with A and w with B.
Vec3 crossing_rate(const Manifold& m, const Twist& a, const Twist& b) {
  const Vec3 &u = m.edge_a, &w = m.edge_b, cross = u.cross(w);
  const Vec3 rate =
      (a.angular_velocity.cross(u).cross(w) + u.cross(b.angular_velocity.cross(w))) / cross.norm();
  return cross.dot(m.normal) < 0 ? Vec3(-rate) : rate;
}

/// Returns the time derivative of n = d / |d|, where d leads from a point or line of B to a point or line of
/// A. The nearest point of a line slides along the line, which does not change the part of d that is
/// perpendicular to the line. For the direction e of a line, n.e = 0 gives n'.e = -n.e'.
Vec3 pointing_rate(const Manifold& m, const ContactPoint& point, const Twist& a, const Twist& b) {
  const Vec3 &n = m.normal, p = point.on_a + m.radius_a * n, q = point.on_b - m.radius_b * n;
  const Real distance = (p - q).dot(n);
  if (std::abs(distance) < kCoincident) return (a.angular_velocity + b.angular_velocity).cross(n) / 2;
  const Vec3 rate = (a.at(p) - b.at(q)) / distance;
  if (m.source == NormalSource::points) return rate;
  const bool of_a = m.source == NormalSource::edge_of_a;
  const Vec3& e = of_a ? m.edge_a : m.edge_b;
  const Vec3& turn = of_a ? a.angular_velocity : b.angular_velocity;
  return rate - (rate.dot(e) + n.dot(turn.cross(e))) * e;
}

}  // namespace

ContactFrame contact_frame(const Vec3& n) {
  Eigen::Index drop;
  n.cwiseAbs().minCoeff(&drop);
  const Vec3 t = Vec3::Unit(drop).cross(n).normalized();
  return {n, t, n.cross(t)};
}

// The result is computed from s = e x n and t = s / |s|: t' = (s' - t (t.s')) / |s|, and s' = e x n'.
ContactFrame contact_frame_rate(const ContactFrame& frame, const Vec3& n_rate) {
  Eigen::Index drop;
  frame.n.cwiseAbs().minCoeff(&drop);
  const Real length = Vec3::Unit(drop).cross(frame.n).norm();
  const Vec3 s_rate = Vec3::Unit(drop).cross(n_rate);
  const Vec3 t_rate = (s_rate - frame.t * frame.t.dot(s_rate)) / length;
  return {n_rate, t_rate, n_rate.cross(frame.t) + frame.n.cross(t_rate)};
}

Vec3 normal_rate(const Manifold& m, const ContactPoint& point, const Twist& a, const Twist& b) {
  Vec3 rate;
  switch (m.source) {
    case NormalSource::face_of_a:
      return a.angular_velocity.cross(m.normal);
    case NormalSource::face_of_b:
      return b.angular_velocity.cross(m.normal);
    case NormalSource::edges:
      rate = crossing_rate(m, a, b);
      break;
    default:
      rate = pointing_rate(m, point, a, b);
  }
  return rate - m.normal * m.normal.dot(rate);
}

}  // namespace offstage::sim
