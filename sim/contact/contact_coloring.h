#pragma once
/// Colours of the contact graph. Patches of one colour share no movable body, so they can be solved at the
/// same time. The colouring is greedy in the order of the patches and depends only on that order.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace offstage::sim {

class ContactColoring {
 public:
  static constexpr uint32_t kLanes = 8, kNone = UINT32_MAX;
  /// Patches of one colour, one per lane; kNone in unused lanes.
  using Batch = std::array<uint32_t, kLanes>;
  /// Indices of the two bodies of a patch. kNone stands for a body that contacts do not move; such a body may
  /// be in several patches of one colour.
  struct Link {
    uint32_t a, b;
  };

  /// Computes the colouring. `links` has one entry per patch, with body indices below `bodies`.
  void assign(uint32_t bodies, std::span<const Link> links);

  std::span<const Batch> batches() const { return batches_; }
  /// The batches of colour c begin at begins()[c] and end at begins()[c + 1].
  std::span<const uint32_t> begins() const { return begins_; }
  /// Index of the first batch outside of all colours. From this index on, each batch has a single patch, and
  /// the batches must be solved one after the other. They occur at bodies with more contact partners than
  /// there are colours.
  uint32_t serial_begin() const { return begins_.back(); }

 private:
  std::vector<uint64_t> used_;   // by body: bits of the colours of its patches
  std::vector<uint8_t> colors_;  // by patch
  std::vector<uint32_t> begins_;
  std::vector<Batch> batches_;
};

}  // namespace offstage::sim
