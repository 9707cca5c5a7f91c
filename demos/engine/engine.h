#pragma once
/// Computes frames and figures of a scene. One thread simulates and draws; requests take effect within one
/// frame. Only the latest version of the scene counts: an older run ends at once, and its results stay in
/// memory of a bounded size.

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <mutex>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "engine/film_run.h"
#include "engine/frame_store.h"
#include "producer/build/decomposition_cache.h"

namespace offstage::engine {

/// A frame is available in the store. Frame 0 is a picture of the time before frame 1.
struct FrameEvent {
  uint64_t run = 0;
  std::string film;
  int frame = 0;
  double time = 0;  ///< time of the film [s]
  Detail detail = Detail::draft;
  double draw_ms = 0;
  std::optional<producer::FrameFigures> figures;
  render::Camera camera;
};
/// Progress of the film.
struct FilmEvent {
  enum class Phase { loading, lead_in, running, complete, failed };
  uint64_t run = 0;
  std::string film;
  Phase phase = Phase::loading;
  double lead_in = 0;      ///< simulated fraction of the time before frame 1
  int simulated = 0;       ///< number of frames
  std::string message;     ///< reason of a failure, or the file being loaded
  std::string statistics;  ///< JSON, after the simulation is complete
  std::vector<std::string> notes;
};
/// A picture of a sweep is finished.
struct CellEvent {
  uint64_t sweep = 0;
  int index = 0;
  std::string fault;  ///< reason if there is no picture; otherwise empty
  uint64_t particles = 0;
};
using EngineEvent = std::variant<FrameEvent, FilmEvent, CellEvent>;

struct EngineSettings {
  Eigen::Vector2i draft_px = {640, 360};
  std::size_t frame_bytes = 192u << 20;       ///< limit for compressed pictures
  std::size_t physics_bytes = kPhysicsBytes;  ///< limit for states
  producer::DecompositionCache decompositions;
};

class Engine {
 public:
  using OnEvent = std::function<void(const EngineEvent&)>;
  using Loaded = std::shared_ptr<const producer::LoadedScene>;

  /// `on_event` is called on the engine's thread; it may only call `frame` and `ranges` of the engine.
  Engine(EngineSettings settings, OnEvent on_event);
  /// Ends the run within one frame.
  ~Engine();
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  struct Run {
    uint64_t number = 0;
    std::string film;
  };
  /// While a Hold exists, the engine begins no new work and aborts drafts in progress. The processors are
  /// then free for the next request: work done between the arrival of a change and show() would be useless.
  class Hold {
   public:
    explicit Hold(Engine& engine) : engine_(engine) { ++engine_.holds_; }
    ~Hold();
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;

   private:
    Engine& engine_;
  };

  /// Shows this version from now on. Returns a number that increases with every call.
  Run show(Loaded scene, const std::optional<ViewCamera>& camera);
  /// Key under which the store has the pictures of a version that are drawn with the scene's own camera.
  std::string film_of(const producer::LoadedScene& scene) const;
  /// Sets a second version whose frames are kept and, in idle time, completed; null: none.
  void pin(Loaded scene);
  /// Sets the frame that the user sees. It is drawn first, and refined when nothing changes or plays.
  void look_at(int frame, bool playing);
  /// Reads model files again after they have changed.
  void forget_models();
  /// Name of the object that is visible at a position of a frame, as FilmRun::pick() returns it; empty also
  /// if the frame is not available.
  std::future<std::string> pick(int frame, double x, double y);
  /// Draws a small frame of each of these versions; ends an earlier sweep. Returns its number.
  uint64_t sweep(std::vector<Loaded> versions, int frame);
  void stop_sweep() { sweep({}, 1); }

  std::optional<StoredFrame> frame(const std::string& film, int number, Detail most = Detail::final) {
    return frames_.get(film, number, most);
  }
  std::shared_ptr<const std::string> cell(uint64_t sweep, int index) const;
  std::vector<std::pair<int, int>> ranges(const std::string& film) const { return frames_.ranges(film); }
  /// Figures of the simulated frames of the current version.
  std::vector<producer::FrameFigures> figures() const;
  std::size_t bytes() const { return frames_.bytes(); }
  std::size_t most_bytes() const { return frames_.most_bytes(); }

 private:
  struct Pick {
    int frame;
    double x, y;
    std::promise<std::string> name;
  };
  struct Sweep {
    uint64_t number = 0;
    std::vector<Loaded> versions;
    int frame = 1;
    std::size_t next = 0;
    std::vector<std::shared_ptr<const std::string>> pictures;
  };
  using Clock = std::chrono::steady_clock;

  FilmDef definition(Loaded scene, const std::optional<ViewCamera>& camera) const;
  void work();
  void work_with(const FilmResources& resources);
  bool step(const FilmResources& resources);
  bool take_requests(const FilmResources& resources);
  void start_film(const FilmResources& resources);
  bool answer_picks();
  bool advance_film();
  bool refine_frame();
  bool is_film_drawn();
  bool advance_pinned(const FilmResources& resources);
  bool advance_sweep(const FilmResources& resources);
  std::shared_ptr<const producer::ModelLibrary> models_for(const FilmDef& def);
  void report_frame(int frame, Detail detail);
  void report_film(FilmEvent::Phase phase, const std::string& message = "");
  void fail(const std::string& what);
  /// Whether there is a request of any kind.
  bool is_stale() const { return ending_ || holds_ > 0 || requested_ != taken_; }
  /// Whether there is, or soon will be, another version or camera. Other requests, such as the frames of a
  /// film that plays, let a draft finish first.
  bool is_outdated() const { return ending_ || holds_ > 0 || runs_ != run_; }

  const EngineSettings settings_;
  const OnEvent on_event_;
  FrameStore frames_;
  PhysicsStore physics_;

  mutable std::mutex mutex_;  // for the members below, up to those of the thread
  std::condition_variable woken_;
  std::atomic<uint64_t> requested_ = 0;  // increases with every request to the thread
  std::atomic<bool> ending_ = false;
  std::atomic<int> holds_ = 0;
  std::atomic<uint64_t> runs_ = 0;  // number of the latest run
  uint64_t sweeps_ = 0, models_generation_ = 0;
  std::optional<FilmDef> wanted_, wanted_pinned_;
  bool pinned_changed_ = false;
  int frame_ = 1;
  bool playing_ = false;
  Clock::time_point changed_ = Clock::now();  // last change of the version or of the visible frame
  std::deque<Pick> picks_;
  Sweep sweep_;
  std::shared_ptr<const Physics> shown_physics_;
  std::vector<producer::FrameFigures> figures_;

  // Used only by the thread.
  uint64_t taken_ = 0, run_ = 0;
  std::optional<FilmDef> def_;
  std::unique_ptr<FilmRun> film_, pinned_;
  std::string models_key_;
  std::shared_ptr<const producer::ModelLibrary> models_;
  Clock::time_point lead_in_shown_{};
  bool failed_ = false, complete_reported_ = false;

  std::thread thread_;  // last, so that it ends first
};

}  // namespace offstage::engine
