#include "render/sandbox.h"

#include <array>
#include <cstddef>
#include <fstream>
#include <vector>

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/landlock.h>
#include <linux/seccomp.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "render/file_io.h"

namespace offstage::render {
namespace {

constexpr uint64_t kReading = LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
constexpr uint64_t kAllOfFirstVersion = (LANDLOCK_ACCESS_FS_MAKE_SYM << 1) - 1;

long landlock_version() {
  return ::syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
}

void restrict_files(std::span<const std::filesystem::path> folders) {
  if (landlock_version() < 1) return;
  landlock_ruleset_attr all{};
  all.handled_access_fs = kAllOfFirstVersion;
  const Descriptor rules(
      static_cast<int>(::syscall(SYS_landlock_create_ruleset, &all, sizeof all.handled_access_fs, 0)));
  if (!rules) return;
  for (const std::filesystem::path& folder : folders) {
    const Descriptor place(::open(folder.c_str(), O_PATH | O_CLOEXEC));
    landlock_path_beneath_attr below{};
    below.allowed_access = kReading;
    below.parent_fd = place.fd();
    if (place) ::syscall(SYS_landlock_add_rule, rules.fd(), LANDLOCK_RULE_PATH_BENEATH, &below, 0);
  }
  ::syscall(SYS_landlock_restrict_self, rules.fd(), 0);
}

/// System calls for memory, arithmetic and reading. Opening files is handled separately.
constexpr std::array kAllowedCalls = {
    SYS_read,         SYS_readv,          SYS_pread64,      SYS_write,           SYS_writev,
    SYS_pwrite64,     SYS_close,          SYS_fstat,        SYS_newfstatat,      SYS_stat,
    SYS_lstat,        SYS_statx,          SYS_lseek,
    SYS_ftruncate,  // for the file of the answer, the only file that is open for writing
    SYS_access,       SYS_faccessat,      SYS_faccessat2,   SYS_readlink,        SYS_readlinkat,
    SYS_getcwd,       SYS_getdents64,     SYS_mmap,         SYS_munmap,          SYS_mprotect,
    SYS_mremap,       SYS_madvise,        SYS_brk,          SYS_futex,           SYS_sched_yield,
    SYS_rt_sigaction, SYS_rt_sigprocmask, SYS_rt_sigreturn, SYS_sigaltstack,     SYS_clock_gettime,
    SYS_clock_getres, SYS_gettimeofday,   SYS_time,         SYS_getrandom,       SYS_getpid,
    SYS_gettid,       SYS_getrusage,      SYS_getrlimit,    SYS_sysinfo,         SYS_uname,
    SYS_fcntl,        SYS_exit,           SYS_exit_group,   SYS_restart_syscall, SYS_sched_getaffinity};

sock_filter statement(uint16_t code, uint32_t k) {
  return {code, 0, 0, k};
}
sock_filter jump(uint16_t test, uint32_t k, uint8_t if_true, uint8_t if_false) {
  return {static_cast<uint16_t>(BPF_JMP | test | BPF_K), if_true, if_false, k};
}
sock_filter load(std::size_t offset) {
  return statement(BPF_LD | BPF_W | BPF_ABS, static_cast<uint32_t>(offset));
}
sock_filter answer(uint32_t action) {
  return statement(BPF_RET | BPF_K, action);
}

/// Allows a system call that opens files, but only if its flags argument requests read-only access.
void allow_opening(std::vector<sock_filter>& program, uint32_t call, std::size_t flags_argument) {
  constexpr uint32_t kChanges = O_ACCMODE | O_CREAT | O_TRUNC | O_APPEND;  // O_RDONLY is 0
  // The less significant half comes first.
  const std::size_t flags = offsetof(seccomp_data, args) + flags_argument * sizeof(uint64_t);
  program.push_back(jump(BPF_JEQ, call, 0, 4));
  program.push_back(load(flags));
  program.push_back(jump(BPF_JSET, kChanges, 0, 1));
  program.push_back(answer(SECCOMP_RET_ERRNO | EPERM));
  program.push_back(answer(SECCOMP_RET_ALLOW));
}

/// Allows signals that a process sends to itself, as abort() does.
void allow_own_signals(std::vector<sock_filter>& program) {
  program.push_back(jump(BPF_JEQ, SYS_tgkill, 0, 4));
  program.push_back(load(offsetof(seccomp_data, args)));
  program.push_back(jump(BPF_JEQ, static_cast<uint32_t>(::getpid()), 0, 1));
  program.push_back(answer(SECCOMP_RET_ALLOW));
  program.push_back(answer(SECCOMP_RET_ERRNO | EPERM));
}

void restrict_calls() {
  std::vector<sock_filter> program = {load(offsetof(seccomp_data, arch)),
                                      jump(BPF_JEQ, AUDIT_ARCH_X86_64, 1, 0),
                                      answer(SECCOMP_RET_ERRNO | EPERM), load(offsetof(seccomp_data, nr))};
  allow_opening(program, SYS_open, 1);
  allow_opening(program, SYS_openat, 2);
  allow_own_signals(program);
  for (const long call : kAllowedCalls) {
    program.push_back(jump(BPF_JEQ, static_cast<uint32_t>(call), 0, 1));
    program.push_back(answer(SECCOMP_RET_ALLOW));
  }
  program.push_back(answer(SECCOMP_RET_ERRNO | EPERM));
  const sock_fprog filter{static_cast<uint16_t>(program.size()), program.data()};
  ::prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &filter, 0, 0);
}

}  // namespace

void close_descriptors(int kept) {
  const auto first = static_cast<unsigned>(STDERR_FILENO + 1), own = static_cast<unsigned>(kept);
  if (own > first) ::syscall(SYS_close_range, first, own - 1, 0);
  ::syscall(SYS_close_range, own + 1, ~0u, 0);
}

void limit_process(const ProcessLimits& limits) {
  const auto limit = [](__rlimit_resource what, rlim_t value) {
    const rlimit both{value, value};
    ::setrlimit(what, &both);
  };
  uint64_t mapped_pages = 0;
  std::ifstream("/proc/self/statm") >> mapped_pages;
  limit(RLIMIT_AS, mapped_pages * static_cast<uint64_t>(::sysconf(_SC_PAGESIZE)) + limits.memory_bytes);
  limit(RLIMIT_FSIZE, limits.memory_bytes);
  limit(RLIMIT_CORE, 0);
  // The hard limit is a second later, so that the signal reports the reason before the kernel kills the
  // process.
  const rlimit time{limits.cpu_s, limits.cpu_s + 1};
  ::setrlimit(RLIMIT_CPU, &time);

  sigset_t none;
  sigemptyset(&none);
  ::pthread_sigmask(SIG_SETMASK, &none, nullptr);
  ::signal(SIGXCPU, SIG_DFL);
  for (const int signal : {SIGINT, SIGTERM, SIGXFSZ}) ::signal(signal, SIG_IGN);
}

void enter_sandbox(std::span<const std::filesystem::path> folders) {
  ::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
  restrict_files(folders);
  restrict_calls();
}

std::string sandbox_support() {
  const bool seccomp = ::prctl(PR_GET_SECCOMP) >= 0, landlock = landlock_version() >= 1;
  if (landlock && seccomp) return "Landlock and seccomp";
  return landlock ? "Landlock" : seccomp ? "seccomp" : "none; limits of time and memory only";
}

}  // namespace offstage::render
