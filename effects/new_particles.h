#pragma once
/// The parameters of new particles (physics F2), which emitters, trails and sub-emitters share. Every number
/// can be a distribution.

#include <cstdint>

#include "effects/distribution.h"

namespace offstage::effects {

struct NewParticles {
  Varying speed = 1.0;        ///< speed along the direction of release [m/s]
  Varying spread_deg = 0.0;   ///< angle from that direction [degrees], -180 to 180; the azimuth is uniform
  Varying radius = 0.01;      ///< [m], > 0
  Varying density = 1000.0;   ///< [kg/m^3]; gives the mass unless `mass` is set
  Varying mass = 0.0;         ///< [kg]; 0: from density and radius
  Varying lifespan = 5.0;     ///< [s], > 0
  Varying restitution = 0.3;  ///< in [0, 1]
  Varying friction = 0.5;     ///< >= 0
  Varying charge = 0.0;       ///< [C]
  uint64_t max_alive = 1'000'000;  ///< greatest number of living particles; further ones are not released,
                                   ///< but counted as skipped
};

}  // namespace offstage::effects
