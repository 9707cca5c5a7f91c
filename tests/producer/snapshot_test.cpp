#include "producer/build/snapshot.h"

#include <gtest/gtest.h>

#include "render/error.h"

namespace offstage::producer {
namespace {

Snapshot sample() {
  Snapshot s;
  s.frame = 42;
  s.time = 1.0 / 3;
  s.bodies = {{{1, 2, 3}, Eigen::Quaternionf(0.5f, 0.5f, -0.5f, 0.5f)},
              {{-1, 0, 1e-20f}, Eigen::Quaternionf::Identity()}};
  s.rods = {{{0, 1, 0}, {2, 1, 0}}};
  s.point_sets.resize(2);
  for (uint64_t i = 0; i < 100; ++i) {
    const auto x = static_cast<float>(i);
    s.point_sets[1].points.push_back({{x, -x, 0}, {0, x, 1}, 0.01f * x, {0.1f, 0.2f, 0.3f, 1}, i * i});
    s.point_sets[1].points.back().angle = 0.1f * x;
    s.point_sets[1].ages.push_back(x / 30);
    s.point_sets[1].spins.push_back(x - 50);
  }
  s.cloths.resize(2);
  s.cloths[0] = {.points = {{1, 2, 3}, {4, 5, 6}, {7, 8, 9}},
                 .velocities = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}},
                 .version = 3,
                 .triangles = {0, 1, 2},
                 .sources = {0, 1, 1}};
  s.overlays.resize(3);
  s.overlays[1].lines = {{{1, 2, 3}, {4, 5, 6}, {0.1f, 0.2f, 0.3f, 0.4f}, 2, 0},
                         {{0, 0, 0}, {0, 0, 0}, {1, 1, 1, 1}}};
  s.overlays[1].ids = {7, 8};
  s.state_hash = {123, 456};
  return s;
}

TEST(Snapshot, IsReadBackUnchanged) {
  const auto bytes = serialize(sample());
  const Snapshot back = deserialize(bytes, "memory");
  EXPECT_EQ(back.frame, 42);
  EXPECT_EQ(back.time, 1.0 / 3);
  EXPECT_EQ(back.state_hash, sample().state_hash);
  ASSERT_EQ(back.point_sets.size(), 2u);
  EXPECT_EQ(back.point_sets[1].points[7].id, 49u);
  EXPECT_EQ(back.point_sets[1].points[7].color, sample().point_sets[1].points[7].color);
  EXPECT_EQ(back.point_sets[1].points[7].angle, 0.7f);
  EXPECT_EQ(back.point_sets[1].spins, sample().point_sets[1].spins);
  ASSERT_EQ(back.cloths.size(), 2u);
  EXPECT_EQ(back.cloths[0].points, sample().cloths[0].points);
  EXPECT_EQ(back.cloths[0].sources, sample().cloths[0].sources);
  ASSERT_EQ(back.overlays.size(), 3u);
  EXPECT_EQ(back.overlays[1].lines[0].b, Eigen::Vector3f(4, 5, 6));
  EXPECT_EQ(back.overlays[1].ids[1], 8u);
  EXPECT_EQ(serialize(back), bytes) << "every field is stored";
}

TEST(Snapshot, AnyDamagedByteIsNoticed) {
  const auto good = serialize(sample());
  for (std::size_t i = 0; i < good.size(); ++i) {
    if (i >= 12 && i < 16) continue;  // the reserved word of the header is not checked
    auto bytes = good;
    bytes[i] = static_cast<uint8_t>(bytes[i] ^ 0x55);
    EXPECT_THROW(deserialize(bytes, "memory"), render::FileError) << "byte " << i;
  }
}

TEST(Snapshot, AnyTruncationIsNoticed) {
  const auto good = serialize(sample());
  for (std::size_t n = 0; n < good.size(); ++n)
    EXPECT_THROW(deserialize(std::span(good).first(n), "memory"), render::FileError) << n << " bytes";
}

}  // namespace
}  // namespace offstage::producer
