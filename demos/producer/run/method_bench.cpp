#include "producer/run/method_bench.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <type_traits>
#include <utility>

#include <fmt/format.h>

#include "producer/base/interrupt.h"
#include "producer/build/body_shapes.h"
#include "producer/format/table_world.h"
#include "producer/run/csv.h"

namespace offstage::producer {
namespace {

/// Adds a method for each value of a key except its present value. `dependent`: a further override of these
/// methods, which resets a key that is allowed with only some of the values; empty: none.
template <class E>
void add_others(const std::string& key, E present, std::vector<Method>& methods,
                const std::string& dependent = {}) {
  for (std::size_t i = 0; i < Names<E>::kNames.size(); ++i) {
    if (i == static_cast<std::size_t>(present)) continue;
    const std::string setting = fmt::format("{}={}", key, Names<E>::kNames[i]);
    methods.push_back({setting, {"world." + setting}});
    if (!dependent.empty()) methods.back().overrides.push_back(dependent);
  }
}

constexpr std::array kResultHeader = {
    "method",      "steps/s",         "steps",       "pairs tested", "volume tests",
    "piece tests", "impact searches", "collisions",  "iterations",   "pivots",
    "fall-backs",  "overlap mm",      "joint error", "deviation m",  "fault"};
using ResultRow = std::array<std::string, kResultHeader.size()>;

ResultRow row_of(const MethodResult& r, const MethodResult& first) {
  const SimulationTotals& t = r.totals;
  const std::optional<double> deviation = r.deviation(first);
  return {r.name,
          fmt::format("{:.0f}", r.steps_per_second()),
          fmt::format("{}", t.substeps),
          fmt::format("{}", t.contacts.pairs_tested),
          fmt::format("{}", t.contacts.volume_tests),
          fmt::format("{}", t.contacts.piece_tests),
          fmt::format("{}", t.impacts.searches),
          fmt::format("{}", t.impacts.collisions),
          fmt::format("{}", r.iterations()),
          fmt::format("{}", r.pivots()),
          fmt::format("{}", r.fallbacks()),
          fmt::format("{:.3f}", 1000 * t.contacts.penetration),
          fmt::format("{:.1e}", t.joints.error),
          deviation ? fmt::format("{:.4g}", *deviation) : "",
          r.fault};
}

}  // namespace

std::vector<Method> methods_of(const Scene& scene) {
  const sim::CollisionMethods& c = scene.world.collision;
  std::vector<Method> methods = {{"scene", {}}};
  add_others("solver", scene.world.solver, methods);
  add_others("collision.narrow_phase", c.narrow_phase, methods);
  add_others("collision.broad_phase", c.broad_phase, methods,
             fmt::format("world.collision.cell_factor={}", sim::CollisionMethods().cell_factor));
  add_others("collision.impact_time", c.impact_time, methods);
  const auto meshes = std::ranges::count_if(scene.bodies, is_mesh);
  if (meshes > 0) {
    add_others("collision.trees", c.trees, methods);
    add_others("collision.tree_split", c.tree_split, methods);
  }
  const bool pairs = meshes > 1;
  if (pairs) add_others("collision.mesh_pairs", c.mesh_pairs, methods);
  if (!scene.particles.empty() || !scene.emitters.empty())
    add_others("particle_contacts", scene.world.particle_contacts, methods,
               fmt::format("world.particle_cluster={}", WorldSettings().particle_cluster));
  std::vector<std::string> books = {"world.solver=lcp", "world.collision.narrow_phase=vclip",
                                    "world.collision.broad_phase=grid",
                                    "world.collision.impact_time=bisection"};
  if (meshes > 0) books.insert(books.end(), {"world.collision.trees=obb", "world.collision.tree_split=mean"});
  if (pairs) books.push_back("world.collision.mesh_pairs=triangles");
  if (!scene.particles.empty() || !scene.emitters.empty()) books.push_back("world.particle_contacts=lcp");
  methods.push_back({"all of the book's", books});
  return methods;
}

double MethodResult::steps_per_second() const {
  return seconds > 0 ? static_cast<double>(totals.substeps) / seconds : 0;
}

uint64_t MethodResult::iterations() const {
  return totals.solvers.exact.iterations + totals.solvers.fast.iterations + totals.solvers.impacts.iterations;
}

uint64_t MethodResult::pivots() const {
  return totals.solvers.lcp.iterations + totals.solvers.particle_lcp.iterations;
}

uint64_t MethodResult::fallbacks() const {
  uint64_t sum =
      totals.impacts.toi_limit_reached + totals.impacts.restitution_suppressed + totals.joints.unsolved;
  sim::for_each_figure(totals.solvers, [&](std::string_view, const sim::ContactWork& work) {
    sum += work.fallbacks + work.over_budget;
  });
  return sum;
}

std::optional<double> MethodResult::deviation(const MethodResult& other) const {
  if (!fault.empty() || !other.fault.empty()) return {};
  double most = 0;
  for (std::size_t i = 0; i < std::min(positions.size(), other.positions.size()); ++i)
    most = std::max(most, (positions[i] - other.positions[i]).norm());
  return most;
}

MethodResult run_method(const std::string& name, const LoadedScene& loaded, const ModelLibrary& models,
                        double limit_s, const MethodProgress& progress) {
  MethodResult result;
  result.name = name;
  Simulation simulation(loaded.scene, models);
  const int advances = simulation.advances_to(loaded.scene.frame_count());
  const auto start = std::chrono::steady_clock::now();
  const auto elapsed = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  try {
    for (int i = 0; i < advances && result.fault.empty(); ++i) {
      if (const int signal = interrupt_signal()) throw Interrupted(signal);
      if (progress) progress(static_cast<double>(i) / advances);
      simulation.advance();
      if (i + 1 < advances && elapsed() > limit_s)
        result.fault = fmt::format("stopped by --limit after {:.0f} s, at {:.2f} s of {:.2f} s", limit_s,
                                   simulation.world().time(), loaded.scene.output.duration);
    }
  } catch (const DivergedError& error) {
    result.fault = error.what();
  }
  result.seconds = elapsed();
  result.totals = simulation.totals();
  for (const auto& body : simulation.moving_bodies())
    result.positions.push_back(simulation.world().body(body.handle).pose.position);
  return result;
}

void merge(MethodResult& result, const MethodResult& again) {
  if (again.fault.empty()) result.seconds = std::min(result.seconds, again.seconds);
}

std::string to_text(const std::vector<MethodResult>& results) {
  std::vector<ResultRow> rows(1);
  std::ranges::copy(kResultHeader, rows[0].begin());
  for (const MethodResult& r : results) rows.push_back(row_of(r, results.front()));
  std::array<std::size_t, kResultHeader.size()> width{};
  for (const ResultRow& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i) width[i] = std::max(width[i], row[i].size());
  std::string text;
  for (const ResultRow& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i)  // texts are aligned to the left, numbers to the right
      line += i == 0 || i + 1 == row.size() ? fmt::format("{:<{}}  ", row[i], width[i])
                                            : fmt::format("{:>{}}  ", row[i], width[i]);
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

std::string to_csv(const std::vector<MethodResult>& results) {
  std::string text =
      "method,seconds,steps,pairs_tested,volume_tests,piece_tests,impact_searches,collisions,iterations,"
      "pivots,"
      "fallbacks,penetration,"
      "joint_error,deviation,fault\n";
  for (const MethodResult& r : results) {
    const SimulationTotals& t = r.totals;
    CsvRows row;
    row.text(r.name)
        .number(r.seconds)
        .count(t.substeps)
        .count(t.contacts.pairs_tested)
        .count(t.contacts.volume_tests);
    row.count(t.contacts.piece_tests).count(t.impacts.searches);
    row.count(t.impacts.collisions).count(r.iterations()).count(r.pivots()).count(r.fallbacks());
    row.number(t.contacts.penetration).number(t.joints.error);
    if (const std::optional<double> deviation = r.deviation(results.front()))
      row.number(*deviation);
    else
      row.text("");
    row.text(r.fault);
    row.end_row();
    text += row.rows();
  }
  return text;
}

}  // namespace offstage::producer
