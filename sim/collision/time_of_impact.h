#pragma once
/// When two moving solids first touch: conservative advancement (Mirtich, "Impulse-based dynamic simulation
/// of rigid body systems", 1996, 2.3), physics R3 and R12. From the distance now and the greatest rate at
/// which it can shrink follows a time before which nothing touches; going there again and again closes in on
/// the impact from the safe side, so nothing is ever passed through, however fast or thin.
///
/// The rate is that along the separating direction, with the rotation's share taken from the support of both
/// solids and its change bounded by the largest acceleration: for all points of both solids
///   gap(t + dt) >= distance - rate dt - acceleration dt^2 / 2.

#include <optional>

#include "sim/collision/convex.h"
#include "sim/collision/pose_path.h"
#include "sim/collision/separation.h"

namespace offstage::sim {

struct Impact {
  Real share;             ///< of the step, in [0, 1]
  Separation separation;  ///< there, in A's frame
  int advances = 0;       ///< how many distance queries it took
  bool converged = true;  ///< false: the bounded advancement ended early, at a share that is still safe
};

/// A convex solid on its way.
struct MovingConvex {
  const Convex& shape;
  const PosePath& path;
};

/// A share of the step at which A and B are within `tolerance` [m], > 0, of each other, and before which they
/// are never within half of it. None: they stay more than half of it apart to the end. Solids that begin
/// within it have their impact at share 0.
std::optional<Impact> time_of_impact(const MovingConvex& a, const MovingConvex& b, Real tolerance);

/// The same against the half-space under a plane, the xz plane of its path's frame. The normal is the
/// plane's, in the solid's frame.
std::optional<Impact> time_of_plane_impact(const MovingConvex& a, const PosePath& plane, Real tolerance);

/// The distance of two solids at some time, and how it can shrink from there on.
struct Gap {
  Real distance;      ///< [m]
  Real rate;          ///< greatest closing speed of any two points along the normal now [m per step]
  Real acceleration;  ///< bound on its growth [m per step^2]

  /// The least share after which the distance can be down to `target`; infinite if never.
  Real time_to(Real target) const;
};

/// How fast two solids can close in along `normal` (unit, world, from B to A), at a share of their ways.
Gap closing_gap(const MovingConvex& a, const MovingConvex& b, Real share, Real distance, const Vec3& normal);

}  // namespace offstage::sim
