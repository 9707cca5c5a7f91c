#include "producer/production.h"

#include <algorithm>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <exception>
#include <fstream>
#include <map>
#include <mutex>
#include <sstream>
#include <thread>

#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <unistd.h>

#include "producer/interrupt.h"
#include "producer/picture.h"
#include "producer/trace.h"
#include "render/context.h"

namespace offstage::producer {
namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

class LiveSource : public SnapshotSource {
 public:
  explicit LiveSource(Simulation& simulation) : simulation_(simulation) {}
  Snapshot at(int frame) override {
    while (simulation_.frame() < frame) {
      simulation_.advance();
      if (interrupt_signal()) break;
    }
    return simulation_.snapshot();
  }

 private:
  Simulation& simulation_;
};

class CachedSource : public SnapshotSource {
 public:
  explicit CachedSource(SnapshotCache cache) : cache_(std::move(cache)) {}
  Snapshot at(int frame) override { return cache_.read(frame); }

 private:
  SnapshotCache cache_;
};

/// A frame to draw. Snapshots are immutable and each serves two neighbouring frames, hence shared.
struct Shot {
  int index = 0;  // in the list of frames
  int frame = 0;
  std::shared_ptr<const Snapshot> previous, current;
  double sim_ms = 0;
};

struct Print {
  Shot shot;
  render::Image image;
  double render_ms = 0;
};

/// Hands shots to the drawing threads and brings the finished frames back in order. At most `window` frames
/// are between the simulation and the sink, so memory is bounded. The first failure ends everything.
class Pipeline {
 public:
  explicit Pipeline(int window) : window_(window) {}

  /// Waits for room; false when the run has failed.
  bool push(Shot shot) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return failure_ || shot.index < next_print_ + window_; });
    if (failure_) return false;
    shots_.push_back(std::move(shot));
    changed_.notify_all();
    return true;
  }
  void no_more_shots() {
    const std::lock_guard lock(mutex_);
    all_shot_ = true;
    changed_.notify_all();
  }
  std::optional<Shot> take_shot() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return failure_ || all_shot_ || !shots_.empty(); });
    if (failure_ || shots_.empty()) return std::nullopt;
    Shot shot = std::move(shots_.front());
    shots_.pop_front();
    ++drawing_;
    return shot;
  }
  void give_print(Print print) {
    const std::lock_guard lock(mutex_);
    --drawing_;
    const int index = print.shot.index;
    prints_.emplace(index, std::move(print));
    changed_.notify_all();
  }
  /// The next finished frame in order; none when all are through or the run has failed.
  std::optional<Print> take_print() {
    std::unique_lock lock(mutex_);
    const auto ready = [&] { return !prints_.empty() && prints_.begin()->first == next_print_; };
    changed_.wait(lock,
                  [&] { return failure_ || ready() || (all_shot_ && shots_.empty() && drawing_ == 0); });
    if (failure_ || !ready()) return std::nullopt;
    Print print = std::move(prints_.begin()->second);
    prints_.erase(prints_.begin());
    ++next_print_;
    changed_.notify_all();
    return print;
  }
  void fail(std::exception_ptr error) {
    const std::lock_guard lock(mutex_);
    if (!failure_) failure_ = std::move(error);
    changed_.notify_all();
  }
  void rethrow_failure() const {
    if (failure_) std::rethrow_exception(failure_);
  }

 private:
  const int window_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Shot> shots_;
  std::map<int, Print> prints_;
  int next_print_ = 0, drawing_ = 0;
  bool all_shot_ = false;
  std::exception_ptr failure_;
};

/// Runs `work`; a failure of it becomes the pipeline's.
template <class F>
void guarded(Pipeline& pipeline, F&& work) {
  try {
    work();
  } catch (...) {
    pipeline.fail(std::current_exception());
  }
}

bool is_blank(const render::Image& image) {
  const auto* first = image.rgba.data();
  for (std::size_t i = 1; i < image.pixel_count(); ++i)
    if (std::memcmp(first, first + 4 * i, 4) != 0) return false;
  return true;
}

void draw_shots(Pipeline& pipeline, const Scene& scene, const ModelLibrary& models) {
  render::Context context;
  Picture picture(scene, models, context);
  while (auto shot = pipeline.take_shot()) {
    const auto start = Clock::now();
    render::Image image = picture.draw(*shot->previous, *shot->current);
    pipeline.give_print({std::move(*shot), std::move(image), ms_since(start)});
  }
}

void print_frames(Pipeline& pipeline, render::FrameSink& sink, int total, RunStats& stats,
                  const ProgressCallback& progress) {
  const auto start = Clock::now();
  while (auto print = pipeline.take_print()) {
    const auto encode_start = Clock::now();
    sink.write(print->shot.frame, print->image);
    const double encode_ms = ms_since(encode_start);
    if (stats.frames++ == 0) stats.startup_s = process_age_s();
    stats.sim.add(print->shot.sim_ms);
    stats.render.add(print->render_ms);
    stats.encode.add(encode_ms);
    const Snapshot& state = *print->shot.current;
    stats.particles = state.point_count();
    stats.most_particles = std::max(stats.most_particles, stats.particles);
    stats.state_hash = stats.frame_states[print->shot.frame] = state.state_hash.hex();
    if (is_blank(print->image)) stats.blank_frames.push_back(print->shot.frame);
    if (progress)
      progress({.done = stats.frames,
                .total = total,
                .sim_ms = print->shot.sim_ms,
                .render_ms = print->render_ms,
                .encode_ms = encode_ms,
                .particles = stats.particles,
                .eta_s = ms_since(start) / 1000 / stats.frames * (total - stats.frames)});
  }
}

/// Produces the shots on the calling thread.
void shoot(Pipeline& pipeline, SnapshotSource& source, const std::vector<int>& frames, bool needs_previous) {
  std::shared_ptr<const Snapshot> last;
  for (std::size_t i = 0; i < frames.size() && !interrupt_signal(); ++i) {
    const auto start = Clock::now();
    const int frame = frames[i];
    std::shared_ptr<const Snapshot> previous;
    if (needs_previous && frame > 1)
      previous =
          last && last->frame == frame - 1 ? last : std::make_shared<const Snapshot>(source.at(frame - 1));
    auto current = std::make_shared<const Snapshot>(source.at(frame));
    if (current->frame != frame) break;  // interrupted on the way
    if (!previous) previous = current;
    last = current;
    if (!pipeline.push(
            {static_cast<int>(i), frame, std::move(previous), std::move(current), ms_since(start)}))
      return;
  }
  pipeline.no_more_shots();
}

}  // namespace

StageTimes::Summary StageTimes::summary() const {
  if (ms_.empty()) return {};
  std::vector<double> sorted = ms_;
  std::ranges::sort(sorted);
  double sum = 0;
  for (const double ms : sorted) sum += ms;
  const auto quantile = [&](double q) {
    return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1) + 0.5)];
  };
  return {sum / static_cast<double>(sorted.size()), quantile(0.5), quantile(0.95), sorted.back()};
}

RunStats render_frames(const LoadedScene& loaded, const ModelLibrary& models, const RenderJob& job,
                       render::FrameSink& sink, const ProgressCallback& progress) {
  const auto start = Clock::now();
  RunStats stats;
  std::optional<Simulation> simulation;
  std::unique_ptr<SnapshotSource> source;
  if (job.cache) {
    SnapshotCache cache(*job.cache);
    cache.check(simulation_key(loaded, models), loaded.scene.frame_count());
    source = std::make_unique<CachedSource>(std::move(cache));
  } else {
    simulation.emplace(loaded.scene, models);
    stats.bodies = simulation->body_count();
    stats.energy_start = simulation->world().energy();
    source = std::make_unique<LiveSource>(*simulation);
  }

  Pipeline pipeline(2 * job.threads + 2);
  {
    std::vector<std::jthread> crew;
    for (int i = 0; i < job.threads; ++i)
      crew.emplace_back([&] { guarded(pipeline, [&] { draw_shots(pipeline, loaded.scene, models); }); });
    crew.emplace_back([&] {
      guarded(pipeline,
              [&] { print_frames(pipeline, sink, static_cast<int>(job.frames.size()), stats, progress); });
    });
    guarded(pipeline,
            [&] { shoot(pipeline, *source, job.frames, subframes(loaded.scene.render.quality) > 1); });
  }
  pipeline.rethrow_failure();

  stats.interrupted_by = interrupt_signal();
  if (stats.frames > 0) sink.close();
  if (simulation) {
    stats.totals = simulation->totals();
    stats.energy_end = simulation->world().energy();
  }
  stats.wall_s = ms_since(start) / 1000;
  return stats;
}

RunStats simulate_frames(const LoadedScene& loaded, const ModelLibrary& models, const SimulateJob& job,
                         const ProgressCallback& progress) {
  const auto start = Clock::now();
  RunStats stats;
  const Scene& scene = loaded.scene;
  const int total = scene.frame_count();
  const std::string key = simulation_key(loaded, models);
  Simulation simulation(scene, models);
  std::optional<SnapshotCache> cache;
  if (job.cache) cache.emplace(*job.cache).create(key, total, job.force);
  std::optional<Trace> trace;
  if (job.trace) trace.emplace(*job.trace, simulation);
  if (trace && job.trace_every_step) simulation.on_substep([&](double time) { trace->record(time); });
  stats.bodies = simulation.body_count();
  stats.energy_start = simulation.world().energy();

  for (int frame = 1; frame <= total && !interrupt_signal(); ++frame) {
    const auto step_start = Clock::now();
    simulation.advance();
    stats.sim.add(ms_since(step_start));
    const auto write_start = Clock::now();
    if (cache) cache->write(simulation.snapshot());
    const bool at_step = job.trace_every_step && frame < total;  // that state is the next sub-step's start
    if (trace && !at_step) trace->record(simulation.world().time());
    stats.encode.add(ms_since(write_start));
    ++stats.frames;
    stats.particles = simulation.world().particle_count();
    stats.most_particles = std::max(stats.most_particles, stats.particles);
    if (progress)
      progress({.done = frame,
                .total = total,
                .sim_ms = ms_since(step_start),
                .particles = stats.particles,
                .eta_s = ms_since(start) / 1000 / frame * (total - frame)});
  }
  stats.interrupted_by = interrupt_signal();
  if (cache && stats.frames == total) cache->finish(key, total);
  if (trace) trace->close();
  stats.totals = simulation.totals();
  stats.energy_end = simulation.world().energy();
  stats.state_hash = simulation.world().state_hash().hex();
  stats.wall_s = ms_since(start) / 1000;
  return stats;
}

std::string simulation_key(const LoadedScene& loaded, const ModelLibrary& models) {
  auto scene = nlohmann::ordered_json::parse(loaded.canonical);
  for (const char* key : {"name", "description", "camera", "lights", "environment", "render"})
    scene.erase(key);
  return text_hash(scene.dump() + models.digest());
}

std::string settings_key(const LoadedScene& loaded, const ModelLibrary& models) {
  return text_hash(std::string(OFFSTAGE_VERSION) + loaded.canonical + models.digest());
}

std::string to_json(const RunStats& stats) {
  nlohmann::ordered_json json;
  json["frames"] = stats.frames;
  json["frames_kept"] = stats.frames_kept;
  json["wall_s"] = stats.wall_s;
  json["startup_s"] = stats.startup_s;
  for (const auto& [name, times] : {std::pair("sim_ms", &stats.sim), std::pair("render_ms", &stats.render),
                                    std::pair("encode_ms", &stats.encode)}) {
    const StageTimes::Summary s = times->summary();
    json[name] = {{"mean", s.mean}, {"p50", s.p50}, {"p95", s.p95}, {"max", s.max}};
  }
  json["peak_rss_mb"] = peak_rss_mb();
  json["bodies"] = stats.bodies;
  json["particles"] = stats.particles;
  json["most_particles"] = stats.most_particles;
  const SimulationTotals& t = stats.totals;
  json["substeps"] = t.substeps;
  json["contacts"] = t.collisions;
  json["born"] = t.born;
  json["expired"] = t.expired;
  json["retired"] = t.retired;
  json["ejected"] = t.ejected;
  json["removed"] = t.removed;
  json["truncated_sweeps"] = t.truncated;
  json["emitter_waits"] = t.waiting;
  json["emitter_skips"] = t.skipped;
  for (const auto& [name, energy] :
       {std::pair("energy_start", &stats.energy_start), std::pair("energy_end", &stats.energy_end)})
    if (*energy)
      json[name] = {{"kinetic", (*energy)->kinetic},
                    {"potential", (*energy)->potential},
                    {"elastic", (*energy)->elastic}};
  json["state_hash"] = stats.state_hash;
  json["blank_frames"] = stats.blank_frames;
  if (stats.interrupted_by) json["interrupted_by"] = stats.interrupted_by;
  return json.dump(2) + "\n";
}

double process_age_s() {
  // Field 22 of /proc/self/stat is the start in clock ticks since boot; the name in field 2 may hold blanks.
  std::ifstream in("/proc/self/stat");
  std::string stat{std::istreambuf_iterator<char>(in), {}};
  std::istringstream fields(stat.substr(stat.rfind(')') + 1));
  std::string field;
  for (int i = 3; i <= 22; ++i) fields >> field;
  double uptime = 0;
  std::ifstream("/proc/uptime") >> uptime;
  return uptime - std::stod(field) / static_cast<double>(sysconf(_SC_CLK_TCK));
}

double peak_rss_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

}  // namespace offstage::producer
