#include "render/context.h"

#include <array>
#include <cstdlib>
#include <mutex>

#include "render/error.h"
// glad must come before Mesa's own gl.h, which osmesa.h includes.
// clang-format off
#include "render/gl.h"
#include <GL/osmesa.h>
// clang-format on

namespace offstage::render {
namespace {

// Everything is drawn into framebuffer objects; OSMesa's own buffer is only what makes the context current.
constexpr int kDummySize_px = 16;

std::string gl_string(GLenum name) {
  const GLubyte* text = glGetString(name);
  return text != nullptr ? reinterpret_cast<const char*>(text) : "";
}

// glad keeps its function pointers in globals; they are the same for every context of the process.
void load_functions() {
  static std::once_flag once;
  static int version = 0;
  std::call_once(once, [] { version = gladLoadGL(reinterpret_cast<GLADloadfunc>(OSMesaGetProcAddress)); });
  if (version == 0) throw UnavailableError("OSMesa offers no GL functions; reinstall libosmesa6");
}

}  // namespace

void pin_environment(int raster_threads) {
  setenv("GALLIUM_DRIVER", "llvmpipe", 1);
  setenv("LP_NATIVE_VECTOR_WIDTH", "256", 1);
  setenv("LP_NUM_THREADS", std::to_string(raster_threads).c_str(), 1);
  setenv("MESA_SHADER_CACHE_DISABLE", "true", 1);
  for (const char* name :
       {"MESA_GL_VERSION_OVERRIDE", "MESA_GLES_VERSION_OVERRIDE", "MESA_GLSL_VERSION_OVERRIDE",
        "MESA_EXTENSION_OVERRIDE", "MESA_LOADER_DRIVER_OVERRIDE", "MESA_NO_ERROR", "MESA_DEBUG",
        "LIBGL_ALWAYS_SOFTWARE", "LIBGL_DEBUG", "LP_PERF", "LP_DEBUG", "GALLIVM_PERF", "GALLIVM_DEBUG",
        "GALLIUM_OVERRIDE_CPU_CAPS", "GALLIUM_NOSSE", "DRAW_USE_LLVM"}) {
    unsetenv(name);
  }
}

struct Context::Impl {
  OSMesaContext handle = nullptr;
  std::array<GLubyte, kDummySize_px * kDummySize_px * 4> pixels{};
  ContextInfo info;

  ~Impl() {
    if (handle != nullptr) OSMesaDestroyContext(handle);
  }
};

Context::Context() : impl_(std::make_unique<Impl>()) {
  // clang-format off
  const int attributes[] = {OSMESA_FORMAT, OSMESA_RGBA, OSMESA_DEPTH_BITS, 0, OSMESA_STENCIL_BITS, 0,
                            OSMESA_ACCUM_BITS, 0, OSMESA_PROFILE, OSMESA_CORE_PROFILE,
                            OSMESA_CONTEXT_MAJOR_VERSION, 4, OSMESA_CONTEXT_MINOR_VERSION, 5, 0};
  // clang-format on
  impl_->handle = OSMesaCreateContextAttribs(attributes, nullptr);
  if (impl_->handle == nullptr) {
    throw UnavailableError(
        "OSMesa gives no OpenGL 4.5 core context; install libosmesa6 22.3 or newer (apt-get install "
        "libosmesa6)");
  }
  if (!OSMesaMakeCurrent(impl_->handle, impl_->pixels.data(), GL_UNSIGNED_BYTE, kDummySize_px,
                         kDummySize_px)) {
    throw UnavailableError("OSMesa cannot make its context current; reinstall libosmesa6");
  }
  load_functions();
  ContextInfo& info = impl_->info;
  info = {gl_string(GL_RENDERER), gl_string(GL_VERSION), gl_string(GL_SHADING_LANGUAGE_VERSION)};
  if (!info.renderer.starts_with("llvmpipe")) {
    throw UnavailableError(
        "OSMesa draws with \"" + info.renderer +
        "\" where llvmpipe is needed; install libosmesa6 with llvmpipe and unset GALLIUM_DRIVER");
  }
  GLint major = 0, minor = 0;
  glGetIntegerv(GL_MAJOR_VERSION, &major);
  glGetIntegerv(GL_MINOR_VERSION, &minor);
  if (major * 10 + minor < 45) {
    throw UnavailableError("OSMesa offers OpenGL \"" + info.version +
                           "\" where 4.5 is needed; upgrade libosmesa6");
  }
}

Context::~Context() = default;

const ContextInfo& Context::info() const {
  return impl_->info;
}

}  // namespace offstage::render
