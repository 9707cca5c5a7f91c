// compare and bless.

#include <cstdlib>
#include <set>

#include <fmt/format.h>

#include "producer/base/log.h"
#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/run/fingerprint.h"
#include "producer/run/golden.h"
#include "render/context.h"
#include "render/error.h"
#include "render/image_io.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;

std::set<std::string> pictures_in(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".png") names.insert(entry.path().filename().string());
  return names;
}

/// Compares two pictures; prints a line.
bool same_picture(const fs::path& a, const fs::path& b, const std::string& report) {
  const render::Image x = render::read_image(a), y = render::read_image(b);
  if (x.width_px != y.width_px || x.height_px != y.height_px) {
    fmt::print("{} {}: sizes differ, {}x{} and {}x{}\n", a.string(), b.string(), x.width_px, x.height_px,
               y.width_px, y.height_px);
    return false;
  }
  const render::ImageDifference d = render::difference(x, y);
  fmt::print(
      "{} {}: {}\n", a.string(), b.string(),
      d.max_delta == 0
          ? "identical"
          : fmt::format("largest difference {}, mean {:.4f}, {} pixels ({:.3f} %) off by more than 2 steps",
                        d.max_delta, d.mean_delta, d.pixels_over, 100 * d.fraction_over));
  if (d.max_delta == 0) return true;
  if (!report.empty()) {
    fs::create_directories(report);
    render::write_png(fs::path(report) / (a.stem().string() + "-difference.png"),
                      render::amplified_difference(x, y));
  }
  return false;
}

int compare_pictures(const CompareOptions& options) {
  const fs::path a = options.scene.file, b = options.other;
  if (fs::is_directory(a) != fs::is_directory(b))
    throw render::FileError(a.string() + " and " + b.string() + ": compare two pictures or two folders");
  if (!fs::is_directory(a)) return same_picture(a, b, options.report) ? kOk : kImagesDiffer;
  std::set<std::string> names = pictures_in(a);
  names.merge(pictures_in(b));
  if (names.empty()) throw render::FileError(a.string() + ": no PNG files to compare");
  bool same = true;
  for (const std::string& name : names) {
    const bool in_a = fs::exists(a / name), in_b = fs::exists(b / name);
    if (in_a && in_b) {
      same &= same_picture(a / name, b / name, options.report);
    } else {
      fmt::print("{}: only in {}\n", name, (in_a ? a : b).string());
      same = false;
    }
  }
  return same ? kOk : kImagesDiffer;
}

Golden drawn_with_progress(const LoadedScene& scene, int threads, const GoldenStates& states = {}) {
  ProgressPrinter printer(ProgressStyle::automatic);
  Golden golden = draw_golden(scene, threads, states, std::ref(printer));
  printer.finish();
  return golden;
}

void refuse_standard_input(const std::string& command, const std::string& file) {
  if (file == kStandardInput)
    throw std::invalid_argument(
        command +
        ": needs a scene file, because a golden is found by the file's name; standard input has none");
}

int compare_with_golden(const CompareOptions& options) {
  refuse_standard_input("compare", options.scene.file);
  const LoadedScene scene = load(options.scene, true, golden_overrides());
  const GoldenPlace place = find_golden(options.golden, scene, options.scene.file);
  if (!place.exists)
    throw render::FileError(
        fmt::format("{}: no golden for {}; make one with: offstage bless {} --golden {} "
                    "--reason \"...\"",
                    options.golden, options.scene.file, options.scene.file, options.golden));
  if (!place.moved_from.empty())
    log("note: the golden was recorded for {}, which no longer exists; it is used for {} as its moved file\n",
        (fs::path(options.golden) / place.moved_from).lexically_normal().string(), options.scene.file);
  const Golden expected = read_golden(options.golden, place.name);
  const int threads = threads_or_all(options.threads);
  const auto control = simulation_threads(options.threads);
  render::pin_environment(threads, options.gl);
  Golden actual = drawn_with_progress(scene, threads, options.states);
  actual.scene = place.name;
  const Verdict verdict = judge(expected, actual);
  fmt::print("{}", verdict.text);
  if (verdict.pass) return kOk;
  const std::string folder = options.report.empty() ? "golden-report/" + actual.scene : options.report;
  fmt::print("see {}\nto accept the new pictures: offstage bless {} --golden {} --reason \"...\"\n",
             fs::absolute(write_report(folder, expected, actual, verdict)).string(), options.scene.file,
             options.golden);
  return kImagesDiffer;
}

}  // namespace

int compare_command(const CompareOptions& options) {
  return options.other.empty() ? compare_with_golden(options) : compare_pictures(options);
}

int bless_command(const BlessOptions& options) {
  if (std::getenv("CI"))
    throw std::invalid_argument("bless: does not run in CI; run it by hand and look at the pictures");
  if (options.reason.find_first_not_of(" \t") == std::string::npos)
    throw std::invalid_argument("bless: --reason must state why the pictures changed");
  for (const std::string& file : options.scenes) refuse_standard_input("bless", file);
  const int threads = threads_or_all(options.threads);
  const auto control = simulation_threads(options.threads);
  render::pin_environment(threads, options.gl);
  std::set<std::string> taken;  // names used by scenes of this command
  for (const std::string& file : options.scenes) {
    const LoadedScene scene = load({.file = file,
                                    .set = {},
                                    .quality = {},
                                    .size = {},
                                    .fps = {},
                                    .duration = {},
                                    .seed = {},
                                    .allow = options.allow},
                                   true, golden_overrides());
    const GoldenPlace place = find_golden(options.golden, scene, file, taken);
    Golden golden = drawn_with_progress(scene, threads);
    golden.scene = place.name;
    golden.source = place.source;
    golden.reason = options.reason;
    write_golden(options.golden, golden);
    taken.insert(place.name);
    const std::string asked = scene.scene.name;
    fmt::print("{}: {} frames{}\n", golden.scene, golden.frames.size(),
               asked == golden.scene ? "" : fmt::format(" (of {})", file));
  }
  return kOk;
}

}  // namespace offstage::producer
