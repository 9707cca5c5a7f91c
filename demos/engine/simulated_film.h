#pragma once
/// The states of a film, frame by frame: from the store, or simulated into it.

#include <memory>
#include <optional>
#include <string>

#include "engine/physics_store.h"
#include "producer/build/simulation.h"
#include "producer/run/state_source.h"

namespace offstage::engine {

/// Where a state is not in the store, the film is simulated from its start up to that state.
class SimulatedFilm : public producer::StateSource {
 public:
  /// `key` names the simulation in the store. `last` is the last frame that is needed, which is the same for
  /// all films with this key. The scene, the models and the store must outlive this object.
  SimulatedFilm(const producer::Scene& scene, const producer::ModelLibrary& models, PhysicsStore& store,
                std::string key, int last);

  const Physics& physics() const { return *physics_; }
  bool has_state(int frame) const { return find(frame) != nullptr; }
  /// The state must be available.
  const producer::Snapshot& state(int frame) const { return *find(frame); }
  bool is_complete() const { return physics_->totals.has_value(); }

  /// Makes the next simulate() begin at the start of the film.
  void restart();
  /// Simulates one frame, or a part of the time before frame 1. Throws DivergedError.
  void simulate();
  /// Time of the simulation [s].
  double time() const { return simulation_ ? simulation_->world().time() : 0; }
  /// The state of the simulation, which must have begun; it may be before frame 1.
  producer::Snapshot current() const { return simulation_->snapshot(); }
  /// The latest simulated frame, or 0 before the first.
  int simulated_to() const { return simulation_ ? simulation_->frame() : 0; }
  /// Finished fraction of the work before frame 1.
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
  std::shared_ptr<const producer::Snapshot> latest_[2];  // also used if the store has no room
  int advances_ = 0;
};

}  // namespace offstage::engine
