#include "sim/dynamics/adaptive.h"

#include <algorithm>
#include <cassert>

#include "sim/dynamics/flat_array.h"

namespace offstage::sim {
namespace {

/// The next step is kSafety times the step that would just meet the target. kLeastChange and kGreatestChange
/// limit the ratio of consecutive steps.
constexpr Real kSafety = 0.8, kLeastChange = 0.1, kGreatestChange = 4;

/// Returns r^(1/n) for r in [0, 5^n], by Newton's method. The iteration starts above the root and converges
/// monotonically. Unlike std::pow, the result has the same bits on every machine.
Real root(Real r, int n) {
  Real y = 5;
  for (int i = 0; i < 60; ++i) {
    Real power = 1;
    for (int k = 1; k < n; ++k) power *= y;
    const Real next = y - (y - r / power) / n;
    if (!(next < y)) break;
    y = next;
  }
  return y;
}

/// Returns h_new / h = 0.8 |target / error|^(1/p), where p is `error_order`.
Real step_change(Real target, Real error, int error_order) {
  Real least = 1, greatest_ratio = 1;
  for (int i = 0; i < error_order; ++i) {
    least *= kLeastChange / kSafety;
    greatest_ratio *= kGreatestChange / kSafety;
  }
  if (!(error < target / least)) return kLeastChange;  // also if the error is NaN
  if (error <= target / greatest_ratio) return kGreatestChange;
  return kSafety * root(target / error, error_order);
}

/// Returns the greatest error of (x, p) = work.next at time t, in the unit of the coordinates. It is the
/// error of x itself or, if that is greater, the error of the rates times `span` [s].
Real error_of(const DynamicSystem& system, Real t, Real span, IntegratorWorkspace& work) {
  work.x.resize(work.next_x.size());
  work.p.resize(work.next_p.size());
  work.dx.resize(work.next_x.size());
  work.sum_x.resize(work.next_x.size());
  array(work.x) = array(work.next_x) - array(work.error_x);
  array(work.p) = array(work.next_p) - array(work.error_p);
  system.velocity(t, work.next_x, work.next_p, work.dx);
  system.velocity(t, work.x, work.p, work.sum_x);
  array(work.dx) = span * (array(work.dx) - array(work.sum_x));
  const Real by_place = greatest(work.error_x), by_rate = greatest(work.dx);
  return by_rate <= by_place ? by_place : by_rate;
}

}  // namespace

void AdaptiveIntegrator::step(const DynamicSystem& system, Real t, Real h, std::span<Real> x,
                              std::span<Real> p, IntegratorWorkspace& work) const {
  const Real shortest = h * kShortest;
  Real length = work.next_step > 0 ? std::max(work.next_step, shortest) : h;
  begin(system, t, x, p, work);
  for (Real at = 0; at < h;) {
    // A remainder shorter than the shortest step is included in this step.
    const bool is_last = at + length >= h - shortest / 2;
    const Real now = is_last ? h - at : length;
    attempt(system, t + at, now, x, p, work);
    const Real error = error_of(system, t + at + now, h, work);
    const Real change = step_change(work.tolerance, error, error_order_);
    const bool good = error <= work.tolerance;
    if (!good && now > shortest) {
      length = std::max(shortest, change * now);
      ++work.report.rejected;
      continue;
    }
    accept(work);
    std::copy(work.next_x.begin(), work.next_x.end(), x.begin());
    std::copy(work.next_p.begin(), work.next_p.end(), p.begin());
    ++work.report.steps;
    work.report.missed += !good;
    at = is_last ? h : at + now;
    // The small error of a step that was shortened to end at h does not limit the next step.
    const Real proposed = std::max(shortest, change * now);
    length = now < length ? std::max(length, proposed) : proposed;
  }
  work.next_step = length;
}

void StepDoubling::attempt(const DynamicSystem& system, Real t, Real h, std::span<const Real> x,
                           std::span<const Real> p, IntegratorWorkspace& work) const {
  work.error_x.assign(x.begin(), x.end());
  work.error_p.assign(p.begin(), p.end());
  work.next_x = work.error_x;
  work.next_p = work.error_p;
  const uint64_t steps = work.report.steps;
  inner_.step(system, t, h, work.error_x, work.error_p, work);
  inner_.step(system, t, h / 2, work.next_x, work.next_p, work);
  inner_.step(system, t + h / 2, h / 2, work.next_x, work.next_p, work);
  work.report.steps = steps;  // they are parts of one step
  array(work.error_x) = array(work.next_x) - array(work.error_x);
  array(work.error_p) = array(work.next_p) - array(work.error_p);
}

void StepDoubling::accept(IntegratorWorkspace& work) const {
  // To leading order, the error of the whole step is 2^order times the error of the two half steps.
  const Real fraction = 1.0 / ((1 << inner_.order()) - 1);
  array(work.next_x) += fraction * array(work.error_x);
  array(work.next_p) += fraction * array(work.error_p);
}

namespace {

constexpr int kStages = 7;
constexpr Real kNodes[kStages] = {0, 1.0 / 5, 3.0 / 10, 4.0 / 5, 8.0 / 9, 1, 1};
// The last row contains the weights of the fifth order, too.
constexpr Real kCoefficients[kStages][kStages - 1] = {
    {},
    {1.0 / 5},
    {3.0 / 40, 9.0 / 40},
    {44.0 / 45, -56.0 / 15, 32.0 / 9},
    {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
    {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
    {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}};
// The weights of the fifth order minus the weights of the fourth order.
constexpr Real kErrorWeights[kStages] = {71.0 / 57600,      0,          -71.0 / 16695, 71.0 / 1920,
                                         -17253.0 / 339200, 22.0 / 525, -1.0 / 40};

void evaluate(const DynamicSystem& system, Real t, std::span<const Real> x, std::span<const Real> p,
              int stage, IntegratorWorkspace& work) {
  const auto s = static_cast<std::size_t>(stage);
  system.velocity(t, x, p, work.stages_x[s]);
  system.force(t, x, p, work.stages_p[s]);
  ++work.report.evaluations;
}

/// Adds h (weights . stages) to `sum`.
void add_stages(const std::vector<std::vector<Real>>& stages, const Real* weights, int count, Real h,
                std::vector<Real>& sum) {
  for (int i = 0; i < count; ++i)
    if (weights[i] != 0)
      array(sum) += h * weights[i] * array(std::span<const Real>(stages[static_cast<std::size_t>(i)]));
}

}  // namespace

void DormandPrince::begin(const DynamicSystem& system, Real t, std::span<const Real> x,
                          std::span<const Real> p, IntegratorWorkspace& work) const {
  work.stages_x.resize(kStages);
  work.stages_p.resize(kStages);
  for (auto& stage : work.stages_x) stage.resize(x.size());
  for (auto& stage : work.stages_p) stage.resize(p.size());
  evaluate(system, t, x, p, 0, work);
}

void DormandPrince::attempt(const DynamicSystem& system, Real t, Real h, std::span<const Real> x,
                            std::span<const Real> p, IntegratorWorkspace& work) const {
  for (int k = 1; k < kStages; ++k) {
    work.next_x.assign(x.begin(), x.end());
    work.next_p.assign(p.begin(), p.end());
    add_stages(work.stages_x, kCoefficients[k], k, h, work.next_x);
    add_stages(work.stages_p, kCoefficients[k], k, h, work.next_p);
    evaluate(system, t + kNodes[k] * h, work.next_x, work.next_p, k, work);
  }
  work.error_x.assign(x.size(), 0);
  work.error_p.assign(p.size(), 0);
  add_stages(work.stages_x, kErrorWeights, kStages, h, work.error_x);
  add_stages(work.stages_p, kErrorWeights, kStages, h, work.error_p);
}

void DormandPrince::accept(IntegratorWorkspace& work) const {
  work.stages_x.front().swap(work.stages_x.back());
  work.stages_p.front().swap(work.stages_p.back());
}

}  // namespace offstage::sim
