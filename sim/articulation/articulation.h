#pragma once
/// Bodies connected by joints (physics A1, A4, A5). An articulation computes the joint forces during a
/// motion; with these, joints stay connected to the accuracy of the integrator. Afterwards it removes the
/// remaining error by projection.

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
  JointFrame on_a, on_b;            ///< frame of the joint on a and on b, in the frame of that body
  Real length = 0;  ///< length of a rod or rope [m]; for gears, racks and screws the offset by whole turns
  Articulation* articulation = nullptr;

  bool is_broken = false;
  bool is_absent = false;  ///< whether the joint has not appeared yet, or was removed
  Real coordinate = 0;     ///< accumulated coordinate, for joints that count turns
  // Loads of the joint on body a, about the anchor.
  Wrench load;            ///< mean during the last motion, including the effect of contacts [N], [N m]
  Wrench impact_impulse;  ///< sum of its impulses in all collisions of this sub-step [N s], [N m s]
  Wrench borne;           ///< mean load over the last sub-step, including impacts [N], [N m]
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
/// Returns the motion of a body's centre of mass at a time [s]; for a body that is not dynamic, the motion of
/// its origin.
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
  /// Returns a fraction of a motion, from 0 to 1. Impulses at this time move the links as far as the same
  /// impulses distributed over the kicks.
  Real kicks_act_from() const { return (1 - 1 / kicks_) / 2; }
  /// With springs: computes the mean force and torque on each link over the part of the motion from t to t +
  /// h [s], by implicit Euler (physics A8). Springs and dampers of the joints are included. `forces` holds
  /// all other forces on entry, and the result [force, torque] on return.
  void kick(Real t, Real h, std::span<const LinkMotion> motion, std::span<const LinkMobility> mobility,
            std::span<Vec6> forces);
  /// Begins a motion from t to t + h.
  void begin_motion(Real t, Real h);
  /// Adds the joint forces at time t within the motion to `forces`. On entry, `forces` holds all other forces
  /// on the links [force, torque]. `motion`: state of the links at that time.
  void add_forces(Real t, std::span<const LinkMotion> motion, std::span<const LinkMobility> mobility,
                  std::span<Vec6> forces);
  /// Propagates impulses that acted on single bodies since the last settle() through the joints.
  void transmit_impulses(Real time, JointFigures& tally);
  /// Projects the bodies' `rigid` states onto the joint constraints at a time: first the positions, by the
  /// smallest mass-weighted displacement, then the velocities.
  void settle(Real time, JointFigures& tally);

  /// Evaluates the constraints at the current states Body::rigid or, if `at_start`, at the states at the
  /// start of the interval.
  void place(Real time, bool at_start = false);
  /// Evaluates the constraints for the contact solver, at the poses after a `fraction` of the interval. The
  /// interval lasts `duration` [s] and ends at `time` with the states Body::rigid. The fraction is the
  /// average time at which the impulses act. At the end of the interval, the arms would have turned further,
  /// and the impulses would change the angular momentum.
  void place_within(Real time, Real duration, Real fraction, Real substep);
  /// Projects velocities of the links at `time` onto the constraints of the last place_within().
  void project(Real time, std::span<Vec6> velocities);
  /// Returns the JointPlace of joint j at the state of the last place() or place_within(). `still_a` and
  /// `still_b` are storage for ends that are not links.
  JointPlace joint_place(std::size_t j, Real time, LinkMotion& still_a, LinkMotion& still_b) const {
    return place_of(j, time, motion_, still_a, still_b, before_);
  }
  /// Returns the JointPlace of joint j at the end of the interval; start_place(), at its start.
  JointPlace end_place(std::size_t j, Real time, LinkMotion& still_a, LinkMotion& still_b) const {
    return place_of(j, time, end_motion_, still_a, still_b);
  }
  JointPlace start_place(std::size_t j, Real start, LinkMotion& still_a, LinkMotion& still_b) const {
    return place_of(j, start, start_motion_, still_a, still_b);
  }
  /// Returns the change of the speed of a joint's row by a unit impulse of the row, for the constraints and
  /// poses of the last place_within(). Springs of joints are not included.
  Real mobility(const Joint& joint, const JointRow& row);
  bool has_bounded_rows() const { return has_bounded_rows_; }
  /// Adds an impulse along a row of a joint to the velocities at the interval's start, with the impulses of
  /// the other joints that follow from it, and to the loads of the joints. `arm`: vector from the centre of
  /// the joint's body a to the anchor, world axes [m]. Call place() at the start before.
  void strike(Joint& joint, const JointRow& row, const Vec3& arm, Real impulse);
  /// Whether impacts at limits with restitution are traced back to their times, so that these limits have no
  /// rows. In each sub-step this is done at most kMostRebounds times; afterwards rows replace it.
  bool traces_rebounds() const { return rebounds_left_ > 0; }
  void begin_rebounds() { rebounds_left_ = has_elastic_limits_ && !has_springs() ? kMostRebounds : 0; }
  void count_rebound() { --rebounds_left_; }
  void end_rebounds() { rebounds_left_ = 0; }
  const JointSystem& system() const { return system_; }
  JointSystem& system() { return system_; }
  /// Returns the linear system after place_within(). It contains the constraints, and the springs and dampers
  /// as soft rows, which resist changes of the free motion.
  JointSystem& inert_system() { return has_springs() ? *sprung_ : system_; }
  /// Multiplies the softness of the springs after place_within() by a factor. Returns whether the softness
  /// has changed.
  bool soften(Real factor);
  /// Adds constraint forces to the loads of the joints: the impulses of an interval divided by its duration
  /// [s]. The loads already contain the constraint forces of the free motion.
  void add_loads(std::span<const Vec6> impulses, Real duration);
  /// Adds constraint impulses of a collision to the loads of the joints.
  void add_impact_impulses(std::span<const Vec6> impulses);

  /// Prepares link_mobility() and respond() for impulses on links at the end of a sub-step, `time` [s]. The
  /// bodies must be in their poses at this time. The first call of link_mobility() or respond() factors the
  /// linear system.
  void begin_impulses(Real time);
  Mat6 link_mobility(uint32_t link, const Vec6& push) override;
  /// Returns for each link the changes of its velocities per unit of impulse and angular impulse on `link`.
  /// The matrix of `link` itself is link_mobility().
  std::vector<Mat6> link_responses(uint32_t link, const Vec6& push);
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
  std::vector<Driven> driven_a_, driven_b_;      // accelerations of driven links in this motion
  bool has_bounded_rows_ = false, has_kinematic_ = false, has_elastic_limits_ = false;
  static constexpr uint32_t kMostRebounds = 32;
  uint32_t rebounds_left_ = 0;
  std::vector<Momenta> settled_;  // momenta of the bodies after settle()
  JointSystem system_;

  // These exist only with springs: the constraints and the springs as soft rows, and the loads by the kicks.
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
  std::vector<const Stop*> stops_against(uint32_t link, const Vec6& push);
  Eigen::MatrixXd stop_matrix(std::span<const Stop* const> pressed, uint32_t link) const;
  Eigen::VectorXd stop_impulses() const;
  std::vector<Stop> stops_;  // computed since begin_impulses()
  std::mutex responding_;
  // Results since begin_impulses(), for the links that were used.
  std::vector<std::optional<Mat6>> link_mobility_;
  Real response_time_ = 0;
  bool is_placed_ = false;  // whether place() was called since begin_impulses()
  std::vector<Vec6> response_;
};

}  // namespace offstage::sim
