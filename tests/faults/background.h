#pragma once
/// Runs the program in the background, so that tests can stop, continue and kill it while it works.

#include <filesystem>
#include <string>
#include <vector>

#include <sys/types.h>

namespace offstage::test {

class Background {
 public:
  Background(const std::vector<std::string>& arguments, const std::filesystem::path& folder);
  /// Kills the program if it still runs.
  ~Background();
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  pid_t pid() const { return pid_; }
  void send(int signal) const;
  /// Waits for the program. Returns its exit code, or 128 + the number of the signal that ended it. After
  /// `seconds`, kills the program and returns -1.
  int end(double seconds = 60);

 private:
  pid_t pid_;
};

/// Waits until `file` exists and returns true; returns false after one minute.
bool appears(const std::filesystem::path& file);

}  // namespace offstage::test
