#pragma once
/// The simulation side of a scene: builds the world and its emitters, advances them frame by frame, and takes
/// the snapshots that the drawing needs.

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "producer/build/models.h"
#include "producer/build/object_table.h"
#include "producer/build/overlays.h"
#include "producer/build/particle_sources.h"
#include "producer/build/snapshot.h"
#include "producer/scene/scene.h"
#include "sim/world.h"

namespace offstage::producer {

/// Thrown if the simulation cannot continue, because a quantity became infinite or NaN. The exception
/// contains the state as JSON text, which can be saved.
class DivergedError : public std::runtime_error {
 public:
  DivergedError(const std::string& what, std::string state)
      : std::runtime_error(what), state_(std::move(state)) {}
  const std::string& state() const { return state_; }

 private:
  std::string state_;
};

/// Statistics of a run: the figures of all steps together. Contacts and penetration are also given for the
/// end of the run.
struct SimulationTotals : sim::StepFigures {
  uint64_t waiting = 0, skipped = 0;  ///< numbers of particles that emitters postponed, and did not release
  uint64_t most_contacts = 0;         ///< greatest number of contact points of bodies at the end of a frame
  std::vector<std::string> broken_joints;  ///< names of broken joints, in the order in which they broke
  std::vector<std::string> lost_bodies;    ///< bodies that left the world's bounds and were frozen there
  /// For each cloth with reduced stiffness: the smallest factor of the stiffness of a spring.
  std::map<std::string, sim::Real> softened_cloths;
  struct FirstTear : sim::ClothTear {
    std::string body_name;  ///< of ClothTear::body; empty: none
  };
  std::map<std::string, FirstTear> first_tears;  ///< by cloth
  /// For each body with approximate contact forces: the number of fall-backs of its solver.
  std::map<std::string, uint64_t> rough_bodies;
  double first_rough_s = 0;  ///< time of the first fall-back [s]
  double step_s = 0;         ///< longest internal step [s]
};

/// Collision meshes by a key, which contains the model's data, its scale and its decomposition settings.
using CollisionMeshes = std::map<std::string, std::shared_ptr<const sim::CollisionMesh>>;

class Simulation {
 public:
  /// Builds the simulation of a scene. `shared` (may be null) keeps collision meshes between simulations, so
  /// that the next version of a scene does not compute them again. Throws SceneError for errors that are
  /// found only here, such as an open mesh as a dynamic body.
  Simulation(const Scene& scene, const ModelLibrary& models, CollisionMeshes* shared = nullptr);

  /// Sets a function that is called at the start of every sub-step with its time [s]. Traces use it.
  void on_substep(std::function<void(double time)> callback) { on_substep_ = std::move(callback); }

  /// Advances by one frame. Prewarming and the time skipped by `output.start` take several calls, during
  /// which frame() is 0. Throws DivergedError.
  void advance();
  int frame() const { return frame_; }
  /// Returns how many calls of advance() lead from the start to a frame.
  int advances_to(int frame) const { return prewarm_pieces_ + skipped_pieces() + frame; }

  Snapshot snapshot() const;

  const sim::World& world() const { return world_; }
  /// Returns the energy of the world. Throws DivergedError if it is not finite.
  sim::Energy energy() const;
  /// Throws DivergedError with the current state and the reason.
  [[noreturn]] void fail(const std::string& what) const;
  SimulationTotals totals() const;
  std::size_t body_count() const { return world_.body_count(); }

  struct NamedBody {
    std::string name;
    sim::BodyHandle handle;
  };
  /// Bodies that can move, by their slots (see ObjectTable).
  const std::vector<NamedBody>& moving_bodies() const { return moving_; }
  /// A group of particles of the scene.
  struct Group {
    const ParticleGroup* scene;
    sim::ParticleSystemHandle handle;
    LookRamps look;
  };
  const std::vector<Group>& particle_groups() const { return groups_; }
  struct NamedCloth {
    std::string name;
    sim::ClothHandle handle;
  };
  const std::vector<NamedCloth>& cloths() const { return cloths_; }

  /// Calls visit(name, particles, as drawn) for each group and each source of particles, in the order of a
  /// snapshot's point sets.
  void for_each_particle_system(const std::function<void(const std::string&, const sim::ParticleArrays&,
                                                         const PointSet&)>& visit) const;

  /// Returns the name of the object that is not finite and the state of all others, as JSON text. The text is
  /// saved when a run diverges.
  std::string state_dump(const sim::NonFinite& lost) const;

 private:
  void add_bodies(const Scene& scene, const ModelLibrary& models, CollisionMeshes* shared);
  sim::MeshHandle add_mesh(const MeshFile& file, const ModelLibrary& models);
  void add_pieces(const Body& body, const sim::BodyDef& whole, const ModelLibrary& models);
  void add_particle_groups(const Scene& scene);
  void add_particles(const ParticleGroup& group, sim::ParticleSystemHandle system, sim::Real elapsed);
  void add_late_particles(sim::Real start, sim::Real end);
  void add_springs(sim::Real time);
  void add_joints(const Scene& scene);
  void add_cloths(const Scene& scene, const ModelLibrary& models);
  void note_cloths();
  void add_forces(const Scene& scene);
  sim::BodyHandle body_named(const std::string& name) const;
  sim::ParticleSystemHandle system_named(const std::string& name) const;
  void prewarm(double from, double to);
  void step(double sampling_time);
  int skipped_pieces() const;  // pieces in which the time before output.start is simulated
  void note(const sim::StepReport& report);

  struct DrawnJoint {
    sim::JointHandle handle;
    std::size_t first_rod;
  };

  const Scene& scene_;
  const ObjectTable objects_;
  sim::World world_;
  std::optional<ParticleSources> sources_;
  std::vector<NamedBody> moving_;
  std::vector<Group> groups_;
  std::vector<NamedCloth> cloths_;
  std::map<std::string, sim::BodyHandle> bodies_;
  std::vector<sim::Pose> moving_poses_;                 // by slot; kept up to date from World::moved()
  std::map<sim::BodyHandle, std::size_t> slot_of_;      // slots of moving bodies
  std::vector<std::optional<sim::SpringDef>> springs_;  ///< by index in the scene; those that were added
  std::vector<DrawnJoint> joints_;
  std::optional<Overlays> overlays_;
  std::function<void(double)> on_substep_;
  SimulationTotals totals_;
  int frame_ = 0, skipped_pieces_ = 0, prewarm_pieces_ = 0, prewarmed_pieces_ = 0;
};

}  // namespace offstage::producer
