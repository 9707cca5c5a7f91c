#include "render/sprite_pictures.h"

#include <algorithm>
#include <array>
#include <bit>
#include <stdexcept>
#include <string>
#include <vector>

#include "render/stage.h"
#include "render/tone_map.h"

namespace offstage::render {
namespace {

/// A picture in linear light with premultiplied alpha, rows from the top down.
struct LinearPicture {
  int width_px, height_px;
  std::vector<Vector4f> pixels;

  Vector4f& at(int x, int y) {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px) +
                  static_cast<std::size_t>(x)];
  }
};

LinearPicture cut(const Image& sheet, int left, int top, int width_px, int height_px) {
  std::array<float, 256> linear;
  for (std::size_t i = 0; i < linear.size(); ++i) linear[i] = srgb_decode(static_cast<float>(i) / 255);
  LinearPicture picture{width_px, height_px, {}};
  picture.pixels.reserve(static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px));
  for (int y = top; y < top + height_px; ++y) {
    for (int x = left; x < left + width_px; ++x) {
      const uint8_t* p = sheet.rgba.data() + 4 * (static_cast<std::ptrdiff_t>(y) * sheet.width_px + x);
      const float alpha = static_cast<float>(p[3]) / 255;
      picture.pixels.emplace_back(linear[p[0]] * alpha, linear[p[1]] * alpha, linear[p[2]] * alpha, alpha);
    }
  }
  return picture;
}

LinearPicture half_of(LinearPicture& fine) {
  LinearPicture half{std::max(fine.width_px / 2, 1), std::max(fine.height_px / 2, 1), {}};
  for (int y = 0; y < half.height_px; ++y) {
    for (int x = 0; x < half.width_px; ++x) {
      const int right = std::min(2 * x + 1, fine.width_px - 1),
                below = std::min(2 * y + 1, fine.height_px - 1);
      const int left = std::min(2 * x, right), above = std::min(2 * y, below);
      half.pixels.push_back(0.25f * (fine.at(left, above) + fine.at(right, above) + fine.at(left, below) +
                                     fine.at(right, below)));
    }
  }
  return half;
}

std::vector<uint8_t> encode(const LinearPicture& picture) {
  std::vector<uint8_t> bytes;
  bytes.reserve(picture.pixels.size() * 4);
  const auto byte = [](float x) { return static_cast<uint8_t>(std::clamp(x, 0.0f, 1.0f) * 255 + 0.5f); };
  for (const Vector4f& p : picture.pixels) {
    for (int c = 0; c < 3; ++c) bytes.push_back(byte(srgb_encode(p[c])));
    bytes.push_back(byte(p.w()));
  }
  return bytes;
}

/// Sheets whose pictures are layers of one texture.
struct TextureGroup {
  int width_px = 0, height_px = 0;
  std::size_t layers = 0;
  std::vector<const SpritePictures*> sheets;

  bool takes(const SpritePictures& sheet) const {
    constexpr std::size_t kMostTextureLayers = 2048,
                          kMostGroupBytes = std::size_t{64} << 20;  // OpenGL allows 2048
    const auto width = static_cast<std::size_t>(std::max(width_px, sheet.width_px)),
               height = static_cast<std::size_t>(std::max(height_px, sheet.height_px));
    const std::size_t all = layers + sheet.levels.size();
    const bool same = sheet.width_px == width_px && sheet.height_px == height_px;
    return all <= kMostTextureLayers && (same || width * height * 4 * all <= kMostGroupBytes);
  }
  void add(const SpritePictures& sheet) {
    width_px = std::max(width_px, sheet.width_px);
    height_px = std::max(height_px, sheet.height_px);
    layers += sheet.levels.size();
    sheets.push_back(&sheet);
  }
};

/// Returns a mip level in the corner of a larger picture. The rest is filled by repeating the edges, so that
/// filters do not mix in other colours.
std::vector<uint8_t> padded_level(const std::vector<uint8_t>& level, int width, int height, int to_width,
                                  int to_height) {
  if (width == to_width && height == to_height) return level;
  std::vector<uint8_t> result;
  result.reserve(4 * static_cast<std::size_t>(to_width) * static_cast<std::size_t>(to_height));
  for (int y = 0; y < to_height; ++y)
    for (int x = 0; x < to_width; ++x) {
      const auto from = level.begin() + 4 * (static_cast<std::ptrdiff_t>(std::min(y, height - 1)) * width +
                                             std::min(x, width - 1));
      result.insert(result.end(), from, from + 4);
    }
  return result;
}

gl::Texture upload_group(const TextureGroup& group) {
  GLuint name = 0;
  glCreateTextures(GL_TEXTURE_2D_ARRAY, 1, &name);
  gl::Texture texture(name);
  const int width = group.width_px, height = group.height_px;
  const auto levels = static_cast<int>(std::bit_width(static_cast<unsigned>(std::max(width, height))));
  glTextureStorage3D(texture, levels, GL_SRGB8_ALPHA8, width, height, static_cast<GLsizei>(group.layers));
  glTextureParameteri(texture, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  glTextureParameteri(texture, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTextureParameteri(texture, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTextureParameteri(texture, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  int layer = 0;
  for (const SpritePictures* sheet : group.sheets)
    for (const std::vector<std::vector<uint8_t>>& picture : sheet->levels) {
      for (int k = 0; k < levels; ++k) {
        const int own = std::min(k, static_cast<int>(picture.size()) - 1);
        const int to_width = std::max(width >> k, 1), to_height = std::max(height >> k, 1);
        glTextureSubImage3D(
            texture, k, 0, 0, layer, to_width, to_height, 1, GL_RGBA, GL_UNSIGNED_BYTE,
            padded_level(picture[static_cast<std::size_t>(own)], std::max(sheet->width_px >> own, 1),
                         std::max(sheet->height_px >> own, 1), to_width, to_height)
                .data());
      }
      ++layer;
    }
  gl::check_error("uploading the pictures of sprites");
  return texture;
}

}  // namespace

Vector4f SpritePictures::mean(std::size_t picture) const {
  const std::vector<uint8_t>& pixel = levels[picture].back();  // the smallest level has one pixel
  Vector4f result;
  for (std::size_t c = 0; c < 4; ++c) result[static_cast<int>(c)] = static_cast<float>(pixel[c]) / 255;
  for (int c = 0; c < 3; ++c) result[c] = srgb_decode(result[c]);
  return result;
}

SpritePictures sprite_pictures(const Image& sheet, int columns, int rows) {
  if (columns < 1 || rows < 1 || columns > kMostSheetPictures / rows)
    throw std::invalid_argument("a sheet has 1 to " + std::to_string(kMostSheetPictures) + " pictures");
  const int width = sheet.width_px / columns, height = sheet.height_px / rows;
  if (width < 1 || height < 1)
    throw std::invalid_argument("a sheet of " + std::to_string(sheet.width_px) + "x" +
                                std::to_string(sheet.height_px) + " pixels cannot hold " +
                                std::to_string(columns) + "x" + std::to_string(rows) + " pictures");
  SpritePictures result{width, height, {}};
  const auto levels = static_cast<int>(std::bit_width(static_cast<unsigned>(std::max(width, height))));
  for (int i = 0; i < columns * rows; ++i) {
    LinearPicture level = cut(sheet, i % columns * width, i / columns * height, width, height);
    std::vector<std::vector<uint8_t>>& encoded = result.levels.emplace_back();
    for (int k = 0; k < levels; ++k) {
      if (k > 0) level = half_of(level);
      encoded.push_back(encode(level));
    }
  }
  return result;
}

std::shared_ptr<const SpritePictures> SpriteTextures::add(SpritePictures pictures) {
  for (const auto& known : sheets_)
    if (const auto sheet = known.lock(); sheet && *sheet == pictures) return sheet;
  auto sheet = std::make_shared<const SpritePictures>(std::move(pictures));
  sheets_.push_back(sheet);
  is_current_ = false;
  return sheet;
}

void SpriteTextures::update() {
  is_current_ &= std::erase_if(sheets_, [](const auto& sheet) { return sheet.expired(); }) == 0;
  if (is_current_) return;
  std::vector<std::shared_ptr<const SpritePictures>> sheets;
  for (const auto& sheet : sheets_) sheets.push_back(sheet.lock());
  std::ranges::stable_sort(sheets, std::ranges::greater(), [](const auto& sheet) {
    return int64_t{sheet->width_px} * sheet->height_px;  // so that sheets of similar sizes are neighbours
  });
  std::vector<TextureGroup> groups;
  for (const auto& sheet : sheets) {
    auto group = std::ranges::find_if(groups, [&](const TextureGroup& g) { return g.takes(*sheet); });
    (group == groups.end() ? groups.emplace_back() : *group).add(*sheet);
  }
  textures_.clear();
  places_.clear();
  for (const TextureGroup& group : groups) {
    textures_.push_back(upload_group(group));
    int layer = 0;
    for (const SpritePictures* sheet : group.sheets) {
      places_[sheet] = {textures_.back(), layer};
      layer += static_cast<int>(sheet->levels.size());
    }
  }
  is_current_ = true;
}

}  // namespace offstage::render
