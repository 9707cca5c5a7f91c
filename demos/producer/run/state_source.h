#pragma once
/// Provides the states of a film to the frame loop: from the simulation, from a cache on disk, or from states
/// of earlier simulations in memory.

#include <functional>
#include <memory>

#include "producer/build/snapshot.h"

namespace offstage::producer {

struct FrameJob;
struct RunStats;

class StateSource {
 public:
  /// Called after every call of Simulation::advance(). Returns whether the simulation goes on.
  using OnAdvance = std::function<bool()>;

  virtual ~StateSource() = default;
  /// Number of calls of Simulation::advance() that at() needs for all frames up to `frame`.
  virtual int advances_to(int frame) = 0;
  /// Returns the state of a frame; null if `on_advance` has stopped the simulation first. Frames are
  /// requested in ascending order. Throws DivergedError, and FileError for a cache.
  virtual std::shared_ptr<const Snapshot> at(int frame, const OnAdvance& on_advance) = 0;
  /// Adds further data of the latest state.
  virtual void describe(FrameJob&) const {}
  /// Adds the figures of the simulation up to the latest state.
  virtual void add_totals(RunStats&) const {}
};

}  // namespace offstage::producer
