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
  /// Bodies of a patch. kNone for a body that contacts do not move: it may be in many patches of a colour.
  struct Link {
    uint32_t a, b;
  };

  /// Computes the colouring. `links` has one entry per patch, with body indices below `bodies`.
  void assign(uint32_t bodies, std::span<const Link> links);

  std::span<const Batch> batches() const { return batches_; }
  /// The batches of colour c begin at begins()[c] and end at begins()[c + 1].
  std::span<const uint32_t> begins() const { return begins_; }
  /// Batches from this index on have one patch each and must be solved one after the other. They belong to
  /// bodies with more partners than there are colours.
  uint32_t serial_begin() const { return begins_.back(); }

 private:
  std::vector<uint64_t> used_;   // by body: bits of the colours of its patches
  std::vector<uint8_t> colors_;  // by patch
  std::vector<uint32_t> begins_;
  std::vector<Batch> batches_;
};

}  // namespace offstage::sim
