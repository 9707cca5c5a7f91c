#pragma once
/// Scenes in which bodies fall on a heap. A test limits the counted work of a step; a benchmark measures the
/// time of a step.

#include <array>
#include <cmath>
#include <numbers>

#include "sim/world.h"
#include "tests/random.h"

namespace offstage::sim {

enum class Heap { spheres_in_a_silo, poured_cubes, ragdolls, bodies_on_terrain };
inline constexpr std::array kHeaps = {Heap::spheres_in_a_silo, Heap::poured_cubes, Heap::ragdolls,
                                      Heap::bodies_on_terrain};

inline const char* name_of(Heap heap) {
  constexpr std::array kNames = {"180 spheres in a silo", "180 poured cubes", "six ragdolls",
                                 "two bodies on terrain"};
  return kNames[static_cast<std::size_t>(heap)];
}

/// Returns a vertical tube above a funnel with a closed bottom. It is one open mesh whose front faces point
/// inwards.
inline TriangleMesh silo_mesh() {
  constexpr uint32_t kAround = 32;
  constexpr std::array<std::array<Real, 2>, 4> kProfile = {{{0.1, 0}, {0.1, 0.1}, {0.5, 0.5}, {0.5, 4}}};
  TriangleMesh mesh;
  mesh.vertices.emplace_back(0, 0, 0);
  for (const auto& [radius, height] : kProfile)
    for (uint32_t i = 0; i < kAround; ++i) {
      const Real angle = 2 * std::numbers::pi * i / kAround;
      mesh.vertices.emplace_back(radius * std::cos(angle), height, radius * std::sin(angle));
    }
  const auto at = [](std::size_t ring, uint32_t i) {
    return static_cast<uint32_t>(1 + ring * kAround + i % kAround);
  };
  for (uint32_t i = 0; i < kAround; ++i) {
    mesh.triangles.push_back({0, at(0, i + 1), at(0, i)});
    for (std::size_t ring = 0; ring + 1 < kProfile.size(); ++ring) {
      mesh.triangles.push_back({at(ring, i), at(ring, i + 1), at(ring + 1, i + 1)});
      mesh.triangles.push_back({at(ring, i), at(ring + 1, i + 1), at(ring + 1, i)});
    }
  }
  return mesh;
}

/// Returns a terrain with hills 0.5 m high, on a grid with cells of 0.5 m.
inline TriangleMesh terrain_mesh() {
  constexpr uint32_t kCells = 24;
  TriangleMesh mesh;
  for (uint32_t i = 0; i <= kCells; ++i)
    for (uint32_t k = 0; k <= kCells; ++k) {
      const Real x = 0.5 * i - 6, z = 0.5 * k - 6;
      mesh.vertices.emplace_back(x, 0.25 * std::sin(1.3 * x) * std::cos(1.1 * z), z);
    }
  for (uint32_t i = 0; i < kCells; ++i)
    for (uint32_t k = 0; k < kCells; ++k) {
      const uint32_t a = i * (kCells + 1) + k, b = a + kCells + 1;
      mesh.triangles.push_back({a, a + 1, b});
      mesh.triangles.push_back({b, a + 1, b + 1});
    }
  return mesh;
}

/// Adds a figure that lies on its back along x: a torso of two links, a head, and two links for each arm and
/// leg.
inline void add_ragdoll(World& world, const Pose& at) {
  const auto limb = [&](const Vec3& from, const Vec3& to, Real radius, Real mass) {
    BodyDef def{.shape = Capsule{radius, std::max((to - from).norm() - 2 * radius, 0.01)},
                .mass = mass,
                .restitution = 0,
                .friction = 0.6};
    def.pose = {at.point_to_world((from + to) / 2),
                at.orientation * Quat::FromTwoVectors(Vec3::UnitY(), to - from)};
    return world.add_body(def);
  };
  const auto join = [&](JointType type, BodyHandle a, BodyHandle b, const Vec3& anchor, const Vec3& axis,
                        Real lower, Real upper) {
    JointDef def{
        .type = type, .a = a, .b = b, .anchor = at.point_to_world(anchor), .axis = at.vector_to_world(axis)};
    if (type == JointType::revolute) {
      def.lower = lower;
      def.upper = upper;
    } else {
      def.swing = upper;
    }
    def.friction = 0.5;
    world.add_joint(def);
  };
  const BodyHandle hips = limb({0, 0, -0.08}, {0, 0, 0.08}, 0.1, 12),
                   chest = limb({0.3, 0, -0.1}, {0.3, 0, 0.1}, 0.12, 20),
                   head = limb({0.52, 0, 0}, {0.68, 0, 0}, 0.08, 4);
  join(JointType::spherical, chest, hips, {0.14, 0, 0}, Vec3::UnitX(), 0, 0.6);
  join(JointType::spherical, head, chest, {0.47, 0, 0}, Vec3::UnitX(), 0, 0.7);
  for (const Real side : {-1.0, 1.0}) {
    const BodyHandle upper_arm = limb({0.36, 0, 0.26 * side}, {0.36, 0, 0.5 * side}, 0.045, 2),
                     forearm = limb({0.36, 0, 0.54 * side}, {0.36, 0, 0.78 * side}, 0.04, 1.5),
                     thigh = limb({-0.14, 0, 0.1 * side}, {-0.5, 0, 0.1 * side}, 0.07, 8),
                     shin = limb({-0.56, 0, 0.1 * side}, {-0.92, 0, 0.1 * side}, 0.05, 4);
    join(JointType::spherical, upper_arm, chest, {0.36, 0, 0.23 * side}, side * Vec3::UnitZ(), 0, 1.4);
    join(JointType::revolute, forearm, upper_arm, {0.36, 0, 0.52 * side}, Vec3::UnitY(), -0.1, 2.2);
    join(JointType::spherical, thigh, hips, {-0.1, 0, 0.1 * side}, -Vec3::UnitX(), 0, 1.2);
    join(JointType::revolute, shin, thigh, {-0.53, 0, 0.1 * side}, Vec3::UnitZ(), -0.1, 2.2);
  }
}

/// Returns the world of a heap at the start, before there are any contacts. Each seed places the bodies
/// differently.
inline World heap_scene(Heap heap, SolverKind solver = SolverKind::automatic, Real step = 1.0 / 240,
                        uint64_t seed = 11) {
  World world({.max_step = step, .solver = solver});
  const Scatter random{seed};
  const auto u = [&](int i, uint64_t k) { return random.uniform(static_cast<uint64_t>(i), k); };
  const auto turn = [&](int i) {
    return Quat(u(i, 4) - 0.5, u(i, 5) - 0.5, u(i, 6) - 0.5, u(i, 7) - 0.5).normalized();
  };
  switch (heap) {
    case Heap::spheres_in_a_silo:
      world.add_body({.shape = MeshShape{world.add_mesh(silo_mesh())},
                      .motion = MotionType::static_body,
                      .restitution = 0.3});
      for (int i = 0; i < 180; ++i)
        world.add_body({.shape = Sphere{0.06 + 0.02 * u(i, 0)},
                        .pose = {Vec3(0.2 * (i % 3 - 1) + 0.04 * u(i, 1), 0.8 + 0.2 * (i / 9),
                                      0.2 * (i / 3 % 3 - 1) + 0.04 * u(i, 2))},
                        .restitution = 0.3,
                        .friction = 0.4});
      break;
    case Heap::poured_cubes:
      world.add_body(
          {.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0.5, .friction = 0.6});
      for (int i = 0; i < 180; ++i)
        world.add_body({.shape = Box{Vec3::Constant(0.2)},
                        .pose = {Vec3(0.32 * (i % 3 - 1) + 0.05 * u(i, 1), 0.5 + 0.35 * (i / 9),
                                      0.32 * (i / 3 % 3 - 1) + 0.05 * u(i, 2)),
                                 turn(i)},
                        .angular_velocity = 4 * Vec3(u(i, 8) - 0.5, u(i, 9) - 0.5, u(i, 10) - 0.5),
                        .restitution = 0.5,
                        .friction = 0.3 + 0.7 * u(i, 3)});
      break;
    case Heap::ragdolls:
      world.add_body(
          {.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0, .friction = 0.6});
      for (int i = 0; i < 6; ++i)
        add_ragdoll(world, {Vec3(0.1 * u(i, 1), 0.6 + 0.5 * i, 0.1 * u(i, 2)),
                            Quat(Eigen::AngleAxisd(1.1 * i, Vec3::UnitY())) *
                                Quat(Eigen::AngleAxisd(0.4 * u(i, 3), Vec3::UnitZ()))});
      break;
    case Heap::bodies_on_terrain:
      world.add_body({.shape = MeshShape{world.add_mesh(terrain_mesh())}, .motion = MotionType::static_body});
      world.add_body(
          {.shape = Box{{2.5, 0.01, 2.5}}, .pose = {Vec3(0, 2, 0), turn(1)}, .velocity = {1, 0, 0.5}});
      world.add_body({.shape = Box{{0.02, 1.5, 0.02}},
                      .pose = {Vec3(1, 3, -1), turn(2)},
                      .angular_velocity = {3, 0, 5}});
      break;
  }
  return world;
}

}  // namespace offstage::sim
