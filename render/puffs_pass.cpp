#include "render/puffs_pass.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <tbb/parallel_for.h>

namespace offstage::render {
namespace {

constexpr GLuint kColorUnit = 6, kLowDepthUnit = 7;
constexpr float kMostOpaque = 0.98f;  // greatest opacity of one puff, so that its optical depth is finite
/// Radii of puffs from which on their picture is drawn at half and at a quarter of the size.
constexpr double kHalf_px = 8, kQuarter_px = 64;
/// Radius from which on a puff fades out, as a fraction of half the picture's height.
constexpr float kNearestPuff = 1.2f;
constexpr float kTolerance = 0.25f;   // depth in typical radii over which puffs change little
constexpr float kFlameWobble = 0.5f;  // [rad]
constexpr float kSpin = 0.35f;        // [rad/s]

PuffAtlas::Kind kind_of(PointStyle style) {
  return style == PointStyle::fire ? PuffAtlas::Kind::flame : PuffAtlas::Kind::smoke;
}

// Several independent random properties of a puff, derived from its random number in [0, 1), which has 24
// bits.
struct Shape {
  int variant;
  bool mirrored;
  float turn;  // in [0, 1)
  explicit Shape(float own) {
    const auto bits = static_cast<uint32_t>(own * 0x1p24f);
    variant = static_cast<int>(bits % PuffAtlas::kVariants);
    mirrored = (bits & PuffAtlas::kVariants) != 0;
    turn = static_cast<float>(bits >> 4) * 0x1p-20f;
  }
};

// Because of the size of the sun's disc, the shadow of a drop disappears within a few tens of its widths.
// Drops are therefore treated as mist.
void add_drops(const PointSet& set, std::vector<OpacityGrid::Absorber>& absorbers) {
  constexpr float kLost = 0.6f;  // fraction of the light on a drop that is removed
  for (const GpuPoint& point : set.points) {
    const float radius = point.position.w();
    const float length = std::max(set.def.stretch_s * point.velocity.head<3>().norm(), 2 * radius);
    absorbers.push_back({point.position.head<3>(), 0.5f * length,
                         kLost * 2 * radius * length * std::min(point.color.w(), 1.0f)});
  }
}

// Thin parts of flames are redder.
constexpr float kFlameThin[3] = {0.85f, 0.45f, 0.2f}, kFlameThick[3] = {0.3f, 0.75f, 1.0f};

// The mean of the normal's component towards the eye, over the disc of a ball.
constexpr float kMeanTowards = 2.0f / 3;

}  // namespace

Vector3f mean_radiance_of_flame(float number) {
  Vector3f result;
  for (int k = 0; k < 3; ++k)
    result[k] = (0.5f + Shape(number).turn) * (kFlameThin[k] + kMeanTowards * kFlameThick[k]);
  return result;
}

void PuffsPass::prepare(std::span<const PointSet* const> sets, const Sun& sun) {
  std::vector<OpacityGrid::Absorber> absorbers;
  for (const PointSet* set : sets) {
    if (set->is_puffs() && !atlas_) atlas_ = std::make_unique<PuffAtlas>();
    if (!set->def.casts_shadow || !sun.shadows || sun.intensity <= 0) continue;
    if (set->def.style == PointStyle::streak) add_drops(*set, absorbers);
    if (set->def.style != PointStyle::smoke) continue;
    const float mean_cover = atlas_->mean_cover(PuffAtlas::Kind::smoke);
    for (const GpuPoint& point : set->points) {
      const float radius = point.position.w();
      const float depth = -std::log(1 - std::min(point.color.w(), kMostOpaque));
      absorbers.push_back({point.position.head<3>(), radius, depth * mean_cover * 4 * radius * radius});
    }
  }
  grid_.build(absorbers, -sun.direction.normalized());
}

float PuffsPass::mean_cover(PointStyle style) const {
  return atlas_->mean_cover(kind_of(style)) * (4 / std::numbers::pi_v<float>);
}

void PuffsPass::measure(const PaintOrder& order, const View& view, float pixel_m) {
  farthest_m_ = 0;
  double area = 0, volume = 0, area_px = 0, volume_px = 0;
  for (const uint64_t key : order.keys(PaintOrder::Kind::puffs)) {
    const PaintOrder::Place at = order.place(PaintOrder::Kind::puffs, key);
    const Vector4f& ball = at.set->points[at.index].position;
    const float depth = view.depth_of(ball.head<3>());
    const auto r = static_cast<double>(ball.w());
    const double px = r / static_cast<double>(depth * pixel_m);
    area += r * r;
    volume += r * r * r;
    area_px += px * px;
    volume_px += px * px * px;
    farthest_m_ = std::max(farthest_m_, depth + ball.w());
  }
  // In a picture of half or a quarter of the size, large puffs look the same and take a fraction of the time.
  typical_m_ = static_cast<float>(volume / area);
  const double typical_px = volume_px / area_px;
  factor_ = typical_px < kHalf_px ? 1 : typical_px < kQuarter_px ? 2 : 4;
}

namespace {

/// The picture into which puffs are drawn.
struct PuffScreen {
  const View& view;
  Vector2f half_size;  // [px]
  float pixel_m;       // size of a pixel at a depth of 1 m
};

/// Sets everything but the radiance, and returns the axes of the atlas's cell in the world.
Eigen::Matrix3f place_puff(const PointSet& set, std::size_t i, const PuffScreen& screen,
                           const PuffAtlas& atlas, Splat& s) {
  const View& view = screen.view;
  const GpuPoint& point = set.points[i];
  const Vector3f center = point.position.head<3>();
  const float radius = point.position.w();
  const bool flame = set.def.style == PointStyle::fire;

  s.depth = view.depth_of(center);
  const Vector4f clip = view.clip_from_world * center.homogeneous();
  s.x = (clip.x() / clip.w() + 1) * screen.half_size.x();
  s.y = (clip.y() / clip.w() + 1) * screen.half_size.y();
  const float pixel = screen.pixel_m * s.depth, drawn = std::max(radius, 0.7f * pixel);
  const float radius_px = drawn / pixel, thinning = radius / drawn;
  s.inverse_reach = 0.5f / drawn;
  s.cover = flame ? kFlameCover : set.def.additive ? 0.0f : 1.0f;
  s.opacity = std::min(point.color.w(), 1.0f) * thinning * thinning *
              std::clamp(0.5f * (s.depth - view.near_m) / drawn, 0.0f, 1.0f);

  // A puff near the eye fills the picture. It fades out before the eye is inside it.
  const float apart = std::clamp(0.5f * s.depth / radius - 1, 0.0f, 1.0f);
  s.opacity *= std::max(apart, std::clamp(2 - radius_px / (kNearestPuff * screen.half_size.y()), 0.0f, 1.0f));

  // Axes of the cell on the screen, and the stretch along the motion.
  const Shape shape(point.velocity.w());
  const Vector3f velocity = point.velocity.head<3>();
  Vector2f motion(velocity.dot(view.right), velocity.dot(view.up));
  const float stretch = 1 + 0.5f * set.def.stretch_s * motion.norm() / drawn;
  if (flame) motion += 0.2f * Vector2f(view.right.y(), view.up.y());  // flames at rest point upwards
  const Vector2f along = motion.norm() > 1e-6f ? Vector2f(motion.normalized()) : Vector2f(0, 1);
  float angle = 2 * std::numbers::pi_v<float> * shape.turn + kSpin * (2 * shape.turn - 1) * set.ages[i];
  if (flame) angle = std::atan2(along.x(), along.y()) + kFlameWobble * (2 * shape.turn - 1);
  const float c = std::cos(angle), sine = std::sin(angle);
  const Vector2f u = (shape.mirrored ? -1.0f : 1.0f) * Vector2f(c, -sine), v(sine, c);
  const Vector2f u_px = (u - (1 - 1 / stretch) * u.dot(along) * along) / radius_px;
  const Vector2f v_px = (v - (1 - 1 / stretch) * v.dot(along) * along) / radius_px;
  s.ux = u_px.x();
  s.uy = u_px.y();
  s.vx = v_px.x();
  s.vy = v_px.y();
  const Vector2f half =
      (Vector2f::Ones() + (stretch * stretch - 1) * along.cwiseAbs2()).cwiseSqrt() * radius_px;
  s.half_x = half.x();
  s.half_y = half.y();
  s.cell = atlas.level(kind_of(set.def.style), shape.variant, 2 * radius_px * stretch);

  Eigen::Matrix3f world_from_cell;
  world_from_cell << u.x() * view.right + u.y() * view.up, v.x() * view.right + v.y() * view.up,
      -view.forward;
  return world_from_cell;
}

/// Sets the radiance of a placed puff.
void light_puff(const PointSet& set, std::size_t i, const Vector3f& eye,
                const Eigen::Matrix3f& world_from_cell, const PuffLight& light, Splat& s) {
  const GpuPoint& point = set.points[i];
  const Vector3f center = point.position.head<3>();
  const Vector4f fog = light.fog_to(center);
  const Vector3f haze = s.cover * fog.head<3>();
  const Vector3f albedo = point.color.head<3>();
  AirRadiance radiance;
  Eigen::Matrix3f by_cell_normal = Eigen::Matrix3f::Zero();
  if (set.def.style == PointStyle::fire) {
    const float turn = Shape(point.velocity.w()).turn;
    for (int k = 0; k < 3; ++k) {
      radiance.constant[k] = (0.5f + turn) * kFlameThin[k];
      by_cell_normal(k, 2) = (0.5f + turn) * kFlameThick[k];
    }
  } else if (set.def.lit) {
    const ParticleLight own = light.of_puff(center, point.position.w(), albedo, point.velocity.w());
    radiance = own.diffuse;
    radiance.constant +=
        forward_lobe(Scattering::puff, light.to_sun.dot((center - eye).normalized())) * own.forward;
    by_cell_normal = radiance.slope * world_from_cell;
  } else {
    radiance.constant.setOnes();
  }
  for (int k = 0; k < 3; ++k) {
    s.radiance[k][0] = albedo[k] * fog.w() * radiance.constant[k] + haze[k];
    for (int j = 0; j < 3; ++j) s.radiance[k][j + 1] = albedo[k] * fog.w() * by_cell_normal(k, j);
  }
}

}  // namespace

void PuffsPass::make_splats(const PaintOrder& order, const View& view, const PuffLight& light) {
  const auto factor = static_cast<float>(factor_);
  const PuffScreen screen = {
      view,
      {0.5f * static_cast<float>(width_px_) / factor, 0.5f * static_cast<float>(height_px_) / factor},
      light.frame.eye.w() * factor};
  const std::span<const uint64_t> keys = order.keys(PaintOrder::Kind::puffs);
  splats_.resize(keys.size());
  constexpr std::size_t kBlock = 512;
  tbb::parallel_for(std::size_t{0}, (keys.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
    for (std::size_t k = block * kBlock; k < std::min(keys.size(), (block + 1) * kBlock); ++k) {
      const PaintOrder::Place at = order.place(PaintOrder::Kind::puffs, keys[k]);
      Splat& s = splats_[k];
      const Eigen::Matrix3f world_from_cell = place_puff(*at.set, at.index, screen, *atlas_, s);
      light_puff(*at.set, at.index, view.eye, world_from_cell, light, s);
    }
  });
}

namespace {

Eigen::AlignedBox2f area_of(std::span<const Splat> splats) {
  Eigen::AlignedBox2f area;
  for (const Splat& s : splats)
    area.extend(Vector2f(s.x - s.half_x, s.y - s.half_y)).extend(Vector2f(s.x + s.half_x, s.y + s.half_y));
  return area;
}

}  // namespace

Eigen::AlignedBox2i PuffsPass::area_px(uint32_t first, uint32_t last) const {
  const Eigen::AlignedBox2f area = area_of(std::span(splats_).subspan(first, last - first));
  const Eigen::Array2f most(static_cast<float>(width_px_), static_cast<float>(height_px_));
  const auto factor = static_cast<float>(factor_);
  return {(factor * (area.min().array() - 1)).max(0).min(most).floor().cast<int>().matrix(),
          (factor * (area.max().array() + 1)).max(0).min(most).ceil().cast<int>().matrix()};
}

void PuffsPass::read_depth(std::span<const Splat> splats, const FrameUniforms& frame, GLuint framebuffer) {
  const int factor = factor_;
  picture_.width_px = (width_px_ + factor - 1) / factor;
  picture_.height_px = (height_px_ + factor - 1) / factor;
  picture_.depth.assign(
      static_cast<std::size_t>(picture_.width_px) * static_cast<std::size_t>(picture_.height_px), 0);
  const Eigen::AlignedBox2f seen = area_of(splats);
  const auto low = [](float x, int limit) {
    return static_cast<int>(std::clamp(std::floor(x) - 1, 0.0f, static_cast<float>(limit)));
  };
  const auto high = [](float x, int limit) {
    return static_cast<int>(std::clamp(std::ceil(x) + 1, 0.0f, static_cast<float>(limit)));
  };
  const int x0 = low(seen.min().x(), picture_.width_px), x1 = high(seen.max().x(), picture_.width_px);
  const int y0 = low(seen.min().y(), picture_.height_px), y1 = high(seen.max().y(), picture_.height_px);
  if (x0 >= x1 || y0 >= y1) return;
  const int left = x0 * factor, bottom = y0 * factor;
  const int width = std::min(x1 * factor, width_px_) - left,
            height = std::min(y1 * factor, height_px_) - bottom;
  depths_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
  glReadPixels(left, bottom, width, height, GL_DEPTH_COMPONENT, GL_FLOAT, depths_.data());
  // Takes alternately the nearest and the farthest of the pixels, so that compositing finds both sides of
  // every edge (Jansen and Bavoil, "Fast Rendering of Opacity Mapped Particles", 2011). A nearer depth is
  // greater.
  tbb::parallel_for(y0, y1, [&](int y) {
    for (int x = x0; x < x1; ++x) {
      const bool nearest = ((x ^ y) & 1) != 0;
      float value = nearest ? 0.0f : 1.0f;
      for (int j = y * factor - bottom; j < std::min((y + 1) * factor - bottom, height); ++j) {
        for (int i = x * factor - left; i < std::min((x + 1) * factor - left, width); ++i) {
          const float d = depths_[static_cast<std::size_t>(j) * static_cast<std::size_t>(width) +
                                  static_cast<std::size_t>(i)];
          value = nearest ? std::max(value, d) : std::min(value, d);
        }
      }
      picture_.depth[static_cast<std::size_t>(y * picture_.width_px + x)] =
          std::min(frame.depth.x() / (value + frame.depth.y()), farthest_m_);
    }
  });
}

void PuffsPass::composite(GLuint framebuffer) {
  const int factor = factor_;
  if (picture_.x0 >= picture_.x1) return;
  if (texture_factor_ != factor) {
    texture_factor_ = factor;
    colors_ = gl::make_target(GL_RGBA32F, picture_.width_px, picture_.height_px, GL_NEAREST);
    low_depths_ = gl::make_target(GL_R32F, picture_.width_px, picture_.height_px, GL_NEAREST);
  }
  const auto upload = [this](GLuint texture, GLenum format, const std::vector<float>& values,
                             int components) {
    const int width = picture_.x1 - picture_.x0, height = picture_.y1 - picture_.y0;
    const auto first =
        (static_cast<std::ptrdiff_t>(picture_.y0) * picture_.width_px + picture_.x0) * components;
    glTextureSubImage2D(texture, 0, picture_.x0, picture_.y0, width, height, format, GL_FLOAT,
                        values.data() + first);
  };
  glPixelStorei(GL_UNPACK_ROW_LENGTH, picture_.width_px);
  upload(colors_, GL_RGBA, picture_.rgbt, 4);
  upload(low_depths_, GL_RED, picture_.depth, 1);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  glBindTextureUnit(kColorUnit, colors_);
  glBindTextureUnit(kLowDepthUnit, low_depths_);

  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_SCISSOR_TEST);
  glScissor(picture_.x0 * factor, picture_.y0 * factor, (picture_.x1 - picture_.x0) * factor,
            (picture_.y1 - picture_.y0) * factor);
  program_.use();
  glUniform3f(0, static_cast<float>(factor_), kTolerance * typical_m_, farthest_m_);
  glUniform4i(1, picture_.x0, picture_.y0, picture_.x1 - 1, picture_.y1 - 1);
  glBindVertexArray(no_attributes_);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glDisable(GL_SCISSOR_TEST);
  glEnable(GL_DEPTH_TEST);
}

void PuffsPass::prepare_splats(const PaintOrder& order, const View& view, const PuffLight& light) {
  splats_.clear();
  if (order.keys(PaintOrder::Kind::puffs).empty()) return;
  measure(order, view, light.frame.eye.w());
  make_splats(order, view, light);
}

void PuffsPass::draw(uint32_t first, uint32_t last, const FrameUniforms& frame, GLuint framebuffer) {
  const std::span<const Splat> splats = std::span<const Splat>(splats_).subspan(first, last - first);
  read_depth(splats, frame, framebuffer);
  draw_splats(splats, picture_);
  composite(framebuffer);
}

}  // namespace offstage::render
