#pragma once
/// Builds the bodies and joints of ready-made articulations.

#include <string>
#include <vector>

#include "producer/scene/scene.h"

namespace offstage::producer {

/// The bodies and joints of an articulation.
struct Parts {
  std::vector<Body> bodies;
  std::vector<Joint> joints;
};

/// Creates bodies and joints with names that begin with the name of the articulation.
class ArticulationBuilder {
 public:
  ArticulationBuilder(const Where& where, const std::string& name) : where_(where), name_(name) {}

  Body& body(const std::string& part, const std::string& material) {
    Body& b = parts.bodies.emplace_back();
    b.where = where_;
    b.name = own(part);
    b.material = material;
    return b;
  }
  /// Adds a joint. `a` and `b` are full names of bodies; an empty `b` is the world.
  Joint& joint(const std::string& part, const std::string& a, const std::string& b, const Vec3& anchor) {
    Joint& j = parts.joints.emplace_back();
    j.where = where_;
    j.name = own(part);
    j.a = a;
    j.b = b;
    j.anchor = anchor;
    return j;
  }
  /// Returns the full name of a part: NAME/PART.
  std::string own(const std::string& part) const { return name_ + "/" + part; }

  Parts parts;

 private:
  Where where_;
  std::string name_;
};

Parts build(const Chain& chain);
Parts build(const Bridge& bridge);
Parts build(const Ragdoll& doll);
Parts build(const Vehicle& vehicle);
Parts build(const Crane& crane);
Parts build(const ModelTree& tree);

}  // namespace offstage::producer
