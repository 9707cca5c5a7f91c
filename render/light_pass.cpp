#include "render/light_pass.h"

#include <array>

#include "render/frame.h"

namespace offstage::render {
namespace {

// Texture units of shaders/traced.glsl.
constexpr GLuint kArrivingUnit = 8, kLampsUnit = 10, kMirroredUnit = 18, kHighlightsUnit = 19;

void write_texture(const gl::Texture& texture, GLuint unit, int width_px, int height_px,
                   const std::vector<Vector4f>& values) {
  glTextureSubImage2D(texture, 0, 0, 0, width_px, height_px, GL_RGBA, GL_FLOAT, values.data());
  glBindTextureUnit(unit, texture);
}

}  // namespace

LightPass::LightPass(int width_px, int height_px, const gl::Texture& depth)
    : light_(width_px, height_px),
      places_(gl::make_target(GL_RGBA32F, width_px, height_px, GL_NEAREST)),
      normals_(gl::make_target(GL_RGBA16, width_px, height_px, GL_NEAREST)),
      framebuffer_(gl::make_framebuffer(places_, depth)),
      arriving_(gl::make_target(GL_RGBA32F, width_px, height_px, GL_NEAREST)),
      mirrored_(gl::make_target(GL_RGBA32F, width_px, height_px, GL_NEAREST)) {
  glNamedFramebufferTexture(framebuffer_, GL_COLOR_ATTACHMENT1, normals_, 0);
  const std::array<GLenum, 2> both = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  glNamedFramebufferDrawBuffers(framebuffer_, 2, both.data());
  surfaces_.width_px = width_px;
  surfaces_.height_px = height_px;
  const auto count = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  surfaces_.places.resize(count);
  surfaces_.normals.resize(count);
}

void LightPass::begin() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  glViewport(0, 0, surfaces_.width_px, surfaces_.height_px);
  const std::array<float, 4> nothing = {0, 0, 0, -1}, flat = {0.5f, 0.5f, 0.5f, 0.5f};
  glClearNamedFramebufferfv(framebuffer_, GL_COLOR, 0, nothing.data());
  glClearNamedFramebufferfv(framebuffer_, GL_COLOR, 1, flat.data());
}

void LightPass::trace(const LightSources& sources, const View& view, const SampleOffsets& offsets) {
  const int width = surfaces_.width_px, height = surfaces_.height_px;
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_);
  glReadBuffer(GL_COLOR_ATTACHMENT0);
  glReadPixels(0, 0, width, height, GL_RGBA, GL_FLOAT, surfaces_.places.data());
  glReadBuffer(GL_COLOR_ATTACHMENT1);
  glReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_SHORT, surfaces_.normals.data());
  glReadBuffer(GL_COLOR_ATTACHMENT0);
  const float pixel_m = 2 * view.tan_half.y() / static_cast<float>(height);
  LightTracer(scene_, sources).trace(surfaces_, {view.eye, pixel_m, offsets}, light_);
  write_texture(arriving_, kArrivingUnit, width, height, light_.arriving);
  if (light_.has_mirrors) {
    write_texture(mirrored_, kMirroredUnit, width, height, light_.mirrored);
  } else if (mirrored_is_filled_) {
    glClearTexImage(mirrored_, 0, GL_RGBA, GL_FLOAT, nullptr);
    glBindTextureUnit(kMirroredUnit, mirrored_);
  }
  mirrored_is_filled_ = light_.has_mirrors;
  if (light_.lamps.empty()) return;
  if (lamps_ == 0) {
    lamps_ = gl::make_target(GL_RGBA32F, width, height, GL_NEAREST);
    highlights_ = gl::make_target(GL_RGBA32F, width, height, GL_NEAREST);
  }
  write_texture(lamps_, kLampsUnit, width, height, light_.lamps);
  write_texture(highlights_, kHighlightsUnit, width, height, light_.highlights);
}

}  // namespace offstage::render
