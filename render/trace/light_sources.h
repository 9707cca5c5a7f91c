#pragma once
/// Private: everything that emits light in a sub-frame.

#include <vector>

#include "render/opacity_grid.h"
#include "render/sky.h"
#include "render/stage.h"
#include "render/trace/glow.h"
#include "render/trace/ray_lamp.h"

namespace offstage::render {

/// A solid piece of glass, which focuses the light of the sun; and a ball around it.
struct GlassPiece {
  unsigned object;  ///< in the RayScene
  Vector3f center;
  float radius;
};

struct LightSources {
  Sun sun;
  SkyModel sky;
  float fog = 0;
  std::vector<RayLamp> lamps;
  Glow glow;
  std::vector<GlassPiece> glass;
  const OpacityGrid* smoke = nullptr;  ///< null: none
};

/// Light at a point in the air, as the radiance of a white surface there with unit normal n: constant +
/// slope * n, per channel.
struct AirRadiance {
  Vector3f constant = Vector3f::Zero();
  Eigen::Matrix3f slope = Eigen::Matrix3f::Zero();  ///< rows: red, green, blue
  Vector3f at(const Vector3f& normal) const { return (constant + slope * normal).cwiseMax(0.0f); }
};

/// Light at a point in the air from everything but the sun's disc and lamps.
struct AirLightAround {
  AirRadiance light;
  float sky = 1;  ///< fraction of the sky's light from above the horizon that arrives
};

/// The disc of the sun.
class SunDisc {
 public:
  SunDisc(const Sun& sun, const Vector3f& direction);
  /// The unit direction to the point of the disc that belongs to `uv`.
  Vector3f direction(const SquarePoint<float>& uv) const;
  LaneVectors direction(const SquarePoint<Lanes>& uv) const;

 private:
  Vector3f middle_, across_, along_;  ///< centre and two perpendicular radii of the disc, at distance 1
};

}  // namespace offstage::render
