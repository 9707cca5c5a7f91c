#include "render/confined_child.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <new>

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "render/child_process.h"
#include "render/error.h"
#include "render/sandbox.h"

namespace offstage::render {
namespace {

constexpr int kAnswerExit = 40, kMessageExit = 41;  // other codes do not come from this code
constexpr uint64_t kMiB = uint64_t{1} << 20;

ProcessLimits limits_of(const ConfinedWork& work) {
  const uint64_t file_bytes = work.file_bytes;
  constexpr uint64_t kSeconds = 10, kMostSeconds = 60, kMebibytesPerSecond = 5;
  constexpr uint64_t kMemory = 1536 * kMiB, kMostMemory = 4096 * kMiB, kTimesFile = 16;
  constexpr uint64_t kPicture = 128 * kMiB, kMostPictures = 32;
  return {.cpu_s = std::min(kSeconds + file_bytes / (kMebibytesPerSecond * kMiB), kMostSeconds),
          .memory_bytes =
              std::min(kMemory + kTimesFile * file_bytes + kPicture * std::min(work.pictures, kMostPictures),
                       kMostMemory)};
}

/// Runs in the child: writes an answer or a message to the memory file.
[[noreturn]] void become_child(const ConfinedWork& work, const ProcessLimits& limits, int memory,
                               const std::function<void(int)>& job) {
  std::string message;
  try {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int nowhere = ::open("/dev/null", O_RDWR);  // for the output of importers
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(nowhere, stream);
    close_descriptors(memory);
    limit_process(limits);
    enter_sandbox(work.folders->folders());
    job(memory);
    ::_exit(kAnswerExit);
  } catch (const FileError& error) {
    message = error.what();
  } catch (const std::bad_alloc&) {
    message = work.what + ": reading it needs more than " + std::to_string(limits.memory_bytes / kMiB) +
              " MiB of memory; the file is broken or too large";
  } catch (const std::exception& error) {
    message = work.what + ": cannot be read: " + one_line(error.what());
  }
  ::lseek(memory, 0, SEEK_SET);
  if (::ftruncate(memory, 0) == 0)
    write_all(memory, {reinterpret_cast<const uint8_t*>(message.data()), message.size()});
  ::_exit(kMessageExit);
}

[[noreturn]] void throw_too_slow(const ConfinedWork& work, const ProcessLimits& limits) {
  throw FileError(work.what + ": reading it takes more than " + std::to_string(limits.cpu_s) +
                  " s of processor time; the file is broken or too large");
}

/// Detects a child that hangs: its processor time in the last minute was less than a hundredth of a minute.
/// On a busy machine a working child gets less than the full time, but more than this. Its processor time has
/// a separate limit.
class Standstill {
 public:
  Standstill(pid_t child, std::chrono::seconds interval) : interval_(interval) {
    known_ = ::clock_getcpuclockid(child, &clock_) == 0;
  }

  bool reached() {
    const auto now = std::chrono::steady_clock::now();
    if (now - since_ < interval_) return false;
    timespec used{};
    if (!known_ || ::clock_gettime(clock_, &used) != 0) return true;
    const auto cpu = std::chrono::seconds(used.tv_sec) + std::chrono::nanoseconds(used.tv_nsec);
    const bool still = cpu - cpu_ < std::chrono::nanoseconds(interval_) / 100;
    since_ = now;
    cpu_ = cpu;
    return still;
  }

 private:
  std::chrono::seconds interval_;
  clockid_t clock_ = 0;
  bool known_ = false;
  std::chrono::steady_clock::time_point since_ = std::chrono::steady_clock::now();
  std::chrono::nanoseconds cpu_{0};
};

/// Waits for the child and returns its status.
int wait_status(pid_t child, const ConfinedWork& work) {
  Standstill standstill(child, work.standstill);
  bool stopped = false, still = false;
  while (!wait_for_end(child, std::chrono::milliseconds(StopDeadline::kInterval_ms))) {
    stopped = work.stop && work.stop();
    still = standstill.reached();
    if (stopped || still) ::kill(child, SIGKILL);
    if (stopped || still) break;
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0)
    if (errno != EINTR)
      throw UnavailableError("the process that reads files cannot be waited for: " + system_reason(errno));
  if (stopped) throw StoppedError(work.what + ": reading was interrupted");
  if (still)
    throw FileError(work.what + ": the process that reads it made no progress for " +
                    std::to_string(work.standstill.count()) + " s; the file is broken");
  return status;
}

[[noreturn]] void throw_for_end(const ConfinedWork& work, const ProcessLimits& limits, int status) {
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) throw_too_slow(work, limits);
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL)
    throw FileError(
        work.what +
        ": the process that reads it was killed by another process; perhaps the machine ran out of memory");
  throw FileError(work.what + ": crashed the process that reads it (" +
                  describe_failure(status).value_or("ended") + "); it is broken or nested too deeply");
}

}  // namespace

ChildAnswer::ChildAnswer(int fd)
    : size_(static_cast<std::size_t>(std::max<off_t>(::lseek(fd, 0, SEEK_END), 0))) {
  if (size_ == 0) return;
  data_ = ::mmap(nullptr, size_, PROT_READ, MAP_SHARED | MAP_POPULATE, fd, 0);
  if (data_ == MAP_FAILED) throw std::bad_alloc();
}

ChildAnswer::~ChildAnswer() {
  if (size_ > 0) ::munmap(data_, size_);
}

ChildAnswer run_confined(const ConfinedWork& work, const std::function<void(int)>& job) {
  const Descriptor memory(::memfd_create("offstage-answer", MFD_CLOEXEC));
  if (!memory)
    throw UnavailableError("no memory file can be created for reading files: " + system_reason(errno));
  const ProcessLimits limits = limits_of(work);
  const pid_t child = ::fork();
  if (child < 0)
    throw UnavailableError("the process that reads files cannot be started: " + system_reason(errno));
  if (child == 0) become_child(work, limits, memory.fd(), job);

  const int status = wait_status(child, work);
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : 0;
  if (code != kAnswerExit && code != kMessageExit) throw_for_end(work, limits, status);
  if (code == kAnswerExit) return ChildAnswer(memory.fd());
  const ChildAnswer message(memory.fd());
  throw FileError({message.bytes().begin(), message.bytes().end()});
}

}  // namespace offstage::render
