#pragma once
/// Private: area light sources for rays: lamps, and the bright part of a sky picture.

#include "render/sky_picture.h"
#include "render/stage.h"
#include "render/trace/directions.h"

namespace offstage::render {

/// A point of a lamp as seen from one place, or points as seen from eight places.
template <class T>
struct LampPoint {
  Three<T> towards;   ///< unit direction from the place to the point
  T distance;         ///< [m]
  T fraction;         ///< fraction of the intensity that arrives at a surface which faces the point
  Three<T> arriving;  ///< radiance of a white surface: `fraction` times intensity and colour
  T density;          ///< probability density with which point() chooses the direction [1/sr]
};

class RayLamp {
 public:
  /// `within_glass`: whether the lamp is inside of a solid piece of glass.
  explicit RayLamp(const Lamp& lamp, bool within_glass = false);
  /// Creates a lamp from the bright part of a sky picture. `sky` must have a picture.
  explicit RayLamp(const TurnedSky& sky);
  /// Returns a point of the lamp as seen from `place`. `uv` is uniform in the unit square.
  LampPoint<float> point(const Three<float>& place, const SquarePoint<float>& uv) const;
  LampPoint<Lanes> point(const LaneVectors& place, const SquarePoint<Lanes>& uv) const;
  /// Returns the points of the lamp in the unit directions `towards`; their `fraction` is 0 where a ray
  /// misses the lamp. Must not be called for the sky.
  LampPoint<Lanes> point_towards(const LaneVectors& place, const LaneVectors& towards) const;
  const Lamp& def() const { return def_; }
  /// Returns whether this is the bright part of the sky's picture.
  bool is_sky() const { return sky_.picture != nullptr; }
  /// Returns whether the light that glass focuses is traced: the lamp casts shadows and is not inside of
  /// glass.
  bool is_focused() const { return is_focused_; }

 private:
  /// The flat area of the lamp that is visible from a place: the rectangle, or a disc of the ball.
  template <class T>
  struct Area {
    Three<T> from_place;  ///< from the place to the middle [m]
    Three<T> right, up;   ///< unit vectors in the plane of the area
    Three<T> facing;      ///< unit normal of the plane, on the side of the place
  };
  bool is_rectangle() const { return def_.size.x() > 0; }
  template <class T>
  Area<T> area_from(const Three<T>& place) const;
  template <class T>
  LampPoint<T> point_on(const Area<T>& area, const SquarePoint<T>& along) const;
  template <class T>
  LampPoint<T> point_of(const Three<T>& place, const SquarePoint<T>& uv) const;
  LampPoint<float> point_of_sky(const SquarePoint<float>& uv) const;

  Lamp def_;
  bool is_focused_ = true;
  /// The sky whose picture is the lamp. If it has no picture, the lamp is `def_`.
  TurnedSky sky_;
  Vector3f right_, up_;
  float cone_factor_ = 0, cone_offset_ = 1;
};

}  // namespace offstage::render
