#pragma once
/// The springs of cloths by backward Euler, linearised once (Baraff and Witkin, "Large Steps in Cloth
/// Simulation", 1998), and solved approximately. One symmetric Gauss-Seidel sweep corrects the explicit step.
/// The explicit step has the exact forces and is zero in equilibrium; therefore cloth under a static load has
/// exactly the right length.
///
/// The sweep follows paths of springs (spring_paths.h), four at a time, one in each lane of a register. Paths
/// of one colour share no point, so a sweep gives identical bits on any number of threads.

#include <cstdint>
#include <span>
#include <vector>

#include "sim/cloth/cloth.h"
#include "sim/cloth/cloth_points.h"
#include "sim/cloth/four_vectors.h"
#include "sim/cloth/spring_paths.h"
#include "sim/linear/lanes.h"

namespace offstage::sim {

class ClothSprings {
 public:
  /// Sets the springs of one cloth. Their ends are indices into the points of all cloths.
  void assign(std::span<const ClothSpring> springs, const ClothPoints& points);

  /// Adapts longest_step() to the current positions. A spring under tension also has a transverse stiffness,
  /// its force divided by its length, which the sweep does not make implicit. To be called when the stretch
  /// may have changed much; the result depends only on the positions.
  void adapt_to_stretch(const ClothPoints& points);
  /// The longest step at which no spring's stiffness is clamped [s].
  Real longest_step() const { return longest_step_; }
  /// Prepares for steps of length h [s].
  void begin(const ClothPoints& points, Real h);
  /// Adds the effect of the spring forces at ClothPoints::start to `moves`, the displacements of the points
  /// in a step [m]. Pinned points keep their displacements; the impulses on them are added to
  /// ClothPoints::pin_impulse.
  void apply(ClothPoints& points, std::span<Vec4> moves);
  /// Turns the explicit displacements of apply() into implicit ones, by one symmetric sweep. Calls
  /// after_half() after the sweep forwards and after the sweep backwards.
  template <class AfterHalf>
  void relax(ClothPoints& points, std::span<Vec4> moves, AfterHalf&& after_half) {
    run(forward_, points, moves);
    after_half();
    run(backward_, points, moves);
    after_half();
  }

  /// Number of springs whose stiffness was clamped, and the smallest ratio of clamped to defined stiffness.
  uint64_t clamped() const { return clamped_; }
  Real least_stiffness() const { return least_stiffness_; }

 private:
  static constexpr std::size_t kLanes = 4;
  static constexpr std::size_t kChains = 4;  // batches swept in turns
  typedef float Floats __attribute__((vector_size(kLanes * sizeof(float))));

  struct Material {
    uint32_t a, b;
    Real stiffness, damping;
    Real fastest;             // k (1/m_a + 1/m_b)
    Real most, most_at_rest;  // of h^2 `fastest`; at the present stretch, and without stretch
  };
  /// The springs between one point of each of four paths and the next, and the first of the two points. It is
  /// small because every sweep reads all of them. A relative move d along the axis is resisted by the impulse
  /// `along` d, less the fraction `forget` of the impulse of the sweep so far.
  struct Row {
    Lanes weight;                // inverse masses
    std::array<Floats, 3> axis;  // unit, from the next point to this one; by x, y and z
    Floats along, forget, impulse;
    std::array<uint32_t, kLanes> point;
    uint32_t count;  // of lanes that have this point
    uint32_t held;   // bit mask of those whose point is held
  };
  /// Values of a row that are needed only for the explicit step.
  struct Elastic {
    Lanes rest, stiffness;  // the latter times h^2, clamped if necessary
    std::array<uint32_t, kLanes> spring;
  };
  /// The other diagonals of springs that have a counterpart.
  struct Counterparts {
    std::array<uint32_t, kLanes> a, b;
    Lanes rest;  // 0: none
  };
  /// Up to four paths: rows from the first on, of which the last has points alone.
  struct Batch {
    std::size_t first, length;  // number of springs of the longest
    std::size_t counterparts;   // index of the counterparts of the first row; kNone: it has none
  };
  static constexpr std::size_t kNone = ~std::size_t{0};
  static constexpr uint32_t kNoSpring = ~0u;
  struct Stage {
    enum { apply, forward, backward } kind;
    std::size_t begin, end;  // batches
    std::size_t block;       // batches of a block
    bool alone;              // one batch at a time

    uint32_t block_count() const { return static_cast<uint32_t>((end - begin + block - 1) / block); }
  };

  void add_batch(std::span<const SpringPath* const> paths, std::span<const ClothSpring> springs);
  void add_stages(std::span<const std::size_t> color_ends);
  void set_longest_step();
  void run(std::span<const Stage> stages, ClothPoints& points, std::span<Vec4> moves);
  template <class Look>
  [[gnu::always_inline]] void for_rows(const Vec4* x, Look&& look) const;
  [[gnu::always_inline]] Lanes elongations(const Batch& batch, std::size_t row, Lanes length,
                                           const Vec4* x) const;
  void apply(ClothPoints& points, std::span<Vec4> moves, const Batch& batch);
  static void pass_on(ClothPoints& points, const Row& row, const FourVectors& impulse);
  template <class Act>
  [[gnu::always_inline]] static void for_lanes(const Row& row, Act&& act);
  [[gnu::always_inline]] static void store(std::span<Vec4> moves, const Row& row, const FourVectors& move);
  [[gnu::always_inline]] static void relax(ClothPoints& points, Row& row, const Row& after, FourVectors& at,
                                           FourVectors& next);
  [[gnu::always_inline]] void relax_forward(ClothPoints& points, std::span<Vec4> moves, std::size_t row,
                                            FourVectors& at);
  [[gnu::always_inline]] void relax_backward(ClothPoints& points, std::span<Vec4> moves, std::size_t row,
                                             FourVectors& next);
  void sweep_forward(ClothPoints& points, std::span<Vec4> moves, std::span<const Batch> batches);
  void sweep_backward(ClothPoints& points, std::span<Vec4> moves, std::span<const Batch> batches);

  std::vector<Material> material_;  // of each spring
  std::vector<Row> row_;
  std::vector<Elastic> elastic_;
  std::vector<Counterparts> counterparts_;
  std::vector<Batch> batch_;
  std::vector<Stage> apply_, forward_, backward_;  // of any step
  std::vector<Real> inverse_mass_;                 // that springs were prepared for
  bool is_stretched_ = false;                      // whether some `most` is not that at rest
  Real prepared_for_ = -1;                         // step [s]; < 0: none
  Real longest_step_ = 0, least_stiffness_ = 1;
  uint64_t clamped_ = 0;
};

}  // namespace offstage::sim
