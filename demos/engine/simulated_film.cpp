#include "engine/simulated_film.h"

#include <algorithm>
#include <chrono>

#include "producer/run/pipeline.h"
#include "producer/run/run_notes.h"

namespace offstage::engine {

using producer::RunStats;
using producer::Snapshot;

SimulatedFilm::SimulatedFilm(const producer::Scene& scene, const producer::ModelLibrary& models,
                             PhysicsStore& store, std::string key, int last)
    : scene_(scene),
      models_(models),
      store_(store),
      key_(std::move(key)),
      last_(last),
      physics_(store_.open(key_)) {}

std::shared_ptr<const Snapshot> SimulatedFilm::find(int frame) const {
  for (const auto& state : latest_)
    if (state && state->frame == frame) return state;
  const auto place = static_cast<std::size_t>(frame - 1);
  return frame >= 1 && place < physics_->states.size() ? physics_->states[place] : nullptr;
}

void SimulatedFilm::restart() {
  simulation_.reset();
  advances_ = 0;
}

void SimulatedFilm::make_simulation() {
  if (simulation_) return;
  simulation_.emplace(scene_, models_, &store_.meshes());
  energy_start_ = simulation_->energy();
}

void SimulatedFilm::simulate() {
  if (simulated_to() >= last_) restart();
  make_simulation();
  const auto start = std::chrono::steady_clock::now();
  simulation_->advance();
  ++advances_;
  const int frame = simulation_->frame();
  if (frame < 1) return;
  if (!has_state(frame)) {
    auto state = std::make_shared<const Snapshot>(simulation_->snapshot());
    store_.keep(key_, frame, state);
    latest_[frame % 2] = std::move(state);
  }
  const std::chrono::duration<double, std::milli> time = std::chrono::steady_clock::now() - start;
  add_figures(time.count());
  if (frame == last_) finish();
}

void SimulatedFilm::add_figures(double sim_ms) {
  const int frame = simulation_->frame();
  if (physics_->figures.size() >= static_cast<std::size_t>(frame)) return;
  const sim::World& world = simulation_->world();
  physics_->figures.push_back({.frame = frame,
                               .time = scene_.output.time_of(frame),
                               .sim_ms = sim_ms,
                               .particles = world.particle_count(),
                               .contacts = world.contacts().size(),
                               .energy = world.energy(),
                               .state_hash = state(frame).state_hash.hex()});
  constexpr int kEvery = 15;  // notes are updated every 15 frames
  if (frame % kEvery == 0 || frame == last_) physics_->notes = producer::notes_of(simulation_->totals());
}

void SimulatedFilm::finish() {
  RunStats stats;
  stats.frames = last_;
  stats.bodies = simulation_->body_count();
  stats.energy_start = energy_start_;
  stats.energy_end = simulation_->energy();
  stats.totals = simulation_->totals();
  for (const producer::FrameFigures& figures : physics_->figures) {
    stats.sim.add(figures.sim_ms);
    stats.particles = figures.particles;
    stats.most_particles = std::max(stats.most_particles, figures.particles);
    stats.wall_s += figures.sim_ms / 1000;
  }
  stats.state_hash = physics_->figures.back().state_hash;
  physics_->totals = std::move(stats);
}

double SimulatedFilm::lead_in() const {
  if (!simulation_) return 0;
  const int before = simulation_->advances_to(0);
  return before == 0 ? 1 : std::min(1.0, double(advances_) / before);
}

int SimulatedFilm::advances_to(int frame) {
  const auto stored = [&] {
    for (int k = 1; k <= frame; ++k)
      if (!has_state(k)) return false;
    return true;
  };
  if (is_complete() && stored()) return 0;
  make_simulation();
  return simulation_->advances_to(frame);
}

std::shared_ptr<const Snapshot> SimulatedFilm::at(int frame, const OnAdvance& on_advance) {
  while (!has_state(frame)) {
    if (simulated_to() >= frame) restart();
    simulate();
    if (!on_advance() && !has_state(frame)) return nullptr;
  }
  return find(frame);
}

void SimulatedFilm::describe(producer::FrameJob& frame_job) const {
  const producer::FrameFigures& figures = physics_->figures[static_cast<std::size_t>(frame_job.frame - 1)];
  frame_job.contacts = figures.contacts;
  frame_job.energy = figures.energy;
}

void SimulatedFilm::add_totals(RunStats& stats) const {
  if (!physics_->totals) return;
  stats.bodies = physics_->totals->bodies;
  stats.totals = physics_->totals->totals;
  stats.energy_start = physics_->totals->energy_start;
  stats.energy_end = physics_->totals->energy_end;
}

}  // namespace offstage::engine
