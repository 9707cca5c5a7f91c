#pragma once
/// An off-screen OpenGL 4.5 core context, created by OSMesa or EGL. The environment variables of Mesa are set
/// first, so that the same scene gives the same pixels. Both libraries are loaded at run time, so that
/// programs start without them.

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace offstage::render {

/// Ways to create a context. OSMesa and EGL draw with llvmpipe and give the same pixels.
enum class GlPlatform {
  automatic,  ///< OSMesa, or EGL with llvmpipe if OSMesa is not installed
  osmesa,     ///< libOSMesa: llvmpipe without a window system
  egl,        ///< libEGL without a surface, on llvmpipe
  /// libEGL without a surface, on the first GPU that offers OpenGL 4.5. Its pixels differ from the pixels of
  /// llvmpipe.
  egl_gpu,
};

/// Returns "auto", "osmesa", "egl" or "egl:gpu".
std::string_view name_of(GlPlatform platform);
/// Returns the platform with a name, as in name_of(). Throws std::invalid_argument with a list of the names
/// if there is none.
GlPlatform gl_platform(std::string_view name);
/// Returns the platform in the environment variable OFFSTAGE_GL, or automatic if it is not set. Throws
/// std::invalid_argument for an unknown name.
GlPlatform gl_platform_of_environment();

/// Describes the GL implementation in use; part of a golden image's fingerprint.
struct ContextInfo {
  std::string renderer;  ///< GL_RENDERER: name of the renderer, such as "llvmpipe (LLVM 15.0.6, 256 bits)"
  std::string version;   ///< GL_VERSION, such as "4.5 (Core Profile) Mesa 22.3.6"
  std::string glsl;
  std::string rays;                          ///< the library that traces light, such as "Embree 3.13.5 avx2"
  GlPlatform platform = GlPlatform::osmesa;  ///< the platform in use, never automatic
};

/// Sets the environment variables of Mesa, and selects the platform of all contexts. Call it once, in main,
/// before any thread starts, because it uses setenv. Mesa reads the variables when the first context is
/// created. `raster_threads` is the value of LP_NUM_THREADS. All contexts of a process share the rasterizer
/// threads of llvmpipe, so this should be the number of processors. The environment variable
/// OFFSTAGE_SHADER_CACHE may name an existing folder in which Mesa stores compiled shaders for later
/// processes. It does not change pixels.
void pin_environment(int raster_threads, GlPlatform platform = gl_platform_of_environment());

/// Owns an OpenGL context, which is current on the thread that created it. It must be used only on that
/// thread, and there must be no second context there during its lifetime. The constructor throws
/// UnavailableError.
class Context {
 public:
  Context();
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  const ContextInfo& info() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// A device listed by EGL.
struct EglDevice {
  bool software = false;   ///< whether the device is llvmpipe, not a GPU
  std::string name;        ///< name of the device from the vendor's driver, such as "NVIDIA H100 80GB
                           ///< HBM3"; may be empty
  std::string file;        ///< device file, such as /dev/dri/card0; empty if there is none
  std::string extensions;  ///< EGL_EXTENSIONS of the device
};

/// Lists all devices of EGL, in its order. Throws UnavailableError if libEGL is missing or cannot list
/// devices.
std::vector<EglDevice> egl_devices();

}  // namespace offstage::render
