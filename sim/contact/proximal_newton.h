#pragma once
/// The exact solver of contact problems (physics N11): a proximal method of multipliers whose inner problems
/// are solved by a semismooth Newton method on the velocities of the bodies, with the true friction cone.
///
/// Coulomb's law is p in the cone C, u~ = u + mu |u_t| n in its dual, p . u~ = 0 (De Saxce and Feng, "The
/// bipotential method", 1998). With g = mu |u_t| held constant, multipliers q and penalties rho, the impulses
///   p(v) = projection of q - rho (u(v) - target + g n) on C
/// make M (v - v0) = J^T p(v) the stationarity condition of a smooth, strongly convex function of v. Newton's
/// method with line search minimizes it for any contacts: even with redundant contacts the matrix
///   H = M + sum J^T rho (dp/dq) J
/// is positive definite, and it has the sparsity of the graph of bodies. Then q := p and g := mu |u_t|, until
/// neither changes. Without sliding g is 0 and only q must converge. The multipliers of the last step are the
/// initial guess for the next: at rest they are the solution, which one evaluation confirms without a
/// factorization. See Rockafellar, "Monotone operators and the proximal point algorithm" (1976); Alart and
/// Curnier, "A mixed formulation for frictional contact problems prone to Newton like solution methods"
/// (1991).
///
/// Joints are constraints J (v - v0) = 0 of that minimization: Newton's steps solve the quasi-definite system
/// of H and J, so all iterates satisfy the constraints. Rows with bounds are treated like contacts, with an
/// interval in place of the cone.

#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "sim/articulation/joint_problem.h"
#include "sim/contact/contact_problem.h"
#include "sim/contact/friction_cone.h"
#include "sim/linear/block_cholesky.h"

namespace offstage::sim {

/// Keep one object per island between steps: the factored matrix of nearly the same contacts is reused.
class ProximalNewton {
 public:
  /// Solves until the residual is at most 1e-7 of the velocities (at least 1e-11 m/s). If convergence is
  /// slow, a residual of up to 1e-3 of the velocities is accepted; see ContactWork::residual. Starts from the
  /// contacts' impulses, whose effect must not yet be included in the velocities of the bodies. If the
  /// iterations reach their limit, projected Gauss-Seidel continues from the last iterate. If the cost would
  /// exceed `budget` [ns, see cost()], returns no result and changes nothing.
  std::optional<ContactWork> solve(std::span<ContactBody> bodies, std::span<Contact> contacts,
                                   const JointProblem& joints = {},
                                   Real budget = std::numeric_limits<Real>::infinity());

  /// Cost of the last solve(), estimated from the number of its operations for a machine of 2020 [ns].
  Real cost() const { return cost_; }

 private:
  struct Point {
    Vec3 multiplier, impulse, shifted;  // q, p(v), and the argument of the projection
    Real rho, lift, rise;               // lift: g; rise: the change of g that is still needed
    uint32_t a, b, pair;                // rows of the matrix; kNone for bodies that are not moved
    ConeRegion region;
    uint32_t turning;  // index into turnings_; kNone without rolling and spinning friction
  };
  /// Rolling and spinning friction of a point. The vectors have the components (s, t, k): spinning friction,
  /// and rolling friction about t and k [N m s]. The limits follow from the multipliers of the last update,
  /// not from the current impulses, so the minimized function stays convex. If `arm` [m] is > 0, spinning
  /// friction and sliding friction share one friction cone. The impulse of spinning friction is then divided
  /// by `arm`, its velocity is arm * w_n, and its penalty equals the penalty of the point.
  struct Turning {
    Vec3 multiplier = Vec3::Zero(), impulse = Vec3::Zero(), shifted = Vec3::Zero(), fixed = Vec3::Zero();
    Real arm = 0, rho = 0, mobility = 0;
    Real radius = 0;  // length that makes angular velocities comparable to velocities [m]
    Real spin_limit = 0, roll_limit = 0;
    Real spin_scale() const { return arm > 0 ? arm : 1; }
  };
  /// A row with bounds. `multiplier` is q, `impulse` is p(v), and `is_free`: whether no bound was applied to
  /// p(v).
  struct Bounded {
    Real multiplier, impulse, rho;
    uint32_t a, b, pair;
    bool is_free;
  };
  /// The constraints of a joint: one block row of the matrix. These rows follow the block rows of the bodies.
  struct Constraint {
    uint32_t a, b, pair_a, pair_b;
    Mat6 diagonal;
    Vec6 impulse;
  };
  struct Mixed {
    Eigen::VectorXd lift, rise;
  };
  /// Changes of the multipliers and of g in an iteration, as velocities [m/s].
  struct Change {
    Real multipliers = 0, lifts = 0;
  };
  /// Value of the minimized function, and the sum of the magnitudes of its terms, which bounds the rounding
  /// error.
  struct Merit {
    Real value = 0, size = 0;
    void add(Real term) {
      value += term;
      size += std::abs(term);
    }
  };
  static constexpr uint32_t kNone = UINT32_MAX;

  void number_bodies(std::span<const ContactBody> bodies, std::span<const Contact> contacts);
  void find_pairs(std::span<const Contact> contacts);
  uint32_t pair_of(uint32_t row, uint32_t other) const;
  void set_points(std::span<const ContactBody> bodies, std::span<const Contact> contacts);
  void set_joints();
  void scale_penalties(Real contacts, Real bounded);
  bool ramp_penalties(std::span<const Contact> contacts, Real tolerance, ContactWork& work);
  Real constraint_speed() const;
  Vec6 violation(std::size_t j) const;
  void satisfy_constraints();
  void add_constraint_blocks();
  void solve_for_direction();
  void finish_joints(std::span<ContactBody> bodies);
  void evaluate(std::span<const Contact> contacts);
  void gradient(std::span<const Contact> contacts);
  Real gradient_speed() const;
  bool assemble(std::span<const Contact> contacts, ContactWork& work);
  bool minimize(std::span<const Contact> contacts, Real tolerance, ContactWork& work);
  bool descend(std::span<const Contact> contacts);
  Change update_multipliers(std::span<const Contact> contacts);
  void mix_lifts(bool slow);
  // Contacts with rolling or spinning friction, proximal_turning.cpp
  void set_turning(std::span<const ContactBody> bodies, const Contact& c, Point& p);
  Vec3 turning_speed(const Contact& c, const Point& p) const;
  void evaluate_turning(const Contact& c, Point& p, const Vec3& u);
  Vec3 turning_impulse(const Contact& c, const Point& p) const;
  void assemble_turning(const Contact& c, const Point& p);
  Real turning_lift(const Contact& c, const Point& p, const Vec3& u) const;
  bool stays_open(const Contact& c, const Point& p, const Vec3& u) const;
  void update_turning(const Contact& c, Point& p, Change& change);
  void store_moments(std::span<Contact> contacts) const;
  Vec3 relative_velocity(const Contact& c, const Point& p, std::span<const Vec6> velocity) const;

  Real relative_velocity(const BoundedRow& r, const Bounded& p, std::span<const Vec6> velocity) const;

  std::vector<uint32_t> body_of_row_, row_of_body_;
  std::vector<std::pair<uint32_t, uint32_t>> pairs_;
  std::vector<Point> points_;
  std::vector<Turning> turnings_;
  std::vector<Vec6> free_, velocity_, trial_, gradient_, direction_;
  std::vector<Vec3> fixed_;  // relative velocity due to immovable bodies and offsets, less the target
  std::vector<Mat6> mass_;   // mass matrix of each row
  std::vector<LinkMobility> mobility_;
  std::vector<Mat6> diagonal_, off_;  // H
  std::vector<BlockRowKind> kinds_;
  JointProblem joints_;
  std::vector<Bounded> bounded_;
  std::vector<Constraint> constraints_;
  bool is_factored_ = false;
  std::size_t factored_contacts_ = 0;  // number of contacts when H was factored
  std::vector<Mixed> mixing_;          // values of the last iterations
  BlockCholesky<6> factor_;
  Merit merit_;
  Real cost_ = 0, budget_ = 0;
};

}  // namespace offstage::sim
