#include "sim/contact/exact_contacts.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <tuple>

#include "sim/contact/bounded_collision.h"
#include "sim/contact/contact_lcp.h"
#include "sim/contact/contact_motion.h"
#include "sim/contact/contact_terms.h"

namespace offstage::sim {
namespace {

/// kPushOut: fraction of a penetration that a step removes. kFastestPush: greatest speed of this correction
/// [m/s].
constexpr Real kPushOut = 0.2, kFastestPush = 0.5;
/// A correction that is faster than this is a displacement; bodies keep the velocity of a slower one [m/s].
/// Where bodies turn, they also keep one within the uncertainty of the velocity terms (kTurningShare), whose
/// error is the cause of such overlaps: it has taken from a rolling body what the correction returns.
constexpr Real kKeptPush = 1e-3;
/// Points that approach faster than this closed within the interval, and not before it [m/s].
constexpr Real kClosing = 1e-3;
/// In an interval that may be divided, points with a gap close later if they approach faster than this, even
/// if the gap is very small [m/s].
constexpr Real kApproaching = 1e-4;
/// Islands with more bodies than this are heaps, whose intervals are not divided, because that would cost
/// more than the solution.
constexpr std::size_t kMostDivided = 6;
/// Corners of bodies that turn farther than this in an interval do not move on straight lines [rad]. Islands
/// of several bodies with such a body are not divided, since bodies that have touched would overlap.
constexpr Real kMostTurned = 0.1;
/// Greatest cost of a solution and its division if there is a budget [ns, see ProximalNewton::cost()].
constexpr Real kMostDivision = 2e6;
/// Uncertainty of the speed of approach at a resting contact. It is this fraction of the change of the normal
/// velocity due to rotation in half an interval.
constexpr Real kTurningShare = 0.5;
/// A stopped body also stops those neighbours that would otherwise overlap it by more than kOverlap [m]. This
/// is repeated for their neighbours, in at most kBlockPasses passes.
constexpr int kBlockPasses = 20;
constexpr Real kOverlap = 1e-6;
/// The result of a fall-back is rejected if its residual is larger than kRough [m/s], or if it adds more than
/// the fraction kEnergyRounding of the energy.
constexpr Real kRough = 1e-2, kEnergyRounding = 1e-9;
/// Fraction of the kinetic energy that the velocity terms of a solution may add in a step.
constexpr Real kTermsShare = 0.02;

/// A point slides throughout the interval if contacts change its sliding velocity by less than this fraction
/// of its sliding speed at the start.
constexpr Real kSlidesOn = 0.5;

/// Greatest number of solutions with points that are assumed to slide throughout; see add_sliding().
constexpr int kMostAssumed = 4;

/// Returns the angular speed of a body's corners [rad/s]. The rotation of round bodies about their axis does
/// not count.
Real turning_of_corners(const Body& body) {
  const Vec3& spin = body.start_twist.angular_velocity;
  const Shape& shape = body.def.shape;
  if (std::holds_alternative<Sphere>(shape)) return 0;
  if (!is_round_about_axis(shape)) return spin.norm();
  const Vec3 axis = body.start_pose.vector_to_world(Vec3::UnitY());
  return (spin - spin.dot(axis) * axis).norm();
}

/// Returns the sum of the normal forces of a pair at the end of the last interval [N].
Real last_force(const ContactPair& pair) {
  Real sum = 0;
  for (const PlacedManifold& m : pair.manifolds())
    for (uint32_t k = 0; k < m.manifold.count; ++k) sum += m.forces[k].last.x();
  return sum;
}

/// Returns the data of a contact for the division of the interval. `linear`: the bias at the interval's end,
/// if the contact does not turn.
ClosingPoint closing_point(Real gap, const Vec3& surface, const ContactMotion& motion, const Vec3& linear) {
  if (!motion.turns) return {.gap = gap, .surface = surface, .bias = {Vec3::Zero(), linear, Vec3::Zero()}};
  const Vec3 &gain = motion.gain, &bow = motion.bow;  // coefficients of the polynomial in s = 2 part - 1
  return {.gap = gap, .surface = surface, .bias = {bow - gain, 2 * gain - 4 * bow, 4 * bow}};
}

}  // namespace

ExactContacts::Outcome ExactContacts::solve(const Island& island, const ContactInterval& interval,
                                            Real budget, Method method) {
  cost_ = division_cost_ = 0;
  bodies_.clear();
  contacts_.clear();
  pairs_.clear();
  forces_.clear();
  approach_.clear();
  sliding_.clear();
  has_carrier_ = false;
  for (Body* body : island.bodies) {
    body->row = static_cast<uint32_t>(bodies_.size());
    add_body(*body, interval);
  }
  points_.clear();
  displacements_.clear();
  const Island* const one[] = {&island};
  joints_.collect(one, interval, IslandJoints::Springs::rows);
  may_divide_ = island.bodies.size() == 1 ||
                (island.bodies.size() <= kMostDivided &&
                 std::all_of(island.bodies.begin(), island.bodies.end(), [&](const Body* body) {
                   return turning_of_corners(*body) * interval.duration <= kMostTurned;
                 }));
  may_divide_ = may_divide_ && joints_.act_throughout();
  for (ContactPair* pair : island.pairs) add_points(*pair, interval, method);
  if (contacts_.empty() && joints_.bounded().empty()) return {.is_applied = true, .work = {}};

  free_ = bodies_;
  push_apart(island, interval.duration);
  joints_.project(bodies_, interval.end);
  Outcome outcome;
  if (method == Method::lcp) outcome.is_applied = solve_lcp(outcome.lcp);
  if (!outcome.is_applied) {
    const std::optional<ContactWork> work = solve_by_newton(budget);
    if (!work) return outcome;
    outcome.is_applied = is_safe(*work);
    outcome.work = *work;
    if (!outcome.is_applied) outcome.work.fallbacks = 1;
    if (outcome.work.fallbacks > 0)
      if (const auto worst = worst_contact(bodies_, contacts_)) outcome.rough = pairs_[*worst];
    if (!outcome.is_applied) return outcome;
    // The fast solver has shorter sub-steps, so it loses less energy than an undivided solution. Without a
    // budget that solution would be applied, so the division may cost what it must.
    const Real left = std::isfinite(budget) ? std::min(2 * budget, kMostDivision) - cost_ : budget;
    const bool is_divided = !has_closing() || divide_at_closings(island, interval, left, outcome.work);
    outcome.is_applied = is_divided || !std::isfinite(budget);
    if (!outcome.is_applied) return outcome;
  }
  joints_.store_impulses(interval.duration);
  for (std::size_t i = 0; i < contacts_.size(); ++i)
    forces_[i]->now = contacts_[i].impulse / interval.duration;
  if (interval.is_whole)
    for (PointForce* force : forces_) force->last = force->now;
  move_bodies(island, interval);
  return outcome;
}

/// Moves overlapping bodies apart, without a change of their velocities: they would keep the speed of the
/// correction, which depends on the length of the sub-step. Slow corrections and those of linked bodies are
/// left to the solution of the velocities, and so are those of thin bodies, whose energy depends on their
/// orientation.
void ExactContacts::push_apart(const Island& island, Real duration) {
  pushes_.clear();
  const bool is_slow = std::ranges::all_of(contacts_, [](const Contact& c) {
    return c.target <= std::max(kKeptPush, kTurningShare * std::abs(c.bias.x()));
  });
  const auto is_thin = [](const Body* body) { return body->rigid.is_thin(); };
  if (is_slow || !joints_.articulations().empty() || std::ranges::any_of(island.bodies, is_thin)) return;
  std::vector<Contact> pushing = contacts_;
  for (Contact& c : pushing) {
    c.offset = c.bias = c.impulse = c.moment = Vec3::Zero();
    c.friction_t = c.friction_k = c.rolling = c.spinning = 0;
    c.is_guessed = false;
  }
  std::vector<ContactBody> moved = bodies_;
  for (ContactBody& body : moved) body.velocity = body.angular_velocity = Vec3::Zero();
  const std::optional<ContactWork> work = newton_.solve(moved, pushing, {}, kInfinity);
  cost_ += newton_.cost();
  if (!work || work->fallbacks > 0) return;
  for (const ContactBody& body : moved)
    pushes_.push_back({duration * body.velocity, duration * body.angular_velocity});
  for (Contact& c : contacts_) c.target = std::min(c.target, 0.0);
}

/// Solves the contacts by N11. Returns no result if this would cost more than `budget`.
std::optional<ContactWork> ExactContacts::solve_by_newton(Real budget) {
  const std::vector<ContactBody> start = bodies_;
  ContactWork total;
  for (int turn = 1;; ++turn, bodies_ = start) {
    const std::optional<ContactWork> work =
        newton_.solve(bodies_, contacts_, joints_.problem(), budget - cost_);
    cost_ += newton_.cost();
    if (!work) return {};
    total.add(*work);
    if (!remove_sliding(turn >= kMostAssumed)) return total;
  }
}

/// Solves the contacts by linear complementarity. If this fails or the result is unsafe, nothing is changed.
bool ExactContacts::solve_lcp(ContactWork& work) {
  const std::vector<Contact> guesses = contacts_;
  const std::vector<BoundedRow> rows(joints_.bounded().begin(), joints_.bounded().end());
  const JointProblem joints = joints_.problem();
  const std::vector<Vec6> reactions(joints.impulses.begin(), joints.impulses.end());
  if (!solve_by_lcp(bodies_, contacts_, joints, work)) return false;
  if (is_safe({})) return true;
  ++work.fallbacks;
  bodies_ = free_;
  contacts_ = guesses;
  std::copy(rows.begin(), rows.end(), joints.bounded.begin());
  std::copy(reactions.begin(), reactions.end(), joints.impulses.begin());
  return false;
}

/// Whether the solution can be applied. It is rejected in these cases. Contacts that push a body out of
/// overlaps from two sides have no solution: their unbounded impulses nearly cancel, and the remainder throws
/// bodies away. The velocity terms of R9 are wrong if a thin body turns far in a step. Moving surfaces,
/// motors and friction in joints may do work; all other forces may only dissipate energy, apart from the
/// speed at which overlaps are removed and a small fraction for the velocity terms. Energy that motors and
/// friction take away is counted, since a limit or a contact that holds against a motor returns a part of it.
bool ExactContacts::is_safe(const ContactWork& work) const {
  if (work.fallbacks > 0 && work.residual > kRough) return false;
  Real energy = added_energy(free_, bodies_, contacts_);
  // A limit has one finite bound. A motor or friction has two, and a motor of unlimited strength has none.
  for (const BoundedRow& r : joints_.bounded())
    if (const Real gain = (r.impulse * row_speed(r, free_) + r.impulse * row_speed(r, bodies_)) / 2;
        std::isfinite(r.lower) != std::isfinite(r.upper) || gain < 0)
      energy += gain;
  if (energy <= 0) return true;

  Real push = 0, mass = 0;
  for (const Contact& c : contacts_)
    if (c.impulse.x() > 0) push = std::max(push, c.target);
  for (const ContactBody& body : free_)
    if (body.is_moved()) mass += 1 / body.inverse_mass;
  const Real kinetic = kinetic_energy(free_);
  if (work.fallbacks > 0) return energy <= kEnergyRounding * kinetic;
  return energy <= kTermsShare * kinetic + mass * push * push / 2;
}

/// Whether a contact with an immovable body touches from the interval's start on, and another contact pushes
/// that had a gap at the start or approached faster than kApproaching. Without such contacts the interval
/// need not be divided: bodies that rest on other moving bodies lose little energy.
bool ExactContacts::has_closing() const {
  bool touches = false, closes = false;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Contact& c = contacts_[i];
    if (bodies_[c.a].is_moved() && bodies_[c.b].is_moved()) continue;
    touches = touches || points_[i].gap == 0;
    closes = closes || (c.impulse.x() > 0 && (points_[i].gap > 0 || approach_[i] > kApproaching));
  }
  return touches && closes;
}

/// Replaces the solution by one that is divided at the times at which contacts close. Returns false, without
/// a change, if that is unsafe or too expensive.
bool ExactContacts::divide_at_closings(const Island& island, const ContactInterval& interval, Real budget,
                                       ContactWork& work) {
  std::vector<ContactBody> start = free_;
  for (const Body* body : island.bodies) {
    start[body->row].velocity = body->start_twist.velocity;
    start[body->row].angular_velocity = body->start_twist.angular_velocity;
  }
  std::vector<Contact> guesses = contacts_;
  for (std::size_t i = 0; i < guesses.size(); ++i)
    if (guesses[i].is_guessed) guesses[i].impulse = interval.duration * forces_[i]->last;
  const JointProblem joints = joints_.problem();
  std::optional<ClosingSolution> solution = solve_closing(
      {start, free_, guesses, points_, joints, interval.duration, budget}, newton_, division_cost_);
  if (!solution) return false;
  const auto exchange = [&] {
    std::swap(bodies_, solution->bodies);
    std::swap(contacts_, solution->contacts);
    std::swap_ranges(joints.bounded.begin(), joints.bounded.end(), solution->bounded.begin());
    std::swap_ranges(joints.impulses.begin(), joints.impulses.end(), solution->constraints.begin());
  };
  exchange();
  if (!is_safe(solution->work)) {
    exchange();
    return false;
  }
  work.add(solution->work);
  displacements_ = std::move(solution->displacements);
  return true;
}

/// Lets the friction of a point oppose its sliding in the middle of the interval, if the point seems to slide
/// throughout. Axes with limits of their own are treated one by one, since a point that slides along the
/// friction axis may stick across it. `u` is the relative velocity at the start with the arms of the middle,
/// and `force` the normal force of the pair [N].
void ExactContacts::add_sliding(const Vec3& u, Real force, Real duration) {
  if (!(force > 0)) return;
  const Contact& c = contacts_.back();
  const Mat3 K = mobility(c, bodies_);
  // A point that was hardly loaded may be loaded now.
  const Real stop = std::max(0.0, -c.relative_velocity(bodies_).x()) / K(0, 0);
  const Real load = duration * force + stop;
  if (c.is_isotropic()) {
    add_sliding(u, {1, 1}, c.friction_t * load * (K(1, 1) + K(2, 2)) / 2);
  } else {
    add_sliding(u, {1, 0}, c.friction_t * load * K(1, 1));
    add_sliding(u, {0, 1}, c.friction_k * load * K(2, 2));
  }
}

/// Does so along `axes` (1 or 0 for t and k), unless friction may change the sliding velocity along them by
/// more than kSlidesOn of it. `greatest_change` is the greatest change [m/s].
void ExactContacts::add_sliding(const Vec3& u, const Eigen::Vector2d& axes, Real greatest_change) {
  Contact& c = contacts_.back();
  const Eigen::Vector2d start = u.tail<2>().cwiseProduct(axes);
  if (start.isZero(0) || greatest_change > kSlidesOn * start.norm()) return;
  const Eigen::Vector2d change = start - c.bias.tail<2>().cwiseProduct(axes);
  sliding_.push_back({static_cast<uint32_t>(contacts_.size() - 1), axes, start, change});
  c.bias.tail<2>() += change;
  c.offset.tail<2>() += change;
}

/// Finds points that do not slide throughout the interval, contrary to what add_sliding() assumed. Their
/// friction, or that of all points if `all` is true, then opposes the velocity at the end. Returns whether
/// there are any: the contacts must then be solved again.
bool ExactContacts::remove_sliding(bool all) {
  const auto is_wrong = [this](const Sliding& s) {
    const Contact& c = contacts_[s.contact];
    const Eigen::Vector2d end = c.relative_velocity(bodies_).tail<2>().cwiseProduct(s.axes) - s.start;
    return c.impulse.x() != 0 && (end - s.start).norm() > kSlidesOn * s.start.norm();
  };
  const auto wrong = all && std::ranges::any_of(sliding_, is_wrong)
                         ? sliding_.begin()
                         : std::stable_partition(sliding_.begin(), sliding_.end(), std::not_fn(is_wrong));
  const bool any = wrong != sliding_.end();
  std::for_each(wrong, sliding_.end(), [this](const Sliding& s) {
    contacts_[s.contact].bias.tail<2>() -= s.change;
    contacts_[s.contact].offset.tail<2>() -= s.change;
  });
  sliding_.erase(wrong, sliding_.end());
  return any;
}

uint32_t ExactContacts::add_body(Body& body, const ContactInterval& interval) {
  bodies_.push_back(body.is_awake()
                        ? ContactBody{1 / body.rigid.mass,
                                      inverse_inertia(body.rigid, body.impulse_orientation(interval.duration,
                                                                                           interval.substep)),
                                      body.rigid.velocity(), body.rigid.angular_velocity()}
                        : unmoved_body(body));
  has_carrier_ = has_carrier_ || RidingBodies::can_carry(body);
  return static_cast<uint32_t>(bodies_.size() - 1);
}

void ExactContacts::add_points(ContactPair& pair, const ContactInterval& interval, Method method) {
  const Real h = interval.duration;
  const uint32_t a = pair.a().is_awake() ? pair.a().row : add_body(pair.a(), interval);
  const uint32_t b = pair.b().is_awake() ? pair.b().row : add_body(pair.b(), interval);
  const Real force = last_force(pair);
  for (PlacedManifold& m : pair.manifolds()) {
    const Vec3 surface = surface_velocity(pair, m.frame.n);
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const ContactPoint& point = m.manifold.points[k];
      if (pair.awaits_impact(m, point, interval.impact_speed)) continue;
      const Vec3 place = (point.on_a + point.on_b) / 2;
      const Vec3 u = m.frame.components(pair.relative_velocity(place) + surface);
      const ContactMotion motion = contact_motion(pair.a(), pair.b(), m.manifold, m.frame, place,
                                                  point.separation, h, interval.substep);
      // The approach of a rotating contact differs slightly from the prediction of its rotation.
      const Real approach = std::max(0.0, std::abs(u.x()) - kTurningShare * std::abs(motion.gain.x()));
      const bool closes_later = may_divide_ && point.separation > 0 && u.x() < 0 && approach > kApproaching;
      const bool touches = point.separation <= kTouching && !closes_later;
      Contact c{.a = a, .b = b, .frame = motion.frame};
      c.arm_a = motion.middle.arm_a;
      c.arm_b = motion.middle.arm_b;
      c.offset = c.frame.components(surface);
      if (touches) c.bias = motion.turns ? Vec3(motion.gain + motion.bow) : velocity_bias(pair, m, point, h);
      c.offset += c.bias;
      // This is the length of the sub-step. The rest of a sub-step after an impact can be very short, and the
      // speed would then be unbounded.
      c.target = touches ? std::min(-kPushOut * point.separation / interval.substep, kFastestPush)
                         : -point.separation / h;
      // Surfaces that rebound, and then approach because the bodies turn, have a gap in between: they need no
      // force. The approach at the end may undo a half of the separation.
      if (touches && u.x() > 0 && approach > interval.impact_speed && c.bias.x() < 0)
        c.target = std::min(c.target, std::max(c.bias.x(), -u.x() / 2));
      std::tie(c.friction_t, c.friction_k) = friction(pair.surface(), u);
      c.rolling = pair.surface().rolling;
      c.spinning = pair.surface().spinning;
      c.impulse = h * m.forces[k].last;
      c.is_guessed = m.forces[k].known;
      contacts_.push_back(c);
      // The moment of spinning friction has no such velocity in the middle.
      if (method == Method::proximal && touches && pair.surface().spinning == 0)
        add_sliding(u + motion.gain - motion.bow, force, h);
      pairs_.push_back(&pair);
      forces_.push_back(&m.forces[k]);
      approach_.push_back(approach);
      if (may_divide_)
        points_.push_back(
            closing_point(touches ? 0 : point.separation, c.frame.components(surface), motion,
                          motion.turns ? Vec3(Vec3::Zero()) : velocity_bias(pair, m, point, h)));
    }
  }
}

/// Moves the bodies by the solution. Forces that are constant over the interval move a body by half of the
/// change of velocity times the time. The force of a joint that reaches a limit acts on the rest of the
/// interval only, with the whole change of velocity. If a contact of the body closed in the interval, or
/// opened and closed again, its force also acts only in a part of the interval. The body then moves by its
/// new velocity throughout the interval, as the contact's target assumes.
void ExactContacts::move_bodies(const Island& island, const ContactInterval& interval) {
  const Real duration = interval.duration;
  end_weights_.assign(bodies_.size(), 0);
  for (std::size_t i = 0; i < contacts_.size(); ++i)
    if (approach_[i] > kClosing && contacts_[i].impulse.x() > 0)
      end_weights_[contacts_[i].a] = end_weights_[contacts_[i].b] = 1;
  // Links with springs move by the velocities at the end in any case.
  std::vector<uint8_t> is_kicked(bodies_.size(), 0);
  for (const Articulation* a : joints_.articulations())
    if (a->has_springs())
      for (const Body* link : a->bodies()) {
        is_kicked[link->row] = 1;
        end_weights_[link->row] = 1;
      }
  close_stops();
  close_links();
  close_neighbors(island, duration);
  rest_.assign(island.bodies.size(), 0.5);
  for (std::size_t i = 0; i < joints_.articulations().size(); ++i)
    for (const Body* body : joints_.articulations()[i]->bodies())
      rest_[body->row] = 1 - joints_.acting_from(i);
  riding_.clear();
  if (has_carrier_ && interval.is_whole) riding_.find(island, bodies_, contacts_, pairs_, duration);
  for (std::size_t i = 0; i < island.bodies.size(); ++i) {
    Body& body = *island.bodies[i];
    const Vec3 dv = bodies_[i].velocity - free_[i].velocity,
               dw = bodies_[i].angular_velocity - free_[i].angular_velocity;
    Vec3 mean = rest_[i] * dv, mean_spin = rest_[i] * dw;
    if (end_weights_[i] > 0 && !is_kicked[i]) {
      const Vec3 end = (dv + bodies_[i].velocity - body.start_twist.velocity) / 2;
      const Vec3 end_spin = (dw + bodies_[i].angular_velocity - body.start_twist.angular_velocity) / 2;
      mean += end_weights_[i] * (end - mean);
      mean_spin += end_weights_[i] * (end_spin - mean_spin);
    }
    if (!riding_.empty() && end_weights_[i] == 0) {
      mean += riding_.deviation(i).shift / duration;
      mean_spin += riding_.deviation(i).turn / duration;
    }
    if (!displacements_.empty()) {
      const auto& [shift, turn] = displacements_[i];
      mean = shift / duration - (body.start_twist.velocity + free_[i].velocity) / 2;
      mean_spin = turn / duration - (body.start_twist.angular_velocity + free_[i].angular_velocity) / 2;
    }
    if (!pushes_.empty()) {
      mean += pushes_[i].shift / duration;
      mean_spin += pushes_[i].turn / duration;
    }
    add_effect(body, {body.rigid.mass * dv,
                      body.rigid.spin_momentum(body.impulse_orientation(duration, interval.substep), dw),
                      free_[i].inverse_inertia * body.rigid.angular_momentum, dw, duration * mean,
                      duration * mean_spin, duration / interval.substep});
  }
}

/// Marks bodies as stopped that a stopped neighbour would overlap. A stopped body moves less far than one
/// that is not stopped, although both get equal velocities: the difference is half of the change of velocity
/// times the interval. If this would cause an overlap, the other body counts as stopped, too.
void ExactContacts::close_neighbors(const Island& island, Real duration) {
  const auto displacement = [&](uint32_t i, const Vec3& arm) {
    const Vec3 end = bodies_[i].velocity_at(arm);
    if (i >= island.bodies.size()) return Vec3(duration * end);
    return Vec3(
        duration / 2 *
        ((1 + end_weights_[i]) * end + (1 - end_weights_[i]) * island.bodies[i]->start_twist.at(arm)));
  };
  bool changed = true;
  for (int pass = 0; changed && pass < kBlockPasses; ++pass) {
    changed = false;
    for (const Contact& c : contacts_) {
      if (end_weights_[c.a] == end_weights_[c.b]) continue;
      const Real separation = std::max(0.0, -c.target * duration);
      if (separation + c.frame.n.dot(displacement(c.a, c.arm_a) - displacement(c.b, c.arm_b)) > -kOverlap)
        continue;
      end_weights_[c.a] = end_weights_[c.b] = 1;
      changed = true;
    }
    if (changed) close_links();
  }
}

/// Gives all links of an articulation the greatest weight of its links. If some links moved by the mean of
/// their velocities and others by the new ones, the joints would come apart, and their projection would push
/// light links into the obstacle that stopped them.
void ExactContacts::close_links() {
  for (const Articulation* articulation : joints_.articulations()) {
    const std::span<Body* const> links = articulation->bodies();
    Real greatest = 0;
    for (const Body* link : links) greatest = std::max(greatest, end_weights_[link->row]);
    for (const Body* link : links) end_weights_[link->row] = greatest;
  }
}

/// Gives the bodies of rows that close the weight of the row.
void ExactContacts::close_stops() {
  for (std::size_t i = 0; i < joints_.bounded().size(); ++i) {
    const BoundedRow& row = joints_.bounded()[i];
    if (row.impulse == 0) continue;
    for (uint32_t body : {row.a, row.b})
      if (body != kUnmoved)
        end_weights_[body] = std::max(end_weights_[body], joints_.origins()[i].end_weight);
  }
}

}  // namespace offstage::sim
