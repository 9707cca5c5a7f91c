// The command frame: draws one frame.

#include <filesystem>
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "producer/base/log.h"
#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/cli/run_progress.h"
#include "producer/run/output.h"
#include "producer/run/production.h"
#include "render/frame_files.h"
#include "render/image_io.h"
#include "render/sink.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;

struct FrameOptions {
  SceneOptions scene;
  LogOptions log;
  std::string out;
  std::optional<int> frame;
  std::optional<double> at;
  int threads = 0;
  bool force = false;
  render::GlPlatform gl = render::GlPlatform::automatic;
};

int frame_command(const FrameOptions& options) {
  const LoadedScene loaded = load(options.scene, options.log.quiet);
  const Scene& scene = loaded.scene;
  int frame = 0;
  if (options.at) {
    frame = frame_at(scene, *options.at);
  } else {
    const double wanted = options.frame.value_or(1);
    frame = checked_frame(scene, wanted < 0 ? wanted + scene.frame_count() + 1 : wanted);
  }
  check_png(options.out);
  const render::ChannelChoice channels{scene.output.channels, scene.output.channel_format};
  const fs::path stem = fs::path(options.out).replace_extension();
  std::vector<std::string> files = {options.out};
  for (const fs::path& file : render::channel_files(stem, channels)) files.push_back(file.string());
  for (const std::string& file : files) check_file(file, options.force);
  check_not_read(files, options.scene);

  class PictureSink : public render::FrameSink {
   public:
    PictureSink(fs::path path, std::string settings)
        : path_(std::move(path)), settings_(std::move(settings)) {}
    void write(int, const render::Image& image) override { render::write_png(path_, image, settings_); }
    void close() override {}

   private:
    fs::path path_;
    std::string settings_;
  };
  const ModelLibrary models = load_models(loaded, options.scene, options.log);
  const auto threads = simulation_threads(options.threads);
  render::pin_environment(threads_or_all(options.threads), options.gl);
  PictureSink sink(options.out, frame_settings(loaded, models, options.gl));
  RunProgress progress(scene, models, options.log);
  const RunStats stats = render_frames(
      loaded, models,
      {.frames = {frame}, .threads = 1, .cache = {}, .channels = channels, .channels_stem = stem}, sink,
      std::ref(progress));
  progress.finish();
  report_run(stats, options.log, "");
  if (stats.interrupted_by) return interrupted(stats, 1, "");
  print_output_name(options.out);
  return kOk;
}

}  // namespace

Command add_frame(CLI::App& app) {
  const auto options = std::make_shared<FrameOptions>();
  FrameOptions& frame = *options;
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
  add_log_options(*command, frame.log);
  return {command, [options] { return frame_command(*options); }};
}

}  // namespace offstage::producer
