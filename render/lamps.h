#pragma once
/// Private: lamps and their shadows. All shadow maps share one texture. A lamp that shines in all directions
/// has a block of two rows of three tiles; a cone has one larger tile.

#include <span>
#include <vector>

#include "render/frame.h"
#include "render/gl.h"
#include "render/points_pass.h"
#include "render/shadow_map.h"

namespace offstage::render {

/// Creates a lamp in the middle of a fire, as bright as its flames.
Lamp lamp_of_fire(const PointSet& flames);

/// Radiance of a white surface that faces a lamp, and the unit vector to the lamp, computed as in
/// shaders/lamps.glsl.
Vector3f lamp_radiance(const LampUniforms& lamp, const Vector3f& place, Vector3f& towards);

class LampPass {
 public:
  /// Selects the lamps of a sub-frame, and the point of each that emits in this sub-frame.
  void prepare(std::span<const Lamp> lamps, const SampleOffsets& offsets, FrameUniforms& frame);
  /// One view of a shadow map.
  struct Tile {
    Matrix4f clip_from_world;
    int x_px, y_px, size_px;
    Vector3f eye, forward;
    float slope;  ///< tangent of half its angle, towards the corners

    bool sees(const Caster& caster) const;
  };
  const std::vector<Tile>& tiles() const { return tiles_; }
  /// Binds and clears the map and sets the state for drawing casters into its tiles.
  void begin();
  void begin(const Tile& tile) const;
  /// Ends drawing and leaves the map bound for shading.
  void end() const;

 private:
  void add_shadow(int row, LampUniforms& lamp);

  std::vector<Tile> tiles_;
  int rows_ = 0, rows_made_ = 0;
  gl::Texture depth_;
  gl::Framebuffer framebuffer_;
  gl::Sampler plain_;
};

}  // namespace offstage::render
