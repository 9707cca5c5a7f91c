#pragma once
/// Every key of the scene format: the one place that lists them, with units, ranges and help.

#include "producer/format/fields.h"
#include "producer/scene/scene.h"

namespace offstage::producer {

void read_scene(Reader& in, const Node& node, Scene& out);
/// With every key, defaults too.
Node write_scene(const Scene& scene);
/// The scene first, then every object in it.
Catalogue scene_catalogue();

}  // namespace offstage::producer
