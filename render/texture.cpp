#include "render/texture.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "render/error.h"
#include "render/tone_map.h"

namespace offstage::render {
namespace {

constexpr int kMaxSize_px = 16384;

using ChannelTable = std::array<float, 256>;

ChannelTable decode_table(TextureContent content) {
  ChannelTable table;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const float value = static_cast<float>(i) / 255;
    table[i] = content == TextureContent::color ? srgb_decode(value) : value;
  }
  return table;
}

uint8_t encode(float value, TextureContent content) {
  const float encoded = content == TextureContent::color ? srgb_encode(value) : value;
  return static_cast<uint8_t>(std::clamp(encoded, 0.0f, 1.0f) * 255 + 0.5f);
}

// Returns an image of half the size. Colours are weighted by their alpha, so that cut-out parts leave no
// fringe.
Image half_size(const Image& image, TextureContent content, const ChannelTable& decode) {
  Image half{std::max(image.width_px / 2, 1), std::max(image.height_px / 2, 1), {}};
  half.rgba.reserve(half.pixel_count() * 4);
  for (int y = 0; y < half.height_px; ++y) {
    for (int x = 0; x < half.width_px; ++x) {
      std::array<float, 3> weighted{}, plain{};
      float alpha = 0;
      for (int k = 0; k < 4; ++k) {
        const int sx = std::min(2 * x + (k & 1), image.width_px - 1),
                  sy = std::min(2 * y + k / 2, image.height_px - 1);
        const uint8_t* pixel =
            image.rgba.data() + 4 * (static_cast<std::ptrdiff_t>(sy) * image.width_px + sx);
        const float a = static_cast<float>(pixel[3]) / 255;
        alpha += a;
        for (std::size_t c = 0; c < 3; ++c) {
          weighted[c] += a * decode[pixel[c]];
          plain[c] += decode[pixel[c]];
        }
      }
      for (std::size_t c = 0; c < 3; ++c) {
        half.rgba.push_back(encode(alpha > 0 ? weighted[c] / alpha : plain[c] / 4, content));
      }
      half.rgba.push_back(static_cast<uint8_t>(alpha / 4 * 255 + 0.5f));
    }
  }
  return half;
}

/// Returns the fraction of the pixels whose alpha, times `factor`, reaches the cutoff.
double coverage_of(const Image& image, float cutoff, float factor) {
  std::size_t count = 0;
  for (std::size_t i = 3; i < image.rgba.size(); i += 4)
    count += static_cast<float>(image.rgba[i]) / 255 * factor >= cutoff;
  return static_cast<double>(count) / static_cast<double>(std::max<std::size_t>(image.pixel_count(), 1));
}

/// Scales alpha so that about the fraction `coverage` of the pixels reaches the cutoff.
Image with_coverage(const Image& image, float cutoff, double coverage) {
  float low = 0.1f, high = 16;  // with the factor `low` too little is covered, with `high` too much
  for (int k = 0; k < 16; ++k) {
    const float middle = std::sqrt(low * high);
    (coverage_of(image, cutoff, middle) < coverage ? low : high) = middle;
  }
  // A level with few pixels has only a few possible fractions. The nearer one of the two neighbouring
  // fractions is used.
  const double below = coverage - coverage_of(image, cutoff, low),
               above = coverage_of(image, cutoff, high) - coverage;
  const float factor = below < above ? low : high;
  Image result = image;
  for (std::size_t i = 3; i < result.rgba.size(); i += 4)
    result.rgba[i] =
        static_cast<uint8_t>(std::min(static_cast<float>(image.rgba[i]) * factor + 0.5f, 255.0f));
  return result;
}

GLint wrap_mode(Wrap wrap) {
  return wrap == Wrap::clamp ? GL_CLAMP_TO_EDGE : wrap == Wrap::mirror ? GL_MIRRORED_REPEAT : GL_REPEAT;
}

}  // namespace

gl::Texture make_texture(const Image& image, TextureContent content, const TextureMap& map,
                         float alpha_cutoff) {
  if (image.width_px < 1 || image.height_px < 1 || std::max(image.width_px, image.height_px) > kMaxSize_px) {
    throw UnavailableError("a texture of " + std::to_string(image.width_px) + "x" +
                           std::to_string(image.height_px) + " pixels cannot be drawn; at most " +
                           std::to_string(kMaxSize_px) + " pixels per side are possible");
  }
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_2D, 1, &name);
  gl::Texture texture(name);
  const auto levels =
      static_cast<GLsizei>(std::bit_width(static_cast<unsigned>(std::max(image.width_px, image.height_px))));
  glTextureStorage2D(texture, levels, content == TextureContent::color ? GL_SRGB8_ALPHA8 : GL_RGBA8,
                     image.width_px, image.height_px);
  glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER,
                      map.mip_maps  ? GL_LINEAR_MIPMAP_LINEAR
                      : map.nearest ? GL_NEAREST
                                    : GL_LINEAR);
  glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, map.nearest ? GL_NEAREST : GL_LINEAR);
  glTextureParameteri(texture, GL_TEXTURE_WRAP_S, wrap_mode(map.wrap_u));
  glTextureParameteri(texture, GL_TEXTURE_WRAP_T, wrap_mode(map.wrap_v));

  const ChannelTable decode = decode_table(content);
  const double coverage = alpha_cutoff > 0 ? coverage_of(image, alpha_cutoff, 1) : 0;
  Image level = image;
  for (int k = 0; k < levels; ++k) {
    if (k > 0) level = half_size(level, content, decode);
    const Image* uploaded = &level;
    Image scaled;
    if (k > 0 && alpha_cutoff > 0) {
      scaled = with_coverage(level, alpha_cutoff, coverage);
      uploaded = &scaled;
    }
    glTextureSubImage2D(texture, k, 0, 0, level.width_px, level.height_px, GL_RGBA, GL_UNSIGNED_BYTE,
                        uploaded->rgba.data());
  }
  return texture;
}

gl::Texture make_texture(std::span<const SkyPicture::Packed> levels) {
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_2D, 1, &name);
  gl::Texture texture(name);
  glTextureStorage2D(texture, static_cast<GLsizei>(levels.size()), GL_RGB9_E5, levels[0].columns,
                     levels[0].rows);
  glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTextureParameteri(texture, GL_TEXTURE_WRAP_S, GL_REPEAT);
  glTextureParameteri(texture, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  for (std::size_t k = 0; k < levels.size(); ++k)
    glTextureSubImage2D(texture, static_cast<GLint>(k), 0, 0, levels[k].columns, levels[k].rows, GL_RGB,
                        GL_UNSIGNED_INT_5_9_9_9_REV, levels[k].values.data());
  return texture;
}

gl::Texture make_white_texture() {
  return make_texture({1, 1, {255, 255, 255, 255}}, TextureContent::data);
}

bool has_alpha(const Image& image) {
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) {
    if (image.rgba[i] != 255) return true;
  }
  return false;
}

}  // namespace offstage::render
