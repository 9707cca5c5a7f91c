#pragma once
/// Private: draws cloths, from both sides, and into the shadow map.

#include <map>
#include <span>
#include <tuple>
#include <vector>

#include "render/cloth_surface.h"
#include "render/frame.h"
#include "render/gl.h"
#include "render/mesh_pass.h"

namespace offstage::render {

/// A cloth as the stage holds it.
struct Cloth {
  const GpuMaterial* material = nullptr;
  float thickness = 0;
  Vector2f texture_from_uv = {1, 1};
  bool casts_shadow = true;
  ClothSurface surface;
  uint32_t object = 0;           ///< id in Channels
  std::vector<Vector3f> before;  ///< where its vertices were at Stage::store_previous_transforms

  gl::StreamBuffer vertices, indices;
  uint32_t uploaded = 0;  ///< version of the indices
  gl::VertexArray vertex_array;

  /// Something is seen through it.
  bool is_translucent() const { return material->lets_through(); }
  bool is_seen() const { return !surface.vertices().empty() && !surface.indices().empty(); }
};

class ClothPass {
 public:
  ClothPass();
  /// Uploads a cloth as it is now.
  void prepare(Cloth& cloth);
  void draw_shadow(const Cloth& cloth, const Matrix4f& shadow_clip_from_world);
  /// The depth of an opaque one in the picture, of the very surface that `draw` shades.
  void draw_depth(const Cloth& cloth);
  void draw(const Cloth& cloth, const Features& features);

 private:
  static void bind(const Cloth& cloth, GLint texture_from_uv);
  static void draw_triangles(const Cloth& cloth);
  gl::LazyProgram& program(const GpuMaterial& material, const Features& features);

  std::map<std::tuple<Weave, Pattern, bool, bool, Features>, gl::LazyProgram> programs_;  ///< textured, sheer
  gl::LazyProgram shadow_, sheer_shadow_, textured_sheer_shadow_, depth_;
};

}  // namespace offstage::render
