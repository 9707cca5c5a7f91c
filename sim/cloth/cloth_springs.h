#pragma once
/// The springs of cloths by backward Euler, linearised once (Baraff and Witkin, "Large Steps in Cloth
/// Simulation", 1998), and solved approximately. A few symmetric Gauss-Seidel sweeps correct the explicit
/// step, which contains every force exactly. In equilibrium the residual is zero, so cloth under a static
/// load has its true length for any number of sweeps.
///
/// Springs of one colour share no point, so a sweep gives identical bits on any number of threads.

#include <cstdint>
#include <span>
#include <vector>

#include "sim/cloth/cloth.h"
#include "sim/cloth/cloth_points.h"

namespace offstage::sim {

class ClothSprings {
 public:
  /// Springs of one cloth, between points of all cloths; their order determines the colours.
  void assign(std::span<const ClothSpring> springs, const ClothPoints& points);

  /// Adapts the stable step to the points' present positions: a spring under tension also acts across its
  /// direction, by its force over its length, and the sweeps do not make that part implicit. To be called
  /// where the stretch may have changed much; the result depends on the positions alone.
  void adapt_to_stretch(const ClothPoints& points);
  /// The longest step at which no spring's stiffness is clamped [s].
  Real longest_step() const { return longest_step_; }
  /// To be called before steps of length h.
  void begin(const ClothPoints& points, Real h);
  /// Applies the forces of the springs at the points' start to `moves`, the displacements of points in a
  /// step. The moves of pinned points are kept, and the impulses on them are added to their `pull`.
  void pull(ClothPoints& points, std::span<Vec4> moves);
  /// Then makes the moves implicit, by one symmetric sweep.
  void relax(ClothPoints& points, std::span<Vec4> moves);

  /// Number of springs whose stiffness was clamped, and the least share of its stiffness that any has left.
  uint64_t clamped() const { return clamped_; }
  Real least_stiffness() const { return least_stiffness_; }

 private:
  struct Spring {
    uint32_t a, b;
    std::array<uint32_t, 2> counterpart;  // a twice if it has none
    Real rest, stiffness;                 // stiffness times h^2, clamped if necessary
    Real counterpart_rest;
  };
  struct Material {
    Real stiffness, damping;
    Real fastest;             // k (1/m_a + 1/m_b)
    Real most, most_at_rest;  // of h^2 `fastest`; at the present stretch, and without stretch
  };
  /// A spring in the step. It is small because every sweep reads all of them. A relative move d along the
  /// axis is resisted by the impulse `along` d, less the share `forget` of the impulse of previous sweeps.
  struct Link {
    Eigen::Vector4f axis;  // unit, from b to a; the fourth is `along`
    float forget, impulse;
    uint32_t a, b;
  };
  struct Stage {
    enum { pull, forward, backward } kind;
    std::size_t begin, end;
    bool whole;  // by one thread

    uint32_t block_count() const;
  };

  void set_longest_step();
  void run(std::span<const Stage> stages, ClothPoints& points, std::span<Vec4> moves);
  void pull(ClothPoints& points, std::span<Vec4> moves, std::size_t begin, std::size_t end);
  void relax(ClothPoints& points, std::span<Vec4> moves, std::size_t spring);

  std::vector<Spring> spring_;            // by colour
  std::vector<Material> material_;        // of each
  std::vector<std::size_t> color_start_;  // and the end
  std::vector<Link> link_;                // of the step
  std::vector<Stage> pull_, relax_;       // of any step
  std::vector<Real> inverse_mass_;        // that springs were prepared for
  bool is_stretched_ = false;             // whether some `most` is not that at rest
  Real prepared_for_ = -1;                // step [s]; < 0: none
  Real longest_step_ = 0, least_stiffness_ = 1;
  uint64_t clamped_ = 0;
};

}  // namespace offstage::sim
