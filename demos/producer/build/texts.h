#pragma once
/// The text overlays of a scene.

#include "producer/build/snapshot.h"
#include "producer/scene/scene.h"
#include "render/image.h"

namespace offstage::producer {

/// Draws the text overlays that are visible at the time of `moment` on a finished frame.
void write_texts(const Scene& scene, const Snapshot& moment, render::Image& image);

}  // namespace offstage::producer
