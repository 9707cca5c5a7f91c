/// Limits of the cost of a step, as counted work of the solvers, on falling heaps; tests/bench measures the
/// times.

#include <gtest/gtest.h>

#include "heap_scenes.h"

namespace offstage::sim {
namespace {

// The counted work of the exact solver's attempts is limited in each sub-step, and so is that of the impacts.
TEST(BoundedStep, OfHeapsTakesFewTraceBacksAndFactorizations) {
  for (const Heap heap : kHeaps) {
    World world = heap_scene(heap);
    for (int step = 0; step < 600; ++step) {
      const StepReport r = world.step(1.0 / 240);
      ASSERT_TRUE(r.finite) << name_of(heap);
      ASSERT_LE(r.impacts.tracebacks, 35u) << name_of(heap) << ", step " << step;
      ASSERT_LE(r.solvers.impacts.iterations, 2000u) << name_of(heap) << ", step " << step;
      ASSERT_LE(r.solvers.exact.iterations, 2500u) << name_of(heap) << ", step " << step;
      ASSERT_LE(r.solvers.exact.factorizations, 1000u) << name_of(heap) << ", step " << step;
    }
  }
}

}  // namespace
}  // namespace offstage::sim
