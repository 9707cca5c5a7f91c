#include "sim/cloth/self_contacts.h"

#include <gtest/gtest.h>

namespace offstage::sim {
namespace {

/// Two triangles of 1 m, one above the other, as free cloths of 10 mm that touch each other.
struct Layers {
  explicit Layers(Real apart) {
    for (const Real height : {0.0, apart})
      for (const Vec4& p : {Vec4(0, height, 0, 0), Vec4(1, height, 0, 0), Vec4(0, height, 1, 0)})
        points.position.push_back(p);
    points.start = points.rest = points.position;
    points.velocity.assign(6, Vec4::Zero());
    points.acceleration = points.pin_impulse = points.velocity;
    points.mass.assign(6, 1);
    points.inverse_mass.assign(6, 1);
    points.holder.assign(6, nullptr);
    points.thickness.assign(6, 0.01);
    points.friction = points.self_friction = std::vector<Real>(6, 0);
    points.cloth = {0, 0, 0, 1, 1, 1};
    contacts.assign({{0, 1, 2}, {3, 4, 5}}, points);
  }
  /// Moves both layers by these displacements [m], as far as contacts allow.
  void move(const Vec4& lower, const Vec4& upper) {
    make(lower, upper);
    shorten(Vec4::Zero(), MoveFractions(6, 1));
    contacts.end_substep(points, kStep);
  }
  void make(const Vec4& lower, const Vec4& upper) {
    points.start = points.position;
    for (std::size_t i = 0; i < 6; ++i) points.position[i] += i < 3 ? lower : upper;
  }
  /// Shortens the moves of the layers, except for the common drift.
  void shorten(const Vec4& drift, MoveFractions fractions) {
    contacts.find_doubtful(points, kStep, std::vector<Vec4>(6, drift));
    std::vector<uint32_t> lowered;
    for (Vec4& start : points.start) start += drift;
    for (int round = 0; round < 64 && contacts.shorten(points, fractions, lowered); ++round) {
    }
    for (std::size_t i = 0; i < 6; ++i)
      points.position[i] = points.start[i] + fractions[i] * (points.position[i] - points.start[i]);
    for (Vec4& start : points.start) start -= drift;
  }
  Real least_height() const {
    return std::min({points.position[3].y(), points.position[4].y(), points.position[5].y()}) -
           std::max({points.position[0].y(), points.position[1].y(), points.position[2].y()});
  }

  static constexpr Real kStep = 1.0 / 480;
  ClothPoints points;
  SelfContacts contacts;
};

// If each move left a seventh of the distance, rounding would soon decide on which side a layer is.
TEST(SelfContacts, KeepADistanceAfterAnyNumberOfMoves) {
  Layers layers(0.02);
  for (int i = 0; i < 60; ++i) {
    layers.move(Vec4::Zero(), Vec4(0, -0.85 * layers.least_height(), 0, 0));
    ASSERT_GT(layers.least_height(), 1e-4) << i;
  }
}

// Both layers fall together freely, until the lower layer stops.
TEST(SelfContacts, LetLayersMoveTogetherAndHoldTheOneBehind) {
  Layers layers(0.03);
  const Vec4 way(0, -0.02, 0, 0);
  for (int i = 0; i < 10; ++i) layers.move(way, way);
  EXPECT_NEAR(layers.least_height(), 0.03, 1e-12);
  for (int i = 0; i < 10; ++i) {
    layers.move(Vec4::Zero(), way);
    ASSERT_GT(layers.least_height(), 0) << i;
  }
  EXPECT_LT(layers.least_height(), 0.03);
}

// The upper layer is at rest in the world, but approaches in the moving frame in which the moves of the lower
// layer are shortened.
TEST(SelfContacts, HoldLayersApartInTheFrameOfTheirDrift) {
  Layers layers(0.015);
  layers.make(Vec4::Zero(), Vec4::Zero());
  layers.shorten(Vec4(0, 0.05, 0, 0), {0, 0, 0, 1, 1, 1});
  EXPECT_NEAR(layers.points.position[0].y(), 0.05, 1e-12);
  EXPECT_GT(layers.least_height(), 0);
}

// The search radius covers the displacements of all points. These two points are farther apart.
TEST(SelfContacts, FindPairsThatAMovingFrameBroughtNear) {
  Layers layers(0.03);
  layers.make(Vec4::Zero(), Vec4::Zero());
  layers.shorten(Vec4(0, 0.05, 0, 0), {0, 0, 0, 1, 1, 1});
  layers.shorten(Vec4::Zero(), MoveFractions(6, 1));
  EXPECT_GT(layers.least_height(), 0);
}

}  // namespace
}  // namespace offstage::sim
