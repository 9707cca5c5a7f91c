#include "producer/command_line.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <new>

#include <CLI/CLI.hpp>
#include <fcntl.h>
#include <fmt/format.h>

#include "producer/commands.h"
#include "producer/error.h"
#include "producer/interrupt.h"
#include "producer/output.h"
#include "producer/simulation.h"
#include "producer/talk.h"
#include "producer/version.h"
#include "render/error.h"

namespace offstage::producer {
namespace {

constexpr const char* kExitCodes =
    "Exit codes: 0 ok, 1 run failed, 2 usage, 3 scene invalid, 4 GL or encoder unavailable, 5 simulation "
    "diverged,\n"
    "6 images differ, 130 interrupted (Ctrl-C), 143 terminated.";

const std::map<std::string, ProgressStyle> kProgressStyles = {{"auto", ProgressStyle::automatic},
                                                              {"plain", ProgressStyle::plain},
                                                              {"json", ProgressStyle::json},
                                                              {"none", ProgressStyle::none}};

void add_overrides(CLI::App& command, SceneOptions& scene) {
  command
      .add_option("--set", scene.set,
                  "Override a value of the scene: path=value, such as emitters.0.rate=200")
      ->allow_extra_args(false);
  command.add_option("--seed", scene.seed, "Seed of everything random");
  command.add_flag("--no-cache", scene.no_cache,
                   "Cut models into convex parts anew instead of keeping them in ~/.cache/offstage");
}

void add_scene(CLI::App& command, SceneOptions& scene) {
  command.add_option("scene", scene.file, "Scene file")->required();
  add_overrides(command, scene);
}

void add_timing(CLI::App& command, SceneOptions& scene) {
  command.add_option("--fps", scene.fps, "Frames per second");
  command.add_option("--duration", scene.duration, "Length of the film in seconds");
}

void add_quality(CLI::App& command, SceneOptions& scene) {
  command
      .add_option("--quality", scene.quality,
                  "Sub-frames per frame: draft 1, preview 4, final 16 (the physics stays)")
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
  command.add_option("--progress", talk.progress, "auto, plain, json or none")
      ->transform(CLI::CheckedTransformer(kProgressStyles).description(""));
  command.add_flag("-q,--quiet", talk.quiet, "Say nothing but errors");
  command.add_flag("-v,--verbose", talk.verbose, "Say more: stage times, memory");
}

void add_channels(CLI::App& app, SceneOptions& scene) {
  app.add_option("--channels", scene.channels,
                 "Also write numbers for each pixel beside every frame, or in FILM.channels beside a video:\n"
                 "depth [m], normal, id, motion [px since the frame before]; several with commas")
      ->delimiter(',')
      ->check(CLI::IsMember({"depth", "normal", "id", "motion"}));
  app.add_option("--channel-format", scene.channel_format,
                 "exr: FRAME.exr with all numbers as they are; png: FRAME.depth.png and so on, scaled")
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
          "What draws: osmesa or egl, with the same pixels by llvmpipe; egl:gpu, a graphics card; auto, the\n"
          "first of osmesa and egl that is installed")
      ->envname("OFFSTAGE_GL");
}

void add_threads(CLI::App& command, int& threads) {
  command.add_option("--threads", threads, "Threads of the simulation (default: all available)")
      ->check(CLI::Range(1, 256));
}

CLI::App* add_sheet(CLI::App& app, SheetOptions& sheet) {
  CLI::App* command =
      app.add_subcommand("sheet", "Draw frames of the whole film small, in one PNG with time codes");
  add_scene(*command, sheet.scene);
  command->add_option("-o,--output", sheet.out, "PNG file")->required();
  command->add_option("--count", sheet.count, "How many frames, evenly from the first to the last")
      ->check(CLI::Range(1, 400))
      ->capture_default_str();
  command->add_option("--columns", sheet.columns, "Pictures in a row")->check(CLI::Range(1, 100));
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
      "sweep", "Run a scene with different values: one labelled PNG of all, a CSV of their figures");
  add_scene(*command, sweep.scene);
  command
      ->add_option("--vary", sweep.vary,
                   "What varies: path=a:b:step or path=x,y,z, such as emitters.0.rate=100:400:50; given\n"
                   "several times, every combination is run (at most 256)")
      ->required()
      ->allow_extra_args(false);
  command
      ->add_option("--at", sweep.at, "Times of the pictures in seconds: 1 or 0.5,1,2 (default: the middle)")
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("-o,--output", sweep.out, "PNG file")->required();
  command->add_option("--csv", sweep.csv,
                      "Figures of every run at the last of the times (default: beside the PNG)");
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
  command->add_flag("-q,--quiet", sweep.quiet, "Say nothing but errors and failed runs");
  return command;
}

/// A program started with a standard stream closed would otherwise find its own files under that number.
void open_standard_streams() {
  for (int fd = 0; fd <= 2; ++fd)
    if (fcntl(fd, F_GETFD) < 0)
      open("/dev/null", fd == 0 ? O_RDONLY : O_WRONLY);  // takes the lowest free number
}

/// Results that could not be written are a failure, whatever the command did.
int flushed(int code) {
  if (std::fflush(stdout) == 0 && !std::ferror(stdout)) return code;
  say("offstage: standard output: {}\n", std::strerror(errno));
  return code == kOk ? kRunFailed : code;
}

/// The exit code of a command; what it throws becomes a message and a code of its own.
int reported(const std::function<int()>& command) {
  try {
    return command();
  } catch (const SceneError& error) {
    say("{}\n", error.what());
    return kSceneInvalid;
  } catch (const OutputError& error) {
    say("offstage: {}\n", error.what());
    return kUsage;
  } catch (const std::invalid_argument& error) {
    say("offstage: {}\n", error.what());
    return kUsage;
  } catch (const render::UnavailableError& error) {
    say("offstage: {}\n", error.what());
    return kUnavailable;
  } catch (const DivergedError& error) {
    const std::string file = "offstage-diverged.json";
    say("offstage: {}\n", error.what());
    try {
      write_text_file(file, error.state());
      say("the state was saved to {}\n", file);
    } catch (const render::FileError& unsaved) {
      say("the state could not be saved: {}\n", unsaved.what());
    }
    return kDiverged;
  } catch (const Interrupted& interrupted) {
    say("interrupted\n");
    return 128 + interrupted.signal();
  } catch (const std::bad_alloc&) {
    say("offstage: out of memory\n");
    return kRunFailed;
  } catch (const std::exception& error) {
    say("offstage: {}\n", error.what());
    return kRunFailed;
  }
}

int dispatch(int argc, char** argv);

}  // namespace

int run(int argc, char** argv) {
  open_standard_streams();
  install_signal_handlers();
  return flushed(dispatch(argc, argv));
}

namespace {

int dispatch(int argc, char** argv) {
  CLI::App app{"offstage turns a scene file into a physically simulated film, without a display or a GPU."};
  app.set_version_flag("--version", "offstage " + std::string(version_text()));
  app.require_subcommand(1);
  app.fallthrough(false);
  app.footer(kExitCodes);

  RenderOptions render;
  auto* render_app = app.add_subcommand("render", "Simulate a scene and draw it: frames or a video");
  add_scene(*render_app, render.scene);
  render_app
      ->add_option(
          "-o,--output", render.out,
          "frames/####.png or a folder; .mp4 .webm .mov .gif .webp .apng .png; - for standard output")
      ->required();
  add_picture(*render_app, render.scene);
  add_timing(*render_app, render.scene);
  render_app->add_option("--frames", render.frames, "Which frames: 1-30,40,50-90x2 (negative from the end)");
  render_app->add_option("--chunk", render.chunk, "i/n: the i-th of n parts of the frames");
  render_app->add_option("--cache", render.cache,
                         "Draw from the snapshots of `simulate --cache` instead of simulating");
  render_app->add_option("--format", render.format, "Of standard output: rgba or y4m")
      ->check(CLI::IsMember({"rgba", "y4m"}));
  add_threads(*render_app, render.threads);
  add_gl(*render_app, render.gl);
  render_app->add_option("--jobs", render.jobs, "Frames drawn at the same time (default: half of --threads)")
      ->check(CLI::Range(1, 64));
  auto* resume =
      render_app->add_flag("--resume", render.resume, "Keep finished frames that have the same settings");
  add_channels(*render_app, render.scene);
  render_app->add_flag("--force", render.force, "Replace existing output")->excludes(resume);
  auto* dry_run =
      render_app->add_flag("--dry-run", render.dry_run, "Print the plan as JSON and write nothing");
  render_app
      ->add_flag("--watch", render.watch,
                 "Render again whenever the scene, an include, a model or a texture changes, until Ctrl-C;\n"
                 "only whole results replace the output, and errors of the scene keep the last one")
      ->excludes(resume)
      ->excludes(dry_run);
  render_app->add_option("--stats", render.stats, "Write figures of the run to this JSON file");
  render_app->add_option("--report", render.report,
                         "Write pictures, plots, settings and hashes of the run to this HTML file");
  add_talk(*render_app, render.talk);

  FrameOptions frame;
  auto* frame_app = app.add_subcommand("frame", "Draw one frame to a PNG");
  add_scene(*frame_app, frame.scene);
  frame_app->add_option("-o,--output", frame.out, "PNG file")->required();
  auto* number =
      frame_app->add_option("-n,--frame", frame.frame, "Number of the frame (negative from the end)");
  frame_app->add_option("--at", frame.at, "Time in seconds instead")->excludes(number);
  add_picture(*frame_app, frame.scene);
  add_timing(*frame_app, frame.scene);
  add_threads(*frame_app, frame.threads);
  add_gl(*frame_app, frame.gl);
  add_channels(*frame_app, frame.scene);
  frame_app->add_flag("--force", frame.force, "Replace an existing file");
  add_talk(*frame_app, frame.talk);

  SheetOptions sheet;
  auto* sheet_app = add_sheet(app, sheet);
  SweepOptions sweep;
  auto* sweep_app = add_sweep(app, sweep);

  SimulateOptions simulate;
  auto* simulate_app = app.add_subcommand("simulate", "Run the physics alone; prints its figures as JSON");
  add_scene(*simulate_app, simulate.scene);
  add_timing(*simulate_app, simulate.scene);
  simulate_app->add_option("--trace", simulate.trace,
                           "CSV of position, orientation and velocities of what moves");
  simulate_app->add_option("--contacts", simulate.contacts,
                           "CSV of the points where bodies touch, with the forces there");
  simulate_app->add_option("--cloths", simulate.cloths, "CSV of strain and contacts of cloths");
  simulate_app->add_option("--joints", simulate.joints, "CSV of what joints bear and how they stand");
  simulate_app->add_option("--trace-every", simulate.trace_every, "frame or step, of all of these")
      ->check(CLI::IsMember({"frame", "step"}));
  simulate_app->add_option("--cache", simulate.cache,
                           "Folder for one snapshot per frame, for `render --cache`");
  simulate_app->add_option("--stats", simulate.stats, "Write the figures to this JSON file instead");
  add_threads(*simulate_app, simulate.threads);
  simulate_app->add_flag("--force", simulate.force, "Replace existing output");
  add_talk(*simulate_app, simulate.talk);

  SceneOptions validate;
  bool validate_json = false;
  auto* validate_app = app.add_subcommand("validate", "Check a scene and report every problem");
  add_scene(*validate_app, validate);
  validate_app->add_flag("--json", validate_json, "Print the result as JSON");

  bool reference = false;
  auto* schema_app = app.add_subcommand("schema", "Print the JSON Schema of the scene format");
  schema_app->add_flag("--reference", reference, "Print the reference in Markdown instead");

  std::string preset;
  auto* presets_app = app.add_subcommand(
      "presets", "List the effects, fabrics and articulations that scenes can name, or print one");
  presets_app->add_option("name", preset, "Preset, fabric or articulation to print");

  SceneOptions info;
  bool info_json = false;
  auto* info_app = app.add_subcommand("info", "Describe a scene or a model file");
  info_app->add_option("file", info.file, "Scene (.json) or model file")->required();
  add_overrides(*info_app, info);
  info_app->add_flag("--json", info_json, "Print as JSON");

  CompareOptions compare;
  compare.golden = "tests/golden";
  auto* compare_app =
      app.add_subcommand("compare", "Compare a scene with its golden, or two pictures or folders of frames");
  compare_app->add_option("a", compare.scene.file, "Scene, picture or folder")->required();
  compare_app->add_option("b", compare.other, "Second picture or folder");
  compare_app->add_option("--golden", compare.golden, "Folder of the goldens")->capture_default_str();
  compare_app->add_option("--report", compare.report,
                          "Folder for expected, actual, difference and a page that shows them");
  add_overrides(*compare_app, compare.scene);
  add_threads(*compare_app, compare.threads);
  add_gl(*compare_app, compare.gl);

  BlessOptions bless;
  bless.golden = "tests/golden";
  auto* bless_app = app.add_subcommand("bless", "Renew the goldens of scenes");
  bless_app->add_option("scenes", bless.scenes, "Scene files")->required();
  bless_app->add_option("--golden", bless.golden, "Folder of the goldens")->capture_default_str();
  bless_app->add_option("--reason", bless.reason, "Why the pictures changed")->required();
  add_threads(*bless_app, bless.threads);
  add_gl(*bless_app, bless.gl);

  auto* doctor_app = app.add_subcommand("doctor", "Say what this machine has: GL, encoders, processor");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kOk : kUsage;
  }

  return reported([&] {
    if (*render_app && render.watch)
      return watch_command(
          render, [](const RenderOptions& once) { return reported([&] { return render_command(once); }); });
    if (*render_app) return render_command(render);
    if (*frame_app) return frame_command(frame);
    if (*sheet_app) return sheet_command(sheet);
    if (*sweep_app) return sweep_command(sweep);
    if (*simulate_app) return simulate_command(simulate);
    if (*validate_app) return validate_command(validate, validate_json);
    if (*schema_app) return schema_command(reference);
    if (*info_app) return info_command(info, info_json);
    if (*presets_app) return presets_command(preset);
    if (*compare_app) return compare_command(compare);
    if (*bless_app) return bless_command(bless);
    return *doctor_app ? doctor_command() : static_cast<int>(kUsage);
  });
}

}  // namespace

}  // namespace offstage::producer
