#include "render/lamps.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace offstage::render {
namespace {

constexpr GLuint kLampShadowUnit = 10, kLampPlainUnit = 11;
constexpr int kTile_px = 512, kRowWidth_px = 3 * kTile_px, kRowHeight_px = 2 * kTile_px;
constexpr float kNear = 0.02f;  // as in shaders/lamps.glsl

float power(const Lamp& lamp) {
  return lamp.intensity.sum();
}

/// Projection whose depth is 1 - near / distance along the axis.
Matrix4f projection(const Vector3f& eye, const Vector3f& right, const Vector3f& up, const Vector3f& forward,
                    float tan_half) {
  Matrix4f m = Matrix4f::Zero();
  m.block<1, 3>(0, 0) = right.transpose() / tan_half;
  m.block<1, 3>(1, 0) = up.transpose() / tan_half;
  m.block<1, 3>(2, 0) = m.block<1, 3>(3, 0) = forward.transpose();
  m.col(3) = -m.leftCols<3>() * eye;
  m(2, 3) -= kNear;
  return m;
}

/// Point of the ball or rectangle that emits the light in a sub-frame.
Vector3f place_in(const Lamp& lamp, const Vector3f& right, const Vector3f& up, const SampleOffsets& offsets) {
  if (lamp.size.x() > 0)
    return lamp.position + offsets.light.x() * lamp.size.x() * right + offsets.light.y() * lamp.size.y() * up;
  const Vector2f disc = square_to_disc(offsets.light);
  const float height = 2 * offsets.pixel.x() * std::sqrt(std::max(1 - disc.squaredNorm(), 0.0f));
  return lamp.position + lamp.radius * (disc.x() * right + disc.y() * up + height * right.cross(up));
}

}  // namespace

Lamp lamp_of_fire(const PointSet& flames) {
  Vector3f place = Vector3f::Zero(), light = Vector3f::Zero();
  float area = 0;
  for (const GpuPoint& p : flames.points) {
    const float seen = p.position.w() * p.position.w() * std::min(p.color.w(), 1.0f);
    area += seen;
    place += seen * p.position.head<3>();
    light += seen * p.color.head<3>();
  }
  if (area <= 0) return {.intensity = Vector3f::Zero()};
  // Flames hide each other: their total visible area is at most one side of the box around them.
  constexpr float kCover = 0.6f;  // share of a flame's disc that is covered
  constexpr float kDimmed = 4;  // flames are drawn darker than they are, because otherwise all would be white
  const Vector3f sizes = flames.box.sizes();
  const float side = 0.5f * sizes.y() * (sizes.x() + sizes.z());
  const float shown =
      side * (1 - std::exp(-kCover * std::numbers::pi_v<float> * area / std::max(side, 1e-6f)));
  return {.position = place / area,
          .intensity = kDimmed * light / area * (shown / std::numbers::pi_v<float>),
          .radius = 0.25f * std::min(sizes.x(), sizes.y())};
}

Vector3f lamp_radiance(const LampUniforms& lamp, const Vector3f& place, Vector3f& towards) {
  const Vector3f v = lamp.position.head<3>() - place;
  towards = v.normalized();
  const float share =
      std::clamp(lamp.right.w() - lamp.direction.w() * towards.dot(lamp.direction.head<3>()), 0.0f, 1.0f);
  const float radius = lamp.position.w();
  return lamp.intensity.head<3>() * (share / (v.squaredNorm() + 0.25f * radius * radius));
}

bool LampPass::Tile::sees(const Caster& caster) const {
  const Vector3f v = caster.center - eye;
  const float along = v.dot(forward), across = std::sqrt(std::max(v.squaredNorm() - along * along, 0.0f));
  return along > -caster.radius && across - along * slope < caster.radius * std::sqrt(1 + slope * slope);
}

void LampPass::add_shadow(int row, LampUniforms& lamp) {
  const Vector3f eye = lamp.position.head<3>();
  const int y = row * kRowHeight_px;
  lamp.block.head<2>() = Vector2f(0, static_cast<float>(y));
  if (lamp.intensity.w() == 1) {
    const float t = lamp.up.w();
    tiles_.push_back({projection(eye, lamp.right.head<3>(), lamp.up.head<3>(), lamp.direction.head<3>(), t),
                      0, y, kRowHeight_px, eye, lamp.direction.head<3>(), t * std::numbers::sqrt2_v<float>});
    lamp.block.tail<2>().setConstant(kRowHeight_px);
    return;
  }
  for (int k = 0; k < 6; ++k) {
    const int axis = k % 3;
    const Vector3f forward = (k < 3 ? 1.0f : -1.0f) * Vector3f::Unit(axis);
    tiles_.push_back(
        {projection(eye, Vector3f::Unit((axis + 1) % 3), Vector3f::Unit((axis + 2) % 3), forward, 1),
         axis * kTile_px, y + k / 3 * kTile_px, kTile_px, eye, forward, std::numbers::sqrt2_v<float>});
  }
  lamp.block.tail<2>().setConstant(kTile_px);
}

void LampPass::prepare(std::span<const Lamp> lamps, const SampleOffsets& offsets, FrameUniforms& frame) {
  std::vector<const Lamp*> chosen;
  for (const Lamp& lamp : lamps)
    if (power(lamp) > 0) chosen.push_back(&lamp);
  std::stable_sort(chosen.begin(), chosen.end(),
                   [](const Lamp* a, const Lamp* b) { return power(*a) > power(*b); });
  chosen.resize(std::min(chosen.size(), kMostLamps));
  tiles_.clear();
  rows_ = 0;
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    const Lamp& lamp = *chosen[k];
    LampUniforms& u = frame.lamps[k];
    const Vector3f forward = lamp.direction.normalized();
    const Vector3f other = std::abs(forward.y()) < 0.99f ? Vector3f::UnitY() : Vector3f::UnitX();
    const Vector3f right = other.cross(forward).normalized(), up = forward.cross(right);
    const bool cone = lamp.cone_deg > 0, area = lamp.size.x() > 0;
    u.position << place_in(lamp, right, up, offsets), lamp.radius;
    u.intensity << lamp.intensity, 0;
    u.direction << forward, area ? 1.0f : 0.0f;
    u.right << right, area ? 0.0f : 1.0f;
    u.up << up, 1;
    if (cone) {
      const float half = 0.5f * lamp.cone_deg * std::numbers::pi_v<float> / 180;
      const float edge = std::cos(half), full = std::cos(half * (1 - std::clamp(lamp.softness, 0.02f, 1.0f)));
      u.direction.w() = 1 / (full - edge);
      u.right.w() = -edge / (full - edge);
      u.up.w() = 1.05f * std::tan(half);
    }
    if (!lamp.shadows || rows_ == static_cast<int>(kMostLampShadows)) continue;
    u.intensity.w() = cone ? 1.0f : 2.0f;
    add_shadow(rows_++, u);
  }
  frame.air.x() = static_cast<float>(chosen.size());
  const Vector2f size(kRowWidth_px, static_cast<float>(std::max(rows_, rows_made_)) * kRowHeight_px);
  for (LampUniforms& lamp : frame.lamps) {
    lamp.block.head<2>() = lamp.block.head<2>().cwiseQuotient(size).eval();
    lamp.block.tail<2>() = lamp.block.tail<2>().cwiseQuotient(size).eval();
  }
}

void LampPass::begin() {
  if (rows_ > rows_made_) {
    rows_made_ = rows_;
    depth_ = gl::make_target(GL_DEPTH_COMPONENT32F, kRowWidth_px, rows_ * kRowHeight_px, GL_LINEAR);
    glTextureParameteri(depth_, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    glTextureParameteri(depth_, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
    framebuffer_ = gl::make_framebuffer(0, depth_);
    plain_ = gl::make_depth_sampler();
  }
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  const float farthest = 1;
  glDepthMask(GL_TRUE);
  glClearNamedFramebufferfv(framebuffer_, GL_DEPTH, 0, &farthest);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDisable(GL_BLEND);
  glDisable(GL_CULL_FACE);
}

void LampPass::begin(const Tile& tile) const {
  glViewport(tile.x_px, tile.y_px, tile.size_px, tile.size_px);
}

void LampPass::end() const {
  glBindTextureUnit(kLampShadowUnit, depth_);
  glBindTextureUnit(kLampPlainUnit, depth_);
  glBindSampler(kLampPlainUnit, plain_);
}

}  // namespace offstage::render
