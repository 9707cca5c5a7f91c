#pragma once
/// A world for Python. It records which handles are valid, because a stale handle must raise an exception
/// instead of undefined behaviour.

#include <set>
#include <stdexcept>
#include <string>

#include "sim/world.h"

namespace offstage::python {

class LiveWorld {
 public:
  explicit LiveWorld(const sim::WorldDef& def) : world(def) {}

  sim::World world;
  std::set<sim::BodyHandle> bodies;
  std::set<sim::ParticleSystemHandle> systems;
  std::set<sim::JointHandle> joints;
  std::set<sim::ClothHandle> cloths;
  std::set<sim::MeshHandle> meshes;

  template <class H>
  static H live(const std::set<H>& known, H handle, const char* kind) {
    if (!known.contains(handle))
      throw std::invalid_argument(std::string("this ") + kind +
                                  " does not belong to this world, or was removed");
    return handle;
  }
  sim::BodyHandle body(sim::BodyHandle h) const { return live(bodies, h, "body"); }
  sim::ParticleSystemHandle system(sim::ParticleSystemHandle h) const {
    return live(systems, h, "particle system");
  }
  sim::JointHandle joint(sim::JointHandle h) const { return live(joints, h, "joint"); }
  sim::ClothHandle cloth(sim::ClothHandle h) const { return live(cloths, h, "cloth"); }

  bool remove(sim::BodyHandle handle) {
    bodies.erase(handle);
    const bool removed = world.remove(handle);
    joints.clear();  // removing a body also removes its joints
    world.for_each_joint([&](sim::JointHandle joint) { joints.insert(joint); });
    return removed;
  }
  bool remove(sim::ParticleSystemHandle handle) { return systems.erase(handle) > 0 && world.remove(handle); }
  bool remove(sim::JointHandle handle) { return joints.erase(handle) > 0 && world.remove(handle); }
  bool remove(sim::ClothHandle handle) { return cloths.erase(handle) > 0 && world.remove(handle); }
  template <class H>
  bool remove(H handle) {
    return world.remove(handle);
  }
};

}  // namespace offstage::python
