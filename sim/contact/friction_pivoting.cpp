#include "sim/contact/friction_pivoting.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "sim/linear/updated_cholesky.h"
#include "sim/linear/updated_qr.h"

namespace offstage::sim {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr Real kSatisfied = 1e-11;  ///< velocities below this fraction of the greatest |b| count as zero
constexpr Real kNoise = 1e-12;      ///< rates below this fraction of the greatest rate count as zero
constexpr Real kDependent = UpdatedCholesky::kDependent;
constexpr int kAttempts = 4;
constexpr uint8_t kMoves = 4;  ///< changes of one row in steps of no length after which it counts as a cycle

/// State of a row. free is Baraff's ZA: no velocity, and any force within the limits. high and low are his
/// MaxF and MinF: the force is at a limit. held: a row without velocity that depends linearly on free rows;
/// its force stays constant. fixed: a row that is not yet added, or a tangent whose force F_n determines.
/// broken: a normal without force.
enum class State : uint8_t { fixed, free, held, high, low, broken };

class Pivoting {
 public:
  Pivoting(const DenseContacts& contacts, VectorXd& F);
  PivotingResult run(Index first);

 private:
  enum class Outcome { solved, postponed, failed };
  struct Block {
    Real step = kInfinity;
    Index row = -1;
    State to = State::fixed;

    void consider(Real s, Index r, State t) {
      if (s < step) *this = {std::max(s, 0.0), r, t};
    }
  };

  State& state(Index row) { return states_[static_cast<std::size_t>(row)]; }
  State state(Index row) const { return states_[static_cast<std::size_t>(row)]; }
  Real friction(Index tangent) const {
    return contacts_.friction[static_cast<std::size_t>(tangent / 3)][tangent % 3 - 1];
  }
  bool slides(Index row) const { return contacts_.slides[static_cast<std::size_t>(row / 3)] != 0; }
  bool is_held(Index row) const {
    return !contacts_.held.empty() && contacts_.held[static_cast<std::size_t>(row / 3)] != 0;
  }
  Real fraction(Index tangent) const;
  Real entry(Index row, Index column) const;

  Outcome bring_in(Index m);
  bool is_settled(Index m);
  bool turns_back(const Block& last, State before) const;
  bool end_step(const Block& block, Index m);
  bool find_direction(Index m, Real sign);
  Block first_block(Index m, Real sign) const;
  void block_on_limits(Index tangent, Block& first) const;
  void block_on_tangent(Index tangent, Block& first) const;
  void advance(const Block& block, Index m);
  void change(const Block& block);
  void open(Index normal);
  void close(Index normal);
  void move_tangent(Index tangent, State to);
  void update_normal(Index normal);
  bool enter(Index row);
  void leave(Index row);

  const DenseContacts& contacts_;
  const Eigen::MatrixXd& A_;
  VectorXd& F_;
  VectorXd a_, dF_, da_, x_;
  Real zero_, noise_ = 0;
  std::vector<State> states_;
  std::vector<uint8_t> moves_;         ///< by row: changes since the last step whose length was not zero
  std::vector<Index> rows_, columns_;  ///< rows and columns of the factor
  UpdatedQr factor_;
  PivotingResult result_;
  uint32_t max_pivots_;
};

Pivoting::Pivoting(const DenseContacts& contacts, VectorXd& F)
    : contacts_(contacts),
      A_(contacts.A),
      F_(F),
      a_(contacts.b),
      dF_(a_.size()),
      zero_(a_.size() ? kSatisfied * a_.cwiseAbs().maxCoeff() : 0),
      states_(static_cast<std::size_t>(a_.size()), State::fixed),
      moves_(states_.size(), 0),
      factor_(a_.size()),
      max_pivots_(static_cast<uint32_t>(100 + 20 * a_.size())) {
  F_.setZero(a_.size());
  for (Index n = 0; n < a_.size(); n += 3)
    if (is_held(n)) {
      F_[n] = 1;
      state(n) = State::free;
    }
}

/// Returns F_t / F_n of a tangent whose force the normal force determines. The normal's column then contains
/// this multiple of the tangent's column.
Real Pivoting::fraction(Index tangent) const {
  switch (state(tangent)) {
    case State::high:
      return friction(tangent);
    case State::low:
      return -friction(tangent);
    case State::fixed:
      return slides(tangent) && tangent % 3 == 1 ? -friction(tangent) : 0;
    default:
      return 0;
  }
}

Real Pivoting::entry(Index row, Index j) const {
  if (j % 3 != 0) return A_(row, j);
  return A_(row, j) + fraction(j + 1) * A_(row, j + 1) + fraction(j + 2) * A_(row, j + 2);
}

bool Pivoting::find_direction(Index m, Real sign) {
  x_.resize(factor_.size());
  for (std::size_t k = 0; k < rows_.size(); ++k) x_[static_cast<Index>(k)] = -sign * entry(rows_[k], m);
  if (!factor_.solve(x_)) return false;
  dF_.setZero();
  dF_[m] = sign;
  for (std::size_t k = 0; k < columns_.size(); ++k) dF_[columns_[k]] = x_[static_cast<Index>(k)];
  for (Index n = 0; n < dF_.size(); n += 3)
    for (const Index t : {n + 1, n + 2})
      if (fraction(t) != 0) dF_[t] = fraction(t) * dF_[n];
  da_.noalias() = A_ * dF_;
  noise_ = kNoise * dF_.cwiseAbs().maxCoeff();
  return true;
}

/// Finds where the friction force reaches its limit mu F_n. The limit also changes within the step.
void Pivoting::block_on_limits(Index t, Block& first) const {
  const Real mu = friction(t), limit = mu * F_[t - t % 3], change = mu * dF_[t - t % 3];
  if (change - dF_[t] < -noise_) first.consider((limit - F_[t]) / (dF_[t] - change), t, State::high);
  if (change + dF_[t] < -noise_) first.consider((limit + F_[t]) / (-dF_[t] - change), t, State::low);
}

void Pivoting::block_on_tangent(Index t, Block& first) const {
  const State s = state(t);
  const Real still = kDependent * std::sqrt(A_(t, t) * A_.diagonal().maxCoeff());
  if (s == State::free || s == State::held) block_on_limits(t, first);
  if (s == State::held && std::abs(da_[t]) > still) first.consider(0, t, State::free);
  if ((s == State::high && da_[t] > still) || (s == State::low && da_[t] < -still))
    first.consider(-a_[t] / da_[t], t, State::free);
}

/// Finds the event that ends a step first: row m is satisfied, or another row would leave its state.
Pivoting::Block Pivoting::first_block(Index m, Real sign) const {
  Block first;
  if (std::abs(da_[m]) > kDependent * A_(m, m) && a_[m] * da_[m] < 0)
    first.consider(-a_[m] / da_[m], m, State::free);
  if (m % 3 != 0) block_on_limits(m, first);
  if (m % 3 == 0 && sign < 0) first.consider(F_[m], m, State::broken);
  for (Index n = 0; n < F_.size(); n += 3) {
    if (state(n) == State::broken && da_[n] < -kDependent * std::sqrt(A_(n, n) * A_(m, m)))
      first.consider(-a_[n] / da_[n], n, State::free);
    if (state(n) != State::free) continue;
    if (dF_[n] < -noise_) first.consider(-F_[n] / dF_[n], n, State::broken);
    for (const Index t : {n + 1, n + 2}) block_on_tangent(t, first);
  }
  return first;
}

void Pivoting::advance(const Block& block, Index m) {
  ++result_.pivots;
  F_ += block.step * dF_;
  a_ += block.step * da_;
  for (const Index row : rows_) a_[row] = 0;
  for (Index n = 0; n < F_.size(); n += 3) F_[n] = std::max(F_[n], 0.0);
  if (block.row == m && block.to == State::free) a_[m] = 0;
  if (block.step * A_(m, m) > zero_) std::fill(moves_.begin(), moves_.end(), uint8_t{0});
}

/// Adds a row to the system of free rows; returns false if it depends on them.
bool Pivoting::enter(Index row) {
  const Index n = factor_.size();
  VectorXd across(n), down(n);
  for (Index k = 0; k < n; ++k) {
    across[k] = entry(row, columns_[static_cast<std::size_t>(k)]);
    down[k] = entry(rows_[static_cast<std::size_t>(k)], row);
  }
  x_ = down;
  a_[row] = 0;
  const Real corner = entry(row, row);
  if (!factor_.solve(x_) || std::abs(corner - across.dot(x_)) <= kDependent * A_(row, row)) return false;
  factor_.append(across, down, corner);
  rows_.push_back(row);
  columns_.push_back(row);
  state(row) = State::free;
  return true;
}

void Pivoting::leave(Index row) {
  if (state(row) != State::free) return;
  const auto r = std::find(rows_.begin(), rows_.end(), row);
  const auto c = std::find(columns_.begin(), columns_.end(), row);
  factor_.remove(r - rows_.begin(), c - columns_.begin());
  rows_.erase(r);
  columns_.erase(c);
}

/// Updates the column of a contact's normal force after fraction() of one of its tangents has changed.
void Pivoting::update_normal(Index normal) {
  const auto c = std::find(columns_.begin(), columns_.end(), normal);
  if (c == columns_.end()) return;
  VectorXd by(factor_.size());
  for (std::size_t k = 0; k < rows_.size(); ++k) by[static_cast<Index>(k)] = entry(rows_[k], normal);
  factor_.replace(c - columns_.begin(), by);
  columns_.erase(c);
  columns_.push_back(normal);
}

void Pivoting::move_tangent(Index t, State to) {
  leave(t);
  const Index n = t - t % 3;
  state(t) = to == State::free ? State::held : to;
  update_normal(n);
  if (to == State::free)
    enter(t);
  else
    F_[t] = fraction(t) * F_[n];
}

void Pivoting::open(Index n) {
  for (const Index t : {n + 1, n + 2}) {
    leave(t);
    F_[t] = 0;
    if (state(t) != State::fixed) state(t) = State::high;
  }
  leave(n);
  F_[n] = 0;
  state(n) = State::broken;
}

void Pivoting::close(Index n) {
  for (const Index t : {n + 1, n + 2})
    if (state(t) != State::fixed) state(t) = a_[t] < 0 ? State::high : State::low;
  enter(n);
}

void Pivoting::change(const Block& block) {
  ++moves_[static_cast<std::size_t>(block.row)];
  if (block.row % 3 != 0)
    move_tangent(block.row, block.to);
  else if (block.to == State::broken)
    open(block.row);
  else
    close(block.row);
}

/// Whether row m needs no more force; if so, sets its state. A normal row may depend linearly on others that
/// already give it the right velocity. The load of row m is then transferred to these rows, until the load is
/// zero or one of these rows changes its state.
bool Pivoting::is_settled(Index m) {
  if (m % 3 == 0) {
    if (F_[m] > 0) return std::abs(a_[m]) <= zero_ && enter(m);
    if (a_[m] >= -zero_) state(m) = State::broken;
    return state(m) == State::broken;
  }
  if (state(m) != State::fixed) return true;
  if (state(m - m % 3) != State::free || std::abs(a_[m]) <= zero_)
    move_tangent(m, state(m - m % 3) != State::free ? State::high : State::free);
  return state(m) != State::fixed;
}

/// Whether the row that has just changed would immediately change back. Sliding friction can make principal
/// minors negative. The path of solutions, with F_m as its parameter, then reverses its direction, and so
/// does F_m.
bool Pivoting::turns_back(const Block& last, State before) const {
  const Index r = last.row;
  const Real still = kDependent * std::sqrt(A_(r, r) * A_.diagonal().maxCoeff());
  switch (state(r)) {
    case State::broken:
      return da_[r] < -still;
    case State::high:
      return da_[r] > still;
    case State::low:
      return da_[r] < -still;
    case State::free:
      if (r % 3 == 0) return dF_[r] < -noise_;
      if (before == State::high) return dF_[r] - friction(r) * dF_[r - r % 3] > noise_;
      return before == State::low && -dF_[r] - friction(r) * dF_[r - r % 3] > noise_;
    default:
      return false;
  }
}

/// Ends a step at row m itself. Returns false if the path has led back to zero force, or to the opposite
/// limit.
bool Pivoting::end_step(const Block& block, Index m) {
  if (block.to == State::broken) {
    F_[m] = 0;
    return a_[m] >= -zero_;
  }
  if (block.to == State::high || block.to == State::low) {
    if (a_[m] * (block.to == State::high ? 1 : -1) > zero_) return false;
    move_tangent(m, block.to);
  }
  return true;
}

Pivoting::Outcome Pivoting::bring_in(Index m) {
  if (m % 3 == 0 && is_held(m)) return Outcome::solved;
  if (m % 3 != 0 && (slides(m) || friction(m) == 0)) return Outcome::solved;
  if (m % 3 != 0 && state(m - m % 3) == State::fixed) return Outcome::postponed;
  std::fill(moves_.begin(), moves_.end(), uint8_t{0});
  Block block;
  State before = State::fixed;
  Real sign = 0;
  while (result_.pivots < max_pivots_) {
    if (is_settled(m)) return Outcome::solved;
    if (block.row < 0 || block.row == m) sign = a_[m] < (m % 3 == 0 ? -zero_ : 0) ? 1 : -1;
    if (!find_direction(m, sign)) return Outcome::failed;
    if (block.row >= 0 && block.row != m && turns_back(block, before)) {
      sign = -sign;
      dF_ = -dF_;
      da_ = -da_;
    }
    block = first_block(m, sign);
    if (block.row < 0) return Outcome::failed;
    before = state(block.row);
    advance(block, m);
    if (block.row == m) {
      if (!end_step(block, m)) return Outcome::postponed;
      continue;
    }
    change(block);
    if (moves_[static_cast<std::size_t>(block.row)] > kMoves) return Outcome::postponed;
  }
  return Outcome::postponed;
}

PivotingResult Pivoting::run(Index first) {
  struct Visit {
    Index row;
    int attempts;
  };
  std::deque<Visit> queue;
  for (Index m = 0; m < F_.size(); ++m) queue.push_back({(first + m) % F_.size(), 0});
  while (!queue.empty()) {
    const Visit visit = queue.front();
    queue.pop_front();
    const Outcome outcome = bring_in(visit.row);
    if (outcome == Outcome::postponed && visit.attempts + 1 < kAttempts)
      queue.push_back({visit.row, visit.attempts + 1});
    else if (outcome != Outcome::solved)
      result_.solved = false;
  }
  return result_;
}

}  // namespace

PivotingResult pivot(const DenseContacts& contacts, std::size_t first, VectorXd& p) {
  return Pivoting(contacts, p).run(static_cast<Index>(3 * first));
}

}  // namespace offstage::sim
