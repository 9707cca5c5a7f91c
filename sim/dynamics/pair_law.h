#pragma once
/// Laws of forces between the particles of one or more systems (physics P2). The force on particle 1 of a
/// pair is -dU/dr1, that on particle 2 its opposite. In a region it is multiplied by the strengths at both
/// particles. Without a cut-off distance all pairs are visited, which takes the square of the number of
/// particles; with one, only those near each other.
///
/// Systems that such a force joins are integrated together, by the integrator of the first of them, or by the
/// world's where springs hold one of them. A particle takes part from the first whole sub-step of its life
/// on.

#include <type_traits>

#include "sim/dynamics/region.h"

namespace offstage::sim {

/// U = -G m1 m2 / sqrt(r^2 + s^2).
struct MutualGravitation {
  Real constant = 6.672e-11;  ///< G [N m^2/kg^2], >= 0
  Real softening = 0;         ///< s, as if the masses were spread over this radius [m], >= 0 (Plummer)
  Real cut_off = 0;           ///< no force from here on [m]; 0: none
  Region region;
  uint32_t drop_rate = 0;
};

/// U = K q1 q2 / sqrt(r^2 + s^2).
struct Coulomb {
  Real constant = 8.9875e9;  ///< K [N m^2/C^2], >= 0
  Real softening = 0;        ///< s [m], >= 0
  Real cut_off = 0;          ///< no force from here on [m]; 0: none
  Region region;
  uint32_t drop_rate = 0;
};

/// U = 4 epsilon [(sigma/r)^12 - (sigma/r)^6]; at rest at a distance of 2^(1/6) sigma. Closer than sigma/1000
/// the force is as there.
struct LennardJones {
  Real epsilon = 1;   ///< depth of the well [J], >= 0
  Real sigma = 0.01;  ///< where U = 0 [m], > 0
  Real cut_off = 0;   ///< no force from here on [m]; 0: none. Usual is 2.5 sigma
  Region region;
  uint32_t drop_rate = 0;
};

template <class T>
constexpr bool kIsPairLaw =
    std::is_same_v<T, MutualGravitation> || std::is_same_v<T, Coulomb> || std::is_same_v<T, LennardJones>;

}  // namespace offstage::sim
