#pragma once
/// Private: the light that particles receive from the sky and from objects around them. It changes little
/// over a short distance, so it is traced at some of the particles and interpolated between them, which also
/// averages its noise.

#include <span>
#include <vector>

#include "render/trace/light_tracer.h"

namespace offstage::render {

class AirField {
 public:
  /// A particle. `number`: one in [0, 1) that it keeps; it decides whether the light is traced at the
  /// particle, and along which rays.
  struct Ball {
    Vector3f center;
    float number;
  };
  /// Traces the light of a sub-frame around `balls`. `open`: see LightTracer::trace_air.
  AirField(const LightTracer& tracer, const SampleOffsets& offsets, std::span<const Ball> balls,
           const AirRadiance& open);
  /// Returns the light at the centre of one of the balls.
  AirLightAround at(const Vector3f& place) const;

 private:
  /// Weight of the samples, and sums over them: fraction of the sky, constant and slope of the light.
  using Sums = Eigen::Array<float, 16, 1>;
  /// Calls each(corner of the grid, weight) for the eight corners around a place.
  template <class Each>
  void for_corners(const Vector3f& place, Each&& each) const;

  Vector3f origin_ = Vector3f::Zero();  ///< the first corner of the grid
  float cell_m_ = 1;
  Eigen::Array3i size_ = Eigen::Array3i::Zero();  ///< numbers of corners along x, y and z
  std::vector<Sums> corners_;
  Sums total_ = Sums::Zero();
};

}  // namespace offstage::render
