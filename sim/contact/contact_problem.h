#pragma once
/// What every solver of contacts is given and gives back: bodies, and points where two of them touch. It is a
/// problem on velocities, and serves collisions (R6, R7) and resting contact (R8, R9) alike: found are the
/// impulses p_i at the contacts, in the frames of these, such that with
///   v+ = v + M^-1 sum_i J_i^T p_i,   u_i = J_i v+ + offset_i
/// each contact has
///   0 <= p_n,  0 <= u_n - target,  p_n (u_n - target) = 0,
///   (p_t, p_k) in the friction limits given by p_n, against (u_t, u_k) with the greatest dissipation.
/// For a collision v are the velocities before it, and target = -e u_n of those. For resting contact over a
/// time h, v are the velocities that the bodies would have after h without contacts; then p / h are the
/// contact forces, and (u - u(now)) / h the relative accelerations of R9.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sim/collision/contact_frame.h"
#include "sim/core/types.h"

namespace offstage::sim {

struct ContactBody {
  Real inverse_mass = 0;                 ///< [1/kg]; 0: contacts do not move it
  Mat3 inverse_inertia = Mat3::Zero();   ///< about the centre of mass, world axes [1/(kg m^2)]
  Vec3 velocity = Vec3::Zero();          ///< of the centre of mass [m/s]; solvers add what the impulses do
  Vec3 angular_velocity = Vec3::Zero();  ///< world [rad/s]

  bool is_moved() const { return inverse_mass > 0; }
  Vec3 velocity_at(const Vec3& arm) const { return velocity + angular_velocity.cross(arm); }
  void apply(const Vec3& impulse, const Vec3& arm) {
    velocity += inverse_mass * impulse;
    angular_velocity += inverse_inertia * arm.cross(impulse);
  }
};

/// One point where body a touches body b. Its numbers are in the order normal, t, k of its frame.
struct Contact {
  uint32_t a = 0, b = 0;                            ///< indices of bodies; not both unmoved
  ContactFrame frame;                               ///< n from b to a
  Vec3 arm_a = Vec3::Zero(), arm_b = Vec3::Zero();  ///< from the centres of mass to the point, world [m]
  Vec3 offset = Vec3::Zero();  ///< added to the relative velocity: moving surfaces, turning frames [m/s]
  Vec3 bias = Vec3::Zero();    ///< the part of `offset` that no surface has: velocity terms of R9 [m/s]
  Real target = 0;             ///< least normal velocity afterwards [m/s]
  /// Coulomb's coefficients along t and k. Equal ones make the round cone, |p_tk| <= mu p_n; with different
  /// ones each axis has its own limit (R6).
  Real friction_t = 0, friction_k = 0;
  Vec3 impulse = Vec3::Zero();  ///< in: a guess; out: the solution [N s]
  bool is_guessed = false;      ///< whether the guess means anything

  bool is_isotropic() const { return friction_t == friction_k; }
  Vec3 to_world(const Vec3& p) const { return p.x() * frame.n + p.y() * frame.t + p.z() * frame.k; }
  Vec3 to_frame(const Vec3& v) const { return {frame.n.dot(v), frame.t.dot(v), frame.k.dot(v)}; }
  /// (u_n, u_t, u_k), offset included.
  Vec3 relative_velocity(std::span<const ContactBody> bodies) const {
    return to_frame(bodies[a].velocity_at(arm_a) - bodies[b].velocity_at(arm_b)) + offset;
  }
};

/// K_i of R6: the velocity that a unit impulse at `arm` gives to the point there [1/kg], world axes.
Mat3 mobility(const ContactBody& body, const Vec3& arm);
/// K = K_a + K_b in the contact's frame.
Mat3 mobility(const Contact& contact, std::span<const ContactBody> bodies);

/// Adds a contact's impulse to its bodies.
void apply(const Contact& contact, const Vec3& impulse, std::span<ContactBody> bodies);

/// How far an answer is from being one: the greatest violation of the conditions above [m/s]. Impulses count
/// by the velocities that they mean, |K| p.
Real residual(std::span<const ContactBody> bodies, std::span<const Contact> contacts);

/// The contact that violates the conditions above most; none without contacts.
std::optional<std::size_t> worst_contact(std::span<const ContactBody> bodies,
                                         std::span<const Contact> contacts);

/// Kinetic energy that the contacts' impulses add to bodies that have the velocities `before` without them
/// and `after` with them [J]. The work of surfaces that move by themselves is not part of it. A solution
/// without targets and biases adds none: friction and plastic impacts dissipate.
Real added_energy(std::span<const ContactBody> before, std::span<const ContactBody> after,
                  std::span<const Contact> contacts);

/// What a solver did: figures for StepReport.
struct ContactWork {
  uint64_t solves = 0;             ///< problems, one per island or cluster
  uint64_t iterations = 0;         ///< pivots, Newton steps or sweeps
  uint64_t factorizations = 0;     ///< of the matrix, from the beginning
  uint64_t fallbacks = 0;          ///< problems that the solver meant for them did not solve
  uint64_t over_budget = 0;        ///< that became too dear for the exact solver and went to the fast one
  uint64_t cluster_truncated = 0;  ///< collisions of which contacts far from the impact were left out
  uint64_t restitution_reduced =
      0;              ///< collisions with less restitution, steps with smaller impulses, to keep the energy
  Real residual = 0;  ///< greatest left over [m/s]

  void add(const ContactWork& w) {
    solves += w.solves;
    iterations += w.iterations;
    factorizations += w.factorizations;
    fallbacks += w.fallbacks;
    over_budget += w.over_budget;
    cluster_truncated += w.cluster_truncated;
    restitution_reduced += w.restitution_reduced;
    residual = residual < w.residual ? w.residual : residual;
  }
};

/// Projected Gauss-Seidel from the impulses that the contacts hold, which the bodies' velocities must already
/// contain: sweeps in order, each contact solved by itself, until a sweep changes no velocity by more than
/// `tolerance` [m/s]. Returns the number of sweeps. The fall-back of the other solvers.
uint32_t projected_gauss_seidel(std::span<ContactBody> bodies, std::span<Contact> contacts,
                                uint32_t max_sweeps, Real tolerance);

}  // namespace offstage::sim
