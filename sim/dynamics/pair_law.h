#pragma once
/// Laws of forces between the particles of one or more systems (physics P2). The force on particle 1 of a
/// pair is -dU/dr1; the force on particle 2 is opposite. In a region it is multiplied by the strengths at
/// both particles. Without a cut-off distance all pairs are computed, and the time is proportional to the
/// square of the number of particles. With a cut-off distance only neighbours are computed.
///
/// Systems connected by such a force are integrated together: by the integrator of the first system, or by
/// the world's integrator if springs act on one of the systems. A particle participates from the first whole
/// sub-step of its life.

#include <type_traits>

#include "sim/dynamics/region.h"

namespace offstage::sim {

/// The potential U = -G m1 m2 / sqrt(r^2 + s^2).
struct MutualGravitation {
  Real constant = 6.672e-11;  ///< G [N m^2/kg^2], >= 0
  Real softening = 0;         ///< s, as if each mass were distributed over this radius [m], >= 0 (Plummer)
  Real cut_off = 0;           ///< distance from which on there is no force [m]; 0: unlimited
  Region region;
  uint32_t drop_rate = 0;
};

/// The potential U = K q1 q2 / sqrt(r^2 + s^2).
struct Coulomb {
  Real constant = 8.9875e9;  ///< K [N m^2/C^2], >= 0
  Real softening = 0;        ///< s [m], >= 0
  Real cut_off = 0;          ///< distance from which on there is no force [m]; 0: unlimited
  Region region;
  uint32_t drop_rate = 0;
};

/// The potential U = 4 epsilon [(sigma/r)^12 - (sigma/r)^6]. The equilibrium distance is 2^(1/6) sigma. Below
/// sigma/1000 the force is constant.
struct LennardJones {
  Real epsilon = 1;   ///< depth of the well [J], >= 0
  Real sigma = 0.01;  ///< distance of U = 0 [m], > 0
  /// Distance from which on there is no force [m]; 0: unlimited. A common value is 2.5 sigma.
  Real cut_off = 0;
  Region region;
  uint32_t drop_rate = 0;
};

template <class T>
constexpr bool kIsPairLaw =
    std::is_same_v<T, MutualGravitation> || std::is_same_v<T, Coulomb> || std::is_same_v<T, LennardJones>;

}  // namespace offstage::sim
