#pragma once
/// The cloths with which particles collide during one sub-step (physics F9). The corners of a triangle move
/// straight from their positions at the start of the sub-step to those at its end. Impulses of particles
/// change the velocities of the corners, which move with them from the next sub-step on. Corners that are
/// pinned to a dynamic body pass impulses on to this body and its joints.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sim/collision/bounding_tree.h"
#include "sim/dynamics/body_impulses.h"

namespace offstage::sim {

class ClothObstacles {
 public:
  /// A collision of a particle with a triangle of cloth.
  struct Hit {
    uint32_t triangle;
    Real fraction;  ///< time as a fraction of the sub-step
    Vec3 position;  ///< position of the particle's centre
    Vec3 normal;    ///< unit vector from the nearest point of the triangle to the particle's centre
    Real distance;  ///< distance between these two points [m]
    Vec3 weights;   ///< barycentric coordinates of the nearest point
  };

  /// A point of a cloth that is pinned to a dynamic body.
  struct Pin {
    uint32_t point;   ///< its index in the cloth
    uint32_t holder;  ///< number of the body, from add_holder()
    Real mass;        ///< mass of the point that moves with the body [kg]; 0 if the body sleeps
  };

  /// Removes all cloths and holders. Impulses on the bodies that hold cloth will be added to `impulses`.
  void clear(BodyImpulses& impulses);
  /// Adds a dynamic body that holds points of cloths. Returns its number.
  uint32_t add_holder(const Obstacle& body);
  /// Adds a cloth. `from` and `to`: positions of its points at the start and the end of the sub-step [m];
  /// `velocities` at the end [m/s]; `inverse_masses` [1/kg], 0 for pinned points and for points that
  /// particles do not move.
  void add(std::span<const Vec3> from, std::span<const Vec3> to, std::span<const Vec3> velocities,
           std::span<const Real> inverse_masses, std::span<const Triangle> triangles, Real friction,
           std::span<const Pin> pins = {});
  /// Prepares the search, after all cloths have been added.
  void build();
  bool empty() const { return triangles_.empty(); }

  /// Returns the first hit of a sphere whose centre moves straight from a, at the fraction `from` of the
  /// sub-step, to b at its end; empty if there is none before the fraction `latest`. A sphere that is closer
  /// to a triangle than its radius at first hits it at once if it approaches, and otherwise comes hardly
  /// closer.
  std::optional<Hit> first_hit(const Vec3& a, const Vec3& b, Real radius, Real from, Real latest) const;
  /// Returns the end of the path of a particle that must not pass cloth: b, or the place to which the first
  /// triangle that it meets takes it along. Where several layers of cloth close on it, it comes as close to
  /// them as necessary.
  Vec3 held_end(const Vec3& a, const Vec3& b, Real radius, Real from) const;
  /// Returns whether the centre of a particle passes cloth on a straight line at a fraction of the sub-step.
  bool separates(const Vec3& a, const Vec3& b, Real fraction) const;
  /// Returns the distance at which particles of a radius are kept from cloth [m].
  static Real kept_distance(Real radius);

  /// Displacement of the point that was hit, from the time of the hit to the end of the sub-step [m].
  Vec3 displacement(const Hit& hit) const;
  /// Position at the end of the sub-step of a particle that moves with the triangle from the hit on.
  Vec3 carried(const Hit& hit) const;
  struct Collider {
    Real mass, restitution, friction;
  };
  struct Impact {
    Vec3 impulse = Vec3::Zero();  ///< on the particle [N s]
    bool strikes = false;         ///< whether it counts as a collision, and not as a resting contact
    bool bounces = false;
  };
  /// Collides a particle of the velocity v with the cloth, which gets the opposite impulse. `gain`: speed of
  /// approach that forces restore within a sub-step [m/s]. A bounce that would end within the sub-step does
  /// not take place (E6).
  Impact collide(const Hit& hit, const Vec3& v, const Collider& particle, Real gain);

  /// Velocity of the point that was hit at the end of the sub-step, with all impulses so far [m/s].
  Vec3 velocity(const Hit& hit) const;
  /// Returns the impulse on a particle [N s] that collides with the cloth at the relative velocity `u`, which
  /// approaches [m/s].
  Vec3 impulse(const Hit& hit, const Vec3& u, const Collider& particle) const;
  /// Applies an impulse to the cloth at the point that was hit [N s].
  void push(const Hit& hit, const Vec3& impulse);

  /// Changes the velocities of pinned points by the impulses on their holders. Call it after all collisions.
  void finish();
  /// Velocities of a cloth's points with all impulses, and its number of collisions, in the order of add().
  std::span<const Vec3> velocities(std::size_t cloth) const;
  uint64_t hits(std::size_t cloth) const { return cloths_[cloth].hits; }

 private:
  struct ClothTriangle {
    Triangle corners;
    uint32_t cloth;
    bool operator==(const ClothTriangle&) const = default;
  };
  struct Sheet {
    std::size_t first;  // its first point
    Real friction;
    uint64_t hits = 0;
  };
  /// The path of a particle's centre: its position at the fraction `from`, and displacement per sub-step.
  struct Path {
    Vec3 start, rate;
    Real from, radius;
    Vec3 at(Real fraction) const { return start + (fraction - from) * rate; }
  };

  Vec3 corner(uint32_t point, Real fraction) const {
    return from_[point] + fraction * (to_[point] - from_[point]);
  }
  std::optional<Hit> hit(uint32_t triangle, const Path& path, Real latest) const;

  /// A dynamic body that holds points.
  struct Holder {
    Obstacle body;
    Mat6 carried = Mat6::Zero();  // mass matrix of the points about its centre of mass
    Vec6 gained = Vec6::Zero();   // change of its velocity by hits on its points
  };
  static constexpr uint32_t kNone = ~0u;
  using PointVelocity = Eigen::Matrix<Real, 3, 6>;
  /// The part of a holder in a hit: the velocity of the point that was hit is `at` times that of the holder,
  /// plus the velocities of other corners.
  struct Share {
    uint32_t holder;
    PointVelocity at;
  };
  /// Calls f(share) for each holder of the corners of the triangle that was hit.
  template <class F>
  void for_each_holder(const Hit& hit, F&& f) const;
  /// Mobility of a holder and its points for an impulse roughly in this direction.
  Mat6 holder_mobility(const Holder& holder, const Vec6& push) const;
  Real mobility_of_free_corners(const Hit& hit) const;
  bool is_held(const Hit& hit) const;

  std::vector<Vec3> from_, to_, velocity_;
  std::vector<Real> inverse_mass_;
  std::vector<uint32_t> holder_;  // by point: number of the dynamic body that holds it, or kNone
  std::vector<Holder> holders_;
  BodyImpulses* impulses_ = nullptr;
  std::vector<ClothTriangle> triangles_;
  std::vector<ClothTriangle> in_tree_;  // the triangles for which the tree was built
  std::vector<Sheet> cloths_;
  std::vector<Aabb> boxes_;
  AabbTree tree_;
};

}  // namespace offstage::sim
