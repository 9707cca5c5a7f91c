#pragma once
/// Private: draws balls, sprites and flakes. Every particle is one instanced quad. Sprites and flakes of all
/// sets are blended back to front over the picture; balls are ray-cast with depth among the opaque objects.

#include <cstdint>
#include <map>
#include <memory>
#include <tuple>
#include <vector>

#include "render/frame.h"
#include "render/gl.h"
#include "render/trace/ray_material.h"

namespace offstage::render {

struct GpuPoint {
  Vector4f position, velocity, color;
};

/// Rotation and pictures of a sprite or flake: angle [rad], two layers of SpritePictures, and the share of
/// the second one.
using GpuPicture = Vector4f;

/// A sprite or flake of any set.
struct BlendedPoint {
  GpuPoint point;
  Vector4f style;
  GpuPicture picture;
};

struct PointSet {
  PointsDef def;
  std::vector<GpuPoint>
      points;  ///< w of position: radius; w of velocity: a pseudo-random number per particle in [0, 1)
  std::vector<uint64_t> ids;
  std::vector<float> ages;
  std::vector<GpuPicture> turns;  ///< for each point; sprites and flakes only
  gl::Texture pictures;           ///< see make_sprite_pictures(); 0: soft discs
  Eigen::AlignedBox3f box;        ///< bounds of the drawn particles, streaks at full length
  gl::StreamBuffer buffer;       ///< balls: first those outside the view whose shadows fall into it, then the
                                 ///< visible ones by depth
  gl::StreamBuffer turn_buffer;  ///< `turns`, for the shadow map
  std::size_t unseen = 0;        ///< number of balls outside the view
  uint32_t object = 0;           ///< id in Channels
  std::unique_ptr<const RayMaterial> rays;  ///< of balls, for light rays

  void assign(std::span<const Point> values);
  /// Smoke and fire, which PuffsPass draws; StreaksPass draws streaks.
  bool is_puffs() const { return def.style == PointStyle::smoke || def.style == PointStyle::fire; }
  bool is_splatted() const { return is_puffs() || def.style == PointStyle::streak; }
  /// Whether points are stretched along their motion.
  bool is_stretched() const { return def.style != PointStyle::sphere; }
  bool is_turned() const { return def.style == PointStyle::sprite || def.style == PointStyle::flake; }
  /// Radius of the ball around everything drawn for a point [m].
  float reach(std::size_t i) const;
};

class PaintOrder;

class PointsPass {
 public:
  PointsPass();
  /// Uploads the points for the shadow map, and balls in drawing order.
  void prepare(PointSet& set, const View& view);
  /// Uploads the sprites and flakes of all sets.
  void prepare_blended(const PaintOrder& order);
  void draw_shadow(const PointSet& set, const Matrix4f& shadow_clip_from_world);
  void draw_spheres(const PointSet& set, const Features& features);
  /// Writes the surfaces of balls for the tracer of light.
  void draw_surfaces(const PointSet& set);
  /// Draws sprites or flakes; `first` and `last` are their keys in the PaintOrder.
  void draw_blended(PointStyle style, uint32_t first, uint32_t last, const Features& features);
  /// Makes the program of channels_ball.frag current, so that its uniforms can be set before the draw.
  void use_channels() { channels_.use(); }
  void draw_channels(const PointSet& set) { draw(set, set.unseen); }

 private:
  void draw(const PointSet& set, std::size_t first);

  struct Programs {
    gl::LazyProgram seen, shadow, surface;
  };
  Programs& programs(PointStyle style, const Features& features = {}, bool pictures = false);
  void draw_blended(PointStyle style, GLuint pictures, std::size_t first, std::size_t last,
                    const Features& features);

  std::map<std::tuple<PointStyle, Features, bool>, Programs> programs_;
  gl::LazyProgram channels_{{"frame.glsl", "sky.glsl", "light.glsl", "lamps.glsl", "points.vert"},
                            {"frame.glsl", "channels_ball.frag"},
                            {"STYLE 2", "CHANNELS 1"}};
  gl::VertexArray vertex_array_, blended_array_;
  std::vector<GpuPoint> ordered_;
  gl::StreamBuffer blended_buffer_;
  std::vector<BlendedPoint> blended_;  ///< sprites, then flakes, each back to front
  /// The first of a run of blended points with the same pictures.
  struct PictureRun {
    std::size_t first;
    GLuint pictures;
  };
  std::vector<PictureRun> picture_runs_;  ///< of all blended points, in their order
  uint32_t sprites_ = 0, flakes_ = 0;     ///< number of each
  std::vector<std::pair<float, uint32_t>> keys_;
};

}  // namespace offstage::render
