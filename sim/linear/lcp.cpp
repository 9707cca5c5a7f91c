#include "sim/linear/lcp.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "sim/linear/updated_cholesky.h"

namespace offstage::sim {
namespace {

using Eigen::Index;

constexpr Real kLcpSatisfied = 1e-11;  ///< accelerations below this times max |b| count as zero
/// With a residual above this fraction of the greatest |b|, the fall-back is used.
constexpr Real kAccurateLcp = 1e-9;
constexpr Real kLcpNoise = 1e-12;  ///< scaled rates smaller than this count as zero
constexpr int kLcpAttempts = 4;
constexpr int kLcpSweeps = 500;

/// State of a contact. waiting: not yet added, its acceleration is ignored. ZA: it holds, a = 0. ZF: it is
/// broken, f = 0.
enum class Zone : uint8_t { waiting, ZA, ZF };

enum class Outcome { solved, postponed, unbounded };

class Dantzig {
 public:
  Dantzig(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
  LcpSolution solve();

 private:
  struct Block {
    Real step = kInfinity;
    Index index = -1;
  };

  Outcome bring_in(Index m);
  void find_direction(Index m, Real sign);
  Block first_block(Index m, Real sign) const;
  void advance(const Block& block, Index m, Real sign);
  void change_zone(Index i);
  bool enter(Index i);
  void refine();
  void relax();
  Real residual() const;
  Real length(Index i) const { return std::sqrt(A_(i, i)); }

  const Eigen::MatrixXd& A_;
  const Eigen::VectorXd& b_;
  Real scale_;
  uint32_t max_pivots_;
  LcpSolution result_;
  Eigen::VectorXd a_, da_, x_;
  std::vector<Zone> zones_;
  std::vector<Index> active_;   ///< the indices in ZA, in the order of the factor
  std::vector<uint8_t> moves_;  ///< by index: changes of zone since the last step of positive length
  UpdatedCholesky factor_;
};

Dantzig::Dantzig(const Eigen::MatrixXd& A, const Eigen::VectorXd& b)
    : A_(A),
      b_(b),
      scale_(b.size() ? b.cwiseAbs().maxCoeff() : 0),
      max_pivots_(static_cast<uint32_t>(100 + 50 * b.size())),
      a_(b),
      da_(b.size()),
      zones_(static_cast<std::size_t>(b.size()), Zone::waiting),
      moves_(zones_.size(), 0),
      factor_(b.size()) {
  result_.f.setZero(b.size());
}

/// Finds how the forces in ZA change with f_m so that they keep a = 0.
void Dantzig::find_direction(Index m, Real sign) {
  x_.resize(factor_.size());
  for (std::size_t k = 0; k < active_.size(); ++k) x_[static_cast<Index>(k)] = -sign * A_(active_[k], m);
  factor_.solve(x_);
  da_ = sign * A_.col(m);
  for (std::size_t k = 0; k < active_.size(); ++k) da_ += x_[static_cast<Index>(k)] * A_.col(active_[k]);
}

/// Finds the event that ends a step first: a_m becomes zero, or another index would leave its zone. If m is
/// dependent (da_m = 0), it never ends the step itself. It then unloads the other contacts until one of them
/// can leave.
Dantzig::Block Dantzig::first_block(Index m, Real sign) const {
  Block first;
  const auto consider = [&first](Real step, Index i) {
    if (step < first.step) first = {std::max(step, 0.0), i};
  };
  if (sign * da_[m] > UpdatedCholesky::kDependent * A_(m, m)) consider(-a_[m] / da_[m], m);
  if (sign < 0) consider(result_.f[m], m);
  for (std::size_t k = 0; k < active_.size(); ++k) {
    const Real rate = x_[static_cast<Index>(k)];
    if (rate * length(active_[k]) < -kLcpNoise * length(m))
      consider(-result_.f[active_[k]] / rate, active_[k]);
  }
  for (Index i = 0; i < a_.size(); ++i)
    if (zones_[static_cast<std::size_t>(i)] == Zone::ZF &&
        da_[i] < -UpdatedCholesky::kDependent * length(i) * length(m))
      consider(-a_[i] / da_[i], i);
  return first;
}

void Dantzig::advance(const Block& block, Index m, Real sign) {
  ++result_.pivots;
  a_ += block.step * da_;
  result_.f[m] += block.step * sign;
  for (std::size_t k = 0; k < active_.size(); ++k) {
    Real& f = result_.f[active_[k]];
    f = std::max(0.0, f + block.step * x_[static_cast<Index>(k)]);
    a_[active_[k]] = 0;
  }
  if (block.index == m && result_.f[m] > 0) a_[m] = 0;
  if (block.step * length(m) * length(m) > kLcpSatisfied * scale_)
    std::fill(moves_.begin(), moves_.end(), uint8_t{0});
}

bool Dantzig::enter(Index i) {
  Eigen::VectorXd couplings(factor_.size());
  for (std::size_t k = 0; k < active_.size(); ++k) couplings[static_cast<Index>(k)] = A_(active_[k], i);
  a_[i] = 0;
  if (!factor_.append(couplings, A_(i, i))) return false;
  active_.push_back(i);
  return true;
}

/// Moves an index that ended the step to the other zone. A dependent index may stay in ZF, because the other
/// contacts keep its a at 0.
void Dantzig::change_zone(Index i) {
  Zone& zone = zones_[static_cast<std::size_t>(i)];
  ++moves_[static_cast<std::size_t>(i)];
  if (zone == Zone::ZA) {
    const auto at = std::find(active_.begin(), active_.end(), i);
    factor_.remove(at - active_.begin());
    active_.erase(at);
    result_.f[i] = 0;
    zone = Zone::ZF;
  } else if (enter(i)) {
    zone = Zone::ZA;
  }
}

/// Adds index m. If m is dependent and the other contacts already make its a zero, it cannot enter the
/// factor. Its force is then transferred back to the others, until it is zero or one of them leaves.
Outcome Dantzig::bring_in(Index m) {
  std::fill(moves_.begin(), moves_.end(), uint8_t{0});
  const Real zero = kLcpSatisfied * scale_;
  while (result_.pivots < max_pivots_) {
    const bool holds = result_.f[m] > 0 && std::abs(a_[m]) <= zero && enter(m);
    if (holds || (result_.f[m] == 0 && a_[m] >= -zero)) {
      zones_[static_cast<std::size_t>(m)] = holds ? Zone::ZA : Zone::ZF;
      return Outcome::solved;
    }
    const Real sign = a_[m] < -zero ? 1 : -1;
    find_direction(m, sign);
    const Block block = first_block(m, sign);
    if (block.index < 0) return Outcome::unbounded;
    advance(block, m, sign);
    if (block.index == m) continue;
    change_zone(block.index);
    if (moves_[static_cast<std::size_t>(block.index)] > 2) return Outcome::postponed;
  }
  return Outcome::postponed;
}

/// Removes the rounding errors of the steps by one step of iterative refinement with the matrix itself.
void Dantzig::refine() {
  a_ = A_ * result_.f + b_;
  x_.resize(factor_.size());
  for (std::size_t k = 0; k < active_.size(); ++k) x_[static_cast<Index>(k)] = -a_[active_[k]];
  factor_.solve(x_);
  for (std::size_t k = 0; k < active_.size(); ++k) {
    Real& f = result_.f[active_[k]];
    f = std::max(0.0, f + x_[static_cast<Index>(k)]);
  }
  a_ = A_ * result_.f + b_;
}

Real Dantzig::residual() const {
  Real worst = 0;
  for (Index i = 0; i < a_.size(); ++i) {
    const auto& skip = result_.unbounded;
    if (std::find(skip.begin(), skip.end(), static_cast<uint32_t>(i)) != skip.end()) continue;
    worst = std::max(worst, std::abs(std::min(A_(i, i) * result_.f[i], a_[i])));
  }
  return worst;
}

/// Improves the current forces by projected Gauss-Seidel, as a fall-back.
void Dantzig::relax() {
  for (int sweep = 0; sweep < kLcpSweeps; ++sweep) {
    for (Index i = 0; i < a_.size(); ++i) {
      if (!(A_(i, i) > 0)) continue;
      const Real a = A_.col(i).dot(result_.f) + b_[i];
      result_.f[i] = std::max(0.0, result_.f[i] - a / A_(i, i));
    }
    a_ = A_ * result_.f + b_;
    if (residual() <= kAccurateLcp * scale_) return;
  }
}

LcpSolution Dantzig::solve() {
  struct Visit {
    Index index;
    int attempts;
  };
  std::deque<Visit> queue;
  for (Index i = 0; i < b_.size(); ++i) queue.push_back({i, 0});
  while (!queue.empty()) {
    const Visit visit = queue.front();
    queue.pop_front();
    const Outcome outcome = bring_in(visit.index);
    if (outcome == Outcome::unbounded) result_.unbounded.push_back(static_cast<uint32_t>(visit.index));
    if (outcome == Outcome::postponed && visit.attempts + 1 < kLcpAttempts)
      queue.push_back({visit.index, visit.attempts + 1});
  }
  refine();
  if (residual() > kAccurateLcp * scale_) {
    result_.fell_back = true;
    relax();
  }
  result_.residual = residual();
  return std::move(result_);
}

}  // namespace

LcpSolution solve_lcp(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  return Dantzig(A, b).solve();
}

}  // namespace offstage::sim
