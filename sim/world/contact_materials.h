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
  /// Returns the number of a material; a new name gets a new number.
  uint32_t number(const std::string& material);
  void add(const ContactRule& rule) { rules_[std::minmax(number(rule.a), number(rule.b))] = rule; }
  /// Returns the surface properties of two bodies that meet. Properties that the rule for their materials
  /// does not give follow from the bodies' own values. `methods`: how the contacts of the bodies are found.
  PairSurface surface(const Body& a, const Body& b, const CollisionMethods& methods) const;

 private:
  std::vector<std::string> names_;
  std::map<std::pair<uint32_t, uint32_t>, ContactRule> rules_;
};

}  // namespace offstage::sim
