#include "producer/run/snapshot_cache.h"

#include <algorithm>
#include <cctype>

#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/file.h>

#include "producer/base/json_file.h"
#include "producer/base/packed_file.h"
#include "producer/base/version.h"
#include "render/error.h"
#include "render/image_io.h"
#include "render/output_file.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kGenerationPrefix = SnapshotCache::kGenerationPrefix;

render::Descriptor open_folder(const fs::path& folder) {
  return render::Descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
}

/// Returns the file name of a snapshot, such as "000012.snap".
bool is_snapshot_name(const std::string& name) {
  constexpr std::string_view kEnding = ".snap";
  return name.size() > kEnding.size() && name.ends_with(kEnding) &&
         std::all_of(name.begin(), name.end() - kEnding.size(),
                     [](unsigned char c) { return std::isdigit(c); });
}

void remove_snapshots(const fs::path& folder) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (is_snapshot_name(entry.path().filename().string())) fs::remove(entry.path(), error);
}

std::vector<fs::path> generations_in(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().filename().string().starts_with(kGenerationPrefix) &&
        fs::is_directory(entry.symlink_status(error)))
      found.push_back(entry.path());
  return found;
}

}  // namespace

void SnapshotCache::create(const std::string& key, int frames, bool force) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) throw render::FileError(folder_.string() + ": " + error.message());
  const bool occupied = fs::exists(folder_ / kFile, error);
  if (occupied && !force)
    throw render::FileError(folder_.string() + ": already contains a cache; replace it with --force");
  if (!occupied && !fs::is_empty(folder_, error) && generations_in(folder_).empty())
    throw render::FileError(folder_.string() + ": is not empty and is not a cache; choose an empty folder");
  remove_old_generations();
  std::string name = (folder_ / (std::string(kGenerationPrefix) + "XXXXXX")).string();
  if (::mkdtemp(name.data()) == nullptr) render::throw_file_error(folder_, "cannot create a folder");
  generation_ = name;
  // mkdtemp() gives permissions only to the owner.
  fs::permissions(generation_, fs::status(folder_, error).permissions(), error);
  hold_ = open_folder(generation_);
  ::flock(hold_.fd(), LOCK_EX | LOCK_NB);
  key_ = key;
  frames_ = frames;
}

void SnapshotCache::open(const std::string& key, int frames) {
  const fs::path path = folder_ / kFile;
  const auto refuse = [&](const std::string& what) {
    throw render::FileError(folder_.string() + ": " + what);
  };
  constexpr int kTries = 10;  // opened again if a writer publishes the next generation meanwhile
  for (int i = 0; i < kTries; ++i) {
    const std::optional<JsonObject> published = read_json_file(path);
    if (!published && !generations_in(folder_).empty())
      refuse("the simulation of this cache did not finish; simulate again");
    if (!published)
      refuse("contains no cache; create one with: offstage simulate SCENE --cache " + folder_.string());
    if (published->count("offstage_cache", 0, kMostFrames) != kFormat)
      refuse("is a cache of another version; simulate again with --force");
    const std::string program = published->text("program");
    if (published->text("key") != key && !program.empty() && program != version())
      refuse(fmt::format("the cache was made by offstage {}, and this is {}; simulate again with --force",
                         program, version()));
    if (published->text("key") != key || published->count("frames", 0, kMostFrames) != frames)
      refuse("the cache was made with another scene or other settings; simulate again with --force");
    const std::string name = published->text("generation");
    if (!name.starts_with(kGenerationPrefix) || name.find('/') != std::string::npos)
      published->refuse("generation", "the name of a generation's folder");
    generation_ = folder_ / name;
    hold_ = open_folder(generation_);
    key_ = key;
    frames_ = frames;
    if (hold_ && ::flock(hold_.fd(), LOCK_SH | LOCK_NB) == 0 && fs::exists(generation_)) return;
  }
  refuse("its snapshots were deleted; simulate again with --force");
}

bool SnapshotCache::holds(const std::string& key, int frames) const {
  try {
    SnapshotCache(folder_).open(key, frames);
    return true;
  } catch (const render::FileError&) {
    return false;
  }
}

void SnapshotCache::discard() {
  generation_.clear();
  hold_ = {};
  remove_old_generations();
}

void SnapshotCache::publish() {
  const nlohmann::ordered_json published = {{"offstage_cache", kFormat},
                                            {"program", std::string(version())},
                                            {"key", key_},
                                            {"frames", frames_},
                                            {"generation", generation_.filename().string()}};
  const std::string text = published.dump(2) + "\n";
  render::write_file_atomically(folder_ / kFile,
                                {reinterpret_cast<const uint8_t*>(text.data()), text.size()});
  remove_old_generations();
}

/// Removes the generations that no process uses, except the published generation and `generation_`.
void SnapshotCache::remove_old_generations() const {
  const std::optional<JsonObject> published = read_json_file(folder_ / kFile);
  const std::string kept = published ? published->text("generation") : "";
  std::error_code error;
  for (const fs::path& folder : generations_in(folder_)) {
    if (folder.filename() == kept || folder == generation_) continue;
    const render::Descriptor hold = open_folder(folder);
    if (!hold || ::flock(hold.fd(), LOCK_EX | LOCK_NB) != 0) continue;
    remove_snapshots(folder);
    render::remove_leftovers(folder);
    fs::remove(folder, error);
  }
}

fs::path SnapshotCache::file(int frame) const {
  return generation_ / file_name(frame);
}

std::string SnapshotCache::file_name(int frame) {
  return fmt::format("{:06}.snap", frame);
}

uint64_t SnapshotCache::write(const Snapshot& snapshot) const {
  const auto bytes = serialize(snapshot, key_);
  render::write_file_atomically(file(snapshot.frame), bytes);
  return bytes.size();
}

Snapshot SnapshotCache::read(int frame) const {
  const fs::path path = file(frame);
  Snapshot snapshot = deserialize(read_file(path), path.string(), key_);
  if (snapshot.frame != frame)
    throw render::FileError(
        fmt::format("{}: contains frame {} instead of {}", path.string(), snapshot.frame, frame));
  return snapshot;
}

}  // namespace offstage::producer
