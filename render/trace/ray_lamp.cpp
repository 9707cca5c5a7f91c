#include "render/trace/ray_lamp.h"

namespace offstage::render {

RayLamp::RayLamp(const Lamp& lamp, bool within_glass) : def_(lamp) {
  is_focused_ = lamp.shadows && !within_glass;
  def_.direction.normalize();
  const Vector3f side = std::abs(def_.direction.y()) < 0.99f ? Vector3f::UnitY() : Vector3f::UnitX();
  right_ = def_.direction.cross(side).normalized();
  up_ = right_.cross(def_.direction);
  if (def_.cone_deg > 0) {
    const float half = 0.5f * def_.cone_deg * std::numbers::pi_v<float> / 180;
    const float edge = std::cos(half), full = std::cos(half * (1 - std::clamp(def_.softness, 0.02f, 1.0f)));
    cone_factor_ = 1 / (full - edge);
    cone_offset_ = -edge / (full - edge);
  }
}

RayLamp::RayLamp(const TurnedSky& sky) : sky_(sky), right_(Vector3f::UnitX()), up_(Vector3f::UnitY()) {
  const SkyBeam beam = sky.beam();
  def_.intensity = beam.light;
  def_.direction = -beam.direction;
  def_.radius = 0;
}

LampPoint<float> RayLamp::point_of_sky(const SquarePoint<float>& uv) const {
  constexpr float kFarAway = 1e9f;  // [m]
  const SkyPicture::Sample sample = sky_.picture->sample({uv.x, uv.y});
  const Vector3f arriving = sky_.intensity / std::numbers::pi_v<float> * sample.light;
  return {from_eigen(sky_.from_picture(sample.direction)), kFarAway, 1, from_eigen(arriving),
          sky_.picture->density(sample.direction)};
}

template <class T>
LampPoint<T> RayLamp::point_of(const Three<T>& place, const SquarePoint<T>& uv) const {
  const bool rectangle = def_.size.x() > 0;
  const auto everywhere = [](const Vector3f& v) { return Three<T>{T{} + v.x(), T{} + v.y(), T{} + v.z()}; };
  const Three<T> middle = everywhere(def_.position);
  Three<T> a = everywhere(right_), b = everywhere(up_);
  T softening{};
  SquarePoint<T> along = {(uv.x - 0.5f) * def_.size.x(), (uv.y - 0.5f) * def_.size.y()};
  if (!rectangle) {  // the disc of the ball that is visible from the place
    const Three<T> to_place = place - middle;
    make_basis(to_place * (1.0f / square_root(larger(dot(to_place, to_place), T{} + 1e-24f))), a, b);
    const SquarePoint<T> d = on_disc(uv);
    along = {d.x * def_.radius, d.y * def_.radius};
    softening = T{} + 0.25f * def_.radius * def_.radius;
  }
  const Three<T> offset = middle + a * along.x + b * along.y - place;
  LampPoint<T> result;
  result.distance = square_root(dot(offset, offset));
  result.towards = offset * (1.0f / larger(result.distance, T{} + 1e-12f));
  const T cosine = -dot(result.towards, everywhere(def_.direction));
  T fraction = T{} + 1.0f;
  if (rectangle) fraction = larger(cosine, T{});
  if (def_.cone_deg > 0) fraction = clamped_to(cone_factor_ * cosine + cone_offset_, 0, 1);
  if (def_.squared_edge) fraction = fraction * fraction;
  result.fraction = fraction / (result.distance * result.distance + softening + 1e-12f);
  result.arriving = everywhere(def_.intensity) * result.fraction;
  result.density = T{};
  return result;
}

LampPoint<float> RayLamp::point(const Three<float>& place, const SquarePoint<float>& uv) const {
  return sky_.picture ? point_of_sky(uv) : point_of(place, uv);
}
LampPoint<Lanes> RayLamp::point(const LaneVectors& place, const SquarePoint<Lanes>& uv) const {
  if (!sky_.picture) return point_of(place, uv);
  LampPoint<Lanes> result{};
  for (int i = 0; i < kLanes; ++i) {
    const LampPoint<float> one = point_of_sky({uv.x[i], uv.y[i]});
    const auto set = [i](LaneVectors& lanes, const Three<float>& value) {
      lanes.x[i] = value.x;
      lanes.y[i] = value.y;
      lanes.z[i] = value.z;
    };
    set(result.towards, one.towards);
    set(result.arriving, one.arriving);
    result.distance[i] = one.distance;
    result.fraction[i] = one.fraction;
    result.density[i] = one.density;
  }
  return result;
}

}  // namespace offstage::render
