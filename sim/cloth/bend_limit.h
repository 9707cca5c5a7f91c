#pragma once
/// The smallest radius to which a cloth bends. In each sub-step, the impulses of all places of the cloth that
/// are bent further are solved for together by projected Gauss-Seidel sweeps: impulses only bend back. A
/// place is a triangle with its surroundings, whose curvature ClothBending measures: it is that of the
/// surface on any mesh, and neither stretching nor the direction of a fold changes it.
///
/// The impulses are along gradients of curvatures, whose sums and moments are zero: momentum and angular
/// momentum are kept. The limit stops bending as an inelastic impact does, in two parts.
///
/// Before the springs act, brace() changes velocities so that free motion would not bend a place too far.
/// The new velocities are the nearest ones, in the metric of masses, of a convex set that contains rest, so
/// the kinetic energy does not grow, and the springs store no more than what they take from the motion.
/// After the springs have acted, project() moves points to take back a tenth of what is left, which the
/// springs have added: in a hard impact, curvatures can exceed the limit by some percent. These moves stretch
/// springs, so the less is taken back at once, the less energy they add. They begin with the impulses of the
/// last sub-step, which hardly differ while a load rests, and add no kinetic energy.
///
/// Contacts with bodies and cloth, and the limit of stretch, are solved later in the sub-step and have
/// precedence: under their pressure the curvature can exceed the limit for that sub-step.

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "sim/cloth/bending.h"
#include "sim/cloth/cloth_points.h"

namespace offstage::sim {

class BendLimit {
 public:
  /// Of the cloth with this number, which has `count` points from `first` on. `bending` must stay valid and
  /// measure the curvature. `radius` > 0 [m].
  BendLimit(uint32_t cloth, std::size_t first, std::size_t count, const ClothBending& bending, Real radius)
      : cloth_(cloth), first_(first), count_(count), bending_(&bending), radius_(radius) {}
  uint32_t cloth() const { return cloth_; }

  /// Takes from the velocities at the start of a sub-step of length dt what would bend places too far.
  void brace(ClothPoints& points, Real dt);

  /// Bends back all places that are bent too far at the end of a sub-step of length dt. Returns whether there
  /// were any. The impulses on held points, also those of brace(), are added to their `pull`. `kick` is the
  /// velocity of points besides that of their moves; the part of the moves that must not count as velocity is
  /// appended to `cuts`.
  bool project(ClothPoints& points, Real dt, std::span<const Vec4> kick, std::vector<VelocityCut>& cuts);

  /// Greatest curvature times the radius.
  Real greatest(const ClothPoints& points) const;

 private:
  /// A place at its limit or near it.
  struct Row {
    std::size_t patch;
    std::size_t first, end;  // in gradient_
    Real excess;             // of the curvature times the radius: what is to be taken back
    Real compliance;         // of the curvature times the radius, for an impulse of this row alone [1/kg]
    Real impulse = 0;        // [kg m], >= 0
  };

  std::span<const Vec4> part(const std::vector<Vec4>& of_all) const {
    return std::span(of_all).subspan(first_, count_);
  }
  bool add_row(const ClothPoints& points, std::size_t patch, std::span<const Vec4> at, Real impulse);
  bool find_rows_ahead(const ClothPoints& points);
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
  std::vector<Vec4> ahead_;   // where points would be at the end of the sub-step without springs
  std::vector<Vec4> braced_;  // impulses of brace() on held points [kg m]; empty if it did nothing
  std::vector<Real> before_;  // impulses of the last sub-step, of each patch
};

}  // namespace offstage::sim
