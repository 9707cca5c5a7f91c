#pragma once
/// Positions of bodies by their names, for objects attached to them: cameras and lights.

#include <map>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "producer/build/snapshot.h"

namespace offstage::producer {

class BodyPlaces {
 public:
  void add_fixed(const std::string& name, const Eigen::Affine3f& world_from_body) {
    fixed_[name] = world_from_body;
  }
  /// `slot`: in Snapshot::bodies.
  void add_moving(const std::string& name, std::size_t slot) { slots_[name] = slot; }

  /// Throws std::out_of_range for an unknown name.
  Eigen::Affine3f at(const std::string& name, const std::vector<BodySample>& moving) const {
    const auto slot = slots_.find(name);
    if (slot == slots_.end()) return fixed_.at(name);
    const BodySample& s = moving[slot->second];
    return Eigen::Translation3f(s.position) * s.orientation;
  }

 private:
  std::map<std::string, Eigen::Affine3f> fixed_;
  std::map<std::string, std::size_t> slots_;
};

}  // namespace offstage::producer
