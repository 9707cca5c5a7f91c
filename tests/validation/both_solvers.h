#pragma once
/// Shared by the tests of bodies in contact. Each test runs with the exact and the fast solver and with the
/// book's solver (`lcp`). Bodies do not sleep unless the test is about sleep.

#include <algorithm>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "sim/world.h"

namespace offstage::sim {

inline std::string name_of(SolverKind solver) {
  switch (solver) {
    case SolverKind::exact:
      return "exact";
    case SolverKind::fast:
      return "fast";
    case SolverKind::automatic:
      return "auto";
    case SolverKind::lcp:
      return "lcp";
  }
  return "unknown";
}

inline std::string solver_name(const testing::TestParamInfo<SolverKind>& info) {
  return name_of(info.param);
}

/// Parameters of a test: solver, steps per second.
using SolverAndRate = std::tuple<SolverKind, int>;

inline std::string solver_and_rate(const testing::TestParamInfo<SolverAndRate>& info) {
  return name_of(std::get<0>(info.param)) + std::to_string(std::get<1>(info.param));
}

/// Instantiates a suite for the solvers of scenes, at 240 and 60 steps per second.
#define OFFSTAGE_SOLVERS_AND_RATES(kind, suite)                                                     \
  INSTANTIATE_TEST_SUITE_P(                                                                         \
      kind, suite,                                                                                  \
      testing::Combine(testing::Values(SolverKind::exact, SolverKind::fast, SolverKind::automatic), \
                       testing::Values(240, 60)),                                                   \
      solver_and_rate)

class BothSolvers : public testing::TestWithParam<SolverKind> {
 protected:
  /// Returns whether the solver's results are exact up to rounding.
  static bool is_exact() { return GetParam() == SolverKind::exact || is_lcp(); }
  static bool is_lcp() { return GetParam() == SolverKind::lcp; }
  /// Returns the definition of a world with the solver under test.
  static WorldDef def(Real max_step = 1.0 / 240) {
    return {.max_step = max_step, .solver = GetParam(), .sleep = false};
  }
  static WorldDef weightless(Real max_step = 1.0 / 240) {
    return {.gravity = Vec3::Zero(), .max_step = max_step, .solver = GetParam(), .sleep = false};
  }
};

/// Instantiates a suite for the exact, the fast and the book's solver (`lcp`). `kind` is Solvers, or Long for
/// tests that take minutes.
#define OFFSTAGE_BOTH_SOLVERS(kind, suite) \
  INSTANTIATE_TEST_SUITE_P(                \
      kind, suite, testing::Values(SolverKind::exact, SolverKind::fast, SolverKind::lcp), solver_name)

/// Instantiates a suite for all solvers, including `auto`.
#define OFFSTAGE_ALL_SOLVERS(kind, suite)                                                           \
  INSTANTIATE_TEST_SUITE_P(                                                                         \
      kind, suite,                                                                                  \
      testing::Values(SolverKind::exact, SolverKind::fast, SolverKind::automatic, SolverKind::lcp), \
      solver_name)

/// Combined reports of many steps: counts are added; of other values the greatest one is kept.
struct Tally {
  Real penetration = 0;
  uint64_t collisions = 0, tracebacks = 0, toi_limit_reached = 0, exact_fallbacks = 0, fast_fallbacks = 0,
           lcp_solves = 0, lcp_fallbacks = 0;
  bool finite = true;
  StepReport last;

  void add(const StepReport& r) {
    penetration = std::max(penetration, r.contacts.penetration);
    collisions += r.impacts.collisions;
    tracebacks += r.impacts.tracebacks;
    toi_limit_reached += r.impacts.toi_limit_reached;
    exact_fallbacks += r.solvers.exact.fallbacks + r.solvers.impacts.fallbacks;
    fast_fallbacks += r.solvers.fast.fallbacks;
    lcp_solves += r.solvers.lcp.solves;
    lcp_fallbacks += r.solvers.lcp.fallbacks;
    finite &= r.finite;
    last = r;
  }
};

/// Steps the world for `seconds` and returns the combined reports.
inline Tally run(World& world, Real seconds, Real sampling = 1.0 / 240) {
  Tally all;
  const Real end = world.time() + seconds - sampling / 2;
  while (world.time() < end) all.add(world.step(sampling));
  return all;
}

/// Returns the pose of a plane that descends towards +x at an angle.
inline Pose incline(Real angle) {
  return {Vec3::Zero(), Quat(Eigen::AngleAxisd(-angle, Vec3::UnitZ()))};
}

/// Returns a pose at `height` [m] above the plane incline(angle), with the y axis along the plane's normal.
inline Pose over_incline(Real angle, Real height, const Quat& turn = Quat::Identity()) {
  const Pose plane = incline(angle);
  return {plane.point_to_world({0, height, 0}), plane.orientation * turn};
}

}  // namespace offstage::sim
