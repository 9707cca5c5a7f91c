#pragma once
/// Takes rights away from the calling process for good: for the child that reads the files of strangers.

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace offstage::render {

struct ProcessLimits {
  uint64_t cpu_s = 0;         ///< processor time [s]
  uint64_t memory_bytes = 0;  ///< beyond what is mapped already; also the most that a file may grow to
};

/// Limits of time and memory (RLIMIT_CPU, RLIMIT_AS, RLIMIT_FSIZE), and no core dump. SIGXCPU ends the
/// process; SIGINT and SIGTERM are ignored, because the parent decides, and so is SIGXFSZ: the write fails
/// instead.
void limit_process(const ProcessLimits& limits);

/// Closes every descriptor above the standard streams but `kept`: outputs and locks of this process stay out
/// of reach.
void close_descriptors(int kept);

/// No file but those below `folders` can be opened, and those for reading only (Landlock); no network, no new
/// process or program, no change of the file system (seccomp: every other system call fails with EPERM). What
/// the kernel does not have is left out.
void enter_sandbox(std::span<const std::filesystem::path> folders);

/// Which of the two this kernel has, for `doctor`: "Landlock and seccomp", "seccomp", ...
std::string sandbox_support();

}  // namespace offstage::render
