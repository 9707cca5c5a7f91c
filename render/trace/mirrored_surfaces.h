#pragma once
/// Private: the diffuse surfaces that smooth mirrors show. Their indirect light is found by random rays, so
/// it is noisy. It is kept apart from the rest of the mirror image and filtered as that of directly visible
/// surfaces, and the mirror image stays sharp.

#include <Eigen/Geometry>

#include "render/stage.h"
#include "render/trace/light_filter.h"

namespace offstage::render {

/// The first diffuse surface on the path of a mirror image.
struct MirroredSurface {
  Eigen::Vector3f place = Eigen::Vector3f::Zero(), normal = Eigen::Vector3f::Zero();
  /// Fraction of the light from all around that arrives at the eye, per channel; zero if there is no surface.
  Eigen::Vector3f fraction = Eigen::Vector3f::Zero();
  Eigen::Vector3f around = Eigen::Vector3f::Zero();  ///< indirect light, as the radiance of a white surface
  float inverse_distance = 0;  ///< mean of 1 / length of the rays that found the light [1/m]
  LightSums sums;              ///< over the rays that found the light

  /// Adds the surface that another ray of the same pixel found; the place is that of the first one.
  void add(const MirroredSurface& more);
};

/// The surfaces in the mirror images of a part of the picture.
class MirroredSurfaces {
 public:
  explicit MirroredSurfaces(const Eigen::AlignedBox2i& area_px);
  /// Sets the surface that pixel (x, y) of the picture shows. Different rows may be set at the same time.
  void set(int x, int y, const MirroredSurface& surface);
  /// Filters the indirect light. `widest`: widest step of the filter at which all light is averaged; wider
  /// steps average only noisy light.
  void filter(int widest);
  /// Returns the indirect light of pixel (x, y) of the picture that arrives at the eye.
  Eigen::Vector3f light(int x, int y) const;

 private:
  void measure_pixels();

  Eigen::Vector2i first_px_;
  LightGuide guide_;
  LightValues around_;
  std::array<LightPlane, 3> fraction_;
  LightPlane inverse_distance_, brightness_, reach2_, noisy_reach2_;
};

}  // namespace offstage::render
