#pragma once
/// An off-screen OpenGL 4.5 core context by OSMesa (llvmpipe), with Mesa's environment pinned first so that
/// the same scene gives the same pixels.

#include <memory>
#include <string>

namespace offstage::render {

/// What draws; part of a golden image's fingerprint.
struct ContextInfo {
  std::string renderer;  ///< GL_RENDERER, such as "llvmpipe (LLVM 15.0.6, 256 bits)"
  std::string version;   ///< GL_VERSION, such as "4.5 (Core Profile) Mesa 22.3.6"
  std::string glsl;
};

/// Sets and clears the environment variables that steer Mesa (LP_NUM_THREADS to `raster_threads`, which all
/// contexts of the process share: llvmpipe has one rasteriser, so give it every processor even if several
/// contexts draw at once). Call once, in main, before any thread starts: it uses setenv. Mesa reads them at
/// the first context.
void pin_environment(int raster_threads);

/// Owns the context, current on the thread that made it; use it from that thread only, and make no
/// second one there while it lives. Throws
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

}  // namespace offstage::render
