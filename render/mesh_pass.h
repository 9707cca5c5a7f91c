#pragma once
/// Private: draws the instances of meshes: opaque ones in batches of one mesh and material, front to back;
/// those that are not opaque one by one, in the order that PaintOrder finds; and casters into the shadow map.

#include <array>
#include <map>
#include <optional>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "render/frame.h"
#include "render/gl.h"
#include "render/shadow_map.h"

namespace offstage::render {

struct GpuMesh {
  explicit GpuMesh(const Mesh& mesh);
  gl::Buffer vertices, indices;
  gl::VertexArray vertex_array;
  GLsizei index_count = 0;
  GLsizei coarse_count = 0;  ///< of the indices behind those, of Mesh::coarse_indices
  Eigen::AlignedBox3f box;
  Vector3f center;  ///< of the bounding ball
  float radius = 0;
  float thickness = 0;   ///< the least side of the box around it
  bool flat = false;     ///< lies in a plane along an axis
  bool endless = false;  ///< see Mesh::endless
  bool round = false;    ///< a ball that fits its box
  bool boxy = false;     ///< fills its box, but for a bevel
  Vector3f flat_normal = {0, 0, 0};
  bool closed = false;  ///< every edge has a triangle on either side, so that the front hides the back
};

/// The uniform block of shaders/material.glsl.
struct MaterialUniforms {
  Vector4f color, pattern_color, emission, surface, back, sheen, glass;
};

struct GpuMaterial {
  gl::Buffer uniforms;
  std::array<gl::Texture, 3> textures;  ///< base colour, metallic and roughness, emission
  Pattern pattern = Pattern::none;
  Weave weave = Weave::plain;
  bool textured = false;
  bool two_sided = false;
  bool blended = false;
  bool casts = true;    ///< false if fully transparent
  bool glass = false;   ///< light goes through and is refracted
  bool smooth = false;  ///< enough to show the scene in it
  bool metal = false;

  /// Something is seen through it.
  bool lets_through() const { return blended || glass; }
};

GpuMaterial make_gpu_material(const Material& material, std::span<const Image> textures);

struct Instance {
  const GpuMesh* mesh = nullptr;
  const GpuMaterial* material = nullptr;
  std::pair<uint32_t, uint32_t> batch_key;  ///< of material and mesh, for sorting
  Eigen::Affine3f world_from_mesh = Eigen::Affine3f::Identity();
  bool casts_shadow = true;
  bool visible = true;
  uint32_t object = 0;                    ///< id in Channels
  std::optional<Eigen::Affine3f> before;  ///< where it was at Stage::store_previous_transforms

  float scale() const;
  Caster ball() const;
  /// Ground shadows nothing that the film shows, and would stretch the shadow map over all of it.
  bool is_ground() const;
};

/// What can hide light from surfaces, and from how far away; nothing does from no distance.
struct Occluders {
  float sky_reach_m = 0;
  std::vector<Eigen::AlignedBox3f> solid;  ///< boxes around what hides the sky besides the instances
  Vector3f to_sun = Vector3f::UnitY();
  float shadow_reach_m = 0;                  ///< across the light
  std::vector<Eigen::AlignedBox3f> casting;  ///< boxes around what casts shadows besides the instances
};

class MeshPass {
 public:
  MeshPass();
  /// Sorts what is visible for this view. The instances must stay where they are until it is drawn.
  void prepare(std::span<const Instance* const> instances, const View& view, const Features& features);
  /// `front_only`: of closed opaque meshes only the side that the light falls on; the matrix must not mirror.
  void draw_shadows(const Matrix4f& shadow_clip_from_world, bool front_only);
  /// Depth alone of what is wholly opaque, so that only what is seen is shaded.
  void draw_depth(const Matrix4f& clip_from_world);
  /// A plane is shaded without looking for what hides light from it where nothing can, if that is much of a
  /// picture of this size.
  void draw_opaque(const View& view, const Occluders& occluders, int width_px, int height_px);
  /// Where opaque surfaces can hide the sky within `reach` [m]: around all but a plane. `others`: boxes
  /// around what is opaque besides the instances.
  ScreenArea occluded_area(const View& view, float reach, std::span<const Eigen::AlignedBox3f> others) const;
  /// What is not opaque, in the order of the instances.
  std::span<const Instance* const> translucent() const { return see_through_; }
  /// Finds the surfaces that mirror something of the scene, and where in a picture of a size; false if there
  /// are none. `reach`: how far away things are looked for [m]. `others` as above.
  bool find_mirrors(const View& view, float reach, std::span<const Eigen::AlignedBox3f> others, int width_px,
                    int height_px);
  /// What those mirror, to be added to the picture, which is bound with its depth.
  void draw_mirrors(float reach);
  /// One of `translucent`. A glass one looks up what is behind it in a copy of the picture that is bound.
  void draw_translucent(std::size_t k);
  /// Its depth alone, by the picture's matrix.
  void draw_translucent_depth(std::size_t k, const Matrix4f& clip_from_world);

 private:
  struct Item;
  enum class Detail { full, coarse };
  struct Batch {
    const GpuMesh* mesh;
    const GpuMaterial* material;
    bool mirrored;
    float depth;
    GLuint first;  ///< of its instances' rows
    GLsizei count;
    float thickness;  ///< in the world, of the first
  };
  void draw(const Batch& batch, const gl::StreamBuffer& rows, Detail detail = Detail::full);
  void bind(const GpuMaterial& material);
  enum class Shading { whole, unhidden, mirror };
  gl::LazyProgram& surface_program(const Batch& batch, Shading shading = Shading::whole);
  gl::LazyProgram& shadow_program(const GpuMaterial& material);
  static void set_facing(const Batch& batch, bool both_sides);
  void draw_batch(const Batch& batch, Shading shading);
  static bool mirrors(const Batch& batch);
  ScreenArea hidden_area(const Batch& batch, const View& view, const Occluders& occluders) const;
  ScreenArea mirrored_area(const Batch& batch, const View& view, float reach,
                           std::span<const Eigen::AlignedBox3f> others) const;

  std::map<std::tuple<Pattern, bool, bool, bool, Shading, Features>, gl::LazyProgram>
      surface_programs_;  ///< textured, glass, endless
  gl::LazyProgram opaque_shadow_, dithered_shadow_, textured_shadow_;
  Features features_;
  gl::Texture white_;
  gl::StreamBuffer rows_, shadow_rows_;
  std::vector<Batch> opaque_, translucent_, casters_;
  std::vector<const Instance*> seen_;         ///< opaque ones, by rows
  std::vector<const Instance*> see_through_;  ///< of translucent_
  std::vector<const Instance*> casting_;      ///< by rows
  struct Mirror {
    const Batch* batch;
    Eigen::AlignedBox2i area_px;
  };
  std::vector<Mirror> mirrors_;
};

}  // namespace offstage::render
