#include "producer/snapshot.h"

#include <cstring>
#include <fstream>
#include <iterator>
#include <type_traits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <xxhash.h>
#include <zstd.h>

#include "render/error.h"
#include "render/image_io.h"

namespace offstage::producer {
namespace {

constexpr char kMagic[8] = {'o', 'f', 'f', 's', 'n', 'a', 'p', '\0'};
constexpr uint32_t kFormatVersion = 1;
constexpr uint64_t kMaxPayload = uint64_t{1} << 34;

struct Header {
  char magic[8];
  uint32_t version;
  uint32_t reserved;
  uint64_t payload_size;  // uncompressed
  uint64_t checksum;      // of the uncompressed payload
};
static_assert(sizeof(Header) == 32);

class Writer {
 public:
  template <class T>
  void put(const T& value) {
    static_assert(std::is_arithmetic_v<T>);
    const auto* bytes = reinterpret_cast<const uint8_t*>(&value);
    bytes_.insert(bytes_.end(), bytes, bytes + sizeof value);
  }
  void put(const Eigen::Vector3f& v) { put(v.x()), put(v.y()), put(v.z()); }
  const std::vector<uint8_t>& bytes() const { return bytes_; }

 private:
  std::vector<uint8_t> bytes_;
};

class Reader {
 public:
  Reader(std::span<const uint8_t> bytes, const std::string& source) : bytes_(bytes), source_(source) {}

  template <class T>
  T take() {
    if (bytes_.size() < sizeof(T)) throw render::FileError(source_ + ": damaged snapshot (too short)");
    T value;
    std::memcpy(&value, bytes_.data(), sizeof value);
    bytes_ = bytes_.subspan(sizeof value);
    return value;
  }
  Eigen::Vector3f take_vector() {
    const auto x = take<float>(), y = take<float>(), z = take<float>();
    return {x, y, z};
  }
  /// A count of records of at least `record_size` bytes; a wrong one must not make us allocate the machine
  /// away.
  std::size_t take_count(std::size_t record_size) {
    const auto n = take<uint64_t>();
    if (n > bytes_.size() / record_size) throw render::FileError(source_ + ": damaged snapshot (bad count)");
    return n;
  }
  bool at_end() const { return bytes_.empty(); }

 private:
  std::span<const uint8_t> bytes_;
  const std::string& source_;
};

std::vector<uint8_t> read_file(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw render::FileError(path.string() + ": cannot read the file");
  return {std::istreambuf_iterator<char>(in), {}};
}

constexpr std::size_t kBodyBytes = 7 * sizeof(float);
constexpr std::size_t kSpringBytes = 6 * sizeof(float);
constexpr std::size_t kPointBytes = 12 * sizeof(float) + sizeof(uint64_t);

void write_manifest(const std::filesystem::path& folder, const std::string& key, int frames, bool complete) {
  const nlohmann::ordered_json manifest = {
      {"offstage_cache", kFormatVersion}, {"key", key}, {"frames", frames}, {"complete", complete}};
  const std::string text = manifest.dump(2) + "\n";
  render::write_file_atomically(folder / "cache.json",
                                {reinterpret_cast<const uint8_t*>(text.data()), text.size()});
}

}  // namespace

uint64_t Snapshot::point_count() const {
  uint64_t n = 0;
  for (const PointSet& set : point_sets) n += set.points.size();
  return n;
}

std::vector<uint8_t> serialize(const Snapshot& snapshot) {
  Writer out;
  out.put(snapshot.frame);
  out.put(snapshot.time);
  out.put(snapshot.state_hash.low);
  out.put(snapshot.state_hash.high);
  out.put(uint64_t{snapshot.bodies.size()});
  for (const BodySample& b : snapshot.bodies) {
    out.put(b.position);
    out.put(b.orientation.w());
    out.put(Eigen::Vector3f(b.orientation.vec()));
  }
  out.put(uint64_t{snapshot.springs.size()});
  for (const SpringSample& s : snapshot.springs) out.put(s.a), out.put(s.b);
  out.put(uint64_t{snapshot.point_sets.size()});
  for (const PointSet& set : snapshot.point_sets) {
    out.put(uint64_t{set.points.size()});
    for (std::size_t i = 0; i < set.points.size(); ++i) {
      const render::Point& p = set.points[i];
      out.put(p.position);
      out.put(p.velocity);
      out.put(p.radius);
      for (int c = 0; c < 4; ++c) out.put(p.color[c]);
      out.put(set.ages[i]);
      out.put(p.id);
    }
  }

  const std::vector<uint8_t>& payload = out.bytes();
  Header header{};
  std::memcpy(header.magic, kMagic, sizeof kMagic);
  header.version = kFormatVersion;
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

Snapshot deserialize(std::span<const uint8_t> bytes, const std::string& source) {
  Header header;
  if (bytes.size() < sizeof header) throw render::FileError(source + ": not a snapshot (too short)");
  std::memcpy(&header, bytes.data(), sizeof header);
  if (std::memcmp(header.magic, kMagic, sizeof kMagic) != 0)
    throw render::FileError(source + ": not a snapshot");
  if (header.version != kFormatVersion)
    throw render::FileError(fmt::format("{}: snapshot format {}, this program reads {}; simulate again",
                                        source, header.version, kFormatVersion));
  if (header.payload_size > kMaxPayload) throw render::FileError(source + ": damaged snapshot (size)");
  const auto packed = bytes.subspan(sizeof header);
  // The header's size is not trusted before the frame agrees with it.
  if (ZSTD_getFrameContentSize(packed.data(), packed.size()) != header.payload_size)
    throw render::FileError(source + ": damaged snapshot (size)");
  std::vector<uint8_t> payload(header.payload_size);
  const std::size_t n = ZSTD_decompress(payload.data(), payload.size(), packed.data(), packed.size());
  if (ZSTD_isError(n) || n != payload.size() || XXH3_64bits(payload.data(), n) != header.checksum)
    throw render::FileError(source + ": damaged snapshot (checksum)");

  Reader in(payload, source);
  Snapshot snapshot;
  snapshot.frame = in.take<int>();
  snapshot.time = in.take<double>();
  snapshot.state_hash.low = in.take<uint64_t>();
  snapshot.state_hash.high = in.take<uint64_t>();
  snapshot.bodies.resize(in.take_count(kBodyBytes));
  for (BodySample& b : snapshot.bodies) {
    b.position = in.take_vector();
    const auto w = in.take<float>();
    const Eigen::Vector3f v = in.take_vector();
    b.orientation = {w, v.x(), v.y(), v.z()};
  }
  snapshot.springs.resize(in.take_count(kSpringBytes));
  for (SpringSample& s : snapshot.springs) s = {in.take_vector(), in.take_vector()};
  snapshot.point_sets.resize(in.take_count(sizeof(uint64_t)));
  for (PointSet& set : snapshot.point_sets) {
    set.points.resize(in.take_count(kPointBytes));
    set.ages.resize(set.points.size());
    for (std::size_t i = 0; i < set.points.size(); ++i) {
      render::Point& p = set.points[i];
      p.position = in.take_vector();
      p.velocity = in.take_vector();
      p.radius = in.take<float>();
      for (int c = 0; c < 4; ++c) p.color[c] = in.take<float>();
      set.ages[i] = in.take<float>();
      p.id = in.take<uint64_t>();
    }
  }
  if (!in.at_end()) throw render::FileError(source + ": damaged snapshot (trailing bytes)");
  return snapshot;
}

std::filesystem::path SnapshotCache::file(int frame) const {
  return folder_ / fmt::format("{:06}.snap", frame);
}

void SnapshotCache::create(const std::string& key, int frames, bool force) const {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) throw render::FileError(folder_.string() + ": " + error.message());
  const bool occupied = std::filesystem::exists(folder_ / "cache.json");
  if (occupied && !force)
    throw render::FileError(folder_.string() + ": holds a cache already; --force replaces it");
  if (!occupied && !std::filesystem::is_empty(folder_))
    throw render::FileError(folder_.string() + ": is not empty and holds no cache; give a folder of its own");
  for (const auto& entry : std::filesystem::directory_iterator(folder_))
    if (entry.path().extension() == ".snap") std::filesystem::remove(entry.path());
  write_manifest(folder_, key, frames, false);
}

void SnapshotCache::check(const std::string& key, int frames) const {
  const auto path = folder_ / "cache.json";
  if (!std::filesystem::exists(path))
    throw render::FileError(folder_.string() +
                            ": no cache here; make one with: offstage simulate SCENE --cache " +
                            folder_.string());
  const std::vector<uint8_t> bytes = read_file(path);
  const auto manifest = nlohmann::json::parse(bytes.begin(), bytes.end(), nullptr, false);
  if (!manifest.is_object() || manifest.value("offstage_cache", 0u) != kFormatVersion)
    throw render::FileError(path.string() + ": not a cache of this version; simulate again");
  if (!manifest.value("complete", false))
    throw render::FileError(folder_.string() +
                            ": the simulation of this cache did not finish; simulate again");
  if (manifest.value("key", std::string()) != key || manifest.value("frames", 0) != frames)
    throw render::FileError(
        folder_.string() +
        ": the cache belongs to another scene or other settings; simulate again with --force");
}

void SnapshotCache::finish(const std::string& key, int frames) const {
  write_manifest(folder_, key, frames, true);
}

void SnapshotCache::write(const Snapshot& snapshot) const {
  render::write_file_atomically(file(snapshot.frame), serialize(snapshot));
}

Snapshot SnapshotCache::read(int frame) const {
  const auto path = file(frame);
  Snapshot snapshot = deserialize(read_file(path), path.string());
  if (snapshot.frame != frame)
    throw render::FileError(fmt::format("{}: holds frame {}, not {}", path.string(), snapshot.frame, frame));
  return snapshot;
}

}  // namespace offstage::producer
