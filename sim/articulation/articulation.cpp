#include "sim/articulation/articulation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Cholesky>

#include "sim/articulation/joint_limits.h"
#include "sim/dynamics/free_body.h"
#include "sim/linear/lcp.h"

namespace offstage::sim {
namespace {

/// The projection uses at most kMostSteps steps of Newton's method. It ends when the constraint errors are
/// below kTogether [m]. Velocities are projected until their errors are below the same number [m/s].
constexpr int kMostSteps = 8;
constexpr Real kTogether = 1e-12;
/// Largest correction of a constraint error in one step [m], because the linearization is poor beyond this.
constexpr Real kFarApart = 0.1;
constexpr Real kSmall = 1e-4;
constexpr int kVelocitySteps = 2;
/// A joint that moves away from its limit faster than this does not touch the limit [m/s], [rad/s].
constexpr Real kLeaving = 1e-6;
/// A velocity that violates the constraints by less than this has not changed since settle() [m/s].
constexpr Real kDisturbed = 1e-7;
/// Greatest phase by which the tension in the joints lets a link swing between two kicks [rad].
constexpr Real kKickPhase = 1;

bool is_moved(const Body* body) {
  return body && body->is_dynamic();
}

std::vector<Body*> dynamic_bodies(std::span<Joint* const> joints) {
  std::vector<Body*> bodies;
  for (const Joint* joint : joints)
    for (Body* body : {joint->a, joint->b})
      if (is_moved(body)) bodies.push_back(body);
  std::sort(bodies.begin(), bodies.end(),
            [](const Body* a, const Body* b) { return a->handle.index < b->handle.index; });
  bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
  return bodies;
}

uint32_t index_in(std::span<Body* const> bodies, const Body* body) {
  if (!is_moved(body)) return JointSystem::kDriven;
  const auto at = std::lower_bound(bodies.begin(), bodies.end(), body, [](const Body* a, const Body* b) {
    return a->handle.index < b->handle.index;
  });
  return static_cast<uint32_t>(at - bodies.begin());
}

JointSystem make_system(std::span<Body* const> bodies, std::span<Joint* const> joints, bool with_springs) {
  std::vector<JointSystem::Topology> topology;
  for (const Joint* joint : joints) {
    const uint32_t soft = with_springs && joint->has_spring() ? 3 : 0;
    topology.push_back(
        {index_in(bodies, joint->a), index_in(bodies, joint->b), constraint_count(joint->def) + soft});
  }
  return {static_cast<uint32_t>(bodies.size()), std::move(topology)};
}

LinkMotion motion_of(const RigidBody& rigid) {
  return {rigid.position, rigid.orientation.toRotationMatrix(), rigid.velocity(), rigid.angular_velocity()};
}

LinkMobility mobility_of(const RigidBody& rigid, const Mat3& axes) {
  return {1 / rigid.mass, axes * rigid.inverse_inertia * axes.transpose()};
}

Vec6 join(const Vec3& linear, const Vec3& angular) {
  Vec6 v;
  v << linear, angular;
  return v;
}

/// Whether whole turns of the bodies change the constraint of a joint.
bool is_offset_by_turns(const Joint& joint) {
  return joint.def.is_coupling() || joint.def.type == JointType::screw;
}

}  // namespace

bool counts_turns(const Joint& joint) {
  using enum JointType;
  return joint.def.type == revolute || joint.def.type == universal || joint.def.type == screw;
}

LinkMotion link_motion(const Body* body, Real time) {
  if (!body) return {};
  if (body->is_dynamic()) return motion_of(body->rigid);
  if (!body->is_kinematic())
    return {.position = body->pose.position, .axes = body->pose.orientation.toRotationMatrix()};
  const Motion m = body->def.track.at(time, body->def.pose);
  return {m.pose.position, m.pose.orientation.toRotationMatrix(), m.velocity, m.angular_velocity};
}

JointFrame link_frame(const Body* body, const JointFrame& in_body) {
  JointFrame frame = in_body;
  if (is_moved(body)) frame.point -= body->rigid.centre;
  return frame;
}

bool Joint::has_rows_besides_spring() const {
  return def.lower > -JointDef::kFree || def.upper < JointDef::kFree || def.swing < JointDef::kFree ||
         def.friction > 0 || (def.damping > 0 && !has_spring()) || def.motor.mode != Motor::Mode::none;
}

Articulation::Articulation(std::vector<Joint*> joints)
    : joints_(std::move(joints)),
      bodies_(dynamic_bodies(joints_)),
      system_(make_system(bodies_, joints_, false)) {
  for (Joint* joint : joints_) {
    joint->articulation = this;
    has_bounded_rows_ |= joint->has_bounded_rows();
    has_elastic_limits_ |= joint->def.restitution > 0;
    for (const Body* body : {joint->a, joint->b}) has_kinematic_ |= body && body->is_kinematic();
    frames_a_.push_back(link_frame(joint->a, joint->on_a));
    frames_b_.push_back(link_frame(joint->b, joint->on_b));
  }
  driven_a_.resize(joints_.size());
  driven_b_.resize(joints_.size());
  rows_.resize(joints_.size());
  motion_.resize(bodies_.size());
  mobility_.resize(bodies_.size());
  velocities_.resize(bodies_.size());
  change_.resize(joints_.size());
  impulses_.resize(joints_.size());
  if (std::ranges::any_of(joints_, &Joint::has_spring)) {
    sprung_.emplace(make_system(bodies_, joints_, true));
    sprung_rows_.resize(joints_.size());
    kick_loads_.resize(joints_.size());
  }
}

/// Returns the greatest angular frequency at which tension swings the links [1/s]. A link that a force F
/// pulls at a lever arm r swings with w^2 = F K / r, where K is its mobility at the joint, perpendicular to
/// the arm. A chain of such links swings at up to twice this frequency.
Real Articulation::greatest_frequency() const {
  Real greatest = 0;
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const Real force = joints_[j]->load.force.norm();
    const auto consider = [&](const Body* body, const JointFrame& frame) {
      if (!is_moved(body)) return;
      const Vec3& r = frame.point;
      const Mat3& I = body->rigid.inverse_inertia;
      const Real length = r.norm();
      if (length < kTogether) return;
      const Real turning = (r.squaredNorm() * I.trace() - r.dot(I * r)) / 2;
      greatest = std::max(greatest, force * (1 / body->rigid.mass + turning) / length);
    };
    consider(joints_[j]->a, frames_a_[j]);
    consider(joints_[j]->b, frames_b_[j]);
  }
  return std::sqrt(greatest);
}

/// Returns the number of kicks for which a phase stays below kKickPhase. A link of mass m in a rod under the
/// force F swings with greatest_frequency(). With the inertia that the springs add to short waves (physics
/// A8), the frequency is at most sqrt(F / 2 h sqrt(m k)).
Real Articulation::kicks_needed(Real duration) const {
  Real most = duration * greatest_frequency();
  Real sprung = 0;
  for (const Joint* joint : joints_) {
    for (const Body* body : {joint->a, joint->b}) {
      if (!is_moved(body)) continue;
      const Real inertia = std::sqrt(body->rigid.mass * joint->def.stiffness);
      if (!(inertia > 0)) return std::max(1.0, std::ceil(most / kKickPhase));
      sprung = std::max(sprung, duration * joint->load.force.norm() / (2 * inertia));
    }
  }
  return std::max(1.0, std::ceil(std::min(most, sprung) / kKickPhase));
}

void Articulation::begin_motion(Real t, Real h) {
  // This is the mean acceleration over the motion, because the velocities of kinematic links may jump at
  // keyframes.
  const auto acceleration = [&](const Body* body) -> Driven {
    if (!body || !body->is_kinematic()) return {};
    const LinkMotion before = link_motion(body, t), after = link_motion(body, t + h);
    return {(after.velocity - before.velocity) / h, (after.angular_velocity - before.angular_velocity) / h};
  };
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    driven_a_[j] = acceleration(joints_[j]->a);
    driven_b_[j] = acceleration(joints_[j]->b);
  }
}

/// Returns the place of joint j. Velocities are taken at `time` [s], and the poses of driven links at `time -
/// before`. The result refers to `motion` and, for driven links, to `still_a` and `still_b`, which this
/// function sets.
JointPlace Articulation::place_of(std::size_t j, Real time, std::span<const LinkMotion> motion,
                                  LinkMotion& still_a, LinkMotion& still_b, Real before) const {
  const auto& [a, b, count] = system_.joints()[j];
  const auto link = [&](uint32_t i, const Body* body, LinkMotion& still) -> const LinkMotion& {
    if (i != JointSystem::kDriven) return motion[i];
    still = link_motion(body, time - before);
    if (before > 0 && body && body->is_kinematic()) {
      const LinkMotion end = link_motion(body, time);
      still.velocity = end.velocity;
      still.angular_velocity = end.angular_velocity;
    }
    return still;
  };
  return {link(a, joints_[j]->a, still_a), frames_a_[j], link(b, joints_[j]->b, still_b), frames_b_[j]};
}

void Articulation::read_rows(Real time, std::span<const LinkMotion> motion, Real before) {
  LinkMotion still_a, still_b;
  for (std::size_t j = 0; j < joints_.size(); ++j)
    set_joint_rows(joints_[j]->def, place_of(j, time, motion, still_a, still_b, before), joints_[j]->length,
                   rows_[j]);
}

void Articulation::add_forces(Real t, std::span<const LinkMotion> motion,
                              std::span<const LinkMobility> mobility, std::span<Vec6> forces) {
  read_rows(t, motion);
  if (!system_.factorize(rows_, mobility)) return;  // settle() detects and counts the same failure
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    // d/dt (I w) = torque. So the angular acceleration includes the gyroscopic term.
    const Mat3& R = motion[i].axes;
    const Vec3& w = motion[i].angular_velocity;
    const Vec3 H = R * (bodies_[i]->rigid.inertia * (R.transpose() * w));
    velocities_[i] = mobility[i].velocity(forces[i] - join(Vec3::Zero(), w.cross(H)));
  }
  system_.relative(velocities_, change_);
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const auto& [a, b, count] = system_.joints()[j];
    Vec6 known = change_[j] + rows_[j].bias;
    if (a == JointSystem::kDriven)
      known += rows_[j].on_a.transpose() * join(driven_a_[j].acceleration, driven_a_[j].angular_acceleration);
    if (b == JointSystem::kDriven)
      known += rows_[j].on_b.transpose() * join(driven_b_[j].acceleration, driven_b_[j].angular_acceleration);
    change_[j] = -known;
  }
  system_.correct(change_, impulses_, velocities_);
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const auto& [a, b, count] = system_.joints()[j];
    if (a != JointSystem::kDriven) forces[a] += rows_[j].on_a * impulses_[j];
    if (b != JointSystem::kDriven) forces[b] += rows_[j].on_b * impulses_[j];
  }
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    joints_[j]->load = wrench(j, rows_[j], impulses_[j], motion);
    if (has_springs()) joints_[j]->load += kick_loads_[j];
  }
}

/// Appends the rows of springs and dampers to the constraints of read_rows(). With the speed u after a kick,
/// their torque is -k (theta + h u) - c u. As an equation for the impulse p: u + softness p = -h k theta
/// softness. A row's `error` is the present speed minus the right-hand side.
void Articulation::read_sprung_rows(Real t, Real h, std::span<const LinkMotion> motion) {
  LinkMotion still_a, still_b;
  softened_ = 1;
  sprung_rows_ = rows_;
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    if (!joints_[j]->has_spring()) continue;
    const JointDef& def = joints_[j]->def;
    const JointPlace place = place_of(j, t, motion, still_a, still_b);
    const Vec3 theta = rotation_vector(place), spin = place.a.angular_velocity - place.b.angular_velocity;
    JointRows& rows = sprung_rows_[j];
    const Real softness = 1 / (h * def.resistance(h));
    for (Eigen::Index i = 0; i < 3; ++i) {
      const Vec3 axis = place.axes_b.col(i);
      JointRow row = turning_row(axis);
      row.error = axis.dot(spin) + h * def.stiffness * theta[i] * softness;
      rows.softness[rows.count] = softness;
      rows.add(row);
    }
  }
}

/// Factorizes the system of the constraints of read_rows(), with the inertia that springs add to the links.
/// Without this inertia a projection could turn light links far against stiff springs, which would then throw
/// them back. Returns the system, or null if the constraints are too degenerate.
JointSystem* Articulation::factorize_inert(Real time) {
  if (!has_springs() || kick_duration_ == 0) return system_.factorize(rows_, mobility_) ? &system_ : nullptr;
  system_.update(rows_);
  read_sprung_rows(time, kick_duration_, motion_);
  return sprung_->factorize(sprung_rows_, mobility_) ? &*sprung_ : nullptr;
}

void Articulation::kick(Real t, Real h, std::span<const LinkMotion> motion,
                        std::span<const LinkMobility> mobility, std::span<Vec6> forces) {
  kick_duration_ = h;
  read_rows(t, motion);
  read_sprung_rows(t, h, motion);
  if (!sprung_->factorize(sprung_rows_, mobility)) return;  // settle() detects and counts the same failure
  for (std::size_t i = 0; i < bodies_.size(); ++i) velocities_[i] = h * mobility[i].velocity(forces[i]);
  std::vector<Vec6> by_forces(joints_.size());
  sprung_->relative(velocities_, by_forces);
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    // The velocities already satisfy the constraints. The errors of the constraints belong to the positions.
    change_[j] = -by_forces[j];
    for (uint32_t i = rows_[j].count; i < sprung_rows_[j].count; ++i)
      change_[j][i] -= sprung_rows_[j].error[i];
  }
  sprung_->correct(change_, impulses_, velocities_);
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const auto& [a, b, count] = sprung_->joints()[j];
    const Vec6 force = impulses_[j] / h;
    if (a != JointSystem::kDriven) forces[a] += sprung_rows_[j].on_a * force;
    if (b != JointSystem::kDriven) forces[b] += sprung_rows_[j].on_b * force;
    kick_loads_[j] = wrench(j, sprung_rows_[j], force, motion);
  }
}

/// Returns the force and torque that the rows of a joint exert on its body a. If `impulse` is an impulse, the
/// result is an impulse and an angular impulse.
Wrench Articulation::wrench(std::size_t j, const JointRows& rows, const Vec6& impulse,
                            std::span<const LinkMotion> motion) const {
  const Vec6 on_a = rows.on_a * impulse;
  const uint32_t a = system_.joints()[j].a;
  const Mat3 axes = a != JointSystem::kDriven ? motion[a].axes : link_motion(joints_[j]->a, 0).axes;
  // This is the torque of the angular constraints, without the moment of the force.
  return {on_a.head<3>(), on_a.tail<3>() - (axes * frames_a_[j].point).cross(on_a.head<3>())};
}

void Articulation::add_loads(std::span<const Vec6> impulses, Real duration) {
  const std::span<const JointRows> rows = has_springs() ? sprung_rows_ : rows_;
  for (std::size_t j = 0; j < joints_.size(); ++j)
    joints_[j]->load += wrench(j, rows[j], impulses[j] / duration, motion_);
}

void Articulation::add_impact_impulses(std::span<const Vec6> impulses) {
  for (std::size_t j = 0; j < joints_.size(); ++j)
    joints_[j]->impact_impulse += wrench(j, rows_[j], impulses[j], motion_);
}

void Articulation::begin_impulses(Real time) {
  response_time_ = time;
  is_placed_ = false;
}

Real Articulation::Stop::speed(std::span<const Vec6> velocities) const {
  return (a != JointSystem::kDriven ? on_a.dot(velocities[a]) : 0) +
         (b != JointSystem::kDriven ? on_b.dot(velocities[b]) : 0);
}

void Articulation::place_for_impulses() {
  if (std::exchange(is_placed_, true)) return;
  place(response_time_);
  link_mobility_.assign(bodies_.size(), std::nullopt);
  find_stops();
}

void Articulation::find_stops() {
  stops_.clear();
  for (uint32_t i = 0; i < bodies_.size(); ++i) bodies_[i]->row = i;
  std::vector<BoundedRow> rows;
  std::vector<BoundedOrigin> origins;
  collect_stops(*this, response_time_, rows, origins);
  for (const BoundedRow& row : rows) {
    const Real side = row.upper > 0 ? 1 : -1;
    Stop stop{row.a, row.b, side * row.on_a, side * row.on_b,
              std::vector<Vec6>(bodies_.size(), Vec6::Zero())};
    if (stop.speed(velocities_) + side * row.offset > kLeaving) continue;
    for (const auto& [link, on] : {std::pair(stop.a, &stop.on_a), std::pair(stop.b, &stop.on_b)})
      if (link != JointSystem::kDriven) stop.response[link] = mobility_[link].velocity(*on);
    pass_on(stop.response);
    stops_.push_back(std::move(stop));
  }
}

/// Completes velocity changes from impulses on single links: adds the constraint impulses that keep the
/// joints together.
void Articulation::pass_on(std::span<Vec6> velocities) {
  system_.relative(velocities, change_);
  for (Vec6& c : change_) c = -c;
  system_.correct(change_, impulses_, velocities);
}

/// Computes the velocity changes of all links due to an impulse on one link, ignoring limits.
void Articulation::find_response(uint32_t link, const Vec6& impulse) {
  response_.assign(bodies_.size(), Vec6::Zero());
  response_[link] = mobility_[link].velocity(impulse);
  pass_on(response_);
}

/// Returns the impulses of the limits that keep every joint of the response within its limits.
Eigen::VectorXd Articulation::stop_impulses() const {
  const auto n = static_cast<Eigen::Index>(stops_.size());
  Eigen::MatrixXd mobility(n, n);
  Eigen::VectorXd speed(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Stop& stop = stops_[static_cast<std::size_t>(i)];
    speed[i] = stop.speed(response_);
    for (Eigen::Index k = 0; k < n; ++k)
      mobility(i, k) = stop.speed(stops_[static_cast<std::size_t>(k)].response);
  }
  return solve_lcp((mobility + mobility.transpose()) / 2, speed).f;
}

/// Returns the stops against which a push on a link presses.
std::vector<const Articulation::Stop*> Articulation::stops_against(uint32_t link, const Vec6& push) {
  if (stops_.empty()) return {};
  find_response(link, push);
  const Eigen::VectorXd impulses = stop_impulses();
  std::vector<const Stop*> pressed;
  for (std::size_t i = 0; i < stops_.size(); ++i)
    if (impulses[static_cast<Eigen::Index>(i)] > 0) pressed.push_back(&stops_[i]);
  return pressed;
}

/// Returns the matrix that maps an impulse on a link to the impulses of stops against it.
Eigen::MatrixXd Articulation::stop_matrix(std::span<const Stop* const> pressed, uint32_t link) const {
  const auto n = static_cast<Eigen::Index>(pressed.size());
  Eigen::MatrixXd among(n, n), on_link(6, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    on_link.col(i) = pressed[static_cast<std::size_t>(i)]->response[link];
    for (Eigen::Index k = 0; k < n; ++k)
      among(i, k) =
          pressed[static_cast<std::size_t>(i)]->speed(pressed[static_cast<std::size_t>(k)]->response);
  }
  return among.ldlt().solve(on_link.transpose());
}

/// Returns the mobility of a link. Joint limits that the impulse `push` would exceed are treated as
/// constraints.
Mat6 Articulation::link_mobility(uint32_t link, const Vec6& push) {
  const std::lock_guard lock(responding_);
  place_for_impulses();
  const Mat6 free = free_mobility(link);
  const std::vector<const Stop*> pressed = stops_against(link, push);
  if (pressed.empty()) return free;
  const Eigen::MatrixXd impulses = stop_matrix(pressed, link);
  Mat6 held = Mat6::Zero();
  for (std::size_t i = 0; i < pressed.size(); ++i)
    held += pressed[i]->response[link] * impulses.row(static_cast<Eigen::Index>(i));
  return free - (held + held.transpose()) / 2;
}

std::vector<Mat6> Articulation::link_responses(uint32_t link, const Vec6& push) {
  const std::lock_guard lock(responding_);
  place_for_impulses();
  std::vector<Mat6> responses(bodies_.size());
  for (Eigen::Index k = 0; k < 6; ++k) {
    find_response(link, Vec6::Unit(k));
    for (std::size_t i = 0; i < responses.size(); ++i) responses[i].col(k) = response_[i];
  }
  const std::vector<const Stop*> pressed = stops_against(link, push);
  if (!pressed.empty()) {
    const Eigen::MatrixXd impulses = stop_matrix(pressed, link);
    for (std::size_t i = 0; i < responses.size(); ++i)
      for (std::size_t s = 0; s < pressed.size(); ++s)
        responses[i] -= pressed[s]->response[i] * impulses.row(static_cast<Eigen::Index>(s));
  }
  const Mat6 own = responses[link];
  responses[link] = (own + own.transpose()) / 2;
  return responses;
}

Mat6 Articulation::free_mobility(uint32_t link) {
  if (link_mobility_[link]) return *link_mobility_[link];
  Mat6 mobility;
  for (Eigen::Index k = 0; k < 6; ++k) {
    find_response(link, Vec6::Unit(k));
    mobility.col(k) = response_[link];
  }
  // Rounding makes the matrix slightly asymmetric, and an impulse could then add energy.
  const Mat6 symmetric = (mobility + mobility.transpose()) / 2;
  link_mobility_[link] = symmetric;
  return symmetric;
}

void Articulation::respond(uint32_t link, const Vec6& impulse, std::span<Vec6> velocities) {
  const std::lock_guard lock(responding_);
  place_for_impulses();
  find_response(link, impulse);
  const Eigen::VectorXd impulses = stop_impulses();
  for (std::size_t k = 0; k < stops_.size(); ++k)
    for (std::size_t i = 0; i < response_.size(); ++i)
      response_[i] += impulses[static_cast<Eigen::Index>(k)] * stops_[k].response[i];
  for (std::size_t i = 0; i < velocities.size(); ++i) velocities[i] += response_[i];
}

void Articulation::count_turns(Real time) {
  if (std::none_of(joints_.begin(), joints_.end(),
                   [](const Joint* j) { return counts_turns(*j) || is_offset_by_turns(*j); }))
    return;
  LinkMotion still_a, still_b;
  read_bodies();
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    Joint& joint = *joints_[j];
    if (!counts_turns(joint) && !is_offset_by_turns(joint)) continue;
    const JointPlace place = place_of(j, time, motion_, still_a, still_b);
    if (is_offset_by_turns(joint)) joint.length += turns_offset(joint.def, place, joint.length);
    if (!counts_turns(joint)) continue;
    const Real now = free_row(joint.def, place, joint.length).error;
    constexpr Real kTurn = 2 * std::numbers::pi;
    joint.coordinate = now + kTurn * std::round((joint.coordinate - now) / kTurn);
  }
}

void Articulation::read_bodies(bool at_start) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const RigidBody rigid = at_start ? bodies_[i]->at_start() : bodies_[i]->rigid;
    motion_[i] = motion_of(rigid);
    mobility_[i] = mobility_of(rigid, motion_[i].axes);
    velocities_[i] = join(motion_[i].velocity, motion_[i].angular_velocity);
  }
}

void Articulation::place(Real time, bool at_start) {
  read_bodies(at_start);
  start_motion_ = end_motion_ = motion_;
  before_ = 0;
  read_rows(time, motion_);
  system_.factorize(rows_, mobility_);
}

void Articulation::place_within(Real time, Real duration, Real fraction, Real substep) {
  read_bodies();
  start_motion_.resize(bodies_.size());
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    start_motion_[i] = motion_of(bodies_[i]->at_start());
    const Quat acting = bodies_[i]->impulse_orientation(duration, substep);
    mobility_[i] = mobility_of(bodies_[i]->rigid, acting.toRotationMatrix());
  }
  end_motion_ = motion_;
  before_ = (1 - fraction) * duration;
  for (LinkMotion& m : motion_) {
    m.position -= before_ * m.velocity;
    m.axes = rotation(m.angular_velocity, -before_).toRotationMatrix() * m.axes;
  }
  read_rows(time, motion_, before_);
  system_.factorize(rows_, mobility_);
  if (!has_springs()) return;
  read_sprung_rows(time, duration, motion_);
  sprung_->factorize(sprung_rows_, mobility_);
}

Real Articulation::mobility(const Joint& joint, const JointRow& row) {
  std::fill(velocities_.begin(), velocities_.end(), Vec6::Zero());
  const uint32_t a = index_in(bodies_, joint.a), b = index_in(bodies_, joint.b);
  if (a != JointSystem::kDriven) velocities_[a] += mobility_[a].velocity(row.on_a);
  if (b != JointSystem::kDriven) velocities_[b] += mobility_[b].velocity(row.on_b);
  system_.relative(velocities_, change_);
  for (Vec6& c : change_) c = -c;
  system_.correct(change_, impulses_, velocities_);
  Real result = 0;
  if (a != JointSystem::kDriven) result += row.on_a.dot(velocities_[a]);
  if (b != JointSystem::kDriven) result += row.on_b.dot(velocities_[b]);
  return result;
}

void Articulation::strike(Joint& joint, const JointRow& row, const Vec3& arm, Real impulse) {
  mobility(joint, row);  // leaves the responses to a unit impulse in velocities_ and impulses_
  for (std::size_t k = 0; k < bodies_.size(); ++k) {
    const Twist& twist = bodies_[k]->start_twist;
    bodies_[k]->set_start_velocity(twist.velocity + impulse * velocities_[k].head<3>(),
                                   twist.angular_velocity + impulse * velocities_[k].tail<3>());
  }
  for (Vec6& p : impulses_) p *= impulse;
  add_impact_impulses(impulses_);
  const Vec6 on_a = impulse * row.on_a;
  joint.impact_impulse += Wrench{on_a.head<3>(), on_a.tail<3>() - arm.cross(on_a.head<3>())};
}

bool Articulation::soften(Real factor) {
  if (!has_springs() || factor == softened_) return false;
  for (JointRows& rows : sprung_rows_) rows.softness *= factor / softened_;
  softened_ = factor;
  sprung_->factorize(sprung_rows_, mobility_);
  return true;
}

void Articulation::project(Real time, std::span<Vec6> velocities) {
  residual(time, velocities, change_);
  for (Vec6& c : change_) c = -c;
  system_.correct(change_, impulses_, velocities);
}

/// Computes J v, including the velocities of driven links.
void Articulation::residual(Real time, std::span<const Vec6> velocities, std::span<Vec6> result) const {
  system_.relative(velocities, result);
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    const auto& [a, b, count] = system_.joints()[j];
    const auto add = [&](const Body* body, const Mat6& on) {
      if (!body || !body->is_kinematic()) return;
      const LinkMotion m = link_motion(body, time);
      result[j] += on.transpose() * join(m.velocity, m.angular_velocity);
    };
    if (a == JointSystem::kDriven) add(joints_[j]->a, system_.rows()[j].on_a);
    if (b == JointSystem::kDriven) add(joints_[j]->b, system_.rows()[j].on_b);
  }
}

void Articulation::transmit_impulses(Real time, JointFigures& tally) {
  const bool is_settled =
      std::equal(bodies_.begin(), bodies_.end(), settled_.begin(), settled_.end(),
                 [](const Body* body, const Momenta& m) {
                   return body->rigid.momentum == m.linear && body->rigid.angular_momentum == m.angular;
                 });
  if (is_settled && !has_kinematic_) return;
  Real fastest = 0;
  read_bodies();
  read_rows(time, motion_);
  system_.update(rows_);
  residual(time, velocities_, change_);
  for (const Vec6& c : change_) fastest = std::max(fastest, c.cwiseAbs().maxCoeff());
  if (fastest > kDisturbed) settle(time, tally);
}

void Articulation::settle(Real time, JointFigures& tally) {
  Real apart = 0;
  JointSystem* system = nullptr;
  std::vector<Pose> before(bodies_.size());  // poses of the centres of mass
  for (int step = 0; step < kMostSteps; ++step) {
    read_bodies();
    read_rows(time, motion_);
    Real now = 0;
    for (const JointRows& rows : rows_) now = std::max(now, rows.error.cwiseAbs().maxCoeff());
    // One factorization serves for all small corrections.
    if (step > 0 && now <= kSmall) {
      system_.update(rows_);
      if (system != &system_) {
        read_sprung_rows(time, kick_duration_, motion_);
        system->update(sprung_rows_);
      }
    } else if (system = factorize_inert(time); !system) {
      ++tally.unsolved;
      return;
    }
    // Near singular poses Newton's method may diverge: if the error has grown, the previous poses are
    // restored.
    if (step > 0 && now > apart) {
      for (std::size_t i = 0; i < bodies_.size(); ++i) {
        bodies_[i]->rigid.position = before[i].position;
        bodies_[i]->rigid.orientation = before[i].orientation;
        bodies_[i]->rigid.set_velocity(motion_[i].velocity, motion_[i].angular_velocity);
      }
      break;
    }
    const bool is_slow = step > 0 && now > 0.5 * apart;
    apart = now;
    if (now <= kTogether || is_slow) break;
    for (std::size_t i = 0; i < bodies_.size(); ++i)
      before[i] = {bodies_[i]->rigid.position, bodies_[i]->rigid.orientation};
    for (std::size_t j = 0; j < joints_.size(); ++j)
      change_[j] = -rows_[j].error * std::min(1.0, kFarApart / std::max(now, kTogether));
    std::vector<Vec6> shift(bodies_.size(), Vec6::Zero());
    system->correct(change_, impulses_, shift);
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      RigidBody& r = bodies_[i]->rigid;
      const Vec3 w = r.angular_velocity();
      r.position += shift[i].head<3>();
      r.orientation = (rotation(shift[i].tail<3>(), 1) * r.orientation).normalized();
      r.set_velocity(r.velocity(), w);
    }
  }
  tally.error = std::max(tally.error, apart);
  if (apart > kSmall) ++tally.unsolved;
  read_bodies();
  for (int k = 0; k < kVelocitySteps; ++k) {
    residual(time, velocities_, change_);
    Real fastest = 0;
    for (Vec6& c : change_) {
      fastest = std::max(fastest, c.cwiseAbs().maxCoeff());
      c = -c;
    }
    if (fastest <= kTogether) break;
    system->correct(change_, impulses_, velocities_);
    add_impact_impulses(impulses_);
  }
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    bodies_[i]->rigid.set_velocity(velocities_[i].head<3>(), velocities_[i].tail<3>());
  settled_.clear();
  for (const Body* body : bodies_) settled_.push_back({body->rigid.momentum, body->rigid.angular_momentum});
}

}  // namespace offstage::sim
