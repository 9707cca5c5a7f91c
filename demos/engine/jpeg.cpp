#include "engine/jpeg.h"

#include <stdexcept>

#include <turbojpeg.h>

namespace offstage::engine {

JpegWriter::JpegWriter() : handle_(tjInitCompress()) {
  if (!handle_) throw std::runtime_error(std::string("libturbojpeg: ") + tjGetErrorStr());
}

JpegWriter::~JpegWriter() {
  tjDestroy(handle_);
}

std::string JpegWriter::write(const render::Image& image, int quality) {
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const int sampling = quality >= 90 ? TJSAMP_444 : TJSAMP_420;
  const int failed = tjCompress2(handle_, image.rgba.data(), image.width_px, 0, image.height_px, TJPF_RGBA,
                                 &bytes, &size, sampling, quality, TJFLAG_FASTDCT);
  const std::string jpeg = failed ? "" : std::string(reinterpret_cast<const char*>(bytes), size);
  tjFree(bytes);
  if (failed) throw std::runtime_error(std::string("libturbojpeg: ") + tjGetErrorStr2(handle_));
  return jpeg;
}

}  // namespace offstage::engine
