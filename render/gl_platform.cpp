#include "render/gl_platform.h"

#include <dlfcn.h>

#include "render/error.h"

namespace offstage::render {

SharedLibrary::SharedLibrary(std::initializer_list<const char*> names, const std::string& package) {
  std::string reason;
  for (const char* name : names) {
    library_ = ::dlopen(name, RTLD_NOW | RTLD_LOCAL);
    if (library_ != nullptr) {
      name_ = name;
      return;
    }
    if (reason.empty()) reason = ::dlerror();
  }
  throw UnavailableError(reason + "; install it: apt-get install " + package);
}

void* SharedLibrary::address(const char* name) const {
  void* function = ::dlsym(library_, name);
  if (function == nullptr) throw UnavailableError(name_ + " has no function " + name + "; upgrade Mesa");
  return function;
}

}  // namespace offstage::render
