#pragma once
/// The smallest radius to which a cloth bends. In each sub-step, or each step of the springs of the
/// integrator `relaxed`, projected Gauss-Seidel sweeps compute impulses that
/// bend the cloth back wherever its curvature exceeds the limit. The curvature is measured by
/// ClothBending for each triangle and its surroundings (a patch). It does not depend on the mesh, on
/// stretching or on the direction of a fold.
///
/// The impulses are along the gradients of the curvatures. The sum and the moment of a gradient are zero, so
/// that momentum and angular momentum are conserved. The impulses of the last sub-step are the initial guess;
/// under a constant load they hardly change. Impulses add no kinetic energy: the limit stops bending like an
/// inelastic impact. The displacements stretch springs, which store this energy for a short time. Contacts
/// with bodies and cloth, and the limit of stretch, are solved later in the sub-step and have precedence:
/// under their pressure the curvature can exceed the limit for that sub-step.

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sim/cloth/bending.h"
#include "sim/cloth/cloth_points.h"

namespace offstage::sim {

class BendLimit {
 public:
  /// Limits the bending of the cloth with the index `cloth`, whose points have the indices `first` to `first`
  /// + `count` - 1. `bending` must outlive this object and measure the curvature. `radius`: smallest radius
  /// [m], > 0.
  BendLimit(uint32_t cloth, std::size_t first, std::size_t count, const ClothBending& bending, Real radius)
      : cloth_(cloth), first_(first), count_(count), bending_(&bending), radius_(radius) {}
  uint32_t cloth() const { return cloth_; }

  /// Bends back all patches that exceed the limit at the end of a sub-step of length dt [s]. Returns whether
  /// there were any. The impulses on pinned points are added to ClothPoints::pin_impulse. `kick`: velocity of
  /// each point in addition to displacement / dt. The part of the displacements that must not count as
  /// velocity is appended to `cuts`.
  bool project(ClothPoints& points, Real dt, std::span<const Vec4> kick, std::vector<VelocityCut>& cuts);
  /// Whether there were any since the last call of this function.
  bool take_acted() { return std::exchange(acted_, false); }

  /// Greatest curvature of the cloth multiplied by the radius; 1 at the limit.
  Real greatest(const ClothPoints& points) const;

 private:
  /// A patch at its limit or near it.
  struct Row {
    std::size_t patch;
    std::size_t first, end;  // range in gradient_
    Real excess;             // excess of the curvature times the radius, to be removed
    Real compliance;         // change of the curvature times the radius by a unit impulse of this row [1/kg]
    Real impulse = 0;        // [kg m], >= 0
  };

  std::span<const Vec4> part(const std::vector<Vec4>& of_all) const {
    return std::span(of_all).subspan(first_, count_);
  }
  bool find_rows(const ClothPoints& points);
  void push(const ClothPoints& points, const Row& row, Real impulse);
  void solve(const ClothPoints& points);
  void apply(ClothPoints& points, Real dt, std::span<const Vec4> kick, std::vector<VelocityCut>& cuts);

  uint32_t cloth_;
  std::size_t first_, count_;
  const ClothBending* bending_;
  Real radius_;
  std::vector<Row> rows_;
  std::vector<std::pair<uint32_t, Vec4>> gradient_;  // by point: derivative times the radius
  std::vector<Vec4> move_;  // by point: move due to the impulses; for pinned points the impulse
  bool acted_ = false;
  std::vector<Real> before_;  // by patch: impulse of the last sub-step
};

}  // namespace offstage::sim
