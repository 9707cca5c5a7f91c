#include "render/frame.h"

#include <algorithm>
#include <numbers>
#include <utility>

#include "render/sky.h"

namespace offstage::render {
namespace {

constexpr float kRadians = std::numbers::pi_v<float> / 180;

Vector4f vec4(const Vector3f& v, float w = 0) {
  return {v.x(), v.y(), v.z(), w};
}

// Returns a unit vector perpendicular to `direction`. It is a continuous function of `direction`, except
// where `direction` is vertical.
Vector3f perpendicular(const Vector3f& direction) {
  const Vector3f other = std::abs(direction.y()) < 0.99f ? Vector3f::UnitY() : Vector3f::UnitX();
  return other.cross(direction).normalized();
}

}  // namespace

Vector2f square_to_disc(const Vector2f& p) {
  const float a = 2 * p.x(), b = 2 * p.y();
  if (a == 0 && b == 0) return Vector2f::Zero();
  constexpr float kQuarter = std::numbers::pi_v<float> / 4;
  if (std::abs(a) > std::abs(b)) {
    const float angle = kQuarter * b / a;
    return a * Vector2f(std::cos(angle), std::sin(angle));
  }
  const float angle = kQuarter * a / b;
  return b * Vector2f(std::sin(angle), std::cos(angle));
}

Vector3f jittered_sun(const Sun& sun, const Vector2f& offset) {
  const Vector3f direction = sun.direction.normalized();
  const Vector2f disc = square_to_disc(offset) * std::tan(0.5f * sun.size_deg * kRadians);
  const Vector3f u = perpendicular(direction), v = direction.cross(u);
  return (direction + disc.x() * u + disc.y() * v).normalized();
}

bool View::sees(const Vector3f& center, float radius) const {
  const Vector3f relative = center - eye;
  const float depth = forward.dot(relative);
  if (depth < near_m - radius || depth > far_m + radius) return false;
  for (int axis = 0; axis < 2; ++axis) {
    const float across = (axis == 0 ? right : up).dot(relative);
    const float middle = -shear[axis] * tan_half[axis] * depth;  // centre of the image at this depth
    const float slope_high = (1 - shear[axis]) * tan_half[axis],
                slope_low = (1 + shear[axis]) * tan_half[axis];
    const float over = across - depth * slope_high, under = -across - depth * slope_low;
    const float slope = across > middle ? slope_high : slope_low;
    if (std::max(over, under) > radius * std::sqrt(1 + slope * slope)) return false;
  }
  return true;
}

void ScreenArea::add(const Vector3f& place) {
  const float depth = view_.depth_of(place);
  if (depth - margin_ <= view_.near_m) return add_all();
  const Vector2f center(view_.right.dot(place - view_.eye), view_.up.dot(place - view_.eye));
  for (const float distance : {depth - margin_, depth + margin_})
    for (const float side : {-margin_, margin_})
      area_.extend(view_.shear + (center.array() + side).matrix().cwiseQuotient(view_.tan_half) / distance);
}

void ScreenArea::add_all() {
  area_.extend(Vector2f(-1, -1)).extend(Vector2f(1, 1));
}

bool ScreenArea::empty() const {
  return !area_.intersects(Eigen::AlignedBox2f(Vector2f(-1, -1), Vector2f(1, 1)));
}

Eigen::AlignedBox2i ScreenArea::pixels(int width_px, int height_px) const {
  const Vector2f half_size(0.5f * static_cast<float>(width_px), 0.5f * static_cast<float>(height_px));
  const auto pixel = [&](const Vector2f& p) {
    return ((p.array().max(-1).min(1) + 1) * half_size.array()).eval();
  };
  return {pixel(area_.min()).floor().cast<int>().matrix(), pixel(area_.max()).ceil().cast<int>().matrix()};
}

View make_view(const Camera& camera, const SampleOffsets& offsets, int width_px, int height_px) {
  View view;
  const Vector3f sight = camera.target - camera.eye;
  const float distance = sight.norm();
  view.forward = distance > 0 ? Vector3f(sight / distance) : Vector3f(-Vector3f::UnitZ());
  Vector3f side = view.forward.cross(camera.up);
  if (side.norm() < 1e-6f)
    side = view.forward.cross(-Vector3f::UnitZ());  // the camera looks straight down: as on a map, -Z is up
  view.right = side.norm() > 1e-6f ? Vector3f(side.normalized()) : perpendicular(view.forward);
  view.up = view.right.cross(view.forward);

  const float tan_y = std::tan(0.5f * camera.fov_deg * kRadians);
  view.tan_half = {tan_y * static_cast<float>(width_px) / static_cast<float>(height_px), tan_y};
  view.near_m = camera.near_m;
  view.far_m = camera.far_m;

  // Thin lens: the eye moves in the lens, and the image is sheared so that the plane in focus does not move.
  const Vector2f lens = square_to_disc(offsets.lens) * (0.5f * camera.aperture);
  const float focus = camera.focus > 0 ? camera.focus : std::max(distance, camera.near_m);
  view.eye = camera.eye + lens.x() * view.right + lens.y() * view.up;
  const Vector2f half_size_px(0.5f * static_cast<float>(width_px), 0.5f * static_cast<float>(height_px));
  view.shear = lens.cwiseQuotient(view.tan_half) / focus + offsets.pixel.cwiseQuotient(half_size_px);

  const float n = view.near_m, f = view.far_m;
  Matrix4f clip_from_view = Matrix4f::Zero();
  clip_from_view(0, 0) = 1 / view.tan_half.x();
  clip_from_view(1, 1) = 1 / view.tan_half.y();
  clip_from_view(0, 2) = -view.shear.x();
  clip_from_view(1, 2) = -view.shear.y();
  clip_from_view(2, 2) = n / (f - n);
  clip_from_view(2, 3) = n * f / (f - n);
  clip_from_view(3, 2) = -1;

  Matrix4f view_from_world = Matrix4f::Identity();
  view_from_world.block<1, 3>(0, 0) = view.right.transpose();
  view_from_world.block<1, 3>(1, 0) = view.up.transpose();
  view_from_world.block<1, 3>(2, 0) = -view.forward.transpose();
  view_from_world.block<3, 1>(0, 3) = -view_from_world.block<3, 3>(0, 0) * view.eye;
  view.clip_from_world = clip_from_view * view_from_world;
  return view;
}

Vector3f FrameUniforms::irradiance_at(std::size_t k) const {
  if (k < 7) return irradiance[k].head<3>();
  const std::size_t first = 3 * (k - 7);
  return {irradiance[first].w(), irradiance[first + 1].w(), irradiance[first + 2].w()};
}

FrameUniforms make_frame(const View& view, const Sun& sun, const Environment& environment,
                         const SampleOffsets& offsets, float time, int height_px) {
  const SkyModel sky = make_sky(sun, environment);
  const float n = view.near_m, f = view.far_m;
  const Vector3f x = view.right * view.tan_half.x(), y = view.up * view.tan_half.y();

  FrameUniforms frame;
  frame.clip_from_world = view.clip_from_world;
  frame.eye = vec4(view.eye, 2 * view.tan_half.y() / static_cast<float>(height_px));
  frame.ray_center = vec4(view.forward - view.shear.x() * x - view.shear.y() * y);
  frame.ray_x = vec4(x);
  frame.ray_y = vec4(y);
  frame.depth = {n * f / (f - n), n / (f - n), n, f};
  frame.sun_direction = vec4(jittered_sun(sun, offsets.light));
  frame.sun_radiance = vec4(sun.color * sun.intensity, 0.5f * sun.size_deg * kRadians);
  frame.zenith = vec4(sky.zenith, environment.fog);
  frame.horizon = vec4(sky.horizon);
  frame.ground = vec4(sky.ground, sky.turned.intensity);
  frame.glow = vec4(sky.glow, environment.picture_turn_deg / 360);
  const std::array<Vector3f, 9> irradiance = sky_irradiance(sky);
  for (std::size_t k = 0; k < 7; ++k)
    frame.irradiance[k] = vec4(irradiance[k], k < 6 ? irradiance[7 + k / 3][static_cast<int>(k % 3)] : 0);
  // The disc of the half vectors to the part of the sun's disc that a sub-frame represents: radius^2.
  const float radius = 0.5f * frame.sun_radiance.w();
  frame.irradiance[6].w() = radius * radius / static_cast<float>(offsets.count);
  frame.air = {time, environment.clouds, 0, 0};
  return frame;
}

SampleOffsets sample_offsets(int i, int n) {
  if (n <= 1) return {};
  // Pixel, lens and light use the Hammersley set in three different orders. They are therefore independent of
  // each other and of time, which is proportional to i.
  const auto hammersley = [n](int k) {
    float inverse = 0, digit = 0.5f;
    for (int bits = k; bits > 0; bits >>= 1, digit *= 0.5f) inverse += static_cast<float>(bits & 1) * digit;
    const float half_cell = 0.5f / static_cast<float>(n);
    return Vector2f(static_cast<float>(k) / static_cast<float>(n) + half_cell - 0.5f,
                    std::min(inverse + half_cell, 1.0f) - 0.5f);
  };
  const auto coprime_near = [n](double fraction) {
    const auto common_divisor_is_one = [n](int a) {
      int b = n;
      while (b != 0) a = std::exchange(b, a % b);
      return a == 1;
    };
    int stride = std::max(1, static_cast<int>(fraction * n));
    while (!common_divisor_is_one(stride)) ++stride;
    return stride;
  };
  const auto permuted = [i, n, &coprime_near](double fraction, int shift) {
    return static_cast<int>((static_cast<int64_t>(i) * coprime_near(fraction) + shift) % n);
  };
  return {.pixel = hammersley(permuted(0.618, 0)),
          .lens = hammersley(permuted(0.414, n / 3)),
          .light = hammersley(permuted(0.236, n / 2)),
          .index = i,
          .count = n};
}

}  // namespace offstage::render
