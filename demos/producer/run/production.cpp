#include "producer/run/production.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <exception>
#include <fstream>
#include <mutex>
#include <sstream>
#include <thread>

#include <nlohmann/json.hpp>
#include <sys/resource.h>
#include <unistd.h>

#include "producer/base/interrupt.h"
#include "producer/base/version.h"
#include "producer/build/picture.h"
#include "producer/run/particle_table.h"
#include "producer/run/pipeline.h"
#include "producer/run/snapshot_cache.h"
#include "producer/run/state_source.h"
#include "producer/run/time_left.h"
#include "producer/run/trace.h"
#include "render/context.h"
#include "render/error.h"

namespace offstage::producer {
namespace {

using Clock = std::chrono::steady_clock;

constexpr const char* kOutdated = "the film is no longer needed";

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Counts simulated and finished frames, and reports the progress of a run. The thread that simulates and the
/// thread that writes share one object.
class ProgressMeter {
 public:
  /// See TimeLeft for the arguments.
  ProgressMeter(const ProgressCallback& callback, int frames, int frames_to_simulate, int warm_ups,
                double drawing_ms)
      : callback_(callback), left_(frames, frames_to_simulate, warm_ups, drawing_ms) {
    latest_.total = frames;
    latest_.frames_to_simulate = frames_to_simulate;
  }
  void simulated_one() {
    const std::lock_guard lock(mutex_);
    if (!callback_ || latest_.frames_simulated >= latest_.frames_to_simulate) return;
    ++latest_.frames_simulated;
    const double ms = ms_since(simulating_since_);
    left_.simulated(ms);
    latest_.simulating_s += ms / 1000;
    latest_.frame_finished = false;
    report();
    simulating_since_ = Clock::now();
  }
  /// Must be called when the simulation continues after it has waited for the drawing.
  void simulation_goes_on() { simulating_since_ = Clock::now(); }
  void finished_one(double sim_ms, double render_ms, double encode_ms, uint64_t particles) {
    const std::lock_guard lock(mutex_);
    if (!callback_) return;
    ++latest_.done;
    left_.finished(render_ms + encode_ms, ms_since(start_) / 1000);
    latest_.drawing_s += (render_ms + encode_ms) / 1000;
    latest_.sim_ms = sim_ms;
    latest_.render_ms = render_ms;
    latest_.encode_ms = encode_ms;
    latest_.particles = particles;
    latest_.frame_finished = true;
    report();
  }

 private:
  void report() {
    latest_.fraction = left_.fraction();
    latest_.eta_s = left_.seconds(ms_since(start_) / 1000);
    latest_.is_steady = left_.is_steady();
    callback_(latest_);
  }

  const ProgressCallback& callback_;
  std::mutex mutex_;
  TimeLeft left_;
  Progress latest_;
  const Clock::time_point start_ = Clock::now();
  Clock::time_point simulating_since_ = start_;  // only the simulating thread uses it
};

class LiveSource : public StateSource {
 public:
  /// Prepares a simulation. The requested states are written to `kept`, unless it is empty. `keep_at_most`:
  /// see RenderJob.
  LiveSource(const Scene& scene, const ModelLibrary& models, std::optional<SnapshotCache>& kept,
             std::optional<uint64_t> keep_at_most)
      : simulation_(scene, models),
        energy_start_(simulation_.energy()),
        kept_(kept),
        keep_at_most_(keep_at_most) {}
  int advances_to(int frame) override { return simulation_.advances_to(frame); }
  std::shared_ptr<const Snapshot> at(int frame, const OnAdvance& on_advance) override {
    while (simulation_.frame() < frame) {
      simulation_.advance();
      if (!on_advance() && simulation_.frame() < frame) return nullptr;
    }
    auto snapshot = std::make_shared<const Snapshot>(simulation_.snapshot());
    keep(*snapshot);
    return snapshot;
  }
  void describe(FrameJob& frame_job) const override {
    frame_job.contacts = simulation_.world().contacts().size();
    frame_job.energy = simulation_.world().energy();
  }
  void add_totals(RunStats& stats) const override {
    stats.bodies = simulation_.body_count();
    stats.totals = simulation_.totals();
    stats.energy_start = energy_start_;
    stats.energy_end = simulation_.energy();
  }

 private:
  void keep(const Snapshot& snapshot) {
    if (!kept_) return;
    if (!keep_at_most_) {
      kept_->write(snapshot);
      return;
    }
    bool fits = false;
    try {
      bytes_ += kept_->write(snapshot);
      fits = bytes_ <= *keep_at_most_;
    } catch (const render::FileError&) {
    }
    if (fits) return;
    kept_->discard();
    kept_.reset();
  }

  Simulation simulation_;
  const sim::Energy energy_start_;
  std::optional<SnapshotCache>& kept_;
  const std::optional<uint64_t> keep_at_most_;
  uint64_t bytes_ = 0;  // written so far
};

class CachedSource : public StateSource {
 public:
  explicit CachedSource(SnapshotCache cache) : cache_(std::move(cache)) {}
  int advances_to(int) override { return 0; }
  std::shared_ptr<const Snapshot> at(int frame, const OnAdvance&) override {
    return std::make_shared<const Snapshot>(cache_.read(frame));
  }

 private:
  SnapshotCache cache_;
};

std::unique_ptr<StateSource> cached_source(const LoadedScene& loaded, const ModelLibrary& models,
                                           const std::filesystem::path& folder) {
  SnapshotCache cache(folder);
  cache.open(simulation_key(loaded, models), loaded.scene.frame_count());
  return std::make_unique<CachedSource>(std::move(cache));
}

bool is_blank(const render::Image& image) {
  const auto* first = image.rgba.data();
  for (std::size_t i = 1; i < image.pixel_count(); ++i)
    if (std::memcmp(first, first + 4 * i, 4) != 0) return false;
  return true;
}

void draw_frames(Pipeline& pipeline, const Scene& scene, const ModelLibrary& models, const RenderJob& job,
                 bool linear) {
  render::Context context;
  Picture picture(scene, models, context);
  while (auto frame_job = pipeline.take_job()) {
    const auto start = Clock::now();
    const render::LightSums before = picture.light_sums();
    render::Image image = picture.draw(*frame_job->previous, *frame_job->current, job.stop);
    if (image.rgba.empty()) throw render::StoppedError(kOutdated);
    render::Channels data;
    if (job.channels.any()) data = picture.channels(*frame_job->previous, *frame_job->current);
    render::HdrImage light;
    if (linear) light = picture.linear();
    render::LightSums sums = picture.light_sums();
    sums.arriving -= before.arriving;
    sums.removed -= before.removed;
    pipeline.give_rendered(
        {std::move(*frame_job), std::move(image), ms_since(start), std::move(data), std::move(light), sums});
  }
}

/// Stores the data of a frame for the report.
void keep_frame(const RenderedFrame& rendered, double encode_ms, int total, RunStats& stats) {
  constexpr int kPictures = 12, kWidth_px = 320;
  const Snapshot& state = *rendered.frame_job.current;
  stats.figures.push_back({.frame = rendered.frame_job.frame,
                           .time = state.time,
                           .sim_ms = rendered.frame_job.sim_ms,
                           .render_ms = rendered.render_ms,
                           .encode_ms = encode_ms,
                           .particles = state.point_count(),
                           .contacts = rendered.frame_job.contacts,
                           .energy = rendered.frame_job.energy,
                           .state_hash = state.state_hash.hex(),
                           .pixel_hash = render::pixel_hash(rendered.image)});
  const int every = std::max(1, (total + kPictures - 1) / kPictures);
  if (rendered.frame_job.index % every == 0)
    stats.pictures.emplace_back(rendered.frame_job.frame, render::reduced(rendered.image, kWidth_px));
}

void print_frames(Pipeline& pipeline, render::FrameSink& sink, const Scene& scene, const RenderJob& job,
                  RunStats& stats, ProgressMeter& meter) {
  const auto total = static_cast<int>(job.frames.size());
  const bool numbered = job.channels_stem.filename().string().find('#') != std::string::npos;
  const render::ObjectNames objects = object_names(scene);
  while (auto rendered = pipeline.take_rendered()) {
    const auto encode_start = Clock::now();
    sink.write(rendered->frame_job.frame, rendered->image);
    if (sink.needs_linear()) sink.write_linear(rendered->frame_job.frame, rendered->linear);
    if (job.channels.any())
      render::write_channels(
          numbered ? render::frame_path(job.channels_stem, rendered->frame_job.frame) : job.channels_stem,
          rendered->channels, job.channels, objects);
    const double encode_ms = ms_since(encode_start);
    if (stats.frames++ == 0) stats.startup_s = process_age_s();
    stats.sim.add(rendered->frame_job.sim_ms);
    stats.render.add(rendered->render_ms);
    stats.encode.add(encode_ms);
    stats.light += rendered->light;
    const Snapshot& state = *rendered->frame_job.current;
    stats.particles = state.point_count();
    stats.most_particles = std::max(stats.most_particles, stats.particles);
    stats.state_hash = stats.frame_states[rendered->frame_job.frame] = state.state_hash.hex();
    if (job.report) keep_frame(*rendered, encode_ms, total, stats);
    if (is_blank(rendered->image)) stats.blank_frames.push_back(rendered->frame_job.frame);
    meter.finished_one(rendered->frame_job.sim_ms, rendered->render_ms, encode_ms, stats.particles);
  }
}

/// Produces the states on the calling thread.
void produce_frames(Pipeline& pipeline, StateSource& source, const RenderJob& job, bool needs_previous,
                    ProgressMeter& meter) {
  const auto go_on = [&] { return !interrupt_signal() && !pipeline.failed() && !(job.stop && job.stop()); };
  const auto state = [&](int frame) {
    meter.simulation_goes_on();
    return source.at(frame, [&] {
      meter.simulated_one();
      return go_on();
    });
  };
  std::shared_ptr<const Snapshot> last;
  for (std::size_t i = 0; i < job.frames.size() && go_on(); ++i) {
    const auto start = Clock::now();
    const int frame = job.frames[i];
    std::shared_ptr<const Snapshot> previous;
    if (needs_previous && frame > 1) {
      previous = last && last->frame == frame - 1 ? last : state(frame - 1);
      if (!previous) break;
    }
    auto current = state(frame);
    if (!current) break;
    if (!previous) previous = current;
    last = current;
    FrameJob frame_job{
        static_cast<int>(i), frame, std::move(previous), std::move(current), ms_since(start), 0, {}};
    if (job.report) source.describe(frame_job);
    if (!pipeline.push(std::move(frame_job))) return;
  }
  pipeline.finish_jobs();
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
  std::optional<SnapshotCache> kept;
  std::unique_ptr<StateSource> own;
  if (job.cache) {
    own = cached_source(loaded, models, *job.cache);
  } else if (!job.states) {
    own = std::make_unique<LiveSource>(loaded.scene, models, kept, job.keep_at_most);
    if (job.keep)
      kept.emplace(*job.keep).create(simulation_key(loaded, models), loaded.scene.frame_count(), true);
  }
  StateSource& source = own ? *own : *job.states;
  constexpr double kDrawing_ms = 300;
  const auto frames = static_cast<int>(job.frames.size());
  ProgressMeter meter(progress, frames, frames > 0 ? source.advances_to(job.frames.back()) : 0, job.threads,
                      kDrawing_ms);

  Pipeline pipeline(job.threads + 2);
  const auto draw = [&] {
    guarded(pipeline, [&] { draw_frames(pipeline, loaded.scene, models, job, sink.needs_linear()); });
  };
  const auto print = [&] {
    guarded(pipeline, [&] { print_frames(pipeline, sink, loaded.scene, job, stats, meter); });
  };
  {
    std::vector<std::jthread> workers;
    // If a thread cannot be started, the run must fail before the other threads are awaited.
    guarded(pipeline, [&] {
      for (int i = 0; i < job.threads; ++i) workers.emplace_back(draw);
      workers.emplace_back(print);
      produce_frames(pipeline, source, job,
                     subframes(loaded.scene.render.quality) > 1 || job.channels.any() || job.keep, meter);
    });
  }
  pipeline.rethrow_failure();
  if (stats.frames < frames && job.stop && job.stop()) throw render::StoppedError(kOutdated);

  if (stats.frames < frames) stats.interrupted_by = interrupt_signal();
  if (stats.frames > 0) sink.close();
  if (kept && !stats.interrupted_by) kept->publish();
  source.add_totals(stats);
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
  std::optional<ContactTrace> contacts;
  std::optional<ClothTrace> cloths;
  if (job.trace) trace.emplace(*job.trace, simulation);
  if (job.contacts) contacts.emplace(*job.contacts, simulation);
  if (job.cloths) cloths.emplace(*job.cloths, simulation);
  std::optional<ClothPointTrace> cloth_points;
  if (job.cloth_points) cloth_points.emplace(*job.cloth_points, simulation);
  std::optional<JointTrace> joints;
  if (job.joints) joints.emplace(*job.joints, simulation);
  std::optional<ParticleTable> particles;
  if (job.particles) particles.emplace(*job.particles, simulation);
  const auto record = [&](double time) {
    try {
      if (particles) particles->record(simulation.frame(), time);
      if (trace) trace->record(time);
      if (contacts) contacts->record(time);
      if (cloths) cloths->record(time);
      if (cloth_points) cloth_points->record(time);
      if (joints) joints->record(time);
    } catch (const CsvFile::NotFinite& error) {
      simulation.fail(error.what());
    }
  };
  if (job.trace_every_step) simulation.on_substep(record);
  stats.bodies = simulation.body_count();
  stats.energy_start = simulation.energy();

  ProgressMeter meter(progress, total, simulation.advances_to(total), 0, 0);
  for (int frame = 1; frame <= total; ++frame) {
    const auto step_start = Clock::now();
    meter.simulation_goes_on();
    while (simulation.frame() < frame && !interrupt_signal()) {
      simulation.advance();
      meter.simulated_one();
    }
    if (simulation.frame() < frame) break;  // interrupted
    stats.sim.add(ms_since(step_start));
    const double sim_ms = ms_since(step_start);
    const auto write_start = Clock::now();
    if (cache) cache->write(simulation.snapshot());
    // With rows for every sub-step, the next sub-step records this state at its start.
    const bool at_step = job.trace_every_step && frame < total;
    if (!at_step) record(simulation.world().time());
    stats.encode.add(ms_since(write_start));
    ++stats.frames;
    stats.particles = simulation.world().particle_count();
    stats.most_particles = std::max(stats.most_particles, stats.particles);
    meter.finished_one(sim_ms, 0, ms_since(write_start), stats.particles);
  }
  if (stats.frames < total) stats.interrupted_by = interrupt_signal();
  if (cache && stats.frames == total) cache->publish();
  if (trace && stats.frames == total) trace->close();
  if (contacts && stats.frames == total) contacts->close();
  if (cloths && stats.frames == total) cloths->close();
  if (cloth_points && stats.frames == total) cloth_points->close();
  if (joints && stats.frames == total) joints->close();
  if (particles && stats.frames == total) particles->close();
  stats.totals = simulation.totals();
  stats.energy_end = simulation.energy();
  stats.state_hash = simulation.world().state_hash().hex();
  stats.wall_s = ms_since(start) / 1000;
  return stats;
}

RunStats visit_frames(const LoadedScene& loaded, const ModelLibrary& models, const SnapshotJob& job,
                      const std::function<void(const Snapshot&)>& take, const ProgressCallback& progress) {
  const auto start = Clock::now();
  RunStats stats;
  std::optional<SnapshotCache> kept;  // stays empty
  const std::unique_ptr<StateSource> source =
      job.cache ? cached_source(loaded, models, *job.cache)
                : std::make_unique<LiveSource>(loaded.scene, models, kept, std::nullopt);
  const auto frames = static_cast<int>(job.frames.size());
  ProgressMeter meter(progress, frames, frames > 0 ? source->advances_to(job.frames.back()) : 0, 0, 0);
  for (const int frame : job.frames) {
    const auto sim_start = Clock::now();
    meter.simulation_goes_on();
    const std::shared_ptr<const Snapshot> snapshot = source->at(frame, [&] {
      meter.simulated_one();
      return interrupt_signal() == 0;
    });
    if (!snapshot) break;  // interrupted on the way
    const double sim_ms = ms_since(sim_start);
    stats.sim.add(sim_ms);
    const auto take_start = Clock::now();
    take(*snapshot);
    stats.encode.add(ms_since(take_start));
    ++stats.frames;
    stats.particles = snapshot->point_count();
    stats.state_hash = snapshot->state_hash.hex();
    meter.finished_one(sim_ms, 0, ms_since(take_start), stats.particles);
    if (interrupt_signal()) break;
  }
  if (stats.frames < frames) stats.interrupted_by = interrupt_signal();
  source->add_totals(stats);
  stats.wall_s = ms_since(start) / 1000;
  return stats;
}

/// The keys of a material that the simulation reads. The other keys are its look.
constexpr std::array kPhysicalKeys = {
    "name",           "restitution",      "friction",         "static_friction",
    "cross_friction", "rolling_friction", "spinning_friction"};

std::string simulation_key(const LoadedScene& loaded, const ModelLibrary& models) {
  auto scene = nlohmann::ordered_json::parse(loaded.canonical);
  for (const char* key : {"name", "description", "camera", "cameras", "lights", "environment", "render"})
    scene.erase(key);
  if (scene.contains("output"))
    for (const char* key : {"channels", "channel_format"}) scene["output"].erase(key);
  if (scene.contains("materials"))
    for (auto& material : scene["materials"]) {
      nlohmann::ordered_json physical;
      for (const char* key : kPhysicalKeys)
        if (material.contains(key)) physical[key] = material[key];
      material = std::move(physical);
    }
  return text_hash(std::string(version()) + scene.dump() + models.digest());
}

std::string settings_key(const LoadedScene& loaded, const ModelLibrary& models) {
  auto scene = nlohmann::ordered_json::parse(loaded.canonical);
  // These keys do not affect any frame. The camera that is drawn is `camera`.
  for (const char* key : {"name", "description", "cameras"}) scene.erase(key);
  return text_hash(std::string(version()) + scene.dump() + models.digest());
}

namespace {

using Json = nlohmann::ordered_json;

/// Adds the figures of a part of the results to a JSON object.
template <sim::HasFigures Part>
void add_figures(const Part& part, Json& json) {
  sim::for_each_figure(part, [&](std::string_view name, const auto& value) {
    if constexpr (!sim::HasFigures<std::remove_cvref_t<decltype(value)>>)
      json[std::string(name)] = value;
    else
      add_figures(value, name.empty() ? json : json[std::string(name)]);
  });
}

}  // namespace

std::string to_json(const RunStats& stats) {
  Json json;
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
  json["light_removed"] = stats.light.removed / std::max(stats.light.arriving, 1e-300);
  json["bodies"] = stats.bodies;
  json["particles"] = stats.particles;
  json["most_particles"] = stats.most_particles;
  const SimulationTotals& t = stats.totals;
  add_figures(t, json);
  json["most_contacts"] = t.most_contacts;
  json["emitter_waits"] = t.waiting;
  json["emitter_skips"] = t.skipped;
  json["lost_bodies"] = t.lost_bodies;
  json["broken_joints"] = t.broken_joints;
  json["rough_bodies"] = t.rough_bodies;
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
