#pragma once
/// Input and output of all contact solvers: bodies and their contact points. The problem is formulated on
/// velocities, for both collisions (R6, R7) and resting contact (R8, R9). The unknowns are the impulses p_i
/// at the contacts, in the contacts' frames, such that with
///   v+ = v + M^-1 sum_i J_i^T p_i,   u_i = J_i v+ + offset_i
/// each contact has
///   0 <= p_n,  0 <= u_n - target,  p_n (u_n - target) = 0,
///   (p_t, p_k) within the friction limits given by p_n, with the greatest dissipation against (u_t, u_k).
/// A contact with rolling or spinning friction also has the angular impulses m = (m_n, m_t, m_k), with the
/// relative angular velocity w:
///   (m_t, m_k) in a disc of radius `rolling` p_n, with the greatest dissipation against (w_t, w_k),
///   (p_t, p_k, m_n / s) in a ball of radius mu p_n, with the greatest dissipation against (u_t, u_k, s w_n),
/// where s = `spinning` / mu. The latter is one law for sliding and spinning, because both are the sliding of
/// one area of contact. Rolling loses its energy inside the bodies, not by sliding, and has its own law.
/// For a collision v are the velocities before it, and target = -e u_n of those. For resting contact over a
/// time h, v are the velocities that the bodies would have after h without contacts; then p / h are the
/// contact forces, and (u - u(now)) / h the relative accelerations of R9.

#include <cstdint>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "sim/articulation/joint_problem.h"
#include "sim/collision/contact_frame.h"
#include "sim/core/figures.h"
#include "sim/core/types.h"

namespace offstage::sim {

struct ContactBody {
  Real inverse_mass = 0;                ///< [1/kg]; 0: contacts do not move it
  Mat3 inverse_inertia = Mat3::Zero();  ///< inverse inertia about the centre of mass, world axes [1/(kg m^2)]
  /// Velocity of the centre of mass [m/s]; solvers add the effect of the impulses.
  Vec3 velocity = Vec3::Zero();
  Vec3 angular_velocity = Vec3::Zero();  ///< world [rad/s]

  bool is_moved() const { return inverse_mass > 0; }
  Vec3 velocity_at(const Vec3& arm) const { return velocity + angular_velocity.cross(arm); }
  void apply(const Vec3& impulse, const Vec3& arm) {
    velocity += inverse_mass * impulse;
    angular_velocity += inverse_inertia * arm.cross(impulse);
  }
};

/// One point where body a touches body b. Vectors of three numbers are in the order normal, t, k of its
/// frame.
struct Contact {
  uint32_t a = 0, b = 0;  ///< indices of bodies; not both unmoved
  ContactFrame frame;     ///< n from b to a
  /// Vectors from the centres of mass to the point, world axes [m].
  Vec3 arm_a = Vec3::Zero(), arm_b = Vec3::Zero();
  /// Velocity that is added to the relative velocity of the bodies, due to moving surfaces and the turning of
  /// the contact's frame [m/s].
  Vec3 offset = Vec3::Zero();
  /// The part of `offset` that is not due to moving surfaces: the velocity terms (physics R9) [m/s].
  Vec3 bias = Vec3::Zero();
  Real target = 0;  ///< smallest normal velocity after the solution [m/s]
  /// Coulomb's coefficients along t and k. If they are equal, friction has the round cone |p_tk| <= mu p_n;
  /// otherwise each axis has its own limit (R6).
  Real friction_t = 0, friction_k = 0;
  /// Rolling and spinning friction: the greatest angular impulse about the tangents and about the normal, per
  /// normal impulse [m].
  Real rolling = 0, spinning = 0;
  Vec3 impulse = Vec3::Zero();  ///< in: a guess; out: the solution [N s]
  Vec3 moment = Vec3::Zero();   ///< out: angular impulse (m_n, m_t, m_k), 0 without such friction [N m s]
  bool is_guessed = false;      ///< whether there is a guess

  bool is_isotropic() const { return friction_t == friction_k; }
  bool resists_turning() const { return rolling > 0 || spinning > 0; }
  Vec3 to_world(const Vec3& p) const { return p.x() * frame.n + p.y() * frame.t + p.z() * frame.k; }
  Vec3 to_frame(const Vec3& v) const { return {frame.n.dot(v), frame.t.dot(v), frame.k.dot(v)}; }
  /// Relative velocity (u_n, u_t, u_k), offset included.
  Vec3 relative_velocity(std::span<const ContactBody> bodies) const {
    return to_frame(bodies[a].velocity_at(arm_a) - bodies[b].velocity_at(arm_b)) + offset;
  }
  /// Relative angular velocity (w_n, w_t, w_k) [rad/s].
  Vec3 relative_spin(std::span<const ContactBody> bodies) const {
    return to_frame(bodies[a].angular_velocity - bodies[b].angular_velocity);
  }
};

/// K_i of R6: the velocity that a unit impulse at `arm` gives to the body's point there [1/kg], world axes.
Mat3 mobility(const ContactBody& body, const Vec3& arm);
/// K = K_a + K_b in the contact's frame.
Mat3 mobility(const Contact& contact, std::span<const ContactBody> bodies);

/// Adds a contact's impulse to its bodies.
void apply(const Contact& contact, const Vec3& impulse, std::span<ContactBody> bodies);

/// Adds an angular impulse in the contact's frame to its bodies.
void apply_moment(const Contact& contact, const Vec3& moment, std::span<ContactBody> bodies);

/// u of a row of a joint: its relative velocity, offset included [m/s] or [rad/s].
Real row_speed(const BoundedRow& row, std::span<const ContactBody> bodies);

/// Residual of an approximate solution: the greatest violation of the conditions above [m/s]. Impulses are
/// converted to velocities by |K| p.
Real residual(std::span<const ContactBody> bodies, std::span<const Contact> contacts);

/// The contact with the greatest violation of the conditions above; none if there are no contacts.
std::optional<std::size_t> worst_contact(std::span<const ContactBody> bodies,
                                         std::span<const Contact> contacts);

/// Kinetic energy of the bodies that contacts move [J].
Real kinetic_energy(std::span<const ContactBody> bodies);

/// Kinetic energy that the contacts' impulses add to bodies, whose velocities are `before` without and
/// `after` with the impulses [J]. The work of conveyors is not included. A solution without targets and
/// biases adds none: friction and plastic impacts dissipate.
Real added_energy(std::span<const ContactBody> before, std::span<const ContactBody> after,
                  std::span<const Contact> contacts);

/// Statistics of a solver, for StepReport.
struct ContactWork {
  uint64_t solves = 0;          ///< problems, one per island or cluster
  uint64_t iterations = 0;      ///< pivots, Newton steps or sweeps
  uint64_t factorizations = 0;  ///< full factorizations of the matrix
  uint64_t fallbacks = 0;       ///< problems that the intended solver did not solve
  /// Problems that exceeded the budget of the exact solver and were given to the fast one.
  uint64_t over_budget = 0;
  uint64_t cluster_truncated = 0;  ///< collisions solved without the contacts far from the impact
  /// Collisions with reduced restitution, and steps with reduced impulses, to avoid a gain of energy.
  uint64_t restitution_reduced = 0;
  Real residual = 0;  ///< greatest residual [m/s]

  static constexpr auto figures() {
    using T = ContactWork;
    return std::tuple(Figure("solves", &T::solves), Figure("iterations", &T::iterations),
                      Figure("factorizations", &T::factorizations), Figure("fallbacks", &T::fallbacks),
                      Figure("over_budget", &T::over_budget),
                      Figure("cluster_truncated", &T::cluster_truncated),
                      Figure("restitution_reduced", &T::restitution_reduced),
                      Figure("residual", &T::residual, OverSteps::greatest));
  }
  void add(const ContactWork& more) { add_figures(*this, more); }
};

/// Solves the problem by projected Gauss-Seidel, starting at the contacts' impulses, whose effect the bodies'
/// velocities must already contain. Each sweep solves the contacts one by one in order, until no velocity
/// changes by more than `tolerance` [m/s]. Returns the number of sweeps. It is the fall-back of the other
/// solvers.
uint32_t projected_gauss_seidel(std::span<ContactBody> bodies, std::span<Contact> contacts,
                                uint32_t max_sweeps, Real tolerance);

}  // namespace offstage::sim
