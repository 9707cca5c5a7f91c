#include "render/streaks_pass.h"

#include <algorithm>

#include <tbb/parallel_for.h>

#include "render/trace/ray_particles.h"

namespace offstage::render {
namespace {

// Radius from which a streak near the lens fades out, as a fraction of half the picture.
constexpr float kNearestStreak = 0.016f;
constexpr float kNearLens_m = 0.5f;   // distance up to which such a streak is invisible
constexpr float kThinnest_px = 0.6f;  // radius; thinner streaks are drawn with this radius and fainter

// Returns the light of a drop that is stretched by its motion. The drop refracts the sky behind it, and is
// bright if the sun is behind it.
Vector3f drop_light(const PuffLight& light, const GpuPoint& point, const Vector3f& to_eye,
                    const AirLightAround& around) {
  const Vector3f place = point.position.head<3>();
  const float radius = point.position.w(), number = point.velocity.w();
  const Vector3f through =
      0.5f * (around.sky * light.sky_reflection(-to_eye, 0.25f) + around.light.at(Vector3f::UnitY()));
  const float scattered =
      kDropAround + kDropForward * forward_lobe(Scattering::drop, -light.to_sun.dot(to_eye));
  const float visibility = light.air.sun(place, radius, number) * std::exp(-light.grid.depth(place));
  return through + visibility * scattered * light.frame.sun_radiance.head<3>() +
         light.air.lamps_around(place, radius, number);
}

// Returns the position on the screen [px] and, as z, the distance along the view axis [m].
Vector3f project(const View& view, const Vector3f& place, const Vector2f& half_size) {
  const Vector4f clip = view.clip_from_world * place.homogeneous();
  return {(clip.x() / clip.w() + 1) * half_size.x(), (clip.y() / clip.w() + 1) * half_size.y(), clip.w()};
}

/// Returns the light of a streak. `along`: direction of the streak on the screen.
StreakLight light_of(const GpuPoint& point, const PointsDef& def, const View& view, const PuffLight& light,
                     const Vector2f& along) {
  const Vector3f center = point.position.head<3>(), to_eye = (view.eye - center).normalized();
  const Vector4f fog = light.fog_to(center);
  const float cover = def.additive ? 0.0f : 1.0f;
  const Vector3f own = point.color.head<3>(), haze = cover * fog.head<3>();
  Vector3f middle = own, left = own, right = own;
  if (def.lit) {
    const AirLightAround around = light.around.at(center);
    middle = own.cwiseProduct(drop_light(light, point, to_eye, around));
    const Vector3f across = along.y() * view.right - along.x() * view.up;
    left = around.sky * light.sky_reflection((-across - 0.6f * to_eye).normalized(), 0.1f);
    right = around.sky * light.sky_reflection((across - 0.6f * to_eye).normalized(), 0.1f);
  }
  StreakLight s;
  for (int c = 0; c < 3; ++c) {
    s.middle[c] = middle[c] * fog.w() + haze[c];
    s.rim[c] = 0.5f * (left[c] + right[c]) * fog.w() + haze[c];
    s.rim_slope[c] = 0.5f * (right[c] - left[c]) * fog.w();
  }
  return s;
}

/// Returns the splat of a streak without its light.
StreakSplat splat_of(const GpuPoint& point, const PointsDef& def, const View& view, float pixel_m,
                     const Vector2f& half_size) {
  const Vector3f center = point.position.head<3>();
  const float distance = view.depth_of(center), pixel = pixel_m * distance;
  const float radius = point.position.w(), drawn = std::max(radius, kThinnest_px * pixel);

  // The length of a streak, with its rounded ends, is the length of its motion. Its ends must not be behind
  // the eye.
  Vector3f half_axis = 0.5f * def.stretch_s * point.velocity.head<3>();
  const float half_length = half_axis.norm();
  half_axis *= half_length > drawn ? 1 - drawn / half_length : 0;
  const float towards = half_axis.dot(view.forward), room = distance - view.near_m;
  if (std::abs(towards) > 0.9f * room) half_axis *= 0.9f * room / std::abs(towards);
  const Vector3f head = project(view, center + half_axis, half_size),
                 tail = project(view, center - half_axis, half_size);

  StreakSplat s;
  const Vector2f axis = 0.5f * (head - tail).head<2>();
  s.half_length = axis.norm();
  const Vector2f along = s.half_length > 1e-3f ? Vector2f(axis / s.half_length) : Vector2f(0, 1);
  s.along_x = along.x();
  s.along_y = along.y();
  s.x = 0.5f * (head.x() + tail.x());
  s.y = 0.5f * (head.y() + tail.y());
  const float radius_px = drawn / pixel;
  s.inverse_radius = 1 / radius_px;
  s.half_x = std::abs(axis.x()) + radius_px;
  s.half_y = std::abs(axis.y()) + radius_px;
  s.depth = 0.5f * (head.z() + tail.z());
  s.depth_slope = 0.5f * (head.z() - tail.z()) / std::max(s.half_length, 1.0f);
  s.inverse_reach = 0.5f / drawn;
  s.opacity =
      std::min(point.color.w(), 1.0f) * (radius / drawn) * std::clamp(0.5f * room / drawn, 0.0f, 1.0f);
  // A drop near the lens fades out. Otherwise it would be a bar across the picture.
  const float apart = std::clamp(distance / kNearLens_m - 1, 0.0f, 1.0f);
  s.opacity *= std::max(apart, std::clamp(2 - radius_px / (kNearestStreak * half_size.y()), 0.0f, 1.0f));
  s.cover = def.additive ? 0.0f : 1.0f;
  s.softness = std::clamp(def.softness, 0.01f, 1.0f);
  s.taper = def.taper;
  return s;
}

}  // namespace

StreaksPass::StreaksPass(int width_px, int height_px) : width_px_(width_px), height_px_(height_px) {}

void StreaksPass::prepare(const PaintOrder& order, const View& view, const PuffLight& light, bool new_frame) {
  constexpr auto kKind = PaintOrder::Kind::streaks;
  const std::span<const uint64_t> keys = order.keys(kKind);
  splats_.resize(keys.size());
  first_behind_ = static_cast<uint32_t>(keys.size());
  if (keys.empty()) return;
  if (new_frame) lights_.clear();
  lights_.resize(order.count(kKind));

  const Vector2f half_size(0.5f * static_cast<float>(width_px_), 0.5f * static_cast<float>(height_px_));
  constexpr std::size_t kBlock = 512;
  tbb::parallel_for(std::size_t{0}, (keys.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
    for (std::size_t k = block * kBlock; k < std::min(keys.size(), (block + 1) * kBlock); ++k) {
      const auto [set, i] = order.place(kKind, keys[k]);
      StreakSplat& s = splats_[k];
      s = splat_of(set->points[i], set->def, view, light.frame.eye.w(), half_size);
      KnownLight& known = lights_[order.number(kKind, keys[k])];
      if (known.id != set->ids[i])
        known = {set->ids[i], light_of(set->points[i], set->def, view, light, {s.along_x, s.along_y})};
      s.light = &known.light;
    }
  });
  bands_.sort(splats_, width_px_, height_px_);
}

Eigen::AlignedBox2i StreaksPass::draw_behind(const Eigen::AlignedBox2i& area_px, const FrameUniforms& frame,
                                             GLuint color) {
  Eigen::AlignedBox2i changed;
  if (first_behind_ >= splats_.size() || area_px.isEmpty()) return changed;
  const auto [left, right] = bands_.columns_px(area_px.min().x(), area_px.max().x());
  if (left >= right) return changed;
  constexpr int kRows = StreakBands::kRows;
  const int width = right - left;
  for (int bottom = area_px.min().y() / kRows * kRows; bottom < area_px.max().y(); bottom += kRows) {
    const int rows = std::min(kRows, height_px_ - bottom);
    if (!bands_.any(bottom, left, right, first_behind_)) continue;
    const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(rows);
    depth_.resize(std::max(depth_.size(), pixels));
    rgba_.resize(std::max(rgba_.size(), 4 * pixels));
    glReadPixels(left, bottom, width, rows, GL_DEPTH_COMPONENT, GL_FLOAT, depth_.data());
    glReadPixels(left, bottom, width, rows, GL_RGBA, GL_FLOAT, rgba_.data());
    bands_.blend_over({left, bottom, width, rows, depth_, rgba_}, frame.depth.head<2>(), first_behind_);
    glTextureSubImage2D(color, 0, left, bottom, width, rows, GL_RGBA, GL_FLOAT, rgba_.data());
    changed.extend(Eigen::Vector2i(left, bottom)).extend(Eigen::Vector2i(right, bottom + rows));
  }
  return changed;
}

void StreaksPass::blend_over(int bottom, int rows, const FrameUniforms& frame, std::span<float> rgba) {
  if (splats_.empty() || !bands_.any(bottom, 0, width_px_, 0)) return;
  depth_.resize(std::max(depth_.size(), static_cast<std::size_t>(width_px_) * StreakBands::kRows));
  glReadPixels(0, bottom, width_px_, rows, GL_DEPTH_COMPONENT, GL_FLOAT, depth_.data());
  bands_.blend_over({0, bottom, width_px_, rows, depth_, rgba}, frame.depth.head<2>(), 0);
}

}  // namespace offstage::render
