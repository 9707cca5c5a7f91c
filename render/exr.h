#pragma once
/// Private: reads OpenEXR pictures.

#include <cstdint>
#include <span>
#include <string>

#include "render/image.h"

namespace offstage::render {

/// Decodes the data window of a flat OpenEXR picture: the channels R, G and B, or Y as grey. Alpha is 1.
/// `name` is used in messages. Throws FileError if the file is broken, lacks these channels or has more than
/// `max_pixels` pixels.
HdrImage decode_exr(std::span<const uint8_t> bytes, const std::string& name, uint64_t max_pixels);

}  // namespace offstage::render
