#include "sim/contact/contact_motion.h"

#include <algorithm>
#include <cmath>

#include "sim/dynamics/free_body.h"

namespace offstage::sim {
namespace {

/// The arms of bodies that turn by less than this in an interval are not rotated [rad].
constexpr Real kStraight = 5e-5;
/// If bodies turn by less than this in an interval, the path of a corner is treated as a parabola [rad].
constexpr Real kEven = 0.1;
/// Cosine of the greatest predicted rotation of a normal within an interval.
constexpr Real kPredictable = 0.8;
/// If the sine of the angle between an axis of revolution and the contact's direction is below this, the
/// direction around the axis is too inaccurate to follow.
constexpr Real kUpright = 0.02;
/// A point of a surface of revolution turns with the body if it is far from the meridian that faces the other
/// body: if the cosine of the angle between them is less than this.
constexpr Real kFacing = 0.97;
/// If the sine of the angle between two lines is less than this, their crossing is undefined.
constexpr Real kParallel = 0.05;

using Vec2 = Eigen::Vector2d;

/// Returns the rotation of a point on a surface of revolution while the body turns. A point that faces the
/// other body stays on the side of that body, so it turns with the meridian that faces the other body. Other
/// points turn with the body, and so do all points if the other body is on the axis. `arm` is the vector from
/// the axis to the point; see turned_arm() for the other arguments.
Quat meridian_turn(const Vec3& arm, const Quat& from, const Vec3& out_from, const Quat& to,
                   const Vec3& out_to) {
  const auto radial = [](const Quat& orientation, const Vec3& v) {
    const Vec3 local = orientation.conjugate() * v;
    return Vec2(local.x(), local.z());
  };
  const Vec2 spoke = radial(from, arm), facing = radial(from, out_from), next = radial(to, out_to);
  const Real lengths = facing.norm() * next.norm();
  if (facing.norm() < kUpright || next.norm() < kUpright ||
      spoke.dot(facing) < kFacing * spoke.norm() * facing.norm())
    return to * from.conjugate();
  // Cosine and sine of half the angle about the axis.
  const Real cosine = std::sqrt(std::max(Real(0), (1 + facing.dot(next) / lengths) / 2));
  const Real sine = (facing.y() * next.x() - facing.x() * next.y()) / lengths / (2 * cosine);
  return cosine > 0.1 ? to * Quat(cosine, 0, sine, 0) * from.conjugate() : to * from.conjugate();
}

/// State of a body at a time after the interval's start, if it keeps its mean_twist().
struct Carried {
  Vec3 shift = Vec3::Zero();  // displacement of the centre of mass, or of the origin
  Quat orientation, turn = Quat::Identity();
};

const Quat& start_orientation(const Body& body) {
  return body.is_awake() ? body.start.orientation : body.start_pose.orientation;
}

/// Velocities at the start of the interval or, for a kinematic body, at its end.
Twist twist_of(const Body& body) {
  return body.is_awake() ? body.start_twist : body.is_kinematic() ? body.drive : Twist{};
}

/// Velocities at the start of the interval.
Twist first_twist(const Body& body) {
  return body.is_kinematic() ? body.start_twist : twist_of(body);
}

/// Velocities at the start of the interval or, for a kinematic body, their means in the interval.
Twist mean_twist(const Body& body) {
  if (!body.is_kinematic()) return twist_of(body);
  return {(body.start_twist.velocity + body.drive.velocity) / 2,
          (body.start_twist.angular_velocity + body.drive.angular_velocity) / 2};
}

Carried carried(const Body& body, Real time) {
  Carried c;
  const Twist twist = mean_twist(body);
  c.shift = time * twist.velocity;
  if (time * time * twist.angular_velocity.squaredNorm() > kStraight * kStraight)
    c.turn = rotation(twist.angular_velocity, time);
  c.orientation = c.turn * start_orientation(body);
  return c;
}

/// The two bodies and the manifold of a contact at the interval's start.
struct Start {
  const Body &a, &b;
  RoundSurface surface_a, surface_b;
  const Manifold& m;
  Vec3 arm_a, arm_b;
  Real gap;      // distance of the surfaces [m]; the contact is in the middle between them
  Vec3 sliding;  // velocity of a's material at the contact relative to b's
};

/// For the arguments see contact_motion().
Start start_of(const Body& a, const Body& b, const Manifold& m, const Vec3& place, Real gap) {
  const Vec3 arm_a = place - start_centre(a), arm_b = place - start_centre(b);
  return {.a = a,
          .b = b,
          .surface_a = round_surface(a, m.piece_a),
          .surface_b = round_surface(b, m.piece_b),
          .m = m,
          .arm_a = arm_a,
          .arm_b = arm_b,
          .gap = gap,
          .sliding = first_twist(a).at(arm_a) - first_twist(b).at(arm_b)};
}

/// Whether a body is a sphere whose rotation does not move its contacts: its centre of mass is in the middle.
bool is_centred_sphere(const Body& body) {
  return std::holds_alternative<Sphere>(body.def.shape) &&
         (!body.is_awake() || body.rigid.centre == Vec3::Zero());
}

bool has_lines(NormalSource s) {
  return s == NormalSource::edges || s == NormalSource::edge_of_a || s == NormalSource::edge_of_b;
}

/// Returns the direction of a line of a body after the body has turned. The line of a rim is the tangent at
/// the point that faces the other body. The line of a round side turns with the axis.
Vec3 turned_edge(const Body& body, const RoundSurface& surface, const Vec3& edge, const Carried& now,
                 const Vec3& arm, const Vec3& out) {
  const Quat& from = start_orientation(body);
  if (!surface.is_revolved()) return now.turn * edge;
  const Vec3 own_axis = surface.place.orientation * Vec3::UnitY(), axis = from * own_axis;
  if (std::abs(axis.dot(edge)) > 0.5) return now.turn * edge;
  const Vec3 radial = turned_arm(surface, arm, from, out, now.orientation, out);
  const Vec3 tangent = (now.orientation * own_axis).cross(radial);
  const Real length = tangent.norm();
  if (length < 1e-12) return now.turn * edge;
  return tangent.dot(now.turn * edge) < 0 ? Vec3(-tangent / length) : Vec3(tangent / length);
}

struct Lines {
  Vec3 of_a, of_b;
};

/// Returns the normal after a time, computed from the features that define it. It is not a unit vector. It is
/// meaningless if the features do not define a direction, as two parallel lines.
Vec3 turned_normal(const Start& s, const Carried& a, const Carried& b, const Lines& lines) {
  const Vec3& n = s.m.normal;
  switch (s.m.source) {
    case NormalSource::face_of_a:
      return a.turn * n;
    case NormalSource::face_of_b:
      return b.turn * n;
    case NormalSource::edges: {
      const Vec3 cross = lines.of_a.cross(lines.of_b);
      if (cross.norm() < kParallel) return Vec3::Zero();
      return cross.dot(n) < 0 ? Vec3(-cross.normalized()) : Vec3(cross.normalized());
    }
    default:
      break;
  }
  // This is the vector from B's point or line behind the surface to A's point or line.
  const Real depth_a = s.gap / 2 + s.m.radius_a, depth_b = s.gap / 2 + s.m.radius_b;
  const Vec3 core_a = s.arm_a + depth_a * n, core_b = s.arm_b - depth_b * n;
  const Real distance = depth_a + depth_b;
  Vec3 between = distance * n + (a.turn * core_a - core_a) - (b.turn * core_b - core_b) + a.shift - b.shift;
  if (s.m.source != NormalSource::points) {
    const Vec3& line = s.m.source == NormalSource::edge_of_a ? lines.of_a : lines.of_b;
    between -= line * line.dot(between);
  }
  const Real length = between.norm();
  return length > 0.5 * distance && distance > 0 ? Vec3(between / length) : Vec3(Vec3::Zero());
}

/// Returns the point where line A crosses line B as seen along the normal, relative to A's centre.
Vec3 crossing(const Vec3& on_a, const Vec3& from_b_to_a, const Lines& lines, const Vec3& n) {
  const Real area = lines.of_a.cross(lines.of_b).dot(n);
  return on_a - from_b_to_a.cross(lines.of_b).dot(n) / area * lines.of_a;
}

/// Computes the contact's place after a time. Returns false if its normal cannot be predicted.
bool place_after(const Start& s, Real time, ContactPlace& place) {
  const Carried a = carried(s.a, time), b = carried(s.b, time);
  const Vec3& n = s.m.normal;
  Lines lines;
  if (has_lines(s.m.source))
    lines = {turned_edge(s.a, s.surface_a, s.m.edge_a, a, s.arm_a, -n),
             turned_edge(s.b, s.surface_b, s.m.edge_b, b, s.arm_b, n)};
  place.normal = turned_normal(s, a, b, lines);
  if (!(place.normal.dot(n) > kPredictable)) return false;
  const Quat &from_a = start_orientation(s.a), &from_b = start_orientation(s.b);
  // The surface moves with its body, and the gap keeps the direction of the normal.
  const Vec3 to_a = s.gap / 2 * n, to_a_now = s.gap / 2 * place.normal;
  const auto arm_of_a = [&]() -> Vec3 {
    return turned_arm(s.surface_a, s.arm_a + to_a, from_a, -n, a.orientation, -place.normal) - to_a_now;
  };
  const auto arm_of_b = [&]() -> Vec3 {
    return turned_arm(s.surface_b, s.arm_b - to_a, from_b, n, b.orientation, place.normal) + to_a_now;
  };
  // Besides its motion along the first body's surface and the sliding, the contact moves with the material of
  // the other body.
  const Vec3 slide = time * s.sliding;
  const bool by_b = moves_with_b(s.m.source);
  const auto turn_of = [&](const Body& body, const RoundSurface& surface, const Carried& now, const Vec3& arm,
                           const Vec3& out, const Vec3& out_now) {
    if (!surface.is_revolved()) return now.turn;
    const Quat from = start_orientation(body) * surface.place.orientation;
    return meridian_turn(arm + from * surface.centre_off_axis(), from, out,
                         now.orientation * surface.place.orientation, out_now);
  };
  place.turn = by_b ? turn_of(s.b, s.surface_b, b, s.arm_b - to_a, n, place.normal)
                    : turn_of(s.a, s.surface_a, a, s.arm_a + to_a, -n, -place.normal);
  if (by_b) {
    place.arm_b = arm_of_b();
    place.arm_a = a.turn * s.arm_a + (place.arm_b - b.turn * s.arm_b) - slide;
    return true;
  }
  place.arm_a = arm_of_a();
  if (s.m.source == NormalSource::edges) {
    const Real depth_a = s.gap / 2 + s.m.radius_a, depth_b = s.gap / 2 + s.m.radius_b;
    const Vec3 core_a = place.arm_a + depth_a * place.normal, core_b = arm_of_b() - depth_b * place.normal;
    // Both lines start at the same point.
    const Vec3 from_b_to_a = core_a - core_b - (s.arm_a - s.arm_b) - b.shift + a.shift;
    place.arm_a = crossing(core_a, from_b_to_a, lines, place.normal) - depth_a * place.normal;
  }
  place.arm_b = b.turn * s.arm_b + (place.arm_a - a.turn * s.arm_a) + slide;
  return true;
}

/// Moves the arms of a contact whose normal cannot be predicted: the contact moves with the body that defines
/// it. Its place is the same for both bodies, so that impulses keep the angular momentum.
void carry_along(const Start& s, Real time, ContactPlace& place) {
  const Carried a = carried(s.a, time), b = carried(s.b, time);
  const Vec3 apart = s.arm_a - s.arm_b - (a.shift - b.shift);  // from a's centre to b's
  if (moves_with_b(s.m.source)) {
    place.arm_b = b.turn * s.arm_b;
    place.arm_a = place.arm_b + apart;
  } else {
    place.arm_a = a.turn * s.arm_a;
    place.arm_b = place.arm_a - apart;
  }
}

/// Change of the relative velocity because the contact moves, in the contact frame at the middle of the
/// interval.
struct Gain {
  Vec3 velocity;
  Real along_t, along_k;
};

Gain gain(const Start& s, const ContactMotion& motion, const ContactPlace& place) {
  const Twist a = twist_of(s.a), b = twist_of(s.b);
  const Vec3 &wa = a.angular_velocity, &wb = b.angular_velocity;
  const ContactPlace& middle = motion.middle;
  const Vec3 velocity = a.velocity + wa.cross(place.arm_a) - b.velocity - wb.cross(place.arm_b);
  Vec3 by_turning =
      motion.frame.components(wa.cross(place.arm_a - middle.arm_a) - wb.cross(place.arm_b - middle.arm_b));
  by_turning.x() += (place.normal - middle.normal).dot(velocity);
  if (s.m.count == 1) return {by_turning, 0, 0};  // a single point has no lever arms
  const Vec3 spin = wa - wb;
  const Quat turn = place.turn * middle.turn.conjugate();
  const auto along = [&](const Vec3& tangent) {
    return spin.dot((turn * tangent).cross(place.normal)) - spin.dot(tangent.cross(middle.normal));
  };
  return {by_turning, along(motion.frame.t), along(motion.frame.k)};
}

/// Fits a parabola through the gains at the start, the middle (where it is 0) and the end.
void set_gain(const Start& s, const ContactPlace& start, const ContactPlace& end, ContactMotion& motion) {
  const Gain first = gain(s, motion, start), last = gain(s, motion, end);
  motion.gain = (last.velocity - first.velocity) / 2;
  motion.bow = (last.velocity + first.velocity) / 2;
  motion.gain_along_t = (last.along_t - first.along_t) / 2;
  motion.gain_along_k = (last.along_k - first.along_k) / 2;
  motion.turns = true;
}

/// Returns the place of the contact of two centred spheres, whose rotation does not move the contact. All
/// contacts in a heap of balls are of this kind.
ContactPlace between_spheres(const Start& s, Real time) {
  const Vec3 between =
      (s.m.radius_a + s.m.radius_b) * s.m.normal + time * (twist_of(s.a).velocity - twist_of(s.b).velocity);
  const Vec3 n = between.normalized();
  return {n, s.arm_a + s.m.radius_a * (s.m.normal - n), s.arm_b + s.m.radius_b * (n - s.m.normal),
          Quat::Identity()};
}

/// Motion of an arm whose end turns with a body and slides by `sliding`.
struct Arm {
  Vec3 start, rate, curve;

  Arm(const Vec3& arm, const Vec3& w, const Vec3& sliding)
      : start(arm), rate(w.cross(arm)), curve(w.cross(rate)) {
    rate += sliding;
  }
};

/// Sets the motion of a corner or an edge of one body over a face of the other. Both bodies must turn by less
/// than kEven. The result is accurate to second order and needs no rotations. Almost all contacts in a heap
/// are of this kind.
void set_even_motion(const Start& s, const ContactFrame& frame, Real duration, ContactMotion& motion) {
  const Vec3 wa = twist_of(s.a).angular_velocity, wb = twist_of(s.b).angular_velocity, &n = frame.n;
  const bool by_b = s.m.source == NormalSource::face_of_a;
  const Vec3 &carrier = by_b ? wb : wa, n_rate = (by_b ? wa : wb).cross(n);
  const Arm a(s.arm_a, wa, by_b ? Vec3(-s.sliding) : Vec3(Vec3::Zero())),
      b(s.arm_b, wb, by_b ? Vec3(Vec3::Zero()) : s.sliding);
  const Real half = duration / 2, square = duration * duration / 8;
  motion.middle.arm_a += half * a.rate + square * a.curve;
  motion.middle.arm_b += half * b.rate + square * b.curve;
  motion.middle.turn =
      Quat(1, half / 2 * carrier.x(), half / 2 * carrier.y(), half / 2 * carrier.z()).normalized();
  if (n_rate != Vec3::Zero()) {
    motion.middle.normal = (n + half * n_rate).normalized();
    motion.frame = turned_frame(frame, motion.middle.normal);
  }
  const Vec3 bow = wa.cross(a.curve) - wb.cross(b.curve), spin = wa - wb;
  motion.gain = frame.components(half * (wa.cross(a.rate) - wb.cross(b.rate)) + 2 * square * bow);
  motion.gain.x() += half * n_rate.dot(s.sliding);
  motion.bow = square * frame.components(bow);
  const auto along = [&](const Vec3& tangent) {
    return half * spin.dot(carrier.cross(tangent).cross(n) + tangent.cross(n_rate));
  };
  motion.gain_along_t = along(frame.t);
  motion.gain_along_k = along(frame.k);
  motion.turns = true;
}

}  // namespace

ContactFrame turned_frame(const ContactFrame& f, const Vec3& n) {
  if (n == f.n) return f;
  const auto turn = [&](const Vec3& tangent) {
    return Vec3(tangent - tangent.dot(n) / (1 + f.n.dot(n)) * (f.n + n));
  };
  return {n, turn(f.t), turn(f.k)};
}

bool moves_with_b(NormalSource source) {
  return source == NormalSource::face_of_a || source == NormalSource::edge_of_a;
}

Vec3 start_centre(const Body& body) {
  return body.is_awake() ? body.start.position : body.start_pose.position;
}

bool runs_along(const Body& body, Real duration) {
  const Vec3 turn = duration * twist_of(body).angular_velocity;
  return has_revolved_part(body) && turn.squaredNorm() > kStraight * kStraight;
}

Real rim_speed(const Body& body, uint32_t piece, const Vec3& normal) {
  if (!body.is_awake() || !has_revolved_part(body)) return 0;
  const RoundSurface surface = round_surface(body, piece);
  if (!surface.is_revolved()) return 0;
  const Vec3 axis = body.start.orientation * (surface.place.orientation * Vec3::UnitY()),
             lean = normal.cross(axis);
  if (lean.norm() < kUpright || std::abs(normal.dot(axis)) < kUpright) return 0;
  return std::abs(body.start_twist.angular_velocity.cross(axis).dot(lean)) / lean.squaredNorm();
}

Vec3 turned_arm(const RoundSurface& surface, const Vec3& arm, const Quat& from, const Vec3& out_from,
                const Quat& to, const Vec3& out_to) {
  const auto with_body = [&](const Vec3& r) { return Vec3(to * (from.conjugate() * r)); };
  if (const Real radius = surface.round_radius(); radius > 0)
    return with_body(arm - radius * out_from) + radius * out_to;
  const Quat own_from = from * surface.place.orientation, own_to = to * surface.place.orientation;
  if (const Ellipsoid* ellipsoid = surface.ellipsoid()) {
    const auto facing = [&](const Quat& orientation, const Vec3& out) {
      const Vec3 scaled = ellipsoid->radii.cwiseProduct(orientation.conjugate() * out);
      return Vec3(ellipsoid->radii.cwiseProduct(scaled.normalized()));
    };
    // The contact can be next to the point that faces the other body, because of an error of the manifold.
    // This difference stays the same in the body's frame.
    return with_body(arm) + own_to * (facing(own_to, out_to) - facing(own_from, out_from));
  }
  if (!surface.is_revolved()) return with_body(arm);
  // The angle between the point and the meridian that faces the other body is an error of the manifold. It
  // stays the same.
  const Vec3 off_axis = surface.centre_off_axis(),
             from_axis = arm - surface.around * out_from + own_from * off_axis;
  return meridian_turn(from_axis, own_from, out_from, own_to, out_to) * from_axis - own_to * off_axis +
         surface.around * out_to;
}

ContactPlace contact_place(const Body& a, const Body& b, const Manifold& m, const Vec3& place, Real gap,
                           Real time, Real substep) {
  const Start start = start_of(a, b, m, place, gap);
  const ContactPlace at_start{m.normal, start.arm_a, start.arm_b, Quat::Identity()};
  if (std::max(twist_of(a).angular_velocity.norm(), twist_of(b).angular_velocity.norm()) * substep >
      kMostPredictedTurn)
    return at_start;
  ContactPlace now;
  if (place_after(start, time, now)) return now;
  now = at_start;
  carry_along(start, time, now);
  return now;
}

ContactMotion contact_motion(const Body& a, const Body& b, const Manifold& m, const ContactFrame& frame,
                             const Vec3& place, Real gap, Real duration, Real substep) {
  const Twist twist_a = twist_of(a), twist_b = twist_of(b);
  const Start start = start_of(a, b, m, place, gap);
  ContactMotion motion;
  motion.frame = frame;
  const bool is_face = m.source == NormalSource::face_of_a || m.source == NormalSource::face_of_b;
  const auto turn2 = [duration](const Body& body) {
    return duration * duration * twist_of(body).angular_velocity.squaredNorm();
  };
  const Real most2 = std::max(turn2(a), turn2(b));
  const ContactPlace at_start{m.normal, start.arm_a, start.arm_b, Quat::Identity()};
  motion.middle = at_start;
  if (const Real fraction = duration / substep;
      most2 > fraction * fraction * kMostPredictedTurn * kMostPredictedTurn)
    return motion;
  if (is_face && most2 < kStraight * kStraight) {
    // One body slides along the face of the other.
    if (m.source == NormalSource::face_of_b)
      motion.middle.arm_b += duration / 2 * start.sliding;
    else
      motion.middle.arm_a -= duration / 2 * start.sliding;
    return motion;
  }
  if (m.source == NormalSource::points && is_centred_sphere(a) && is_centred_sphere(b)) {
    const Vec3 displacement = duration * (twist_a.velocity - twist_b.velocity);
    const Real distance = m.radius_a + m.radius_b, along = m.normal.dot(displacement),
               least = kStraight * distance;
    if (displacement.squaredNorm() - along * along < least * least) return motion;
    const ContactPlace end = between_spheres(start, duration);
    if (!(end.normal.dot(m.normal) > kPredictable)) return motion;
    motion.middle = between_spheres(start, duration / 2);
    motion.frame = turned_frame(frame, motion.middle.normal);
    set_gain(start, at_start, end, motion);
    return motion;
  }
  const bool by_a = m.source == NormalSource::face_of_b;
  if (is_face && is_centred_sphere(by_a ? a : b) && turn2(by_a ? b : a) < kStraight * kStraight) {
    // This is a ball on a face that does not turn: only the motion of its centre moves the contact.
    const Vec3 displacement =
        duration / 2 *
        (start.sliding -
         (by_a ? 1 : -1) *
             (by_a ? twist_a : twist_b).angular_velocity.cross(by_a ? start.arm_a : start.arm_b));
    if (by_a)
      motion.middle.arm_b += displacement;
    else
      motion.middle.arm_a -= displacement;
    return motion;
  }
  const RoundSurface& carrier = m.source == NormalSource::face_of_a ? start.surface_b : start.surface_a;
  // A body that rides on a turning one would gain the error of the parabola in every interval.
  const bool is_carried = a.is_kinematic() || b.is_kinematic();
  if (is_face && !is_carried && most2 < kEven * kEven && !carrier.is_revolved() &&
      carrier.round_radius() == 0 && !carrier.ellipsoid()) {
    set_even_motion(start, frame, duration, motion);
    return motion;
  }
  ContactPlace middle, end;
  if (!place_after(start, duration / 2, middle) || !place_after(start, duration, end)) {
    carry_along(start, duration / 2, motion.middle);
    return motion;
  }
  motion.middle = middle;
  motion.frame = turned_frame(frame, middle.normal);
  set_gain(start, at_start, end, motion);
  return motion;
}

}  // namespace offstage::sim
