#include "render/child_process.h"

#include <array>
#include <cstring>
#include <thread>

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

namespace offstage::render {
namespace {

/// Runs in the child process. Sets its streams, process group and signals, then starts the program. Uses only
/// calls that are safe after fork() in a process with threads.
[[noreturn]] void become(char** argv, const std::array<int, 3>& streams, pid_t parent, int report) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(127);
  ::setpgid(0, 0);
  for (int stream = 0; stream < 3; ++stream) {
    const int mode = stream == STDIN_FILENO ? O_RDONLY : O_WRONLY;
    const int fd = streams[static_cast<std::size_t>(stream)];
    if (::dup2(fd >= 0 ? fd : ::open("/dev/null", mode), stream) < 0) ::_exit(127);
  }
  for (int signal = 1; signal < NSIG; ++signal) ::signal(signal, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  ::execvp(argv[0], argv);
  const int error = errno;
  if (::write(report, &error, sizeof error) != sizeof error) ::_exit(126);
  ::_exit(127);
}

}  // namespace

BoundedCapture::BoundedCapture(std::size_t max_bytes)
    : max_bytes_(max_bytes), memory_(::memfd_create("offstage-capture", MFD_CLOEXEC | MFD_ALLOW_SEALING)) {
  if (!memory_ || ::ftruncate(memory_.fd(), static_cast<off_t>(max_bytes)) != 0 ||
      ::fcntl(memory_.fd(), F_ADD_SEALS, F_SEAL_GROW) != 0) {
    throw_file_error("memory file", "cannot be created");
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
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) {
    error_ = errno;
    return;
  }
  const Descriptor reading(ends[0]);
  Descriptor writing(ends[1]);
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ == 0) become(argv.data(), {in, out, err}, parent, writing.fd());
  if (pid_ < 0) {
    error_ = errno;
    return;
  }
  writing.close();
  ssize_t got = 0;
  do {
    // If the program has started, the other end is closed and nothing can be read.
    got = ::read(reading.fd(), &error_, sizeof error_);
  } while (got < 0 && errno == EINTR);
  if (got != sizeof error_) {
    error_ = 0;
    return;
  }
  ::waitpid(pid_, nullptr, 0);
  pid_ = -1;
}

ChildProcess::~ChildProcess() {
  kill();
  wait();
}

void ChildProcess::kill() {
  if (pid_ > 0) ::kill(-pid_, SIGKILL);
}

std::optional<std::string> ChildProcess::wait(const StopTest& stop) {
  if (pid_ <= 0) return std::nullopt;
  StopDeadline patience(stop);
  while (stop && !wait_for_end(pid_, std::chrono::milliseconds(StopDeadline::kInterval_ms)))
    if (patience.exhausted()) kill();
  int status = 0;
  pid_t ended = -1;
  do {
    ended = ::waitpid(pid_, &status, 0);
  } while (ended < 0 && errno == EINTR);
  pid_ = -1;
  return ended < 0 ? "an unknown exit status: " + system_reason(errno) : describe_failure(status);
}

std::optional<std::string> ChildProcess::wait_for(std::chrono::milliseconds limit) {
  if (pid_ > 0 && !wait_for_end(pid_, limit)) {
    kill();
    wait();
    return "no answer within " + std::to_string(limit.count() / 1000) + " s";
  }
  return wait();
}

bool wait_for_end(pid_t child, std::chrono::milliseconds limit) {
  const auto deadline = std::chrono::steady_clock::now() + limit;
  // A process descriptor becomes readable when the child ends; without one (old kernels) the child is polled.
  const Descriptor process(static_cast<int>(::syscall(SYS_pidfd_open, child, 0)));
  while (true) {
    siginfo_t info{};
    if (::waitid(P_PID, static_cast<id_t>(child), &info, WEXITED | WNOHANG | WNOWAIT) != 0 ||
        info.si_pid != 0)
      return true;
    const auto left =
        std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    if (left.count() <= 0) return false;
    constexpr std::chrono::milliseconds kAsk(2);
    if (process) {
      pollfd end{process.fd(), POLLIN, 0};
      ::poll(&end, 1, static_cast<int>(left.count()));
    } else {
      std::this_thread::sleep_for(std::min(kAsk, left));
    }
  }
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
