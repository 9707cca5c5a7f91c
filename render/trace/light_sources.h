#pragma once
/// Private: everything that emits light in a sub-frame.

#include <vector>

#include "render/opacity_grid.h"
#include "render/sky.h"
#include "render/stage.h"
#include "render/trace/glow.h"
#include "render/trace/ray_lamp.h"
#include "render/trace/ray_particles.h"

namespace offstage::render {

/// A solid piece of glass that focuses light, and its oriented bounding box.
struct GlassPiece {
  unsigned object;        ///< number of the object in the RayScene
  Vector3f corner;        ///< a corner of the box
  Eigen::Matrix3f edges;  ///< columns: the three edges of the box that start at `corner` [m]

  Vector3f center() const { return corner + 0.5f * edges.rowwise().sum(); }
  /// Returns the normal of the face between the other two edges, on the side of edge k. Its length is the
  /// area of the face [m^2].
  Vector3f side(int k) const {
    const Vector3f normal = edges.col((k + 1) % 3).cross(edges.col((k + 2) % 3));
    return normal.dot(edges.col(k)) < 0 ? -normal : normal;
  }
  /// Returns the outward normal of one of the faces 0 ... 5. Its length is the area of the face [m^2].
  Vector3f outward(int face) const { return face < 3 ? -side(face) : side(face - 3); }
  /// Returns the centre of one of the faces 0 ... 5.
  Vector3f middle_of(int face) const { return center() + (face < 3 ? -0.5f : 0.5f) * edges.col(face % 3); }
  bool contains(const Vector3f& place, float margin_m) const;
};

struct LightSources {
  Sun sun;
  SkyModel sky;
  bool sky_is_visible = true;  ///< false: the background of the picture is transparent
  float fog = 0;
  std::vector<RayLamp> lamps;
  Glow glow;
  std::vector<GlassPiece> glass;
  bool sun_is_tinted = false;          ///< whether panes give the light of the sun another colour
  const OpacityGrid* smoke = nullptr;  ///< opacity of the smoke; null: there is no smoke
  RayParticles* particles = nullptr;   ///< the particles in mirror images; null: there are none
  AirRadiance open_air;                ///< light of the sky on particles, without objects
};

/// Light at a point in the air from the sky and from objects, without the sun's disc and lamps.
struct AirLightAround {
  AirRadiance light;
  float sky = 1;  ///< fraction of the sky's light from above the horizon that arrives
};

/// The disc of the sun.
class SunDisc {
 public:
  SunDisc(const Sun& sun, const Vector3f& direction);
  /// Returns the unit direction to a point of the disc. `uv` is uniform in the unit square.
  Vector3f direction(const SquarePoint<float>& uv) const;
  LaneVectors direction(const SquarePoint<Lanes>& uv) const;

 private:
  Vector3f middle_, across_, along_;  ///< centre and two perpendicular radii of the disc, at distance 1
};

}  // namespace offstage::render
