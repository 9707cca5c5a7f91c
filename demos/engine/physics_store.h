#pragma once
/// Stores simulated states and their statistics, in memory of a bounded size. The least recently used
/// simulations are removed first. The store also keeps the collision meshes of the latest simulation for the
/// next one.

#include <list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "producer/build/simulation.h"
#include "producer/build/snapshot.h"
#include "producer/run/production.h"

namespace offstage::engine {

/// The states of one simulation so far.
struct Physics {
  /// State of each frame; element 0 is frame 1. Null: the state is not stored.
  std::vector<std::shared_ptr<const producer::Snapshot>> states;
  std::vector<producer::FrameFigures> figures;  ///< statistics of each frame; element 0 is frame 1
  std::optional<producer::RunStats> totals;  ///< statistics of the whole simulation; set after its last frame
  std::vector<std::string> notes;            ///< problems during the simulation, as sentences
};

inline constexpr std::size_t kPhysicsBytes = 384u << 20;  ///< default limit of the memory for states [bytes]

/// Simulations by key. The simulation to which states are added is never removed. Its states beyond the
/// memory limit are not stored; a caller that needs one simulates again. Not safe from several threads.
class PhysicsStore {
 public:
  explicit PhysicsStore(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  std::shared_ptr<Physics> open(const std::string& key);
  void keep(const std::string& key, int frame, std::shared_ptr<const producer::Snapshot> state);
  std::size_t bytes() const { return bytes_; }
  producer::CollisionMeshes& meshes() { return meshes_; }

 private:
  struct Entry {
    std::string key;
    std::shared_ptr<Physics> physics;
    std::size_t bytes = 0;
  };
  const std::size_t most_bytes_;
  std::list<Entry> entries_;  // latest first
  std::size_t bytes_ = 0;
  producer::CollisionMeshes meshes_;
};

}  // namespace offstage::engine
