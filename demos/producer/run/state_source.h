#pragma once
/// A source of a film's states for the frame loop: the simulation, a cache on disk, or states of earlier
/// simulations in memory.

#include <functional>
#include <memory>

#include "producer/build/snapshot.h"

namespace offstage::producer {

struct FrameJob;
struct RunStats;

class StateSource {
 public:
  /// Called after every call of Simulation::advance(). Returns whether the simulation continues.
  using OnAdvance = std::function<bool()>;

  virtual ~StateSource() = default;
  /// Returns how often Simulation::advance() must be called for all frames up to `frame`.
  virtual int advances_to(int frame) = 0;
  /// Returns the state of a frame; null if `on_advance` returned false before. Frames must be requested in
  /// ascending order. Throws DivergedError if the simulation diverges, and FileError if a cache cannot be
  /// read.
  virtual std::shared_ptr<const Snapshot> at(int frame, const OnAdvance& on_advance) = 0;
  /// Adds data of the latest state to a frame job: its contacts and its energy, if they are known.
  virtual void describe(FrameJob&) const {}
  /// Adds the figures of the simulation, from its start to the latest state.
  virtual void add_totals(RunStats&) const {}
};

}  // namespace offstage::producer
