#pragma once
/// Adaptive integration (physics N5): the given time is divided into steps whose error is kept below a
/// target, by step doubling or by an embedded pair. A step whose error is too large is undone and repeated
/// with a shorter length. The error is measured in the coordinates: the error of x itself, and the error in x
/// that the error of the rates p would cause over the whole given time.

#include "sim/dynamics/integrator.h"

namespace offstage::sim {

class AdaptiveIntegrator : public Integrator {
 public:
  /// Shortest step, as a fraction of the given time. It bounds the number of steps.
  static constexpr Real kShortest = 1.0 / 16384;

  void step(const DynamicSystem& system, Real t, Real h, std::span<Real> x, std::span<Real> p,
            IntegratorWorkspace& work) const final;

 protected:
  /// `error_order`: the error of a step of length h is proportional to h^error_order.
  explicit AdaptiveIntegrator(int error_order) : error_order_(error_order) {}

  /// Prepares for the attempts. Called before the first one.
  virtual void begin(const DynamicSystem&, Real, std::span<const Real>, std::span<const Real>,
                     IntegratorWorkspace&) const {}
  /// Takes a step from (x, p) to work.next_x, work.next_p, and estimates its error in work.error_x,
  /// work.error_p.
  virtual void attempt(const DynamicSystem& system, Real t, Real h, std::span<const Real> x,
                       std::span<const Real> p, IntegratorWorkspace& work) const = 0;
  /// Called after an attempt whose error is accepted. An integrator may correct the result of the attempt
  /// here.
  virtual void accept(IntegratorWorkspace&) const {}

 private:
  int error_order_;
};

/// Compares one step of another integrator with two of half the length. The difference is the leading term of
/// the error, and also corrects the result.
class StepDoubling final : public AdaptiveIntegrator {
 public:
  explicit StepDoubling(const Integrator& inner) : AdaptiveIntegrator(inner.order() + 1), inner_(inner) {}
  int order() const override { return inner_.order() + 1; }

 private:
  void attempt(const DynamicSystem& system, Real t, Real h, std::span<const Real> x, std::span<const Real> p,
               IntegratorWorkspace& work) const override;
  void accept(IntegratorWorkspace& work) const override;

  const Integrator& inner_;
};

/// The embedded pair of orders 5 and 4 by Dormand and Prince ("A family of embedded Runge-Kutta formulae",
/// 1980). The result has order 5. The last stage of a step is reused as the first stage of the next.
class DormandPrince final : public AdaptiveIntegrator {
 public:
  DormandPrince() : AdaptiveIntegrator(5) {}
  int order() const override { return 5; }

 private:
  void begin(const DynamicSystem& system, Real t, std::span<const Real> x, std::span<const Real> p,
             IntegratorWorkspace& work) const override;
  void attempt(const DynamicSystem& system, Real t, Real h, std::span<const Real> x, std::span<const Real> p,
               IntegratorWorkspace& work) const override;
  void accept(IntegratorWorkspace& work) const override;
};

}  // namespace offstage::sim
