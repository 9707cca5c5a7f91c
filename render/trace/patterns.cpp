#include "render/trace/patterns.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wunused-variable"
#pragma GCC diagnostic ignored "-Wunused-but-set-variable"

#define GLM_FORCE_SWIZZLE
#include <glm/glm.hpp>

namespace offstage::render {
namespace {
namespace glsl {

// Functions that the shaders take from other files.
using namespace glm;
inline float saturate(float x) {
  return clamp(x, 0.0f, 1.0f);
}
#include "noise.inc"

struct Uniforms {
  vec4 air;
};
struct MaterialColors {
  vec4 color, pattern_color, surface;
};
/// Inputs of a shader's functions besides their arguments.
struct Inputs {
  Uniforms uniforms;
  MaterialColors material;
  float footprint;
  vec3 dFdx(const vec3&) const { return vec3(0.577f * footprint); }
  vec3 dFdy(const vec3&) const { return vec3(0.577f * footprint); }
  vec2 dFdx(const vec2&) const { return vec2(0.707f * footprint); }
  vec2 dFdy(const vec2&) const { return vec2(0.707f * footprint); }
};

// Clang before version 16 does not initialize the members of a struct by parentheses.
#define PatternSample(...) \
  PatternSample {          \
    __VA_ARGS__            \
  }
#define Threads(...) \
  Threads {          \
    __VA_ARGS__      \
  }

struct Checker : Inputs {
#define PATTERN 1
#include "pattern.inc"
#undef PATTERN
};
struct Grid : Inputs {
#define PATTERN 2
#include "pattern.inc"
#undef PATTERN
};
struct Noise : Inputs {
#define PATTERN 3
#include "pattern.inc"
#undef PATTERN
};
struct Brick : Inputs {
#define PATTERN 4
#include "pattern.inc"
#undef PATTERN
};
struct Wood : Inputs {
#define PATTERN 5
#include "pattern.inc"
#undef PATTERN
};
struct Lawn : Inputs {
#define PATTERN 6
#include "pattern.inc"
#undef PATTERN
};
struct Paving : Inputs {
#define PATTERN 7
#include "pattern.inc"
#undef PATTERN
};
struct Stripes : Inputs {
#define PATTERN 8
#include "pattern.inc"
#undef PATTERN
};
struct Gingham : Inputs {
#define PATTERN 9
#include "pattern.inc"
#undef PATTERN
};
struct Concrete : Inputs {
#define PATTERN 10
#include "pattern.inc"
#undef PATTERN
};
struct Sand : Inputs {
#define PATTERN 11
#include "pattern.inc"
#undef PATTERN
};
struct Planks : Inputs {
#define PATTERN 12
#include "pattern.inc"
#undef PATTERN
};
struct Water : Inputs {
#define PATTERN 13
#include "pattern.inc"
#undef PATTERN
};

struct PlainWeave : Inputs {
#define WEAVE 1
#include "threads.inc"
#undef WEAVE
};
struct Twill : Inputs {
#define WEAVE 2
#include "threads.inc"
#undef WEAVE
};
struct Satin : Inputs {
#define WEAVE 3
#include "threads.inc"
#undef WEAVE
};

}  // namespace glsl

template <class Shader>
PatternPoint point_by(const glsl::Inputs& inputs, const Vector3f& position, const Vector3f& normal) {
  Shader shader;
  static_cast<glsl::Inputs&>(shader) = inputs;
  const auto sample = shader.pattern_sample(glsl::vec3(position.x(), position.y(), position.z()),
                                            glsl::vec3(normal.x(), normal.y(), normal.z()));
  return {{sample.color.x, sample.color.y, sample.color.z},
          sample.roughness,
          {sample.slope.x, sample.slope.y, sample.slope.z}};
}

template <class Shader>
ThreadPoint threads_by(const glsl::Inputs& inputs, const Vector2f& place) {
  Shader shader;
  static_cast<glsl::Inputs&>(shader) = inputs;
  const auto threads = shader.threads(glsl::vec2(place.x(), place.y()));
  return {threads.shade, {threads.slope.x, threads.slope.y}};
}

}  // namespace

PatternPoint pattern_point(const PatternDef& def, const Vector3f& position, const Vector3f& normal,
                           float footprint, float time) {
  const Vector3f &color = def.color, &second = def.second_color;
  const glsl::Inputs inputs{
      {glsl::vec4(time, 0, 0, 0)},
      {glsl::vec4(color.x(), color.y(), color.z(), 1),
       glsl::vec4(second.x(), second.y(), second.z(), def.scale), glsl::vec4(0, def.roughness, 0, 0)},
      footprint};
  switch (def.pattern) {
    case Pattern::none:
      return {.color = color};
    case Pattern::checker:
      static_assert(static_cast<int>(Pattern::checker) == 1);
      return point_by<glsl::Checker>(inputs, position, normal);
    case Pattern::grid:
      static_assert(static_cast<int>(Pattern::grid) == 2);
      return point_by<glsl::Grid>(inputs, position, normal);
    case Pattern::noise:
      static_assert(static_cast<int>(Pattern::noise) == 3);
      return point_by<glsl::Noise>(inputs, position, normal);
    case Pattern::brick:
      static_assert(static_cast<int>(Pattern::brick) == 4);
      return point_by<glsl::Brick>(inputs, position, normal);
    case Pattern::wood:
      static_assert(static_cast<int>(Pattern::wood) == 5);
      return point_by<glsl::Wood>(inputs, position, normal);
    case Pattern::lawn:
      static_assert(static_cast<int>(Pattern::lawn) == 6);
      return point_by<glsl::Lawn>(inputs, position, normal);
    case Pattern::paving:
      static_assert(static_cast<int>(Pattern::paving) == 7);
      return point_by<glsl::Paving>(inputs, position, normal);
    case Pattern::stripes:
      static_assert(static_cast<int>(Pattern::stripes) == 8);
      return point_by<glsl::Stripes>(inputs, position, normal);
    case Pattern::gingham:
      static_assert(static_cast<int>(Pattern::gingham) == 9);
      return point_by<glsl::Gingham>(inputs, position, normal);
    case Pattern::concrete:
      static_assert(static_cast<int>(Pattern::concrete) == 10);
      return point_by<glsl::Concrete>(inputs, position, normal);
    case Pattern::sand:
      static_assert(static_cast<int>(Pattern::sand) == 11);
      return point_by<glsl::Sand>(inputs, position, normal);
    case Pattern::planks:
      static_assert(static_cast<int>(Pattern::planks) == 12);
      return point_by<glsl::Planks>(inputs, position, normal);
    case Pattern::water:
      static_assert(static_cast<int>(Pattern::water) == 13);
      return point_by<glsl::Water>(inputs, position, normal);
  }
  return {.color = color};
}

ThreadPoint thread_point(const Fabric& fabric, const Vector2f& place, float footprint) {
  const glsl::Inputs inputs{
      {}, {{}, {}, glsl::vec4(0, 0, fabric.thread, fabric.relief)}, footprint / fabric.thread};
  switch (fabric.weave) {
    case Weave::none:
      return {};
    case Weave::plain:
      static_assert(static_cast<int>(Weave::plain) == 1);
      return threads_by<glsl::PlainWeave>(inputs, place);
    case Weave::twill:
      static_assert(static_cast<int>(Weave::twill) == 2);
      return threads_by<glsl::Twill>(inputs, place);
    case Weave::satin:
      static_assert(static_cast<int>(Weave::satin) == 3);
      return threads_by<glsl::Satin>(inputs, place);
  }
  return {};
}

}  // namespace offstage::render

#pragma GCC diagnostic pop
