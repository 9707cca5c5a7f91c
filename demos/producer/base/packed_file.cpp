#include "producer/base/packed_file.h"

#include <algorithm>

#include <fmt/format.h>
#include <xxhash.h>
#include <zstd.h>

#include "render/file_io.h"

namespace offstage::producer {
namespace {

constexpr uint64_t kMaxPayload = uint64_t{1} << 32;

struct Header {
  char magic[8];
  uint32_t version;
  uint32_t reserved;
  uint64_t payload_size;  // uncompressed
  uint64_t checksum;      // checksum of the uncompressed payload
};
static_assert(sizeof(Header) == 32);

}  // namespace

std::vector<uint8_t> pack(const FileKind& kind, std::span<const uint8_t> payload) {
  Header header{};
  std::copy_n(kind.magic.begin(), std::min(kind.magic.size(), sizeof header.magic), header.magic);
  header.version = kind.version;
  header.payload_size = payload.size();
  header.checksum = XXH3_64bits(payload.data(), payload.size());
  std::vector<uint8_t> bytes(sizeof header + ZSTD_compressBound(payload.size()));
  std::memcpy(bytes.data(), &header, sizeof header);
  const std::size_t packed = ZSTD_compress(bytes.data() + sizeof header, bytes.size() - sizeof header,
                                           payload.data(), payload.size(), 1);
  if (ZSTD_isError(packed)) throw render::FileError(std::string("zstd: ") + ZSTD_getErrorName(packed));
  bytes.resize(sizeof header + packed);
  return bytes;
}

std::vector<uint8_t> unpack(const FileKind& kind, std::span<const uint8_t> bytes, const std::string& source) {
  const auto refuse = [&](const std::string& why) { throw render::FileError(source + ": " + why); };
  Header header;
  if (bytes.size() < sizeof header) refuse(fmt::format("not a {}: the file is too short", kind.name));
  std::memcpy(&header, bytes.data(), sizeof header);
  Header expected{};
  std::copy_n(kind.magic.begin(), std::min(kind.magic.size(), sizeof expected.magic), expected.magic);
  if (std::memcmp(header.magic, expected.magic, sizeof header.magic) != 0)
    refuse(fmt::format("not a {}", kind.name));
  if (header.version != kind.version)
    refuse(fmt::format("{} has format {}, but this program reads format {}; create it again", kind.name,
                       header.version, kind.version));
  const std::string damaged = fmt::format("damaged {}: ", kind.name);
  if (header.payload_size > kMaxPayload) refuse(damaged + "its size is wrong; create it again");
  const auto packed = bytes.subspan(sizeof header);
  // The size in the header is not trusted unless the zstd frame has the same size.
  if (ZSTD_getFrameContentSize(packed.data(), packed.size()) != header.payload_size)
    refuse(damaged + "its size is wrong; create it again");
  std::vector<uint8_t> payload(header.payload_size);
  const std::size_t n = ZSTD_decompress(payload.data(), payload.size(), packed.data(), packed.size());
  if (ZSTD_isError(n) || n != payload.size() || XXH3_64bits(payload.data(), n) != header.checksum)
    refuse(damaged + "its checksum is wrong; create it again");
  return payload;
}

std::vector<uint8_t> read_file(const std::filesystem::path& path) {
  return render::read_file(path, kMaxPayload);
}

}  // namespace offstage::producer
