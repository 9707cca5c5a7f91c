#pragma once
/// Search for particles that come near each other on their paths. Each particle has a ball around its path,
/// in a frame that moves with the mean of all particles. Balls are sorted into size classes, each of which
/// covers a factor of two and has its own grid. Therefore large or fast particles do not enlarge the cells of
/// the others.

#include <span>
#include <vector>

#include "sim/dynamics/neighbor_grid.h"
#include "sim/particles/colliding_particle.h"

namespace offstage::sim {

class ParticleSearch {
 public:
  static constexpr std::size_t kChunk = 512;

  /// Sorts all particles, or only those with the indices `members`, for a sub-step of length h [s]. Particles
  /// whose surfaces come within `margin` [m] count as near.
  void build(std::span<const CollidingParticle> particles, Real h, Real margin);
  void build(std::span<const CollidingParticle> particles, std::span<const uint32_t> members, Real h,
             Real margin);

  /// Calls f(index) for the particles whose paths may come near the path of `particle`, including `particle`
  /// itself. The state of `particle` may have changed since build().
  template <class F>
  void for_each_near(const CollidingParticle& particle, F&& f) const {
    const Ball b = ball(particle);
    for (const SizeClass& c : classes_)
      c.grid.for_each_near(b.centre, b.radius + c.radius, [&](uint32_t k) {
        if (overlap(b, c.balls[k])) f(c.member[k]);
      });
  }

  /// Creates the lists for partners(). A list has the particles that may collide with a particle and whose
  /// paths may come near its path. Each pair is in only one of the two lists. build() must have sorted all
  /// particles.
  void list_partners(std::span<const CollidingParticle> particles);
  /// Creates lists only for `chosen` particles (one flag per particle): pairs with at least one chosen
  /// particle.
  void list_partners(std::span<const CollidingParticle> particles, std::span<const uint8_t> chosen);
  std::span<const uint32_t> partners(uint32_t i) const {
    const List& list = lists_[i];
    if (list.count == 0) return {};
    return std::span(partners_[list.chunk]).subspan(list.first, list.count);
  }

 private:
  struct Ball {
    Vec3 centre;
    Real radius;
  };
  struct SizeClass {
    int size = 0;
    Real radius = 0;  // radius of the largest ball
    NeighborGrid grid;
    std::vector<uint32_t> member;
    std::vector<Ball> balls;
    std::vector<Vec3> centres;
  };

  /// The partners of a particle, as a range of the partners of its chunk.
  struct List {
    uint32_t chunk = 0, first = 0, count = 0;
  };

  template <class ForEachPartner>
  void list(std::span<const CollidingParticle> particles, ForEachPartner&& for_each_partner);

  static bool overlap(const Ball& a, const Ball& b) {
    const Real reach = a.radius + b.radius;
    return (a.centre - b.centre).squaredNorm() <= reach * reach;
  }
  Ball ball(const CollidingParticle& g) const {
    const Vec3 displacement = (h_ - g.from) / 2 * (g.path_velocity - drift_);
    return {g.position - g.from * drift_ + displacement, displacement.norm() + g.radius + margin_ / 2};
  }
  int size_class(Real radius) const { return std::ilogb(radius / unit_); }

  Vec3 drift_ = Vec3::Zero();
  Real h_ = 0, margin_ = 0, unit_ = 1;
  std::vector<SizeClass> classes_;  // finer ones first
  std::vector<uint32_t> all_;
  std::vector<Ball> balls_;
  std::vector<int> size_class_;
  std::vector<std::vector<uint32_t>> partners_;  // by chunk
  std::vector<List> lists_;                      // by particle
};

}  // namespace offstage::sim
