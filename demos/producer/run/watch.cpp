#include "producer/run/watch.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <sstream>
#include <thread>

#include <fmt/format.h>
#include <poll.h>
#include <sys/inotify.h>
#include <sys/stat.h>
#include <unistd.h>

#include "producer/base/error.h"
#include "producer/base/json.h"
#include "producer/build/models.h"
#include "render/mesh_io.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::milliseconds kPollingInterval{250};

/// Returns the bytes of a regular file; nothing if it cannot be read.
std::string file_bytes(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return {};
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Returns whether a text may be a file name: it must be short and have an ending that begins with a letter.
bool is_name(const std::string& text) {
  constexpr std::size_t kLongestName = 4096, kLongestEnding = 8;
  if (text.empty() || text.size() > kLongestName || text.find_first_of("\n\"*?") != std::string::npos)
    return false;
  const std::string ending = render::split_node(text).file.extension().string();
  return ending.size() > 1 && ending.size() <= kLongestEnding &&
         std::isalpha(static_cast<unsigned char>(ending[1]));
}

void collect_strings(const Node& node, std::vector<std::string>& strings) {
  if (const std::string* text = node.as<std::string>()) strings.push_back(*text);
  if (const List* list = node.as<List>())
    for (const Node& item : *list) collect_strings(item, strings);
  if (const Object* object = node.as<Object>())
    for (const Member& member : *object) collect_strings(member.value, strings);
}

/// Returns possible file names in a text that is currently not valid JSON: its pieces between quotes.
std::vector<std::string> quoted_strings(const std::string& text) {
  std::vector<std::string> strings;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream pieces(line);
    for (std::string piece; std::getline(pieces, piece, '"');) strings.push_back(piece);
  }
  return strings;
}

std::vector<std::string> strings_in_json(const std::string& text, const fs::path& file) {
  std::vector<std::string> strings;
  try {
    collect_strings(parse_json(text, file.string()), strings);
  } catch (const SceneError&) {
    return quoted_strings(text);
  }
  return strings;
}

/// Returns the file names at the ends of lines in an OBJ or MTL file.
std::vector<std::string> names_in_obj(const std::string& text) {
  std::vector<std::string> names;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("mtllib") && !line.starts_with("map_") && !line.starts_with("bump") &&
        !line.starts_with("disp") && !line.starts_with("norm"))
      continue;
    std::istringstream words(line);
    std::string last;
    for (std::string word; words >> word;) last = word;
    names.push_back(last);
  }
  return names;
}

std::vector<std::string> included_names(const fs::path& file) {
  std::string ending = file.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending == ".json" || ending == ".gltf") return strings_in_json(file_bytes(file), file);
  if (ending == ".obj" || ending == ".mtl") return names_in_obj(file_bytes(file));
  return {};
}

}  // namespace

std::set<fs::path> files_of_scene(const fs::path& scene, const std::vector<std::string>& overrides) {
  constexpr std::size_t kMostFiles = 1000;
  std::set<fs::path> files = {scene.lexically_normal()};
  std::vector<fs::path> unread = {scene.lexically_normal()};
  const auto add = [&](const std::string& name, const fs::path& folder) {
    if (!is_name(name) || files.size() >= kMostFiles) return;
    const fs::path file = render::split_node((folder / name).lexically_normal()).file;
    if (files.insert(file).second) unread.push_back(file);
  };
  for (const std::string& override : overrides)
    for (const std::string& text : strings_in_json(override.substr(override.find('=') + 1), "--set"))
      add(text, scene.parent_path());
  while (!unread.empty()) {
    const fs::path file = unread.back();
    unread.pop_back();
    // Models are named relative to the scene, even by an include; includes are named relative to their own
    // file.
    for (const std::string& name : included_names(file))
      for (const fs::path& folder : {file.parent_path(), scene.parent_path()}) add(name, folder);
  }
  return files;
}

std::string contents_hash(const std::set<fs::path>& files) {
  std::string hashes;
  for (const fs::path& file : files)
    hashes +=
        file.string() + (fs::exists(file) ? " is " + text_hash(file_bytes(file)) : " is missing") + "\n";
  return text_hash(hashes);
}

FileWatch::FileWatch(std::set<fs::path> files, Method method) : files_(std::move(files)) {
  if (method == Method::notified) fd_ = inotify_init1(IN_NONBLOCK | IN_CLOEXEC);
  if (fd_ >= 0) {
    std::set<fs::path> folders;
    for (const fs::path& file : files_) {
      folders.insert(file.has_parent_path() ? file.parent_path() : ".");
      std::error_code error;  // a link is resolved, because writing to it changes its target
      if (const fs::path real = fs::canonical(file, error); !error) folders.insert(real.parent_path());
    }
    // Folders are watched instead of files, because editors write a new file and rename it.
    constexpr uint32_t kEvents =
        IN_CLOSE_WRITE | IN_MODIFY | IN_MOVED_TO | IN_MOVED_FROM | IN_CREATE | IN_DELETE;
    for (const fs::path& folder : folders) inotify_add_watch(fd_, folder.c_str(), kEvents | IN_ONLYDIR);
  }
  first_ = stamps();
}

FileWatch::~FileWatch() {
  if (fd_ >= 0) close(fd_);
}

FileWatch::Stamps FileWatch::stamps() const {
  Stamps stamps;
  for (const fs::path& file : files_) {
    struct stat s {};
    std::string& stamp = stamps[file];
    if (stat(file.c_str(), &s) == 0)
      stamp = fmt::format("{} {} {} {}", s.st_mtim.tv_sec, s.st_mtim.tv_nsec, s.st_size, s.st_ino);
  }
  return stamps;
}

bool FileWatch::changed() const {
  return stamps() != first_;
}

void FileWatch::wait(std::chrono::milliseconds limit) {
  if (fd_ < 0) {
    std::this_thread::sleep_for(std::min(limit, kPollingInterval));
    return;
  }
  pollfd entry{fd_, POLLIN, 0};
  if (poll(&entry, 1, static_cast<int>(limit.count())) <= 0) return;
  std::array<char, 4096> events;
  while (read(fd_, events.data(), events.size()) > 0) {
  }
}

void FileWatch::settle(std::chrono::milliseconds still) {
  // A file that never stops changing is finally used in its current state.
  constexpr int kMostRounds = 50;
  Stamps last = stamps();
  for (int round = 0; round < kMostRounds; ++round) {
    std::this_thread::sleep_for(still);
    Stamps now = stamps();
    if (now == last) return;
    last = std::move(now);
  }
}

}  // namespace offstage::producer
