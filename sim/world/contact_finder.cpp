#include "sim/world/contact_finder.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <oneapi/tbb/parallel_for.h>

#include "sim/contact/internal_edges.h"
#include "sim/contact/solver_choice.h"
#include "sim/core/parallel_loop.h"
#include "sim/world/impact_search.h"

namespace offstage::sim {
namespace {

/// Contact points are searched within the bodies' motion in the interval plus a margin: at most kMargin [m],
/// and at most kMarginFraction of the size of the smaller body.
constexpr Real kMargin = 2e-3, kMarginFraction = 0.05;
/// If bodies move more than this in an interval, as a fraction of the smaller body's size, the contact points
/// at the start do not predict later contacts. The limit is larger for the fast solver without restitution,
/// for which the points only limit the approach.
constexpr Real kFar = 0.25, kFarWithoutBounce = 1;
/// Margin of the boxes in the broad phase: kRoom times the body's size, plus its motion in kSteps steps.
constexpr Real kRoom = 0.03, kSteps = 2;
/// Greatest deviation of a path from its chord, as a fraction of the extent. Only rotations of more than half
/// a radian exceed it.
constexpr Real kWide = 0.036;
/// Contact points are reused while the relative motion of the bodies is at most kReuse [m] and at most
/// kReuseFraction of the smaller body's size. Meanwhile only the separations are updated in each step, to
/// second order. With the exact solvers the limit is kExactReuse [m].
constexpr Real kReuse = 1e-4, kReuseFraction = 2e-4, kExactReuse = 1e-8;
/// A body that hits another body of the same mass without restitution moves on with this fraction of its
/// speed, and so does the other body. Impacts are propagated kPassedOn times. The next one would have a
/// sixteenth of the speed; for less than 7.7 m/s this is within kMargin in a step of 1/240 s.
constexpr Real kPassedFraction = 0.5;
constexpr uint32_t kPassedOn = 3;
/// Bodies count as turning if their rotation moves their surfaces by more than this in an interval [m].
constexpr Real kTurning = 2e-4;
/// Bodies with more relative motion than this in an interval may touch at other features by its end [m].
constexpr Real kFastPair = 3e-3;
Real smaller_extent(const Body& a, const Body& b) {
  return std::min(a.extent, b.extent);
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

/// Whether the box of a body's path is not within its box in the broad phase.
bool leaves(const Body& body, const Aabb& swept_box) {
  return body.collides() && !body.swept.contains(swept_box);
}

/// Whether all touching points of a pair separate faster than `speed` [m/s].
bool rebounds(const ContactPair& pair, Real speed) {
  for (const PlacedManifold& m : pair.manifolds())
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const ContactPoint& point = m.manifold.points[k];
      if (point.separation <= kTouching &&
          pair.relative_velocity((point.on_a + point.on_b) / 2).dot(m.frame.n) <= speed)
        return false;
    }
  return true;
}

/// Whether a keyframed body does not move in this sub-step.
bool stands_still(const Body& body) {
  return body.is_kinematic() && body.drive.velocity == Vec3::Zero() &&
         body.drive.angular_velocity == Vec3::Zero() && body.pose.position == body.before_substep.position &&
         body.pose.orientation.coeffs() == body.before_substep.orientation.coeffs();
}

}  // namespace

void ContactFinder::use(const CollisionMethods& methods) {
  if (methods.broad_phase == CollisionMethods::BroadPhase::grid)
    broad_phase_ = GroupedBroadPhase(GridKind::uniform, methods.cell_factor);
}

void ContactFinder::add(const Body& body) {
  if (body.collides())
    broad_phase_.insert(body.handle.index, bounds(body.solid, body.pose), !body.is_dynamic());
}

void ContactFinder::remove(const Body& body) {
  if (broad_phase_.contains(body.handle.index)) broad_phase_.remove(body.handle.index);
}

void ContactFinder::forget(const Body& body) {
  graph_.forget(body.handle.index);
  clear();
}

void ContactFinder::forget_all() {
  graph_.forget_all();
  clear();
}

void ContactFinder::update_joint_groups() {
  broad_phase_.set_groups(joints_.colliding());
  is_current_ = false;
}

void ContactFinder::clear() {
  pairs_.clear();
  is_current_ = false;
}

/// Returns a box around all positions of a body in its interval.
Aabb ContactFinder::swept_bounds(const Body& body) const {
  Aabb box = bounds(body.solid, body.start_pose).merged(bounds(body.solid, body.pose));
  Real margin = std::min(kMargin, kMarginFraction * body.extent);
  // Without a rotation there is no bow; for a plane, whose extent is infinite, the product would be
  // undefined.
  if (const PosePath path = body.path(); path.turns() && !std::holds_alternative<Sphere>(body.def.shape)) {
    // The deviation of a point from the chord of its path is at most an eighth of its greatest acceleration.
    // Large rotations use the balls around the start and the end instead.
    const Real bow = path.max_acceleration(body.extent) / 8;
    margin += bow > kWide * body.extent ? body.extent : bow;
  }
  margin += cloth_.room(box);
  box.min().array() -= margin;
  box.max().array() += margin;
  return box;
}

/// Gives the box of a body's path, enlarged by a margin, to the broad phase. With `again`, in the same
/// sub-step, the previous box is included.
void ContactFinder::move(Body& body, Aabb swept_box, bool again) {
  // The margin covers a few more steps like this one.
  const Vec3 shift = kSteps * (body.pose.position - body.start_pose.position);
  const Vec3 room = Vec3::Constant(kRoom * body.extent);
  swept_box.min() += shift.cwiseMin(0) - room;
  swept_box.max() += shift.cwiseMax(0) + room;
  if (again) swept_box.extend(body.swept);
  body.swept = swept_box;
  broad_phase_.move(body.handle.index, swept_box);
  is_current_ = false;
}

/// Gives a new box to the broad phase only if the body's path is not within the previous box. Returns whether
/// the box was changed.
bool ContactFinder::move(Body& body, bool again) {
  const Aabb swept_box = swept_bounds(body);
  if (!leaves(body, swept_box)) return false;
  move(body, swept_box, again);
  return true;
}

/// Collects the pairs of bodies whose paths come near each other. With `again`, in the same sub-step,
/// existing pairs are kept.
void ContactFinder::collect(bool again) {
  if (std::exchange(is_current_, true) && version_ == active_.version()) return;
  version_ = active_.version();
  graph_.update(
      broad_phase_.pairs(), again, [&](uint32_t slot) { return &world_.body_at(slot); },
      [&](const Body& a, const Body& b) { return materials_.surface(a, b, world_.def.collision); });
  std::vector<RankedPair> ranked;
  ranked.reserve(graph_.size());
  graph_.for_each([&](ContactPair& pair) {
    const Body &a = pair.a(), &b = pair.b();
    if (joints_.is_collision_disabled(a, b)) return;
    if (a.can_move() || b.can_move())
      ranked.push_back({std::min(a.rank, b.rank), std::max(a.rank, b.rank), &pair});
  });
  sort_by_rank(ranked, world_.bodies.size(), pairs_);
}

/// Computes for each body an upper bound of the speed that an impact in the sub-step can give to it. The
/// bound is propagated from body to body, and decreases each time.
void ContactFinder::propagate_impact_speeds(Real h) {
  for (Body* body : active_.awake()) body->impact_speed_bound = 0;
  if (is_exact_) return;  // the exact solver resolves each impact at its own time
  struct Approach {
    Body *a, *b;
    Real speed;
  };
  std::vector<Approach> approaches(pairs_.size());
  for_each_index(pairs_.size(), [&](std::size_t i) {
    ContactPair& pair = *pairs_[i];
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
      strike(*a, kPassedFraction * b->impact_speed_bound);
      strike(*b, kPassedFraction * a->impact_speed_bound);
    }
}

void ContactFinder::find(Real h) {
  traces_impacts_ = true;
  const std::span<Body* const> awake = active_.awake();
  is_exact_ = world_.is_exact() || (world_.def.solver == SolverKind::automatic && awake.size() <= kFewBodies);
  cloth_.begin(h);
  std::vector<Aabb> swept_boxes(awake.size());
  const std::vector<std::size_t> leaving = indices_where(awake.size(), [&](std::size_t i) {
    swept_boxes[i] = swept_bounds(*awake[i]);
    return leaves(*awake[i], swept_boxes[i]);
  });
  for (const std::size_t i : leaving) move(*awake[i], swept_boxes[i], false);
  for (Body* body : active_.kinematic()) move(*body, false);
  collect(false);
  cloth_.find(pairs_);
  propagate_impact_speeds(h);
  const auto find_contacts = [&](std::size_t i) {
    // Pairs are scattered in memory.
    if (i + 6 < pairs_.size()) pairs_[i + 6]->prefetch();
    if (i + 3 < pairs_.size()) pairs_[i + 3]->prefetch_manifold();
    pairs_[i]->impacts = 0;
    pairs_[i]->deepest = 0;
    pairs_[i]->toi_exhausted = pairs_[i]->restitution_suppressed = false;
    find_points(*pairs_[i], 0, h);
  };
  constexpr std::size_t kManyPairs = 64, kPairsOfTask = 16;
  if (pairs_.size() < kManyPairs) {
    for (std::size_t i = 0; i < pairs_.size(); ++i) find_contacts(i);
  } else {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, pairs_.size(), kPairsOfTask),
                      [&](const auto& range) {
                        for (std::size_t i = range.begin(); i < range.end(); ++i) find_contacts(i);
                      });
  }
  remove_internal_edge_contacts(pairs_, 0, h);
}

/// Returns an upper bound of the relative motion of a pair's bodies in the rest of the sub-step [m].
Real ContactFinder::motion_bound(const ContactPair& pair, Real left) const {
  return (pair.speed_bound() + 2 * world_.def.gravity.norm() * left) * left;
}
Real ContactFinder::motion_known(const ContactPair& pair) const {
  const Real size = smaller_extent(pair.a(), pair.b());
  const bool bounces = is_exact_ || pair.surface().restitution > 0;
  return std::max(std::min(kMargin, kMarginFraction * size), (bounces ? kFar : kFarWithoutBounce) * size);
}

void ContactFinder::find_points(ContactPair& pair, Real time, Real h) const {
  const Real left = h - time;
  const Real size = smaller_extent(pair.a(), pair.b());
  const Real base = std::min(kMargin, kMarginFraction * size);
  const Real motion = motion_bound(pair, left), far = motion_known(pair);
  const bool exact = is_exact_;
  // An impact moves a body at most as fast as the body that hits it.
  const Real impact = std::max(pair.a().impact_speed_bound, pair.b().impact_speed_bound) * left;
  // Cloth that lies between the bodies keeps them apart by its thickness, unless they are so fast that the
  // contact points of the start do not predict the impact.
  const std::span<const LayerTriangle> cloth =
      motion > far ? std::span<const LayerTriangle>{} : cloth_.between(pair);
  pair.set_cloth(cloth);
  pair.toi_exhausted = pair.toi_exhausted || !traces_impacts_;
  // If the pair is not traced back again, only its contact points keep the bodies apart.
  const Real most = pair.toi_exhausted ? std::numeric_limits<Real>::infinity() : far;
  const Real margin =
      base + std::min(std::max(2 * motion, impact), most) + (cloth.empty() ? 0 : cloth_.room());
  // An impact also turns the body.
  const Real turning = pair.turning_speed() * left + (impact > kMargin ? impact : 0);
  const Real reuse = exact ? kExactReuse : std::min(kReuse, kReuseFraction * size);
  pair.find(pair.a().placed_at(time, h), pair.b().placed_at(time, h), margin, reuse, turning > kTurning);

  // The impact would be found where the bodies themselves touch.
  if (pair.layer()) pair.toi_exhausted = true;
  const bool is_far = motion > far;
  const bool is_quick =
      !exact && time == 0 && !pair.manifolds().empty() && pair.speed_bound() * h > kFastPair;
  if (is_quick && !is_far && !pair.toi_exhausted) pair.add_speculative_contacts(h);
  choose_event(pair, is_far, left);
}

/// Sets ContactPair::needs_toi, which requests the trace-back of the island to the pair's next impact. `far`:
/// whether the relative motion is too large for the known contact points.
void ContactFinder::choose_event(ContactPair& pair, bool far, Real left) const {
  pair.needs_toi = far && !pair.toi_exhausted;
  pair.tumbles_away = pair.needs_toi && turns_fast(pair, left) && rebounds(pair, world_.def.collision_speed);
  const bool bounces = is_exact_ || pair.surface().restitution > 0;
  if (far || pair.toi_exhausted || !bounces || pair.restitution_suppressed) return;
  for (const PlacedManifold& m : pair.manifolds())
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const ContactPoint& point = m.manifold.points[k];
      const Real speed = pair.relative_velocity((point.on_a + point.on_b) / 2).dot(m.frame.n);
      if (speed < -world_.def.collision_speed &&
          point.separation + 2 * (speed - world_.def.gravity.norm() * left) * left < 0)
        pair.needs_toi = true;
    }
}

void ContactFinder::remove_internal_edge_contacts(std::span<ContactPair* const> pairs, Real time,
                                                  Real h) const {
  for (ContactPair* pair : sim::remove_internal_edge_contacts(pairs, time, h))
    choose_event(*pair, motion_bound(*pair, h - time) > motion_known(*pair), h - time);
}

std::vector<Body*> ContactFinder::wake_touched(FreeMotion& motion, Real start, Real h) {
  if (active_.asleep() == 0) return {};
  std::vector<Body*> touched;
  for (ContactPair* pair : pairs_) {
    if (pair->manifolds().empty() && !pair->needs_toi) continue;
    if (stands_still(pair->a()) || stands_still(pair->b())) continue;
    for (Body* body : {&pair->a(), &pair->b()})
      if (body->asleep) touched.push_back(body);
  }
  if (touched.empty()) return {};
  std::vector<Body*> woken;
  for (Body* body : touched)
    for (Body* member : active_.wake(*body)) woken.push_back(member);
  std::sort(woken.begin(), woken.end(), [](const Body* a, const Body* b) { return a->rank < b->rank; });
  for (Body* body : woken) body->begin_interval(0);
  motion.move_group(woken, start, 0, h);
  for (Body* body : woken) move(*body, false);
  active_.update();
  return woken;
}

bool ContactFinder::follow(std::span<Body* const> bodies) {
  bool left = false;
  for (Body* body : bodies) left |= move(*body, true);
  if (left) collect(true);
  return left;
}

void ContactFinder::count(StepReport& report) const {
  report.bodies.awake = static_cast<uint32_t>(active_.awake().size());
  report.bodies.asleep = static_cast<uint32_t>(active_.asleep());
  report.contacts.pairs_tested += pairs_.size();
  report.contacts.points = 0;
  for (ContactPair* pair : pairs_) {
    const TestCounts tests = pair->take_tests();
    report.contacts.volume_tests += tests.volumes;
    report.contacts.piece_tests += tests.pieces;
    report.contacts.points += pair->touching();
    report.contacts.speculative += pair->speculative;
    report.contacts.penetration = std::max(report.contacts.penetration, pair->deepest);
  }
}

}  // namespace offstage::sim
