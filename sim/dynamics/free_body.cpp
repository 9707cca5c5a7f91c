#include "sim/dynamics/free_body.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "sim/dynamics/flat.h"
#include "sim/dynamics/rigid_jacobian.h"

namespace offstage::sim {
namespace {

/// Greatest rotation of a body in a piece of a sub-step [rad], and greatest number of pieces. The speed is
/// the fastest spin that the body's angular momentum allows: a thin body that turns about a short axis may
/// later spin about its long axis.
constexpr Real kTurn = 0.5, kMostPieces = 8;
/// If more pieces were needed, SplitRotation is used. In one of its pieces, the angle of a kick is at most
/// kKick and the angle of the nutation at most kNutation [rad]. The number of pieces is at most kMostKicks.
constexpr Real kKick = 0.05, kNutation = 0.2, kMostKicks = 1000;
/// Accepted relative error of the energy of a free rotation; the exact energy is constant.
constexpr Real kRotationEnergy = 1e-3;

/// Returns the quaternion that is stored in the coordinates of a body.
Eigen::Map<Eigen::Vector4d> turn_of(std::span<Real> x) {
  return Eigen::Map<Eigen::Vector4d>(&x[3]);
}
Eigen::Map<const Eigen::Vector4d> turn_of(std::span<const Real> x) {
  return Eigen::Map<const Eigen::Vector4d>(&x[3]);
}

RigidMotion motion_of(const RigidBody& body, std::span<const Real> x, std::span<const Real> p) {
  const Quat q = Quat(turn_of(x)).normalized();
  return {vec3(x, 0), q, vec3(p, 0) / body.mass, body.angular_velocity(q, vec3(p, 3))};
}

/// Whether all axes have the same moment of inertia, within the rounding errors of a mesh's inertia.
bool is_isotropic(const Mat3& inertia) {
  const Real tiny = 1e-13 * inertia(0, 0);
  return std::abs(inertia(0, 1)) <= tiny && std::abs(inertia(0, 2)) <= tiny &&
         std::abs(inertia(1, 2)) <= tiny && std::abs(inertia(1, 1) - inertia(0, 0)) <= tiny &&
         std::abs(inertia(2, 2) - inertia(0, 0)) <= tiny;
}

bool is_pulled(const RigidBody& body, std::span<const ActiveForce> forces) {
  return std::any_of(forces.begin(), forces.end(), [&](const ActiveForce& f) { return f.acts_on(body); });
}

void integrate(RigidBody& body, const BodyForces& forces, const Integrator& integrator, Real t, Real h,
               IntegratorWorkspace& work) {
  std::array<Real, kBodyX> x;
  std::array<Real, kBodyP> p;
  load(body, x, p);
  work.next_step = body.next_step;
  stable_integrator(integrator, stiffness(body, forces), h).step(FreeBody(body, forces), t, h, x, p, work);
  body.next_step = work.next_step;
  store(x, p, body);
}

}  // namespace

namespace {

/// Computes the free rotation of a body that may turn by many radians in a sub-step. Its kinetic energy is
/// split into the energy of a symmetric top and a term of one axis. The motion of each part has a closed
/// form, and the two motions are applied alternately (Touma and Wisdom, "Lie-Poisson integrators for rigid
/// body dynamics in the solar system", 1994). The angular momentum is conserved exactly, and the energy does
/// not drift.
class SplitRotation {
 public:
  explicit SplitRotation(const RigidBody& body) : H_(body.angular_momentum) {
    const Eigen::SelfAdjointEigenSolver<Mat3> solver(body.inertia);
    Mat3 axes = solver.eigenvectors();
    if (axes.determinant() < 0) axes.col(0) = -axes.col(0);
    body_from_principal_ = Quat(axes).normalized();
    inverse_ = solver.eigenvalues().cwiseInverse();
    // The two axes with the most similar moments make the symmetric top.
    const bool is_flat = inverse_[0] - inverse_[1] < inverse_[1] - inverse_[2];
    own_ = is_flat ? 2 : 0;
    kicked_ = is_flat ? 0 : 2;
  }

  /// Advances the body over a time h.
  void advance(RigidBody& body, Real h) const {
    const Real momentum = H_.norm(), kick = std::abs(inverse_[kicked_] - inverse_[1]) * momentum,
               nutation = std::sqrt(kick * momentum * inverse_[0]);
    const Real pieces =
        std::clamp(std::ceil(h * std::max(kick / kKick, nutation / kNutation)), 1.0, kMostKicks);
    const Real before = energy(body.orientation);
    Quat q = body.orientation * body_from_principal_;
    for (Real i = 0; i < pieces; ++i) {
      turn(q, kicked_, h / pieces / 2);
      turn(q, own_, h / pieces);
      q = (rotation(inverse_[1] * H_, h / pieces) * q).normalized();
      turn(q, kicked_, h / pieces / 2);
    }
    q = (q * body_from_principal_.conjugate()).normalized();
    // If even this is too inaccurate, a rotation about the angular momentum conserves the energy.
    if (!(std::abs(energy(q) - before) <= kRotationEnergy * before))
      q = (rotation(inverse_[1] * H_, h) * body.orientation).normalized();
    body.orientation = q;
  }

 private:
  /// Rotates the body by the energy term of one axis. The factor of this term is the axis's inverse inertia
  /// minus the inverse inertia of the middle axis.
  void turn(Quat& q, int axis, Real h) const {
    const Real along = (q.conjugate() * H_)[axis];
    q = q * rotation(along * (inverse_[axis] - inverse_[1]) * Vec3::Unit(axis), h);
  }
  Real energy(const Quat& orientation) const {
    const Vec3 local = (orientation * body_from_principal_).conjugate() * H_;
    return local.cwiseAbs2().dot(inverse_) / 2;
  }

  Vec3 H_, inverse_;
  Quat body_from_principal_;
  int own_, kicked_;
};

}  // namespace

RigidStage::RigidStage(const RigidBody& rigid, std::span<const Real> x, std::span<const Real> p)
    : body(rigid), turn(turn_of(x)), motion(motion_of(rigid, x, p)), angular_momentum(vec3(p, 3)) {}

void RigidStage::velocity(std::span<Real> dx) const {
  const Vec3& w = motion.angular_velocity;
  vec3(dx, 0) = motion.velocity;
  // dq/dt = 1/2 (0, w) q
  turn_of(dx) = 0.5 * (Quat(0, w.x(), w.y(), w.z()) * Quat(turn)).coeffs();
}

void RigidStage::force(const BodyForces& forces, Real t, std::span<Real> dp) const {
  Vec3 force =
      body.mass * forces.gravity - body.linear_drag * (motion.velocity - forces.wind) + body.push.force;
  Vec3 torque = -body.angular_drag * motion.angular_velocity + body.push.torque;
  for (const ActiveForce& f : forces.forces) {
    if (!f.acts_on(body)) continue;
    const Wrench w = effect_wrench(*f.def, forces.inside(t), motion, body.centre, body.linear_drag);
    force += w.force;
    torque += w.torque;
  }
  vec3(dp, 0) = force;
  vec3(dp, 3) = torque;
}

void load(const RigidBody& body, std::span<Real> x, std::span<Real> p) {
  vec3(x, 0) = body.position;
  turn_of(x) = body.orientation.coeffs();
  vec3(p, 0) = body.momentum;
  vec3(p, 3) = body.angular_momentum;
}

void store(std::span<const Real> x, std::span<const Real> p, RigidBody& body) {
  body.position = vec3(x, 0);
  body.orientation = Quat(turn_of(x)).normalized();
  body.momentum = vec3(p, 0);
  body.angular_momentum = vec3(p, 3);
}

Stiffness stiffness(const RigidBody& body, const BodyForces& forces) {
  const Real by_moment = body.inverse_inertia.norm();
  Stiffness at_centre{0, body.linear_drag}, at_points;
  for (const ActiveForce& f : forces.forces) {
    if (!f.acts_on(body)) continue;
    if (const auto* grab = std::get_if<Grab>(&f.def->effect))
      at_points +=
          (1 / body.mass + (grab->point - body.centre).squaredNorm() * by_moment) * stiffness(*f.def);
    else
      at_centre += stiffness(*f.def);
  }
  // Forces at the centre and torques do not affect each other.
  at_points.by_velocity += std::max(at_centre.by_velocity / body.mass, body.angular_drag * by_moment);
  return at_points;
}

void FreeBody::velocity(Real, std::span<const Real> x, std::span<const Real> p, std::span<Real> dx) const {
  RigidStage(body_, x, p).velocity(dx);
}

void FreeBody::force(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dp) const {
  if (forces_.forces.empty() && body_.linear_drag == 0 && body_.angular_drag == 0 && !body_.is_pushed()) {
    vec3(dp, 0) = body_.mass * forces_.gravity;
    vec3(dp, 3).setZero();
  } else {
    RigidStage(body_, x, p).force(forces_, t, dp);
  }
}

void FreeBody::jacobian(Real t, std::span<const Real> x, std::span<const Real> p,
                        SparseEntries& entries) const {
  const RigidStage stage(body_, x, p);
  const RigidDerivative d(stage);
  const StateColumns at{0, static_cast<int>(kBodyX)};
  add_block(d.own_rates(forces_, t), at, at, entries);
}

Real greatest_spin(const RigidBody& body) {
  return body.angular_momentum.norm() * body.inverse_inertia.norm();
}

Quat rotation(const Vec3& w, Real h) {
  // With a = h |w| / 2, the quaternion is (cos a, sin a / a * h w / 2). Both functions are even series in a.
  // A large angle is halved until the series are short, and the result is squared as often.
  Vec3 half = h / 2 * w;
  int squarings = 0;
  for (; half.squaredNorm() > 0.25 && squarings < 600; ++squarings) half /= 2;
  const Real s = half.squaredNorm();
  // The series are 1 - s/2! + s^2/4! - ... and 1 - s/3! + s^2/5! - ...; their next terms are below 1e-17.
  Real cosine = 1, sinc = 1;
  for (int k = 14; k > 0; k -= 2) {
    cosine = 1 - s / (k * (k - 1)) * cosine;
    sinc = 1 - s / (k * (k + 1)) * sinc;
  }
  Quat q(cosine, sinc * half.x(), sinc * half.y(), sinc * half.z());
  for (; squarings > 0; --squarings) q = (q * q).normalized();
  return q;
}

void fly(RigidBody& body, const BodyForces& forces, const Integrator& integrator, Real t, Real h,
         IntegratorWorkspace& work) {
  if (body.linear_drag != 0 || body.angular_drag != 0 || body.is_pushed() || is_pulled(body, forces.forces))
    return integrate(body, forces, integrator, t, h, work);
  const Vec3 velocity = body.velocity();
  const Vec3 position = body.position + h * (velocity + h / 2 * forces.gravity);
  const Vec3 momentum = body.momentum + h * body.mass * forces.gravity;
  if (!body.angular_momentum.isZero(0)) {
    if (is_isotropic(body.inertia)) {
      const Quat turned = rotation(body.angular_momentum / body.inertia(0, 0), h) * body.orientation;
      // The length is 1 within rounding, so one Newton step for 1 / sqrt(length^2) is enough.
      body.orientation.coeffs() = (1.5 - 0.5 * turned.squaredNorm()) * turned.coeffs();
    } else {
      // Integrators with a fixed step are inaccurate for much larger rotations in a step.
      const Real pieces = std::max(std::ceil(greatest_spin(body) * h / kTurn), 1.0);
      if (!(pieces <= kMostPieces)) SplitRotation(body).advance(body, h);
      for (Real i = 0; i < pieces && pieces <= kMostPieces; ++i)
        integrate(body, {Vec3::Zero(), {}}, integrator, t + i * h / pieces, h / pieces, work);
    }
  }
  body.position = position;
  body.momentum = momentum;
}

}  // namespace offstage::sim
