#pragma once
/// Writes files so that a file under its final name is always complete. A file has a unique temporary name
/// until it is flushed to the disk; then it is renamed. All outputs are written in this way.

#include <filesystem>
#include <span>
#include <string>

#include "render/file_io.h"

namespace offstage::render {

/// An unfinished file. It is locked while its process runs, so that another process can distinguish it from a
/// leftover.
class OutputFile {
 public:
  /// Creates the temporary file ".offstage-XXXXXX.part" beside `target` (O_EXCL, random name). Throws
  /// FileError if this fails, or if `target` is a symbolic link, because outputs do not follow links.
  explicit OutputFile(const std::filesystem::path& target);
  /// Removes the temporary file unless it was committed.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  int fd() const { return file_.fd(); }
  const std::filesystem::path& path() const { return path_; }  ///< path of the temporary file
  /// Appends bytes. Throws FileError.
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

/// Removes the temporary files in a folder whose processes do not run any more; returns their number.
int remove_leftovers(const std::filesystem::path& folder);

}  // namespace offstage::render
