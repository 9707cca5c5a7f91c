#include "sim/particles/particle_search.h"

#include <algorithm>
#include <limits>
#include <map>

#include <oneapi/tbb/parallel_for.h>

namespace offstage::sim {
void ParticleSearch::build(std::span<const CollidingParticle> particles, Real h, Real margin) {
  all_.clear();
  for (uint32_t i = 0; i < particles.size(); ++i)
    if (particles[i].internal || particles[i].external) all_.push_back(i);
  build(particles, all_, h, margin);
}

void ParticleSearch::build(std::span<const CollidingParticle> particles, std::span<const uint32_t> members,
                           Real h, Real margin) {
  const std::size_t n = members.size();
  h_ = h;
  margin_ = margin;
  drift_.setZero();
  unit_ = std::numeric_limits<Real>::infinity();
  for (const uint32_t i : members) {
    drift_ += particles[i].path_velocity / static_cast<Real>(n);
    unit_ = std::min(unit_, particles[i].radius + margin / 2);
  }
  balls_.resize(n);
  size_class_.resize(n);
  tbb::parallel_for(std::size_t{0}, (n + kChunk - 1) / kChunk, [&](std::size_t c) {
    for (std::size_t k = c * kChunk; k < std::min(n, (c + 1) * kChunk); ++k)
      size_class_[k] = size_class((balls_[k] = ball(particles[members[k]])).radius);
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
  for (SizeClass& c : classes_) c.grid.build(c.centres, 2 * c.radius * (1 + 1e-9));
}

/// Makes the lists of partners. for_each_partner(size class, place in the class, f) must call f with the
/// index of each partner of the particle at this place of the class.
template <class ForEachPartner>
void ParticleSearch::list(std::span<const CollidingParticle> particles, ForEachPartner&& for_each_partner) {
  struct Range {
    const SizeClass* own;
    std::size_t begin, end;
  };
  std::vector<Range> ranges;
  for (const SizeClass& c : classes_)
    for (std::size_t begin = 0; begin < c.member.size(); begin += kChunk)
      ranges.push_back({&c, begin, std::min(begin + kChunk, c.member.size())});
  partners_.resize(ranges.size());
  lists_.assign(particles.size(), {});
  tbb::parallel_for(std::size_t{0}, ranges.size(), [&](std::size_t r) {
    const auto& [own, begin, end] = ranges[r];
    std::vector<uint32_t>& partners = partners_[r];
    partners.clear();
    for (std::size_t place = begin; place < end; ++place) {
      const uint32_t i = own->member[own->grid.at(place)];
      const auto first = static_cast<uint32_t>(partners.size());
      for_each_partner(*own, place, [&](uint32_t j) {
        if (may_collide(particles[i], particles[j])) partners.push_back(j);
      });
      lists_[i] = {static_cast<uint32_t>(r), first, static_cast<uint32_t>(partners.size()) - first};
    }
  });
}

void ParticleSearch::list_partners(std::span<const CollidingParticle> particles) {
  list(particles, [&](const SizeClass& own, std::size_t place, auto&& add) {
    const Ball& b = own.balls[own.grid.at(place)];
    own.grid.for_each_pair(place, b.radius + own.radius, [&](uint32_t k) {
      if (overlap(b, own.balls[k])) add(own.member[k]);
    });
    for (const SizeClass& coarser : classes_) {
      if (coarser.size <= own.size) continue;
      coarser.grid.for_each_near(b.centre, b.radius + coarser.radius, [&](uint32_t k) {
        if (overlap(b, coarser.balls[k])) add(coarser.member[k]);
      });
    }
  });
}

void ParticleSearch::list_partners(std::span<const CollidingParticle> particles,
                                   std::span<const uint8_t> chosen) {
  list(particles, [&](const SizeClass& own, std::size_t place, auto&& add) {
    const uint32_t i = own.member[own.grid.at(place)];
    if (!chosen[i]) return;
    for_each_near(particles[i], [&](uint32_t j) {
      if (j > i || (j < i && !chosen[j])) add(j);
    });
  });
}

}  // namespace offstage::sim
