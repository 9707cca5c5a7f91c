#include "sim/contact/relaxed_joints.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/contact/relaxation.h"

namespace offstage::sim {
namespace {

/// If the number of rows times the number of links is above this, the responses of all links are not stored.
constexpr std::size_t kMostResponses = 20000;
/// Joints that leave less than this fraction of its mobility to a row hold the row's bodies fast.
constexpr Real kHeldFast = 1e-9;
/// Fraction of the interval. A row that acts only from the interval's end on acts in its last sub-step.
constexpr Real kInstant = 1e-9;
/// The contacts of an articulation depend on each other. Passes over them end when none changes a velocity by
/// more than kSettled [m/s].
constexpr int kContactPasses = 30;
constexpr Real kSettled = 1e-3;
/// A contact of a link that approaches faster than this after the joints were solved is stopped [m/s].
constexpr Real kApproach = 0.1;

Vec6 twist(const FloatLanes& lanes) {
  Vec6 v;
  for (unsigned i = 0; i < 3; ++i) {
    v[i] = lanes[i];
    v[i + 3] = lanes[i + 4];
  }
  return v;
}

/// Returns the change of a body's velocity since the start of the step.
Vec6 change_of(const BodyMotion& m) {
  return twist(m.velocity);
}

Vec6 velocity_of(const RelaxedBody& b, const BodyMotion& m) {
  Vec6 v;
  v << b.velocity, b.angular_velocity;
  return v + change_of(m);
}

FloatLanes lanes(const Vec6& v) {
  const Eigen::Matrix<float, 6, 1> f = v.cast<float>();
  return FloatLanes{f[0], f[1], f[2], 0, f[3], f[4], f[5], 0};
}

void add_to(BodyMotion& m, const Vec6& v) {
  m.velocity += lanes(v);
}

/// Returns the change of a body's velocity since the start of the step, without contacts and rows with
/// bounds.
Vec6 free_change(const RelaxedBody& b, Real elapsed) {
  Vec6 v;
  v << b.free_acceleration, b.free_angular_acceleration;
  return elapsed * v;
}

}  // namespace

RelaxedJoints::RelaxedJoints(const JointProblem& problem, std::span<Articulation* const> articulations,
                             std::span<const uint32_t> bounded_ends, std::span<LinkContact> contacts)
    : problem_(problem), contacts_(contacts), rows_(problem.bounded.size()), contact_rows_(contacts.size()) {
  uint32_t constraint = 0, row = 0, contact = 0;
  for (std::size_t i = 0; i < articulations.size(); ++i) {
    Part part{.articulation = articulations[i],
              .first_constraint = constraint,
              .first_row = row,
              .last_row = bounded_ends[i],
              .first_contact = contact};
    while (contact < contacts.size() && contacts[contact].part == i) ++contact;
    part.last_contact = contact;
    for (const Body* body : articulations[i]->bodies()) part.bodies.push_back(body->row);
    const std::size_t links = part.bodies.size(), joints = articulations[i]->joints().size();
    part.velocities.resize(links);
    part.change.resize(joints);
    part.impulses.resize(joints);
    part.now.assign(joints, Vec6::Zero());
    part.sum.assign(joints, Vec6::Zero());
    part.shift.assign(joints, Vec6::Zero());
    parts_.push_back(std::move(part));
    constraint += static_cast<uint32_t>(joints);
    row = bounded_ends[i];
  }
}

void RelaxedJoints::begin(std::span<const RelaxedBody> bodies, Real duration, uint32_t substeps) {
  bodies_ = bodies;
  duration_ = duration;
  substep_ = duration / substeps;
  const Real fraction = 1.0 / substeps;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const BoundedRow& r = problem_.bounded[i];
    rows_[i].impulse = fraction * r.impulse;
    rows_[i].lower = fraction * r.lower;
    rows_[i].upper = fraction * r.upper;
    rows_[i].softness = r.softness / fraction;
  }
  for (Part& part : parts_) prepare(part, bodies);
}

void RelaxedJoints::prepare(Part& part, std::span<const RelaxedBody> bodies) {
  const std::size_t rows = part.last_row - part.first_row;
  const bool whole = part.bodies.size() * rows <= kMostResponses;
  for (uint32_t i = part.first_row; i < part.last_row; ++i)
    prepare_row(part, problem_.bounded[i], rows_[i], bodies, whole);
}

/// Applies the softness of the rows of springs, which oppose the change of their speeds since the step's
/// start. With steady forces this change grows in proportion to the time, and the impulses of the sub-steps
/// are equal. So the softness times the sum of all impulses is the change in each sub-step.
void RelaxedJoints::soften(Part& part, Real elapsed) {
  const Real substeps = std::max(1.0, std::round(elapsed / substep_));
  if (!part.articulation->soften(substeps)) return;
  for (uint32_t i = part.first_row; i < part.last_row; ++i)
    prepare_row(part, problem_.bounded[i], rows_[i], bodies_, true);
  part.prepared = 0;
  for (uint32_t i = part.first_contact; i < part.last_contact; ++i) contact_rows_[i].is_ready = false;
}

/// Prepares a row of a part. `whole`: whether the response of the whole articulation is computed, or only the
/// response of the row's bodies.
void RelaxedJoints::prepare_row(Part& part, const BoundedRow& r, Row& row,
                                std::span<const RelaxedBody> bodies, bool whole) {
  const auto response = [&](uint32_t body, const Vec6& on) -> Vec6 {
    if (body == kUnmoved) return Vec6::Zero();
    return LinkMobility{bodies[body].inverse_mass, bodies[body].inverse_inertia}.velocity(on);
  };
  row.response_a = response(r.a, r.on_a);
  row.response_b = response(r.b, r.on_b);
  const std::size_t links = part.bodies.size();
  const Real alone = r.on_a.dot(row.response_a) + r.on_b.dot(row.response_b);
  Real mobility = alone;
  if (whole) {
    row.response.assign(links, Vec6::Zero());
    bool has_a = false, has_b = false;
    for (std::size_t k = 0; k < links; ++k) {
      if (part.bodies[k] == r.a) row.response[k] = row.response_a, has_a = true;
      if (part.bodies[k] == r.b) row.response[k] = row.response_b, has_b = true;
    }
    JointSystem& system = part.articulation->inert_system();
    system.relative(row.response, part.change);
    for (Vec6& c : part.change) c = -c;
    system.correct(part.change, part.impulses, row.response);
    row.reaction = part.impulses;
    // Bodies outside the articulation respond on their own.
    if (has_a) row.response_a.setZero();
    if (has_b) row.response_b.setZero();
    mobility = r.on_a.dot(row.response_a) + r.on_b.dot(row.response_b);
    for (std::size_t k = 0; k < links; ++k) {
      if (part.bodies[k] == r.a) mobility += r.on_a.dot(row.response[k]);
      if (part.bodies[k] == r.b) mobility += r.on_b.dot(row.response[k]);
    }
  }
  // Joints may hold the bodies fast: what is left of the mobility is then rounding.
  if (mobility < kHeldFast * alone) mobility = 0;
  const Real stiffness = mobility + row.softness;
  row.inverse_stiffness = stiffness > 1e-300 ? 1 / stiffness : 0;
}

void RelaxedJoints::push(Part& part, const BoundedRow& r, const Row& row, Real impulse,
                         std::span<BodyMotion> motions) const {
  for (std::size_t k = 0; k < row.response.size(); ++k)
    add_to(motions[part.bodies[k]], impulse * row.response[k]);
  if (!row.response.empty())
    for (std::size_t j = 0; j < part.now.size(); ++j) part.now[j] += impulse * row.reaction[j];
  if (r.a != kUnmoved) add_to(motions[r.a], impulse * row.response_a);
  if (r.b != kUnmoved) add_to(motions[r.b], impulse * row.response_b);
}

/// Returns the change of a row's speed since the start of the step.
Real RelaxedJoints::speed_change(const BoundedRow& r, std::span<const BodyMotion> motions) {
  Real change = 0;
  if (r.a != kUnmoved) change += r.on_a.dot(change_of(motions[r.a]));
  if (r.b != kUnmoved) change += r.on_b.dot(change_of(motions[r.b]));
  return change;
}

Real RelaxedJoints::speed(const BoundedRow& r, std::span<const BodyMotion> motions) const {
  Real u = r.offset;
  if (r.a != kUnmoved) u += r.on_a.dot(velocity_of(bodies_[r.a], motions[r.a]));
  if (r.b != kUnmoved) u += r.on_b.dot(velocity_of(bodies_[r.b], motions[r.b]));
  return u;
}

void RelaxedJoints::start(uint32_t p, std::span<BodyMotion> motions) {
  Part& part = parts_[p];
  soften(part, substep_);
  for (uint32_t i = part.first_row; i < part.last_row; ++i)
    if (rows_[i].impulse != 0) push(part, problem_.bounded[i], rows_[i], rows_[i].impulse, motions);
  // The contacts have given their initial forces to single links. Without the reactions of the joints, the
  // first sweep would take a light link that carries a heavy body to fly off, and would undo these forces.
  if (part.first_contact == part.last_contact) return;
  join(part, motions, substep_);
  for (std::size_t j = 0; j < part.now.size(); ++j) part.now[j] += part.impulses[j];
}

/// Changes the velocities of the links so that they satisfy the joints at the time `elapsed` [s].
void RelaxedJoints::join(Part& part, std::span<BodyMotion> motions, Real elapsed) {
  JointSystem& system = part.articulation->inert_system();
  for (std::size_t k = 0; k < part.bodies.size(); ++k)
    part.velocities[k] = change_of(motions[part.bodies[k]]) - free_change(bodies_[part.bodies[k]], elapsed);
  system.relative(part.velocities, part.change);
  for (std::size_t j = 0; j < part.change.size(); ++j)
    part.change[j] = -part.change[j] - system.rows()[j].softness.cwiseProduct(part.now[j]);
  std::vector<Vec6>& correction = part.velocities;
  std::fill(correction.begin(), correction.end(), Vec6::Zero());
  system.correct(part.change, part.impulses, correction);
  for (std::size_t k = 0; k < part.bodies.size(); ++k) add_to(motions[part.bodies[k]], correction[k]);
}

void RelaxedJoints::solve(uint32_t p, std::span<BodyMotion> motions, Real elapsed, bool is_last) {
  Part& part = parts_[p];
  soften(part, elapsed);
  join(part, motions, elapsed);
  // The next sub-step starts with the velocities of this one, including the impulses. After the last sub-step
  // there is no next one.
  if (is_last) std::fill(part.now.begin(), part.now.end(), Vec6::Zero());
  for (std::size_t j = 0; j < part.now.size(); ++j) part.now[j] += part.impulses[j];

  for (uint32_t i = part.first_row; i < part.last_row; ++i) {
    const BoundedRow& r = problem_.bounded[i];
    Row& row = rows_[i];
    row.acts |= elapsed > (r.from - kInstant) * duration_;
    if (!row.acts) continue;
    if (!is_last) row.before = std::exchange(row.after, 0);
    const Real u = speed(r, motions) + (1 - elapsed / duration_) * r.turning;
    const Real target = r.target - r.lag * row.before;
    const Real wanted = row.impulse - (u - target + row.softness * row.impulse) * row.inverse_stiffness;
    const Real next = std::clamp(wanted, row.lower, row.upper);
    push(part, r, row, next - row.impulse, motions);
    row.sum += is_last ? next - row.impulse : next;
    row.impulse = next;
  }
  solve_contacts(part, motions, elapsed, is_last);
  for (std::size_t j = 0; j < part.sum.size(); ++j) part.sum[j] += part.now[j];
  if (is_last) return;
  for (uint32_t i = part.first_row; i < part.last_row; ++i) {
    rows_[i].shift += substep_ * rows_[i].sum;
    if (problem_.bounded[i].lag != 0) rows_[i].after = speed_change(problem_.bounded[i], motions);
  }
  for (uint32_t i = part.first_contact; i < part.last_contact; ++i)
    contact_rows_[i].shift += substep_ * contact_rows_[i].sum;
  for (std::size_t j = 0; j < part.sum.size(); ++j) part.shift[j] += substep_ * part.sum[j];
}

/// Limits the approach of the links' contacts to the speed that closes their gaps in the sub-step.
void RelaxedJoints::solve_contacts(Part& part, std::span<BodyMotion> motions, Real elapsed, bool is_last) {
  const Real before = is_last ? elapsed : elapsed - substep_;
  Real change = 0;
  const auto solve_one = [&](uint32_t i) {
    const BoundedRow& r = contacts_[i].row;
    Row& row = contact_rows_[i];
    Real gap = contacts_[i].separation;
    for (const auto& [body, on] : {std::pair(r.a, &r.on_a), std::pair(r.b, &r.on_b)}) {
      Vec6 v;
      v << bodies_[body].velocity, bodies_[body].angular_velocity;
      gap += on->dot(before * v + twist(motions[body].shift));
    }
    const Real target = -std::max(0.0, gap) / substep_, u = speed(r, motions);
    if (row.impulse == 0 && u > target - kApproach) return;
    if (!std::exchange(row.is_ready, true))
      prepare_row(part, r, row, bodies_, part.bodies.size() * ++part.prepared <= kMostResponses);
    const Real next = std::max(0.0, row.impulse - (u - target) * row.inverse_stiffness);
    if (next == row.impulse) return;
    change = std::max(change, std::abs(u - target));
    push(part, r, row, next - row.impulse, motions);
    row.sum += next - row.impulse;
    row.impulse = next;
  };
  for (uint32_t i = part.first_contact; i < part.last_contact; ++i)
    if (!is_last) contact_rows_[i].sum += contact_rows_[i].impulse;
  for (int pass = 0; pass < kContactPasses; ++pass) {
    change = 0;
    for (uint32_t i = part.first_contact; i < part.last_contact; ++i) solve_one(i);
    if (change < kSettled) break;
  }
}

void RelaxedJoints::begin_push(uint32_t p, std::span<const BodyMotion> motions) {
  Part& part = parts_[p];
  part.before_push.clear();
  part.pushed.assign(part.bodies.size(), Vec6::Zero());
  for (const uint32_t body : part.bodies) part.before_push.push_back(motions[body].shift);
}

Real RelaxedJoints::push_out(uint32_t p, std::span<BodyMotion> motions) {
  Part& part = parts_[p];
  JointSystem& system = part.articulation->inert_system();
  for (std::size_t k = 0; k < part.bodies.size(); ++k)
    part.velocities[k] = twist(motions[part.bodies[k]].shift - part.before_push[k]);
  system.relative(part.velocities, part.change);
  for (Vec6& c : part.change) c = -c;
  std::vector<Vec6>& correction = part.velocities;
  std::fill(correction.begin(), correction.end(), Vec6::Zero());
  system.correct(part.change, part.impulses, correction);
  Real farthest = 0;
  for (std::size_t k = 0; k < part.bodies.size(); ++k) {
    motions[part.bodies[k]].shift += lanes(correction[k]);
    farthest = std::max(farthest, correction[k].head<3>().norm());
    part.pushed[k] = twist(motions[part.bodies[k]].shift - part.before_push[k]);
  }
  for (std::size_t j = 0; j < part.shift.size(); ++j) part.shift[j] += part.impulses[j];
  return farthest;
}

void RelaxedJoints::add_motion(std::span<RelaxedBody> bodies, std::span<const Real> late) const {
  const auto to = [&](uint32_t body, const Vec6& impulse, const Vec6& shift) {
    if (body == kUnmoved || bodies[body].inverse_mass == 0) return;
    RelaxedBody& b = bodies[body];
    const Vec6 way = shift - late[body] * impulse;
    b.impulse += impulse.head<3>();
    b.angular_impulse += impulse.tail<3>();
    b.velocity += b.inverse_mass * impulse.head<3>();
    b.angular_velocity += b.inverse_inertia * impulse.tail<3>();
    b.displacement += b.inverse_mass * way.head<3>();
    b.rotation_vector += b.inverse_inertia * way.tail<3>();
  };
  for (const Part& part : parts_) {
    for (std::size_t j = 0; j < part.sum.size(); ++j) {
      const JointConstraint& c = problem_.constraints[part.first_constraint + j];
      to(c.a, c.rows->on_a * part.sum[j], c.rows->on_a * part.shift[j]);
      to(c.b, c.rows->on_b * part.sum[j], c.rows->on_b * part.shift[j]);
    }
    for (uint32_t i = part.first_row; i < part.last_row; ++i) {
      const BoundedRow& r = problem_.bounded[i];
      to(r.a, rows_[i].sum * r.on_a, rows_[i].shift * r.on_a);
      to(r.b, rows_[i].sum * r.on_b, rows_[i].shift * r.on_b);
    }
    for (uint32_t i = part.first_contact; i < part.last_contact; ++i) {
      const BoundedRow& r = contacts_[i].row;
      to(r.a, contact_rows_[i].sum * r.on_a, contact_rows_[i].shift * r.on_a);
      to(r.b, contact_rows_[i].sum * r.on_b, contact_rows_[i].shift * r.on_b);
    }
    // Links with springs move by the change of the velocity at the end. Any other motion would strain the
    // springs.
    if (!part.articulation->has_springs()) continue;
    const Real time = (1 - part.articulation->kicks_act_from()) * duration_;
    for (std::size_t k = 0; k < part.bodies.size(); ++k) {
      RelaxedBody& b = bodies[part.bodies[k]];
      b.displacement = time * b.inverse_mass * b.impulse + part.pushed[k].head<3>();
      b.rotation_vector = time * (b.inverse_inertia * b.angular_impulse) + part.pushed[k].tail<3>();
    }
  }
}

void RelaxedJoints::finish() {
  for (const Part& part : parts_)
    std::copy(part.sum.begin(), part.sum.end(), problem_.impulses.begin() + part.first_constraint);
  for (std::size_t i = 0; i < rows_.size(); ++i) problem_.bounded[i].impulse = rows_[i].sum;
  for (std::size_t i = 0; i < contacts_.size(); ++i) contacts_[i].row.impulse = contact_rows_[i].sum;
}

}  // namespace offstage::sim
