#pragma once
/// Impulses of particles on dynamic bodies in a sub-step (physics P8, A3). The impulses change the velocities
/// of the bodies from the next sub-step on. Each collision of a particle uses the velocity that the body has
/// after the previous collisions. Therefore many impulses together never transfer too much momentum or
/// energy. An impulse on a body with joints acts on its whole articulation. The loads of resting particles
/// are expected: they act already as forces while the bodies move.

#include <map>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "sim/collision/obstacles.h"
#include "sim/core/twist.h"
#include "sim/linear/block_cholesky.h"

namespace offstage::sim {

/// Bodies of an articulation, and their response to impulses at the end of a sub-step. Velocities refer to
/// the centre of mass, and impulses act at it. Both are in world axes.
class JointedBodies {
 public:
  virtual ~JointedBodies() = default;
  /// Returns the 6 x 6 mobility of a link, joints included: its change of velocity and angular velocity per
  /// unit of impulse and angular impulse on it. It is valid for impulses roughly in the direction of `push`,
  /// because a joint at a limit resists only impulses towards the limit. It may be called from several
  /// threads at the same time.
  virtual Mat6 link_mobility(uint32_t link, const Vec6& push) = 0;
  /// Adds the changes of velocity of all links due to an impulse on one link to `velocities`. Joint limits
  /// are taken into account.
  virtual void respond(uint32_t link, const Vec6& impulse, std::span<Vec6> velocities) = 0;
  virtual std::size_t link_count() const = 0;
};

class BodyImpulses {
 public:
  /// Articulation of a body (null if it has no joints), and its index there.
  struct Link {
    JointedBodies* bodies = nullptr;
    uint32_t index = 0;
  };

  /// Impulses of resting particles on a body in a sub-step.
  struct Load {
    Wrench expected;  ///< expected in this sub-step; the velocity of the body at its end contains it already
    /// Mobility of a body that rests on others; empty for other bodies.
    std::optional<Mat6> mobility = {};
  };

  /// Begins a sub-step and removes all impulses. `links` is indexed by Obstacle::body; bodies beyond its end
  /// have no joints. `expected`: by body.
  void begin(std::span<const Link> links, std::map<uint32_t, Load> expected = {});

  /// Mobility K of physics P8 at the point `arm` from the centre of mass: change of the point's velocity per
  /// unit of impulse there, world axes [1/kg]; zero for a body that is not dynamic. `push`: unit direction of
  /// the impulse, because a joint at its limit yields to one side only. It may be called from several threads
  /// while no impulse is added.
  Mat3 mobility(const Obstacle& o, const Vec3& arm, const Vec3& push) const;
  /// The 6 x 6 mobility of a dynamic body, as JointedBodies::link_mobility().
  Mat6 mobility(const Obstacle& o, const Vec6& push) const;
  /// The expected impulse on a body; zero if there is none.
  Wrench expected(uint32_t body) const;
  /// Change of the velocity and the angular velocity of a dynamic body by the impulses so far.
  Vec6 gained(const Obstacle& o) const;
  /// Velocity of the point at `arm` from the centre of mass, after the impulses so far [m/s].
  Vec3 velocity(const Obstacle& o, const Vec3& arm) const;
  void push(const Reaction& reaction);
  /// Subtracts the expected impulses. It is called when all resting contacts have added their impulses.
  void subtract_expected();

  /// Sum of the impulses on each body less the expected ones, in ascending order of their indices.
  std::vector<Reaction> sums() const;
  /// Sums of the impulses of resting contacts (Reaction::is_load), by body.
  const std::map<uint32_t, Wrench>& loads() const { return loads_; }

 private:
  Link link(uint32_t body) const { return body < links_.size() ? links_[body] : Link{}; }
  const Mat6* held_mobility(uint32_t body) const;

  std::span<const Link> links_;
  std::map<uint32_t, Reaction> sums_;                             // by body
  std::map<uint32_t, Load> expected_;                             // by body
  std::map<uint32_t, Wrench> loads_;                              // by body
  std::unordered_map<JointedBodies*, std::vector<Vec6>> gained_;  // velocity changes of the links
};

}  // namespace offstage::sim
