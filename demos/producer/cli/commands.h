#pragma once
/// The commands of the command line, and their common functions.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>
#include <tbb/global_control.h>

#include "producer/build/models.h"
#include "producer/cli/options.h"
#include "producer/format/scene_io.h"
#include "producer/run/state_source.h"
#include "render/context.h"

namespace offstage::producer {

/// A command in the command line.
struct Command {
  CLI::App* arguments;  ///< belongs to the program's command line
  std::function<int()>
      /// Runs the command with the options that were parsed. Returns an exit code; errors are exceptions.
      run;
};

struct RenderOptions;
/// The function behind `render --watch`, which is in a library that depends on this one: see
/// engine/watch_command.h.
using WatchCommand = std::function<int(const RenderOptions&)>;

// Each adds a command with its options to the program's command line.
Command add_render(CLI::App& app, const WatchCommand& watch);
Command add_new(CLI::App& app);
Command add_encode(CLI::App& app);
Command add_frame(CLI::App& app);
Command add_sheet(CLI::App& app);
Command add_sweep(CLI::App& app);
Command add_simulate(CLI::App& app);
Command add_bench(CLI::App& app);
Command add_export(CLI::App& app);
Command add_cache(CLI::App& app);
Command add_farm(CLI::App& app);
Command add_validate(CLI::App& app);
Command add_schema(CLI::App& app);
Command add_presets(CLI::App& app);
Command add_info(CLI::App& app);
Command add_compare(CLI::App& app);
Command add_bless(CLI::App& app);
Command add_doctor(CLI::App& app);
Command add_man(CLI::App& app);
Command add_completion(CLI::App& app);

struct RenderOptions {
  SceneOptions scene;
  LogOptions log;
  std::string out;
  std::string frames, chunk;
  std::string format = "rgba";  ///< format of standard output
  std::string cache, stats, report;
  std::vector<std::string> cameras;  ///< cameras to draw, or kAllCameras; empty: the scene's `camera`
  /// Folder for the states of a film with several cameras: the first camera writes them, the others read
  /// them. Empty: none.
  std::string states;
  int threads = 0;  ///< number of threads of the simulation; 0: all available
  int jobs = 0;     ///< number of frames drawn at the same time; 0: chosen by `threads`
  bool resume = false, force = false, dry_run = false, watch = false;
  render::GlPlatform gl = render::GlPlatform::automatic;

  // These are set by render --watch.
  std::function<bool()> stop;  ///< see RenderJob::stop
  /// Makes RenderJob::states for a film that ends with the frame `last`; empty: none.
  std::function<std::unique_ptr<StateSource>(const LoadedScene&, const ModelLibrary&, int last)> states_of;
  bool prints_name = true;  ///< whether the name of the complete output is printed
};
int render_command(const RenderOptions& options);
/// Default output of a scene: SCENE.mp4 in the current folder. Throws OutputError for standard input.
std::string default_film(const std::string& scene_file);

struct TuneOptions {
  SceneOptions scene;
  int port = 0;                  ///< port of the page; 0: any free one
  std::string size = "640x360";  ///< size of drafts
  bool open = true;              ///< whether to open the page in a browser
  int threads = 0;
  render::GlPlatform gl = render::GlPlatform::automatic;
};
/// The function behind `tune`, which is in a library that depends on this one: see tune/tune_command.h.
using TuneCommand = std::function<int(const TuneOptions&)>;

/// Number of threads, or the number of available processors if it is 0.
int threads_or_all(int threads);
/// Limits the simulation to this number of threads during its lifetime.
tbb::global_control simulation_threads(int threads);

/// Loads a scene, prints its warnings to standard error unless quiet.
LoadedScene load(const SceneOptions& options, bool quiet,
                 const std::vector<std::string>& more_overrides = {});
void print_warnings(const std::vector<Problem>& warnings);
/// Reads the models of a scene, and shows steps that take long. Prints warnings unless quiet. Throws
/// Interrupted between two models, and the exceptions of ModelLibrary.
ModelLibrary load_models(const LoadedScene& loaded, const SceneOptions& options,
                         const LogOptions& log_options);
/// Reads the models of a scene, and appends warnings to `warnings` instead of printing them.
ModelLibrary load_models(const LoadedScene& loaded, const SceneOptions& options,
                         const LogOptions& log_options, std::vector<Problem>& warnings);
/// Returns a hash of all settings that determine the pixels of a scene's frames.
std::string frame_settings(const LoadedScene& loaded, const ModelLibrary& models, render::GlPlatform gl);
/// Prints JSON as indented lines "key: value".
void print_readable(const nlohmann::ordered_json& json, int indent = 0);
/// Returns the error message for an invalid frame rate.
std::string wrong_frame_rate(const std::string& text);
void write_text_file(const std::string& path, const std::string& text);
/// Writes to the first name of STEM.EXT, STEM-2.EXT, ... that does not exist, and returns it.
std::string write_numbered_file(const std::string& stem, const std::string& ending, const std::string& text);

/// Throws OutputError if an output file could not be written. Called before a long run. An empty name is
/// ignored.
void check_file(const std::string& file, bool force);
void check_distinct(const std::string& a, const std::string& b);
/// Throws OutputError unless the name ends in .png.
void check_png(const std::string& file);

/// Converts a number to a frame. Throws std::invalid_argument if the film has no such frame.
int checked_frame(const Scene& scene, double number);
/// Returns the frame nearest to a time [s]. Throws std::invalid_argument for a time outside of the film.
int frame_at(const Scene& scene, double time);
inline constexpr int kSmallSide_px = 320;  ///< side of the pictures of a sheet
/// Returns a size such as "320x180" that has the scene's aspect ratio and the given longer side [pixels].
std::string small_size(const Scene& scene, int longer_side_px);

}  // namespace offstage::producer
