#pragma once
/// The keys of the film: camera, light, environment, picture, time.

#include <array>

#include "producer/format/values.h"

namespace offstage::producer {

// --- Camera and light ---

template <>
struct Table<Lens> {
  static Fields<Lens> fields() {
    return {
        {"fov_deg", &Lens::fov_deg, "vertical field of view", "degrees", inside(0, 180)},
        {"focal_mm", &Lens::focal_mm,
         "focal length for a picture 36 mm wide, instead of fov_deg: 24 is wide, 50 is normal, 100 is long",
         "mm", between(1, 2000)},
        {"aperture", &Lens::aperture, "diameter of the lens opening; 0: everything is in focus", "m",
         kNotNegative},
        {"focus", &Lens::focus, "focus distance; 0: the distance of the target", "m", kNotNegative},
        {"focus_on", &Lens::focus_on, "name of a body that is kept in focus"},
        {"look_at", &Lens::look_at, "name of a body that the camera keeps turning to"},
        {"fit", &Lens::fit,
         "names of bodies that fill the picture: the camera keeps its direction and moves as close as it can "
         "while all of them are visible at time 0"}};
  }
};
template <>
struct Table<StaticCamera> {
  static constexpr const char* kName = "static_camera";
  static constexpr const char* kHelp = "A camera on a tripod.";
  static Fields<StaticCamera> fields() {
    return Fields<StaticCamera>{{"eye", &StaticCamera::eye, "position of the camera", "m"},
                                {"target", &StaticCamera::target, "point that the camera looks at", "m"}}
        .with_base<Lens>();
  }
};
template <>
struct Table<CameraKey> {
  static constexpr const char* kName = "camera_key";
  static constexpr const char* kHelp = "A view at a time.";
  static Fields<CameraKey> fields() {
    return {{"time", &CameraKey::time, "time of the key; times must increase", "s"},
            {"eye", &CameraKey::eye, "position of the camera", "m"},
            {"target", &CameraKey::target, "point that the camera looks at", "m"},
            {"fov_deg", &CameraKey::fov_deg, "vertical field of view at this key; default: the camera's",
             "degrees", inside(0, 180)},
            {"focus", &CameraKey::focus, "focus distance at this key; default: the camera's", "m", kPositive},
            {"interpolation", &CameraKey::interpolation,
             "interpolation from this key to the next; default: the camera's"}};
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
      "body "
      "plays. Its field of view is that of the file, unless `focal_mm` is given; `offstage info FILE` lists "
      "the "
      "cameras of a file.";
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
  static constexpr const char* kHelp = "The camera. Up is +Y, except for cameras of files.";
  static constexpr std::array kTags = {"static", "keyframes", "orbit", "follow", "model"};
  static constexpr bool kRequired = false;
};

template <>
struct Table<NamedCamera> {
  static constexpr const char* kName = "named_camera";
  static constexpr const char* kHelp =
      "A further camera. `render --camera NAME` draws it instead of `camera`, `--camera all` draws all of "
      "them in "
      "one run.";
  static Fields<NamedCamera> fields() {
    return {{"name", &NamedCamera::name,
             "name of the camera, a part of the names of its files: letters, digits, _ and -; not `main`, "
             "which is "
             "the name of `camera`, and not `all`",
             kRequired},
            {"camera", &NamedCamera::camera, "the camera"}};
  }
};

template <>
struct Table<SunLight> {
  static constexpr const char* kName = "sun";
  static constexpr const char* kHelp = "Parallel light. A scene has at most one sun.";
  static Fields<SunLight> fields() {
    using T = SunLight;
    return {
        {"direction", &T::direction, "direction towards the sun, above the horizon", "", kDirection},
        {"color", &T::color, "colour of the light"},
        {"intensity", &T::intensity, "brightness of a white surface that faces the sun", "", kNotNegative},
        {"size_deg", &T::size_deg, "angular diameter of the sun's disc; larger: softer shadows", "degrees",
         between(0, 90)},
        {"shadows", &T::shadows, "casts shadows"}};
  }
};
template <>
struct Table<LampBase> {
  static Fields<LampBase> fields() {
    using T = LampBase;
    return {
        {"body", &T::body,
         "name of the body that carries the light; position and target are then in its frame; empty: none"},
        {"position", &T::position, "position of the light", "m"},
        {"color", &T::color, "colour of the light"},
        {"intensity", &T::intensity,
         "brightness of a white surface that faces the light 1 m away; a number or a curve over time", "",
         kNotNegative},
        {"shadows", &T::shadows, "casts shadows"}};
  }
};
template <>
struct Table<PointLight> {
  static constexpr const char* kName = "point_light";
  static constexpr const char* kHelp = "A glowing ball: a bulb, a fire.";
  static Fields<PointLight> fields() {
    using T = PointLight;
    return Fields<T>{{"radius", &T::radius, "radius of the ball; larger: softer shadows", "m", kPositive}}
        .with_base<LampBase>();
  }
};
template <>
struct Table<SpotLight> {
  static constexpr const char* kName = "spot_light";
  static constexpr const char* kHelp = "A cone of light.";
  static Fields<SpotLight> fields() {
    using T = SpotLight;
    return Fields<T>{
        {"target", &T::target, "point that the light aims at", "m"},
        {"angle_deg", &T::angle_deg, "full angle of the cone", "degrees", between(1, 150)},
        {"softness", &T::softness, "fraction of the cone over which its edge fades", "", kFraction},
        {"radius", &T::radius, "radius of the lamp; larger: softer shadows", "m", kPositive}}
        .with_base<LampBase>();
  }
};
template <>
struct Table<AreaLight> {
  static constexpr const char* kName = "area_light";
  static constexpr const char* kHelp = "A glowing rectangle: a window, a lamp with a large screen.";
  static Fields<AreaLight> fields() {
    using T = AreaLight;
    return Fields<T>{{"target", &T::target, "point that the light aims at", "m"},
                     {"size", &T::size, "width and height; larger: softer shadows", "m", kPositive}}
        .with_base<LampBase>();
  }
};
template <>
struct Table<ModelLights> {
  static constexpr const char* kName = "model_lights";
  static constexpr const char* kHelp =
      "Lights of the glTF file that a body shows (KHR_lights_punctual). They move with the body and with the "
      "animation that the body plays. Their candela and lux are converted by 1 / pi: a white surface that "
      "faces "
      "a lamp of 1 cd at a distance of 1 m has a luminance of 1 / pi cd/m^2, and 1 cd/m^2 is the brightness "
      "1. "
      "`offstage info FILE` lists the lights of a file.";
  static Fields<ModelLights> fields() {
    using T = ModelLights;
    return {
        {"body", &T::body, "name of the body that shows the file", kRequired},
        {"name", &T::name, "name of the light's node in the file; empty: all lights"},
        {"intensity", &T::intensity,
         "factor of their intensities; files by Blender in watts need about 0.001", "", kNotNegative},
        {"radius", &T::radius, "radius of point and spot lights, which have none in the file", "m",
         kPositive},
        {"size_deg", &T::size_deg, "angular diameter of a directional light, which becomes the scene's sun",
         "degrees", between(0, 90)},
        {"shadows", &T::shadows, "cast shadows"}};
  }
};
template <>
struct Tags<Light> {
  static constexpr const char* kName = "light";
  static constexpr const char* kHelp =
      "A light source in addition to the sky. With an empty list of lights, only the sky gives light.";
  static constexpr std::array kTags = {"sun", "point", "spot", "area", "model"};
  static constexpr bool kRequired = false;
};

// --- Picture and time ---

template <>
struct Names<Background> {
  static constexpr std::array kNames = {"sky", "transparent"};
};
template <>
struct Table<SkyPictureSettings> {
  static constexpr const char* kName = "sky picture";
  static constexpr const char* kHelp =
      "A picture of the whole sky in equirectangular projection, twice as wide as high. It lights the scene "
      "in "
      "place of the colours, and is the background. A scene with a picture has no sun by default.";
  static Fields<SkyPictureSettings> fields() {
    using T = SkyPictureSettings;
    return {
        {"file", &T::file,
         "picture relative to the scene: Radiance HDR or OpenEXR with linear light, or PNG, JPEG or WebP in "
         "sRGB. Its centre is at -z, its right half at +x",
         kRequired},
        {"turn_deg", &T::turn_deg, "turns the picture counter-clockwise, as seen from above", "deg"},
        {"blur_deg", &T::blur_deg,
         "standard deviation of a blur of the background; the light stays. 0: sharp", "deg", between(0, 90)},
        {"visible", &T::visible,
         "if false, the picture only lights the scene and is mirrored by it; the background shows the "
         "colours"}};
  }
};
template <>
struct Table<EnvironmentSettings> {
  static constexpr const char* kName = "environment";
  static constexpr const char* kHelp = "The sky, its light, and fog.";
  static Fields<EnvironmentSettings> fields() {
    using T = EnvironmentSettings;
    return {{"zenith", &T::zenith, "colour of the sky overhead"},
            {"horizon", &T::horizon, "colour of the sky at the horizon, and of the fog"},
            {"ground", &T::ground,
             "colour below the horizon, and of the light from below; default: the light that a ground plane "
             "would reflect"},
            {"intensity", &T::intensity, "factor of the sky's brightness and of the ambient light", "",
             kNotNegative},
            {"fog", &T::fog,
             "density of the fog: the fraction exp(-fog * distance) of the light passes. 0: no fog, but an "
             "infinite plane still blends into the sky in the last quarter of a degree below its horizon",
             "1/m", kNotNegative},
            {"clouds", &T::clouds, "fraction of the sky that is covered by clouds", "", kFraction},
            {"background", &T::background,
             "`sky` draws the sky, and frames have no alpha channel; `transparent` draws none, and all "
             "frames have an alpha channel"},
            {"picture", &T::picture,
             "a picture of the sky in place of the colours and clouds; `intensity` "
             "scales it"}};
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
  static constexpr const char* kHelp = "The picture. These settings do not change the simulation.";
  static Fields<RenderSettings> fields() {
    using T = RenderSettings;
    return {
        {"size", &T::size, "width and height; most video formats need even numbers", "pixels",
         between(16, 16384)},
        {"quality", &T::quality, "number of sub-frames per frame: `draft` 1, `preview` 4, `final` 16"},
        {"shutter", &T::shutter,
         "fraction of the frame time during which the shutter is open; gives motion blur", "", kFraction},
        {"exposure", &T::exposure, "brightness factor of the whole picture; a number or a curve over time",
         "", kPositive},
        {"metering", &T::metering,
         "`fixed` uses `exposure` unchanged; `automatic` also brings each frame to the same average "
         "brightness"},
        {"bloom", &T::bloom, "fraction of very bright light that spreads as glow; 0: none", "", kNotNegative},
        {"tone_curve", &T::tone_curve, "mapping from light to picture values"}};
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
  static constexpr const char* kHelp =
      "Frame rate and length of the film, and the channels written beside its frames.";
  static Fields<OutputSettings> fields() {
    using T = OutputSettings;
    return {{"fps", &T::fps, "frames per second: a number, or an exact fraction such as \"30000/1001\"",
             "1/s", between(1, 1000)},
            {"duration", &T::duration, "length of the film", "s", over(0, 86400)},
            {"start", &T::start, "time of the first frame; earlier times are simulated but not shown", "s",
             between(0, 86400)},
            {"channels", &T::channels,
             "channels written beside each frame (or into FILM.channels beside a video): depth [m], normal, "
             "id, motion [px since the previous frame]"},
            {"channel_format", &T::channel_format,
             "exr: FRAME.exr with all channels as floating-point numbers; png: FRAME.depth.png (16 bits, mm) "
             "and so on, each with its scale in its comment"}};
  }
};

}  // namespace offstage::producer
