#include "producer/run/run_notes.h"

#include <algorithm>

#include <fmt/format.h>

namespace offstage::producer {
namespace {

/// Names the body that was concerned most often.
std::string note_of_rough_contacts(const SimulationTotals& t) {
  const auto& [name, count] =
      *std::ranges::max_element(t.rough_bodies, {}, [](const auto& entry) { return entry.second; });
  const std::size_t others = t.rough_bodies.size() - 1;
  return fmt::format(
      "warning: body '{}'{}: contact forces are approximate {} times, first at {:.2f} s, because the solver "
      "found "
      "no exact ones; the body may sink in, slide or tremble there. Reduce world.step (now {:g} s), or make "
      "thin "
      "shapes thicker",
      name, others > 0 ? fmt::format(" (and {} more)", others) : "", count, t.first_rough_s, t.step_s);
}

}  // namespace

std::vector<std::string> notes_of(const SimulationTotals& t) {
  std::vector<std::string> notes;
  for (const std::string& body : t.lost_bodies)
    notes.push_back(
        fmt::format("warning: the body '{}' left the world (world.bounds) and stays where it left", body));
  for (const std::string& joint : t.broken_joints)
    notes.push_back(fmt::format("note: the joint '{}' broke", joint));
  if (t.joints_unsolved)
    notes.push_back(
        fmt::format("warning: joints could not be put back together {} times; use a smaller world.step",
                    t.joints_unsolved));
  const auto add = [&](uint64_t count, const char* what) {
    if (count) notes.push_back(fmt::format(fmt::runtime(what), count));
  };
  add(t.retired, "note: {} particles left the world (world.bounds)");
  add(t.skipped, "warning: {} particles were not released: max_alive was reached");
  add(t.waiting, "note: {} particles had to wait for room on their emitter");
  add(t.removed, "warning: {} particles were inside a body and had to be removed");
  add(t.truncated, "note: {} particles hit more often in one step than is followed");
  if (!t.rough_bodies.empty()) notes.push_back(note_of_rough_contacts(t));
  if (t.toi_limit_reached)
    notes.push_back(
        fmt::format("warning: {} times a pair of bodies reached the limit of collisions per sub-step; it "
                    "stopped bouncing "
                    "until the next. Reduce world.step (now {:g} s)",
                    t.toi_limit_reached, t.step_s));
  return notes;
}

}  // namespace offstage::producer
