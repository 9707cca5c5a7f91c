#include "engine/film_run.h"

#include <algorithm>
#include <chrono>

#include "producer/build/shown_model.h"

namespace offstage::engine {
namespace {

using Clock = std::chrono::steady_clock;
using producer::Scene;
using producer::StaticCamera;

constexpr int kDraftQuality = 82, kFineQuality = 92;  // quality of JPEG

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Returns the largest size with a picture's aspect ratio within a box, and no larger than the picture.
Eigen::Vector2i fitted(const Eigen::Vector2i& size, const Eigen::Vector2i& box) {
  const double scale = std::min({1.0, double(box.x()) / size.x(), double(box.y()) / size.y()});
  return {std::max(2, int(size.x() * scale + 0.5)), std::max(2, int(size.y() * scale + 0.5))};
}

/// Replaces the pose of the scene's camera; its lens remains, with the field of view of a glTF file's camera
/// and with keys of field of view and focus.
void look_with(Scene& scene, const Scene& original, const producer::ModelLibrary& models,
               const std::optional<ViewCamera>& camera) {
  scene.camera = original.camera;
  if (!camera) return;
  if (auto* keyed = std::get_if<producer::KeyframedCamera>(&scene.camera)) {
    for (producer::CameraKey& key : keyed->keyframes) {
      key.eye = camera->eye;
      key.target = camera->target;
    }
  } else {
    StaticCamera view;
    static_cast<producer::Lens&>(view) =
        std::visit([](const producer::Lens& lens) -> const producer::Lens& { return lens; }, original.camera);
    const auto* of_model = std::get_if<producer::ModelCamera>(&original.camera);
    if (of_model && !view.focal_mm)
      view.fov_deg = producer::Real{producer::find_camera(*of_model, original, models)->fov_deg};
    view.eye = camera->eye;
    view.target = camera->target;
    scene.camera = view;
  }
  std::visit(
      [](producer::Lens& lens) {
        lens.look_at.clear();
        lens.fit.clear();
      },
      scene.camera);
}

}  // namespace

FilmRun::FilmRun(FilmDef def, std::shared_ptr<const producer::ModelLibrary> models,
                 const FilmResources& resources)
    : def_(std::move(def)),
      models_(std::move(models)),
      resources_(resources),
      scene_(def_.loaded->scene),
      simulated_(def_.loaded->scene, *models_, resources_.physics, def_.physics, frames()) {
  scene_.render.size = fitted(scene_.render.size, resources_.draft_px);
  scene_.render.quality = producer::Quality::draft;
  look_with(scene_, def_.loaded->scene, *models_, def_.camera);
}

void FilmRun::look_from(const std::optional<ViewCamera>& camera, const std::string& film) {
  def_.camera = camera;
  def_.film = film;
  missing_hint_ = 1;
  look_with(scene_, def_.loaded->scene, *models_, camera);
  if (refined_) look_with(refined_->scene, def_.loaded->scene, *models_, camera);
}

int FilmRun::first_missing() {
  while (missing_hint_ <= frames() && has_draft(missing_hint_)) ++missing_hint_;
  return missing_hint_;
}

producer::Picture& FilmRun::draft_picture() {
  if (!picture_) picture_.emplace(scene_, *models_, resources_.context, true);
  return *picture_;
}

bool FilmRun::draw_draft(int frame, const Stop& stop) {
  return draw_draft(frame, previous(frame), state(frame), stop);
}

bool FilmRun::draw_lead_in(const Stop& stop) {
  const producer::Snapshot now = simulated_.current();
  return draw_draft(0, now, now, stop);
}

bool FilmRun::draw_draft(int frame, const producer::Snapshot& before, const producer::Snapshot& now,
                         const Stop& stop) {
  const auto start = Clock::now();
  const render::Image image = draft_picture().draw(before, now, stop);
  if (image.rgba.empty()) return false;
  camera_ = picture_->camera();
  auto jpeg = std::make_shared<const std::string>(resources_.jpeg.write(image, kDraftQuality));
  resources_.frames.put(def_.film, frame, {Detail::draft, ms_since(start), std::move(jpeg), camera_});
  return true;
}

bool FilmRun::refine(int frame, Detail detail, const Stop& stop) {
  if (!refined_) {
    refined_ = std::make_unique<Refined>();
    refined_->scene = def_.loaded->scene;
    look_with(refined_->scene, def_.loaded->scene, *models_, def_.camera);
    refined_->picture.emplace(refined_->scene, *models_, resources_.context);
    if (stop()) return false;
  }
  refined_->scene.render.quality =
      detail == Detail::final ? producer::Quality::final : producer::Quality::preview;
  const auto start = Clock::now();
  const render::Image image = refined_->picture->draw(previous(frame), state(frame), stop);
  if (image.rgba.empty()) return false;
  camera_ = refined_->picture->camera();
  auto jpeg = std::make_shared<const std::string>(resources_.jpeg.write(image, kFineQuality));
  resources_.frames.put(def_.film, frame, {detail, ms_since(start), std::move(jpeg), camera_});
  return true;
}

std::string FilmRun::pick(int frame, double x, double y) {
  const render::Channels seen = draft_picture().channels(state(frame), state(frame));
  const int column = std::clamp(int(x * seen.width_px), 0, seen.width_px - 1),
            row = std::clamp(int(y * seen.height_px), 0, seen.height_px - 1);
  const uint32_t id = seen.id[static_cast<std::size_t>(row * seen.width_px + column)];
  const render::ObjectNames names = producer::object_names(scene_);
  const auto name = names.find(id);
  return name == names.end() ? "" : name->second;
}

}  // namespace offstage::engine
