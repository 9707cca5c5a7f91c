#pragma once
/// Simulated states and their figures, in memory of a bounded size. Those of the least recently used
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
  /// State of each frame, from frame 1; null: not stored.
  std::vector<std::shared_ptr<const producer::Snapshot>> states;
  std::vector<producer::FrameFigures> figures;  ///< figures of each frame, from frame 1
  std::optional<producer::RunStats> totals;     ///< figures of the whole simulation, after its last frame
  std::vector<std::string> notes;               ///< problems during the simulation, as sentences
};

inline constexpr std::size_t kPhysicsBytes = 384u << 20;  ///< usual limit for states

/// Simulations by key. The current one is never removed, but its states beyond the bound are not stored; they
/// are simulated again on request. For one thread.
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
