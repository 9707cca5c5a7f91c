#pragma once
/// Estimates the cost of a scene. It gives the share of each object. A short trial run also gives the time
/// that the film takes on this machine.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "producer/build/models.h"
#include "producer/build/simulation.h"
#include "producer/format/scene_io.h"

namespace offstage::producer {

/// The cost of one object of a scene with its copies, or of work that belongs to no object. The times follow
/// from benchmarks (tests/bench/RESULTS.md). They compare the objects of a scene and do not predict
/// durations.
struct ObjectCost {
  std::string kind, name;   ///< such as "cloth" and "sheet"
  std::size_t count = 1;    ///< number of copies
  std::string size;         ///< such as "1681 vertices"
  std::string advice;       ///< advice on how to reduce the object's cost
  double simulation_s = 0;  ///< computing time per second of film [s]
  double drawing_s = 0;     ///< computing time per frame [s]
  uint64_t particles = 0;   ///< for an emitter: greatest number of particles that exist at once
  double fraction = 0;      ///< fraction of the time of the whole film, 0 .. 1; set only by estimate_cost()
};

/// Returns the costs of a scene's objects, in no particular order. The scene must be flat: its placements are
/// expanded to copies.
std::vector<ObjectCost> object_costs(const Scene& scene, const ModelLibrary& models);

struct CostEstimate {
  double trial_film_s = 0;        ///< film time that the trial simulated [s]
  double simulation_s_per_s = 0;  ///< measured computing time of the simulation per second of film [s]
  std::optional<double> frame_s;  ///< drawing time per frame, scaled to the film's size and quality [s]
  std::string not_drawn;          ///< reason why there is no frame_s
  double film_s = 0;  ///< computing time of the whole film, with as many particles as in the trial [s]
  /// Computing time of the whole film, with the greatest possible number of particles [s].
  double most_film_s = 0;
  std::vector<ObjectCost> objects;  ///< the most expensive first
};

/// Estimates the cost by a trial, which simulates for about a second and draws one or two frames.
/// `simulation` must be new, and cannot be used afterwards. The environment variables of GL must be set
/// before. Throws Interrupted after a signal, and DivergedError if the simulation diverges.
CostEstimate estimate_cost(const LoadedScene& loaded, const ModelLibrary& models, Simulation& simulation);

/// Returns the kind, name and size of an object, such as "cloth 'sheet' (1681 vertices)".
std::string describe(const ObjectCost& object);

}  // namespace offstage::producer
