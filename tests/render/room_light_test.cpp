// Light in a room with coloured walls and an area lamp (after C. Goral et al., "Modeling the Interaction of
// Light between Diffuse Surfaces", 1984), against path tracing without any shortcut.

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "render/primitives.h"
#include "render/trace/light_tracer.h"

namespace offstage::render {
namespace {

using Eigen::Vector3d;

constexpr double kHalfRoom = 1, kHalfLamp = 0.4, kLampHeight = 0.98, kHalfBlock = 0.3;
const Vector3d kBlock(0.35, -0.7, -0.3);  // centre of the block, which stands on the floor
const Vector3d kWhiteWall(0.7, 0.7, 0.7), kRedWall(0.6, 0.1, 0.1), kGreenWall(0.1, 0.5, 0.1);

struct RoomMeeting {
  double distance = 1e30;
  Vector3d normal = Vector3d::Zero(), albedo = Vector3d::Zero();
};

/// Returns the first surface that a ray meets: a wall of the room from inside, or the block from outside.
RoomMeeting meet_room(const Vector3d& from, const Vector3d& direction) {
  RoomMeeting first;
  for (int axis = 0; axis < 3; ++axis) {
    if (direction[axis] == 0) continue;
    const double side = direction[axis] > 0 ? 1 : -1;
    const double wall = (side * kHalfRoom - from[axis]) / direction[axis];
    if (wall < first.distance) {
      const Vector3d color = axis != 0 ? kWhiteWall : side < 0 ? kRedWall : kGreenWall;
      first = {wall, -side * Vector3d::Unit(axis), color};
    }
    const double face = (kBlock[axis] - side * kHalfBlock - from[axis]) / direction[axis];
    const Vector3d off = from + face * direction - kBlock;
    const double along = std::max(std::abs(off[(axis + 1) % 3]), std::abs(off[(axis + 2) % 3]));
    if (face > 1e-9 && face < first.distance && along < kHalfBlock)
      first = {face, -side * Vector3d::Unit(axis), kWhiteWall};
  }
  return first;
}

class RoomReference {
 public:
  /// Returns the mean of the light that arrives at points of the floor in a square, as the radiance of a
  /// white surface.
  Vector3d on_floor(const Vector3d& middle, double half, int paths) {
    Vector3d sum = Vector3d::Zero();
    for (int i = 0; i < paths; ++i) {
      const Vector3d at = middle + Vector3d(half * signed_random(), 0, half * signed_random());
      sum += arriving(at, Vector3d::UnitY());
    }
    return sum / paths;
  }

 private:
  double random() { return uniform_(engine_); }
  double signed_random() { return 2 * random() - 1; }

  // The lamp radiates downwards with its intensity per unit of solid angle times the cosine.
  Vector3d arriving(Vector3d at, Vector3d normal) {
    Vector3d sum = Vector3d::Zero(), fraction = Vector3d::Ones();
    for (int bounce = 0; bounce < 60; ++bounce) {
      at += 1e-7 * normal;
      const Vector3d lamp(kHalfLamp * signed_random(), kLampHeight, kHalfLamp * signed_random());
      const Vector3d way = lamp - at;
      const double distance = way.norm(), towards = normal.dot(way) / distance, down = way.y() / distance;
      if (towards > 0 && down > 0 && meet_room(at, way / distance).distance > distance)
        sum += fraction * (towards * down / (distance * distance));
      const double angle = 2 * std::numbers::pi * random(), r2 = random(), r = std::sqrt(r2);
      const Vector3d a = normal.unitOrthogonal(), b = normal.cross(a);
      const Vector3d direction =
          r * std::cos(angle) * a + r * std::sin(angle) * b + std::sqrt(1 - r2) * normal;
      const RoomMeeting next = meet_room(at, direction);
      at += next.distance * direction;
      normal = next.normal;
      fraction = fraction.cwiseProduct(next.albedo);
      if (fraction.maxCoeff() < 0.05) {
        if (random() > 0.5) return sum;
        fraction *= 2;
      }
    }
    return sum;
  }

  std::mt19937_64 engine_{7};
  std::uniform_real_distribution<double> uniform_{0, 1};
};

TEST(TracedRoom, AgreesWithPathTracing) {
  const auto matt = [](const Vector3d& color) {
    Material material{.roughness = 1, .two_sided = true};
    material.color.head<3>() = color.cast<float>();
    return RayMaterial(material, {});
  };
  const RayMaterial white = matt(kWhiteWall), red = matt(kRedWall), green = matt(kGreenWall);
  const auto box = [](const Vector3f& size) {
    const Mesh mesh = make_box(size);
    return RayMesh(mesh, mesh.normals);
  };
  const RayMesh floor = box({2.2f, 0.1f, 2.2f}), wall = box({0.1f, 2.2f, 2.2f}),
                back = box({2.2f, 2.2f, 0.1f}), block = box(Vector3f::Constant(0.6f));
  RayScene scene;
  scene.clear();
  const auto add = [&](const RayMesh& mesh, const RayMaterial& material, const Vector3f& place) {
    scene.add(mesh, material, Eigen::Affine3f(Eigen::Translation3f(place)), true);
  };
  for (const float side : {-1.05f, 1.05f}) {
    add(floor, white, {0, side, 0});
    add(wall, side < 0 ? red : green, {side, 0, 0});
    add(back, white, {0, 0, side});
  }
  add(block, white, kBlock.cast<float>());
  scene.build();

  LightSources sources;
  sources.sun.intensity = 0;
  sources.sun.shadows = false;
  sources.sky = make_sky(sources.sun, {.intensity = 0});
  sources.lamps.emplace_back(Lamp{.position = {0, static_cast<float>(kLampHeight), 0},
                                  .intensity = {1, 1, 1},
                                  .size = {0.8f, 0.8f},
                                  .direction = {0, -1, 0}});

  // The floor as a picture: pixel (x, y) is a square of it.
  constexpr int kSize = 64, kSubFrames = 16, kTile = 8;
  SurfaceBuffer surfaces{.width_px = kSize, .height_px = kSize};
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const auto along = [](int k) { return (2 * static_cast<float>(k) + 1) / kSize - 1; };
      const float px = along(x), pz = along(y);
      const bool hidden = std::abs(px - kBlock.x()) < kHalfBlock && std::abs(pz - kBlock.z()) < kHalfBlock;
      surfaces.places.push_back({px, -1, pz, hidden ? -1.0f : 1.0f});
      surfaces.normals.push_back({32768, 32768, 32768, 32768});
    }
  const LightView above{
      .eye = {0, 1, 0}, .clip_from_world = Eigen::Matrix4f::Zero(), .pixel_m = 2.0f / kSize / 2};
  LightBuffer light(kSize, kSize);
  std::vector<Vector3f> mean(surfaces.places.size(), Vector3f::Zero());
  for (int k = 0; k < kSubFrames; ++k) {
    LightView view = above;
    view.offsets.index = k;
    view.offsets.count = kSubFrames;
    LightTracer(scene, sources).trace(surfaces, view, light);
    for (std::size_t i = 0; i < mean.size(); ++i)
      mean[i] += (light.arriving[i].head<3>() + light.lamps[i].head<3>()) / kSubFrames;
  }

  RoomReference reference;
  double error = 0, whole = 0;
  for (int ty = 0; ty < kSize; ty += kTile)
    for (int tx = 0; tx < kSize; tx += kTile) {
      Vector3d seen = Vector3d::Zero();
      bool hidden = false;
      for (int y = ty; y < ty + kTile; ++y)
        for (int x = tx; x < tx + kTile; ++x) {
          const auto k = static_cast<std::size_t>(y * kSize + x);
          hidden = hidden || surfaces.places[k].w() < 0;
          seen += mean[k].cast<double>() / (kTile * kTile);
        }
      if (hidden) continue;
      const double half = static_cast<double>(kTile) / kSize;
      const Vector3d middle((2 * tx + kTile) / double{kSize} - 1, -1, (2 * ty + kTile) / double{kSize} - 1);
      const Vector3d expected = reference.on_floor(middle, half, 20000);
      error += (seen - expected).cwiseAbs().sum();
      whole += expected.sum();
    }
  EXPECT_LT(error / whole, 0.02);
}

}  // namespace
}  // namespace offstage::render
