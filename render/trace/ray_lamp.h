#pragma once
/// Private: a lamp as a light source with an area.

#include "render/stage.h"
#include "render/trace/directions.h"

namespace offstage::render {

/// A point of a lamp as seen from one place, or from eight.
template <class T>
struct LampPoint {
  Three<T> towards;  ///< unit direction from the place to the point
  T distance;        ///< [m]
  T share;           ///< share of the lamp's intensity that arrives at a surface there that faces the point
};

class RayLamp {
 public:
  explicit RayLamp(const Lamp& lamp);
  /// The point of the lamp that belongs to `uv`. `place` is where the light arrives.
  LampPoint<float> point(const Three<float>& place, const SquarePoint<float>& uv) const;
  LampPoint<Lanes> point(const LaneVectors& place, const SquarePoint<Lanes>& uv) const;
  const Lamp& def() const { return def_; }

 private:
  template <class T>
  LampPoint<T> point_of(const Three<T>& place, const SquarePoint<T>& uv) const;

  Lamp def_;
  Vector3f right_, up_;
  float cone_factor_ = 0, cone_offset_ = 1;
};

}  // namespace offstage::render
