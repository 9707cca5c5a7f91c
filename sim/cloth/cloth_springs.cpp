#include "sim/cloth/cloth_springs.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "sim/contact/staged_loop.h"

namespace offstage::sim {
namespace {

/// Springs at a time, and from how many on threads are worth their waking.
constexpr std::size_t kBlock = 2048, kWorthThreads = 60000;

/// Greedy: each spring gets the first colour that neither of its ends has.
std::vector<uint32_t> colors(std::span<const ClothSpring> springs, std::size_t point_count) {
  std::vector<uint64_t> used(point_count, 0);
  std::vector<uint32_t> color(springs.size());
  for (std::size_t i = 0; i < springs.size(); ++i) {
    const uint64_t taken = used[springs[i].a] | used[springs[i].b];
    const uint32_t first = static_cast<uint32_t>(std::countr_one(taken));
    color[i] = std::min(first, 64u);
    if (first == 64) continue;
    used[springs[i].a] |= uint64_t{1} << first;
    used[springs[i].b] |= uint64_t{1} << first;
  }
  return color;
}

}  // namespace

void ClothSprings::assign(std::span<const ClothSpring> springs, std::size_t point_count) {
  // Colour 64 takes what finds no other: at points with very many springs. It is swept by one thread.
  const std::vector<uint32_t> color = colors(springs, point_count);
  color_start_.assign(66, 0);
  for (uint32_t c : color) ++color_start_[c + 1];
  for (std::size_t c = 1; c < color_start_.size(); ++c) color_start_[c] += color_start_[c - 1];
  std::vector<std::size_t> next(color_start_.begin(), color_start_.end());
  spring_.resize(springs.size());
  for (std::size_t i = 0; i < springs.size(); ++i) {
    const ClothSpring& s = springs[i];
    spring_[next[color[i]]++] = {s.a, s.b, s.rest_length, 1 / s.stiffness, s.damping / s.stiffness};
  }
}

void ClothSprings::sweep(ClothPoints& points, Real h) const {
  struct Stage {
    std::size_t begin, end;
    bool whole;
    uint32_t block_count() const {
      return whole ? 1 : static_cast<uint32_t>((end - begin + kBlock - 1) / kBlock);
    }
  };
  std::vector<Stage> stages;
  for (std::size_t c = 0; c + 1 < color_start_.size(); ++c)
    if (color_start_[c + 1] > color_start_[c])
      stages.push_back({color_start_[c], color_start_[c + 1], c == 64});
  const uint32_t threads = spring_.size() < kWorthThreads ? 1 : available_threads();
  run_stages(std::span(stages), threads, [&](const Stage& stage, uint32_t block) {
    const std::size_t begin = stage.begin + block * kBlock;
    sweep_block(points, h, begin, stage.whole ? stage.end : std::min(begin + kBlock, stage.end));
  });
}

void ClothSprings::sweep_block(ClothPoints& points, Real h, std::size_t begin, std::size_t end) const {
  Vec4* const x = points.position.data();
  const Vec4* const x0 = points.start.data();
  const Real* const w = points.inverse_mass.data();
  for (std::size_t i = begin; i < end; ++i) {
    const Spring& s = spring_[i];
    const Real wa = w[s.a], wb = w[s.b];
    const Vec4 d = x[s.a] - x[s.b], moved = d - (x0[s.a] - x0[s.b]);
    const Real length = std::sqrt(d.squaredNorm());
    if (!(length > 0)) continue;
    const Real gamma = s.damping / h;
    const Real error = length - s.rest + gamma * (d.dot(moved) / length);
    const Real correction = error / (((1 + gamma) * (wa + wb) + s.compliance / (h * h)) * length);
    x[s.a] -= (wa * correction) * d;
    x[s.b] += (wb * correction) * d;
    if (wa == 0) points.pull[s.a] -= correction * d;
    if (wb == 0) points.pull[s.b] += correction * d;
  }
}

}  // namespace offstage::sim
