#pragma once
/// What one frame hands from the simulation to the drawing: an immutable picture of the state, cast to float
/// once. It is also what a SnapshotCache keeps, one compressed and checksummed file per frame.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "render/stage.h"
#include "sim/world.h"

namespace offstage::producer {

struct BodySample {
  Eigen::Vector3f position;
  Eigen::Quaternionf orientation;
};

/// Ends of a spring, or of a joint that is a rod or rope; both the same where it is gone.
struct RodSample {
  Eigen::Vector3f a, b;
};

/// Particles of one group or emitter. `ids` ascend; `ages` tell when a particle was born inside the frame.
struct PointSet {
  std::vector<render::Point> points;
  std::vector<float> ages;  ///< [s]
};

/// A cloth.
struct ClothSample {
  std::vector<Eigen::Vector3f> points;      ///< [m]
  std::vector<Eigen::Vector3f> velocities;  ///< [m/s]
  uint32_t version = 0;                     ///< of the next two; 0: the cloth is whole, and they are empty
  std::vector<uint32_t> triangles;          ///< three points each
  std::vector<uint32_t> sources;  ///< of each point the vertex of the scene's cloth that it comes from
};

/// What an overlay shows. A line with the same id in two snapshots is the same line, moved.
struct LineSet {
  std::vector<render::Line> lines;
  std::vector<uint64_t> ids;
};

struct Snapshot {
  int frame = 1;
  double time = 0;                   ///< [s]
  std::vector<BodySample> bodies;    ///< moving bodies, in scene order
  std::vector<RodSample> rods;       ///< springs, then distance joints, in scene order
  std::vector<PointSet> point_sets;  ///< particle groups, then emitters, in scene order
  std::vector<ClothSample> cloths;   ///< in scene order
  std::vector<LineSet> overlays;     ///< in scene order; empty for those that draw no lines
  sim::StateHash state_hash;

  uint64_t point_count() const;
};

/// The bytes of a snapshot: magic, format version, checksum (XXH3-64), zstd payload. `key` is that of the
/// run.
std::vector<uint8_t> serialize(const Snapshot& snapshot, std::string_view key = {});
/// Throws render::FileError, naming `source`, for bytes that are damaged, cut short, of another version or of
/// a run with another key.
Snapshot deserialize(std::span<const uint8_t> bytes, const std::string& source, std::string_view key = {});

}  // namespace offstage::producer
