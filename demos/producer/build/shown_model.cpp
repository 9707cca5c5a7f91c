#include "producer/build/shown_model.h"

#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "producer/base/suggest.h"
#include "producer/base/to_float.h"
#include "producer/build/animated_bodies.h"

namespace offstage::producer {
namespace {

using Eigen::Affine3f;

Affine3f scaled_pose(const Vec3& position, const Quat& orientation, Real scale) {
  return Eigen::Translation3f(position.cast<float>()) * orientation.cast<float>() *
         Eigen::Scaling(to_float(scale));
}

template <class Place>
std::string unknown_place(const std::string& file, const char* kind, const std::string& name,
                          const std::vector<Place>& known) {
  if (known.empty())
    return fmt::format("{}: has no {}s; `offstage info FILE` lists the cameras and lights of a file", file,
                       kind);
  std::vector<std::string> names;
  for (const Place& place : known) names.push_back(place.name);
  return fmt::format("{}: has no {} '{}'{}", file, kind, name, suggestion(name, names));
}

/// Returns whether the animation that a body plays moves a node.
bool is_animated(const Body& body, const render::Model::Place& place, const render::ModelRig& rig) {
  if (!body.animation || place.node < 0) return false;
  const int clip = rig.clip(body.animation->clip);
  if (clip < 0) return false;
  for (int node = place.node; node >= 0; node = rig.nodes[static_cast<std::size_t>(node)].parent)
    for (const render::RigChannel& channel : rig.clips[static_cast<std::size_t>(clip)].channels)
      if (channel.node == node && channel.path != render::RigChannel::Path::weights) return true;
  return false;
}

class PlaceCheck {
 public:
  PlaceCheck(const Scene& scene, const ModelLibrary& models, std::vector<Problem>& problems,
             std::vector<Problem>& warnings)
      : scene_(scene),
        models_(models),
        problems_(problems),
        warnings_(warnings),
        suns_(std::ranges::count_if(
            scene.lights, [](const Light& light) { return std::holds_alternative<SunLight>(light); })) {}

  void camera(const Camera& any) {
    const auto* camera = std::get_if<ModelCamera>(&any);
    if (!camera) return;
    const std::string file = file_of(camera->body);
    files_with_camera.insert(file);
    const render::Model::Camera* found = find_camera(*camera, scene_, models_);
    if (!found)
      fail(camera->where, unknown_place(file, "camera", camera->name, models_.model(file).cameras));
    else if (!found->perspective)
      fail(camera->where,
           fmt::format("{}: the camera '{}' is orthographic; only perspective ones can be used", file,
                       found->name));
  }

  void lights(const ModelLights& lights) {
    const std::string file = file_of(lights.body);
    files_with_lights.insert(file);
    const std::vector<FileLight>& known = models_.model(file).lights;
    bool found = false;
    for (const FileLight& light : known)
      if (has_light(lights, light)) {
        found = true;
        if (light.kind == FileLight::Kind::directional) sun(lights, light, file);
        if (light.range_m > 0)
          warnings_.push_back(
              {lights.where, fmt::format("{}: the range of the light '{}' is ignored: its light "
                                         "decreases with the square of the distance, without an end",
                                         file, light.name)});
      }
    if (!found) fail(lights.where, unknown_place(file, "light", lights.name, known));
  }

  std::set<std::string> files_with_camera, files_with_lights;

 private:
  std::string file_of(const std::string& body) const {
    return shown_model(body_of(scene_, body), models_).value().file;
  }
  void sun(const ModelLights& lights, const FileLight& light, const std::string& file) {
    const Body& body = body_of(scene_, lights.body);
    const auto wrong = [&](const std::string& why) {
      fail(lights.where, fmt::format("{}: the directional light '{}' {}", file, light.name, why));
    };
    if (++suns_ > 1) wrong("is a second sun; a scene has at most one. Select other lights by \"name\"");
    if (body.motion != sim::MotionType::static_body || is_animated(body, light, models_.model(file).rig))
      return wrong("moves, but the sun cannot move. Make the body static, without an animation of the light");
    const Eigen::Vector3f towards =
        body.orientation.cast<float>() *
        (pose_in_body(body, light, models_, 0).linear() * Eigen::Vector3f::UnitZ());
    if (!(towards.normalized().y() > 0))
      wrong("does not shine downwards; the sun must be above the horizon. Turn the body");
  }
  void fail(const Where& where, std::string what) { problems_.push_back({where, std::move(what)}); }

  const Scene& scene_;
  const ModelLibrary& models_;
  std::vector<Problem>& problems_;
  std::vector<Problem>& warnings_;
  std::ptrdiff_t suns_;
};

}  // namespace

std::optional<ShownModel> shown_model(const Body& body, const ModelLibrary& models) {
  if (body.model)
    return ShownModel{body.model->file, scaled_pose(body.model->position, body.model->orientation,
                                                    scale_of(*body.model, models))};
  if (const auto* mesh = std::get_if<MeshFile>(&body.shape))
    return ShownModel{mesh->file, scaled_pose(Vec3::Zero(), Quat::Identity(), scale_of(*mesh, models))};
  return {};
}

const Body& body_of(const Scene& scene, const std::string& name) {
  return *std::ranges::find(scene.bodies, name, &Body::name);
}

const render::Model::Camera* find_camera(const ModelCamera& camera, const Scene& scene,
                                         const ModelLibrary& models) {
  const auto shown = shown_model(body_of(scene, camera.body), models);
  for (const render::Model::Camera& own : models.model(shown.value().file).cameras)
    if (camera.name.empty() || camera.name == own.name) return &own;
  return nullptr;
}

bool has_light(const ModelLights& lights, const render::Model::Light& light) {
  return lights.name.empty() || lights.name == light.name;
}

Affine3f pose_in_body(const Body& body, const render::Model::Place& place, const ModelLibrary& models,
                      double time) {
  const ShownModel shown = shown_model(body, models).value();
  const render::ModelRig& rig = models.model(shown.file).rig;
  const int clip = body.animation && place.node >= 0 ? rig.clip(body.animation->clip) : -1;
  if (clip < 0) return shown.body_from_model * Affine3f(place.model_from_place);
  const double duration = double{rig.clips[static_cast<std::size_t>(clip)].duration};
  const render::RigPose pose =
      render::pose_at(rig, clip, to_float(clip_time(*body.animation, duration, time)));
  return shown.body_from_model * pose.world[static_cast<std::size_t>(place.node)];
}

void check_cameras_and_lights(const Scene& scene, const ModelLibrary& models, std::vector<Problem>& problems,
                              std::vector<Problem>& warnings) {
  PlaceCheck check(scene, models, problems, warnings);
  check.camera(scene.camera);
  for (const NamedCamera& camera : scene.cameras) check.camera(camera.camera);
  for (const Light& light : scene.lights)
    if (const auto* lights = std::get_if<ModelLights>(&light)) check.lights(*lights);
  std::set<std::string> seen;
  for (const Body& body : scene.bodies) {
    const auto shown = shown_model(body, models);
    if (!shown || !seen.insert(shown->file).second) continue;
    const render::Model& model = models.model(shown->file);
    const auto warn = [&](std::size_t count, const char* kind, const char* key) {
      warnings.push_back(
          {body.where,
           fmt::format("{}: {} {} not used; {{\"type\": \"model\", \"body\": \"{}\"}} in `{}` uses "
                       "cameras and lights of a file",
                       shown->file, count, kind, body.name, key)});
    };
    if (!model.cameras.empty() && !check.files_with_camera.contains(shown->file))
      warn(model.cameras.size(), "cameras are", "camera");
    if (!model.lights.empty() && !check.files_with_lights.contains(shown->file))
      warn(model.lights.size(), "lights are", "lights");
  }
}

}  // namespace offstage::producer
