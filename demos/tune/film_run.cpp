#include "tune/film_run.h"

#include <algorithm>
#include <chrono>

#include "producer/build/shown_model.h"
#include "producer/run/run_notes.h"

namespace offstage::tune {
namespace {

using Clock = std::chrono::steady_clock;
using producer::Scene;
using producer::StaticCamera;

constexpr int kDraftQuality = 82, kFineQuality = 92;  // quality of JPEG

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// The largest size with a picture's aspect ratio within a box, and no larger than the picture.
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

FilmRun::FilmRun(FilmDef def, std::shared_ptr<const producer::ModelLibrary> models, const Workshop& workshop)
    : def_(std::move(def)),
      models_(std::move(models)),
      workshop_(workshop),
      scene_(def_.loaded->scene),
      physics_(workshop_.physics.open(def_.physics)) {
  scene_.render.size = fitted(scene_.render.size, workshop_.draft_px);
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

bool FilmRun::has_state(int frame) const {
  const auto place = static_cast<std::size_t>(frame - 1);
  if (frame >= 1 && place < physics_->states.size() && physics_->states[place]) return true;
  return std::ranges::any_of(latest_, [&](const auto& state) { return state && state->frame == frame; });
}

const producer::Snapshot& FilmRun::state(int frame) const {
  for (const auto& state : latest_)
    if (state && state->frame == frame) return *state;
  return *physics_->states[static_cast<std::size_t>(frame - 1)];
}

int FilmRun::first_missing() {
  while (missing_hint_ <= frames() && has_draft(missing_hint_)) ++missing_hint_;
  return missing_hint_;
}

void FilmRun::restart() {
  simulation_.reset();
  advances_ = 0;
}

void FilmRun::make_simulation() {
  if (simulation_) return;
  simulation_.emplace(def_.loaded->scene, *models_);
  energy_start_ = simulation_->world().energy();
}

void FilmRun::simulate() {
  if (simulated_to() >= frames()) restart();
  make_simulation();
  const auto start = Clock::now();
  simulation_->advance();
  ++advances_;
  const int frame = simulation_->frame();
  if (frame < 1) return;
  if (!has_state(frame)) {
    auto state = std::make_shared<const producer::Snapshot>(simulation_->snapshot());
    workshop_.physics.keep(def_.physics, frame, state);
    latest_[frame % 2] = std::move(state);
  }
  add_figures(ms_since(start));
  if (frame == frames()) finish();
}

void FilmRun::add_figures(double sim_ms) {
  const int frame = simulation_->frame();
  if (physics_->figures.size() >= static_cast<std::size_t>(frame)) return;
  const sim::World& world = simulation_->world();
  physics_->figures.push_back({.frame = frame,
                               .time = scene_.output.time_of(frame),
                               .sim_ms = sim_ms,
                               .particles = world.particle_count(),
                               .contacts = world.contacts().size(),
                               .energy = world.energy(),
                               .state_hash = world.state_hash().hex()});
  constexpr int kEvery = 15;  // number of frames
  if (frame % kEvery == 0 || frame == frames()) physics_->notes = producer::notes_of(simulation_->totals());
}

void FilmRun::finish() {
  producer::RunStats stats;
  stats.frames = frames();
  stats.bodies = simulation_->body_count();
  stats.energy_start = energy_start_;
  stats.energy_end = simulation_->world().energy();
  stats.totals = simulation_->totals();
  for (const producer::FrameFigures& figures : physics_->figures) {
    stats.sim.add(figures.sim_ms);
    stats.particles = figures.particles;
    stats.most_particles = std::max(stats.most_particles, figures.particles);
    stats.wall_s += figures.sim_ms / 1000;
  }
  stats.state_hash = simulation_->world().state_hash().hex();
  physics_->statistics = to_json(stats);
}

double FilmRun::lead_in() const {
  if (!simulation_) return 0;
  const int before = simulation_->advances_to(0);
  return before == 0 ? 1 : std::min(1.0, double(advances_) / before);
}

double FilmRun::lead_in_time() const {
  return simulation_ ? simulation_->world().time() : 0;
}

producer::Picture& FilmRun::draft_picture() {
  if (!picture_) picture_.emplace(scene_, *models_, workshop_.context, true);
  return *picture_;
}

bool FilmRun::draw_draft(int frame, const Stop& stop) {
  return draw_draft(frame, previous(frame), state(frame), stop);
}

bool FilmRun::draw_lead_in(const Stop& stop) {
  const producer::Snapshot now = simulation_->snapshot();
  return draw_draft(0, now, now, stop);
}

bool FilmRun::draw_draft(int frame, const producer::Snapshot& before, const producer::Snapshot& now,
                         const Stop& stop) {
  const auto start = Clock::now();
  const render::Image image = draft_picture().draw(before, now, stop);
  if (image.rgba.empty()) return false;
  camera_ = picture_->camera();
  auto jpeg = std::make_shared<const std::string>(workshop_.jpeg.write(image, kDraftQuality));
  workshop_.frames.put(def_.film, frame, {Detail::draft, ms_since(start), std::move(jpeg), camera_});
  return true;
}

bool FilmRun::refine(int frame, Detail detail, const Stop& stop) {
  if (!refined_) {
    refined_ = std::make_unique<Refined>();
    refined_->scene = def_.loaded->scene;
    look_with(refined_->scene, def_.loaded->scene, *models_, def_.camera);
    refined_->picture.emplace(refined_->scene, *models_, workshop_.context);
    if (stop()) return false;
  }
  refined_->scene.render.quality =
      detail == Detail::final ? producer::Quality::final : producer::Quality::preview;
  const auto start = Clock::now();
  const render::Image image = refined_->picture->draw(previous(frame), state(frame), stop);
  if (image.rgba.empty()) return false;
  camera_ = refined_->picture->camera();
  auto jpeg = std::make_shared<const std::string>(workshop_.jpeg.write(image, kFineQuality));
  workshop_.frames.put(def_.film, frame, {detail, ms_since(start), std::move(jpeg), camera_});
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

}  // namespace offstage::tune
