// The command render: makes a film.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <tbb/global_control.h>

#include "producer/base/interrupt.h"
#include "producer/base/log.h"
#include "producer/base/suggest.h"
#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/cli/hidden_folder.h"
#include "producer/cli/options.h"
#include "producer/cli/run_progress.h"
#include "producer/run/fingerprint.h"
#include "producer/run/frame_list.h"
#include "producer/run/output.h"
#include "producer/run/production.h"
#include "producer/run/run_notes.h"
#include "producer/run/run_report.h"
#include "producer/run/snapshot_cache.h"
#include "producer/run/watch.h"
#include "render/context.h"
#include "render/error.h"
#include "render/frame_files.h"
#include "render/image_io.h"
#include "render/sink.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;

// Limit on the states that are kept on the disk for further cameras.
constexpr uint64_t kStatesBytes = 4ull << 30;

struct Plan {
  LoadedScene loaded;
  OutputTarget target;
  std::vector<int> frames;
  std::string settings;
  int threads = 1, jobs = 1;
  // Whether the frames are drawn to files first, and then encoded to a video. Such a run can be resumed.
  bool through_frames = false;
  fs::path frames_pattern;  // pattern of these frames
  ChannelFiles channels;
};

render::VideoDef video_def(const Plan& plan, const std::function<bool()>& stop = {}) {
  const Scene& scene = plan.loaded.scene;
  return {.path = plan.target.path,
          .width_px = scene.render.size.x(),
          .height_px = scene.render.size.y(),
          .fps = scene.output.fps,
          .alpha = scene.environment.background == Background::transparent,
          .stop = [stop] { return interrupt_signal() != 0 || (stop && stop()); }};
}

int print_plan(const Plan& plan) {
  const Scene& scene = plan.loaded.scene;
  const double pixels = double(scene.render.size.x()) * scene.render.size.y();
  constexpr double kPngBytesPerPixel = 0.8;  // mean over the scenes of the gallery
  const nlohmann::ordered_json json = {
      {"scene", scene.name},
      {"output", plan.target.kind == OutputKind::pipe ? "-" : plan.target.path.string()},
      {"frames", plan.frames.size()},
      {"first_frame", plan.frames.empty() ? 0 : plan.frames.front()},
      {"last_frame", plan.frames.empty() ? 0 : plan.frames.back()},
      {"size", {scene.render.size.x(), scene.render.size.y()}},
      {"fps", fps_json(scene.output.fps)},
      {"subframes", subframes(scene.render.quality)},
      {"threads", plan.threads},
      {"jobs", plan.jobs},
      {"png_mb_estimate",
       std::round(pixels * kPngBytesPerPixel * static_cast<double>(plan.frames.size()) / 1e5) / 10},
      {"settings", plan.settings}};
  fmt::print("{}\n", json.dump(2));
  return kOk;
}

/// Checks that the format of the frames suits the scene. Warns if it loses data, or throws an exception.
void check_format(const Plan& plan) {
  if (plan.target.kind != OutputKind::frames) return;
  const Scene& scene = plan.loaded.scene;
  const auto format = render::frame_format(plan.frames_pattern);
  if (format == render::FrameFormat::jpeg && scene.environment.background == Background::transparent)
    throw OutputError(
        plan.frames_pattern.string() +
        ": JPEG has no transparency; write PNG or EXR, or set environment.background to \"sky\"");
  const bool texts = std::ranges::any_of(
      scene.overlays, [](const Overlay& overlay) { return std::holds_alternative<TextOverlay>(overlay); });
  if (format == render::FrameFormat::exr && texts)
    log("warning: the text overlays are not in the EXR frames, which contain only the light of the scene\n");
}

Plan make_plan(const RenderOptions& options, const ModelLibrary& models, LoadedScene loaded) {
  Plan plan{.loaded = std::move(loaded), .target = parse_output(options.out)};
  plan.frames = parse_frames(options.frames, plan.loaded.scene.frame_count());
  if (!options.chunk.empty()) plan.frames = chunk_of(plan.frames, options.chunk);
  plan.settings = frame_settings(plan.loaded, models, options.gl);
  plan.threads = threads_or_all(options.threads);
  // llvmpipe already draws one frame with all processors. On two processors, a second drawing thread takes
  // about 100 MB and more processor time, and saves about 2 % of wall time. With more processors, the serial
  // part of a frame leaves some of them idle.
  plan.jobs = options.jobs > 0 ? options.jobs : std::max(1, plan.threads / 2);
  plan.through_frames = plan.target.kind == OutputKind::video && options.resume;
  plan.frames_pattern =
      plan.through_frames ? fs::path(plan.target.path.string() + ".frames") / "####.png" : plan.target.path;
  const OutputSettings& output = plan.loaded.scene.output;
  plan.channels = {{output.channels, output.channel_format},
                   plan.target.kind == OutputKind::frames ? channels_stem(plan.frames_pattern)
                                                          : channels_folder(plan.target.path) / "####"};
  check_format(plan);
  return plan;
}

/// Makes the video from finished frames. Returns false after a signal.
bool assemble_video(const Plan& plan) {
  auto video = render::make_video_sink(video_def(plan));
  for (const int frame : plan.frames) {
    if (interrupt_signal()) return false;
    video->write(frame, render::read_image(render::frame_path(plan.frames_pattern, frame)));
  }
  video->close();
  return true;
}

OutputLock lock_film(const Plan& plan) {
  const fs::path& film = plan.target.path;
  std::error_code error;
  if (film.has_parent_path()) fs::create_directories(film.parent_path(), error);
  if (error)
    throw render::FileError(film.parent_path().string() + ": cannot create the folder: " + error.message());
  return OutputLock(OutputLock::beside(film), film.string());
}

RunStats draw(const Plan& plan, const ModelLibrary& models, const RenderOptions& options,
              std::vector<int> frames, render::FrameSink& sink) {
  RunProgress progress(plan.loaded.scene, models, options.log);
  RenderJob job{
      .frames = std::move(frames), .threads = plan.jobs, .cache = {}, .report = !options.report.empty()};
  if (!options.cache.empty()) job.cache = options.cache;
  if (!options.states.empty()) {
    const SnapshotCache states(options.states);
    const bool known = states.holds(simulation_key(plan.loaded, models), plan.loaded.scene.frame_count());
    (known ? job.cache : job.keep) = options.states;
    job.keep_at_most = kStatesBytes;
  }
  job.channels = plan.channels.choice;
  job.channels_stem = plan.channels.stem;
  job.stop = options.stop;
  std::unique_ptr<StateSource> states;
  if (options.states_of) states = options.states_of(plan.loaded, models, job.frames.back());
  job.states = states.get();
  RunStats stats = render_frames(plan.loaded, models, job, sink, std::ref(progress));
  progress.finish();
  if (job.report) write_text_file(options.report, run_report(plan.loaded, plan.settings, stats));
  return stats;
}

int render_to_frames(const Plan& plan, const ModelLibrary& models, const RenderOptions& options) {
  const Scene& scene = plan.loaded.scene;
  const Existing existing = options.force    ? Existing::replace
                            : options.resume ? Existing::keep
                                             : Existing::refuse;
  std::optional<OutputLock> film_lock;
  if (plan.through_frames) film_lock.emplace(lock_film(plan));
  if (plan.through_frames && plan.channels.choice.any())
    fs::create_directories(plan.channels.stem.parent_path());
  FrameFolder folder = prepare_frames(plan.frames_pattern, plan.channels, plan.frames,
                                      {.scene = scene.name,
                                       .settings = plan.settings,
                                       .width_px = scene.render.size.x(),
                                       .height_px = scene.render.size.y(),
                                       .frames = scene.frame_count(),
                                       .fps = scene.output.fps},
                                      existing);
  RunStats stats;
  if (!folder.missing.empty()) {
    auto sink = render::make_frame_sink(plan.frames_pattern, plan.settings);
    stats = draw(plan, models, options, folder.missing, *sink);
  }
  stats.frames_kept = static_cast<int>(plan.frames.size() - folder.missing.size());
  if (plan.through_frames && !stats.interrupted_by) {
    if (!assemble_video(plan)) stats.interrupted_by = interrupt_signal();
  }
  if (plan.through_frames && !stats.interrupted_by) {
    folder.lock = {};  // releases the lock, because its file would prevent the removal of the folder
    remove_frames(plan.frames_pattern.parent_path());
  }
  report_run(stats, options.log, options.stats);
  if (stats.interrupted_by)
    return interrupted(stats, static_cast<int>(plan.frames.size()),
                       options.force ? "; continue with the same command and --resume instead of --force"
                                     : "; continue with the same command and --resume");
  if (options.prints_name) print_output_name(plan.target.path.string());
  return kOk;
}

int render_to_video(const Plan& plan, const ModelLibrary& models, const RenderOptions& options) {
  // An incomplete film must not look like a complete one, and must not replace one. So the film gets its name
  // only when it has all frames.
  render::VideoDef def = video_def(plan, options.stop);
  const OutputLock lock = lock_film(plan);
  const fs::path partial = def.path.replace_extension(".partial" + plan.target.path.extension().string());
  if (plan.channels.choice.any()) prepare_channels(plan.channels.stem.parent_path(), options.force);
  auto sink = render::make_video_sink(def);
  const RunStats stats = draw(plan, models, options, plan.frames, *sink);
  if (!stats.interrupted_by) {
    fs::rename(partial, plan.target.path);
    if (!plan.channels.choice.any())
      remove_channels(channels_folder(plan.target.path));  // channels of an earlier film
  }
  report_run(stats, options.log, options.stats);
  if (!stats.interrupted_by) {
    if (options.prints_name) print_output_name(plan.target.path.string());
    return kOk;
  }
  return interrupted(stats, static_cast<int>(plan.frames.size()),
                     (stats.frames > 0 ? "; they are in " + partial.string() : std::string()) +
                         "; to be able to continue a video, start it with --resume");
}

int render_to_pipe(const Plan& plan, const ModelLibrary& models, const RenderOptions& options) {
  const Scene& scene = plan.loaded.scene;
  auto sink = render::make_pipe_sink(options.format == "y4m", scene.render.size.x(), scene.render.size.y(),
                                     scene.output.fps, [] { return interrupt_signal() != 0; });
  const RunStats stats = draw(plan, models, options, plan.frames, *sink);
  report_run(stats, options.log, options.stats);
  return stats.interrupted_by ? interrupted(stats, static_cast<int>(plan.frames.size()), "") : kOk;
}

/// Returns the output for one of several cameras: film-NAME.mp4, or frames/NAME/####.png.
std::string output_of_camera(const std::string& out, const std::string& camera) {
  const OutputTarget target = parse_output(out);
  if (target.kind == OutputKind::pipe)
    throw OutputError("-: standard output takes the frames of one camera; give a folder or a file");
  const fs::path& path = target.path;
  if (target.kind == OutputKind::frames) return (path.parent_path() / camera / path.filename()).string();
  return (path.parent_path() / (path.stem().string() + "-" + camera + path.extension().string())).string();
}

std::string file_of_camera(const std::string& file, const std::string& camera) {
  const fs::path path = file;
  return file.empty()
             ? ""
             : (path.parent_path() / (path.stem().string() + "-" + camera + path.extension().string()))
                   .string();
}

/// Renders the films of several cameras one after the other. Only the first film is simulated; its states are
/// kept for the others. A resumed run keeps no states, because each film may lack different frames.
int render_cameras(const RenderOptions& options) {
  const LoadedScene loaded = load(options.scene, true);
  const std::vector<std::string> known = camera_names(loaded.scene);
  std::vector<std::string> names = options.cameras;
  if (std::ranges::find(names, kAllCameras) != names.end()) names = known;
  for (const std::string& name : names)
    if (std::ranges::find(known, name) == known.end())
      throw std::invalid_argument("there is no camera '" + name + "'" + suggestion(name, known));
  for (const std::string& name : names) {
    const OutputTarget target = parse_output(output_of_camera(options.out, name));
    if (target.kind == OutputKind::video) check_file(target.path.string(), options.force);
  }
  std::optional<HiddenFolder> states;
  if (options.cache.empty() && !options.resume && !options.dry_run && names.size() > 1)
    states.emplace(parse_output(options.out).path, "states");
  for (const std::string& name : names) {
    RenderOptions one = options;
    one.cameras = {name};
    one.out = output_of_camera(options.out, name);
    one.stats = file_of_camera(options.stats, name);
    one.report = file_of_camera(options.report, name);
    if (states) one.states = states->path().string();
    const int code = render_command(one);
    if (code != kOk) return code;
  }
  return kOk;
}

/// Returns the names of all files that a run may replace or remove.
std::vector<std::string> replaced_files(const Plan& plan, const RenderOptions& options) {
  std::vector<std::string> files = {options.stats, options.report};
  if (plan.target.kind == OutputKind::video) files.push_back(plan.target.path.string());
  if (plan.target.kind != OutputKind::frames || !options.force) return files;
  for (const int frame : plan.frames)
    files.push_back(render::frame_path(plan.frames_pattern, frame).string());
  for (const fs::path& file : files_of_frames(plan.frames_pattern.parent_path()))
    files.push_back(file.string());
  return files;
}

}  // namespace

std::string frame_settings(const LoadedScene& loaded, const ModelLibrary& models, render::GlPlatform gl) {
  // A GPU draws pixels that differ from the pixels of the processor.
  return settings_key(loaded, models) + (gl == render::GlPlatform::egl_gpu ? "-gpu" : "");
}

void check_file(const std::string& file, bool force) {
  if (file.empty()) return;
  const fs::path folder = fs::path(file).parent_path();
  std::error_code error;
  if (!folder.empty() && !fs::is_directory(folder, error))
    throw OutputError(file + ": there is no folder " + folder.string());
  const fs::file_status status = fs::symlink_status(file, error);
  if (status.type() == fs::file_type::not_found) return;
  if (status.type() == fs::file_type::none) throw OutputError(file + ": " + error.message());
  if (status.type() == fs::file_type::symlink)
    throw OutputError(file + ": is a symbolic link, which outputs do not follow; name the file itself");
  if (status.type() != fs::file_type::regular) throw OutputError(file + ": is not a regular file");
  if (!force) throw OutputError(file + ": exists already; replace it with --force");
}

void check_not_read(const std::vector<std::string>& outputs, const SceneOptions& scene) {
  std::vector<std::string> existing;
  std::ranges::copy_if(outputs, std::back_inserter(existing),
                       [](const std::string& file) { return !file.empty() && fs::exists(file); });
  if (existing.empty() || scene.from_standard_input()) return;
  const std::set<fs::path> inputs = files_of_scene(scene.file, scene.overrides());
  for (const std::string& file : existing)
    for (const fs::path& input : inputs)
      if (std::error_code error; fs::equivalent(file, input, error))
        throw OutputError(file + ": is read by the scene; give the output another name");
}

void check_distinct(const std::string& a, const std::string& b) {
  if (!a.empty() && fs::path(a).lexically_normal() == fs::path(b).lexically_normal())
    throw OutputError(a + ": is used for two outputs; give them different names");
}

void check_png(const std::string& file) {
  if (fs::path(file).extension() != ".png")
    throw OutputError(file + ": a picture is a PNG file; give a name ending in .png");
  check_folder(file);
}

int checked_frame(const Scene& scene, double number) {
  const int count = scene.frame_count();
  if (number >= 1 && number <= count) return static_cast<int>(number);
  throw std::invalid_argument(
      fmt::format("frame {} is outside the film; it has frames 1-{}, times {:g} to {:g} s", number, count,
                  scene.output.start, scene.output.time_of(count)));
}

int frame_at(const Scene& scene, double time) {
  const int count = scene.frame_count();
  const double number = 1 + std::round((time - scene.output.start) * scene.output.fps.per_second());
  if (number >= 1 && number <= count) return static_cast<int>(number);
  throw std::invalid_argument(fmt::format("the time {:g} s is outside the film, which shows {:g} to {:g} s",
                                          time, scene.output.start, scene.output.time_of(count)));
}

std::string default_film(const std::string& scene_file) {
  if (scene_file == kStandardInput)
    throw OutputError("a scene from standard input has no file name; name the film with -o FILM.mp4");
  return fs::path(scene_file).stem().string() + ".mp4";
}

int render_command(const RenderOptions& given) {
  if (given.cameras.size() > 1 || (given.cameras.size() == 1 && given.cameras.front() == kAllCameras))
    return render_cameras(given);
  RenderOptions options = given;
  if (options.cameras.size() == 1) options.scene.camera = options.cameras.front();
  LoadedScene loaded = load(options.scene, options.log.quiet);
  const ModelLibrary models = load_models(loaded, options.scene, options.log);
  const Plan plan = make_plan(options, models, std::move(loaded));
  if (plan.target.kind == OutputKind::video) {
    render::check_video(video_def(plan));
    check_file(plan.target.path.string(), options.force);
    if (!options.chunk.empty())
      throw OutputError(
          plan.target.path.string() +
          ": a video cannot be rendered in parts; render them as frames (-o frames/####.png --chunk " +
          options.chunk + "), then: offstage encode frames/ -o " + plan.target.path.filename().string());
    const fs::path stale = channels_folder(plan.target.path);
    if (!plan.channels.choice.any() && !options.force && holds_channels(stale))
      throw OutputError(stale.string() +
                        ": contains channels of an earlier film; remove it, or replace it with --force");
  }
  check_file(options.stats, options.force || options.resume);
  check_distinct(options.stats, options.out);
  check_file(options.report, options.force || options.resume);
  check_distinct(options.report, options.out);
  check_distinct(options.report, options.stats);
  check_not_read(replaced_files(plan, options), options.scene);
  if (plan.channels.choice.any() && plan.target.kind == OutputKind::pipe)
    throw OutputError("-: channels are files beside frames or a video; choose a folder or a file as output");
  if (options.dry_run) return print_plan(plan);
  if (plan.frames.empty()) {
    log("note: this chunk has no frames: there are fewer frames than chunks\n");
    return kOk;
  }

  const auto threads = simulation_threads(options.threads);
  render::pin_environment(plan.threads, options.gl);
  render::Context();  // throws if a library is missing, before anything is written
  if (plan.target.kind == OutputKind::pipe) return render_to_pipe(plan, models, options);
  if (plan.target.kind == OutputKind::frames || plan.through_frames)
    return render_to_frames(plan, models, options);
  return render_to_video(plan, models, options);
}

Command add_render(CLI::App& app, const WatchCommand& watch) {
  const auto options = std::make_shared<RenderOptions>();
  RenderOptions& render = *options;
  CLI::App* command = app.add_subcommand("render", "Simulate a scene and draw it: frames or a video");
  add_scene(*command, render.scene);
  command->add_option(
      "-o,--output", render.out,
      "frames/####.png (or .jpg, .exr) or a folder; .mp4 .webm .mov .mkv .gif .webp .apng .png; "
      "- for standard "
      "output");
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
                 "of cameras,\nlights and looks need no new simulation")
      ->excludes(resume)
      ->excludes(dry_run);
  command->add_option("--stats", render.stats, "Write statistics of the run to this JSON file");
  command->add_option("--report", render.report,
                      "Write pictures, plots, settings and hashes of the run to this HTML file");
  add_log_options(*command, render.log);
  return {command, [options, watch] {
            if (options->out.empty()) options->out = default_film(options->scene.file);
            return options->watch ? watch(*options) : render_command(*options);
          }};
}

}  // namespace offstage::producer
