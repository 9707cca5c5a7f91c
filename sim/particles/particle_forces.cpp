#include "sim/particles/particle_forces.h"

#include <array>

namespace offstage::sim {
namespace {

/// Number of particles in a block. It is small, so that intermediate data stay in the first-level cache.
constexpr std::size_t kBlock = 64;

/// Particles at a stage of an integration, with their accelerations.
struct Run {
  Real time;
  std::span<const Real> x, v, mass;
  Real own_drag;
  std::span<Real> dv;
  std::span<Real> damping;  // by particle; may be empty

  std::size_t size() const { return mass.size(); }
  Eigen::Map<const Vec3> position(std::size_t i) const { return vec3(x, 3 * i); }
  Eigen::Map<const Vec3> velocity(std::size_t i) const { return vec3(v, 3 * i); }
  void push(std::size_t i, const Vec3& force) const { vec3(dv, 3 * i) += 1 / mass[i] * force; }
  void damp(std::size_t i, Real drag) const {
    if (!damping.empty()) damping[i] += drag / mass[i];
  }

  Run part(std::size_t begin, std::size_t count) const {
    return {time,
            x.subspan(3 * begin, 3 * count),
            v.subspan(3 * begin, 3 * count),
            mass.subspan(begin, count),
            own_drag,
            dv.subspan(3 * begin, 3 * count),
            damping.empty() ? damping : damping.subspan(begin, count)};
  }
};

/// Calls f(block, strengths) for each block of particles with at least one particle in the field's region.
template <class Field, class F>
void for_each_block(const Field& field, const Run& run, F&& f) {
  std::array<Real, kBlock> fraction;
  for (std::size_t begin = 0; begin < run.size(); begin += kBlock) {
    const Run block = run.part(begin, std::min(kBlock, run.size() - begin));
    const std::span s = std::span(fraction).first(block.size());
    if (strengths(field.region, field.drop_rate, block.x, s)) f(block, std::span<const Real>(s));
  }
}

void add(const ConstantField& f, const Run& run) {
  for_each_block(f, run, [&](const Run& b, std::span<const Real> fraction) {
    for (std::size_t i = 0; i < b.size(); ++i) b.push(i, fraction[i] * f.force);
  });
}
void add(const PointField& f, const Run& run) {
  for_each_block(f, run, [&](const Run& b, std::span<const Real> fraction) {
    for (std::size_t i = 0; i < b.size(); ++i) {
      const Vec3 offset = f.point - b.position(i);
      const Real distance = offset.norm();
      if (distance > 0) b.push(i, fraction[i] * f.force / distance * offset);
    }
  });
}

/// Adds the force of moving air. `flow(block, air)` writes the velocity of the air at each particle of a
/// block.
template <class Field, class Flow>
void add_air(const Field& f, const Run& run, Flow&& flow) {
  for_each_block(f, run, [&](const Run& b, std::span<const Real> fraction) {
    std::array<Real, 3 * kBlock> air;
    flow(b, std::span(air).first(3 * b.size()));
    for (std::size_t i = 0; i < b.size(); ++i) {
      b.push(i, fraction[i] *
                    air_drag(f.drag, b.own_drag, vec3(std::span<const Real>(air), 3 * i), b.velocity(i)));
      b.damp(i, fraction[i] * f.drag);
    }
  });
}
void add(const WindField& f, const Run& run) {
  add_air(f, run, [&](const Run& b, std::span<Real> air) {
    for (std::size_t i = 0; i < b.size(); ++i) vec3(air, 3 * i) = f.wind;
  });
}
void add(const Vortex& f, const Run& run) {
  add_air(f, run, [&](const Run& b, std::span<Real> air) {
    for (std::size_t i = 0; i < b.size(); ++i) vec3(air, 3 * i) = velocity(f, b.position(i));
  });
}
void add(const Turbulence& f, const Run& run) {
  const TurbulentFlow flow(f, run.time);
  add_air(f, run, [&](const Run& b, std::span<Real> air) { flow.velocity(b.x, air); });
}

void add(const Grab& f, const Run& run) {
  const Motion hand = f.track.at(run.time, Pose{});
  for (std::size_t i = 0; i < run.size(); ++i) {
    const Vec3 gap = run.position(i) - hand.pose.position;
    if (!(gap.norm() < f.reach)) continue;
    run.push(i, -f.stiffness * gap - f.damping * (run.velocity(i) - hand.velocity));
    run.damp(i, f.damping);
  }
}
template <class Other>
void add(const Other&, const Run&) {
  static_assert(kIsPairLaw<Other> || std::is_same_v<Other, Explosion> || std::is_same_v<Other, AppliedForce>,
                "every other kind must be handled here");
}

/// Returns the stiffness of a force on a particle at the position x.
Stiffness stiffness_at(const Grab& f, Real t, const Vec3& x) {
  const bool held = (x - f.track.at(t, Pose{}).pose.position).norm() < f.reach;
  return held ? Stiffness{f.stiffness, f.damping} : Stiffness{};
}
template <class Effect>
Stiffness stiffness_at(const Effect& f, Real, const Vec3& x) {
  if constexpr (requires { f.drag; }) return {0, f.drag * strength(f.region, f.drop_rate, x)};
  return {};
}

}  // namespace

void ParticleForces::accelerate(Real t, std::span<const Real> x, std::span<const Real> v,
                                std::span<const Real> mass, std::span<Real> dv,
                                std::span<Real> damping) const {
  for (std::size_t i = 0; i < mass.size(); ++i) vec3(dv, 3 * i) = acceleration(vec3(v, 3 * i), mass[i]);
  for (std::size_t i = 0; i < damping.size(); ++i) damping[i] = drag / mass[i];
  const Run run{t, x, v, mass, drag, dv, damping};
  for (const ForceDef* field : fields)
    std::visit([&](const auto& effect) { add(effect, run); }, field->effect);
}

Stiffness ParticleForces::stiffness() const {
  Stiffness sum{0, drag};
  for (const ForceDef* field : fields) sum += sim::stiffness(*field);
  return sum;
}

void ParticleForces::leapfrog_step(Real h, std::span<Vec3> x, std::span<Vec3> v,
                                   std::span<const Real> mass) const {
  for (std::size_t i = 0; i < mass.size(); ++i) {
    const Vec3 a = acceleration(v[i], mass[i]);
    const DampedKick kick(h, drag / mass[i]);
    x[i] += h * (v[i] + kick.mean * a);
    v[i] += kick.end * a;
  }
}

bool FreeFlight::force_and_damping(Real t, std::span<const Real> x, std::span<const Real> p,
                                   std::span<Real> dp, std::span<Real> damping) const {
  // The rate of each particle is copied to its three coordinates. The loop starts with the last particle,
  // because the copies are made in place.
  const std::size_t count = mass_.size();
  forces_.accelerate(t, x, p, mass_, dp, damping.first(count));
  for (std::size_t i = count; i-- > 0;)
    std::fill_n(damping.begin() + static_cast<std::ptrdiff_t>(3 * i), 3, Real(damping[i]));
  return true;
}

void ParticleForces::jacobian(Real t, std::span<const Real> x, std::span<const Real> mass, int at_x, int at_v,
                              SparseEntries& entries) const {
  for (std::size_t i = 0; i < mass.size(); ++i) {
    Stiffness sum{0, drag};
    for (const ForceDef* field : fields)
      sum += std::visit([&](const auto& effect) { return stiffness_at(effect, t, vec3(x, 3 * i)); },
                        field->effect);
    for (int k = 3 * static_cast<int>(i); k < 3 * static_cast<int>(i) + 3; ++k) {
      entries.emplace_back(at_x + k, at_v + k, 1);
      entries.emplace_back(at_v + k, at_x + k, -sum.by_position / mass[i]);
      entries.emplace_back(at_v + k, at_v + k, -sum.by_velocity / mass[i]);
    }
  }
}

}  // namespace offstage::sim
