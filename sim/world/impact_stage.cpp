#include "sim/world/impact_stage.h"

#include <algorithm>
#include <cmath>

#include "sim/articulation/joint_limits.h"
#include "sim/contact/contact_motion.h"
#include "sim/contact/contact_terms.h"
#include "sim/contact/island_impacts.h"
#include "sim/contact/solver_choice.h"
#include "sim/core/parallel_loop.h"
#include "sim/world/impact_search.h"
#include "sim/world/moving_islands.h"

namespace offstage::sim {
namespace {

constexpr uint32_t kMaxImpactsOfPair = 40, kMaxOfTumblingPair = 100;
constexpr std::size_t kMaxImpacts = 128, kImpactsPerBody = 4;
/// Limits of the cost of impacts in a sub-step: of many bodies, of few ones, and with the exact solvers [ns].
/// An impact of bodies with joints costs more, so each joint adds kImpactCostOfJoint, up to the limit of few
/// (kFewBodies) bodies. In a pile each impact moves many bodies and causes hundreds of other impacts. After
/// the limit, restitution is suppressed, and impacts are solved together. After kLastCost times the limit,
/// all impacts that are still pending are solved together, and no pair is traced back in the rest of the
/// sub-step. The limits are larger in sub-steps that are longer than kUsualStep [s], which contain more
/// impacts.
constexpr Real kImpactCost = 6e5, kImpactCostOfFew = 2e6, kExactImpactCost = 8e7, kLastCost = 2;
constexpr Real kImpactCostOfJoint = 2e5;
constexpr Real kUsualStep = 1.0 / 240;
/// Cost of an impact, in addition to the solvers: of each body and contact point that is moved again
/// (kPointCost), of finding the points of a pair (kPairCost), and of a search for the time of impact of a
/// pair, for each piece of its path (kSearchCost) [ns].
constexpr Real kPointCost = 200, kPairCost = 500, kSearchCost = 3000;
/// If the contact point of a body moves around its rim by more than `turn` [rad] in the sub-step, the
/// sub-step is divided for that body into at most `most` pieces, and its contacts are updated after
/// each piece. Islands with more than kMostRimBodies bodies are not divided, because all of their contacts
/// would be solved once for each piece. The fast solver loses energy at a rate that grows with the cube of
/// the angle, so a body that touches no other moving one has more pieces there.
struct RimPieces {
  Real turn, most;
};
constexpr RimPieces kRimPieces{0.1, 16}, kFastRimPieces{0.07, 22};
constexpr std::size_t kMostRimBodies = 8;
/// Greatest number of times that an island continues from the same impact because new contacts of the same
/// bodies were found.
constexpr int kMostPasses = 4;
/// Contact points with a separation below this take part in a collision [m].
constexpr Real kCluster = 1e-4;

/// Whether a body is awake and belongs to this island.
bool is_in(const Body& body, uint32_t island) {
  return body.is_awake() && body.island == island;
}

/// Returns the cost of moving an island again, without its contact forces [ns].
Real moving_cost(const Island& island) {
  std::size_t count = island.bodies.size();
  for (const ContactPair* pair : island.pairs)
    for (const PlacedManifold& m : pair->manifolds()) count += m.manifold.count;
  return kPointCost * static_cast<Real>(count);
}

/// Returns the speed that forces have given to the points of a body in the rest of its interval, which lasts
/// `duration` [m/s].
Real speed_by_forces(const Body& body, Real duration) {
  const Vec3 shift = body.rigid.position - body.start.position;
  const Real slip = (shift - duration * body.start_twist.velocity).norm() / duration;
  const Vec3 turn = rotation_vector(body.start.orientation, body.rigid.orientation);
  return slip + body.extent * (turn / duration - body.start_twist.angular_velocity).norm();
}

}  // namespace

/// Returns the cost of the impacts of the sub-step so far [ns].
Real ImpactStage::cost() const {
  return cost_ + solver_.cost() - cost_before_;
}
Real ImpactStage::greatest_cost() const {
  if (world_.is_exact()) return kExactImpactCost;
  const Real of_many = kImpactCost + kImpactCostOfJoint * static_cast<Real>(world_.joints.size());
  return std::max(1.0, h_ / kUsualStep) *
         (active_.awake().size() <= kFewBodies ? kImpactCostOfFew : std::min(of_many, kImpactCostOfFew));
}

/// Returns the number of impacts in a sub-step after which no pair is traced back again.
std::size_t ImpactStage::most_impacts() const {
  return kMaxImpacts + kImpactsPerBody * active_.awake().size();
}

template <class IsWanted>
void ImpactStage::search(IsWanted&& is_wanted) {
  const std::span<ContactPair* const> pairs = contacts_.pairs();
  const std::vector<std::size_t> wanted =
      indices_where(pairs.size(), [&](std::size_t i) { return pairs[i]->needs_toi && is_wanted(*pairs[i]); });
  report_.impacts.searches += wanted.size();
  std::vector<std::optional<Real>> times(wanted.size());
  std::vector<TestCounts> tests(wanted.size());
  for_each_index(wanted.size(),
                 [&](std::size_t i) { times[i] = impact_time(*pairs[wanted[i]], world_.def, h_, tests[i]); });
  for (const TestCounts& t : tests) {
    report_.contacts.volume_tests += t.volumes;
    report_.contacts.piece_tests += t.pieces;
  }
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (times[i]) pending_.push_back({*times[i], pairs[wanted[i]], true});
    cost_ += kSearchCost * search_pieces(*pairs[wanted[i]], h_);
  }
}

/// Adds the next rebounds from joint limits of the wanted articulations.
template <class IsWanted>
void ImpactStage::search_rebounds(IsWanted&& is_wanted) {
  for (const auto& articulation : world_.articulations) {
    const Body& body = *articulation->bodies().front();
    if (!articulation->traces_rebounds() || !body.is_awake() || !is_wanted(body)) continue;
    const Real duration = h_ - body.from;
    if (!(duration > h_ * kInstant)) continue;
    articulation->place_within(start_ + h_, duration, 0.5, h_);
    if (const auto fraction = first_rebound(*articulation, duration, start_ + h_))
      pending_.push_back({body.from + *fraction * duration, nullptr, false, articulation.get()});
  }
}

/// Moves an articulation, with its island, to the time at which it reaches a limit, and lets it rebound. If
/// there are too many rebounds, rows replace them in the rest of the sub-step. Returns the island's number.
uint32_t ImpactStage::rebound_at(const Event& event) {
  Articulation& articulation = *event.rebounding;
  const uint32_t number = articulation.bodies().front()->island;
  trace_back(islands_[number], event.time);
  cost_ += moving_cost(islands_[number]);
  ++report_.impacts.tracebacks;
  articulation.count_rebound();
  if (cost() > greatest_cost()) articulation.end_rebounds();
  if (articulation.traces_rebounds()) {
    rebound(articulation, start_ + event.time);
    ++report_.impacts.collisions;
    collide(number, event.time);
  } else {
    ++report_.impacts.toi_limit_reached;
    continue_from(number, event.time);
  }
  return number;
}

/// Adds events that update the contacts of pairs whose contact point moves around a rim.
void ImpactStage::add_rim_updates() {
  const bool is_fast = world_.def.solver == SolverKind::fast;
  for (ContactPair* pair : contacts_.pairs()) {
    if (pair->touching() == 0) continue;
    Real turn = 0;
    for (const PlacedManifold& m : pair->manifolds())
      turn = std::max({turn, h_ * rim_speed(pair->a(), m.manifold.piece_a, m.frame.n),
                       h_ * rim_speed(pair->b(), m.manifold.piece_b, m.frame.n)});
    if (turn <= kFastRimPieces.turn) continue;
    const Body& body = pair->a().is_awake() ? pair->a() : pair->b();
    const bool is_single = islands_[body.island].bodies.size() == 1;
    const RimPieces limits = is_fast && is_single ? kFastRimPieces : kRimPieces;
    const Real pieces = std::min(std::ceil(turn / limits.turn), limits.most);
    for (Real i = 1; i < pieces; ++i) pending_.push_back({h_ * i / pieces, pair, false});
  }
}

void ImpactStage::resolve() {
  cost_before_ = solver_.cost();
  search([](const ContactPair&) { return true; });
  search_rebounds([](const Body&) { return true; });
  add_rim_updates();
  if (pending_.empty()) return;
  // An impact moves back only bodies to which it is connected by forces. Most others in an island are only
  // near; they join if the impact sends a body towards them.
  find_moving_islands(world_, active_.awake(), contacts_.pairs(), touch_or_push, motion_.whole(), islands_);

  for (std::size_t count = 0; !pending_.empty();) {
    const auto next = std::min_element(pending_.begin(), pending_.end(),
                                       [](const Event& x, const Event& y) { return x.time < y.time; });
    const Event event = *next;
    // After most_impacts(), each pair has at most one more impact. A state that is not finite has more.
    const bool is_last = count > 2 * most_impacts() + contacts_.pairs().size();
    if (event.is_impact && (is_last || cost() > kLastCost * greatest_cost())) return end_tracing(event);
    uint32_t island = 0;
    if (event.rebounding) {
      island = rebound_at(event);
    } else if (event.is_impact) {
      limit(*event.pair, count++);
      island = impact_at(event);
    } else {
      pending_.erase(next);
      const Body& body = event.pair->a().is_awake() ? event.pair->a() : event.pair->b();
      const Island& moving = islands_[body.island];
      if (cost() > greatest_cost() || moving.from >= event.time || moving.bodies.size() > kMostRimBodies)
        continue;
      island = gather(*event.pair, event.time);
      cost_ += moving_cost(islands_[island]);
      continue_from(island, event.time);
    }
    // The pending impacts of these bodies are no longer valid; the next ones are searched again.
    const auto moved = [&](const Body& body) { return is_in(body, island); };
    const auto involved = [&](const ContactPair& p) { return moved(p.a()) || moved(p.b()); };
    std::erase_if(pending_, [&](const Event& e) {
      return e.rebounding ? moved(*e.rebounding->bodies().front()) : e.is_impact && involved(*e.pair);
    });
    search(involved);
    search_rebounds(moved);
  }
}

/// Moves the islands of a pair to the time of its impact, and lets them collide. Returns the number of the
/// merged island.
uint32_t ImpactStage::impact_at(const Event& event) {
  const uint32_t island = gather(*event.pair, event.time);
  cost_ += moving_cost(islands_[island]);
  ++report_.impacts.tracebacks;
  if (cost() > greatest_cost()) {
    join_pending(island, event.time);
    suppress_restitution(island);
  }
  collide(island, event.time);
  return island;
}

/// Ends the tracing of impacts and rebounds in the sub-step. Rows replace the rebounds that are still
/// pending.
void ImpactStage::end_tracing(const Event& first) {
  for (const auto& articulation : world_.articulations) articulation->end_rebounds();
  std::vector<const Body*> rebounding;
  for (const Event& event : pending_)
    if (event.rebounding) rebounding.push_back(event.rebounding->bodies().front());
  end_at_once(first);
  for (const Body* body : rebounding) continue_from(body->island, islands_[body->island].from);
}

/// Merges the islands that have pending impacts, and those that are near them, with an island at a time.
void ImpactStage::join_all_pending(uint32_t number, Real time) {
  const auto take = [&](const ContactPair& pair) {
    for (const Body* body : {&pair.a(), &pair.b()}) {
      if (!body->is_awake() || body->island == number) continue;
      const uint32_t other = body->island;
      trace_back(islands_[other], time);
      join(number, other);
    }
  };
  for (const Event& event : pending_)
    if (event.is_impact) take(*event.pair);
  for (bool grown = true; grown;) {
    grown = false;
    for (const ContactPair* pair : contacts_.pairs()) {
      if (!pair->a().is_awake() || !pair->b().is_awake()) continue;
      if ((pair->a().island == number) == (pair->b().island == number)) continue;
      take(*pair);
      grown = true;
    }
  }
}

/// Solves the rest of the sub-step together for all bodies near pending impacts, from the next impact on. All
/// contacts that will close in this rest bounce at once, so that they keep their restitution. Afterwards only
/// the contact solver stops bodies that approach each other.
void ImpactStage::end_at_once(const Event& first) {
  const Real time = first.time;
  ++report_.impacts.toi_limit_reached;
  contacts_.stop_tracing();
  if (time >= h_ * (1 - kInstant)) return;
  const uint32_t number = gather(*first.pair, time);
  join_all_pending(number, time);
  ++report_.impacts.tracebacks;
  join_next(number, time);
  accurate_left_ = 0;
  bounce(number, time, h_ - time);
  // The contact solver can propagate the greatest speed to all bodies.
  Real fastest = 0;
  for (const Body* body : islands_[number].bodies)
    fastest = std::max(fastest, body->start_twist.velocity.norm());
  for (Body* body : islands_[number].bodies)
    body->impact_speed_bound = std::max(body->impact_speed_bound, fastest);
  Island& island = islands_[number];
  island.motion = &motion_.move_group(island.bodies, start_, time, h_ - time);
  find_pairs_again(number);
  join_next(number, time);
  solver_.solve(islands_[number],
                {.duration = h_ - time,
                 .end = start_ + h_,
                 .substep = h_,
                 .impact_speed = world_.def.collision_speed,
                 .is_whole = false,
                 .is_cheap = true},
                report_);
  find_pairs_again(number);
}

/// Decides whether later impacts of a pair in this sub-step are traced back, and if not, sets
/// ContactPair::toi_exhausted. `count`: number of previous impacts.
void ImpactStage::limit(ContactPair& pair, std::size_t count) {
  const uint32_t most = turns_fast(pair, h_) ? kMaxOfTumblingPair : kMaxImpactsOfPair;
  if (++pair.impacts <= most && count < most_impacts()) return;
  pair.toi_exhausted = true;
  ++report_.impacts.toi_limit_reached;
}

/// Moves the islands of a pair's two bodies to a time, and merges them. Returns the number of the merged
/// island.
uint32_t ImpactStage::gather(const ContactPair& pair, Real time) {
  const uint32_t island = pair.a().is_awake() ? pair.a().island : pair.b().island;
  trace_back(islands_[island], time);
  if (pair.a().is_awake() && pair.b().is_awake() && pair.b().island != island) {
    trace_back(islands_[pair.b().island], time);
    join(island, pair.b().island);
  }
  return island;
}

/// Merges an island with all islands that it will hit at `time` or later. The merged island is extended in
/// the same way, until it hits no other island. One solution then replaces many impacts.
void ImpactStage::join_pending(uint32_t number, Real time) {
  for (bool grown = true; grown;) {
    grown = false;
    for (const Event& impact : pending_) {
      if (!impact.is_impact) continue;
      const Body &a = impact.pair->a(), &b = impact.pair->b();
      if (!a.is_awake() || !b.is_awake() || (a.island == number) == (b.island == number)) continue;
      const uint32_t other = a.island == number ? b.island : a.island;
      trace_back(islands_[other], time);
      join(number, other);
      grown = true;
    }
  }
}

/// Suppresses restitution within an island for the rest of this sub-step. Pairs are still traced back if they
/// are so fast that their contact points are not known otherwise.
void ImpactStage::suppress_restitution(uint32_t island) {
  const auto is_outside = [&](const Body& body) { return body.is_awake() && body.island != island; };
  for (ContactPair* pair : contacts_.pairs()) {
    if (is_outside(pair->a()) || is_outside(pair->b()) || pair->restitution_suppressed) continue;
    pair->restitution_suppressed = true;
    report_.impacts.restitution_suppressed += pair->needs_toi;
  }
}

/// Moves an island back to a time, with the effect of the contact forces until then.
void ImpactStage::trace_back(Island& island, Real time) {
  if (island.from >= time) return;
  island.motion->restore(island.bodies);
  motion_.move_group(island.bodies, start_, island.from, time - island.from);
  solver_.solve(island,
                {.duration = time - island.from,
                 .end = start_ + time,
                 .substep = h_,
                 .impact_speed = world_.def.collision_speed,
                 .is_whole = false},
                report_);
  for (Body* body : island.bodies) {
    body->pose = body->rigid.pose();
    body->begin_interval(time);
  }
  island.from = time;
}

/// Merges two islands, which must be at the same time.
void ImpactStage::join(uint32_t into, uint32_t other) {
  if (into == other) return;
  Island &x = islands_[into], &y = islands_[other];
  for (Body* body : y.bodies) body->island = into;
  x.bodies.insert(x.bodies.end(), y.bodies.begin(), y.bodies.end());
  x.pairs.insert(x.pairs.end(), y.pairs.begin(), y.pairs.end());
  x.articulations.insert(x.articulations.end(), y.articulations.begin(), y.articulations.end());
  std::sort(x.bodies.begin(), x.bodies.end(), [](const Body* a, const Body* b) { return a->rank < b->rank; });
  y.bodies.clear();
  y.pairs.clear();
  y.articulations.clear();
}

/// Collides an island's bodies with each other and with other bodies that they touch at a time, and continues
/// their motion from there.
void ImpactStage::collide(uint32_t number, Real time) {
  const std::span<ContactPair* const> pairs = contacts_.pairs();
  // Bodies of other islands that these bodies touch join the island, and then their own neighbours. The
  // points of a pair are found again when its second body has joined, because that body was moved back.
  std::vector<uint8_t> members(pairs.size(), 0);
  for (bool grown = true; grown;) {
    grown = false;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      ContactPair& pair = *pairs[i];
      const bool has_a = is_in(pair.a(), number), has_b = is_in(pair.b(), number);
      const auto count = static_cast<uint8_t>(has_a + has_b);
      if (count == members[i]) continue;
      members[i] = count;
      find_points(pair, time);
      const Body& other = has_a ? pair.b() : pair.a();
      if (count == 2 || !other.is_awake() || pair.separation() > kTouching) continue;
      const uint32_t joined = other.island;
      trace_back(islands_[joined], time);
      join(number, joined);
      grown = true;
    }
  }
  islands_[number].pairs.clear();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    ContactPair& pair = *pairs[i];
    const Body& other = is_in(pair.a(), number) ? pair.b() : pair.a();
    if (members[i] == 0 || (members[i] == 1 && other.is_awake()) || pair.manifolds().empty()) continue;
    islands_[number].pairs.push_back(&pair);
  }
  contacts_.remove_internal_edge_contacts(islands_[number].pairs, time, h_);
  bounce(number, time, 0);
  if (time < h_ * (1 - kInstant)) continue_from(number, time);
}

/// Changes the velocities of an island by the impacts at a time. `ahead`: see CollisionSettings.
void ImpactStage::bounce(uint32_t number, Real time, Real ahead) {
  const Island& island = islands_[number];
  const CollisionSettings settings{.time = start_ + time,
                                   .substep = h_,
                                   .reach = kCluster,
                                   .collision_speed = world_.def.collision_speed,
                                   .law = world_.def.impact,
                                   .whole = contacts_.is_exact(),
                                   .ahead = ahead};
  const CollisionOutcome outcome = resolve_collisions(island, settings, accurate_left_);
  report_.impacts.collisions += outcome.bounces;
  report_.solvers.impacts.add(outcome.work);
  record_rough_contact(outcome.rough, report_);
  for (Body* body : island.bodies) body->rigid.set_state(body->start);
  cost_ += outcome.cost;
}

/// Finds the contact points of a pair at a time.
void ImpactStage::find_points(ContactPair& pair, Real time) {
  contacts_.find_points(pair, time, h_);
  cost_ += kPairCost;
}

/// Continues the motion of an island from an impact to the end of the sub-step. Its velocities have changed,
/// so it may hit other bodies, and other contacts may limit its motion. In this case the other islands are
/// merged with it, and the motion is computed again.
void ImpactStage::continue_from(uint32_t number, Real time) {
  std::size_t bodies = 0;
  int same = 0;  // passes since the last body joined
  for (bool joined = true; joined; ++same) {
    if (islands_[number].bodies.size() > bodies) same = 0;
    bodies = islands_[number].bodies.size();
    if (same > kMostPasses) {  // the result of the last pass is kept
      ++report_.impacts.toi_limit_reached;
      return;
    }
    for (Body* body : islands_[number].bodies) body->rigid.set_state(body->start);
    islands_[number].motion = &motion_.move_group(islands_[number].bodies, start_, time, h_ - time);
    find_pairs_again(number);
    joined = join_next(number, time);
    if (joined) continue;
    solver_.solve(islands_[number],
                  {.duration = h_ - time,
                   .end = start_ + h_,
                   .substep = h_,
                   .impact_speed = world_.def.collision_speed,
                   .is_whole = false},
                  report_);
    find_pairs_again(number);
    joined = join_overtaken(number, time);
  }
}

/// Finds the contacts of an island that continues from `time`. If it will hit a body of another island, and
/// this impact will not be traced back, the other island is merged. The function then returns true, and the
/// merged island must be moved again.
bool ImpactStage::join_next(uint32_t number, Real time) {
  const std::span<ContactPair* const> pairs = contacts_.pairs();
  islands_[number].pairs.clear();
  bool joined = false;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    ContactPair& pair = *pairs[i];
    const bool has_a = is_in(pair.a(), number), has_b = is_in(pair.b(), number);
    if (!has_a && !has_b) continue;
    find_points(pair, time);
    const Body& other = has_a ? pair.b() : pair.a();
    if (has_a == has_b || !other.is_awake()) {
      if (!pair.manifolds().empty()) islands_[number].pairs.push_back(&pair);
    } else if (!pair.needs_toi && closes(pair, h_ - time)) {
      const uint32_t next = other.island;
      trace_back(islands_[next], time);
      join(number, next);
      joined = true;
    }
  }
  if (!joined) contacts_.remove_internal_edge_contacts(islands_[number].pairs, time, h_);
  return joined;
}

/// Merges the islands that an island overlaps now because its contact forces have moved it since `time`. It
/// also finds contacts that were too far away for the first search. Returns whether any were found; all
/// bodies must then be moved again.
bool ImpactStage::join_overtaken(uint32_t number, Real time) {
  const std::span<ContactPair* const> pairs = contacts_.pairs();
  for (Body* body : islands_[number].bodies)
    body->impact_speed_bound = std::max(body->impact_speed_bound, speed_by_forces(*body, h_ - time));
  bool joined = false;
  std::vector<ContactPair*> new_inside;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    ContactPair& pair = *pairs[i];
    const bool has_a = is_in(pair.a(), number), has_b = is_in(pair.b(), number);
    if ((!has_a && !has_b) || pair.needs_toi) continue;
    const Body& other = has_a ? pair.b() : pair.a();
    const bool is_inside = has_a == has_b || !other.is_awake();
    // The known points of this pair have limited its approach.
    if (is_inside && !pair.manifolds().empty()) continue;
    if (std::max(pair.a().impact_speed_bound, pair.b().impact_speed_bound) * (h_ - time) > kTouching)
      find_points(pair, time);
    if (pair.needs_toi || !overlaps_at_end(pair, time)) continue;
    if (is_inside) {
      new_inside.push_back(&pair);
      continue;
    }
    const uint32_t next = other.island;
    trace_back(islands_[next], time);
    join(number, next);
    joined = true;
  }
  if (joined || new_inside.empty()) return joined;
  // Points at internal edges do not limit the motion. If they were kept, they would be found and removed
  // again and again.
  std::vector<ContactPair*> inside = islands_[number].pairs;
  inside.insert(inside.end(), new_inside.begin(), new_inside.end());
  contacts_.remove_internal_edge_contacts(inside, time, h_);
  return std::any_of(new_inside.begin(), new_inside.end(),
                     [](const ContactPair* pair) { return !pair->manifolds().empty() && !pair->needs_toi; });
}

/// Whether any contact point of a pair may close within the time `left` [s].
bool ImpactStage::closes(const ContactPair& pair, Real left) const {
  for (const PlacedManifold& m : pair.manifolds())
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const ContactPoint& point = m.manifold.points[k];
      const Real speed = pair.relative_velocity((point.on_a + point.on_b) / 2).dot(m.frame.n);
      if (point.separation + 2 * (speed - world_.def.gravity.norm() * left) * left < 0) return true;
    }
  return false;
}

/// Whether any point of a pair, as it was at `time`, overlaps at the end of the sub-step.
bool ImpactStage::overlaps_at_end(const ContactPair& pair, Real time) const {
  const auto displacement = [&](const Body& body, const Vec3& place) {
    const Vec3 local = body.placed_at(time, h_).point_to_body(place);
    return Vec3(body.placed_at(h_, h_).point_to_world(local) - place);
  };
  for (const PlacedManifold& m : pair.manifolds())
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const ContactPoint& point = m.manifold.points[k];
      const Vec3 approach = displacement(pair.a(), point.on_a) - displacement(pair.b(), point.on_b);
      if (point.separation + m.frame.n.dot(approach) < -kTouching) return true;
    }
  return false;
}

/// Updates the pairs of an island's bodies. Bodies that leave their boxes in the broad phase have new
/// neighbours. Sleeping ones wake, and form an island of their own.
void ImpactStage::find_pairs_again(uint32_t number) {
  if (!contacts_.follow(islands_[number].bodies)) return;
  std::vector<ContactPair*> near = islands_[number].pairs;
  for (ContactPair* pair : contacts_.pairs()) {
    if (!pair->is_new()) continue;
    contacts_.find_points(*pair, std::max(pair->a().from, pair->b().from), h_);
    near.push_back(pair);
  }
  contacts_.remove_internal_edge_contacts(near, islands_[number].from, h_);
  const std::vector<Body*> woken = contacts_.wake_touched(motion_, start_, h_);
  if (woken.empty()) return;
  const auto added = static_cast<uint32_t>(islands_.size());
  islands_.emplace_back();
  islands_[added].bodies = woken;
  islands_[added].motion = &motion_.last();
  for (Body* body : woken) body->island = added;
  for (const auto& articulation : world_.articulations)
    if (articulation->bodies().front()->is_awake() && articulation->bodies().front()->island == added)
      islands_[added].articulations.push_back(articulation.get());
  contacts_.extend();
  for (ContactPair* pair : contacts_.pairs()) {
    if (pair->is_new()) contacts_.find_points(*pair, std::max(pair->a().from, pair->b().from), h_);
    const auto outside = [&](const Body& body) { return body.is_awake() && body.island != added; };
    if (outside(pair->a()) || outside(pair->b()) || pair->manifolds().empty()) continue;
    if (pair->a().is_awake() || pair->b().is_awake()) islands_[added].pairs.push_back(pair);
  }
  solver_.solve(islands_[added],
                {.duration = h_,
                 .end = start_ + h_,
                 .substep = h_,
                 .impact_speed = world_.def.collision_speed,
                 .is_whole = true},
                report_);
}

}  // namespace offstage::sim
