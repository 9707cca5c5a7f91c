#include "render/channels_pass.h"

#include <array>
#include <limits>

#include "render/texture.h"

namespace offstage::render {

ChannelsPass::ChannelsPass(int width_px, int height_px)
    : width_px_(width_px),
      height_px_(height_px),
      normal_id_(gl::make_target(GL_RGBA32F, width_px, height_px, GL_NEAREST)),
      motion_depth_(gl::make_target(GL_RGBA32F, width_px, height_px, GL_NEAREST)),
      depth_(gl::make_target(GL_DEPTH_COMPONENT32F, width_px, height_px, GL_NEAREST)),
      framebuffer_(gl::make_framebuffer(normal_id_, depth_)),
      white_(make_white_texture()),
      cloth_layout_(gl::make_vertex_array()) {
  glNamedFramebufferTexture(framebuffer_, GL_COLOR_ATTACHMENT1, motion_depth_, 0);
  const std::array<GLenum, 2> both = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  glNamedFramebufferDrawBuffers(framebuffer_, 2, both.data());
  gl::set_attribute(cloth_layout_, 0, 0, 3, offsetof(ClothVertex, position));
  gl::set_attribute(cloth_layout_, 1, 0, 3, offsetof(ClothVertex, normal));
  gl::set_attribute(cloth_layout_, 2, 1, 3, 0);
}

void ChannelsPass::begin(const Matrix4f& clip_from_world, const Matrix4f& clip_before_from_world) {
  clip_from_world_ = clip_from_world;
  clip_before_from_world_ = clip_before_from_world;
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  glViewport(0, 0, width_px_, height_px_);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_TRUE);  // the drawing passes have disabled writing of depth, and clearing needs it
  glDepthFunc(GL_GREATER);
  glDisable(GL_BLEND);
  const std::array<float, 4> nothing = {0, 0, 0, 0};
  for (const GLint k : {0, 1}) glClearNamedFramebufferfv(framebuffer_, GL_COLOR, k, nothing.data());
  glClearNamedFramebufferfv(framebuffer_, GL_DEPTH, 0, nothing.data());
}

void ChannelsPass::set_matrices(const Matrix4f& world_from_mesh, const Matrix4f& world_before_from_mesh,
                                uint32_t id) {
  const Matrix4f now = clip_from_world_ * world_from_mesh;
  const Matrix4f before = clip_before_from_world_ * world_before_from_mesh;
  const Eigen::Matrix3f normals = world_from_mesh.topLeftCorner<3, 3>().inverse().transpose();
  glUniformMatrix4fv(0, 1, GL_FALSE, now.data());
  glUniformMatrix4fv(4, 1, GL_FALSE, before.data());
  glUniformMatrix3fv(8, 1, GL_FALSE, normals.data());
  glUniform3f(11, 0.5f * static_cast<float>(width_px_), -0.5f * static_cast<float>(height_px_),
              static_cast<float>(id));
}

void ChannelsPass::draw(const Instance& instance) {
  const bool holes = instance.material->cut_out;
  (holes ? holes_ : mesh_).use();
  if (holes) bind_material(*instance.material, white_);
  set_matrices(instance.world_from_mesh.matrix(), instance.before.value_or(instance.world_from_mesh).matrix(),
               instance.object);
  (instance.material->two_sided ? glDisable : glEnable)(GL_CULL_FACE);
  glFrontFace(instance.world_from_mesh.linear().determinant() < 0 ? GL_CW : GL_CCW);
  glVertexArrayVertexBuffer(instance.mesh->vertex_array, 1, instance.mesh->vertices, 0, 0);  // not read
  glBindVertexArray(instance.mesh->vertex_array);
  gl::draw_triangles(instance.mesh->index_count);
}

void ChannelsPass::draw(const Cloth& cloth) {
  std::vector<Vector3f> before = cloth.before;
  if (before.size() != cloth.surface.vertices().size()) {  // the cloth is new, or tore
    before.clear();
    for (const ClothVertex& v : cloth.surface.vertices()) before.push_back(v.position);
  }
  places_before_.write(std::span<const Vector3f>(before));
  cloth_.use();
  set_matrices(Matrix4f::Identity(), Matrix4f::Identity(), cloth.object);
  glDisable(GL_CULL_FACE);
  glFrontFace(GL_CCW);
  glVertexArrayVertexBuffer(cloth_layout_, 0, cloth.vertices, 0, sizeof(ClothVertex));
  glVertexArrayVertexBuffer(cloth_layout_, 1, places_before_, 0, sizeof(Vector3f));
  glVertexArrayElementBuffer(cloth_layout_, cloth.indices);
  glBindVertexArray(cloth_layout_);
  gl::draw_triangles(static_cast<GLsizei>(cloth.surface.indices().size()));
}

void ChannelsPass::draw_balls(PointsPass& pass, const PointSet& set, float time) {
  glDisable(GL_CULL_FACE);
  pass.use_channels();
  glUniformMatrix4fv(4, 1, GL_FALSE, clip_before_from_world_.data());
  glUniform4f(11, 0.5f * static_cast<float>(width_px_), -0.5f * static_cast<float>(height_px_),
              static_cast<float>(set.object), time);
  pass.draw_channels(set);
}

void ChannelsPass::end(Channels& result) {
  const auto count = static_cast<std::size_t>(width_px_) * static_cast<std::size_t>(height_px_);
  result = {width_px_,
            height_px_,
            std::vector<float>(count),
            std::vector<Vector3f>(count),
            std::vector<uint32_t>(count),
            std::vector<Vector2f>(count)};
  std::vector<Vector4f> pixels(count);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_);
  // OpenGL returns rows from the bottom up.
  const auto read = [&](GLenum attachment, auto&& put) {
    glReadBuffer(attachment);
    glReadPixels(0, 0, width_px_, height_px_, GL_RGBA, GL_FLOAT, pixels.data());
    const auto width = static_cast<std::size_t>(width_px_), height = static_cast<std::size_t>(height_px_);
    for (std::size_t y = 0; y < height; ++y)
      for (std::size_t x = 0; x < width; ++x) put(y * width + x, pixels[(height - 1 - y) * width + x]);
  };
  read(GL_COLOR_ATTACHMENT0, [&](std::size_t i, const Vector4f& p) {
    result.normal[i] = p.head<3>();
    result.id[i] = static_cast<uint32_t>(p.w());
  });
  read(GL_COLOR_ATTACHMENT1, [&](std::size_t i, const Vector4f& p) {
    result.motion[i] = p.head<2>();
    result.depth[i] = p.z() > 0 ? p.z() : std::numeric_limits<float>::infinity();
  });
  glReadBuffer(GL_COLOR_ATTACHMENT0);
  gl::check_error("drawing channels");
}

}  // namespace offstage::render
