#include "producer/build/drawn_objects.h"

#include <gtest/gtest.h>

namespace offstage::producer {
namespace {

/// Returns the distance from the edge of a face to where it is flat [m].
float bevel_of(float side, std::optional<Real> bevel) {
  const sim::Box box{sim::Vec3::Constant(side)};
  float flat = 0;
  for (const auto& p : DrawnShape{box, bevel}.mesh().positions)
    if (p.x() == side / 2) flat = std::max(flat, p.y());
  return side / 2 - flat;
}

TEST(DrawnObjects, BevelsOfBoxesAreInProportionUpToALimitUnlessTheyAreGiven) {
  EXPECT_FLOAT_EQ(bevel_of(0.5f, {}), 0.02f);
  EXPECT_NEAR(bevel_of(200, {}), 0.05f, 1e-4);
  EXPECT_EQ(bevel_of(0.5f, 0.0), 0);
  EXPECT_FLOAT_EQ(bevel_of(0.5f, 0.1), 0.1f);
  EXPECT_NE((DrawnShape{sim::Box{}, 0.1}.key()), (DrawnShape{sim::Box{}, 0.2}.key()))
      << "boxes with different bevels do not share a mesh";
}

}  // namespace
}  // namespace offstage::producer
