#pragma once
/// Management of folders with snapshots, without the scene: listing, verifying, clearing. docs/cache.md
/// describes the format.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "producer/build/snapshot.h"

namespace offstage::producer {

struct CacheInfo {
  std::filesystem::path folder;
  int format = 0;          ///< version of the format; 0: there is no readable cache.json
  int frames = 0;          ///< number of frames of the film
  std::string key;         ///< key of the simulation
  std::string generation;  ///< name of the published generation's folder
  uint64_t bytes = 0;      ///< size of the whole folder on the disk
  std::string problem;     ///< reason why the cache cannot be used; empty if it can
};

/// Returns the information about a cache, without reading its snapshots. Throws FileError if the folder is
/// not a cache.
CacheInfo read_cache_info(const std::filesystem::path& folder);

/// Returns the caches in a folder, ordered by name: the folder itself, or those directly below it.
std::vector<CacheInfo> find_caches(const std::filesystem::path& folder);

/// Reads and checks the snapshot of a frame in the published generation. Throws FileError.
Snapshot read_cached_snapshot(const std::filesystem::path& folder, int frame);

/// Reads every snapshot. Returns one line for each missing or damaged one, at most `most` lines.
std::vector<std::string> verify_cache(const CacheInfo& info, std::size_t most = 20);

/// Removes the files of a cache, and its folder if it is then empty. Returns the number of freed bytes. A
/// generation in use by a process is kept, and `problem` names it. Throws FileError if the folder is not a
/// cache.
uint64_t clear_cache(const std::filesystem::path& folder, std::string& problem);

}  // namespace offstage::producer
