// The command encode: makes a video of existing frames.

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "producer/base/interrupt.h"
#include "producer/base/json_file.h"
#include "producer/base/log.h"
#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/cli/options.h"
#include "producer/run/frame_sequence.h"
#include "producer/run/output.h"
#include "producer/run/progress.h"
#include "render/error.h"
#include "render/image_io.h"
#include "render/sink.h"
#include "render/tone_map.h"

namespace offstage::producer {
namespace {

struct EncodeOptions {
  std::vector<std::string> frames;  ///< the pattern of the frames, as the only item
  LogOptions log;
  std::string out;
  std::optional<std::string> fps;  ///< frame rate; default: the rate in the manifest beside the frames, or 30
  bool allow_gaps = false, force = false;
};

namespace fs = std::filesystem;

/// Returns the frame rate from the manifest in the folder of the frames, if the manifest belongs to them.
std::optional<render::FrameRate> rate_of_manifest(const fs::path& pattern) {
  const std::optional<JsonObject> manifest = read_json_file(pattern.parent_path() / "manifest.json");
  if (!manifest || manifest->text("pattern") != pattern.filename().string()) return {};
  const nlohmann::json fps = manifest->value("fps");
  return render::parse_frame_rate(fps.is_string() ? fps.get<std::string>() : fps.dump());
}

render::FrameRate rate_of(const EncodeOptions& options, const FrameSequence& sequence) {
  if (!options.fps) return rate_of_manifest(sequence.pattern).value_or(render::FrameRate());
  const auto rate = render::parse_frame_rate(*options.fps);
  if (!rate) throw std::invalid_argument(wrong_frame_rate(*options.fps));
  return *rate;
}

bool is_transparent(const render::Image& image) {
  for (std::size_t i = 3; i < image.rgba.size(); i += 4)
    if (image.rgba[i] != 255) return true;
  return false;
}

/// Returns whether the frames need an alpha channel. They do not if all their pixels are opaque.
bool any_transparent(const FrameSequence& sequence) {
  return sequence.may_be_transparent && std::ranges::any_of(sequence.frames, [](const SequenceFrame& frame) {
           if (interrupt_signal()) throw Interrupted(interrupt_signal());
           return is_transparent(render::read_image(frame.path));
         });
}

/// Composites a picture with straight alpha over black, in linear light.
void composite_over_black(render::Image& image) {
  static const std::array<float, 256> linear = [] {
    std::array<float, 256> table{};
    for (std::size_t i = 0; i < table.size(); ++i)
      table[i] = render::srgb_decode(static_cast<float>(i) / 255);
    return table;
  }();
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    const uint8_t alpha = image.rgba[i + 3];
    if (alpha == 255) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const float light = linear[image.rgba[i + c]] * static_cast<float>(alpha) / 255;
      image.rgba[i + c] = static_cast<uint8_t>(std::lround(255 * render::srgb_encode(light)));
    }
    image.rgba[i + 3] = 255;
  }
}

void check_not_a_frame(const EncodeOptions& options, const FrameSequence& sequence) {
  for (const SequenceFrame& frame : sequence.frames)
    if (fs::exists(options.out) && fs::equivalent(options.out, frame.path))
      throw OutputError(options.out + ": is an input frame and would be overwritten; choose another output");
}

/// Encodes all frames. Returns the number of encoded frames, which is smaller after a signal.
std::size_t encode(const FrameSequence& sequence, const render::VideoDef& def,
                   const LogOptions& log_options) {
  const auto sink = render::make_video_sink(def);
  ProgressPrinter printer(log_options.quiet ? ProgressStyle::none : log_options.progress);
  const auto start = std::chrono::steady_clock::now();
  const auto total = static_cast<int>(sequence.frames.size());
  bool is_noted = false;
  int done = 0;
  for (const SequenceFrame& frame : sequence.frames) {
    if (interrupt_signal()) return static_cast<std::size_t>(done);
    render::Image image = render::read_image(frame.path);
    if (!def.alpha && is_transparent(image)) {
      if (!std::exchange(is_noted, true) && !log_options.quiet)
        log("note: {} has no transparency; transparent frames are composited over black. Use .webm, .mov, "
            ".webp or .apng to keep it\n",
            def.path.extension().string());
      composite_over_black(image);
    }
    const auto encode_start = std::chrono::steady_clock::now();
    sink->write(frame.number, image);
    const auto now = std::chrono::steady_clock::now();
    const double elapsed = std::chrono::duration<double>(now - start).count();
    ++done;
    printer({.done = done,
             .total = total,
             .encode_ms = std::chrono::duration<double, std::milli>(now - encode_start).count(),
             .eta_s = elapsed / done * (total - done),
             .fraction = static_cast<double>(done) / total});
  }
  sink->close();
  printer.finish();
  return sequence.frames.size();
}

}  // namespace

std::string wrong_frame_rate(const std::string& text) {
  return "fps: '" + text +
         "' is not a frame rate; give a number such as 24 or 29.97, or a fraction such as 30000/1001";
}

namespace {

/// Makes a video of existing frames.
int encode_command(const EncodeOptions& options) {
  if (options.frames.size() != 1)
    throw std::invalid_argument(
        "encode: give one pattern in quotes, such as 'frames/####.png', instead of a list of files");
  const OutputTarget target = parse_output(options.out);
  if (target.kind != OutputKind::video)
    throw OutputError(options.out + ": encode makes a video; give a file name that ends in one of " +
                      fmt::format("{}", fmt::join(render::video_endings(), " ")));
  const FrameSequence sequence = find_sequence(options.frames.front(), options.allow_gaps);
  check_not_a_frame(options, sequence);
  render::VideoDef def{.path = target.path,
                       .width_px = sequence.width_px,
                       .height_px = sequence.height_px,
                       .fps = rate_of(options, sequence),
                       .stop = [] { return interrupt_signal() != 0; }};
  render::check_video(def);
  check_file(target.path.string(), options.force);
  const OutputLock lock(OutputLock::beside(target.path), target.path.string());
  def.alpha = render::keeps_alpha(target.path.extension().string()) && any_transparent(sequence);
  if (sequence.left_out > 0 && !options.log.quiet)
    log("note: {} frames are missing between {} and {}; the video skips them\n", sequence.left_out,
        sequence.frames.front().number, sequence.frames.back().number);
  const std::size_t done = encode(sequence, def, options.log);
  if (done < sequence.frames.size()) {
    log("interrupted: {} of {} frames encoded; nothing was written\n", done, sequence.frames.size());
    return 128 + interrupt_signal();
  }
  if (!options.log.quiet)
    log("{} frames, {} per second, {:.3f} s\n", sequence.frames.size(), def.fps.text(),
        def.fps.seconds(static_cast<int64_t>(sequence.frames.size())));
  print_output_name(target.path.string());
  return kOk;
}

}  // namespace

Command add_encode(CLI::App& app) {
  const auto options = std::make_shared<EncodeOptions>();
  EncodeOptions& encode = *options;
  CLI::App* command = app.add_subcommand("encode", "Encode existing PNG frames as a video");
  command->add_option("frames", encode.frames, "Pattern such as 'frames/####.png', or a folder")->required();
  command->add_option("-o,--output", encode.out, "Video: .mp4 .webm .mov .mkv .gif .webp .apng .png")
      ->required();
  command->add_option("--fps", encode.fps,
                      "Frames per second: 24, 29.97, 30000/1001 (default: as rendered, or 30)");
  command->add_flag("--allow-gaps", encode.allow_gaps, "Skip missing frame numbers");
  command->add_flag("--force", encode.force, "Replace an existing file");
  add_log_options(*command, encode.log);
  return {command, [options] { return encode_command(*options); }};
}

}  // namespace offstage::producer
