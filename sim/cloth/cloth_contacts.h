#pragma once
/// Contact of the points of cloths with bodies. Points near a body are found once per sub-step of the world;
/// in each sub-step of cloth those that are too near are put back to the cloth's thickness, by sweeping where
/// they are fast, with Coulomb friction and with the impulse on the body. A point between two bodies hands
/// the push of one on to the other.

#include <cstdint>
#include <span>
#include <vector>

#include "sim/cloth/cloth_bodies.h"
#include "sim/cloth/cloth_points.h"
#include "sim/cloth/stretch_limit.h"

namespace offstage::sim {

/// A part of a point's move that was not motion: it was put out of what it was already in.
struct VelocityCut {
  uint32_t point;
  Vec4 move;  // [m]
};

class ClothContacts {
 public:
  /// What points can meet in a sub-step of the world of length h. `collides` says it of each point.
  void find(const ClothPoints& points, std::span<const uint8_t> collides, std::span<ClothBody> bodies,
            Real h);
  /// Looks again for points that moved farther than predicted.
  void find_runaways(const ClothPoints& points);
  /// Puts points out of the bodies, in a sub-step of cloth of length dt, one of `parts` of the world's.
  /// Appends to `cuts`.
  void solve(ClothPoints& points, Real dt, Real parts, std::vector<VelocityCut>& cuts);
  /// After moves were shortened, those of points that are not 0 in `shortened`: cloth that can get no farther
  /// stops the bodies that press into it. `recoil` is the inverse mass of what is behind each point's cloth:
  /// 0 if it hangs on the world. Returns by cloth the impulse that it takes up [N s].
  std::vector<Vec3> stop_bodies(const ClothPoints& points, std::span<const uint8_t> shortened,
                                std::span<const Real> recoil);

  /// Whether a point was so near to another body in the last solve() that it may touch that soon.
  bool is_near_other_than(std::size_t point, const ClothBody* body) const {
    return point < near_to_.size() && near_to_[point] && (near_to_[point] != body || near_several_[point]);
  }
  bool any_dynamic() const { return any_dynamic_; }  ///< whether a body that can be pushed touches cloth
  std::span<const uint64_t> active() const { return active_; }  ///< contacts of the last solve(), by cloth
  /// Raises, by cloth, how deep any of its points is behind a surface, at the end of a sub-step.
  void measure(const ClothPoints& points, std::span<Real> penetration) const;

 private:
  struct Near {
    uint32_t point, body;
    Vec3 place;        // in the body's frame where last looked at
    Real distance;     // from the surface there
    Real pressed = 0;  // impulse along the normal in this sub-step of the world, of a pinched point [N s]
  };
  struct Touch {
    Near* near;
    ClothBody* body;
    Vec3 normal, on_body;  // world
    Real gap;              // to the cloth's thickness, negative in contact
  };

  void look(const ClothPoints& points, uint32_t point, std::vector<Near>& found) const;
  bool touch(const ClothPoints& points, Near& near, Touch& t) const;
  void pinch(Touch& a, Touch& b, Real friction);
  void block(Touch& t, ClothBody* holder);
  void press(ClothPoints& points, Touch& t, Real dt, Real parts, bool supported,
             std::vector<VelocityCut>& cuts);

  std::span<ClothBody> bodies_;
  std::span<const uint8_t> collides_;
  Real h_ = 0;
  bool any_dynamic_ = false;
  std::vector<Near> near_;  // by point
  // Of each point: a body that it is near to, and whether it is to others.
  std::vector<const ClothBody*> near_to_;
  std::vector<uint8_t> near_several_;
  std::vector<Vec3> seen_at_;
  std::vector<Real> seen_reach_;  // how far each point may move before it must be looked at again
  std::vector<Aabb> boxes_;       // of the bodies' ways
  std::vector<uint64_t> active_;
  std::vector<Touch> touches_;  // of one point
};

}  // namespace offstage::sim
