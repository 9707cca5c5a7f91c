#pragma once
/// The files of a scene, and detection of their changes.

#include <chrono>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace offstage::producer {

/// Returns all files that a scene file names, directly or indirectly: includes, models and their parts,
/// textures; and the files named by `overrides`. A text that may or may not be a file name is included.
/// Missing or damaged files are included, too, because they may be repaired.
std::set<std::filesystem::path> files_of_scene(const std::filesystem::path& scene,
                                               const std::vector<std::string>& overrides);

/// Hash of the contents of files; it does not change if a file is only touched.
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

  /// Whether a file has changed since the construction, or was created or removed.
  bool changed() const;
  /// Waits for `limit` at most; less if something happens in a folder that contains one of the files, or if a
  /// signal arrives.
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
