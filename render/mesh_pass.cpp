#include "render/mesh_pass.h"

#include <algorithm>
#include <bit>
#include <numeric>

#include "render/smooth_surface.h"
#include "render/texture.h"

namespace offstage::render {
namespace {

struct Vertex {
  Vector3f position, normal;
  Vector2f uv;
};
static_assert(sizeof(Vertex) == 32);

/// Vertex data that only a few meshes have.
struct VertexDetails {
  Vector2f second_uv;
  Vector4f color, tangent;
};

constexpr GLuint kVertexBinding = 0, kInstanceBinding = 1, kDetailBinding = 2;
constexpr GLuint kSecondUv = 6, kColor = 7, kTangent = 8, kBefore = 9;  // attributes
constexpr GLuint kMaterialBlock = 1;
constexpr std::array<GLuint, kTextureMaps> kTextureUnits = {1, 2, 3, 14, 15, 16, 17};
// The first three rows of a transform.
using Rows = std::array<Vector4f, 3>;

Rows rows_of(const Eigen::Affine3f& transform) {
  const auto& m = transform.matrix();
  return {Vector4f(m.row(0).transpose()), Vector4f(m.row(1).transpose()), Vector4f(m.row(2).transpose())};
}

const Image* texture_at(std::span<const Image> textures, int index) {
  return index >= 0 && static_cast<std::size_t>(index) < textures.size()
             ? &textures[static_cast<std::size_t>(index)]
             : nullptr;
}

/// Uploads the second texture coordinates, colours and tangents of a mesh that has any of them.
void add_details(const Mesh& mesh, GpuMesh& gpu) {
  if (mesh.second_uvs.empty() && mesh.colors.empty() && mesh.tangents.empty()) return;
  std::vector<VertexDetails> packed(mesh.positions.size());
  for (std::size_t i = 0; i < packed.size(); ++i) {
    packed[i] = {mesh.second_uvs.empty() ? Vector2f(0, 0) : mesh.second_uvs[i],
                 mesh.colors.empty() ? Vector4f(1, 1, 1, 1) : mesh.colors[i],
                 mesh.tangents.empty() ? Vector4f(0, 0, 0, 1) : mesh.tangents[i]};
  }
  gpu.details = gl::make_buffer(std::span<const VertexDetails>(packed));
  glVertexArrayVertexBuffer(gpu.vertex_array, kDetailBinding, gpu.details, 0, sizeof(VertexDetails));
  gl::set_attribute(gpu.vertex_array, kSecondUv, kDetailBinding, 2, offsetof(VertexDetails, second_uv));
  gl::set_attribute(gpu.vertex_array, kColor, kDetailBinding, 4, offsetof(VertexDetails, color));
  gl::set_attribute(gpu.vertex_array, kTangent, kDetailBinding, 4, offsetof(VertexDetails, tangent));
}

}  // namespace

struct MeshPass::Item {
  const Instance* instance;
  float depth;     // depth of the far end of the ball, so that large ground comes last
  uint32_t order;  // breaks ties
  bool mirrored;
};

GpuMesh::GpuMesh(const Mesh& source) : vertex_array(gl::make_vertex_array()) {
  const Mesh* mesh = &source;
  Mesh smooth;
  if (source.normals.size() != source.positions.size()) {
    smooth = source;
    compute_normals(smooth, 180);
    mesh = &smooth;
  }
  std::vector<Vertex> packed(mesh->positions.size());
  for (std::size_t i = 0; i < packed.size(); ++i) {
    packed[i] = {mesh->positions[i], mesh->normals[i], mesh->uvs.empty() ? Vector2f(0, 0) : mesh->uvs[i]};
  }
  box = mesh->bounds();
  center = box.isEmpty() ? Vector3f(0, 0, 0) : Vector3f(box.center());
  for (const Vector3f& p : mesh->positions) radius = std::max(radius, (p - center).norm());
  thickness = box.isEmpty() ? 0 : box.sizes().minCoeff();
  boxy = std::ranges::all_of(mesh->positions, [this](const Vector3f& p) {
    return ((p - center).array().abs() >= 0.4f * box.sizes().array()).all();
  });
  round = !box.isEmpty() && radius < 0.505f * box.sizes().minCoeff();
  endless = mesh->endless;
  if (!box.isEmpty()) {
    flat = box.sizes().minCoeff() <= 1e-4f * box.sizes().maxCoeff();
  }

  rays = std::make_unique<RayMesh>(*mesh, mesh->normals);
  vertex_count = packed.size();
  index_count = static_cast<GLsizei>(mesh->indices.size());
  if (index_count == 0) return;
  vertices = gl::make_buffer(std::span<const Vertex>(packed));
  indices = gl::make_buffer(std::span<const uint32_t>(mesh->indices));
  glVertexArrayVertexBuffer(vertex_array, kVertexBinding, vertices, 0, sizeof(Vertex));
  glVertexArrayElementBuffer(vertex_array, indices);
  gl::set_attribute(vertex_array, 0, kVertexBinding, 3, offsetof(Vertex, position));
  gl::set_attribute(vertex_array, 1, kVertexBinding, 3, offsetof(Vertex, normal));
  gl::set_attribute(vertex_array, 2, kVertexBinding, 2, offsetof(Vertex, uv));
  glVertexArrayVertexBuffer(vertex_array, kBeforeBinding, vertices, 0, sizeof(Vertex));
  gl::set_attribute(vertex_array, kBefore, kBeforeBinding, 3, offsetof(Vertex, position));
  for (GLuint row = 0; row < 3; ++row) {
    gl::set_attribute(vertex_array, 3 + row, kInstanceBinding, 4, row * sizeof(Vector4f));
  }
  glVertexArrayBindingDivisor(vertex_array, kInstanceBinding, 1);
  add_details(*mesh, *this);
}

void GpuMesh::store() {
  stored = true;
  vertices_before = gl::Buffer();
  if (vertices != 0) glVertexArrayVertexBuffer(vertex_array, kBeforeBinding, vertices, 0, sizeof(Vertex));
}

void GpuMesh::store_previous_vertices(GpuMesh& before) {
  if (!before.stored || before.vertex_count != vertex_count || vertex_count == 0 || vertices == 0) return;
  stored = true;
  vertices_before = std::move(before.vertices_before != 0 ? before.vertices_before : before.vertices);
  glVertexArrayVertexBuffer(vertex_array, kBeforeBinding, vertices_before, 0, sizeof(Vertex));
}

void bind_material(const GpuMaterial& material, GLuint white) {
  glBindBufferBase(GL_UNIFORM_BUFFER, kMaterialBlock, material.uniforms);
  if (!material.textured) return;
  const std::size_t count = material.detailed ? material.textures.size() : 3;
  for (std::size_t k = 0; k < count; ++k)
    glBindTextureUnit(kTextureUnits[k], material.textures[k] != 0 ? GLuint{material.textures[k]} : white);
}

GpuMaterial make_gpu_material(const Material& material, std::span<const Image> textures) {
  GpuMaterial result;
  result.rays = std::make_unique<RayMaterial>(material, textures);
  MaterialUniforms uniforms;
  uniforms.color = material.color;
  uniforms.pattern_color << material.pattern_color, std::max(material.pattern_scale, 1e-4f);
  uniforms.emission << material.emission, 0;
  const Fabric& fabric = material.fabric;
  uniforms.surface = {material.metallic, material.roughness, std::max(fabric.thread, 1e-6f), fabric.relief};
  uniforms.back << fabric.back_color.value_or(material.color.head<3>()), fabric.translucency;
  uniforms.sheen << fabric.sheen * fabric.sheen_color, fabric.back_color ? 1 : 0;
  uniforms.glass = {material.transmission, 1 / std::max(material.refraction, 1.0f), 0, 0};
  uniforms.specular << material.specular, material.glossiness;
  uniforms.coat = {material.clearcoat, material.clearcoat_roughness, material.normal_scale,
                   material.occlusion_strength};
  uniforms.velvet << material.sheen_color, 0;
  uniforms.options = {material.alpha_cutoff, material.unlit ? 1.0f : 0.0f,
                      texture_at(textures, material.normal_texture.image) != nullptr ? 1.0f : 0.0f, 0};
  std::size_t row = 0;
  for_each_texture(material, [&](const TextureMap& map) {
    uniforms.uv_rows[row++] << map.rows[0], map.uv_set == 1 ? 1.0f : 0.0f;
    uniforms.uv_rows[row++] << map.rows[1], 0.0f;
  });
  result.uniforms = gl::make_buffer(std::span<const MaterialUniforms>(&uniforms, 1));

  result.detailed = material.is_detailed();
  result.textured = result.detailed;
  result.triplanar = material.triplanar;
  result.texture_rows = material.base_color_texture.rows;
  std::size_t k = 0;
  for_each_texture(material, [&](const TextureMap& map) {
    const std::size_t unit = k++;
    const Image* image = texture_at(textures, map.image);
    if (image == nullptr || (unit > 2 && !result.detailed)) return;
    const bool is_color = unit == 0 || unit == 2 || unit == 6;
    result.textures[unit] = make_texture(*image, is_color ? TextureContent::color : TextureContent::data, map,
                                         unit == 0 && result.detailed ? material.alpha_cutoff : 0.0f);
    result.textured = true;
  });
  const Image* base = texture_at(textures, material.base_color_texture.image);
  result.pattern = material.pattern;
  result.weave = fabric.weave;
  result.two_sided = material.two_sided;
  result.cut_out = result.detailed && material.alpha_cutoff > 0;
  result.blended = !result.cut_out &&
                   (material.color.w() < 1 || material.vertex_alpha || (base != nullptr && has_alpha(*base)));
  result.thin = material.thin;
  result.glass = material.transmission > 0 && !result.blended;
  result.plain = material.pattern == Pattern::none && !result.detailed && !result.blended && !result.glass &&
                 material.emission.isZero();
  result.smooth = is_smooth(material.roughness, material.metallic);
  return result;
}

float Instance::scale() const {
  return world_from_mesh.linear().colwise().norm().maxCoeff();
}

bool Instance::is_ball() const {
  const Vector3f sides = world_from_mesh.linear().colwise().norm();
  return mesh->round && sides.minCoeff() > 0.999f * sides.maxCoeff();
}

MeshPass::MeshPass(bool quick) : quick_(quick), white_(make_white_texture()) {
  // Sets the values that are used for meshes without these attributes.
  glVertexAttrib4f(kColor, 1, 1, 1, 1);
  glVertexAttrib4f(kTangent, 0, 0, 0, 1);
}

void MeshPass::prepare(std::span<const Instance* const> instances, const View& view,
                       const Features& features) {
  features_ = features;
  std::vector<Item> seen;
  for (uint32_t i = 0; i < instances.size(); ++i) {
    const Instance& instance = *instances[i];
    if (!instance.visible || instance.mesh->index_count == 0) continue;
    const Vector3f center = instance.center();
    if (!view.sees(center, instance.radius())) continue;
    seen.push_back({&instance, view.depth_of(center) + instance.radius(), i,
                    instance.world_from_mesh.linear().determinant() < 0});
  }
  const auto transparent = std::stable_partition(
      seen.begin(), seen.end(), [](const Item& item) { return !item.instance->material->lets_through(); });
  const std::vector<Item> see_through(transparent, seen.end());
  seen.erase(transparent, seen.end());
  // A surface that is cut out by its texture is opaque in some places, so it is drawn in both passes.
  const auto by_batch = [](const Item& a, const Item& b) {
    return std::tie(a.instance->batch_key, a.mirrored, a.depth, a.order) <
           std::tie(b.instance->batch_key, b.mirrored, b.depth, b.order);
  };
  std::sort(seen.begin(), seen.end(), by_batch);
  std::vector<Rows> rows;
  const auto append = [&rows](const std::vector<Item>& items, bool merge, std::vector<Batch>& batches) {
    batches.clear();
    for (const Item& item : items) {
      const Instance& instance = *item.instance;
      const bool joins = merge && !batches.empty() && batches.back().mesh == instance.mesh &&
                         batches.back().material == instance.material &&
                         batches.back().mirrored == item.mirrored;
      if (!joins) {
        batches.push_back({instance.mesh, instance.material, item.mirrored, item.depth,
                           static_cast<GLuint>(rows.size()), 0, instance.mesh->thickness * instance.scale()});
      }
      ++batches.back().count;
      rows.push_back(rows_of(instance.world_from_mesh));
    }
  };
  see_through_.clear();
  for (const Item& item : see_through) see_through_.push_back(item.instance);
  append(seen, true, opaque_);
  append(see_through, false, translucent_);
  std::stable_sort(opaque_.begin(), opaque_.end(),
                   [](const Batch& a, const Batch& b) { return a.depth < b.depth; });
  rows_.write(std::span<const Rows>(rows));
}

void MeshPass::draw(const Batch& batch) {
  const GpuMesh& mesh = *batch.mesh;
  glVertexArrayVertexBuffer(mesh.vertex_array, kInstanceBinding, rows_, 0, sizeof(Rows));
  glBindVertexArray(mesh.vertex_array);
  gl::draw_triangles(mesh.index_count, batch.count, batch.first);
}

gl::LazyProgram& MeshPass::surface_program(const Batch& batch, Shading shading) {
  const GpuMaterial& material = *batch.material;
  // A surface without mirror images is drawn without the relief of its pattern, which is faster. The light of
  // lamps, which is traced for these surfaces, gets the relief in traced.glsl.
  const bool surface = shading == Shading::surface || shading == Shading::layer;
  const Pattern pattern = surface && !material.smooth ? Pattern::none : material.pattern;
  const bool plain = surface && is_plain(batch);
  const auto key = std::make_tuple(pattern, material.textured, material.detailed, material.triplanar,
                                   material.glass, batch.mesh->endless, plain, shading, features_);
  const auto found = surface_programs_.find(key);
  if (found != surface_programs_.end()) return found->second;
  std::vector<std::string> defines = features_;
  defines.push_back("FLAT 1");
  if (surface) defines.push_back("SURFACE 1");
  if (shading == Shading::layer) defines.push_back("LAYER 1");
  if (plain) defines.push_back("PLAIN 1");
  std::vector<std::string_view> fragment = {"frame.glsl", "sky.glsl", "light.glsl", "material.glsl",
                                            surface ? "surface.glsl" : "traced.glsl"};
  if (material.textured) defines.push_back("TEXTURED 1");
  if (material.detailed) defines.push_back("DETAILED 1");
  if (material.triplanar) defines.push_back("TRIPLANAR 1");
  if (batch.mesh->endless) defines.push_back("ENDLESS 1");
  if (material.glass && !surface) {
    defines.push_back("GLASS 1");
    if (shading == Shading::traced_with_particles) defines.push_back("PARTICLES 1");
    fragment.push_back("glass.glsl");
  }
  if (pattern != Pattern::none) {
    defines.push_back("PATTERN " + std::to_string(static_cast<int>(pattern)));
    if (!material.smooth) defines.push_back("ROUGH_PATTERN 1");
    fragment.insert(fragment.end(), {"noise.glsl", "pattern.glsl"});
  }
  fragment.push_back("mesh.frag");
  const std::vector<std::string_view> vertex = {"frame.glsl", "mesh.vert"};
  return surface_programs_.emplace(key, gl::LazyProgram(vertex, fragment, defines)).first->second;
}

void MeshPass::set_facing(const Batch& batch) {
  (batch.material->two_sided ? glDisable : glEnable)(GL_CULL_FACE);
  glFrontFace(batch.mirrored ? GL_CW : GL_CCW);
}

void MeshPass::draw_batch(const Batch& batch, Shading shading, float min_alpha) {
  surface_program(batch, shading).use();
  glUniform1f(0, min_alpha);
  set_facing(batch);
  bind_material(*batch.material, white_);
  draw(batch);
}

void MeshPass::draw_opaque(Shading shading) {
  constexpr float kOpaqueAlpha = 0.99f;
  for (const Batch& batch : opaque_)
    if (shading == Shading::surface || !is_plain(batch)) draw_batch(batch, shading, kOpaqueAlpha);
  for (const Batch& batch : translucent_) {
    if (batch.material->blended && batch.material->textured) draw_batch(batch, shading, kOpaqueAlpha);
  }
}

void MeshPass::draw_translucent(std::size_t k, Shading shading) {
  constexpr float kVisibleAlpha = 1.0f / 512;
  const Batch& batch = translucent_[k];
  if (batch.material->glass && shading == Shading::traced_with_particles) {
    surface_program(batch, shading).use();
    glUniform1f(1, batch.material->thin ? 0 : batch.thickness);
  }
  draw_batch(batch, shading, batch.material->glass ? 0 : kVisibleAlpha);
}

void MeshPass::draw_translucent_depth(std::size_t k) {
  depth_program_.use();
  set_facing(translucent_[k]);
  draw(translucent_[k]);
}

}  // namespace offstage::render
