#include "sim/collision/narrow_phase.h"

#include <gtest/gtest.h>

#include "meshes.h"
#include "random.h"
#include "tests/mesh_pair.h"

namespace offstage::sim {
namespace {

/// A shape with the collision data that it needs.
struct Piece {
  explicit Piece(const Shape& s, bool needs_volume = true)
      : shape(s), collision({&shape, nullptr}, needs_volume) {}
  Piece(const TriangleMesh& m, bool needs_volume)
      : shape(MeshShape{}),
        mesh(std::make_unique<CollisionMesh>(m)),
        collision({&shape, mesh.get()}, needs_volume) {}
  Piece(const Piece&) = delete;

  Shape shape;
  std::unique_ptr<CollisionMesh> mesh;
  CollisionShape collision;
};

/// Returns an L of square cross-section: a bar of 2 x 0.5 x 0.5 and a post of 0.5 x 1.5 x 0.5 on its left
/// end.
TriangleMesh l_mesh() {
  TriangleMesh mesh;
  const std::array<Eigen::Vector2d, 6> outline = {
      {{-1, -0.5}, {1, -0.5}, {1, 0}, {-0.5, 0}, {-0.5, 1.5}, {-1, 1.5}}};
  for (const Real z : {-0.25, 0.25})
    for (const auto& p : outline) mesh.vertices.emplace_back(p.x(), p.y(), z);
  for (const Triangle& t : {Triangle{0, 1, 2}, Triangle{0, 2, 3}, Triangle{0, 3, 5}, Triangle{3, 4, 5}}) {
    mesh.triangles.push_back({t[0] + 6, t[1] + 6, t[2] + 6});
    mesh.triangles.push_back({t[2], t[1], t[0]});
  }
  for (uint32_t i = 0; i < 6; ++i) {
    const uint32_t j = (i + 1) % 6;
    mesh.triangles.push_back({i, j, j + 6});
    mesh.triangles.push_back({i, j + 6, i + 6});
  }
  return mesh;
}

Pose pose(const Vec3& position, Real angle = 0, const Vec3& axis = Vec3::UnitZ()) {
  return {position, Quat(Eigen::AngleAxisd(angle, axis.normalized()))};
}

Pose random_pose(const Scatter& random, uint64_t i, Real spread) {
  const auto u = [&](uint64_t k) { return 2 * random.uniform(i, k) - 1; };
  return {spread * Vec3(u(0), u(1), u(2)), Quat(u(3), u(4), u(5), u(6)).normalized()};
}

Pose between(const Pose& a, const Pose& b) {
  return {a.point_to_body(b.position), a.orientation.conjugate() * b.orientation};
}

TEST(NarrowPhase, TouchingIsExactForEveryPairOfPrimitives) {
  const Piece plane(Plane{}), box(Box{Vec3::Ones()}), ball(Sphere{0.5}), capsule(Capsule{0.2, 1}),
      cone(Cone{0.5, 1}), cylinder(Cylinder{0.5, 1});
  const auto both = [](const Piece& s, const Pose& p, const Piece& t, const Pose& q) {
    const bool forward = touching(s.collision, t.collision, between(p, q));
    if (!t.collision.is_plane()) {
      EXPECT_EQ(forward, touching(t.collision, s.collision, between(q, p)));
    }
    return forward;
  };
  const Pose tilt = pose(Vec3::Zero(), M_PI / 4);
  for (const Real e : {-1e-9, 1e-9}) {
    EXPECT_EQ(both(box, pose({0, std::sqrt(0.5) + e, 0}, M_PI / 4), plane, {}), e < 0);
    EXPECT_EQ(both(cone, pose({0, 0.5 + e, 0}), plane, {}), e < 0);
    EXPECT_EQ(both(ball, {}, box, pose({1 + e, 0, 0})), e < 0);
    EXPECT_EQ(both(ball, {}, box, pose(Vec3::Constant(0.5) + (0.5 + e) * Vec3::Ones().normalized())), e < 0);
    EXPECT_EQ(both(capsule, {}, ball, pose({0.7 + e, 0.3, 0})), e < 0);
    EXPECT_EQ(both(capsule, {}, capsule, pose({0.4 + e, 0.8, 0})), e < 0);
    EXPECT_EQ(both(cone, {}, ball, pose({0, 1 + e, 0})), e < 0);
    EXPECT_EQ(both(cylinder, {}, cylinder, pose({0.6 + e, 1 + e, 0})), e < 0);
    EXPECT_EQ(both(cylinder, {}, box, pose({1 + e, 0, 0})), e < 0);
    // The lower edge of one box crosses the upper edge of the other at a right angle.
    EXPECT_EQ(both(box, tilt, box, pose({0, 2 * std::sqrt(0.5) + e, 0}, M_PI / 4, Vec3::UnitX())), e < 0);
  }
}

TEST(NarrowPhase, NonConvexSolidsHaveTheDistanceOfTheirSurfaces) {
  const Piece l(l_mesh(), true);
  ASSERT_EQ(l.mesh->decomposition().method, ConvexDecomposition::Method::exact);
  const Scatter random{5};
  const MeshTree<Aabb> surface{l.mesh->mesh, l.mesh->tree};
  int apart = 0;
  for (uint64_t i = 0; i < 300; ++i) {
    const Pose a_from_b = random_pose(random, i, 2);
    PairCache cache, clipped;
    const auto s = separation(l.collision, l.collision, a_from_b, cache);
    const auto v = separation(l.collision, l.collision, a_from_b, clipped, DistanceMethod::vclip);
    const auto exact = closest_triangles(surface, surface, a_from_b);
    ASSERT_TRUE(s && v && exact);
    EXPECT_NEAR(s->distance, v->distance, 1e-9);
    EXPECT_EQ(touching(l.collision, l.collision, a_from_b), s->distance <= 0);
    const Real distance = std::sqrt(exact->points.squared_distance);
    if (s->distance > 0) {
      EXPECT_NEAR(s->distance, distance, 1e-9);
      EXPECT_NEAR((s->on_a - s->on_b).norm(), distance, 1e-9);
      ++apart;
    } else {
      EXPECT_EQ(distance, 0) << "two equal solids cannot contain each other";
    }
  }
  EXPECT_GT(apart, 100);
}

TEST(NarrowPhase, TheGapOfAnLHoldsABox) {
  const Piece l(l_mesh(), true), box(Box{Vec3(0.5, 0.5, 0.5)});
  PairCache cache;
  // In the angle of the L: first touching neither arm, then resting on both.
  EXPECT_FALSE(touching(l.collision, box.collision, pose({0.1, 0.6, 0})));
  const auto s = separation(l.collision, box.collision, pose({0.1, 0.6, 0}), cache);
  ASSERT_TRUE(s);
  EXPECT_NEAR(s->distance, 0.35, 1e-9);
  std::vector<Manifold> manifolds;
  find_manifolds(l.collision, box.collision, pose({-0.25, 0.25, 0}), 1e-3, cache, DistanceMethod::gjk,
                 manifolds);
  Vec3 pushes = Vec3::Zero();
  for (const Manifold& m : manifolds) {
    EXPECT_GE(m.count, 2u);
    for (uint32_t k = 0; k < m.count; ++k) EXPECT_NEAR(m.points[k].separation, 0, 1e-9);
    pushes = pushes.cwiseMax(-m.normal);
  }
  EXPECT_NEAR(pushes.x(), 1, 1e-6) << "the post pushes it to the right";
  EXPECT_NEAR(pushes.y(), 1, 1e-6) << "the bar pushes it up";
}

TEST(NarrowPhase, ABoxOnATiltedPlaneRestsOnFourPoints) {
  const Piece box(Box{Vec3(1, 2, 3)}), plane(Plane{});
  const Pose slope = pose({0.3, -0.2, 0.1}, 0.6, {1, 2, 3});
  PairCache cache;
  for (const Real height : {1.004, 0.999, 1.02}) {
    // The box lies flat on the slope and is rotated about the slope's normal.
    const Pose placed = {slope.point_to_world({0.5, height, -0.4}),
                         slope.orientation * Quat(Eigen::AngleAxisd(0.4, Vec3::UnitY()))};
    const auto s = separation(box.collision, plane.collision, between(placed, slope), cache);
    ASSERT_TRUE(s);
    EXPECT_NEAR(s->distance, height - 1, 1e-12);
    EXPECT_NEAR((placed.vector_to_world(s->normal) - slope.vector_to_world(Vec3::UnitY())).norm(), 0, 1e-12);
    std::vector<Manifold> manifolds;
    find_manifolds(box.collision, plane.collision, between(placed, slope), 0.01, cache, DistanceMethod::gjk,
                   manifolds);
    if (height > 1.01) {
      EXPECT_TRUE(manifolds.empty()) << "farther than the margin";
      continue;
    }
    ASSERT_EQ(manifolds.size(), 1u);
    ASSERT_EQ(manifolds[0].count, 4u);
    EXPECT_NEAR((manifolds[0].normal - s->normal).norm(), 0, 1e-12);
    for (const ContactPoint& p : manifolds[0].points) {
      EXPECT_NEAR(p.separation, height - 1, 1e-12);
      EXPECT_NEAR(p.on_a.cwiseAbs().x(), 0.5, 1e-12) << "a corner of the box, in its own frame";
      EXPECT_NEAR(slope.point_to_body(placed.point_to_world(p.on_b)).y(), 0, 1e-12);
    }
  }
}

TEST(NarrowPhase, ABoxRestsExactlyOnAGroundTwoHundredTimesAsLarge) {
  const Piece ground(Box{{200, 10, 200}}), box(Box{Vec3::Ones()}), ball(Sphere{0.5});
  PairCache cache;
  const auto contact = [&](const Piece& a, const Pose& p, const Piece& b, const Pose& q) {
    std::vector<Manifold> found;
    find_manifolds(a.collision, b.collision, between(p, q), 1e-3, cache, DistanceMethod::gjk, found);
    EXPECT_EQ(found.size(), 1u);
    return found.empty() ? Manifold{} : found[0];
  };
  const Scatter random{2};
  for (uint64_t k = 0; k < 100; ++k) {
    const Pose on = pose({190 * random.uniform(k, 0) - 95, 5.5, 190 * random.uniform(k, 1) - 95},
                         k % 4 == 0 ? 0 : 6 * random.uniform(k, 2), Vec3::UnitY());
    // In every second case the whole scene is rotated and moved.
    const Pose world = k % 2 == 0 ? Pose{} : random_pose(random, k, 1);
    const Pose on_world{world.point_to_world(on.position), world.orientation * on.orientation};
    for (const Manifold& m : {contact(box, on_world, ground, world), contact(ground, world, box, on_world)}) {
      ASSERT_EQ(m.count, 4u);
      for (const ContactPoint& p : m.points) EXPECT_LT(std::abs(p.separation), 1e-12);
    }
    for (const Manifold& m :
         {contact(ball, on_world, ground, world), contact(ground, world, ball, on_world)}) {
      ASSERT_EQ(m.count, 1u);
      EXPECT_LT(std::abs(m.points[0].separation), 1e-12);
    }
  }
}

/// A pair of single convex shapes skips the bounding trees; the same shapes as parts of a mesh do not.
TEST(NarrowPhase, ASingleShapeHasTheManifoldThatItHasAsPartOfAMesh) {
  const Piece box(Box{{1.5, 0.5, 0.5}}), l(l_mesh(), true);
  PairCache cache;
  std::vector<Manifold> alone, among;
  find_manifolds(box.collision, box.collision, pose({0.3, -0.5, 0.1}), 1e-3, cache, DistanceMethod::gjk,
                 alone);
  find_manifolds(box.collision, l.collision, pose({0.3, -0.25, 0.1}), 1e-3, cache, DistanceMethod::gjk,
                 among);
  ASSERT_EQ(alone.size(), 1u);
  ASSERT_FALSE(among.empty());
  for (const Manifold& m : {alone[0], among[0]}) {
    EXPECT_EQ(m.count, 4u);
    EXPECT_NEAR(m.normal.y(), 1, 1e-12);
    EXPECT_NEAR(m.points[0].separation, 0, 1e-12);
  }
  alone.clear();
  find_manifolds(box.collision, box.collision, pose({0.3, -0.51, 0.1}), 1e-3, cache, DistanceMethod::gjk,
                 alone);
  EXPECT_TRUE(alone.empty()) << "farther than the margin";
}

TEST(NarrowPhase, ABodyInsideASolidIsInPenetration) {
  const TriangleMesh torus = torus_mesh(1, 0.4, 48, 24);
  const Piece parts(torus, true), ball(Sphere{0.1});
  // With an approximate decomposition, a body that does not need a volume uses its triangles.
  ConvexDecomposition rough;
  rough.method = ConvexDecomposition::Method::approximate;
  const CollisionMesh hollow_mesh(torus, rough);
  const Shape mesh_shape = MeshShape{};
  const CollisionShape hollow({&mesh_shape, &hollow_mesh}, false);
  ASSERT_TRUE(hollow.is_hollow());
  for (const CollisionShape* solid : {&parts.collision, &hollow}) {
    EXPECT_TRUE(touching(*solid, ball.collision, pose({1, 0, 0})));
    EXPECT_TRUE(touching(ball.collision, *solid, pose({-1, 0, 0})));
    EXPECT_FALSE(touching(*solid, ball.collision, pose({0, 0, 0}))) << "the ball is in the hole";
    const PosePath resting{Pose{}}, inside(pose({1, 0, 0}));
    const auto impact =
        time_of_impact(MovingShape{*solid, resting}, MovingShape{ball.collision, inside}, 1e-6);
    ASSERT_TRUE(impact);
    EXPECT_EQ(impact->fraction, 0);
    EXPECT_LT(impact->separation.distance, 0);
  }
  PairCache cache;
  const auto s = separation(hollow, ball.collision, pose({0.9, 0, 0}), cache);
  ASSERT_TRUE(s);
  EXPECT_NEAR(s->distance, -0.4, 0.01) << "0.3 to the inner side of the tube, plus the radius of the ball";
  EXPECT_NEAR(s->normal.x(), 1, 0.02) << "the solid is pushed outwards, the ball towards the hole";
}

TEST(NarrowPhase, OpenSurfacesAreTwoSided) {
  TriangleMesh sheet;
  sheet.vertices = {{-5, 0, -5}, {5, 0, -5}, {5, 0, 5}, {-5, 0, 5}};
  sheet.triangles = {{0, 2, 1}, {0, 3, 2}};
  const Piece floor(sheet, false), box(Box{Vec3(1, 1, 1)});
  for (const Real side : {1.0, -1.0}) {
    PairCache cache;
    const auto s = separation(box.collision, floor.collision, pose({0.3, -side * 0.7, 0}), cache);
    ASSERT_TRUE(s);
    EXPECT_NEAR(s->distance, 0.2, 1e-9);
    EXPECT_NEAR(s->normal.y(), side, 1e-9);
    std::vector<Manifold> manifolds;
    find_manifolds(box.collision, floor.collision, pose({0.3, -side * 0.5, 0.1}), 1e-3, cache,
                   DistanceMethod::gjk, manifolds);
    ASSERT_FALSE(manifolds.empty());
    for (const Manifold& m : manifolds) EXPECT_NEAR(m.normal.y(), side, 1e-9);
  }
}

/// Returns two squares along x that meet at x = 0, at the height `height`. The second one rises by `rise` per
/// metre.
TriangleMesh folded_sheet(Real rise, Real height) {
  TriangleMesh m;
  for (const Real x : {-1.0, 0.0, 1.0})
    for (const Real z : {-1.0, 1.0}) m.vertices.emplace_back(x, height + std::max(0.0, x * rise), z);
  m.triangles = {{0, 1, 2}, {1, 3, 2}, {2, 3, 4}, {3, 5, 4}};
  return m;
}

std::vector<Manifold> manifolds_on(const TriangleMesh& mesh, const Piece& piece, const Pose& at,
                                   Real margin) {
  const Piece sheet(mesh, false);
  PairCache cache;
  std::vector<Manifold> found;
  find_manifolds(piece.collision, sheet.collision, between(at, {}), margin, cache, DistanceMethod::gjk,
                 found);
  for (Manifold& m : found) m = placed(m, at);
  return found;
}

TEST(NarrowPhase, ATriangleGivesItsNormalAtAnyHeightInItsMesh) {
  const Piece box(Box{Vec3::Constant(0.5)});
  for (const Real height : {-1.0, 0.0, 1.0}) {
    uint32_t points = 0;
    for (const Manifold& m :
         manifolds_on(folded_sheet(0, height), box, pose({-0.5, height + 0.2501, 0}), 1e-3)) {
      EXPECT_EQ(m.source, NormalSource::face_of_b) << height;
      EXPECT_NEAR(m.normal.y(), 1, 1e-15) << height;
      for (uint32_t k = 0; k < m.count; ++k) EXPECT_NEAR(m.points[k].separation, 1e-4, 1e-12) << height;
      points += m.count;
    }
    EXPECT_GE(points, 4u) << height;
  }
}

TEST(NarrowPhase, AnEdgeOfASheetHasOnlyTheNormalsBetweenItsFaces) {
  const Piece box(Box{Vec3::Constant(0.5)}), ball(Sphere{0.25}), drum(Cylinder{0.25, 0.5});
  for (const Piece* piece : {&box, &ball, &drum}) {
    // Short of the edge by less than the margin: the triangles beyond the edge are near, but in the same
    // plane.
    for (const Manifold& m : manifolds_on(folded_sheet(0, 0), *piece, pose({-0.255, 0.25, 0}), 0.02))
      EXPECT_NEAR(m.normal.y(), 1, 1e-15);
    // In a valley, too, the next contact is with the face of the slope, not with the edge.
    const Vec3 slope = Vec3(-0.5, 1, 0).normalized();
    for (const Manifold& m : manifolds_on(folded_sheet(0.5, 0), *piece, pose({-0.255, 0.25, 0}), 0.02))
      EXPECT_GT(std::max(m.normal.y(), m.normal.dot(slope)), 1 - 1e-12);
  }
  // Beyond the border of the sheet the contact is with the border edge.
  const auto beside = manifolds_on(folded_sheet(0, 0), ball, pose({1.2, 0.1, 0.3}), 0.02);
  ASSERT_FALSE(beside.empty());
  for (const Manifold& m : beside) EXPECT_GT(m.normal.x(), 0.8);
}

TEST(NarrowPhase, ABodySinkingIntoASheetStaysOnItsSide) {
  const Piece ball(Sphere{0.1}), box(Box{Vec3::Constant(0.2)}), capsule(Capsule{0.1, 0.2}),
      drum(Cylinder{0.1, 0.2});
  const Piece sheet(folded_sheet(0, 0), false);
  for (const Piece* piece : {&ball, &box, &capsule, &drum})
    for (const Real side : {1.0, -1.0}) {
      PairCache cache;
      for (const Real height : {0.101, 0.05, 0.001, -0.001, -0.05, -0.09}) {
        const Pose at = pose({0.3 * height, side * height, 0.1});
        std::vector<Manifold> found;
        find_manifolds(piece->collision, sheet.collision, between(at, {}), 1e-2, cache, DistanceMethod::gjk,
                       found);
        cache.forget_unused();
        ASSERT_FALSE(found.empty()) << height;
        Real deepest = 1;
        for (const Manifold& m : found) {
          EXPECT_NEAR(m.normal.y(), side, 1e-9) << height;
          for (uint32_t k = 0; k < m.count; ++k) deepest = std::min(deepest, m.points[k].separation);
        }
        if (piece != &capsule) {
          EXPECT_NEAR(deepest, height - 0.1, 1e-9);
        }
      }
    }
}

/// Returns the time of the first contact, as a reference. Tests many times for contact, then bisects the
/// first interval that ends in contact.
std::optional<Real> first_contact(const MovingShape& a, const MovingShape& b, Real tolerance, int looks) {
  const auto near = [&](Real fraction) {
    PairCache none;
    const auto s = separation(a.shape, b.shape, between(a.path.at(fraction), b.path.at(fraction)), none);
    return s && s->distance <= tolerance;
  };
  if (near(0)) return 0;
  for (int k = 1; k <= looks; ++k) {
    Real low = static_cast<Real>(k - 1) / looks, high = static_cast<Real>(k) / looks;
    if (!near(high)) continue;
    for (int i = 0; i < 40; ++i) (near((low + high) / 2) ? high : low) = (low + high) / 2;
    return high;
  }
  return std::nullopt;
}

TEST(TimeOfImpact, OfNonConvexSolidsAgreesWithBisection) {
  const Piece l(l_mesh(), true), hollow(l_mesh(), false), torus(torus_mesh(1, 0.3, 12, 8), false),
      rod(Capsule{0.05, 2});
  const Scatter random{8};
  constexpr Real kTolerance = 1e-6;
  int impacts = 0;
  for (uint64_t i = 0; i < 60; ++i) {
    const Piece& a = i % 3 == 0 ? rod : l;
    const Piece& b = i % 2 == 0 ? torus : l;
    const PosePath way_a(random_pose(random, 4 * i, 3), random_pose(random, 4 * i + 1, 3)),
        way_b(random_pose(random, 4 * i + 2, 1), random_pose(random, 4 * i + 3, 1));
    const MovingShape moving_a{a.collision, way_a}, moving_b{b.collision, way_b};
    const auto impact = time_of_impact(moving_a, moving_b, kTolerance);
    const auto near = first_contact(moving_a, moving_b, kTolerance, 100),
               nearer = first_contact(moving_a, moving_b, kTolerance / 2, 100);
    if (nearer) {
      ASSERT_TRUE(impact) << i;
      EXPECT_LE(impact->fraction, *nearer + 1e-9) << i;
    }
    if (!impact) continue;
    if (near && nearer && *nearer - *near < 1e-3) {
      EXPECT_GE(impact->fraction, *near - 1e-9) << i;
    }
    ++impacts;
    EXPECT_TRUE(impact->converged);
    PairCache none;
    const auto s = separation(a.collision, b.collision,
                              between(way_a.at(impact->fraction), way_b.at(impact->fraction)), none);
    EXPECT_LE(s->distance, kTolerance * (1 + 1e-6)) << i;
    if (impact->fraction > 0) {
      EXPECT_GT(s->distance, kTolerance / 2 - 1e-9) << i;
    }
  }
  EXPECT_GT(impacts, 20);
}

TEST(TimeOfNextImpact, ARodThatTouchesMeetsTheGroundAgainWithItsOtherEnd) {
  TriangleMesh sheet_mesh;
  sheet_mesh.vertices = {{-2, 0, -2}, {2, 0, -2}, {2, 0, 2}, {-2, 0, 2}};
  sheet_mesh.triangles = {{0, 2, 1}, {0, 3, 2}};
  const Piece rod(Box{{1, 0.02, 0.02}}), plane(Plane{}), sheet(sheet_mesh, false), slab(Box{{4, 1, 4}});
  constexpr Real kTilt = 0.2, kTolerance = 1e-5, kSpeed = 0.01;
  // height of the rod's centre when one end touches
  const Real high = 0.5 * std::sin(kTilt) + 0.01 * std::cos(kTilt);
  for (const Piece* ground : {&plane, &sheet, &slab}) {
    const PosePath rest(pose({0, ground == &slab ? -0.5 : 0, 0}));
    const auto next = [&](const Pose& start, const Pose& end) {
      const PosePath way(start, end);
      return time_of_next_impact({rod.collision, way}, {ground->collision, rest}, kTolerance, kSpeed);
    };
    const Pose start = pose({0, high, 0}, kTilt);
    const auto rocks = next(start, pose({0, high, 0}, -2 * kTilt));
    ASSERT_TRUE(rocks);
    const Pose then = PosePath(start, pose({0, high, 0}, -2 * kTilt)).at(rocks->fraction);
    EXPECT_NEAR(then.point_to_world({0.5, -0.01, 0}).y(), 0, 1e-3);
    EXPECT_NEAR(then.vector_to_world(Vec3::UnitX()).y(), -std::sin(kTilt), 1e-3) << "the other end";
    EXPECT_NEAR(rocks->separation.distance, 0, 2 * kTolerance);

    EXPECT_FALSE(next(start, pose({0, high + 0.2, 0}, kTilt / 2))) << "lifts off";
    const Pose flat = pose({0, 0.01, 0});
    EXPECT_FALSE(next(flat, pose({0.5, 0.01, 0}, 0.4, Vec3::UnitY()))) << "slides and turns";
    EXPECT_FALSE(next(flat, pose({0, 0.01 - kSpeed / 2, 0}))) << "slower than an impact";
    EXPECT_TRUE(next(flat, pose({0, 0.01 - kSpeed * 2, 0}))) << "still comes nearer";
  }
}

TEST(PairCache, KeepsUsedEntries) {
  PairCache cache;
  cache.of(3, 1).gjk.size = 7;
  cache.of(1, 2).gjk.size = 8;
  EXPECT_EQ(cache.of(3, 1).gjk.size, 7u);
  EXPECT_EQ(cache.of(1, 2).gjk.size, 8u);
  cache.forget_unused();
  EXPECT_EQ(cache.of(1, 2).gjk.size, 8u);
  cache.forget_unused();
  EXPECT_EQ(cache.of(3, 1).gjk.size, 0u) << "was not used";
  EXPECT_EQ(cache.of(1, 2).gjk.size, 8u);
}

}  // namespace
}  // namespace offstage::sim
