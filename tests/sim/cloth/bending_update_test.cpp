/// After a tear or a clamp, the bending of a cloth is computed again only around it. The result has the same
/// bits as for a cloth that is computed as a whole.

#include <algorithm>

#include <gtest/gtest.h>

#include "sim/cloth/bending.h"
#include "tests/random.h"

namespace offstage::sim {
namespace {

constexpr uint32_t kCells = 12;

uint32_t vertex_at(uint32_t x, uint32_t z) {
  return z * (kCells + 1) + x;
}

/// A curved sheet, whose diagonals alternate.
struct Sheet {
  Sheet() {
    for (uint32_t z = 0; z <= kCells; ++z)
      for (uint32_t x = 0; x <= kCells; ++x) rest.push_back(Vec3(0.1 * x, 0.002 * x * x, 0.1 * z));
    for (uint32_t z = 0; z < kCells; ++z)
      for (uint32_t x = 0; x < kCells; ++x) {
        const uint32_t a = vertex_at(x, z), b = vertex_at(x + 1, z), c = vertex_at(x, z + 1),
                       d = vertex_at(x + 1, z + 1);
        if ((x + z) % 2 == 0) {
          triangles.push_back({a, c, d});
          triangles.push_back({a, d, b});
        } else {
          triangles.push_back({a, c, b});
          triangles.push_back({b, c, d});
        }
      }
    masses.assign(rest.size(), 0.01);
  }
  /// Tears the sheet at a vertex: the triangles beyond its x coordinate get a new point.
  void part(uint32_t vertex) {
    const auto own = static_cast<uint32_t>(rest.size());
    const Real x = rest[vertex].x();
    const auto centre = [&](const Triangle& t) { return (rest[t[0]] + rest[t[1]] + rest[t[2]]).x() / 3; };
    for (Triangle& t : triangles)
      if (centre(t) > x) std::replace(t.begin(), t.end(), vertex, own);
    rest.push_back(rest[vertex]);
    masses[vertex] /= 2;
    masses.push_back(masses[vertex]);
  }
  void assign_to(ClothBending& bending) const { bending.assign(rest, triangles, masses, 1e-3, 0.01, 1); }

  std::vector<Vec3> rest;
  std::vector<Triangle> triangles;
  std::vector<Real> masses;
};

void expect_same(const ClothBending& updated, const ClothBending& whole, std::size_t points) {
  const Scatter random{3};
  std::vector<Vec4> x;
  for (std::size_t i = 0; i < points; ++i)
    x.push_back(padded(Vec3(random.uniform(i, 0), random.uniform(i, 1), random.uniform(i, 2))));
  std::vector<Vec4> a(points, Vec4::Zero()), b = a;
  updated.add_forces(x, 1, a);
  whole.add_forces(x, 1, b);
  for (std::size_t i = 0; i < points; ++i) {
    ASSERT_EQ(a[i], b[i]) << "force on point " << i;
    ASSERT_EQ(updated.diagonal(static_cast<uint32_t>(i)), whole.diagonal(static_cast<uint32_t>(i)));
  }
  EXPECT_EQ(updated.fastest(), whole.fastest());
}

TEST(BendingUpdate, TearsGiveTheBendingOfTheTornClothToTheLastBit) {
  Sheet sheet;
  ClothBending updated;
  sheet.assign_to(updated);
  for (uint32_t z : {0u, 1u, 2u, 12u, 11u, 7u}) {
    sheet.part(vertex_at(6, z));
    sheet.assign_to(updated);
    ClothBending whole;
    sheet.assign_to(whole);
    expect_same(updated, whole, sheet.rest.size());
  }
}

TEST(BendingUpdate, ClampsOutlastATearAndAreReleased) {
  Sheet sheet;
  ClothBending updated;
  sheet.assign_to(updated);
  std::vector<uint32_t> clamp(sheet.rest.size(), 0);
  for (uint32_t z = 0; z <= kCells; ++z) clamp[vertex_at(0, z)] = clamp[vertex_at(1, z)] = 1;
  updated.set_clamps(clamp);
  sheet.part(vertex_at(4, 0));
  clamp.push_back(0);
  sheet.assign_to(updated);
  updated.set_clamps(clamp);
  ClothBending whole;
  sheet.assign_to(whole);
  const Real free = whole.fastest();
  whole.set_clamps(clamp);
  expect_same(updated, whole, sheet.rest.size());
  std::ranges::fill(clamp, 0);
  updated.set_clamps(clamp);
  EXPECT_EQ(updated.fastest(), free);
}

}  // namespace
}  // namespace offstage::sim
