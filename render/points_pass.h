#pragma once
/// Private: draws balls, sprites and flakes. Every particle is one instanced quad. Sprites and flakes of all
/// sets are blended back to front over the picture; balls are ray-cast with depth among the opaque objects.

#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include "render/frame.h"
#include "render/gl.h"
#include "render/sprite_pictures.h"
#include "render/trace/ray_material.h"

namespace offstage::render {

struct GpuPoint {
  Vector4f position, velocity, color;
};

/// Rotation and pictures of a sprite or flake: angle [rad], indices of two pictures of its sheet, and the
/// weight of the second picture. In a BlendedPoint, the indices are layers of the texture.
using GpuPicture = Vector4f;

/// A sprite or flake of any set.
struct BlendedPoint {
  GpuPoint point;
  Vector4f style;  ///< x: softness; y: stretch [s]; z: visible fraction of the sun, or -1 for a particle that
                   ///< is not lit; w: additive
  GpuPicture picture;
  /// Light of lamps and from around, a column for each of red, green and blue: the constant and the slope of
  /// an AirRadiance.
  Eigen::Matrix<float, 4, 3> light;
  Vector2f size_px = Vector2f::Ones();  ///< size of the picture [px]
};

struct PointSet {
  PointsDef def;
  std::vector<GpuPoint> points;  ///< the particles; w of the position is the radius, w of the velocity a
                                 ///< pseudo-random number in [0, 1)
  std::vector<uint64_t> ids;
  std::vector<float> ages;
  std::vector<GpuPicture> turns;                   ///< for each point of sprites and flakes
  std::shared_ptr<const SpritePictures> pictures;  ///< pictures of the sprites; null: soft discs
  Eigen::AlignedBox3f box;                         ///< bounds of the drawn particles, streaks at full length
  gl::StreamBuffer buffer;                         ///< visible balls by depth
  std::size_t seen = 0;                            ///< number of visible balls in the buffer
  uint32_t object = 0;                             ///< id of the object in Channels
  std::unique_ptr<const RayMaterial> rays;         ///< material of spheres, for light rays

  void assign(std::span<const Point> values);
  /// Returns whether the points are smoke or fire, which PuffsPass draws.
  bool is_puffs() const { return def.style == PointStyle::smoke || def.style == PointStyle::fire; }
  /// Returns whether another pass draws the points: PuffsPass, or StreaksPass for streaks.
  bool is_splatted() const { return is_puffs() || def.style == PointStyle::streak; }
  /// Returns whether points are stretched along their motion.
  bool is_stretched() const { return def.style != PointStyle::sphere; }
  bool is_turned() const { return def.style == PointStyle::sprite || def.style == PointStyle::flake; }
  /// Returns the radius of the bounding sphere of the drawn particle i [m].
  float reach(std::size_t i) const;
};

class PaintOrder;
struct PuffLight;

class PointsPass {
 public:
  PointsPass();
  /// Uploads the visible balls of a set in drawing order.
  void prepare(PointSet& set, const View& view);
  /// Lights and uploads the sprites and flakes of all sets.
  void prepare_blended(const PaintOrder& order, const PuffLight& light);
  /// Adds the pictures of sprites, and returns them for PointSet::pictures.
  std::shared_ptr<const SpritePictures> add_pictures(SpritePictures pictures) {
    return textures_.add(std::move(pictures));
  }
  void draw_spheres(const PointSet& set, const Features& features);
  /// Draws the surfaces of balls into the targets from which their light is traced.
  void draw_surfaces(const PointSet& set);
  /// Draws sprites or flakes; `first` and `last` are their keys in the PaintOrder.
  void draw_blended(PointStyle style, uint32_t first, uint32_t last);
  /// Makes the program of channels_ball.frag current, so that its uniforms can be set before the draw.
  void use_channels() { channels_.use(); }
  void draw_channels(const PointSet& set) { draw(set); }

 private:
  void draw(const PointSet& set);
  gl::LazyProgram& ball_program(const Features& features);
  gl::LazyProgram& blended_program(PointStyle style, bool pictures);

  std::map<Features, gl::LazyProgram> ball_programs_;
  /// Key: style, and whether the points have pictures.
  std::map<std::pair<PointStyle, bool>, gl::LazyProgram> blended_programs_;
  gl::LazyProgram surface_{{"frame.glsl", "sky.glsl", "points.vert"},
                           {"frame.glsl", "sky.glsl", "light.glsl", "surface.glsl", "sphere.frag"},
                           {"STYLE 2", "SURFACE 1"}};
  gl::LazyProgram channels_{{"frame.glsl", "sky.glsl", "points.vert"},
                            {"frame.glsl", "channels_ball.frag"},
                            {"STYLE 2", "CHANNELS 1"}};
  gl::VertexArray vertex_array_, blended_array_;
  std::vector<GpuPoint> ordered_;
  gl::StreamBuffer blended_buffer_;
  std::vector<BlendedPoint> blended_;  ///< all sprites from back to front, then all flakes from back to front
  /// A run of blended points that share a texture of pictures.
  struct PictureRun {
    std::size_t first;
    GLuint pictures;
  };
  std::vector<PictureRun> picture_runs_;  ///< runs of one picture among all blended points, in their order
  SpriteTextures textures_;
  uint32_t sprites_ = 0, flakes_ = 0;  ///< number of sprites and of flakes
  std::vector<std::pair<float, uint32_t>> keys_;
};

}  // namespace offstage::render
