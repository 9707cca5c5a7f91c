#pragma once
/// Fabrics of cloth. Stiffnesses are per metre of width, so the behaviour of a cloth does not depend on its
/// resolution.

#include <optional>
#include <span>
#include <string>

#include "sim/core/types.h"

namespace offstage::effects {

using sim::Real;

/// Resistance to bending.
enum class BendModel {
  plate,    ///< a thin plate of the flexural rigidity `bend`, on any mesh (sim/cloth/bending.h)
  springs,  ///< the book's springs to second neighbours; they resist sharp folds, but hardly resist slight
            ///< curvature
};

struct Fabric {
  Real areal_density = 0.15;  ///< [kg/m^2], > 0
  /// Stiffness along the threads: force per metre of width at a strain of 1 [N/m], > 0.
  Real stretch = 1000;
  Real shear =
      100;  ///< shear stiffness: force per metre of width at a strain of 1 of the diagonals [N/m], >= 0
  Real bend = 1e-4;  ///< flexural rigidity: moment per metre of width at a curvature of 1/m [N m], >= 0
  Real bend_damping = 2e-3;  ///< damping time of bending [s], >= 0; the moment is bend * (curvature +
                             ///< bend_damping * its rate)
  BendModel bend_model = BendModel::plate;
  /// Fraction of the critical damping of each spring between its two points, >= 0.
  Real damping = 0.05;
  /// Fraction of the critical damping of one kind of springs, >= 0; empty: `damping`. Springs for bending
  /// exist only with BendModel::springs.
  std::optional<Real> stretch_damping, shear_damping, bend_spring_damping;
  Real friction = 0.5;       ///< friction on bodies, >= 0
  Real self_friction = 0.3;  ///< friction on itself, >= 0
  /// Distance kept from other layers and from bodies [m], > 0; usually larger than the thickness of real
  /// cloth.
  Real thickness = 0.005;
  Real drag = 1;  ///< aerodynamic coefficient for air flow across the cloth (ClothAir), >= 0
  /// Coefficient of lift, >= 0 and at most `drag`; drag - lift is the coefficient for air flow along the
  /// cloth.
  Real lift = 0.98;
  Real max_stretch = 1.1;    ///< greatest length divided by rest length along the threads, > 1; 0: no limit
  Real max_shear = 0;        ///< greatest length of a shear spring divided by its rest length; 0: no limit
  Real min_bend_radius = 0;  ///< smallest radius to which it bends [m], >= 0; 0: no limit
};

struct FabricPreset {
  const char* name;
  const char* help;
  Fabric fabric;
};

/// The presets: silk, cotton, denim, leather, rubber, balloon.
std::span<const FabricPreset> fabric_presets();
/// Returns the preset with this name; null if there is none.
const FabricPreset* find_fabric(const std::string& name);

}  // namespace offstage::effects
