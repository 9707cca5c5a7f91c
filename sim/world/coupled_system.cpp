#include "sim/world/coupled_system.h"

#include <algorithm>

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include "sim/world/coupling_graph.h"

namespace offstage::sim {
namespace {

/// Number of single bodies per task. With fewer than kParallel bodies, tasks cost more than they save.
constexpr std::size_t kBlock = 64, kParallel = 256;

std::vector<Body*> awake_bodies(WorldState& world) {
  std::vector<Body*> bodies;
  world.bodies.for_each([&](BodyHandle, const std::unique_ptr<Body>& body) {
    if (body->is_awake()) bodies.push_back(body.get());
  });
  return bodies;
}

}  // namespace

CoupledSystem::CoupledSystem(WorldState& world, std::span<const ForceDef* const> forces)
    : begins_substep_(true) {
  resolve(world, forces);
  gather(world, awake_bodies(world), true);
}

CoupledSystem::CoupledSystem(WorldState& world, std::span<Body* const> bodies,
                             std::span<const ForceDef* const> forces)
    : begins_substep_(false) {
  resolve(world, forces);
  gather(world, bodies, false);
}

void CoupledSystem::resolve(const WorldState& world, std::span<const ForceDef* const> forces) {
  for (const ForceDef* def : forces) {
    ActiveForce force{def, {}};
    for (BodyHandle handle : def->bodies)
      if (const auto* body = world.bodies.find(handle)) force.only.push_back(&(*body)->rigid);
    std::sort(force.only.begin(), force.only.end());
    active_.push_back(std::move(force));
  }
  const Real inside = kInside * (world.substep_end - world.substep_start);
  forces_ = {world.def.gravity, active_, world.def.wind, world.substep_start + inside,
             world.substep_end - inside};
}

void CoupledSystem::gather(WorldState& world, std::span<Body* const> bodies, bool all_systems) {
  if (world.springs.empty() && world.articulations.empty() && !world.has_pair_forces()) {
    lone_.assign(bodies.begin(), bodies.end());
    return;
  }
  const CouplingGraph graph(world);
  // The groups are ordered by their first members, and so do not depend on addresses.
  std::vector<std::size_t> index(graph.size(), CouplingGraph::kNone);
  std::vector<GroupMembers> networks;
  const auto has_network = [&](std::size_t component) { return index[component] != CouplingGraph::kNone; };
  const auto network = [&](std::size_t component) -> GroupMembers& {
    if (!has_network(component)) {
      index[component] = networks.size();
      networks.emplace_back();
    }
    return networks[index[component]];
  };
  for (Body* body : bodies) {
    if (const std::size_t c = graph.component(*body); c != CouplingGraph::kNone)
      network(c).bodies.push_back(body);
    else
      lone_.push_back(body);
  }
  world.systems.for_each([&](ParticleSystemHandle, ParticleSystem& system) {
    const std::size_t c = graph.component(system);
    if (c != CouplingGraph::kNone && (all_systems || has_network(c))) network(c).systems.push_back(&system);
  });
  world.springs.for_each([&](SpringHandle, const Spring& spring) {
    if (!world.acts(spring)) return;
    const std::size_t c = graph.component(spring);
    if (c != CouplingGraph::kNone && has_network(c)) network(c).springs.push_back(&spring);
  });
  for (const auto& articulation : world.articulations) {
    const std::size_t c = graph.component(*articulation);
    if (has_network(c)) network(c).articulations.push_back(articulation.get());
  }
  networks_.reserve(networks.size());
  for (GroupMembers& members : networks) networks_.emplace_back(world, std::move(members), forces_);
}

JointFigures CoupledSystem::joint_figures() const {
  JointFigures sum;
  for (const CoupledGroup& n : networks_) sum.add(n.joint_figures());
  return sum;
}

bool CoupledSystem::holds(const ParticleSystem& system) const {
  return std::any_of(networks_.begin(), networks_.end(),
                     [&](const CoupledGroup& n) { return n.holds(system); });
}

void CoupledSystem::for_each_held_body(const auto& use) const {
  const auto use_held = [&](Body* body) {
    if (body->has_motion_forces) use(*body);
  };
  std::ranges::for_each(lone_, use_held);
  for (const CoupledGroup& n : networks_) std::ranges::for_each(n.bodies(), use_held);
}

void CoupledSystem::step(const Integrator& integrator, Real t, Real h, Real tolerance) {
  for_each_held_body([](Body& body) { body.held.add_to(body.rigid); });
  fly_uncoupled(integrator, t, h, tolerance);
  std::vector<IntegratorReport> reports(networks_.size());
  tbb::parallel_for(std::size_t{0}, networks_.size(), [&](std::size_t i) {
    IntegratorWorkspace work{.tolerance = tolerance};
    if (begins_substep_) networks_[i].begin_substep();
    networks_[i].step(integrator, t, h, work);
    reports[i] = work.report;
  });
  for (const IntegratorReport& r : reports) report_.add(r);
  for_each_held_body([h](Body& body) { body.held.take_back(body.rigid, h); });
}

void CoupledSystem::fly_uncoupled(const Integrator& integrator, Real t, Real h, Real tolerance) {
  const auto fly_range = [&](std::size_t begin, std::size_t end, IntegratorWorkspace& work) {
    for (std::size_t i = begin; i < end; ++i) fly(lone_[i]->rigid, forces_, integrator, t, h, work);
  };
  if (lone_.size() <= kParallel) {
    IntegratorWorkspace work{.tolerance = tolerance};
    fly_range(0, lone_.size(), work);
    report_.add(work.report);
    return;
  }
  tbb::enumerable_thread_specific<IntegratorWorkspace> spaces(IntegratorWorkspace{.tolerance = tolerance});
  tbb::parallel_for(std::size_t{0}, (lone_.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
    const std::size_t begin = block * kBlock;
    fly_range(begin, std::min(begin + kBlock, lone_.size()), spaces.local());
  });
  for (const IntegratorWorkspace& work : spaces) report_.add(work.report);
}

void CoupledSystem::save() {
  kept_.clear();
  kept_.reserve(lone_.size());
  for (const Body* body : lone_) kept_.push_back(body->rigid.state());
  for (CoupledGroup& n : networks_) n.save();
}

void CoupledSystem::restore() {
  for (std::size_t i = 0; i < lone_.size(); ++i) lone_[i]->rigid.set_state(kept_[i]);
  for (CoupledGroup& n : networks_) n.restore();
}

void CoupledSystem::restore(std::span<Body* const> bodies) {
  if (lone_index_.empty()) {
    for (std::size_t i = 0; i < lone_.size(); ++i) lone_index_.emplace_back(lone_[i], i);
    std::sort(lone_index_.begin(), lone_index_.end());
  }
  for (const Body* body : bodies) {
    const auto at = std::lower_bound(lone_index_.begin(), lone_index_.end(), std::pair(body, std::size_t{0}));
    if (at != lone_index_.end() && at->first == body) lone_[at->second]->rigid.set_state(kept_[at->second]);
  }
  for (CoupledGroup& n : networks_)
    if (std::find_first_of(n.bodies().begin(), n.bodies().end(), bodies.begin(), bodies.end()) !=
        n.bodies().end())
      n.restore();
}

}  // namespace offstage::sim
