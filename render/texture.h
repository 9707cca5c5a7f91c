#pragma once
/// Private: colour textures. Mip levels are averaged in linear light on the CPU, where the result is the same
/// everywhere.

#include "render/gl.h"
#include "render/image.h"
#include "render/model.h"

namespace offstage::render {

enum class TextureContent { color /**< sRGB */, data /**< linear */ };

/// `map`: how the texture is repeated and filtered.
gl::Texture make_texture(const Image& image, TextureContent content, const TextureMap& map = {});
gl::Texture make_white_texture();
/// True if any pixel is not opaque.
bool has_alpha(const Image& image);

}  // namespace offstage::render
