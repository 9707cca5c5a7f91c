#pragma once
/// Binary files written by offstage, compressed and with a checksum: a header with a magic word and a format
/// version, then the zstd-compressed payload. Files that are damaged, cut short, or of another kind or
/// version are detected.

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

#include "render/error.h"

namespace offstage::producer {

/// Kind of a file: its magic word of at most eight characters, the format version that is read and written,
/// and the name of the kind in messages.
struct FileKind {
  std::string_view magic;
  uint32_t version;
  std::string_view name;
};

/// Returns the bytes of a file: the header and the compressed payload.
std::vector<uint8_t> pack(const FileKind& kind, std::span<const uint8_t> payload);
/// Returns the decompressed payload of a file's bytes. Throws render::FileError, which names the file
/// `source`.
std::vector<uint8_t> unpack(const FileKind& kind, std::span<const uint8_t> bytes, const std::string& source);

/// Returns the bytes of a whole file. Throws render::FileError.
std::vector<uint8_t> read_file(const std::filesystem::path& path);

/// Appends numbers and vectors in the machine's byte order.
class ByteWriter {
 public:
  template <class T>
  requires std::is_arithmetic_v<T>
  void put(T value) {
    const auto* bytes = reinterpret_cast<const uint8_t*>(&value);
    bytes_.insert(bytes_.end(), bytes, bytes + sizeof value);
  }
  template <class Scalar, int N>
  void put(const Eigen::Matrix<Scalar, N, 1>& v) {
    for (int i = 0; i < N; ++i) put(v[i]);
  }
  const std::vector<uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<uint8_t> bytes_;
};

/// Reads numbers and vectors that a ByteWriter has appended. Throws render::FileError, which names the file
/// `source`, if the data end too early.
class ByteReader {
 public:
  ByteReader(std::span<const uint8_t> bytes, const std::string& source) : bytes_(bytes), source_(source) {}

  template <class T>
  requires std::is_arithmetic_v<T> T take() {
    if (bytes_.size() < sizeof(T))
      throw render::FileError(source_ + ": damaged: the file ends too early; create it again");
    T value;
    std::memcpy(&value, bytes_.data(), sizeof value);
    bytes_ = bytes_.subspan(sizeof value);
    return value;
  }
  template <class V>
  requires(!std::is_arithmetic_v<V>) V take() {
    V v;
    for (int i = 0; i < V::SizeAtCompileTime; ++i) v[i] = take<typename V::Scalar>();
    return v;
  }
  /// Reads the number of records that follow. Each record has at least `record_size` bytes. Throws
  /// render::FileError if the remaining data are too short, so that the caller never allocates too much
  /// memory.
  std::size_t take_count(std::size_t record_size) {
    const auto n = take<uint64_t>();
    if (n > bytes_.size() / record_size)
      throw render::FileError(source_ + ": damaged: a list is longer than the file; create it again");
    return n;
  }
  /// Throws render::FileError unless all data were read.
  void expect_end() const {
    if (!bytes_.empty())
      throw render::FileError(source_ + ": damaged: bytes follow its end; create it again");
  }

 private:
  std::span<const uint8_t> bytes_;
  const std::string& source_;
};

}  // namespace offstage::producer
