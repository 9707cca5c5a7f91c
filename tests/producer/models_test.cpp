#include "producer/build/models.h"

#include <gtest/gtest.h>

namespace offstage::producer {
namespace {

TEST(ModelSize, FitGivesTheLargestSizeWithinABox) {
  render::Model model;  // a flat triangle of 200 x 100
  render::Mesh& mesh = model.parts.emplace_back().mesh;
  mesh.positions = {{0, 0, 0}, {200, 0, 0}, {0, 100, 0}};
  mesh.indices = {0, 1, 2};
  EXPECT_DOUBLE_EQ(fitted_scale(3, std::nullopt, model), 3);
  EXPECT_DOUBLE_EQ(fitted_scale(1, Vec3(2, 2, 2), model), 0.01) << "the longest side decides";
  EXPECT_DOUBLE_EQ(fitted_scale(1, Vec3(2, 0.5, 2), model), 0.005) << "or the tightest";
  EXPECT_DOUBLE_EQ(fitted_scale(1, Vec3(2, 2, 1e-6), model), 0.01) << "a side without extent does not count";
  EXPECT_DOUBLE_EQ(fitted_scale(3, Vec3(2, 2, 2), model), 0.03) << "copies scale the fitted size";
}

}  // namespace
}  // namespace offstage::producer
