#pragma once
/// Bodies that joints hold together (physics A1, A4, A5): the joint forces of their motion, so that they stay
/// together to the integrator's accuracy, and the removal of what it leaves.

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
  JointFrame on_a, on_b;            ///< in the bodies' frames
  Real length = 0;                  ///< of a rod
  Articulation* articulation = nullptr;

  bool is_broken = false;
  Real coordinate = 0;  ///< of joints that count turns
  // What it does to a, about the anchor.
  Wrench load;                       ///< in the last motion, with the contacts in it [N], [N m]
  Wrench impact_impulse;             ///< impulses of collisions in this sub-step [N s], [N m s]
  Wrench borne;                      ///< load and impacts of the last sub-step together [N], [N m]
  Vec6 reaction = Vec6::Zero();      ///< to contacts, by its constraints, as a guess
  std::array<Real, 9> efforts = {};  ///< of its rows with bounds, as a guess (joint_limits.h)

  /// Whether it does more than hold its bodies together.
  bool has_bounded_rows() const;
};

/// What joints did in a step: figures for StepReport.
struct JointTally {
  uint64_t unsolved = 0;  ///< systems that could not be factored, or positions that did not come together
  Real error = 0;         ///< greatest that was left of a constraint [m], of angles [rad]

  void add(const JointTally& t) {
    unsolved += t.unsolved;
    error = error < t.error ? t.error : error;
  }
};

/// Whether its coordinate is an angle that can go round and round; then Joint::coordinate counts its turns.
bool counts_turns(const Joint& joint);
/// Motion of a body's centre of mass, or origin if it is not dynamic, at a time.
LinkMotion link_motion(const Body* body, Real time);
/// Where a joint is on a body, from the point that link_motion() tells of.
JointFrame link_frame(const Body* body, const JointFrame& in_body);

class Articulation final : public JointedBodies {
 public:
  /// All joints of one connected component, of which each joins at least one dynamic body.
  explicit Articulation(std::vector<Joint*> joints);

  std::span<Body* const> bodies() const { return bodies_; }  ///< the dynamic ones, in slot order
  std::span<Joint* const> joints() const { return joints_; }

  /// An estimate of the fastest swinging of links under the forces that their joints had last [rad/s].
  Real greatest_frequency() const;
  /// A motion from t to t + h begins.
  void begin_motion(Real t, Real h);
  /// At a time within: adds the joint forces to `forces` [force, torque] of the links, which are about to
  /// move from `motion` under these.
  void add_forces(Real t, std::span<const LinkMotion> motion, std::span<const LinkMobility> mobility,
                  std::span<Vec6> forces);
  /// Passes on, through the joints, what has pushed single bodies since they were settled last.
  void transmit_impulses(Real time, JointTally& tally);
  /// Puts the bodies' `rigid` back together at a time: positions by the shortest way, weighted with the
  /// masses, then velocities.
  void settle(Real time, JointTally& tally);

  /// Takes the constraints of the bodies as `rigid` has them, for what impulses of contacts add to their
  /// motion; or as they were at their interval's `start`.
  void place(Real time, bool at_start = false);
  /// Where a joint is, since place().
  JointPlace joint_place(std::size_t j, Real time, LinkMotion& still_a, LinkMotion& still_b) const {
    return place_of(j, time, motion_, still_a, still_b);
  }
  bool has_bounded_rows() const { return has_bounded_rows_; }
  const JointSystem& system() const { return system_; }
  JointSystem& system() { return system_; }
  /// The joints bear these impulses of their constraints over a duration, besides the forces of the motion.
  void add_loads(std::span<const Vec6> impulses, Real duration);
  /// Or all at once.
  void add_impact_impulses(std::span<const Vec6> impulses);

  /// A sub-step ends at this time; impulses on links are then those on the bodies as they are now. The system
  /// is factored once, when the first link is asked for.
  void begin_impulses(Real time);
  Mat6 link_mobility(uint32_t link, const Vec6& push) override;
  void respond(uint32_t link, const Vec6& impulse, std::span<Vec6> velocities) override;
  std::size_t link_count() const override { return bodies_.size(); }

  /// Brings the coordinates that count whole turns up to date; at least once in half a turn.
  void count_turns(Real time);

 private:
  struct Driven {
    Vec3 acceleration = Vec3::Zero(), angular_acceleration = Vec3::Zero();
  };

  struct Momenta {
    Vec3 linear, angular;
  };

  JointPlace place_of(std::size_t j, Real time, std::span<const LinkMotion> motion, LinkMotion& still_a,
                      LinkMotion& still_b) const;
  void read_rows(Real time, std::span<const LinkMotion> motion);
  void read_bodies(bool at_start = false);
  void residual(Real time, std::span<const Vec6> velocities, std::span<Vec6> result) const;
  Wrench wrench(std::size_t j, const Vec6& impulse, std::span<const LinkMotion> motion) const;

  std::vector<Joint*> joints_;
  std::vector<Body*> bodies_;
  std::vector<JointFrame> frames_a_, frames_b_;  // from the links' centres
  std::vector<Driven> driven_a_, driven_b_;      // in this motion
  bool has_bounded_rows_ = false, has_kinematic_ = false;
  std::vector<Momenta> settled_;  // of the bodies, as settle() left them
  JointSystem system_;

  std::vector<JointRows> rows_;
  std::vector<LinkMotion> motion_;
  std::vector<LinkMobility> mobility_;
  std::vector<Vec6> velocities_, change_, impulses_;

  /// A limit that a joint has reached and does not leave. Its row is such that the speed away from it is
  /// positive.
  struct Stop {
    uint32_t a, b;  // links; kDriven: none that moves
    Vec6 on_a, on_b;
    std::vector<Vec6> response;  // of the links to its unit impulse

    Real speed(std::span<const Vec6> velocities) const;
  };

  void place_for_impulses();
  void find_stops();
  void pass_on(std::span<Vec6> velocities);
  void find_response(uint32_t link, const Vec6& impulse);
  Mat6 free_mobility(uint32_t link);
  Eigen::VectorXd stop_impulses() const;
  std::vector<Stop> stops_;  // since begin_impulses()
  std::mutex responding_;
  std::vector<std::optional<Mat6>> link_mobility_;  // since begin_impulses(), of the links asked for
  Real response_time_ = 0;
  bool is_placed_ = false;  // since begin_impulses()
  std::vector<Vec6> response_;
};

}  // namespace offstage::sim
