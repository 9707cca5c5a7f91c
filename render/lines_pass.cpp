#include "render/lines_pass.h"

#include <algorithm>
#include <optional>
#include <utility>

namespace offstage::render {
namespace {

/// Returns the part of a line in front of the near plane; nothing if there is none.
std::optional<Line> in_front(Line line, const View& view) {
  const float a = view.depth_of(line.a) - view.near_m, b = view.depth_of(line.b) - view.near_m;
  if (a < 0 && b < 0) return std::nullopt;
  if (a >= 0 && b >= 0) return line;
  const float t = a / (a - b);
  const Vector3f cut = line.a + t * (line.b - line.a);
  const float width = line.width_a + t * (line.width_b - line.width_a);
  (a < 0 ? line.a : line.b) = cut;
  (a < 0 ? line.width_a : line.width_b) = width;
  return line;
}

}  // namespace

void LineSet::assign(std::span<const Line> values) {
  lines.clear();
  for (const Line& value : values) {
    const bool drawable = std::max(value.width_a, value.width_b) > 0 && value.color.w() > 0 &&
                          value.a.allFinite() && value.b.allFinite();
    if (drawable) lines.push_back(value);
  }
}

LinesPass::LinesPass() : vertex_array_(gl::make_vertex_array()) {
  gl::set_attribute(vertex_array_, 0, 0, 4, offsetof(GpuLine, a));
  gl::set_attribute(vertex_array_, 1, 0, 4, offsetof(GpuLine, b));
  gl::set_attribute(vertex_array_, 2, 0, 4, offsetof(GpuLine, color));
  glVertexArrayBindingDivisor(vertex_array_, 0, 1);
}

void LinesPass::prepare(LineSet& set, const View& view) {
  keys_.clear();
  for (uint32_t i = 0; i < set.lines.size(); ++i) {
    const Line& line = set.lines[i];
    keys_.emplace_back(-view.depth_of(0.5f * (line.a + line.b)), i);
  }
  std::sort(keys_.begin(), keys_.end());
  ordered_.clear();
  for (const auto& [depth, i] : keys_) {
    const std::optional<Line> line = in_front(set.lines[i], view);
    if (!line) continue;
    GpuLine& out = ordered_.emplace_back();
    out.a << line->a, line->width_a;
    out.b << line->b, line->width_b;
    out.color = line->color;
  }
  set.drawn = static_cast<GLsizei>(ordered_.size());
  set.buffer.write(std::span<const GpuLine>(ordered_));
}

void LinesPass::draw(const LineSet& set, int width_px, int height_px) {
  if (set.drawn == 0) return;
  program_.use();
  glVertexArrayVertexBuffer(vertex_array_, 0, set.buffer, 0, sizeof(GpuLine));
  glBindVertexArray(vertex_array_);
  const Vector2f half_size_px(0.5f * static_cast<float>(width_px), 0.5f * static_cast<float>(height_px));
  glUniform2fv(0, 1, half_size_px.data());
  glUniform1f(1, set.def.width * half_size_px.y());
  const auto draw_where = [&](GLenum depth_test, float opacity) {
    if (opacity <= 0) return;
    glDepthFunc(depth_test);
    glUniform1f(2, opacity);
    gl::draw_quads(set.drawn);
  };
  draw_where(GL_LEQUAL, set.def.hidden);  // depth increases towards the eye
  draw_where(GL_GREATER, 1);
}

}  // namespace offstage::render
