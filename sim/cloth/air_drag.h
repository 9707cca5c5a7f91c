#pragma once
/// Drag, lift and ram pressure of the air on a cloth (ClothAir, physics F8), and the linear drag of fields
/// and hands. The force is linearised in the velocities of the points, and the integrators make this linear
/// part implicit. Steady motion and loads at rest are exact for any step. Decay without loads is accurate to
/// second order. With one step of the springs per linearisation, the decay u0 / (1 + k u0 t) of a flat cloth
/// is exact.

#include <array>
#include <cstdint>
#include <vector>

#include <immintrin.h>

#include "sim/cloth/cloth_points.h"
#include "sim/cloth/cloth_state.h"
#include "sim/linear/lanes.h"

namespace offstage::sim {

class AirDrag {
 public:
  /// Sets the cloth on which the air acts. Its points begin at index `first`, and its address must stay valid
  /// until the next call.
  void assign(const Cloth& cloth, std::size_t first);

  /// Forces the next renew() to linearise again. Call it after changes of other forces, masses or velocities.
  void expire() { left_ = 0; }
  /// Updates the linearisation if it has expired: sets ClothPoints::acceleration to the effect of outer
  /// forces and of the air at the current velocities. Call it before each sub-step of the cloth, of length dt
  /// [s]. `substeps`: number of sub-steps of the cloth that are left in the world's sub-step; `steps`: steps
  /// of the integrator in each of them.
  void renew(ClothPoints& points, Real dt, uint32_t substeps, uint32_t steps);
  /// Returns whether the force of the air does not depend on the velocities of the points.
  bool empty() const { return !is_active_; }

  /// Prepares respond() for steps of length h [s].
  void begin(Real h);
  /// Returns the change of the acceleration of the cloth's point i [m/s^2] if its velocity is v instead of
  /// from(i).
  Vec4 change(std::size_t i, const Vec4& v) const { return -resistance_[i].times(v - from_[i]); }
  /// Returns R v of the cloth's point i: R is the decrease of its acceleration per unit of velocity [1/s].
  Vec4 resist(std::size_t i, const Vec4& v) const { return resistance_[i].times(v); }
  /// Returns the part of a change of velocity dv that remains after the drag of a step, (1 + h R)^-1 dv.
  Vec4 respond(std::size_t i, const Vec4& dv) const { return dv - loss_[i].times(dv); }
  /// Returns the matrix R of point i [1/s].
  Mat3 resistance(std::size_t i) const { return resistance_[i].matrix(); }
  /// Returns the velocity for which the accelerations of the points were computed.
  const Vec4& from(std::size_t i) const { return from_[i]; }

 private:
  /// A symmetric matrix in single precision, which is fast: every step of the springs reads two for each
  /// point. The matrix only slows motion, so its rounding is never visible.
  struct alignas(32) Symmetric {
    std::array<float, 8> at = {};  // xx yy zz 0 xy yz zx 0

    Vec4 times(const Vec4& v) const {
      const Lanes diagonal = _mm256_cvtps_pd(_mm_load_ps(at.data())),
                  beside = _mm256_cvtps_pd(_mm_load_ps(at.data() + 4)), x = _mm256_load_pd(v.data());
      const Lanes sum = diagonal * x + beside * lane_next(x) + lane_last(beside) * lane_last(x);
      Vec4 result;
      _mm256_store_pd(result.data(), sum);
      return result;
    }
    void add(const Mat3& m) {
      at[0] += static_cast<float>(m(0, 0));
      at[1] += static_cast<float>(m(1, 1));
      at[2] += static_cast<float>(m(2, 2));
      at[4] += static_cast<float>(m(0, 1));
      at[5] += static_cast<float>(m(1, 2));
      at[6] += static_cast<float>(m(2, 0));
    }
    Mat3 matrix() const {
      Mat3 m;
      m << at[0], at[4], at[6], at[4], at[1], at[5], at[6], at[5], at[2];
      return m;
    }
  };

  uint32_t substeps_until_change(const ClothPoints& points, Real dt) const;
  void drag_points(ClothPoints& points);
  void drag_triangles(ClothPoints& points);
  void drag_triangles(const ClothPoints& points, std::size_t first, std::size_t count);
  void catch_air(ClothPoints& points);

  const Cloth* cloth_ = nullptr;
  std::size_t first_ = 0;
  Real lightness_ = 0;   // greatest area per mass of a point [m^2/kg]
  uint32_t left_ = 0;    // number of sub-steps for which the linearisation is still kept
  Real span_ = 0;        // total time for which it is kept [s]
  Real fraction_ = 0.5;  // fraction of the linear part that is implicit
  bool is_active_ = false;
  std::vector<Symmetric> resistance_;
  std::vector<Symmetric> loss_;  // 1 - (1 + h R)^-1
  std::vector<Vec4> from_, wind_, force_;
  std::vector<Real> mobility_;  // by triangle: kValence over the mass of its points [1/kg]
  Real prepared_for_ = -1;      // length of the steps that were prepared [s]; < 0: none
};

}  // namespace offstage::sim
