#pragma once
/// The smallest radius to which a cloth bends. In each sub-step, the impulses of all places of the cloth that
/// are bent further are solved for together by projected Gauss-Seidel sweeps: impulses only bend back. A
/// place is a triangle with its surroundings, whose curvature ClothBending measures: it is that of the
/// surface on any mesh, and neither stretching nor the direction of a fold changes it.
///
/// The impulses are along gradients of curvatures, whose sums and moments are zero: momentum and angular
/// momentum are kept. They begin with those of the last sub-step, which hardly differ while a load rests.
/// They add no kinetic energy: the limit stops bending as an inelastic impact does. The moves stretch
/// springs, which store that energy for a moment. Contacts with bodies and cloth, and the limit of stretch,
/// are solved later in the sub-step and have precedence: under their pressure the curvature can exceed the
/// limit for that sub-step.

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sim/cloth/bending.h"
#include "sim/cloth/cloth_points.h"

namespace offstage::sim {

class BendLimit {
 public:
  /// Limits the bending of the cloth with this number, which has `count` points from `first` on. `bending`
  /// must stay valid and measure the curvature. `radius` > 0 [m].
  BendLimit(uint32_t cloth, std::size_t first, std::size_t count, const ClothBending& bending, Real radius)
      : cloth_(cloth), first_(first), count_(count), bending_(&bending), radius_(radius) {}
  uint32_t cloth() const { return cloth_; }

  /// Bends back all places that are bent too far at the end of a sub-step of length dt. Returns whether there
  /// were any. The impulses on held points are added to their `pin_impulse`. `kick` is the velocity of points
  /// besides that of their moves; the part of the moves that must not count as velocity is appended to
  /// `cuts`.
  bool project(ClothPoints& points, Real dt, std::span<const Vec4> kick, std::vector<VelocityCut>& cuts);

  /// Greatest curvature of the cloth, times the radius.
  Real greatest(const ClothPoints& points) const;

 private:
  /// A place at its limit or near it.
  struct Row {
    std::size_t patch;
    std::size_t first, end;  // in gradient_
    Real excess;             // excess of the curvature times the radius, which is to be removed
    Real compliance;         // of the curvature times the radius, for an impulse of this row alone [1/kg]
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
  std::vector<std::pair<uint32_t, Vec4>> gradient_;  // times the radius, by points of the cloth
  std::vector<Vec4> move_;    // of each point by the impulses; of held ones the impulse
  std::vector<Real> before_;  // impulses of the last sub-step, of each patch
};

}  // namespace offstage::sim
