#pragma once
/// Private: converts textures of classic materials (bump maps, masks) to textures of physically based
/// materials.

#include "render/image.h"

namespace offstage::render {

/// Whether a picture looks like a normal map: bluish, and neutral in red and green on average.
bool is_normal_map(const Image& image);
/// Returns the normal map (X towards +u, Y towards the top) of a height map that repeats. The height of white
/// above black is `bump` times one hundredth of the picture's width.
Image normals_of_heights(const Image& heights, float bump);
/// `base` with the alpha of a mask: the mask's own alpha if it has any, else its luminance. An empty base is
/// white and as large as the mask.
Image with_mask(const Image& base, const Image& mask);
/// Whether nearly all of the picture is either opaque or fully transparent, so that it cuts holes.
bool is_cut_out(const Image& image);

}  // namespace offstage::render
