#include "sim/contact/energy_guard.h"

#include <algorithm>

#include "sim/articulation/articulation.h"

namespace offstage::sim {
namespace {

/// Fraction of the kinetic energy that the velocity terms may add in a step.
constexpr Real kAdded = 0.02;

}  // namespace

bool can_do_work(const Island& island) {
  const auto drives = [](const Body* body) {
    return body && body->is_kinematic() && body->def.track.moves();
  };
  return std::any_of(island.pairs.begin(), island.pairs.end(),
                     [&](const ContactPair* p) {
                       return drives(&p->a()) || drives(&p->b()) || p->surface().conveys;
                     }) ||
         std::any_of(island.articulations.begin(), island.articulations.end(), [&](const Articulation* a) {
           // The joints of an elastic rod return energy. A rod at its lowest point has hardly any kinetic
           // energy; with a limit on the energy it would creep back.
           const auto has_spring = [](const Joint* j) { return j->def.stiffness > 0; };
           if (std::count_if(a->joints().begin(), a->joints().end(), has_spring) > 1) return true;
           return std::any_of(a->joints().begin(), a->joints().end(), [&](const Joint* j) {
             return j->def.motor.mode != Motor::Mode::none || drives(j->a) || drives(j->b);
           });
         });
}

Real kinetic_energy(const Island& island) {
  Real sum = 0;
  for (const Body* body : island.bodies) {
    const RigidBody& r = body->rigid;
    sum += (r.velocity().dot(r.momentum) + r.angular_velocity().dot(r.angular_momentum)) / 2;
  }
  return sum;
}

Real kept_fraction(const Island& island, std::span<const RelaxedBody> relaxed) {
  // The energy with s times the impulses is kinetic + first s + second s^2.
  Real kinetic = 0, first = 0, second = 0;
  for (std::size_t i = 0; i < island.bodies.size(); ++i) {
    const RigidBody& body = island.bodies[i]->rigid;
    const RelaxedBody& r = relaxed[i];
    // Impulses, inertia and angular velocity belong to the same orientation.
    const Vec3 v = body.velocity(), w = r.inverse_inertia * body.angular_momentum;
    kinetic += (v.dot(body.momentum) + w.dot(body.angular_momentum)) / 2;
    first += v.dot(r.impulse) + w.dot(r.angular_impulse);
    second += (r.inverse_mass * r.impulse.squaredNorm() +
               r.angular_impulse.dot(r.inverse_inertia * r.angular_impulse)) /
              2;
  }
  if (!(first + second > kAdded * kinetic) || can_do_work(island)) return 1;
  return first < 0 ? -first / second : 0;
}

}  // namespace offstage::sim
