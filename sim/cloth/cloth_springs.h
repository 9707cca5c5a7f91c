#pragma once
/// The springs of cloths by backward Euler, linearised once (Baraff and Witkin, "Large Steps in Cloth
/// Simulation", 1998), and relaxed: from the explicit step, which has every force as it is, a few symmetric
/// Gauss-Seidel sweeps take out what springs and damping do not allow. At rest nothing is left for the sweeps
/// to do, so that what hangs or carries a load has its true length, however few they are.
///
/// Springs of a colour share no point, so that a sweep gives the same bits on any number of threads.

#include <cstdint>
#include <span>
#include <vector>

#include "sim/cloth/cloth.h"
#include "sim/cloth/cloth_points.h"

namespace offstage::sim {

class ClothSprings {
 public:
  /// Springs between points of all cloths; their order decides about colours.
  void assign(std::span<const ClothSpring> springs, const ClothPoints& points);

  /// Changes `moves`, which points would make from their start in a step of length h, by the springs. Those
  /// of what pins hold stay, and what pulls at them is added to their `pull`.
  void step(ClothPoints& points, std::span<Vec4> moves, Real h);

  /// How many springs counted as softer in the last step, by cloth; empty before the first.
  std::span<const uint64_t> clamped() const { return clamped_; }

 private:
  struct Spring {
    uint32_t a, b;
    Real rest, stiffness;  // the latter times h^2, and as soft as it must be
  };
  struct Material {
    Real stiffness, damping;
    Real most;  // of h^2 k (1/m_a + 1/m_b)
  };
  /// A spring in the step, small because all of them pass through memory in every sweep. Moves d apart along
  /// the direction are resisted by the impulse `along` d, less `forget` of that of the sweeps before.
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

  void prepare(const ClothPoints& points, Real step);
  void pull(ClothPoints& points, std::span<Vec4> moves, std::size_t begin, std::size_t end);
  void relax(ClothPoints& points, std::span<Vec4> moves, std::size_t spring);

  std::vector<Spring> spring_;            // by colour
  std::vector<Material> material_;        // of each
  std::vector<std::size_t> color_start_;  // and the end
  std::vector<Link> link_;                // of the step
  std::vector<Stage> stages_;             // of any step
  std::vector<Real> inverse_mass_;        // that springs were prepared for
  Real prepared_for_ = -1;                // step [s]; < 0: none
  std::vector<uint64_t> clamped_;
};

}  // namespace offstage::sim
