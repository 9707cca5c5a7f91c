#pragma once
/// All keys of the scene format with units, ranges and help texts; each is defined only here.

#include "producer/format/fields.h"
#include "producer/scene/scene.h"

namespace offstage::producer {

void read_scene(Reader& in, const Node& node, Scene& out);
/// Writes a scene with every key, including defaults.
Node write_scene(const Scene& scene);
/// Returns the scene first, then every object in it.
Catalogue scene_catalogue();

}  // namespace offstage::producer
