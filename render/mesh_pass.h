#pragma once
/// Private: draws the instances of meshes. Opaque instances are drawn front to back in batches of one mesh
/// and material; translucent ones are drawn one by one in the order of PaintOrder.

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
#include "render/trace/ray_scene.h"

namespace offstage::render {

struct GpuMesh {
  explicit GpuMesh(const Mesh& mesh);
  gl::Buffer vertices, details, indices;
  gl::VertexArray vertex_array;
  std::size_t vertex_count = 0;
  GLsizei index_count = 0;
  Eigen::AlignedBox3f box;
  Vector3f center;  ///< centre of the bounding ball
  float radius = 0;
  float thickness = 0;                  ///< smallest side of the bounding box
  bool flat = false;                    ///< whether the mesh lies in an axis-aligned plane
  bool endless = false;                 ///< see Mesh::endless
  bool round = false;                   ///< whether the mesh fills the ball inscribed in its box
  bool boxy = false;                    ///< whether the mesh fills its box, except for a bevel
  std::unique_ptr<const RayMesh> rays;  ///< the mesh for ray tracing

  bool stored = false;         ///< whether the mesh existed at the last Stage::store_previous_transforms()
  gl::Buffer vertices_before;  ///< the vertices before the last replacement; 0: they were not replaced

  /// Stores the current vertices as the previous positions for Channels::motion.
  void store();
  /// Takes the previous vertices from `before`, the mesh that this one replaces, if both have the same number
  /// of vertices.
  void store_previous_vertices(GpuMesh& before);
};
/// Vertex buffer binding of the previous positions for Channels::motion.
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
  std::array<Vector3f, 2> texture_rows;            ///< transform of the colour's texture
  Pattern pattern = Pattern::none;
  Weave weave = Weave::plain;
  bool textured = false;
  bool detailed = false;  ///< see Material::is_detailed(); a detailed material is also textured
  bool cut_out = false;   ///< whether alpha cuts holes, and the material is opaque elsewhere
  bool triplanar = false;
  bool thin = false;
  bool two_sided = false;
  bool blended = false;
  bool glass = false;   ///< whether the material transmits and refracts light
  bool smooth = false;  ///< whether the material mirrors the scene
  /// Whether the material is fully described by one colour, roughness and fraction of metal.
  bool plain = false;
  std::unique_ptr<const RayMaterial> rays;  ///< the material for ray tracing

  /// Returns whether objects behind the surface are visible through it.
  bool lets_through() const { return blended || glass; }
};

/// Binds the material's uniforms and textures. `white` is bound in place of missing textures.
void bind_material(const GpuMaterial& material, GLuint white);

GpuMaterial make_gpu_material(const Material& material, std::span<const Image> textures);

struct Instance {
  const GpuMesh* mesh = nullptr;
  const GpuMaterial* material = nullptr;
  std::pair<uint32_t, uint32_t> batch_key;  ///< material and mesh, for sorting
  Eigen::Affine3f world_from_mesh = Eigen::Affine3f::Identity();
  bool casts_shadow = true;
  bool visible = true;
  uint32_t object = 0;                    ///< id of the object in Channels
  std::optional<Eigen::Affine3f> before;  ///< pose at Stage::store_previous_transforms

  float scale() const;
  /// Return the centre and the radius of the bounding sphere in the world [m].
  Vector3f center() const { return world_from_mesh * mesh->center; }
  float radius() const { return mesh->radius * scale(); }
  /// Returns whether the instance fills the ball of center() and radius().
  bool is_ball() const;
};

class MeshPass {
 public:
  /// `quick`: plain surfaces are not drawn in their light; see Shading::traced and shaders/plain.frag.
  explicit MeshPass(bool quick);
  /// Sorts the visible instances for this view. The instances must stay in memory until the view is drawn.
  void prepare(std::span<const Instance* const> instances, const View& view, const Features& features);
  enum class Shading {
    surface,  ///< writes the surfaces from which light is traced
    layer,    ///< does the same in front of the bound depth; see LightPass::begin_layer
    /// Shaded by the traced light; quick pictures draw only materials that are not plain in this way.
    traced,
    traced_with_particles,  ///< does what `traced` does, and glass also shows the particles behind it
  };
  /// Draws the opaque instances, and the opaque parts of blended ones.
  void draw_opaque(Shading shading);
  GLuint white() const { return white_; }
  /// Returns the translucent instances, in the order of all instances.
  std::span<const Instance* const> translucent() const { return see_through_; }
  /// Draws element k of translucent(). With Shading::traced_with_particles, the pictures with and without the
  /// particles behind it must be bound.
  void draw_translucent(std::size_t k, Shading shading);
  /// Draws only the depth of element k of translucent().
  void draw_translucent_depth(std::size_t k);

 private:
  struct Item;
  struct Batch {
    const GpuMesh* mesh;
    const GpuMaterial* material;
    bool mirrored;
    float depth;
    GLuint first;  ///< first row of the batch's instances
    GLsizei count;
    float thickness;  ///< thickness of the batch's first instance in the world [m]
  };
  void draw(const Batch& batch);
  /// Returns whether the surface pass writes everything on which the colour of a batch depends.
  bool is_plain(const Batch& batch) const { return quick_ && batch.material->plain && !batch.mesh->endless; }
  gl::LazyProgram& surface_program(const Batch& batch, Shading shading);
  static void set_facing(const Batch& batch);
  void draw_batch(const Batch& batch, Shading shading, float min_alpha);

  /// Keyed by textured, detailed, triplanar, glass, endless, plain.
  std::map<std::tuple<Pattern, bool, bool, bool, bool, bool, bool, Shading, Features>, gl::LazyProgram>
      surface_programs_;
  gl::LazyProgram depth_program_{{"frame.glsl", "mesh.vert"}, {}, {"DEPTH 1"}};
  bool quick_;
  Features features_;
  gl::Texture white_;
  gl::StreamBuffer rows_;
  std::vector<Batch> opaque_, translucent_;
  /// Instances whose material lets light through, in the order of all.
  std::vector<const Instance*> see_through_;
};

}  // namespace offstage::render
