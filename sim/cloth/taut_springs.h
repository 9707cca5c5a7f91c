#pragma once
/// Solves one linear complementarity problem for springs at their greatest length and for contacts of cloth
/// with dynamic bodies. The impulses bring the springs to their target length and keep the points out of the
/// bodies, to first order. In this way the whole taut cloth stops a heavy body, not only the points that
/// touch it.
///
/// Let the rows of J be the directions of springs and contacts, and W the inverse masses of points and
/// bodies. The impulses lambda >= 0 solve the linear complementarity problem J W J^T lambda >= excess. An
/// active-set method computes them: conjugate gradients solve for the impulses of the active rows, and the
/// active set changes until no active impulse is negative and no inactive row has an excess.

#include <array>
#include <span>
#include <vector>

#include "sim/cloth/cloth_bodies.h"
#include "sim/cloth/cloth_points.h"

namespace offstage::sim {

/// Target of corrections, as a fraction of the allowed elongation. With the limit itself as target, every
/// outward move would be reversed, and the cloth would freeze there.
inline constexpr Real kStretchAim = 0.97;

struct SpringLimit {
  uint32_t a, b;       ///< points
  Real rest, longest;  ///< [m]
  /// Whether the spring tears before it stops a body; tearing happens between sub-steps of the world.
  bool tears = false;
};

/// Contact of a point of cloth, or of a point within a triangle, with a dynamic body.
struct BodyContact {
  std::array<uint32_t, 3> points;  ///< indices of the points; for a single point, three times the same index
  std::array<Real, 3> weights;     ///< barycentric weights of the points; for a single point: 1, 0, 0
  ClothBody* body;
  Vec3 normal;   ///< unit normal of the body's surface, world axes
  Vec3 on_body;  ///< contact point on the body's surface, world [m]
  Real gap;      ///< distance to the body [m]; negative: penetration
};

/// Fraction of an overlap that is removed per sub-step where taut cloth stops a body.
inline constexpr Real kTautRecovery = 0.1;

class TautSprings {
 public:
  /// The object keeps references to the arguments.
  TautSprings(const ClothPoints& points, std::span<const Carrier> carriers);

  /// Adds a spring if its elongation is near the limit or beyond it.
  void add(const SpringLimit& limit);
  void add(const BodyContact& contact);
  bool any_too_long() const { return any_too_long_; }
  void solve();
  /// Displaces points and bodies by the impulses of a sub-step of length dt [s]. Impulses on points that are
  /// pinned to other objects are added to ClothPoints::pin_impulse. The change of velocities is scaled by the
  /// greatest fraction that adds no kinetic energy; the remainder of the displacements of points is appended
  /// to `cuts`. `kick`: velocity of each point in addition to displacement / dt. The total momentum is
  /// conserved.
  void apply(ClothPoints& points, Real dt, std::span<const Vec4> kick, std::vector<VelocityCut>& cuts);

 private:
  static constexpr uint32_t kNone = ~0u;

  struct MovedBody {
    ClothBody* body;
    const Carrier* carrier;  // null: the body carries no points
    Mat6 carried, mobility;
  };
  /// One end of a row: a point, which a body may carry, a point of a body, or a weighted mean of points.
  struct Place {
    uint32_t point, body;
    Vec3 arm;  // vector from the body's centre
  };
  /// A place within a triangle: the weighted mean of the places of its corners.
  struct MeanPlace {
    uint32_t place;
    std::array<uint32_t, 3> corners;  // places
    std::array<Real, 3> weights;
  };
  /// A row acts on one place along its direction, and on the other against it.
  struct Row {
    uint32_t first, second;  // indices in places_
    Vec4 direction;
    Real excess;      // displacement that is missing along the direction [m]
    Real compliance;  // J W J^T of the row alone [1/kg]
    bool acts;        // whether it is in the active set
  };

  uint32_t place_of(uint32_t point);
  uint32_t mean_place(const BodyContact& contact);
  Real compliance_at(uint32_t place, const Vec4& direction) const;
  void add_row(uint32_t first, uint32_t second, const Vec4& direction, Real excess);
  void gather(std::span<const Real> impulses);
  Real velocity_fraction(Real dt, std::span<const Vec4> kick, std::span<const VelocityCut> cuts) const;
  void multiply(std::span<const Real> x, std::span<Real> y);
  bool solve_acting();
  bool change_set();

  const ClothPoints& points_;
  std::vector<MovedBody> bodies_;
  std::vector<Vec6> impulses_;   // by body
  std::vector<uint32_t> place_;  // by point: its index in places_; kNone: none
  std::vector<Place> places_;    // an entry for a weighted mean has neither point nor body
  std::vector<MeanPlace> mean_places_;
  std::vector<Vec4> moves_;  // by place: impulses, and then moves
  std::vector<Row> rows_;
  std::vector<Real> lambda_;  // by row [kg m]
  std::vector<Real> residual_, direction_, image_, scaled_;
  Real greatest_ = 0;  // greatest initial excess [m]
  bool any_too_long_ = false;
};

}  // namespace offstage::sim
