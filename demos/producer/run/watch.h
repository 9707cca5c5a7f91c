#pragma once
/// Finds the files of a scene, and detects when they change.

#include <chrono>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace offstage::producer {

/// Returns all files that a scene file or `overrides` name, directly or indirectly: includes, models and
/// their parts, and textures. If it is uncertain whether a text is a file name, the text is included. Missing
/// or damaged files are included, too, because they may be repaired later.
std::set<std::filesystem::path> files_of_scene(const std::filesystem::path& scene,
                                               const std::vector<std::string>& overrides);

/// Returns a hash of the contents of files. Times of files do not affect it.
std::string contents_hash(const std::set<std::filesystem::path>& files);

/// Detects changes by comparing times and sizes. The system's notifications (inotify) only make this faster,
/// so file systems without them are supported, too.
class FileWatch {
 public:
  enum class Method { notified, polling };

  explicit FileWatch(std::set<std::filesystem::path> files, Method method = Method::notified);
  ~FileWatch();
  FileWatch(const FileWatch&) = delete;
  FileWatch& operator=(const FileWatch&) = delete;

  /// Returns whether a file has changed, or was created or removed, since the construction of this object.
  bool changed() const;
  /// Waits for at most `limit`. Returns earlier if something changes in the folder of one of the files, or if
  /// a signal arrives.
  void wait(std::chrono::milliseconds limit);
  /// Waits until the files have not changed for the duration `still`, because an editor may write a file in
  /// several steps.
  void settle(std::chrono::milliseconds still);

  Method method() const { return fd_ < 0 ? Method::polling : Method::notified; }

 private:
  using Stamps = std::map<std::filesystem::path, std::string>;
  Stamps stamps() const;

  std::set<std::filesystem::path> files_;
  Stamps first_;
  int fd_ = -1;  // descriptor of inotify
};

}  // namespace offstage::producer
