#pragma once
/// Turbulent air (physics P2): a random velocity field without divergence, so that drifting particles keep
/// their density (after Bridson, Houriham, Nordenstam, "Curl-Noise for Procedural Fluid Flow", 2007).

#include <array>
#include <cstdint>
#include <span>

#include "sim/dynamics/region.h"

namespace offstage::sim {

/// Air with eddies of several sizes. The eddies of each octave are half as wide as in the previous octave;
/// their speed decreases with the cube root of the width and their lifetime with its power 2/3, as in
/// Kolmogorov's cascade.
struct Turbulence {
  static constexpr uint32_t kMaxOctaves = 8;

  Real speed = 1;        ///< root mean square of the air's speed [m/s], >= 0
  Real scale = 1;        ///< width of the largest eddies [m], > 0
  uint32_t octaves = 2;  ///< number of octaves (sizes of eddies), 1 to kMaxOctaves
  Real lifetime = 0;     ///< lifetime of the largest eddies [s], >= 0; 0: scale / speed, their turnover time
  /// Velocity at which the pattern of eddies moves [m/s]. It does not include a mean wind, which must be a
  /// separate field.
  Vec3 drift = Vec3::Zero();
  uint32_t seed = 0;  ///< different seeds give different eddies
  Real drag = 0;      ///< k as in WindField [kg/s]
  Region region;
  uint32_t drop_rate = 0;
};

/// The eddies of one size at one time. At regular times, the ticks, each corner of the lattice gets a new
/// random velocity. Between two ticks the velocities of both are mixed.
struct EddyLattice {
  Real cells;   ///< cells per metre
  Vec3 origin;  ///< [cells]
  /// Keys of the hashes that give the corners' velocities, at the ticks before and after this time.
  std::array<uint32_t, 2> key;
  std::array<float, 2> fraction;  ///< weights of the velocities at these ticks
  float bias;                     ///< makes the mean of the hashes 0
};

/// Computes the velocity of turbulent air at one time. The velocity is periodic in space with a period of
/// 1024 eddies, and not periodic in time.
///
/// Each corner c of a lattice has a random velocity a. Let d be the vector from c, in cells, and w(d) the
/// corner's smooth weight. The potential psi = sum w (a x d)/2 has the curl
///   v = sum [a (w + (grad w . d)/2) - d (grad w . a)/2],
/// which is a at each corner. The formula is exact, so the divergence is 0 within the rounding of single
/// precision.
class TurbulentFlow {
 public:
  TurbulentFlow(const Turbulence& turbulence, Real time);

  /// Computes velocities [m/s] at points (x y z of each). The velocity at a point does not depend on the
  /// other points.
  void velocity(std::span<const Real> points, std::span<Real> out) const;
  Vec3 velocity(const Vec3& point) const;

 private:
  void velocity8(const Real* points, Real* out) const;

  uint32_t octave_count_;
  std::array<EddyLattice, Turbulence::kMaxOctaves> octaves_;
};

}  // namespace offstage::sim
