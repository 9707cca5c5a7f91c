#pragma once
/// Solution of the contacts of one island by the exact solver (physics R8, R9, N11).

#include <optional>
#include <vector>

#include "sim/contact/closing_contacts.h"
#include "sim/contact/island_joints.h"
#include "sim/contact/proximal_newton.h"
#include "sim/contact/riding_bodies.h"

namespace offstage::sim {

/// Solves the contacts of one island to rounding. The bodies must have moved freely through the interval,
/// from Body::start to Body::rigid. The effect of the contacts is added to this motion. Keep one object per
/// island.
class ExactContacts {
 public:
  /// How the problem is solved.
  enum class Method : uint8_t {
    proximal,  ///< proximal Newton method on the true friction cone
    lcp        ///< linear complementarity (contact_lcp.h); `proximal` if that fails
  };
  struct Outcome {
    /// Whether the result was applied. If false, nothing was changed, because the cost exceeded the budget or
    /// the result of a fall-back was unsafe.
    bool is_applied = false;
    ContactWork work;
    ContactWork lcp;                     ///< work of Method::lcp; `work` is then only the fall-back's
    const ContactPair* rough = nullptr;  ///< after a fall-back: the pair with the greatest error
  };
  /// Solves the contacts and applies the result. It stops when the cost exceeds `budget` [ns, see
  /// SolverChoice]. The result of a fall-back is applied only if its error is small and it adds no kinetic
  /// energy; otherwise the fast solver, whose work is bounded, must solve the island.
  Outcome solve(const Island& island, const ContactInterval& interval, Real budget,
                Method method = Method::proximal);
  /// Cost of the last solve(), without division_cost() [ns].
  Real cost() const { return cost_; }
  /// Cost of dividing the interval of the last solve() at the times at which contacts close [ns].
  Real division_cost() const { return division_cost_; }

 private:
  /// A point that slides throughout the interval, along the axes t and k for which `axes` is 1. Vectors are 0
  /// along the others.
  struct Sliding {
    uint32_t contact;
    Eigen::Vector2d axes;
    /// Sliding velocity at the start with the arms of the middle, and this velocity minus the velocity terms
    /// of a point that does not slide, in (t, k) [m/s].
    Eigen::Vector2d start, change;
  };
  uint32_t add_body(Body& body, const ContactInterval& interval);
  void add_points(ContactPair& pair, const ContactInterval& interval, Method method);
  void add_sliding(const Vec3& u, Real force, Real duration);
  void add_sliding(const Vec3& u, const Eigen::Vector2d& axes, Real greatest_change);
  bool remove_sliding(bool all);
  void push_apart(const Island& island, Real duration);
  std::optional<ContactWork> solve_by_newton(Real budget);
  bool solve_lcp(ContactWork& work);
  bool has_closing() const;
  bool divide_at_closings(const Island& island, const ContactInterval& interval, Real budget,
                          ContactWork& work);
  bool is_safe(const ContactWork& work) const;
  void move_bodies(const Island& island, const ContactInterval& interval);
  void close_stops();
  void close_links();
  void close_neighbors(const Island& island, Real duration);

  std::vector<ContactBody> bodies_, free_;  // free_: the velocities without contacts
  std::vector<Contact> contacts_;
  std::vector<const ContactPair*> pairs_;  // pair of each contact
  std::vector<PointForce*> forces_;        // force of each contact, in its pair
  // By contact: absolute value of the speed at the start minus the part due to rotation [m/s].
  std::vector<Real> approach_;
  std::vector<Sliding> sliding_;
  // By body: weight of the end's velocities in its motion, as BoundedOrigin::end_weight; 1 if a contact of it
  // closed in the interval.
  std::vector<Real> end_weights_;
  // By body: mean change of velocity over the interval, divided by the change at its end.
  std::vector<Real> rest_;
  bool may_divide_ = false;                  // whether the interval of the island may be divided
  std::vector<ClosingPoint> points_;         // by contact
  std::vector<Displacement> displacements_;  // by body, if the interval was divided
  std::vector<Displacement> pushes_;         // by body: corrections of overlaps; empty if there are none
  bool has_carrier_ = false;                 // whether a body may ride on a body of the contacts
  RidingBodies riding_;
  Real cost_ = 0, division_cost_ = 0;
  IslandJoints joints_;
  ProximalNewton newton_;
};

}  // namespace offstage::sim
