#include "producer/build/snapshot.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "producer/base/packed_file.h"
#include "render/error.h"

namespace offstage::producer {
namespace {

using Eigen::Vector3f;
using Eigen::Vector4f;

constexpr FileKind kSnapshotKind = {"offsnap", 6, "snapshot"};

constexpr std::size_t kBodyBytes = 7 * sizeof(float);
constexpr std::size_t kRodBytes = 6 * sizeof(float);
constexpr std::size_t kPointBytes = 12 * sizeof(float) + sizeof(uint64_t);
constexpr std::size_t kSpinBytes = 2 * sizeof(float);
constexpr std::size_t kClothBytes = 4 * sizeof(uint64_t) + sizeof(uint32_t);
constexpr std::size_t kLineBytes = 12 * sizeof(float) + sizeof(uint64_t);

void put(ByteWriter& out, const std::vector<Vector3f>& values) {
  out.put(uint64_t{values.size()});
  for (const Vector3f& v : values) out.put(v);
}
void put(ByteWriter& out, const std::vector<uint32_t>& values) {
  out.put(uint64_t{values.size()});
  for (const uint32_t v : values) out.put(v);
}
void put(ByteWriter& out, const std::vector<Eigen::Quaternionf>& values) {
  out.put(uint64_t{values.size()});
  for (const Eigen::Quaternionf& q : values) out.put(Vector4f(q.coeffs()));
}
void take_bytes(ByteReader& in, std::vector<Eigen::Quaternionf>& values) {
  values.resize(in.take_count(4 * sizeof(float)));
  for (Eigen::Quaternionf& q : values) q.coeffs() = in.take<Vector4f>();
}
template <class T>
void take_bytes(ByteReader& in, std::vector<T>& values) {
  values.resize(in.take_count(sizeof(T)));
  for (T& v : values) v = in.take<T>();
}

}  // namespace

uint64_t Snapshot::point_count() const {
  uint64_t n = 0;
  for (const PointSet& set : point_sets) n += set.points.size();
  return n;
}

std::vector<uint8_t> serialize(const Snapshot& snapshot, std::string_view key) {
  ByteWriter out;
  out.put(uint64_t{key.size()});
  for (const char c : key) out.put(c);
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
  out.put(uint64_t{snapshot.rods.size()});
  for (const RodSample& s : snapshot.rods) out.put(s.a), out.put(s.b);
  out.put(uint64_t{snapshot.point_sets.size()});
  for (const PointSet& set : snapshot.point_sets) {
    out.put(uint64_t{set.points.size()});
    for (std::size_t i = 0; i < set.points.size(); ++i) {
      const render::Point& p = set.points[i];
      out.put(p.position);
      out.put(p.velocity);
      out.put(p.radius);
      out.put(p.color);
      out.put(set.ages[i]);
      out.put(p.id);
    }
    out.put(uint64_t{set.spins.size()});
    for (std::size_t i = 0; i < set.spins.size(); ++i) out.put(set.points[i].angle), out.put(set.spins[i]);
    put(out, set.orientations);
  }
  out.put(uint64_t{snapshot.cloths.size()});
  for (const ClothSample& cloth : snapshot.cloths) {
    put(out, cloth.points);
    put(out, cloth.velocities);
    out.put(cloth.version);
    put(out, cloth.triangles);
    put(out, cloth.sources);
  }
  out.put(uint64_t{snapshot.overlays.size()});
  for (const LineSet& set : snapshot.overlays) {
    out.put(uint64_t{set.lines.size()});
    for (std::size_t i = 0; i < set.lines.size(); ++i) {
      const render::Line& line = set.lines[i];
      out.put(line.a), out.put(line.b);
      out.put(line.color);
      out.put(line.width_a), out.put(line.width_b);
      out.put(set.ids[i]);
    }
  }

  return pack(kSnapshotKind, out.bytes());
}

Snapshot deserialize(std::span<const uint8_t> bytes, const std::string& source, std::string_view key) {
  const std::vector<uint8_t> payload = unpack(kSnapshotKind, bytes, source);
  ByteReader in(payload, source);
  std::string own_key(in.take_count(1), '\0');
  for (char& c : own_key) c = in.take<char>();
  if (own_key != key) throw render::FileError(source + ": belongs to another simulation");
  Snapshot snapshot;
  snapshot.frame = in.take<int>();
  snapshot.time = in.take<double>();
  snapshot.state_hash.low = in.take<uint64_t>();
  snapshot.state_hash.high = in.take<uint64_t>();
  snapshot.bodies.resize(in.take_count(kBodyBytes));
  for (BodySample& b : snapshot.bodies) {
    b.position = in.take<Vector3f>();
    const auto w = in.take<float>();
    const auto v = in.take<Vector3f>();
    b.orientation = {w, v.x(), v.y(), v.z()};
  }
  snapshot.rods.resize(in.take_count(kRodBytes));
  for (RodSample& s : snapshot.rods) s = {in.take<Vector3f>(), in.take<Vector3f>()};
  snapshot.point_sets.resize(in.take_count(sizeof(uint64_t)));
  for (PointSet& set : snapshot.point_sets) {
    set.points.resize(in.take_count(kPointBytes));
    set.ages.resize(set.points.size());
    for (std::size_t i = 0; i < set.points.size(); ++i) {
      render::Point& p = set.points[i];
      p.position = in.take<Vector3f>();
      p.velocity = in.take<Vector3f>();
      p.radius = in.take<float>();
      p.color = in.take<Vector4f>();
      p.age = set.ages[i] = in.take<float>();
      p.id = in.take<uint64_t>();
    }
    set.spins.resize(in.take_count(kSpinBytes));
    if (!set.spins.empty() && set.spins.size() != set.points.size())
      throw render::FileError(source + ": is damaged: only some particles of a set have a rate of rotation");
    for (std::size_t i = 0; i < set.spins.size(); ++i) {
      set.points[i].angle = in.take<float>();
      set.spins[i] = in.take<float>();
    }
    take_bytes(in, set.orientations);
    if (!set.orientations.empty() && set.orientations.size() != set.points.size())
      throw render::FileError(source + ": is damaged: only some particles of a set have an orientation");
  }
  snapshot.cloths.resize(in.take_count(kClothBytes));
  for (ClothSample& cloth : snapshot.cloths) {
    take_bytes(in, cloth.points);
    take_bytes(in, cloth.velocities);
    cloth.version = in.take<uint32_t>();
    take_bytes(in, cloth.triangles);
    take_bytes(in, cloth.sources);
  }
  snapshot.overlays.resize(in.take_count(sizeof(uint64_t)));
  for (LineSet& set : snapshot.overlays) {
    set.lines.resize(in.take_count(kLineBytes));
    set.ids.resize(set.lines.size());
    for (std::size_t i = 0; i < set.lines.size(); ++i) {
      render::Line& line = set.lines[i];
      line.a = in.take<Vector3f>();
      line.b = in.take<Vector3f>();
      line.color = in.take<Vector4f>();
      line.width_a = in.take<float>();
      line.width_b = in.take<float>();
      set.ids[i] = in.take<uint64_t>();
    }
  }
  in.expect_end();
  return snapshot;
}

}  // namespace offstage::producer
