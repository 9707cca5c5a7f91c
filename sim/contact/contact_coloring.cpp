#include "sim/contact/contact_coloring.h"

#include <bit>

namespace offstage::sim {
namespace {

constexpr uint32_t kColors = 64;

}  // namespace

void ContactColoring::assign(uint32_t bodies, std::span<const Link> links) {
  used_.assign(bodies, 0);
  colors_.resize(links.size());
  std::array<uint32_t, kColors + 1> counts{};
  for (std::size_t i = 0; i < links.size(); ++i) {
    const auto [a, b] = links[i];
    const uint64_t used = (a == kNone ? 0 : used_[a]) | (b == kNone ? 0 : used_[b]);
    const auto color = static_cast<uint32_t>(std::countr_one(used));
    if (color < kColors && a != kNone) used_[a] |= uint64_t{1} << color;
    if (color < kColors && b != kNone) used_[b] |= uint64_t{1} << color;
    colors_[i] = static_cast<uint8_t>(color);
    ++counts[color];
  }
  begins_.assign(1, 0);
  for (uint32_t c = 0; c < kColors && counts[c] > 0; ++c)
    begins_.push_back(begins_.back() + (counts[c] + kLanes - 1) / kLanes);
  Batch unused;
  unused.fill(kNone);
  batches_.assign(begins_.back() + counts[kColors], unused);
  std::array<uint32_t, kColors + 1> filled{};
  for (std::size_t i = 0; i < links.size(); ++i) {
    const uint32_t color = colors_[i], place = filled[color]++;
    const bool serial = color == kColors;
    const uint32_t batch = serial ? begins_.back() + place : begins_[color] + place / kLanes;
    batches_[batch][serial ? 0 : place % kLanes] = static_cast<uint32_t>(i);
  }
}

}  // namespace offstage::sim
