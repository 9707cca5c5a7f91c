#include "sim/dynamics/implicit_euler.h"

#include <algorithm>
#include <numbers>

#include <Eigen/SparseLU>

#include "sim/dynamics/flat_array.h"

namespace offstage::sim {
namespace {

constexpr int kIterations = 16;
/// Newton's method ends after a correction below kConverged times the coordinates, or times kLeastScale [m]
/// if they are smaller. The next correction would be about the square of this one.
constexpr Real kConverged = 1e-9, kLeastScale = 1e-3;
constexpr Real kShortest = 1.0 / 64;

}  // namespace

/// The implicit equations of a system.
class ImplicitIntegrator::Equations {
 public:
  Equations(const DynamicSystem& system, std::size_t x_size, std::size_t p_size, IntegratorReport& report)
      : system_(system),
        report_(report),
        n_(static_cast<Eigen::Index>(x_size)),
        size_(static_cast<Eigen::Index>(x_size + p_size)),
        matrix_(size_, size_),
        slope_(size_),
        velocity_(x_size) {}

  /// Improves `y` until it solves y = constant + h f(t, y). Returns false if the iteration fails.
  bool solve(Real t, Real h, const Eigen::VectorXd& constant, Eigen::VectorXd& y) {
    for (int i = 0; i < kIterations; ++i) {
      evaluate(t, y);
      if (!factorize(t, h, y)) return false;
      const Eigen::VectorXd correction = factors_.solve(constant + h * slope_ - y);
      y += correction;
      ++report_.iterations;
      if (!y.allFinite()) return false;
      if (is_small(correction, t, h, y)) return true;
    }
    return false;
  }

 private:
  std::span<const Real> head(const Eigen::VectorXd& y) const {
    return {y.data(), static_cast<std::size_t>(n_)};
  }
  std::span<const Real> tail(const Eigen::VectorXd& y) const {
    return {y.data() + n_, static_cast<std::size_t>(size_ - n_)};
  }

  void evaluate(Real t, const Eigen::VectorXd& y) {
    system_.velocity(t, head(y), tail(y), {slope_.data(), head(y).size()});
    system_.force(t, head(y), tail(y), {slope_.data() + n_, tail(y).size()});
    ++report_.evaluations;
  }

  /// Factorizes 1 - h df/dy at the state y. The sparsity pattern is the same for all states, so it is
  /// analysed only once.
  bool factorize(Real t, Real h, const Eigen::VectorXd& y) {
    entries_.clear();
    system_.jacobian(t, head(y), tail(y), entries_);
    for (auto& e : entries_) e = {e.row(), e.col(), -h * e.value()};
    for (int i = 0; i < size_; ++i) entries_.emplace_back(i, i, 1);
    matrix_.setFromTriplets(entries_.begin(), entries_.end());
    if (!analyzed_) factors_.analyzePattern(matrix_);
    analyzed_ = true;
    factors_.factorize(matrix_);
    return factors_.info() == Eigen::Success;
  }

  /// Whether a correction that led to `y` is negligible, both in the coordinates and by its effect on the
  /// rates.
  bool is_small(const Eigen::VectorXd& correction, Real t, Real h, const Eigen::VectorXd& y) {
    system_.velocity(t, head(y), tail(y), velocity_);
    array(velocity_) = h * (array(velocity_) - slope_.head(n_).array());
    const Real least = kConverged * std::max(kLeastScale, greatest(head(y)));
    return greatest(head(correction)) <= least && greatest(velocity_) <= least;
  }

  const DynamicSystem& system_;
  IntegratorReport& report_;
  Eigen::Index n_, size_;
  Eigen::SparseMatrix<Real> matrix_;
  Eigen::SparseLU<Eigen::SparseMatrix<Real>> factors_;
  bool analyzed_ = false;
  SparseEntries entries_;
  Eigen::VectorXd slope_;
  std::vector<Real> velocity_;
};

void ImplicitIntegrator::step(const DynamicSystem& system, Real t, Real h, std::span<Real> x,
                              std::span<Real> p, IntegratorWorkspace& work) const {
  if (x.empty()) return;
  const auto n = static_cast<Eigen::Index>(x.size());
  Equations equations(system, x.size(), p.size(), work.report);
  Eigen::VectorXd start(x.size() + p.size());
  start << array(x).matrix(), array(p).matrix();
  Eigen::VectorXd end(start.size());

  Real length = h;
  for (Real at = 0; at < h;) {
    end = start;
    const bool good = advance(equations, t + at, length, start, end);
    if (!good && length > h * kShortest) {
      length /= 2;  // after halving, the steps still end exactly at h
      ++work.report.rejected;
      continue;
    }
    ++work.report.steps;
    work.report.missed += !good;
    start = end;
    at += length;
  }
  array(x) = start.head(n).array();
  array(p) = start.tail(start.size() - n).array();
}

bool ImplicitEuler::advance(Equations& equations, Real t, Real h, const Eigen::VectorXd& y0,
                            Eigen::VectorXd& y) const {
  return equations.solve(t + h, h, y0, y);
}

bool StiffRungeKutta::advance(Equations& equations, Real t, Real h, const Eigen::VectorXd& y0,
                              Eigen::VectorXd& y) const {
  // With g = 1 - sqrt(1/2): y1 = y0 + g h f(t + g h, y1) and y = y0 + (1 - g) h f(t + g h, y1)
  // + g h f(t + h, y), where the first equation gives h f(t + g h, y1) = (y1 - y0) / g.
  constexpr Real g = 1 - std::numbers::sqrt2 / 2;
  const bool good = equations.solve(t + g * h, g * h, y0, y);
  const Eigen::VectorXd constant = y0 + (1 - g) / g * (y - y0);
  return equations.solve(t + h, g * h, constant, y) && good;
}

}  // namespace offstage::sim
