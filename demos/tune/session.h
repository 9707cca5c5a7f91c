#pragma once
/// A tuning session: one scene file, its text, the engine that computes the frames, and the connected browser
/// tabs. The interface uses JSON and is independent of HTTP.

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "engine/engine.h"
#include "producer/base/error.h"
#include "tune/document.h"
#include "tune/tabs.h"

namespace offstage::tune {

/// Reply to a request: an HTTP status and a JSON object.
struct Reply {
  int status = 200;
  nlohmann::ordered_json body = nlohmann::ordered_json::object();
};

class Session {
 public:
  using Json = nlohmann::ordered_json;

  /// Reads the scene from `file`. Throws SceneError if the file cannot be read. If its text is not a valid
  /// scene, the session starts and reports the errors. The scene may refer to files in its own folder and in
  /// the `allowed` folders.
  Session(const std::string& file, engine::EngineSettings settings, std::vector<std::string> allowed = {});
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Returns the complete state of the session, for a new tab.
  Json state();
  Json figures() const;
  Json versions();
  /// Returns the text of a version; null if there is no such version or it was removed.
  Json version_text(uint64_t id);
  /// Handles a request of a tab. `what` is the last part of the address, such as "edit". Only the writer (see
  /// Tabs) may change the scene; a change by another tab is refused with status 423. Errors are reported by
  /// the status of the reply.
  Reply post(const std::string& what, const nlohmann::json& request, const std::string& tab);

  Tabs& tabs() { return tabs_; }
  engine::Engine& engine() { return *engine_; }
  /// Ends the event streams of all tabs and stops watching the scene's files.
  void close();

 private:
  struct Parsed {
    engine::Engine::Loaded loaded;
    std::vector<Problem> errors;
  };
  using Handler = Reply (Session::*)(const nlohmann::json&);

  Reply edit(const nlohmann::json& request);
  Reply text(const nlohmann::json& request);
  Reply undo(const nlohmann::json& request);
  Reply redo(const nlohmann::json& request);
  Reply restore(const nlohmann::json& request);
  Reply view(const nlohmann::json& request);
  Reply pin(const nlohmann::json& request);
  Reply pick(const nlohmann::json& request);
  Reply save(const nlohmann::json& request);
  Reply reload(const nlohmann::json& request);
  Reply keep(const nlohmann::json& request);
  Reply sweep(const nlohmann::json& request);

  Parsed parse(const std::string& text, bool with_view) const;
  std::vector<std::string> muted_paths(const std::string& text) const;
  void show();
  Reply shown();
  Json document() const;
  void post_document();
  void on_event(const engine::EngineEvent& event);
  void watch_files();
  void files_changed(const std::string& hash_before, const std::string& hash_now);

  mutable std::mutex mutex_;
  std::vector<std::string> allowed_;  // folders in addition to the scene's own
  Document document_;
  Tabs tabs_;
  engine::Engine::Loaded shown_;  // the latest valid version
  std::vector<Problem> errors_, warnings_;
  uint64_t revision_ = 0;  // increases with every change of the document that is sent to the tabs
  engine::Engine::Run run_;
  std::map<uint64_t, std::string> films_;  // key of the film of each version, by the version's id
  std::optional<engine::ViewCamera> camera_;
  Json overlays_ = Json::array();
  std::set<std::string> muted_;
  Json pinned_;
  std::optional<std::string> theirs_;  // content of the file after a change by another program
  mutable std::mutex events_mutex_;
  Json latest_film_;  // latest progress, for new tabs
  std::unique_ptr<engine::Engine> engine_;
  std::atomic<bool> closing_ = false;
  std::thread watcher_;  // the last member, so that the thread ends first
};

}  // namespace offstage::tune
