#pragma once
/// Estimates the cost of a scene: the share of each object, and, from a short trial run, the time that the
/// film takes on this machine.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "producer/build/models.h"
#include "producer/build/simulation.h"
#include "producer/format/scene_io.h"

namespace offstage::producer {

/// One object of a scene with its copies, or work that belongs to no object. The times are those of the
/// benchmarks (tests/bench/RESULTS.md); they compare objects of one scene and do not predict durations.
struct ObjectCost {
  std::string kind, name;   ///< "cloth", "sheet"
  std::size_t count = 1;    ///< number of copies
  std::string size;         ///< "1681 vertices"
  std::string advice;       ///< advice on how to reduce the object's cost
  double simulation_s = 0;  ///< time per second of film
  double drawing_s = 0;     ///< time per frame
  uint64_t particles = 0;   ///< for an emitter: greatest number of particles alive at once
  double fraction = 0;      ///< fraction of the time of the whole film, 0 .. 1; set only by estimate_cost()
};

/// Returns every object of a (flat) scene that has a cost, in no particular order.
std::vector<ObjectCost> object_costs(const Scene& scene, const ModelLibrary& models);

struct CostEstimate {
  double trial_film_s = 0;        ///< film time that the trial simulated [s]
  double simulation_s_per_s = 0;  ///< measured time of simulation per second of film [s]
  std::optional<double> frame_s;  ///< time of drawing, measured and scaled to the film's size and quality
  std::string not_drawn;          ///< reason if there is no frame_s
  double film_s = 0;              ///< time of the whole film with the trial's number of particles [s]
  /// Time of the whole film with the greatest possible number of particles [s].
  double most_film_s = 0;
  std::vector<ObjectCost> objects;  ///< the most expensive first
};

/// Simulates for about a second and draws one or two frames. The simulation must be new, and cannot be used
/// afterwards; the GL environment must be set. Throws Interrupted and DivergedError.
CostEstimate estimate_cost(const LoadedScene& loaded, const ModelLibrary& models, Simulation& simulation);

/// "cloth 'sheet' (1681 vertices)"
std::string describe(const ObjectCost& object);

}  // namespace offstage::producer
