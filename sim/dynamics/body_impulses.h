#pragma once
/// What particles do to dynamic bodies in a sub-step (physics P8, A3). It moves them from the next sub-step
/// on, but each particle that strikes a body already meets it with the velocity that the particles before it
/// have left it: so that the impulses of many, together, take no more momentum and energy than there is. An
/// impulse on a body that joints hold goes through these, and moves all that they hold together.

#include <map>
#include <span>
#include <unordered_map>
#include <vector>

#include "sim/collision/obstacles.h"
#include "sim/linear/block_cholesky.h"

namespace offstage::sim {

/// Bodies that joints hold together, as impulses find them at the end of a sub-step. Velocities and impulses
/// are those of the centre of mass and about it, in world axes.
class JointedBodies {
 public:
  virtual ~JointedBodies() = default;
  /// The velocity that each unit impulse and angular impulse on a link gives to that link, through the
  /// joints; 6 x 6. For impulses in about the direction of `push`: limits that are reached hold against those
  /// that press on them. May be called from several threads at the same time.
  virtual Mat6 link_mobility(uint32_t link, const Vec6& push) = 0;
  /// What an impulse on a link adds to the velocities of all links, limits included.
  virtual void respond(uint32_t link, const Vec6& impulse, std::span<Vec6> velocities) = 0;
  virtual std::size_t link_count() const = 0;
};

class BodyImpulses {
 public:
  /// Where a body is among jointed ones; null: no joint holds it.
  struct Link {
    JointedBodies* bodies = nullptr;
    uint32_t index = 0;
  };

  /// A sub-step begins: nothing has been struck. `links` are by Obstacle::body; those behind the end have
  /// none.
  void begin(std::span<const Link> links);

  /// K of P8: the velocity that a unit impulse at `arm` from the centre of mass gives to the point there,
  /// world axes [1/kg]; zero of what is not dynamic. `push` is the direction from which it comes, unit: a
  /// joint at its limit gives way to one side only. May be called from several threads while nothing is
  /// pushed.
  Mat3 mobility(const Obstacle& o, const Vec3& arm, const Vec3& push) const;
  /// Velocity of the point at `arm` from the centre of mass, as the impulses so far leave it [m/s].
  Vec3 velocity(const Obstacle& o, const Vec3& arm) const;
  void push(const Reaction& reaction);

  /// What each body got, in the order of their numbers.
  std::vector<Reaction> sums() const;

 private:
  Link link(uint32_t body) const { return body < links_.size() ? links_[body] : Link{}; }

  std::span<const Link> links_;
  std::map<uint32_t, Reaction> sums_;                             // by body
  std::unordered_map<JointedBodies*, std::vector<Vec6>> gained_;  // velocities of the links
};

}  // namespace offstage::sim
