#pragma once
/// Bodies connected by joints (physics A1, A4, A5). An articulation computes the joint forces, which keep the
/// joints connected to the integrator's accuracy, and then projects away the remaining error.

#include <array>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "sim/articulation/joint_system.h"
#include "sim/dynamics/body.h"
#include "sim/dynamics/body_impulses.h"
#include "sim/dynamics/force_field.h"

namespace offstage::sim {

class Articulation;

/// A joint of the world.
struct Joint {
  JointDef def;
  JointHandle handle;
  Body *a = nullptr, *b = nullptr;  ///< b may be null: the world
  JointFrame on_a, on_b;            ///< frame of the joint on a and on b, each in the body's frame
  Real length = 0;                  ///< length of a rod or rope; offset of a coupling by whole turns
  Articulation* articulation = nullptr;

  bool is_broken = false;
  bool is_absent = false;  ///< whether the joint has not appeared yet, or was removed
  Real coordinate = 0;     ///< accumulated coordinate, for joints that count turns
  // Loads of the joint on body a, about the anchor.
  Wrench load;            ///< mean during the last motion, including the effect of contacts [N], [N m]
  Wrench impact_impulse;  ///< sum of the joint's impulses in the collisions of this sub-step [N s], [N m s]
  Wrench borne;           ///< mean load of the last sub-step including impacts [N], [N m]
  /// Impulse of the joint's constraints in the last contact solution; initial guess of the next one.
  Vec6 reaction = Vec6::Zero();
  /// Impulses of the joint's rows with bounds (joint_limits.h) in the last solution; initial guess of the
  /// next one.
  std::array<Real, 12> efforts = {};

  bool has_spring() const { return def.stiffness > 0; }
  /// Whether the joint has a limit, a motor, friction, or a damper without a spring.
  bool has_rows_besides_spring() const;
  bool has_bounded_rows() const { return has_spring() || has_rows_besides_spring(); }
};

/// Whether the joint's coordinate is an unbounded angle; Joint::coordinate then counts whole turns.
bool counts_turns(const Joint& joint);
/// Motion of a body at a time: the motion of its centre of mass, or of its origin if it is not dynamic.
LinkMotion link_motion(const Body* body, Real time);
/// Frame of a joint on a body, relative to the point whose motion link_motion() returns.
JointFrame link_frame(const Body* body, const JointFrame& in_body);

class Articulation final : public JointedBodies {
 public:
  /// Constructs the articulation of all joints of one connected component. Each joint must have at least one
  /// dynamic body.
  explicit Articulation(std::vector<Joint*> joints);

  std::span<Body* const> bodies() const { return bodies_; }  ///< the dynamic bodies, in slot order
  std::span<Joint* const> joints() const { return joints_; }

  bool has_springs() const { return !sprung_rows_.empty(); }
  /// Estimates the highest angular frequency at which links swing under the last forces of their joints
  /// [rad/s].
  Real greatest_frequency() const;
  /// With springs: the number of parts of an interval of this duration [s] for which kick() is stable.
  Real kicks_needed(Real duration) const;
  /// With springs, before a motion: the number of times that kick() will be called in it.
  void set_kicks(Real count) { kicks_ = count; }
  /// The fraction of a motion from which impulses have to act to move the links as the forces of its kicks
  /// do.
  Real kicks_act_from() const { return (1 - 1 / kicks_) / 2; }
  /// With springs: the mean forces on the links [force, torque] that change their velocities at t by all
  /// forces of the part from t to t + h, the springs and dampers of the joints included, by implicit Euler
  /// (physics A8). `forces` holds all other forces on entry.
  void kick(Real t, Real h, std::span<const LinkMotion> motion, std::span<const LinkMobility> mobility,
            std::span<Vec6> forces);
  /// Begins a motion from t to t + h.
  void begin_motion(Real t, Real h);
  /// Adds the joint forces at a time within the motion to `forces` [force, torque] of the links. `motion` is
  /// the state of the links, and `forces` holds all other forces on entry.
  void add_forces(Real t, std::span<const LinkMotion> motion, std::span<const LinkMobility> mobility,
                  std::span<Vec6> forces);
  /// Propagates impulses that acted on single bodies since the last settle() through the joints.
  void transmit_impulses(Real time, JointFigures& tally);
  /// Projects the bodies' `rigid` states onto the joint constraints at a time: first the positions, by the
  /// smallest mass-weighted displacement, then the velocities.
  void settle(Real time, JointFigures& tally);

  /// Evaluates the constraints at the bodies' current `rigid` states or, if `at_start`, at those of their
  /// interval's start.
  void place(Real time, bool at_start = false);
  /// Evaluates the constraints for the contact solver at the poses after `fraction` of an interval of
  /// `duration` [s] that ends at `time` with the bodies' `rigid` states. There the impulses of the interval
  /// act, on average. At the poses of the interval's end they would change the angular momentum, because
  /// their arms turn until then.
  void place_within(Real time, Real duration, Real fraction, Real substep);
  /// Projects velocities of the links at `time` onto the constraints of the last place_within().
  void project(Real time, std::span<Vec6> velocities);
  /// Place of a joint at the state for which place() or place_within(), whichever was called last, evaluated
  /// the constraints.
  JointPlace joint_place(std::size_t j, Real time, LinkMotion& still_a, LinkMotion& still_b) const {
    return place_of(j, time, motion_, still_a, still_b, before_);
  }
  /// Place of a joint at the end of the interval; start_place() has that at its start.
  JointPlace end_place(std::size_t j, Real time, LinkMotion& still_a, LinkMotion& still_b) const {
    return place_of(j, time, end_motion_, still_a, still_b);
  }
  JointPlace start_place(std::size_t j, Real start, LinkMotion& still_a, LinkMotion& still_b) const {
    return place_of(j, start, start_motion_, still_a, still_b);
  }
  bool has_bounded_rows() const { return has_bounded_rows_; }
  const JointSystem& system() const { return system_; }
  JointSystem& system() { return system_; }
  /// After place_within(), the system of the constraints, and of the springs and dampers as soft rows, which
  /// resist changes of the free motion.
  JointSystem& inert_system() { return has_springs() ? *sprung_ : system_; }
  /// Multiplies the softness of the springs after place_within() by a factor. Returns whether it has changed.
  bool soften(Real factor);
  /// Adds constraint forces to the loads of the joints: the impulses of an interval divided by its duration
  /// [s]. The loads already contain the constraint forces of the free motion.
  void add_loads(std::span<const Vec6> impulses, Real duration);
  /// Adds constraint impulses of a collision to the loads of the joints.
  void add_impact_impulses(std::span<const Vec6> impulses);

  /// Prepares link_mobility() and respond() for impulses on links at the end of a sub-step, at this time and
  /// the bodies' current poses. The system is factored at the first of these calls.
  void begin_impulses(Real time);
  Mat6 link_mobility(uint32_t link, const Vec6& push) override;
  void respond(uint32_t link, const Vec6& impulse, std::span<Vec6> velocities) override;
  std::size_t link_count() const override { return bodies_.size(); }

  /// Updates the coordinates that count whole turns. It must be called at least once per half turn.
  void count_turns(Real time);

 private:
  struct Driven {
    Vec3 acceleration = Vec3::Zero(), angular_acceleration = Vec3::Zero();
  };

  struct Momenta {
    Vec3 linear, angular;
  };

  JointPlace place_of(std::size_t j, Real time, std::span<const LinkMotion> motion, LinkMotion& still_a,
                      LinkMotion& still_b, Real before = 0) const;
  void read_rows(Real time, std::span<const LinkMotion> motion, Real before = 0);
  void read_bodies(bool at_start = false);
  void residual(Real time, std::span<const Vec6> velocities, std::span<Vec6> result) const;
  Wrench wrench(std::size_t j, const JointRows& rows, const Vec6& impulse,
                std::span<const LinkMotion> motion) const;
  void read_sprung_rows(Real t, Real h, std::span<const LinkMotion> motion);
  JointSystem* factorize_inert(Real time);

  std::vector<Joint*> joints_;
  std::vector<Body*> bodies_;
  std::vector<JointFrame> frames_a_, frames_b_;  // relative to the links' centres
  std::vector<Driven> driven_a_, driven_b_;      // driven links in this motion
  bool has_bounded_rows_ = false, has_kinematic_ = false;
  std::vector<Momenta> settled_;  // momenta of the bodies after settle()
  JointSystem system_;

  // With springs: the constraints and the springs as soft rows, and the loads by the kicks.
  std::optional<JointSystem> sprung_;
  std::vector<JointRows> sprung_rows_;
  std::vector<Wrench> kick_loads_;
  Real kicks_ = 1, kick_duration_ = 0, softened_ = 1;

  std::vector<JointRows> rows_;
  std::vector<LinkMotion> motion_, start_motion_, end_motion_;
  Real before_ = 0;  // time by which the poses of motion_ are earlier than its velocities [s]
  std::vector<LinkMobility> mobility_;
  std::vector<Vec6> velocities_, change_, impulses_;

  /// A limit that a joint has reached and is not leaving. The speed along its row is positive away from the
  /// limit.
  struct Stop {
    uint32_t a, b;  // links; kDriven: no movable link
    Vec6 on_a, on_b;
    std::vector<Vec6> response;  // velocity changes of the links due to a unit impulse of the row

    Real speed(std::span<const Vec6> velocities) const;
  };

  void place_for_impulses();
  void find_stops();
  void pass_on(std::span<Vec6> velocities);
  void find_response(uint32_t link, const Vec6& impulse);
  Mat6 free_mobility(uint32_t link);
  Eigen::VectorXd stop_impulses() const;
  std::vector<Stop> stops_;  // computed since begin_impulses()
  std::mutex responding_;
  // Computed since begin_impulses(), for the links that were used.
  std::vector<std::optional<Mat6>> link_mobility_;
  Real response_time_ = 0;
  bool is_placed_ = false;  // whether place() was called since begin_impulses()
  std::vector<Vec6> response_;
};

}  // namespace offstage::sim
