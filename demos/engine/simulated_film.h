#pragma once
/// Provides the states of a film, frame by frame. A state comes from the store, or is simulated and stored.

#include <memory>
#include <optional>
#include <string>

#include "engine/physics_store.h"
#include "producer/build/simulation.h"
#include "producer/run/state_source.h"

namespace offstage::engine {

/// If a state is not in the store, the film is simulated up to that state, if necessary from its start.
class SimulatedFilm : public producer::StateSource {
 public:
  /// `key` names the simulation in the store. `last` is the last frame to simulate; it must be the same for
  /// all films with this key. The scene, the models and the store must outlive this object.
  SimulatedFilm(const producer::Scene& scene, const producer::ModelLibrary& models, PhysicsStore& store,
                std::string key, int last);

  const Physics& physics() const { return *physics_; }
  bool has_state(int frame) const { return find(frame) != nullptr; }
  /// Returns the state of a frame, which must be available.
  const producer::Snapshot& state(int frame) const { return *find(frame); }
  bool is_complete() const { return physics_->totals.has_value(); }

  /// Makes the next simulate() begin at the start of the film.
  void restart();
  /// Simulates one frame, or a part of the time before frame 1. Throws DivergedError.
  void simulate();
  /// Returns the time of the simulation [s].
  double time() const { return simulation_ ? simulation_->world().time() : 0; }
  /// Returns the current state of the simulation, also before frame 1. simulate() must have been called
  /// before.
  producer::Snapshot current() const { return simulation_->snapshot(); }
  /// Returns the number of the latest simulated frame; 0 before frame 1.
  int simulated_to() const { return simulation_ ? simulation_->frame() : 0; }
  /// Returns the finished fraction of the simulation before frame 1, 0 to 1.
  double lead_in() const;

  int advances_to(int frame) override;
  std::shared_ptr<const producer::Snapshot> at(int frame, const OnAdvance& on_advance) override;
  void describe(producer::FrameJob& frame_job) const override;
  void add_totals(producer::RunStats& stats) const override;

 private:
  std::shared_ptr<const producer::Snapshot> find(int frame) const;
  void make_simulation();
  void add_figures(double sim_ms);
  void finish();

  const producer::Scene& scene_;
  const producer::ModelLibrary& models_;
  PhysicsStore& store_;
  const std::string key_;
  const int last_;
  std::shared_ptr<Physics> physics_;
  std::optional<producer::Simulation> simulation_;
  std::optional<sim::Energy> energy_start_;
  std::shared_ptr<const producer::Snapshot>
      latest_[2];  // kept here because the store may have no room for them
  int advances_ = 0;
};

}  // namespace offstage::engine
