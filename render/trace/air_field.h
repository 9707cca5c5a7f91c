#pragma once
/// Private: a grid of the light that particles receive from the sky and from objects. This light changes
/// little over a short distance. It is therefore traced at some of the particles only, and interpolated for
/// the others. The interpolation also averages the noise of the rays.

#include <span>
#include <vector>

#include "render/trace/light_tracer.h"

namespace offstage::render {

class AirField {
 public:
  /// A particle.
  struct Ball {
    Vector3f center;
    /// Constant pseudo-random number in [0, 1), which selects the traced particles and the rays.
    float number;
  };
  /// Traces the light of a sub-frame at some of the `balls`. `open`: see LightTracer::trace_air.
  AirField(const LightTracer& tracer, const SampleOffsets& offsets, std::span<const Ball> balls,
           const AirRadiance& open);
  /// Returns the interpolated light at a point, which should be the centre of one of the balls.
  AirLightAround at(const Vector3f& place) const;

 private:
  /// The sum of the weights of the samples [0], and weighted sums of their AirLightAround: sky [1], constant
  /// [2, 5) and slope [5, 14) of the light. The last two numbers are padding.
  using Sums = Eigen::Array<float, 16, 1>;
  /// Calls each(index in corners_, trilinear weight) for the eight grid corners around a point.
  template <class Each>
  void for_corners(const Vector3f& place, Each&& each) const;

  Vector3f origin_ = Vector3f::Zero();  ///< position of the first corner of the grid
  float cell_m_ = 1;
  Eigen::Array3i size_ = Eigen::Array3i::Zero();  ///< numbers of corners along x, y and z
  std::vector<Sums> corners_;
  Sums total_ = Sums::Zero();  ///< sums over all samples, for points far from any of them
};

}  // namespace offstage::render
