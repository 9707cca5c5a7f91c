#include "render/context.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include <unistd.h>

#include "render/error.h"
#include "render/gl.h"
#include "render/gl_platform.h"
#include "render/trace/ray_scene.h"

namespace offstage::render {
namespace {

constexpr std::array<std::pair<std::string_view, GlPlatform>, 4> kPlatforms = {
    {{"auto", GlPlatform::automatic},
     {"osmesa", GlPlatform::osmesa},
     {"egl", GlPlatform::egl},
     {"egl:gpu", GlPlatform::egl_gpu}}};

// Protects the platform, the environment variables of Mesa and the function pointers of glad, which are
// global in the process. The first context replaces `automatic` by an available platform.
std::mutex platform_mutex;
GlPlatform chosen_platform = GlPlatform::automatic;

std::unique_ptr<PlatformContext> make_context_of(GlPlatform platform) {
  return platform == GlPlatform::osmesa ? make_osmesa_context()
                                        : make_egl_context(platform == GlPlatform::egl_gpu);
}

/// Creates a context of the chosen platform and makes it current on this thread.
std::pair<std::unique_ptr<PlatformContext>, GlPlatform> make_platform_context() {
  const std::lock_guard lock(platform_mutex);
  if (chosen_platform != GlPlatform::automatic) return {make_context_of(chosen_platform), chosen_platform};
  std::string reasons;
  for (const GlPlatform platform : {GlPlatform::osmesa, GlPlatform::egl}) {
    try {
      auto context = make_context_of(platform);
      chosen_platform = platform;
      return {std::move(context), platform};
    } catch (const UnavailableError& error) {
      reasons += std::string(reasons.empty() ? "" : "\n") + error.what();
    }
  }
  throw UnavailableError("no OpenGL backend is available; one of the two is enough:\n" + reasons);
}

std::string gl_string(GLenum name) {
  const GLubyte* text = glGetString(name);
  return text != nullptr ? reinterpret_cast<const char*>(text) : "";
}

// glad keeps its function pointers in global variables; they are the same for every context of the process.
void load_functions(GlLookup lookup) {
  static std::once_flag once;
  static int version = 0;
  std::call_once(once, [&] { version = gladLoadGL(lookup); });
  if (version == 0) throw UnavailableError("the driver offers no GL functions; reinstall Mesa");
}

void check(const ContextInfo& info) {
  const std::string name(name_of(info.platform));
  if (info.platform != GlPlatform::egl_gpu && !info.renderer.starts_with("llvmpipe"))
    throw UnavailableError(name + " draws with \"" + info.renderer +
                           "\" where llvmpipe is needed; install Mesa with llvmpipe");
  GLint major = 0, minor = 0;
  glGetIntegerv(GL_MAJOR_VERSION, &major);
  glGetIntegerv(GL_MINOR_VERSION, &minor);
  if (major * 10 + minor < 45)
    throw UnavailableError(name + " offers OpenGL \"" + info.version +
                           "\" where 4.5 is needed; upgrade the driver");
}

}  // namespace

std::string_view name_of(GlPlatform platform) {
  for (const auto& [name, value] : kPlatforms)
    if (value == platform) return name;
  throw std::logic_error("unknown GL platform");
}

GlPlatform gl_platform(std::string_view name) {
  std::string names;
  for (const auto& [known, value] : kPlatforms) {
    if (known == name) return value;
    names += (names.empty() ? "" : ", ") + std::string(known);
  }
  throw std::invalid_argument("'" + std::string(name) + "' is not an OpenGL backend; the backends are " +
                              names);
}

GlPlatform gl_platform_of_environment() {
  const char* name = std::getenv("OFFSTAGE_GL");
  return name == nullptr ? GlPlatform::automatic : gl_platform(name);
}

namespace {

/// Removes the environment variables that change or trace the pixels of a Mesa driver. These are all
/// variables of some families, except the ones that specify where parts of Mesa are installed.
void clear_driver_variables() {
  constexpr std::array<std::string_view, 14> kFamilies = {
      "MESA_", "GALLIUM_",  "GALLIVM_", "LP_",  "ST_",   "DRAW_",   "TGSI_",
      "NIR_",  "SOFTPIPE_", "LIBGL_",   "EGL_", "GLSL_", "OSMESA_", "mesa_"};
  constexpr std::array<std::string_view, 3> kKept = {"LIBGL_DRIVERS_PATH", "EGL_LOG_LEVEL",
                                                     "EGL_DRIVERS_PATH"};
  std::vector<std::string> names;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view text = *entry;
    const std::string_view name = text.substr(0, text.find('='));
    const bool family =
        std::ranges::any_of(kFamilies, [&](std::string_view f) { return name.starts_with(f); });
    if (family && std::ranges::find(kKept, name) == kKept.end()) names.emplace_back(name);
  }
  for (const std::string& name : names) unsetenv(name.c_str());
}

}  // namespace

void pin_environment(int raster_threads, GlPlatform platform) {
  const std::lock_guard lock(platform_mutex);
  chosen_platform = platform;
  const bool software = platform != GlPlatform::egl_gpu;
  const auto set_if = [](bool set, const char* name, const std::string& value) {
    if (set)
      setenv(name, value.c_str(), 1);
    else
      unsetenv(name);
  };
  clear_driver_variables();
  set_if(software, "GALLIUM_DRIVER", "llvmpipe");
  set_if(software, "LIBGL_ALWAYS_SOFTWARE", "true");  // without this variable, EGL prefers a GPU
  setenv("EGL_LOG_LEVEL", "fatal", 0);                // errors are reported as exceptions
  setenv("LP_NATIVE_VECTOR_WIDTH", "256", 1);
  setenv("LP_NUM_THREADS", std::to_string(raster_threads).c_str(), 1);
  const char* cache = std::getenv("OFFSTAGE_SHADER_CACHE");
  const bool caches = cache != nullptr && *cache != '\0';
  setenv("MESA_SHADER_CACHE_DISABLE", caches ? "false" : "true", 1);
  set_if(caches, "MESA_SHADER_CACHE_DIR", caches ? cache : "");
}

struct Context::Impl {
  std::unique_ptr<PlatformContext> platform;
  ContextInfo info;
  std::optional<gl::SharedPrograms> programs;  // destroyed before the context
};

Context::Context() : impl_(std::make_unique<Impl>()) {
  ContextInfo& info = impl_->info;
  std::tie(impl_->platform, info.platform) = make_platform_context();
  load_functions(impl_->platform->lookup());
  info.renderer = gl_string(GL_RENDERER);
  info.version = gl_string(GL_VERSION);
  info.glsl = gl_string(GL_SHADING_LANGUAGE_VERSION);
  info.rays = ray_library();
  check(info);
  impl_->programs.emplace();
}

Context::~Context() = default;

const ContextInfo& Context::info() const {
  return impl_->info;
}

}  // namespace offstage::render
