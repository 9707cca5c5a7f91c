#include "effects/emitter_surface.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "births.h"
#include "meshes.h"

namespace offstage::effects {
namespace {

using namespace sim;

constexpr Real kPi = std::numbers::pi;

std::vector<Vec3> cell_points(const ReleaseSurface& surface, const Cells& cells) {
  std::vector<Vec3> points;
  for (uint64_t i = 0; i < cells.count(); ++i)
    points.push_back(surface.cell(cells, i, {0.3, 0.1, 0.7}).point);
  return points;
}

Real least_distance(const std::vector<Vec3>& points) {
  Real least = 1e300;
  for (std::size_t i = 0; i < points.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) least = std::min(least, (points[i] - points[j]).norm());
  return least;
}

TEST(ReleaseSurface, CellsOfSphereAndDiscKeepParticlesApartAndLeaveLittleRoom) {
  for (const SurfaceKind kind : {SurfaceKind::sphere, SurfaceKind::disc}) {
    const ReleaseSurface surface({.kind = kind, .radius = 2});
    for (Real diameter = 4.5; diameter > 0.09; diameter *= 0.97) {
      const Cells cells = surface.cells(diameter);
      const auto points = cell_points(surface, cells);
      if (points.size() > 1) {
        ASSERT_GE(least_distance(points), diameter * (1 - 1e-9)) << points.size();
      }
      for (const Vec3& p : points) {
        if (kind == SurfaceKind::disc)
          ASSERT_LE(p.norm(), std::max(0.0, 2 - diameter / 2) + 1e-12);
        else
          ASSERT_NEAR(p.norm(), 2, 1e-12);
      }
      // On a large surface, circles as wide as the particles cover more than half of the area.
      if (diameter < 0.2) {
        EXPECT_GT(static_cast<Real>(points.size()) * kPi * diameter * diameter / 4, 0.5 * surface.area());
      }
    }
  }
}

// The cells have equal area: the fraction of cells within any cap or circle is its fraction of the area, up
// to some cells along its border.
TEST(ReleaseSurface, CellsAreEqualInArea) {
  const ReleaseSurface sphere({.kind = SurfaceKind::sphere, .radius = 1}),
      disc({.kind = SurfaceKind::disc, .radius = 1});
  const auto on_sphere = cell_points(sphere, sphere.cells(0.02)),
             on_disc = cell_points(disc, disc.cells(0.01));
  const auto part = [](const std::vector<Vec3>& points, auto inside) {
    return static_cast<Real>(std::count_if(points.begin(), points.end(), inside)) /
           static_cast<Real>(points.size());
  };
  for (const Vec3& pole : {Vec3(0, 1, 0), Vec3(1, 0, 0), Vec3(0.6, 0, -0.8)})
    for (Real height : {-0.9, 0.0, 0.5, 0.8})
      EXPECT_NEAR(part(on_sphere, [&](const Vec3& p) { return p.dot(pole) > height; }), (1 - height) / 2,
                  3e-3);
  for (Real x : {-0.5, 0.0, 0.25}) {
    const Real area = std::acos(x) - x * std::sqrt(1 - x * x);
    EXPECT_NEAR(part(on_disc, [&](const Vec3& p) { return p.x() > x; }), area / kPi, 5e-3);
  }
}

TEST(ReleaseSurface, PlacesOnAMeshAreEvenByArea) {
  // A large and a small triangle, and between them one without area.
  const TriangleMesh mesh{{{0, 0, 0}, {3, 0, 0}, {0, 0, 1}, {10, 0, 0}, {10, 1, 0}, {10, 0, 1}},
                          {{0, 2, 1}, {0, 1, 1}, {3, 4, 5}}};
  const ReleaseSurface surface({.kind = SurfaceKind::mesh, .mesh = mesh});
  EXPECT_DOUBLE_EQ(surface.area(), 2);
  const RandomStream random(5, 5);
  constexpr int kN = 100'000;
  int large = 0;
  Vec3 sum = Vec3::Zero();
  for (uint64_t i = 0; i < kN; ++i) {
    const Place p = surface.anywhere({random.uniform(i, 0), random.uniform(i, 1), random.uniform(i, 2)});
    EXPECT_NEAR(p.normal.dot(p.tangent), 0, 1e-12);
    if (p.point.x() > 5) continue;
    EXPECT_EQ(p.normal, Vec3::UnitY());
    ++large;
    sum += p.point;
  }
  EXPECT_NEAR(large, 0.75 * kN, 3 * std::sqrt(kN * 0.75 * 0.25));
  // Position of the centroid; the deviation of a coordinate over a triangle is base / sqrt(18).
  const Real error = 3 / std::sqrt(18.0 * large);
  EXPECT_NEAR(sum.x() / large, 1, 3 * 3 * error / 3);
  EXPECT_NEAR(sum.z() / large, 1.0 / 3, 3 * error / 3);
}

struct Case {
  const char* name;
  EmitterSurface surface;
};

std::vector<Case> surfaces() {
  const Pose tilted{Vec3(1, 2, 3), Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()))};
  return {{"plane", {.pose = tilted, .size = {1.5, 0.8}}},
          {"sphere", {.kind = SurfaceKind::sphere, .pose = tilted, .radius = 0.4}},
          {"disc", {.kind = SurfaceKind::disc, .pose = tilted, .radius = 0.6}},
          {"mesh", {.kind = SurfaceKind::mesh, .pose = tilted, .mesh = torus_mesh(0.3, 0.1, 24, 12)}}};
}

EmitterDef burst_from(const EmitterSurface& surface, Real count) {
  return {.name = "burst",
          .surface = surface,
          .release = {.rate = 0.0, .bursts = {{.count = count}}},
          .particles = {.speed = 0.5, .radius = Uniform{0.01, 0.03}, .lifespan = 1e9}};
}

TEST(EmitterSurface, ParticlesOfOneReleaseNeverOverlapOnAnySurface) {
  for (const auto& [name, surface] : surfaces()) {
    SCOPED_TRACE(name);
    World world = empty_world();
    const auto system = world.add_particle_system({});
    Emitter emitter(burst_from(surface, 1000), system);
    run(world, 1, 30, emitter);
    EXPECT_EQ(emitter.report().released, 1000u);
    EXPECT_GT(emitter.report().waited, 0u);
    const auto births = births_of(world, system);
    std::size_t together = 0;
    for (std::size_t i = 0; i < births.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        if (std::abs(births[i].time - births[j].time) > 1e-9) continue;
        ASSERT_GE((births[i].position - births[j].position).norm(),
                  births[i].radius + births[j].radius - 1e-9);
        together += j + 1 == i;
      }
    EXPECT_GT(together, 900u);  // most particles come in large releases
  }
}

TEST(EmitterSurface, ParticlesTouchTheSurfaceFromOutsideAndLeaveAlongItsNormal) {
  for (const auto& [name, surface] : surfaces()) {
    if (surface.kind == SurfaceKind::mesh) continue;
    SCOPED_TRACE(name);
    World world = empty_world();
    const auto system = world.add_particle_system({});
    Emitter emitter(burst_from(surface, 200), system);
    run(world, 1, 30, emitter);
    for (const Birth& b : births_of(world, system)) {
      const Vec3 p = surface.pose.point_to_body(b.position), v = surface.pose.vector_to_body(b.velocity);
      const Vec3 normal = surface.kind == SurfaceKind::sphere ? Vec3(p.normalized()) : Vec3::UnitY();
      ASSERT_NEAR((v - 0.5 * normal).norm(), 0, 1e-9);
      ASSERT_NEAR(surface.kind == SurfaceKind::sphere ? p.norm() - surface.radius : p.y(), b.radius, 1e-9);
    }
  }
}

// A sphere emits in all directions, even if it is tiny and has few cells.
TEST(EmitterSurface, ATinySphereHasNoPreferredDirection) {
  World world = empty_world();
  const auto system = world.add_particle_system({});
  Emitter emitter({.surface = {.kind = SurfaceKind::sphere, .radius = 1e-3},
                   .release = {.rate = 20'000.0},
                   .particles = {.radius = 0.01, .lifespan = 1e9}},
                  system);
  run(world, 1, 60, emitter);
  Vec3 sum = Vec3::Zero(), squares = Vec3::Zero();
  for (const Vec3& v : world.particles(system).velocity) {
    sum += v;
    squares += v.cwiseProduct(v);
  }
  const Real n = static_cast<Real>(world.particle_count());
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(sum[axis] / n, 0, 3 / std::sqrt(3 * n));
    EXPECT_NEAR(squares[axis] / n, 1.0 / 3, 3 * std::sqrt(4.0 / 45 / n));
  }
}

TEST(EmitterSurface, OverlappingReleasesNeedNoRoomAndLieEvenly) {
  for (const auto& [name, surface] : surfaces()) {
    SCOPED_TRACE(name);
    World world = empty_world();
    const auto system = world.add_particle_system({});
    EmitterDef def = burst_from(surface, 20'000);
    def.release.overlap = true;
    Emitter emitter(def, system);
    run(world, 1.0 / 30, 30, emitter);
    EXPECT_EQ(emitter.report().waited, 0u);
    ASSERT_EQ(world.particle_count(), 20'000u);
    Vec3 sum = Vec3::Zero();
    for (const Birth& b : births_of(world, system)) sum += surface.pose.point_to_body(b.position);
    // Mean of all positions; the deviation of a coordinate is below 0.5 m.
    sum.y() *= surface.kind == SurfaceKind::sphere || surface.kind == SurfaceKind::mesh;
    EXPECT_NEAR((sum / 20'000).norm(), 0, 3 * 0.5 / std::sqrt(20'000.0));
  }
}

TEST(EmitterSurface, AGivenDirectionIsInTheBodysFrame) {
  World world = empty_world();
  const auto body = world.add_body({.motion = MotionType::kinematic,
                                    .pose = {Vec3::Zero(), Quat(Eigen::AngleAxisd(kPi / 2, Vec3::UnitZ()))},
                                    .collides = false});
  const auto system = world.add_particle_system({});
  Emitter emitter({.surface = {.kind = SurfaceKind::sphere, .radius = 0.5},
                   .body = body,
                   .release = {.direction = {2, 0, 0}},
                   .particles = {.speed = 3.0, .spread_deg = 20.0, .lifespan = 1e9}},
                  system);
  run(world, 1, 60, emitter);
  for (const Vec3& v : world.particles(system).velocity) {
    EXPECT_NEAR(v.y(), 3 * std::cos(20 * kPi / 180), 1e-12);
    EXPECT_NEAR(v.norm(), 3, 1e-12);
  }
}

TEST(EmitterSurface, RefusesSurfacesWithoutArea) {
  EXPECT_THROW(ReleaseSurface({.kind = SurfaceKind::sphere, .radius = 0}), std::invalid_argument);
  EXPECT_THROW(ReleaseSurface({.kind = SurfaceKind::mesh}), std::invalid_argument);
  EXPECT_THROW(ReleaseSurface({.kind = SurfaceKind::mesh, .mesh = {{Vec3::Zero()}, {{0, 0, 1}}}}),
               std::invalid_argument);
}

}  // namespace
}  // namespace offstage::effects
