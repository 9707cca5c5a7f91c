#include "render/light_pass.h"

#include <array>

#include "render/frame.h"

namespace offstage::render {
namespace {

// Texture units of shaders/traced.glsl.
constexpr GLuint kArrivingUnit = 8, kLampsUnit = 10, kMirroredUnit = 18, kHighlightsUnit = 19;
// Of shaders/glass.glsl.
constexpr GLuint kThroughGlassUnit = 20, kMirroredByGlassUnit = 21;

void write_texture(const gl::Texture& texture, GLuint unit, const Eigen::AlignedBox2i& area_px,
                   const std::vector<Vector4f>& values) {
  glTextureSubImage2D(texture, 0, area_px.min().x(), area_px.min().y(), area_px.sizes().x(),
                      area_px.sizes().y(), GL_RGBA, GL_FLOAT, values.data());
  glBindTextureUnit(unit, texture);
}

/// Clears the targets of surfaces in the area that is drawn.
void clear_surfaces(GLuint framebuffer) {
  const std::array<float, 4> nothing = {0, 0, 0, -1}, flat = {0.5f, 0.5f, 0.5f, 0.5f};
  glClearNamedFramebufferfv(framebuffer, GL_COLOR, 0, nothing.data());
  glClearNamedFramebufferfv(framebuffer, GL_COLOR, 1, flat.data());
}

void write_to_both(GLuint framebuffer, const gl::Texture& normals) {
  glNamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT1, normals, 0);
  const std::array<GLenum, 2> both = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  glNamedFramebufferDrawBuffers(framebuffer, 2, both.data());
}

}  // namespace

LightPass::LightPass(int width_px, int height_px, const gl::Texture& depth)
    : all_px_(Eigen::Vector2i(0, 0), Eigen::Vector2i(width_px, height_px)),
      light_(width_px, height_px),
      places_(gl::make_target(GL_RGBA32F, width_px, height_px, GL_NEAREST)),
      normals_(gl::make_target(GL_RGBA16, width_px, height_px, GL_NEAREST)),
      framebuffer_(gl::make_framebuffer(places_, depth)),
      arriving_(gl::make_target(GL_RGBA32F, width_px, height_px, GL_NEAREST)),
      mirrored_(gl::make_target(GL_RGBA32F, width_px, height_px, GL_NEAREST)) {
  write_to_both(framebuffer_, normals_);
}

void LightPass::begin() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  glViewport(0, 0, all_px_.sizes().x(), all_px_.sizes().y());
  clear_surfaces(framebuffer_);
}

void LightPass::read_surfaces(const Eigen::AlignedBox2i& area_px, SurfaceBuffer& surfaces) const {
  surfaces.width_px = area_px.sizes().x();
  surfaces.height_px = area_px.sizes().y();
  const auto count =
      static_cast<std::size_t>(surfaces.width_px) * static_cast<std::size_t>(surfaces.height_px);
  surfaces.places.resize(count);
  surfaces.normals.resize(count);
  const auto read = [&](GLenum attachment, GLenum type, void* pixels) {
    glReadBuffer(attachment);
    glReadPixels(area_px.min().x(), area_px.min().y(), surfaces.width_px, surfaces.height_px, GL_RGBA, type,
                 pixels);
  };
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_);
  read(GL_COLOR_ATTACHMENT1, GL_UNSIGNED_SHORT, surfaces.normals.data());
  read(GL_COLOR_ATTACHMENT0, GL_FLOAT, surfaces.places.data());
}

LightView LightPass::light_view(const View& view, const SampleOffsets& offsets) const {
  return {view.eye, view.clip_from_world, 2 * view.tan_half.y() / static_cast<float>(all_px_.sizes().y()),
          offsets};
}

void LightPass::trace(const LightSources& sources, const View& view, const SampleOffsets& offsets) {
  read_surfaces(all_px_, surfaces_);
  LightTracer(scene_, sources).trace(surfaces_, light_view(view, offsets), light_);
  sums_ += light_.sums;
  write_texture(arriving_, kArrivingUnit, all_px_, light_.arriving);
  if (light_.has_mirrors) {
    write_texture(mirrored_, kMirroredUnit, all_px_, light_.mirrored);
  } else if (mirrored_is_filled_) {
    glClearTexImage(mirrored_, 0, GL_RGBA, GL_FLOAT, nullptr);
    glBindTextureUnit(kMirroredUnit, mirrored_);
  }
  mirrored_is_filled_ = light_.has_mirrors;
  if (light_.lamps.empty()) return;
  for (gl::Texture* texture : {&lamps_, &highlights_})
    if (*texture == 0)
      *texture = gl::make_target(GL_RGBA32F, all_px_.sizes().x(), all_px_.sizes().y(), GL_NEAREST);
  write_texture(lamps_, kLampsUnit, all_px_, light_.lamps);
  write_texture(highlights_, kHighlightsUnit, all_px_, light_.highlights);
}

void LightPass::begin_glass(GLuint depth, const Eigen::AlignedBox2i& area_px) {
  const int width = all_px_.sizes().x(), height = all_px_.sizes().y();
  if (glass_framebuffer_ == 0) {
    glass_depth_ = gl::make_target(GL_DEPTH_COMPONENT32F, width, height, GL_NEAREST);
    through_glass_ = gl::make_target(GL_RGBA32F, width, height, GL_NEAREST);
    mirrored_by_glass_ = gl::make_target(GL_RGBA32F, width, height, GL_NEAREST);
    glass_framebuffer_ = gl::make_framebuffer(places_, glass_depth_);
    write_to_both(glass_framebuffer_, normals_);
  }
  glass_px_ = area_px.intersection(all_px_);
  const int x = glass_px_.min().x(), y = glass_px_.min().y(), w = glass_px_.sizes().x(),
            h = glass_px_.sizes().y();
  glCopyImageSubData(depth, GL_TEXTURE_2D, 0, x, y, 0, glass_depth_, GL_TEXTURE_2D, 0, x, y, 0, w, h, 1);
  glBindFramebuffer(GL_FRAMEBUFFER, glass_framebuffer_);
  glViewport(0, 0, width, height);
  glEnable(GL_SCISSOR_TEST);
  glScissor(x, y, w, h);
  clear_surfaces(glass_framebuffer_);
}

void LightPass::trace_glass(const LightSources& sources, const View& view, const SampleOffsets& offsets,
                            GLuint picture_framebuffer) {
  glDisable(GL_SCISSOR_TEST);
  read_surfaces(glass_px_, glass_);
  picture_.resize(light_.arriving.size());
  glBindFramebuffer(GL_READ_FRAMEBUFFER, picture_framebuffer);
  glReadPixels(0, 0, all_px_.sizes().x(), all_px_.sizes().y(), GL_RGBA, GL_FLOAT, picture_.data());
  LightTracer(scene_, sources)
      .trace_glass(glass_, glass_px_.min().x(), glass_px_.min().y(), light_view(view, offsets), light_,
                   picture_, glass_light_);
  sums_ += glass_light_.sums;
  write_texture(through_glass_, kThroughGlassUnit, glass_px_, glass_light_.through);
  write_texture(mirrored_by_glass_, kMirroredByGlassUnit, glass_px_, glass_light_.mirrored);
}

}  // namespace offstage::render
