#pragma once
/// Two bodies that are near each other: where they touch, and what is kept from step to step, which is the
/// narrow phase's cache, and the forces at the points as the guess for the next solution.

#include <array>
#include <limits>
#include <vector>

#include "sim/collision/contact_frame.h"
#include "sim/collision/narrow_phase.h"
#include "sim/core/prefetch.h"
#include "sim/dynamics/body.h"

namespace offstage::sim {

/// How the surfaces of two bodies act on each other.
struct PairSurface {
  Real restitution = 0, friction = 0, static_friction = 0;
  Real cross = 1;               ///< friction across the grain over that along it
  const Body* grain = nullptr;  ///< whose axis the grain is; null: isotropic
  bool conveys = false;         ///< a surface moves along the body
};

/// What acts at a point of a manifold, on body a, in the manifold's frame.
struct PointForce {
  Vec3 now = Vec3::Zero();   ///< mean over the interval [N]
  Vec3 last = Vec3::Zero();  ///< at its end, what the next one begins with [N]
  Vec3 mean = Vec3::Zero();  ///< over the intervals before; the fast solver's [N]
  bool known = false;        ///< whether the point was there in the interval before
};

/// A manifold placed in the world, with the forces that acted at its points.
struct PlacedManifold {
  ContactFrame frame;                ///< isotropic friction's, or along the grain
  Real torque = 0, mean_torque = 0;  ///< about the normal, of all points together; the fast solver's [N m]
  Manifold manifold;                 ///< world
  std::array<PointForce, 4> forces;
};

/// Points nearer than this touch [m].
constexpr Real kTouching = 2e-5;

/// Whether the points of a manifold are all near one line.
bool is_narrow(const Manifold& m);

/// What the loops over all pairs ask for lies in the first cache line.
class alignas(64) ContactPair {
 private:
  Body *a_, *b_;
  std::vector<PlacedManifold> placed_;
  Real separation_ = std::numeric_limits<Real>::infinity();
  uint32_t touching_ = 0;
  bool has_narrow_ = false;

 public:
  uint32_t impacts = 0;        ///< in this sub-step
  uint8_t speculative = 0;     ///< manifolds that add_speculative_contacts() added
  bool toi_exhausted = false;  ///< too many of them: no more trace-backs in this sub-step
  bool restitution_suppressed =
      false;               ///< its points limit the approach in this sub-step even if it would bounce
  Real deepest = 0;        ///< overlap that find() has seen in this sub-step [m]
  bool needs_toi = false;  ///< an impact of this pair is traced back to; else its points limit the approach

  /// A plane can only be `b`. Not both are planes.
  ContactPair(Body& a, Body& b, const PairSurface& surface);

  Body& a() const { return *a_; }
  Body& b() const { return *b_; }
  const PairSurface& surface() const { return surface_; }

  /// Finds where the bodies, placed, are within `margin` [m] of each other. If they are placed as before to
  /// each other, within `reuse` [m], the points are taken over and only their distances are new. `turning`:
  /// see find_manifolds().
  void find(const Pose& a, const Pose& b, Real margin, Real reuse, bool turning);

  /// Adds to what find() found at the interval's start where the bodies would overlap at its end if nothing
  /// stopped them, deeper than the points found tell: of bodies that turn or slide fast other features meet
  /// than were near before. The distances of these points are such that the velocities at the start's arms,
  /// over `duration` [s], bring them to what they are at the end.
  void add_speculative_contacts(Real duration);

  /// Asks for the memory that find() will want: of the pair, and a little later of the first manifold.
  void prefetch() const { sim::prefetch(this, this + 1); }
  void prefetch_manifold() const {
    if (!placed_.empty()) sim::prefetch(placed_.data(), placed_.data() + 1);
  }

  /// Whether some contact found is a line or a point (is_narrow()), at which there may be a seam.
  bool has_narrow() const { return has_narrow_; }
  /// The i-th manifold that add_speculative_contacts() added, with its points where they are at the
  /// interval's end.
  const Manifold& at_end(std::size_t i) const { return at_end_[i]; }
  /// Puts another manifold, placed in the world, in the place of the i-th; one without points takes it away
  /// at the next drop_empty(). The separation remains that of the bodies.
  void replace(uint32_t i, const Manifold& m);
  void drop_empty();

  /// Whether find() was never called.
  bool is_new() const { return found_margin_ < 0; }

  std::vector<PlacedManifold>& manifolds() { return placed_; }
  const std::vector<PlacedManifold>& manifolds() const { return placed_; }

  /// Least distance of the points found; infinite if there are none.
  Real separation() const { return separation_; }
  /// How many of the points found touch.
  uint32_t touching() const { return touching_; }
  /// Greatest speed at which a point of the pair can come closer: of all points of both [m/s].
  Real speed_bound() const;
  /// Of it, by their turning alone.
  Real turning_speed() const { return a_->turning_speed() + b_->turning_speed(); }
  /// Velocity of a's point against b's at a place of the world, at the interval's start [m/s].
  Vec3 relative_velocity(const Vec3& point) const;

 private:
  /// A point with its forces, all in a's frame.
  struct Remembered {
    Vec3 on_a, last, mean, normal;
    Real torque, mean_torque;
    uint32_t id;
    bool taken = false;  ///< by points that are there now
  };
  static PointForce recalled(const Remembered& p, const ContactFrame& frame, const Mat3& a_axes);
  void find_points(const Pose& a, const Pose& b, Real margin, Real reuse, bool turning);
  void find_one_point(const Pose& a, const Pose& b, Real margin);
  void remember(std::vector<Remembered>& points) const;
  void recall(std::vector<Remembered>& points, const Pose& a);
  void inherit(std::vector<Remembered>& points, const Pose& a);
  void reuse(const Pose& a, const Pose& b, const std::vector<Remembered>& points);
  void set_frame(PlacedManifold& m) const;
  /// How far the free motion brings a away from b along the normal, at a contact of the start [m].
  Real free_way(const PlacedManifold& m, const Vec3& place, Real duration) const;
  /// Whether the points found tell that there will be such an overlap, in the world at the end.
  bool is_expected(const Vec3& normal, const ContactPoint& at_end, Real duration) const;
  PlacedManifold brought_back(const Manifold& at_end, Real duration) const;

  PairSurface surface_;
  bool is_on_plane_;
  bool has_sphere_;  // then there is one point at most, as quick to find anew as to take over
  PairCache cache_;
  // In a's frame; filled only when they are first taken over: what moves has no use for the memory.
  std::vector<Manifold> found_;
  std::vector<Manifold> at_end_;  // of the speculative ones
  Pose a_from_b_;                 // when found
  Real found_margin_ = -1;
  Pose placed_at_;  // of a, when placed
};

}  // namespace offstage::sim
