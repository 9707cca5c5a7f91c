#pragma once
/// A pair of bodies near each other, with their contact points. Two kinds of data are kept between steps: the
/// cache of the narrow phase, and the forces at the points, which are the initial guess of the next solution.

#include <array>
#include <limits>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "sim/collision/contact_frame.h"
#include "sim/collision/narrow_phase.h"
#include "sim/contact/cloth_layer.h"
#include "sim/core/prefetch.h"
#include "sim/dynamics/body.h"

namespace offstage::sim {

/// Combined surface parameters of two bodies.
struct PairSurface {
  Real restitution = 0, friction = 0, static_friction = 0;
  Real cross = 1;                   ///< friction across the friction axis, divided by friction along the axis
  Real rolling = 0, spinning = 0;   ///< rolling and spinning friction [m]
  const Body* axis_body = nullptr;  ///< body that defines the friction axis; null: isotropic
  bool conveys = false;             ///< whether a surface is a conveyor
  DistanceMethod method = DistanceMethod::gjk;
  bool by_triangles = false;  ///< whether the time of impact is searched between the triangles of two meshes
};

/// Force at a point of a manifold on body a, in the manifold's frame.
struct PointForce {
  Vec3 now = Vec3::Zero();   ///< mean over the interval [N]
  Vec3 last = Vec3::Zero();  ///< force at the end of the interval, the initial guess for the next one [N]
  Vec3 mean = Vec3::Zero();  ///< moving average over previous intervals, for the fast solver [N]
  bool known = false;        ///< whether the point existed in the previous interval
};

/// A manifold placed in the world, with the forces that acted at its points.
struct PlacedManifold {
  ContactFrame frame;  ///< contact_frame() of the normal, or t along the friction axis
  Real torque = 0,
       mean_torque = 0;  ///< mean torque of all points about the normal, for the fast solver [N m]
  Manifold manifold;     ///< world
  std::array<PointForce, 4> forces;
};

/// Cloth between the bodies of a pair.
struct PairLayer {
  /// A contact point that cloth keeps at a distance.
  struct Place {
    Vec3 middle, normal;     ///< the line along the normal, world
    uint32_t cloth, number;  ///< slot of the cloth and index of the triangle on this line
  };
  PairSurface bare;                      ///< surface of the pair without cloth
  std::span<const LayerTriangle> cloth;  ///< triangles that may be between the bodies
  Real thickest = 0;                     ///< greatest thickness of these triangles [m]
  std::vector<Place> places;             ///< of the last search; empty: there is no cloth at the contacts
  /// Whether the cloth slides on both bodies. The bodies then exert no friction on each other, but both do on
  /// the cloth. If not, the bodies exert the friction on each other.
  bool slides = false;
  /// Whether body a holds the cloth by friction, and not b: the body on which the cloth rests while it slides
  /// on the other one, or else the heavier body.
  bool holds_by_a = false;
};

/// Points with a smaller separation count as touching [m].
constexpr Real kTouching = 2e-5;

/// Whether all points of a manifold are near one line.
bool is_narrow(const Manifold& m);
/// Two points of a face that lies on another face differ less than this in depth [m].
constexpr Real kInclined = 1e-3;
/// Returns a manifold without the points that are less deep than the deepest one by more than kInclined.
Manifold near_deepest(const Manifold& m);

/// Two bodies near each other, and their contacts. Members that are read in loops over all pairs come first,
/// in one cache line.
class alignas(64) ContactPair {
 private:
  Body *a_, *b_;
  std::vector<PlacedManifold> placed_;
  Real separation_ = std::numeric_limits<Real>::infinity();
  uint32_t touching_ = 0;
  bool has_narrow_ = false;

 public:
  uint32_t impacts = 0;     ///< number of impacts of this pair in this sub-step
  uint8_t speculative = 0;  ///< number of manifolds that add_speculative_contacts() added
  /// Whether the pair is not traced back again in this sub-step: it reached its limit of impacts, or cloth is
  /// between its bodies.
  bool toi_exhausted = false;
  /// Whether the contacts of the pair have no restitution in this sub-step. They stop the approach without a
  /// bounce.
  bool restitution_suppressed = false;
  Real deepest = 0;  ///< deepest overlap that find() has seen in this sub-step [m]
  /// Whether the island of this pair is moved back to the times of the pair's impacts. If not, the contact
  /// points limit the approach.
  bool needs_toi = false;
  /// Whether a body turns far and all touching points rebound. The next impact may then be at any point, and
  /// its time is not known without a search.
  bool tumbles_away = false;

  /// Only body `b` may be a plane.
  ContactPair(Body& a, Body& b, const PairSurface& surface);

  Body& a() const { return *a_; }
  Body& b() const { return *b_; }
  const PairSurface& surface() const { return surface_; }
  /// Shapes of the two bodies for the search of the time of impact.
  const CollisionShape& impact_shape_a() const { return impact_shape(*a_); }
  const CollisionShape& impact_shape_b() const { return impact_shape(*b_); }
  /// Returns how many tests of bounding volumes and of pairs of pieces were made since the last call.
  TestCounts take_tests() { return std::exchange(cache_.tests, {}); }

  /// Finds the contact points of the bodies in the given poses. Surfaces must be within `margin` [m] of each
  /// other. If the relative pose of the bodies has changed by less than `reuse` [m], the points are reused
  /// and only their separations are updated. `turning`: see find_manifolds().
  void find(const Pose& a, const Pose& b, Real margin, Real reuse, bool turning);

  /// Sets the triangles of cloth that may be between the bodies in the next find(). They must exist until
  /// then. Contact points with cloth on their line are found with the distance that the cloth keeps.
  void set_cloth(std::span<const LayerTriangle> cloth);
  /// Returns the cloth between the bodies at the contact points of the last find(), or null.
  const PairLayer* layer() const { return layer_ && !layer_->places.empty() ? layer_.get() : nullptr; }

  /// Adds speculative contacts to the contacts that find() found at the interval's start. A speculative
  /// contact is added where the freely moving bodies would overlap at the interval's end by more than the
  /// existing points predict: fast turning or sliding brings other features together. The separation of such
  /// a point is chosen so that its velocity over `duration` [s], with the lever arms of the start, gives its
  /// separation at the end.
  void add_speculative_contacts(Real duration);

  /// Whether the contacts of a manifold already prevent a predicted overlap. `at_end` is the contact point of
  /// that overlap at the interval's end, and `normal` its normal. The result is true if the motion of the
  /// points of `m` over `duration` [s] leads to an overlap that is at least as deep at `at_end`. With
  /// `between_points`, `at_end` may also lie between two points of `m`. `m` is a manifold of this pair;
  /// `at_end` may belong to another pair with one of the same bodies.
  bool predicts(const PlacedManifold& m, const Vec3& normal, const ContactPoint& at_end, Real duration,
                bool between_points) const;

  /// Returns the separation at the end of an interval of `duration` [s], by the free motion, of a point of a
  /// manifold of this pair [m].
  Real separation_at_end(const PlacedManifold& m, const ContactPoint& point, Real duration) const {
    return point.separation + free_displacement(m, (point.on_a + point.on_b) / 2, point.separation, duration);
  }

  /// Whether the island will be moved back to the impact at this point. The point must then not limit the
  /// approach before the impact. While points of the pair touch and do not tumble away, this requires an
  /// approach faster than `impact_speed` [m/s]. If none touches, speculative contacts wait, too; at their
  /// places at the start they may seem to touch.
  bool awaits_impact(const PlacedManifold& m, const ContactPoint& point, Real impact_speed) const {
    if (!needs_toi) return false;
    if (separation_ > kTouching) return true;
    return point.separation > kTouching &&
           (tumbles_away || relative_velocity((point.on_a + point.on_b) / 2).dot(m.frame.n) < -impact_speed);
  }

  /// Prefetches the pair for find(). Call prefetch_manifold(), which prefetches its first manifold, a little
  /// later.
  void prefetch() const { sim::prefetch(this, this + 1); }
  void prefetch_manifold() const {
    if (!placed_.empty()) sim::prefetch(placed_.data(), placed_.data() + 1);
  }

  /// Whether a manifold touches along a line or at a point with the points near its deepest one
  /// (is_narrow()). It may then lie at an internal edge.
  bool has_narrow() const { return has_narrow_; }
  /// The i-th manifold added by add_speculative_contacts(), with its points at their positions at the
  /// interval's end.
  const Manifold& at_end(std::size_t i) const { return at_end_[i]; }
  /// Replaces the i-th manifold by `m`, which is in world coordinates. If `m` has no points, the next
  /// drop_empty() removes the manifold. separation() is not changed.
  void replace(uint32_t i, const Manifold& m);
  void drop_empty();

  /// Whether one body is a sphere and the other a simple shape. The pair then has at most one contact, found
  /// in closed form.
  bool has_sphere() const { return has_sphere_; }
  /// Whether find() was never called for this pair.
  bool is_new() const { return found_margin_ < 0; }
  /// Distance of surfaces up to which the last find() has searched for contacts [m].
  Real margin() const { return found_margin_; }

  std::vector<PlacedManifold>& manifolds() { return placed_; }
  const std::vector<PlacedManifold>& manifolds() const { return placed_; }

  /// Smallest separation of the contact points; infinite if there are none.
  Real separation() const { return separation_; }
  /// Number of touching points.
  uint32_t touching() const { return touching_; }
  /// Upper bound of the speed at which points of the two bodies can approach each other [m/s].
  Real speed_bound() const;
  /// Part of speed_bound() that is due to rotation [m/s].
  Real turning_speed() const { return a_->turning_speed() + b_->turning_speed(); }
  /// Velocity of a relative to b at a point of the world, at the interval's start [m/s].
  Vec3 relative_velocity(const Vec3& point) const;

 private:
  const CollisionShape& impact_shape(Body& body) const {
    return surface_.by_triangles ? body.triangle_shape() : body.collision_shape();
  }
  /// A point with its forces, all in a's frame.
  struct StoredPoint {
    Vec3 on_a, last, mean, normal;
    Real torque, mean_torque;
    uint32_t id;
    bool taken = false;  ///< whether the stored point was matched with a current one
  };
  static PointForce stored_force(const StoredPoint& p, const ContactFrame& frame, const Mat3& a_axes);
  void find_points(const Pose& a, const Pose& b, Real margin, Real reuse, bool turning);
  void find_one_point(const Pose& a, const Pose& b, Real margin);
  void insert_layers();
  void clear_layers();
  void store_points(std::vector<StoredPoint>& points) const;
  void restore_forces(std::vector<StoredPoint>& points, const Pose& a);
  void inherit(std::vector<StoredPoint>& points, const Pose& a);
  void reuse(const Pose& a, const Pose& b, const std::vector<StoredPoint>& points);
  void set_frame(PlacedManifold& m) const;
  /// Returns the displacement of a relative to b along the normal, by the free motion during `duration` [m],
  /// at a contact of the manifold `m`. `place` is the world position of the contact at the interval's start,
  /// in the middle between both surfaces; `gap` is the distance of the surfaces [m].
  Real free_displacement(const PlacedManifold& m, const Vec3& place, Real gap, Real duration) const;
  PlacedManifold moved_back(const Manifold& at_end, Real duration) const;

  PairSurface surface_;
  bool is_on_plane_;
  bool has_sphere_;  // the pair has at most one point, and finding it is as fast as reusing it
  PairCache cache_;
  std::unique_ptr<PairLayer> layer_;  // null: no cloth is near
  // Manifolds in a's frame. They are stored when they are first reused, to save memory for moving pairs.
  std::vector<Manifold> found_;
  std::vector<Manifold> at_end_;  // manifolds of the speculative contacts
  Pose a_from_b_;                 // relative pose when the contacts were found
  Real found_margin_ = -1;
  Pose placed_at_;  // pose of a when the contacts were placed
};

}  // namespace offstage::sim
