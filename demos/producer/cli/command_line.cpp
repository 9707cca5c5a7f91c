#include "producer/cli/command_line.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <functional>
#include <map>
#include <new>
#include <tuple>

#include <CLI/CLI.hpp>
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "producer/base/error.h"
#include "producer/base/interrupt.h"
#include "producer/base/log.h"
#include "producer/base/suggest.h"
#include "producer/base/version.h"
#include "producer/build/simulation.h"
#include "producer/cli/command_texts.h"
#include "producer/cli/commands.h"
#include "producer/cli/failure.h"
#include "producer/run/output.h"
#include "render/error.h"
#include "render/file_io.h"

namespace offstage::producer {
namespace {

constexpr const char* kFooter =
    "A first film: offstage new rain && offstage rain.json   (SCENE.json alone renders SCENE.mp4)\n"
    "A scene named - is read from standard input.\n\n"
    "Exit codes: 0 ok, 1 run failed, 2 usage, 3 scene invalid, 4 GL or encoder unavailable, 5 simulation "
    "diverged,\n"
    "6 images differ, 130 interrupted (Ctrl-C), 143 terminated.";

const std::map<std::string, ProgressStyle> kProgressStyles = {{"auto", ProgressStyle::automatic},
                                                              {"bar", ProgressStyle::bar},
                                                              {"plain", ProgressStyle::plain},
                                                              {"json", ProgressStyle::json},
                                                              {"none", ProgressStyle::none}};

void add_allow(CLI::App& command, std::vector<std::string>& allow) {
  command
      .add_option(
          "--allow", allow,
          "A folder besides the scene's own that includes, models and textures may lie in (repeatable)")
      ->allow_extra_args(false);
}

void add_overrides(CLI::App& command, SceneOptions& scene) {
  command
      .add_option("--set", scene.set,
                  "Override a value of the scene: path=value, such as emitters.0.rate=200")
      ->allow_extra_args(false);
  command.add_option("--seed", scene.seed, "Seed of all random numbers");
  add_allow(command, scene.allow);
  command.add_flag("--no-cache", scene.no_cache,
                   "Do not use the cache of convex decompositions in ~/.cache/offstage");
}

void add_scene(CLI::App& command, SceneOptions& scene) {
  command.add_option("scene", scene.file, "Scene file; - for standard input")->required();
  add_overrides(command, scene);
}

void add_timing(CLI::App& command, SceneOptions& scene) {
  command.add_option("--fps", scene.fps, "Frames per second: 24, 29.97, 30000/1001");
  command.add_option("--duration", scene.duration, "Length of the film in seconds");
}

void add_quality(CLI::App& command, SceneOptions& scene) {
  command
      .add_option("--quality", scene.quality,
                  "Sub-frames per frame: draft 1, preview 4, final 16 (does not change the simulation)")
      ->check(CLI::IsMember({"draft", "preview", "final"}));
}

void add_picture(CLI::App& command, SceneOptions& scene) {
  add_quality(command, scene);
  command.add_option("--size", scene.size, "Picture size WxH, such as 1280x720");
}

void add_small_picture(CLI::App& command, SceneOptions& scene) {
  add_quality(command, scene);
  command.add_option("--size", scene.size,
                     "Size of each picture WxH (default: 320 pixels on the longer side)");
}

void add_talk(CLI::App& command, TalkOptions& talk) {
  command
      .add_option("--progress", talk.progress,
                  "auto: a bar on a terminal, lines in a log file, nothing on a pipe; bar, plain, json, none")
      ->transform(CLI::CheckedTransformer(kProgressStyles).description(""));
  command.add_flag("-q,--quiet", talk.quiet, "Print errors only");
  command.add_flag("-v,--verbose", talk.verbose, "Print more: stage times, memory");
}

void add_channels(CLI::App& app, SceneOptions& scene) {
  app.add_option("--channels", scene.channels,
                 "Also write channels beside every frame, or into FILM.channels beside a video:\ndepth [m], "
                 "normal, id, motion [px since the previous frame]; several with commas")
      ->delimiter(',')
      ->check(CLI::IsMember({"depth", "normal", "id", "motion"}));
  app.add_option(
         "--channel-format", scene.channel_format,
         "exr: FRAME.exr with all channels as floating-point numbers; png: FRAME.depth.png and so on, scaled")
      ->check(CLI::IsMember({"exr", "png"}));
}

void add_gl(CLI::App& command, render::GlPlatform& gl) {
  const auto take = [&gl](const std::string& name) {
    try {
      gl = render::gl_platform(name);
    } catch (const std::invalid_argument& error) {
      throw CLI::ValidationError("--gl", error.what());
    }
  };
  command
      .add_option_function<std::string>(
          "--gl", take,
          "OpenGL backend: osmesa or egl, which draw the same pixels with llvmpipe; egl:gpu uses a graphics "
          "card;\nauto uses the first of osmesa and egl that is installed")
      ->envname("OFFSTAGE_GL");
}

void add_threads(CLI::App& command, int& threads) {
  command.add_option("--threads", threads, "Threads of the simulation (default: all available)")
      ->check(CLI::Range(1, 256));
}

/// `bare`: for a command line without the command, which has no -o.
void add_camera(CLI::App& command, SceneOptions& scene) {
  command.add_option("--camera", scene.camera, "Name of a camera of the scene to draw instead of `camera`");
}

CLI::App* add_render(CLI::App& app, RenderOptions& render, bool bare) {
  CLI::App* command = app.add_subcommand("render", "Simulate a scene and draw it: frames or a video");
  add_scene(*command, render.scene);
  command
      ->add_option("-o,--output", render.out,
                   "frames/####.png (or .jpg, .exr) or a folder; .mp4 .webm .mov .mkv .gif .webp .apng .png; "
                   "- for standard "
                   "output")
      ->required(!bare);
  command
      ->add_option("--camera", render.cameras,
                   "Name of a camera to draw, or `all`; several cameras get files with their names")
      ->delimiter(',')
      ->allow_extra_args(false);
  add_picture(*command, render.scene);
  add_timing(*command, render.scene);
  command->add_option("--frames", render.frames,
                      "Frames to render: 1-30,40,50-90x2 (negative numbers count from the end)");
  command->add_option("--chunk", render.chunk, "i/n: render the i-th of n parts of the frames");
  command->add_option("--cache", render.cache,
                      "Draw from the snapshots of `simulate --cache` instead of simulating");
  command->add_option("--format", render.format, "Format on standard output: rgba or y4m")
      ->check(CLI::IsMember({"rgba", "y4m"}));
  add_threads(*command, render.threads);
  add_gl(*command, render.gl);
  command->add_option("--jobs", render.jobs, "Frames drawn at the same time (default: half of --threads)")
      ->check(CLI::Range(1, 64));
  auto* resume =
      command->add_flag("--resume", render.resume, "Keep finished frames that have the same settings");
  add_channels(*command, render.scene);
  command->add_flag("--force", render.force, "Replace existing output")->excludes(resume);
  auto* dry_run = command->add_flag("--dry-run", render.dry_run, "Print the plan as JSON and write nothing");
  command
      ->add_flag("--watch", render.watch,
                 "Render again whenever the scene, an include, a model or a texture changes, until "
                 "Ctrl-C;\nthe output is replaced only by a complete result, never after an error. Changes "
                 "of cameras,\nlights and looks do not simulate again")
      ->excludes(resume)
      ->excludes(dry_run);
  command->add_option("--stats", render.stats, "Write statistics of the run to this JSON file");
  command->add_option("--report", render.report,
                      "Write pictures, plots, settings and hashes of the run to this HTML file");
  add_talk(*command, render.talk);
  return command;
}

CLI::App* add_new(CLI::App& app, NewOptions& options) {
  CLI::App* command = app.add_subcommand("new",
                                         "Write a commented scene to start from, which can be rendered at "
                                         "once; without NAME: list the templates");
  command->add_option("name", options.name, "NAME or NAME.json; - for standard output");
  command->add_option("--template", options.from,
                      "Template to use (default: the one called NAME, as in `new rain`, or else `basic`)");
  command->add_flag("--list", options.list, "List the templates");
  command->add_flag("--force", options.force, "Replace an existing file");
  return command;
}

CLI::App* add_tune(CLI::App& app, TuneOptions& tune) {
  CLI::App* command = app.add_subcommand(
      "tune", "Edit a scene in the browser with a live preview; prints the address of the page");
  command->add_option("scene", tune.scene.file, "Scene file")->required();
  command->add_option("--port", tune.port, "Port on this machine (default: any that is free)")
      ->check(CLI::Range(1, 65535));
  command->add_option("--size", tune.size, "Size WxH that drafts fit into")->capture_default_str();
  command->add_flag_callback(
      "--no-open", [&tune] { tune.open = false; }, "Only print the address and open no browser");
  add_allow(*command, tune.scene.allow);
  command->add_flag("--no-cache", tune.scene.no_cache,
                    "Do not use the cache of convex decompositions in ~/.cache/offstage");
  add_threads(*command, tune.threads);
  add_gl(*command, tune.gl);
  return command;
}

CLI::App* add_encode(CLI::App& app, EncodeOptions& encode) {
  CLI::App* command = app.add_subcommand("encode", "Encode existing PNG frames as a video");
  command->add_option("frames", encode.frames, "Pattern such as 'frames/####.png', or a folder")->required();
  command->add_option("-o,--output", encode.out, "Video: .mp4 .webm .mov .mkv .gif .webp .apng .png")
      ->required();
  command->add_option("--fps", encode.fps,
                      "Frames per second: 24, 29.97, 30000/1001 (default: as rendered, or 30)");
  command->add_flag("--allow-gaps", encode.allow_gaps, "Skip missing frame numbers");
  command->add_flag("--force", encode.force, "Replace an existing file");
  add_talk(*command, encode.talk);
  return command;
}

CLI::App* add_validate(CLI::App& app, ValidateOptions& validate) {
  CLI::App* command =
      app.add_subcommand("validate", "Check a scene, report every problem, and estimate the rendering time");
  add_scene(*command, validate.scene);
  command->add_flag("--json", validate.json, "Print the result as JSON");
  command->add_flag("--no-estimate,--quick", validate.no_estimate,
                    "Skip the estimate, which takes about two seconds");
  add_gl(*command, validate.gl);
  return command;
}

CLI::App* add_frame(CLI::App& app, FrameOptions& frame) {
  CLI::App* command = app.add_subcommand("frame", "Draw one frame to a PNG");
  add_scene(*command, frame.scene);
  command->add_option("-o,--output", frame.out, "PNG file")->required();
  auto* number = command->add_option("-n,--frame", frame.frame,
                                     "Number of the frame (negative numbers count from the end)");
  command->add_option("--at", frame.at, "Time of the frame in seconds, instead of its number")
      ->excludes(number);
  add_camera(*command, frame.scene);
  add_picture(*command, frame.scene);
  add_timing(*command, frame.scene);
  add_threads(*command, frame.threads);
  add_gl(*command, frame.gl);
  add_channels(*command, frame.scene);
  command->add_flag("--force", frame.force, "Replace an existing file");
  add_talk(*command, frame.talk);
  return command;
}

CLI::App* add_simulate(CLI::App& app, SimulateOptions& simulate) {
  CLI::App* command = app.add_subcommand("simulate", "Simulate without drawing; prints statistics as JSON");
  add_scene(*command, simulate.scene);
  add_timing(*command, simulate.scene);
  command->add_option("--trace", simulate.trace,
                      "CSV of position, orientation and velocities of moving objects");
  command->add_option("--contacts", simulate.contacts,
                      "CSV of the contact points of bodies, with their forces");
  command->add_option("--cloths", simulate.cloths, "CSV of strain, contacts and volume of cloths");
  command->add_option("--cloth-points", simulate.cloth_points,
                      "CSV of position and velocity of the vertices of cloths");
  command->add_option("--joints", simulate.joints, "CSV of the loads and positions of joints");
  command->add_option(
      "--particles", simulate.particles,
      "Table of all particles, emitted ones included: CSV, or binary if its name ends in .bin");
  command->add_option("--trace-every", simulate.trace_every, "Interval of the CSV rows: frame or step")
      ->check(CLI::IsMember({"frame", "step"}));
  command->add_option("--cache", simulate.cache, "Folder for one snapshot per frame, for `render --cache`");
  command->add_option("--stats", simulate.stats,
                      "Write the statistics to this JSON file instead of standard output");
  add_threads(*command, simulate.threads);
  command->add_flag("--force", simulate.force, "Replace existing output");
  add_talk(*command, simulate.talk);
  return command;
}

CLI::App* add_bench(CLI::App& app, BenchOptions& bench) {
  CLI::App* command = app.add_subcommand(
      "bench",
      "Simulate a scene by each choice of solver and collision detection, and print a table of their speed, "
      "work, fall-backs and errors");
  add_scene(*command, bench.scene);
  add_timing(*command, bench.scene);
  command->add_option("--repeat", bench.repeat, "Runs of each method; the fastest one counts (default: 1)")
      ->check(CLI::Range(1, 100));
  command->add_option("--csv", bench.csv, "Write the table to this CSV file, too");
  add_threads(*command, bench.threads);
  command->add_flag("--force", bench.force, "Replace an existing file");
  command->add_flag("-q,--quiet", bench.quiet, "Print no warnings");
  return command;
}

CLI::App* add_export(CLI::App& app, ExportOptions& options) {
  CLI::App* command = app.add_subcommand(
      "export", "Simulate a scene and write its motion for other programs: USD, glTF, PLY, OBJ or CSV");
  add_scene(*command, options.scene);
  command
      ->add_option("-o,--output", options.out,
                   "film.usda, film.glb or film.csv; frames/####.ply or frames/####.obj, one file per frame")
      ->required();
  add_timing(*command, options.scene);
  command->add_option("--frames", options.frames,
                      "Frames to export: 1-30,40,50-90x2 (negative numbers count from the end)");
  command->add_option("--cache", options.cache,
                      "Take the snapshots of `simulate --cache` instead of simulating");
  add_threads(*command, options.threads);
  command->add_flag("--force", options.force, "Replace existing output");
  add_talk(*command, options.talk);
  return command;
}

CLI::App* add_cache(CLI::App& app, CacheOptions& options) {
  CLI::App* command =
      app.add_subcommand("cache", "List, verify or clear folders of snapshots that `simulate --cache` wrote");
  const std::map<std::string, CacheOptions::Action> actions = {{"list", CacheOptions::Action::list},
                                                               {"verify", CacheOptions::Action::verify},
                                                               {"clear", CacheOptions::Action::clear}};
  command
      ->add_option("action", options.action,
                   "list: what is in them; verify: read every snapshot; clear: remove the snapshots")
      ->required()
      ->transform(CLI::CheckedTransformer(actions).description("{list,verify,clear}"));
  command
      ->add_option("folders", options.folders,
                   "Caches; for `list` and `verify` also folders that hold caches")
      ->required();
  command->add_flag("--json", options.json, "Print the list as JSON");
  return command;
}

CLI::App* add_farm(CLI::App& app, FarmOptions& farm) {
  CLI::App* command = app.add_subcommand(
      "farm", "Simulate once and draw on many machines by Slurm, or by several processes of this one");
  command->add_option("scene", farm.scene.file, "Scene file");
  command->add_option("-o,--output", farm.out, "Video, or frames/####.png");
  command->add_flag("--slurm", farm.slurm,
                    "Submit the steps to Slurm; the folder must be visible to all nodes");
  command->add_option("--local", farm.local, "Run the same steps here, with so many drawing processes")
      ->check(CLI::Range(1, 256));
  command->add_option("--chunks", farm.chunks, "Parts of the frames")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  command->add_option("--retries", farm.retries, "How often a failed step is tried again")
      ->check(CLI::Range(0, 100))
      ->capture_default_str();
  command->add_option("--work", farm.work,
                      "Folder of scripts, cache, frames and logs (default: OUTPUT.farm)");
  command->add_option("--partition", farm.partition, "Partition of Slurm");
  command->add_option("--account", farm.account, "Account of Slurm");
  command->add_option("--time", farm.time, "Time limit of each job of Slurm, such as 2:00:00");
  command
      ->add_option("--sbatch", farm.sbatch,
                   "A further option of sbatch, such as --sbatch=--mem=8G (repeatable)")
      ->allow_extra_args(false);
  command->add_option("--program", farm.program, "Path of offstage on the nodes (default: this one)");
  auto* resume = command->add_flag("--resume", farm.resume, "Keep the steps and frames that are done");
  command->add_flag("--force", farm.force, "Start again, and replace existing output")->excludes(resume);
  command->add_flag("--dry-run", farm.dry_run, "Print the scripts and write nothing");
  command->add_option("--status", farm.status, "Report the progress of the farm in this folder");
  add_overrides(*command, farm.scene);
  add_picture(*command, farm.scene);
  add_timing(*command, farm.scene);
  add_threads(*command, farm.threads);
  add_gl(*command, farm.gl);
  add_talk(*command, farm.talk);
  return command;
}

CLI::App* add_compare(CLI::App& app, CompareOptions& compare) {
  compare.golden = "tests/golden";
  CLI::App* command = app.add_subcommand(
      "compare", "Compare scenes with their goldens, or two pictures or folders of frames");
  command->add_option("inputs", compare.inputs, "Scenes, or two pictures, or two folders of frames")
      ->required();
  command->add_option("--golden", compare.golden, "Folder of the goldens")->capture_default_str();
  command->add_option("--report", compare.report,
                      "Folder for the expected and actual pictures, their difference and an HTML page; with\n"
                      "several scenes, a folder for each that differs, and a page about all");
  command->add_option("--junit", compare.junit,
                      "Write the results of the scenes to this JUnit XML file, which CI systems read");
  CLI::Option* keep = command->add_option("--keep-states", compare.states.keep,
                                          "Write the simulated states of the golden's frames to this folder");
  command
      ->add_option(
          "--states", compare.states.from,
          "Draw the states written by --keep-states instead of simulating, for example with another --gl")
      ->excludes(keep);
  add_overrides(*command, compare.scene);
  add_threads(*command, compare.threads);
  add_gl(*command, compare.gl);
  return command;
}

CLI::App* add_bless(CLI::App& app, BlessOptions& bless) {
  bless.golden = "tests/golden";
  CLI::App* command = app.add_subcommand("bless", "Record the goldens of scenes again");
  command->add_option("scenes", bless.scenes, "Scene files")->required();
  command->add_option("--golden", bless.golden, "Folder of the goldens")->capture_default_str();
  command->add_option("--reason", bless.reason, "Why the pictures changed")->required();
  add_allow(*command, bless.allow);
  add_threads(*command, bless.threads);
  add_gl(*command, bless.gl);
  return command;
}

CLI::App* add_sheet(CLI::App& app, SheetOptions& sheet) {
  CLI::App* command = app.add_subcommand(
      "sheet", "Draw a contact sheet: small frames of the whole film in one PNG, with time codes");
  add_scene(*command, sheet.scene);
  command->add_option("-o,--output", sheet.out, "PNG file")->required();
  command->add_option("--count", sheet.count, "Number of frames, evenly from the first to the last")
      ->check(CLI::Range(1, 400))
      ->capture_default_str();
  command->add_option("--columns", sheet.columns, "Pictures in a row")->check(CLI::Range(1, 100));
  add_camera(*command, sheet.scene);
  add_small_picture(*command, sheet.scene);
  add_timing(*command, sheet.scene);
  add_threads(*command, sheet.threads);
  add_gl(*command, sheet.gl);
  command->add_flag("--force", sheet.force, "Replace an existing file");
  add_talk(*command, sheet.talk);
  return command;
}

CLI::App* add_sweep(CLI::App& app, SweepOptions& sweep) {
  CLI::App* command = app.add_subcommand(
      "sweep",
      "Render a scene with different values: one PNG with labelled pictures, and a CSV of statistics");
  add_scene(*command, sweep.scene);
  command
      ->add_option("--vary", sweep.vary,
                   "Values to try: path=a:b:step or path=x,y,z, such as emitters.0.rate=100:400:50; if "
                   "given\nseveral times, every combination is run (at most 256)")
      ->required()
      ->allow_extra_args(false);
  command
      ->add_option("--at", sweep.at, "Times of the pictures in seconds: 1 or 0.5,1,2 (default: the middle)")
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("-o,--output", sweep.out, "PNG file")->required();
  command->add_option(
      "--csv", sweep.csv,
      "CSV with the statistics of every run at the last of the times (default: beside the PNG)");
  command->add_option("--columns", sweep.columns, "Pictures in a row")->check(CLI::Range(1, 100));
  add_small_picture(*command, sweep.scene);
  add_timing(*command, sweep.scene);
  add_threads(*command, sweep.threads);
  add_gl(*command, sweep.gl);
  command->add_option("--jobs", sweep.jobs, "Runs at the same time (default: as --threads, if memory allows)")
      ->check(CLI::Range(1, 64));
  auto* resume =
      command->add_flag("--resume", sweep.resume, "Keep the finished runs of an interrupted sweep");
  command->add_flag("--force", sweep.force, "Replace existing output")->excludes(resume);
  command->add_flag("-q,--quiet", sweep.quiet, "Print errors and failed runs only");
  return command;
}

/// Opens closed standard streams, because otherwise the program's own files would get their numbers.
void open_standard_streams() {
  for (int fd = 0; fd <= 2; ++fd) {
    if (fcntl(fd, F_GETFD) >= 0) continue;
    // Takes the lowest free number. Writing to standard output then fails, so results are not lost silently.
    open("/dev/null", fd == 2 ? O_WRONLY : O_RDONLY);
    if (fd == 1) note_closed_output();
  }
}

/// Called when memory is exhausted where no exception can pass: in a thread, or in a destructor during
/// another exception. The program ends with the same line and exit code; unfinished files keep their
/// temporary names.
[[noreturn]] void end_program() {
  try {
    if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::bad_alloc&) {
    constexpr std::string_view kLine = "offstage: out of memory\n";
    std::ignore = ::write(STDERR_FILENO, kLine.data(), kLine.size());
    ::_exit(kRunFailed);
  } catch (...) {
  }
  std::abort();
}

/// Installed before the construction of static objects, which needs memory, too.
[[gnu::constructor(101)]] void install_end() {
  std::set_terminate(end_program);
}

/// If results could not be written, the command has failed.
int flushed(int code) {
  if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return code;
  log("offstage: standard output: {}\n", std::strerror(errno));
  return code == kOk ? kRunFailed : code;
}

/// Returns the exit code of a command; an exception becomes a message and an exit code of its own.
int reported(const std::function<int()>& command) {
  try {
    return command();
  } catch (const DivergedError& error) {
    log("offstage: {}\n", error.what());
    try {
      log("the last state was saved to {}\n",
          write_numbered_file("offstage-diverged", ".json", error.state()));
    } catch (const render::FileError& unsaved) {
      log("the last state could not be saved: {}\n", unsaved.what());
    }
    return kDiverged;
  } catch (const render::StoppedError&) {
    log("interrupted\n");
    return 128 + interrupt_signal();
  } catch (const Interrupted& interrupted) {
    log("interrupted\n");
    return 128 + interrupted.signal();
  } catch (const std::bad_alloc&) {
    write_log("offstage: out of memory\n");
    return kRunFailed;
  } catch (const std::exception&) {
    const Failure failure = describe_failure(std::current_exception());
    log("{}\n", failure.message);
    return failure.code;
  }
}

int dispatch(int argc, char** argv, const TuneCommand& tune);

}  // namespace

int run(int argc, char** argv, const TuneCommand& tune) {
  open_standard_streams();
  install_signal_handlers();
  return flushed(reported([&] { return dispatch(argc, argv, tune); }));
}

namespace {

bool is_scene_name(std::string_view argument) {
  return argument == kStandardInput || argument.ends_with(".json");
}

/// Whether the arguments have a scene in place of a command; it is then rendered.
bool lacks_command(const std::vector<const char*>& arguments, const std::vector<std::string>& commands) {
  if (arguments.size() < 2) return false;
  const std::string_view first = arguments[1];
  if (!first.starts_with('-') || first == kStandardInput) return is_scene_name(first);
  const auto is_command = [&](const char* argument) {
    return std::ranges::find(commands, argument) != commands.end();
  };
  return std::none_of(arguments.begin() + 1, arguments.end(), is_command) &&
         std::any_of(arguments.begin() + 1, arguments.end(), is_scene_name);
}

/// Error message for a word that is not a command; empty if there is none.
std::string wrong_command(const std::vector<const char*>& arguments,
                          const std::vector<std::string>& commands) {
  if (arguments.size() < 2 || std::string_view(arguments[1]).starts_with('-')) return {};
  const std::string word = arguments[1];
  if (std::ranges::find(commands, word) != commands.end()) return {};
  if (std::error_code error; std::filesystem::is_regular_file(word, error))
    return word + " is not a scene: a scene is a .json file, or - for standard input";
  const std::string near = nearest(word, commands);
  return "there is no command '" + word + "'" + (near.empty() ? "" : "; did you mean '" + near + "'?") +
         " (--help lists all)";
}

constexpr std::array kCommandNames = {"render",  "frame",  "sheet",    "sweep",  "simulate",   "new",
                                      "tune",    "encode", "validate", "schema", "presets",    "info",
                                      "compare", "bless",  "doctor",   "man",    "completion", "export",
                                      "cache",   "farm",   "bench"};

int dispatch(int argc, char** argv, const TuneCommand& tune) {
  std::vector<const char*> arguments(argv, argv + argc);
  const std::vector<std::string> commands(kCommandNames.begin(), kCommandNames.end());
  const bool bare = lacks_command(arguments, commands);
  if (bare) arguments.insert(arguments.begin() + 1, "render");
  if (const std::string wrong = wrong_command(arguments, commands); !wrong.empty()) {
    log("offstage: {}\n", wrong);
    return kUsage;
  }
  CLI::App app{"offstage turns a scene file into a physically simulated film, without a display or a GPU."};
  app.set_version_flag("--version", "offstage " + std::string(version_text()));
  app.require_subcommand(1);
  app.fallthrough(false);
  app.footer(kFooter);

  RenderOptions render;
  auto* render_app = add_render(app, render, bare);
  NewOptions create;
  auto* new_app = add_new(app, create);
  TuneOptions tuning;
  auto* tune_app = add_tune(app, tuning);
  EncodeOptions encode;
  auto* encode_app = add_encode(app, encode);

  FrameOptions frame;
  auto* frame_app = add_frame(app, frame);
  SheetOptions sheet;
  auto* sheet_app = add_sheet(app, sheet);
  SweepOptions sweep;
  auto* sweep_app = add_sweep(app, sweep);

  SimulateOptions simulate;
  auto* simulate_app = add_simulate(app, simulate);
  BenchOptions bench;
  auto* bench_app = add_bench(app, bench);
  ExportOptions exporting;
  auto* export_app = add_export(app, exporting);
  CacheOptions caches;
  auto* cache_app = add_cache(app, caches);
  FarmOptions farm;
  auto* farm_app = add_farm(app, farm);
  ValidateOptions validate;
  auto* validate_app = add_validate(app, validate);

  bool reference = false;
  auto* schema_app = app.add_subcommand("schema", "Print the JSON Schema of the scene format");
  schema_app->add_flag("--reference", reference, "Print the scene reference in Markdown instead");

  std::string preset;
  auto* presets_app = app.add_subcommand(
      "presets", "List the presets, fabrics and articulations for scenes, or print one of them");
  presets_app->add_option("name", preset, "Preset, fabric or articulation to print");

  SceneOptions info;
  bool info_json = false;
  auto* info_app = app.add_subcommand("info", "Describe a scene or a model file");
  info_app->add_option("file", info.file, "Scene (.json) or model file")->required();
  add_overrides(*info_app, info);
  info_app->add_flag("--json", info_json, "Print as JSON");

  CompareOptions compare;
  auto* compare_app = add_compare(app, compare);
  BlessOptions bless;
  auto* bless_app = add_bless(app, bless);
  auto* doctor_app =
      app.add_subcommand("doctor", "Report OpenGL backends, video encoders and processor of this machine");
  auto* man_app = app.add_subcommand("man", "Print the manual page, for `man -l -`");
  std::string shell;
  auto* completion_app = app.add_subcommand("completion", "Print the completion script of a shell");
  completion_app->add_option("shell", shell, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));

  try {
    app.parse(static_cast<int>(arguments.size()), arguments.data());
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kOk : kUsage;
  }

  return reported([&] {
    if (bare && render.out.empty()) render.out = default_film(render.scene.file);
    if (*render_app && render.watch)
      return watch_command(
          render, [](const RenderOptions& once) { return reported([&] { return render_command(once); }); });
    if (*render_app) return render_command(render);
    if (*new_app) return new_command(create);
    if (*tune_app) return tune(tuning);
    if (*encode_app) return encode_command(encode);
    if (*frame_app) return frame_command(frame);
    if (*sheet_app) return sheet_command(sheet);
    if (*sweep_app) return sweep_command(sweep);
    if (*simulate_app) return simulate_command(simulate);
    if (*bench_app) return bench_command(bench);
    if (*export_app) return export_command(exporting);
    if (*cache_app) return cache_command(caches);
    if (*farm_app) return farm_command(farm);
    if (*validate_app) return validate_command(validate);
    if (*schema_app) return schema_command(reference);
    if (*info_app) return info_command(info, info_json);
    if (*presets_app) return presets_command(preset);
    if (*compare_app) return compare_command(compare);
    if (*bless_app) return bless_command(bless);
    if (*man_app || *completion_app) {
      fmt::print("{}", *man_app ? manual_page(app) : shell_completion(app, shell));
      return static_cast<int>(kOk);
    }
    return *doctor_app ? doctor_command() : static_cast<int>(kUsage);
  });
}

}  // namespace

}  // namespace offstage::producer
