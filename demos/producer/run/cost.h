#pragma once
/// What a scene costs: how the work spreads over its objects by their sizes, and how long the film takes on
/// this machine by a short trial.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "producer/build/models.h"
#include "producer/build/simulation.h"
#include "producer/format/scene_io.h"

namespace offstage::producer {

/// One object of a scene with its copies, or what belongs to no object. The times are those of the benchmarks
/// (tests/bench/RESULTS.md), for comparing objects of one scene, not for clocks.
struct ObjectCost {
  std::string kind, name;   ///< "cloth", "sheet"
  std::size_t count = 1;    ///< copies
  std::string size;         ///< "1681 vertices"
  std::string advice;       ///< what makes it cheaper
  double simulation_s = 0;  ///< per second of film
  double drawing_s = 0;     ///< per frame
  uint64_t particles = 0;   ///< most that are alive at once, of an emitter
  double share = 0;         ///< of the time of the whole film, 0 .. 1; by estimate_cost() alone
};

/// Every object of a (flat) scene that costs something, in no order.
std::vector<ObjectCost> object_costs(const Scene& scene, const ModelLibrary& models);

struct CostEstimate {
  double trial_film_s = 0;          ///< film time that the trial simulated [s]
  double simulation_s_per_s = 0;    ///< measured, per second of film
  std::optional<double> frame_s;    ///< of drawing, measured and scaled to the film's size and quality
  std::string not_drawn;            ///< why there is no frame_s
  double film_s = 0;                ///< whole film, as it goes at the trial's number of particles
  double most_film_s = 0;           ///< the same with all particles that there can be
  std::vector<ObjectCost> objects;  ///< the most expensive first
};

/// Runs the simulation for about a second and draws a frame or two. The simulation must be fresh, and is of
/// no use afterwards; the GL environment must be pinned. Throws Interrupted and DivergedError.
CostEstimate estimate_cost(const LoadedScene& loaded, const ModelLibrary& models, Simulation& simulation);

/// "cloth 'sheet' (1681 vertices)"
std::string describe(const ObjectCost& object);

}  // namespace offstage::producer
