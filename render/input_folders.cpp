#include "render/input_folders.h"

#include <algorithm>
#include <system_error>

namespace offstage::render {

namespace fs = std::filesystem;

InputFolders::InputFolders(const std::vector<fs::path>& folders) {
  for (const fs::path& folder : folders) {
    std::error_code error;
    const fs::path real = fs::canonical(folder.empty() ? fs::path(".") : folder, error);
    if (!error) folders_.push_back(real);
  }
}

bool InputFolders::contain(const fs::path& file) const {
  std::error_code error;
  const fs::path real = fs::weakly_canonical(fs::absolute(file, error), error);
  if (error) return false;
  return std::ranges::any_of(folders_, [&](const fs::path& folder) {
    return std::mismatch(folder.begin(), folder.end(), real.begin(), real.end()).first == folder.end();
  });
}

}  // namespace offstage::render
