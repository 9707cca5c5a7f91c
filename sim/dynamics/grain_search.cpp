#include "sim/dynamics/grain_search.h"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>

#include <oneapi/tbb/parallel_for.h>

namespace offstage::sim {
void GrainSearch::build(std::span<const Grain> grains, Real h, Real margin) {
  all_.resize(grains.size());
  std::iota(all_.begin(), all_.end(), 0u);
  build(grains, all_, h, margin);
}

void GrainSearch::build(std::span<const Grain> grains, std::span<const uint32_t> members, Real h,
                        Real margin) {
  const std::size_t n = members.size();
  h_ = h;
  margin_ = margin;
  drift_.setZero();
  unit_ = std::numeric_limits<Real>::infinity();
  for (const uint32_t i : members) {
    drift_ += grains[i].path_velocity / static_cast<Real>(n);
    unit_ = std::min(unit_, grains[i].radius + margin / 2);
  }
  balls_.resize(n);
  size_class_.resize(n);
  tbb::parallel_for(std::size_t{0}, (n + kChunk - 1) / kChunk, [&](std::size_t c) {
    for (std::size_t k = c * kChunk; k < std::min(n, (c + 1) * kChunk); ++k)
      size_class_[k] = size_class((balls_[k] = ball(grains[members[k]])).radius);
  });

  std::map<int, std::size_t> count;
  for (const int size : size_class_) ++count[size];
  classes_.resize(count.size());
  std::map<int, SizeClass*> of_size;
  std::size_t next = 0;
  for (const auto& [size, population] : count) {
    SizeClass& c = classes_[next++];
    c.size = size;
    c.radius = 0;
    c.member.clear();
    c.balls.clear();
    c.centres.clear();
    of_size[size] = &c;
  }
  for (std::size_t k = 0; k < n; ++k) {
    const Ball& b = balls_[k];
    SizeClass& c = *of_size[size_class_[k]];
    c.radius = std::max(c.radius, b.radius);
    c.member.push_back(members[k]);
    c.balls.push_back(b);
    c.centres.push_back(b.centre);
  }
  for (SizeClass& c : classes_) c.grid.build(c.centres, 2 * c.radius);
}

void GrainSearch::list_partners(std::span<const Grain> grains) {
  const std::size_t n = grains.size();
  partners_.resize((n + kChunk - 1) / kChunk);
  first_.resize(n);
  count_.resize(n);
  tbb::parallel_for(std::size_t{0}, partners_.size(), [&](std::size_t c) {
    std::vector<uint32_t>& partners = partners_[c];
    partners.clear();
    for (auto i = static_cast<uint32_t>(c * kChunk); i < std::min(n, (c + 1) * kChunk); ++i) {
      first_[i] = static_cast<uint32_t>(partners.size());
      for_each_partner(grains[i], i, [&](uint32_t j) {
        if (may_collide(grains[i], grains[j])) partners.push_back(j);
      });
      count_[i] = static_cast<uint32_t>(partners.size()) - first_[i];
    }
  });
}

}  // namespace offstage::sim
