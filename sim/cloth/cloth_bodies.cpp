#include "sim/cloth/cloth_bodies.h"

#include <utility>

namespace offstage::sim {
namespace {

/// Joints permit no motion with a mobility below this fraction of the greatest one.
constexpr Real kSingular = 1e-9;
/// A body whose velocity changes by up to twice this in a sub-step of the world may accelerate steadily
/// [m/s].
constexpr Real kSmoothChange = 0.25;

/// Adds the mass matrix of a point mass at the lever arm `arm`.
void add_point_mass(Real mass, const Vec3& arm, Mat6& matrix) {
  const Mat3 cross = cross_matrix(arm);
  matrix.topLeftCorner<3, 3>().diagonal().array() += mass;
  matrix.topRightCorner<3, 3>() -= mass * cross;
  matrix.bottomLeftCorner<3, 3>() += mass * cross;
  matrix.bottomRightCorner<3, 3>() -= mass * cross * cross;
}

Vec6 momentum_of(const Reaction& r) {
  return stacked(r.impulse, r.angular_impulse);
}

}  // namespace

ClothBody::ClothBody(const Obstacle& obstacle, Real h, const Vec3& velocity, const Vec3& angular_velocity)
    : obstacle_(obstacle),
      h_(h),
      velocity_(velocity),
      angular_velocity_(angular_velocity),
      reaction_{obstacle.body, Vec3::Zero(), Vec3::Zero()} {}

void ClothBody::accelerate_steadily(const Vec3& gravity) {
  const Vec3 mean =
      (obstacle_.end.point_to_world(obstacle_.centre) - obstacle_.start.point_to_world(obstacle_.centre)) /
      h_;
  const Vec3 bow = (velocity_ - mean) * h_;
  const Vec3 turn_bow = (angular_velocity_ - obstacle_.angular_velocity) * h_;
  // A greater deviation is due to an impact; the path then stays a line.
  const Real most = h_ * std::max(gravity.norm() * h_, kSmoothChange);
  const bool moves_smoothly = bow.norm() <= most, turns_smoothly = turn_bow.norm() * obstacle_.extent <= most;
  if (moves_smoothly) bow_ = bow;
  if (turns_smoothly) turn_bow_ = turn_bow;
  is_steady_ = moves_smoothly && turns_smoothly;
}

/// Returns the pose on the path that the world computed, without displacement by cloth.
Pose ClothBody::on_path(Real fraction) const {
  const Real sag = fraction * (1 - fraction);
  const Pose pose = obstacle_.turned_at(fraction);
  if (turn_bow_.isZero(0)) return {pose.position - sag * bow_, pose.orientation};
  return displaced(pose, obstacle_.centre, -sag * bow_, -sag * turn_bow_);
}

Pose ClothBody::predicted(Real fraction) const {
  return displaced(on_path(fraction), obstacle_.centre, shift_, turn_);
}

void ClothBody::begin(Real from, Real to, Real dt) {
  start_ = from > 0 ? end_ : predicted(from);
  shift_ += dt * gained_;
  turn_ += dt * gained_spin_;
  moved_by_others_ += dt * gained_by_others_;
  const Vec6 rate = 2 / h_ * stacked(bow_, turn_bow_);
  steady_change_ = (to - from) * rate;
  left_ = (1 - to) * rate;
  dt_ = dt;
  to_ = to;
  move_end();
  is_still_ = start_.position == end_.position && start_.orientation.coeffs() == end_.orientation.coeffs() &&
              obstacle_.angular_velocity == Vec3::Zero() && obstacle_.surface_velocity == Vec3::Zero();
}

void ClothBody::take_back_contained() {
  lead_ = {};
  take_back(std::exchange(unreturned_lead_, {}), dt_);
  const Wrench share = dt_ / h_ * expected_;
  take_back(share, dt_ / 2);
  if (!is_steady_ || is_zero(share)) return;
  steady_change_ -= free_change(share.force, share.torque);
  for (const Connected& c : connected_) c.body->steady_change_ -= c.response * stacked(share);
}

/// Takes back an impulse that the path contains, and the displacement by it in `displacing_time` [s].
void ClothBody::take_back(const Wrench& impulse, Real displacing_time) {
  if (is_zero(impulse)) return;
  const Vec6 change = -free_change(impulse.force, impulse.torque);
  take(change, -stacked(impulse));
  shift_ += displacing_time * change.head<3>();
  turn_ += displacing_time * change.tail<3>();
  move_end();
  displace_connected(-displacing_time * stacked(impulse));
}

Wrench ClothBody::contained() const {
  Wrench sum = expected_;
  return sum += given_lead_;
}

Vec3 ClothBody::rigid_move(const Vec3& p) const {
  return end_.point_to_world(start_.point_to_body(p)) - p;
}

Vec3 ClothBody::surface_motion(const Vec3& p, const Vec3& n) const {
  if (is_still_ && !is_dynamic()) return Vec3::Zero();
  return p - start_.point_to_world(end_.point_to_body(p)) + dt_ * obstacle_.conveying_velocity(n, 1);
}

Real ClothBody::mobility(const Vec3& p, const Vec3& n) const {
  if (!is_dynamic()) return 0;
  const Vec3 turning = (p - centre_).cross(n);
  if (resting_.empty() && !jointed_)
    return obstacle_.inverse_mass + turning.dot(obstacle_.inverse_inertia * turning);
  const Vec6 push = stacked(n, turning), response = free_change(n, turning);
  return resting_.empty() ? std::max(push.dot(response), 0.0) : resting_.mobility(gained(), -push, -response);
}

void ClothBody::apply_impulse(const Vec3& impulse, const Vec3& p) {
  touched = true;
  if (!is_dynamic()) return;
  const Vec3 turning = (p - centre_).cross(impulse);
  add_impulse((Vec6() << impulse, turning).finished());
}

Vec6 ClothBody::free_change(const Vec3& impulse, const Vec3& angular) const {
  if (jointed_) return *jointed_ * stacked(impulse, angular);
  return (Vec6() << obstacle_.inverse_mass * impulse, obstacle_.inverse_inertia * angular).finished();
}

/// Returns the change of the velocities that the contacts with other bodies permit. `free_change`: the change
/// without these contacts. Their impulses are added to `impulse`.
Vec6 ClothBody::respond(RestingContacts& contacts, const Vec6& free_change, Vec6& impulse) const {
  if (contacts.empty()) return free_change;
  Vec6 after = gained() + free_change;
  impulse += contacts.respond(after);
  return after - gained();
}

/// Applies an impulse and an angular impulse about centre() to a body without pinned points.
void ClothBody::add_impulse(Vec6 impulse) {
  const Vec6 change = respond(resting_, free_change(impulse.head<3>(), impulse.tail<3>()), impulse);
  take(change, impulse);
}

/// Returns an impulse and angular impulse times the time that displaces a body with joints in this way.
Vec6 ClothBody::impulse_for(const Vec6& displacement) const {
  // Joints make the mobility singular. Impulses in its null space do not move the other bodies either.
  Eigen::CompleteOrthogonalDecomposition<Mat6> mobility;
  mobility.setThreshold(kSingular);
  return mobility.compute(*jointed_).solve(displacement);
}

/// Displaces the bodies to which joints connect this one. `impulse`: impulse and angular impulse times the
/// time.
void ClothBody::displace_connected(const Vec6& impulse) {
  for (const Connected& c : connected_) {
    const Vec6 moved = c.response * impulse;
    c.body->moved_by_others_ += moved;
    c.body->shift_ += moved.head<3>();
    c.body->turn_ += moved.tail<3>();
    c.body->move_end();
  }
}

Pose ClothBody::own_end() const {
  if (moved_by_others_.isZero(0)) return end_;
  return displaced(end_, obstacle_.centre, -moved_by_others_.head<3>(), -moved_by_others_.tail<3>());
}

/// Updates the pose at the end of the cloth's sub-step.
void ClothBody::move_end() {
  end_ = predicted(to_);
  centre_ = end_.point_to_world(obstacle_.centre);
}

void ClothBody::record_pin_impulse(const Vec3& impulse, const Vec3& p) {
  if (!pin_load_) pin_load_ = Reaction{obstacle_.body, Vec3::Zero(), Vec3::Zero()};
  pin_load_->impulse += impulse;
  pin_load_->angular_impulse += (p - centre_).cross(impulse);
}

void ClothBody::apply_contact_impulse(const Vec3& impulse, const Vec3& p, Real fraction) {
  const Vec3 gained = gained_, gained_spin = gained_spin_;
  const Reaction before = reaction_;
  apply_impulse(impulse, p);
  if (!is_dynamic()) return;
  shift_ += fraction * dt_ * (gained_ - gained);
  turn_ += fraction * dt_ * (gained_spin_ - gained_spin);
  end_ = predicted(to_);
  displace_connected(fraction * dt_ * (momentum_of(reaction_) - momentum_of(before)));
}

void ClothBody::apply_impulses(const Vec6& impulse, const Vec6& displacement) {
  touched = true;
  add_impulse(impulse);
  shift_ += displacement.head<3>();
  turn_ += displacement.tail<3>();
  end_ = predicted(to_);
  if (!connected_.empty()) displace_connected(impulse_for(displacement));
}

Mat6 ClothBody::free_mobility() const {
  return jointed_ ? *jointed_ : sim::free_mobility(obstacle_.inverse_mass, obstacle_.inverse_inertia);
}

/// Returns the mobility of a body without contacts and of points that it carries.
Mat6 ClothBody::carrying_mobility(const Mat6& carried) const {
  const Mat6 own = free_mobility();
  return (Mat6::Identity() + own * carried).partialPivLu().solve(own);
}

Mat6 ClothBody::mobility(const Mat6& carried) const {
  const Mat6 whole = carrying_mobility(carried);
  return resting_.empty() ? whole : resting_.held_mobility(whole);
}

Vec6 ClothBody::apply_pin_impulses(const Vec6& impulse, const Vec6& moving, const Mat6& carried) {
  const Mat6 whole = carrying_mobility(carried);
  touched = true;
  resting_.set_mobility(whole);
  // The contacts hold the body against the displacement, too, and by friction as well.
  RestingContacts holding = resting_;
  Vec6 of_displacement = moving, own = impulse;
  const Vec6 shift = dt_ * respond(holding, whole * moving, of_displacement);
  const Vec6 change = respond(resting_, whole * impulse, own);
  take(change, own - carried * change);
  resting_.set_mobility(free_mobility());
  shift_ += shift.head<3>();
  turn_ += shift.tail<3>();
  end_ = displaced(end_, obstacle_.centre, shift.head<3>(), shift.tail<3>());
  centre_ = end_.point_to_world(obstacle_.centre);
  displace_connected(dt_ * of_displacement - carried * shift);
  return change;
}

void ClothBody::set_lead(const Vec6& impulse, const Mat6& carried) {
  const Vec6 own = impulse - carried * carrying_mobility(carried) * impulse;
  lead_ = {own.head<3>(), own.tail<3>()};
}

/// Changes the velocities by `change`, and the momenta of the body by `impulse`.
void ClothBody::take(const Vec6& change, const Vec6& impulse) {
  reaction_.impulse += impulse.head<3>();
  reaction_.angular_impulse += impulse.tail<3>();
  accelerate(change.head<3>(), change.tail<3>());
  for (const Connected& c : connected_) {
    const Vec6 gained = c.response * impulse;
    c.body->gained_by_others_ += gained;
    c.body->accelerate(gained.head<3>(), gained.tail<3>());
  }
}

void ClothBody::accelerate(const Vec3& dv, const Vec3& dw) {
  velocity_ += dv;
  angular_velocity_ += dw;
  gained_ += dv;
  gained_spin_ += dw;
}

Vec3 ClothBody::shorten(Real fraction, const Vec3& drift) {
  const Vec3 displacement = move() - drift;
  const Quat turned = end_.orientation * start_.orientation.conjugate();
  const Vec3 turn = 2 * (turned.w() < 0 ? -1 : 1) * turned.vec();  // for a small rotation
  const Vec3 lost = (1 - fraction) * displacement, lost_turn = (1 - fraction) * turn;
  shift_ -= lost;
  turn_ -= lost_turn;
  end_ = displaced(start_, obstacle_.centre, drift + fraction * displacement, fraction * turn);
  centre_ = end_.point_to_world(obstacle_.centre);
  touched = true;
  const Vec6 change = -stacked(lost, lost_turn) / dt_;
  const Vec6 impulse = jointed_ ? impulse_for(change)
                                : stacked(change.head<3>() / obstacle_.inverse_mass,
                                          obstacle_.inverse_inertia.inverse() * change.tail<3>());
  take(change, impulse);
  displace_connected(dt_ * impulse);
  return change.head<3>();
}

Mat6 Carrier::carried(const ClothPoints& cloth, const Vec3& centre) const {
  Mat6 matrix = Mat6::Zero();
  for (uint32_t i : points) add_point_mass(cloth.mass[i], cloth.at(i) - centre, matrix);
  return matrix;
}

void Carrier::apply_loads(const Vec6& impulse, const Vec6& moving, ClothPoints& cloth) const {
  const Mat6 mass = carried(cloth);
  // A constant force displaces the body by half of its impulse.
  body->set_lead(moving - impulse / 2, mass);
  apply_impulses(impulse, moving, mass, cloth);
}

void Carrier::apply_impulses(const Vec6& impulse, const Vec6& moving, const Mat6& mass,
                             ClothPoints& cloth) const {
  const Vec3 centre = body->centre();  // before it moves
  const Vec6 change = body->apply_pin_impulses(impulse, moving, mass);
  for (uint32_t i : points)
    cloth.velocity[i] += padded(change.head<3>() + change.tail<3>().cross(cloth.at(i) - centre));
  place(cloth);
}

void Carrier::accelerate_whole(const Vec3& gain, ClothPoints& cloth) const {
  const Vec3 before = body->velocity(body->centre());
  body->apply_impulse(body->mass() * gain, body->centre());
  // Joints may resist the impulse.
  accelerate(body->is_jointed() ? Vec3(body->velocity(body->centre()) - before) : gain, cloth);
}

void Carrier::accelerate(const Vec3& dv, ClothPoints& cloth) const {
  for (uint32_t i : points) cloth.velocity[i] += padded(dv);
}

void Carrier::place(ClothPoints& cloth) const {
  for (std::size_t k = 0; k < points.size(); ++k)
    cloth.position[points[k]] = padded(body->end().point_to_world(places[k]));
}

}  // namespace offstage::sim
