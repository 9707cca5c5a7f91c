#include "producer/build/camera.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace offstage::producer {
namespace {

using Eigen::Vector3f;

// Two balls, one of which moves.
struct Set {
  Set() {
    scene.render.size = {1600, 900};
    scene.bodies = {Body{.name = "still", .shape = sim::Sphere{1}, .position = {-3, 1, 0}},
                    Body{.name = "moving", .shape = sim::Sphere{1}, .position = {3, 1, 0}}};
    scene.bodies[0].motion = sim::MotionType::static_body;
    places = BodyPlaces(ObjectTable(scene));
  }
  render::Camera at(double time, const Vector3f& moving = {3, 1, 0}) {
    std::vector<Problem> warnings;
    const ModelLibrary models(scene, ".", {}, warnings);
    return CameraRig(scene, models).at(time, places, {{moving, Eigen::Quaternionf::Identity()}});
  }
  Scene scene;
  BodyPlaces places;
};

TEST(CameraRig, FocalLengthIsThatOfAPicture36MillimetresWide) {
  Set set;
  StaticCamera camera;
  camera.focal_mm = 18;  // 90 degrees horizontally
  set.scene.camera = camera;
  const double half = 0.5 * static_cast<double>(set.at(0).fov_deg) * std::numbers::pi / 180;
  EXPECT_NEAR(std::tan(half) * 16 / 9, 1, 1e-5);
}

TEST(CameraRig, LooksAtAndFocusesOnABodyThatMoves) {
  Set set;
  StaticCamera camera;
  camera.eye = {0, 1, 10};
  camera.look_at = "moving";
  camera.focus_on = "still";
  set.scene.camera = camera;
  const render::Camera view = set.at(0, {0, 1, 2});
  EXPECT_TRUE(view.target.isApprox(Vector3f(0, 1, 2)));
  EXPECT_NEAR(view.focus, 10, 1e-4) << "along the line of sight";
}

TEST(CameraRig, FitFillsThePictureFromItsSide) {
  Set set;
  StaticCamera camera;
  camera.eye = {0, 1, 50};
  camera.target = {0, 1, 0};
  camera.fit = {"still", "moving"};
  set.scene.camera = camera;
  const render::Camera view = set.at(0);
  EXPECT_TRUE(view.target.isApprox(Vector3f(0, 1, 0)));
  EXPECT_NEAR(view.eye.x(), 0, 1e-5);
  // The sphere around both balls just fits into the picture.
  const float radius = std::sqrt(4.0f * 4 + 1 + 1), distance = (view.eye - view.target).norm();
  EXPECT_NEAR(std::asin(radius / distance), 0.5f * view.fov_deg * 0.01745329f, 1e-4f);
}

TEST(CameraRig, KeysCarryFieldOfViewAndFocus) {
  Set set;
  KeyframedCamera camera;
  camera.keyframes = {{.time = 0, .eye = {0, 0, 5}, .fov_deg = 60, .focus = 2},
                      {.time = 2, .eye = {0, 0, 5}}};
  camera.fov_deg = 30;
  set.scene.camera = camera;
  EXPECT_NEAR(set.at(0).fov_deg, 60, 1e-4);
  EXPECT_NEAR(set.at(2).fov_deg, 30, 1e-4);
  EXPECT_NEAR(set.at(0).focus, 2, 1e-5);
  EXPECT_NEAR(set.at(2).focus, 5, 1e-5) << "the distance of the target";
  EXPECT_GT(set.at(1).fov_deg, 31);
  EXPECT_LT(set.at(1).fov_deg, 59);
}

}  // namespace
}  // namespace offstage::producer
