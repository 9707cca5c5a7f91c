#include "producer/run/run_notes.h"

#include <algorithm>

#include <fmt/format.h>

namespace offstage::producer {
namespace {

/// Returns the warning about contacts whose solver did not converge. It names the body with the most such
/// cases.
std::string note_of_rough_contacts(const SimulationTotals& t) {
  const auto& [name, count] =
      *std::ranges::max_element(t.rough_bodies, {}, [](const auto& entry) { return entry.second; });
  const std::size_t others = t.rough_bodies.size() - 1;
  return fmt::format(
      "warning: body '{}'{}: the contact solver did not converge {} times, first at {:.2f} s, and used "
      "approximate forces; the body may sink in, slide or jitter. Reduce world.step (now {:g} s), or make "
      "thin shapes thicker.",
      name, others > 0 ? fmt::format(" (and {} more)", others) : "", count, t.first_rough_s, t.step_s);
}

}  // namespace

std::vector<std::string> notes_of(const SimulationTotals& t) {
  std::vector<std::string> notes;
  for (const std::string& body : t.lost_bodies)
    notes.push_back(
        fmt::format("warning: body '{}' left world.bounds and was frozen there. Enlarge world.bounds to keep "
                    "it moving.",
                    body));
  for (const std::string& joint : t.broken_joints)
    notes.push_back(
        fmt::format("note: joint '{}' broke, because its load exceeded max_force or max_torque", joint));
  if (t.joints.unsolved)
    notes.push_back(fmt::format(
        "warning: the motion of joints did not converge {} times; joints may come apart or slow down. "
        "Reduce world.step (now {:g} s).",
        t.joints.unsolved, t.step_s));
  for (const auto& [cloth, fraction] : t.softened_cloths)
    notes.push_back(fmt::format(
        "warning: cloth '{}': the stiffness of springs was reduced to {:.2g} of its value, because they are "
        "too stiff for their step; the cloth stretches up to {:.2g} times as far as \"stretch\" says. Remove "
        "\"soften\", reduce \"substep\" or use \"integrator\": \"implicit\".",
        cloth, fraction, 1 / fraction));
  for (const auto& [cloth, tear] : t.first_tears)
    notes.push_back(
        fmt::format("note: cloth '{}' first tore at {:.3f} s at ({:.3g}, {:.3g}, {:.3g}): a thread was "
                    "{:.3g} times its rest length, under {}",
                    cloth, tear.time, tear.place.x(), tear.place.y(), tear.place.z(), tear.stretch,
                    tear.touches_body ? fmt::format("the load of body '{}', which touches it", tear.body_name)
                    : tear.by_pressure ? "its pressure"
                                       : "its own load"));
  const auto add = [&](uint64_t count, const char* what) {
    if (count) notes.push_back(fmt::format(fmt::runtime(what), count));
  };
  add(t.particles.retired, "note: {} particles left the world (world.bounds) and were removed");
  add(t.skipped,
      "warning: {} particles were not released because max_alive was reached; emitters look thinner. "
      "Increase max_alive, or lower the rate or the lifespan.");
  add(t.waiting, "note: {} particles waited for free space on their emitter and were released late");
  add(t.particles.removed,
      "warning: {} particles were deep inside a body and were removed. Keep emitters and groups of particles "
      "outside bodies, or reduce world.step.");
  add(t.particles.truncated,
      "note: {} particles reached the limit of collisions per sub-step; the rest of their motion in that "
      "sub-step was dropped");
  if (!t.rough_bodies.empty()) notes.push_back(note_of_rough_contacts(t));
  if (t.solvers.lcp.fallbacks)
    notes.push_back(fmt::format(
        "note: world.solver \"lcp\": the exact solver solved {} of {} islands, because pivoting failed "
        "or they had too many contacts",
        t.solvers.lcp.fallbacks, t.solvers.lcp.solves));
  if (t.solvers.particle_lcp.fallbacks)
    notes.push_back(
        fmt::format("note: world.particle_contacts \"lcp\": relaxation solved {} of {} clusters of "
                    "particles, because pivoting "
                    "failed or they had more than world.particle_cluster contacts",
                    t.solvers.particle_lcp.fallbacks, t.solvers.particle_lcp.solves));
  if (t.impacts.toi_limit_reached)
    notes.push_back(
        fmt::format("warning: pairs or islands of bodies reached the limit of time-of-impact events in a "
                    "sub-step {} times; "
                    "bodies may overlap briefly. Reduce world.step (now {:g} s).",
                    t.impacts.toi_limit_reached, t.step_s));
  return notes;
}

}  // namespace offstage::producer
