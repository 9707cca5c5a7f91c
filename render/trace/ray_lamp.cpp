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
RayLamp::Area<T> RayLamp::area_from(const Three<T>& place) const {
  const auto everywhere = [](const Vector3f& v) { return Three<T>{T{} + v.x(), T{} + v.y(), T{} + v.z()}; };
  const Three<T> from_place = everywhere(def_.position) - place;
  if (is_rectangle()) return {from_place, everywhere(right_), everywhere(up_), everywhere(def_.direction)};
  Area<T> disc{from_place, {}, {}, {}};
  disc.facing = from_place * (-1.0f / square_root(larger(dot(from_place, from_place), T{} + 1e-24f)));
  make_basis(disc.facing, disc.right, disc.up);
  return disc;
}

// Returns a point of the area. `along`: its coordinates from the middle [m].
template <class T>
LampPoint<T> RayLamp::point_on(const Area<T>& area, const SquarePoint<T>& along) const {
  const auto everywhere = [](const Vector3f& v) { return Three<T>{T{} + v.x(), T{} + v.y(), T{} + v.z()}; };
  const Three<T> offset = area.right * along.x + area.up * along.y + area.from_place;
  LampPoint<T> result;
  result.distance = square_root(dot(offset, offset));
  result.towards = offset * (1.0f / larger(result.distance, T{} + 1e-12f));
  const T cosine = -dot(result.towards, everywhere(def_.direction));
  T fraction = T{} + 1.0f;
  if (is_rectangle()) fraction = larger(cosine, T{});
  if (def_.cone_deg > 0) fraction = clamped_to(cone_factor_ * cosine + cone_offset_, 0, 1);
  if (def_.squared_edge) fraction = fraction * fraction;
  const T distance2 = result.distance * result.distance;
  const float softening = is_rectangle() ? 0 : 0.25f * def_.radius * def_.radius;
  result.fraction = fraction / (distance2 + (softening + 1e-12f));
  result.arriving = everywhere(def_.intensity) * result.fraction;
  const float area_m2 =
      is_rectangle() ? def_.size.prod() : std::numbers::pi_v<float> * def_.radius * def_.radius;
  result.density = distance2 / (area_m2 * larger(-dot(result.towards, area.facing), T{} + 1e-6f));
  return result;
}

template <class T>
LampPoint<T> RayLamp::point_of(const Three<T>& place, const SquarePoint<T>& uv) const {
  if (is_rectangle())
    return point_on(area_from(place), {(uv.x - 0.5f) * def_.size.x(), (uv.y - 0.5f) * def_.size.y()});
  const SquarePoint<T> d = on_disc(uv);
  return point_on(area_from(place), {d.x * def_.radius, d.y * def_.radius});
}

LampPoint<Lanes> RayLamp::point_towards(const LaneVectors& place, const LaneVectors& towards) const {
  const Area<Lanes> area = area_from(place);
  const Lanes approach = -dot(towards, area.facing);
  const Lanes distance = -dot(area.from_place, area.facing) / larger(approach, Lanes{} + 1e-6f);
  const LaneVectors offset = towards * distance - area.from_place;
  const SquarePoint<Lanes> along = {dot(offset, area.right), dot(offset, area.up)};
  const IntLanes inside = is_rectangle() ? (absolute(along.x) <= 0.5f * def_.size.x()) &
                                               (absolute(along.y) <= 0.5f * def_.size.y())
                                         : along.x * along.x + along.y * along.y <= def_.radius * def_.radius;
  LampPoint<Lanes> point = point_on(area, along);
  point.fraction = (approach > 1e-6f) & (distance > 0.0f) & inside ? point.fraction : Lanes{};
  return point;
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
