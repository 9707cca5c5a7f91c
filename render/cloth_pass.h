#pragma once
/// Private: draws cloths from both sides.

#include <map>
#include <span>
#include <tuple>
#include <vector>

#include "render/cloth_surface.h"
#include "render/frame.h"
#include "render/gl.h"
#include "render/mesh_pass.h"

namespace offstage::render {

/// A cloth of the stage, with the data for drawing it.
struct Cloth {
  const GpuMaterial* material = nullptr;
  float thickness = 0;
  Vector2f texture_from_uv = {1, 1};
  bool casts_shadow = true;
  ClothSurface surface;
  uint32_t object = 0;           ///< id of the object in Channels
  std::vector<Vector3f> before;  ///< vertex positions at the last Stage::store_previous_transforms()

  gl::StreamBuffer vertices, indices;
  uint32_t uploaded = 0;  ///< version of the uploaded indices
  gl::VertexArray vertex_array;

  /// Returns whether objects behind the cloth are visible through it.
  bool is_translucent() const { return material->lets_through(); }
  bool is_seen() const { return !surface.vertices().empty() && !surface.indices().empty(); }
};

class ClothPass {
 public:
  ClothPass();
  /// Uploads the current state of a cloth.
  void prepare(Cloth& cloth);
  /// Draws only the depth of a cloth, which is exactly that of draw().
  void draw_depth(const Cloth& cloth);
  void draw(const Cloth& cloth, const Features& features);
  /// Draws the surface of a cloth into the targets from which its light is traced. Of a translucent cloth,
  /// only what is in front of the bound depth is drawn; see LightPass::begin_layer.
  void draw_surface(const Cloth& cloth);

 private:
  static void bind(const Cloth& cloth);
  static void draw_triangles(const Cloth& cloth);
  gl::LazyProgram& program(const GpuMaterial& material, const Features& features);

  std::map<std::tuple<Weave, Pattern, bool, bool, Features>, gl::LazyProgram>
      programs_;  ///< key: textured, translucent, features
  gl::LazyProgram depth_, surface_, layer_, textured_layer_;
};

}  // namespace offstage::render
