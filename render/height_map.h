#pragma once
/// Private: converts textures of classic materials (bump maps, masks) to textures of physically based
/// materials.

#include "render/image.h"

namespace offstage::render {

/// Returns whether a picture looks like a normal map: bluish, and neutral in red and green on average.
bool is_normal_map(const Image& image);
/// Returns the normal map (X towards +u, Y towards the top) of a repeating height map. White is higher than
/// black by `bump` times 1 % of the picture's width.
Image normals_of_heights(const Image& heights, float bump);
/// Returns `base` with the alpha of a mask: the alpha channel of the mask if it is used, otherwise its
/// luminance. If `base` is empty, the result is white and has the size of the mask.
Image with_mask(const Image& base, const Image& mask);
/// Returns whether nearly all of the picture is either opaque or fully transparent, so that it cuts holes.
bool is_cut_out(const Image& image);

}  // namespace offstage::render
