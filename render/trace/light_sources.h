#pragma once
/// Private: everything that emits light in a sub-frame.

#include <vector>

#include "render/opacity_grid.h"
#include "render/sky.h"
#include "render/stage.h"
#include "render/trace/glow.h"
#include "render/trace/ray_lamp.h"

namespace offstage::render {

/// A solid piece of glass, which focuses light, and the box around it.
struct GlassPiece {
  unsigned object;  ///< in the RayScene
  Vector3f corner;
  Eigen::Matrix3f edges;  ///< columns: the edges of the box at its corner

  Vector3f center() const { return corner + 0.5f * edges.rowwise().sum(); }
  /// A vector along edge k, at right angles to the other two, whose length is the area of the side they span.
  Vector3f side(int k) const {
    const Vector3f normal = edges.col((k + 1) % 3).cross(edges.col((k + 2) % 3));
    return normal.dot(edges.col(k)) < 0 ? -normal : normal;
  }
  /// Outward normal of one of the six faces, whose length is the area of the face; and the middle of the
  /// face.
  Vector3f outward(int face) const { return face < 3 ? -side(face) : side(face - 3); }
  Vector3f middle_of(int face) const { return center() + (face < 3 ? -0.5f : 0.5f) * edges.col(face % 3); }
  bool contains(const Vector3f& place, float margin_m) const;
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
