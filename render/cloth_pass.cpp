#include "render/cloth_pass.h"

#include <string>
#include <utility>
#include <vector>

namespace offstage::render {
namespace {

constexpr GLuint kClothMaterialBlock = 1, kClothTextureUnit = 1;

gl::VertexArray make_layout() {
  gl::VertexArray layout = gl::make_vertex_array();
  gl::set_attribute(layout, 0, 0, 3, offsetof(ClothVertex, position));
  gl::set_attribute(layout, 1, 0, 4, offsetof(ClothVertex, normal));
  gl::set_attribute(layout, 2, 0, 2, offsetof(ClothVertex, uv));
  return layout;
}

gl::LazyProgram make_surface_program(std::vector<std::string> defines) {
  defines.insert(defines.end(), {"FLAT 1", "WEAVE 0", "SURFACE 1"});
  return {{"frame.glsl", "cloth.vert"},
          {"frame.glsl", "sky.glsl", "light.glsl", "material.glsl", "noise.glsl", "surface.glsl",
           "threads.glsl", "fabric.glsl", "cloth.frag"},
          std::move(defines)};
}

}  // namespace

ClothPass::ClothPass()
    : depth_({"frame.glsl", "cloth.vert"}, {}, {}),
      surface_(make_surface_program({})),
      layer_(make_surface_program({"SHEER 1", "LAYER 1"})),
      textured_layer_(make_surface_program({"SHEER 1", "LAYER 1", "TEXTURED 1"})) {}

void ClothPass::prepare(Cloth& cloth) {
  if (cloth.vertex_array == 0) cloth.vertex_array = make_layout();
  cloth.vertices.write(cloth.surface.vertices());
  if (cloth.uploaded != cloth.surface.version()) {
    cloth.indices.write(std::span<const uint32_t>(cloth.surface.indices()));
    cloth.uploaded = cloth.surface.version();
  }
  glVertexArrayVertexBuffer(cloth.vertex_array, 0, cloth.vertices, 0, sizeof(ClothVertex));
  glVertexArrayElementBuffer(cloth.vertex_array, cloth.indices);
}

void ClothPass::draw_triangles(const Cloth& cloth) {
  glBindVertexArray(cloth.vertex_array);
  gl::draw_triangles(static_cast<GLsizei>(cloth.surface.indices().size()));
}

void ClothPass::bind(const Cloth& cloth) {
  glBindBufferBase(GL_UNIFORM_BUFFER, kClothMaterialBlock, cloth.material->uniforms);
  if (cloth.material->textures[0] == 0) return;
  glBindTextureUnit(kClothTextureUnit, cloth.material->textures[0]);
  std::array<Vector3f, 2> rows = cloth.material->texture_rows;
  for (Vector3f& row : rows) row.head<2>() = row.head<2>().cwiseProduct(cloth.texture_from_uv);
  glUniform3fv(0, 2, rows[0].data());
}

void ClothPass::draw_depth(const Cloth& cloth) {
  glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
  glDisable(GL_CULL_FACE);
  if (cloth.is_translucent() && cloth.material->textures[0] != 0) {
    program(*cloth.material, {}).use();  // its texture can have holes
    bind(cloth);
  } else {
    depth_.use();
  }
  draw_triangles(cloth);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

gl::LazyProgram& ClothPass::program(const GpuMaterial& material, const Features& features) {
  const bool textured = material.textures[0] != 0;
  const bool translucent = material.lets_through();
  const auto key = std::make_tuple(material.weave, material.pattern, textured, translucent, features);
  const auto found = programs_.find(key);
  if (found != programs_.end()) return found->second;
  std::vector<std::string> defines = features;
  defines.push_back("FLAT 1");
  defines.push_back("WEAVE " + std::to_string(static_cast<int>(material.weave)));
  std::vector<std::string_view> fragment = {"frame.glsl",  "sky.glsl",      "light.glsl",
                                            "traced.glsl", "material.glsl", "noise.glsl"};
  if (textured) defines.push_back("TEXTURED 1");
  if (material.pattern != Pattern::none) {
    defines.push_back("PATTERN " + std::to_string(static_cast<int>(material.pattern)));
    fragment.push_back("pattern.glsl");
  }
  if (translucent) defines.push_back("SHEER 1");
  fragment.insert(fragment.end(), {"threads.glsl", "fabric.glsl", "cloth.frag"});
  const std::vector<std::string_view> vertex = {"frame.glsl", "cloth.vert"};
  return programs_.emplace(key, gl::LazyProgram(vertex, fragment, defines)).first->second;
}

void ClothPass::draw(const Cloth& cloth, const Features& features) {
  program(*cloth.material, features).use();
  glDisable(GL_CULL_FACE);
  glFrontFace(GL_CCW);
  bind(cloth);
  draw_triangles(cloth);
}

void ClothPass::draw_surface(const Cloth& cloth) {
  if (!cloth.is_translucent())
    surface_.use();
  else
    (cloth.material->textures[0] != 0 ? textured_layer_ : layer_).use();
  glDisable(GL_CULL_FACE);
  glFrontFace(GL_CCW);
  bind(cloth);
  draw_triangles(cloth);
}

}  // namespace offstage::render
