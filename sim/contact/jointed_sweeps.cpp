#include "sim/contact/jointed_sweeps.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

namespace offstage::sim {
namespace {

Vec6 twist_of(std::span<const ContactBody> bodies, uint32_t body) {
  Vec6 v = Vec6::Zero();
  if (body != kUnmoved) v << bodies[body].velocity, bodies[body].angular_velocity;
  return v;
}

/// Returns the velocity change of a body due to an impulse and an angular impulse.
Vec6 response_of(std::span<const ContactBody> bodies, uint32_t body, const Vec6& impulse) {
  if (body == kUnmoved) return Vec6::Zero();
  return LinkMobility{bodies[body].inverse_mass, bodies[body].inverse_inertia}.velocity(impulse);
}

void add_impulse(std::span<ContactBody> bodies, uint32_t body, const Vec6& impulse) {
  if (body == kUnmoved) return;
  const Vec6 v = response_of(bodies, body, impulse);
  bodies[body].velocity += v.head<3>();
  bodies[body].angular_velocity += v.tail<3>();
}

/// The constraints J (v - v0) = 0 of a joint, solved as one block.
class JointBlock {
 public:
  JointBlock(const JointConstraint& joint, std::span<const ContactBody> bodies)
      : joint_(joint), start_(velocity(bodies)) {
    Mat6 stiffness = Mat6::Zero();
    for (const auto& [body, on] :
         {std::pair(joint.a, &joint.rows->on_a), std::pair(joint.b, &joint.rows->on_b)})
      for (Eigen::Index k = 0; k < 6; ++k)
        stiffness.col(k) += on->transpose() * response_of(bodies, body, on->col(k));
    // Joints with fewer than six constraints have empty rows.
    for (Eigen::Index k = 0; k < 6; ++k)
      if (!(stiffness(k, k) > 0)) stiffness(k, k) = 1;
    factor_.compute(stiffness);
  }

  /// Solves the constraints and adds the impulses to `sum`. Returns the greatest change of a velocity.
  Real solve(std::span<ContactBody> bodies, Vec6& sum) const {
    const Vec6 error = velocity(bodies) - start_;
    const Vec6 impulse = -factor_.solve(error);
    if (!impulse.allFinite()) return 0;
    add_impulse(bodies, joint_.a, joint_.rows->on_a * impulse);
    add_impulse(bodies, joint_.b, joint_.rows->on_b * impulse);
    sum += impulse;
    return error.cwiseAbs().maxCoeff();
  }

 private:
  Vec6 velocity(std::span<const ContactBody> bodies) const {
    return joint_.rows->on_a.transpose() * twist_of(bodies, joint_.a) +
           joint_.rows->on_b.transpose() * twist_of(bodies, joint_.b);
  }

  const JointConstraint& joint_;
  Vec6 start_;
  Eigen::LDLT<Mat6> factor_;
};

Real solve_row(BoundedRow& r, std::span<ContactBody> bodies) {
  const Real mobility = r.on_a.dot(response_of(bodies, r.a, r.on_a)) +
                        r.on_b.dot(response_of(bodies, r.b, r.on_b)) + r.softness;
  if (!(mobility > 0)) return 0;
  const Real u = r.on_a.dot(twist_of(bodies, r.a)) + r.on_b.dot(twist_of(bodies, r.b)) + r.offset;
  const Real next =
      std::clamp(r.impulse - (u - r.target + r.softness * r.impulse) / mobility, r.lower, r.upper);
  const Real step = next - std::exchange(r.impulse, next);
  add_impulse(bodies, r.a, step * r.on_a);
  add_impulse(bodies, r.b, step * r.on_b);
  return std::abs(step) * mobility;
}

}  // namespace

uint32_t jointed_gauss_seidel(std::span<ContactBody> bodies, std::span<Contact> contacts,
                              const JointProblem& joints, uint32_t max_sweeps, Real tolerance) {
  for (Contact& c : contacts) c.impulse.setZero();
  for (BoundedRow& r : joints.bounded) r.impulse = 0;
  std::fill(joints.impulses.begin(), joints.impulses.end(), Vec6::Zero());
  std::vector<JointBlock> blocks;
  for (const JointConstraint& joint : joints.constraints) blocks.emplace_back(joint, bodies);
  for (uint32_t sweep = 1; sweep <= max_sweeps; ++sweep) {
    // The joints come last. A bounded number of sweeps then leaves an error in the contacts, and none in the
    // joints.
    const std::vector<ContactBody> before(bodies.begin(), bodies.end());
    projected_gauss_seidel(bodies, contacts, 1, tolerance);
    Real change = 0;
    for (BoundedRow& r : joints.bounded) change = std::max(change, solve_row(r, bodies));
    for (std::size_t j = 0; j < blocks.size(); ++j)
      change = std::max(change, blocks[j].solve(bodies, joints.impulses[j]));
    for (std::size_t i = 0; i < bodies.size(); ++i)
      change = std::max(change, (bodies[i].velocity - before[i].velocity).cwiseAbs().maxCoeff());
    if (change <= tolerance) return sweep;
  }
  return max_sweeps;
}

}  // namespace offstage::sim
