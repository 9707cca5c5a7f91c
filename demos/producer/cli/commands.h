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

/// A command of the program.
struct Command {
  CLI::App* arguments;  ///< arguments of the command; owned by the program's CLI::App
  std::function<int()>
      /// Runs the command with the parsed options and returns the exit code. Throws an exception for an
      /// error.
      run;
};

struct RenderOptions;
/// Runs `render --watch`. The function is in a library that depends on this one: see engine/watch_command.h.
using WatchCommand = std::function<int(const RenderOptions&)>;

// Each function adds a command with its options to the program's command line.
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
  std::string format = "rgba";  ///< format of the frames on standard output
  std::string cache, stats, report;
  /// Names of the cameras to draw, or kAllCameras; empty: the scene's `camera`.
  std::vector<std::string> cameras;
  /// Folder for the states of a film with several cameras: the first camera writes them, the others read
  /// them. Empty: none.
  std::string states;
  int threads = 0;  ///< number of threads of the simulation; 0: all available
  int jobs = 0;     ///< number of frames drawn at the same time; 0: chosen by `threads`
  bool resume = false, force = false, dry_run = false, watch = false;
  render::GlPlatform gl = render::GlPlatform::automatic;

  // `render --watch` sets the following members.
  std::function<bool()> stop;  ///< see RenderJob::stop
  /// Makes RenderJob::states for a film whose last frame is `last`. Empty: the film is simulated.
  std::function<std::unique_ptr<StateSource>(const LoadedScene&, const ModelLibrary&, int last)> states_of;
  bool prints_name = true;  ///< whether to print the name of the output when it is complete
};
/// Runs the command `render` and returns the exit code.
int render_command(const RenderOptions& options);
/// Returns the default output for a scene: SCENE.mp4 in the current folder. Throws OutputError if the scene
/// is read from standard input.
std::string default_film(const std::string& scene_file);

struct TuneOptions {
  SceneOptions scene;
  int port = 0;                  ///< port of the page; 0: any free one
  std::string size = "640x360";  ///< size of drafts
  bool open = true;              ///< whether to open the page in a browser
  int threads = 0;
  render::GlPlatform gl = render::GlPlatform::automatic;
};
/// Runs the command `tune`. The function is in a library that depends on this one: see tune/tune_command.h.
using TuneCommand = std::function<int(const TuneOptions&)>;

/// Returns `threads`, or the number of available processors if `threads` is 0.
int threads_or_all(int threads);
/// Limits the simulation to a number of threads while the returned object exists. 0 threads mean all
/// available processors.
tbb::global_control simulation_threads(int threads);

/// Loads a scene with the overrides of the options, then `more_overrides`. Prints its warnings to standard
/// error unless `quiet`. Throws SceneError.
LoadedScene load(const SceneOptions& options, bool quiet,
                 const std::vector<std::string>& more_overrides = {});
void print_warnings(const std::vector<Problem>& warnings);
/// Reads the models of a scene, and shows steps that take long. Prints warnings, unless the options say
/// quiet. Throws the exceptions of ModelLibrary. After a signal it throws Interrupted before the next model.
ModelLibrary load_models(const LoadedScene& loaded, const SceneOptions& options,
                         const LogOptions& log_options);
/// Like the function above, but appends warnings to `warnings` instead of printing them.
ModelLibrary load_models(const LoadedScene& loaded, const SceneOptions& options,
                         const LogOptions& log_options, std::vector<Problem>& warnings);
/// Returns a hash of all settings that determine the pixels of a scene's frames.
std::string frame_settings(const LoadedScene& loaded, const ModelLibrary& models, render::GlPlatform gl);
/// Prints JSON to standard output as lines "key: value". `indent`: number of spaces before each line.
void print_readable(const nlohmann::ordered_json& json, int indent = 0);
/// Returns the error message for an invalid frame rate.
std::string wrong_frame_rate(const std::string& text);
/// Writes a text to a file. Throws render::FileError.
void write_text_file(const std::string& path, const std::string& text);
/// Writes a text to a new file, and returns its name: the first of STEM.EXT, STEM-2.EXT, STEM-3.EXT and so on
/// that does not exist. `ending` is ".EXT".
std::string write_numbered_file(const std::string& stem, const std::string& ending, const std::string& text);

/// Checks before a long run that an output file can be written. Otherwise throws OutputError. An existing
/// file is an error unless `force`. An empty name means that there is no such file.
void check_file(const std::string& file, bool force);
/// Throws OutputError if one of the output files is a file that the scene reads: the scene itself, an
/// include, a model or a texture. Outputs replace files of earlier runs, never these.
void check_not_read(const std::vector<std::string>& outputs, const SceneOptions& scene);
/// Throws OutputError if two outputs are the same file.
void check_distinct(const std::string& a, const std::string& b);
/// Throws OutputError unless the name ends in .png.
void check_png(const std::string& file);

/// Converts a number to a frame number. Throws std::invalid_argument if the film has no such frame.
int checked_frame(const Scene& scene, double number);
/// Returns the number of the frame nearest to a time [s]. Throws std::invalid_argument for a time outside of
/// the film.
int frame_at(const Scene& scene, double time);
inline constexpr int kSmallSide_px = 320;  ///< longer side of each picture of a contact sheet [pixels]
/// Returns a size such as "320x180" that has the scene's aspect ratio and the given longer side [pixels].
std::string small_size(const Scene& scene, int longer_side_px);

}  // namespace offstage::producer
