#pragma once
/// One cloth of a world between steps.

#include "sim/cloth/bending.h"
#include "sim/cloth/cloth.h"
#include "sim/cloth/cloth_gas.h"

namespace offstage::sim {

struct Cloth {
  /// `def` must be valid: problem() must return an empty text for it.
  Cloth(ClothHandle cloth, const ClothDef& definition);

  ClothView view() const { return {points, velocities, masses, triangles, sources, springs, version}; }

  ClothHandle handle;
  ClothDef def;
  std::vector<Vec3> points, velocities, rest;
  std::vector<Vec3> before;  ///< positions of the points at the start of the world's sub-step
  std::vector<Real> masses;
  std::vector<uint32_t> sources;
  std::vector<Triangle> triangles;
  std::vector<ClothSpring> springs;  ///< springs that are not broken
  std::vector<ClothPin> pins;        ///< pins that are not released
  std::vector<Real> seam_lengths;    ///< distance between the two vertices of each seam at the start [m]
  Real rest_volume = 0;              ///< volume inside a closed cloth at rest [m^3]
  ClothGas gas;                      ///< gas inside a closed cloth under pressure
  Real age = 0;                      ///< [s]
  uint32_t version = 0;
  bool stopped = false;  ///< whether the cloth became non-finite and is no longer stepped
  bool absent = false;   ///< whether the cloth has not appeared yet, or was removed
  ClothBending bending;  ///< bending of the triangles
  std::optional<ClothTear> first_tear;
  ClothReport report;

  /// Adapts the bending to the triangles. Call it after these have changed.
  void assign_bending();
};

/// Volume inside of a closed surface by the divergence theorem [m^3].
Real enclosed_volume(std::span<const Vec3> points, std::span<const Triangle> triangles);

/// Elastic energy of a cloth's springs [J].
Real elastic_energy(const Cloth& cloth);

}  // namespace offstage::sim
