#pragma once
/// Private: the pictures of sprites, as layers of array textures. Sheets share textures where possible,
/// because each change of the texture in the drawing order needs another draw call.

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "render/gl.h"
#include "render/image.h"
#include "render/mesh.h"

namespace offstage::render {

/// The pictures of a sheet.
struct SpritePictures {
  int width_px = 0, height_px = 0;  ///< size of each picture
  /// For each picture its mip levels, encoded: RGBA, sRGB colour with premultiplied alpha, rows from the top.
  std::vector<std::vector<std::vector<uint8_t>>> levels;
  bool operator==(const SpritePictures&) const = default;
  /// Returns the mean of a picture: linear colour, premultiplied; w: opacity.
  Vector4f mean(std::size_t picture) const;
};

/// Cuts a sheet into pictures, in rows from the upper left corner. Each has mip levels of its own, so that
/// neighbours on the sheet never mix. Pixels at the right and lower border that do not fill a picture are
/// omitted. Throws std::invalid_argument if there are no pictures, or more than kMostSheetPictures, or if a
/// picture would have no pixel.
SpritePictures sprite_pictures(const Image& sheet, int columns, int rows);

class SpriteTextures {
 public:
  /// The place of a sheet's pictures: consecutive layers, in their upper left corner.
  struct Place {
    GLuint texture = 0;
    int first_layer = 0;
  };
  /// Adds a sheet, or returns the existing sheet with the same pictures. Its layers exist as long as the
  /// returned pointer.
  std::shared_ptr<const SpritePictures> add(SpritePictures pictures);
  /// Uploads all sheets again if some were added or removed. Sheets with pictures of the same size share a
  /// texture. Sheets with pictures of different sizes share a texture if its layers, which fit all pictures,
  /// take at most 64 MiB.
  void update();
  Place place(const SpritePictures& pictures) const { return places_.at(&pictures); }

 private:
  std::vector<std::weak_ptr<const SpritePictures>> sheets_;
  bool is_current_ = true;
  std::vector<gl::Texture> textures_;
  std::map<const SpritePictures*, Place> places_;
};

}  // namespace offstage::render
