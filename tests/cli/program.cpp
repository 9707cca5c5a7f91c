#include "cli/program.h"

#include <cstdlib>
#include <fstream>
#include <iterator>

#include <sys/wait.h>

namespace offstage::test {

namespace fs = std::filesystem;

Outcome offstage(const std::string& args, const fs::path& folder, const std::string& before) {
  const TemporaryFolder talk;
  // Redirections of the caller come later and take precedence.
  const std::string command = "cd '" + folder.string() + "' && export XDG_CACHE_HOME='" +
                              (talk / "cache").string() + "' && " + before +
                              " '" OFFSTAGE_BINARY_DIR "/offstage' >'" + (talk / "out").string() + "' 2>'" +
                              (talk / "err").string() + "' </dev/null " + args;
  const int status = std::system(command.c_str());
  return {.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1,
          .out = read_file(talk / "out"),
          .err = read_file(talk / "err")};
}

std::string read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

void write_file(const fs::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

std::map<std::string, std::string> contents(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file()) files[fs::relative(entry.path(), folder).string()] = read_file(entry.path());
  return files;
}

TemporaryFolder::TemporaryFolder() {
  std::string pattern = (fs::temp_directory_path() / "offstage-XXXXXX").string();
  path_ = mkdtemp(pattern.data());
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

std::string tiny_scene() {
  return OFFSTAGE_SOURCE_DIR "/tests/data/tiny.json";
}

}  // namespace offstage::test
