#pragma once
/// Bytes that are produced frame by frame and needed in one piece at the end: a file without a name.

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "render/output_file.h"

namespace offstage::producer {

class Spool {
 public:
  /// The file is made in `folder`, where the output goes, because a temporary folder may be small. Throws
  /// render::FileError.
  explicit Spool(const std::filesystem::path& folder);

  void append(std::span<const uint8_t> bytes);
  void append(std::string_view text) { append({reinterpret_cast<const uint8_t*>(text.data()), text.size()}); }
  uint64_t size() const { return size_; }
  /// Everything so far, to the end of another file.
  void copy_to(render::OutputFile& file);

 private:
  void flush();

  std::filesystem::path folder_;
  render::Descriptor file_;
  std::vector<uint8_t> buffer_;
  uint64_t size_ = 0;
};

}  // namespace offstage::producer
