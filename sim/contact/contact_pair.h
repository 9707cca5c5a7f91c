#pragma once
/// Two bodies that are near each other: where they touch, and what is kept from step to step, which is the
/// narrow phase's cache, and the forces at the points as the guess for the next solution.

#include <array>
#include <vector>

#include "sim/body.h"
#include "sim/collision/narrow_phase.h"
#include "sim/contact/contact_frame.h"

namespace offstage::sim {

/// How the surfaces of two bodies act on each other.
struct PairSurface {
  Real restitution = 0, friction = 0, static_friction = 0;
  Real cross = 1;               ///< friction across the grain over that along it
  const Body* grain = nullptr;  ///< whose axis the grain is; null: isotropic
};

/// A manifold placed in the world, with the forces that acted at its points.
struct PlacedManifold {
  Manifold manifold;            ///< world
  ContactFrame frame;           ///< isotropic friction's, or along the grain
  std::array<Vec3, 4> force;    ///< in the frame: on body a [N]
  std::array<bool, 4> known{};  ///< whether the point was there in the interval before
  Real torque = 0;              ///< about the normal, of all points together; the fast solver's [N m]
  /// Means over the last intervals of `force` and `torque`, which the fast solver keeps.
  std::array<Vec3, 4> mean_force;
  Real mean_torque = 0;
};

class ContactPair {
 public:
  /// A plane can only be `b`. Not both are planes.
  ContactPair(Body& a, Body& b, const PairSurface& surface) : a_(&a), b_(&b), surface_(surface) {}

  Body& a() const { return *a_; }
  Body& b() const { return *b_; }
  const PairSurface& surface() const { return surface_; }
  void set_surface(const PairSurface& surface) { surface_ = surface; }

  /// Finds where the bodies, placed, are within `margin` [m] of each other. If they are placed as before to
  /// each other, within `reuse` [m], the points are taken over and only their distances are new.
  void find(const Pose& a, const Pose& b, Real margin, Real reuse);
  /// Forgets where they touch.
  void clear();

  /// Whether find() was never called.
  bool is_new() const { return found_margin_ < 0; }

  std::vector<PlacedManifold>& manifolds() { return placed_; }
  const std::vector<PlacedManifold>& manifolds() const { return placed_; }

  /// Least distance of the points found; infinite if there are none.
  Real separation() const;
  /// Greatest speed at which a point of the pair can come closer: of all points of both [m/s].
  Real speed_bound() const;
  /// Velocity of a's point against b's at a place of the world, at the interval's start [m/s].
  Vec3 relative_velocity(const Vec3& point) const;

  uint32_t impacts = 0;   ///< in this sub-step
  bool gave_up = false;   ///< too many of them: no more trace-backs in this sub-step
  bool by_event = false;  ///< an impact of this pair is traced back to; else its points limit the approach

 private:
  static Vec3 carried(const Vec3& force, const ContactFrame& old, const ContactFrame& now, const Quat& turn);
  void recall(const std::vector<PlacedManifold>& before, const Pose& a_before, const Pose& a);
  void reuse(const Pose& a, const Pose& b);
  void set_frames();

  Body *a_, *b_;
  PairSurface surface_;
  PairCache cache_;
  std::vector<Manifold> found_;  // in a's frame
  Pose a_from_b_;                // when found
  Real found_margin_ = -1, found_reuse_ = 0;
  Pose placed_at_;  // of a, when placed
  std::vector<PlacedManifold> placed_, before_;
  std::vector<ContactFrame> before_frames_;
};

}  // namespace offstage::sim
