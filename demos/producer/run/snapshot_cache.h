#pragma once
/// A cache: a folder with the snapshots of one simulation. Each run writes its snapshots to a new folder in
/// the cache, a generation, and publishes it when it is complete. A reader keeps using the generation that it
/// opened.

#include <filesystem>
#include <string>
#include <string_view>

#include "producer/build/snapshot.h"
#include "render/file_io.h"

namespace offstage::producer {

class SnapshotCache {
 public:
  /// Version of the folder's layout and of the snapshots in it. Folders of other versions are refused
  /// (docs/cache.md).
  static constexpr int kFormat = 4;
  /// This file names the published generation and its simulation.
  static constexpr const char* kFile = "cache.json";
  /// Prefix of the names of folders with snapshots.
  static constexpr std::string_view kGenerationPrefix = "generation-";
  /// Returns the file name of the snapshot of a frame, such as "000012.snap".
  static std::string file_name(int frame);

  explicit SnapshotCache(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// Begins a generation for the simulation identified by `key`. Throws FileError if the folder already
  /// contains a cache (unless `force`) or other files.
  void create(const std::string& key, int frames, bool force);
  /// Opens the published generation for reading. Throws FileError if the folder contains no cache, an
  /// unfinished one, or one of another simulation.
  void open(const std::string& key, int frames);
  /// Returns whether open() would succeed.
  bool holds(const std::string& key, int frames) const;
  /// Publishes the generation by a single rename. Removes old generations that no process reads or writes.
  void publish();
  /// Removes the generation that was begun.
  void discard();
  /// Removes the generations that are not published and that no process holds.
  void remove_unused_generations() const { remove_old_generations(); }

  /// write() adds a snapshot to the generation that was begun, and returns its size [bytes]. read() returns
  /// the snapshot of a frame from the generation that was opened. Both throw FileError; read() also throws it
  /// for a snapshot of another run.
  uint64_t write(const Snapshot& snapshot) const;
  Snapshot read(int frame) const;

 private:
  std::filesystem::path file(int frame) const;
  void remove_old_generations() const;

  std::filesystem::path folder_, generation_;
  std::string key_;
  int frames_ = 0;
  render::Descriptor hold_;  // a lock on the generation's folder while it is in use
};

}  // namespace offstage::producer
