#pragma once
/// The materials of bodies and the rules for pairs of them.

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "sim/contact/contact_pair.h"
#include "sim/world.h"

namespace offstage::sim {

class ContactMaterials {
 public:
  /// Returns the number that identifies a material; a new name gets a new number.
  uint32_t number(const std::string& material);
  void add(const ContactRule& rule) { rules_[std::minmax(number(rule.a), number(rule.b))] = rule; }
  /// Returns the combined surface properties of two bodies. The rule for their materials takes precedence;
  /// properties that it does not set are combined from the values of both bodies. `methods`: the algorithms
  /// of collision detection.
  PairSurface surface(const Body& a, const Body& b, const CollisionMethods& methods) const;

 private:
  std::vector<std::string> names_;
  std::map<std::pair<uint32_t, uint32_t>, ContactRule> rules_;
};

}  // namespace offstage::sim
