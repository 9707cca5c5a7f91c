// Depth, normals, ids and motion compared with closed forms.

#include "render/channels.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/render/gl_fixture.h"
#include "tests/render/scratch.h"

namespace offstage::render {
namespace {

std::size_t at(const Channels& c, int x, int y) {
  return static_cast<std::size_t>(y * c.width_px + x);
}
std::size_t middle(const Channels& c) {
  return at(c, c.width_px / 2, c.height_px / 2);
}

TEST(StageChannels, DepthOfTheGroundIsTheClosedForm) {
  SmallStage s;
  const Camera camera{.eye = {0, 2, 5}, .target = {0, 0, 0}, .fov_deg = 40};
  s.stage.set_camera(camera);
  const InstanceHandle ground = s.add(make_ground(1000), {});
  s.stage.set_object(ground, 7);
  const Channels c = s.stage.channels(0);
  const Vector3f forward = (camera.target - camera.eye).normalized(), right = Vector3f::UnitX(),
                 up = right.cross(forward);
  const float tan_y = std::tan(20 * 0.0174532925f), tan_x = tan_y * 96 / 64;
  int seen = 0;
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 96; x += 7) {
      // A point on the ray through the pixel's centre; the ray's component along the view axis is 1, so its
      // parameter is the depth.
      const Vector3f ray = forward + right * tan_x * (2 * (static_cast<float>(x) + 0.5f) / 96 - 1) -
                           up * tan_y * (2 * (static_cast<float>(y) + 0.5f) / 64 - 1);
      const float depth = -camera.eye.y() / ray.y();
      if (ray.y() > -0.02f) continue;
      ++seen;
      EXPECT_NEAR(c.depth[at(c, x, y)], depth, 1e-3f * depth) << x << " " << y;
      EXPECT_LT((c.normal[at(c, x, y)] - Vector3f::UnitY()).norm(), 1e-5f);
      EXPECT_EQ(c.id[at(c, x, y)], 7u);
    }
  EXPECT_GT(seen, 500);
  s.stage.set_camera({.eye = {0, 2, 5}, .target = {0, 4, 0}});
  const Channels sky = s.stage.channels(0);
  EXPECT_TRUE(std::isinf(sky.depth[at(sky, 48, 2)]));
  EXPECT_EQ(sky.id[at(sky, 48, 2)], 0u);
}

TEST(StageChannels, AnImageInBetweenDoesNotChangeTheChannels) {
  SmallStage s;
  s.stage.set_object(s.add(make_box({4, 4, 1}), {}, {0, 0, -1}), 4);
  const InstanceHandle front = s.add(make_box({1, 1, 1}), {}, {0, 0, 1});
  s.stage.set_object(front, 3);
  const Channels before = s.stage.channels(0);
  EXPECT_EQ(before.id[middle(before)], 3u);
  HdrImage sum;
  s.stage.draw({}, sum);
  s.stage.set_visible(front, false);
  const Channels after = s.stage.channels(0);
  EXPECT_EQ(after.id[middle(after)], 4u);
}

TEST(StageChannels, IdsAreThoseOfTheNearestObject) {
  SmallStage s;
  s.stage.set_object(s.add(make_box({1, 1, 1}), {}, {0, 0, 1}), 3);
  s.stage.set_object(s.add(make_box({4, 4, 1}), {}, {0, 0, -1}), 4);
  const PointsHandle balls = s.stage.add_points({.style = PointStyle::sphere});
  s.stage.set_points(balls, std::array{Point{.position = {1.2f, 0, 0},
                                             .velocity = Vector3f::Zero(),
                                             .radius = 0.2f,
                                             .color = {1, 1, 1, 1},
                                             .id = 1}});
  s.stage.set_object(balls, 5);
  const Channels c = s.stage.channels(0);
  const auto id_at = [&](const Vector3f& place) {
    const Vector2f p = project({.eye = {0, 0, 5}, .target = {0, 0, 0}}, place, 96, 64);
    return c.id[at(c, static_cast<int>(p.x()), static_cast<int>(p.y()))];
  };
  EXPECT_EQ(id_at({0, 0, 1.5f}), 3u);
  EXPECT_EQ(id_at({-1.2f, 0, -0.5f}), 4u);
  EXPECT_EQ(id_at({1.2f, 0, 0}), 5u);
  EXPECT_EQ(c.id[0], 0u);
  EXPECT_NEAR(c.depth[middle(c)], 3.5f, 1e-4f);
}

// Half of the picture's 64 rows cover tan(20 degrees) at distance 1.
float pixels_per_m(float distance) {
  return 32 / std::tan(20 * 0.0174532925f) / distance;
}

TEST(StageChannels, MotionIsThatOfTheBodyInPixels) {
  SmallStage s;
  const InstanceHandle box = s.add(make_box({1, 1, 1}), {}, {0, 0, 0});
  s.stage.store_previous_transforms();
  s.stage.set_transform(box, Eigen::Affine3f(Eigen::Translation3f(0.1f, -0.05f, 0)));
  const Channels c = s.stage.channels(0.1f);
  const Vector2f way = c.motion[middle(c)];
  EXPECT_NEAR(way.x(), 0.1f * pixels_per_m(4.5f), 0.01f);
  EXPECT_NEAR(way.y(), 0.05f * pixels_per_m(4.5f), 0.01f) << "downwards is positive";
}

TEST(StageChannels, BallsMoveWithTheirVelocityAndTheCameraMovesEverything) {
  SmallStage s;
  const PointsHandle balls = s.stage.add_points({.style = PointStyle::sphere});
  s.stage.set_points(
      balls,
      std::array{Point{
          .position = {0, 0, 0}, .velocity = {1, 0, 0}, .radius = 0.5f, .color = {1, 1, 1, 1}, .id = 1}});
  s.stage.store_previous_transforms();
  Channels c = s.stage.channels(0.1f);
  EXPECT_NEAR(c.motion[middle(c)].x(), 0.1f * pixels_per_m(4.5f), 0.05f);
  s.stage.set_camera({.eye = {0.1f, 0, 5}, .target = {0.1f, 0, 0}});  // the camera moves with the ball
  c = s.stage.channels(0.1f);
  EXPECT_NEAR(c.motion[middle(c)].x(), 0, 0.05f);
}

// A mesh that is replaced by its next pose, as an animated skin is.
TEST(StageChannels, PosesMoveByTheirVertices) {
  SmallStage s;
  Mesh square = make_box({2, 2, 0.1f});
  const MeshHandle mesh = s.stage.add_mesh(square);
  s.stage.add_instance(mesh, s.stage.add_material({}));
  s.stage.set_mesh(mesh, square);
  s.stage.store_previous_transforms();
  for (const float step : {0.3f, -0.2f}) {  // only the sum counts
    for (Vector3f& p : square.positions) p.x() += step;
    s.stage.set_mesh(mesh, square);
  }
  const Channels c = s.stage.channels(1);
  EXPECT_NEAR(c.motion[middle(c)].x(), 0.1f * pixels_per_m(4.95f), 0.05f);
  s.stage.store_previous_transforms();
  EXPECT_NEAR(s.stage.channels(1).motion[middle(c)].x(), 0, 0.01f);
}

TEST(StageChannels, ClothsMoveByTheirVertices) {
  SmallStage s;
  const ClothHandle cloth = s.stage.add_cloth(
      {.triangles = {0, 1, 2, 0, 2, 3}, .uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}}}, s.stage.add_material({}));
  std::array<Vector3f, 4> places = {Vector3f(-1, -1, 0), Vector3f(1, -1, 0), Vector3f(1, 1, 0),
                                    Vector3f(-1, 1, 0)};
  s.stage.set_cloth(cloth, places);
  s.stage.set_object(cloth, 9);
  s.stage.store_previous_transforms();
  for (Vector3f& p : places) p.y() += 0.1f;
  s.stage.set_cloth(cloth, places);
  const Channels c = s.stage.channels(0.1f);
  EXPECT_EQ(c.id[middle(c)], 9u);
  EXPECT_NEAR(c.motion[middle(c)].y(), -0.1f * pixels_per_m(5), 0.05f);
  EXPECT_NEAR(c.normal[middle(c)].z(), 1, 1e-3f);
}

}  // namespace
}  // namespace offstage::render
