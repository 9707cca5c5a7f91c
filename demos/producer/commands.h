#pragma once
/// The commands behind the command line. Each takes what was asked for and returns an exit code; errors are
/// thrown.

#include <optional>
#include <string>
#include <vector>

#include <tbb/global_control.h>

#include "producer/decomposition_cache.h"
#include "producer/progress.h"
#include "producer/scene_io.h"

namespace offstage::producer {

/// What every command that reads a scene accepts.
struct SceneOptions {
  std::string file;
  std::vector<std::string> set;
  std::optional<std::string> quality, size;
  std::optional<double> fps, duration;
  std::optional<uint64_t> seed;
  bool no_cache = false;  ///< neither read nor keep the convex parts of models on disk

  DecompositionCache decompositions() const {
    return no_cache ? DecompositionCache() : DecompositionCache::of_user();
  }
  /// The shorthands as overrides, then `set`.
  std::vector<std::string> overrides() const;
};

struct TalkOptions {
  ProgressStyle progress = ProgressStyle::automatic;
  bool quiet = false, verbose = false;
};

struct RenderOptions {
  SceneOptions scene;
  TalkOptions talk;
  std::string out;
  std::string frames, chunk;
  std::string format = "rgba";  ///< of standard output
  std::string cache, stats;
  int threads = 0;  ///< 0: all available
  int jobs = 0;     ///< 0: as `threads`
  bool resume = false, force = false, dry_run = false;
};
int render_command(const RenderOptions& options);

struct FrameOptions {
  SceneOptions scene;
  TalkOptions talk;
  std::string out;
  std::optional<int> frame;
  std::optional<double> at;
  int threads = 0;
  bool force = false;
};
int frame_command(const FrameOptions& options);

struct SimulateOptions {
  SceneOptions scene;
  TalkOptions talk;
  std::string trace, contacts, trace_every = "frame", cache, stats;
  int threads = 0;
  bool force = false;
};
int simulate_command(const SimulateOptions& options);

int validate_command(const SceneOptions& options, bool json);
int schema_command(bool reference);
int info_command(const SceneOptions& options, bool json);
int doctor_command();

struct CompareOptions {
  SceneOptions scene;  ///< `file` may also be a picture or a folder of frames
  std::string other;   ///< the second picture or folder
  std::string golden, report;
  int threads = 0;
};
int compare_command(const CompareOptions& options);

struct BlessOptions {
  std::vector<std::string> scenes;
  std::string golden, reason;
  int threads = 0;
};
int bless_command(const BlessOptions& options);

/// As asked for, or every processor that may be used.
int threads_or_all(int threads);
/// Limits the simulation to so many threads while it lives.
tbb::global_control simulation_threads(int threads);

/// Loads a scene, prints its warnings to standard error unless quiet.
LoadedScene load(const SceneOptions& options, bool quiet,
                 const std::vector<std::string>& more_overrides = {});
void print_warnings(const std::vector<Problem>& warnings);
void write_text_file(const std::string& path, const std::string& text);

}  // namespace offstage::producer
