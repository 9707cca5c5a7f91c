// The command sheet: draws small frames of the whole film in one picture.

#include <algorithm>
#include <cmath>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "producer/base/log.h"
#include "producer/base/time_code.h"
#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/cli/options.h"
#include "producer/cli/run_progress.h"
#include "producer/run/contact_sheet.h"
#include "producer/run/output.h"
#include "producer/run/production.h"
#include "render/context.h"
#include "render/image_io.h"

namespace offstage::producer {
namespace {

struct SheetOptions {
  SceneOptions scene;
  LogOptions log;
  std::string out;
  int count = 12, columns = 0;  ///< columns 0: chosen according to the count
  int threads = 0;
  bool force = false;
  render::GlPlatform gl = render::GlPlatform::automatic;
};

/// Returns `count` evenly distributed frames from the first to the last; for a count of 1, the middle frame.
std::vector<int> spread_frames(int count, int total) {
  count = std::min(count, total);
  if (count == 1) return {(total + 1) / 2};
  std::vector<int> frames;
  for (int i = 0; i < count; ++i)
    frames.push_back(1 + static_cast<int>(std::lround(i * (total - 1.0) / (count - 1))));
  return frames;
}

class CellSink : public render::FrameSink {
 public:
  explicit CellSink(const Scene& scene) : scene_(scene) {}
  void write(int frame, const render::Image& image) override {
    const double time = scene_.output.time_of(frame);
    cells.push_back({{fmt::format("{}  frame {}", time_code(time), frame)}, image});
  }
  void close() override {}

  std::vector<SheetCell> cells;

 private:
  const Scene& scene_;
};

}  // namespace

std::string small_size(const Scene& scene, int longer_side_px) {
  const Eigen::Vector2i size = scene.render.size;
  const double scale = double(longer_side_px) / size.maxCoeff();
  const auto side = [&](int full) { return std::max(1, static_cast<int>(std::lround(full * scale))); };
  return fmt::format("{}x{}", side(size.x()), side(size.y()));
}

namespace {

int sheet_command(const SheetOptions& options) {
  check_png(options.out);
  check_file(options.out, options.force);
  check_not_read({options.out}, options.scene);
  SceneOptions scene_options = options.scene;
  if (!scene_options.size) scene_options.size = small_size(load(options.scene, true).scene, kSmallSide_px);
  const LoadedScene loaded = load(scene_options, options.log.quiet);
  const Scene& scene = loaded.scene;
  const std::vector<int> frames = spread_frames(options.count, scene.frame_count());
  const int columns = options.columns > 0 ? options.columns : columns_for(frames.size());
  check_sheet_size(frames.size(), columns, scene.render.size.x(), scene.render.size.y());

  const ModelLibrary models = load_models(loaded, options.scene, options.log);
  const auto threads = simulation_threads(options.threads);
  const int jobs = threads_or_all(options.threads);
  render::pin_environment(jobs, options.gl);
  CellSink sink(scene);
  RunProgress progress(scene, models, options.log);
  const RunStats stats = render_frames(loaded, models, {.frames = frames, .threads = jobs, .cache = {}}, sink,
                                       std::ref(progress));
  progress.finish();
  if (stats.interrupted_by) {
    log("interrupted: {} of {} pictures done; nothing was written\n", stats.frames, frames.size());
    return 128 + stats.interrupted_by;
  }
  const std::string heading =
      fmt::format("{}  {:g} s, {} frames/s", scene.name, scene.output.duration, scene.output.fps.text());
  render::write_png(options.out,
                    contact_sheet({heading}, sink.cells, std::min(columns, static_cast<int>(frames.size()))));
  print_output_name(options.out);
  return kOk;
}

}  // namespace

Command add_sheet(CLI::App& app) {
  const auto options = std::make_shared<SheetOptions>();
  SheetOptions& sheet = *options;
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
  add_log_options(*command, sheet.log);
  return {command, [options] { return sheet_command(*options); }};
}

}  // namespace offstage::producer
