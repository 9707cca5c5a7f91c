// The comparison of algorithms of `offstage bench`.

#include "producer/run/method_bench.h"

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "producer/format/scene_io.h"

namespace offstage::producer {
namespace {

/// Returns a scene in which two compounds of frusta fall on a floor and bounce.
LoadedScene falling_cups(const std::vector<std::string>& overrides = {}) {
  return parse_scene(R"({"world": {"solver": "exact"}, "output": {"fps": 30, "duration": 1},
    "materials": [{"name": "rubber", "restitution": 0.4}],
    "bodies": [{"name": "floor", "motion": "static", "shape": {"type": "plane"}, "material": "rubber"},
               {"name": "cup", "material": "rubber", "position": [0, 0.5, 0],
                "shape": {"type": "compound", "parts": [
                  {"shape": {"type": "frustum", "radius": 0.3, "top_radius": 0.2, "height": 0.4}}]},
                "repeat": {"count": 2, "offset": [0, 0.6, 0]}}]})",
                     "s", OFFSTAGE_SOURCE_DIR, overrides);
}

constexpr double kNoLimit = 1e6;  // [s]

TEST(MethodBench, VariesOneChoiceAtATimeAndLastTheBooksTogether) {
  std::vector<std::string> names;
  for (const Method& method : methods_of(falling_cups().scene)) {
    names.push_back(method.name);
    EXPECT_NO_THROW(falling_cups(method.overrides));
  }
  EXPECT_EQ(names, (std::vector<std::string>{
                       "scene", "solver=fast", "solver=auto", "solver=lcp", "collision.narrow_phase=vclip",
                       "collision.broad_phase=grid", "collision.impact_time=bisection", "collision.trees=obb",
                       "collision.trees=sphere", "collision.trees=mixed", "collision.tree_split=mean",
                       "collision.mesh_pairs=triangles", "all of the book's"}));
}

TEST(MethodBench, CountsTheWorkAndTheDeviationOfEachMethod) {
  std::vector<MethodResult> results;
  for (const Method& method : methods_of(falling_cups().scene))
    results.push_back(run_method(method.name, falling_cups(method.overrides), ModelLibrary(), kNoLimit));
  const MethodResult& first = results.front();
  EXPECT_EQ(first.deviation(first), 0);
  EXPECT_EQ(first.totals.substeps, 29 * 8u);  // the first frame shows time 0
  EXPECT_GT(first.totals.impacts.collisions, 2u);
  EXPECT_GT(first.totals.impacts.searches, 2u);
  EXPECT_GT(first.totals.contacts.pairs_tested, first.totals.impacts.searches);
  for (const MethodResult& r : results) {
    EXPECT_EQ(r.fallbacks(), 0u) << r.name;
    EXPECT_GT(r.steps_per_second(), 0) << r.name;
    // The exact solver has the same motion with each kind of collision detection.
    ASSERT_TRUE(r.deviation(first)) << r.name;
    if (r.name.starts_with("collision")) {
      EXPECT_LT(*r.deviation(first), 1e-4) << r.name;
    }
  }
  const std::string csv = to_csv(results), text = to_text(results);
  EXPECT_EQ(std::ranges::count(csv, '\n'), 1 + static_cast<std::ptrdiff_t>(results.size()));
  EXPECT_EQ(std::ranges::count(text, '\n'), 1 + static_cast<std::ptrdiff_t>(results.size()));
  EXPECT_NE(text.find("collision.narrow_phase=vclip"), std::string::npos);
}

TEST(MethodBench, ARunThatTakesTooLongEndsEarlyAndSaysSo) {
  double fraction = 0;
  const MethodResult whole = run_method("whole", falling_cups(), ModelLibrary(), kNoLimit);
  MethodResult cut = run_method("cut", falling_cups(), ModelLibrary(), 0, [&](double s) { fraction = s; });
  EXPECT_EQ(cut.totals.substeps, 0u);  // the first frame shows the start, so there is no sub-step
  EXPECT_GT(whole.totals.substeps, 0u);
  EXPECT_EQ(fraction, 0);
  EXPECT_NE(cut.fault.find("--limit"), std::string::npos) << cut.fault;
  EXPECT_FALSE(cut.deviation(whole));
  MethodResult merged = whole;
  merge(merged, cut);  // `cut` is faster only because it has fewer steps
  EXPECT_EQ(merged.seconds, whole.seconds);
}

}  // namespace
}  // namespace offstage::producer
