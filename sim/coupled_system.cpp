#include "sim/coupled_system.h"

#include <algorithm>

namespace offstage::sim {
namespace {

/// The four numbers of a body's orientation. Intermediate stages are not of unit length.
Eigen::Map<Eigen::Vector4d> turn(std::span<Real> x, std::size_t body) {
  return Eigen::Map<Eigen::Vector4d>(&x[7 * body + 3]);
}
Eigen::Map<const Eigen::Vector4d> turn(std::span<const Real> x, std::size_t body) {
  return Eigen::Map<const Eigen::Vector4d>(&x[7 * body + 3]);
}
Quat orientation(std::span<const Real> x, std::size_t body) {
  return Quat(turn(x, body)).normalized();
}

}  // namespace

CoupledSystem::CoupledSystem(WorldState& world) : gravity_(world.def.gravity) {
  world.bodies.for_each([&](BodyHandle, const std::unique_ptr<Body>& body) {
    if (body->is_dynamic()) bodies_.push_back(body.get());
  });
  std::vector<ParticleSystemHandle> held;
  world.springs.for_each([&](SpringHandle, const Spring& spring) {
    for (const Attachment* a : {&spring.def.a, &spring.def.b})
      if (const auto* p = std::get_if<ParticlePoint>(a)) held.push_back(p->system);
  });
  std::size_t particles = 0;
  world.systems.for_each([&](ParticleSystemHandle handle, ParticleSystem& system) {
    if (std::find(held.begin(), held.end(), handle) == held.end()) return;
    Group group{&system, world.forces(system), {}, particles};
    for (std::size_t i = 0; i < system.arrays.size(); ++i)
      if (system.whole_step(i)) group.members.push_back(i);
    particles += group.members.size();
    groups_.push_back(std::move(group));
  });
  x_size_ = kBodyX * bodies_.size() + 3 * particles;
  p_size_ = kBodyP * bodies_.size() + 3 * particles;
  add_springs(world);
}

bool CoupledSystem::holds(const ParticleSystem& system) const {
  return std::any_of(groups_.begin(), groups_.end(), [&](const Group& g) { return g.system == &system; });
}

void CoupledSystem::add_springs(const WorldState& world) {
  // A spring at a newborn waits until that has lived up to the end of the sub-step.
  const auto ready = [&](const Attachment& a) {
    const auto* p = std::get_if<ParticlePoint>(&a);
    if (!p) return true;
    const ParticleSystem& system = world.systems[p->system];
    const auto i = system.find(p->id);
    return i && system.whole_step(*i);
  };
  world.springs.for_each([&](SpringHandle, const Spring& spring) {
    if (!ready(spring.def.a) || !ready(spring.def.b)) return;
    springs_.push_back({resolve(world, spring.def.a), resolve(world, spring.def.b), spring.def.stiffness,
                        spring.def.damping, spring.rest_length});
  });
}

CoupledSystem::End CoupledSystem::resolve(const WorldState& world, const Attachment& a) const {
  if (const auto* w = std::get_if<WorldPoint>(&a)) return {.point = w->position};
  if (const auto* b = std::get_if<BodyPoint>(&a)) {
    const Body* body = world.bodies[b->body].get();
    if (body->is_dynamic()) {
      const auto index =
          static_cast<std::size_t>(std::find(bodies_.begin(), bodies_.end(), body) - bodies_.begin());
      return {End::Kind::dynamic, b->position - body->rigid.centre, body, index};
    }
    if (body->can_move()) return {End::Kind::kinematic, b->position, body};
    return {.point = body->pose.point_to_world(b->position)};
  }
  const auto& p = std::get<ParticlePoint>(a);
  const ParticleSystem& system = world.systems[p.system];
  const std::size_t i = *system.find(p.id);
  const Group& group =
      *std::find_if(groups_.begin(), groups_.end(), [&](const Group& g) { return g.system == &system; });
  const auto member = std::lower_bound(group.members.begin(), group.members.end(), i) - group.members.begin();
  return {End::Kind::particle, Vec3::Zero(), nullptr, group.offset + static_cast<std::size_t>(member),
          system.arrays.mass[i]};
}

CoupledSystem::PointMotion CoupledSystem::motion(const End& end, Real t, std::span<const Real> x,
                                                 std::span<const Real> p) const {
  switch (end.kind) {
    case End::Kind::still:
      break;
    case End::Kind::kinematic: {
      const Motion m = end.body->def.track.at(t, end.body->def.pose);
      const Vec3 arm = m.pose.vector_to_world(end.point);
      return {m.pose.position + arm, m.velocity + m.angular_velocity.cross(arm)};
    }
    case End::Kind::dynamic: {
      const RigidBody& body = end.body->rigid;
      const Quat q = orientation(x, end.index);
      const Vec3 arm = q * end.point, w = body.angular_velocity(q, vec3(p, kBodyP * end.index + 3));
      return {vec3(x, kBodyX * end.index) + arm, vec3(p, kBodyP * end.index) / body.mass + w.cross(arm)};
    }
    case End::Kind::particle:
      return {vec3(x, particle_x(end.index)), vec3(p, particle_p(end.index))};
  }
  return {end.point, Vec3::Zero()};
}

void CoupledSystem::apply(const End& end, const Vec3& force, std::span<const Real> x,
                          std::span<Real> dp) const {
  if (end.kind == End::Kind::dynamic) {
    const std::size_t at = kBodyP * end.index;
    vec3(dp, at) += force;
    vec3(dp, at + 3) += (orientation(x, end.index) * end.point).cross(force);
  } else if (end.kind == End::Kind::particle) {
    vec3(dp, particle_p(end.index)) += force / end.mass;
  }
}

void CoupledSystem::velocity(Real, std::span<const Real> x, std::span<const Real> p,
                             std::span<Real> dx) const {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const RigidBody& body = bodies_[i]->rigid;
    const Vec3 w = body.angular_velocity(orientation(x, i), vec3(p, kBodyP * i + 3));
    const Quat q(turn(x, i));
    vec3(dx, kBodyX * i) = vec3(p, kBodyP * i) / body.mass;
    // dq/dt = 1/2 (0, w) q
    turn(dx, i) = 0.5 * (Quat(0, w.x(), w.y(), w.z()) * q).coeffs();
  }
  const auto particles = p.subspan(kBodyP * bodies_.size());
  std::copy(particles.begin(), particles.end(),
            dx.begin() + static_cast<std::ptrdiff_t>(kBodyX * bodies_.size()));
}

void CoupledSystem::force(Real t, std::span<const Real> x, std::span<const Real> p,
                          std::span<Real> dp) const {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const RigidBody& body = bodies_[i]->rigid;
    const Vec3 v = vec3(p, kBodyP * i) / body.mass;
    const Vec3 w = body.angular_velocity(orientation(x, i), vec3(p, kBodyP * i + 3));
    vec3(dp, kBodyP * i) = body.mass * gravity_ - body.linear_drag * v;
    vec3(dp, kBodyP * i + 3) = -body.angular_drag * w;
  }
  for (const Group& g : groups_)
    for (std::size_t k = 0; k < g.members.size(); ++k) {
      const std::size_t at = particle_p(g.offset + k);
      vec3(dp, at) = g.forces.acceleration(vec3(p, at), g.system->arrays.mass[g.members[k]]);
    }
  for (const ActiveSpring& s : springs_) {
    const PointMotion a = motion(s.a, t, x, p), b = motion(s.b, t, x, p);
    const Vec3 d = a.position - b.position;
    const Real length = d.norm();
    if (length == 0) continue;  // no direction to push in
    const Vec3 along = d / length;
    const Real pull =
        s.stiffness * (length - s.rest_length) + s.damping * (a.velocity - b.velocity).dot(along);
    apply(s.a, -pull * along, x, dp);
    apply(s.b, pull * along, x, dp);
  }
}

void CoupledSystem::load(std::span<Real> x, std::span<Real> p) const {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const RigidBody& body = bodies_[i]->rigid;
    vec3(x, kBodyX * i) = body.position;
    turn(x, i) = body.orientation.coeffs();
    vec3(p, kBodyP * i) = body.momentum;
    vec3(p, kBodyP * i + 3) = body.angular_momentum;
  }
  for (const Group& g : groups_)
    for (std::size_t k = 0; k < g.members.size(); ++k) {
      vec3(x, particle_x(g.offset + k)) = g.system->arrays.position[g.members[k]];
      vec3(p, particle_p(g.offset + k)) = g.system->arrays.velocity[g.members[k]];
    }
}

void CoupledSystem::store(std::span<const Real> x, std::span<const Real> p) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    RigidBody& body = bodies_[i]->rigid;
    body.position = vec3(x, kBodyX * i);
    body.orientation = orientation(x, i);
    body.momentum = vec3(p, kBodyP * i);
    body.angular_momentum = vec3(p, kBodyP * i + 3);
  }
  for (const Group& g : groups_)
    for (std::size_t k = 0; k < g.members.size(); ++k) {
      g.system->arrays.position[g.members[k]] = vec3(x, particle_x(g.offset + k));
      g.system->arrays.velocity[g.members[k]] = vec3(p, particle_p(g.offset + k));
    }
}

void CoupledSystem::step(const Integrator& integrator, Real t, Real h) {
  for (const Group& g : groups_) g.system->begin_coupled();
  std::vector<Real> x(x_size_), p(p_size_);
  IntegratorWorkspace work;
  load(x, p);
  integrator.step(*this, t, h, x, p, work);
  store(x, p);
}

}  // namespace offstage::sim
