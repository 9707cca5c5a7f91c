#pragma once
/// The table of all keys of the scene format, with their units, ranges and help texts. The loader, the
/// writer, the schema and the reference follow from it, so each key is defined only here.
///
/// To add a key, add one line to the file that is named after the object which gets the key:
///
/// - `world`: table_world.h
/// - `materials`, `contacts`: table_material.h; the look of threads: table_fabric.h
/// - `bodies`: table_body.h; shapes: table_shape.h; copies and fills: table_placement.h
/// - `particles`: table_particles.h; looks of particles: table_particle_look.h
/// - `emitters`, with trails, splits and sub-emitters: table_emitter.h
/// - `effects`: table_effect.h
/// - `springs`: table_spring.h
/// - `joints`: table_joint.h; `articulations`: table_articulation.h
/// - `cloths`: table_cloth.h
/// - `forces`: table_force.h
/// - `overlays`: table_overlay.h
/// - `camera`, `cameras`: table_camera.h
/// - `lights`: table_light.h
/// - `environment`: table_environment.h
/// - `render`: table_render.h
/// - `output`: table_output.h
///
/// A new key at the top of the file is a line in scene_table.cpp. For a new kind of value, add a Codec to
/// values.h. fields.h has the parts of which a table is made.

#include "producer/format/fields.h"
#include "producer/scene/scene.h"

namespace offstage::producer {

/// Reads a scene. `in` collects the problems.
void read_scene(Reader& in, const Node& node, Scene& out);
/// Writes a scene with every key, including defaults.
Node write_scene(const Scene& scene);
/// Returns the descriptions of all objects of the format, the scene itself first.
Catalogue scene_catalogue();
/// Returns the names of the objects in the catalogue that have a key.
std::vector<std::string> objects_with_key(std::string_view key);

}  // namespace offstage::producer
