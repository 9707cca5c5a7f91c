#pragma once
/// The frame loop. The simulation (or a cache), several drawing threads with a GL context each, and the sink
/// run concurrently. Bounded queues connect them. The output does not depend on the number of drawing
/// threads.

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "producer/build/models.h"
#include "producer/build/simulation.h"
#include "producer/build/snapshot.h"
#include "producer/format/scene_io.h"
#include "producer/run/state_source.h"
#include "render/channels.h"
#include "render/sink.h"

namespace offstage::producer {

/// Durations of one stage of the pipeline over the frames of a run [ms].
class StageTimes {
 public:
  void add(double ms) { ms_.push_back(ms); }
  struct Summary {
    double mean = 0, p50 = 0, p95 = 0, max = 0;
  };
  Summary summary() const;

 private:
  std::vector<double> ms_;
};

/// Figures of one frame, for a report.
struct FrameFigures {
  int frame = 0;
  double time = 0;  ///< time of the film [s]
  double sim_ms = 0, render_ms = 0, encode_ms = 0;
  uint64_t particles = 0;
  std::size_t contacts = 0;           ///< contacts of bodies; 0 with a cache
  std::optional<sim::Energy> energy;  ///< energy of the state; empty with a cache
  std::string state_hash, pixel_hash;
};

/// Results of a run. The command line prints them as a JSON object.
struct RunStats {
  int frames = 0;       ///< number of frames that this run wrote
  int frames_kept = 0;  ///< number of existing frames that were kept (--resume)
  double wall_s = 0;
  double startup_s = 0;  ///< time from the start of the process to the first written frame
  StageTimes sim, render, encode;
  std::size_t bodies = 0;
  uint64_t particles = 0;  ///< number of particles at the end
  uint64_t most_particles = 0;
  SimulationTotals totals;
  render::LightSums light;
  /// Energy at the start and at the end; empty with a cache.
  std::optional<sim::Energy> energy_start, energy_end;
  std::string state_hash;                   ///< hash of the state after the last frame
  std::map<int, std::string> frame_states;  ///< state hash of every drawn frame
  /// Figures of each frame, only if the job requests them.
  std::vector<FrameFigures> figures;
  std::vector<std::pair<int, render::Image>> pictures;  ///< thumbnails of about a dozen frames
  std::vector<int> blank_frames;  ///< frames with only one colour, which are probably wrong
  int interrupted_by = 0;         ///< number of the signal, or 0
};

/// Returns the results as one JSON object.
std::string to_json(const RunStats& stats);

/// Progress of a run. It is reported after every simulated and every finished frame, by one thread at a time.
struct Progress {
  int done = 0, total = 0;  ///< finished frames
  /// Times for simulating, drawing and encoding the latest finished frame.
  double sim_ms = 0, render_ms = 0, encode_ms = 0;
  uint64_t particles = 0;  ///< number of particles in that frame
  double eta_s = 0;        ///< remaining time [s]; 0: not known yet
  double fraction = 0;     ///< fraction of the whole work that is done, 0 .. 1
  /// Numbers of simulated frames and of frames to simulate. They include frames that are simulated but not
  /// drawn. Both are 0 if nothing is simulated.
  int frames_simulated = 0, frames_to_simulate = 0;
  /// Whether the progress is reported for a finished frame; false: for a simulated one.
  bool frame_finished = true;
  /// Time spent so far. The time of drawing includes encoding, and is summed over all threads.
  double simulating_s = 0, drawing_s = 0;
  /// Whether `eta_s` does not extrapolate the first frames, which take longer (see TimeLeft).
  bool is_steady = false;
};
using ProgressCallback = std::function<void(const Progress&)>;

struct RenderJob {
  std::vector<int> frames;                     ///< frames to draw, ascending
  int threads = 1;                             ///< number of drawing threads, each with a context of its own
  std::optional<std::filesystem::path> cache;  ///< folder from which states are read instead of simulating
  StateSource* states = nullptr;  ///< source of the states if there is no `cache`; null: the simulation
  /// Folder to which the drawn states are written, in the format of `cache`.
  std::optional<std::filesystem::path> keep;
  /// Limit on the size of `keep` [bytes]. If the states exceed the limit or cannot be written, they are
  /// discarded and the run continues. Empty: no limit, and a write error ends the run.
  std::optional<uint64_t> keep_at_most;
  bool report = false;             ///< whether figures and pictures are stored
  render::ChannelChoice channels;  ///< channels to write
  /// Stem of the channel files; '#' stands for the frame number, as in render::frame_path.
  std::filesystem::path channels_stem;
  /// Returns whether to stop the run. Once it returns true, the run ends within one frame with
  /// render::StoppedError and without output. Several threads call this function. Empty: the run is never
  /// stopped.
  std::function<bool()> stop = {};
};

/// Draws the frames, writes them to the sink, and closes the sink. After a signal it finishes the frames in
/// progress, closes the sink, and sets RunStats::interrupted_by. Rethrows exceptions of the simulation, the
/// drawing and the sink; in this case, no partial output is left.
RunStats render_frames(const LoadedScene& loaded, const ModelLibrary& models, const RenderJob& job,
                       render::FrameSink& sink, const ProgressCallback& progress);

struct SimulateJob {
  std::optional<std::filesystem::path> cache;      ///< folder to which a snapshot of each frame is written
  bool force = false;                              ///< whether an existing cache is replaced
  std::optional<std::filesystem::path> trace;      ///< CSV of every moving body and placed particle
  std::optional<std::filesystem::path> contacts;   ///< CSV of the contact points of bodies
  std::optional<std::filesystem::path> cloths;     ///< CSV of strain, contacts and volume of cloths
  std::optional<std::filesystem::path> joints;     ///< CSV of the loads and states of joints
  std::optional<std::filesystem::path> particles;  ///< table of all particles; see particle_table.h
  std::optional<std::filesystem::path> cloth_points = {};  ///< CSV of the vertices of cloths
  bool trace_every_step = false;  ///< whether rows are written for every sub-step; otherwise for every frame
};

/// Simulates all frames without drawing them, and writes the requested files.
RunStats simulate_frames(const LoadedScene& loaded, const ModelLibrary& models, const SimulateJob& job,
                         const ProgressCallback& progress);

struct SnapshotJob {
  std::vector<int> frames;                     ///< frames to visit, ascending
  std::optional<std::filesystem::path> cache;  ///< folder from which states are read instead of simulating
};

/// Calls `take` with the state of each frame, in order, on the calling thread. After a signal it stops
/// between two frames and sets RunStats::interrupted_by. Rethrows exceptions of the simulation, the cache and
/// `take`.
RunStats visit_frames(const LoadedScene& loaded, const ModelLibrary& models, const SnapshotJob& job,
                      const std::function<void(const Snapshot&)>& take, const ProgressCallback& progress);

/// Returns a hash of everything on which a cache of snapshots depends: the version of offstage, the models,
/// and the scene without cameras, lights, environment, looks of materials and settings of the picture.
std::string simulation_key(const LoadedScene& loaded, const ModelLibrary& models);
/// Returns a hash of everything on which the pixels of a frame depend.
std::string settings_key(const LoadedScene& loaded, const ModelLibrary& models);

/// Returns the time since the process started [s].
double process_age_s();
/// Returns the greatest amount of memory that this process has used so far (its resident set) [MB].
double peak_rss_mb();

}  // namespace offstage::producer
