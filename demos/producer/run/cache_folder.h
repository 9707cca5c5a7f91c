#pragma once
/// Folders of snapshots as a user looks after them, without the scene that they were made of: what is in a
/// folder, whether it is whole, and how it is emptied. The format is described in docs/cache.md.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "producer/build/snapshot.h"

namespace offstage::producer {

struct CacheInfo {
  std::filesystem::path folder;
  int format = 0;          ///< version of the format; 0: there is no readable cache.json
  int frames = 0;          ///< of the film
  std::string key;         ///< of the simulation
  std::string generation;  ///< name of the published generation's folder
  uint64_t bytes = 0;      ///< on the disk, of everything in the folder
  std::string problem;     ///< why it cannot be used; empty: it can
};

/// What is known of a cache without reading its snapshots. Throws FileError for a folder that is no cache.
CacheInfo read_cache_info(const std::filesystem::path& folder);

/// The caches in a folder: itself, or those directly below it, by name.
std::vector<CacheInfo> find_caches(const std::filesystem::path& folder);

/// The snapshot of a frame of the published generation, checked. Throws FileError.
Snapshot read_cached_snapshot(const std::filesystem::path& folder, int frame);

/// Reads every snapshot; returns one line for each that is missing or damaged, at most `most` of them.
std::vector<std::string> verify_cache(const CacheInfo& info, std::size_t most = 20);

/// Removes the files of a cache, and its folder if nothing else is in it; returns the bytes that became free.
/// A generation that a process reads or writes stays: then `problem` names it. Throws FileError for a folder
/// that is no cache.
uint64_t clear_cache(const std::filesystem::path& folder, std::string& problem);

}  // namespace offstage::producer
