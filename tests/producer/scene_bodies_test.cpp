// Shapes, masses, lifetimes, applied forces and fills of a scene: the resulting objects, and refused values.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "producer/build/body_shapes.h"
#include "producer/build/fill.h"
#include "producer/build/simulation.h"
#include "producer/format/scene_io.h"
#include "producer/run/production.h"
#include "sim/geometry/mass_properties.h"
#include "tests/meshes.h"

namespace offstage::producer {
namespace {

LoadedScene body_scene(const std::string& text) {
  return parse_scene("{" + text + "}", "s", OFFSTAGE_SOURCE_DIR);
}

std::string body_scene_errors(const std::string& text) {
  try {
    body_scene(text);
  } catch (const SceneError& error) {
    std::string all;
    for (const Problem& problem : error.problems()) all += problem.where.path + ": " + problem.what + "\n";
    return all;
  }
  return "";
}

const char* kHammer = R"(
  "materials": [{"name": "steel"}, {"name": "wood"}],
  "bodies": [{"name": "hammer", "material": "wood", "density": 600, "shape": {"type": "compound", "parts": [
      {"shape": {"type": "box", "size": [0.1, 0.05, 0.1]}, "position": [0, 0.3, 0], "density": 8000, "material": "steel"},
      {"shape": {"type": "cylinder", "radius": 0.015, "height": 0.5}}]}}])";

TEST(SceneBodies, ACompoundHasTheMassOfItsParts) {
  const LoadedScene loaded = body_scene(kHammer);
  const ModelLibrary models;
  Simulation simulation(loaded.scene, models);
  const sim::BodyState state = simulation.world().body(simulation.moving_bodies()[0].handle);
  const Real head = 8000 * 0.1 * 0.05 * 0.1, handle = 600 * std::numbers::pi * 0.015 * 0.015 * 0.5;
  EXPECT_NEAR(state.mass, head + handle, 1e-12);
  EXPECT_NEAR(state.centre.y(), head * 0.3 / (head + handle), 1e-12);
}

TEST(SceneBodies, OwnMassCentreAndInertiaReplaceThoseOfTheShape) {
  const LoadedScene loaded =
      body_scene(R"("world": {"gravity": [0, 0, 0]}, "output": {"fps": 10, "duration": 0.2},
    "bodies": [{"name": "top", "mass": 3, "centre": [0.1, 0, 0], "inertia": [1, 2, 2.5], "inertia_products": [0.1, 0, 0],
                "angular_velocity": [0, 0, 1]}])");
  const ModelLibrary models;
  Simulation simulation(loaded.scene, models);
  const sim::BodyState state = simulation.world().body(simulation.moving_bodies()[0].handle);
  EXPECT_EQ(state.mass, 3);
  EXPECT_LT((state.centre - Vec3(0.1, 0, 0)).norm(), 1e-12);
  EXPECT_LT((state.angular_momentum - Vec3(0, 0, 2.5)).norm(), 1e-12);
}

TEST(SceneBodies, WrongShapesAndTimesAreRefused) {
  EXPECT_EQ(body_scene_errors(R"("bodies": [{"shape": {"type": "torus", "radius": 0.1, "tube_radius": 0.2}},
                                    {"shape": {"type": "tube", "radius": 0.1, "thickness": 0.1}},
                                    {"shape": {"type": "open_box", "thickness": 0.5}},
                                    {"shape": {"type": "compound", "parts": []}},
                                    {"inertia_products": [1, 0, 0]},
                                    {"appear_at": 2, "remove_at": 1}])"),
            "/bodies/0/shape/tube_radius: must be less than the \"radius\" of the torus\n"
            "/bodies/1/shape/thickness: must be less than the \"radius\" of the tube; use a cylinder for a "
            "solid one\n"
            "/bodies/2/shape/thickness: must be less than half of \"size\" along x and z, and less than "
            "\"size\" along y\n"
            "/bodies/3/shape/parts: is empty; a compound needs at least one part\n"
            "/bodies/4/inertia_products: need \"inertia\"\n"
            "/bodies/5/remove_at: must be later than \"appear_at\" (2 s), got 1 s\n");
  EXPECT_EQ(
      body_scene_errors(
          R"("bodies": [{"name": "b"}], "forces": [{"type": "applied", "bodies": ["b"], "torque": [1, 0, 0],
                         "keyframes": [{"time": 1}, {"time": 1}]}])"),
      "/forces/0: has both \"keyframes\" and a \"force\" or \"torque\"; give one of them\n"
      "/forces/0/keyframes/1/time: times must increase, got 1 after 1\n");
}

TEST(SceneBodies, InvalidCouplingsAreRefused) {
  const std::string bodies = R"("bodies": [{"name": "a"}, {"name": "b", "position": [3, 0, 0]}], )";
  EXPECT_EQ(body_scene_errors(
                bodies + R"("joints": [{"type": "gear", "a": "a"}, {"type": "screw", "a": "a", "ratio": 0},
      {"type": "pulley", "a": "a", "b": "b", "pulley_a": [0, 3, 0], "pulley_b": [0, 3, 0], "ratio": -1},
      {"type": "distance", "a": "a", "anchor": [0, 1, 0], "length_limits": [0, 0.5]},
      {"type": "revolute", "a": "a", "stiffness": 3}, {"a": "a", "restitution": 0.5},
      {"type": "revolute", "a": "a", "ratio": 2, "pulley_a": [0, 3, 0]},
      {"a": "a", "swing_deg": 20, "restitution": 0.5}])"),
            "/joints/0/b: is needed: a gear or rack couples two bodies\n"
            "/joints/1/ratio: must not be 0\n"
            "/joints/2/ratio: must be greater than 0 for a pulley\n"
            "/joints/3/length_limits: must be a range that contains the length at time 0, 1.000000 m\n"
            "/joints/4/stiffness: is for spherical joints; use a motor with a \"stiffness\"\n"
            "/joints/5/restitution: has no effect: it is for impacts at limits, and the joint has none\n"
            "/joints/6/ratio: is for gears, racks, screws and pulleys\n"
            "/joints/6/pulley_a: is for pulleys\n");
}

// The rope of 2 m lets its load fall by 1 m.
TEST(SceneBodies, LengthLimitsAreLengths) {
  const LoadedScene loaded = body_scene(R"("output": {"fps": 30, "duration": 3},
    "bodies": [{"name": "load", "shape": {"type": "sphere", "radius": 0.1}}],
    "joints": [{"type": "distance", "a": "load", "anchor_b": [0, 1, 0], "length_limits": [0, 2]}])");
  const ModelLibrary models;
  Simulation simulation(loaded.scene, models);
  for (int i = 0; i < 90; ++i) simulation.advance();
  EXPECT_NEAR(simulation.world().body(simulation.moving_bodies()[0].handle).centre.y(), -1, 1e-3);
}

// A chain along a path has links of equal length along it.
TEST(SceneBodies, AChainAlongAPathHasLinksOfEqualLength) {
  const LoadedScene corner = body_scene(R"("articulations": [
    {"type": "chain", "name": "c", "links": 6, "path": [[0, 0, 0], [1, 0, 0], [1, 2, 0]]}])");
  ASSERT_EQ(corner.scene.bodies.size(), 6u);
  EXPECT_LT((corner.scene.joints[2].anchor - Vec3(1, 0, 0)).norm(), 1e-12);
  EXPECT_LT((corner.scene.joints[4].anchor - Vec3(1, 1, 0)).norm(), 1e-12);
}

TEST(Fills, HoldAllBallsAtTheirDistance) {
  for (const Packing packing : {Packing::hexagonal, Packing::cubic, Packing::random})
    for (const auto& shape :
         {decltype(Fill::shape)(BoxFill{{1, 0.7, 0.9}}), decltype(Fill::shape)(CylinderFill{0.5, 0.8}),
          decltype(Fill::shape)(SphereFill{0.5})}) {
      const Real d = 0.1;
      const std::vector<Vec3> places = fill_places({.shape = shape, .packing = packing}, d, 100'000);
      for (std::size_t i = 0; i < places.size(); ++i)
        for (std::size_t k = 0; k < i; ++k) ASSERT_GE((places[i] - places[k]).norm(), d * (1 - 1e-9));
      const Real volume = shape.index() == 0   ? 0.63
                          : shape.index() == 1 ? std::numbers::pi / 4 * 0.8
                                               : std::numbers::pi / 6;
      const Real fraction = static_cast<Real>(places.size()) * std::numbers::pi / 6 * d * d * d / volume;
      // The density is less than the ideal 0.74, 0.52 and 0.38, because of the layer at the walls.
      const Real ideal = packing == Packing::hexagonal ? 0.7405 : packing == Packing::cubic ? 0.5236 : 0.385;
      EXPECT_LT(fraction, ideal + 1e-9);
      EXPECT_GT(fraction, 0.6 * ideal) << static_cast<int>(packing) << " " << shape.index();
    }
}

TEST(Fills, HoldBallsInsideAModel) {
  const sim::TriangleMesh torus = sim::torus_mesh(1, 0.3, 48, 32);
  const Real d = 0.06, free = 0.3 - d / 2;  // radius of the tube in which the centres lie
  for (const Packing packing : {Packing::hexagonal, Packing::cubic, Packing::random}) {
    MeshFill shape;
    shape.solid = torus;
    for (Vec3& v : shape.solid.vertices) v += Vec3(5, 0, 0);
    const std::vector<Vec3> places = fill_places({.shape = shape, .packing = packing}, d, 100'000);
    for (const Vec3& p : places) {
      const Vec3 q = p - Vec3(5, 0, 0);
      // The mesh's chords leave the torus by up to 0.7 (1 - cos(pi / 48)) = 0.0015, at its inner equator.
      EXPECT_LE(std::hypot(std::hypot(q.x(), q.z()) - 1, q.y()), free + 0.0015);
    }
    Real nearest = d * d;
    for (std::size_t i = 0; i < places.size(); ++i)
      for (std::size_t k = 0; k < i; ++k) nearest = std::min(nearest, (places[i] - places[k]).squaredNorm());
    EXPECT_GE(std::sqrt(nearest), d * (1 - 1e-9));
    // The places fill that tube at the density of their packing: 1 or sqrt(2) per cube of d for the lattices,
    // whose ten rows cover 0.96 of the tube's section, and less than the limit of random sequential addition,
    // 0.384 * 6 / pi = 0.733, for random places.
    const Real fraction = static_cast<Real>(places.size()) * d * d * d /
                          (2 * std::numbers::pi * std::numbers::pi * free * free);
    EXPECT_GT(fraction, packing == Packing::random ? 0.55 : packing == Packing::hexagonal ? 1.25 : 0.9);
    EXPECT_LT(fraction, packing == Packing::random ? 0.733 : packing == Packing::hexagonal ? 1.5 : 1.1);
  }
}

TEST(Fills, OfAModelReadItsFile) {
  const LoadedScene loaded = body_scene(R"(
    "particles": [{"name": "water", "radius": 0.01, "fill": {"shape": {"type": "mesh", "file": "rock.glb", "fit": [0.2, 0.2, 0.2]},
                                                           "position": [0, 1, 0]}}])");
  EXPECT_GT(loaded.scene.particles[0].places.size(), 50u);
  EXPECT_FALSE(loaded.scene.fill_digest.empty());
  EXPECT_THROW(body_scene(R"("particles": [{"name": "water", "radius": 0.01,
    "fill": {"shape": {"type": "mesh", "file": "hammock.glb"}}}])"),
               SceneError);
}

TEST(Fills, MakeParticlesAndCopiesOfBodies) {
  const LoadedScene loaded = body_scene(R"(
    "particles": [{"name": "water", "radius": 0.05, "places": [{"position": [9, 0, 0]}],
                   "fill": {"shape": {"type": "box", "size": [0.4, 0.3, 0.2]}, "packing": "cubic", "position": [0, 5, 0]}}],
    "bodies": [{"name": "marble", "shape": {"type": "sphere", "radius": 0.05}, "position": [0, 1, 0],
                "fill": {"shape": {"type": "cylinder", "radius": 0.2, "height": 0.4}, "spacing": 0.101}}])");
  EXPECT_EQ(loaded.scene.particles[0].places.size(), 1u + 4 * 3 * 2);
  EXPECT_GT(loaded.scene.bodies.size(), 15u);
  for (const Body& body : loaded.scene.bodies)
    EXPECT_LT(std::hypot(body.position.x(), body.position.z()), 0.15);
  EXPECT_EQ(body_scene_errors(R"("bodies": [{"name": "m", "fill": {}}])"),
            "/bodies/0/fill: needs a \"spacing\", the distance between neighbouring copies\n");
  const char* no_room = ": has no room for a single object; use a smaller \"spacing\" or a larger volume\n";
  EXPECT_EQ(body_scene_errors(R"("bodies": [{"name": "m", "fill": {"spacing": 2}}])"),
            std::string("/bodies/0/fill") + no_room);
  EXPECT_EQ(body_scene_errors(R"("particles": [{"fill": {"spacing": 2}}])"),
            std::string("/particles/0/fill") + no_room);
  // A thin and very long volume contains only few places of its bounding box.
  EXPECT_EQ(
      body_scene_errors(
          R"("particles": [{"fill": {"shape": {"type": "cylinder", "radius": 0.06, "height": 1e9}, "spacing": 0.1}}])"),
      "/particles/0/fill: has room for more than 5000000 objects, the limit; use a larger \"spacing\" or a "
      "smaller volume\n");
}

TEST(EmitterFaces, AreThoseOfTheBodyOrOfACube) {
  const LoadedScene loaded = body_scene(R"(
    "bodies": [{"name": "box", "shape": {"type": "box", "size": [1, 2, 3]}, "motion": "static"},
               {"name": "can", "shape": {"type": "cylinder", "radius": 0.3, "height": 2}, "motion": "static"}],
    "emitters": [{"body": "box", "surface": {"type": "face", "face": "right"}},
                 {"body": "can", "surface": {"type": "face", "face": "bottom"}},
                 {"surface": {"type": "face", "face": "front", "size": [1, 1, 4], "position": [5, 0, 0]}}])");
  const auto& right = std::get<PlaneSurface>(loaded.scene.emitters[0].surface);
  EXPECT_LT((right.position - Vec3(0.5, 0, 0)).norm(), 1e-12);
  EXPECT_LT((right.direction - Vec3::UnitX()).norm(), 1e-12);
  // Corners of the rectangle are corners of the box.
  const Vec3 corner = right.position + right.orientation() * Vec3(right.size.x() / 2, 0, right.size.y() / 2);
  EXPECT_LT((corner.cwiseAbs() - Vec3(0.5, 1, 1.5)).norm(), 1e-12);
  const auto& bottom = std::get<DiscSurface>(loaded.scene.emitters[1].surface);
  EXPECT_LT((bottom.position - Vec3(0, -1, 0)).norm() + (bottom.direction + Vec3::UnitY()).norm(), 1e-12);
  EXPECT_EQ(bottom.radius, 0.3);
  EXPECT_LT((std::get<PlaneSurface>(loaded.scene.emitters[2].surface).position - Vec3(5, 0, 2)).norm(),
            1e-12);
  EXPECT_EQ(body_scene_errors(R"("bodies": [{"name": "ball", "shape": {"type": "sphere"}}],
                         "emitters": [{"body": "ball", "surface": {"type": "face"}}])"),
            "/emitters/0/surface/face: the body 'ball' has no such face: boxes have six, cylinders and "
            "frusta have a top "
            "and a bottom, cones have a bottom\n");
}

TEST(Lifetimes, GroupsAppearAndAreRemoved) {
  const LoadedScene loaded = body_scene(R"("output": {"fps": 10, "duration": 3},
    "particles": [{"name": "p", "places": [{"position": [0, 0, 0]}], "appear_at": 0.55, "remove_at": 1.25},
                  {"name": "q", "places": [{"position": [5, 0, 0]}], "appear_at": 0.5}])");
  const ModelLibrary models;
  Simulation simulation(loaded.scene, models);
  std::vector<std::size_t> counts;
  for (int i = 0; i < 20; ++i) {
    simulation.advance();
    counts.push_back(simulation.world().particle_count());
    if (i == 7) {  // at 0.7 s it has fallen for 0.15 s
      const auto& p = simulation.world().particles(simulation.particle_groups()[0].handle);
      EXPECT_NEAR(p.position[0].y(), -9.81 / 2 * 0.15 * 0.15, 1e-3);
    }
  }
  EXPECT_EQ(counts[4], 0u);
  EXPECT_EQ(counts[5], 1u);  // at 0.5 s
  EXPECT_EQ(counts[6], 2u);
  EXPECT_EQ(counts[12], 2u);
  EXPECT_EQ(counts[13], 1u);
}

// The table has a row for each particle of each frame, and both forms hold the same numbers.
TEST(ParticleTables, HoldEveryParticleOfEveryFrame) {
  const LoadedScene loaded = body_scene(R"("output": {"fps": 10, "duration": 1},
    "particles": [{"name": "placed", "places": [{"position": [0, 1, 0]}]}],
    "emitters": [{"name": "jet", "rate": 50, "lifespan": 0.5, "surface": {"position": [0, 2, 0]},
                  "trails": [{"name": "wake", "rate": 20}]}])");
  const ModelLibrary models;
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "offstage_particle_table";
  std::filesystem::create_directories(folder);
  for (const char* name : {"p.csv", "p.bin"})
    simulate_frames(
        loaded, models,
        {.cache = {}, .trace = {}, .contacts = {}, .cloths = {}, .joints = {}, .particles = folder / name},
        {});
  std::size_t expected = 0;
  Simulation simulation(loaded.scene, models);
  for (int i = 0; i < 10; ++i) {
    simulation.advance();
    expected += simulation.world().particle_count();
  }
  std::ifstream csv(folder / "p.csv");
  std::string line, last;
  std::size_t rows = 0, wakes = 0;
  std::getline(csv, line);
  EXPECT_EQ(line, "frame,time,system,id,age,x,y,z,vx,vy,vz,radius,red,green,blue,alpha");
  while (std::getline(csv, line)) {
    ++rows;
    wakes += line.find(",jet/wake,") != std::string::npos;
    last = line;
  }
  EXPECT_EQ(rows, expected);
  EXPECT_GT(wakes, 50u);
  std::ifstream binary(folder / "p.bin", std::ios::binary);
  std::getline(binary, line);
  EXPECT_NE(line.find(R"("systems":["placed","jet","jet/wake"])"), std::string::npos);
  const std::string records((std::istreambuf_iterator<char>(binary)), {});
  constexpr std::size_t kRecord = 4 + 8 + 4 + 8 + 7 * 8 + 5 * 4;
  EXPECT_EQ(records.size(), rows * kRecord);
  std::filesystem::remove_all(folder);
}

// The table has rows for both cloths. The volume of the balloon is the volume of its mesh, and p V of its gas
// is constant. The sheet has neither volume nor pressure.
TEST(ClothTables, HoldEveryVertexAndTheGasInside) {
  const LoadedScene loaded = body_scene(R"("output": {"fps": 10, "duration": 0.5},
    "cloths": [{"name": "sheet", "shape": {"type": "grid", "size": [1, 1], "cells": [2, 2]}, "position": [0, 5, 0]},
               {"name": "balloon", "shape": {"type": "sphere", "radius": 0.1, "divisions": 2}, "position": [3, 5, 0], "fabric": "balloon",
                "pressure": 3000}])");
  const ModelLibrary models;
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "offstage_cloth_table";
  std::filesystem::create_directories(folder);
  simulate_frames(loaded, models,
                  {.cache = {},
                   .trace = {},
                   .contacts = {},
                   .cloths = folder / "c.csv",
                   .joints = {},
                   .particles = {},
                   .cloth_points = folder / "v.csv"},
                  {});
  Simulation simulation(loaded.scene, models);
  const auto volume_inside = [&] {
    const sim::ClothView balloon = simulation.world().cloth(simulation.cloths()[1].handle);
    return sim::mass_properties({{balloon.points.begin(), balloon.points.end()},
                                 {balloon.triangles.begin(), balloon.triangles.end()}})
        .volume;
  };
  const Real rest_volume = volume_inside();
  for (int i = 0; i < 5; ++i) simulation.advance();
  const sim::ClothView balloon = simulation.world().cloth(simulation.cloths()[1].handle);

  std::ifstream points(folder / "v.csv"), cloths(folder / "c.csv");
  std::string line, last;
  std::getline(points, line);
  EXPECT_EQ(line, "time,cloth,vertex,x,y,z,vx,vy,vz");
  std::size_t rows = 0, of_sheet = 0;
  for (; std::getline(points, line); ++rows) {
    of_sheet += line.find(",sheet,") != std::string::npos;
    last = line;
  }
  EXPECT_EQ(of_sheet, 5u * 9u);
  EXPECT_EQ(rows - of_sheet, 5 * balloon.points.size());
  const sim::Vec3& p = balloon.points.back();
  EXPECT_NE(last.find(fmt::format(",balloon,{},{},{},{},", balloon.points.size() - 1, p.x(), p.y(), p.z())),
            std::string::npos)
      << last;

  std::getline(cloths, line);
  EXPECT_TRUE(line.ends_with(",volume,pressure"));
  std::string sheet;
  while (std::getline(cloths, line)) (line.find(",sheet,") != std::string::npos ? sheet : last) = line;
  EXPECT_TRUE(sheet.ends_with(",0,0"));
  const Real volume = volume_inside();
  EXPECT_GT(volume, 0.002);  // the undeformed ball has 0.0042 m^3
  const std::size_t comma = last.rfind(','), before = last.rfind(',', comma - 1);
  EXPECT_NEAR(std::stod(last.substr(before + 1)), volume, 1e-9);
  // The gas is isothermal: p V = p0 V0, and the skin has grown.
  EXPECT_GT(volume, 1.01 * rest_volume);
  EXPECT_NEAR(std::stod(last.substr(comma + 1)) * volume, 3000 * rest_volume, 1e-6 * 3000 * rest_volume);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace offstage::producer
