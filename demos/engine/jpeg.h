#pragma once
/// Encodes frames as JPEG for a browser.

#include <memory>
#include <string>

#include "render/image.h"

namespace offstage::engine {

/// Writes pictures as JPEG files in memory. Each thread needs its own object, because the buffers are reused.
class JpegWriter {
 public:
  JpegWriter();
  ~JpegWriter();
  JpegWriter(const JpegWriter&) = delete;
  JpegWriter& operator=(const JpegWriter&) = delete;

  /// Returns the bytes of a JPEG file. `quality`: 1 to 100. Throws std::runtime_error if encoding fails.
  std::string write(const render::Image& image, int quality);

 private:
  void* handle_;
};

}  // namespace offstage::engine
