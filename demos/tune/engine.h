#pragma once
/// Scene in, frames and figures out. One thread simulates and draws; what is asked of it meanwhile takes
/// effect within one frame. The latest version of the scene is all that counts: an older run ends where it
/// is, and what it made stays in memory of a stated size.

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

#include "producer/build/decomposition_cache.h"
#include "tune/film_run.h"
#include "tune/frame_store.h"

namespace offstage::tune {

/// A frame can be had from the store. Frame 0 is a glimpse of the time before frame 1.
struct FrameEvent {
  uint64_t run = 0;
  std::string film;
  int frame = 0;
  double time = 0;  ///< of the film [s]
  Detail detail = Detail::draft;
  double draw_ms = 0;
  std::optional<producer::FrameFigures> figures;
  render::Camera camera;
};
/// How far the film is.
struct FilmEvent {
  enum class Phase { loading, lead_in, running, complete, failed };
  uint64_t run = 0;
  std::string film;
  Phase phase = Phase::loading;
  double lead_in = 0;      ///< share of the time before frame 1 that is simulated
  int simulated = 0;       ///< frames
  std::string message;     ///< why it failed, or what is loaded
  std::string statistics;  ///< JSON, when the simulation is complete
  std::vector<std::string> notes;
};
/// A picture of a sweep is done.
struct CellEvent {
  uint64_t sweep = 0;
  int index = 0;
  std::string fault;  ///< why there is none; empty: there is one
  uint64_t particles = 0;
};
using EngineEvent = std::variant<FrameEvent, FilmEvent, CellEvent>;

struct EngineSettings {
  Eigen::Vector2i draft_px = {640, 360};
  std::size_t frame_bytes = 192u << 20;    ///< of compressed pictures
  std::size_t physics_bytes = 384u << 20;  ///< of states
  producer::DecompositionCache decompositions;
};

class Engine {
 public:
  using OnEvent = std::function<void(const EngineEvent&)>;
  using Loaded = std::shared_ptr<const producer::LoadedScene>;

  /// `on_event` is called on the engine's thread; of the engine it may call `frame` and `ranges` alone.
  Engine(EngineSettings settings, OnEvent on_event);
  /// Ends the run within one frame.
  ~Engine();
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  struct Run {
    uint64_t number = 0;
    std::string film;
  };
  /// While one of these lives, the engine begins nothing new and leaves the processors to what is about to
  /// give it an order: between the arrival of a change and show() every piece of work would be for nothing.
  class Hold {
   public:
    explicit Hold(Engine& engine) : engine_(engine) { ++engine_.holds_; }
    ~Hold();
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;

   private:
    Engine& engine_;
  };

  /// Shows this version from now on. The number rises with every call.
  Run show(Loaded scene, const std::optional<ViewCamera>& camera);
  /// The key of a version's pictures by the scene's own camera.
  std::string film_of(const producer::LoadedScene& scene) const;
  /// A second version whose frames are kept and, when there is nothing else to do, completed; null: none.
  void pin(Loaded scene);
  /// Which frame is looked at. It is drawn first, and well when nothing else changes and nothing plays.
  void look_at(int frame, bool playing);
  /// Model files have changed: they are read again.
  void forget_models();
  /// The name of what is seen at a place of a frame; see FilmRun::pick. Empty also if the frame is not there.
  std::future<std::string> pick(int frame, double x, double y);
  /// Draws a frame of each of these versions small; ends an earlier sweep. Returns its number.
  uint64_t sweep(std::vector<Loaded> versions, int frame);
  void stop_sweep() { sweep({}, 1); }

  std::optional<StoredFrame> frame(const std::string& film, int number, Detail most = Detail::final) {
    return frames_.get(film, number, most);
  }
  std::shared_ptr<const std::string> cell(uint64_t sweep, int index) const;
  std::vector<std::pair<int, int>> ranges(const std::string& film) const { return frames_.ranges(film); }
  /// Figures of the frames that are simulated so far of the current version.
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
  void work_with(const Workshop& workshop);
  bool step(const Workshop& workshop);
  bool take_orders(const Workshop& workshop);
  void start_film(const Workshop& workshop);
  bool answer_picks();
  bool advance_film();
  bool refine_frame();
  bool is_film_drawn();
  bool advance_pinned(const Workshop& workshop);
  bool advance_sweep(const Workshop& workshop);
  std::shared_ptr<const producer::ModelLibrary> models_for(const FilmDef& def);
  void report_frame(int frame, Detail detail);
  void report_film(FilmEvent::Phase phase, const std::string& message = "");
  void fail(const std::string& what);
  bool is_stale() const { return ending_ || holds_ > 0 || ordered_ != taken_; }

  const EngineSettings settings_;
  const OnEvent on_event_;
  FrameStore frames_;
  PhysicsStore physics_;

  mutable std::mutex mutex_;  // of what follows, up to the thread's own
  std::condition_variable woken_;
  std::atomic<uint64_t> ordered_ = 0;  // rises with every order that the thread has to look at
  std::atomic<bool> ending_ = false;
  std::atomic<int> holds_ = 0;
  uint64_t runs_ = 0, sweeps_ = 0, models_generation_ = 0;
  std::optional<FilmDef> wanted_, wanted_pinned_;
  bool pinned_changed_ = false;
  int frame_ = 1;
  bool playing_ = false;
  Clock::time_point changed_ = Clock::now();  // the version or the frame that is looked at
  std::deque<Pick> picks_;
  Sweep sweep_;
  std::shared_ptr<const Physics> shown_physics_;
  std::vector<producer::FrameFigures> figures_;

  // Of the thread alone.
  uint64_t taken_ = 0, run_ = 0;
  std::optional<FilmDef> def_;
  std::unique_ptr<FilmRun> film_, pinned_;
  std::string models_key_;
  std::shared_ptr<const producer::ModelLibrary> models_;
  Clock::time_point lead_in_shown_{};
  bool failed_ = false, complete_reported_ = false;

  std::thread thread_;  // last
};

}  // namespace offstage::tune
