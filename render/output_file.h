#pragma once
/// The one way in which a file is written: under a temporary name of its own, flushed to the disk, then
/// renamed. Whoever sees the final name sees a whole file.

#include <filesystem>
#include <span>
#include <string>

#include "render/file_io.h"

namespace offstage::render {

/// A file in the making. It is locked while its process lives, so that another process can tell a live one
/// from a leftover.
class OutputFile {
 public:
  /// Makes the temporary file ".offstage-XXXXXX.part" beside `target` (O_EXCL, a random name). Throws
  /// FileError if that fails, or if `target` is a symbolic link: outputs do not follow links.
  explicit OutputFile(const std::filesystem::path& target);
  /// Removes the temporary file unless it was committed.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  int fd() const { return file_.fd(); }
  const std::filesystem::path& path() const { return path_; }  ///< of the temporary file
  /// Throws FileError.
  void write(std::span<const uint8_t> bytes);
  /// Flushes to the disk and renames to the target, or to `other` in the same folder. Throws FileError.
  void commit() { commit_as(target_); }
  void commit_as(const std::filesystem::path& other);

 private:
  std::filesystem::path target_, path_;
  Descriptor file_;
  bool renamed_ = false;
};

/// Throws FileError if `path` is a symbolic link.
void refuse_link(const std::filesystem::path& path);

/// Removes the temporary files in a folder that processes left behind that live no more; returns how many.
int remove_leftovers(const std::filesystem::path& folder);

}  // namespace offstage::render
