#pragma once
/// The text overlays of a scene.

#include "producer/build/snapshot.h"
#include "producer/scene/scene.h"
#include "render/image.h"

namespace offstage::producer {

/// Writes on a finished frame what its moment shows.
void write_texts(const Scene& scene, const Snapshot& moment, render::Image& image);

}  // namespace offstage::producer
