#pragma once
/// Temporary storage on the disk for bytes that are produced frame by frame and are needed together at the
/// end.

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "render/output_file.h"

namespace offstage::producer {

/// An unnamed temporary file. append() and copy_to() throw render::FileError.
class Spool {
 public:
  /// Creates the file in `folder`, the folder of the output, because the system's temporary folder may be
  /// small. Throws render::FileError.
  explicit Spool(const std::filesystem::path& folder);

  void append(std::span<const uint8_t> bytes);
  void append(std::string_view text) { append({reinterpret_cast<const uint8_t*>(text.data()), text.size()}); }
  /// Returns the number of appended bytes.
  uint64_t size() const { return size_; }
  /// Appends all bytes of this file to another file.
  void copy_to(render::OutputFile& file);

 private:
  void flush();

  std::filesystem::path folder_;
  render::Descriptor file_;
  std::vector<uint8_t> buffer_;
  uint64_t size_ = 0;
};

}  // namespace offstage::producer
