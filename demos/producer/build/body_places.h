#pragma once
/// Positions of bodies by their names, for objects attached to them: cameras and lights.

#include <map>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "producer/build/object_table.h"
#include "producer/build/snapshot.h"

namespace offstage::producer {

class BodyPlaces {
 public:
  BodyPlaces() = default;
  explicit BodyPlaces(const ObjectTable& objects) {
    for (const auto& [body, slot, id] : objects.bodies)
      if (slot)
        slots_[body->name] = *slot;
      else
        fixed_[body->name] =
            Eigen::Translation3f(body->position.cast<float>()) * body->orientation.cast<float>();
  }

  /// Returns the pose of a body. `moving`: Snapshot::bodies, which has the poses of moving bodies. Throws
  /// std::out_of_range for an unknown name.
  Eigen::Affine3f at(const std::string& name, const std::vector<BodySample>& moving) const {
    const auto slot = slots_.find(name);
    if (slot == slots_.end()) return fixed_.at(name);
    const BodySample& s = moving[slot->second];
    return Eigen::Translation3f(s.position) * s.orientation;
  }

 private:
  std::map<std::string, Eigen::Affine3f> fixed_;
  std::map<std::string, std::size_t> slots_;  // in Snapshot::bodies
};

}  // namespace offstage::producer
