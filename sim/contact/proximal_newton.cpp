#include "sim/contact/proximal_newton.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "sim/core/twist.h"
#include "sim/linear/least_squares.h"

namespace offstage::sim {
namespace {

/// Penalty of a contact times its mobility. In a direction whose eigenvalue of the mobility is the fraction e
/// of the largest, the method of multipliers leaves 1 / (1 + kStiffness e) of the error. In stacks of 100
/// bodies e is about 1e-4. Larger values reduce the accuracy of H.
constexpr Real kStiffness = 1e5;
/// Penalty of rows with bounds, until convergence takes too long. The bounds of dry friction may be small,
/// and its force reverses within a velocity of bound / rho. With a larger penalty Newton's method would jump
/// from kink to kink.
constexpr Real kBoundedStiffness = 1e3;
/// Springs that are stiffer than their penalty have no kinks. Their rows enter the matrix with their own
/// stiffness, up to this multiple of the inertia of the bodies.
constexpr Real kMostStiffness = 1e8;
/// For islands with joints. Joints transmit the effect of a contact, so a poor initial guess changes which
/// other contacts are closed. The first kSoftSteps iterations then use smaller penalties, and each multiplies
/// them by kStiffen. In heaps of chains this saves two thirds of the factorizations and nine tenths of the
/// fall-backs.
constexpr int kSoftSteps = 4;
constexpr Real kStiffen = 10, kFarOff = 1e-3;
/// For islands without joints. If the initial guess is worse than none, the penalties start at the fraction
/// kSoft, which changes fewer contacts in each iteration. They increase when the multipliers converge slowly.
/// In heaps of boxes this saves half of the factorizations and six of seven fall-backs. Without a guess they
/// start at full size, because redundant contacts then share their load in a way that the next steps can
/// keep: a wall of 1000 bricks takes 62 factorizations in 4 s instead of 3100.
constexpr Real kSoft = 1e-2, kWrong = 1;
constexpr Real kTolerance = 3e-8, kSmallest = 1e-11;  // fraction of the velocities, and lower bound [m/s]
/// The tolerance is multiplied by ten after every kPatience iterations, up to these fractions of the
/// velocities. kCoarseLift is for g: an error of g is a speed at which a sliding contact opens. Where wheels
/// touch two strips of a mesh at once, g may move in a cycle between two sets of open contacts.
constexpr Real kCoarse = 1e-5, kCoarseLift = 1e-3;
constexpr uint32_t kPatience = 4;
/// An iteration that leaves more than this fraction of the error is slow.
constexpr Real kSlow = 0.2;
constexpr uint32_t kMaxOuter = 120, kMaxNewton = 40, kMaxHalvings = 25, kMaxSweeps = 200;
/// An earlier matrix is reused while each step leaves less than this fraction of the gradient.
constexpr Real kStale = 0.2;
constexpr Real kMeritRounding = 1e-11;
constexpr std::size_t kMixed = 5;
/// Fraction of the mobility of a joint's constraints that is added to it, so that dependent constraints can
/// be solved.
constexpr Real kRegularization = 1e-11;
constexpr uint32_t kMaxFactorizations = 300;
/// Cost of operations, per contact or per block of the factorization [ns].
constexpr Real kSetUp = 150, kEvaluation = 80, kAssembly = 150, kSolve = 25, kProduct = 80;

/// Returns the mean eigenvalue of mobility(): a third of its trace.
Real mean_mobility(const ContactBody& body, const Vec3& r) {
  const Mat3& I = body.inverse_inertia;
  return body.inverse_mass + (r.squaredNorm() * I.trace() - r.dot(I * r)) / 3;
}

/// Returns J_r^T W J_s, where J maps a body's velocities (v, w) to the velocity v - [r] w of its point at the
/// arm r.
Mat6 block(const Mat3& W, const Vec3& r, const Vec3& s) {
  const Mat3 R = cross_matrix(r), Ws = -W * cross_matrix(s);
  Mat6 m;
  m.topLeftCorner<3, 3>() = W;
  m.topRightCorner<3, 3>() = Ws;
  m.bottomLeftCorner<3, 3>() = R * W;
  m.bottomRightCorner<3, 3>() = R * Ws;
  return m;
}

}  // namespace

std::optional<ContactWork> ProximalNewton::solve(std::span<ContactBody> bodies, std::span<Contact> contacts,
                                                 const JointProblem& joints, Real budget) {
  ContactWork work{.solves = 1};
  cost_ = kSetUp * static_cast<Real>(contacts.size() + joints.constraints.size());
  budget_ = budget;
  joints_ = joints;
  number_bodies(bodies, contacts);
  find_pairs(contacts);
  set_points(bodies, contacts);
  set_joints();
  Real speed = 0;
  for (const Point& p : points_) speed = std::max(speed, p.impulse.cwiseAbs().maxCoeff());
  for (const Bounded& p : bounded_) speed = std::max(speed, std::abs(p.impulse));
  const Real tolerance = kSmallest + kTolerance * speed;
  // At rest the impulses of the last step still satisfy the joints' constraints.
  if (constraint_speed() > tolerance / 4) satisfy_constraints();

  evaluate(contacts);
  gradient(contacts);
  Real left = gradient_speed();
  bool solved = false;
  mixing_.clear();
  Real softness = 1;
  if (!joints.empty()) {
    if (left > kFarOff * speed && !ramp_penalties(contacts, tolerance, work)) return std::nullopt;
  } else if (left > kWrong * speed && std::any_of(points_.begin(), points_.end(),
                                                  [](const Point& p) { return p.multiplier.x() > 0; })) {
    scale_penalties(softness = kSoft, 1);
    evaluate(contacts);
    gradient(contacts);
    left = gradient_speed();
  }
  Change change;
  uint32_t began = 0;
  for (uint32_t outer = 0; outer < kMaxOuter && work.factorizations < kMaxFactorizations; ++outer) {
    minimize(contacts, std::max(tolerance / 4, left / 20), work);
    if (cost_ > budget_) return std::nullopt;
    const Real before = left, multipliers_before = change.multipliers;
    change = update_multipliers(contacts);
    const Real forces_left = std::max(gradient_speed(), change.multipliers);
    left = std::max(forces_left, change.lifts);
    const Real relaxed = tolerance * std::pow(10, (outer - began) / kPatience);
    solved = forces_left <= std::min(relaxed, tolerance + kCoarse * speed) &&
             change.lifts <= std::min(relaxed, tolerance + kCoarseLift * speed);
    if (solved && softness == 1) break;
    if (solved) {  // the last digits are computed with the full penalties
      scale_penalties(1 / std::exchange(softness, 1), 1);
      evaluate(contacts);
      gradient(contacts);
      began = outer + 1;
      continue;
    }
    mix_lifts(left > kSlow * before);
    if (outer == 2 * kPatience) scale_penalties(1, kStiffness / kBoundedStiffness);
    if (softness < 1 && change.multipliers > std::max(kSlow * multipliers_before, left / 2)) {
      scale_penalties(kStiffen, 1);
      softness *= kStiffen;
    }
    evaluate(contacts);
    gradient(contacts);
  }

  store_moments(contacts);
  if (!joints.empty()) {
    for (std::size_t i = 0; i < contacts.size(); ++i) contacts[i].impulse = points_[i].multiplier;
    finish_joints(bodies);
    work.fallbacks += !solved;
    work.residual = left;
    return work;
  }
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    contacts[i].impulse = points_[i].multiplier;
    apply(contacts[i], contacts[i].impulse, bodies);
    if (contacts[i].resists_turning()) apply_moment(contacts[i], contacts[i].moment, bodies);
  }
  if (!solved) {
    work.iterations += projected_gauss_seidel(bodies, contacts, kMaxSweeps, tolerance);
    ++work.fallbacks;
    left = residual(bodies, contacts);
  }
  work.residual = left;
  return work;
}

void ProximalNewton::number_bodies(std::span<const ContactBody> bodies, std::span<const Contact> contacts) {
  row_of_body_.assign(bodies.size(), kNone);
  body_of_row_.clear();
  const auto add = [&](uint32_t body) {
    if (body == kUnmoved || !bodies[body].is_moved() || row_of_body_[body] != kNone) return;
    row_of_body_[body] = 0;
    body_of_row_.push_back(body);
  };
  for (const Contact& c : contacts) {
    add(c.a);
    add(c.b);
  }
  for (const JointConstraint& c : joints_.constraints) {
    add(c.a);
    add(c.b);
  }
  for (const BoundedRow& r : joints_.bounded) {
    add(r.a);
    add(r.b);
  }
  std::sort(body_of_row_.begin(), body_of_row_.end());
  for (uint32_t row = 0; row < body_of_row_.size(); ++row) row_of_body_[body_of_row_[row]] = row;

  const std::size_t rows = body_of_row_.size();
  free_.resize(rows);
  velocity_.resize(rows);
  trial_.resize(rows);
  gradient_.resize(rows);
  mass_.resize(rows);
  mobility_.resize(rows);
  for (std::size_t row = 0; row < rows; ++row) {
    const ContactBody& body = bodies[body_of_row_[row]];
    free_[row] << body.velocity, body.angular_velocity;
    velocity_[row] = free_[row];
    mass_[row].setZero();
    mass_[row].diagonal().head<3>().setConstant(1 / body.inverse_mass);
    mass_[row].bottomRightCorner<3, 3>() = body.inverse_inertia.inverse();
    mobility_[row] = {body.inverse_mass, body.inverse_inertia};
  }
}

/// Finds the off-diagonal blocks of the matrix: pairs of bodies that share a contact or a row with bounds,
/// and pairs of a constraint's row and one of its bodies.
void ProximalNewton::find_pairs(std::span<const Contact> contacts) {
  const auto row = [this](uint32_t body) { return body == kUnmoved ? kNone : row_of_body_[body]; };
  pairs_.clear();
  const auto add = [this](uint32_t a, uint32_t b) {
    const auto [low, high] = std::minmax(a, b);
    if (high != kNone) pairs_.emplace_back(low, high);
  };
  for (const Contact& c : contacts) add(row(c.a), row(c.b));
  for (const BoundedRow& r : joints_.bounded) add(row(r.a), row(r.b));
  const auto rows = static_cast<uint32_t>(body_of_row_.size());
  for (uint32_t j = 0; j < joints_.constraints.size(); ++j) {
    add(row(joints_.constraints[j].a), rows + j);
    add(row(joints_.constraints[j].b), rows + j);
  }
  std::sort(pairs_.begin(), pairs_.end());
  pairs_.erase(std::unique(pairs_.begin(), pairs_.end()), pairs_.end());
  kinds_.clear();
  if (joints_.constraints.empty()) return;
  kinds_.resize(rows + joints_.constraints.size());
  std::fill(kinds_.begin() + rows, kinds_.end(), BlockRowKind{.is_negative = true, .is_empty = true});
}

/// Returns the index of the block of two rows; kNone if one of the rows belongs to a body that does not move.
uint32_t ProximalNewton::pair_of(uint32_t row, uint32_t other) const {
  if (row == kNone || other == kNone) return kNone;
  const std::pair<uint32_t, uint32_t> pair = std::minmax(row, other);
  return static_cast<uint32_t>(std::lower_bound(pairs_.begin(), pairs_.end(), pair) - pairs_.begin());
}

/// Multiplies the penalties by these factors.
void ProximalNewton::scale_penalties(Real contacts, Real bounded) {
  if (contacts == 1 && bounded_.empty()) return;
  for (Point& p : points_) p.rho *= contacts;
  for (Turning& t : turnings_) t.rho *= contacts;
  for (Bounded& p : bounded_) p.rho *= bounded;
  is_factored_ = false;
}

/// Improves a poor initial guess by iterations with increasing penalties. Returns false if the budget is
/// exceeded.
bool ProximalNewton::ramp_penalties(std::span<const Contact> contacts, Real tolerance, ContactWork& work) {
  Real softness = 1;
  for (int k = 0; k < kSoftSteps; ++k) softness /= kStiffen;
  scale_penalties(softness, softness);
  for (int k = 0; k < kSoftSteps; ++k) {
    evaluate(contacts);
    gradient(contacts);
    minimize(contacts, std::max(tolerance / 4, gradient_speed() / 20), work);
    if (cost_ > budget_) return false;
    update_multipliers(contacts);
    scale_penalties(kStiffen, kStiffen);
  }
  evaluate(contacts);
  gradient(contacts);
  return true;
}

/// Sets the initial guess: multipliers from the contacts, and the velocities that result from them.
/// Point::impulse temporarily holds the relative velocity without any impulse, as a scale.
void ProximalNewton::set_points(std::span<const ContactBody> bodies, std::span<const Contact> contacts) {
  if (factored_contacts_ != contacts.size()) is_factored_ = false;
  points_.resize(contacts.size());
  turnings_.clear();
  fixed_.resize(contacts.size());
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Contact& c = contacts[i];
    Point& p = points_[i];
    p.a = row_of_body_[c.a];
    p.b = row_of_body_[c.b];
    p.pair = pair_of(p.a, p.b);
    p.rho = kStiffness / (mean_mobility(bodies[c.a], c.arm_a) + mean_mobility(bodies[c.b], c.arm_b));
    p.multiplier = c.is_guessed ? project_on_cone(c, c.impulse).point : Vec3(Vec3::Zero());
    p.impulse = c.relative_velocity(bodies);
    fixed_[i] = c.offset - Vec3(c.target, 0, 0);
    if (p.a == kNone) fixed_[i] += c.to_frame(bodies[c.a].velocity_at(c.arm_a));
    if (p.b == kNone) fixed_[i] -= c.to_frame(bodies[c.b].velocity_at(c.arm_b));

    p.turning = kNone;
    if (c.resists_turning()) set_turning(bodies, c, p);

    const Vec3 impulse = c.to_world(p.multiplier);
    const auto add = [&](uint32_t row, uint32_t body, const Vec3& arm, Real sign) {
      if (row == kNone) return;
      velocity_[row].head<3>() += sign * bodies[body].inverse_mass * impulse;
      velocity_[row].tail<3>() += sign * (bodies[body].inverse_inertia * arm.cross(impulse));
    };
    add(p.a, c.a, c.arm_a, 1);
    add(p.b, c.b, c.arm_b, -1);
  }
  for (std::size_t i = 0; i < contacts.size(); ++i)
    points_[i].lift = turning_lift(contacts[i], points_[i],
                                   relative_velocity(contacts[i], points_[i], velocity_) + fixed_[i]);
}

/// Adds the rows with bounds, whose impulses also change the velocities. Bounded::impulse temporarily holds
/// the change of speed that the row demands, as a scale. Call it after set_points().
void ProximalNewton::set_joints() {
  const auto row = [this](uint32_t body) { return body == kUnmoved ? kNone : row_of_body_[body]; };
  const auto rows = static_cast<uint32_t>(body_of_row_.size());
  bounded_.clear();
  for (const BoundedRow& r : joints_.bounded) {
    Bounded p{.multiplier = std::clamp(r.impulse, r.lower, r.upper),
              .impulse = r.offset - r.target,
              .a = row(r.a),
              .b = row(r.b),
              .is_free = false};
    p.pair = pair_of(p.a, p.b);
    Real mobility = 0;
    for (const auto& [at, on] : {std::pair(p.a, &r.on_a), std::pair(p.b, &r.on_b)}) {
      if (at == kNone) continue;
      const Vec6 response = mobility_[at].velocity(*on);
      mobility += on->dot(response);
      p.impulse += on->dot(free_[at]);
      velocity_[at] += p.multiplier * response;
    }
    // The target of a soft row may be far beyond any speed that the row causes.
    if (r.softness > 0) p.impulse *= mobility / (mobility + r.softness);
    p.rho = kBoundedStiffness / mobility;
    if (std::isinf(r.lower) && std::isinf(r.upper) && r.softness > 0 && p.rho * r.softness < 1)
      p.rho = std::max(p.rho, std::min(kBoundedStiffness / r.softness, kMostStiffness / mobility));
    bounded_.push_back(p);
  }
  constraints_.clear();
  for (uint32_t j = 0; j < joints_.constraints.size(); ++j) {
    const JointConstraint& c = joints_.constraints[j];
    Constraint k{.a = row(c.a), .b = row(c.b), .diagonal = Mat6::Zero(), .impulse = joints_.impulses[j]};
    k.pair_a = pair_of(k.a, rows + j);
    k.pair_b = pair_of(k.b, rows + j);
    for (Eigen::Index i = 0; i < 6; ++i) {
      Real mobility = 0;
      for (const auto& [at, on] : {std::pair(k.a, &c.rows->on_a), std::pair(k.b, &c.rows->on_b)})
        if (at != kNone) mobility += on->col(i).dot(mobility_[at].velocity(on->col(i)));
      k.diagonal(i, i) = mobility > 0 ? -kRegularization * mobility : -1;
    }
    if (k.a != kNone) velocity_[k.a] += mobility_[k.a].velocity(c.rows->on_a * k.impulse);
    if (k.b != kNone) velocity_[k.b] += mobility_[k.b].velocity(c.rows->on_b * k.impulse);
    constraints_.push_back(k);
  }
  direction_.resize(rows + constraints_.size());
  if (!joints_.empty() || factor_.rows() != direction_.size()) is_factored_ = false;
}

/// Returns the greatest violation of the joints' constraints by the velocities [m/s].
Real ProximalNewton::constraint_speed() const {
  Real worst = 0;
  for (std::size_t j = 0; j < constraints_.size(); ++j)
    worst = std::max(worst, violation(j).cwiseAbs().maxCoeff());
  return worst;
}

/// Returns J (v - v0) of joint j.
Vec6 ProximalNewton::violation(std::size_t j) const {
  const Constraint& c = constraints_[j];
  const JointRows& rows = *joints_.constraints[j].rows;
  Vec6 v = Vec6::Zero();
  if (c.a != kNone) v += rows.on_a.transpose() * (velocity_[c.a] - free_[c.a]);
  if (c.b != kNone) v += rows.on_b.transpose() * (velocity_[c.b] - free_[c.b]);
  return v;
}

/// Corrects the velocities so that they satisfy the joints' constraints. The change has the least kinetic
/// energy.
void ProximalNewton::satisfy_constraints() {
  factor_.analyze(static_cast<uint32_t>(direction_.size()), pairs_, kinds_);
  add_constraint_blocks();
  is_factored_ = factor_.factorize(diagonal_, off_);
  std::fill(gradient_.begin(), gradient_.end(), Vec6::Zero());
  for (int k = 0; is_factored_ && k < 2; ++k) {
    solve_for_direction();
    for (std::size_t row = 0; row < velocity_.size(); ++row) velocity_[row] -= direction_[row];
    for (std::size_t j = 0; j < constraints_.size(); ++j)
      constraints_[j].impulse += direction_[gradient_.size() + j];
  }
  is_factored_ = false;
}

/// Assembles the blocks of the masses and constraints.
void ProximalNewton::add_constraint_blocks() {
  diagonal_ = mass_;
  off_.assign(pairs_.size(), Mat6::Zero());
  for (std::size_t j = 0; j < constraints_.size(); ++j) {
    const Constraint& c = constraints_[j];
    diagonal_.push_back(c.diagonal);
    if (c.pair_a != kNone) off_[c.pair_a] = joints_.constraints[j].rows->on_a;
    if (c.pair_b != kNone) off_[c.pair_b] = joints_.constraints[j].rows->on_b;
  }
}

/// Solves for Newton's step, with the gradient and the violation of the constraints as right-hand side.
/// -direction_ is the step of the velocities; the elements after it are the impulses of the constraints.
void ProximalNewton::solve_for_direction() {
  std::copy(gradient_.begin(), gradient_.end(), direction_.begin());
  for (std::size_t j = 0; j < constraints_.size(); ++j) direction_[gradient_.size() + j] = violation(j);
  factor_.solve(direction_);
}

void ProximalNewton::finish_joints(std::span<ContactBody> bodies) {
  for (std::size_t row = 0; row < velocity_.size(); ++row) {
    bodies[body_of_row_[row]].velocity = velocity_[row].head<3>();
    bodies[body_of_row_[row]].angular_velocity = velocity_[row].tail<3>();
  }
  for (std::size_t i = 0; i < bounded_.size(); ++i) joints_.bounded[i].impulse = bounded_[i].multiplier;
  for (std::size_t j = 0; j < joints_.impulses.size(); ++j) joints_.impulses[j] = constraints_[j].impulse;
}

Vec3 ProximalNewton::relative_velocity(const Contact& c, const Point& p,
                                       std::span<const Vec6> velocity) const {
  Vec3 u = Vec3::Zero();
  if (p.a != kNone) u += velocity[p.a].head<3>() + velocity[p.a].tail<3>().cross(c.arm_a);
  if (p.b != kNone) u -= velocity[p.b].head<3>() + velocity[p.b].tail<3>().cross(c.arm_b);
  return c.to_frame(u);
}

/// Evaluates the impulses p of contacts and constraints at the velocities, and the function whose gradient is
/// M (v - v0) - J^T p.
void ProximalNewton::evaluate(std::span<const Contact> contacts) {
  merit_ = {};
  for (std::size_t row = 0; row < velocity_.size(); ++row) {
    const Vec6 d = velocity_[row] - free_[row];
    merit_.add(0.5 * d.dot(mass_[row] * d));
  }
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Contact& c = contacts[i];
    Point& p = points_[i];
    const Vec3 u = relative_velocity(c, p, velocity_) + fixed_[i] + Vec3(p.lift, 0, 0);
    if (p.turning != kNone) {
      evaluate_turning(c, p, u);
      continue;
    }
    const Vec3 q = p.multiplier - p.rho * u;
    const ConeProjection projection = project_on_cone(c, q);
    p.impulse = projection.point;
    p.region = projection.region;
    p.shifted = q;
    merit_.add(p.impulse.squaredNorm() / (2 * p.rho));
  }
  for (std::size_t i = 0; i < bounded_.size(); ++i) {
    const BoundedRow& r = joints_.bounded[i];
    Bounded& p = bounded_[i];
    const Real u = relative_velocity(r, p, velocity_) - r.target;
    const Real wanted = (p.multiplier - p.rho * u) / (1 + p.rho * r.softness);
    p.impulse = std::clamp(wanted, r.lower, r.upper);
    p.is_free = p.impulse == wanted;
    // This term is the greatest value of -p u - s p^2 / 2 - (p - q)^2 / (2 rho). It is convex in u and has
    // the derivative -p.
    merit_.add(-p.impulse * u);
    merit_.add(-r.softness * p.impulse * p.impulse / 2);
    merit_.add(-std::pow(p.impulse - p.multiplier, 2) / (2 * p.rho));
  }
  for (std::size_t j = 0; j < constraints_.size(); ++j)
    merit_.add(-constraints_[j].impulse.dot(violation(j)));
}

Real ProximalNewton::relative_velocity(const BoundedRow& r, const Bounded& p,
                                       std::span<const Vec6> velocity) const {
  Real u = r.offset;
  if (p.a != kNone) u += r.on_a.dot(velocity[p.a]);
  if (p.b != kNone) u += r.on_b.dot(velocity[p.b]);
  return u;
}

void ProximalNewton::gradient(std::span<const Contact> contacts) {
  for (std::size_t row = 0; row < gradient_.size(); ++row)
    gradient_[row] = mass_[row] * (velocity_[row] - free_[row]);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Contact& c = contacts[i];
    const Point& p = points_[i];
    const Vec3 impulse = c.to_world(p.impulse);
    if (p.turning != kNone) {
      const Vec3 moment = turning_impulse(c, p);
      if (p.a != kNone) gradient_[p.a].tail<3>() -= moment;
      if (p.b != kNone) gradient_[p.b].tail<3>() += moment;
    }
    if (p.a != kNone) {
      gradient_[p.a].head<3>() -= impulse;
      gradient_[p.a].tail<3>() -= c.arm_a.cross(impulse);
    }
    if (p.b != kNone) {
      gradient_[p.b].head<3>() += impulse;
      gradient_[p.b].tail<3>() += c.arm_b.cross(impulse);
    }
  }
  for (std::size_t i = 0; i < bounded_.size(); ++i) {
    const Bounded& p = bounded_[i];
    if (p.a != kNone) gradient_[p.a] -= p.impulse * joints_.bounded[i].on_a;
    if (p.b != kNone) gradient_[p.b] -= p.impulse * joints_.bounded[i].on_b;
  }
  for (std::size_t j = 0; j < constraints_.size(); ++j) {
    const Constraint& c = constraints_[j];
    if (c.a != kNone) gradient_[c.a] -= joints_.constraints[j].rows->on_a * c.impulse;
    if (c.b != kNone) gradient_[c.b] -= joints_.constraints[j].rows->on_b * c.impulse;
  }
}

/// Returns the greatest velocity that the unbalanced impulses give to a body [m/s].
Real ProximalNewton::gradient_speed() const {
  Real worst = 0;
  for (std::size_t row = 0; row < gradient_.size(); ++row) {
    const Vec6& g = gradient_[row];
    const Real mass = mass_[row](0, 0);
    // The angular part is a lower bound, because the trace of the inertia is used in place of the moments of
    // inertia, which are smaller.
    const Mat3& inertia = mass_[row].bottomRightCorner<3, 3>();
    const Real radius = std::sqrt(inertia.trace() / mass);
    worst = std::max(worst, (g.head<3>().norm() + g.tail<3>().norm() / std::max(radius, 1e-12)) / mass);
  }
  return worst;
}

bool ProximalNewton::assemble(std::span<const Contact> contacts, ContactWork& work) {
  factor_.analyze(static_cast<uint32_t>(direction_.size()), pairs_, kinds_);
  add_constraint_blocks();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Contact& c = contacts[i];
    const Point& p = points_[i];
    if (p.turning != kNone) {
      assemble_turning(c, p);
      continue;
    }
    if (p.region == ConeRegion::apex) continue;
    Mat3 axes;
    axes << c.frame.n, c.frame.t, c.frame.k;
    const Mat3 W = p.rho * axes * cone_derivative(c, p.shifted, {p.impulse, p.region}) * axes.transpose();
    if (p.a != kNone) diagonal_[p.a] += block(W, c.arm_a, c.arm_a);
    if (p.b != kNone) diagonal_[p.b] += block(W, c.arm_b, c.arm_b);
    if (p.pair == kNone) continue;
    if (p.a < p.b)
      off_[p.pair] -= block(W, c.arm_a, c.arm_b);
    else
      off_[p.pair] -= block(W, c.arm_b, c.arm_a);
  }
  for (std::size_t i = 0; i < bounded_.size(); ++i) {
    const Bounded& p = bounded_[i];
    if (!p.is_free) continue;
    const BoundedRow& r = joints_.bounded[i];
    const Real weight = p.rho / (1 + p.rho * r.softness);
    if (p.a != kNone) diagonal_[p.a] += weight * r.on_a * r.on_a.transpose();
    if (p.b != kNone) diagonal_[p.b] += weight * r.on_b * r.on_b.transpose();
    if (p.pair == kNone) continue;
    off_[p.pair] += p.a < p.b ? weight * r.on_a * r.on_b.transpose() : weight * r.on_b * r.on_a.transpose();
  }
  ++work.factorizations;
  cost_ += kProduct * static_cast<Real>(factor_.factor_products()) +
           kAssembly * static_cast<Real>(contacts.size());
  factored_contacts_ = contacts.size();
  return is_factored_ = factor_.factorize(diagonal_, off_);
}

/// Minimizes the function of evaluate() by Newton's method, for constant multipliers and limits, until the
/// gradient is below `tolerance` [m/s]. Returns false if there were too many factorizations or steps.
bool ProximalNewton::minimize(std::span<const Contact> contacts, Real tolerance, ContactWork& work) {
  Real before = std::numeric_limits<Real>::infinity();
  for (uint32_t step = 0; step < kMaxNewton; ++step) {
    const Real now = gradient_speed();
    if (now <= tolerance) return true;
    // The earlier matrix is tried first, although some contacts may have opened or closed.
    if (!is_factored_ || now > kStale * before)
      if (work.factorizations >= kMaxFactorizations || !assemble(contacts, work)) return false;
    before = now;
    ++work.iterations;
    if (cost_ > budget_) return false;
    if (!descend(contacts)) return false;
  }
  return false;
}

/// Makes one step along -H^-1 g with back-tracking. Returns false if rounding prevents a decrease.
bool ProximalNewton::descend(std::span<const Contact> contacts) {
  solve_for_direction();
  cost_ +=
      kSolve * static_cast<Real>(factor_.factor_blocks()) + kEvaluation * static_cast<Real>(contacts.size());
  // The step includes new impulses of the constraints. With these, it decreases the function even where it
  // restores violated constraints.
  const auto add_to_constraints = [this, &contacts](Real sign) {
    for (std::size_t j = 0; j < constraints_.size(); ++j)
      constraints_[j].impulse += sign * direction_[gradient_.size() + j];
    evaluate(contacts);
    gradient(contacts);
  };
  if (!constraints_.empty()) add_to_constraints(1);
  Real slope = 0;
  for (std::size_t row = 0; row < gradient_.size(); ++row) slope -= direction_[row].dot(gradient_[row]);
  const Merit before = merit_;
  const Real speed = gradient_speed();
  const std::vector<Vec6> start = velocity_;
  Real length = 1;
  for (uint32_t k = 0; k < kMaxHalvings; ++k, length /= 2) {
    for (std::size_t row = 0; row < velocity_.size(); ++row)
      velocity_[row] = start[row] - length * direction_[row];
    evaluate(contacts);
    if (merit_.value <= before.value + 1e-4 * length * slope) {
      gradient(contacts);
      return true;
    }
    // Near the minimum rounding hides the decrease of the function; the gradient is then used instead.
    if (merit_.value > before.value + kMeritRounding * before.size) continue;
    gradient(contacts);
    if (gradient_speed() <= 0.8 * speed) return true;
  }
  velocity_ = start;
  add_to_constraints(-1);
  return false;
}

/// Sets q := p and g := mu |u_t|. Returns the greatest changes of both.
ProximalNewton::Change ProximalNewton::update_multipliers(std::span<const Contact> contacts) {
  Change change;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    Point& p = points_[i];
    const Vec3 lacking = (p.impulse - p.multiplier) / p.rho;
    change.multipliers = std::max(change.multipliers, lacking.cwiseAbs().maxCoeff());
    p.multiplier = p.impulse;
    const Contact& c = contacts[i];
    const Vec3 u = relative_velocity(c, p, velocity_) + fixed_[i];
    const Real lift = turning_lift(c, p, u);
    // An open contact does not depend on g if it stays open.
    const bool open = p.region == ConeRegion::apex && stays_open(c, p, u + Vec3(lift, 0, 0));
    p.rise = open ? 0 : lift - p.lift;
    change.lifts = std::max(change.lifts, std::abs(p.rise));
    p.lift = lift;
    if (p.turning != kNone) update_turning(c, p, change);
  }
  for (Bounded& p : bounded_) {
    change.multipliers = std::max(change.multipliers, std::abs(p.impulse - p.multiplier) / p.rho);
    p.multiplier = p.impulse;
  }
  return change;
}

/// The feedback of friction on the normal impulses can make g = mu |u_t(g)| converge slowly. Anderson
/// acceleration ("Iterative procedures for nonlinear integral equations", 1965) sets g to the combination of
/// the last few values with the smallest residual.
void ProximalNewton::mix_lifts(bool slow) {
  const auto n = static_cast<Eigen::Index>(points_.size());
  Eigen::VectorXd lift(n), rise(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    lift[i] = points_[static_cast<std::size_t>(i)].lift;
    rise[i] = points_[static_cast<std::size_t>(i)].rise;
  }
  if (!mixing_.empty() && rise.norm() > 2 * mixing_.back().rise.norm()) mixing_.clear();
  mixing_.push_back({lift, rise});
  if (mixing_.size() > kMixed) mixing_.erase(mixing_.begin());
  const auto m = static_cast<Eigen::Index>(mixing_.size()) - 1;
  if (m == 0 || !slow || rise.norm() == 0) return;
  Eigen::MatrixXd of_lift(n, m), of_rise(n, m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const Mixed& before = mixing_[static_cast<std::size_t>(k)];
    of_lift.col(k) = lift - before.lift;
    of_rise.col(k) = rise - before.rise;
  }
  const Eigen::VectorXd fraction = least_squares(of_rise, rise);
  if (!fraction.allFinite()) return;
  const Eigen::VectorXd mixed = lift - of_lift * fraction;
  for (Eigen::Index i = 0; i < n; ++i) points_[static_cast<std::size_t>(i)].lift = std::max(mixed[i], 0.0);
}

}  // namespace offstage::sim
