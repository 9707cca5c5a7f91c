#pragma once
/// The keys of how a scene is filmed: camera, light, environment, picture, time.

#include <array>

#include "producer/values.h"

namespace offstage::producer {

// --- Camera and light ---

template <>
struct Table<Lens> {
  static Fields<Lens> fields() {
    return {{"fov_deg", &Lens::fov_deg, "vertical field of view", "degrees", inside(0, 180)},
            {"aperture", &Lens::aperture, "diameter of the lens; 0: everything is sharp", "m", kNotNegative},
            {"focus", &Lens::focus, "distance that is sharp; 0: the target's", "m", kNotNegative}};
  }
};
template <>
struct Table<StaticCamera> {
  static constexpr const char* kName = "static_camera";
  static constexpr const char* kHelp = "A camera on a tripod.";
  static Fields<StaticCamera> fields() {
    return Fields<StaticCamera>{{"eye", &StaticCamera::eye, "where it is", "m"},
                                {"target", &StaticCamera::target, "where it looks", "m"}}
        .with_base<Lens>();
  }
};
template <>
struct Table<CameraKey> {
  static constexpr const char* kName = "camera_key";
  static constexpr const char* kHelp = "A view at a time.";
  static Fields<CameraKey> fields() {
    return {{"time", &CameraKey::time, "when; times must increase", "s"},
            {"eye", &CameraKey::eye, "where the camera is", "m"},
            {"target", &CameraKey::target, "where it looks", "m"}};
  }
};
template <>
struct Table<KeyframedCamera> {
  static constexpr const char* kName = "keyframed_camera";
  static constexpr const char* kHelp = "A camera that moves smoothly through given views.";
  static Fields<KeyframedCamera> fields() {
    return Fields<KeyframedCamera>{{"keyframes", &KeyframedCamera::keyframes, "at least one"}}
        .with_base<Lens>();
  }
};
template <>
struct Table<OrbitCamera> {
  static constexpr const char* kName = "orbit_camera";
  static constexpr const char* kHelp = "A camera that circles around a point.";
  static Fields<OrbitCamera> fields() {
    using T = OrbitCamera;
    return Fields<T>{{"target", &T::target, "where it looks: the centre of the circle", "m"},
                     {"radius", &T::radius, "of the circle", "m", kPositive},
                     {"height", &T::height, "of the circle above the target", "m"},
                     {"start_deg", &T::start_deg, "angle at time 0, from +Z towards +X", "degrees"},
                     {"turn_deg_per_s", &T::turn_deg_per_s, "angular speed", "degrees/s"}}
        .with_base<Lens>();
  }
};
template <>
struct Table<FollowCamera> {
  static constexpr const char* kName = "follow_camera";
  static constexpr const char* kHelp = "A camera that goes along with a body without turning with it.";
  static Fields<FollowCamera> fields() {
    using T = FollowCamera;
    return Fields<T>{
        {"body", &T::body, "name of the body", kRequired},
        {"offset", &T::offset, "of the camera from the body, world axes", "m"},
        {"look_offset", &T::look_offset, "of the point it looks at from the body, world axes", "m"}}
        .with_base<Lens>();
  }
};
template <>
struct Tags<Camera> {
  static constexpr const char* kName = "camera";
  static constexpr const char* kHelp = "Where the film is seen from. Up is +Y.";
  static constexpr std::array kTags = {"static", "keyframes", "orbit", "follow"};
  static constexpr bool kRequired = false;
};

template <>
struct Table<SunLight> {
  static constexpr const char* kName = "sun";
  static constexpr const char* kHelp = "Parallel light; at most one.";
  static Fields<SunLight> fields() {
    using T = SunLight;
    return {{"direction", &T::direction, "towards the sun, above the horizon", "", kDirection},
            {"color", &T::color, "colour of its light"},
            {"intensity", &T::intensity, "brightness of a white surface facing it", "", kNotNegative},
            {"size_deg", &T::size_deg, "diameter of its disc: the softness of shadows", "degrees",
             between(0, 90)},
            {"shadows", &T::shadows, "throws shadows"}};
  }
};
template <>
struct Tags<Light> {
  static constexpr const char* kName = "light";
  static constexpr const char* kHelp =
      "A source of light besides the sky. An empty list of lights leaves the sky alone.";
  static constexpr std::array kTags = {"sun"};
  static constexpr bool kRequired = false;
};

// --- Picture and time ---

template <>
struct Names<Background> {
  static constexpr std::array kNames = {"sky", "transparent"};
};
template <>
struct Table<EnvironmentSettings> {
  static constexpr const char* kName = "environment";
  static constexpr const char* kHelp = "Sky, the light that comes from it, and fog.";
  static Fields<EnvironmentSettings> fields() {
    using T = EnvironmentSettings;
    return {{"zenith", &T::zenith, "the sky overhead"},
            {"horizon", &T::horizon, "the sky at the horizon, and the fog"},
            {"ground", &T::ground, "below the horizon, and light from below"},
            {"intensity", &T::intensity, "factor of sky and ambient light", "", kNotNegative},
            {"fog", &T::fog, "density; a share exp(-fog * distance) of the light comes through", "1/m",
             kNotNegative},
            {"background", &T::background, "the sky, or nothing: pictures with an alpha channel"}};
  }
};
template <>
struct Names<Quality> {
  static constexpr std::array kNames = {"draft", "preview", "final"};
};
template <>
struct Names<render::ToneCurve> {
  static constexpr std::array kNames = {"filmic", "linear"};
};
template <>
struct Table<RenderSettings> {
  static constexpr const char* kName = "render";
  static constexpr const char* kHelp = "The picture. Nothing here changes the physics.";
  static Fields<RenderSettings> fields() {
    using T = RenderSettings;
    return {
        {"size", &T::size, "width and height; even for video", "pixels", between(16, 16384)},
        {"quality", &T::quality, "1, 4 or 16 sub-frames per frame"},
        {"shutter", &T::shutter, "share of the frame time that the shutter is open: motion blur", "", kShare},
        {"exposure", &T::exposure, "factor of all light", "", kPositive},
        {"bloom", &T::bloom, "share of very bright light that spreads as glow; 0: none", "", kNotNegative},
        {"tone_curve", &T::tone_curve, "from light to the picture"},
        {"shadow_map", &T::shadow_map, "width and height of the sun's shadow map", "pixels",
         between(64, 16384)}};
  }
};
template <>
struct Table<OutputSettings> {
  static constexpr const char* kName = "output";
  static constexpr const char* kHelp = "The film's time.";
  static Fields<OutputSettings> fields() {
    using T = OutputSettings;
    return {{"fps", &T::fps, "frames per second", "1/s", between(1, 1000)},
            {"duration", &T::duration, "length of the film", "s", over(0, 86400)},
            {"start", &T::start, "time of the first frame; what happens before is simulated and not shown",
             "s", between(0, 86400)}};
  }
};

}  // namespace offstage::producer
