/// Impacts within a sub-step (physics E6, E7, R12). Bodies, with all objects connected to them, are moved
/// back to the time of impact, collide there, and continue for the rest of the sub-step. Other bodies are not
/// changed. The work is bounded: if a pair collides too often in a sub-step, or if there are too many
/// impacts, later ones are left to the contact solver, which also prevents tunnelling. In a pile with too
/// many impacts the restitution of slower ones is suppressed for the rest of the sub-step.

#include <algorithm>
#include <cmath>

#include "sim/contact/contact_motion.h"
#include "sim/contact/contact_terms.h"
#include "sim/core/parallel_loop.h"
#include "sim/dynamics/free_body.h"
#include "sim/world/coupled_system.h"
#include "sim/world/world_impl.h"

namespace offstage::sim {
namespace {

constexpr uint32_t kMaxImpactsOfPair = 40, kMaxOfTumblingPair = 100;
constexpr std::size_t kMaxImpacts = 128, kImpactsPerBody = 4;
/// Limits of the work of impacts in a sub-step, for the fast and for the exact solver [us]. In a pile each
/// impact moves many bodies and causes hundreds of other impacts.
constexpr std::size_t kImpactWork = 2000, kExactImpactWork = 80'000;
/// Work of an impact for each body and contact point that is moved again, and for each near pair that is not
/// of two spheres; work of a search for the time of impact of a pair for each piece of its path [us].
constexpr std::size_t kPointWork = 1, kPairWork = 3, kLookWork = 3;
/// After this multiple of the limit no more pairs are traced back to in the sub-step.
constexpr std::size_t kLastWork = 3;
/// Contact points with a smaller separation take part in a collision [m].
constexpr Real kCluster = 1e-4;
/// Larger rotations in an interval are divided into pieces of this angle [rad], of which there are at most
/// kMostTurns.
constexpr Real kImpactTurn = 0.5, kMostTurns = 512;
/// With a larger rotation in an interval, the contact forces of its start soon become invalid; the body is
/// assumed to fly freely [rad].
constexpr Real kFastSpin = 3;

/// A path that deviates from its chord by more than kStraight [m] is divided into at most kMostArcs pieces. A
/// force counts as steady if the position at the end agrees with the mean velocity within the share kSteady
/// of the change of velocity.
constexpr Real kStraight = 1e-5, kMostArcs = 8, kSteady = 0.05;
/// Intervals shorter than this share of the sub-step are skipped.
constexpr Real kInstant = 1e-9;

Real spin(const Body& body) {
  return body.is_awake() ? body.start_twist.angular_velocity.norm() : 0;
}

/// Angular speed of the faster turning body of a pair [rad/s].
Real turn_of(const ContactPair& pair) {
  return std::max(spin(pair.a()), spin(pair.b()));
}

/// Whether a body may touch in an interval with points that are not known at its start: the known points of a
/// rim or of a round side are those that face the other body now.
bool turns_other_points(const Body& body, Real duration) {
  return runs_along(body, duration) ||
         (std::holds_alternative<Ellipsoid>(body.def.shape) && body.turning_speed() * duration > kTouching);
}

/// Whether a body moves in the island of this number.
bool is_in(const Body& body, uint32_t island) {
  return body.is_awake() && body.island == island;
}

/// Number of pieces into which a rotation is divided.
uint32_t pieces_of(Real turn) {
  return static_cast<uint32_t>(std::clamp(std::ceil(turn / kImpactTurn), 1.0, kMostTurns));
}

/// Work of moving an island again [us].
std::size_t impact_work(const Island& island) {
  std::size_t work = island.bodies.size();
  for (const ContactPair* pair : island.pairs)
    for (const PlacedManifold& m : pair->manifolds()) work += m.manifold.count;
  return kPointWork * work;
}

/// Change of a body's velocity in its interval if it is due to a steady force; zero if the body was stopped
/// on the way, which is seen from its position at the end [m/s].
Vec3 bend(const Body& body, Real h) {
  if (!body.is_awake()) return Vec3::Zero();
  const Vec3 change = body.rigid.velocity() - body.start_twist.velocity;
  const Vec3 mean = (body.rigid.position - body.start.position) / (h - body.from);
  const bool steady = (body.start_twist.velocity + change / 2 - mean).norm() < kSteady * change.norm();
  return steady ? change : Vec3(Vec3::Zero());
}

/// Pose at a time of its interval, on the parabola of a steady force.
Pose on_arc(const Body& body, Real time, Real h) {
  Pose pose = body.placed_at(time, h);
  if (time > body.from)
    pose.position -= (time - body.from) * (h - time) / (2 * (h - body.from)) * bend(body, h);
  return pose;
}

/// Time at which two bodies touch after conservative advancement has ended within its tolerance: the rest of
/// the gap closes at the speed of the nearest points. Otherwise bounces would be early by the tolerance, and
/// the errors would add up.
Real touching_share(const Impact& impact, const PosePath& a, const PosePath& b) {
  const Separation& s = impact.separation;
  if (impact.share == 0 || !(s.distance > 0)) return impact.share;
  const Pose pose = a.at(impact.share);
  const auto velocity = [&](const PosePath& path, const Vec3& local) {
    const Vec3 arm = pose.point_to_world(local) - path.at(impact.share).position;
    return Vec3(path.velocity() + path.angular_velocity(impact.share).cross(arm));
  };
  const Real closing = (velocity(b, s.on_b) - velocity(a, s.on_a)).dot(pose.vector_to_world(s.normal));
  if (!(closing > 0)) return impact.share;
  return impact.share + std::min(s.distance / closing, 1 - impact.share);
}

/// Speed that the forces in the rest of its interval, of this duration, have given to the points of a body
/// [m/s].
Real speed_by_forces(const Body& body, Real duration) {
  const Vec3 shift = body.rigid.position - body.start.position;
  const Real slip = (shift - duration * body.start_twist.velocity).norm() / duration;
  const Vec3 turn = rotation_vector(body.start.orientation, body.rigid.orientation);
  return slip + body.extent * (turn / duration - body.start_twist.angular_velocity).norm();
}

/// A body in free rotation through its interval.
class Tumbling {
 public:
  /// A body that spins fast flies under gravity; the position of any other body is interpolated on a straight
  /// line.
  Tumbling(const Body& body, const WorldDef& def, bool spins_fast, Real h)
      : body_(body), def_(def), spins_fast_(spins_fast), h_(h), turning_(body.at_start()), now_(body.from) {}

  /// Pose at a time of the sub-step of length h, not before the time of the last call.
  Pose go_on(Real time) {
    if (!body_.is_awake()) return body_.placed_at(time, h_);
    fly(turning_, {def_.gravity, {}}, integrator(def_.integrator), now_, time - now_, work_);
    now_ = time;
    if (!spins_fast_) {
      const Real share = (time - body_.from) / (h_ - body_.from);
      turning_.position = body_.start.position + share * (body_.rigid.position - body_.start.position);
    }
    return turning_.pose();
  }

 private:
  const Body& body_;
  const WorldDef& def_;
  bool spins_fast_;
  Real h_;
  RigidBody turning_;
  Real now_;
  IntegratorWorkspace work_;
};

}  // namespace

std::optional<sim::Impact> World::Impl::first_impact(const MovingShape& a, const MovingShape& b) const {
  return def.collision.impact_time == CollisionMethods::ImpactTime::bisection
             ? bisected_time_of_impact(a, b, kTouching / 2)
             : time_of_impact(a, b, kTouching / 2);
}

/// Time at which the bodies of a pair will touch on their current paths. If they touch already and approach,
/// it is the current time.
std::optional<Real> World::Impl::impact_time(const ContactPair& pair, Real h, TestCounts& tests) const {
  if (pair.toi_exhausted) return std::nullopt;
  const Body &a = pair.a(), &b = pair.b();
  const Real from = std::max(a.is_awake() ? a.from : 0, b.is_awake() ? b.from : 0);
  if (from >= h * (1 - kInstant)) return std::nullopt;
  const Real turn = turn_of(pair) * (h - from);
  if (turn > kImpactTurn) return tumbling_impact_time(pair, from, h, turn, tests);
  if (pair.separation() <= kTouching) {
    const std::optional<Real> at_points = point_impact_time(pair, h);
    if (!turns_other_points(a, h - from) && !turns_other_points(b, h - from)) return at_points;
    const std::optional<Real> beside = tumbling_impact_time(pair, from, h, turn, tests);
    return at_points && beside ? std::min(at_points, beside) : at_points ? at_points : beside;
  }
  const Real bow = (bend(a, h) - bend(b, h)).norm() * (h - from) / 8;
  const auto pieces =
      static_cast<uint32_t>(std::clamp(std::ceil(std::sqrt(bow / kStraight)), 1.0, kMostArcs));
  for (uint32_t i = 0; i < pieces; ++i) {
    const Real begin = from + (h - from) * i / pieces, end = from + (h - from) * (i + 1) / pieces;
    const PosePath path_a(on_arc(a, begin, h), on_arc(a, end, h)),
        path_b(on_arc(b, begin, h), on_arc(b, end, h));
    const auto impact =
        first_impact({pair.impact_shape_a(), path_a, &tests}, {pair.impact_shape_b(), path_b});
    if (impact) return begin + touching_share(*impact, path_a, path_b) * (end - begin);
  }
  return std::nullopt;
}

/// A path describes at most half a turn, so faster rotations are divided into pieces.
std::optional<Real> World::Impl::tumbling_impact_time(const ContactPair& pair, Real from, Real h, Real turn,
                                                      TestCounts& tests) const {
  const bool spins_fast = turn > kFastSpin;
  Tumbling body_a(pair.a(), def, spins_fast, h), body_b(pair.b(), def, spins_fast, h);
  Pose begin_a = body_a.go_on(from), begin_b = body_b.go_on(from);
  const uint32_t pieces = pieces_of(turn);
  // Bodies that touch now have just met.
  const bool touches = pair.separation() <= kTouching;
  for (uint32_t i = 0; i < pieces; ++i) {
    const Real begin = from + (h - from) * i / pieces, end = from + (h - from) * (i + 1) / pieces;
    const PosePath path_a(begin_a, body_a.go_on(end)), path_b(begin_b, body_b.go_on(end));
    begin_a = path_a.end();
    begin_b = path_b.end();
    const MovingShape a{pair.impact_shape_a(), path_a, &tests}, b{pair.impact_shape_b(), path_b};
    std::optional<sim::Impact> impact;
    const bool met = (i == 0 && touches) || ((impact = first_impact(a, b)) && impact->share == 0);
    if (met) impact = time_of_next_impact(a, b, kTouching / 2, def.collision_speed * (end - begin));
    if (impact) return begin + impact->share * (end - begin);
    // The effect of the contact has ended by then, or the contact must be found again.
    if (spins_fast && touches) return end;
  }
  return std::nullopt;
}

/// The same for bodies that touch at some points, by their known points that do not touch.
std::optional<Real> World::Impl::point_impact_time(const ContactPair& pair, Real h) const {
  const Body &a = pair.a(), &b = pair.b();
  const Real from = std::max(a.is_awake() ? a.from : 0, b.is_awake() ? b.from : 0);
  std::optional<Real> first;
  for (const PlacedManifold& m : pair.manifolds())
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const ContactPoint& point = m.manifold.points[k];
      const Real speed = pair.relative_velocity((point.on_a + point.on_b) / 2).dot(m.frame.n);
      if (speed >= -def.collision_speed) continue;
      if (point.separation <= kTouching) return from;
      // Both points move with their bodies; the normal turns with the body that defines it.
      const bool with_b = m.manifold.source == NormalSource::face_of_b;
      const Pose pose_a = a.placed_at(from, h), pose_b = b.placed_at(from, h);
      const Vec3 on_a = pose_a.point_to_body(point.on_a), on_b = pose_b.point_to_body(point.on_b);
      const Vec3 n = with_b ? pose_b.vector_to_body(m.frame.n) : pose_a.vector_to_body(m.frame.n);
      const auto gap = [&](Real time) {
        const Pose p = a.placed_at(time, h), q = b.placed_at(time, h);
        const Vec3 normal = with_b ? q.vector_to_world(n) : p.vector_to_world(n);
        return normal.dot(p.point_to_world(on_a) - q.point_to_world(on_b));
      };
      Real early = from, late = first.value_or(h);
      if (gap(late) > kTouching / 2) continue;
      for (int i = 0; i < 40 && late - early > kInstant * h; ++i) {
        const Real middle = (early + late) / 2;
        (gap(middle) > kTouching / 2 ? early : late) = middle;
      }
      first = late;
    }
  return first;
}

void World::Impl::resolve_impacts(Real start, Real h, StepReport& report) {
  std::vector<Impact> impacts;
  const auto look = [&](auto&& is_wanted) {
    const std::vector<std::size_t> events = indices_where(active_pairs.size(), [&](std::size_t i) {
      return active_pairs[i]->needs_toi && is_wanted(*active_pairs[i]);
    });
    report.impact_searches += events.size();
    std::vector<std::optional<Real>> times(events.size());
    std::vector<TestCounts> tests(events.size());
    for_each_index(events.size(),
                   [&](std::size_t i) { times[i] = impact_time(*active_pairs[events[i]], h, tests[i]); });
    for (const TestCounts& t : tests) {
      report.volume_tests += t.volumes;
      report.piece_tests += t.pieces;
    }
    std::size_t taken = 0;
    for (std::size_t i = 0; i < events.size(); ++i) {
      if (times[i]) impacts.push_back({*times[i], active_pairs[events[i]]});
      taken += kLookWork * pieces_of(turn_of(*active_pairs[events[i]]) * h);
    }
    return taken;
  };
  std::size_t work = look([](const ContactPair&) { return true; });
  // An impact moves back only bodies that are connected to it by forces. Most others in an island are merely
  // near; they join if the impact sends a body their way.
  if (!impacts.empty()) find_moving_islands(touch_or_push);

  const std::size_t most = kMaxImpacts + kImpactsPerBody * awake.size();
  const std::size_t most_work = is_exact() ? kExactImpactWork : kImpactWork;
  for (std::size_t count = 0; !impacts.empty(); ++count) {
    const auto first = std::min_element(impacts.begin(), impacts.end(),
                                        [](const Impact& x, const Impact& y) { return x.time < y.time; });
    const Impact impact = *first;
    ContactPair& pair = *impact.pair;
    const bool tumbles = turn_of(pair) * h > kImpactTurn;
    if (++pair.impacts > (tumbles ? kMaxOfTumblingPair : kMaxImpactsOfPair) || count >= most ||
        work > kLastWork * most_work) {
      pair.toi_exhausted = true;
      ++report.toi_limit_reached;
    }
    const uint32_t island = pair.a().is_awake() ? pair.a().island : pair.b().island;
    if (pair.a().is_awake() && pair.b().is_awake()) {
      bring_to(islands[pair.a().island], start, impact.time, h, report);
      bring_to(islands[pair.b().island], start, impact.time, h, report);
      join(island, pair.b().island);
    } else {
      bring_to(islands[island], start, impact.time, h, report);
    }
    ++report.tracebacks;
    work += impact_work(islands[island]);
    if (work > most_work) {
      join_pending(island, start, impact.time, h, impacts, report);
      suppress_restitution(island, report);
    }
    work += collide(island, start, impact.time, h, report);
    // The speculative contacts of these bodies are no longer valid.
    const auto involved = [&](const ContactPair& p) { return is_in(p.a(), island) || is_in(p.b(), island); };
    std::erase_if(impacts, [&](const Impact& i) { return involved(*i.pair); });
    work += look(involved);
  }
}

/// Merges an island with all that it is about to hit at a time or later, and with those that these hit: one
/// solution then replaces many impacts.
void World::Impl::join_pending(uint32_t number, Real start, Real time, Real h,
                               std::span<const Impact> impacts, StepReport& report) {
  for (bool grown = true; grown;) {
    grown = false;
    for (const Impact& impact : impacts) {
      const Body &a = impact.pair->a(), &b = impact.pair->b();
      if (!a.is_awake() || !b.is_awake() || (a.island == number) == (b.island == number)) continue;
      const uint32_t other = a.island == number ? b.island : a.island;
      bring_to(islands[other], start, time, h, report);
      join(number, other);
      grown = true;
    }
  }
}

/// Suppresses restitution within an island for the rest of this sub-step. Pairs that are so fast that only
/// tracing back shows where they meet are still traced back to.
void World::Impl::suppress_restitution(uint32_t island, StepReport& report) {
  const auto is_outside = [&](const Body& body) { return body.is_awake() && body.island != island; };
  for (ContactPair* pair : active_pairs) {
    if (is_outside(pair->a()) || is_outside(pair->b()) || pair->restitution_suppressed) continue;
    pair->restitution_suppressed = true;
    report.restitution_suppressed += pair->needs_toi;
  }
}

/// Moves an island back to a time, with the contact forces until then.
void World::Impl::bring_to(Island& island, Real start, Real time, Real h, StepReport& report) {
  if (island.from >= time) return;
  island.motion->restore(island.bodies);
  move_some(island.bodies, start, island.from, time - island.from);
  Island* const one[] = {&island};
  if (has_forces(island))
    solve(one, {.duration = time - island.from, .end = start + time, .substep = h, .is_whole = false},
          report);
  for (Body* body : island.bodies) {
    body->pose = body->rigid.pose();
    body->begin_interval(time);
  }
  island.from = time;
}

/// Merges two islands, which must be at the same time.
void World::Impl::join(uint32_t into, uint32_t other) {
  if (into == other) return;
  Island &x = islands[into], &y = islands[other];
  for (Body* body : y.bodies) body->island = into;
  x.bodies.insert(x.bodies.end(), y.bodies.begin(), y.bodies.end());
  x.pairs.insert(x.pairs.end(), y.pairs.begin(), y.pairs.end());
  x.articulations.insert(x.articulations.end(), y.articulations.begin(), y.articulations.end());
  std::sort(x.bodies.begin(), x.bodies.end(), [](const Body* a, const Body* b) { return a->rank < b->rank; });
  y.bodies.clear();
  y.pairs.clear();
  y.articulations.clear();
}

/// Collides an island's bodies with each other and with the bodies that they touch at a time, and continues
/// their motion from there. Returns its work [us].
std::size_t World::Impl::collide(uint32_t number, Real start, Real time, Real h, StepReport& report) {
  // Bodies that they touch join the island, and in turn the bodies that those touch. The points of a pair are
  // found again when its second body has joined, because that body was moved back.
  std::vector<uint8_t> members(active_pairs.size(), 0);
  std::size_t work = 0;
  for (bool grown = true; grown;) {
    grown = false;
    for (std::size_t i = 0; i < active_pairs.size(); ++i) {
      ContactPair& pair = *active_pairs[i];
      const bool has_a = is_in(pair.a(), number), has_b = is_in(pair.b(), number);
      const auto count = static_cast<uint8_t>(has_a + has_b);
      if (count == members[i]) continue;
      members[i] = count;
      find_points(pair, time, h);
      const Body& other = has_a ? pair.b() : pair.a();
      if (count == 2 || !other.is_awake() || pair.separation() > kTouching) continue;
      const uint32_t joined = other.island;
      bring_to(islands[joined], start, time, h, report);
      join(number, joined);
      grown = true;
    }
  }
  islands[number].pairs.clear();
  for (std::size_t i = 0; i < active_pairs.size(); ++i) {
    ContactPair& pair = *active_pairs[i];
    const Body& other = is_in(pair.a(), number) ? pair.b() : pair.a();
    if (members[i] > 0 && !pair.has_sphere()) work += kPairWork;
    if (members[i] == 0 || (members[i] == 1 && other.is_awake()) || pair.manifolds().empty()) continue;
    islands[number].pairs.push_back(&pair);
  }
  Island& island = islands[number];
  remove_seams(island.pairs, time, h);
  const CollisionSettings settings{start + time, kCluster, def.collision_speed, def.impact, is_exact()};
  const CollisionOutcome outcome = resolve_collisions(island, settings);
  report.collisions += outcome.bounces;
  report.impacts.add(outcome.work);
  add_rough(outcome.rough, report);
  for (Body* body : island.bodies) body->rigid.set_state(body->start);
  if (time < h * (1 - kInstant)) go_on(number, start, time, h, report);
  return work + static_cast<std::size_t>(outcome.cost / 1000);
}

/// Continues the motion of an island from an impact to the end of the sub-step. Its velocities have changed,
/// so other bodies may be in its way and other contacts limit its motion. If so, they join, and all of them
/// start again.
void World::Impl::go_on(uint32_t number, Real start, Real time, Real h, StepReport& report) {
  for (bool joined = true; joined;) {
    for (Body* body : islands[number].bodies) body->rigid.set_state(body->start);
    islands[number].motion = &move_some(islands[number].bodies, start, time, h - time);
    find_pairs_again(number, start, h, report);
    joined = join_next(number, start, time, h, report);
    if (joined) continue;
    Island* const one[] = {&islands[number]};
    if (has_forces(islands[number]))
      solve(one, {.duration = h - time, .end = start + h, .substep = h, .is_whole = false}, report);
    find_pairs_again(number, start, h, report);
    joined = join_overtaken(number, start, time, h, report);
  }
}

/// Finds the contacts of an island that continues from `time`. If a body of another island is in its way and
/// their impact would not be traced back to, that island is merged, and must be moved again; the function
/// then returns true.
bool World::Impl::join_next(uint32_t number, Real start, Real time, Real h, StepReport& report) {
  islands[number].pairs.clear();
  bool joined = false;
  for (std::size_t i = 0; i < active_pairs.size(); ++i) {
    ContactPair& pair = *active_pairs[i];
    const bool has_a = is_in(pair.a(), number), has_b = is_in(pair.b(), number);
    if (!has_a && !has_b) continue;
    find_points(pair, time, h);
    const Body& other = has_a ? pair.b() : pair.a();
    if (has_a == has_b || !other.is_awake()) {
      if (!pair.manifolds().empty()) islands[number].pairs.push_back(&pair);
    } else if (!pair.needs_toi && closes(pair, h - time)) {
      const uint32_t next = other.island;
      bring_to(islands[next], start, time, h, report);
      join(number, next);
      joined = true;
    }
  }
  if (!joined) remove_seams(islands[number].pairs, time, h);
  return joined;
}

/// Merges the islands into which an island has been pushed by its contact forces since `time`, and finds the
/// contacts that it has not looked for because they were too far away. Returns whether there are any; all
/// bodies must then be moved again.
bool World::Impl::join_overtaken(uint32_t number, Real start, Real time, Real h, StepReport& report) {
  for (Body* body : islands[number].bodies)
    body->impact_speed_bound = std::max(body->impact_speed_bound, speed_by_forces(*body, h - time));
  bool joined = false;
  for (std::size_t i = 0; i < active_pairs.size(); ++i) {
    ContactPair& pair = *active_pairs[i];
    const bool has_a = is_in(pair.a(), number), has_b = is_in(pair.b(), number);
    if ((!has_a && !has_b) || pair.needs_toi) continue;
    const Body& other = has_a ? pair.b() : pair.a();
    const bool is_inside = has_a == has_b || !other.is_awake();
    // The known points inside have limited the approach.
    if (is_inside && !pair.manifolds().empty()) continue;
    if (std::max(pair.a().impact_speed_bound, pair.b().impact_speed_bound) * (h - time) > kTouching)
      find_points(pair, time, h);
    if (pair.needs_toi || !overlaps_at_end(pair, time, h)) continue;
    joined = true;
    if (is_inside) continue;
    const uint32_t next = other.island;
    bring_to(islands[next], start, time, h, report);
    join(number, next);
  }
  return joined;
}

/// Whether any points of a pair may meet within a time.
bool World::Impl::closes(const ContactPair& pair, Real left) const {
  for (const PlacedManifold& m : pair.manifolds())
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const ContactPoint& point = m.manifold.points[k];
      const Real speed = pair.relative_velocity((point.on_a + point.on_b) / 2).dot(m.frame.n);
      if (point.separation + 2 * (speed - def.gravity.norm() * left) * left < 0) return true;
    }
  return false;
}

/// Whether the points of a pair at a time overlap at the end of the sub-step.
bool World::Impl::overlaps_at_end(const ContactPair& pair, Real time, Real h) const {
  const auto displacement = [&](const Body& body, const Vec3& place) {
    const Vec3 local = body.placed_at(time, h).point_to_body(place);
    return Vec3(body.placed_at(h, h).point_to_world(local) - place);
  };
  for (const PlacedManifold& m : pair.manifolds())
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const ContactPoint& point = m.manifold.points[k];
      const Vec3 approach = displacement(pair.a(), point.on_a) - displacement(pair.b(), point.on_b);
      if (point.separation + m.frame.n.dot(approach) < -kTouching) return true;
    }
  return false;
}

/// Bodies that leave their boxes in the broad phase have new neighbours, which may have to be woken.
void World::Impl::find_pairs_again(uint32_t number, Real start, Real h, StepReport& report) {
  bool left = false;
  for (Body* body : islands[number].bodies) left |= move_in_broad_phase(*body, true);
  if (!left) return;
  collect_pairs(true);
  std::vector<ContactPair*> near = islands[number].pairs;
  for (ContactPair* pair : active_pairs) {
    if (!pair->is_new()) continue;
    find_points(*pair, std::max(pair->a().from, pair->b().from), h);
    near.push_back(pair);
  }
  remove_seams(near, islands[number].from, h);
  const std::vector<Body*> woken = wake_touched(start, h);
  if (woken.empty()) return;
  const auto added = static_cast<uint32_t>(islands.size());
  islands.emplace_back();
  islands[added].bodies = woken;
  islands[added].motion = motions.back().get();
  for (Body* body : woken) body->island = added;
  for (const auto& articulation : articulations)
    if (articulation->bodies().front()->is_awake() && articulation->bodies().front()->island == added)
      islands[added].articulations.push_back(articulation.get());
  collect_pairs(true);
  for (ContactPair* pair : active_pairs) {
    if (pair->is_new()) find_points(*pair, std::max(pair->a().from, pair->b().from), h);
    const auto outside = [&](const Body& body) { return body.is_awake() && body.island != added; };
    if (outside(pair->a()) || outside(pair->b()) || pair->manifolds().empty()) continue;
    if (pair->a().is_awake() || pair->b().is_awake()) islands[added].pairs.push_back(pair);
  }
  Island* const one[] = {&islands[added]};
  if (has_forces(islands[added]))
    solve(one, {.duration = h, .end = start + h, .substep = h, .is_whole = true}, report);
}

}  // namespace offstage::sim
