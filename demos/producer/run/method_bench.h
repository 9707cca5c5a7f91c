#pragma once
/// Compares the algorithms that a scene can select. The film is simulated with each of them. A table then
/// lists their cost, their work and their errors.

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
  std::string name;  ///< name of the method: "scene" for the unchanged scene, otherwise its first override
  std::vector<std::string> overrides;  ///< overrides such as "world.solver=fast"
};

/// Returns the methods to compare. The first method is the unchanged scene. One method follows for each other
/// value of `world.solver`, and of those keys of `world.collision` that matter for the scene. The last method
/// uses all algorithms of the book together.
std::vector<Method> methods_of(const Scene& scene);

/// Results of one method over a whole film.
struct MethodResult {
  std::string name;
  double seconds = 0;       ///< computing time of the simulation; of several runs, the shortest time [s]
  SimulationTotals totals;  ///< counts of work and fall-backs
  std::vector<sim::Vec3> positions;  ///< positions of the moving bodies at the end [m]
  /// Why the simulation ended early: it diverged, or took too long. Empty if it did not end early.
  std::string fault;

  double steps_per_second() const;
  /// Returns the number of iterations of the contact solvers and the impact solver: Newton steps, sweeps and
  /// pivots.
  uint64_t iterations() const;
  /// Returns the number of pivots of the solver `lcp`, which solves contacts as a linear complementarity
  /// problem.
  uint64_t pivots() const;
  /// Returns the number of cases that the intended algorithm did not solve: fall-backs of the contact
  /// solvers, exceeded budgets and limits of impacts, suppressed restitution, and failed projections of
  /// joints.
  uint64_t fallbacks() const;
  /// Returns the greatest distance between the positions of a body at the end of this run and at the end of
  /// `other` [m]; nothing if either run ended early.
  std::optional<double> deviation(const MethodResult& other) const;
};

/// Receives the fraction of a run that is done, 0 .. 1.
using MethodProgress = std::function<void(double fraction)>;

/// Simulates all frames with the algorithms that the scene selects. After `limit_s` seconds, or if the
/// simulation diverges, it stops and sets MethodResult::fault. Throws Interrupted after a signal.
MethodResult run_method(const std::string& name, const LoadedScene& loaded, const ModelLibrary& models,
                        double limit_s, const MethodProgress& progress = {});

/// Sets the time of `result` to the shorter time of two runs of the same method. If the run `again` ended
/// early, its time is ignored.
void merge(MethodResult& result, const MethodResult& again);

/// Return the results as a table: to_text() with aligned columns, to_csv() as CSV. Deviations are relative to
/// the first result.
std::string to_text(const std::vector<MethodResult>& results);
std::string to_csv(const std::vector<MethodResult>& results);

}  // namespace offstage::producer
