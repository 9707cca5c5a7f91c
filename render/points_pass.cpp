#include "render/points_pass.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "render/paint_order.h"
#include "render/puff_light.h"

namespace offstage::render {
namespace {

constexpr GLuint kPictureUnit = 1;
constexpr float kCorner = std::numbers::sqrt2_v<float>;  // distance of the corner of a picture, in radii

// Returns a number in [0, 1) that depends only on `id`: the finalizer of SplitMix64, scaled.
float number_of_its_own(uint64_t id) {
  id = (id ^ (id >> 30)) * 0xBF58476D1CE4E5B9ull;
  id = (id ^ (id >> 27)) * 0x94D049BB133111EBull;
  return static_cast<float>((id ^ (id >> 31)) >> 40) * 0x1p-24f;
}

/// Returns the pictures of a sheet that a particle shows at its current age.
GpuPicture picture_of(const Point& point, const PointsDef& def, float random_number) {
  const SpriteSheet& sheet = def.sheet;
  const int count = sheet.columns * sheet.rows;
  if (count <= 1) return {point.angle, 0, 0, 0};
  const auto n = static_cast<double>(count);
  double at = std::max(double{point.age}, 0.0) * sheet.fps;
  if (sheet.random_start) at += std::floor(random_number * n);
  at = sheet.loop ? std::fmod(at, n) : std::min(at, n - 1);
  const double first = std::min(std::floor(at), n - 1);
  const double second = first + 1 < n ? first + 1 : sheet.loop ? 0 : first;
  return {point.angle, static_cast<float>(first), static_cast<float>(second),
          sheet.blend ? static_cast<float>(at - first) : 0};
}

Vector4f style_of(const PointsDef& def) {
  return {std::clamp(def.softness, 0.01f, 1.0f), def.stretch_s, def.lit ? 1.0f : -1.0f,
          def.additive ? 1.0f : 0.0f};
}

}  // namespace

void PointSet::assign(std::span<const Point> values) {
  points.clear();
  ids.clear();
  ages.clear();
  turns.clear();
  box.setEmpty();
  std::vector<Point> by_id;
  const auto smaller_id = [](const Point& a, const Point& b) { return a.id < b.id; };
  if (def.style != PointStyle::sphere && !std::is_sorted(values.begin(), values.end(), smaller_id)) {
    by_id.assign(values.begin(), values.end());
    std::stable_sort(by_id.begin(), by_id.end(), smaller_id);
    values = by_id;
  }
  for (const Point& value : values) {
    const bool drawable =
        value.radius > 0 && value.color.w() > 0 && value.position.allFinite() && value.velocity.allFinite();
    if (!drawable) continue;
    GpuPoint point;
    point.position << value.position, value.radius;
    point.velocity << value.velocity, number_of_its_own(value.id);
    point.color = value.color;
    points.push_back(point);
    ids.push_back(value.id);
    ages.push_back(value.age);
    if (is_turned()) turns.push_back(picture_of(value, def, point.velocity.w()));
    Vector3f reach = Vector3f::Constant(pictures ? kCorner * value.radius : value.radius);
    if (is_stretched()) reach += value.velocity.cwiseAbs() * (0.5f * def.stretch_s);
    box.extend(value.position - reach).extend(value.position + reach);
  }
}

float PointSet::reach(std::size_t i) const {
  const float radius = pictures ? kCorner * points[i].position.w() : points[i].position.w();
  const float stretch = is_stretched() ? 0.5f * def.stretch_s * points[i].velocity.head<3>().norm() : 0.f;
  return radius + stretch;
}

gl::LazyProgram& PointsPass::ball_program(const Features& features) {
  const auto found = ball_programs_.find(features);
  if (found != ball_programs_.end()) return found->second;
  std::vector<std::string> defines = features;
  defines.push_back("STYLE 2");
  return ball_programs_
      .emplace(features, gl::LazyProgram(
                             {"frame.glsl", "sky.glsl", "points.vert"},
                             {"frame.glsl", "sky.glsl", "light.glsl", "traced.glsl", "sphere.frag"}, defines))
      .first->second;
}

gl::LazyProgram& PointsPass::blended_program(PointStyle style, bool pictures) {
  const auto found = blended_programs_.find({style, pictures});
  if (found != blended_programs_.end()) return found->second;
  std::vector<std::string> defines = {"STYLE " + std::to_string(static_cast<int>(style))};
  if (pictures) defines.push_back("PICTURES 1");
  return blended_programs_
      .emplace(std::pair(style, pictures),
               gl::LazyProgram({"frame.glsl", "sky.glsl", "points.vert"},
                               {"frame.glsl", "sky.glsl", "points_shape.glsl", "points.frag"}, defines))
      .first->second;
}

PointsPass::PointsPass() : vertex_array_(gl::make_vertex_array()), blended_array_(gl::make_vertex_array()) {
  for (const GLuint array : {GLuint{vertex_array_}, GLuint{blended_array_}}) {
    gl::set_attribute(array, 0, 0, 4, offsetof(GpuPoint, position));
    gl::set_attribute(array, 1, 0, 4, offsetof(GpuPoint, velocity));
    gl::set_attribute(array, 2, 0, 4, offsetof(GpuPoint, color));
    glVertexArrayBindingDivisor(array, 0, 1);
  }
  gl::set_attribute(blended_array_, 3, 0, 4, offsetof(BlendedPoint, style));
  gl::set_attribute(blended_array_, 4, 0, 4, offsetof(BlendedPoint, picture));
  for (GLuint c = 0; c < 3; ++c)
    gl::set_attribute(blended_array_, 5 + c, 0, 4, offsetof(BlendedPoint, light) + c * sizeof(Vector4f));
  gl::set_attribute(blended_array_, 8, 0, 2, offsetof(BlendedPoint, size_px));
}

void PointsPass::prepare(PointSet& set, const View& view) {
  if (set.def.style != PointStyle::sphere) return;
  keys_.clear();
  ordered_.clear();
  for (uint32_t i = 0; i < set.points.size(); ++i) {
    const Vector3f center = set.points[i].position.head<3>();
    const float depth = view.depth_of(center);
    // The margin accounts for thin particles, which are drawn one pixel wide.
    if (view.sees(center, set.reach(i) + 0.01f * std::abs(depth))) keys_.emplace_back(depth, i);
  }
  std::sort(keys_.begin(), keys_.end(), [&set](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : set.ids[a.second] < set.ids[b.second];
  });
  for (const auto& [depth, i] : keys_) ordered_.push_back(set.points[i]);
  set.seen = ordered_.size();
  set.buffer.write(std::span<const GpuPoint>(ordered_));
}

void PointsPass::prepare_blended(const PaintOrder& order, const PuffLight& light) {
  blended_.clear();
  picture_runs_.clear();
  textures_.update();
  const PointSet* latest = nullptr;
  SpriteTextures::Place pictures;
  Vector2f size_px = Vector2f::Ones();
  const auto look_up = [&](const PointSet& set) {
    if (latest == &set) return;
    latest = &set;
    pictures = set.pictures ? textures_.place(*set.pictures) : SpriteTextures::Place();
    if (set.pictures)
      size_px = Eigen::Vector2i(set.pictures->width_px, set.pictures->height_px).cast<float>();
  };
  const auto append = [&](PaintOrder::Kind kind) {
    const std::span<const uint64_t> keys = order.keys(kind);
    for (std::size_t k = keys.size(); k-- > 0;) {
      const PaintOrder::Place at = order.place(kind, keys[k]);
      look_up(*at.set);
      if (picture_runs_.empty() || picture_runs_.back().pictures != pictures.texture)
        picture_runs_.push_back({blended_.size(), pictures.texture});
      const auto layer = static_cast<float>(pictures.first_layer);
      blended_.push_back({at.set->points[at.index], style_of(at.set->def),
                          at.set->turns[at.index] + Vector4f(0, layer, layer, 0),
                          Eigen::Matrix<float, 4, 3>::Zero(), size_px});
    }
    return static_cast<uint32_t>(keys.size());
  };
  sprites_ = append(PaintOrder::Kind::sprites);
  flakes_ = append(PaintOrder::Kind::flakes);
  if (blended_.empty()) return;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, blended_.size(), 256), [&](const auto& range) {
    for (std::size_t k = range.begin(); k < range.end(); ++k) {
      BlendedPoint& p = blended_[k];
      if (p.style.z() < 0) continue;  // not lit
      const Vector3f place = p.point.position.head<3>();
      const float radius = p.point.position.w(), number = p.point.velocity.w();
      p.style.z() = light.air.sun(place, radius, number) * std::exp(-light.grid.depth(place));
      const AirRadiance around = light.around.at(place).light;
      const Vector3f constant = around.constant + light.air.lamps_around(place, radius, number);
      p.light << constant.transpose(), around.slope.transpose();
    }
  });
  blended_buffer_.write(std::span<const BlendedPoint>(blended_));
}

void PointsPass::draw(const PointSet& set) {
  glVertexArrayVertexBuffer(vertex_array_, 0, set.buffer, 0, sizeof(GpuPoint));
  glBindVertexArray(vertex_array_);
  glUniform4fv(1, 1, style_of(set.def).data());
  gl::draw_quads(static_cast<GLsizei>(set.seen));
}

void PointsPass::draw_spheres(const PointSet& set, const Features& features) {
  ball_program(features).use();
  glUniform2f(2, set.def.metallic, set.def.roughness);
  draw(set);
}

void PointsPass::draw_blended(PointStyle style, uint32_t first, uint32_t last) {
  const uint32_t begin = style == PointStyle::flake ? sprites_ + flakes_ - last : sprites_ - last;
  const uint32_t end = begin + (last - first);
  glVertexArrayVertexBuffer(blended_array_, 0, blended_buffer_, 0, sizeof(BlendedPoint));
  glBindVertexArray(blended_array_);
  // Consecutive particles share a draw call only if they have the same texture. As little state as possible
  // changes between two calls.
  auto run = std::upper_bound(picture_runs_.begin(), picture_runs_.end(), std::size_t{begin},
                              [](std::size_t place, const PictureRun& r) { return place < r.first; });
  std::optional<bool> with_pictures;
  for (std::size_t from = begin; from < end; ++run) {
    const std::size_t to = run == picture_runs_.end() ? end : std::min<std::size_t>(run->first, end);
    const GLuint pictures = std::prev(run)->pictures;
    if (with_pictures != (pictures != 0)) blended_program(style, pictures != 0).use();
    with_pictures = pictures != 0;
    if (pictures) glBindTextureUnit(kPictureUnit, pictures);
    gl::draw_quads(static_cast<GLsizei>(to - from), static_cast<GLuint>(from));
    from = to;
  }
}

void PointsPass::draw_surfaces(const PointSet& set) {
  surface_.use();
  glUniform2f(2, set.def.metallic, set.def.roughness);
  draw(set);
}

}  // namespace offstage::render
