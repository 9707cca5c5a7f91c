#include "sim/contact/contact_terms.h"

#include <algorithm>
#include <cmath>

#include "sim/contact/round_surface.h"
#include "sim/core/rotation.h"

namespace offstage::sim {
namespace {

/// Static friction applies below this sliding speed [m/s].
constexpr Real kSlip = 1e-3;
/// A thin body may exceed its expected energy of rotation by this fraction after a sub-step.
constexpr Real kSpinExcess = 1e-3;
/// Cosine of the greatest angle by which the orientation of a body is corrected to agree with its angular
/// momentum.
constexpr Real kAligned = 0.995;

/// Returns the material point of a round body that represents a place on the surface of a piece: a point of
/// the axis, or the centre. The surface turns through the contact; these points do not.
Vec3 core_point(const Body& body, uint32_t piece, const Vec3& place) {
  const RoundSurface surface = round_surface(body, piece);
  const bool is_ball = std::holds_alternative<Sphere>(*surface.shape);
  if (!is_ball && !is_round_about_axis(*surface.shape)) return place;
  const Vec3 local = surface.place.point_to_body(body.start_pose.point_to_body(place));
  const Vec3 on_axis(0, is_ball ? 0 : local.y(), 0);
  return body.start_pose.point_to_world(surface.place.point_to_world(on_axis));
}

struct PointRates {
  /// Motion of a material point at the start. The acceleration is the part without forces, w x (w x r).
  Vec3 velocity, acceleration;
};

PointRates rates(const Body& body, const Vec3& place) {
  if (body.is_awake()) {
    const Vec3 &w = body.start_twist.angular_velocity, wr = w.cross(place - body.start.position);
    return {body.start_twist.velocity + wr, w.cross(wr)};
  }
  // The velocities of kinematic bodies belong to the interval's end, so they need no correction.
  return {body.start_velocity(place), Vec3::Zero()};
}

Twist twist(const Body& body) {
  // The twist refers to the origin of the world.
  if (body.is_awake()) {
    const Vec3& w = body.start_twist.angular_velocity;
    return {body.start_twist.velocity - w.cross(body.start.position), w};
  }
  if (!body.is_kinematic()) return {};
  const Vec3& w = body.drive.angular_velocity;
  return {body.drive.velocity - w.cross(body.pose.position), w};
}

bool is_face(NormalSource s) {
  return s == NormalSource::face_of_a || s == NormalSource::face_of_b;
}

/// Below this squared angular velocity, faces do not turn in a step [1/s^2].
constexpr Real kNoSpin = 1e-14;
Real spin(const Body& body) {
  if (body.is_awake()) return body.start_twist.angular_velocity.squaredNorm();
  return body.is_kinematic() ? body.drive.angular_velocity.squaredNorm() : 0;
}

/// Returns the rotation by a rotation vector, computed by series. It is accurate enough for the rotation of
/// contacts in a step, and needs no trigonometric functions, whose last bits differ between libraries.
Quat rotation(const Vec3& v) {
  const Real s = v.squaredNorm() / 4;
  const Real sine = 1 - s / 6 * (1 - s / 20 * (1 - s / 42)), cosine = 1 - s / 2 * (1 - s / 12 * (1 - s / 30));
  return Quat(cosine, sine * v.x() / 2, sine * v.y() / 2, sine * v.z() / 2);
}

/// Corrects a body whose rotation has more energy than expected, by more than `fraction` of the larger of the
/// expected and the free energy (`free_energy` is twice the energy). The orientation is turned so that the
/// angular momentum has the direction that belongs to the angular velocity `expected`. If this takes a
/// rotation of more than `farthest` [rad], the body gets the expected angular velocity instead. If a body
/// turns by radians, the sum of two velocities at different orientations may itself have too much energy.
/// Energy above `most`, twice the energy at the orientation at which the impulses act, is then removed.
void agree_with_spin(RigidBody& r, const Vec3& expected, Real free_energy, Real most, Real fraction,
                     Real farthest) {
  const Vec3 wanted = r.spin_momentum(r.orientation, expected);
  const Real energy = expected.dot(wanted);
  const auto exceeds = [&](Real limit) {
    const Real excess = r.angular_velocity().dot(r.angular_momentum) - limit;
    return excess > fraction * std::max(free_energy, limit);
  };
  if (exceeds(energy)) {
    const Real aligned = std::max(kAligned, 1 - farthest * farthest / 2);
    if (wanted.dot(r.angular_momentum) > aligned * wanted.norm() * r.angular_momentum.norm())
      r.orientation = (rotation_between(wanted, r.angular_momentum) * r.orientation).normalized();
    else
      r.angular_momentum = wanted;
  }
  if (energy > most && exceeds(most))
    r.angular_momentum *= std::sqrt(most / r.angular_velocity().dot(r.angular_momentum));
}

}  // namespace

/// Returns the change of the relative velocity in an interval of length h by the velocity terms of R9, in the
/// contact's frame. These are the terms of the relative acceleration that are not linear in the accelerations
/// of the bodies:
///   n . (c_a'' - c_b'') + 2 n' . (c_a' - c_b') - |n'|^2 D
/// with material points c on both bodies at a distance D along n. (For two centres of spheres, this is n.c''
/// + n'.c', without the factor 2.) The tangential terms are due to the rotation of the bodies.
///
/// The terms with n' are valid while n turns little. When sharp corners slide past each other, or edges that
/// are almost parallel, n turns by any angle in a very short time. The velocity of separation is then at most
/// the sliding speed. For two points that pass each other with the velocity s, T = s^2 / D gives
///   d/dt |(D, s t)| at h = T h / sqrt(1 + (T h / s)^2),
/// which is used in all cases.
Vec3 velocity_bias(const ContactPair& pair, const PlacedManifold& placed, const ContactPoint& point, Real h) {
  const Manifold& m = placed.manifold;
  if (is_face(m.source) && spin(pair.a()) < kNoSpin && spin(pair.b()) < kNoSpin) return Vec3::Zero();
  const Vec3 place_a =
      m.source == NormalSource::face_of_a ? point.on_a : core_point(pair.a(), m.piece_a, point.on_a);
  const Vec3 place_b =
      m.source == NormalSource::face_of_b ? point.on_b : core_point(pair.b(), m.piece_b, point.on_b);
  const PointRates a = rates(pair.a(), place_a), b = rates(pair.b(), place_b);
  const Vec3 n_rate =
      is_face(m.source)
          ? twist(m.source == NormalSource::face_of_a ? pair.a() : pair.b()).angular_velocity.cross(m.normal)
          : normal_rate(m, point, twist(pair.a()), twist(pair.b()));
  const Vec3 velocity = a.velocity - b.velocity, acceleration = a.acceleration - b.acceleration;
  const Real distance = m.normal.dot(place_a - place_b);
  const Real turned = h * (2 * n_rate.dot(velocity) - n_rate.squaredNorm() * distance);
  const Real sliding2 = (velocity - m.normal.dot(velocity) * m.normal).squaredNorm();
  const Real parting = turned == 0 ? 0 : turned * std::sqrt(sliding2 / (sliding2 + turned * turned));
  return {h * m.normal.dot(acceleration) + parting, h * placed.frame.t.dot(acceleration),
          h * placed.frame.k.dot(acceleration)};
}

Vec3 surface_velocity(const ContactPair& pair, const Vec3& n) {
  if (!pair.surface().conveys) return Vec3::Zero();
  const Vec3 v = pair.a().start_pose.vector_to_world(pair.a().def.surface_velocity) -
                 pair.b().start_pose.vector_to_world(pair.b().def.surface_velocity);
  return v - n.dot(v) * n;
}

std::pair<Real, Real> friction(const PairSurface& surface, const Vec3& u) {
  const bool slips = u.y() * u.y() + u.z() * u.z() > kSlip * kSlip;
  const Real mu = slips ? surface.friction : surface.static_friction;
  return {mu, mu * surface.cross};
}

Vec3 origin(const Body& body) {
  return body.is_awake() ? body.start.position : body.pose.position;
}

ContactBody unmoved_body(const Body& body) {
  ContactBody b;
  if (body.is_kinematic()) {
    b.velocity = body.drive.velocity;
    b.angular_velocity = body.drive.angular_velocity;
  }
  return b;
}

Mat3 inverse_inertia(const RigidBody& body, const Quat& orientation) {
  const Mat3 R = orientation.toRotationMatrix();
  return R * body.inverse_inertia * R.transpose();
}

Vec3 rotation_vector(const Quat& from, const Quat& to) {
  const Quat turn = to * from.conjugate();
  const Vec3 sine = turn.w() < 0 ? Vec3(-turn.vec()) : Vec3(turn.vec());
  const Real s = sine.squaredNorm();
  return 2 * (1 + s / 6 * (1 + 9 * s / 20 * (1 + 25 * s / 42))) * sine;
}

void add_effect(Body& body, const IntervalEffect& effect) {
  RigidBody& r = body.rigid;
  const Vec3 free = r.angular_velocity(), expected = free + effect.spin;
  const Real free_energy = free.dot(r.angular_momentum);  // twice the energy
  r.position += effect.shift;
  if (effect.turn != Vec3::Zero()) r.orientation = (rotation(effect.turn) * r.orientation).normalized();
  r.momentum += effect.impulse;
  r.angular_momentum += effect.angular_impulse;
  // The orientation is uncertain for two reasons: the time of the impulses within the interval is unknown,
  // and the whole turn in the interval has an effect of second order.
  if (r.is_thin()) {
    const Real turned = rotation_vector(body.start.orientation, r.orientation).squaredNorm();
    const Real most = (effect.free_spin + effect.spin).dot(r.angular_momentum);
    agree_with_spin(r, expected, free_energy, most, effect.fraction * kSpinExcess,
                    effect.turn.norm() + turned);
  }
  body.pose = r.pose();
}

}  // namespace offstage::sim
