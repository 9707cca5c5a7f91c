#include "render/light_pass.h"

#include <algorithm>
#include <array>

#include "render/frame.h"

namespace offstage::render {
namespace {

// Texture units of shaders/traced.glsl.
constexpr GLuint kArrivingUnit = 8, kSunUnit = 9, kLampsUnit = 10, kMirroredUnit = 18, kHighlightsUnit = 19;
// Texture units of shaders/glass.glsl.
constexpr GLuint kThroughGlassUnit = 20, kMirroredByGlassUnit = 21;
// Texture units of shaders/plain.frag.
constexpr GLuint kPlacesUnit = 25, kNormalsUnit = 26, kColorsUnit = 27;
// Texture unit of shaders/surface.glsl.
constexpr GLuint kDepthBehindUnit = 28;

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

/// Moves the first corner of a part of the picture to a multiple of kGrid_px. The samples of a pixel depend
/// on its place in the part. They complement those of the other sub-frames only if the part begins at the
/// same pixel, although its objects move a little.
Eigen::AlignedBox2i on_grid(const Eigen::AlignedBox2i& part_px) {
  constexpr int kGrid_px = 16;
  return {Eigen::Vector2i(part_px.min().array() / kGrid_px * kGrid_px), part_px.max()};
}

/// Makes all targets of surfaces writable. `colors`: texture for the colours of surfaces; 0 if they are not
/// written.
void write_to_all(GLuint framebuffer, const gl::Texture& normals, GLuint colors) {
  glNamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT1, normals, 0);
  if (colors != 0) glNamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT2, colors, 0);
  const std::array<GLenum, 3> all = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1, GL_COLOR_ATTACHMENT2};
  glNamedFramebufferDrawBuffers(framebuffer, colors != 0 ? 3 : 2, all.data());
}

}  // namespace

LightPass::LightPass(int width_px, int height_px, const gl::Texture& depth, bool quick)
    : all_px_(Eigen::Vector2i(0, 0), Eigen::Vector2i(width_px, height_px)),
      light_(width_px, height_px),
      quick_(quick),
      places_(gl::make_target(GL_RGBA32F, width_px, height_px, GL_NEAREST)),
      normals_(gl::make_target(GL_RGBA16, width_px, height_px, GL_NEAREST)),
      framebuffer_(gl::make_framebuffer(places_, depth)),
      arriving_(gl::make_target(GL_RGBA32F, width_px, height_px, GL_NEAREST)),
      mirrored_(gl::make_target(GL_RGBA32F, width_px, height_px, GL_NEAREST)) {
  if (quick_) colors_ = gl::make_target(GL_RGBA16, width_px, height_px, GL_NEAREST);
  write_to_all(framebuffer_, normals_, colors_);
}

void LightPass::begin() const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_);
  glViewport(0, 0, all_px_.sizes().x(), all_px_.sizes().y());
  clear_surfaces(framebuffer_);
  if (!quick_) return;
  const std::array<float, 4> not_plain = {0, 0, 0, 0};
  glClearNamedFramebufferfv(framebuffer_, GL_COLOR, 2, not_plain.data());
}

void LightPass::bind_surfaces() const {
  glBindTextureUnit(kPlacesUnit, places_);
  glBindTextureUnit(kNormalsUnit, normals_);
  glBindTextureUnit(kColorsUnit, colors_);
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
          offsets, quick_};
}

// Creates those of the textures that do not exist.
void LightPass::make_textures(std::initializer_list<gl::Texture*> textures) const {
  for (gl::Texture* texture : textures)
    if (*texture == 0)
      *texture = gl::make_target(GL_RGBA32F, all_px_.sizes().x(), all_px_.sizes().y(), GL_NEAREST);
}

void LightPass::write_lamps(const Eigen::AlignedBox2i& area_px, const std::vector<Vector4f>& lamps,
                            const std::vector<Vector4f>& highlights) {
  if (lamps.empty()) return;
  make_textures({&lamps_, &highlights_});
  write_texture(lamps_, kLampsUnit, area_px, lamps);
  write_texture(highlights_, kHighlightsUnit, area_px, highlights);
}

void LightPass::write_light(const Eigen::AlignedBox2i& area_px, const LightBuffer& light) {
  write_texture(arriving_, kArrivingUnit, area_px, light.arriving);
  if (light.has_mirrors) {
    write_texture(mirrored_, kMirroredUnit, area_px, light.mirrored);
  } else if (mirrored_is_filled_) {
    glClearTexImage(mirrored_, 0, GL_RGBA, GL_FLOAT, nullptr);
    glBindTextureUnit(kMirroredUnit, mirrored_);
  }
  mirrored_is_filled_ = light.has_mirrors;
  write_lamps(area_px, light.lamps, light.highlights);
  if (light.sun.empty()) return;
  make_textures({&sun_});
  write_texture(sun_, kSunUnit, area_px, light.sun);
}

void LightPass::trace(const LightSources& sources, const View& view, const SampleOffsets& offsets,
                      const StopTest& stop) {
  read_surfaces(all_px_, surfaces_);
  LightTracer(scene_, sources, stop).trace(surfaces_, light_view(view, offsets), light_);
  sums_ += light_.sums;
  write_light(all_px_, light_);
}

// Binds and clears the targets for drawing surfaces in a part of the picture, except their depth. Returns
// false if the area is outside of the picture.
bool LightPass::begin_part(const Eigen::AlignedBox2i& area_px) {
  const Eigen::AlignedBox2i area = area_px.intersection(all_px_);
  if (area.isEmpty() || area.volume() == 0) return false;
  part_px_ = on_grid(area);
  const Eigen::Vector2i all = all_px_.sizes(), first = part_px_.min(), size = part_px_.sizes();
  if (part_framebuffer_ == 0) {
    for (gl::Texture& depth : part_depths_)
      depth = gl::make_target(GL_DEPTH_COMPONENT32F, all.x(), all.y(), GL_NEAREST);
    part_framebuffer_ = gl::make_framebuffer(places_, part_depths_[part_]);
    write_to_all(part_framebuffer_, normals_, 0);
  }
  part_ = 1 - part_;
  glNamedFramebufferTexture(part_framebuffer_, GL_DEPTH_ATTACHMENT, part_depths_[part_], 0);
  glBindFramebuffer(GL_FRAMEBUFFER, part_framebuffer_);
  glViewport(0, 0, all.x(), all.y());
  glEnable(GL_SCISSOR_TEST);
  glScissor(first.x(), first.y(), size.x(), size.y());
  clear_surfaces(part_framebuffer_);
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
  return true;
}

bool LightPass::begin_part(GLuint depth, const Eigen::AlignedBox2i& area_px) {
  if (!begin_part(area_px)) return false;
  const Eigen::Vector2i first = part_px_.min(), size = part_px_.sizes();
  glCopyImageSubData(depth, GL_TEXTURE_2D, 0, first.x(), first.y(), 0, part_depths_[part_], GL_TEXTURE_2D, 0,
                     first.x(), first.y(), 0, size.x(), size.y(), 1);
  glBindTextureUnit(kDepthBehindUnit, depth);
  glDepthFunc(GL_GREATER);
  return true;
}

bool LightPass::begin_layer(GLuint behind, const Eigen::AlignedBox2i& area_px) {
  if (!begin_part(area_px)) return false;
  const float nearest = 1;
  glClearNamedFramebufferfv(part_framebuffer_, GL_DEPTH, 0, &nearest);
  glBindTextureUnit(kDepthBehindUnit, behind);
  glDepthFunc(GL_LESS);
  return true;
}

// Reduces the part of the picture to the smallest rectangle that contains all its surfaces. Returns false if
// there are none.
bool LightPass::crop_to_surfaces() {
  const int width = surfaces_.width_px;
  Eigen::AlignedBox2i seen;
  for (int y = 0; y < surfaces_.height_px; ++y) {
    const std::span row = std::span(surfaces_.places)
                              .subspan(static_cast<std::size_t>(y * width), static_cast<std::size_t>(width));
    const auto is_surface = [](const Vector4f& place) { return place.w() >= 0; };
    const auto first = std::ranges::find_if(row, is_surface);
    if (first == row.end()) continue;
    const auto past = std::find_if(row.rbegin(), row.rend(), is_surface).base();
    seen.extend(Eigen::Vector2i(static_cast<int>(first - row.begin()), y));
    seen.extend(Eigen::Vector2i(static_cast<int>(past - row.begin()), y + 1));
  }
  if (seen.isEmpty()) return false;
  const Eigen::AlignedBox2i cropped = on_grid({part_px_.min() + seen.min(), part_px_.min() + seen.max()});
  if (cropped.isApprox(part_px_)) return true;
  part_px_ = cropped;
  read_surfaces(part_px_, surfaces_);
  return true;
}

void LightPass::trace_glass(const LightSources& sources, const View& view, const SampleOffsets& offsets,
                            GLuint picture_framebuffer) {
  glDisable(GL_SCISSOR_TEST);
  make_textures({&through_glass_, &mirrored_by_glass_});
  read_surfaces(part_px_, surfaces_);
  picture_.resize(light_.arriving.size());
  glBindFramebuffer(GL_READ_FRAMEBUFFER, picture_framebuffer);
  glReadPixels(0, 0, all_px_.sizes().x(), all_px_.sizes().y(), GL_RGBA, GL_FLOAT, picture_.data());
  const LightView seen = light_view(view, offsets);
  // These values of the opaque objects are already in the textures, so their memory can be used again.
  glass_light_.mirrored.swap(light_.mirrored);
  glass_light_.highlights.swap(light_.highlights);
  LightTracer(scene_, sources)
      .trace_glass(surfaces_, part_px_.min().x(), part_px_.min().y(), seen,
                   VisibleLight(light_, seen, picture_), glass_light_);
  sums_ += glass_light_.sums;
  write_texture(through_glass_, kThroughGlassUnit, part_px_, glass_light_.through);
  write_texture(mirrored_by_glass_, kMirroredByGlassUnit, part_px_, glass_light_.mirrored);
  write_lamps(part_px_, glass_light_.lamps, glass_light_.highlights);
  glass_light_.mirrored.swap(light_.mirrored);
  glass_light_.highlights.swap(light_.highlights);
}

GLuint LightPass::trace_body(const LightSources& sources, const View& view, const SampleOffsets& offsets) {
  glDisable(GL_SCISSOR_TEST);
  read_surfaces(part_px_, surfaces_);
  if (!crop_to_surfaces()) return 0;
  if (!body_light_ || body_light_->pixels.width_px != surfaces_.width_px ||
      body_light_->pixels.height_px != surfaces_.height_px)
    body_light_.emplace(surfaces_.width_px, surfaces_.height_px);
  const LightView seen = light_view(view, offsets);
  LightTracer(scene_, sources).trace_body(surfaces_, seen, VisibleLight(light_, seen), *body_light_);
  sums_ += body_light_->sums;
  write_light(part_px_, *body_light_);
  return part_depths_[part_];
}

}  // namespace offstage::render
