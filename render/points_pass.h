#pragma once
/// Private: draws balls, sprites and flakes. Every particle is one quad, drawn instanced: sprites and flakes
/// of all sets blended back to front over the picture, balls ray-cast with depth among the opaque things.

#include <cstdint>
#include <map>
#include <vector>

#include "render/frame.h"
#include "render/gl.h"

namespace offstage::render {

struct GpuPoint {
  Vector4f position, velocity, color;
};

/// A sprite or flake, of whichever set.
struct BlendedPoint {
  GpuPoint point;
  Vector4f style;
};

struct PointSet {
  PointsDef def;
  std::vector<GpuPoint> points;  ///< w of position: radius; w of velocity: a number of its own in [0, 1)
  std::vector<uint64_t> ids;
  std::vector<float> ages;
  Eigen::AlignedBox3f box;  ///< of what can be seen of them, streaks at full length
  gl::StreamBuffer buffer;  ///< of balls: first those that only throw shadows into the view, then by depth
  std::size_t unseen = 0;   ///< how many those are
  uint32_t object = 0;      ///< id in Channels

  void assign(std::span<const Point> values);
  /// Smoke and fire, which PuffsPass draws; StreaksPass draws streaks.
  bool is_puffs() const { return def.style == PointStyle::smoke || def.style == PointStyle::fire; }
  bool is_splatted() const { return is_puffs() || def.style == PointStyle::streak; }
  /// Whether points are drawn out along their motion.
  bool is_stretched() const { return def.style != PointStyle::sprite && def.style != PointStyle::sphere; }
  /// Radius of the ball around all that is drawn of a point [m].
  float reach(std::size_t i) const;
};

class PaintOrder;

class PointsPass {
 public:
  PointsPass();
  /// Uploads what the shadow map shows, and balls in drawing order.
  void prepare(PointSet& set, const View& view);
  /// Uploads the sprites and flakes of all sets.
  void prepare_blended(const PaintOrder& order);
  void draw_shadow(const PointSet& set, const Matrix4f& shadow_clip_from_world);
  /// Depth alone of balls.
  void draw_depth(const PointSet& set);
  void draw_spheres(const PointSet& set, const Features& features);
  /// Sprites or flakes from `first` to `last` of their keys in the PaintOrder.
  void draw_blended(PointStyle style, uint32_t first, uint32_t last, const Features& features);
  /// Balls with channels_ball.frag, whose uniforms are set in between.
  void use_channels() { channels_.use(); }
  void draw_channels(const PointSet& set) { draw(set, set.unseen); }

 private:
  void draw(const PointSet& set, std::size_t first);

  struct Programs {
    gl::LazyProgram seen, shadow, depth;
  };
  Programs& programs(PointStyle style, const Features& features = {});

  std::map<std::pair<PointStyle, Features>, Programs> programs_;
  gl::LazyProgram channels_{{"frame.glsl", "sky.glsl", "light.glsl", "lamps.glsl", "points.vert"},
                            {"frame.glsl", "channels_ball.frag"},
                            {"STYLE 2", "CHANNELS 1"}};
  gl::VertexArray vertex_array_, blended_array_;
  std::vector<GpuPoint> ordered_;
  gl::StreamBuffer blended_buffer_;
  std::vector<BlendedPoint> blended_;  ///< sprites, then flakes, each back to front
  uint32_t sprites_ = 0, flakes_ = 0;  ///< how many those are
  std::vector<std::pair<float, uint32_t>> keys_;
};

}  // namespace offstage::render
