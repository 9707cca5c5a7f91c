#pragma once
/// Lists, verifies and clears caches, which are folders with snapshots. The scene is not needed for this.
/// docs/cache.md describes the format of a cache.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "producer/build/snapshot.h"

namespace offstage::producer {

struct CacheInfo {
  std::filesystem::path folder;
  int format = 0;          ///< version of the format; 0: cache.json cannot be read
  int frames = 0;          ///< number of frames of the film
  std::string key;         ///< key of the simulation
  std::string generation;  ///< folder name of the published generation
  uint64_t bytes = 0;      ///< size of the whole folder on the disk
  std::string problem;     ///< reason why the cache cannot be used; empty if it can
};

/// Returns the information about a cache, without reading its snapshots. Throws FileError if the folder is
/// not a cache.
CacheInfo read_cache_info(const std::filesystem::path& folder);

/// Returns the folder itself if it is a cache, otherwise the caches directly below it, ordered by name.
std::vector<CacheInfo> find_caches(const std::filesystem::path& folder);

/// Reads and checks the snapshot of a frame in the published generation. Throws FileError if the snapshot is
/// missing or damaged.
Snapshot read_cached_snapshot(const std::filesystem::path& folder, int frame);

/// Reads every snapshot of a cache. Returns one line for each snapshot that is missing or damaged, at most
/// `most` lines.
std::vector<std::string> verify_cache(const CacheInfo& info, std::size_t most = 20);

/// Removes the files of a cache, and its folder if it is then empty. Returns the number of freed bytes. Keeps
/// a generation that a process uses, and sets `problem` to a message about it. Throws FileError if the folder
/// is not a cache.
uint64_t clear_cache(const std::filesystem::path& folder, std::string& problem);

}  // namespace offstage::producer
