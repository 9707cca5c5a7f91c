#pragma once
/// An off-screen OpenGL 4.5 core context, by OSMesa or EGL, with Mesa's environment pinned first so that the
/// same scene gives the same pixels. Both libraries are loaded at run time: a program starts without them.

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace offstage::render {

/// How a context is made. OSMesa and EGL draw with llvmpipe and give the same pixels.
enum class GlPlatform {
  automatic,  ///< OSMesa, or EGL with llvmpipe where OSMesa is not installed
  osmesa,     ///< libOSMesa: llvmpipe without a window system
  egl,        ///< libEGL without a surface, on llvmpipe
  egl_gpu,    ///< libEGL without a surface, on the first GPU that offers OpenGL 4.5; pixels differ from
              ///< llvmpipe's
};

/// "auto", "osmesa", "egl" or "egl:gpu".
std::string_view name_of(GlPlatform platform);
/// The platform of such a name. Throws std::invalid_argument, which lists the names.
GlPlatform gl_platform(std::string_view name);
/// The platform that the environment variable OFFSTAGE_GL names; automatic without it. Throws
/// std::invalid_argument.
GlPlatform gl_platform_of_environment();

/// Describes the GL implementation in use; part of a golden image's fingerprint.
struct ContextInfo {
  std::string renderer;  ///< GL_RENDERER, such as "llvmpipe (LLVM 15.0.6, 256 bits)"
  std::string version;   ///< GL_VERSION, such as "4.5 (Core Profile) Mesa 22.3.6"
  std::string glsl;
  GlPlatform platform = GlPlatform::osmesa;  ///< the one in use, never automatic
};

/// Sets and clears the environment variables that steer Mesa (LP_NUM_THREADS to `raster_threads`, which all
/// contexts of the process share: llvmpipe has one rasteriser, so give it every processor even if several
/// contexts draw at once), and chooses the platform of all contexts. Call once, in main, before any thread
/// starts: it uses setenv. Mesa reads the variables at the first context. The environment variable
/// OFFSTAGE_SHADER_CACHE names a folder that is there, in which Mesa keeps compiled shaders from process to
/// process; without it none are kept. The pixels are the same.
void pin_environment(int raster_threads, GlPlatform platform = gl_platform_of_environment());

/// Owns an OpenGL context, which is current on the thread that created it. Use it from that thread only, and
/// create no second one there during its lifetime. Throws UnavailableError.
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

/// A device that EGL enumerates.
struct EglDevice {
  bool software = false;   ///< llvmpipe rather than a GPU
  std::string name;        ///< name from the vendor's driver, such as "NVIDIA H100 80GB HBM3"; may be empty
  std::string file;        ///< device file, such as /dev/dri/card0; empty if there is none
  std::string extensions;  ///< EGL_EXTENSIONS of the device
};

/// Lists all devices of EGL, in its order. Throws UnavailableError if libEGL is missing or cannot list
/// devices.
std::vector<EglDevice> egl_devices();

}  // namespace offstage::render
