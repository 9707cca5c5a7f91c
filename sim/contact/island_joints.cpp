#include "sim/contact/island_joints.h"

#include <algorithm>
#include <cmath>

namespace offstage::sim {

bool has_forces(const Island& island) {
  // The free motion already includes the springs. Their rows react to changes of this motion.
  const auto has_other_rows = [](const Joint* joint) { return joint->has_rows_besides_spring(); };
  return !island.pairs.empty() ||
         std::any_of(island.articulations.begin(), island.articulations.end(), [&](const Articulation* a) {
           return a->has_bounded_rows() && std::ranges::any_of(a->joints(), has_other_rows);
         });
}

/// Collects the rows of the constraints. `place` evaluates the constraints of an articulation.
template <class Place>
void IslandJoints::collect_constraints(const Island& island, Springs springs, Place&& place) {
  const auto row = [](const Articulation& a, uint32_t link) {
    return link == JointSystem::kDriven ? kUnmoved : a.bodies()[link]->row;
  };
  for (Articulation* a : island.articulations) {
    place(*a);
    articulations_.push_back(a);
    const JointSystem& system = springs == Springs::rows ? a->system() : a->inert_system();
    for (std::size_t j = 0; j < system.joints().size(); ++j)
      constraints_.push_back(
          {row(*a, system.joints()[j].a), row(*a, system.joints()[j].b), &system.rows()[j]});
  }
}

/// Evaluates the constraints at the time at which the impulses act: the middle of the interval, or the time
/// at which a limit is reached. If the joint moved between the two times, the impulses would change the
/// angular momentum.
void IslandJoints::place(Articulation& a, const ContactInterval& interval) {
  const Real from = a.has_springs() ? a.kicks_act_from() : kMiddle;
  a.place_within(interval.end, interval.duration, from, interval.substep);
  std::optional<Real> stop;
  if (a.has_bounded_rows() && !a.has_springs()) stop = first_stop(a, interval.duration, interval.end);
  if (stop) a.place_within(interval.end, interval.duration, *stop, interval.substep);
  stops_.push_back(stop);
}

bool IslandJoints::act_throughout() const {
  // Rows do not act throughout if they belong to a distance joint, whose direction turns with its ends, or to
  // a limit, which has one finite bound.
  const auto is_distance = [](const Joint* joint) { return joint->def.type == JointType::distance; };
  return std::none_of(stops_.begin(), stops_.end(), [](const auto& stop) { return stop.has_value(); }) &&
         std::none_of(articulations_.begin(), articulations_.end(),
                      [&](const Articulation* a) {
                        return a->has_springs() || std::ranges::any_of(a->joints(), is_distance);
                      }) &&
         std::all_of(bounded_.begin(), bounded_.end(), [](const BoundedRow& row) {
           return std::isfinite(row.lower) == std::isfinite(row.upper);
         });
}

void IslandJoints::project(std::span<ContactBody> bodies, Real end) const {
  std::vector<Vec6> velocities;
  for (std::size_t i = 0; i < articulations_.size(); ++i) {
    if (!stops_[i]) continue;
    const std::span<Body* const> links = articulations_[i]->bodies();
    velocities.resize(links.size());
    for (std::size_t k = 0; k < links.size(); ++k)
      velocities[k] << bodies[links[k]->row].velocity, bodies[links[k]->row].angular_velocity;
    articulations_[i]->project(end, velocities);
    for (std::size_t k = 0; k < links.size(); ++k) {
      bodies[links[k]->row].velocity = velocities[k].head<3>();
      bodies[links[k]->row].angular_velocity = velocities[k].tail<3>();
    }
  }
}

void IslandJoints::collect(std::span<const Island* const> islands, const ContactInterval& interval,
                           Springs springs) {
  articulations_.clear();
  constraints_.clear();
  bounded_.clear();
  origins_.clear();
  bounded_ends_.clear();
  stops_.clear();
  impulses_.clear();
  for (const Island* island : islands) {
    const std::size_t first = articulations_.size();
    collect_constraints(*island, springs, [&](Articulation& a) { place(a, interval); });
    for (std::size_t i = first; i < articulations_.size(); ++i) {
      Articulation& a = *articulations_[i];
      collect_bounded_rows(a, interval.duration, interval.end, bounded_, origins_);
      if (springs == Springs::rows) collect_springs(a, interval.duration, interval.end, bounded_, origins_);
      bounded_ends_.push_back(static_cast<uint32_t>(bounded_.size()));
      for (const Joint* joint : a.joints()) {
        impulses_.push_back(interval.duration * joint->reaction);
        if (springs == Springs::rows && joint->has_spring()) impulses_.back().tail<3>().setZero();
      }
    }
  }
}

void IslandJoints::collect_for_collision(const Island& island, Real time, Real substep) {
  articulations_.clear();
  constraints_.clear();
  bounded_.clear();
  origins_.clear();
  collect_constraints(island, Springs::rows, [&](Articulation& a) { a.place(time, true); });
  for (const Articulation* a : articulations_) {
    collect_stops(*a, time, bounded_, origins_);
    collect_springs(*a, substep, time, bounded_, origins_);
  }
  for (BoundedRow& row : bounded_) row.impulse = 0;
  impulses_.assign(constraints_.size(), Vec6::Zero());
}

/// Returns the wrench that a bounded row's impulse exerts on its joint.
Wrench IslandJoints::wrench(std::size_t i, Real impulse) const {
  const Vec6 on_a = impulse * bounded_[i].on_a;
  return {on_a.head<3>(), on_a.tail<3>() - origins_[i].arm.cross(on_a.head<3>())};
}

void IslandJoints::store_impact_impulses() {
  for (std::size_t i = 0; i < bounded_.size(); ++i)
    origins_[i].joint->impact_impulse += wrench(i, bounded_[i].impulse);
  std::size_t first = 0;
  for (Articulation* a : articulations_) {
    a->add_impact_impulses(std::span(impulses_).subspan(first, a->joints().size()));
    first += a->joints().size();
  }
}

void IslandJoints::store_impulses(Real duration) {
  for (std::size_t i = 0; i < bounded_.size(); ++i) {
    const Real effort = bounded_[i].impulse / duration;
    origins_[i].joint->efforts[origins_[i].slot] = effort;
    origins_[i].joint->load += wrench(i, effort);
  }
  std::size_t first = 0;
  for (Articulation* a : articulations_) {
    const std::span of_articulation = std::span(impulses_).subspan(first, a->joints().size());
    a->add_loads(of_articulation, duration);
    for (std::size_t j = 0; j < of_articulation.size(); ++j)
      a->joints()[j]->reaction = of_articulation[j] / duration;
    first += of_articulation.size();
  }
}

}  // namespace offstage::sim
