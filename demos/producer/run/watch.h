#pragma once
/// The files a scene is made of, and noticing when one of them changes.

#include <chrono>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace offstage::producer {

/// Every file that a scene file names, directly or through what it names: includes, models and their parts,
/// textures; and those that `overrides` name. Takes names for files rather than too few, also of files that
/// are missing or broken: they are about to be mended.
std::set<std::filesystem::path> files_of_scene(const std::filesystem::path& scene,
                                               const std::vector<std::string>& overrides);

/// A hash of what files hold; the same when one was only touched.
std::string contents_hash(const std::set<std::filesystem::path>& files);

/// Sees changes by comparing times and sizes; the system's notifications (inotify) only tell it sooner, so
/// file systems that send none are watched as well.
class FileWatch {
 public:
  enum class Method { notified, polling };

  explicit FileWatch(std::set<std::filesystem::path> files, Method method = Method::notified);
  ~FileWatch();
  FileWatch(const FileWatch&) = delete;
  FileWatch& operator=(const FileWatch&) = delete;

  /// Whether a file is not as it was at the construction, or has come or gone.
  bool changed() const;
  /// Waits so long, or until something happens in a folder of the files, or a signal arrives.
  void wait(std::chrono::milliseconds limit);
  /// Waits until the files have kept still so long; an editor may write a file in several steps.
  void settle(std::chrono::milliseconds still);

  Method method() const { return fd_ < 0 ? Method::polling : Method::notified; }

 private:
  using Stamps = std::map<std::filesystem::path, std::string>;
  Stamps stamps() const;

  std::set<std::filesystem::path> files_;
  Stamps first_;
  int fd_ = -1;  // of inotify
};

}  // namespace offstage::producer
