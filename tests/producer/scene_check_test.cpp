#include "producer/format/scene_check.h"

#include <cmath>

#include <gtest/gtest.h>

#include "producer/format/scene_check_particles.h"
#include "producer/format/scene_io.h"

namespace offstage::producer {
namespace {

std::string lines(const std::vector<Problem>& problems) {
  std::string text;
  for (const Problem& problem : problems) text += problem.where.path + ": " + problem.what + "\n";
  return text;
}

/// Paths and texts of all errors, one per line.
std::string errors_of(const std::string& text) {
  try {
    parse_scene(text, "s", OFFSTAGE_SOURCE_DIR);
  } catch (const SceneError& error) {
    return lines(error.problems());
  }
  return "";
}
std::string warnings_of(const std::string& text) {
  return lines(parse_scene(text, "s", OFFSTAGE_SOURCE_DIR).warnings);
}

TEST(SceneCheck, NamesAreUniqueWithinASection) {
  EXPECT_EQ(errors_of(R"({"bodies": [{"name": "a"}, {"name": "a"}], "particles": [{"name": "a"}]})"),
            "/bodies/1/name: the name 'a' is already used by /bodies/0\n");
  EXPECT_EQ(errors_of(R"({"bodies": [{}, {"name": "body_0"}]})"),
            "/bodies/1/name: the name 'body_0' is already used by /bodies/0\n");
  EXPECT_EQ(errors_of(R"({"bodies": [{"name": "a", "repeat": {"count": 2}}, {"name": "a_1"}]})"),
            "/bodies/1/name: the name 'a_1' is already used by /bodies/0\n");
}

TEST(SceneCheck, ABodyAndAClothHaveDifferentNames) {
  EXPECT_EQ(errors_of(R"({"bodies": [{"name": "a"}], "cloths": [{"name": "a"}]})"),
            "/cloths/0/name: the name 'a' is already used by /bodies/0\n");
}

TEST(SceneCheck, ABevelIsForBoxes) {
  EXPECT_EQ(warnings_of(R"({"bodies": [{"shape": {"type": "sphere"}, "bevel": 0.1}]})"),
            "/bodies/0/bevel: has no effect: the body is not drawn as a box\n");
  EXPECT_EQ(warnings_of(R"({"bodies": [{"shape": {"type": "box"}, "bevel": 0}]})"), "");
}

TEST(SceneCheck, EmittersThatPushABodyOrGetItsVelocityNeedOne) {
  EXPECT_EQ(errors_of(R"({"emitters": [{"inherit_velocity": 0.5}]})"),
            "/emitters/0/inherit_velocity: is a fraction of the velocity of a body; the emitter needs a "
            "\"body\"\n");
  EXPECT_EQ(errors_of(R"({"emitters": [{"recoil": true}]})"),
            "/emitters/0/recoil: pushes a body back; the emitter needs a \"body\"\n");
  const std::string on_body = R"("emitters": [{"body": "a", "recoil": true, "inherit_velocity": 0.5}]})";
  EXPECT_EQ(errors_of(R"({"bodies": [{"name": "a", "motion": "static"}], )" + on_body),
            "/emitters/0/recoil: pushes dynamic bodies only, and \"a\" is not dynamic\n");
  EXPECT_EQ(errors_of(R"({"bodies": [{"name": "a"}], )" + on_body), "");
  EXPECT_EQ(errors_of(R"({"bodies": [{"name": "a"}],
                          "emitters": [{"body": "a", "surface": {"type": "face", "size": [1, 2, 3]}}]})"),
            "/emitters/0/surface: has the faces of the emitter's body; \"position\" and \"size\" are for an "
            "emitter without "
            "a body\n");
}

TEST(SceneCheck, NamesReferToExistingObjects) {
  EXPECT_EQ(errors_of(R"({
    "materials": [{"name": "steel"}],
    "bodies": [{"name": "ball", "material": "stele"}, {"name": "rock", "repeat": {"count": 2}}],
    "particles": [{"name": "chain", "places": [{}]}],
    "emitters": [{"body": "bal"}, {"body": "rock"}, {"body": "rock_1"}],
    "springs": [{"a": {"body": "ball"}, "b": {"particles": "chian"}, "material": "glass"},
                {"a": {"body": "ball"}, "b": {"particles": "chain", "index": 1}}],
    "camera": {"type": "follow", "body": "car"}})"),
            "/bodies/0/material: there is no material 'stele'; did you mean 'steel'?\n"
            "/emitters/0/body: there is no body 'bal'; did you mean 'ball'?\n"
            "/emitters/1/body: the body 'rock' has copies; name one of them, such as 'rock_0'\n"
            "/springs/0/b/particles: there are no particles 'chian'; did you mean 'chain'?\n"
            "/springs/0/material: there is no material 'glass'; known: 'steel'\n"
            "/springs/1/b/index: must be less than 1, the number of particles of 'chain', got 1\n"
            "/camera/body: there is no body 'car'; known: 'ball', 'rock_0', 'rock_1'\n");
}

TEST(SceneCheck, AlgorithmsWithoutEffectAreRefused) {
  EXPECT_EQ(
      errors_of(R"({"world": {"collision": {"cell_factor": 3, "trees": "obb", "tree_split": "mean",
    "mesh_pairs": "triangles"}, "particle_cluster": 8}, "bodies": [{"name": "box"}]})"),
      "/world/collision/cell_factor: is for \"broad_phase\": \"grid\"; \"multi_grid\" chooses its cells "
      "by the size of each body\n"
      "/world/collision/trees: has no effect: no body has the shape of a mesh or a compound\n"
      "/world/collision/tree_split: has no effect: no body has the shape of a mesh or a compound\n"
      "/world/collision/mesh_pairs: has no effect: it needs two bodies with the shape of a mesh; there are "
      "0\n"
      "/world/particle_cluster: is for \"particle_contacts\": \"lcp\"\n");
  const std::string rings = R"("bodies": [{"name": "ring", "shape": {"type": "torus"}, "position": [0, 5, 0],
    "repeat": {"count": 2, "offset": [0, 4, 0]}}])";
  EXPECT_EQ(errors_of(R"({"world": {"collision": {"broad_phase": "grid", "cell_factor": 3, "trees": "obb",
    "tree_split": "mean", "mesh_pairs": "triangles"}, "particle_contacts": "lcp", "particle_cluster": 8}, )" +
                      rings + "}"),
            "");
  EXPECT_NE(errors_of(R"({"world": {"particle_contacts": "lcp", "particle_cluster": 65}})").find("64"),
            std::string::npos);
  EXPECT_NE(errors_of(R"({"world": {"collision": {"broad_phase": "grid", "cell_factor": 0}}})").find("0.1"),
            std::string::npos);
  EXPECT_NE(errors_of(R"({"world": {"solver": "dantzig"}})").find("lcp"), std::string::npos);
  EXPECT_NE(warnings_of(
                R"({"world": {"solver": "lcp"}, "materials": [{"name": "felt", "rolling_friction": 0.01}]})")
                .find("'felt'"),
            std::string::npos);
}

TEST(SceneCheck, OverlaysNameExistingObjects) {
  EXPECT_EQ(errors_of(R"({
    "bodies": [{"name": "ball"}, {"name": "floor", "motion": "static", "shape": {"type": "plane"}},
               {"name": "wall", "motion": "static", "shape": {"type": "plane"}},
               {"name": "rock", "shape": {"type": "mesh", "file": "LICENSE"}}],
    "overlays": [
      {"type": "tree", "body": "ball"}, {"type": "parts", "body": "rokc"},
      {"type": "tree", "body": "rock", "level": {"mean": 2, "deviation": 1}},
      {"type": "parts", "body": "rock", "explode": {"range": [0, 1]}},
      {"type": "closest", "a": "ball", "b": "ball"}, {"type": "contacts", "a": "ball"},
      {"type": "contacts", "a": "wall", "b": "floor"}, {"type": "contacts"},
      {"type": "closest", "a": "rock", "b": "floor"}]})"),
            "/overlays/0/body: the body 'ball' has no mesh\n"
            "/overlays/1/body: there is no body 'rokc'; did you mean 'rock'?\n"
            "/overlays/2/level: must be a number or a curve over time, not a random distribution\n"
            "/overlays/3/explode: must be a number or a curve over time, not a random distribution\n"
            "/overlays/4/b: is the same body as \"a\"\n"
            "/overlays/5/b: there is no body ''; known: 'ball', 'floor', 'wall', 'rock'\n"
            "/overlays/6: two planes never have a contact\n");
  EXPECT_EQ(
      errors_of(R"({"overlays": [{"type": "tree", "body": "a", "level": -1}, {"body": "a"}]})"),
      "/overlays/0/body: there is no body 'a'\n"
      "/overlays/0/level: must be between 0 and 16, got -1\n"
      "/overlays/1/type: is required; it must be one of \"tree\", \"parts\", \"closest\", \"contacts\", "
      "\"velocities\", \"islands\", \"joints\", \"cloth\", \"trails\" or \"text\"\n");
}

TEST(SceneCheck, FilesMustExist) {
  EXPECT_EQ(errors_of(R"({"materials": [{"texture": "no.png"}],
                          "bodies": [{"material": "material_0", "shape": {"type": "mesh", "file": "no.obj"}},
                                     {"model": {"file": "LICENSE"}}]})"),
            "/materials/0/texture: there is no file '" OFFSTAGE_SOURCE_DIR
            "/no.png'\n"
            "/bodies/0/shape/file: there is no file '" OFFSTAGE_SOURCE_DIR "/no.obj'\n");
}

TEST(SceneCheck, OnlyKinematicBodiesFollowKeysAndPlanesDoNotMove) {
  EXPECT_EQ(
      errors_of(
          R"({"bodies": [{"keyframes": [{}]}, {"motion": "static", "spin": [0, 1, 0]}, {"shape": {"type": "plane"}},
                                     {"motion": "kinematic", "keyframes": [{"time": 1}, {"time": 1}, {"time": 0}]}]})"),
      "/bodies/0/keyframes: only kinematic bodies follow keyframes; give the body \"motion\": \"kinematic\"\n"
      "/bodies/1/spin: only kinematic bodies have a spin; give the body \"motion\": \"kinematic\"\n"
      "/bodies/2/shape: a plane cannot be dynamic; give the body \"motion\": \"static\"\n"
      "/bodies/3/keyframes/1/time: times must increase, got 1 after 1\n"
      "/bodies/3/keyframes/2/time: times must increase, got 0 after 1\n");
}

TEST(SceneCheck, CameraAndSunAreValid) {
  EXPECT_EQ(
      errors_of(
          R"({"camera": {"eye": [1, 1, 1], "target": [1, 1, 1]}, "lights": [{"direction": [1, 0, 0]}, {}]})"),
      "/camera: the camera is at the point that it looks at\n"
      "/lights/0/direction: the sun must be above the horizon: y must be greater than 0\n"
      "/lights/1: a scene has at most one sun\n");
  EXPECT_EQ(errors_of(R"({"camera": {"type": "keyframes"}})"),
            "/camera: needs at least one entry in \"keyframes\"\n");
}

TEST(SceneCheck, AFilmHasAtLeastOneFrame) {
  EXPECT_EQ(errors_of(R"({"output": {"fps": 10, "duration": 0.04}})"),
            "/output/duration: is shorter than one frame at 10 frames per second\n");
  EXPECT_EQ(errors_of(R"({"output": {"fps": 10, "duration": 0.06}})"), "");
}

TEST(SceneCheck, KeysWithoutEffectGiveWarnings) {
  EXPECT_EQ(
      warnings_of(R"({
    "materials": [{"name": "lone"}],
    "bodies": [{"name": "b", "motion": "static", "velocity": [1, 0, 0]}, {"mass": 2, "density": 7}],
    "emitters": [{"rate": 0}],
    "springs": [{"a": {"body": "b"}, "b": {"position": [0, 1, 0]}}],
    "render": {"size": [321, 180]}})"),
      "/materials/0: the material 'lone' is not used\n"
      "/bodies/0/velocity: has no effect: the body is not dynamic\n"
      "/bodies/1/density: has no effect: \"mass\" is given\n"
      "/emitters/0: releases no particles: rate, count and bursts are zero, or their times are outside "
      "the film\n"
      "/springs/0: has no effect: neither end can move\n"
      "/render/size: has an odd width or height; most video formats need even numbers, such as 1280 x 720\n");
}

TEST(SceneCheck, ContactRulesNameTwoMaterialsOnce) {
  EXPECT_EQ(errors_of(R"({"materials": [{"name": "ice"}, {"name": "steel"}],
    "bodies": [{"material": "ice"}, {"material": "steel"}],
    "contacts": [{"materials": ["ice", "steel"], "friction": 0.02}, {"materials": ["steel", "ice"], "friction": 1},
                 {"materials": ["ice", "stele"], "restitution": 1}, {"materials": ["ice"]}, {"friction": 1},
                 {"materials": ["ice", ""], "restitution": 2}]})"),
            "/contacts/1/materials: are the same pair as in /contacts/0; remove one of the two rules\n"
            "/contacts/2/materials/1: there is no material 'stele'; did you mean 'steel'?\n"
            "/contacts/3/materials: must be a list of 2 values, got 1 items\n"
            "/contacts/4/materials: is required: names of two materials, in any order; may be the same\n"
            "/contacts/5/materials/1: must not be empty\n"
            "/contacts/5/restitution: must be between 0 and 1, got 2\n");
  EXPECT_EQ(warnings_of(R"({"bodies": [{"name": "a"}], "forces": [{"type": "applied", "bodies": ["a"]}]})"),
            "/forces/0: has no effect: it has neither a force nor a torque nor keyframes\n");
  EXPECT_EQ(warnings_of(R"({"materials": [{"name": "ice"}], "bodies": [{"material": "ice"}],
                           "contacts": [{"materials": ["ice", "ice"]}]})"),
            "/contacts/0: has no effect: it has neither restitution nor friction\n");
}

TEST(SceneCheck, CrossFrictionNeedsMaterialAndAxis) {
  EXPECT_EQ(warnings_of(R"({"materials": [{"name": "planks", "cross_friction": 1}, {"name": "ice"}],
    "bodies": [{"material": "planks"}, {"material": "ice", "friction_axis": [1, 0, 0]}]})"),
            "/materials/0/cross_friction: has no effect: no body of this material has a friction_axis\n"
            "/bodies/1/friction_axis: has no effect: the body's material has no cross_friction\n");
  EXPECT_EQ(warnings_of(R"({"materials": [{"name": "planks", "cross_friction": 1}],
    "bodies": [{"material": "planks", "friction_axis": [1, 0, 0]}]})"),
            "");
  EXPECT_EQ(errors_of(R"({"materials": [{"name": "skate", "friction": 0, "cross_friction": 1}],
    "bodies": [{"material": "skate", "friction_axis": [1, 0, 0]}]})"),
            "/materials/0/cross_friction: needs a \"friction\" above 0, such as 0.001: friction across the "
            "axis is a multiple of friction along it\n");
}

TEST(SceneCheck, ForcesNameExistingObjects) {
  EXPECT_EQ(errors_of(R"({"bodies": [{"name": "crate", "repeat": {"count": 2}}, {"name": "ball", "mass": 1}],
    "forces": [{"type": "constant", "bodies": ["crate_1", "bal", "crate"]}, {"type": "wind", "end": 0},
               {"type": "grab", "body": "ball"},
               {"type": "grab", "body": "ball", "keyframes": [{"time": 1}, {"time": 1}]},
               {"type": "explosion", "name": "force_0"}, {"type": "field"}]})"),
            "/forces/0/bodies/1: there is no body 'bal'; did you mean 'ball'?\n"
            "/forces/1/end: must be later than the start, 0 s\n"
            "/forces/2: needs at least one entry in \"keyframes\"\n"
            "/forces/3/keyframes/1/time: times must increase, got 1 after 1\n"
            "/forces/4/name: the name 'force_0' is already used by /forces/0\n"
            "/forces/5/type: must be one of \"constant\", \"point\", \"wind\", \"grab\", \"explosion\", "
            "\"vortex\", \"turbulence\", \"gravitation\", \"coulomb\", \"lennard_jones\" or \"applied\", got "
            "the string "
            "\"field\"\n");
  EXPECT_EQ(warnings_of(R"({"bodies": [{"name": "wall", "motion": "static"}, {"name": "ball"}],
    "forces": [{"type": "point", "bodies": ["ball", "wall"], "drop_rate": 1}]})"),
            "/forces/0/bodies/1: has no effect: the body 'wall' is not dynamic\n"
            "/forces/0/drop_rate: has no effect without a region\n");
}

TEST(SceneCheck, EventsAtUnreachableAgesAreErrors) {
  const auto scene = [](const std::string& more) {
    return R"({"emitters": [{"lifespan": {"mean": 1, "deviation": 0.2}, )" + more + "}]}";
  };
  EXPECT_EQ(errors_of(scene(R"("split": {"age": 1.5})")),
            "/emitters/0/split/age: is 1.5 s, but the lifespan is at most 1.2 s, so particles never split; "
            "it must be less than the lifespan\n");
  EXPECT_NE(errors_of(scene(R"("trails": [{"start_age": 1.2}])")), "");
  EXPECT_NE(errors_of(scene(R"("on_age": [{"age": 2}])")), "");
  EXPECT_NE(errors_of(scene(R"("on_death": [{"lifespan": 0.3, "split": {"age": 0.3}}])")), "");
  EXPECT_EQ(
      errors_of(scene(R"("split": {"age": 1.1}, "trails": [{"start_age": 1}], "on_age": [{"age": 1.1}])")),
      "");
  EXPECT_EQ(errors_of(scene(R"("split": {"age": 1.5, "enabled": false})")), "");
  EXPECT_EQ(errors_of(scene(R"("split": {"age": 0.5, "delay": 0.2, "delay_steps": 10})")),
            "/emitters/0/split/delay: is replaced by \"delay_steps\"; remove one of them\n");
}

// --- Springs ---

/// Integrates x'' = -k x from rest at x = 1 and returns whether the solution stays bounded.
bool stays_bounded(sim::IntegratorKind kind, Real k, Real h) {
  Real x = 1, v = 0;
  const auto a = [&](Real x1) { return -k * x1; };
  for (int i = 0; i < 20000 && std::abs(x) < 1e6; ++i) {
    if (kind == sim::IntegratorKind::symplectic_euler) {
      v += h * a(x);
      x += h * v;
    } else {
      const Real x2 = x + h / 2 * v, v2 = v + h / 2 * a(x), x3 = x + h / 2 * v2, v3 = v + h / 2 * a(x2);
      const Real x4 = x + h * v3, v4 = v + h * a(x3);
      const Real next = v + h / 6 * (a(x) + 2 * a(x2) + 2 * a(x3) + a(x4));
      x += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
      v = next;
    }
  }
  return std::abs(x) < 1e6;
}

TEST(SceneCheck, TheLargestStableStepIsWhereTheIntegratorsDiverge) {
  using enum sim::IntegratorKind;
  for (const auto kind : {symplectic_euler, rk4}) {
    const Real h = largest_stable_step(kind, 400, 1);
    EXPECT_TRUE(stays_bounded(kind, 400, 0.99 * h));
    EXPECT_FALSE(stays_bounded(kind, 400, 1.01 * h));
  }
}

TEST(SceneCheck, ASpringTooStiffForItsStepIsNamedWithTheStepItNeeds) {
  const auto scene = [](Real stiffness, const std::string& integrator) {
    return R"({"world": {"step": 0.01, "integrator": ")" + integrator + R"("},
               "particles": [{"name": "p", "places": [{}, {"position": [1, 0, 0]}], "mass": 2}],
               "springs": [{"name": "tie", "a": {"particles": "p"}, "b": {"particles": "p", "index": 1}, "stiffness": )" +
           std::to_string(stiffness) + "}]}";
  };
  // The reduced mass is 1 kg: the bound 2 sqrt(1 / k) is 0.01 s at k = 40000 N/m, 2.83 sqrt(1 / k) at k =
  // 80000.
  EXPECT_EQ(errors_of(scene(39000, "symplectic_euler")), "");
  EXPECT_EQ(errors_of(scene(41000, "symplectic_euler")),
            "/springs/0: the spring 'tie' is too stiff for this sub-step: /world/step must be less than "
            "0.00983 s, is 0.01 s\n");
  EXPECT_EQ(errors_of(scene(79000, "rk4")), "");
  EXPECT_NE(errors_of(scene(81000, "rk4")), "");
}

// Springs in line add up. Those along different axes do not.
TEST(SceneCheck, SpringsAtTheSameObjectsAreCheckedTogether) {
  const auto scene = [](Real stiffness, std::vector<std::string> ends) {
    std::string springs;
    for (const std::string& end : ends)
      springs += (springs.empty() ? "" : ",") + (R"({"a": {"body": "b"}, "b": {"position": )" + end) +
                 R"(}, "stiffness": )" + std::to_string(stiffness) + "}";
    return R"({"world": {"step": 0.01, "integrator": "leapfrog"}, "bodies": [{"name": "b", "mass": 1}],
               "springs": [)" +
           springs + "]}";
  };
  // A spring alone may have 40000 N/m.
  EXPECT_EQ(errors_of(scene(39000, {"[1, 0, 0]", "[0, 1, 0]", "[0, 0, 1]"})), "");
  EXPECT_EQ(errors_of(scene(19500, {"[1, 0, 0]", "[-1, 0, 0]"})), "");
  EXPECT_EQ(
      errors_of(scene(20500, {"[1, 0, 0]", "[-1, 0, 0]"})),
      "/springs/0: the spring 'spring_0' and others at the same objects are together too stiff for this "
      "sub-step: /world/step must be less than 0.00983 s, is 0.01 s\n");
}

TEST(SceneCheck, ASpringEndMustBeOneThing) {
  EXPECT_EQ(errors_of(R"({"bodies": [{"name": "b"}], "particles": [{"name": "p", "places": [{}]}],
    "springs": [{"a": {"body": "b", "particles": "p"}}, {"a": {"particles": "p"}, "b": {"particles": "p"}}]})"),
            "/springs/0/a: must name a body or a particle, not both\n"
            "/springs/1: has the same particle at both ends\n");
}

// --- Emitters ---

TEST(SceneCheck, TooManyParticlesAreAnErrorAndHeldBackOnesAWarning) {
  EXPECT_EQ(warnings_of(R"({"emitters": [{"rate": 1000, "lifespan": 2, "max_alive": 1900}]})"),
            "/emitters/0/max_alive: may prevent releases: up to 2e+03 particles could exist at once, 1900 "
            "are allowed\n");
  EXPECT_EQ(warnings_of(R"({"emitters": [{"rate": 1000, "lifespan": 2, "max_alive": 2000}]})"), "");
  EXPECT_EQ(errors_of(R"({"emitters": [{"rate": 1.1e7, "lifespan": 2}]})"),
            "/emitters/0: could have 2.2e+07 particles at once, more than the limit of 2e+07; reduce rate, "
            "count or lifespan\n");
}

TEST(SceneCheck, ASplitThatExplodesIsRefused) {
  const auto scene = [](int depth) {
    return R"({"emitters": [{"rate": 10, "split": {"count": 9, "age": 0.1, "delay": 0.1, "depth": )" +
           std::to_string(depth) + "}}]}";
  };
  EXPECT_EQ(errors_of(scene(2)), "");
  EXPECT_NE(errors_of(scene(9)).find("/emitters/0: could have 5e+10 particles at once"), std::string::npos)
      << errors_of(scene(9));
}

TEST(SceneCheck, BoundsCountDescendants) {
  const Scene scene = parse_scene(R"({"output": {"duration": 1}, "emitters": [
    {"name": "shell", "rate": 0, "bursts": [{"count": 3}], "lifespan": 0.5,
     "trails": [{"name": "tail", "rate": 100, "lifespan": 9}],
     "on_death": [{"name": "star", "count": 20, "on_death": [{"count": 2}]}]}]})",
                                  "s", OFFSTAGE_SOURCE_DIR)
                          .scene;
  std::string text;
  for (const ParticleBound& bound : particle_bounds(scene))
    text += bound.name + " " + std::to_string(bound.alive) + "\n";
  EXPECT_EQ(text, "shell 3\nshell/tail 150\nshell/star 60\nshell/star/on_death_0 120\n");
}

TEST(SceneCheck, ForcesNameParticles) {
  EXPECT_EQ(errors_of(R"({
    "emitters": [{"name": "rain", "on_collision": [{"name": "splash"}], "repeat": {"count": 2, "offset": [1, 0, 0]}}],
    "forces": [{"type": "turbulence", "particles": ["rain", "rain/splash", "rain_1/splash"]},
               {"type": "vortex", "particles": ["rain/spalsh"]}, {"type": "grab", "keyframes": [{}]},
               {"type": "coulomb"}]})"),
            "/forces/1/particles/0: there are no particles 'rain/spalsh'; did you mean 'rain/splash'?\n"
            "/forces/2: needs a \"body\", \"particles\" or \"cloths\"\n"
            "/forces/3/particles: is required: names of particle groups and emitters whose particles act on "
            "each other\n");
}

TEST(SceneCheck, ASurfaceHasRoomForAParticle) {
  EXPECT_EQ(errors_of(R"({"emitters": [{"radius": 0.06}]})"),
            "/emitters/0/surface: is 0.1 m wide, too small for the smallest particle, 0.12 m; make it "
            "larger, or set \"overlap\" to true\n");
  EXPECT_EQ(warnings_of(R"({"emitters": [{"radius": {"range": [0.04, 0.06]}}]})"),
            "/emitters/0/surface: is 0.1 m wide, too small for the largest particles, which will be released "
            "late or not at all\n");
}

TEST(SceneCheck, AgesDoNotDecreaseAndEmittersEndAfterTheyStart) {
  EXPECT_EQ(
      errors_of(
          R"({"emitters": [{"start": 2, "end": 1, "look": {"size_over_age": [[0, 1], [0.5, 2], [0.4, 1]]}}]})"),
      "/emitters/0/end: must be later than the start, 2 s\n"
      "/emitters/0/look/size_over_age/2: ages must not decrease\n");
}

// Drag, dampers and grabs are stable for any strength.
TEST(SceneCheck, StrongDragIsAllowed) {
  EXPECT_EQ(errors_of(R"({"world": {"step": 0.01},
    "bodies": [{"name": "b", "mass": 1, "linear_drag": 1000, "angular_drag": 30}],
    "particles": [{"name": "p", "integrator": "symplectic_euler", "mass": 0.01, "linear_drag": 10, "places": [{}]}],
    "springs": [{"a": {"body": "b"}, "b": {"position": [0, 1, 0]}, "damping": 5000}],
    "forces": [{"type": "wind", "drag": 300},
               {"type": "grab", "body": "b", "keyframes": [{}], "stiffness": 90000, "damping": 1000}]})"),
            "");
}

TEST(SceneCheck, NothingStartsOutsideTheWorld) {
  EXPECT_NE(errors_of(R"({"bodies": [{"position": [5000, 0, 0]}]})")
                .find("/bodies/0/position: is outside the world"),
            std::string::npos);
  EXPECT_EQ(errors_of(R"({"world": {"bounds": 6000}, "bodies": [{"position": [5000, 0, 0]}]})"), "");
}

TEST(SceneCheck, KeysThatSpheresIgnoreGiveWarnings) {
  EXPECT_NE(
      warnings_of(
          R"({"particles": [{"places": [{}], "look": {"style": "sphere", "color": "#ff000080", "additive": true}}]})")
          .find("/particles/0/look/color: alpha has no effect"),
      std::string::npos);
}

}  // namespace
}  // namespace offstage::producer
