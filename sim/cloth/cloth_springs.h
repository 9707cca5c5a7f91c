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

/// Returns the greatest relative speed of both ends of a spring, divided by its length at rest [1/s]. It is
/// the greatest strain rate or angular velocity of a spring. `first`: index of the vertex 0 of the springs.
Real fastest_spring_rate(const ClothPoints& points, std::span<const ClothSpring> springs,
                         std::size_t first = 0);

class ClothSprings {
 public:
  /// Sets the springs of one cloth. Their ends are indices into the points of all cloths.
  void assign(std::span<const ClothSpring> springs, const ClothPoints& points);

  /// Adapts longest_step() to the current positions. A spring under tension also has a transverse stiffness,
  /// which is its force divided by its length. The sweep does not make this stiffness implicit. Call this
  /// function when the stretch may have changed much; the result depends only on the positions.
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
  static constexpr std::size_t kChains = 4;  // number of batches that are swept in turns
  typedef float Floats __attribute__((vector_size(kLanes * sizeof(float))));

  struct Material {
    uint32_t a, b;
    Real stiffness, damping;
    Real fastest;             // k (1/m_a + 1/m_b)
    Real most, most_at_rest;  // limits of h^2 `fastest`: at the current stretch, and without stretch
  };
  typedef std::array<Floats, 3> AxisFloats;  ///< four unit vectors, by x, y and z
  /// For each of four paths, a point and the spring to the next point. A relative move d along the axis of
  /// the spring causes the impulse `along` d; the fraction `forget` of the sweep's impulse so far is
  /// subtracted. The time of a sweep is that of reading the rows, so a row has only the values that the
  /// explicit step and both sweeps need.
  struct Row {
    Lanes weight;  // inverse masses of the points
    Floats along, forget;
    std::array<uint32_t, kLanes> point;
    uint32_t count;  // number of lanes that have this point
    uint32_t held;   // bit mask of the lanes whose point is pinned
  };
  /// Values of a row that are needed only for the explicit step.
  struct Elastic {
    Lanes rest, stiffness;  // stiffness: times h^2, clamped if necessary
  };
  /// The other diagonals of springs that have a counterpart.
  struct Counterparts {
    std::array<uint32_t, kLanes> a, b;
    Lanes rest;  // 0: no counterpart
  };
  /// Up to four paths as consecutive rows, one for each spring of the longest path and one for its last
  /// point.
  struct Batch {
    std::size_t first, length;  // index of the first row; number of springs of the longest path
    std::size_t counterparts;   // index of the first row's counterparts; kNone: none
  };
  static constexpr std::size_t kNone = ~std::size_t{0};
  static constexpr uint32_t kNoSpring = ~0u;
  struct Stage {
    enum { apply, forward, backward } kind;
    std::size_t begin, end;  // range of batches
    std::size_t block;       // number of batches in a block
    bool alone;              // whether only one batch at a time is swept

    uint32_t block_count() const { return static_cast<uint32_t>((end - begin + block - 1) / block); }
  };

  void add_batch(std::span<const SpringPath* const> paths, std::span<const ClothSpring> springs);
  void add_stages(std::span<const std::size_t> color_ends);
  void set_longest_step();
  Real bound_across(const ClothPoints& points) const;
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
  [[gnu::always_inline]] static Lanes relax(ClothPoints& points, const Row& row, const Row& after,
                                            const FourVectors& axis, Lanes impulse, FourVectors& at,
                                            FourVectors& next);
  [[gnu::always_inline]] void relax_forward(ClothPoints& points, std::span<Vec4> moves, std::size_t row,
                                            FourVectors& at);
  [[gnu::always_inline]] void relax_backward(ClothPoints& points, std::span<Vec4> moves, std::size_t row,
                                             FourVectors& next);
  void sweep_forward(ClothPoints& points, std::span<Vec4> moves, std::span<const Batch> batches);
  void sweep_backward(ClothPoints& points, std::span<Vec4> moves, std::span<const Batch> batches);

  std::vector<Material> material_;  // by spring
  std::vector<Row> row_;
  std::vector<std::array<uint32_t, kLanes>> spring_;  // by row: its springs
  std::vector<Elastic> elastic_;                      // by row
  std::vector<AxisFloats> axis_;                      // by row: from the next point to this one
  std::vector<Floats> impulse_;                       // by row: impulses of the sweep forwards
  std::vector<Counterparts> counterparts_;
  std::vector<Batch> batch_;
  std::vector<Stage> apply_, forward_, backward_;  // stages of a step of any length
  std::vector<Real> inverse_mass_;                 // inverse masses for which the springs were prepared
  bool is_stretched_ = false;                      // whether some `most` may differ from `most_at_rest`
  Real prepared_for_ = -1;                         // length of the steps that were prepared [s]; < 0: none
  Real longest_step_ = 0, longest_at_rest_ = 0, least_stiffness_ = 1;
  Real most_around_ = 0;       // greatest sum of k / m of the springs at a point [1/s^2]
  uint32_t most_springs_ = 0;  // greatest number of springs at a point
  uint64_t clamped_ = 0;
};

}  // namespace offstage::sim
