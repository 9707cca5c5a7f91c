#include "producer/build/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "producer/base/to_float.h"
#include "producer/build/body_shapes.h"
#include "producer/build/shown_model.h"
#include "sim/dynamics/keyframes.h"

namespace offstage::producer {
namespace {

using Eigen::Vector3f;

constexpr Real kRadians = std::numbers::pi / 180;

Real vertical_fov_deg(const Lens& lens, const Eigen::Vector2i& size) {
  if (!lens.focal_mm) return lens.fov_deg;
  constexpr Real kHalfWidth_mm = 18;
  return 2 * std::atan(kHalfWidth_mm / *lens.focal_mm * size.y() / size.x()) / kRadians;
}

/// Returns half the size of the box around a shape.
template <class S>
Vec3 half_extent(const S& s, const ModelLibrary&) {
  return producer::half_extent(s);
}
Vec3 half_extent(const MeshFile& s, const ModelLibrary& models) {
  const Eigen::AlignedBox3f box = models.model(s.file).bounds();
  return scale_of(s, models) * box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).cast<Real>();
}

Eigen::AlignedBox3f box_of(const Body& body, const ModelLibrary& models) {
  const Vec3 half = std::visit([&](const auto& shape) { return half_extent(shape, models); }, body.shape);
  const Vec3 reach = body.orientation.toRotationMatrix().cwiseAbs() * half;
  return {(body.position - reach).cast<float>(), (body.position + reach).cast<float>()};
}

/// Interpolates a vector of the camera's keys at a time. `value` returns this vector for a key.
template <class Value>
Vec3 follow_keys(const KeyframedCamera& camera, double time, Value&& value) {
  sim::KeyframeTrack track{.keys = {}, .interpolation = camera.interpolation};
  for (const CameraKey& key : camera.keyframes)
    track.keys.push_back({key.time, {value(key), Quat::Identity()}, key.interpolation});
  return track.at(time, {}).pose.position;
}

struct View {
  Vec3 eye, target;
  Real fov_deg, focus;
  Vec3 up = Vec3::UnitY();
};

View view_of(const StaticCamera& c, const View& lens, double) {
  return {c.eye, c.target, lens.fov_deg, lens.focus};
}
View view_of(const KeyframedCamera& c, const View& lens, double time) {
  const auto at = [&](auto&& value) { return follow_keys(c, time, value); };
  const bool pulls_focus =
      std::ranges::any_of(c.keyframes, [](const CameraKey& k) { return k.focus.has_value(); });
  return {at([](const CameraKey& k) { return k.eye; }), at([](const CameraKey& k) { return k.target; }),
          at([&](const CameraKey& k) { return Vec3(k.fov_deg.value_or(lens.fov_deg), 0, 0); }).x(),
          !pulls_focus
              ? lens.focus
              : at([&](const CameraKey& k) {
                  return Vec3(k.focus.value_or(lens.focus > 0 ? lens.focus : (k.target - k.eye).norm()), 0,
                              0);
                }).x()};
}
View view_of(const OrbitCamera& c, const View& lens, double time) {
  const Real angle = (c.start_deg + c.turn_deg_per_s * time) * kRadians;
  return {c.target + Vec3(c.radius * std::sin(angle), c.height, c.radius * std::cos(angle)), c.target,
          lens.fov_deg, lens.focus};
}

/// Returns the view of a camera of a model file. `world_of` returns the pose of the camera, which looks along
/// -z.
View view_of(const ModelCamera& c, const View& lens, const render::Model::Camera& camera,
             const auto& world_of) {
  const Eigen::Affine3f world = world_of(camera);
  const Vec3 eye = world.translation().template cast<Real>();
  const auto axis = [&](const Vector3f& own) {
    return Vec3((world.linear() * own).normalized().cast<Real>());
  };
  return {eye, eye + axis(-Vector3f::UnitZ()), c.focal_mm ? lens.fov_deg : Real{camera.fov_deg}, lens.focus,
          axis(Vector3f::UnitY())};
}

}  // namespace

CameraRig::CameraRig(const Scene& scene, const ModelLibrary& models) : scene_(scene), models_(models) {
  const std::vector<std::string>& names =
      std::visit([](const Lens& lens) -> const std::vector<std::string>& { return lens.fit; }, scene.camera);
  for (const Body& body : scene.bodies)
    if (std::ranges::find(names, body.name) != names.end()) fitted_.extend(box_of(body, models));
}

render::Camera CameraRig::at(double time, const BodyPlaces& places,
                             const std::vector<BodySample>& moving) const {
  const Lens& lens = std::visit([](const Lens& l) -> const Lens& { return l; }, scene_.camera);
  const auto place = [&](const std::string& body) {
    return Vec3(places.at(body, moving).translation().cast<Real>());
  };
  const View own{Vec3::Zero(), Vec3::Zero(), vertical_fov_deg(lens, scene_.render.size), lens.focus};
  View view = std::visit(
      [&]<class C>(const C& c) {
        if constexpr (std::is_same_v<C, FollowCamera>)
          return View{place(c.body) + c.offset, place(c.body) + c.look_offset, own.fov_deg, own.focus};
        else if constexpr (std::is_same_v<C, ModelCamera>)
          return view_of(c, own, *find_camera(c, scene_, models_), [&](const render::Model::Place& camera) {
            return Eigen::Affine3f(places.at(c.body, moving) *
                                   pose_in_body(body_of(scene_, c.body), camera, models_, time));
          });
        else
          return view_of(c, own, time);
      },
      scene_.camera);
  if (!lens.look_at.empty()) {
    view.target = place(lens.look_at);
    view.up = Vec3::UnitY();
  }
  if (!fitted_.isEmpty()) {
    // The bounding sphere of the bodies touches the two sides of the picture that are closer to each other.
    const Real aspect = Real(scene_.render.size.x()) / scene_.render.size.y();
    const Real half = std::atan(std::tan(0.5 * view.fov_deg * kRadians) * std::min(1.0, aspect));
    const Real distance = 0.5 * static_cast<Real>(fitted_.diagonal().norm()) / std::sin(half);
    const Vec3 back = (view.eye - view.target).normalized();
    view.target = fitted_.center().cast<Real>();
    view.eye = view.target + distance * back;
  }
  if (!lens.focus_on.empty())
    view.focus = std::max((place(lens.focus_on) - view.eye).dot((view.target - view.eye).normalized()), 0.01);
  return {.eye = view.eye.cast<float>(),
          .target = view.target.cast<float>(),
          .up = view.up.cast<float>(),
          .fov_deg = to_float(view.fov_deg),
          .aperture = to_float(lens.aperture),
          .focus = to_float(view.focus)};
}

}  // namespace offstage::producer
