#pragma once
/// The keys of `camera` and of an entry of `cameras`.

#include <array>

#include "producer/format/values.h"

namespace offstage::producer {

template <>
struct Table<Lens> {
  static Fields<Lens> fields() {
    return {{"fov_deg", &Lens::fov_deg, "vertical field of view", "degrees", inside(0, 180)},
            {"focal_mm", &Lens::focal_mm,
             "focal length for a picture 36 mm wide, instead of `fov_deg`: 24 is a wide-angle lens, 50 a "
             "normal lens, 100 a telephoto lens",
             "mm", between(1, 2000)},
            {"aperture", &Lens::aperture,
             "diameter of the lens opening; larger: objects out of focus are more blurred; 0: everything is "
             "in focus",
             "m", kNotNegative},
            {"focus", &Lens::focus,
             "distance from the camera to the plane that is in focus; 0: the distance of the target", "m",
             kNotNegative},
            {"focus_on", &Lens::focus_on,
             "name of a body that is kept in focus, instead of `focus`; empty: none"},
            {"look_at", &Lens::look_at, "name of a body that the camera keeps turning to; empty: none"},
            {"fit", &Lens::fit,
             "names of bodies that fill the picture: the camera keeps its direction and moves as close as it "
             "can while all of them are visible at time 0"}};
  }
};
template <>
struct Table<StaticCamera> {
  static constexpr const char* kName = "static_camera";
  static constexpr const char* kHelp = "A camera that does not move.";
  static Fields<StaticCamera> fields() {
    return Fields<StaticCamera>{{"eye", &StaticCamera::eye, "position of the camera", "m"},
                                {"target", &StaticCamera::target, "point that the camera looks at", "m"}}
        .with_base<Lens>();
  }
};
template <>
struct Table<CameraKey> {
  static constexpr const char* kName = "camera_key";
  static constexpr const char* kHelp = "Position and direction of a moving camera at a time.";
  static Fields<CameraKey> fields() {
    return {{"time", &CameraKey::time, "time of the key; times must increase", "s"},
            {"eye", &CameraKey::eye, "position of the camera", "m"},
            {"target", &CameraKey::target, "point that the camera looks at", "m"},
            {"fov_deg", &CameraKey::fov_deg,
             "vertical field of view at this key; default: the field of view of the camera", "degrees",
             inside(0, 180)},
            {"focus", &CameraKey::focus,
             "focus distance at this key; default: the focus distance of the camera", "m", kPositive},
            {"interpolation", &CameraKey::interpolation,
             "interpolation from this key to the next; default: the interpolation of the camera"}};
  }
};
template <>
struct Table<KeyframedCamera> {
  static constexpr const char* kName = "keyframed_camera";
  static constexpr const char* kHelp = "A camera that moves through given views.";
  static Fields<KeyframedCamera> fields() {
    return Fields<KeyframedCamera>{
        {"keyframes", &KeyframedCamera::keyframes, "views over time; at least one"},
        {"interpolation", &KeyframedCamera::interpolation, kInterpolationHelp}}
        .with_base<Lens>();
  }
};
template <>
struct Table<OrbitCamera> {
  static constexpr const char* kName = "orbit_camera";
  static constexpr const char* kHelp = "A camera that circles around a point.";
  static Fields<OrbitCamera> fields() {
    using T = OrbitCamera;
    return Fields<T>{{"target", &T::target, "point that the camera looks at, the centre of the circle", "m"},
                     {"radius", &T::radius, "radius of the circle", "m", kPositive},
                     {"height", &T::height, "height of the circle above the target", "m"},
                     {"start_deg", &T::start_deg, "angle at time 0, from +Z towards +X", "degrees"},
                     {"turn_deg_per_s", &T::turn_deg_per_s, "angular speed of the camera", "degrees/s"}}
        .with_base<Lens>();
  }
};
template <>
struct Table<FollowCamera> {
  static constexpr const char* kName = "follow_camera";
  static constexpr const char* kHelp = "A camera that moves with a body but does not turn with it.";
  static Fields<FollowCamera> fields() {
    using T = FollowCamera;
    return Fields<T>{
        {"body", &T::body, "name of the body", kRequired},
        {"offset", &T::offset, "position of the camera relative to the body, in world axes", "m"},
        {"look_offset", &T::look_offset,
         "point that the camera looks at, relative to the body, in world axes", "m"}}
        .with_base<Lens>();
  }
};
template <>
struct Table<ModelCamera> {
  static constexpr const char* kName = "model_camera";
  static constexpr const char* kHelp =
      "A camera of the glTF file that a body shows. It moves with the body and with the animation that the "
      "body plays. Its field of view comes from the file, unless `focal_mm` is given. `offstage info FILE` "
      "lists the cameras of a file.";
  static Fields<ModelCamera> fields() {
    using T = ModelCamera;
    return Fields<T>{{"body", &T::body, "name of the body that shows the file", kRequired},
                     {"name", &T::name, "name of the camera's node in the file; empty: the first camera"}}
        .with_base<Lens>();
  }
};
template <>
struct Tags<Camera> {
  static constexpr const char* kName = "camera";
  static constexpr const char* kHelp =
      "The camera. Its up direction is +Y, except that a camera of a model file has its own.";
  static constexpr std::array kTags = {"static", "keyframes", "orbit", "follow", "model"};
  static constexpr bool kRequired = false;
};

template <>
struct Table<NamedCamera> {
  static constexpr const char* kName = "named_camera";
  static constexpr const char* kHelp =
      "A further camera. `render --camera NAME` draws it instead of `camera`, `--camera all` draws all of "
      "them in one run.";
  static Fields<NamedCamera> fields() {
    return {{"name", &NamedCamera::name,
             "name of the camera, a part of the names of its files: letters, digits, _ and -; not `main`, "
             "which is the name of `camera`, and not `all`",
             kRequired},
            {"camera", &NamedCamera::camera, "the camera"}};
  }
};

}  // namespace offstage::producer
