#pragma once
/// Runs the offstage program as a user would, and captures its output.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace offstage::test {

struct Outcome {
  int code = 0;  ///< exit code
  std::string out, err;
};

/// Runs `build/offstage ARGS` in `folder`; `before`: shell text in front of the command, such as "ulimit -f
/// 1;" or "VAR=value".
Outcome offstage(const std::string& args, const std::filesystem::path& folder,
                 const std::string& before = {});

std::string read_file(const std::filesystem::path& path);
void write_file(const std::filesystem::path& path, const std::string& text);

/// Returns the contents of all regular files below a folder, by relative path. Hidden files are included.
std::map<std::string, std::string> contents(const std::filesystem::path& folder);

/// A new empty folder. The destructor removes it with its contents.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// Returns the path of the scene that most tests use, tests/data/tiny.json.
std::string tiny_scene();

}  // namespace offstage::test
