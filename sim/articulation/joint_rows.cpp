#include "sim/articulation/joint_rows.h"

#include <cmath>
#include <numbers>

namespace offstage::sim {
namespace {

Vec6 concatenate(const Vec3& linear, const Vec3& angular) {
  Vec6 v;
  v << linear, angular;
  return v;
}

/// t . (anchor a - anchor b) = 0, where t is fixed in b. With s from b's centre to a's anchor,
///   dC/dt = t . s',  s' = v_a(anchor) - v_b - w_b x s   (as seen from b).
/// Besides the accelerations, d2C/dt2 contains t . (w_a x (w_a x r_a) - w_b x (w_b x s) - 2 w_b x s').
JointRow slide_row(const JointPlace& p, const Vec3& t) {
  const Vec3 s = p.arm_b + p.apart;
  const Vec3 &wa = p.a.angular_velocity, &wb = p.b.angular_velocity;
  const Vec3 turning = wa.cross(p.arm_a), seen = p.a.velocity + turning - p.b.velocity - wb.cross(s);
  return {concatenate(t, p.arm_a.cross(t)), concatenate(-t, -s.cross(t)), t.dot(p.apart),
          t.dot(wa.cross(turning) - wb.cross(wb.cross(s)) - 2 * wb.cross(seen))};
}

/// Both anchors coincide, along the world's axes. Besides the accelerations, d2C/dt2 contains w_a x (w_a x
/// r_a) - w_b x (w_b x r_b).
void add_meeting_rows(const JointPlace& p, JointRows& rows) {
  const auto cross_matrix = [](const Vec3& r) {
    Mat3 m;
    m << 0, -r.z(), r.y(), r.z(), 0, -r.x(), -r.y(), r.x(), 0;
    return m;
  };
  const Vec3 &wa = p.a.angular_velocity, &wb = p.b.angular_velocity;
  rows.on_a.topLeftCorner<3, 3>().setIdentity();
  rows.on_a.bottomLeftCorner<3, 3>() = cross_matrix(p.arm_a);
  rows.on_b.topLeftCorner<3, 3>() = -Mat3::Identity();
  rows.on_b.bottomLeftCorner<3, 3>() = -cross_matrix(p.arm_b);
  rows.error.head<3>() = p.apart;
  rows.bias.head<3>() = wa.cross(wa.cross(p.arm_a)) - wb.cross(wb.cross(p.arm_b));
  rows.count = 3;
}

/// u . v = 0, where u is fixed in a and v in b.
JointRow perpendicular_row(const JointPlace& p, const Vec3& u, const Vec3& v) {
  const Vec3 n = u.cross(v), &wa = p.a.angular_velocity, &wb = p.b.angular_velocity;
  const Vec3 n_rate = wa.cross(u).cross(v) + u.cross(wb.cross(v));
  return {concatenate(Vec3::Zero(), n), concatenate(Vec3::Zero(), -n), u.dot(v), n_rate.dot(wa - wb)};
}

/// |anchor a - anchor b| = length.
JointRow length_row(const JointPlace& p, Real length) {
  const Vec3 &wa = p.a.angular_velocity, &wb = p.b.angular_velocity;
  const Real now = p.apart.norm();
  const Vec3 n = now > 0 ? Vec3(p.apart / now) : p.axes_b.col(2);
  const Vec3 turning_a = wa.cross(p.arm_a), turning_b = wb.cross(p.arm_b);
  const Vec3 rate = p.a.velocity + turning_a - p.b.velocity - turning_b;
  const Real across = rate.squaredNorm() - std::pow(n.dot(rate), 2);
  return {concatenate(n, p.arm_a.cross(n)), concatenate(-n, -p.arm_b.cross(n)), now - length,
          n.dot(wa.cross(turning_a) - wb.cross(turning_b)) + (now > 0 ? across / now : 0)};
}

}  // namespace

JointPlace::JointPlace(const LinkMotion& link_a, const JointFrame& on_a, const LinkMotion& link_b,
                       const JointFrame& on_b)
    : a(link_a),
      b(link_b),
      arm_a(a.axes * on_a.point),
      arm_b(b.axes * on_b.point),
      apart(a.position + arm_a - b.position - arm_b),
      axes_a(a.axes * on_a.axes),
      axes_b(b.axes * on_b.axes) {}

void JointRows::add(const JointRow& row) {
  const auto i = static_cast<Eigen::Index>(count++);
  on_a.col(i) = row.on_a;
  on_b.col(i) = row.on_b;
  error[i] = row.error;
  bias[i] = row.bias;
}

uint32_t constraint_count(const JointDef& def) {
  switch (def.type) {
    case JointType::spherical:
      return 3;
    case JointType::fixed:
      return 6;
    case JointType::revolute:
    case JointType::prismatic:
      return 5;
    case JointType::universal:
      return 4;
    case JointType::distance:
      return def.has_free_coordinate() ? 0 : 1;
  }
  return 0;
}

void set_joint_rows(const JointDef& def, const JointPlace& p, Real length, JointRows& rows) {
  const JointType type = def.type;
  rows = {};
  const auto perpendicular = [&](int of_a, int of_b) {
    rows.add(perpendicular_row(p, p.axes_a.col(of_a), p.axes_b.col(of_b)));
  };
  if (type == JointType::distance) {
    if (!def.has_free_coordinate()) rows.add(length_row(p, length));
    return;
  }
  if (type == JointType::prismatic) {
    for (const int across : {0, 1}) rows.add(slide_row(p, p.axes_b.col(across)));
  } else {
    add_meeting_rows(p, rows);
  }
  if (type == JointType::universal) perpendicular(2, 0);
  if (type == JointType::revolute || type == JointType::fixed || type == JointType::prismatic) {
    perpendicular(2, 0);
    perpendicular(2, 1);
  }
  if (type == JointType::fixed || type == JointType::prismatic) perpendicular(0, 1);
}

JointRow turning_row(const Vec3& axis) {
  return {concatenate(Vec3::Zero(), axis), concatenate(Vec3::Zero(), -axis)};
}

JointRow free_row(JointType type, const JointPlace& p, Real length) {
  const auto xa = p.axes_a.col(0), ya = p.axes_a.col(1), za = p.axes_a.col(2);
  const auto xb = p.axes_b.col(0), yb = p.axes_b.col(1), zb = p.axes_b.col(2);
  if (type == JointType::prismatic) return slide_row(p, zb);
  if (type == JointType::distance) return length_row(p, length);
  JointRow row;
  if (type == JointType::revolute) {
    row = turning_row(zb);
    row.error = angle_of(xa.dot(yb), xa.dot(xb));
  } else if (type == JointType::universal) {
    row = turning_row(za);
    row.error = angle_of(-ya.dot(xb), xa.dot(xb));
  } else {
    // Angle after the smallest rotation of one axis onto the other. It is undefined if they are opposite.
    const Real both = std::max(1 + za.dot(zb), 0.05);
    row = turning_row((za + zb) / both);
    const Mat3 between = p.axes_b.transpose() * p.axes_a;
    row.error = angle_of(between(1, 0) - between(0, 1), between(0, 0) + between(1, 1));
  }
  return row;
}

JointRow swing_row(JointType type, const JointPlace& p) {
  const auto za = p.axes_a.col(2), xb = p.axes_b.col(0), yb = p.axes_b.col(1), zb = p.axes_b.col(2);
  if (type == JointType::universal) {
    JointRow row = turning_row(xb);
    row.error = angle_of(-za.dot(yb), za.dot(zb));
    return row;
  }
  const Vec3 n = Vec3(zb).cross(Vec3(za));
  const Real sine = n.norm();
  JointRow row = turning_row(sine > 1e-9 ? Vec3(n / sine) : Vec3(xb));
  row.error = angle_of(sine, za.dot(zb));
  return row;
}

Real angle_of(Real y, Real x) {
  const Real r = std::sqrt(x * x + y * y);
  if (r == 0) return 0;
  // First half the angle, which is within a right angle, then two more halvings.
  Real t = x >= 0 ? y / (r + x) : (y < 0 ? -1 : 1) * ((r - x) / std::max(std::abs(y), 1e-300));
  if (x < 0 && y == 0) return std::numbers::pi;
  const bool steep = std::abs(t) > 1;
  if (steep) t = 1 / t;
  t /= 1 + std::sqrt(1 + t * t);
  t /= 1 + std::sqrt(1 + t * t);
  // Series of atan for an argument of at most tan(pi / 16).
  const Real s = t * t;
  Real sum = 0;
  for (int k = 23; k > 0; k -= 2) sum = 1.0 / k - s * sum;
  const Real quarter = 4 * t * sum;
  return 2 * (steep ? (t < 0 ? -1 : 1) * std::numbers::pi / 2 - quarter : quarter);
}

}  // namespace offstage::sim
