#pragma once
/// Private: lamps for particles and translucent bodies. The light of opaque surfaces is traced.

#include <span>

#include "render/frame.h"
#include "render/points_pass.h"

namespace offstage::render {

/// Creates a lamp in the middle of a fire, as bright as its flames.
Lamp lamp_of_fire(const PointSet& flames);

/// Radiance of a white surface that faces a lamp, and the unit vector to the lamp, computed as in
/// shaders/lamps.glsl.
Vector3f lamp_radiance(const LampUniforms& lamp, const Vector3f& place, Vector3f& towards);

/// Selects the lamps of a sub-frame for shaders that have no traced light, and the point of each that emits
/// in this sub-frame. If there are more than kMostLamps, the strongest are selected.
void prepare_lamp_uniforms(std::span<const Lamp> lamps, const SampleOffsets& offsets, FrameUniforms& frame);

}  // namespace offstage::render
