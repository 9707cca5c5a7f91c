/// Prevents particles from passing through each other in the solution of ParticleContacts. That solution
/// considers the particles that come near each other on their paths before contact, but a contact may turn a
/// fast particle towards others. Therefore the new paths are swept once more, in the order of time. Two
/// particles that would pass each other stop for the rest of the sub-step. A stopped particle keeps its
/// distance from particles that arrive later. So no particle passes, and each particle stops at most once.

#include <algorithm>
#include <queue>

#include <oneapi/tbb/parallel_for.h>

#include "sim/particles/particle_contacts.h"

namespace offstage::sim {
namespace {

/// Two particles whose paths are shorter than this fraction of their radii cannot pass each other.
constexpr Real kShort = 0.5;
/// Particles stop at this fraction of their initial distance or of the distance at which they touch. It is
/// smaller than the distances that the contact solver allows.
constexpr Real kNearest = 0.992;

}  // namespace

/// Sets the paths to the new ends. Returns whether any path is long, relative to the mean motion of all
/// particles.
bool ParticleContacts::predict_paths(std::span<const Vec3> end) {
  const std::size_t n = particles_.size();
  const Real h = step_->h;
  paths_.resize(n);
  is_long_.resize(n);
  Vec3 drift = Vec3::Zero();
  for (std::size_t i = 0; i < n; ++i) drift += (end[i] - particles_[i].position) / static_cast<Real>(n);
  tbb::parallel_for(std::size_t{0}, chunk_count(), [&](std::size_t c) {
    for (std::size_t i = c * ParticleSearch::kChunk; i < std::min(n, (c + 1) * ParticleSearch::kChunk); ++i) {
      CollidingParticle& g = paths_[i] = particles_[i];
      const Vec3 displacement = end[i] - g.position;
      g.path_velocity = g.from < h ? Vec3(displacement / (h - g.from)) : Vec3::Zero();
      is_long_[i] = (displacement - drift).norm() > kShort * g.radius;
    }
  });
  return std::find(is_long_.begin(), is_long_.end(), 1) != is_long_.end();
}

/// Finds the time from which two particles come too near each other, with regard to the stops that are
/// already known.
template <class Add>
void ParticleContacts::find_passing(uint32_t i, uint32_t j, Real after, Add&& add) const {
  const CollidingParticle &a = paths_[i], &b = paths_[j];
  if (!may_collide(a, b)) return;
  const Real from = std::max({a.from, b.from, after});
  const Vec3 d = a.at(std::min(from, stop_[i])) - b.at(std::min(from, stop_[j]));
  const Vec3 u = (stands(i) ? 0 : 1) * a.path_velocity - (stands(j) ? 0 : 1) * b.path_velocity;
  const Real first = std::max(a.from, b.from), reach = a.radius + b.radius;
  const Real nearest = std::min(kNearest * std::min(reach, (a.at(first) - b.at(first)).norm()), d.norm());
  const auto met = meeting_time(d, u, nearest);
  if (met && from + *met < step_->h) add(Passing{from + *met, i, j, stands(i), stands(j)});
}

void ParticleContacts::find_passing() {
  stop_.assign(particles_.size(), kNever);
  tbb::parallel_for(std::size_t{0}, chunk_count(), [&](std::size_t c) {
    std::vector<Passing>& passing = found_[c].passing;
    passing.clear();
    const auto add = [&](const Passing& p) { passing.push_back(p); };
    const std::size_t end = std::min(particles_.size(), (c + 1) * ParticleSearch::kChunk);
    for (auto i = static_cast<uint32_t>(c * ParticleSearch::kChunk); i < end; ++i)
      for (const uint32_t j : path_search_.partners(i)) find_passing(i, j, 0, add);
  });
}

void ParticleContacts::list_near() {
  const auto n = static_cast<uint32_t>(particles_.size());
  near_begin_.assign(n + 1, 0);
  const auto for_each = [&](auto&& f) {
    for (uint32_t i = 0; i < n; ++i)
      for (const uint32_t j : path_search_.partners(i)) f(i, j);
  };
  for_each([&](uint32_t i, uint32_t j) { ++near_begin_[i], ++near_begin_[j]; });
  uint32_t sum = 0;
  for (uint32_t& begin : near_begin_) begin = sum += begin;
  near_.resize(sum);
  for_each([&](uint32_t i, uint32_t j) {
    near_[--near_begin_[i]] = j;
    near_[--near_begin_[j]] = i;
  });
}

/// Stops both particles, and removes their speed of approach.
void ParticleContacts::stop(const Passing& p) {
  stop_[p.a] = std::min(stop_[p.a], p.time);
  stop_[p.b] = std::min(stop_[p.b], p.time);
  CollidingParticle &a = particles_[p.a], &b = particles_[p.b];
  const Vec3 d = paths_[p.a].at(stop_[p.a]) - paths_[p.b].at(stop_[p.b]);
  const Real approach = -(a.velocity - b.velocity).dot(d);
  if (!(approach > 0)) return;
  const Vec3 impulse = a.mass * b.mass / (a.mass + b.mass) * approach / d.squaredNorm() * d;
  a.velocity += impulse / a.mass;
  b.velocity -= impulse / b.mass;
}

void ParticleContacts::stop_passing(std::span<Vec3> end) {
  if (!predict_paths(end)) return;
  path_search_.build(paths_, step_->h, 0);
  path_search_.list_partners(paths_, is_long_);
  find_passing();
  list_near();
  std::priority_queue<Passing, std::vector<Passing>, std::greater<>> queue;
  for (const Found& found : found_)
    for (const Passing& p : found.passing) queue.push(p);
  const auto add = [&](const Passing& p) { queue.push(p); };
  while (!queue.empty()) {
    const Passing p = queue.top();
    queue.pop();
    if (stands(p.a) != p.a_stands || stands(p.b) != p.b_stands) continue;
    stop(p);
    for (const uint32_t i : {p.a, p.b}) {
      if (i == p.a ? p.a_stands : p.b_stands) continue;
      end[i] = paths_[i].at(p.time);
      for (uint32_t n = near_begin_[i]; n < near_begin_[i + 1]; ++n)
        if (!stands(near_[n])) find_passing(i, near_[n], p.time, add);
    }
  }
}

}  // namespace offstage::sim
