#pragma once
/// Private: draws lines. Each line is one instanced quad that faces the eye. Lines are blended back to front
/// over the finished picture: first the hidden parts with their reduced opacity, then the visible parts.

#include <span>
#include <vector>

#include "render/frame.h"
#include "render/gl.h"

namespace offstage::render {

struct GpuLine {
  Vector4f a, b;  ///< end points; w: width of the line there
  Vector4f color;
};

struct LineSet {
  LinesDef def;
  std::vector<Line> lines;
  gl::StreamBuffer buffer;  ///< visible lines, in drawing order
  GLsizei drawn = 0;        ///< number of lines in the buffer

  void assign(std::span<const Line> values);
};

class LinesPass {
 public:
  LinesPass();
  /// Clips lines at the near plane and uploads them back to front for this view.
  void prepare(LineSet& set, const View& view);
  void draw(const LineSet& set, int width_px, int height_px);

 private:
  gl::LazyProgram program_{{"frame.glsl", "lines.vert"}, {"frame.glsl", "lines.frag"}};
  gl::VertexArray vertex_array_;
  std::vector<GpuLine> ordered_;
  std::vector<std::pair<float, uint32_t>> keys_;
};

}  // namespace offstage::render
