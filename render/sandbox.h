#pragma once
/// Permanently removes rights from the calling process, for the child that reads untrusted files.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace offstage::render {

struct ProcessLimits {
  uint64_t cpu_s = 0;         ///< processor time [s]
  uint64_t memory_bytes = 0;  ///< memory in addition to that already mapped; also the limit of file sizes
};

/// Limits time and memory (RLIMIT_CPU, RLIMIT_AS, RLIMIT_FSIZE), and disables core dumps. SIGXCPU ends the
/// process. SIGINT and SIGTERM are ignored, because the parent handles them. SIGXFSZ is ignored, so that the
/// write fails instead.
void limit_process(const ProcessLimits& limits);

/// Closes all descriptors above the standard streams except `kept`, so that the child cannot reach outputs
/// and locks of this process.
void close_descriptors(int kept);

/// Allows only files below `folders` to be opened, and only for reading (Landlock). Allows no network, no new
/// process or program, and no change of the file system (seccomp: all other system calls fail with EPERM).
/// Features that the kernel lacks are skipped.
void enter_sandbox(std::span<const std::filesystem::path> folders);

/// Returns which of Landlock and seccomp the kernel supports, for `doctor`: "Landlock and seccomp",
/// "seccomp", ...
std::string sandbox_support();

}  // namespace offstage::render
