#include "producer/run/cache_folder.h"

#include <algorithm>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>

#include "producer/base/json_file.h"
#include "producer/base/packed_file.h"
#include "producer/run/snapshot_cache.h"
#include "render/error.h"
#include "render/output_file.h"

namespace offstage::producer {
namespace {

namespace fs = std::filesystem;

bool is_cache(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder / SnapshotCache::kFile, error)) return true;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().filename().string().starts_with(SnapshotCache::kGenerationPrefix)) return true;
  return false;
}

uint64_t bytes_in(const fs::path& folder) {
  uint64_t bytes = 0;
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(folder, error)) {
    const fs::file_status status = entry.symlink_status(error);
    if (fs::is_regular_file(status)) bytes += entry.file_size(error);
  }
  return bytes;
}

fs::path snapshot_file(const CacheInfo& info, int frame) {
  return info.folder / info.generation / SnapshotCache::file_name(frame);
}

}  // namespace

CacheInfo read_cache_info(const fs::path& folder) {
  if (!is_cache(folder))
    throw render::FileError(
        folder.string() +
        ": is not a cache of snapshots; `offstage simulate SCENE --cache FOLDER` writes one");
  CacheInfo info{.folder = folder, .bytes = bytes_in(folder)};
  const std::optional<JsonObject> published = read_json_file(folder / SnapshotCache::kFile);
  if (!published) {
    info.problem = "its simulation did not finish; simulate again with --force";
    return info;
  }
  info.format = published->count("offstage_cache", 0, kMostFrames);
  if (info.format != SnapshotCache::kFormat) {
    info.problem = fmt::format(
        "format {} of another version of the program; this one reads format {}; simulate again with --force",
        info.format, SnapshotCache::kFormat);
    return info;
  }
  info.frames = published->count("frames", 0, kMostFrames);
  info.key = published->text("key");
  info.generation = published->text("generation");
  if (!info.generation.starts_with(SnapshotCache::kGenerationPrefix) ||
      info.generation.find('/') != std::string::npos)
    published->refuse("generation", "the name of a generation's folder");
  std::error_code error;
  if (!fs::is_directory(folder / info.generation, error))
    info.problem = "its snapshots were deleted; simulate again with --force";
  return info;
}

std::vector<CacheInfo> find_caches(const fs::path& folder) {
  if (is_cache(folder)) return {read_cache_info(folder)};
  std::vector<fs::path> folders;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (fs::is_directory(entry.symlink_status(error)) && is_cache(entry.path()))
      folders.push_back(entry.path());
  if (error) throw render::FileError(folder.string() + ": " + error.message());
  std::ranges::sort(folders);
  std::vector<CacheInfo> caches;
  for (const fs::path& path : folders) caches.push_back(read_cache_info(path));
  return caches;
}

Snapshot read_cached_snapshot(const fs::path& folder, int frame) {
  const CacheInfo info = read_cache_info(folder);
  if (!info.problem.empty()) throw render::FileError(folder.string() + ": " + info.problem);
  if (frame < 1 || frame > info.frames)
    throw render::FileError(fmt::format("{}: has frames 1-{}, not {}", folder.string(), info.frames, frame));
  const fs::path path = snapshot_file(info, frame);
  Snapshot snapshot = deserialize(read_file(path), path.string(), info.key);
  if (snapshot.frame != frame)
    throw render::FileError(
        fmt::format("{}: contains frame {} instead of {}", path.string(), snapshot.frame, frame));
  return snapshot;
}

std::vector<std::string> verify_cache(const CacheInfo& info, std::size_t most) {
  if (!info.problem.empty()) return {info.problem};
  std::vector<std::string> problems;
  for (int frame = 1; frame <= info.frames && problems.size() < most; ++frame) {
    try {
      read_cached_snapshot(info.folder, frame);
    } catch (const render::FileError& error) {
      problems.push_back(error.what());
    }
  }
  return problems;
}

uint64_t clear_cache(const fs::path& folder, std::string& problem) {
  if (!is_cache(folder))
    throw render::FileError(
        folder.string() +
        ": is not a cache of snapshots; `offstage simulate SCENE --cache FOLDER` writes one");
  const uint64_t before = bytes_in(folder);
  std::error_code error;
  // removed first, so that no further process opens the cache
  fs::remove(folder / SnapshotCache::kFile, error);
  SnapshotCache(folder).remove_unused_generations();
  render::remove_leftovers(folder);
  for (const auto& entry : fs::directory_iterator(folder, error))
    if (entry.path().filename().string().starts_with(SnapshotCache::kGenerationPrefix))
      problem = entry.path().string() + " is in use by another process and stays";
  if (problem.empty() && fs::is_empty(folder, error)) fs::remove(folder, error);
  const uint64_t after = fs::exists(folder, error) ? bytes_in(folder) : 0;
  return before - std::min(before, after);
}

}  // namespace offstage::producer
