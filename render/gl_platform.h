#pragma once
/// Private: the libraries that make GL contexts, loaded at run time.

#include <initializer_list>
#include <memory>
#include <string>

namespace offstage::render {

/// Finds a GL function by its name.
using GlLookup = void (*(*)(const char* name))();

/// A context of one library. It must be destroyed on the thread that created it.
class PlatformContext {
 public:
  virtual ~PlatformContext() = default;
  virtual GlLookup lookup() const = 0;
};

/// Creates an OpenGL 4.5 core context, current on this thread. Throws UnavailableError.
std::unique_ptr<PlatformContext> make_osmesa_context();
/// Creates an OpenGL 4.5 core context by EGL without a surface, current on this thread, on llvmpipe or on the
/// first GPU with OpenGL 4.5. Throws UnavailableError.
std::unique_ptr<PlatformContext> make_egl_context(bool gpu);

/// A shared library that stays loaded until the process ends.
class SharedLibrary {
 public:
  /// Loads the first of `names` that can be loaded. Throws UnavailableError, which names the Debian package
  /// to install.
  SharedLibrary(std::initializer_list<const char*> names, const std::string& package);
  /// Sets `function` to the library's function of the given name. Throws UnavailableError.
  template <class Function>
  void find(const char* name, Function*& function) const {
    function = reinterpret_cast<Function*>(address(name));
  }

 private:
  void* address(const char* name) const;
  void* library_ = nullptr;
  std::string name_;
};

}  // namespace offstage::render
