#include "sim/cloth/gas_force.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace offstage::sim {
namespace {

constexpr Real kAirDensity = 1.2;  // density of leaking gas if none is given [kg/m^3]

/// Returns the volume of the gas in a cloth that encloses this volume [m^3]: at least a tenth of the volume
/// at rest. This minimum keeps cloth that is crushed flat from bursting. It also lets torn cloth, which
/// encloses nothing, lose its gas.
Real gas_volume(const Cloth& cloth, Real enclosed) {
  return std::max(enclosed, 0.1 * cloth.rest_volume);
}
Real gas_volume(const Cloth& cloth, std::span<const Vec3> at) {
  return gas_volume(cloth, cloth.gas.volume(at, cloth.triangles));
}

/// Returns the overpressure of the gas filled in so far at this volume, without leaks [Pa].
Real overpressure(const Cloth& cloth, Real volume) {
  const Real let_in = cloth.age < cloth.def.inflate_time ? cloth.age / cloth.def.inflate_time : 1;
  return let_in * cloth.def.pressure * cloth.rest_volume / volume;
}

/// Returns the current overpressure at this volume [Pa], without the weight of the gas.
Real acting_pressure(const Cloth& cloth, Real volume) {
  return cloth.gas.remaining_fraction() * overpressure(cloth, volume);
}

Real gas_density(const Cloth& cloth) {
  const Real density = cloth.def.gas_density.value_or(cloth.def.air.density);
  return density > 0 ? density : kAirDensity;
}

}  // namespace

ClothGasState gas_state(const Cloth& cloth) {
  if (cloth.def.pressure == 0) return {};
  const Real enclosed = cloth.gas.volume(cloth.points, cloth.triangles);
  return {enclosed, acting_pressure(cloth, gas_volume(cloth, enclosed))};
}

bool leaks(const Cloth& cloth) {
  return cloth.def.pressure != 0 && cloth.version > 0 && cloth.gas.remaining_fraction() > 0 && !cloth.stopped;
}

void leak(Cloth& cloth, Real h) {
  const Real volume = gas_volume(cloth, cloth.points);
  cloth.gas.leak(cloth.points, volume, overpressure(cloth, volume), gas_density(cloth), h);
}

/// For a sphere of radius R that oscillates in air, this is rho_air R / 2 and rho_gas R for the gas in it
/// (Lamb, Hydrodynamics, art. 92). It is ten times the mass of a balloon's skin, which would otherwise move
/// away faster than the gas.
Real moved_with_skin(const Cloth& cloth) {
  const Real radius = std::cbrt(3 * cloth.rest_volume / (4 * std::numbers::pi));
  return cloth.gas.remaining_fraction() * radius * (cloth.def.air.density / 2 + gas_density(cloth));
}

void GasForce::add_forces(std::span<const Vec4> x, Real factor, std::span<Vec4> force) {
  // Each corner of a triangle gets a third of the pressure on it. By the divergence theorem, the volume is a
  // sixth of the sum of the doubled area vectors times a corner.
  doubled_.assign(x.size(), Vec4::Zero());
  Real six_fold = 0;
  for (const Triangle& t : cloth_->triangles) {
    const Vec4 &a = x[t[0]], area = (x[t[1]] - a).cross3(x[t[2]] - a);
    six_fold += (a - x[0]).dot(area);
    for (uint32_t corner : t) doubled_[corner] += area;
  }
  Real volume = gas_volume(*cloth_, six_fold / 6);
  if (cloth_->gas.has_holes()) {
    at_.resize(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) at_[i] = x[i].head<3>();
    volume = gas_volume(*cloth_, at_);
  }
  const Real sixth = factor * acting_pressure(*cloth_, volume) / 6;
  for (std::size_t i = 0; i < x.size(); ++i) force[i] += sixth * doubled_[i];
}

}  // namespace offstage::sim
