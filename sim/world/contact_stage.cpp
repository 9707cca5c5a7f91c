/// Contacts of a sub-step: near pairs, contact points, and contact forces (physics E6, R7-R10).

#include <algorithm>
#include <cmath>
#include <limits>

#include <oneapi/tbb/parallel_for.h>

#include "sim/articulation/joint_energy.h"
#include "sim/contact/energy_guard.h"
#include "sim/core/parallel_loop.h"
#include "sim/world/coupled_system.h"
#include "sim/world/coupling_graph.h"
#include "sim/world/world_impl.h"

namespace offstage::sim {
namespace {

/// Distance of contact points in addition to that by the bodies' motion in the interval: at most kMargin [m]
/// and at most this share of the smaller body.
constexpr Real kMargin = 2e-3, kMarginShare = 0.05;
/// Motion in an interval, as a share of the smaller body, above which the contact points at the start do not
/// predict later contacts. The limit is larger for the fast solver without restitution, which uses the points
/// only as limits of the approach.
constexpr Real kFar = 0.25, kFarWithoutBounce = 1;
/// Margin of bodies in the broad phase: a share of their size, plus their motion in this many steps.
constexpr Real kRoom = 0.03, kSteps = 2;
/// Share of the extent: a greater deviation from the chord occurs only for rotations of more than half a
/// radian.
constexpr Real kWide = 0.036;
/// Greatest relative motion of bodies for which their contact points are reused: at most this length [m] and
/// at most this share of the smaller body. Until then only the distances of the points are updated in each
/// step, to second order.
constexpr Real kReuse = 1e-4, kReuseShare = 2e-4, kExactReuse = 1e-8;
/// A body that is hit without restitution by a body of the same mass gets this share of its speed; both then
/// move together. Impacts are propagated kPassedOn times. The next one would have a sixteenth of the speed;
/// for less than 7.7 m/s this is within kMargin in a step of 1/240 s.
constexpr Real kPassedShare = 0.5;
constexpr uint32_t kPassedOn = 3;
/// Bodies turn if their rotation moves their surfaces by more than this in an interval [m].
constexpr Real kTurning = 2e-4;
/// Bodies with more relative motion than this in an interval may touch with other features [m].
constexpr Real kFastPair = 3e-3;
/// Share of the kinetic energy of an island with joints that a sub-step may add. A greater excess is removed;
/// it counts as a fall-back if it is larger than the usual error of the velocity terms.
constexpr Real kAddedByJoints = 1e-3, kUsualExcess = 0.02;

Real smaller_extent(const Body& a, const Body& b) {
  return std::min(a.extent, b.extent);
}

/// Box around all positions of a body in its interval.
Aabb swept_bounds(const Body& body) {
  Aabb box = bounds(body.solid, body.start_pose).merged(bounds(body.solid, body.pose));
  Real margin = std::min(kMargin, kMarginShare * body.extent);
  if (!std::holds_alternative<Sphere>(body.def.shape)) {
    // The deviation of a point from the chord of its path is at most an eighth of its greatest acceleration.
    // Large rotations use the balls around the start and the end instead.
    const Real bow = body.path().max_acceleration(body.extent) / 8;
    margin += bow > kWide * body.extent ? body.extent : bow;
  }
  box.min().array() -= margin;
  box.max().array() += margin;
  return box;
}

/// A pair with the ranks of its bodies.
struct RankedPair {
  uint32_t low, high;
  ContactPair* pair;
};

/// Sorts pairs in ascending order of ranks. There are many pairs, but few of each body.
void sort_by_rank(std::span<const RankedPair> pairs, std::size_t bodies, std::vector<ContactPair*>& sorted) {
  std::vector<uint32_t> ends(bodies, 0);
  for (const RankedPair& p : pairs) ++ends[p.low];
  for (std::size_t i = 1; i < bodies; ++i) ends[i] += ends[i - 1];
  std::vector<RankedPair> order(pairs.size());
  for (std::size_t i = pairs.size(); i-- > 0;) order[--ends[pairs[i].low]] = pairs[i];
  for (std::size_t i = 1; i < order.size(); ++i) {
    const RankedPair moved = order[i];
    std::size_t at = i;
    for (; at > 0 && order[at - 1].low == moved.low && order[at - 1].high > moved.high; --at)
      order[at] = order[at - 1];
    order[at] = moved;
  }
  sorted.clear();
  for (const RankedPair& p : order) sorted.push_back(p.pair);
}

/// Whether the path is not within the box in the broad phase.
bool leaves(const Body& body, const Aabb& way) {
  return body.collides() && !body.swept.contains(way);
}

}  // namespace

PairSurface World::Impl::surface_of(const Body& a, const Body& b) const {
  const auto static_friction = [](const BodyDef& d) {
    return d.static_friction < 0 ? d.friction : d.static_friction;
  };
  PairSurface s;
  if (def.collision.narrow_phase == CollisionMethods::NarrowPhase::vclip) s.method = DistanceMethod::vclip;
  if (def.collision.mesh_pairs == CollisionMethods::MeshPairs::triangles)
    // The solids of a compound may overlap, so that triangles of one lie inside another.
    s.by_triangles =
        a.solid.mesh && b.solid.mesh && a.solid.mesh->solids.empty() && b.solid.mesh->solids.empty();
  s.restitution = std::max(a.def.restitution, b.def.restitution);
  s.friction = std::sqrt(a.def.friction * b.def.friction);
  s.static_friction = std::sqrt(static_friction(a.def) * static_friction(b.def));
  s.rolling = std::max(a.def.rolling_friction, b.def.rolling_friction);
  s.spinning = std::max(a.def.spinning_friction, b.def.spinning_friction);
  const auto rule = rules.find(std::minmax(a.surface, b.surface));
  if (rule != rules.end()) {
    s.restitution = rule->second.restitution.value_or(s.restitution);
    s.friction = rule->second.friction.value_or(s.friction);
    s.static_friction =
        rule->second.static_friction.value_or(rule->second.friction.value_or(s.static_friction));
    s.rolling = rule->second.rolling_friction.value_or(s.rolling);
    s.spinning = rule->second.spinning_friction.value_or(s.spinning);
  }
  const bool a_is_first = a.handle.index < b.handle.index;
  for (const Body* body : {a_is_first ? &a : &b, a_is_first ? &b : &a}) {
    const BodyDef& d = body->def;
    s.conveys |= d.surface_velocity != Vec3::Zero();
    if (d.cross_friction < 0 || d.friction_axis == Vec3::Zero() || s.axis_body) continue;
    s.axis_body = body;
    s.cross = d.friction > 0 ? std::sqrt(d.cross_friction / d.friction) : 1;  // otherwise both are 0
  }
  return s;
}

/// Gives the box of a body's path to the broad phase, enlarged by a margin. If repeated in a sub-step
/// (`again`), the previous box is included.
void World::Impl::move_in_broad_phase(Body& body, Aabb way, bool again) {
  // Margin for some more steps like this one.
  const Vec3 shift = kSteps * (body.pose.position - body.start_pose.position);
  const Vec3 room = Vec3::Constant(kRoom * body.extent);
  way.min() += shift.cwiseMin(0) - room;
  way.max() += shift.cwiseMax(0) + room;
  if (again) way.extend(body.swept);
  body.swept = way;
  broad_phase.move(body.handle.index, way);
  pairs_changed = true;
}

/// The same unless the path is within the previous box; returns whether the box was changed.
bool World::Impl::move_in_broad_phase(Body& body, bool again) {
  const Aabb way = swept_bounds(body);
  if (!leaves(body, way)) return false;
  move_in_broad_phase(body, way, again);
  return true;
}

/// Collects the pairs of bodies whose paths come near each other. With `again`, within a sub-step, existing
/// pairs are kept, because impacts and islands refer to them.
void World::Impl::collect_pairs(bool again) {
  if (!std::exchange(pairs_changed, false)) return;
  graph.update(
      broad_phase.pairs(), again, [&](uint32_t slot) { return bodies[bodies.at_slot(slot)].get(); },
      [&](const Body& a, const Body& b) { return surface_of(a, b); });
  std::vector<RankedPair> ranked;
  ranked.reserve(graph.size());
  graph.for_each([&](ContactPair& pair) {
    const Body &a = pair.a(), &b = pair.b();
    if (are_jointed(a, b)) return;
    if (a.can_move() || b.can_move())
      ranked.push_back({std::min(a.rank, b.rank), std::max(a.rank, b.rank), &pair});
  });
  sort_by_rank(ranked, bodies.size(), active_pairs);
}

/// Computes a bound of the speed that an impact in the sub-step can give to each body, propagated from body
/// to body with decreasing shares.
void World::Impl::propagate_impact_speeds(Real h) {
  for (Body* body : awake) body->impact_speed_bound = 0;
  if (is_exact()) return;  // the exact solver resolves each impact at its own time
  struct Approach {
    Body *a, *b;
    Real speed;
  };
  std::vector<Approach> approaches(active_pairs.size());
  for_each_index(active_pairs.size(), [&](std::size_t i) {
    ContactPair& pair = *active_pairs[i];
    approaches[i] = {&pair.a(), &pair.b(), pair.speed_bound()};
  });
  const auto strike = [](Body& body, Real speed) {
    if (body.is_awake()) body.impact_speed_bound = std::max(body.impact_speed_bound, speed);
  };
  Real fastest = 0;
  for (const auto& [a, b, speed] : approaches) {
    strike(*a, speed);
    strike(*b, speed);
    fastest = std::max(fastest, speed);
  }
  for (uint32_t i = 0; i < kPassedOn && fastest * h > kMargin; ++i)
    for (const auto& [a, b, speed] : approaches) {
      strike(*a, kPassedShare * b->impact_speed_bound);
      strike(*b, kPassedShare * a->impact_speed_bound);
    }
}

void World::Impl::update_pairs(Real h) {
  std::vector<Aabb> ways(awake.size());
  const std::vector<std::size_t> leaving = indices_where(awake.size(), [&](std::size_t i) {
    ways[i] = swept_bounds(*awake[i]);
    return leaves(*awake[i], ways[i]);
  });
  for (const std::size_t i : leaving) move_in_broad_phase(*awake[i], ways[i], false);
  for (Body* body : kinematic) move_in_broad_phase(*body, false);
  collect_pairs(false);
  propagate_impact_speeds(h);
  const auto find = [&](std::size_t i) {
    // Pairs are scattered in memory.
    if (i + 6 < active_pairs.size()) active_pairs[i + 6]->prefetch();
    if (i + 3 < active_pairs.size()) active_pairs[i + 3]->prefetch_manifold();
    active_pairs[i]->impacts = 0;
    active_pairs[i]->deepest = 0;
    active_pairs[i]->toi_exhausted = active_pairs[i]->restitution_suppressed = false;
    find_points(*active_pairs[i], 0, h);
  };
  constexpr std::size_t kManyPairs = 64, kPairsOfTask = 16;
  if (active_pairs.size() < kManyPairs) {
    for (std::size_t i = 0; i < active_pairs.size(); ++i) find(i);
  } else {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, active_pairs.size(), kPairsOfTask),
                      [&](const auto& range) {
                        for (std::size_t i = range.begin(); i < range.end(); ++i) find(i);
                      });
  }
  remove_seams(active_pairs, 0, h);
}

/// Bound of the relative motion of a pair's bodies in the rest of the sub-step, and the motion for which its
/// contact points are sufficient [m].
Real World::Impl::motion_bound(const ContactPair& pair, Real left) const {
  return (pair.speed_bound() + 2 * def.gravity.norm() * left) * left;
}
Real World::Impl::motion_known(const ContactPair& pair) const {
  const Real size = smaller_extent(pair.a(), pair.b());
  const bool bounces = is_exact() || pair.surface().restitution > 0;
  return std::max(std::min(kMargin, kMarginShare * size), (bounces ? kFar : kFarWithoutBounce) * size);
}

/// Finds the points where a pair's bodies touch at their interval's start, or may touch in the rest of the
/// sub-step.
void World::Impl::find_points(ContactPair& pair, Real time, Real h) const {
  const Real left = h - time;
  const Real size = smaller_extent(pair.a(), pair.b());
  const Real base = std::min(kMargin, kMarginShare * size);
  const Real motion = motion_bound(pair, left), far = motion_known(pair);
  const bool exact = is_exact();
  // An impact moves a body at most as fast as the body that hits it.
  const Real impact = std::max(pair.a().impact_speed_bound, pair.b().impact_speed_bound) * left;
  // If no impact of the pair is traced back to any more, only its points keep the bodies apart.
  const Real most = pair.toi_exhausted ? std::numeric_limits<Real>::infinity() : far;
  const Real margin = base + std::min(std::max(2 * motion, impact), most);
  // An impact also turns the body.
  const Real turning = pair.turning_speed() * left + (impact > kMargin ? impact : 0);
  const Real reuse = exact ? kExactReuse : std::min(kReuse, kReuseShare * size);
  pair.find(pair.a().placed_at(time, h), pair.b().placed_at(time, h), margin, reuse, turning > kTurning);

  const bool is_far = motion > far;
  const bool is_quick =
      !exact && time == 0 && !pair.manifolds().empty() && pair.speed_bound() * h > kFastPair;
  if (is_quick && !is_far && !pair.toi_exhausted) pair.add_speculative_contacts(h);
  choose_event(pair, is_far, left);
}

/// Chooses whether a pair's next impact is traced back to. `far`: its motion is too large for its contact
/// points.
void World::Impl::choose_event(ContactPair& pair, bool far, Real left) const {
  pair.needs_toi = far && !pair.toi_exhausted;
  const bool bounces = is_exact() || pair.surface().restitution > 0;
  if (far || pair.toi_exhausted || !bounces || pair.restitution_suppressed) return;
  for (const PlacedManifold& m : pair.manifolds())
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const ContactPoint& point = m.manifold.points[k];
      const Real speed = pair.relative_velocity((point.on_a + point.on_b) / 2).dot(m.frame.n);
      if (speed < -def.collision_speed &&
          point.separation + 2 * (speed - def.gravity.norm() * left) * left < 0)
        pair.needs_toi = true;
    }
}

/// Removes the contacts at seams of pairs that were found at the same time.
void World::Impl::remove_seams(std::span<ContactPair* const> pairs, Real time, Real h) const {
  for (ContactPair* pair : remove_seam_contacts(pairs, time, h))
    choose_event(*pair, motion_bound(*pair, h - time) > motion_known(*pair), h - time);
}

/// Wakes the sleeping bodies near moving ones, moves them through the sub-step, and returns them.
std::vector<Body*> World::Impl::wake_touched(Real start, Real h) {
  if (asleep == 0) return {};
  std::vector<Body*> touched;
  for (ContactPair* pair : active_pairs)
    for (Body* body : {&pair->a(), &pair->b()})
      if (body->asleep && (!pair->manifolds().empty() || pair->needs_toi)) touched.push_back(body);
  if (touched.empty()) return {};
  const std::size_t before = stepped.size();
  for (Body* body : touched) wake(*body);
  std::vector<Body*> woken(stepped.begin() + static_cast<std::ptrdiff_t>(before), stepped.end());
  std::sort(woken.begin(), woken.end(), [](const Body* a, const Body* b) { return a->rank < b->rank; });
  for (Body* body : woken) body->begin_interval(0);
  move_some(woken, start, 0, h);
  for (Body* body : woken) move_in_broad_phase(*body, false);
  update_lists();
  return woken;
}

/// Groups the awake bodies by joints, springs and the contacts that `connect` them.
void World::Impl::find_moving_islands(bool (*connect)(const ContactPair&)) {
  std::vector<std::pair<Body*, Body*>> joined;
  if (!springs.empty() || !articulations.empty()) {
    const CouplingGraph connections(*this);
    std::vector<Body*> first(connections.size(), nullptr);
    for (Body* body : awake) {
      const std::size_t c = connections.component(*body);
      if (c == CouplingGraph::kNone) continue;
      if (first[c]) joined.emplace_back(first[c], body);
      first[c] = body;
    }
  }
  find_islands(awake, active_pairs, connect, joined, islands);
  for (Island& island : islands) island.motion = motions.front().get();
  for (const auto& articulation : articulations)
    if (const Body& first = *articulation->bodies().front(); first.is_awake())
      islands[first.island].articulations.push_back(articulation.get());
}

void World::Impl::solve_islands(Real start, Real h, StepReport& report) {
  std::vector<Island*> all;
  for (Island& island : islands)
    if (has_forces(island)) all.push_back(&island);
  if (def.solver == SolverKind::automatic) patience.begin(all, h);
  solve(all, {.duration = h, .end = start + h, .substep = h, .is_whole = true}, report);
}

/// The motion by contacts and limits satisfies the joints only approximately, so it is projected. If links
/// turn far in a step, the result may have more than the most kinetic energy [J] that the island can have;
/// the relative velocities of its links are then reduced.
void World::Impl::settle_joints(const Island& island, Real end, Real most_energy) {
  for (Articulation* articulation : island.articulations) {
    articulation->settle(end, joint_tally);
    for (Body* body : articulation->bodies()) body->pose = body->rigid.pose();
  }
  if (const Real excess = kinetic_energy(island) - most_energy; excess > 0) {
    Real internal = 0;
    for (const Articulation* a : island.articulations) internal += internal_energy(*a);
    for (const Articulation* a : island.articulations)
      slow_down(*a, std::sqrt(std::max(0.0, 1 - excess / internal)));
    joint_tally.unsolved += excess > kUsualExcess * most_energy;
  }
}

/// The most kinetic energy that an island may have after its contacts are solved in an interval, which is a
/// share of the sub-step: contacts and joints dissipate energy, except for the error of their velocity terms.
Real World::Impl::most_energy(const Island& island, Real share) {
  if (island.articulations.empty() || can_do_work(island)) return std::numeric_limits<Real>::infinity();
  return (1 + kAddedByJoints * share) * kinetic_energy(island);
}

/// Solves the contact forces of islands over an interval, each by the suitable solver.
void World::Impl::solve(std::span<Island* const> group, const ContactInterval& interval, StepReport& report) {
  std::vector<const Island*> fast;
  std::vector<std::pair<Island*, SolverChoice*>> exact;
  for (Island* island : group) {
    if (def.solver == SolverKind::fast) {
      fast.push_back(island);
      continue;
    }
    SolverChoice& choice = choices[island->bodies.front()->handle.index];
    if (def.solver == SolverKind::automatic && !choice.is_exact_worth(*island, patience)) {
      fast.push_back(island);
      continue;
    }
    if (!choice.exact) choice.exact = std::make_unique<ExactContacts>();
    exact.emplace_back(island, &choice);
  }
  std::vector<Real> most(group.size());
  for (std::size_t i = 0; i < group.size(); ++i)
    most[i] = most_energy(*group[i], interval.duration / interval.substep);
  std::vector<ExactContacts::Outcome> outcomes(exact.size());
  using Method = ExactContacts::Method;
  const Method method = def.solver == SolverKind::lcp ? Method::lcp : Method::proximal;
  const auto run = [&](std::size_t i) {
    const auto& [island, choice] = exact[i];
    const Real budget = is_exact() ? std::numeric_limits<Real>::infinity()
                                   : choice->budget(*island, interval.duration, patience);
    outcomes[i] = choice->exact->solve(*island, interval, budget, method);
  };
  if (exact.size() < 2) {
    for (std::size_t i = 0; i < exact.size(); ++i) run(i);
  } else {
    tbb::parallel_for(std::size_t{0}, exact.size(), run);
  }
  for (std::size_t i = 0; i < exact.size(); ++i) {
    const auto& [island, choice] = exact[i];
    const ExactContacts::Outcome& outcome = outcomes[i];
    report.exact.add(outcome.work);
    report.lcp.add(outcome.lcp);
    add_rough(outcome.rough, report);
    choice->learn(*island, interval.duration, outcome.is_applied, patience);
    if (outcome.is_applied) continue;
    report.exact.over_budget += outcome.work.fallbacks == 0;
    fast.push_back(island);
  }
  if (!fast.empty()) report.fast.add(fast_contacts.solve(fast, interval));
  for (std::size_t i = 0; i < group.size(); ++i)
    if (!group[i]->articulations.empty()) settle_joints(*group[i], interval.end, most[i]);
}

void World::Impl::add_rough(const ContactPair* pair, StepReport& report) {
  if (pair) report.rough_contacts.push_back({pair->a().handle, pair->b().handle});
}

void World::Impl::count_contacts(StepReport& report) const {
  report.islands = static_cast<uint32_t>(islands.size());
  report.bodies_awake = static_cast<uint32_t>(awake.size());
  report.bodies_asleep = static_cast<uint32_t>(asleep);
  report.pairs_tested += active_pairs.size();
  report.contacts = 0;
  for (ContactPair* pair : active_pairs) {
    const TestCounts tests = pair->take_tests();
    report.volume_tests += tests.volumes;
    report.piece_tests += tests.pieces;
    report.contacts += pair->touching();
    report.speculative_contacts += pair->speculative;
    report.penetration = std::max(report.penetration, pair->deepest);
  }
}

}  // namespace offstage::sim
