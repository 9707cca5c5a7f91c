#pragma once
/// Private: the pictures of sprites, as the layers of an array texture.

#include "render/gl.h"
#include "render/image.h"

namespace offstage::render {

/// Uploads the pictures of a sheet, in rows from the upper left corner, each as one layer with mip levels of
/// its own, so that neighbours on the sheet never mix. Texels have premultiplied alpha and sRGB colour.
/// Pixels beyond a whole number of pictures are left out. Throws std::invalid_argument if there are no
/// pictures, or more than kMostSheetPictures, or if a picture would have no pixel.
gl::Texture make_sprite_pictures(const Image& sheet, int columns, int rows);

}  // namespace offstage::render
