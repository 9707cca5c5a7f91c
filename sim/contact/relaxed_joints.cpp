#include "sim/contact/relaxed_joints.h"

#include <algorithm>
#include <cmath>

#include "sim/contact/relaxation.h"

namespace offstage::sim {
namespace {

/// Rows times links above which the responses of all links are not stored.
constexpr std::size_t kMostResponses = 20000;

/// Change of velocity since the step's start.
Vec6 change_of(const BodyMotion& m) {
  Vec6 v;
  for (unsigned i = 0; i < 3; ++i) {
    v[i] = m.velocity[i];
    v[i + 3] = m.velocity[i + 4];
  }
  return v;
}

Vec6 velocity_of(const RelaxedBody& b, const BodyMotion& m) {
  Vec6 v;
  v << b.velocity, b.angular_velocity;
  return v + change_of(m);
}

void add_to(BodyMotion& m, const Vec6& v) {
  const Eigen::Matrix<float, 6, 1> f = v.cast<float>();
  m.velocity += FloatLanes{f[0], f[1], f[2], 0, f[3], f[4], f[5], 0};
}

/// Change of velocity without contacts and rows with bounds.
Vec6 free_change(const RelaxedBody& b, Real elapsed) {
  Vec6 v;
  v << b.free_acceleration, b.free_angular_acceleration;
  return elapsed * v;
}

}  // namespace

RelaxedJoints::RelaxedJoints(const JointProblem& problem, std::span<Articulation* const> articulations,
                             std::span<const uint32_t> bounded_ends)
    : problem_(problem), rows_(problem.bounded.size()) {
  uint32_t constraint = 0, row = 0;
  for (std::size_t i = 0; i < articulations.size(); ++i) {
    Part part{.articulation = articulations[i],
              .first_constraint = constraint,
              .first_row = row,
              .last_row = bounded_ends[i]};
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
  const Real share = 1.0 / substeps;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const BoundedRow& r = problem_.bounded[i];
    rows_[i].impulse = share * r.impulse;
    rows_[i].lower = share * r.lower;
    rows_[i].upper = share * r.upper;
    rows_[i].softness = r.softness / share;
  }
  for (Part& part : parts_) prepare(part, bodies);
}

void RelaxedJoints::prepare(Part& part, std::span<const RelaxedBody> bodies) {
  for (uint32_t i = part.first_row; i < part.last_row; ++i) prepare_row(part, i, bodies);
}

void RelaxedJoints::prepare_row(Part& part, uint32_t i, std::span<const RelaxedBody> bodies) {
  const BoundedRow& r = problem_.bounded[i];
  Row& row = rows_[i];
  const auto response = [&](uint32_t body, const Vec6& on) -> Vec6 {
    if (body == kUnmoved) return Vec6::Zero();
    return LinkMobility{bodies[body].inverse_mass, bodies[body].inverse_inertia}.velocity(on);
  };
  row.response_a = response(r.a, r.on_a);
  row.response_b = response(r.b, r.on_b);
  const std::size_t links = part.bodies.size();
  Real mobility = r.on_a.dot(row.response_a) + r.on_b.dot(row.response_b);
  if (links * (part.last_row - part.first_row) <= kMostResponses) {
    row.response.assign(links, Vec6::Zero());
    for (std::size_t k = 0; k < links; ++k) {
      if (part.bodies[k] == r.a) row.response[k] = row.response_a;
      if (part.bodies[k] == r.b) row.response[k] = row.response_b;
    }
    JointSystem& system = part.articulation->system();
    system.relative(row.response, part.change);
    for (Vec6& c : part.change) c = -c;
    system.correct(part.change, part.impulses, row.response);
    row.reaction = part.impulses;
    mobility = 0;
    for (std::size_t k = 0; k < links; ++k) {
      if (part.bodies[k] == r.a) mobility += r.on_a.dot(row.response[k]);
      if (part.bodies[k] == r.b) mobility += r.on_b.dot(row.response[k]);
    }
  }
  const Real stiffness = mobility + row.softness;
  row.inverse_stiffness = stiffness > 1e-300 ? 1 / stiffness : 0;
}

void RelaxedJoints::push(Part& part, uint32_t i, Real impulse, std::span<BodyMotion> motions) const {
  const Row& row = rows_[i];
  if (!row.response.empty()) {
    for (std::size_t k = 0; k < part.bodies.size(); ++k)
      add_to(motions[part.bodies[k]], impulse * row.response[k]);
    for (std::size_t j = 0; j < part.now.size(); ++j) part.now[j] += impulse * row.reaction[j];
    return;
  }
  const BoundedRow& r = problem_.bounded[i];
  if (r.a != kUnmoved) add_to(motions[r.a], impulse * row.response_a);
  if (r.b != kUnmoved) add_to(motions[r.b], impulse * row.response_b);
}

void RelaxedJoints::start(uint32_t p, std::span<BodyMotion> motions) {
  Part& part = parts_[p];
  for (uint32_t i = part.first_row; i < part.last_row; ++i)
    if (rows_[i].impulse != 0) push(part, i, rows_[i].impulse, motions);
}

void RelaxedJoints::solve(uint32_t p, std::span<BodyMotion> motions, Real elapsed, bool is_last) {
  Part& part = parts_[p];
  JointSystem& system = part.articulation->system();
  for (std::size_t k = 0; k < part.bodies.size(); ++k)
    part.velocities[k] = change_of(motions[part.bodies[k]]) - free_change(bodies_[part.bodies[k]], elapsed);
  system.relative(part.velocities, part.change);
  for (Vec6& c : part.change) c = -c;
  std::vector<Vec6>& correction = part.velocities;
  std::fill(correction.begin(), correction.end(), Vec6::Zero());
  system.correct(part.change, part.impulses, correction);
  for (std::size_t k = 0; k < part.bodies.size(); ++k) add_to(motions[part.bodies[k]], correction[k]);
  // The velocities of a sub-step carry over to the next one, including the impulses; after the last there is
  // none.
  if (is_last) std::fill(part.now.begin(), part.now.end(), Vec6::Zero());
  for (std::size_t j = 0; j < part.now.size(); ++j) part.now[j] += part.impulses[j];

  for (uint32_t i = part.first_row; i < part.last_row; ++i) {
    const BoundedRow& r = problem_.bounded[i];
    Row& row = rows_[i];
    row.acts |= elapsed > r.from * duration_;
    if (!row.acts) continue;
    Real u = r.offset;
    if (r.a != kUnmoved) u += r.on_a.dot(velocity_of(bodies_[r.a], motions[r.a]));
    if (r.b != kUnmoved) u += r.on_b.dot(velocity_of(bodies_[r.b], motions[r.b]));
    const Real wanted = row.impulse - (u - r.target + row.softness * row.impulse) * row.inverse_stiffness;
    const Real next = std::clamp(wanted, row.lower, row.upper);
    push(part, i, next - row.impulse, motions);
    row.sum += is_last ? next - row.impulse : next;
    row.impulse = next;
  }
  for (std::size_t j = 0; j < part.sum.size(); ++j) part.sum[j] += part.now[j];
  if (is_last) return;
  for (uint32_t i = part.first_row; i < part.last_row; ++i) rows_[i].shift += substep_ * rows_[i].sum;
  for (std::size_t j = 0; j < part.sum.size(); ++j) part.shift[j] += substep_ * part.sum[j];
}

void RelaxedJoints::give(std::span<RelaxedBody> bodies, std::span<const Real> late) const {
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
  }
}

void RelaxedJoints::finish() {
  for (const Part& part : parts_)
    std::copy(part.sum.begin(), part.sum.end(), problem_.impulses.begin() + part.first_constraint);
  for (std::size_t i = 0; i < rows_.size(); ++i) problem_.bounded[i].impulse = rows_[i].sum;
}

}  // namespace offstage::sim
