#include "faults/background.h"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <thread>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace offstage::test {

Background::Background(const std::vector<std::string>& arguments, const std::filesystem::path& folder)
    : pid_(fork()) {
  if (pid_ != 0) return;
  std::vector<char*> argv = {const_cast<char*>("offstage")};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const int nowhere = open("/dev/null", O_RDWR);
  for (int stream = 0; stream < 3; ++stream) dup2(nowhere, stream);
  setenv("XDG_CACHE_HOME", (folder / "own-cache").c_str(), 1);
  if (chdir(folder.c_str()) == 0) execv(OFFSTAGE_BINARY_DIR "/offstage", argv.data());
  _exit(99);
}

Background::~Background() {
  if (pid_ <= 0) return;
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
}

void Background::send(int signal) const {
  kill(pid_, signal);
}

int Background::end(double seconds) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  int status = 0;
  while (waitpid(pid_, &status, WNOHANG) == 0) {
    if (std::chrono::steady_clock::now() > deadline) return -1;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

bool appears(const std::filesystem::path& file) {
  std::error_code error;
  for (int i = 0; i < 12000; ++i) {
    if (std::filesystem::exists(file, error)) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return false;
}

}  // namespace offstage::test
