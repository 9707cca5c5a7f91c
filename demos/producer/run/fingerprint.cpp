#include "producer/run/fingerprint.h"

#include <algorithm>
#include <fstream>

#include <fmt/format.h>
#include <gnu/libc-version.h>
#include <sched.h>

namespace offstage::producer {

std::string cpu_class() {
  std::string vendor = "unknown";
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("vendor_id")) {
      vendor = line.substr(line.find(':') + 2);
      break;
    }
  const bool v3 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("bmi") &&
                  __builtin_cpu_supports("bmi2") && __builtin_cpu_supports("fma");
  return (v3 ? "x86-64-v3 " : "other ") + vendor;
}

std::string fingerprint(const render::ContextInfo& context) {
#ifdef __clang__
  const char* compiler = "clang " __clang_version__;
#else
  const char* compiler = "gcc " __VERSION__;
#endif
  return fmt::format("{}; {}; {}; glibc {}; {}; {}", context.renderer, context.version, context.rays,
                     gnu_get_libc_version(), cpu_class(), compiler);
}

int available_processors() {
  cpu_set_t set;
  CPU_ZERO(&set);
  return sched_getaffinity(0, sizeof set, &set) == 0 ? std::max(1, CPU_COUNT(&set)) : 1;
}

}  // namespace offstage::producer
