// EGL without a surface. llvmpipe is used through Mesa's surfaceless platform, GPUs through EGL devices. The
// few necessary functions are declared here, so that only libEGL.so.1 is needed, and only at run time.

#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>

#include "render/context.h"
#include "render/error.h"
#include "render/gl_platform.h"

namespace offstage::render {
namespace {

// Constants and types from the EGL registry of Khronos.
using Display = void*;
using EglHandle = void*;
using Device = void*;
constexpr int kExtensions = 0x3055;           // EGL_EXTENSIONS
constexpr int kEglNone = 0x3038;              // EGL_NONE
constexpr unsigned kOpenGlApi = 0x30A2;       // EGL_OPENGL_API
constexpr int kEglMajorVersion = 0x3098;      // EGL_CONTEXT_MAJOR_VERSION
constexpr int kEglMinorVersion = 0x30FB;      // EGL_CONTEXT_MINOR_VERSION
constexpr int kEglProfileMask = 0x30FD;       // EGL_CONTEXT_OPENGL_PROFILE_MASK
constexpr int kEglCoreProfile = 1;            // EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT
constexpr unsigned kSurfaceless = 0x31DD;     // EGL_PLATFORM_SURFACELESS_MESA
constexpr unsigned kDevicePlatform = 0x313F;  // EGL_PLATFORM_DEVICE_EXT
constexpr int kDrmDeviceFile = 0x3233;        // EGL_DRM_DEVICE_FILE_EXT
constexpr int kRenderer = 0x335F;             // EGL_RENDERER_EXT

const std::string kPackages = "libegl1 libegl-mesa0 libgl1-mesa-dri";

struct EglLibrary {
  void (*(*get_proc_address)(const char* name))() = nullptr;
  int (*get_error)() = nullptr;
  unsigned (*initialize)(Display, int* major, int* minor) = nullptr;
  unsigned (*bind_api)(unsigned api) = nullptr;
  const char* (*query_string)(Display, int name) = nullptr;
  EglHandle (*create_context)(Display, void* config, EglHandle shared, const int* attributes) = nullptr;
  unsigned (*make_current)(Display, void* draw, void* read, EglHandle) = nullptr;
  unsigned (*destroy_context)(Display, EglHandle) = nullptr;
  unsigned (*release_thread)() = nullptr;
  // Functions of extensions; null if the extension is missing.
  Display (*get_platform_display)(unsigned platform, void* native, const int* attributes) = nullptr;
  unsigned (*query_devices)(int most, Device* devices, int* count) = nullptr;
  const char* (*query_device_string)(Device, int name) = nullptr;

  EglLibrary() {
    const SharedLibrary library({"libEGL.so.1", "libEGL.so"}, kPackages);
    library.find("eglGetProcAddress", get_proc_address);
    library.find("eglGetError", get_error);
    library.find("eglInitialize", initialize);
    library.find("eglBindAPI", bind_api);
    library.find("eglQueryString", query_string);
    library.find("eglCreateContext", create_context);
    library.find("eglMakeCurrent", make_current);
    library.find("eglDestroyContext", destroy_context);
    library.find("eglReleaseThread", release_thread);
    find_extension("eglGetPlatformDisplayEXT", get_platform_display);
    find_extension("eglQueryDevicesEXT", query_devices);
    find_extension("eglQueryDeviceStringEXT", query_device_string);
  }

 private:
  template <class Function>
  void find_extension(const char* name, Function*& function) const {
    function = reinterpret_cast<Function*>(get_proc_address(name));
  }
};

const EglLibrary& egl() {
  static const EglLibrary library;
  return library;
}

bool has_word(const char* list, std::string_view word) {
  std::string_view rest = list != nullptr ? list : "";
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(' '), rest.size());
    if (rest.substr(0, end) == word) return true;
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return false;
}

/// Returns the error code of the last call, for a message.
std::string error_code() {
  std::array<char, 8> digits{};
  std::to_chars(digits.data(), digits.data() + digits.size(), egl().get_error(), 16);
  return std::string("EGL error 0x") + digits.data();
}

std::vector<Device> devices() {
  constexpr int kMost = 64;
  std::array<Device, kMost> found{};
  int count = 0;
  if (egl().query_devices == nullptr || egl().query_device_string == nullptr ||
      !egl().query_devices(kMost, found.data(), &count))
    throw UnavailableError("libEGL cannot list devices; upgrade it: apt-get install " + kPackages);
  // Parentheses are necessary, because braces would make a list of the two iterators.
  return std::vector<Device>(found.begin(), found.begin() + count);
}

bool is_software(Device device) {
  return has_word(egl().query_device_string(device, kExtensions), "EGL_MESA_device_software");
}

/// Returns an initialized display of EGL; it stays valid until the process ends.
Display initialized(unsigned platform, void* native) {
  if (egl().get_platform_display == nullptr)
    throw UnavailableError("libEGL has no platform displays; upgrade it: apt-get install " + kPackages);
  const Display display = egl().get_platform_display(platform, native, nullptr);
  if (display == nullptr || !egl().initialize(display, nullptr, nullptr))
    throw UnavailableError(error_code());
  const char* extensions = egl().query_string(display, kExtensions);
  for (const char* needed :
       {"EGL_KHR_create_context", "EGL_KHR_no_config_context", "EGL_KHR_surfaceless_context"})
    if (!has_word(extensions, needed)) throw UnavailableError(std::string("its display has no ") + needed);
  return display;
}

class EglContext : public PlatformContext {
 public:
  explicit EglContext(Display display) : display_(display) {
    const int attributes[] = {kEglMajorVersion, 4,       kEglMinorVersion, 5, kEglProfileMask,
                              kEglCoreProfile,  kEglNone};
    if (!egl().bind_api(kOpenGlApi)) throw UnavailableError("no OpenGL: " + error_code());
    handle_ = egl().create_context(display_, nullptr, nullptr, attributes);
    if (handle_ == nullptr) throw UnavailableError("no OpenGL 4.5 core context: " + error_code());
    if (!egl().make_current(display_, nullptr, nullptr, handle_)) {
      const std::string error = error_code();
      egl().destroy_context(display_, handle_);
      throw UnavailableError("its context cannot be made current: " + error);
    }
  }
  ~EglContext() override {
    egl().make_current(display_, nullptr, nullptr, nullptr);
    egl().destroy_context(display_, handle_);
    egl().release_thread();
  }
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;
  GlLookup lookup() const override { return egl().get_proc_address; }

 private:
  Display display_ = nullptr;
  EglHandle handle_ = nullptr;
};

std::unique_ptr<PlatformContext> make_software_context() {
  try {
    static const Display display = initialized(kSurfaceless, nullptr);
    return std::make_unique<EglContext>(display);
  } catch (const UnavailableError& error) {
    throw UnavailableError("EGL cannot draw with llvmpipe (" + std::string(error.what()) +
                           "); install Mesa 22.3 or newer: apt-get install " + kPackages);
  }
}

/// Returns the display of the first GPU on which a context can be created. The GPUs after it are not tried.
Display first_gpu() {
  std::string reasons;
  for (const Device device : devices()) {
    if (is_software(device)) continue;
    try {
      const Display display = initialized(kDevicePlatform, device);
      EglContext{display};  // checks that the driver of the device has OpenGL 4.5
      return display;
    } catch (const UnavailableError& error) {
      reasons += std::string(reasons.empty() ? "" : "; ") + error.what();
    }
  }
  throw UnavailableError(reasons.empty()
                             ? "EGL lists no GPU; see `offstage doctor`, and draw with --gl egl or osmesa"
                             : "EGL cannot draw on a GPU: " + reasons);
}

std::string text(const char* string) {
  return string != nullptr ? string : "";
}

}  // namespace

std::unique_ptr<PlatformContext> make_egl_context(bool gpu) {
  if (!gpu) return make_software_context();
  static const Display display = first_gpu();
  return std::make_unique<EglContext>(display);
}

std::vector<EglDevice> egl_devices() {
  std::vector<EglDevice> list;
  for (const Device device : devices()) {
    const std::string extensions = text(egl().query_device_string(device, kExtensions));
    EglDevice& item = list.emplace_back(
        EglDevice{.software = is_software(device), .name = {}, .file = {}, .extensions = extensions});
    if (has_word(extensions.c_str(), "EGL_EXT_device_query_name"))
      item.name = text(egl().query_device_string(device, kRenderer));
    if (has_word(extensions.c_str(), "EGL_EXT_device_drm"))
      item.file = text(egl().query_device_string(device, kDrmDeviceFile));
  }
  return list;
}

}  // namespace offstage::render
