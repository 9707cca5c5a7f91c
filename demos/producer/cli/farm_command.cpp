// The command farm: renders a film in many processes.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <thread>

#include <CLI/CLI.hpp>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "producer/base/interrupt.h"
#include "producer/base/log.h"
#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/cli/options.h"
#include "producer/run/farm.h"
#include "producer/run/output.h"
#include "producer/run/production.h"
#include "render/child_process.h"
#include "render/error.h"
#include "render/file_io.h"
#include "render/sink.h"

namespace offstage::producer {
namespace {

struct FarmOptions {
  SceneOptions scene;
  LogOptions log;
  std::string out, work, program, status;
  bool slurm = false;
  int local = 0;  ///< number of drawing processes on this machine; 0: none
  int chunks = 8, retries = 2, threads = 0;
  std::string partition, account, time;
  std::vector<std::string> sbatch;  ///< further options of sbatch
  bool resume = false, force = false, dry_run = false;
  render::GlPlatform gl = render::GlPlatform::automatic;
};

namespace fs = std::filesystem;

/// Returns the folder of a farm: FILM.mp4.farm, or the folder that contains the folder of the frames.
fs::path default_work(const OutputTarget& target) {
  if (target.kind == OutputKind::video) return target.path.string() + ".farm";
  const fs::path folder = target.path.parent_path();
  return (folder.empty() ? fs::path("frames") : folder).string() + ".farm";
}

FarmPlan plan_of(const FarmOptions& options) {
  const OutputTarget target = parse_output(options.out);
  if (target.kind == OutputKind::pipe)
    throw OutputError("-: a farm cannot write to standard output; name a video or frames");
  if (options.scene.from_standard_input())
    throw std::invalid_argument("farm: needs a scene file that all machines can read");
  FarmPlan plan;
  std::error_code error;
  plan.program =
      options.program.empty() ? fs::read_symlink("/proc/self/exe", error) : fs::path(options.program);
  plan.scene = fs::absolute(options.scene.file);
  plan.out = fs::absolute(target.path);
  plan.work = fs::absolute(options.work.empty() ? default_work(target) : fs::path(options.work));
  plan.encodes = target.kind == OutputKind::video;
  plan.chunks = options.chunks;
  plan.retries = options.retries;
  plan.threads = options.threads;
  const auto option = [](std::vector<std::string>& list, const char* name, const std::string& value) {
    list.emplace_back(name);
    list.push_back(value);
  };
  for (const std::string& set : options.scene.set) option(plan.simulate_options, "--set", set);
  for (const std::string& folder : options.scene.allow)
    option(plan.simulate_options, "--allow", fs::absolute(folder).string());
  if (options.scene.fps) option(plan.simulate_options, "--fps", *options.scene.fps);
  if (options.scene.duration)
    option(plan.simulate_options, "--duration", fmt::format("{}", *options.scene.duration));
  if (options.scene.seed) option(plan.simulate_options, "--seed", std::to_string(*options.scene.seed));
  if (options.scene.quality) option(plan.render_options, "--quality", *options.scene.quality);
  if (options.scene.size) option(plan.render_options, "--size", *options.scene.size);
  if (options.gl != render::GlPlatform::automatic)
    option(plan.render_options, "--gl", std::string(name_of(options.gl)));
  return plan;
}

/// Checks the scene on this machine before any job is submitted, and sets the key of the plan.
void check_scene(const FarmOptions& options, FarmPlan& plan) {
  const LoadedScene loaded = load(options.scene, options.log.quiet);
  const ModelLibrary models = load_models(loaded, options.scene, options.log);
  plan.key = settings_key(loaded, models);
  plan.chunks = std::min(plan.chunks, loaded.scene.frame_count());
  if (plan.encodes)
    render::check_video({.path = plan.out,
                         .width_px = loaded.scene.render.size.x(),
                         .height_px = loaded.scene.render.size.y(),
                         .fps = loaded.scene.output.fps,
                         .alpha = loaded.scene.environment.background == Background::transparent});
}

/// Prepares the folder of a farm. An existing farm is continued with --resume if it is for the same film.
void prepare_work(const FarmOptions& options, const FarmPlan& plan) {
  const bool there = fs::exists(plan.work / "farm.json");
  if (there && !options.resume && !options.force)
    throw OutputError(plan.work.string() +
                      ": already contains a farm; continue with --resume, or start again with --force");
  if (there && options.resume) {
    const FarmPlan before = read_farm(plan.work);
    if (before.key != plan.key || before.chunks != plan.chunks)
      throw OutputError(
          plan.work.string() +
          ": was started with another scene, other settings or other --chunks; start again with --force");
  }
  if (there && !options.resume) {
    fs::remove_all(plan.work / "done");
    if (plan.encodes) remove_frames(plan.work / "frames");
  }
  if (!options.resume && plan.encodes) check_file(plan.out.string(), options.force);
  check_not_read({plan.out.string()}, options.scene);
  fs::create_directories(plan.work / "logs");
  fs::create_directories(plan.work / "done");
  for (const FarmScript& script : step_scripts(plan)) {
    const fs::path file = plan.work / script.name;
    write_text_file(file.string(), script.text);
    ::chmod(file.c_str(), 0755);
  }
  write_farm(plan);
}

/// Runs a script in the farm's folder, and writes the script's output to a log. Returns an error message;
/// nothing if the script succeeded.
std::optional<std::string> run_script(const FarmPlan& plan, const std::vector<std::string>& arguments,
                                      const std::string& log_name) {
  const fs::path log_file = plan.work / "logs" / log_name;
  const render::Descriptor out(::open(log_file.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644));
  std::vector<std::string> words = {"/bin/sh", (plan.work / arguments[0]).string()};
  words.insert(words.end(), arguments.begin() + 1, arguments.end());
  render::ChildProcess child(words, -1, out.fd(), out.fd());
  if (child.error()) return render::system_reason(child.error());
  auto failed = child.wait([] { return interrupt_signal() != 0; });
  if (failed) return *failed + "; see " + log_file.string();
  return {};
}

int run_locally(const FarmOptions& options, const FarmPlan& plan) {
  const auto say = [&](const std::string& line) {
    if (!options.log.quiet) log("{}\n", line);
  };
  say("simulating once");
  if (const auto failed = run_script(plan, {"simulate.sh"}, "simulate.log")) {
    if (interrupt_signal()) throw Interrupted(interrupt_signal());
    throw render::FileError("the simulation failed: " + *failed);
  }
  const std::vector<int> chunks = farm_state(plan).missing;
  std::atomic<std::size_t> next = 0, finished = 0;
  std::mutex mutex;
  std::vector<std::string> problems;
  const auto work = [&] {
    for (std::size_t i = next++; i < chunks.size() && !interrupt_signal(); i = next++) {
      const std::string number = std::to_string(chunks[i]);
      const auto failed = run_script(plan, {"chunk.sh", number}, "chunk-" + number + ".log");
      const std::lock_guard lock(mutex);
      if (failed)
        problems.push_back("chunk " + number + ": " + *failed);
      else
        say(fmt::format("chunk {} done, {} of {}", number, ++finished, chunks.size()));
    }
  };
  {
    std::vector<std::jthread> workers;
    for (int i = 0; i < options.local; ++i) workers.emplace_back(work);
  }
  if (interrupt_signal()) {
    log("interrupted; continue with the same command and --resume\n");
    throw Interrupted(interrupt_signal());
  }
  if (!problems.empty())
    throw render::FileError(fmt::format("{} of {} chunks failed after {} retries: {}; continue with --resume",
                                        problems.size(), chunks.size(), plan.retries, problems.front()));
  if (const auto failed = run_script(plan, {"encode.sh"}, "encode.log"))
    throw render::FileError("the encoding failed: " + *failed);
  print_output_name(options.out);
  return kOk;
}

int submit_to_slurm(const FarmOptions& options, const FarmPlan& plan) {
  const FarmScript script = slurm_script(
      plan, {options.partition, options.account, options.time, options.sbatch}, farm_state(plan).missing);
  write_text_file((plan.work / script.name).string(), script.text);
  if (const auto failed = run_script(plan, {script.name}, "submit.log"))
    throw render::UnavailableError("sbatch did not accept the jobs: " + *failed);
  fmt::print("jobs {}", render::read_text_file(plan.work / "jobs", 1 << 16));
  if (!options.log.quiet)
    log("show their progress: offstage farm --status {}\n", shell_word(plan.work.string()));
  return kOk;
}

int print_scripts(const FarmOptions& options, const FarmPlan& plan) {
  std::vector<FarmScript> scripts = step_scripts(plan);
  if (options.slurm) {
    std::vector<int> all(static_cast<std::size_t>(plan.chunks));
    for (int i = 0; i < plan.chunks; ++i) all[static_cast<std::size_t>(i)] = i + 1;
    scripts.push_back(
        slurm_script(plan, {options.partition, options.account, options.time, options.sbatch}, all));
  }
  for (const FarmScript& script : scripts)
    fmt::print("# ---- {}\n{}\n", (plan.work / script.name).string(), script.text);
  return kOk;
}

int print_status(const FarmOptions& options) {
  const FarmPlan plan = read_farm(options.status);
  const FarmState state = farm_state(plan);
  const int done = plan.chunks - static_cast<int>(state.missing.size());
  fmt::print("simulation: {}\nchunks: {} of {} done, {} frames\n", state.simulated ? "done" : "not done",
             done, plan.chunks, state.frames);
  if (plan.encodes) fmt::print("film: {}\n", state.encoded ? plan.out.string() : "not done");
  if (fs::exists(plan.work / "jobs")) {
    std::string jobs = render::read_text_file(plan.work / "jobs", 1 << 16);
    std::erase(jobs, '\n');
    std::ranges::replace(jobs, ' ', ',');
    std::fflush(stdout);
    render::ChildProcess squeue({"squeue", "--jobs=" + jobs, "--format=%.18i %.24j %.10T %.10M %R"}, -1,
                                STDOUT_FILENO, -1);
    if (!squeue.error()) squeue.wait_for(std::chrono::seconds(20));
  }
  return state.encoded ? kOk : kRunFailed;
}

/// Renders a film in steps on many machines, or reports the progress of the steps.
int farm_command(const FarmOptions& options) {
  if (!options.status.empty()) return print_status(options);
  if (options.scene.file.empty() || options.out.empty())
    throw std::invalid_argument("farm: needs a scene and -o OUTPUT, or --status FOLDER");
  if (options.slurm == (options.local > 0)) throw std::invalid_argument("farm: choose --slurm or --local N");
  FarmPlan plan = plan_of(options);
  check_scene(options, plan);
  if (options.dry_run) return print_scripts(options, plan);
  prepare_work(options, plan);
  return options.slurm ? submit_to_slurm(options, plan) : run_locally(options, plan);
}

}  // namespace

Command add_farm(CLI::App& app) {
  const auto options = std::make_shared<FarmOptions>();
  FarmOptions& farm = *options;
  CLI::App* command = app.add_subcommand(
      "farm",
      "Simulate once, then draw in many processes: on the nodes of a Slurm cluster, or on this machine");
  command->add_option("scene", farm.scene.file, "Scene file");
  command->add_option("-o,--output", farm.out, "Video, or frames/####.png");
  command->add_flag("--slurm", farm.slurm,
                    "Submit the steps to Slurm; all nodes must be able to read and write the folder");
  command
      ->add_option("--local", farm.local,
                   "Run the same steps on this machine, with this number of drawing processes")
      ->check(CLI::Range(1, 256));
  command
      ->add_option("--chunks", farm.chunks,
                   "Number of parts into which the frames are divided, each a job of its own")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  command->add_option("--retries", farm.retries, "Number of retries of a failed step")
      ->check(CLI::Range(0, 100))
      ->capture_default_str();
  command->add_option("--work", farm.work,
                      "Folder of scripts, cache, frames and logs (default: OUTPUT.farm)");
  command->add_option("--partition", farm.partition, "Slurm partition");
  command->add_option("--account", farm.account, "Slurm account");
  command->add_option("--time", farm.time, "Time limit of each Slurm job, such as 2:00:00");
  command
      ->add_option("--sbatch", farm.sbatch,
                   "A further option of sbatch, such as --sbatch=--mem=8G (repeatable)")
      ->allow_extra_args(false);
  command->add_option("--program", farm.program, "Path of offstage on the nodes (default: this one)");
  auto* resume = command->add_flag("--resume", farm.resume,
                                   "Continue an earlier farm: keep the steps and frames that are done");
  command->add_flag("--force", farm.force, "Start again, and replace existing output")->excludes(resume);
  command->add_flag("--dry-run", farm.dry_run, "Print the scripts and write nothing");
  command->add_option("--status", farm.status, "Report the progress of the farm in this folder");
  add_overrides(*command, farm.scene);
  add_picture(*command, farm.scene);
  add_timing(*command, farm.scene);
  add_threads(*command, farm.threads);
  add_gl(*command, farm.gl);
  add_log_options(*command, farm.log);
  return {command, [options] { return farm_command(*options); }};
}

}  // namespace offstage::producer
