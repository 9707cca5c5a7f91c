#pragma once
/// The engine computes the frames and the statistics of a scene while the scene is edited. One thread
/// simulates and draws; a request takes effect within one frame. A new version of the scene ends the work on
/// the previous version. Finished frames and states of older versions stay in stores of a bounded size.

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

/// Event: a frame was drawn and is in the store. Frame 0 shows the scene during the simulated time before
/// frame 1.
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
/// Event: the progress of the film has changed.

struct FilmEvent {
  enum class Phase { loading, lead_in, running, complete, failed };
  uint64_t run = 0;
  std::string film;
  Phase phase = Phase::loading;
  double lead_in = 0;      ///< finished fraction of the simulation before frame 1, 0 to 1
  int simulated = 0;       ///< number of simulated frames
  std::string message;     ///< reason for a failure, or name of the file that is being loaded
  std::string statistics;  ///< statistics of the run as JSON; empty until the simulation is complete
  std::vector<std::string> notes;
};
/// Event: a picture of a sweep is finished or has failed.
struct CellEvent {
  uint64_t sweep = 0;
  int index = 0;
  std::string fault;  ///< reason why there is no picture; empty if there is one
  uint64_t particles = 0;
};
using EngineEvent = std::variant<FrameEvent, FilmEvent, CellEvent>;

struct EngineSettings {
  Eigen::Vector2i draft_px = {640, 360};
  std::size_t frame_bytes = 192u << 20;       ///< limit of the memory for compressed pictures [bytes]
  std::size_t physics_bytes = kPhysicsBytes;  ///< limit of the memory for states [bytes]
  producer::DecompositionCache decompositions;
};

class Engine {
 public:
  using OnEvent = std::function<void(const EngineEvent&)>;
  using Loaded = std::shared_ptr<const producer::LoadedScene>;

  /// Starts the engine's thread. `on_event` is called on this thread; the only functions of the engine that
  /// it may call are frame() and ranges().
  Engine(EngineSettings settings, OnEvent on_event);
  /// Ends the run within one frame.
  ~Engine();
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  struct Run {
    uint64_t number = 0;
    std::string film;
  };
  /// While a Hold exists, the engine begins no new work and aborts drafts in progress. Work between the
  /// arrival of a change and the call of show() would be useless, and would slow down the preparation of the
  /// new version.
  class Hold {
   public:
    explicit Hold(Engine& engine) : engine_(engine) { ++engine_.holds_; }
    ~Hold();
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;

   private:
    Engine& engine_;
  };

  /// Makes this version the current one; `camera`, if set, replaces the scene's camera. Returns the key of
  /// its film and a number that increases with every call.
  Run show(Loaded scene, const std::optional<ViewCamera>& camera);
  /// Returns the key of a version's pictures in the store, for pictures with the scene's own camera.
  std::string film_of(const producer::LoadedScene& scene) const;
  /// Sets a second version, for comparison with the current one. Its frames are removed from the store last,
  /// and missing frames are drawn in idle time. Null removes it.
  void pin(Loaded scene);
  /// Sets the frame that the user sees. This frame is drawn first. It is refined when there are no changes
  /// for a while and the film is not playing.
  void look_at(int frame, bool playing);
  /// Must be called when model files have changed. Versions that are shown later read them again.
  void forget_models();
  /// Returns the name of the object that is visible at a position of a frame; see FilmRun::pick(). The name
  /// is empty if there is no object or the frame has no state yet.
  std::future<std::string> pick(int frame, double x, double y);
  /// Starts a sweep: one small picture of `frame` for each of these versions. It replaces an earlier sweep. A
  /// null version gets a CellEvent with a fault. Returns the number of the sweep.
  uint64_t sweep(std::vector<Loaded> versions, int frame);
  void stop_sweep() { sweep({}, 1); }

  std::optional<StoredFrame> frame(const std::string& film, int number, Detail most = Detail::final) {
    return frames_.get(film, number, most);
  }
  std::shared_ptr<const std::string> cell(uint64_t sweep, int index) const;
  std::vector<std::pair<int, int>> ranges(const std::string& film) const { return frames_.ranges(film); }
  /// Returns the statistics of each frame of the current version that is simulated so far.
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
  /// Returns whether there is an unprocessed request of any kind.
  bool is_stale() const { return ending_ || holds_ > 0 || requested_ != taken_; }
  /// Returns whether another version or camera was requested, or is about to be (see Hold). Other requests,
  /// such as the next frame of a playing film, do not abort a draft.
  bool is_outdated() const { return ending_ || holds_ > 0 || runs_ != run_; }

  const EngineSettings settings_;
  const OnEvent on_event_;
  FrameStore frames_;
  PhysicsStore physics_;

  mutable std::mutex mutex_;  // protects the members below, up to those that only the thread uses
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

  std::thread thread_;  // the last member, so that the thread ends first
};

}  // namespace offstage::engine
