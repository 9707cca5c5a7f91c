#include "sim/articulation/joint_rows.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/core/twist.h"

namespace offstage::sim {
namespace {

Vec6 concatenate(const Vec3& linear, const Vec3& angular) {
  Vec6 v;
  v << linear, angular;
  return v;
}

/// Returns the row of the constraint t . (anchor a - anchor b) = 0, where t is fixed in b. With the vector s
/// from b's centre to a's anchor,
///   dC/dt = t . s',  s' = v_a(anchor) - v_b - w_b x s   (as seen from b).
/// Besides the accelerations, d2C/dt2 contains t . (w_a x (w_a x r_a) - w_b x (w_b x s) - 2 w_b x s').
JointRow slide_row(const JointPlace& p, const Vec3& t) {
  const Vec3 s = p.arm_b + p.apart;
  const Vec3 &wa = p.a.angular_velocity, &wb = p.b.angular_velocity;
  const Vec3 turning = wa.cross(p.arm_a), seen = p.a.velocity + turning - p.b.velocity - wb.cross(s);
  return {concatenate(t, p.arm_a.cross(t)), concatenate(-t, -s.cross(t)), t.dot(p.apart),
          t.dot(wa.cross(turning) - wb.cross(wb.cross(s)) - 2 * wb.cross(seen))};
}

/// Adds the rows that keep both anchors at the same point, one row for each world axis. Besides the
/// accelerations, d2C/dt2 contains w_a x (w_a x r_a) - w_b x (w_b x r_b).
void add_meeting_rows(const JointPlace& p, JointRows& rows) {
  const Vec3 &wa = p.a.angular_velocity, &wb = p.b.angular_velocity;
  rows.on_a.topLeftCorner<3, 3>().setIdentity();
  rows.on_a.bottomLeftCorner<3, 3>() = cross_matrix(p.arm_a);
  rows.on_b.topLeftCorner<3, 3>() = -Mat3::Identity();
  rows.on_b.bottomLeftCorner<3, 3>() = -cross_matrix(p.arm_b);
  rows.error.head<3>() = p.apart;
  rows.bias.head<3>() = wa.cross(wa.cross(p.arm_a)) - wb.cross(wb.cross(p.arm_b));
  rows.count = 3;
}

/// Returns the row of the constraint u . v = 0, where u is fixed in a and v is fixed in b.
JointRow perpendicular_row(const JointPlace& p, const Vec3& u, const Vec3& v) {
  const Vec3 n = u.cross(v), &wa = p.a.angular_velocity, &wb = p.b.angular_velocity;
  const Vec3 n_rate = wa.cross(u).cross(v) + u.cross(wb.cross(v));
  return {concatenate(Vec3::Zero(), n), concatenate(Vec3::Zero(), -n), u.dot(v), n_rate.dot(wa - wb)};
}

/// Returns the row of the constraint |anchor a - anchor b| = length.
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

constexpr Real kWholeTurn = 2 * std::numbers::pi;

/// Returns right-handed orthonormal axes as columns. The last column is `axis`. The first column is `second`
/// without its component along the axis, or any perpendicular direction if this is zero.
Mat3 axes_along(const Vec3& axis, const Vec3& second) {
  Mat3 m;
  m.col(2) = axis.normalized();
  Vec3 x = second - second.dot(m.col(2)) * m.col(2);
  if (!(x.norm() > 1e-6)) x = m.col(2).unitOrthogonal();
  m.col(0) = x.normalized();
  m.col(1) = m.col(2).cross(m.col(0));
  return m;
}

/// Returns the rotation of a link about its joint axis since the joint was created, between minus and plus
/// half a turn [rad].
Real angle_since(const Mat3& axes, const Mat3& at_creation) {
  return angle_of(axes.col(0).dot(at_creation.col(1)), axes.col(0).dot(at_creation.col(0)));
}

/// The row of a gear, rack or screw, and the changes of its error due to one full turn of a and of b.
struct Coupling {
  JointRow row;
  Real turn_a = 0, turn_b = 0;
};

/// The axis of each wheel is fixed in the wheel. The change of its direction does no work, so the row has no
/// bias.
Coupling gear_coupling(const JointDef& def, const JointPlace& p, Real length) {
  const Real a = angle_since(p.axes_a, frame_axes(def, false)),
             b = angle_since(p.axes_b, frame_axes(def, true));
  return {{concatenate(Vec3::Zero(), p.axes_a.col(2)), concatenate(Vec3::Zero(), def.ratio * p.axes_b.col(2)),
           a + def.ratio * b - length},
          kWholeTurn,
          def.ratio * kWholeTurn};
}

/// The anchor of b moves along a direction that is fixed in the world: the direction when the joint was
/// created.
Coupling rack_coupling(const JointDef& def, const JointPlace& p, Real length) {
  const Vec3 d = def.second_axis.normalized(), &wb = p.b.angular_velocity;
  const Real a = angle_since(p.axes_a, frame_axes(def, false));
  return {{concatenate(Vec3::Zero(), -def.ratio * p.axes_a.col(2)), concatenate(d, p.arm_b.cross(d)),
           d.dot(p.b.position + p.arm_b - def.anchor_b) - def.ratio * a - length,
           d.dot(wb.cross(wb.cross(p.arm_b)))},
          def.ratio * kWholeTurn};
}

Real screw_angle(const JointPlace& p) {
  return angle_of(p.axes_a.col(0).dot(p.axes_b.col(1)), p.axes_a.col(0).dot(p.axes_b.col(0)));
}

Coupling screw_coupling(const JointDef& def, const JointPlace& p, Real length) {
  const Vec3 z = p.axes_b.col(2);
  const Real lead = def.ratio / kWholeTurn;  // travel per radian [m]
  JointRow row = slide_row(p, z);
  const JointRow turning = turning_row(z);
  row.on_a -= lead * turning.on_a;
  row.on_b -= lead * turning.on_b;
  row.error -= lead * screw_angle(p) + length;
  const Vec3 &wa = p.a.angular_velocity, &wb = p.b.angular_velocity;
  row.bias -= lead * wb.cross(z).dot(wa - wb);
  return {row, def.ratio};
}

Coupling coupling(const JointDef& def, const JointPlace& p, Real length) {
  if (def.type == JointType::gear) return gear_coupling(def, p, length);
  return def.type == JointType::rack ? rack_coupling(def, p, length) : screw_coupling(def, p, length);
}

/// Returns the multiple of whole turns to subtract from the constraint's error, so that it is nearest to 0.
/// The measured angles jump by whole turns.
Real nearest_turns(const Coupling& c) {
  Real best = 0;
  for (const int a : {-1, 0, 1})
    for (const int b : {-1, 0, 1}) {
      const Real turns = a * c.turn_a + b * c.turn_b;
      if (std::abs(c.row.error - turns) < std::abs(c.row.error - best)) best = turns;
    }
  return best;
}

JointRow coupling_row(const JointDef& def, const JointPlace& p, Real length) {
  Coupling c = coupling(def, p, length);
  c.row.error -= nearest_turns(c);
  return c.row;
}

/// Adds the part of a pulley's row that acts on one body. Returns the length of the rope from the fixed point
/// to the anchor of this body [m].
Real add_strand(const LinkMotion& link, const Vec3& arm, const Vec3& from, Real factor, Vec6& on,
                JointRow& row) {
  const Vec3 offset = link.position + arm - from;
  const Real length = offset.norm();
  const Vec3 n = length > 0 ? Vec3(offset / length) : Vec3(-Vec3::UnitY());
  const Vec3 turning = link.angular_velocity.cross(arm), rate = link.velocity + turning;
  const Real across = rate.squaredNorm() - std::pow(n.dot(rate), 2);
  on = factor * concatenate(n, arm.cross(n));
  row.bias += factor * (n.dot(link.angular_velocity.cross(turning)) + (length > 0 ? across / length : 0));
  return factor * length;
}

JointRow pulley_row(const JointDef& def, const JointPlace& p, Real length) {
  JointRow row;
  row.error = add_strand(p.a, p.arm_a, def.pulley_a, 1, row.on_a, row) +
              add_strand(p.b, p.arm_b, def.pulley_b, def.ratio, row.on_b, row) - length;
  return row;
}

}  // namespace

Mat3 frame_axes(const JointDef& def, bool of_b) {
  if (!def.is_coupling()) return axes_along(def.axis, def.second_axis);
  const Vec3& axis = of_b && def.type == JointType::gear ? def.second_axis : def.axis;
  return axes_along(axis, axis);  // any direction across it
}

Real turns_offset(const JointDef& def, const JointPlace& place, Real length) {
  return nearest_turns(coupling(def, place, length));
}

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
    case JointType::gear:
    case JointType::rack:
      return 1;
    case JointType::screw:
      return 5;
    case JointType::pulley:
      return 0;
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
  if (type == JointType::pulley) return;
  if (def.is_coupling()) return rows.add(coupling_row(def, p, length));
  if (type == JointType::prismatic || type == JointType::screw) {
    for (const int across : {0, 1}) rows.add(slide_row(p, p.axes_b.col(across)));
  } else {
    add_meeting_rows(p, rows);
  }
  if (type == JointType::universal) perpendicular(2, 0);
  if (type == JointType::revolute || type == JointType::fixed || type == JointType::prismatic ||
      type == JointType::screw) {
    perpendicular(2, 0);
    perpendicular(2, 1);
  }
  if (type == JointType::fixed || type == JointType::prismatic) perpendicular(0, 1);
  if (type == JointType::screw) rows.add(coupling_row(def, p, length));
}

JointRow turning_row(const Vec3& axis) {
  return {concatenate(Vec3::Zero(), axis), concatenate(Vec3::Zero(), -axis)};
}

JointRow free_row(const JointDef& def, const JointPlace& p, Real length) {
  const JointType type = def.type;
  const auto xa = p.axes_a.col(0), ya = p.axes_a.col(1), za = p.axes_a.col(2);
  const auto xb = p.axes_b.col(0), yb = p.axes_b.col(1), zb = p.axes_b.col(2);
  if (type == JointType::prismatic) return slide_row(p, zb);
  if (type == JointType::distance) return length_row(p, length);
  if (type == JointType::pulley) return pulley_row(def, p, length);
  JointRow row;
  if (type == JointType::revolute || type == JointType::screw) {
    row = turning_row(zb);
    row.error = angle_of(xa.dot(yb), xa.dot(xb));
  } else if (type == JointType::universal) {
    row = turning_row(za);
    row.error = angle_of(-ya.dot(xb), xa.dot(xb));
  } else {
    // The angle is the smallest angle of a rotation from one axis to the other. It is undefined if they are
    // opposite.
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

Vec3 rotation_vector(const JointPlace& place) {
  const Quat turn(Mat3(place.axes_b.transpose() * place.axes_a));
  const Vec3 half = turn.w() < 0 ? Vec3(-turn.vec()) : Vec3(turn.vec());
  const Real sine = half.norm();
  if (!(sine > 0)) return Vec3::Zero();
  return 2 * angle_of(sine, std::abs(turn.w())) / sine * half;
}

Real angle_of(Real y, Real x) {
  const Real r = std::sqrt(x * x + y * y);
  if (r == 0) return 0;
  // The angle is halved once, which makes it less than a right angle, and then twice more.
  Real t = x >= 0 ? y / (r + x) : (y < 0 ? -1 : 1) * ((r - x) / std::max(std::abs(y), 1e-300));
  if (x < 0 && y == 0) return std::numbers::pi;
  const bool steep = std::abs(t) > 1;
  if (steep) t = 1 / t;
  t /= 1 + std::sqrt(1 + t * t);
  t /= 1 + std::sqrt(1 + t * t);
  // The series of atan, for an argument of at most tan(pi / 16).
  const Real s = t * t;
  Real sum = 0;
  for (int k = 23; k > 0; k -= 2) sum = 1.0 / k - s * sum;
  const Real quarter = 4 * t * sum;
  return 2 * (steep ? (t < 0 ? -1 : 1) * std::numbers::pi / 2 - quarter : quarter);
}

}  // namespace offstage::sim
