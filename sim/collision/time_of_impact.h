#pragma once
/// Time of the first contact of two moving solids by conservative advancement (Mirtich, "Impulse-based
/// dynamic simulation of rigid body systems", 1996, 2.3), physics R3 and R12. The current distance and the
/// greatest rate at which it can shrink give a time before which the solids cannot touch. Advancing to this
/// time again and again approaches the impact from the safe side, so solids never pass through each other,
/// however fast or thin they are.
///
/// The rate is the closing speed along the separating direction. The contribution of rotation is computed
/// from the support points of both solids, and its change is bounded by the largest acceleration. For all
/// points of both solids
///   gap(t + dt) >= distance - rate dt - acceleration dt^2 / 2.

#include <optional>

#include "sim/collision/convex.h"
#include "sim/collision/pose_path.h"
#include "sim/collision/separation.h"

namespace offstage::sim {

struct Impact {
  Real fraction;          ///< fraction of the step, in [0, 1]
  Separation separation;  ///< separation at that time, in A's frame
  int advances = 0;       ///< number of distance queries
  bool converged = true;  ///< false: the bounded advancement ended early, at a fraction that is still safe
};

/// A convex solid with its path.
struct MovingConvex {
  const Convex& shape;
  const PosePath& path;
};

/// Returns a time, as a fraction of the step, at which the distance of A and B is at most `tolerance` [m], >
/// 0. Before this time the distance is never less than half of the tolerance. The result is empty if the
/// distance stays greater than half of the tolerance until the end. If the distance is within the tolerance
/// at the start, the time is 0.
std::optional<Impact> time_of_impact(const MovingConvex& a, const MovingConvex& b, Real tolerance);

/// Returns the time of impact, as time_of_impact() does, of a solid and the half-space below a plane, which
/// is the xz plane of its path's frame. The normal is the plane's normal, in the solid's frame.
std::optional<Impact> time_of_plane_impact(const MovingConvex& a, const PosePath& plane, Real tolerance);

/// The part of a solid's rotation that changes the place of its core.
struct CoreRotation {
  Vec3 velocity = Vec3::Zero();  ///< world [rad per step]
  Real acceleration = 0;  ///< bound of the acceleration of a point at distance 1 from the origin [per step^2]
};

/// The rotation of a solid at a time of its motion. A core that turns about its axis of symmetry stays in
/// place, so only the rotation of the axis counts: a rolling wheel approaches the floor no faster than its
/// axle. For a point the rotation is zero.
CoreRotation core_rotation(const MovingConvex& solid, Real fraction);

/// The distance of two solids at some time, and bounds of its decrease from there on.
struct Gap {
  Real distance;      ///< [m]
  Real rate;          ///< greatest closing speed of any two points along the normal at that time [m per step]
  Real acceleration;  ///< bound of the growth of the rate [m per step^2]

  /// Smallest time after which the distance can be `target`; infinite if never.
  Real time_to(Real target) const;
};

/// Returns bounds for the approach of two solids along `normal` (unit, world, from B to A) at a `fraction` of
/// their motions, where they are `distance` [m] apart.
Gap closing_gap(const MovingConvex& a, const MovingConvex& b, Real fraction, Real distance,
                const Vec3& normal);

}  // namespace offstage::sim
