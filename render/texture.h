#pragma once
/// Private: textures of materials and skies. Mip levels are averaged in linear light on the CPU, so that they
/// are the same on all machines.

#include "render/gl.h"
#include "render/image.h"
#include "render/model.h"
#include "render/sky_picture.h"

namespace offstage::render {

enum class TextureContent { color /**< sRGB */, data /**< linear */ };

/// Creates a texture. `map`: how the texture is repeated and filtered. `alpha_cutoff` above 0: the fraction
/// of pixels with at least this alpha stays the same in reduced levels, so that leaves do not get thin at a
/// distance (I. Castano, "Computing alpha mipmaps", 2010).
gl::Texture make_texture(const Image& image, TextureContent content, const TextureMap& map = {},
                         float alpha_cutoff = 0);
/// Creates a texture of a sky from pictures of decreasing size, which become its mip levels.
gl::Texture make_texture(std::span<const SkyPicture::Packed> levels);
gl::Texture make_white_texture();
/// Returns whether any pixel is not opaque.
bool has_alpha(const Image& image);

}  // namespace offstage::render
