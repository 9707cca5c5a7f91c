#pragma once
/// The bodies that particles can hit, as they move during one sub-step, arranged for quick rejection. Dynamic
/// bodies are here like kinematic ones: a particle that hits one sees infinite mass and gives it no reaction
/// (P8 is not in this version), while its velocity still carries the particle along.

#include <algorithm>
#include <span>
#include <vector>

#include "sim/collision/bounding_tree.h"
#include "sim/collision/distance.h"

namespace offstage::sim {

/// A solid that moves from one pose to another during a sub-step at constant rates.
struct Obstacle {
  /// `duration` is the sub-step's length [s].
  Obstacle(const Solid& shape, const Pose& from, const Pose& to, Real duration, Real e, Real mu);

  /// Pose at a fraction of the sub-step.
  Pose at(Real fraction) const;
  /// Velocity of the solid's material point that is at `p` (world) at a fraction of the sub-step.
  Vec3 velocity_at(const Vec3& p, Real fraction) const {
    return velocity + angular_velocity.cross(p - start.position - fraction * (end.position - start.position));
  }
  /// In the frame of a turning solid a straight path is curved. Into how many straight pieces it must be cut
  /// so that they deviate from it by no more than kChordError of the particle's radius; bounded.
  int pieces(Real particle_radius) const;
  /// Around all places of the sub-step, in the world.
  Aabb swept_bounds() const;

  static constexpr Real kChordError = 0.02;

  Solid solid;
  Pose start, end;
  Vec3 velocity = Vec3::Zero(), angular_velocity = Vec3::Zero();  ///< mean over the sub-step, world
  Real turn = 0;                                                  ///< angle turned [rad]
  Real extent;                                                    ///< reach() of the solid
  Real restitution, friction;
};

/// A set of obstacles: planes in a list, the others in a tree of swept boxes.
class Obstacles {
 public:
  Obstacles() = default;
  explicit Obstacles(std::vector<Obstacle> obstacles);

  /// Calls visit(obstacle) for those that a sphere may touch on its way from a to b (world), wherever in the
  /// sub-step.
  template <class Visit>
  void near_path(const Vec3& a, const Vec3& b, Real radius, Visit&& visit) const {
    for (const PlanePath& plane : planes_)
      if (plane.height(a, b) < radius) visit(obstacles_[plane.obstacle]);
    if (boxed_.empty()) return;
    const Real margin = radius * (1 + Obstacle::kChordError);
    Aabb box(a.cwiseMin(b), a.cwiseMax(b));
    box.min().array() -= margin;
    box.max().array() += margin;
    tree_.overlapping(box, [&](uint32_t k) {
      if (boxes_[k].intersects(box)) visit(obstacles_[boxed_[k]]);
    });
  }

 private:
  /// A plane as n.x = offset in the world at the start and at the end of the sub-step.
  struct PlanePath {
    Vec3 start_normal, end_normal;
    Real start_offset, end_offset;
    uint32_t obstacle;

    /// Least height of either point over either plane.
    Real height(const Vec3& a, const Vec3& b) const {
      return std::min(std::min(start_normal.dot(a), start_normal.dot(b)) - start_offset,
                      std::min(end_normal.dot(a), end_normal.dot(b)) - end_offset);
    }
  };

  std::vector<Obstacle> obstacles_;
  std::vector<PlanePath> planes_;
  std::vector<uint32_t> boxed_;
  std::vector<Aabb> boxes_;
  AabbTree tree_;
};

}  // namespace offstage::sim
