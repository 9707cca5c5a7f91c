#pragma once
/// The data that one frame passes from the simulation to the drawing: an immutable copy of the state,
/// converted to float once. A SnapshotCache stores it as one compressed file with a checksum per frame.

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

/// Ends of a rod: a spring, a joint that is a rod or rope, or a segment of a cord. Both ends are equal if the
/// rod does not exist any more.
struct RodSample {
  Eigen::Vector3f a, b;
};

/// Particles of one group or source, in ascending order of their ids. `ages` show when within the frame a new
/// particle was created.
struct PointSet {
  std::vector<render::Point> points;
  std::vector<float> ages;   ///< [s]
  std::vector<float> spins;  ///< rate of Point::angle for each point [rad/s]; empty: no point rotates
  /// Rotations by contacts since the birth time; empty unless the particles `rotate` and show it.
  std::vector<Eigen::Quaternionf> orientations;
};

/// A cloth.
struct ClothSample {
  std::vector<Eigen::Vector3f> points;      ///< [m]
  std::vector<Eigen::Vector3f> velocities;  ///< [m/s]
  /// Version of `triangles` and `sources`; 0: the cloth is intact, and both are empty.
  uint32_t version = 0;
  std::vector<uint32_t> triangles;  ///< three points each
  std::vector<uint32_t> sources;    ///< for each point, the vertex of the scene's cloth from which it comes
};

/// The lines of an overlay. A line with the same id in two snapshots is the same line, moved.
struct LineSet {
  std::vector<render::Line> lines;
  std::vector<uint64_t> ids;
};

struct Snapshot {
  int frame = 1;
  double time = 0;  ///< [s]
  // ObjectTable says which object of the scene each entry belongs to.
  std::vector<BodySample> bodies;  ///< moving bodies
  std::vector<RodSample> rods;
  std::vector<PointSet> point_sets;
  std::vector<ClothSample> cloths;
  std::vector<LineSet> overlays;  ///< lines of each overlay of the scene; empty for overlays without lines
  sim::StateHash state_hash;

  uint64_t point_count() const;
};

/// Converts a snapshot to bytes: magic word, format version, checksum (XXH3-64), zstd-compressed payload.
/// `key` identifies the run.
std::vector<uint8_t> serialize(const Snapshot& snapshot, std::string_view key = {});
/// Converts bytes back to a snapshot. Throws render::FileError, which names the file `source`, if the bytes
/// are damaged, truncated, of another format version, or from a run with another key.
Snapshot deserialize(std::span<const uint8_t> bytes, const std::string& source, std::string_view key = {});

}  // namespace offstage::producer
