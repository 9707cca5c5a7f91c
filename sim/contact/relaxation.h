#pragma once
/// The fast contact solver (physics N12): time stepping on velocities (Stewart and Trinkle, "An implicit
/// time-stepping scheme for rigid body dynamics with inelastic collisions and Coulomb friction", 1996) in
/// many small sub-steps of one sweep of Gauss-Seidel each (Macklin et al., "Small steps in physics
/// simulation", 2019). Penetration is taken away by moving the bodies, at the end of the step, in a sweep
/// that is repeated where it pushes far; velocities never know of it.
///
/// One sweep leaves an error, which the next takes on as a change of velocity: the forces of a tall stack are
/// the springs of a spurious oscillator, and a mode that a sweep reduces by the share e swings at sqrt(e) per
/// sub-step and loses only e / 2 of it. So after its solution a patch goes a little way back towards the mean
/// of its forces over the last tenth of a second, as a lag in a control loop gives damping. Forces at rest
/// are their own mean, and what one sweep can solve alone it does again, so neither is touched by this.
///
/// What is solved is not the point but the patch, the up to four points of a manifold together: its bodies'
/// relative twist has six components, its impulses make a wrench of six, and a symmetric matrix of 6 x 6 that
/// is made once per step relates the two. Within a patch all is solved in these, whatever the number of
/// points. Eight patches that share no body are solved at once, one per SIMD lane, colour by colour of the
/// contact graph.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/collision/contact_frame.h"
#include "sim/collision/manifold.h"
#include "sim/contact/contact_coloring.h"
#include "sim/contact/contact_problem.h"
#include "sim/contact/patch_batch.h"
#include "sim/contact/relaxed_joints.h"
#include "sim/core/types.h"

namespace offstage::sim {

/// A body during a step of the fast solver.
struct RelaxedBody {
  Real inverse_mass = 0;                  ///< [1/kg]; 0: contacts do not move it, but it may move
  Mat3 inverse_inertia = Mat3::Zero();    ///< about the centre of mass, world axes [1/(kg m^2)]
  Vec3 velocity = Vec3::Zero();           ///< of the centre of mass [m/s]; in: at the start, out: at the end
  Vec3 angular_velocity = Vec3::Zero();   ///< world [rad/s]; likewise
  Vec3 free_acceleration = Vec3::Zero();  ///< mean over the step, without contacts [m/s^2]
  Vec3 free_angular_acceleration = Vec3::Zero();  ///< [rad/s^2]
  /// Out: what contacts and joints add to the free motion's momentum [N s], and to its angular momentum about
  /// the centre of mass [N m s]. Of contacts alone, what two bodies give each other is the same to rounding.
  Vec3 impulse = Vec3::Zero(), angular_impulse = Vec3::Zero();
  /// Out: what contacts add to the free motion of the step [m], [rad]: position = free position +
  /// displacement, orientation = exp(rotation_vector) free orientation.
  Vec3 displacement = Vec3::Zero(), rotation_vector = Vec3::Zero();

  /// Of what contacts and joints add, takes a share.
  void scale(Real share) {
    impulse *= share;
    angular_impulse *= share;
    displacement *= share;
    rotation_vector *= share;
  }
};

/// Up to four points where the bodies a and b touch or may soon. Its frame and its arms stay as they are
/// during the step; what their turning adds to the velocities is `gain`.
struct ContactPatch {
  struct Point {
    Real t = 0, k = 0;    ///< coordinates along the tangents, from the patch's centre [m]
    Real separation = 0;  ///< at the start of the step, negative in penetration [m]
    Real force = 0;       ///< normal [N]; in: a guess, that of the last step; out: at the end of this one
    Real mean_force = 0;  ///< over the time before [N]; in and out likewise
    Real impulse = 0;     ///< out: of the whole step [N s]
    Real shift = 0;       ///< out: mass times the way that it moved the bodies in the step [kg m]
  };
  uint32_t a = 0, b = 0;                            ///< indices of bodies; not both unmoved
  ContactFrame frame;                               ///< n from b to a
  Vec3 arm_a = Vec3::Zero(), arm_b = Vec3::Zero();  ///< from the centres of mass to the patch's centre [m]
  Vec3 offset = Vec3::Zero();  ///< (n, t, k), added to the relative velocity: moving surfaces [m/s]
  /// What turning arms and frames add to the relative velocity at the centre, in (n, t, k): gain s + bow s^2,
  /// where s goes evenly from -1 at the step's start to 1 at its end; and to the normal one per metre along t
  /// and k, growing like s [m/s], [1/s].
  Vec3 gain = Vec3::Zero(), bow = Vec3::Zero();
  Real gain_along_t = 0, gain_along_k = 0;
  bool turns = false;  ///< whether there is any
  /// Coulomb's coefficients. Equal ones make the round cone, with different ones each axis has its own limit.
  Real friction_t = 0, friction_k = 0;
  uint32_t count = 0;
  std::array<Point, 4> points;
  /// Of all points together: tangential [N] and about the normal [N m]; in and out like Point::force.
  Real force_t = 0, force_k = 0, torque_n = 0;
  Vec3 mean_friction = Vec3::Zero();     ///< the mean of these, like Point::mean_force
  Vec3 friction_impulse = Vec3::Zero();  ///< likewise, like Point::impulse
  Vec3 friction_shift = Vec3::Zero();    ///< likewise, like Point::shift
};

/// Gives a patch the points of a manifold, which is in world axes like the frame, whose n is its normal; the
/// bodies have these centres of mass. The points stay in the manifold's order. The patch's centre is that of
/// all points, or of the deepest alone.
void set_points(ContactPatch& patch, const Manifold& m, const ContactFrame& frame, const Vec3& centre_a,
                const Vec3& centre_b, bool at_deepest = false);

/// As many sub-steps as make them 1/1920 s or shorter; at least four. Each costs one sweep over the patches.
uint32_t relaxation_substeps(Real duration);

struct RelaxationDef {
  Real duration = 1.0 / 240;  ///< of the step [s], > 0
  uint32_t substeps = 8;      ///< > 0
};

/// Keeps its memory from step to step, and nothing else.
class RelaxationSolver {
 public:
  /// Moves the bodies through a step. Penetration is pushed out, gradually; where a gap is open, the bodies
  /// may approach to close it and no further. The answer depends on the arguments and their order alone, not
  /// on threads; oneTBB's are used if there is enough to do.
  ContactWork solve(std::span<RelaxedBody> bodies, std::span<ContactPatch> patches, const RelaxationDef& def,
                    RelaxedJoints* joints = nullptr);

 private:
  enum class Stage : uint8_t {
    start,
    prepare,
    solve,
    solve_next,   // in another sub-step
    solve_again,  // what the sweep before has struck
    start_joints,
    join,
    join_last,
    advance,
    advance_last,
    push,
    push_again,  // likewise
    finish,
    report
  };
  /// Blocks of a stage may run in any order and at the same time.
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
  bool is_needed(const Range& range) const;
  void run(const Range& range, uint32_t block);
  void start(uint32_t body);
  void extrapolate(uint32_t body);
  void solve(uint32_t batch, const Range& range);
  void push(uint32_t batch, const Range& range, Real threshold);
  void strike(const PatchBatch& batch, uint32_t sweep, FloatLanes impact, Real threshold);
  bool is_struck(uint32_t batch, uint32_t since) const;
  void advance(uint32_t body);
  void finish(uint32_t body);
  void report(uint32_t batch);
  void give(const ContactPatch& patch);
  bool has_joints() const { return joints_ && joints_->count() > 0; }

  std::span<RelaxedBody> bodies_;
  std::span<ContactPatch> patches_;
  RelaxationDef def_;
  RelaxedJoints* joints_ = nullptr;  // null: none
  Real substep_ = 0;
  std::vector<ContactColoring::Link> links_;
  ContactColoring coloring_;
  std::vector<PatchBatch> batches_;
  std::vector<BodyMotion> motions_;   // one more than bodies: of unused lanes
  std::vector<FloatLanes> last_;      // velocities of the sub-step before
  std::vector<FloatLanes> greatest_;  // by components, the greatest change of velocity in a sub-step
  std::vector<Real> late_;            // by body: see finish() [s]
  std::vector<SubstepTime> times_;    // and one of what would follow the last
  std::vector<Range> ranges_;
  // Sweeps are numbered from 1; those that strike a body leave their number with it.
  uint32_t sweeps_ = 0;
  std::vector<uint32_t> struck_;  // by body
  std::vector<uint8_t> strikes_;  // by sweep: some body
};

}  // namespace offstage::sim
