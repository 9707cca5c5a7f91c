#pragma once
/// Private: a lamp as a light source with an area, and the bright part of the sky's picture as another.

#include "render/sky_picture.h"
#include "render/stage.h"
#include "render/trace/directions.h"
#include "render/trace/ray_scene.h"

namespace offstage::render {

/// A point of a lamp as seen from one place, or from eight.
template <class T>
struct LampPoint {
  Three<T> towards;  ///< unit direction from the place to the point
  T distance;        ///< [m]
  T fraction;  ///< fraction of the lamp's intensity that arrives at a surface there that faces the point
  Three<T> arriving;  ///< radiance of a white surface: `fraction` times the intensity of the lamp
  T density;  ///< probability density of the direction, if rays meet the lamp, too; otherwise 0 [1/sr]
};

class RayLamp {
 public:
  /// `within_glass`: whether a solid piece of glass contains it.
  explicit RayLamp(const Lamp& lamp, bool within_glass = false);
  /// The bright part of the picture of a sky, which must have one.
  explicit RayLamp(const TurnedSky& sky);
  /// The point of the lamp that belongs to `uv`. `place` is where the light arrives.
  LampPoint<float> point(const Three<float>& place, const SquarePoint<float>& uv) const;
  LampPoint<Lanes> point(const LaneVectors& place, const SquarePoint<Lanes>& uv) const;
  const Lamp& def() const { return def_; }
  /// Whether it is the bright part of the sky's picture.
  bool is_sky() const { return sky_.picture != nullptr; }
  /// How its shadow rays to the surfaces of the picture meet glass that focuses light.
  RayScene::Focus focus() const { return focus_; }

 private:
  template <class T>
  LampPoint<T> point_of(const Three<T>& place, const SquarePoint<T>& uv) const;
  LampPoint<float> point_of_sky(const SquarePoint<float>& uv) const;

  Lamp def_;
  RayScene::Focus focus_ = RayScene::Focus::blocks;
  /// The sky, if the bright part of its picture is the lamp. Without a picture, the lamp is `def_`.
  TurnedSky sky_;
  Vector3f right_, up_;
  float cone_factor_ = 0, cone_offset_ = 1;
};

}  // namespace offstage::render
