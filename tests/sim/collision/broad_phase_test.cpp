#include "sim/collision/broad_phase.h"

#include <cmath>
#include <limits>
#include <map>

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>
#include <rapidcheck.h>

#include "tests/random.h"

namespace offstage::sim {
namespace {

constexpr Real kInfinity = std::numeric_limits<Real>::infinity();
constexpr std::array kKinds = {GridKind::uniform, GridKind::multilevel};

Aabb cube(const Vec3& centre, Real side) {
  return {centre - Vec3::Constant(side / 2), centre + Vec3::Constant(side / 2)};
}

/// The boxes by object, and the pairs that a broad phase is expected to report, by comparing all boxes.
struct Model {
  struct Item {
    Aabb box;
    bool is_static;
  };
  std::map<uint32_t, Item> items;

  std::vector<IndexPair> pairs() const {
    std::vector<IndexPair> pairs;
    for (auto i = items.begin(); i != items.end(); ++i)
      for (auto k = std::next(i); k != items.end(); ++k)
        if (!(i->second.is_static && k->second.is_static) && i->second.box.intersects(k->second.box))
          pairs.push_back({i->first, k->first});
    return pairs;
  }
};

/// A broad phase and its reference model; every change is made to both.
struct Both {
  explicit Both(GridKind kind) : grid(kind) {}
  void insert(uint32_t i, const Aabb& box, bool is_static = false) {
    grid.insert(i, box, is_static);
    model.items[i] = {box, is_static};
  }
  void move(uint32_t i, const Aabb& box) {
    grid.move(i, box);
    model.items[i].box = box;
  }
  void remove(uint32_t i) {
    grid.remove(i);
    model.items.erase(i);
  }
  std::vector<IndexPair> found() {
    const auto pairs = grid.pairs();
    return {pairs.begin(), pairs.end()};
  }
  BroadPhase grid;
  Model model;
};

/// Sizes from 1 mm to 100 m, distributed evenly over the logarithm. Most boxes lie near the origin.
Aabb scattered_box(const Scatter& random, uint64_t i) {
  const Real size = std::pow(10, 5 * random.uniform(i, 0) - 3);
  Vec3 centre, half;
  for (uint32_t k = 0; k < 3; ++k) {
    centre[k] = std::pow(10, 4 * random.uniform(i, 1 + k) - 2) * (random.uniform(i, 4 + k) < 0.5 ? -1 : 1);
    half[k] = size * random.uniform(i, 7 + k) / 2;
  }
  return {centre - half, centre + half};
}

// Objects are added, removed, at rest or moving, and the fraction of moving ones changes. All paths of the
// grid are taken: resting objects settle, become active again, and levels are rebuilt.
TEST(BroadPhase, FindsExactlyTheOverlappingBoxesAfterAnyChanges) {
  for (const GridKind kind : kKinds) {
    const Scatter random{5};
    Both both(kind);
    std::size_t settlings = 0, found = 0;
    for (uint64_t step = 0; step < 120; ++step) {
      const Real fraction = step < 40 ? 1 : step < 80 ? 0.02 : 0.3;
      for (uint32_t i = 0; i < 400; ++i) {
        const uint64_t event = 1000 * step + i;
        const bool present = both.grid.contains(i);
        if (!present && random.uniform(event, 20) < 0.2)
          both.insert(i, scattered_box(random, event), random.uniform(event, 21) < 0.3);
        else if (present && random.uniform(event, 22) < 0.01)
          both.remove(i);
        else if (present && !both.model.items[i].is_static && random.uniform(event, 23) < fraction)
          both.move(i, both.model.items[i].box.translated(0.1 * Vec3(random.uniform(event, 24), 0, -0.5)));
        else if (present && random.uniform(event, 25) < 0.002)
          both.move(i, scattered_box(random, event));
      }
      ASSERT_EQ(both.found(), both.model.pairs()) << "step " << step;
      settlings += both.grid.work().settled > 0;
      found += both.model.pairs().size();
    }
    EXPECT_GT(settlings, 5u);
    EXPECT_GT(found, 10000u);
  }
}

// Corners lie on the lattice of the cells, so boxes touch, coincide, are points, end on cell borders, or
// extend to infinity.
TEST(BroadPhase, AnySequenceOfChangesOnALatticeGivesThePairsOfTheModel) {
  const auto coordinate = rc::gen::weightedElement<Real>({{4, 0},
                                                          {4, 1},
                                                          {4, -1},
                                                          {4, 2},
                                                          {4, -2},
                                                          {2, 8},
                                                          {2, -16},
                                                          {1, 1e5},
                                                          {1, -1e5},
                                                          {1, kInfinity},
                                                          {1, -kInfinity}});
  const auto corner = [&] { return Vec3(*coordinate, *coordinate, *coordinate); };
  const auto any_box = [&] {
    const Vec3 a = corner(), b = *rc::gen::element(0, 1) ? a : corner();
    return Aabb(a.cwiseMin(b), a.cwiseMax(b));
  };
  EXPECT_TRUE(rc::check([&] {
    Both both(*rc::gen::elementOf(kKinds));
    const int changes = *rc::gen::inRange(1, 80);
    for (int n = 0; n < changes; ++n) {
      const auto i = *rc::gen::inRange<uint32_t>(0, 24);
      if (!both.grid.contains(i))
        both.insert(i, any_box(), *rc::gen::element(false, true));
      else if (*rc::gen::inRange(0, 4) == 0)
        both.remove(i);
      else
        both.move(i, any_box());
      if (*rc::gen::inRange(0, 3) == 0) RC_ASSERT(both.found() == both.model.pairs());
    }
    RC_ASSERT(both.found() == both.model.pairs());
  }));
}

TEST(BroadPhase, TouchingCountsAndTheSmallestGapSeparates) {
  for (const GridKind kind : kKinds)
    for (const Real x : {0.0, 1.0, -3.7, 1e5}) {
      Both both(kind);
      both.insert(0, {Vec3(x - 1, 0, 0), Vec3(x, 1, 1)});
      both.insert(1, {Vec3(x, 1, 1), Vec3(x + 1, 2, 2)});
      both.insert(2, {Vec3(std::nextafter(x, kInfinity), 0, 0), Vec3(x + 1, 1, 1)});
      const std::vector<IndexPair> expected = {{0, 1}, {1, 2}};
      EXPECT_EQ(both.found(), expected) << x;
    }
}

TEST(BroadPhase, PlanesPointsAndAnythingFarOrHuge) {
  for (const GridKind kind : kKinds) {
    Both both(kind);
    both.insert(0, {Vec3(-kInfinity, -kInfinity, -kInfinity), Vec3(kInfinity, 0, kInfinity)}, true);
    both.insert(1, {Vec3(-50, -0.5, -50), Vec3(50, 0.001, 50)}, true);
    for (uint32_t i = 0; i < 200; ++i) both.insert(2 + i, cube(Vec3(0.01 * i, 0.001 * i, 0), 0.01));
    both.insert(300, cube(Vec3::Zero(), 0));
    both.insert(301, cube(Vec3::Zero(), 0));
    both.insert(302, cube(Vec3(1e5, -1e5, 1e5), 1e-3));
    both.insert(303, cube(Vec3(1e5, -1e5, 1e5), 0));
    both.insert(304, cube(Vec3::Constant(1e300), 1e299));
    both.insert(305, cube(Vec3::Constant(1e300), 1e250));
    both.insert(306, cube(Vec3::Constant(1e-300), 1e-310));
    both.insert(307, {Vec3::Constant(-kInfinity), Vec3::Constant(kInfinity)});
    for (int step = 0; step < 6; ++step) {
      ASSERT_EQ(both.found(), both.model.pairs()) << "step " << step;
      if (step >= 3)
        for (uint32_t i = 0; i < 100; ++i) both.move(2 + i, cube(Vec3(0.01 * i, -0.002 * step, 0), 0.01));
    }
  }
}

// A grid level appears without any object at rest on it, disappears, and appears elsewhere.
TEST(BroadPhase, LevelsComeAndGoWithTheirObjects) {
  Both both(GridKind::multilevel);
  const Scatter random{6};
  for (uint32_t i = 0; i < 500; ++i)
    both.insert(i, cube(10 * Vec3(random.uniform(i, 0), random.uniform(i, 1), random.uniform(i, 2)), 0.05),
                i % 2 == 0);
  for (int step = 0; step < 3; ++step) both.grid.pairs();
  ASSERT_EQ(both.grid.work().entered, 0u) << "all have settled";
  for (const Real size : {3.0, 0.4, 1e-4, 40.0}) {
    both.insert(1000, cube(Vec3::Constant(size), size));
    both.insert(1001, cube(Vec3::Constant(5), size));
    ASSERT_EQ(both.found(), both.model.pairs()) << size;
    ASSERT_EQ(both.grid.work().entered, 2u);
    both.remove(1000);
    ASSERT_EQ(both.found(), both.model.pairs()) << size;
    both.remove(1001);
  }
  both.grid.pairs();
  EXPECT_EQ(both.grid.work().copies, 0u);
}

// A hundred moving boxes cause the same comparisons and visit the same cells whether or not there are ten
// thousand static objects out of reach. Without moving objects there is no work at all.
TEST(BroadPhase, StaticObjectsCostNothingWhenNothingTouchesThem) {
  for (const GridKind kind : kKinds) {
    const Scatter random{7};
    const auto work = [&](uint32_t far_statics) {
      BroadPhase grid(kind);
      const auto place = [&](uint32_t i, Real y) {
        return cube(Vec3(4 * random.uniform(i, 0), y, 4 * random.uniform(i, 1)), 0.25);
      };
      for (uint32_t i = 0; i < 100; ++i) grid.insert(i, place(i, 0));
      for (uint32_t i = 100; i < 200; ++i) grid.insert(i, place(i, 0), true);
      for (uint32_t i = 200; i < 200 + far_statics; ++i)
        grid.insert(i, cube(Vec3(1000 + i % 100, i / 100, 0), 0.25), true);
      for (int step = 1; step < 5; ++step) {
        for (uint32_t i = 0; i < 100; ++i) grid.move(i, place(i, 0.001 * step));
        EXPECT_FALSE(grid.pairs().empty());
      }
      return grid.work();
    };
    const BroadPhase::Work few = work(0), many = work(10000);
    EXPECT_EQ(many.entered, 100u);
    EXPECT_EQ(many.settled, 0u);
    EXPECT_EQ(many.copies, few.copies);
    // Distant cells may share a hash bucket with near ones.
    EXPECT_LE(many.compared, few.compared + few.compared / 4);
  }
}

TEST(BroadPhase, StaticPairsAreNeverReportedAndObjectsAtRestStillAre) {
  for (const GridKind kind : kKinds) {
    Both both(kind);
    for (uint32_t i = 0; i < 30; ++i) both.insert(i, cube(Vec3(0.5 * i, 0, 0), 1), i % 3 != 0);
    for (int step = 0; step < 5; ++step) {
      const auto pairs = both.found();
      EXPECT_EQ(pairs, both.model.pairs());
      EXPECT_FALSE(pairs.empty());
      for (const IndexPair& p : pairs) EXPECT_TRUE(p.a % 3 == 0 || p.b % 3 == 0);
    }
    EXPECT_EQ(both.grid.work().compared, 0u);
  }
}

TEST(BroadPhase, SameResultForAnyNumberOfThreadsAndAnyPast) {
  constexpr uint32_t kCount = 20000;
  const Scatter random{8};
  const auto box = [&](uint32_t i, int step) {
    const Vec3 p(random.uniform(i, 0), random.uniform(i, 1), random.uniform(i, 2));
    return cube(12 * p + Vec3::Constant(0.03 * step * random.uniform(i, 3)),
                0.01 * std::pow(100, random.uniform(i, 4)));
  };
  std::vector<IndexPair> expected;
  {
    BroadPhase fresh;
    for (uint32_t i = kCount; i-- > 0;) fresh.insert(i, box(i, 4));
    const auto pairs = fresh.pairs();
    expected.assign(pairs.begin(), pairs.end());
  }
  EXPECT_GT(expected.size(), kCount);
  EXPECT_EQ(std::adjacent_find(expected.begin(), expected.end(), std::greater_equal<>()), expected.end());
  for (const std::size_t threads : {1, 2, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    BroadPhase grid;
    for (uint32_t i = 0; i < kCount; ++i) grid.insert(i, box(i, 0));
    for (int step = 1; step <= 4; ++step) {
      for (uint32_t i = 0; i < kCount; ++i)
        if (i % 4 < static_cast<uint32_t>(step) || step == 4) grid.move(i, box(i, step));
      grid.pairs();
    }
    const auto pairs = grid.pairs();
    EXPECT_TRUE(std::equal(pairs.begin(), pairs.end(), expected.begin(), expected.end())) << threads;
  }
}

// Long boxes share many cells, and few buckets make different cells collide. Each pair is still reported
// once, from the one cell that is responsible for it.
TEST(CellTable, LongBoxesAreFoundOnceAlthoughBucketsAreShared) {
  const CellSizes sizes{.kind = GridKind::uniform, .uniform_width = 1};
  const Scatter random{10};
  std::size_t met = 0;
  for (uint64_t i = 0; i < 3000; ++i) {
    const int axis = static_cast<int>(i % 3);
    Vec3 low, size = Vec3::Constant(0.5);
    for (uint32_t k = 0; k < 3; ++k) low[k] = 1000 * random.uniform(i, k) - 500;
    size[axis] = 55;
    const Aabb beam(low, low + size);
    const Aabb block = cube(low + random.uniform(i, 3) * size, 1 + random.uniform(i, 4));
    const std::array ranges = {sizes.range(0, beam, 0), sizes.range(1, block, 0)};
    CellTable table;
    table.build(0, ranges, 0, nullptr);
    CandidatePairs found;
    table.find_pairs(0, table.bucket_count(), found);
    ASSERT_TRUE(beam.intersects(block));
    ASSERT_EQ(found.meeting.size() + found.doubtful.size(), 1u);
    met += found.meeting.size();
  }
  EXPECT_EQ(met, 3000u) << "in doubt only where bounds are equal in single precision";
}

// H6: kmin <= d/L < 2 kmin; widths double from level to level; each object covers few cells; cells of all
// levels nest.
TEST(CellSizes, LevelsFollowTheDiameterAndCellsNest) {
  const CellSizes sizes;
  const Scatter random{9};
  for (uint64_t i = 0; i < 2000; ++i) {
    const Real d = std::pow(10, 8 * random.uniform(i, 0) - 5);
    const Aabb box =
        cube(100 * d * Vec3(random.uniform(i, 1) - 0.5, random.uniform(i, 2) - 0.5, random.uniform(i, 3)), d);
    const int32_t level = sizes.level(box);
    const Real cells = box.sizes().maxCoeff() / sizes.width(level);
    ASSERT_GE(cells, CellSizes::kMinInCell);
    ASSERT_LT(cells, 2 * CellSizes::kMinInCell);
    ASSERT_EQ(sizes.width(level + 1), 2 * sizes.width(level));
    const CellRange own = sizes.range(0, box, level);
    for (std::size_t k = 0; k < 3; ++k) ASSERT_LE(own.high[k] - own.low[k], 1);
    for (int32_t coarser = level; coarser < level + 8; ++coarser) {
      ASSERT_EQ(own.at(coarser).low, sizes.range(0, box, coarser).low);
      ASSERT_EQ(own.at(coarser).high, sizes.range(0, box, coarser).high);
    }
  }
}

TEST(CellSizes, UniformCellsAreTwoMeanDiametersWide) {
  CellSizes sizes{.kind = GridKind::uniform, .uniform_width = 2};
  EXPECT_EQ(sizes.level(cube(Vec3::Zero(), 1)), 0);
  EXPECT_EQ(sizes.level({Vec3::Zero(), Vec3(1000, 0.1, 0.1)}), CellSizes::kNone) << "500 cells";
  // Objects a quarter as large, on a grid scaled with them: the number of comparisons stays in proportion,
  // because the cells shrink with the objects.
  const auto compared = [](Real size) {
    BroadPhase grid(GridKind::uniform);
    for (uint32_t i = 0; i < 4096; ++i)
      grid.insert(i, cube(size * Vec3(i % 16, i / 16 % 16, i / 256), 0.9 * size));
    grid.pairs();
    return grid.work().compared;
  };
  EXPECT_EQ(compared(1), compared(0.25));
  EXPECT_LT(compared(1), 4096u * 40);
}

}  // namespace
}  // namespace offstage::sim
