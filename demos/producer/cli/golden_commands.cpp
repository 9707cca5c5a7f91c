// The commands compare and bless: compare scenes with their goldens, and record goldens.

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <exception>
#include <memory>
#include <set>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "producer/base/log.h"
#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/cli/failure.h"
#include "producer/cli/options.h"
#include "producer/run/fingerprint.h"
#include "producer/run/frame_list.h"
#include "producer/run/golden.h"
#include "producer/run/golden_overview.h"
#include "producer/run/junit.h"
#include "render/context.h"
#include "render/error.h"
#include "render/file_io.h"
#include "render/image_io.h"

namespace offstage::producer {
namespace {

struct BlessOptions {
  std::vector<std::string> scenes, allow;
  std::string golden, reason, frames;
  int threads = 0;
  render::GlPlatform gl = render::GlPlatform::automatic;
};

struct CompareOptions {
  std::vector<std::string> inputs;  ///< scenes, or two pictures, or two folders of frames
  SceneOptions scene;               ///< options for all scenes; its member `file` is not used
  std::string golden, report, junit;
  GoldenStates states;
  int threads = 0;
  render::GlPlatform gl = render::GlPlatform::automatic;
};

namespace fs = std::filesystem;

std::set<std::string> pictures_in(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() == ".png") names.insert(entry.path().filename().string());
  return names;
}

/// Compares two pictures and prints one line.
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
  const fs::path a = options.inputs[0], b = options.inputs[1];
  if (fs::is_directory(a) != fs::is_directory(b))
    throw render::FileError(a.string() + " and " + b.string() +
                            ": one is a folder and the other is not; compare two pictures or two folders");
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

Golden drawn_with_progress(const LoadedScene& scene, const std::vector<int>& frames, int threads,
                           const GoldenStates& states = {}) {
  ProgressPrinter printer(ProgressStyle::automatic);
  Golden golden = draw_golden(scene, frames, threads, states, std::ref(printer));
  printer.finish();
  return golden;
}

void refuse_standard_input(const std::string& command, const std::string& file) {
  if (file == kStandardInput)
    throw std::invalid_argument(
        command +
        ": needs a scene file, because a golden is found by the file's name; standard input has none");
}

/// The result of the comparison of one scene.
struct Comparison {
  TestResult result;
  int code = kOk;
  fs::path page;              // page of the report; empty: none
  std::exception_ptr thrown;  // the error because of which there is no result
};

void compare_scene(const CompareOptions& options, const std::string& file, Comparison& comparison) {
  refuse_standard_input("compare", file);
  SceneOptions scene_options = options.scene;
  scene_options.file = file;
  const LoadedScene scene = load(scene_options, true, golden_overrides());
  const GoldenPlace place = find_golden(options.golden, scene, file);
  if (!place.exists)
    throw render::FileError(
        fmt::format("{}: no golden for {}; make one with: offstage bless {} --golden {} "
                    "--reason \"...\"",
                    options.golden, file, file, options.golden));
  if (!place.moved_from.empty())
    log("note: the golden was recorded for {}, which no longer exists; {} is taken to be the same scene, "
        "moved\n",
        (fs::path(options.golden) / place.moved_from).lexically_normal().string(), file);
  const bool several = options.inputs.size() > 1;
  const auto states_in = [&](const std::string& folder) {
    return several && !folder.empty() ? (fs::path(folder) / place.name).string() : folder;
  };
  const Golden expected = read_golden(options.golden, place.name);
  Golden actual = drawn_with_progress(scene, frames_of(expected), threads_or_all(options.threads),
                                      {states_in(options.states.keep), states_in(options.states.from)});
  actual.scene = place.name;
  const Verdict verdict = judge(expected, actual);
  comparison.result.output = verdict.text;
  fmt::print("{}", verdict.text);
  if (verdict.pass) return;
  comparison.code = kImagesDiffer;
  comparison.result.outcome = TestResult::Outcome::failed;
  comparison.result.kind = "images differ";
  comparison.result.message = verdict.difference;
  const fs::path folder = options.report.empty() ? fs::path("golden-report") / actual.scene
                          : several              ? fs::path(options.report) / actual.scene
                                                 : fs::path(options.report);
  comparison.page = write_report(folder, expected, actual, verdict);
  fmt::print("see {}\nto accept the new pictures: offstage bless {} --golden {} --reason \"...\"\n",
             fs::absolute(comparison.page).string(), file, options.golden);
}

/// Compares a scene with its golden. An error does not affect the other scenes.
Comparison compared(const CompareOptions& options, const std::string& file) {
  const auto start = std::chrono::steady_clock::now();
  Comparison comparison;
  comparison.result.name = file;
  comparison.result.class_name = fs::path(options.golden).lexically_normal().generic_string();
  try {
    compare_scene(options, file, comparison);
  } catch (const std::exception&) {
    comparison.thrown = std::current_exception();
    const Failure failure = describe_failure(comparison.thrown);
    comparison.code = failure.code;
    comparison.result.outcome = TestResult::Outcome::error;
    comparison.result.kind = failure.kind;
    comparison.result.message = render::one_line(failure.message);
    comparison.result.output = failure.message;
  }
  comparison.result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return comparison;
}

void write_overview(const CompareOptions& options, const std::vector<Comparison>& comparisons) {
  std::vector<ReportedScene> scenes;
  for (const Comparison& c : comparisons)
    scenes.push_back(
        {c.result, c.page.empty() ? "" : c.page.lexically_relative(options.report).generic_string()});
  fmt::print("see {}\n", fs::absolute(write_report_overview(options.report, scenes)).string());
}

/// Returns the exit code of the command. An error takes precedence over differences, and the first error over
/// later ones.
int exit_code(const std::vector<Comparison>& comparisons) {
  int code = kOk;
  for (const Comparison& c : comparisons) {
    if (c.thrown) return c.code;
    if (c.code != kOk) code = c.code;
  }
  return code;
}

int compare_with_goldens(const CompareOptions& options) {
  const auto control = simulation_threads(options.threads);
  render::pin_environment(threads_or_all(options.threads), options.gl);
  std::vector<Comparison> comparisons;
  const bool several = options.inputs.size() > 1;
  for (const std::string& file : options.inputs) {
    comparisons.push_back(compared(options, file));
    if (several && comparisons.back().thrown) log("{}\n", comparisons.back().result.output);
  }
  if (!options.junit.empty()) {
    std::vector<TestResult> results;
    for (const Comparison& c : comparisons) results.push_back(c.result);
    const std::string xml = junit_xml("offstage compare", results);
    render::write_file_atomically(options.junit, {reinterpret_cast<const uint8_t*>(xml.data()), xml.size()});
  }
  if (!several && comparisons.front().thrown) std::rethrow_exception(comparisons.front().thrown);
  if (several) {
    const auto count = [&](TestResult::Outcome outcome) {
      return std::ranges::count_if(comparisons,
                                   [&](const Comparison& c) { return c.result.outcome == outcome; });
    };
    fmt::print("{} scenes: {} as recorded, {} with differences, {} with errors\n", comparisons.size(),
               count(TestResult::Outcome::passed), count(TestResult::Outcome::failed),
               count(TestResult::Outcome::error));
    if (!options.report.empty()) write_overview(options, comparisons);
  }
  return exit_code(comparisons);
}

int compare_command(const CompareOptions& options) {
  const auto is_scene = [](const std::string& input) {
    return input == kStandardInput || fs::path(input).extension() == ".json";
  };
  if (std::ranges::all_of(options.inputs, is_scene)) return compare_with_goldens(options);
  if (options.inputs.size() != 2 || std::ranges::any_of(options.inputs, is_scene))
    throw std::invalid_argument("compare: takes scenes (.json), or two pictures, or two folders of frames");
  if (!options.junit.empty()) throw std::invalid_argument("compare: --junit is for scenes");
  return compare_pictures(options);
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
    const std::vector<int> frames = options.frames.empty()
                                        ? recorded_frames(options.golden, place.name)
                                        : parse_frames(options.frames, scene.scene.frame_count());
    Golden golden = drawn_with_progress(scene, frames, threads);
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

}  // namespace

Command add_compare(CLI::App& app) {
  const auto options = std::make_shared<CompareOptions>();
  CompareOptions& compare = *options;
  compare.golden = "tests/golden";
  CLI::App* command = app.add_subcommand("compare",
                                         "Compare scenes with their goldens (recorded states and pictures), "
                                         "or two pictures or folders of frames");
  command->add_option("inputs", compare.inputs, "Scenes, or two pictures, or two folders of frames")
      ->required();
  command->add_option("--golden", compare.golden, "Folder of the goldens")->capture_default_str();
  command->add_option(
      "--report", compare.report,
      "Folder for the expected and actual pictures, their difference and an HTML page; with\n"
      "several scenes, a subfolder for each scene that differs, and a page that lists them all");
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
  return {command, [options] { return compare_command(*options); }};
}

Command add_bless(CLI::App& app) {
  const auto options = std::make_shared<BlessOptions>();
  BlessOptions& bless = *options;
  bless.golden = "tests/golden";
  CLI::App* command =
      app.add_subcommand("bless", "Record the goldens of scenes again: their states and pictures");
  command->add_option("scenes", bless.scenes, "Scene files")->required();
  command->add_option("--golden", bless.golden, "Folder of the goldens")->capture_default_str();
  command->add_option("--reason", bless.reason, "Reason for the change, which the golden records")
      ->required();
  command->add_option(
      "--frames", bless.frames,
      "Frames to record: 12,48 (negative numbers count from the end). Default: those of the golden;\n"
      "for a new golden, the frames at a fifth and at three fifths of the film");
  add_allow(*command, bless.allow);
  add_threads(*command, bless.threads);
  add_gl(*command, bless.gl);
  return {command, [options] { return bless_command(*options); }};
}

}  // namespace offstage::producer
