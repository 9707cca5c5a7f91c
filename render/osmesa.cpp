// OSMesa. Its few functions are declared here, because GL/osmesa.h includes Mesa's gl.h, which conflicts with
// the header of glad. Mesa 25.1 and later have neither the header nor the library.

#include <array>
#include <cstdint>

#include "render/error.h"
#include "render/gl_platform.h"

namespace offstage::render {
namespace {

// Interface of libOSMesa 11.2 and later.
constexpr int kRgba = 0x1908;               // GL_RGBA
constexpr unsigned kUnsignedByte = 0x1401;  // GL_UNSIGNED_BYTE
constexpr int kFormat = 0x22;
constexpr int kDepthBits = 0x30, kStencilBits = 0x31, kAccumBits = 0x32;
constexpr int kOsMesaProfile = 0x33, kOsMesaCoreProfile = 0x34;
constexpr int kOsMesaMajorVersion = 0x36, kOsMesaMinorVersion = 0x37;
using OsMesaHandle = void*;

// All drawing goes to framebuffer objects; OSMesa's own buffer is only needed to make the context current.
constexpr int kDummySize_px = 16;

struct OsMesaLibrary {
  OsMesaHandle (*create)(const int* attributes, OsMesaHandle shared) = nullptr;
  unsigned char (*make_current)(OsMesaHandle, void* buffer, unsigned type, int width, int height) = nullptr;
  void (*destroy)(OsMesaHandle) = nullptr;
  void (*(*get_proc_address)(const char* name))() = nullptr;

  OsMesaLibrary() {
    const SharedLibrary library({"libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"}, "libosmesa6");
    library.find("OSMesaCreateContextAttribs", create);
    library.find("OSMesaMakeCurrent", make_current);
    library.find("OSMesaDestroyContext", destroy);
    library.find("OSMesaGetProcAddress", get_proc_address);
  }
};

const OsMesaLibrary& osmesa() {
  static const OsMesaLibrary library;
  return library;
}

class OsmesaContext : public PlatformContext {
 public:
  OsmesaContext() {
    // clang-format off
    const int attributes[] = {kFormat, kRgba, kDepthBits, 0, kStencilBits, 0, kAccumBits, 0,
                              kOsMesaProfile, kOsMesaCoreProfile, kOsMesaMajorVersion, 4, kOsMesaMinorVersion, 5, 0};
    // clang-format on
    handle_ = osmesa().create(attributes, nullptr);
    if (handle_ == nullptr)
      throw UnavailableError(
          "OSMesa gives no OpenGL 4.5 core context; install libosmesa6 22.3 or newer (apt-get install "
          "libosmesa6)");
    if (!osmesa().make_current(handle_, pixels_.data(), kUnsignedByte, kDummySize_px, kDummySize_px)) {
      osmesa().destroy(handle_);
      throw UnavailableError("OSMesa cannot make its context current; reinstall libosmesa6");
    }
  }
  ~OsmesaContext() override { osmesa().destroy(handle_); }
  OsmesaContext(const OsmesaContext&) = delete;
  OsmesaContext& operator=(const OsmesaContext&) = delete;
  GlLookup lookup() const override { return osmesa().get_proc_address; }

 private:
  OsMesaHandle handle_ = nullptr;
  std::array<uint8_t, kDummySize_px * kDummySize_px * 4> pixels_{};
};

}  // namespace

std::unique_ptr<PlatformContext> make_osmesa_context() {
  return std::make_unique<OsmesaContext>();
}

}  // namespace offstage::render
