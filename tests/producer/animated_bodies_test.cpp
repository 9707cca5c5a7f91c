// Bodies whose model file plays an animation: the motion of their pieces, and the bodies that these push.

#include "producer/build/animated_bodies.h"

#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>

#include "producer/build/picture.h"
#include "producer/build/simulation.h"
#include "producer/format/scene_io.h"
#include "tests/render/gltf_samples.h"
#include "tests/render/scratch.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;

/// A folder with a cube of 1 m that moves from x = 0 to x = 2 in 2 s.
struct CubeFolder : render::ScratchFolder {
  CubeFolder() {
    render::GltfSample sample;
    std::vector<float> corners;
    for (int k = 0; k < 8; ++k)
      for (int axis = 0; axis < 3; ++axis) corners.push_back(k >> axis & 1 ? 0.5f : -0.5f);
    sample.primitive()["attributes"] = {{"POSITION", sample.accessor(corners, "VEC3")}};
    sample.primitive()["indices"] =
        sample.accessor(std::vector<uint16_t>{0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                              2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5},
                        "SCALAR");
    sample.document["nodes"][0]["name"] = "cube";
    const int times = sample.accessor(std::vector<float>{0, 2}, "SCALAR"),
              places = sample.accessor(std::vector<float>{0, 0, 0, 2, 0, 0}, "VEC3");
    sample.document["animations"] = {
        {{"name", "slide"},
         {"samplers", {{{"input", times}, {"output", places}}}},
         {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "translation"}}}}}}}};
    put("cube.gltf", sample.text());
  }
};

std::string pusher_scene(const std::string& animation, const std::string& more = "") {
  return R"({"world": {"gravity": [0, 0, 0]}, "materials": [{"name": "slick", "friction": 0, "restitution": 0}],
    "bodies": [{"name": "pusher", "motion": "static", "material": "slick", "shape": {"type": "mesh", "file": "cube.gltf"},
                "animation": )" +
         animation + R"(},
               {"name": "ball", "material": "slick", "shape": {"type": "sphere", "radius": 0.25}, "position": [1, 0, 0]})" +
         more + R"(], "output": {"fps": 10, "duration": 1.1}})";
}

struct Loaded {
  explicit Loaded(const std::string& text, const fs::path& folder)
      : loaded(parse_scene(text, "scene", folder)), models(loaded.scene, loaded.folder, {}, warnings) {}
  std::vector<Problem> warnings;
  LoadedScene loaded;
  ModelLibrary models;
};

std::string why_not(const std::string& text, const fs::path& folder) {
  try {
    Loaded(text, folder);
  } catch (const SceneError& error) {
    return error.what();
  }
  return "";
}

TEST(AnimatedBodies, PushOtherBodiesWithTheSpeedOfTheAnimation) {
  const CubeFolder folder;
  Loaded scene(pusher_scene(R"({"loop": false})"), folder.path());
  Simulation simulation(scene.loaded.scene, scene.models);
  for (int frame = 0; frame < scene.loaded.scene.frame_count(); ++frame) simulation.advance();
  ASSERT_EQ(simulation.moving_bodies().size(), 1u) << "the pieces are not among the bodies of the scene";
  const sim::BodyState ball = simulation.world().body(simulation.moving_bodies()[0].handle);
  // The face reaches the ball after 0.25 s; at 1 s it is at x = 1.5.
  EXPECT_NEAR(ball.velocity.x(), 1, 1e-3);
  EXPECT_NEAR(ball.pose.position.x(), 1.75, 5e-3);
}

// The cube moves by 0.5 m while the shutter is open, so the light of its edges grows and fades over 0.5 m
// each, and it is complete in the 0.5 m between.
TEST(AnimatedBodies, AreBlurredAlongTheirAnimation) {
  const CubeFolder folder;
  Loaded scene(R"({"materials": [{"name": "glow", "color": [0, 0, 0], "emission": [1, 1, 1]}],
    "bodies": [{"motion": "static", "collides": false, "material": "glow",
                "shape": {"type": "mesh", "file": "cube.gltf"}, "animation": {"loop": false}}],
    "camera": {"type": "static", "eye": [0.75, 0, 10.5], "target": [0.75, 0, 0], "fov_deg": 20},
    "environment": {"intensity": 0}, "lights": [{"type": "sun", "intensity": 0}],
    "render": {"size": [192, 96], "quality": "final", "shutter": 1, "bloom": 0},
    "output": {"fps": 2, "duration": 1.6}})",
               folder.path());
  Simulation simulation(scene.loaded.scene, scene.models);
  simulation.advance();
  const Snapshot before = simulation.snapshot();
  simulation.advance();
  const Snapshot after = simulation.snapshot();
  render::Context context;
  Picture picture(scene.loaded.scene, scene.models, context);
  picture.draw(before, after);
  const render::HdrImage image = picture.linear();
  const double metres_per_pixel = 10 * std::tan(10 * std::acos(-1.0) / 180) / 48;
  double partial = 0, whole = 0;
  for (std::size_t x = 0; x < 192; ++x) {
    const float light = image.rgba[4 * (192 * 48 + x)];
    (light > 0.97f ? whole : partial) += light > 0.03f ? metres_per_pixel : 0;
  }
  EXPECT_NEAR(whole, 0.5, 0.1);
  EXPECT_NEAR(partial, 1, 0.15);
}

TEST(AnimatedBodies, StartSpeedAndRepetitionDetermineTheTimeInTheClip) {
  const ModelAnimation late{.clip = "", .speed = 2, .start = 1, .loop = true};
  EXPECT_DOUBLE_EQ(clip_time(late, 3, 0.5), 0);
  EXPECT_DOUBLE_EQ(clip_time(late, 3, 2), 2);
  EXPECT_DOUBLE_EQ(clip_time(late, 3, 3), 1) << "the second time";
  const ModelAnimation once{.clip = "", .speed = 2, .start = 1, .loop = false};
  EXPECT_DOUBLE_EQ(clip_time(once, 3, 30), 3);
  EXPECT_DOUBLE_EQ(clip_time(once, 0, 30), 0);
}

TEST(AnimatedBodies, PiecesMoveWithTheirNodeAndTheBody) {
  const CubeFolder folder;
  Loaded scene(pusher_scene(R"({"loop": true})"), folder.path());
  const Body& body = scene.loaded.scene.bodies[0];
  const render::ModelRig& rig = scene.models.model("cube.gltf").rig;
  const auto& pieces = scene.models.pieces(body);
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_EQ(pieces[0].name, "cube");
  EXPECT_EQ(pieces[0].parts.parts.size(), 1u) << "a cube is convex";
  // A body that turns by a quarter in 1 s carries the cube, which is enlarged by two.
  sim::KeyframeTrack turning;
  turning.spin = {0, std::acos(-1.0) / 2, 0};
  const sim::KeyframeTrack track = piece_track(rig, pieces[0], *body.animation, turning, {}, 2, 4);
  const sim::Pose at = track.at(1, {}).pose;
  EXPECT_LT((at.position - Vec3(0, 0, -2)).norm(), 1e-6) << at.position.transpose();
  // The clip is not closed: at its end, the piece jumps.
  EXPECT_TRUE(track.jumps(1.9, 2.1));
  EXPECT_FALSE(track.jumps(0.5, 1.5));
}

TEST(AnimatedBodies, BonesCollideAsTheHullsOfTheirSkin) {
  const fs::path models = fs::path(OFFSTAGE_SOURCE_DIR) / "assets/models";
  Loaded scene(
      R"({"bodies": [{"name": "arm", "motion": "static", "shape": {"type": "mesh", "file": "tentacle.glb"},
                   "animation": {"clip": "sweep"}}]})",
      models);
  const auto& pieces = scene.models.pieces(scene.loaded.scene.bodies[0]);
  std::vector<std::string> names;
  for (const AnimatedPiece& piece : pieces) names.push_back(piece.name);
  EXPECT_EQ(names, (std::vector<std::string>{"foot", "ring", "bone_0", "bone_1", "bone_2", "bone_3", "bone_4",
                                             "bone_5"}));
  // The hulls follow the skin. A vertex that two bones share equally lies half way between its two rigid
  // places. Its distance from each is half of the change of the bend angle since the start of the clip (at
  // most 2 * 0.34 rad) times its distance from the joint (at most the radius of 0.185 m).
  const double shared = 0.5 * (2 * 0.34) * 0.185;
  const render::ModelRig& rig = scene.models.model("tentacle.glb").rig;
  std::vector<sim::KeyframeTrack> tracks;
  for (const AnimatedPiece& piece : pieces) tracks.push_back(piece_track(rig, piece, {}, {}, {}, 1, 4));
  for (const float time : {0.f, 0.7f, 2.9f}) {
    const render::RigPose pose = render::pose_at(rig, 0, time);
    double farthest = 0;
    for (const render::RigSurface& surface : rig.surfaces) {
      if (surface.skin < 0) continue;
      for (const Eigen::Vector3f& p : render::deformed(rig, surface, pose).positions) {
        double outside = 1e9;
        for (std::size_t k = 0; k < pieces.size(); ++k) {
          const sim::Pose at = tracks[k].at(time, {}).pose;
          const Vec3 local = at.orientation.conjugate() * (p.cast<double>() - at.position);
          for (const sim::ConvexPolyhedron& part : pieces[k].parts.parts) {
            double distance = -1e9;
            for (uint32_t f = 0; f < part.face_count(); ++f)
              distance = std::max(distance, part.plane(f).normal.dot(local) - part.plane(f).offset);
            outside = std::min(outside, distance);
          }
        }
        farthest = std::max(farthest, outside);
      }
    }
    EXPECT_LT(farthest, time == 0 ? 1e-5 : shared) << time;
  }
}

TEST(AnimatedBodies, UnusableAnimationsAreRefusedByName) {
  const CubeFolder folder;
  EXPECT_NE(why_not(pusher_scene(R"({"clip": "slid"})"), folder.path()).find("did you mean 'slide'"),
            std::string::npos);
  EXPECT_NE(
      why_not(
          pusher_scene(
              "{}",
              R"(, {"name": "d", "position": [9, 0, 0], "shape": {"type": "mesh", "file": "cube.gltf"}, "animation": {}})"),
          folder.path())
          .find("dynamic"),
      std::string::npos);
  EXPECT_NE(
      why_not(pusher_scene(
                  "{}", R"(, {"name": "s", "motion": "static", "shape": {"type": "box"}, "animation": {}})"),
              folder.path())
          .find("needs a model file"),
      std::string::npos);
}

}  // namespace
}  // namespace offstage::producer
