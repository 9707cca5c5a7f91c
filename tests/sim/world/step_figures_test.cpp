/// Statistics of several steps are combined. Each part of a report lists its statistics.

#include <set>
#include <string>

#include <gtest/gtest.h>

#include "sim/step_report.h"

namespace offstage::sim {
namespace {

TEST(StepFigures, AddCountsKeepGreatestValuesAndTakeTheLatestNumbers) {
  StepFigures first, second;
  first.substeps = 4, second.substeps = 8;
  first.particles.born = 3, second.particles.born = 5;
  first.bodies.awake = 9, second.bodies.awake = 2;
  first.contacts.penetration = 0.02, second.contacts.penetration = 0.01;
  first.solvers.fast.solves = 1, second.solvers.fast.solves = 2;
  first.solvers.fast.residual = 1e-6, second.solvers.fast.residual = 1e-3;
  StepFigures all;
  all.add(first);
  all.add(second);
  EXPECT_EQ(all.substeps, 12u);
  EXPECT_EQ(all.particles.born, 8u);
  EXPECT_EQ(all.bodies.awake, 2u);
  EXPECT_EQ(all.contacts.penetration, 0.02);
  EXPECT_EQ(all.solvers.fast.solves, 3u);
  EXPECT_EQ(all.solvers.fast.residual, 1e-3);
}

template <HasFigures Part>
void add_names(const Part& part, const std::string& prefix, std::multiset<std::string>& names) {
  for_each_figure(part, [&](std::string_view name, const auto& value) {
    const std::string whole = prefix + std::string(name);
    if constexpr (HasFigures<std::remove_cvref_t<decltype(value)>>)
      add_names(value, name.empty() ? prefix : whole + "_", names);
    else
      names.insert(whole);
  });
}

TEST(StepFigures, HaveNamesOfTheirOwn) {
  std::multiset<std::string> names;
  add_names(StepFigures(), "", names);
  for (const std::string& name : names) EXPECT_EQ(names.count(name), 1u) << name;
  EXPECT_TRUE(names.contains("particles_born") && names.contains("exact_solver_residual"));
}

}  // namespace
}  // namespace offstage::sim
