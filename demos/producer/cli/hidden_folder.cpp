#include "producer/cli/hidden_folder.h"

#include <atomic>

#include <fmt/format.h>
#include <unistd.h>

namespace offstage::producer {

namespace fs = std::filesystem;

HiddenFolder::HiddenFolder(const fs::path& output, const std::string& purpose) {
  static std::atomic<int> number = 0;
  const fs::path beside = output.has_parent_path() ? output.parent_path() : ".";
  fs::create_directories(beside);
  path_ = beside / fmt::format(".{}.{}-{}-{}", output.filename().string(), purpose, getpid(), ++number);
  fs::create_directory(path_);
}

HiddenFolder::~HiddenFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace offstage::producer
