#include "render/trace/ray_lamp.h"

namespace offstage::render {

RayLamp::RayLamp(const Lamp& lamp) : def_(lamp) {
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

template <class T>
LampPoint<T> RayLamp::point_of(const Three<T>& place, const SquarePoint<T>& uv) const {
  const bool rectangle = def_.size.x() > 0;
  const auto everywhere = [](const Vector3f& v) { return Three<T>{T{} + v.x(), T{} + v.y(), T{} + v.z()}; };
  const Three<T> middle = everywhere(def_.position);
  Three<T> a = everywhere(right_), b = everywhere(up_);
  T softening{};
  SquarePoint<T> along = {(uv.x - 0.5f) * def_.size.x(), (uv.y - 0.5f) * def_.size.y()};
  if (!rectangle) {  // the disc that the ball shows to the place
    const Three<T> to_place = place - middle;
    make_basis(to_place * (1.0f / square_root(larger(dot(to_place, to_place), T{} + 1e-24f))), a, b);
    const SquarePoint<T> d = on_disc(uv);
    along = {d.x * def_.radius, d.y * def_.radius};
    softening = T{} + 0.25f * def_.radius * def_.radius;
  }
  const Three<T> way = middle + a * along.x + b * along.y - place;
  LampPoint<T> result;
  result.distance = square_root(dot(way, way));
  result.towards = way * (1.0f / larger(result.distance, T{} + 1e-12f));
  const T cosine = -dot(result.towards, everywhere(def_.direction));
  T share = T{} + 1.0f;
  if (rectangle) share = larger(cosine, T{});
  if (def_.cone_deg > 0) share = clamped_to(cone_factor_ * cosine + cone_offset_, 0, 1);
  result.share = share / (result.distance * result.distance + softening + 1e-12f);
  return result;
}

LampPoint<float> RayLamp::point(const Three<float>& place, const SquarePoint<float>& uv) const {
  return point_of(place, uv);
}
LampPoint<Lanes> RayLamp::point(const LaneVectors& place, const SquarePoint<Lanes>& uv) const {
  return point_of(place, uv);
}

}  // namespace offstage::render
