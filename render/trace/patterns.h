#pragma once
/// Private: the procedural patterns of shaders/pattern.glsl on the CPU, compiled from the same source.

#include "render/model.h"

namespace offstage::render {

/// Returns the colour of a pattern at a point in object space. `footprint`: width of the area that is
/// averaged, in the object's units. Water is drawn as at the time 0.
Vector3f pattern_color(Pattern pattern, const Vector3f& position, const Vector3f& normal, float footprint,
                       const Vector3f& color, const Vector3f& second_color, float scale);

}  // namespace offstage::render
