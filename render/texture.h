#pragma once
/// Private: colour textures. Mip levels are averaged in linear light on the CPU, where the result is the same
/// everywhere.

#include "render/gl.h"
#include "render/image.h"

namespace offstage::render {

enum class TextureContent { color /**< sRGB */, data /**< linear */ };

gl::Texture make_texture(const Image& image, TextureContent content);
gl::Texture make_white_texture();
/// True if any pixel is not opaque.
bool has_alpha(const Image& image);

}  // namespace offstage::render
