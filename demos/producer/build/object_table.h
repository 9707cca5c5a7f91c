#pragma once
/// Maps the objects of a scene to the entries of a Snapshot that have their states, and to their ids in
/// Channels. The simulation uses this table to write snapshots; the stage, the exporters and the bindings use
/// it to read them.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "producer/scene/scene.h"
#include "render/channels.h"

namespace offstage::producer {

struct ObjectTable {
  /// Builds the table of a scene, which must outlive the table.
  explicit ObjectTable(const Scene& scene);

  struct BodyEntry {
    const Body* body;
    std::optional<std::size_t> slot;  ///< index in Snapshot::bodies; none: the body never moves
    uint32_t id;
  };
  /// A cylinder between two points: a spring, a part of a joint's rod or rope, or a segment of a cord.
  struct RodEntry {
    std::string name;  ///< name of the spring or joint; empty for a cord
    const char* kind;  ///< "spring", "rod" or "cord"
    bool visible;
    Real radius;  ///< [m]
    std::string material;
  };
  struct ClothEntry {
    const Cloth* cloth;
    uint32_t id;
  };
  /// The particles of a group or of a source.
  struct PointsEntry {
    std::string name;  ///< full name, such as `rain/splash`
    const ParticleLook* look;
    uint32_t id;
  };

  std::vector<BodyEntry> bodies;  ///< all bodies of the scene
  std::size_t slots = 0;          ///< length of Snapshot::bodies
  // Entry i belongs to entry i of the snapshot's list of the same name.
  std::vector<RodEntry> rods;
  std::vector<ClothEntry> cloths;
  std::vector<PointsEntry> point_sets;  ///< groups, then sources in the order of for_each_source()
  // Index of the first rod of each spring, joint and cloth of the scene.
  std::vector<std::size_t> rod_of_spring, rod_of_joint, rod_of_cloth;
};

/// Returns the names of the objects, by their ids in Channels.
render::ObjectNames object_names(const Scene& scene);

}  // namespace offstage::producer
