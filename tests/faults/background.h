#pragma once
/// The program in the background, to be stopped, continued and killed while it works.

#include <filesystem>
#include <string>
#include <vector>

#include <sys/types.h>

namespace offstage::test {

class Background {
 public:
  Background(const std::vector<std::string>& arguments, const std::filesystem::path& folder);
  /// Kills it, if it still runs.
  ~Background();
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;

  pid_t pid() const { return pid_; }
  void send(int signal) const;
  /// Its exit code, 128 + signal, or -1 if it has not ended after `seconds`; then it is killed.
  int end(double seconds = 60);

 private:
  pid_t pid_;
};

/// Waits until `file` is there, for a minute at most.
bool appears(const std::filesystem::path& file);

}  // namespace offstage::test
