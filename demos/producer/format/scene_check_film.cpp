#include "producer/format/scene_check_film.h"

#include <algorithm>
#include <cctype>
#include <string>

#include <fmt/format.h>

#include "producer/base/suggest.h"
#include "producer/format/scene_checker.h"

namespace offstage::producer {
namespace {

class FilmChecker : SceneChecker {
 public:
  FilmChecker(const Scene& scene, const Scene& flat, const SceneFolder& folder, Findings& findings)
      : SceneChecker(scene, flat, folder, findings) {}

  void run() {
    for (const Overlay& overlay : scene_.overlays)
      std::visit(
          [&](const auto& o) {
            // An empty path means that the type of the overlay was invalid, so that it was not read.
            if (!o.where.path.empty()) check_overlay(o);
          },
          overlay);
    check_cameras();
    check_lights();
    check_environment();
    check_output();
  }

 private:
  void check_mesh_body(const std::string& path, const std::string& name) {
    const Body* body = named_body(path, name);
    if (body && !std::holds_alternative<MeshFile>(body->shape))
      fail(path, "the body '" + name + "' has no mesh");
  }
  void check_pair(const std::string& path, const std::string& a, const std::string& b) {
    const Body *first = named_body(path + "/a", a), *second = named_body(path + "/b", b);
    if (a == b) return fail(path + "/b", "is the same body as \"a\"");
    const auto is_plane = [](const Body* body) {
      return body && std::holds_alternative<sim::Plane>(body->shape);
    };
    if (is_plane(first) && is_plane(second)) fail(path, "two planes never have a contact");
  }
  void check_not_random(const std::string& path, const Varying& v) {
    if (!std::holds_alternative<Real>(v) && !std::holds_alternative<effects::Curve>(v))
      fail(path, "must be a number or a curve over time, not a random distribution");
  }
  void check_overlay(const TreeOverlay& overlay) {
    check_mesh_body(overlay.where.path + "/body", overlay.body);
    check_not_random(overlay.where.path + "/level", overlay.level);
  }
  void check_overlay(const PartsOverlay& overlay) {
    check_mesh_body(overlay.where.path + "/body", overlay.body);
    check_not_random(overlay.where.path + "/explode", overlay.explode);
  }
  void check_overlay(const ClosestOverlay& overlay) { check_pair(overlay.where.path, overlay.a, overlay.b); }
  void check_overlay(const ContactsOverlay& overlay) {
    if (!overlay.a.empty() || !overlay.b.empty()) check_pair(overlay.where.path, overlay.a, overlay.b);
  }
  void check_overlay(const VelocitiesOverlay& overlay) {
    const std::string path = overlay.where.path + "/body";
    const Body* body = overlay.body.empty() ? nullptr : named_body(path, overlay.body);
    if (body && body->motion == sim::MotionType::static_body)
      warn(path, "shows nothing: the body '" + overlay.body + "' is static");
  }
  void check_overlay(const IslandsOverlay&) {}
  void check_overlay(const TrailsOverlay& overlay) {
    if (!overlay.body.empty()) named_body(overlay.where.path + "/body", overlay.body);
  }
  void check_overlay(const TextOverlay& overlay) {
    if (overlay.until && *overlay.until <= overlay.from)
      fail(overlay.where.path + "/until", "must be later than \"from\"");
  }
  void check_overlay(const JointsOverlay& overlay) {
    if (!overlay.joint.empty() && !find_named(flat_.joints, overlay.joint))
      fail(overlay.where.path + "/joint",
           "there is no joint '" + overlay.joint + "'" + suggestion(overlay.joint, names_of(flat_.joints)));
  }
  void check_overlay(const ClothOverlay& overlay) {
    if (!overlay.cloth.empty() && !find_named(flat_.cloths, overlay.cloth))
      fail(overlay.where.path + "/cloth",
           "there is no cloth '" + overlay.cloth + "'" + suggestion(overlay.cloth, names_of(flat_.cloths)));
  }

  // --- Camera, light, film ---

  void check_view(const Vec3& eye, const Vec3& target, const std::string& path) {
    if (eye == target) fail(path, "the camera is at the point that it looks at");
  }
  void check_view(const StaticCamera& camera, const std::string& path) {
    check_view(camera.eye, camera.target, path);
  }
  void check_view(const KeyframedCamera& camera, const std::string& path) {
    if (camera.keyframes.empty()) fail(path, "needs at least one entry in \"keyframes\"");
    check_times(camera.keyframes, path + "/keyframes");
    for (std::size_t i = 0; i < camera.keyframes.size(); ++i)
      check_view(camera.keyframes[i].eye, camera.keyframes[i].target, path + "/keyframes" + step(i));
  }
  void check_view(const OrbitCamera&, const std::string&) {}
  void check_view(const FollowCamera& camera, const std::string& path) {
    if (!camera.body.empty()) check_body_name(path + "/body", camera.body);
    check_view(camera.offset, camera.look_offset, path);
  }

  /// Checks that a body shows a model file. The cameras and lights in the file are checked later, when the
  /// file is read.
  void check_model_body(const std::string& path, const std::string& name) {
    const Body* body = named_body(path, name);
    if (body && !body->model && !std::holds_alternative<MeshFile>(body->shape))
      fail(path, "the body '" + name + "' shows no model file");
  }
  void check_view(const ModelCamera& camera, const std::string& path) {
    check_model_body(path + "/body", camera.body);
    if (camera.fov_deg != Lens().fov_deg)
      fail(path + "/fov_deg", "a camera of a file has the field of view of the file; `focal_mm` replaces it");
    if (camera.aperture > 0 && camera.focus <= 0 && camera.focus_on.empty())
      fail(path + "/aperture", "needs \"focus\" or \"focus_on\": a camera of a file has no target");
  }

  void check_camera(const Camera& camera, const std::string& path) {
    const auto& lens = std::visit([](const Lens& l) -> const Lens& { return l; }, camera);
    std::visit([&](const auto& c) { check_view(c, path); }, camera);
    if (!lens.focus_on.empty()) check_body_name(path + "/focus_on", lens.focus_on);
    if (!lens.look_at.empty()) check_body_name(path + "/look_at", lens.look_at);
    for (std::size_t i = 0; i < lens.fit.size(); ++i) check_body_name(path + "/fit" + step(i), lens.fit[i]);
  }
  /// Checks the names of cameras, which become parts of file names.
  void check_cameras() {
    constexpr std::size_t kMostLetters = 64;
    check_camera(scene_.camera, "/camera");
    check_unique(scene_.cameras);
    for (const NamedCamera& camera : scene_.cameras) {
      const std::string& path = camera.where.path;
      const bool plain = std::ranges::all_of(
          camera.name, [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; });
      if (camera.name == kMainCamera || camera.name == kAllCameras)
        fail(path + "/name", fmt::format("the name '{}' is reserved for {}; choose another name", camera.name,
                                         camera.name == kMainCamera ? "the scene's \"camera\""
                                                                    : "the selection of all cameras"));
      else if (!plain || camera.name.size() > kMostLetters)
        fail(path + "/name",
             fmt::format("'{}': the name of a camera is part of file names; it has at most {} "
                         "letters, digits, _ and -",
                         camera.name, kMostLetters));
      check_camera(camera.camera, path + "/camera");
    }
  }

  void check_light(const SunLight& sun, const std::string& path) {
    if (sun.direction.y() <= 0)
      fail(path + "/direction", "the sun must be above the horizon: y must be greater than 0");
  }
  void check_lamp(const LampBase& lamp, const std::string& path) {
    if (!lamp.body.empty()) check_body_name(path + "/body", lamp.body);
    check_not_random(path + "/intensity", lamp.intensity);
  }
  void check_light(const ModelLights& lights, const std::string& path) {
    check_model_body(path + "/body", lights.body);
  }
  void check_light(const PointLight& light, const std::string& path) { check_lamp(light, path); }
  template <class Directed>
  void check_light(const Directed& light, const std::string& path) {
    check_lamp(light, path);
    if (light.target == light.position) fail(path + "/target", "is at the position of the light");
  }
  void check_lights() {
    std::size_t suns = 0;
    for (std::size_t i = 0; i < scene_.lights.size(); ++i) {
      const std::string path = "/lights" + step(i);
      if (std::holds_alternative<SunLight>(scene_.lights[i]) && ++suns > 1)
        fail(path, "a scene has at most one sun");
      std::visit([&](const auto& light) { check_light(light, path); }, scene_.lights[i]);
    }
  }

  void check_environment() {
    const EnvironmentSettings& environment = scene_.environment;
    if (environment.picture) check_file("/environment/picture/file", environment.picture->file);
    if (environment.picture && environment.clouds > 0)
      fail("/environment/clouds",
           "a sky from a picture has the clouds of the picture; remove \"clouds\" or \"picture\"");
  }

  void check_output() {
    check_not_random("/render/exposure", scene_.render.exposure);
    const auto& size = scene_.render.size;
    if (size.x() % 2 != 0 || size.y() % 2 != 0)
      warn("/render/size",
           "has an odd width or height; most video formats need even numbers, such as 1280 x 720");
    if (scene_.frame_count() < 1)
      fail("/output/duration",
           fmt::format("is shorter than one frame at {} frames per second", scene_.output.fps.text()));
  }
};

}  // namespace

void check_film(const Scene& scene, const Scene& flat, const SceneFolder& folder, Findings& findings) {
  FilmChecker(scene, flat, folder, findings).run();
}

}  // namespace offstage::producer
