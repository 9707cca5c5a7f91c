#pragma once
/// Runs work on untrusted files in a forked child process. The child has limits of time and memory, cannot
/// use the network, cannot write files, and can only read the given folders (sandbox.h). Private to render.

#include <chrono>
#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "render/file_io.h"
#include "render/input_folders.h"

namespace offstage::render {

struct ConfinedWork {
  std::string what;  ///< name of the file that is read, for messages
  /// Size of the file, which determines the limits. Processor time: 10 s plus 1 s per 5 MiB, at most 60 s.
  /// Memory: 1.5 GiB plus 16 times the size, at most 4 GiB.
  uint64_t file_bytes = 0;
  /// Number of pictures that the file may refer to. Each adds 128 MiB to the limit of memory, up to the same
  /// 4 GiB.
  uint64_t pictures = 0;
  const InputFolders* folders = nullptr;  ///< folders that may be read
  StopTest stop = {};
  /// A child is killed if it uses less than 1 % of a processor for this time.
  std::chrono::seconds standstill{60};
};

/// The bytes that a child returned, mapped into memory.
class ChildAnswer {
 public:
  explicit ChildAnswer(int fd);
  ~ChildAnswer();
  ChildAnswer(const ChildAnswer&) = delete;
  ChildAnswer& operator=(const ChildAnswer&) = delete;

  std::span<const uint8_t> bytes() const { return {static_cast<const uint8_t*>(data_), size_}; }

 private:
  std::size_t size_;
  void* data_ = nullptr;
};

/// Runs `job` in a child process; its argument is the descriptor of a memory file for the answer. Throws
/// FileError with the message of `job`, or with the reason why the child failed: time limit, memory limit,
/// signal or crash. Throws StoppedError after a request to stop, and UnavailableError if no process can be
/// started.
ChildAnswer run_confined(const ConfinedWork& work, const std::function<void(int)>& job);

}  // namespace offstage::render
