#pragma once
/// The commands behind the command line. Each takes what was asked for and returns an exit code; errors are
/// thrown.

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

/// What every command that reads a scene accepts.
struct SceneOptions {
  std::string file;
  std::vector<std::string> set;
  std::optional<std::string> quality, size;
  std::optional<std::string> fps;  ///< a number, or a fraction such as 30000/1001
  std::optional<double> duration;
  std::optional<uint64_t> seed;
  std::vector<std::string> channels;  ///< depth, normal, id, motion; empty: as the scene says
  std::optional<std::string> channel_format;
  std::vector<std::string> allow;  ///< folders besides the scene's own that its files may lie in
  bool no_cache = false;           ///< neither read nor keep the convex parts of models on disk

  DecompositionCache decompositions() const {
    return no_cache ? DecompositionCache() : DecompositionCache::of_user();
  }
  /// The shorthands as overrides, then `set`. Throws std::invalid_argument for one that cannot be read.
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
  std::string format = "rgba";  ///< of standard output
  std::string cache, stats, report;
  int threads = 0;  ///< 0: all available
  int jobs = 0;     ///< 0: as `threads`
  bool resume = false, force = false, dry_run = false, watch = false;
  render::GlPlatform gl = render::GlPlatform::automatic;
};
int render_command(const RenderOptions& options);
/// Where the film of a scene goes if nobody says: SCENE.mp4 in the current folder. Throws OutputError for
/// standard input.
std::string default_film(const std::string& scene_file);
/// Renders, and again whenever a file that the scene is made of changes, until a signal ends it. Every render
/// runs in a process of its own; what a whole one made replaces the output, a failed one leaves the last good
/// result. `render` is the render command that reports its errors itself.
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
  std::vector<double> at;  ///< times [s]; none: the middle of the film
  std::string out, csv;    ///< csv empty: beside the sheet
  int columns = 0;         ///< 0: chosen by what varies
  int threads = 0, jobs = 0;
  bool resume = false, force = false, quiet = false;
  render::GlPlatform gl = render::GlPlatform::automatic;
};
int sweep_command(const SweepOptions& options);

struct SimulateOptions {
  SceneOptions scene;
  TalkOptions talk;
  std::string trace, contacts, cloths, joints, trace_every = "frame", cache, stats;
  int threads = 0;
  bool force = false;
};
int simulate_command(const SimulateOptions& options);

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
/// Looks after folders of snapshots.
int cache_command(const CacheOptions& options);

struct FarmOptions {
  SceneOptions scene;
  TalkOptions talk;
  std::string out, work, program, status;
  bool slurm = false;
  int local = 0;  ///< processes that draw on this machine; 0: none
  int chunks = 8, retries = 2, threads = 0;
  std::string partition, account, time;
  std::vector<std::string> sbatch;  ///< further options of sbatch
  bool resume = false, force = false, dry_run = false;
  render::GlPlatform gl = render::GlPlatform::automatic;
};
/// Renders in steps on many machines, or reports how far they are.
int farm_command(const FarmOptions& options);

struct ValidateOptions {
  SceneOptions scene;
  bool json = false;
  bool no_estimate = false;  ///< without the cost, which takes a short trial
  render::GlPlatform gl = render::GlPlatform::automatic;
};
int validate_command(const ValidateOptions& options);
int schema_command(bool reference);
/// All presets with a line each, or the text of one.
int presets_command(const std::string& name);
int info_command(const SceneOptions& options, bool json);
/// GL by every platform, the devices of EGL, encoders, processor.
int doctor_command();

struct EncodeOptions {
  std::vector<std::string> frames;  ///< one pattern
  TalkOptions talk;
  std::string out;
  std::optional<std::string> fps;  ///< left out: of the manifest beside the frames, or 30
  bool allow_gaps = false, force = false;
};
/// A video of frames that are there already.
int encode_command(const EncodeOptions& options);

struct NewOptions {
  std::string name, from;  ///< file and template; empty template: of that name, or "basic"
  bool list = false, force = false;
};
/// Writes a scene to begin with, or lists the templates.
int new_command(const NewOptions& options);

struct CompareOptions {
  std::vector<std::string> inputs;  ///< scenes, or two pictures, or two folders of frames
  SceneOptions scene;               ///< of each scene; its file is not used
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
  int port = 0;                  ///< 0: any that is free
  std::string size = "640x360";  ///< of drafts
  bool open = true;              ///< the page in a browser
  int threads = 0;
  render::GlPlatform gl = render::GlPlatform::automatic;
};
/// The tuning page, which is a library of its own above this one: see tune/tune_command.h.
using TuneCommand = std::function<int(const TuneOptions&)>;

/// As asked for, or every processor that may be used.
int threads_or_all(int threads);
/// Limits the simulation to so many threads while it lives.
tbb::global_control simulation_threads(int threads);

/// Loads a scene, prints its warnings to standard error unless quiet.
LoadedScene load(const SceneOptions& options, bool quiet,
                 const std::vector<std::string>& more_overrides = {});
void print_warnings(const std::vector<Problem>& warnings);
/// Reads the models of a scene, and shows what takes long on the way and what took long. Prints warnings
/// unless quiet. Throws Interrupted between two models, and what ModelLibrary throws.
ModelLibrary load_models(const LoadedScene& loaded, const SceneOptions& options, const TalkOptions& talk);
/// The same with the warnings added to `warnings` instead.
ModelLibrary load_models(const LoadedScene& loaded, const SceneOptions& options, const TalkOptions& talk,
                         std::vector<Problem>& warnings);
/// JSON as indented "key: value" lines.
void print_readable(const nlohmann::ordered_json& json, int indent = 0);
/// What is wrong with a text that is no frame rate.
std::string wrong_frame_rate(const std::string& text);
void write_text_file(const std::string& path, const std::string& text);
/// Writes to the first of STEM.EXT, STEM-2.EXT, ... that is not there yet, and returns that name.
std::string write_numbered_file(const std::string& stem, const std::string& ending, const std::string& text);

/// Refuses, before the work, a file that could not or must not be written after it. An empty name is none.
/// Throws OutputError.
void check_file(const std::string& file, bool force);
void check_distinct(const std::string& a, const std::string& b);
/// Throws OutputError unless the name ends in .png.
void check_png(const std::string& file);

/// The frame nearest to a time. Throws std::invalid_argument for one outside of the film.
int frame_at(const Scene& scene, double time);
inline constexpr int kSmallSide_px = 320;  ///< of the pictures of a sheet
/// A size such as "320x180" for small pictures of a scene: its shape, and the longer side as given.
std::string small_size(const Scene& scene, int longer_side_px);

}  // namespace offstage::producer
