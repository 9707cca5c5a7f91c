#include "render/child_process.h"

#include <cstring>
#include <thread>

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

namespace offstage::render {
namespace {

/// The child's streams, group and signals: posix_spawn's two attribute objects with their lifetimes.
struct SpawnSetup {
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;

  SpawnSetup(int in, int out, int err) {
    posix_spawn_file_actions_init(&actions);
    connect(in, STDIN_FILENO, O_RDONLY);
    connect(out, STDOUT_FILENO, O_WRONLY);
    connect(err, STDERR_FILENO, O_WRONLY);

    posix_spawnattr_init(&attributes);
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    posix_spawnattr_setpgroup(&attributes, 0);
    posix_spawnattr_setflags(&attributes,
                             POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  }
  ~SpawnSetup() {
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
  }
  SpawnSetup(const SpawnSetup&) = delete;
  SpawnSetup& operator=(const SpawnSetup&) = delete;

 private:
  void connect(int fd, int stream, int mode) {
    if (fd >= 0) {
      posix_spawn_file_actions_adddup2(&actions, fd, stream);
    } else {
      posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", mode, 0);
    }
  }
};

}  // namespace

BoundedCapture::BoundedCapture(std::size_t max_bytes)
    : max_bytes_(max_bytes), memory_(::memfd_create("offstage-capture", MFD_CLOEXEC | MFD_ALLOW_SEALING)) {
  if (!memory_ || ::ftruncate(memory_.fd(), static_cast<off_t>(max_bytes)) != 0 ||
      ::fcntl(memory_.fd(), F_ADD_SEALS, F_SEAL_GROW) != 0) {
    throw_file_error("memory file", "cannot be made");
  }
}

std::string BoundedCapture::text() const {
  std::string text(max_bytes_, '\0');
  const ssize_t size = ::pread(memory_.fd(), text.data(), text.size(), 0);
  text.resize(size > 0 ? ::strnlen(text.data(), static_cast<std::size_t>(size)) : 0);
  return text;
}

ChildProcess::ChildProcess(const std::vector<std::string>& arguments, int in, int out, int err) {
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const SpawnSetup setup(in, out, err);
  error_ = ::posix_spawnp(&pid_, argv[0], &setup.actions, &setup.attributes, argv.data(), environ);
  if (error_ != 0) pid_ = -1;
}

ChildProcess::~ChildProcess() {
  kill();
  wait();
}

void ChildProcess::kill() {
  if (pid_ > 0) ::kill(-pid_, SIGKILL);
}

std::optional<std::string> ChildProcess::wait() {
  if (pid_ <= 0) return std::nullopt;
  int status = 0;
  pid_t ended = -1;
  do {
    ended = ::waitpid(pid_, &status, 0);
  } while (ended < 0 && errno == EINTR);
  pid_ = -1;
  return ended < 0 ? "an unknown end: " + system_reason(errno) : describe_failure(status);
}

std::optional<std::string> ChildProcess::wait_for(std::chrono::milliseconds limit) {
  const auto deadline = std::chrono::steady_clock::now() + limit;
  siginfo_t info{};
  while (pid_ > 0 && ::waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         info.si_pid == 0) {
    if (std::chrono::steady_clock::now() > deadline) {
      kill();
      wait();
      return "no answer within " + std::to_string(limit.count() / 1000) + " s";
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return wait();
}

std::optional<std::string> describe_failure(int wait_status) {
  if (WIFSIGNALED(wait_status)) {
    const int signal = WTERMSIG(wait_status);
    const char* name = ::sigdescr_np(signal);
    return "signal " + std::to_string(signal) + (name ? std::string(" (") + name + ")" : "");
  }
  const int code = WEXITSTATUS(wait_status);
  return code == 0 ? std::nullopt : std::optional("exit code " + std::to_string(code));
}

}  // namespace offstage::render
