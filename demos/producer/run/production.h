#pragma once
/// The frame loop: the simulation (or a cache), several drawing threads with a GL context each, and the sink
/// run concurrently, connected by bounded queues. The output does not depend on the number of drawing
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
  int frames = 0;       ///< written by this run
  int frames_kept = 0;  ///< existing frames that were kept (resume)
  double wall_s = 0;
  double startup_s = 0;  ///< time from the start of the process to the first written frame
  StageTimes sim, render, encode;
  std::size_t bodies = 0;
  uint64_t particles = 0;  ///< number at the end
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
  std::vector<int> blank_frames;                        ///< all pixels equal: something is probably wrong
  int interrupted_by = 0;                               ///< number of the signal, or 0
};

/// One JSON object.
std::string to_json(const RunStats& stats);

/// Progress of a run. Reported after every simulated and every finished frame, by one thread at a time.
struct Progress {
  int done = 0, total = 0;  ///< finished frames
  /// Times of simulating, drawing and encoding the latest finished frame.
  double sim_ms = 0, render_ms = 0, encode_ms = 0;
  uint64_t particles = 0;  ///< number of particles in that frame
  double eta_s = 0;        ///< remaining time [s]; 0: not known yet
  double fraction = 0;     ///< fraction of the work of simulation and drawing, 0 .. 1
  /// Frames of the simulation, including those that the film skips; both 0 without a simulation.
  int frames_simulated = 0, frames_to_simulate = 0;
  bool frame_finished = true;  ///< false: reported for a simulated frame
  /// Time spent so far; drawing includes encoding and is the sum over all threads.
  double simulating_s = 0, drawing_s = 0;
};
using ProgressCallback = std::function<void(const Progress&)>;

struct RenderJob {
  std::vector<int> frames;                     ///< frames to draw, ascending
  int threads = 1;                             ///< number of drawing threads, each with a context of its own
  std::optional<std::filesystem::path> cache;  ///< folder of states that replace the simulation
  StateSource* states = nullptr;               ///< replaces the simulation if there is no `cache`
  /// Folder to which the drawn states are written, in the format of `cache`.
  std::optional<std::filesystem::path> keep;
  /// Limit on the size of `keep` [bytes]. Beyond it, or on a write error, the states are discarded and the
  /// run continues. Empty: no limit, and a write error ends the run.
  std::optional<uint64_t> keep_at_most;
  bool report = false;             ///< whether figures and pictures are stored
  render::ChannelChoice channels;  ///< channels to write
  /// Stem of the channel files; '#' stands for the frame number, as in render::frame_path.
  std::filesystem::path channels_stem;
  /// Whether to stop. After it has returned true, the run ends within one frame with render::StoppedError and
  /// without output. Several threads call it. Empty: the run is never stopped.
  std::function<bool()> stop = {};
};

/// Draws the frames into the sink and closes it. After an interrupt it finishes the frames in progress,
/// closes the sink, and sets RunStats::interrupted_by. Passes on exceptions of the parts; no partial output
/// is left then.
RunStats render_frames(const LoadedScene& loaded, const ModelLibrary& models, const RenderJob& job,
                       render::FrameSink& sink, const ProgressCallback& progress);

struct SimulateJob {
  std::optional<std::filesystem::path> cache;  ///< write a snapshot per frame
  bool force = false;
  std::optional<std::filesystem::path> trace;              ///< CSV of every moving body and placed particle
  std::optional<std::filesystem::path> contacts;           ///< CSV of the contact points of bodies
  std::optional<std::filesystem::path> cloths;             ///< CSV of strain, contacts and volume of cloths
  std::optional<std::filesystem::path> joints;             ///< CSV of the loads and states of joints
  std::optional<std::filesystem::path> particles;          ///< table of all particles; see particle_table.h
  std::optional<std::filesystem::path> cloth_points = {};  ///< CSV of the vertices of cloths
  bool trace_every_step = false;  ///< whether rows are written for every sub-step; otherwise for every frame
};

/// Runs only the physics, over all frames.
RunStats simulate_frames(const LoadedScene& loaded, const ModelLibrary& models, const SimulateJob& job,
                         const ProgressCallback& progress);

struct SnapshotJob {
  std::vector<int> frames;                     ///< ascending
  std::optional<std::filesystem::path> cache;  ///< read states from here instead of simulating
};

/// Passes the state of each frame to `take`, in order, on the calling thread. An interrupt ends it between
/// two frames and is recorded in the result. Passes on the exceptions of the simulation, the cache and
/// `take`.
RunStats visit_frames(const LoadedScene& loaded, const ModelLibrary& models, const SnapshotJob& job,
                      const std::function<void(const Snapshot&)>& take, const ProgressCallback& progress);

/// Hash of everything on which a cache of snapshots depends: the scene without camera, light, environment,
/// looks of materials and picture settings.
std::string simulation_key(const LoadedScene& loaded, const ModelLibrary& models);
/// Hash of everything on which the pixels of a frame depend.
std::string settings_key(const LoadedScene& loaded, const ModelLibrary& models);

/// Time since the process started [s].
double process_age_s();
double peak_rss_mb();

}  // namespace offstage::producer
