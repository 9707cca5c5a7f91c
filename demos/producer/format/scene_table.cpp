#include "producer/format/scene_table.h"

#include <algorithm>

#include "producer/format/table_articulation.h"
#include "producer/format/table_body.h"
#include "producer/format/table_camera.h"
#include "producer/format/table_cloth.h"
#include "producer/format/table_effect.h"
#include "producer/format/table_emitter.h"
#include "producer/format/table_environment.h"
#include "producer/format/table_force.h"
#include "producer/format/table_joint.h"
#include "producer/format/table_light.h"
#include "producer/format/table_material.h"
#include "producer/format/table_output.h"
#include "producer/format/table_overlay.h"
#include "producer/format/table_particles.h"
#include "producer/format/table_render.h"
#include "producer/format/table_spring.h"
#include "producer/format/table_world.h"

namespace offstage::producer {

template <>
struct Table<Scene> {
  static constexpr const char* kName = "scene";
  static constexpr const char* kHelp = "The whole file.";
  static Fields<Scene> fields() {
    using T = Scene;
    return {
        {"version", &T::version, "version of the format", "", between(1, 1)},
        {"name", &T::name, "name of the scene; empty: the file's name"},
        {"description", &T::description, "short description of the scene"},
        {"world", &T::world, "settings of the whole simulation"},
        {"materials", &T::materials,
         "surfaces: how they look, and their friction and restitution; other objects refer to them by name"},
        {"contacts", &T::contacts, "friction and restitution of pairs of materials"},
        {"bodies", &T::bodies, "rigid bodies"},
        {"particles", &T::particles, "groups of particles placed one by one"},
        {"emitters", &T::emitters, "sources of particles"},
        {"effects", &T::effects, "presets of emitters and forces, each at a place"},
        {"springs", &T::springs, "damped springs"},
        {"joints", &T::joints, "joints between bodies"},
        {"articulations", &T::articulations, "ready-made bodies with their joints"},
        {"cloths", &T::cloths, "cloths"},
        {"forces", &T::forces, "force fields, moving air, hands, explosions, forces between particles"},
        {"overlays", &T::overlays, "lines and text over the picture that show the state of the simulation"},
        {"camera", &T::camera, "the camera"},
        {"cameras", &T::cameras,
         "further cameras; the option `--camera NAME` draws one of them instead of `camera`"},
        {"lights", &T::lights, "the sun and other lights"},
        {"environment", &T::environment, "sky, ambient light, fog"},
        {"render", &T::render, "the picture"},
        {"output", &T::output, "frame rate, length and channels of the film"},
    };
  }
};

void read_scene(Reader& in, const Node& node, Scene& out) {
  Codec<Scene>::read(in, node, {}, out);
}

Node write_scene(const Scene& scene) {
  return Codec<Scene>::write(scene);
}

Catalogue scene_catalogue() {
  Catalogue all;
  Codec<Scene>::describe(all, {});
  return all;
}

std::vector<std::string> objects_with_key(std::string_view key) {
  static const Catalogue all = scene_catalogue();
  std::vector<std::string> names;
  for (const ObjectEntry& entry : all.objects())
    if (std::ranges::any_of(entry.properties, [&](const Member& m) { return m.key == key; }))
      names.push_back(entry.name);
  return names;
}

}  // namespace offstage::producer
