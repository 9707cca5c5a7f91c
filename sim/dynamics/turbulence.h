#pragma once
/// Turbulent air (physics P2): a random velocity field without divergence, so that what drifts in it neither
/// gathers nor thins out (after Bridson, Houriham, Nordenstam, "Curl-Noise for Procedural Fluid Flow", 2007).

#include <array>
#include <cstdint>
#include <span>

#include "sim/dynamics/region.h"

namespace offstage::sim {

/// Air that swirls in eddies of several sizes. Each octave has eddies of half the width of those before;
/// their speed falls with the cube root of the width and their lifetime with its power 2/3, as in
/// Kolmogorov's cascade.
struct Turbulence {
  static constexpr uint32_t kMaxOctaves = 8;

  Real speed = 1;             ///< root mean square of the air's speed [m/s], >= 0
  Real scale = 1;             ///< width of the largest eddies [m], > 0
  uint32_t octaves = 2;       ///< sizes of eddies, 1 to kMaxOctaves
  Real lifetime = 0;          ///< of the largest eddies [s], >= 0; 0: they turn over, scale / speed
  Vec3 drift = Vec3::Zero();  ///< of the eddies with the mean wind, which this does not blow [m/s]
  uint32_t seed = 0;          ///< another number, other eddies
  Real drag = 0;              ///< as WindField's [kg/s]
  Region region;
  uint32_t drop_rate = 0;
};

/// The eddies of one size at a moment.
struct EddyLattice {
  Real cells;                   ///< per metre
  Vec3 origin;                  ///< [cells]
  std::array<uint32_t, 2> key;  ///< of the hashes that give the corners' velocities, at the ticks around now
  std::array<float, 2> share;   ///< of these
  float bias;                   ///< makes the mean of the hashes 0
};

/// The velocity of turbulent air at a moment. Its period in space is 1024 eddies; in time it has none.
///
/// At each corner c of a lattice there is a random velocity a. Let d be the way from c, in cells, and w(d)
/// the corner's smooth weight. The potential psi = sum w (a x d)/2 has the curl
///   v = sum [a (w + (grad w . d)/2) - d (grad w . a)/2],
/// which is a at each corner. All is exact, so the divergence is 0 to rounding, which is that of single
/// precision here.
class TurbulentFlow {
 public:
  TurbulentFlow(const Turbulence& turbulence, Real time);

  /// Velocities [m/s] at points; both x y z after each other. The velocity at a point does not depend on the
  /// other points.
  void velocity(std::span<const Real> points, std::span<Real> out) const;
  Vec3 velocity(const Vec3& point) const;

 private:
  void velocity8(const Real* points, Real* out) const;

  uint32_t octave_count_;
  std::array<EddyLattice, Turbulence::kMaxOctaves> octaves_;
};

}  // namespace offstage::sim
