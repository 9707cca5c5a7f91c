#pragma once
/// The bodies as obstacles of particles and cloths in a sub-step.

#include "sim/collision/obstacles.h"
#include "sim/world/active_bodies.h"

namespace offstage::sim {

/// Returns a body as an obstacle that moves along its path in a sub-step of length h [s]. Impulses can move
/// the obstacle if the body is dynamic and not `is_fixed`.
Obstacle swept_obstacle(const Body& body, Real h, bool is_fixed = false);

/// The obstacles of a sub-step. Bodies that cannot move are prepared again only after a change (physics E9).
class ObstacleSet {
 public:
  /// Prepares a sub-step of length h [s]. `fixes_dynamic`: whether dynamic bodies stand still, as in
  /// World::prewarm().
  void update(const WorldState& world, const ActiveBodies& active, Real h, bool fixes_dynamic);
  const Obstacles& fixed() const { return fixed_; }
  Obstacles& moving() { return moving_; }

 private:
  Obstacles fixed_, moving_;
  bool is_current_ = false, fixes_dynamic_ = false;
  uint64_t version_ = 0;  // ActiveBodies::version() for which `fixed_` was prepared
};

}  // namespace offstage::sim
