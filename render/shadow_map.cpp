#include "render/shadow_map.h"

#include <algorithm>

namespace offstage::render {
namespace {

constexpr GLuint kSunPlainUnit = 9;

}  // namespace

ShadowFrame fit_shadow(std::span<const Caster> casters, const View& view, const Vector3f& sun_direction,
                       float pixel_m, int size_px) {
  if (casters.empty()) return {};
  Eigen::Matrix3f light_from_world;
  const Vector3f other = std::abs(sun_direction.y()) < 0.99f ? Vector3f::UnitY() : Vector3f::UnitX();
  light_from_world.row(0) = other.cross(sun_direction).normalized().transpose();
  light_from_world.row(1) = sun_direction.cross(Vector3f(light_from_world.row(0).transpose())).transpose();
  light_from_world.row(2) = sun_direction.transpose();

  Eigen::AlignedBox3f region, world;
  for (const Caster& caster : casters) {
    const Vector3f reach = Vector3f::Constant(caster.radius);
    const Vector3f center = light_from_world * caster.center;
    region.extend(center - reach).extend(center + reach);
    world.extend(caster.center - reach).extend(caster.center + reach);
  }
  // A shadow can be behind its caster by its height over the tangent of the sun's elevation; twice the
  // diagonal is enough for every sun except one at the horizon.
  const float diagonal = world.diagonal().norm();
  float far_distance = 0, near_distance = view.far_m;
  for (const Caster& caster : casters) {
    const float depth = view.depth_of(caster.center);
    far_distance = std::max(far_distance, depth + caster.radius);
    near_distance = std::min(near_distance, depth - caster.radius);
  }
  Eigen::AlignedBox3f seen;
  for (const Vector3f& corner : view.corners(std::max(far_distance, 0.0f) + 2 * diagonal)) {
    seen.extend(light_from_world * corner);
  }
  const Vector3f low = region.min().cwiseMax(seen.min()), high = region.max().cwiseMin(seen.max());
  const float extent = std::max(high.x() - low.x(), high.y() - low.y());
  if (!(low.x() < high.x() && low.y() < high.y()) || !std::isfinite(extent)) return {};

  constexpr float kMargin_px = 4, kTexelPerPixel = 1;
  // Texels much smaller than a pixel would only take time.
  const float finest = kTexelPerPixel * pixel_m * std::max(near_distance, 0.0f);
  const float needed = std::max(extent * (1 + 2 * kMargin_px / static_cast<float>(size_px)),
                                finest * static_cast<float>(size_px));
  const float side = std::exp2(std::ceil(4 * std::log2(needed)) / 4);
  const float texel = side / static_cast<float>(size_px);
  const Vector2f corner = 0.5f * (low + high).head<2>() - Vector2f::Constant(0.5f * side);
  const Vector2f snapped(std::floor(corner.x() / texel) * texel, std::floor(corner.y() / texel) * texel);
  const float z_high = region.max().z(), depth = std::max(region.max().z() - region.min().z(), 1e-3f);

  ShadowFrame frame;
  frame.texel_m = texel;
  frame.depth_m = depth;
  frame.clip_from_world = Matrix4f::Identity();
  frame.clip_from_world.row(0) << 2 / side * light_from_world.row(0), -2 / side * snapped.x() - 1;
  frame.clip_from_world.row(1) << 2 / side * light_from_world.row(1), -2 / side * snapped.y() - 1;
  // 0 is nearest to the sun.
  frame.clip_from_world.row(2) << -light_from_world.row(2) / depth, z_high / depth;
  return frame;
}

ShadowMap::ShadowMap(int size_px)
    : size_px_(size_px),
      depth_(gl::make_target(GL_DEPTH_COMPONENT32F, size_px, size_px, GL_LINEAR)),
      framebuffer_(gl::make_framebuffer(0, depth_)),
      plain_(gl::make_depth_sampler()) {
  glTextureParameteri(depth_, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  glTextureParameteri(depth_, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
}

void ShadowMap::begin() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  glViewport(0, 0, size_px_, size_px_);
  glDepthMask(GL_TRUE);
  const float farthest = 1;
  glClearNamedFramebufferfv(framebuffer_, GL_DEPTH, 0, &farthest);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glEnable(GL_DEPTH_CLAMP);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
  glEnable(GL_POLYGON_OFFSET_FILL);
  glPolygonOffset(1.5f, 0);
}

void ShadowMap::end() const {
  glDisable(GL_POLYGON_OFFSET_FILL);
  glDisable(GL_DEPTH_CLAMP);
  glBindTextureUnit(0, depth_);
  glBindTextureUnit(kSunPlainUnit, depth_);
  glBindSampler(kSunPlainUnit, plain_);
}

void ShadowMap::read(int x, int y, int width, int height, std::vector<uint16_t>& depths) const {
  constexpr int kRows = 32;  // rows read at once
  const auto row = static_cast<std::size_t>(width), size = row * static_cast<std::size_t>(height);
  if (depths.capacity() < size) depths = {};  // avoids holding both buffers
  depths.resize(size);
  std::vector<float> strip(row * kRows);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_);
  for (int first = 0; first < height; first += kRows) {
    const int rows = std::min(kRows, height - first);
    glReadPixels(x, y + first, width, rows, GL_DEPTH_COMPONENT, GL_FLOAT, strip.data());
    uint16_t* out = depths.data() + static_cast<std::size_t>(first) * row;
    for (std::size_t i = 0; i < static_cast<std::size_t>(rows) * row; ++i)
      out[i] = static_cast<uint16_t>(strip[i] * 65535.0f + 0.5f);
  }
}

}  // namespace offstage::render
