#include "producer/build/object_table.h"

namespace offstage::producer {

ObjectTable::ObjectTable(const Scene& scene) {
  uint32_t id = 0;
  for (const Body& body : scene.bodies) {
    bodies.push_back({&body, {}, ++id});
    if (body.motion != sim::MotionType::static_body) bodies.back().slot = slots++;
  }
  for (const Cloth& cloth : scene.cloths) cloths.push_back({&cloth, ++id});
  for (const ParticleGroup& group : scene.particles) point_sets.push_back({group.name, &group.look, ++id});
  for (const Emitter& emitter : scene.emitters)
    for_each_source(emitter, [&](const ParticleSource& source, const ParticleSource*, const std::string& name,
                                 const Emission&) {
      point_sets.push_back({name, &source.look, ++id});
    });

  const auto add_rods = [&](int count, const std::string& name, const char* kind, const auto& look) {
    for (int i = 0; i < count; ++i) rods.push_back({name, kind, look.visible, look.radius, look.material});
  };
  for (const Spring& spring : scene.springs) {
    rod_of_spring.push_back(rods.size());
    add_rods(1, spring.name, "spring", spring);
  }
  for (const Joint& joint : scene.joints) {
    rod_of_joint.push_back(rods.size());
    add_rods(rod_count(joint), joint.name, "rod", joint);
  }
  for (const Cloth& cloth : scene.cloths) {
    rod_of_cloth.push_back(rods.size());
    for (const ClothCord& cord : cloth.cords) add_rods(cord.segments, "", "cord", cord);
  }
}

render::ObjectNames object_names(const Scene& scene) {
  render::ObjectNames names;
  const auto add = [&](uint32_t id, const std::string& name, const char* kind) {
    names[id] = name.empty() ? kind + (" " + std::to_string(id)) : name;
  };
  const ObjectTable objects(scene);
  for (const ObjectTable::BodyEntry& entry : objects.bodies) add(entry.id, entry.body->name, "body");
  for (const ObjectTable::ClothEntry& entry : objects.cloths) add(entry.id, entry.cloth->name, "cloth");
  for (const ObjectTable::PointsEntry& entry : objects.point_sets) add(entry.id, entry.name, "particles");
  return names;
}

}  // namespace offstage::producer
