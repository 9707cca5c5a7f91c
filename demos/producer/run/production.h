#pragma once
/// The frame loop: simulation (or a cache), several drawing threads with a GL context each, and the sink,
/// overlapping through bounded queues. What comes out does not depend on how many threads draw.

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

/// What is known of one frame, for a report.
struct FrameFigures {
  int frame = 0;
  double time = 0;  ///< of the film [s]
  double sim_ms = 0, render_ms = 0, encode_ms = 0;
  uint64_t particles = 0;
  std::size_t contacts = 0;           ///< of bodies; without a cache
  std::optional<sim::Energy> energy;  ///< without a cache
  std::string state_hash, pixel_hash;
};

/// What a run did: the stats object of the command line.
struct RunStats {
  int frames = 0;       ///< written by this run
  int frames_kept = 0;  ///< already there (resume)
  double wall_s = 0;
  double startup_s = 0;  ///< from the start of the process to the first written frame
  StageTimes sim, render, encode;
  std::size_t bodies = 0;
  uint64_t particles = 0;  ///< alive at the end
  uint64_t most_particles = 0;
  SimulationTotals totals;
  std::optional<sim::Energy> energy_start, energy_end;  ///< without a cache
  std::string state_hash;                               ///< after the last frame
  std::map<int, std::string> frame_states;              ///< state hash of every drawn frame
  std::vector<FrameFigures> figures;                    ///< if the job asks for them
  std::vector<std::pair<int, render::Image>> pictures;  ///< thumbnails of about a dozen frames
  std::vector<int> blank_frames;                        ///< all pixels equal: something is probably wrong
  int interrupted_by = 0;                               ///< signal, or 0
};

/// One JSON object.
std::string to_json(const RunStats& stats);

/// How far a run is. Reported after every simulated and every finished frame, by one thread at a time.
struct Progress {
  int done = 0, total = 0;                          ///< finished frames
  double sim_ms = 0, render_ms = 0, encode_ms = 0;  ///< of the latest finished frame
  uint64_t particles = 0;                           ///< in that frame
  double eta_s = 0;                                 ///< time left [s]; 0: not known yet
  double fraction = 0;                              ///< of the work of simulation and drawing, 0 .. 1
  /// Of the simulation, which also runs what the film skips; both 0 without one.
  int frames_simulated = 0, frames_to_simulate = 0;
  bool frame_finished = true;              ///< false: reported for a simulated frame
  double simulating_s = 0, drawing_s = 0;  ///< spent so far; drawing with encoding, of all threads together
};
using ProgressCallback = std::function<void(const Progress&)>;

struct RenderJob {
  std::vector<int> frames;                     ///< to draw, ascending
  int threads = 1;                             ///< that draw, each with a context of its own
  std::optional<std::filesystem::path> cache;  ///< read states from here instead of simulating
  std::optional<std::filesystem::path> keep;  ///< write the states that are drawn here, to be read as `cache`
  bool report = false;                        ///< keep figures and pictures
  render::ChannelChoice channels;             ///< to write ...
  std::filesystem::path channels_stem;  ///< ... as these; '#' as in render::frame_path, or for one frame
};

/// Draws the frames into the sink and closes it. After an interrupt it finishes the frames in flight, closes
/// the sink and says so in the result. Throws what the parts throw; then nothing is left half-written.
RunStats render_frames(const LoadedScene& loaded, const ModelLibrary& models, const RenderJob& job,
                       render::FrameSink& sink, const ProgressCallback& progress);

struct SimulateJob {
  std::optional<std::filesystem::path> cache;  ///< write a snapshot per frame
  bool force = false;
  std::optional<std::filesystem::path> trace;     ///< CSV of every moving body and placed particle
  std::optional<std::filesystem::path> contacts;  ///< CSV of the points where bodies touch
  std::optional<std::filesystem::path> cloths;    ///< CSV of strain and contacts of cloths
  std::optional<std::filesystem::path> joints;    ///< CSV of what joints bear and how they stand
  bool trace_every_step = false;                  ///< all of them; else once a frame
};

/// Runs the physics alone, over all frames.
RunStats simulate_frames(const LoadedScene& loaded, const ModelLibrary& models, const SimulateJob& job,
                         const ProgressCallback& progress);

struct SnapshotJob {
  std::vector<int> frames;                     ///< ascending
  std::optional<std::filesystem::path> cache;  ///< read states from here instead of simulating
};

/// Gives the state of each frame to `take`, in order, on the calling thread. An interrupt ends it between two
/// frames and is noted in the result. Throws what the simulation, the cache and `take` throw.
RunStats visit_frames(const LoadedScene& loaded, const ModelLibrary& models, const SnapshotJob& job,
                      const std::function<void(const Snapshot&)>& take, const ProgressCallback& progress);

/// What a cache of snapshots depends on: everything of the scene but camera, light, air and picture settings.
std::string simulation_key(const LoadedScene& loaded, const ModelLibrary& models);
/// What a frame's pixels depend on.
std::string settings_key(const LoadedScene& loaded, const ModelLibrary& models);

/// Time since the process started [s].
double process_age_s();
double peak_rss_mb();

}  // namespace offstage::producer
