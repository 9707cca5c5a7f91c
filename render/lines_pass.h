#pragma once
/// Private: draws lines. Every line is one quad that faces the eye, drawn instanced and blended back to front
/// over the finished picture: first what is hidden, faintly, then what is not.

#include <span>
#include <vector>

#include "render/frame.h"
#include "render/gl.h"

namespace offstage::render {

struct GpuLine {
  Vector4f a, b;  ///< w: width there
  Vector4f color;
};

struct LineSet {
  LinesDef def;
  std::vector<Line> lines;
  gl::StreamBuffer buffer;  ///< what the view sees of them, in drawing order
  GLsizei drawn = 0;        ///< how many those are

  void assign(std::span<const Line> values);
};

class LinesPass {
 public:
  LinesPass();
  /// Cuts lines off at the near plane and uploads them back to front for this view.
  void prepare(LineSet& set, const View& view);
  void draw(const LineSet& set, int width_px, int height_px);

 private:
  gl::LazyProgram program_{{"frame.glsl", "lines.vert"}, {"frame.glsl", "lines.frag"}};
  gl::VertexArray vertex_array_;
  std::vector<GpuLine> ordered_;
  std::vector<std::pair<float, uint32_t>> keys_;
};

}  // namespace offstage::render
