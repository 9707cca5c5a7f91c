#pragma once
/// The fast contact solver (physics N12): time stepping on velocities (Stewart and Trinkle, "An implicit
/// time-stepping scheme for rigid body dynamics with inelastic collisions and Coulomb friction", 1996) in
/// many small sub-steps of one sweep of Gauss-Seidel each (Macklin et al., "Small steps in physics
/// simulation", 2019). At the end of the step, penetration is removed by moving the bodies in one more sweep,
/// which is repeated where displacements are large. This does not change velocities.
///
/// One sweep leaves an error, which acts on the next sub-step as a change of velocity. The forces of a tall
/// stack therefore behave like the springs of a spurious oscillator: a mode whose error a sweep reduces by
/// the fraction e oscillates at sqrt(e) per sub-step, and is damped only by e / 2. To add damping, a patch
/// moves its forces after its solution slightly towards their mean over the last tenth of a second. This
/// changes neither forces at rest, which equal their mean, nor errors that one sweep can remove.
///
/// The points of a manifold, at most four, are solved together as a patch. The bodies' relative twist has six
/// components, the impulses form a wrench of six components, and a symmetric 6 x 6 matrix, computed once per
/// step, relates the two. All points of a patch are solved in these terms. Eight patches that share no body
/// are solved at once, one per SIMD lane, colour by colour of the contact graph.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/collision/contact_frame.h"
#include "sim/collision/manifold.h"
#include "sim/contact/contact_coloring.h"
#include "sim/contact/contact_problem.h"
#include "sim/contact/friction_cone.h"
#include "sim/contact/patch_batch.h"
#include "sim/contact/relaxed_joints.h"
#include "sim/core/types.h"

namespace offstage::sim {

/// A body during a step of the fast solver.
struct RelaxedBody {
  Real inverse_mass = 0;                ///< [1/kg]; 0: contacts do not move it, but it may be moving
  bool is_link = false;                 ///< whether joints hold it; contacts know its own mass only
  Mat3 inverse_inertia = Mat3::Zero();  ///< inverse inertia about the centre of mass, world axes [1/(kg m^2)]
  Vec3 velocity = Vec3::Zero();  ///< velocity of the centre of mass [m/s]; in: at the start, out: at the end
  Vec3 angular_velocity = Vec3::Zero();           ///< world [rad/s]; in: at the start, out: at the end
  Vec3 free_acceleration = Vec3::Zero();          ///< mean over the step, without contacts [m/s^2]
  Vec3 free_angular_acceleration = Vec3::Zero();  ///< [rad/s^2]
  /// Out: the impulse of contacts and joints, which is added to the free motion's momentum [N s], and their
  /// angular impulse about the centre of mass [N m s]. The impulses of a contact on its two bodies are
  /// opposite to rounding.
  Vec3 impulse = Vec3::Zero(), angular_impulse = Vec3::Zero();
  /// Out: the displacement and rotation by contacts, which are added to the free motion of the step [m],
  /// [rad]: position = free position + displacement, orientation = exp(rotation_vector) free orientation.
  Vec3 displacement = Vec3::Zero(), rotation_vector = Vec3::Zero();

  /// Scales the effect of contacts and joints.
  void scale(Real fraction) {
    impulse *= fraction;
    angular_impulse *= fraction;
    displacement *= fraction;
    rotation_vector *= fraction;
  }
};

/// Up to four points where the bodies a and b touch or may soon touch. The frame and the arms are constant
/// during the step; `gain` is the effect of their rotation on the velocities.
struct ContactPatch {
  struct Point {
    Real t = 0, k = 0;    ///< coordinates along the tangents, from the patch's centre [m]
    Real separation = 0;  ///< separation at the start of the step, negative in penetration [m]
    Real force = 0;  ///< normal force [N]; in: the guess from the last step; out: at the end of this step
    Real mean_force =
        0;             ///< moving average over previous sub-steps [N]; in: from the last step, out: updated
    Real impulse = 0;  ///< out: impulse over the whole step [N s]
    Real shift = 0;  ///< out: effective mass times the displacement that this point causes in the step [kg m]
  };
  uint32_t a = 0, b = 0;  ///< indices of bodies; at least one is movable
  ContactFrame frame;     ///< n from b to a
  /// Vectors from the centres of mass to the patch's centre [m].
  Vec3 arm_a = Vec3::Zero(), arm_b = Vec3::Zero();
  Vec3 offset = Vec3::Zero();  ///< (n, t, k), added to the relative velocity: effect of moving surfaces [m/s]
  /// Change of the relative velocity at the centre due to turning arms and frames, in (n, t, k) [m/s]. With
  /// s, which increases linearly from -1 at the step's start to 1 at its end, it is gain times (s - s0) plus
  /// bow times (s^2 - s0^2). The normal velocity also changes by gain_along_t (s - s0) and gain_along_k (s -
  /// s0) per metre along t and k [1/s]. Frame and arms belong to s0, the time at which the impulses act
  /// (`acting`).
  Vec3 gain = Vec3::Zero(), bow = Vec3::Zero();
  Real gain_along_t = 0, gain_along_k = 0, acting = 0;
  bool turns = false;  ///< whether any gain differs from 0
  /// Coulomb's coefficients along t and k. If they are equal, friction has the round cone; otherwise each
  /// axis has its own limit.
  Real friction_t = 0, friction_k = 0;
  uint32_t count = 0;
  std::array<Point, 4> points;
  /// Friction of all points together: tangential [N] and about the normal [N m]; in and out like
  /// Point::force.
  Real force_t = 0, force_k = 0, torque_n = 0;
  Vec3 mean_friction =
      Vec3::Zero();  ///< moving average of (force_t, force_k, torque_n), like Point::mean_force
  /// Impulses of friction over the whole step, in the order of mean_friction; see Point::impulse.
  Vec3 friction_impulse = Vec3::Zero();
  /// Effect of friction on positions, in the order of mean_friction; see Point::shift.
  Vec3 friction_shift = Vec3::Zero();
  Real rolling = 0, spinning = 0;  ///< rolling and spinning friction [m]; see Contact
  /// Out: angular impulse of rolling friction about t and k over the step [N m s], and its effect on
  /// positions; see Point::impulse and Point::shift.
  Tangential rolling_impulse = Tangential::Zero(), rolling_shift = Tangential::Zero();
};

/// Sets the points, centre and arms of a patch from a manifold. The points keep their order. Manifold and
/// frame are in world axes, and the frame's n must be the manifold's normal. `centre_a` and `centre_b` are
/// the bodies' centres of mass. The patch's centre is the centre of all points or, if `at_deepest`, the
/// deepest point. Returns the separation of the surfaces at the patch's centre [m].
Real set_points(ContactPatch& patch, const Manifold& m, const ContactFrame& frame, const Vec3& centre_a,
                const Vec3& centre_b, bool at_deepest = false);

/// Number of sub-steps of the fast solver: at least four, and enough that each is at most 1/1920 s. Each
/// costs one sweep over the patches.
uint32_t relaxation_substeps(Real duration);

struct RelaxationDef {
  Real duration = 1.0 / 240;  ///< length of the step [s], > 0
  uint32_t substeps = 8;      ///< > 0
};

/// The fast solver. Between steps an object keeps allocated memory, but no state.
class RelaxationSolver {
 public:
  /// Solves the contacts of a step and updates bodies and patches. Penetration is removed gradually. Where a
  /// gap is open, the bodies may approach until it is closed. The result depends only on the arguments and
  /// their order, not on the number of threads. `joints` may be null.
  ContactWork solve(std::span<RelaxedBody> bodies, std::span<ContactPatch> patches, const RelaxationDef& def,
                    RelaxedJoints* joints = nullptr);

 private:
  enum class Stage : uint8_t {
    start,
    prepare,
    solve,
    solve_next,   // the first sweep of another sub-step
    solve_again,  // another sweep over the bodies hit in the previous sweep
    start_joints,
    join,
    join_last,
    advance,
    advance_last,
    begin_push,
    push,
    push_again,   // another push-out of the bodies moved by the previous push-out
    push_joints,  // the joints move their links after the push-out of the same sweep
    finish,
    report
  };
  /// A range of work items that is split into blocks. The blocks may run in any order and in parallel.
  struct Range {
    Stage stage;
    uint32_t begin, end, block_size;
    uint32_t substep = 0, sweep = 0;
    bool backward = false;

    uint32_t block_count() const { return (end - begin + block_size - 1) / block_size; }
  };

  void set_up();
  void plan(uint32_t substeps);
  void plan_colors(Stage stage, uint32_t substep = 0, bool backward = false);
  void plan_sweeps(Stage first, Stage again, uint32_t substep);
  void plan_push(uint32_t substeps, uint32_t joints);
  bool is_needed(const Range& range) const;
  void run(const Range& range, uint32_t block);
  void start(uint32_t body);
  void extrapolate(uint32_t body);
  void solve(uint32_t batch, const Range& range);
  void push(uint32_t batch, const Range& range, Real threshold);
  void push_joints(uint32_t part, const Range& range);
  void strike(const PatchBatch& batch, uint32_t sweep, FloatLanes impact, Real threshold);
  bool is_struck(uint32_t batch, uint32_t since) const;
  bool has_lone_patch(uint32_t batch) const;
  void advance(uint32_t body);
  void finish(uint32_t body);
  void report(uint32_t batch);
  void give(const ContactPatch& patch);

  std::span<RelaxedBody> bodies_;
  std::span<ContactPatch> patches_;
  RelaxationDef def_;
  RelaxedJoints* joints_ = nullptr;  // may be null
  Real substep_ = 0;
  std::vector<ContactColoring::Link> links_;
  std::vector<uint8_t> meets_moving_;  // by body: whether it touches another body that contacts move
  ContactColoring coloring_;
  std::vector<PatchBatch> batches_;
  std::vector<BodyMotion> motions_;   // one more than bodies, for unused lanes
  std::vector<FloatLanes> last_;      // velocities at the end of the previous sub-step
  std::vector<FloatLanes> greatest_;  // by component, the greatest change of velocity in a sub-step
  std::vector<Real> late_;            // by body: see finish() [s]
  std::vector<SubstepTime> times_;    // time of each sub-step, and of one more after the last
  std::vector<Range> ranges_;
  // Sweeps are numbered from 1; a body stores the number of the last sweep in which it was hit.
  uint32_t sweeps_ = 0, push_sweep_ = 0;  // push_sweep_: first sweep of the push-out
  std::vector<uint32_t> struck_;          // by body
  std::vector<uint8_t> strikes_;          // by sweep: whether any body was hit
};

}  // namespace offstage::sim
