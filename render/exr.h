#pragma once
/// Private: reads OpenEXR pictures.

#include <cstdint>
#include <span>
#include <string>

#include "render/image.h"

namespace offstage::render {

/// The channels R, G and B, or Y as grey, of the data window of a flat picture; alpha is 1. `name` is used in
/// messages. Throws FileError for a broken file, for one without these channels, and for one with more than
/// `max_pixels` pixels.
HdrImage decode_exr(std::span<const uint8_t> bytes, const std::string& name, uint64_t max_pixels);

}  // namespace offstage::render
