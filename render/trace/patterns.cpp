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
};

// Clang before version 16 does not initialize the members of a struct by parentheses.
#define PatternSample(...) \
  PatternSample {          \
    __VA_ARGS__            \
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

}  // namespace glsl

template <class Shader>
Vector3f color_by(const glsl::Inputs& inputs, const Vector3f& position, const Vector3f& normal) {
  Shader shader;
  static_cast<glsl::Inputs&>(shader) = inputs;
  const auto sample = shader.pattern_sample(glsl::vec3(position.x(), position.y(), position.z()),
                                            glsl::vec3(normal.x(), normal.y(), normal.z()));
  return {sample.color.x, sample.color.y, sample.color.z};
}

}  // namespace

Vector3f pattern_color(Pattern pattern, const Vector3f& position, const Vector3f& normal, float footprint,
                       const Vector3f& color, const Vector3f& second_color, float scale) {
  const glsl::Inputs inputs{
      {glsl::vec4(0)},
      {glsl::vec4(color.x(), color.y(), color.z(), 1),
       glsl::vec4(second_color.x(), second_color.y(), second_color.z(), scale), glsl::vec4(0, 0.5f, 0, 0)},
      footprint};
  switch (pattern) {
    case Pattern::none:
      return color;
    case Pattern::checker:
      static_assert(static_cast<int>(Pattern::checker) == 1);
      return color_by<glsl::Checker>(inputs, position, normal);
    case Pattern::grid:
      static_assert(static_cast<int>(Pattern::grid) == 2);
      return color_by<glsl::Grid>(inputs, position, normal);
    case Pattern::noise:
      static_assert(static_cast<int>(Pattern::noise) == 3);
      return color_by<glsl::Noise>(inputs, position, normal);
    case Pattern::brick:
      static_assert(static_cast<int>(Pattern::brick) == 4);
      return color_by<glsl::Brick>(inputs, position, normal);
    case Pattern::wood:
      static_assert(static_cast<int>(Pattern::wood) == 5);
      return color_by<glsl::Wood>(inputs, position, normal);
    case Pattern::lawn:
      static_assert(static_cast<int>(Pattern::lawn) == 6);
      return color_by<glsl::Lawn>(inputs, position, normal);
    case Pattern::paving:
      static_assert(static_cast<int>(Pattern::paving) == 7);
      return color_by<glsl::Paving>(inputs, position, normal);
    case Pattern::stripes:
      static_assert(static_cast<int>(Pattern::stripes) == 8);
      return color_by<glsl::Stripes>(inputs, position, normal);
    case Pattern::gingham:
      static_assert(static_cast<int>(Pattern::gingham) == 9);
      return color_by<glsl::Gingham>(inputs, position, normal);
    case Pattern::concrete:
      static_assert(static_cast<int>(Pattern::concrete) == 10);
      return color_by<glsl::Concrete>(inputs, position, normal);
    case Pattern::sand:
      static_assert(static_cast<int>(Pattern::sand) == 11);
      return color_by<glsl::Sand>(inputs, position, normal);
    case Pattern::planks:
      static_assert(static_cast<int>(Pattern::planks) == 12);
      return color_by<glsl::Planks>(inputs, position, normal);
    case Pattern::water:
      static_assert(static_cast<int>(Pattern::water) == 13);
      return color_by<glsl::Water>(inputs, position, normal);
  }
  return color;
}

}  // namespace offstage::render

#pragma GCC diagnostic pop
