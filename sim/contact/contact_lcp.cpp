#include "sim/contact/contact_lcp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include <Eigen/Cholesky>

#include "sim/contact/friction_pivoting.h"
#include "sim/linear/lcp.h"

namespace offstage::sim {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// This fraction of the diagonal is added to the diagonal, so that redundant contacts share their load in a
/// unique way.
constexpr Real kFraction = 1e-7;
/// Greatest accepted residual, as a fraction of scale().
constexpr Real kLcpAccepted = 1e-8;
/// kConstraintAccepted: greatest accepted residual of the constraints of joints, as a fraction of scale().
/// kConstraintSoftness: fraction of the diagonal that is added, so that redundant constraints can be solved.
constexpr Real kConstraintAccepted = 1e-9, kConstraintSoftness = 1e-11;
constexpr int kRefinements = 3;
/// If joints reduce the mobility of a row to less than this fraction, the remaining mobility is only a
/// rounding error.
constexpr Real kImmobile = 1e-10;
/// A tangential impulse within this fraction of its limit counts as sliding.
constexpr Real kAtLimit = 1e-9;
/// Number of orders in which the contacts are tried.
constexpr std::size_t kOrders = 2;
/// Replaces a missing bound of a joint's impulse; larger than any impulse [N s].
constexpr Real kUnbounded = 1e15;

/// The source of three rows of the pivoting: a contact, or a bounded row of a joint.
struct RowOrigin {
  uint32_t index;
  bool is_joint;
  /// impulse = shift + sign p, with the unknown p of the pivoting.
  Real sign = 1, shift = 0;
};

class IslandLcp {
 public:
  IslandLcp(std::span<ContactBody> bodies, std::span<Contact> contacts, const JointProblem& joints)
      : bodies_(bodies), contacts_(contacts), joints_(joints) {}

  bool solve(ContactWork& work);

 private:
  void number_bodies();
  void set_rows();
  void set_contact(uint32_t i);
  void set_bounded(uint32_t i);
  bool eliminate_constraints();
  bool pivot_all(ContactWork& work);
  bool solve_without_friction(ContactWork& work);
  void refine();
  Real residual() const;
  Real scale() const;
  bool apply();
  /// Adds the row `on` of a body's twist to a row of the Jacobian.
  void add(Index row, uint32_t body, const Vec6& on);
  MatrixXd response(const MatrixXd& jacobian) const;
  /// Returns the row of the impulse of bounded coordinate i, or of the normal impulse of contact i.
  Index row_of(std::size_t i) const { return static_cast<Index>(3 * i + (problem_.held[i] ? 1 : 0)); }

  std::span<ContactBody> bodies_;
  std::span<Contact> contacts_;
  const JointProblem& joints_;
  std::vector<Index> column_;  // by body; -1: not moved
  Index columns_ = 0;
  std::vector<RowOrigin> origins_;
  MatrixXd J_, response_;    // response_: M^-1 J^T, where M has only the bodies without joints
  MatrixXd G_, G_response_;  // the Jacobian of the constraints, and its M^-1 G^T
  MatrixXd reaction_;        // impulses of the constraints due to unit impulses of the rows
  DenseContacts problem_;
  VectorXd p_, shifts_;  // shifts_: RowOrigin::shift of each row
  bool has_friction_ = false;
};

void IslandLcp::number_bodies() {
  for (const ContactBody& body : bodies_) {
    column_.push_back(body.is_moved() ? columns_ : -1);
    if (body.is_moved()) columns_ += 6;
  }
}

void IslandLcp::add(Index row, uint32_t body, const Vec6& on) {
  if (body != kUnmoved && column_[body] >= 0) J_.block<1, 6>(row, column_[body]) += on.transpose();
}

MatrixXd IslandLcp::response(const MatrixXd& jacobian) const {
  MatrixXd r(columns_, jacobian.rows());
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (column_[i] < 0) continue;
    const Index c = column_[i];
    r.middleRows<3>(c) = bodies_[i].inverse_mass * jacobian.middleCols<3>(c).transpose();
    r.middleRows<3>(c + 3) = bodies_[i].inverse_inertia * jacobian.middleCols<3>(c + 3).transpose();
  }
  return r;
}

void IslandLcp::set_contact(uint32_t i) {
  const Contact& c = contacts_[i];
  const auto n = static_cast<Index>(3 * origins_.size());
  origins_.push_back({i, false});
  const std::array axes = {c.frame.n, c.frame.t, c.frame.k};
  for (Index k = 0; k < 3; ++k) {
    const Vec3& axis = axes[static_cast<std::size_t>(k)];
    Vec6 on;
    on << axis, c.arm_a.cross(axis);
    add(n + k, c.a, on);
    on << -axis, -c.arm_b.cross(axis);
    add(n + k, c.b, on);
  }
  problem_.b.segment<3>(n) = c.relative_velocity(bodies_) - Vec3(c.target, 0, 0);
  problem_.friction.emplace_back(c.friction_t, c.friction_k);
  has_friction_ |= c.friction_t > 0 || c.friction_k > 0;
}

/// Sets the rows of a bounded row of a joint. A row with one bound is treated as a normal. A row with two
/// bounds is treated as a tangent of a contact whose normal impulse is 1, so that its limits are constant.
void IslandLcp::set_bounded(uint32_t i) {
  const BoundedRow& row = joints_.bounded[i];
  const bool low = std::isfinite(row.lower), high = std::isfinite(row.upper), is_normal = low != high;
  const auto n = static_cast<Index>(3 * origins_.size());
  RowOrigin origin{i, true};
  if (is_normal) {
    origin.sign = low ? 1 : -1;
    origin.shift = low ? row.lower : row.upper;
    problem_.friction.emplace_back(0, 0);
  } else {
    origin.shift = low ? (row.lower + row.upper) / 2 : 0;
    problem_.friction.emplace_back(low ? (row.upper - row.lower) / 2 : kUnbounded, 0);
    has_friction_ = true;
  }
  problem_.held.back() = !is_normal;
  const Index at = is_normal ? n : n + 1;
  Real u = row.offset - row.target;
  for (const auto& [body, on] : {std::pair(row.a, &row.on_a), std::pair(row.b, &row.on_b)}) {
    if (body == kUnmoved) continue;
    add(at, body, origin.sign * *on);
    u += on->head<3>().dot(bodies_[body].velocity) + on->tail<3>().dot(bodies_[body].angular_velocity);
  }
  problem_.b[at] = origin.sign * u;
  problem_.A(at, at) = row.softness;
  origins_.push_back(origin);
}

void IslandLcp::set_rows() {
  const auto rows = static_cast<Index>(3 * (contacts_.size() + joints_.bounded.size()));
  J_ = MatrixXd::Zero(rows, columns_);
  problem_.A = MatrixXd::Zero(rows, rows);
  problem_.b = VectorXd::Zero(rows);
  for (uint32_t i = 0; i < contacts_.size(); ++i) {
    problem_.held.push_back(0);
    set_contact(i);
  }
  for (uint32_t i = 0; i < joints_.bounded.size(); ++i) {
    problem_.held.push_back(0);
    set_bounded(i);
  }
  problem_.slides.assign(origins_.size(), 0);
  response_ = response(J_);
  problem_.A.noalias() += J_ * response_;
  shifts_ = VectorXd::Zero(rows);
  for (std::size_t i = 0; i < origins_.size(); ++i)
    if (origins_[i].is_joint) shifts_[row_of(i)] = origins_[i].sign * origins_[i].shift;
}

/// Eliminates the constraints of the joints. With S = G M^-1 G^T, impulses p cause the constraint impulses
/// -S^-1 G M^-1 J^T p, which reduce the mobility to J M^-1 J^T - (G M^-1 J^T)^T S^-1 (G M^-1 J^T). Redundant
/// constraints make S singular; a small addition to its diagonal and a few refinements give one of its
/// solutions.
bool IslandLcp::eliminate_constraints() {
  Index rows = 0;
  for (const JointConstraint& c : joints_.constraints) rows += c.rows->count;
  G_ = MatrixXd::Zero(rows, columns_);
  if (rows == 0) return true;
  Index row = 0;
  for (const JointConstraint& c : joints_.constraints)
    for (Index k = 0; k < static_cast<Index>(c.rows->count); ++k, ++row) {
      if (c.a != kUnmoved && column_[c.a] >= 0)
        G_.block<1, 6>(row, column_[c.a]) += c.rows->on_a.col(k).transpose();
      if (c.b != kUnmoved && column_[c.b] >= 0)
        G_.block<1, 6>(row, column_[c.b]) += c.rows->on_b.col(k).transpose();
    }
  G_response_ = response(G_);
  const MatrixXd S = G_ * G_response_, coupling = G_ * response_;
  MatrixXd soft = S;
  soft.diagonal() *= 1 + kConstraintSoftness;
  soft.diagonal().array() += kConstraintSoftness * S.diagonal().maxCoeff();
  const Eigen::LLT<MatrixXd> factor(soft);
  if (factor.info() != Eigen::Success) return false;
  reaction_ = factor.solve(-coupling);
  for (int k = 0; k < kRefinements; ++k) reaction_ -= factor.solve(coupling + S * reaction_);
  const Real left = (coupling + S * reaction_).cwiseAbs().maxCoeff();
  if (!(left <= kConstraintAccepted * std::max(coupling.cwiseAbs().maxCoeff(), S.diagonal().maxCoeff())))
    return false;
  const VectorXd free = problem_.A.diagonal();
  problem_.A.noalias() += coupling.transpose() * reaction_;
  problem_.A = ((problem_.A + problem_.A.transpose()) / 2).eval();
  // Joints may hold both bodies of a contact, so that no impulse moves them.
  for (Index i = 0; i < free.size(); ++i) {
    if (problem_.A(i, i) > kImmobile * free[i]) continue;
    problem_.A.row(i).setZero();
    problem_.A.col(i).setZero();
    reaction_.col(i).setZero();
    response_.col(i).setZero();
    problem_.b[i] = 0;
  }
  return true;
}

/// Returns a scale of the velocities: the greatest velocity of the problem, or the greatest velocity that the
/// impulse of one row alone causes [m/s].
Real IslandLcp::scale() const {
  Real s = problem_.b.cwiseAbs().maxCoeff();
  for (Index i = 0; i < p_.size(); ++i) s = std::max(s, problem_.A(i, i) * std::abs(p_[i]));
  return s;
}

/// Returns the natural residual [m/s]. Friction has a separate limit for each tangent.
Real IslandLcp::residual() const {
  const VectorXd u = problem_.A * p_ + problem_.b;
  Real worst = 0;
  for (std::size_t i = 0; i < origins_.size(); ++i) {
    const auto n = static_cast<Index>(3 * i);
    const Real normal = problem_.held[i] ? 1 : p_[n];
    if (!problem_.held[i]) worst = std::max(worst, std::abs(std::min(problem_.A(n, n) * p_[n], u[n])));
    for (const Index t : {n + 1, n + 2}) {
      const Real limit = problem_.friction[i][t - n - 1] * std::max(normal, 0.0), a = problem_.A(t, t);
      if (a <= 0 && p_[t] == 0) continue;
      const Real step = std::clamp(p_[t] - u[t] / a, -limit, limit) - p_[t];
      worst = std::max(worst, std::abs(a * step));
    }
  }
  return worst;
}

bool IslandLcp::solve_without_friction(ContactWork& work) {
  const auto count = static_cast<Index>(origins_.size());
  MatrixXd A(count, count);
  VectorXd b(count);
  for (Index i = 0; i < count; ++i) {
    b[i] = problem_.b[3 * i];
    for (Index j = 0; j < count; ++j) A(i, j) = problem_.A(3 * i, 3 * j);
  }
  const LcpSolution solution = solve_lcp(A, b);
  work.iterations += solution.pivots;
  for (Index i = 0; i < count; ++i) p_[3 * i] = solution.f[i];
  return !solution.fell_back && solution.unbounded.empty();
}

bool IslandLcp::pivot_all(ContactWork& work) {
  DenseContacts soft = problem_;
  soft.A.diagonal() *= 1 + kFraction;
  for (std::size_t k = 0; k < kOrders; ++k) {
    const PivotingResult result = pivot(soft, k * origins_.size() / kOrders, p_);
    work.iterations += result.pivots;
    for (std::size_t i = 0; i < origins_.size(); ++i)
      if (problem_.held[i]) p_[static_cast<Index>(3 * i)] = 0;
    if (!p_.allFinite()) continue;
    refine();
    if (residual() <= kLcpAccepted * scale()) return true;
  }
  return false;
}

/// Removes the error due to kFraction. The rows whose velocity must be zero are solved again with the same
/// softness, starting from the current impulses, so only the remaining error is softened. The friction of
/// sliding tangents follows their normal impulses.
void IslandLcp::refine() {
  const VectorXd u = problem_.A * p_ + problem_.b;
  std::vector<Index> active;
  MatrixXd columns = MatrixXd::Zero(p_.size(), p_.size());  // change of all impulses by each active one
  for (std::size_t i = 0; i < origins_.size(); ++i) {
    const auto n = static_cast<Index>(3 * i);
    const bool held = problem_.held[i] != 0, pushes = !held && p_[n] > 0;
    const auto normal = static_cast<Index>(active.size());
    if (pushes) {
      active.push_back(n);
      columns(n, normal) = 1;
    }
    if (!held && !pushes) continue;
    for (const Index t : {n + 1, n + 2}) {
      const Real mu = problem_.friction[i][t - n - 1], limit = mu * (held ? 1 : p_[n]);
      if (!(limit > 0)) continue;
      if (std::abs(p_[t]) < (1 - kAtLimit) * limit) {
        columns(t, static_cast<Index>(active.size())) = 1;
        active.push_back(t);
      } else if (pushes) {
        columns(t, normal) = p_[t] > 0 ? mu : -mu;
      }
    }
  }
  const auto count = static_cast<Index>(active.size());
  if (count == 0) return;
  const MatrixXd all = problem_.A * columns.leftCols(count);
  MatrixXd K(count, count);
  VectorXd wrong(count);
  for (Index k = 0; k < count; ++k) {
    const Index row = active[static_cast<std::size_t>(k)];
    K.row(k) = all.row(row);
    K(k, k) += kFraction * problem_.A(row, row);
    wrong[k] = -u[row];
  }
  const VectorXd before = p_;
  const Real error = residual();
  p_ += columns.leftCols(count) * K.partialPivLu().solve(wrong);
  if (!p_.allFinite() || !(residual() < error)) p_ = before;
}

/// Stores the impulses and changes the velocities.
bool IslandLcp::apply() {
  p_ += shifts_;
  VectorXd change = response_ * p_, reaction;
  if (G_.rows() > 0) {
    reaction = reaction_ * p_;
    change += G_response_ * reaction;
  }
  if (!change.allFinite()) return false;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    if (column_[i] < 0) continue;
    bodies_[i].velocity += change.segment<3>(column_[i]);
    bodies_[i].angular_velocity += change.segment<3>(column_[i] + 3);
  }
  for (std::size_t i = 0; i < origins_.size(); ++i) {
    const auto n = static_cast<Index>(3 * i);
    const RowOrigin& o = origins_[i];
    if (o.is_joint) {
      joints_.bounded[o.index].impulse = o.sign * p_[row_of(i)];
      continue;
    }
    contacts_[o.index].impulse = p_.segment<3>(n);
    contacts_[o.index].moment.setZero();
  }
  Index row = 0;
  for (std::size_t j = 0; j < joints_.constraints.size(); ++j) {
    joints_.impulses[j].setZero();
    for (Index k = 0; k < static_cast<Index>(joints_.constraints[j].rows->count); ++k)
      joints_.impulses[j][k] = reaction[row++];
  }
  return true;
}

bool IslandLcp::solve(ContactWork& work) {
  number_bodies();
  set_rows();
  if (!eliminate_constraints()) return false;
  problem_.b += problem_.A * shifts_;
  p_ = VectorXd::Zero(problem_.b.size());
  if (!(has_friction_ ? pivot_all(work) : solve_without_friction(work))) return false;
  const Real left = residual();
  if (!(left <= kLcpAccepted * scale())) return false;
  if (!apply()) return false;
  work.residual = std::max(work.residual, left);
  return true;
}

}  // namespace

bool solve_by_lcp(std::span<ContactBody> bodies, std::span<Contact> contacts, const JointProblem& joints,
                  ContactWork& work) {
  ++work.solves;
  uint32_t constraints = 0;
  for (const JointConstraint& c : joints.constraints) constraints += c.rows->count;
  const bool fits =
      contacts.size() + joints.bounded.size() <= kMostLcpContacts && constraints <= kMostLcpConstraints &&
      std::none_of(contacts.begin(), contacts.end(), [](const Contact& c) { return c.resists_turning(); });
  const bool solved = fits && IslandLcp(bodies, contacts, joints).solve(work);
  work.factorizations += fits;
  work.fallbacks += !solved;
  return solved;
}

}  // namespace offstage::sim
