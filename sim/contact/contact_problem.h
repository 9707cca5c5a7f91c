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
/// where s = `spinning` / mu. Sliding and spinning have one common law, because both are sliding of the same
/// contact area. Rolling has a separate law, because it loses energy inside the bodies and not by sliding.
/// For a collision, v are the velocities before it, and target = -e u_n(before). For resting contact over a
/// time h, v are the velocities that the bodies would have after h without contacts. Then p / h are the
/// contact forces, and (u - u(now)) / h are the relative accelerations of R9.

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

/// One point where body a touches body b. Vectors in the contact's frame have the components (n, t, k).
struct Contact {
  uint32_t a = 0, b = 0;  ///< indices of bodies; not both unmoved
  ContactFrame frame;     ///< n from b to a
  /// Vectors from the centres of mass to the point, world axes [m].
  Vec3 arm_a = Vec3::Zero(), arm_b = Vec3::Zero();
  /// Velocity that is added to the relative velocity of the bodies, (n, t, k): the effect of moving surfaces
  /// and of the rotation of the contact's frame [m/s].
  Vec3 offset = Vec3::Zero();
  /// The part of `offset` that does no work: the velocity terms of physics R9 and, if the point slides
  /// throughout the interval, the sliding velocity at its start [m/s].
  Vec3 bias = Vec3::Zero();
  Real target = 0;  ///< smallest normal velocity after the solution [m/s]
  /// Coulomb's coefficients along t and k. If they are equal, friction has the round cone |p_tk| <= mu p_n;
  /// otherwise each axis has its own limit (R6).
  Real friction_t = 0, friction_k = 0;
  /// Coefficients of rolling and spinning friction: greatest angular impulse about a tangent, and about the
  /// normal, divided by the normal impulse [m].
  Real rolling = 0, spinning = 0;
  Vec3 impulse = Vec3::Zero();  ///< in: a guess; out: the solution [N s]
  Vec3 moment =
      Vec3::Zero();         ///< out: angular impulse (m_n, m_t, m_k) of rolling and spinning friction [N m s]
  bool is_guessed = false;  ///< whether `impulse` holds an initial guess

  bool is_isotropic() const { return friction_t == friction_k; }
  bool resists_turning() const { return rolling > 0 || spinning > 0; }
  Vec3 to_world(const Vec3& p) const { return frame.vector(p); }
  Vec3 to_frame(const Vec3& v) const { return {frame.n.dot(v), frame.t.dot(v), frame.k.dot(v)}; }
  /// Relative velocity (u_n, u_t, u_k) of a with respect to b, `offset` included [m/s].
  Vec3 relative_velocity(std::span<const ContactBody> bodies) const {
    return to_frame(bodies[a].velocity_at(arm_a) - bodies[b].velocity_at(arm_b)) + offset;
  }
  /// Relative angular velocity (w_n, w_t, w_k) [rad/s].
  Vec3 relative_spin(std::span<const ContactBody> bodies) const {
    return to_frame(bodies[a].angular_velocity - bodies[b].angular_velocity);
  }
};

/// Mobility K_i of R6, world axes [1/kg]: multiplied by an impulse at the point `arm`, it gives the change of
/// velocity of that point.
Mat3 mobility(const ContactBody& body, const Vec3& arm);
/// Mobility K_a + K_b of both bodies, in the contact's frame [1/kg].
Mat3 mobility(const Contact& contact, std::span<const ContactBody> bodies);

/// Applies an impulse in the contact's frame [N s] to a, and the opposite impulse to b.
void apply(const Contact& contact, const Vec3& impulse, std::span<ContactBody> bodies);

/// Applies an angular impulse in the contact's frame [N m s] to a, and the opposite one to b.
void apply_moment(const Contact& contact, const Vec3& moment, std::span<ContactBody> bodies);

/// Relative velocity of a bounded row of a joint, offset included [m/s] or [rad/s].
Real row_speed(const BoundedRow& row, std::span<const ContactBody> bodies);

/// Residual of an approximate solution: the greatest violation of the conditions above [m/s]. Impulses are
/// converted to velocities by |K| p.
Real residual(std::span<const ContactBody> bodies, std::span<const Contact> contacts);

/// The contact with the greatest violation of the conditions above; none if there are no contacts.
std::optional<std::size_t> worst_contact(std::span<const ContactBody> bodies,
                                         std::span<const Contact> contacts);

/// Kinetic energy of the bodies that contacts move [J].
Real kinetic_energy(std::span<const ContactBody> bodies);

/// Kinetic energy that the impulses of the contacts add to the bodies [J]. `before` has the velocities
/// without the impulses, `after` the velocities with them. The work of conveyors is not included. If all
/// targets and biases are zero, an exact solution adds no energy, because friction and plastic impacts
/// dissipate.
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

/// Solves the problem by projected Gauss-Seidel, the fall-back of the other solvers. It starts from the
/// contacts' impulses, whose effect must already be included in the velocities of the bodies. A sweep solves
/// the contacts one by one in order. Sweeps end when no velocity changes by more than `tolerance` [m/s], or
/// after `max_sweeps`. Returns the number of sweeps.
uint32_t projected_gauss_seidel(std::span<ContactBody> bodies, std::span<Contact> contacts,
                                uint32_t max_sweeps, Real tolerance);

}  // namespace offstage::sim
