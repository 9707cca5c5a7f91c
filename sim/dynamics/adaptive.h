#pragma once
/// Adaptive integration (physics N5): steps inside the given time whose error is kept below a target, by step
/// doubling or by an embedded pair. A step whose error is too large is undone and tried again. The error of a
/// step is measured in the coordinates: what x is off by, and what the rates' error makes of x in the whole
/// time that is integrated over.

#include "sim/dynamics/integrator.h"

namespace offstage::sim {

class AdaptiveIntegrator : public Integrator {
 public:
  /// Steps are no shorter than this part of the given time, so that it always ends.
  static constexpr Real kShortest = 1.0 / 16384;

  void step(const DynamicSystem& system, Real t, Real h, std::span<Real> x, std::span<Real> p,
            IntegratorWorkspace& work) const final;

 protected:
  /// `error_order`: the error of a step of length h falls as h^error_order.
  explicit AdaptiveIntegrator(int error_order) : error_order_(error_order) {}

  /// Before the first attempt.
  virtual void begin(const DynamicSystem&, Real, std::span<const Real>, std::span<const Real>,
                     IntegratorWorkspace&) const {}
  /// Takes a step from (x, p) to work.next_x, work.next_p, and estimates its error in work.error_x,
  /// work.error_p.
  virtual void attempt(const DynamicSystem& system, Real t, Real h, std::span<const Real> x,
                       std::span<const Real> p, IntegratorWorkspace& work) const = 0;
  /// After an attempt whose error has been judged and is good: the last chance to change the result.
  virtual void accept(IntegratorWorkspace&) const {}

 private:
  int error_order_;
};

/// One step of another integrator against two of half the length. The difference, which is the leading term
/// of the error, also corrects the result.
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

/// The pair of orders 5 and 4 by Dormand and Prince ("A family of embedded Runge-Kutta formulae", 1980); the
/// fifth order is kept, and the last stage of a step is the first of the next.
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
