#include "sim/contact/contact_pair.h"

#include <cmath>
#include <limits>
#include <memory>

#include <gtest/gtest.h>

namespace offstage::sim {
namespace {

/// Returns a body in the state in which World::add_body() creates it.
std::unique_ptr<Body> make_body(const Shape& shape, MotionType motion, const Pose& pose) {
  auto body = std::make_unique<Body>();
  body->def.shape = shape;
  body->def.motion = body->type = motion;
  body->solid.shape = &body->def.shape;
  body->pose = body->start_pose = pose;
  body->extent =
      std::holds_alternative<Plane>(shape) ? std::numeric_limits<Real>::infinity() : reach(body->solid);
  body->rigid.mass = 1;
  body->rigid.inverse_inertia = body->rigid.inertia = Mat3::Identity();
  body->rigid.place(pose);
  body->begin_interval(0);
  return body;
}

/// A box with edges of 0.2 m on the ground.
struct BoxOnGround {
  std::unique_ptr<Body> box, ground;
  ContactPair pair;

  explicit BoxOnGround(const PairSurface& surface = {})
      : box(make_body(Box{Vec3::Constant(0.2)}, MotionType::dynamic, {Vec3(0, 0.1, 0)})),
        ground(make_body(Plane{}, MotionType::static_body, {})),
        pair(*box, *ground, surface) {}

  PlacedManifold& find(const Pose& pose, Real reuse = 1e-5) {
    pair.find(pose, Pose{}, 1e-3, reuse, false);
    EXPECT_EQ(pair.manifolds().size(), 1u);
    return pair.manifolds().front();
  }
};

Vec3 world_force(const PlacedManifold& m, uint32_t k) {
  return m.forces[k].last.x() * m.frame.n + m.forces[k].last.y() * m.frame.t +
         m.forces[k].last.z() * m.frame.k;
}

TEST(ContactPair, FindsTheFourCornersOfABoxOnTheGround) {
  BoxOnGround scene;
  EXPECT_TRUE(scene.pair.is_new());
  const PlacedManifold& m = scene.find({Vec3(3, 0.1004, -2)});
  EXPECT_FALSE(scene.pair.is_new());
  ASSERT_EQ(m.manifold.count, 4u);
  EXPECT_NEAR((m.frame.n - Vec3::UnitY()).norm(), 0, 1e-12);
  for (uint32_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(m.manifold.points[k].separation, 4e-4, 1e-12);
    EXPECT_FALSE(m.forces[k].known);
    EXPECT_EQ(m.forces[k].now, Vec3::Zero());
  }
  EXPECT_NEAR(scene.pair.separation(), 4e-4, 1e-12);
  scene.pair.find({Vec3(3, 0.2, -2)}, Pose{}, 1e-3, 1e-5, false);
  EXPECT_TRUE(scene.pair.manifolds().empty());
  EXPECT_EQ(scene.pair.separation(), std::numeric_limits<Real>::infinity());
}

// Contact points whose bodies hardly move are reused with updated separations.
TEST(ContactPair, TakesPointsOverWithNewDistances) {
  BoxOnGround scene;
  scene.find({Vec3(0, 0.1, 0)});
  const PlacedManifold& m = scene.find({Vec3(0, 0.1 - 4e-6, 0)});
  ASSERT_EQ(m.manifold.count, 4u);
  for (uint32_t k = 0; k < 4; ++k) {
    EXPECT_TRUE(m.forces[k].known);
    EXPECT_NEAR(m.manifold.points[k].separation, -4e-6, 1e-12);
  }
}

// Whether points are reused or computed again, a force stays with its point and rotates with the body.
TEST(ContactPair, ForcesStayWithTheirPoints) {
  for (const Real reuse : {0.0, 1.0}) {
    BoxOnGround scene;
    PlacedManifold& before = scene.find({Vec3(0, 0.1, 0)}, reuse);
    std::array<Vec3, 4> corner, force;
    for (uint32_t k = 0; k < 4; ++k) {
      before.forces[k].last = {1.0 + k, 0.1 * k, -0.2};
      corner[k] = before.manifold.points[k].on_a - Vec3(0, 0.1, 0);
      force[k] = world_force(before, k);
    }
    const Quat turn(Eigen::AngleAxisd(0.01, Vec3::UnitY()));
    const Pose moved{Vec3(1e-3, 0.1, 2e-3), turn};
    const PlacedManifold& after = scene.find(moved, reuse);
    ASSERT_EQ(after.manifold.count, 4u);
    for (uint32_t k = 0; k < 4; ++k) {
      const Vec3 local = moved.point_to_body(after.manifold.points[k].on_a);
      bool found = false;
      for (std::size_t j = 0; j < 4; ++j) {
        if ((corner[j] - local).norm() > 5e-3) continue;
        found = true;
        EXPECT_TRUE(after.forces[k].known);
        EXPECT_LT((world_force(after, k) - turn * force[j]).norm(), 1e-12);
      }
      EXPECT_TRUE(found);
    }
  }
}

// Where one contact point becomes two, only one of them inherits the force.
TEST(ContactPair, AForceGoesToOnePointOnly) {
  BoxOnGround scene;
  scene.box->def.shape = Box{{0.2, 0.2, 0.002}};
  const auto edge_on = [](Real lean) {
    return Pose{Vec3(0, 0.1, 0), Quat(Eigen::AngleAxisd(lean, Vec3::UnitX()))};
  };
  PlacedManifold& edge = scene.find(edge_on(0.6), 0);
  ASSERT_EQ(edge.manifold.count, 2u);
  for (uint32_t k = 0; k < 2; ++k) edge.forces[k].last = 7 * Vec3::UnitX();
  const PlacedManifold& flat = scene.find(edge_on(0), 0);
  ASSERT_EQ(flat.manifold.count, 4u);
  Real sum = 0;
  for (uint32_t k = 0; k < 4; ++k) sum += world_force(flat, k).norm();
  EXPECT_NEAR(sum, 14, 1e-12);
}

TEST(ContactPair, ForcesOfRemovedPointsAreDropped) {
  BoxOnGround scene;
  PlacedManifold& m = scene.find({Vec3(0, 0.1, 0)});
  for (uint32_t k = 0; k < 4; ++k) m.forces[k].last = Vec3::UnitX();
  scene.pair.find({Vec3(0, 0.2, 0)}, Pose{}, 1e-3, 1e-5, false);
  EXPECT_TRUE(scene.pair.manifolds().empty());
  const PlacedManifold& again = scene.find({Vec3(0, 0.1, 0)});
  for (uint32_t k = 0; k < 4; ++k) EXPECT_FALSE(again.forces[k].known);
}

TEST(ContactPair, TheFrictionAxisDeterminesTheTangents) {
  BoxOnGround scene;
  scene.ground->def.friction_axis = {1, 5, 1};  // only the component in the surface counts
  ContactPair pair(*scene.box, *scene.ground, {.cross = 2, .axis_body = scene.ground.get()});
  const auto find = [&](const Vec3& at) {
    pair.find({at}, Pose{}, 1e-3, 1e-5, false);
    return pair.manifolds().at(0);
  };
  const PlacedManifold m = find({0, 0.1, 0});
  EXPECT_NEAR((m.frame.t - Vec3(1, 0, 1).normalized()).norm(), 0, 1e-12);
  EXPECT_NEAR((m.frame.k - m.frame.n.cross(m.frame.t)).norm(), 0, 1e-12);
  // An axis perpendicular to the surface defines no direction: any tangents are valid.
  scene.ground->def.friction_axis = {0, 1, 0};
  const PlacedManifold any = find({0.1, 0.1, 0});
  EXPECT_NEAR(any.frame.t.norm(), 1, 1e-12);
  EXPECT_NEAR(any.frame.t.dot(any.frame.n), 0, 1e-12);
}

TEST(ContactPair, SpeedBoundHoldsForEveryPoint) {
  BoxOnGround scene;
  scene.box->rigid.momentum = {1, -2, 0.5};
  scene.box->rigid.angular_momentum = {3, 1, -2};
  scene.box->begin_interval(0);
  const Real bound = scene.pair.speed_bound();
  EXPECT_GE(bound, Vec3(1, -2, 0.5).norm());
  for (int i = 0; i < 8; ++i) {
    const Vec3 corner = Vec3(0, 0.1, 0) + Vec3(i & 1 ? 0.1 : -0.1, i & 2 ? 0.1 : -0.1, i & 4 ? 0.1 : -0.1);
    EXPECT_LE(scene.pair.relative_velocity(corner).norm(), bound + 1e-12);
  }
}

}  // namespace
}  // namespace offstage::sim
