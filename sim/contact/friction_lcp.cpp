#include "sim/contact/friction_lcp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "sim/contact/friction_pivoting.h"
#include "sim/contact/proximal_newton.h"
#include "sim/linear/least_squares.h"

namespace offstage::sim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

using Mat36 = Eigen::Matrix<Real, 3, 6>;

// Bounds of residuals and speeds, as fractions of the greatest velocity.
constexpr Real kAccurate = 1e-12;   ///< residual of a solution that is exact to rounding
constexpr Real kAccepted = 1e-10;   ///< greatest residual at which pivoting ends; else other methods continue
constexpr Real kGoodEnough = 1e-5;  ///< greatest residual of the other methods; else the fall-back solves
constexpr Real kSliding = 1e-9;     ///< slowest tangential speed that counts as sliding
constexpr Real kRank = 1e-11;       ///< pivots below this fraction of the greatest count as zero: redundant
                                    ///< contacts make the matrix singular
/// For pivoting, this fraction of the diagonal is added to the diagonal, so that redundant contacts share
/// their load in a unique way.
constexpr Real kSoftness = 1e-7;
constexpr std::size_t kRounds = 4;  ///< number of rounds of pivoting, with other tangents and another order
constexpr int kNewtonSteps = 25, kStepsInVain = 10, kStepHalvings = 6, kFallbacks = 4;
constexpr uint32_t kSweeps = 200;

/// One body of a contact. Its contribution to the relative velocity u is J (v, w).
struct Side {
  uint32_t body;
  Mat36 J, J_inverse_mass;
};

std::array<Side, 2> sides_of(const Contact& c, std::span<const ContactBody> bodies) {
  const auto side = [&](uint32_t index, const Vec3& arm, Real sign) {
    Side s{.body = index};
    const std::array axes = {c.frame.n, c.frame.t, c.frame.k};
    for (Index i = 0; i < 3; ++i) {
      const Vec3& axis = axes[static_cast<std::size_t>(i)];
      s.J.row(i) << sign * axis.transpose(), sign * arm.cross(axis).transpose();
    }
    s.J_inverse_mass << bodies[index].inverse_mass * s.J.leftCols<3>(),
        s.J.rightCols<3>() * bodies[index].inverse_inertia;
    return s;
  };
  return {side(c.a, c.arm_a, 1), side(c.b, c.arm_b, -1)};
}

/// Returns the matrix of R9. It has a block for each two contacts that share a body. Immovable bodies have no
/// inverse mass and add nothing.
MatrixXd delassus_matrix(std::span<const ContactBody> bodies, std::span<const Contact> contacts) {
  std::vector<std::array<Side, 2>> sides;
  for (const Contact& c : contacts) sides.push_back(sides_of(c, bodies));
  const auto rows = static_cast<Index>(3 * contacts.size());
  MatrixXd A = MatrixXd::Zero(rows, rows);
  for (std::size_t i = 0; i < contacts.size(); ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      Mat3 block = Mat3::Zero();
      for (const Side& s : sides[i])
        for (const Side& o : sides[j])
          if (s.body == o.body && bodies[s.body].is_moved()) block += s.J_inverse_mass * o.J.transpose();
      const auto r = static_cast<Index>(3 * i), c = static_cast<Index>(3 * j);
      A.block<3, 3>(r, c) = block;
      A.block<3, 3>(c, r) = block.transpose();
    }
  return A;
}

class FrictionSolver {
 public:
  /// The contacts' impulses must be zero.
  FrictionSolver(std::span<ContactBody> bodies, std::span<Contact> contacts);

  ContactWork solve();

 private:
  void solve_by_rounds(ContactWork& work);
  void solve_by_newton(ContactWork& work);
  void fall_back(ContactWork& work);
  VectorXd impulses() const;
  void set_impulses(const VectorXd& p);
  bool is_round(std::size_t i) const { return problem_.friction[i].x() == problem_.friction[i].y(); }
  Real step_size(Index row) const { return 1 / problem_.A.diagonal().segment<3>(row).maxCoeff(); }
  void round_friction_row(Index row, const Vec3& p, const Vec3& y, bool with_jacobian);
  void axis_friction_row(Index row, Index axis, const Vec3& p, const Vec3& y, bool with_jacobian);
  Real evaluate(const VectorXd& p, bool with_jacobian);
  Real polish(VectorXd& best, ContactWork& work);
  bool realign();
  bool realign(std::size_t i, const Vector2d& force, Real normal, const Vector2d& sliding);
  void turn(std::size_t i, const Vector2d& direction);

  std::span<ContactBody> bodies_;
  std::span<Contact> contacts_;
  DenseContacts problem_;
  VectorXd p_;
  std::vector<Vector2d> axis_;  ///< the turned t in the contact's own frame
  Real scale_ = 0;
  VectorXd r_;
  MatrixXd jacobian_;
};

FrictionSolver::FrictionSolver(std::span<ContactBody> bodies, std::span<Contact> contacts)
    : bodies_(bodies), contacts_(contacts), axis_(contacts.size(), Vector2d(1, 0)) {
  problem_.A = delassus_matrix(bodies, contacts);
  problem_.b.resize(problem_.A.rows());
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    const Vec3 u = contacts[i].relative_velocity(bodies);
    scale_ = std::max({scale_, u.cwiseAbs().maxCoeff(), std::abs(contacts[i].target)});
    problem_.b.segment<3>(static_cast<Index>(3 * i)) = u - Vec3(contacts[i].target, 0, 0);
    problem_.friction.emplace_back(contacts[i].friction_t, contacts[i].friction_k);
  }
  problem_.slides.assign(contacts.size(), 0);
}

/// Rotates the tangents of a contact so that t becomes `direction`. `direction` has components along the old
/// tangents.
void FrictionSolver::turn(std::size_t i, const Vector2d& direction) {
  const Real length = direction.norm();
  if (!(length > 0)) return;
  const Vector2d d = direction / length;
  Eigen::Matrix2d turned;
  turned << d.x(), -d.y(), d.y(), d.x();
  const auto row = static_cast<Index>(3 * i + 1);
  problem_.A.middleRows<2>(row) = (turned.transpose() * problem_.A.middleRows<2>(row)).eval();
  problem_.A.middleCols<2>(row) = (problem_.A.middleCols<2>(row) * turned).eval();
  problem_.b.segment<2>(row) = (turned.transpose() * problem_.b.segment<2>(row)).eval();
  p_.segment<2>(row) = (turned.transpose() * p_.segment<2>(row)).eval();
  axis_[i] =
      Vector2d(axis_[i].x() * d.x() - axis_[i].y() * d.y(), axis_[i].y() * d.x() + axis_[i].x() * d.y());
}

/// Aligns the tangents of a contact. With dynamic friction, t gets the direction of sliding. Otherwise t gets
/// the direction of the friction force, if that is within the limits of the axes but outside of the cone.
/// Returns false if nothing has to change.
bool FrictionSolver::realign(std::size_t i, const Vector2d& force, Real normal, const Vector2d& sliding) {
  const bool slid = problem_.slides[i] != 0;
  problem_.slides[i] = 0;
  if (normal <= 0) return slid;
  if (slid && sliding.x() <= 0) return true;
  if (sliding.norm() > kSliding * scale_) {
    problem_.slides[i] = 1;
    turn(i, sliding);
    return true;
  }
  if (force.norm() <= problem_.friction[i].x() * normal * (1 + kAccurate)) return slid;
  turn(i, -force);
  return true;
}

bool FrictionSolver::realign() {
  const VectorXd u = problem_.A * p_ + problem_.b;
  bool changed = false;
  for (std::size_t i = 0; i < problem_.count(); ++i) {
    const auto n = static_cast<Index>(3 * i);
    if (is_round(i) && problem_.friction[i].x() > 0)
      changed |= realign(i, p_.segment<2>(n + 1), p_[n], u.segment<2>(n + 1));
  }
  return changed;
}

/// Sets the rows of a contact with a round cone: p_tk - mu p_n y / |y| if y = p_tk - u_tk / K is outside of
/// the cone, else u_tk.
void FrictionSolver::round_friction_row(Index row, const Vec3& p, const Vec3& y, bool with_jacobian) {
  const Real mu = problem_.friction[static_cast<std::size_t>(row / 3)].x(), rho = step_size(row);
  const Real limit = mu * std::max(p.x(), 0.0), length = y.tail<2>().norm();
  const bool sticks = length <= limit && limit > 0;
  const Vector2d d = length > 0 ? Vector2d(y.tail<2>() / length) : Vector2d::Zero();
  r_.segment<2>(row + 1) = p.tail<2>() - (sticks ? Vector2d(y.tail<2>()) : Vector2d(limit * d));
  if (!with_jacobian) return;
  auto rows = jacobian_.middleRows<2>(row + 1);
  rows = rho * problem_.A.middleRows<2>(row + 1);
  if (sticks) return;
  // d (y / |y|) = (1 - d d^T) / |y| dy, where dy = dp - rho A dp.
  const Eigen::Matrix2d across =
      length > 0 ? Eigen::Matrix2d((Eigen::Matrix2d::Identity() - d * d.transpose()) * (limit / length))
                 : Eigen::Matrix2d::Zero();
  rows = (across * rows).eval();
  rows.middleCols<2>(row + 1) += Eigen::Matrix2d::Identity() - across;
  if (p.x() > 0) rows.col(row) -= mu * d;
}

void FrictionSolver::axis_friction_row(Index row, Index axis, const Vec3& p, const Vec3& y,
                                       bool with_jacobian) {
  const Real mu = problem_.friction[static_cast<std::size_t>(row / 3)][axis - 1];
  const Real limit = mu * std::max(p.x(), 0.0), force = std::clamp(y[axis], -limit, limit);
  r_[row + axis] = p[axis] - force;
  if (!with_jacobian) return;
  auto line = jacobian_.row(row + axis);
  if (std::abs(y[axis]) <= limit && limit > 0) {
    line = step_size(row) * problem_.A.row(row + axis);
    return;
  }
  line.setZero();
  line[row + axis] = 1;
  if (p.x() > 0) line[row] = y[axis] > 0 ? -mu : mu;
}

/// Evaluates the natural residual in r_ [N s] and, on request, its generalized Jacobian (Alart and Curnier,
/// 1991). Returns the norm of the residual as a velocity [m/s].
Real FrictionSolver::evaluate(const VectorXd& p, bool with_jacobian) {
  const VectorXd u = problem_.A * p + problem_.b;
  r_.resize(p.size());
  if (with_jacobian) jacobian_.resize(p.size(), p.size());
  Real sum = 0;
  for (Index n = 0; n < p.size(); n += 3) {
    const Real rho = step_size(n);
    const Vec3 force = p.segment<3>(n), y = force - rho * u.segment<3>(n);
    r_[n] = force.x() - std::max(y.x(), 0.0);
    if (with_jacobian && y.x() > 0) jacobian_.row(n) = rho * problem_.A.row(n);
    if (with_jacobian && !(y.x() > 0)) jacobian_.row(n) = VectorXd::Unit(p.size(), n).transpose();
    if (is_round(static_cast<std::size_t>(n / 3))) {
      round_friction_row(n, force, y, with_jacobian);
    } else {
      for (const Index axis : {1, 2}) axis_friction_row(n, axis, force, y, with_jacobian);
    }
    sum += r_.segment<3>(n).squaredNorm() / (rho * rho);
  }
  return std::sqrt(sum);
}

/// Improves the solution by Newton's method on the cone. Near the solution each step squares the error. Steps
/// that increase the residual are halved. If halving does not help, a kink of the cone is in the way, and the
/// full step passes beyond it.
Real FrictionSolver::polish(VectorXd& best, ContactWork& work) {
  VectorXd p = best;
  Real worst = evaluate(p, false), least = worst;
  int last = 0;
  for (int k = 0; k < std::min(kNewtonSteps, last + kStepsInVain) && worst > kAccurate * scale_; ++k) {
    evaluate(p, true);
    const VectorXd step = shortest_least_squares(jacobian_, -r_, kRank);
    ++work.factorizations;
    ++work.iterations;
    const Real whole = evaluate(p + step, false);
    Real length = 1, next = whole;
    for (int h = 0; h < kStepHalvings && !(next < worst); ++h)
      next = evaluate(p + (length /= 2) * step, false);
    if (!std::isfinite(whole)) break;
    p += (next < worst ? length : 1) * step;
    worst = next < worst ? next : whole;
    if (worst < least) {
      least = worst;
      best = p;
      last = k + 1;
    }
  }
  return least;
}

VectorXd FrictionSolver::impulses() const {
  VectorXd p(problem_.b.size());
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const Vec3& q = contacts_[i].impulse;
    const Vector2d& t = axis_[i];
    p.segment<3>(static_cast<Index>(3 * i)) << q.x(), q.y() * t.x() + q.z() * t.y(),
        q.z() * t.x() - q.y() * t.y();
  }
  return p;
}

void FrictionSolver::set_impulses(const VectorXd& p) {
  for (std::size_t i = 0; i < contacts_.size(); ++i) {
    const Vec3 q = p.segment<3>(static_cast<Index>(3 * i)), before = contacts_[i].impulse;
    const Vector2d& t = axis_[i];
    contacts_[i].impulse << std::max(q.x(), 0.0), q.y() * t.x() - q.z() * t.y(),
        q.y() * t.y() + q.z() * t.x();
    apply(contacts_[i], contacts_[i].impulse - before, bodies_);
  }
}

void FrictionSolver::solve_by_rounds(ContactWork& work) {
  p_.setZero(problem_.b.size());
  // The first guess is the direction of sliding without contact forces, which is correct for most contacts.
  for (std::size_t i = 0; i < problem_.count(); ++i)
    if (is_round(i)) turn(i, problem_.b.segment<2>(static_cast<Index>(3 * i + 1)));
  Real least = evaluate(p_, false);
  bool changed = true;
  for (std::size_t round = 0; round < kRounds && changed && least > kAccepted * scale_; ++round) {
    DenseContacts soft = problem_;
    soft.A.diagonal() *= 1 + kSoftness;
    const PivotingResult result = pivot(soft, round * problem_.count() / kRounds, p_);
    work.iterations += result.pivots;
    VectorXd p = p_;
    const Real worst = polish(p, work);
    if (worst < least) {
      least = worst;
      set_impulses(p);
    }
    changed = realign() || !result.solved;
  }
}

/// Solves by the proximal method. Pivoting may cycle among redundant contacts that just touch. The proximal
/// method converges for these, but not to the last digits.
void FrictionSolver::solve_by_newton(ContactWork& work) {
  const VectorXd before = impulses();
  const Real least = residual(bodies_, contacts_);
  set_impulses(VectorXd::Zero(before.size()));
  for (Contact& c : contacts_) c.is_guessed = false;
  const ContactWork newton = *ProximalNewton().solve(bodies_, contacts_);
  work.iterations += newton.iterations;
  work.factorizations += newton.factorizations;
  VectorXd p = impulses();
  if (polish(p, work) < evaluate(impulses(), false)) set_impulses(p);
  if (residual(bodies_, contacts_) > least) set_impulses(before);
}

/// Solves by Gauss-Seidel and Newton's method alternately. Gauss-Seidel approaches the solution from any
/// start, but slowly. Newton's method is fast near the solution.
void FrictionSolver::fall_back(ContactWork& work) {
  ++work.fallbacks;
  for (int k = 0; k < kFallbacks && residual(bodies_, contacts_) > kAccepted * scale_; ++k) {
    work.iterations += projected_gauss_seidel(bodies_, contacts_, kSweeps, kAccurate * scale_);
    VectorXd p = impulses();
    const Real before = evaluate(p, false);
    if (polish(p, work) < before) set_impulses(p);
  }
}

ContactWork FrictionSolver::solve() {
  ContactWork work{.solves = 1};
  solve_by_rounds(work);
  if (residual(bodies_, contacts_) > kAccepted * scale_) solve_by_newton(work);
  if (residual(bodies_, contacts_) > kGoodEnough * scale_) fall_back(work);
  work.residual = residual(bodies_, contacts_);
  return work;
}

}  // namespace

ContactWork solve_by_pivoting(std::span<ContactBody> bodies, std::span<Contact> contacts) {
  for (Contact& c : contacts) c.impulse.setZero();
  if (contacts.empty()) return {};
  return FrictionSolver(bodies, contacts).solve();
}

}  // namespace offstage::sim
