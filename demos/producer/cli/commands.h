#pragma once
/// The commands of the command line. Each takes its options and returns an exit code; errors are exceptions.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>
#include <tbb/global_control.h>

#include "producer/build/decomposition_cache.h"
#include "producer/build/models.h"
#include "producer/format/scene_io.h"
#include "producer/format/scene_source.h"
#include "producer/run/golden.h"
#include "producer/run/progress.h"
#include "render/context.h"

namespace offstage::producer {

/// Options of every command that reads a scene.
struct SceneOptions {
  std::string file;
  std::vector<std::string> set;
  std::optional<std::string> quality, size;
  std::optional<std::string> fps;  ///< a number, or a fraction such as 30000/1001
  std::optional<double> duration;
  std::optional<uint64_t> seed;
  std::vector<std::string> channels;  ///< depth, normal, id, motion; empty: those of the scene
  std::optional<std::string> channel_format;
  std::string camera;              ///< name of the camera to draw; empty: the scene's `camera`
  std::vector<std::string> allow;  ///< additional folders for the scene's files
  bool no_cache = false;           ///< convex parts of models are neither read from the disk nor stored

  DecompositionCache decompositions() const {
    return no_cache ? DecompositionCache() : DecompositionCache::of_user();
  }
  /// Returns the shorthands as overrides, then `set`. Throws std::invalid_argument for an invalid one.
  std::vector<std::string> overrides() const;
  bool from_standard_input() const { return file == kStandardInput; }
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
  std::string format = "rgba";  ///< format of standard output
  std::string cache, stats, report;
  std::vector<std::string> cameras;  ///< cameras to draw, or kAllCameras; empty: the scene's `camera`
  /// Folder of the states, for other cameras and further renders: they are read if it holds those of this
  /// simulation, otherwise they are written to it. Empty: none.
  std::string states;
  int threads = 0;  ///< 0: all available
  int jobs = 0;     ///< 0: chosen by `threads`
  bool resume = false, force = false, dry_run = false, watch = false;
  render::GlPlatform gl = render::GlPlatform::automatic;
};
int render_command(const RenderOptions& options);
/// Default output of a scene: SCENE.mp4 in the current folder. Throws OutputError for standard input.
std::string default_film(const std::string& scene_file);
/// Renders, and renders again whenever a file of the scene changes, until a signal ends it. Every render runs
/// in a separate process. A complete result replaces the output; a failed render keeps the last good result.
/// `render` is the render command that reports its own errors.
int watch_command(const RenderOptions& options, const std::function<int(const RenderOptions&)>& render);

struct FrameOptions {
  SceneOptions scene;
  TalkOptions talk;
  std::string out;
  std::optional<int> frame;
  std::optional<double> at;
  int threads = 0;
  bool force = false;
  render::GlPlatform gl = render::GlPlatform::automatic;
};
int frame_command(const FrameOptions& options);

struct SheetOptions {
  SceneOptions scene;
  TalkOptions talk;
  std::string out;
  int count = 12, columns = 0;  ///< columns 0: chosen by the count
  int threads = 0;
  bool force = false;
  render::GlPlatform gl = render::GlPlatform::automatic;
};
int sheet_command(const SheetOptions& options);

struct SweepOptions {
  SceneOptions scene;
  std::vector<std::string> vary;
  std::vector<double> at;  ///< times [s]; empty: the middle of the film
  std::string out, csv;    ///< csv empty: beside the sheet
  int columns = 0;         ///< 0: chosen by the variations
  int threads = 0, jobs = 0;
  bool resume = false, force = false, quiet = false;
  render::GlPlatform gl = render::GlPlatform::automatic;
};
int sweep_command(const SweepOptions& options);

struct SimulateOptions {
  SceneOptions scene;
  TalkOptions talk;
  std::string trace, contacts, cloths, cloth_points, joints, particles, trace_every = "frame", cache, stats;
  int threads = 0;
  bool force = false;
};
int simulate_command(const SimulateOptions& options);

struct BenchOptions {
  SceneOptions scene;
  std::string csv;
  int repeat = 1;  ///< runs of each method
  int threads = 0;
  bool force = false, quiet = false;
};
/// Simulates a scene by each of the algorithms that it can choose from, and prints a table.
int bench_command(const BenchOptions& options);

struct ExportOptions {
  SceneOptions scene;
  TalkOptions talk;
  std::string out, frames, cache;
  int threads = 0;
  bool force = false;
};
int export_command(const ExportOptions& options);

struct CacheOptions {
  enum class Action { list, verify, clear };
  Action action = Action::list;
  std::vector<std::string> folders;
  bool json = false;
};
/// Lists, verifies or clears folders of snapshots.
int cache_command(const CacheOptions& options);

struct FarmOptions {
  SceneOptions scene;
  TalkOptions talk;
  std::string out, work, program, status;
  bool slurm = false;
  int local = 0;  ///< number of drawing processes on this machine; 0: none
  int chunks = 8, retries = 2, threads = 0;
  std::string partition, account, time;
  std::vector<std::string> sbatch;  ///< further options of sbatch
  bool resume = false, force = false, dry_run = false;
  render::GlPlatform gl = render::GlPlatform::automatic;
};
/// Renders a film in steps on many machines, or reports their progress.
int farm_command(const FarmOptions& options);

struct ValidateOptions {
  SceneOptions scene;
  bool json = false;
  bool no_estimate = false;  ///< no estimate of the cost, which takes a short trial
  render::GlPlatform gl = render::GlPlatform::automatic;
};
int validate_command(const ValidateOptions& options);
int schema_command(bool reference);
/// Lists all presets with a line each, or prints the text of one.
int presets_command(const std::string& name);
int info_command(const SceneOptions& options, bool json);
/// Reports GL on every platform, the devices of EGL, encoders, and the processor.
int doctor_command();

struct EncodeOptions {
  std::vector<std::string> frames;  ///< one pattern
  TalkOptions talk;
  std::string out;
  std::optional<std::string> fps;  ///< default: that of the manifest beside the frames, or 30
  bool allow_gaps = false, force = false;
};
/// Makes a video of existing frames.
int encode_command(const EncodeOptions& options);

struct NewOptions {
  std::string name, from;  ///< file and template; empty template: that of this name, or "basic"
  bool list = false, force = false;
};
/// Writes a first scene, or lists the templates.
int new_command(const NewOptions& options);

struct CompareOptions {
  std::vector<std::string> inputs;  ///< scenes, or two pictures, or two folders of frames
  SceneOptions scene;               ///< options for each scene; its file name is not used
  std::string golden, report, junit;
  GoldenStates states;
  int threads = 0;
  render::GlPlatform gl = render::GlPlatform::automatic;
};
int compare_command(const CompareOptions& options);

struct BlessOptions {
  std::vector<std::string> scenes, allow;
  std::string golden, reason;
  int threads = 0;
  render::GlPlatform gl = render::GlPlatform::automatic;
};
int bless_command(const BlessOptions& options);

struct TuneOptions {
  SceneOptions scene;
  int port = 0;                  ///< 0: any free port
  std::string size = "640x360";  ///< size of drafts
  bool open = true;              ///< whether to open the page in a browser
  int threads = 0;
  render::GlPlatform gl = render::GlPlatform::automatic;
};
/// The tuning page is in a library above this one: see tune/tune_command.h.
using TuneCommand = std::function<int(const TuneOptions&)>;

/// Number of threads, or that of all available processors if it is 0.
int threads_or_all(int threads);
/// Limits the simulation to this number of threads during its lifetime.
tbb::global_control simulation_threads(int threads);

/// Loads a scene, prints its warnings to standard error unless quiet.
LoadedScene load(const SceneOptions& options, bool quiet,
                 const std::vector<std::string>& more_overrides = {});
void print_warnings(const std::vector<Problem>& warnings);
/// Reads the models of a scene, and shows steps that take long. Prints warnings unless quiet. Throws
/// Interrupted between two models, and the exceptions of ModelLibrary.
ModelLibrary load_models(const LoadedScene& loaded, const SceneOptions& options, const TalkOptions& talk);
/// The same with the warnings added to `warnings` instead.
ModelLibrary load_models(const LoadedScene& loaded, const SceneOptions& options, const TalkOptions& talk,
                         std::vector<Problem>& warnings);
/// JSON as indented "key: value" lines.
void print_readable(const nlohmann::ordered_json& json, int indent = 0);
/// Error message for an invalid frame rate.
std::string wrong_frame_rate(const std::string& text);
void write_text_file(const std::string& path, const std::string& text);
/// Writes to the first name of STEM.EXT, STEM-2.EXT, ... that does not exist, and returns it.
std::string write_numbered_file(const std::string& stem, const std::string& ending, const std::string& text);

/// Checks before the work that a file can be written after it. An empty name is ignored. Throws OutputError.
void check_file(const std::string& file, bool force);
void check_distinct(const std::string& a, const std::string& b);
/// Throws OutputError unless the name ends in .png.
void check_png(const std::string& file);

/// The frame nearest to a time. Throws std::invalid_argument for one outside of the film.
int frame_at(const Scene& scene, double time);
inline constexpr int kSmallSide_px = 320;  ///< side of the pictures of a sheet
/// A size such as "320x180" for small pictures of a scene: its aspect ratio, with the given longer side.
std::string small_size(const Scene& scene, int longer_side_px);

}  // namespace offstage::producer
