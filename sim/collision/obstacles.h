#pragma once
/// The bodies with which particles can collide, and their motion during one sub-step. Impulses of particles
/// change the motion from the next sub-step on, except that resting contacts move the end of a body's path
/// (physics P8).

#include <algorithm>
#include <span>
#include <vector>

#include "sim/collision/bounding_tree.h"
#include "sim/collision/distance.h"

namespace offstage::sim {

/// A solid that moves from one pose to another during a sub-step at constant rates.
struct Obstacle {
  /// `duration`: length of the sub-step [s]; `e`: restitution; `mu`: friction.
  Obstacle(const Solid& shape, const Pose& from, const Pose& to, Real duration, Real e, Real mu);

  /// Sets the path of a sub-step of this length [s].
  void set_path(const Pose& from, const Pose& to, Real duration);
  /// Pose at a fraction of the sub-step, without the rotation of a sphere, which does not move its surface.
  Pose at(Real fraction) const;
  /// Pose of the body at a fraction of the sub-step. Points that are fastened to a sphere turn with it.
  Pose turned_at(Real fraction) const;
  /// Velocity of the solid's material point that is at `p` (world) at a fraction of the sub-step.
  Vec3 velocity_at(const Vec3& p, Real fraction) const {
    return velocity + angular_velocity.cross(p - start.position - fraction * (end.position - start.position));
  }
  /// Position of the solid's centre of mass at a fraction of the sub-step.
  Vec3 centre_at(Real fraction) const { return at(fraction).point_to_world(centre); }
  /// Unit direction of the friction axis where the surface has the normal n (world) at a fraction of the
  /// sub-step; zero where friction is the same in all directions.
  Vec3 friction_axis_on(const Vec3& n, Real fraction) const;
  /// Velocity along the surface of a conveyor relative to the solid, where the surface has the normal n
  /// (world) at a fraction of the sub-step, world axes [m/s].
  Vec3 conveying_velocity(const Vec3& n, Real fraction) const;
  /// Mobility K of physics P8 at the point `arm` from the centre of mass: change of the point's velocity per
  /// unit of impulse there, world axes [1/kg].
  Mat3 mobility(const Vec3& arm) const;
  bool is_dynamic() const { return inverse_mass > 0; }
  /// Returns the number of straight pieces into which a particle's path is divided in the solid's frame. If
  /// the solid turns, a straight path is curved in this frame. The pieces deviate from the curve by at most
  /// kChordError of the particle's radius, unless the upper limit of the number is reached.
  int pieces(Real particle_radius) const;
  /// Box in the world around all positions of the solid during the sub-step.
  Aabb swept_bounds() const;

  static constexpr Real kChordError = 0.02;

  Solid solid;
  Pose start, end;
  /// Mean velocity and angular velocity over the sub-step, world axes [m/s], [rad/s].
  Vec3 velocity = Vec3::Zero(), angular_velocity = Vec3::Zero();
  Real turn = 0;  ///< angle by which the surface turns [rad]; 0 for a sphere
  /// Greatest distance of the solid's points from the origin of its frame [m].
  Real extent;
  Real restitution, friction;
  Real cross_friction = 1;  ///< friction across the friction axis, divided by friction along it
  Vec3 friction_axis =
      Vec3::Zero();  ///< direction of the surface's friction axis, in the solid's frame; zero: none
  Vec3 surface_velocity = Vec3::Zero();  ///< BodyDef::surface_velocity
  uint32_t body = 0;                     ///< the world's index of the body
  Real inverse_mass = 0;                 ///< inverse mass [1/kg]; 0: particles do not move it
  /// Inverse inertia about the centre of mass, world axes at the end of the sub-step [1/(kg m^2)].
  Mat3 inverse_inertia = Mat3::Zero();
  Vec3 centre = Vec3::Zero();  ///< centre of mass in the solid's frame
  /// For a dynamic body: velocity of the centre of mass and angular velocity at the end of the sub-step,
  /// world axes.
  Vec3 end_velocity = Vec3::Zero(), end_spin = Vec3::Zero();
};

/// Impulse of a particle on a body.
struct Reaction {
  uint32_t body;         ///< Obstacle::body
  Vec3 impulse;          ///< [N s]
  Vec3 angular_impulse;  ///< angular impulse about the centre of mass [N m s]
  bool is_load = false;  ///< whether it comes from a resting contact, which may last
};

/// A set of obstacles. Planes are in a list; all other obstacles are in a tree of swept boxes.
class Obstacles {
 public:
  Obstacles() = default;
  explicit Obstacles(std::vector<Obstacle> obstacles);

  std::span<const Obstacle> all() const { return obstacles_; }
  /// Changes the end of an obstacle's path in a sub-step of length h [s] by a small distance.
  void move_end(const Obstacle& of, const Pose& end, Real h);

  /// Calls visit(obstacle) for each obstacle that a sphere may touch on its path from a to b (world) within
  /// the sub-step. The test is conservative.
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

    /// Returns the smallest of the heights of both points above the plane at the start and at the end.
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
