#pragma once
/// What cloth is made of. Stiffnesses are per metre of width, so that a cloth behaves the same however finely
/// it is divided.

#include <span>
#include <string>

#include "sim/core/types.h"

namespace offstage::effects {

using sim::Real;

/// Resistance to bending.
enum class BendModel {
  plate,    ///< a thin plate of the flexural rigidity `bend`, on any mesh (sim/cloth/bending.h)
  springs,  ///< the book's springs to second neighbours, which resist folds but hardly a slight curvature
};

struct Fabric {
  Real areal_density = 0.15;  ///< [kg/m^2], > 0
  Real stretch = 1000;        ///< along the threads: force per metre of width at a strain of 1 [N/m], > 0
  Real shear = 100;           ///< across them [N/m], >= 0
  Real bend = 1e-4;  ///< flexural rigidity: moment per metre of width at a curvature of 1/m [N m], >= 0
  Real bend_damping = 2e-3;  ///< the moment grows by this time times its rate [s], >= 0
  BendModel bend_model = BendModel::plate;
  /// Of the springs: share of the critical damping of one spring between its two points, >= 0.
  Real damping = 0.05;
  Real friction = 0.5;       ///< on bodies, >= 0
  Real self_friction = 0.3;  ///< on itself, >= 0
  Real thickness = 0.005;    ///< distance that layers and bodies keep [m], > 0: more than that of real cloth
  Real drag = 1;             ///< coefficient of the pressure of air that comes square, >= 0
  Real lift = 0.9;           ///< <= drag; drag - lift is the coefficient of air that comes along
  Real max_stretch = 1.1;    ///< greatest length over rest length along the threads, > 1; 0: no limit
  Real max_shear = 0;        ///< the same across
};

struct FabricPreset {
  const char* name;
  const char* help;
  Fabric fabric;
};

/// silk, cotton, denim, leather, rubber.
std::span<const FabricPreset> fabric_presets();
/// The preset of a name; none if there is no such.
const FabricPreset* find_fabric(const std::string& name);

}  // namespace offstage::effects
