#pragma once
/// Compares the algorithms that a scene can choose from: it simulates the film with each of them, and reports
/// their cost, their work and their errors side by side.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "producer/build/models.h"
#include "producer/build/simulation.h"
#include "producer/format/scene_io.h"

namespace offstage::producer {

/// A choice of algorithms, as overrides of the scene.
struct Method {
  std::string name;                    ///< "scene" for the scene as it is, otherwise its first override
  std::vector<std::string> overrides;  ///< such as "world.solver=fast"
};

/// The scene as it is, then one method for each other value of `world.solver` and of the keys of
/// `world.collision` that the scene has a use for, and last all of the book's algorithms together.
std::vector<Method> methods_of(const Scene& scene);

/// Results of one method over a whole film.
struct MethodResult {
  std::string name;
  double seconds = 0;                ///< time of the simulation; the shortest of several runs [s]
  SimulationTotals totals;           ///< work and fall-backs
  std::vector<sim::Vec3> positions;  ///< positions of the moving bodies at the end [m]
  /// Why the simulation ended early: it diverged, or took too long. Empty if it did not end early.
  std::string fault;

  double steps_per_second() const;
  /// Iterations of the contact solvers and of the impact solver: Newton steps, sweeps and pivots.
  uint64_t iterations() const;
  /// Pivots of the solver `lcp`, which computes contact forces as a linear complementarity problem.
  uint64_t pivots() const;
  /// Cases that the intended algorithm did not solve: those of the contact solvers, exceeded budgets and
  /// limits of impacts, suppressed restitution, and failed projections of joints.
  uint64_t fallbacks() const;
  /// Greatest distance between the positions of a body at the end of this run and at the end of `other` [m];
  /// nothing if either run ended early.
  std::optional<double> deviation(const MethodResult& other) const;
};

/// Receives the fraction of a run that is done, 0 .. 1.
using MethodProgress = std::function<void(double fraction)>;

/// Simulates all frames with the scene's methods, or as many as it can in `limit_s` seconds. Throws
/// Interrupted after a signal.
MethodResult run_method(const std::string& name, const LoadedScene& loaded, const ModelLibrary& models,
                        double limit_s, const MethodProgress& progress = {});

/// Merges two runs of the same method: keeps the shorter time, unless it belongs to a run that ended early.
void merge(MethodResult& result, const MethodResult& again);

/// The results as a table in aligned columns, or as CSV. Deviations are those from the first result.
std::string to_text(const std::vector<MethodResult>& results);
std::string to_csv(const std::vector<MethodResult>& results);

}  // namespace offstage::producer
