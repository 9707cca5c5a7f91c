#pragma once
/// One cloth of a world between steps.

#include "sim/cloth/bending.h"
#include "sim/cloth/cloth.h"
#include "sim/cloth/cloth_gas.h"

namespace offstage::sim {

struct Cloth {
  /// `def` must have no problem().
  Cloth(ClothHandle cloth, const ClothDef& definition);

  ClothView view() const { return {points, velocities, triangles, sources, springs, version}; }

  ClothHandle handle;
  ClothDef def;
  std::vector<Vec3> points, velocities, rest;
  std::vector<Vec3> before;  ///< the points at the start of the world's sub-step
  std::vector<Real> masses;
  std::vector<uint32_t> sources;
  std::vector<Triangle> triangles;
  std::vector<ClothSpring> springs;  ///< those that are not broken or released
  std::vector<ClothPin> pins;        ///< those that are not broken or released
  std::vector<Real> seam_lengths;    ///< at the start [m]
  Real rest_volume = 0;              ///< inside of a closed one [m^3]
  ClothGas gas;                      ///< inside of a closed one under pressure
  Real age = 0;                      ///< [s]
  uint32_t version = 0;
  bool stopped = false;  ///< it became non-finite and is no longer stepped
  bool absent = false;   ///< it has not appeared yet, or was removed
  ClothBending bending;  ///< bending of the triangles
  std::optional<ClothTear> first_tear;
  ClothReport report;

  /// After triangles changed.
  void assign_bending();
};

/// Volume inside of a closed surface by the divergence theorem [m^3].
Real enclosed_volume(std::span<const Vec3> points, std::span<const Triangle> triangles);

/// Elastic energy of its springs [J].
Real elastic_energy(const Cloth& cloth);

}  // namespace offstage::sim
