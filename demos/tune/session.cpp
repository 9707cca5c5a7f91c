#include "tune/session.h"

#include <algorithm>

#include <fmt/format.h>

#include "producer/base/interrupt.h"
#include "producer/base/json.h"
#include "producer/format/scene_io.h"
#include "producer/format/scene_source.h"
#include "producer/run/watch.h"
#include "render/error.h"
#include "tune/messages.h"
#include "tune/text_edit.h"

namespace offstage::tune {
namespace {

namespace fs = std::filesystem;
using producer::Node;
using std::chrono::milliseconds;

/// Returns the index of the list item that a step of a path refers to, by index or by name.
std::optional<std::size_t> item_of(const producer::List& list, const std::string& step) {
  for (std::size_t i = 0; i < list.size(); ++i) {
    const Node* name = list[i].find("name");
    const std::string* text = name ? name->as<std::string>() : nullptr;
    if (text && *text == step) return i;
  }
  const bool digits =
      !step.empty() && step.find_first_not_of("0123456789") == std::string::npos && step.size() < 9;
  if (digits && std::stoul(step) < list.size()) return std::stoul(step);
  return {};
}

/// Returns an override of the scene with the overlays of its text and those in `more`.
std::string overlays_override(const std::string& text, const Session::Json& more) {
  Session::Json all = Session::Json::array();
  const Node root = producer::parse_json(text, "");
  if (const Node* own = root.find("overlays")) all = Session::Json::parse(producer::to_text(*own));
  if (!all.is_array()) return {};
  for (const auto& overlay : more) all.push_back(overlay);
  return "overlays=" + all.dump();
}

Reply refused(int status, const std::string& why) {
  return {status, {{"error", why}}};
}

std::vector<std::string> strings_in(const nlohmann::json& request, const char* key) {
  return request.value(key, std::vector<std::string>());
}

/// Applies one change to the text.
std::string changed_by(const std::string& text, const nlohmann::json& op) {
  if (op.contains("set"))
    return set_value(text, op.at("set").get<std::string>(), op.at("value").get<std::string>());
  if (op.contains("remove")) return remove_value(text, op.at("remove").get<std::string>());
  return rename_key(text, op.at("rename").get<std::string>(), op.at("to").get<std::string>());
}

}  // namespace

Session::Session(const std::string& file, engine::EngineSettings settings, std::vector<std::string> allowed)
    : allowed_(std::move(allowed)), document_(file) {
  engine_ = std::make_unique<engine::Engine>(std::move(settings),
                                             [this](const engine::EngineEvent& event) { on_event(event); });
  const std::lock_guard lock(mutex_);
  show();
  watcher_ = std::thread([this] { watch_files(); });
}

Session::~Session() {
  close();
  watcher_.join();
}

void Session::close() {
  closing_ = true;
  tabs_.close_all();
}

// --- From text to film ---

std::vector<std::string> Session::muted_paths(const std::string& text) const {
  std::vector<std::string> paths;
  if (muted_.empty()) return paths;
  const Node root = producer::parse_json(text, "");
  for (const std::string& object : muted_) {  // "emitters/jet_a"
    const std::size_t slash = object.find('/');
    const Node* list = root.find(object.substr(0, slash));
    if (!list || !list->as<producer::List>()) continue;
    if (const auto item = item_of(*list->as<producer::List>(), object.substr(slash + 1)))
      paths.push_back(fmt::format("/{}/{}", object.substr(0, slash), *item));
  }
  return paths;
}

/// Parses the scene's text. Errors are a part of the result. `with_view`: omits the muted objects, and adds
/// the overlays of the page.
Session::Parsed Session::parse(const std::string& text, bool with_view) const {
  Parsed parsed;
  std::vector<std::string> muted;
  try {
    std::vector<std::string> overrides;
    if (with_view) muted = muted_paths(text);
    if (with_view && !overlays_.empty()) overrides.push_back(overlays_override(text, overlays_));
    const std::string seen = muted.empty() ? text : blank_out(text, muted);
    parsed.loaded = std::make_shared<const producer::LoadedScene>(
        producer::parse_scene(seen, document_.file().string(),
                              producer::SceneFolder(document_.file().parent_path(), allowed_), overrides));
  } catch (const SceneError& error) {
    parsed.errors = error.problems();
  } catch (const std::exception& error) {
    parsed.errors = {{{document_.file().string(), 0, 0, ""}, error.what()}};
  }
  for (Problem& problem : parsed.errors) problem.where.path = with_muted(problem.where.path, muted);
  return parsed;
}

/// Makes the engine show the current text. If it is not a valid scene, the latest valid version stays
/// visible.
void Session::show() {
  Parsed parsed = parse(document_.text(), true);
  errors_ = std::move(parsed.errors);
  if (!parsed.loaded) return;
  // If only the text changed (a comment, white space), the film continues.
  const bool same = shown_ && shown_->canonical == parsed.loaded->canonical;
  warnings_ = parsed.loaded->warnings;
  if (!same) shown_ = std::move(parsed.loaded);
  run_ = engine_->show(shown_, camera_);
  if (!camera_) films_[document_.version().id] = run_.film;
}

Session::Json Session::document() const {
  Json json;
  json["revision"] = revision_;
  json["version"] = version_json(document_.version(), films_);
  json["text"] = document_.text();
  json["saved"] = document_.is_saved();
  json["undo"] = document_.can_undo() ? Json(document_.undo_label()) : Json();
  json["redo"] = document_.can_redo() ? Json(document_.redo_label()) : Json();
  json["errors"] = problems_json(errors_, document_.file().string());
  json["warnings"] = problems_json(warnings_, document_.file().string());
  json["run"] = run_.number;
  json["film"] = run_.film;
  json["camera"] =
      camera_ ? Json{{"eye", vector_json(camera_->eye)}, {"target", vector_json(camera_->target)}} : Json();
  json["overlays"] = overlays_;
  json["muted"] = muted_;
  json["pinned"] = pinned_;
  if (pinned_.is_object())
    json["pinned"]["ranges"] = ranges_json(engine_->ranges(pinned_["film"].get<std::string>()));
  json["theirs"] = theirs_ ? Json(*theirs_) : Json();
  if (shown_) {
    const producer::Scene& scene = shown_->scene;
    json["scene"] = {{"name", scene.name},
                     {"frames", scene.frame_count()},
                     {"fps", scene.output.fps.per_second()},
                     {"start", scene.output.start},
                     {"seed", scene.world.seed},
                     {"size", {scene.render.size.x(), scene.render.size.y()}}};
    json["ranges"] = ranges_json(engine_->ranges(run_.film));
  }
  return json;
}

void Session::post_document() {
  ++revision_;
  tabs_.post("document", dump(document()));
}

Reply Session::shown() {
  show();
  post_document();
  return {200, document()};
}

Session::Json Session::state() {
  const std::lock_guard lock(mutex_);
  Json json = document();
  json["file"] = document_.file().string();
  json["writer"] = tabs_.writer();
  {
    const std::lock_guard events(events_mutex_);
    json["film_state"] = latest_film_;
  }
  json["cache"] = {{"bytes", engine_->bytes()}, {"most", engine_->most_bytes()}};
  return json;
}

Session::Json Session::figures() const {
  Json json = Json::array();
  for (const producer::FrameFigures& figures : engine_->figures()) json.push_back(figures_json(figures));
  return json;
}

Session::Json Session::versions() {
  const std::lock_guard lock(mutex_);
  Json json = Json::array();
  for (const Version& version : document_.versions()) json.push_back(version_json(version, films_));
  return json;
}

Session::Json Session::version_text(uint64_t id) {
  const std::lock_guard lock(mutex_);
  const Version* version = document_.find(id);
  return version ? Json(version->text) : Json();
}

// --- Requests ---

Reply Session::post(const std::string& what, const nlohmann::json& request, const std::string& tab) {
  static const std::map<std::string, Handler> handlers = {
      {"edit", &Session::edit},     {"text", &Session::text}, {"undo", &Session::undo},
      {"redo", &Session::redo},     {"view", &Session::view}, {"restore", &Session::restore},
      {"pin", &Session::pin},       {"pick", &Session::pick}, {"save", &Session::save},
      {"reload", &Session::reload}, {"keep", &Session::keep}, {"sweep", &Session::sweep}};
  if (what == "write") return tabs_.take_over(tab) ? Reply{} : refused(409, "this tab is not connected");
  const auto handler = handlers.find(what);
  if (handler == handlers.end()) return refused(404, "there is no " + what);
  if (what != "pick" && tabs_.writer() != tab)
    return refused(423, "another tab is editing this scene; take over to edit it here");
  std::optional<engine::Engine::Hold> hold;
  if (what != "pick" && what != "save" && what != "view") hold.emplace(*engine_);
  try {
    return (this->*handler->second)(request);
  } catch (const nlohmann::json::exception& error) {
    return refused(400, std::string("the request is not valid: ") + error.what());
  } catch (const std::invalid_argument& error) {
    return refused(422, error.what());
  } catch (const SceneError& error) {
    return refused(422, error.what());
  } catch (const render::FileError& error) {
    return refused(500, error.what());
  }
}

Reply Session::edit(const nlohmann::json& request) {
  const std::lock_guard lock(mutex_);
  std::string text = document_.text();
  for (const nlohmann::json& op : request.at("ops")) text = changed_by(text, op);
  document_.change(std::move(text), request.value("label", "edit"), strings_in(request, "paths"),
                   request.value("group", ""));
  return shown();
}

Reply Session::text(const nlohmann::json& request) {
  const std::lock_guard lock(mutex_);
  if (request.contains("base") && request["base"].get<uint64_t>() != document_.version().id)
    return {409, document()};
  document_.change(request.at("text").get<std::string>(), request.value("label", "text"), {},
                   request.value("group", ""));
  return shown();
}

Reply Session::undo(const nlohmann::json&) {
  const std::lock_guard lock(mutex_);
  return document_.undo() ? shown() : Reply{200, document()};
}

Reply Session::redo(const nlohmann::json&) {
  const std::lock_guard lock(mutex_);
  return document_.redo() ? shown() : Reply{200, document()};
}

Reply Session::restore(const nlohmann::json& request) {
  const std::lock_guard lock(mutex_);
  const Version* version = document_.find(request.at("id").get<uint64_t>());
  if (!version) return refused(404, "this version of the scene is no longer in memory");
  document_.change(version->text, fmt::format("go back to version {}", version->id), {}, "");
  return shown();
}

/// Handles changes that are never an undo step: of the frame, the camera, the overlays, and the muted
/// objects.
Reply Session::view(const nlohmann::json& request) {
  const std::lock_guard lock(mutex_);
  bool changed = false;
  if (request.contains("frame"))
    engine_->look_at(request["frame"].get<int>(), request.value("playing", false));
  if (request.contains("camera")) {
    std::optional<engine::ViewCamera> camera;
    if (!request["camera"].is_null())
      camera = engine::ViewCamera{vector_of(request["camera"].at("eye")),
                                  vector_of(request["camera"].at("target"))};
    if (camera && !((camera->eye - camera->target).norm() > 1e-6))
      return refused(422, "the camera's eye and target must differ");
    changed |= camera != camera_;
    camera_ = camera;
  }
  if (request.contains("overlays")) {
    const Json overlays = Json::parse(request["overlays"].dump());
    changed |= overlays != overlays_;
    overlays_ = overlays;
  }
  if (request.contains("muted")) {
    const auto muted = request["muted"].get<std::set<std::string>>();
    changed |= muted != muted_;
    muted_ = muted;
  }
  if (changed) return shown();
  return {};
}

Reply Session::pin(const nlohmann::json& request) {
  const std::lock_guard lock(mutex_);
  pinned_ = nullptr;
  engine::Engine::Loaded loaded;
  if (request.contains("id") && !request["id"].is_null()) {
    const Version* version = document_.find(request["id"].get<uint64_t>());
    if (!version) return refused(404, "this version of the scene is no longer in memory");
    loaded = parse(version->text, true).loaded;
    if (!loaded) return refused(422, "this version is not a valid scene");
    pinned_ = version_json(*version, films_);
    pinned_["film"] = engine_->film_of(*loaded);
    pinned_["frames"] = loaded->scene.frame_count();
  }
  engine_->pin(loaded);
  post_document();
  return {200, document()};
}

Reply Session::pick(const nlohmann::json& request) {
  std::future<std::string> name = engine_->pick(request.at("frame").get<int>(), request.at("x").get<double>(),
                                                request.at("y").get<double>());
  constexpr std::chrono::seconds kLongest{10};
  if (name.wait_for(kLongest) != std::future_status::ready) return refused(503, "the frame is not ready");
  return {200, {{"name", name.get()}}};
}

Reply Session::save(const nlohmann::json&) {
  const std::lock_guard lock(mutex_);
  try {
    document_.save();
  } catch (const FileConflict& conflict) {
    theirs_ = conflict.theirs;
    post_document();
    return {409, document()};
  }
  theirs_.reset();
  post_document();
  return {200, document()};
}

Reply Session::reload(const nlohmann::json&) {
  const std::lock_guard lock(mutex_);
  document_.reload(document_.changed_outside().value_or(document_.saved()));
  theirs_.reset();
  return shown();
}

Reply Session::keep(const nlohmann::json&) {
  const std::lock_guard lock(mutex_);
  document_.keep_own(document_.changed_outside().value_or(document_.saved()));
  theirs_.reset();
  post_document();
  return {200, document()};
}

Reply Session::sweep(const nlohmann::json& request) {
  const std::lock_guard lock(mutex_);
  constexpr std::size_t kMostCells = 36;
  const std::vector<std::string> paths = strings_in(request, "paths"), values = strings_in(request, "values");
  if (values.size() > kMostCells) return refused(422, fmt::format("at most {} values", kMostCells));
  std::vector<engine::Engine::Loaded> loaded;
  for (const std::string& value : values) {
    std::string text = document_.text();
    for (const std::string& path : paths) text = set_value(text, path, value);
    loaded.push_back(parse(text, true).loaded);
  }
  return {200, {{"sweep", engine_->sweep(std::move(loaded), request.value("frame", 1))}}};
}

// --- From the engine and the disk ---

void Session::on_event(const engine::EngineEvent& event) {
  if (const auto* film = std::get_if<engine::FilmEvent>(&event)) {
    const std::lock_guard lock(events_mutex_);
    latest_film_ = event_json(*film);
  }
  std::visit(
      [this](const auto& e) {
        Json json = event_json(e);
        // A tab that was too slow for the message of a frame gets its data with the next one.
        if constexpr (std::is_same_v<std::decay_t<decltype(e)>, engine::FrameEvent>)
          json["ranges"] = ranges_json(engine_->ranges(e.film));
        tabs_.post(kind_of(e), dump(json));
      },
      event);
}

void Session::watch_files() {
  const auto files = [&] { return producer::files_of_scene(document_.file(), {}); };
  const auto others = [&](std::set<fs::path> all) {
    all.erase(document_.file().lexically_normal());
    return producer::contents_hash(all);
  };
  std::string hash = others(files());
  while (!closing_) {
    producer::FileWatch watch(files());
    // This also detects a change after the file was read and before the watch began.
    files_changed(hash, hash);
    while (!closing_ && !watch.changed()) watch.wait(milliseconds(250));
    if (closing_) return;
    watch.settle(milliseconds(60));
    const std::string now = others(files());
    files_changed(hash, now);
    hash = now;
  }
}

void Session::files_changed(const std::string& hash_before, const std::string& hash_now) {
  const std::lock_guard lock(mutex_);
  const std::optional<std::string> theirs = document_.changed_outside();
  const bool models = hash_before != hash_now;
  if (models) {
    engine_->forget_models();
    shown_ = nullptr;
  }
  if (theirs && document_.is_saved()) {
    document_.reload(*theirs);
    show();
    post_document();
    tabs_.post("note", dump({{"text", "Another program changed the file. The page has loaded it."}}));
    return;
  }
  if (!theirs && !theirs_ && !models) return;
  theirs_ = theirs && *theirs != document_.text() ? theirs : std::nullopt;
  if (theirs && !theirs_) document_.keep_own(*theirs);
  if (models) show();
  post_document();
}

}  // namespace offstage::tune
