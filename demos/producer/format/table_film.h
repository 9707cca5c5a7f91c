#pragma once
/// The keys of how a scene is filmed: camera, light, environment, picture, time.

#include <array>

#include "producer/format/values.h"

namespace offstage::producer {

// --- Camera and light ---

template <>
struct Table<Lens> {
  static Fields<Lens> fields() {
    return {{"fov_deg", &Lens::fov_deg, "vertical field of view", "degrees", inside(0, 180)},
            {"focal_mm", &Lens::focal_mm,
             "focal length for a picture 36 mm wide, in place of fov_deg: 24 is wide, 50 normal, 100 long",
             "mm", between(1, 2000)},
            {"aperture", &Lens::aperture, "diameter of the lens; 0: everything is sharp", "m", kNotNegative},
            {"focus", &Lens::focus, "distance that is sharp; 0: the target's", "m", kNotNegative},
            {"focus_on", &Lens::focus_on, "name of a body that is sharp, wherever it goes"},
            {"look_at", &Lens::look_at, "name of a body that is looked at, wherever it goes"},
            {"fit", &Lens::fit,
             "names of bodies that fill the picture: the camera keeps its direction and goes as near as all "
             "of them, "
             "where they begin, allow"}};
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
    return {
        {"time", &CameraKey::time, "when; times must increase", "s"},
        {"eye", &CameraKey::eye, "where the camera is", "m"},
        {"target", &CameraKey::target, "where it looks", "m"},
        {"fov_deg", &CameraKey::fov_deg, "field of view then; default: the camera's", "degrees",
         inside(0, 180)},
        {"focus", &CameraKey::focus, "distance that is sharp then; default: the camera's", "m", kPositive},
        {"interpolation", &CameraKey::interpolation, "from this key to the next; left out: the camera's"}};
  }
};
template <>
struct Table<KeyframedCamera> {
  static constexpr const char* kName = "keyframed_camera";
  static constexpr const char* kHelp = "A camera that moves through given views.";
  static Fields<KeyframedCamera> fields() {
    return Fields<KeyframedCamera>{{"keyframes", &KeyframedCamera::keyframes, "at least one"},
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
struct Table<LampBase> {
  static Fields<LampBase> fields() {
    using T = LampBase;
    return {{"body", &T::body, "name of the body that carries it, in whose frame it then is; empty: none"},
            {"position", &T::position, "where it is", "m"},
            {"color", &T::color, "colour of its light"},
            {"intensity", &T::intensity,
             "brightness of a white surface 1 m away that faces it; a number or a curve over time", "",
             kNotNegative},
            {"shadows", &T::shadows, "throws shadows"}};
  }
};
template <>
struct Table<PointLight> {
  static constexpr const char* kName = "point_light";
  static constexpr const char* kHelp = "A glowing ball: a bulb, a fire.";
  static Fields<PointLight> fields() {
    using T = PointLight;
    return Fields<T>{{"radius", &T::radius, "of the ball: the softness of shadows", "m", kPositive}}
        .with_base<LampBase>();
  }
};
template <>
struct Table<SpotLight> {
  static constexpr const char* kName = "spot_light";
  static constexpr const char* kHelp = "A cone of light.";
  static Fields<SpotLight> fields() {
    using T = SpotLight;
    return Fields<T>{{"target", &T::target, "where it points", "m"},
                     {"angle_deg", &T::angle_deg, "of the whole cone", "degrees", between(1, 150)},
                     {"softness", &T::softness, "share of the cone over which its edge fades", "", kShare},
                     {"radius", &T::radius, "of the lamp: the softness of shadows", "m", kPositive}}
        .with_base<LampBase>();
  }
};
template <>
struct Table<AreaLight> {
  static constexpr const char* kName = "area_light";
  static constexpr const char* kHelp = "A glowing rectangle: a window, a lamp with a large screen.";
  static Fields<AreaLight> fields() {
    using T = AreaLight;
    return Fields<T>{{"target", &T::target, "where it points", "m"},
                     {"size", &T::size, "width and height: the softness of shadows", "m", kPositive}}
        .with_base<LampBase>();
  }
};
template <>
struct Tags<Light> {
  static constexpr const char* kName = "light";
  static constexpr const char* kHelp =
      "A source of light besides the sky. An empty list of lights leaves the sky alone.";
  static constexpr std::array kTags = {"sun", "point", "spot", "area"};
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
    return {
        {"zenith", &T::zenith, "the sky overhead"},
        {"horizon", &T::horizon, "the sky at the horizon, and the fog"},
        {"ground", &T::ground,
         "below the horizon, and light from below; default: what sun and sky let the ground plane send back"},
        {"intensity", &T::intensity, "factor of sky and ambient light", "", kNotNegative},
        {"fog", &T::fog,
         "density; a share exp(-fog * distance) of the light comes through. 0: nothing fades with distance, "
         "except that an infinite plane goes over into the sky in the last quarter of a degree below its "
         "horizon",
         "1/m", kNotNegative},
        {"clouds", &T::clouds, "share of the sky that clouds cover", "", kShare},
        {"occlusion", &T::occlusion,
         "how far away things hide the sky from each other; 0: not at all; default: a tenth of the camera's "
         "distance",
         "m", kNotNegative},
        {"background", &T::background,
         "the sky, or nothing. Frames of a scene with the sky have no alpha channel, those of a "
         "`transparent` one "
         "all have one"}};
  }
};
template <>
struct Names<Quality> {
  static constexpr std::array kNames = {"draft", "preview", "final"};
};
template <>
struct Names<Metering> {
  static constexpr std::array kNames = {"fixed", "automatic"};
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
        {"exposure", &T::exposure, "factor of all light; a number or a curve over time", "", kPositive},
        {"metering", &T::metering,
         "automatic: exposure is a factor besides what makes each frame as bright as the others"},
        {"bloom", &T::bloom, "share of very bright light that spreads as glow; 0: none", "", kNotNegative},
        {"tone_curve", &T::tone_curve, "from light to the picture"},
        {"shadow_map", &T::shadow_map, "width and height of the sun's shadow map", "pixels",
         between(64, 16384)}};
  }
};
template <>
struct Names<render::Channel> {
  static constexpr std::array kNames = {"depth", "normal", "id", "motion"};
};
template <>
struct Names<render::ChannelFormat> {
  static constexpr std::array kNames = {"exr", "png"};
};
template <>
struct Table<OutputSettings> {
  static constexpr const char* kName = "output";
  static constexpr const char* kHelp = "The film's time, and the numbers that go with its pictures.";
  static Fields<OutputSettings> fields() {
    using T = OutputSettings;
    return {
        {"fps", &T::fps, "frames per second: a number, or an exact fraction such as \"30000/1001\"", "1/s",
         between(1, 1000)},
        {"duration", &T::duration, "length of the film", "s", over(0, 86400)},
        {"start", &T::start, "time of the first frame; earlier times are simulated but not shown", "s",
         between(0, 86400)},
        {"channels", &T::channels,
         "numbers for each pixel, beside each frame (or in FILM.channels beside a video): depth [m], normal, "
         "id, motion [px since the frame before]"},
        {"channel_format", &T::channel_format,
         "exr: FRAME.exr with all as they are; png: FRAME.depth.png (16 bits, mm) and so on, each with its "
         "scale in its comment"}};
  }
};

}  // namespace offstage::producer
