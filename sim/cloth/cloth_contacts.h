#pragma once
/// Contact of the points of cloths with bodies. Points near a body are found once per sub-step of the world;
/// in each sub-step of cloth, points that are too close are moved back to the cloth's thickness, with Coulomb
/// friction and a reaction on the body. Fast points are swept. A point between two bodies transmits impulses
/// from one to the other.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sim/cloth/cloth_bodies.h"
#include "sim/cloth/cloth_points.h"
#include "sim/cloth/stretch_limit.h"
#include "sim/cloth/taut_springs.h"

namespace offstage::sim {

/// Supports reach this far beyond the distance that points and triangles keep from a body, in thicknesses:
/// springs may move them farther than their free motion.
inline constexpr Real kSupportReach = 0.2;

class ClothContacts {
 public:
  /// Finds the bodies that points can touch in a sub-step of the world of length h [s]. `collides`: for each
  /// point, whether it collides with bodies.
  void find(const ClothPoints& points, std::span<const uint8_t> collides, std::span<ClothBody> bodies, Real h,
            Real at = 0);
  /// Sets the direction against gravity; zero without gravity.
  void set_up(const Vec3& up) { up_ = up; }
  /// Greatest speed of a point relative to a dynamic body that it can touch [m/s].
  Real fastest_approach(const ClothPoints& points) const;
  /// Repeats the search for points that moved farther than predicted.
  void find_runaways(const ClothPoints& points);
  /// Returns whether a body may be a support of a point. Pinned cloth and points that are near another body
  /// are left to solve() if the body is dynamic.
  bool may_support(const ClothPoints& points, const ClothBody& body, uint32_t point) const;
  /// Returns whether a point lies on a body against which `body` presses the cloth (ClothBody::loads). The
  /// contact solver then keeps both bodies apart, and the cloth there does not push `body`.
  bool is_pressed_by(const ClothPoints& points, const ClothBody& body, uint32_t point) const;
  /// Returns whether a pin holds a point closer to a body than triangles keep from it, or so near to such a
  /// pin that the point must come that close, too. Triangles there have no contacts with the body: their
  /// free points could not separate them from it.
  bool is_held_inside(const ClothPoints& points, uint32_t body, uint32_t point) const;
  /// Returns whether a point was closer to a body than twice its thickness when its distance was computed.
  bool is_close(const ClothPoints& points, uint32_t body, uint32_t point) const;
  /// Finds the supports of points (ClothPoints::supports) for a sub-step of the cloth of length dt [s].
  void find_supports(ClothPoints& points, Real dt);
  /// Moves points out of the bodies in a sub-step of the cloth of length dt [s]. `parts`: number of such
  /// sub-steps in the world's sub-step. Displacements that must not count as velocity are appended to `cuts`.
  void solve(ClothPoints& points, Real dt, Real parts, std::vector<VelocityCut>& cuts);
  /// Returns the contacts with dynamic bodies at the points' current positions, including points that are
  /// closer than twice the distance that they keep.
  void collect(const ClothPoints& points, std::vector<BodyContact>& found);
  /// Stops bodies that move towards cloth at points whose moves were shortened (non-zero `shortened`), and
  /// removes the component of the bodies' displacements towards the cloth. The result does not depend on the
  /// order of the contacts. `triangles`: contacts of the bodies with triangles. `kick`: velocity of each
  /// point in addition to the velocity of its move. `recoil`: for each cloth, the inverse of its mass
  /// including the bodies that hold it [1/kg]; 0 if it is pinned to the world. `whole_velocity`: for each
  /// cloth, its mean velocity including these bodies, or the velocity of the single object to which it is
  /// pinned. Returns for each cloth the impulse that it absorbs [N s].
  std::vector<Vec3> stop_bodies(const ClothPoints& points, std::span<const uint8_t> shortened,
                                std::span<const Vec4> kick, std::span<const Real> recoil,
                                std::span<const std::optional<Vec3>> whole_velocity,
                                std::span<const BodyContact> triangles);

  /// near_to() returns a body that was so close to the point in the last solve() that they may soon touch, or
  /// null if there is none. is_near_several() returns whether there was more than one such body.
  const ClothBody* near_to(std::size_t point) const {
    return point < near_to_.size() ? near_to_[point] : nullptr;
  }
  bool is_near_several(std::size_t point) const {
    return point < near_several_.size() && near_several_[point];
  }
  /// Number of contacts of each cloth in the last solve().
  std::span<const uint64_t> active() const { return active_; }
  /// Returns whether any point of a cloth touched a body since the last find().
  bool touched(std::size_t cloth) const { return cloth < touched_.size() && touched_[cloth]; }
  /// Updates the maximum of `penetration` of each cloth [m] with the penetration of its points at the end of
  /// a sub-step.
  void measure(const ClothPoints& points, std::span<Real> penetration) const;

 private:
  struct Near {
    uint32_t point, body;
    Vec3 place;           // position of the point in the body's frame at the last search
    Real distance;        // distance of that position from the surface
    Real least_distance;  // distance that the point keeps from the body: the thickness, or less near a pin
    Real pressed = 0;     // impulse along the normal on a pinched point in this sub-step of the world [N s]
    bool friction_applied = false;  // whether the integrator applies the friction of the loads on the body
  };
  /// A pinned point that is closer to a body than the cloth's thickness.
  struct HeldInside {
    uint32_t point;
    Real distance;  // from the body's surface
  };
  struct HeldPoints {
    std::vector<HeldInside> points;  // sorted by the x of the rest position
    Real deepest = 0;                // greatest depth in the body
  };
  struct Touch {
    Near* near;
    ClothBody* body;
    Vec3 normal, on_body;  // world
    Real gap;              // distance minus Near::least_distance; negative in contact
  };

  void look(const ClothPoints& points, uint32_t point, std::vector<Near>& found) const;
  bool touch(const ClothPoints& points, Near& near, const Vec3& at, Real reach, Touch& t) const;
  void count_points_under_loads(const ClothPoints& points);
  void find_held_inside(const ClothPoints& points);
  Real kept_distance(const ClothPoints& points, uint32_t body, uint32_t point) const;
  bool carries(Touch& a, Touch& b) const;
  bool presses_from_above(const ClothPoints& points, const ClothBody& body, uint32_t point,
                          const Vec3& normal) const;
  Real load_on(const ClothPoints& points, const Near& near) const;
  void pinch(Touch& a, Touch& b, Real friction);
  void block(Touch& t, ClothBody* holder);
  void press(ClothPoints& points, Touch& t, Real dt, Real parts, bool supported,
             std::vector<VelocityCut>& cuts);

  std::span<ClothBody> bodies_;
  std::span<const uint8_t> collides_;
  Real h_ = 0;
  Vec3 up_ = Vec3::Zero();
  std::vector<Near> near_;               // by point
  std::vector<HeldPoints> held_inside_;  // by body
  // By point: a body near it, and whether several bodies are near it.
  std::vector<const ClothBody*> near_to_;
  std::vector<uint8_t> near_several_;
  std::vector<Vec3> seen_at_;
  std::vector<Real> seen_reach_;  // by point: how far it may move before its search must be repeated
  std::vector<Aabb> boxes_;       // boxes of the bodies' paths
  std::vector<uint64_t> active_;
  std::vector<uint8_t> touched_;  // by cloth
  std::vector<uint8_t> pinned_;   // by cloth: whether pins hold it
  std::vector<Touch> touches_;    // contacts of one point
};

}  // namespace offstage::sim
