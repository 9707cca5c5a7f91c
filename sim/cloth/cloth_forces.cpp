#include "sim/cloth/cloth_forces.h"

#include <algorithm>
#include <array>

#include "sim/cloth/gas_force.h"

namespace offstage::sim {
namespace {

/// The points of one cloth, to which forces are added.
struct Run {
  const Cloth& cloth;
  std::size_t first;
  Real time, h;
  ClothPoints& points;
  Real total_mass;

  std::size_t size() const { return cloth.points.size(); }
  Vec3 at(std::size_t i) const { return points.at(first + i); }
  /// Adds a force on the whole cloth. Each point gets a fraction in proportion to its mass.
  void accelerate(std::size_t i, const Vec3& force) { points.outer[first + i] += padded(force / total_mass); }
  /// Adds the force drag * (velocity - velocity of the point); see air_drag.h.
  void drag(std::size_t i, Real drag, const Vec3& velocity) {
    accelerate(i, drag * velocity);
    points.field_drag[first + i] += drag / total_mass;
  }
};

Vec3 direction(const Vec3& v) {
  const Real length = v.norm();
  return length > 0 ? Vec3(v / length) : Vec3(Vec3::Zero());
}

template <class Field, class Flow>
void add_flow(const Field& f, Run& run, Flow&& flow) {
  for (std::size_t i = 0; i < run.size(); ++i) {
    const Real fraction = strength(f.region, f.drop_rate, run.at(i));
    if (!(fraction > 0)) continue;
    const Vec3 air = flow(i);
    run.points.flow[run.first + i] += padded(fraction * air);
    if (f.drag > 0) run.drag(i, fraction * f.drag, air);
  }
}

void add(const WindField& f, Run& run) {
  add_flow(f, run, [&](std::size_t) { return f.wind; });
}
void add(const Vortex& f, Run& run) {
  add_flow(f, run, [&](std::size_t i) { return velocity(f, run.at(i)); });
}
void add(const Turbulence& f, Run& run) {
  std::vector<Real> places, air(3 * run.size());
  for (std::size_t i = 0; i < run.size(); ++i) {
    const Vec3 p = run.at(i);
    places.insert(places.end(), p.begin(), p.end());
  }
  TurbulentFlow(f, run.time).velocity(places, air);
  add_flow(f, run, [&](std::size_t i) { return Vec3(air[3 * i], air[3 * i + 1], air[3 * i + 2]); });
}
void add(const ConstantField& f, Run& run) {
  for (std::size_t i = 0; i < run.size(); ++i)
    run.accelerate(i, strength(f.region, f.drop_rate, run.at(i)) * f.force);
}
void add(const PointField& f, Run& run) {
  for (std::size_t i = 0; i < run.size(); ++i)
    run.accelerate(i, strength(f.region, f.drop_rate, run.at(i)) * f.force * direction(f.point - run.at(i)));
}
/// Adds the force of the hand, which the points that it holds share in proportion to their mass. The force of
/// the spring is that at the end of the sub-step, where the distance from the hand is gap + h v; otherwise a
/// stiff spring would be unstable. The term with v is added as a drag.
void add(const Grab& f, Run& run) {
  const Vec3 hand = f.track.at(run.time + run.h, Pose{}).pose.position;
  const Vec3 velocity = f.track.at(run.time, Pose{}).velocity;
  std::vector<std::size_t> held;
  Real mass = 0;
  for (std::size_t i = 0; i < run.size(); ++i) {
    if ((run.at(i) - hand).norm() > f.reach) continue;
    held.push_back(i);
    mass += run.cloth.masses[i];
  }
  const Real share = run.total_mass / mass;
  for (const std::size_t i : held) {
    run.accelerate(i, -share * f.stiffness * (run.at(i) - hand));
    run.drag(i, share * f.stiffness * run.h, Vec3::Zero());
    run.drag(i, share * f.damping, velocity);
  }
}
void add(const AppliedForce&, Run&) {}  // acts on bodies only
void add(const Explosion&, Run&) {}     // an impulse, not a force: the world applies it
template <class PairLaw>
void add(const PairLaw&, Run&) {
  static_assert(kIsPairLaw<PairLaw>);
}

/// Adds the effect of the weight of gas and air. The pressure of a gas at rest grows downwards by its weight.
/// The corners of a triangle get the forces of a pressure that is linear over it. So the force on a closed
/// cloth is exactly the buoyancy of Archimedes' principle, and acts at the centre of the volume.
void lift(Run& run, const Vec3& gravity) {
  const Cloth& cloth = run.cloth;
  if (cloth.def.pressure == 0 || !cloth.def.gas_density) return;
  const Vec3 slope =
      cloth.gas.remaining_fraction() * (*cloth.def.gas_density - cloth.def.air.density) * gravity;
  if (slope.isZero(0)) return;
  const Vec3 origin = run.at(0);
  for (const Triangle& t : cloth.triangles) {
    const Vec3 a = run.at(t[0]), b = run.at(t[1]), c = run.at(t[2]);
    const Vec3 area = (b - a).cross(c - a) / 2;
    const std::array<Real, 3> p = {slope.dot(a - origin), slope.dot(b - origin), slope.dot(c - origin)};
    const Real sum = p[0] + p[1] + p[2];
    for (std::size_t k = 0; k < 3; ++k)
      run.points.outer[run.first + t[k]] += padded((sum + p[k]) / 12 / cloth.masses[t[k]] * area);
  }
}

/// Sets the points' masses. The masses of a torn skin include the gas that it moves.
void set_inertia(Run& run) {
  std::vector<Real> inertia = run.cloth.masses;
  if (leaks(run.cloth)) {
    const Real moved = moved_with_skin(run.cloth);
    for (const Triangle& t : run.cloth.triangles) {
      const Vec3 a = run.at(t[0]);
      const Real size = (run.at(t[1]) - a).cross(run.at(t[2]) - a).norm() / 2;
      for (uint32_t corner : t) inertia[corner] += moved * size / 3;
    }
  }
  for (std::size_t i = 0; i < run.size(); ++i) {
    run.points.mass[run.first + i] = inertia[i];
    const Real fraction = run.cloth.masses[i] / inertia[i];
    run.points.outer[run.first + i] *= fraction;
    run.points.field_drag[run.first + i] *= fraction;
  }
}

}  // namespace

void add_outer_forces(const Cloth& cloth, std::size_t first, const ClothWeather& weather,
                      ClothPoints& points) {
  Real total = 0;
  for (Real m : cloth.masses) total += m;
  Run run{cloth, first, weather.time, weather.h, points, total};
  const auto fill = [&](auto& values, const auto& value) {
    std::fill_n(values.begin() + static_cast<std::ptrdiff_t>(first), run.size(), value);
  };
  fill(points.outer, padded(weather.gravity));
  fill(points.flow, padded(weather.wind));
  fill(points.field_drag, Real{0});
  for (const ForceDef* f : weather.forces)
    if (f->acts_on(cloth.handle)) std::visit([&](const auto& effect) { add(effect, run); }, f->effect);
  lift(run, weather.gravity);
  set_inertia(run);
}

bool step_leak(Cloth& cloth, std::size_t first, const ClothWeather& weather, ClothPoints& points) {
  if (!leaks(cloth)) return false;
  const std::size_t end = first + cloth.points.size();
  for (std::size_t i = first; i < end; ++i) cloth.points[i - first] = points.at(i);
  leak(cloth, weather.h);
  add_outer_forces(cloth, first, weather, points);
  for (std::size_t i = first; i < end; ++i)
    if (points.inverse_mass[i] > 0) points.inverse_mass[i] = 1 / points.mass[i];
  return true;
}

}  // namespace offstage::sim
