#pragma once
/// Private: draws the instances of meshes, and casters into the shadow map. Opaque instances are drawn front
/// to back in batches of one mesh and material; translucent ones are drawn one by one in the order of
/// PaintOrder.

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "render/frame.h"
#include "render/gl.h"
#include "render/shadow_map.h"
#include "render/trace/ray_scene.h"

namespace offstage::render {

struct GpuMesh {
  explicit GpuMesh(const Mesh& mesh);
  gl::Buffer vertices, details, indices;
  gl::VertexArray vertex_array;
  std::size_t vertex_count = 0;
  GLsizei index_count = 0;
  GLsizei coarse_count = 0;  ///< number of indices of Mesh::coarse_indices, which follow the others
  Eigen::AlignedBox3f box;
  Vector3f center;  ///< centre of the bounding ball
  float radius = 0;
  float thickness = 0;                  ///< smallest side of the bounding box
  bool flat = false;                    ///< lies in an axis-aligned plane
  bool endless = false;                 ///< see Mesh::endless
  bool round = false;                   ///< fills the ball inscribed in its box
  bool boxy = false;                    ///< fills its box, except for a bevel
  std::unique_ptr<const RayMesh> rays;  ///< the same for light rays
  bool closed = false;  ///< every edge has two triangles, so the front faces hide the back faces

  bool stored = false;         ///< was there at Stage::store_previous_transforms()
  gl::Buffer vertices_before;  ///< its vertices then, if they have been replaced; otherwise 0

  /// Makes the present vertices those from which motion starts.
  void store();
  /// The vertices that replace those of `before`, with as many of them, remember the stored ones.
  void remember(GpuMesh& before);
};
/// The binding of the vertices from which motion in Channels starts.
inline constexpr GLuint kBeforeBinding = 3;

/// The uniform block of shaders/material.glsl.
struct MaterialUniforms {
  Vector4f color, pattern_color, emission, surface, back, sheen, glass;
  Vector4f specular, coat, velvet, options;
  std::array<Vector4f, 2 * kTextureMaps> uv_rows;
};

struct GpuMaterial {
  gl::Buffer uniforms;
  std::array<gl::Texture, kTextureMaps> textures;  ///< in the order of for_each_texture()
  std::array<Vector3f, 2> texture_rows;            ///< of the colour's texture
  Pattern pattern = Pattern::none;
  Weave weave = Weave::plain;
  bool textured = false;
  bool detailed = false;  ///< see Material::is_detailed(); textured then, too
  bool cut_out = false;   ///< has holes by its alpha, and is opaque elsewhere
  bool triplanar = false;
  bool thin = false;
  bool two_sided = false;
  bool blended = false;
  bool casts = true;                        ///< false if fully transparent
  bool glass = false;                       ///< light goes through and is refracted
  bool smooth = false;                      ///< mirrors the scene
  std::unique_ptr<const RayMaterial> rays;  ///< the same for light rays

  /// Whether objects behind the surface are visible through it.
  bool lets_through() const { return blended || glass; }
};

/// Binds the material's uniforms and textures; `white` stands for missing textures.
void bind_material(const GpuMaterial& material, GLuint white);

GpuMaterial make_gpu_material(const Material& material, std::span<const Image> textures);

struct Instance {
  const GpuMesh* mesh = nullptr;
  const GpuMaterial* material = nullptr;
  std::pair<uint32_t, uint32_t> batch_key;  ///< material and mesh, for sorting
  Eigen::Affine3f world_from_mesh = Eigen::Affine3f::Identity();
  bool casts_shadow = true;
  bool visible = true;
  uint32_t object = 0;                    ///< id in Channels
  std::optional<Eigen::Affine3f> before;  ///< pose at Stage::store_previous_transforms

  float scale() const;
  Caster ball() const;
  /// Whether this is ground. Ground casts no visible shadow, and would extend the shadow map over its whole
  /// area.
  bool is_ground() const;
};

class MeshPass {
 public:
  MeshPass();
  /// Sorts the visible instances for this view. The instances must stay in memory until the view is drawn.
  void prepare(std::span<const Instance* const> instances, const View& view, const Features& features);
  /// Draws casters into a shadow map. `front_only`: of closed opaque meshes, only the faces that the light
  /// reaches; the matrix must then not mirror.
  void draw_shadows(const Matrix4f& shadow_clip_from_world, bool front_only);
  enum class Shading {
    surface,                ///< writes surfaces for the tracer of light
    traced,                 ///< in the light that was traced
    forward,                ///< translucent bodies: glass in traced light, others without
    forward_with_particles  ///< the same; glass also shows particles behind it
  };
  /// Draws the opaque instances, and the opaque parts of blended ones.
  void draw_opaque(Shading shading);
  GLuint white() const { return white_; }
  /// Translucent instances, in the order of the instances.
  std::span<const Instance* const> translucent() const { return see_through_; }
  /// Writes the surfaces of the glass among `translucent` for the tracer of light.
  void draw_glass_surfaces();
  /// Draws one of `translucent`. The light of glass has been traced and is bound. `particles`: whether glass
  /// shows those behind it, from pictures with and without them that are bound.
  void draw_translucent(std::size_t k, bool particles);
  /// Draws only the depth of one of `translucent`, by the picture's matrix.
  void draw_translucent_depth(std::size_t k, const Matrix4f& clip_from_world);

 private:
  struct Item;
  enum class Detail { full, coarse };
  struct Batch {
    const GpuMesh* mesh;
    const GpuMaterial* material;
    bool mirrored;
    float depth;
    GLuint first;  ///< first row of its instances
    GLsizei count;
    float thickness;  ///< thickness of its first instance, in the world
  };
  void draw(const Batch& batch, const gl::StreamBuffer& rows, Detail detail = Detail::full);
  gl::LazyProgram& surface_program(const Batch& batch, Shading shading);
  gl::LazyProgram& shadow_program(const GpuMaterial& material);
  static void set_facing(const Batch& batch, bool both_sides);
  void draw_batch(const Batch& batch, Shading shading);

  /// Keyed by textured, detailed, triplanar, glass, endless.
  std::map<std::tuple<Pattern, bool, bool, bool, bool, bool, Shading, Features>, gl::LazyProgram>
      surface_programs_;
  gl::LazyProgram opaque_shadow_, dithered_shadow_, textured_shadow_, detailed_shadow_;
  Features features_;
  gl::Texture white_;
  gl::StreamBuffer rows_, shadow_rows_;
  std::vector<Batch> opaque_, translucent_, casters_;
  std::vector<const Instance*> seen_;         ///< opaque instances, in the order of the rows
  std::vector<const Instance*> see_through_;  ///< instances of translucent_
  std::vector<const Instance*> casting_;      ///< casters, in the order of the rows
};

}  // namespace offstage::render
