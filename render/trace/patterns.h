#pragma once
/// Private: the procedural patterns of shaders/pattern.glsl and the threads of shaders/threads.glsl on the
/// CPU, compiled from the same source.

#include "render/model.h"

namespace offstage::render {

/// A pattern at a point, as PatternSample in shaders/pattern.glsl.
struct PatternPoint {
  Vector3f color = Vector3f::Zero();
  float roughness = 1;                ///< factor
  Vector3f slope = Vector3f::Zero();  ///< gradient of the surface's height, along the object's axes
};

/// The values on which a pattern depends. `roughness`: of the material.
struct PatternDef {
  Pattern pattern = Pattern::none;
  Vector3f color = Vector3f::Zero(), second_color = Vector3f::Zero();
  float scale = 1, roughness = 0.5f;  ///< `scale`: size of one cell [m]
};

/// Returns a pattern at a point in object space. `footprint`: width of the area that is averaged, in the
/// object's units. `time`: of the ripples of water [s].
PatternPoint pattern_point(const PatternDef& def, const Vector3f& position, const Vector3f& normal,
                           float footprint, float time);

/// Threads of a fabric at a point, as Threads in shaders/threads.glsl.
struct ThreadPoint {
  float shade = 1;                    ///< factor of the colour
  Vector2f slope = Vector2f::Zero();  ///< gradient of the height, along weft and warp
};

/// Returns the threads of a fabric at a place [m] along weft and warp. `footprint`: width of the area that is
/// averaged [m].
ThreadPoint thread_point(const Fabric& fabric, const Vector2f& place, float footprint);

}  // namespace offstage::render
