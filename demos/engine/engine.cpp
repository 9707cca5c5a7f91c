#include "engine/engine.h"

#include <algorithm>

#include <nlohmann/json.hpp>

#include "producer/base/error.h"
#include "producer/run/production.h"

namespace offstage::engine {
namespace {

using producer::LoadedScene;
using producer::ModelLibrary;
using std::chrono::milliseconds;

constexpr milliseconds kQuiet{500};       // time without requests before a frame is refined
constexpr milliseconds kVeryQuiet{2500};  // time without requests before it is refined to the highest quality
constexpr int kBusy = 4;                  // factor of both times while the film is not complete
constexpr milliseconds kGlimpse{60};      // time between two pictures of the time before frame 1

/// Returns the part of a scene that determines which model files are read and how they are processed:
/// everything except numbers and colours, which matter only for decompositions, the sky's picture and
/// flip-books.
std::string used_by_models(const std::string& canonical) {
  auto json = nlohmann::json::parse(canonical);
  for (const char* key : {"name", "description", "render", "output", "world"}) json.erase(key);
  const std::function<void(nlohmann::json&)> clear = [&](nlohmann::json& value) {
    const bool colour = value.is_string() && value.get_ref<const std::string&>().starts_with('#');
    if (value.is_number() || colour) value = nullptr;
    if (!value.is_structured()) return;
    for (const auto& item : value.items())
      if (item.key() != "decomposition" && item.key() != "picture" && item.key() != "sheet")
        clear(item.value());
  };
  clear(json);
  return json.dump();
}

}  // namespace

Engine::Engine(EngineSettings settings, OnEvent on_event)
    : settings_(std::move(settings)),
      on_event_(std::move(on_event)),
      frames_(settings_.frame_bytes),
      physics_(settings_.physics_bytes),
      thread_([this] { work(); }) {}

Engine::~Engine() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    woken_.notify_all();
  }
  thread_.join();
}

Engine::Hold::~Hold() {
  const std::lock_guard lock(engine_.mutex_);
  --engine_.holds_;
  engine_.woken_.notify_all();
}

// --- Requests ---

FilmDef Engine::definition(Loaded scene, const std::optional<ViewCamera>& camera) const {
  FilmDef def{std::move(scene), camera, "", ""};
  const std::string generation = std::to_string(models_generation_);
  std::string film = settings_key(*def.loaded, ModelLibrary()) + generation;
  if (camera)
    for (const Eigen::Vector3d& v : {camera->eye, camera->target})
      for (const double x : v) film += " " + std::to_string(x);
  def.film = producer::text_hash(film).substr(0, 16);
  def.physics = simulation_key(*def.loaded, ModelLibrary()) + generation;
  return def;
}

Engine::Run Engine::show(Loaded scene, const std::optional<ViewCamera>& camera) {
  const std::lock_guard lock(mutex_);
  FilmDef def = definition(std::move(scene), camera);
  const Run run{++runs_, def.film};
  wanted_ = std::move(def);
  changed_ = Clock::now();
  ++requested_;
  woken_.notify_all();
  return run;
}

std::string Engine::film_of(const LoadedScene& scene) const {
  const std::lock_guard lock(mutex_);
  return definition(std::make_shared<const LoadedScene>(scene), {}).film;
}

void Engine::pin(Loaded scene) {
  const std::lock_guard lock(mutex_);
  wanted_pinned_.reset();
  if (scene) wanted_pinned_ = definition(std::move(scene), {});
  pinned_changed_ = true;
  ++requested_;
  woken_.notify_all();
}

void Engine::look_at(int frame, bool playing) {
  const std::lock_guard lock(mutex_);
  if (frame == frame_ && playing == playing_) return;
  frame_ = frame;
  playing_ = playing;
  changed_ = Clock::now();
  ++requested_;
  woken_.notify_all();
}

void Engine::forget_models() {
  const std::lock_guard lock(mutex_);
  ++models_generation_;
}

std::future<std::string> Engine::pick(int frame, double x, double y) {
  const std::lock_guard lock(mutex_);
  picks_.push_back({frame, x, y, {}});
  ++requested_;
  woken_.notify_all();
  return picks_.back().name.get_future();
}

uint64_t Engine::sweep(std::vector<Loaded> versions, int frame) {
  const std::lock_guard lock(mutex_);
  const std::size_t count = versions.size();
  sweep_ = {++sweeps_, std::move(versions), frame, 0, {}};
  sweep_.pictures.resize(count);
  ++requested_;
  woken_.notify_all();
  return sweep_.number;
}

std::shared_ptr<const std::string> Engine::cell(uint64_t sweep, int index) const {
  const std::lock_guard lock(mutex_);
  const auto place = static_cast<std::size_t>(index);
  return sweep == sweep_.number && place < sweep_.pictures.size() ? sweep_.pictures[place] : nullptr;
}

std::vector<producer::FrameFigures> Engine::figures() const {
  const std::lock_guard lock(mutex_);
  return figures_;
}

// --- The thread ---

void Engine::work() {
  try {
    render::Context context;
    JpegWriter jpeg;
    work_with({physics_, frames_, context, jpeg, settings_.draft_px});
    film_.reset();
    pinned_.reset();
  } catch (const std::exception& error) {
    fail(error.what());
  }
}

void Engine::work_with(const FilmResources& resources) {
  while (!ending_) {
    bool busy = false;
    try {
      busy = holds_ == 0 && step(resources);
    } catch (const std::exception& error) {  // exceptions of the scene, the models, the physics, GL
      fail(error.what());
      busy = true;
    }
    if (busy) continue;
    std::unique_lock lock(mutex_);
    // The wait is limited, because refining begins after a time without requests.
    woken_.wait_for(lock, milliseconds(100),
                    [&] { return ending_ || (holds_ == 0 && requested_ != taken_); });
  }
}

bool Engine::step(const FilmResources& resources) {
  if (take_requests(resources)) return true;
  return answer_picks() || advance_sweep(resources) || refine_frame() || advance_film() ||
         advance_pinned(resources);
}

/// Returns whether there were any requests.
bool Engine::take_requests(const FilmResources& resources) {
  std::optional<FilmDef> wanted;
  {
    const std::lock_guard lock(mutex_);
    if (taken_ == requested_) return false;
    taken_ = requested_;
    if (runs_ != run_) wanted = wanted_;
    run_ = runs_;
    if (pinned_changed_) pinned_.reset();
    pinned_changed_ = false;
    std::vector<std::string> kept;
    if (wanted_) kept.push_back(wanted_->film);
    if (wanted_pinned_) kept.push_back(wanted_pinned_->film);
    frames_.protect(std::move(kept));
  }
  if (!wanted) return true;
  failed_ = complete_reported_ = false;
  if (film_ && film_->def().loaded == wanted->loaded && film_->def().physics == wanted->physics) {
    film_->look_from(wanted->camera, wanted->film);
    def_ = std::move(wanted);
  } else {
    def_ = std::move(wanted);
    start_film(resources);
  }
  return true;
}

void Engine::start_film(const FilmResources& resources) {
  film_.reset();
  film_ = std::make_unique<FilmRun>(*def_, models_for(*def_), resources);
  {
    const std::lock_guard lock(mutex_);
    figures_ = film_->physics().figures;
  }
  report_film(FilmEvent::Phase::lead_in);
}

std::shared_ptr<const ModelLibrary> Engine::models_for(const FilmDef& def) {
  uint64_t generation = 0;
  {
    const std::lock_guard lock(mutex_);
    generation = models_generation_;
  }
  const std::string key = std::to_string(generation) + used_by_models(def.loaded->canonical);
  if (models_ && key == models_key_) return models_;
  std::vector<Problem> warnings;
  const auto on_step = [&](const std::string& step) {
    if (!step.empty()) report_film(FilmEvent::Phase::loading, step);
  };
  models_ = std::make_shared<const ModelLibrary>(def.loaded->scene, def.loaded->folder,
                                                 settings_.decompositions, warnings, on_step);
  models_key_ = key;
  return models_;
}

bool Engine::answer_picks() {
  std::unique_lock lock(mutex_);
  if (picks_.empty()) return false;
  Pick pick = std::move(picks_.front());
  picks_.pop_front();
  lock.unlock();
  try {
    pick.name.set_value(film_ && film_->has_state(pick.frame) ? film_->pick(pick.frame, pick.x, pick.y) : "");
  } catch (...) {
    pick.name.set_value("");
    throw;
  }
  return true;
}

/// Draws the visible frame if its draft is missing; otherwise simulates or draws the first missing frame.
/// Returns whether there was work.
bool Engine::advance_film() {
  if (!film_ || failed_) return false;
  int frame = 0;
  {
    const std::lock_guard lock(mutex_);
    frame = std::clamp(frame_, 1, film_->frames());
  }
  if (film_->has_draft(frame) || !film_->has_state(frame)) frame = film_->first_missing();
  if (frame > film_->frames()) {
    if (film_->simulated().is_complete()) {
      if (!complete_reported_) report_film(FilmEvent::Phase::complete);
      complete_reported_ = true;
      return false;
    }
  } else if (film_->has_state(frame)) {
    if (film_->draw_draft(frame, [this] { return is_outdated(); })) report_frame(frame, Detail::draft);
    return true;
  } else if (film_->simulated().simulated_to() >= frame) {
    film_->simulated().restart();
  }
  film_->simulated().simulate();
  if (film_->simulated().simulated_to() > 0) {
    const std::lock_guard lock(mutex_);
    figures_ = film_->physics().figures;
  } else if (Clock::now() - lead_in_shown_ > kGlimpse && film_->simulated().lead_in() < 1 &&
             film_->first_missing() == 1) {
    if (!film_->draw_lead_in([this] { return is_outdated(); })) return true;
    report_frame(0, Detail::draft);
    report_film(FilmEvent::Phase::lead_in);
    lead_in_shown_ = Clock::now();
  }
  return true;
}

bool Engine::is_film_drawn() {
  return film_->simulated().is_complete() && film_->first_missing() > film_->frames();
}

bool Engine::refine_frame() {
  if (!film_ || failed_) return false;
  int frame = 0;
  bool playing = false;
  Clock::time_point changed;
  {
    const std::lock_guard lock(mutex_);
    frame = std::clamp(frame_, 1, film_->frames());
    playing = playing_;
    changed = changed_;
  }
  if (playing || !film_->has_state(frame) || !film_->has_draft(frame)) return false;
  const int factor = is_film_drawn() ? 1 : kBusy;
  for (const auto& [detail, quiet] :
       {std::pair(Detail::preview, kQuiet), std::pair(Detail::final, kVeryQuiet)}) {
    if (frames_.has(film_->def().film, frame, detail)) continue;
    if (Clock::now() - changed < quiet * factor) return false;
    if (film_->refine(frame, detail, [this] { return is_stale(); })) report_frame(frame, detail);
    return true;
  }
  return false;
}

bool Engine::advance_pinned(const FilmResources& resources) {
  std::optional<FilmDef> wanted;
  {
    const std::lock_guard lock(mutex_);
    wanted = wanted_pinned_;
  }
  if (!wanted) return false;
  if (!pinned_) pinned_ = std::make_unique<FilmRun>(*wanted, models_for(*wanted), resources);
  const int frame = pinned_->first_missing();
  if (frame > pinned_->frames()) return false;
  if (pinned_->has_state(frame)) {
    if (pinned_->draw_draft(frame, [this] { return is_outdated(); }))
      on_event_(FrameEvent{.run = run_, .film = wanted->film, .frame = frame, .figures = {}, .camera = {}});
  } else {
    if (pinned_->simulated().simulated_to() >= frame) pinned_->simulated().restart();
    pinned_->simulated().simulate();
  }
  return true;
}

/// Draws the picture of the next version of the sweep. A new request interrupts this, and the version is then
/// started again later. Returns whether there was work.
bool Engine::advance_sweep(const FilmResources& resources) {
  Loaded version;
  CellEvent event;
  int frame = 1;
  {
    const std::lock_guard lock(mutex_);
    if (sweep_.next >= sweep_.versions.size()) return false;
    version = sweep_.versions[sweep_.next];
    event = {.sweep = sweep_.number, .index = static_cast<int>(sweep_.next), .fault = {}};
    frame = sweep_.frame;
  }
  std::shared_ptr<const std::string> picture;
  try {
    if (!version) throw std::runtime_error("this value is not allowed here");
    FilmDef def;
    {
      const std::lock_guard lock(mutex_);
      def = definition(version, {});
    }
    FilmResources small = resources;
    small.draft_px = {320, 180};
    FilmRun run(def, models_for(def), small);
    frame = std::clamp(frame, 1, run.frames());
    while (!run.has_state(frame)) {
      if (is_stale()) return true;
      run.simulated().simulate();
    }
    picture = std::make_shared<const std::string>(resources.jpeg.write(run.small_picture(frame), 85));
    event.particles = run.physics().figures.at(static_cast<std::size_t>(frame - 1)).particles;
  } catch (const std::exception& error) {
    event.fault = error.what();
  }
  {
    const std::lock_guard lock(mutex_);
    if (sweep_.number != event.sweep) return true;
    sweep_.pictures[sweep_.next++] = std::move(picture);
  }
  on_event_(event);
  return true;
}

// --- Reports ---

void Engine::report_frame(int frame, Detail detail) {
  const auto picture = frames_.get(film_->def().film, frame, detail);
  if (!picture) return;
  FrameEvent event{.run = run_,
                   .film = film_->def().film,
                   .frame = frame,
                   .detail = detail,
                   .draw_ms = picture->draw_ms,
                   .figures = {},
                   .camera = picture->camera};
  event.time = frame > 0 ? film_->scene().output.time_of(frame) : film_->simulated().time();
  const auto& figures = film_->physics().figures;
  if (frame > 0 && static_cast<std::size_t>(frame) <= figures.size())
    event.figures = figures[static_cast<std::size_t>(frame - 1)];
  on_event_(event);
  constexpr int kEvery = 15;
  if (frame > 0 && frame % kEvery == 0 && detail == Detail::draft) report_film(FilmEvent::Phase::running);
}

void Engine::report_film(FilmEvent::Phase phase, const std::string& message) {
  FilmEvent event{.run = run_, .film = def_ ? def_->film : "", .phase = phase, .message = message};
  if (film_) {
    event.lead_in = film_->simulated().lead_in();
    event.simulated = static_cast<int>(film_->physics().figures.size());
    if (const auto& totals = film_->physics().totals) event.statistics = to_json(*totals);
    event.notes = film_->physics().notes;
  }
  on_event_(event);
}

void Engine::fail(const std::string& what) {
  failed_ = true;
  report_film(FilmEvent::Phase::failed, what);
}

}  // namespace offstage::engine
