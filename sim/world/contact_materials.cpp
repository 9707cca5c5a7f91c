#include "sim/world/contact_materials.h"

#include <algorithm>
#include <cmath>

namespace offstage::sim {

uint32_t ContactMaterials::number(const std::string& material) {
  const auto at = std::find(names_.begin(), names_.end(), material);
  if (at == names_.end()) return names_.push_back(material), static_cast<uint32_t>(names_.size() - 1);
  return static_cast<uint32_t>(at - names_.begin());
}

PairSurface ContactMaterials::surface(const Body& a, const Body& b, const CollisionMethods& methods) const {
  const auto static_friction = [](const BodyDef& d) {
    return d.static_friction < 0 ? d.friction : d.static_friction;
  };
  PairSurface s;
  if (methods.narrow_phase == CollisionMethods::NarrowPhase::vclip) s.method = DistanceMethod::vclip;
  if (methods.mesh_pairs == CollisionMethods::MeshPairs::triangles)
    // The solids of a compound may overlap, so that triangles of one lie inside another.
    s.by_triangles =
        a.solid.mesh && b.solid.mesh && a.solid.mesh->solids.empty() && b.solid.mesh->solids.empty();
  s.restitution = std::max(a.def.restitution, b.def.restitution);
  s.friction = std::sqrt(a.def.friction * b.def.friction);
  s.static_friction = std::sqrt(static_friction(a.def) * static_friction(b.def));
  s.rolling = std::max(a.def.rolling_friction, b.def.rolling_friction);
  s.spinning = std::max(a.def.spinning_friction, b.def.spinning_friction);
  const auto rule = rules_.find(std::minmax(a.surface, b.surface));
  if (rule != rules_.end()) {
    s.restitution = rule->second.restitution.value_or(s.restitution);
    s.friction = rule->second.friction.value_or(s.friction);
    s.static_friction =
        rule->second.static_friction.value_or(rule->second.friction.value_or(s.static_friction));
    s.rolling = rule->second.rolling_friction.value_or(s.rolling);
    s.spinning = rule->second.spinning_friction.value_or(s.spinning);
  }
  const bool a_is_first = a.handle.index < b.handle.index;
  for (const Body* body : {a_is_first ? &a : &b, a_is_first ? &b : &a}) {
    const BodyDef& d = body->def;
    s.conveys |= d.surface_velocity != Vec3::Zero();
    if (d.cross_friction < 0 || d.friction_axis == Vec3::Zero() || s.axis_body) continue;
    s.axis_body = body;
    s.cross = d.friction > 0 ? std::sqrt(d.cross_friction / d.friction) : 1;  // otherwise both are 0
  }
  return s;
}

}  // namespace offstage::sim
