#include "producer/cli/options.h"

#include <map>
#include <stdexcept>

#include <CLI/CLI.hpp>

namespace offstage::producer {
namespace {

const std::map<std::string, ProgressStyle> kProgressStyles = {{"auto", ProgressStyle::automatic},
                                                              {"bar", ProgressStyle::bar},
                                                              {"plain", ProgressStyle::plain},
                                                              {"json", ProgressStyle::json},
                                                              {"none", ProgressStyle::none}};

}  // namespace

void add_allow(CLI::App& command, std::vector<std::string>& allow) {
  command
      .add_option(
          "--allow", allow,
          "Allow the scene to read files from this folder, too: includes, models, textures (repeatable)")
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

void add_log_options(CLI::App& command, LogOptions& log_options) {
  command
      .add_option("--progress", log_options.progress,
                  "auto: a bar on a terminal, lines in a log file, nothing on a pipe; bar, plain, json, none")
      ->transform(CLI::CheckedTransformer(kProgressStyles).description(""));
  command.add_flag("-q,--quiet", log_options.quiet, "Print errors only");
  command.add_flag("-v,--verbose", log_options.verbose, "Print more: stage times, memory");
}

void add_channels(CLI::App& app, SceneOptions& scene) {
  app.add_option("--channels", scene.channels,
                 "Also write channels beside every frame, or into FILM.channels beside a video:\ndepth [m], "
                 "normal, id, motion [px since the previous frame]; several with commas")
      ->delimiter(',')
      ->check(CLI::IsMember({"depth", "normal", "id", "motion"}));
  app.add_option("--channel-format", scene.channel_format,
                 "exr: FRAME.exr with all channels as floating-point numbers; png: FRAME.depth.png and so "
                 "on, each with its scale in its comment")
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

void add_camera(CLI::App& command, SceneOptions& scene) {
  command.add_option("--camera", scene.camera, "Name of a camera of the scene to draw instead of `camera`");
}

}  // namespace offstage::producer
