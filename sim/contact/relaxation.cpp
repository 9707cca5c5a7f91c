#include "sim/contact/relaxation.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "sim/core/parallel_loop.h"
#include "sim/core/staged_loop.h"
#include "sim/dynamics/force_field.h"

namespace offstage::sim {
namespace {

/// kPushFraction: fraction of the penetration that a step removes. kMaxPush: greatest speed of this
/// correction [m/s]. Moving one patch opens the gaps of others, whose forces are then missing until the gaps
/// close. With fractions of 0.65 and 0.8 a wall of 1000 bricks trembled (0.2 and 2 J after 4 s instead of
/// 0.001 J), and with 1 it fell. With 0.3 the greatest overlap in heaps was the same.
constexpr Real kPushFraction = 0.5, kMaxPush = 3;

/// With fewer batches than this, a second thread would not save time.
constexpr std::size_t kSerialBatches = 48;
/// A sweep that changes the velocity of a patch by more than this marks its bodies as hit [m/s]. Their other
/// contacts get another sweep before the bodies move, because otherwise they would penetrate; this is
/// repeated at most kRepeats times. In a sub-step of 1/1920 s this speed causes a penetration of 0.05 mm.
/// (With half and twice the value, the greatest overlap of 1000 boxes that fall on a heap was 0.5 and 0.7 mm
/// instead of 0.8 mm, in the same time; this is within the scatter.)
constexpr Real kImpact = 0.1;
constexpr uint32_t kRepeats = 12;
/// Bodies under a load can only be separated together. Therefore a displacement of more than kPress by
/// push-out is propagated like an impact, until it is less than kPassedOn [m]. This was measured in heaps of
/// 3000 boxes at rest. Without propagation, columns overlapped by 1 mm for seconds, and the overlap was above
/// 1 mm in 114 of 360 samples. With propagation, the overlap was 0.6 mm, and above 1 mm in 5 samples. Smaller
/// values reduce the overlap further, but make a wall of 1000 bricks sway. In a wall at rest the
/// displacements are smaller than this.
constexpr Real kPress = 3e-4, kPassedOn = 1e-4;

/// A sub-step whose change of velocity is more than this many times the mean contains an impact.
constexpr Real kUneven = 2.5;

/// Points whose depth differs from the deepest point's depth by less than this count as equally deep [m].
constexpr Real kAsDeep = 5e-5;

constexpr uint32_t kBatchesPerBlock = 4, kBodiesPerBlock = 128;

Vec3 linear_part(FloatLanes x) {
  return {x[0], x[1], x[2]};
}
Vec3 angular_part(FloatLanes x) {
  return {x[4], x[5], x[6]};
}
FloatLanes joined(const Vec3& linear, const Vec3& angular) {
  const Eigen::Vector3f v = linear.cast<float>(), w = angular.cast<float>();
  return FloatLanes{v.x(), v.y(), v.z(), 0, w.x(), w.y(), w.z(), 0};
}

/// Whether a body was hit. Two conditions must hold. Its velocity changes by more than steady forces would
/// change it: by twice the change of the free motion, measured as kinetic energy. (The factor is two because
/// the torque of the load turns the spin of a rolling coin faster than gravity does.) And most of the change
/// happens in few sub-steps. `greatest`: by component, the greatest change of velocity in a sub-step.
bool jumps(const RelaxedBody& b, const BodyMotion& m, FloatLanes greatest, const RelaxationDef& def) {
  const Real inertia = b.inverse_inertia.trace() > 0 ? 3 * b.inverse_mass / b.inverse_inertia.trace() : 0;
  const auto size2 = [inertia](const Vec3& linear, const Vec3& angular) {
    return linear.squaredNorm() + inertia * angular.squaredNorm();
  };
  const Real h = def.duration, change2 = size2(linear_part(m.velocity), angular_part(m.velocity));
  if (change2 <= 4 * h * h * size2(b.free_acceleration, b.free_angular_acceleration)) return false;
  const Real even = kUneven / def.substeps;
  return size2(linear_part(greatest), angular_part(greatest)) > even * even * change2;
}

}  // namespace

Real set_points(ContactPatch& p, const Manifold& m, const ContactFrame& frame, const Vec3& centre_a,
                const Vec3& centre_b, bool at_deepest) {
  p.frame = frame;
  p.count = m.count;
  if (m.count == 0) return 0;
  const auto middle = [&m](uint32_t i) { return Vec3((m.points[i].on_a + m.points[i].on_b) / 2); };
  Real least = kInfinity;
  for (uint32_t i = 0; i < m.count; ++i) least = std::min(least, m.points[i].separation);
  Vec3 centre = Vec3::Zero();
  Real separation = 0;
  uint32_t count = 0;
  for (uint32_t i = 0; i < m.count; ++i) {
    if (at_deepest && m.points[i].separation > least + kAsDeep) continue;
    centre += middle(i);
    separation += m.points[i].separation;
    ++count;
  }
  centre /= count;
  p.arm_a = centre - centre_a;
  p.arm_b = centre - centre_b;
  for (uint32_t i = 0; i < m.count; ++i) {
    const Vec3 d = middle(i) - centre;
    p.points[i] = {.t = frame.t.dot(d), .k = frame.k.dot(d), .separation = m.points[i].separation};
  }
  return separation / count;
}

uint32_t relaxation_substeps(Real duration) {
  return static_cast<uint32_t>(std::max(4.0, std::ceil(1920 * duration - 1e-6)));
}

// Stages

/// Adds one range for each colour, and one for the batches that share bodies, which are solved in order.
/// Colours of a single block do not justify a stage each and are solved in order, too.
void RelaxationSolver::plan_colors(Stage stage, uint32_t substep, bool backward) {
  const std::span<const uint32_t> begins = coloring_.begins();
  const std::size_t first = ranges_.size();
  const auto add = [&](uint32_t begin, uint32_t end, uint32_t block_size) {
    ranges_.push_back({stage, begin, end, block_size, substep, sweeps_, backward});
  };
  for (std::size_t c = 0; c + 1 < begins.size(); ++c) {
    const bool is_small = begins[c + 1] - begins[c] <= kBatchesPerBlock;
    Range* const last = ranges_.size() > first ? &ranges_.back() : nullptr;
    if (is_small && last && last->block_count() == 1) {
      last->end = begins[c + 1];
      last->block_size = last->end - last->begin;
    } else {
      add(begins[c], begins[c + 1], kBatchesPerBlock);
    }
  }
  const auto end = static_cast<uint32_t>(batches_.size());
  if (begins.back() < end) add(begins.back(), end, end - begins.back());
  if (backward) std::reverse(ranges_.begin() + static_cast<std::ptrdiff_t>(first), ranges_.end());
}

/// Plans a sweep over all batches, and then repeated sweeps over the batches that impacts reach. The latter
/// go alternately backward and forward, so that impacts propagate in both directions.
void RelaxationSolver::plan_sweeps(Stage first, Stage again, uint32_t substep) {
  ++sweeps_;
  plan_colors(first, substep);
  for (uint32_t k = 0; k < kRepeats; ++k) {
    ++sweeps_;
    plan_colors(again, substep, k % 2 == 0);
  }
}

/// Plans the sweeps of the push-out in the same way. After each of them the joints move their links.
void RelaxationSolver::plan_push(uint32_t substeps, uint32_t joints) {
  if (joints > 0) ranges_.push_back({Stage::begin_push, 0, joints, 1});
  for (uint32_t k = 0; k <= kRepeats; ++k) {
    ++sweeps_;
    plan_colors(k == 0 ? Stage::push : Stage::push_again, substeps, k % 2 == 1);
    if (joints > 0) ranges_.push_back({Stage::push_joints, 0, joints, 1, substeps, sweeps_});
  }
  push_sweep_ = sweeps_ - kRepeats;
}

void RelaxationSolver::plan(uint32_t substeps) {
  times_.clear();
  for (uint32_t i = 0; i <= substeps; ++i) times_.emplace_back(substep_, i, def_.duration);
  const auto bodies = static_cast<uint32_t>(bodies_.size());
  ranges_.clear();
  sweeps_ = 0;
  ranges_.push_back({Stage::start, 0, bodies, kBodiesPerBlock});
  plan_colors(Stage::prepare);
  const uint32_t joints = joints_ ? joints_->count() : 0;
  if (joints > 0) ranges_.push_back({Stage::start_joints, 0, joints, 1});
  for (uint32_t i = 0; i < substeps; ++i) {
    plan_sweeps(i > 0 ? Stage::solve_next : Stage::solve, Stage::solve_again, i);
    if (joints > 0) ranges_.push_back({Stage::join, 0, joints, joints, i + 1});
    ranges_.push_back({i + 1 < substeps ? Stage::advance : Stage::advance_last, 0, bodies, kBodiesPerBlock});
  }
  plan_push(substeps, joints);
  // Contacts that closed in the last sub-step still have the velocity with which they closed. One more sweep
  // stops them.
  ++sweeps_;
  plan_colors(Stage::solve, substeps);
  if (joints > 0) ranges_.push_back({Stage::join_last, 0, joints, joints, substeps});
  ranges_.push_back({Stage::finish, 0, bodies, kBodiesPerBlock});
  plan_colors(Stage::report, substeps);
  strikes_.assign(sweeps_ + 1, 0);
  struck_.assign(bodies + 1, 0);
}

bool RelaxationSolver::is_needed(const Range& range) const {
  const bool again = range.stage == Stage::solve_again || range.stage == Stage::push_again ||
                     (range.stage == Stage::push_joints && range.sweep > push_sweep_);
  return !again || strikes_[range.sweep - 1];
}

void RelaxationSolver::run(const Range& range, uint32_t block) {
  const uint32_t begin = range.begin + block * range.block_size,
                 end = std::min(begin + range.block_size, range.end);
  const auto each = [&range, begin, end](auto&& work) {
    for (uint32_t i = begin; i < end; ++i) work(range.backward ? begin + end - 1 - i : i);
  };
  switch (range.stage) {
    case Stage::start:
      return each([this](uint32_t i) { start(i); });
    case Stage::prepare:
      return each([this](uint32_t i) {
        sim::prepare(batches_[i], coloring_.batches()[i], patches_, bodies_, motions_, substep_,
                     has_lone_patch(i));
      });
    case Stage::solve:
      return each([&](uint32_t i) { solve(i, range); });
    case Stage::solve_next:
      return each([&](uint32_t i) {
        begin_substep(batches_[i]);
        solve(i, range);
      });
    case Stage::solve_again:
      return each([&](uint32_t i) {
        if (is_struck(i, range.sweep - 1)) solve(i, range);
      });
    case Stage::start_joints:
      return each([this](uint32_t i) { joints_->start(i, motions_); });
    case Stage::join:
    case Stage::join_last:
      return each([&](uint32_t i) {
        joints_->solve(i, motions_, range.substep * substep_, range.stage == Stage::join_last);
      });
    case Stage::advance:
      return each([this](uint32_t i) {
        advance(i);
        extrapolate(i);
      });
    case Stage::advance_last:
      return each([this](uint32_t i) { advance(i); });
    case Stage::push:
      return each([&](uint32_t i) {
        end_substeps(batches_[i], substep_);
        push(i, range, kPress);
      });
    case Stage::push_again:
      return each([&](uint32_t i) {
        if (is_struck(i, range.sweep - 1)) push(i, range, kPassedOn);
      });
    case Stage::begin_push:
      return each([this](uint32_t i) { joints_->begin_push(i, motions_); });
    case Stage::push_joints:
      return each([&](uint32_t i) { push_joints(i, range); });
    case Stage::finish:
      return each([this](uint32_t i) { finish(i); });
    case Stage::report:
      return each([this](uint32_t i) { report(i); });
  }
}

/// Whether a body of a batch touches only bodies that contacts do not move.
bool RelaxationSolver::has_lone_patch(uint32_t i) const {
  const auto is_lone = [this](uint32_t k) {
    return k != ContactColoring::kNone && !meets_moving_[patches_[k].a] && !meets_moving_[patches_[k].b];
  };
  const PatchBatch::Index& patches = coloring_.batches()[i];
  return std::any_of(patches.begin(), patches.end(), is_lone);
}

void RelaxationSolver::start(uint32_t i) {
  const RelaxedBody& b = bodies_[i];
  last_[i] = greatest_[i] = FloatLanes{};
  motions_[i] = {joined(substep_ * b.free_acceleration, substep_ * b.free_angular_acceleration),
                 FloatLanes{}};
}

// Sets the initial guess for the next sub-step: the change of velocity in the last one, by contacts and free
// motion together.
void RelaxationSolver::extrapolate(uint32_t i) {
  FloatLanes& v = motions_[i].velocity;
  const FloatLanes now = v;
  const FloatLanes change = now - last_[i];
  v += change;
  last_[i] = now;
  greatest_[i] = lane_max(greatest_[i], lane_abs(change));
}

void RelaxationSolver::solve(uint32_t i, const Range& range) {
  PatchBatch& p = batches_[i];
  sweep(p, motions_, times_[range.substep]);
  strike(p, range.sweep, p.residual, kImpact);
}

void RelaxationSolver::push(uint32_t i, const Range& range, Real threshold) {
  PatchBatch& p = batches_[i];
  const PushOut how{times_.back(), kPushFraction, kMaxPush * def_.duration};
  strike(p, range.sweep, push_out(p, motions_, how), threshold);
}

/// Moves the links of an articulation. If the joints have moved them far, their contacts get another push-out
/// sweep.
void RelaxationSolver::push_joints(uint32_t part, const Range& range) {
  if (!(joints_->push_out(part, motions_) > kPassedOn)) return;
  for (const uint32_t body : joints_->bodies(part)) struck_[body] = range.sweep;
  std::atomic_ref(strikes_[range.sweep]).store(1, std::memory_order_relaxed);
}

/// Marks the bodies in lanes with an impact above the threshold; their contacts get another sweep.
void RelaxationSolver::strike(const PatchBatch& p, uint32_t sweep, FloatLanes impact, Real threshold) {
  for (unsigned lane = 0; lane < ContactColoring::kLanes; ++lane) {
    if (!(impact[lane] > threshold)) continue;
    if (p.moves_a[lane]) struck_[p.a[lane]] = sweep;
    if (p.moves_b[lane]) struck_[p.b[lane]] = sweep;
    std::atomic_ref(strikes_[sweep]).store(1, std::memory_order_relaxed);
  }
}

bool RelaxationSolver::is_struck(uint32_t i, uint32_t since) const {
  const PatchBatch& p = batches_[i];
  for (unsigned lane = 0; lane < ContactColoring::kLanes; ++lane)
    if (struck_[p.a[lane]] >= since || struck_[p.b[lane]] >= since) return true;
  return false;
}

void RelaxationSolver::advance(uint32_t i) {
  BodyMotion& m = motions_[i];
  m.shift += float_lanes(substep_) * m.velocity;
}

// Corrects the motion of a body at the end of the step. The sub-steps moved the bodies with the velocities at
// their ends, which closes gaps exactly. For steady forces the mean of the velocities at start and end is
// correct. Summed over the sub-steps, the difference is the whole change of velocity times half a sub-step.
void RelaxationSolver::finish(uint32_t i) {
  RelaxedBody& b = bodies_[i];
  if (b.inverse_mass == 0) return;
  const BodyMotion& m = motions_[i];
  const Real h = def_.duration;
  const FloatLanes greatest = lane_max(greatest_[i], lane_abs(m.velocity - last_[i]));
  late_[i] = jumps(b, m, greatest, def_) ? 0 : substep_ / 2;
  b.impulse = b.angular_impulse = b.displacement = b.rotation_vector = Vec3::Zero();
  // The effect of contacts and joints is added afterwards.
  b.velocity += h * b.free_acceleration;
  b.angular_velocity += h * b.free_angular_acceleration;
}

namespace {

/// Returns the wrench about a patch's centre, in world axes. It is computed from the normal components of the
/// points, and from the common components along t and k and about n.
Wrench wrench(const ContactPatch& p, Real ContactPatch::Point::*normal, const Vec3& friction,
              const Tangential& rolling) {
  Vec3 sum = Vec3::Zero();  // along n, and moments about t and k
  for (uint32_t i = 0; i < p.count; ++i) {
    const ContactPatch::Point& q = p.points[i];
    sum += q.*normal * Vec3(1, q.k, -q.t);
  }
  sum.tail<2>() += rolling;
  const auto& [n, t, k] = p.frame;
  return {sum.x() * n + friction.x() * t + friction.y() * k, friction.z() * n + sum.y() * t + sum.z() * k};
}

}  // namespace

/// Adds the effect of the patch in the step to both bodies, in double precision.
void RelaxationSolver::give(const ContactPatch& p) {
  const Wrench impulse = wrench(p, &ContactPatch::Point::impulse, p.friction_impulse, p.rolling_impulse);
  const Wrench shift = wrench(p, &ContactPatch::Point::shift, p.friction_shift, p.rolling_shift);
  const auto to = [&](uint32_t body, const Vec3& arm, Real sign) {
    RelaxedBody& b = bodies_[body];
    if (b.inverse_mass == 0) return;
    const Real late = late_[body];
    const Vec3 force = sign * impulse.force, torque = sign * (arm.cross(impulse.force) + impulse.torque);
    const Vec3 way = sign * shift.force, turn = sign * (arm.cross(shift.force) + shift.torque);
    b.impulse += force;
    b.angular_impulse += torque;
    b.velocity += b.inverse_mass * force;
    b.angular_velocity += b.inverse_inertia * torque;
    b.displacement += b.inverse_mass * (way - late * force);
    b.rotation_vector += b.inverse_inertia * (turn - late * torque);
  };
  to(p.a, p.arm_a, 1);
  to(p.b, p.arm_b, -1);
}

// Reports the forces of a batch, and computes the motion again from the impulses in double precision. The
// impulses on both bodies are opposite to the last bit, so momentum is conserved.
void RelaxationSolver::report(uint32_t i) {
  sim::report(batches_[i], patches_, substep_);
  for (const uint32_t patch : coloring_.batches()[i])
    if (patch != ContactColoring::kNone) give(patches_[patch]);
}

void RelaxationSolver::set_up() {
  const auto mover = [this](uint32_t i) { return bodies_[i].inverse_mass > 0 ? i : ContactColoring::kNone; };
  links_.resize(patches_.size());
  for_each_index(patches_.size(), [&](std::size_t i) {
    links_[i] = {mover(patches_[i].a), mover(patches_[i].b)};
  });
  meets_moving_.assign(bodies_.size(), 0);
  for (const auto& [a, b] : links_)
    if (a != ContactColoring::kNone && b != ContactColoring::kNone) meets_moving_[a] = meets_moving_[b] = 1;
  coloring_.assign(static_cast<uint32_t>(bodies_.size()), links_);
  batches_.resize(coloring_.batches().size());
  motions_.resize(bodies_.size() + 1);
  motions_.back() = {};
  last_.resize(bodies_.size());
  greatest_.resize(bodies_.size());
  late_.resize(bodies_.size());
}

ContactWork RelaxationSolver::solve(std::span<RelaxedBody> bodies, std::span<ContactPatch> patches,
                                    const RelaxationDef& def, RelaxedJoints* joints) {
  bodies_ = bodies;
  patches_ = patches;
  def_ = def;
  joints_ = joints;
  if (joints) joints->begin(bodies, def.duration, def.substeps);
  substep_ = def.duration / def.substeps;
  set_up();
  plan(def.substeps);
  const uint32_t threads = batches_.size() < kSerialBatches ? 1 : available_threads();
  run_stages(
      std::span<const Range>(ranges_), threads, [this](const Range& range) { return is_needed(range); },
      [this](const Range& range, uint32_t block) { run(range, block); });
  if (joints) {
    joints->add_motion(bodies, late_);
    joints->finish();
  }
  ContactWork work{.solves = 1, .iterations = def.substeps + 1};
  for (const PatchBatch& p : batches_)
    for (unsigned lane = 0; lane < ContactColoring::kLanes; ++lane)
      work.residual = std::max(work.residual, Real{p.residual[lane]});
  return work;
}

}  // namespace offstage::sim
