// The command sweep: renders a scene with different values.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <fstream>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "producer/base/interrupt.h"
#include "producer/base/json_file.h"
#include "producer/base/log.h"
#include "producer/base/time_code.h"
#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/cli/options.h"
#include "producer/run/contact_sheet.h"
#include "producer/run/output.h"
#include "producer/run/production.h"
#include "producer/run/sweep.h"
#include "render/context.h"
#include "render/error.h"
#include "render/image_io.h"
#include "render/output_file.h"

namespace offstage::producer {
namespace {

struct SweepOptions {
  SceneOptions scene;
  std::vector<std::string> vary;
  std::vector<double> at;  ///< times [s]; empty: the middle of the film
  std::string out, csv;    ///< an empty `csv` means a file beside the sheet
  int columns = 0;         ///< number of columns of the sheet; 0: chosen according to the variations
  int threads = 0, jobs = 0;
  bool resume = false, force = false, quiet = false;
  render::GlPlatform gl = render::GlPlatform::automatic;
};

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// One combination of values with its result.
struct Run {
  std::vector<std::string> values;
  LoadedScene scene;
  std::vector<int> frames;
  Figures figures;
  std::vector<render::Image> pictures;  // one for each frame; none if the run failed
  std::string fault;
  int code = kOk;
};

struct Sweep {
  std::vector<Variation> variations;
  std::vector<Run> runs;
  std::string csv;
  fs::path finished;  // folder of the finished runs until all are finished
};

/// Returns the values of a combination as text, such as "emitters.0.rate=200, world.seed=3".
std::string name_of(const Sweep& sweep, const Run& run) {
  std::string name;
  for (std::size_t i = 0; i < run.values.size(); ++i)
    name += fmt::format("{}{}={}", i > 0 ? ", " : "", sweep.variations[i].path, run.values[i]);
  return name;
}

// --- Before the work ---

/// Returns the frames at the given times, each once; the middle frame if no times are given.
std::vector<int> frames_of(const Scene& scene, const std::vector<double>& times) {
  if (times.empty()) return {(scene.frame_count() + 1) / 2};
  std::vector<int> frames;
  for (const double time : times) frames.push_back(frame_at(scene, time));
  std::ranges::sort(frames);
  frames.erase(std::unique(frames.begin(), frames.end()), frames.end());
  return frames;
}

/// Collects the problems of the scenes of a sweep. A problem with a varied value belongs to one scene; other
/// problems are reported once.
class SweepFindings {
 public:
  void add(const std::vector<Problem>& problems) {
    for (Problem problem : problems) {
      if (problem.where.file == "--set") problem.where.file = "--vary";
      if (told_.insert(problem.describe()).second) found_.push_back(std::move(problem));
    }
  }
  const std::vector<Problem>& found() const { return found_; }

 private:
  std::set<std::string> told_;
  std::vector<Problem> found_;
};

/// Loads the scene of every combination. Throws SceneError with the problems of all scenes.
void load_runs(const SweepOptions& options, Sweep& sweep) {
  SceneOptions base = options.scene;
  const LoadedScene unvaried = load(base, options.quiet);
  if (!base.size) base.size = small_size(unvaried.scene, kSmallSide_px);
  SweepFindings errors, warnings;
  for (const auto& values : combinations(sweep.variations)) {
    SceneOptions one = base;
    for (std::size_t i = 0; i < values.size(); ++i)
      one.set.push_back(sweep.variations[i].path + "=" + values[i]);
    try {
      Run run{.values = values,
              .scene = load(one, true),
              .frames = {},
              .figures = {},
              .pictures = {},
              .fault = {}};
      run.frames = frames_of(run.scene.scene, options.at);
      warnings.add(run.scene.warnings);
      sweep.runs.push_back(std::move(run));
    } catch (const SceneError& error) {
      errors.add(error.problems());
    }
  }
  if (!errors.found().empty()) throw SceneError(errors.found());
  if (!options.quiet && unvaried.warnings.empty()) print_warnings(warnings.found());
}

int columns_of(const SweepOptions& options, const Sweep& sweep) {
  if (options.columns > 0) return options.columns;
  constexpr std::size_t kMostInRow = 10;
  const std::size_t times = sweep.runs.front().frames.size();
  const std::size_t series = times > 1 ? times : sweep.variations.back().values.size();
  const bool table = times > 1 || sweep.variations.size() > 1;
  return table && series <= kMostInRow ? static_cast<int>(series) : columns_for(times * sweep.runs.size());
}

void check_size(const SweepOptions& options, const Sweep& sweep) {
  Eigen::Vector2i size(1, 1);
  std::size_t pictures = 0;
  for (const Run& run : sweep.runs) {
    size = size.cwiseMax(run.scene.scene.render.size);
    pictures += run.frames.size();
  }
  check_sheet_size(pictures, columns_of(options, sweep), size.x(), size.y());
}

void check_outputs(const SweepOptions& options, const Sweep& sweep) {
  check_png(options.out);
  check_distinct(options.out, sweep.csv);
  const bool begun = fs::exists(sweep.finished);
  if (begun && !options.resume && !options.force)
    throw OutputError(sweep.finished.string() +
                      ": contains an unfinished sweep; continue with --resume, or start again with --force");
  const bool replace = options.force || (options.resume && begun);
  check_file(options.out, replace);
  check_file(sweep.csv, replace);
  check_not_read({options.out, sweep.csv}, options.scene);
}

// --- Finished runs on disk ---

/// Returns a hash of everything on which the result of a run depends. It names the files of the result, so a
/// result is found again only if it is still valid.
std::string key_of(const Run& run, const ModelLibrary& models) {
  return text_hash(settings_key(run.scene, models) + fmt::format(" {}", fmt::join(run.frames, ",")));
}

fs::path picture_path(const fs::path& folder, const std::string& key, int frame) {
  return folder / fmt::format("{}-{}.png", key, frame);
}

void keep(const Run& run, const fs::path& folder, const std::string& key) {
  for (std::size_t i = 0; i < run.pictures.size(); ++i)
    render::write_png(picture_path(folder, key, run.frames[i]), run.pictures[i]);
  const Json json = {{"figures", run.figures}, {"fault", run.fault}, {"code", run.code}};
  // This file is written last, so that its presence shows that the result is complete.
  write_text_file((folder / (key + ".json")).string(), json.dump() + "\n");
}

bool restore(Run& run, const fs::path& folder, const std::string& key) {
  try {
    const std::optional<JsonObject> kept = read_json_file(folder / (key + ".json"));
    if (!kept) return false;
    const auto json = [&](const char* name) { return Json(kept->value(name)); };
    run.figures = json("figures").get<Figures>();
    run.fault = json("fault").get<std::string>();
    run.code = json("code").get<int>();
    for (const int frame : run.frames)
      if (run.fault.empty()) run.pictures.push_back(render::read_image(picture_path(folder, key, frame)));
  } catch (const std::exception&) {  // the files are damaged, so the run is repeated
    run.pictures.clear();
    return false;
  }
  return true;
}

/// Removes the files that keep() wrote, whose names begin with hexadecimal keys. Then removes the folder if
/// it is empty.
void remove_finished(const fs::path& folder) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string(), ending = entry.path().extension().string();
    constexpr std::size_t kKey = 32;
    const bool ours = name.size() > kKey && name.find_first_not_of("0123456789abcdef") == kKey &&
                      (name[kKey] == '-' || name[kKey] == '.') && (ending == ".png" || ending == ".json");
    if (ours && fs::is_regular_file(entry.symlink_status(error))) fs::remove(entry.path(), error);
  }
  render::remove_leftovers(folder);
  fs::remove(folder, error);
}

// --- The work ---

class Album : public render::FrameSink {
 public:
  explicit Album(std::vector<render::Image>& pictures) : pictures_(pictures) {}
  void write(int, const render::Image& image) override { pictures_.push_back(image); }
  void close() override {}

 private:
  std::vector<render::Image>& pictures_;
};

void fail(Run& run, const std::string& fault, int code) {
  run.fault = fault;
  run.code = code;
  run.figures.clear();
  run.pictures.clear();
}

/// Simulates and draws one combination. An error of the simulation or of a model is stored in the run as its
/// result. Returns false after a signal.
bool produce(Run& run, const SweepOptions& options, const fs::path& folder) {
  try {
    std::vector<Problem> warnings;
    const ModelLibrary models(run.scene.scene, run.scene.folder, options.scene.decompositions(), warnings);
    const std::string key = key_of(run, models);
    if (options.resume && restore(run, folder, key)) return true;
    try {
      Album album(run.pictures);
      const RunStats stats =
          render_frames(run.scene, models, {.frames = run.frames, .threads = 1, .cache = {}}, album, {});
      if (stats.interrupted_by) return false;
      run.figures = figures_of(stats);
    } catch (const DivergedError& error) {
      fail(run, error.what(), kDiverged);
    } catch (const SceneError& error) {
      fail(run, error.what(), kSceneInvalid);
    }
    keep(run, folder, key);
  } catch (const SceneError& error) {  // a model that cannot be read
    fail(run, error.what(), kSceneInvalid);
  }
  return true;
}

double available_memory_mb() {
  std::ifstream in("/proc/meminfo");
  for (std::string name, rest; in >> name && std::getline(in, rest);)
    if (name == "MemAvailable:") return std::stod(rest) / 1024;
  return INFINITY;
}

/// Processes the runs on several threads. Only the first run is done at first, to measure how much memory a
/// run needs.
class Crew {
 public:
  Crew(Sweep& sweep, const SweepOptions& options) : sweep_(sweep), options_(options) {}

  /// Returns the number of finished runs.
  std::size_t work(int jobs) {
    work_through(1);
    const double spare = available_memory_mb() / peak_rss_mb();
    const auto most = static_cast<std::size_t>(std::min<double>(jobs, 1 + std::floor(spare)));
    {
      std::vector<std::jthread> workers;
      for (std::size_t i = 1; i < std::min(most, sweep_.runs.size()); ++i)
        workers.emplace_back([this] { work_through(sweep_.runs.size()); });
      work_through(sweep_.runs.size());
    }
    if (failure_) std::rethrow_exception(failure_);
    return done_;
  }

 private:
  void work_through(std::size_t end) {
    try {
      while (!stop_ && !interrupt_signal()) {
        std::size_t i = next_.load();
        while (i < end && !next_.compare_exchange_weak(i, i + 1)) {
        }
        if (i >= end) return;
        const auto start = std::chrono::steady_clock::now();
        if (!produce(sweep_.runs[i], options_, sweep_.finished)) return;
        report(sweep_.runs[i],
               std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
      }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!failure_) failure_ = std::current_exception();
      stop_ = true;
    }
  }
  void report(const Run& run, double seconds) {
    const std::lock_guard lock(mutex_);
    ++done_;
    if (!run.fault.empty()) log("warning: {}: {}\n", name_of(sweep_, run), run.fault);
    if (!options_.quiet)
      log("run {}/{}  {}  {:.1f} s\n", done_, sweep_.runs.size(), name_of(sweep_, run), seconds);
  }

  Sweep& sweep_;
  const SweepOptions& options_;
  std::atomic<std::size_t> next_ = 0;
  std::atomic<bool> stop_ = false;
  std::mutex mutex_;
  std::size_t done_ = 0;
  std::exception_ptr failure_;
};

// --- After the work ---

double time_of(const Run& run, int frame) {
  return run.scene.scene.output.time_of(frame);
}

render::Image draw_sheet(const SweepOptions& options, const Sweep& sweep) {
  const std::size_t times = sweep.runs.front().frames.size();
  std::vector<SheetCell> cells;
  for (const Run& run : sweep.runs)
    for (std::size_t i = 0; i < run.frames.size(); ++i) {
      SheetCell cell{.label = {}, .picture = {}, .fault = run.fault};
      for (std::size_t k = 0; k < run.values.size(); ++k)
        cell.label.push_back(sweep.variations[k].path + "=" + run.values[k]);
      if (times > 1) cell.label.push_back(time_code(time_of(run, run.frames[i])));
      if (i < run.pictures.size()) cell.picture = run.pictures[i];
      cells.push_back(std::move(cell));
    }
  const Run& first = sweep.runs.front();
  std::vector<std::string> heading = {
      fmt::format("{}  at {}", first.scene.scene.name, time_code(time_of(first, first.frames.front())))};
  for (std::size_t i = 1; i < times; ++i)
    heading.front() += ", " + time_code(time_of(first, first.frames[i]));
  for (const Variation& variation : sweep.variations)
    heading.push_back(fmt::format("{} = {}", variation.path, fmt::join(variation.values, ", ")));
  return contact_sheet(heading, cells, columns_of(options, sweep));
}

std::string table(const Sweep& sweep) {
  std::vector<Figures> rows;
  for (std::size_t i = 0; i < sweep.runs.size(); ++i) {
    const Run& run = sweep.runs[i];
    Figures row = {{"run", std::to_string(i + 1)}};
    for (std::size_t k = 0; k < run.values.size(); ++k)
      row.emplace_back(sweep.variations[k].path, run.values[k]);
    row.emplace_back("time", fmt::format("{}", time_of(run, run.frames.back())));
    row.insert(row.end(), run.figures.begin(), run.figures.end());
    row.emplace_back("fault", run.fault);
    rows.push_back(std::move(row));
  }
  return to_csv(rows);
}

int sweep_command(const SweepOptions& options) {
  Sweep sweep;
  for (const std::string& text : options.vary) sweep.variations.push_back(parse_variation(text));
  sweep.csv = options.csv.empty() ? fs::path(options.out).replace_extension(".csv").string() : options.csv;
  sweep.finished = options.out + ".runs";
  load_runs(options, sweep);
  check_size(options, sweep);
  check_outputs(options, sweep);

  const auto threads = simulation_threads(options.threads);
  const int all_threads = threads_or_all(options.threads);
  render::pin_environment(all_threads, options.gl);
  std::error_code error;
  const OutputLock lock(OutputLock::beside(options.out), options.out);
  if (options.force) remove_finished(sweep.finished);
  fs::create_directories(sweep.finished, error);
  if (error)
    throw render::FileError(sweep.finished.string() + ": cannot create the folder: " + error.message());
  const std::size_t done = Crew(sweep, options).work(options.jobs > 0 ? options.jobs : all_threads);
  if (done < sweep.runs.size()) {
    log("interrupted: {} of {} runs done; continue with the same command and --resume{}\n", done,
        sweep.runs.size(), options.force ? " instead of --force" : "");
    return 128 + interrupt_signal();
  }
  write_text_file(sweep.csv, table(sweep));
  render::write_png(options.out, draw_sheet(options, sweep));
  remove_finished(sweep.finished);
  print_output_name(options.out);
  print_output_name(sweep.csv);
  int code = kOk;
  for (const Run& run : sweep.runs) code = std::max(code, run.code);
  return code;
}

}  // namespace

Command add_sweep(CLI::App& app) {
  const auto options = std::make_shared<SweepOptions>();
  SweepOptions& sweep = *options;
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
  return {command, [options] { return sweep_command(*options); }};
}

}  // namespace offstage::producer
