#pragma once
/// Collisions of particles with particles and bodies at their exact times, one after the other in the order
/// of time (physics E6, P3, P5, P6). If a hit particle touches others, they form a cluster and are solved
/// together. The work is bounded. A particle with too many collisions in a sub-step is left to the solver of
/// resting contact (particle_contacts.h), which also prevents tunnelling. If there are too many collisions in
/// total, all particles are left to it. Slow collisions in dense crowds are also left to it, because they are
/// very numerous and depend on each other.

#include <functional>
#include <queue>
#include <span>
#include <vector>

#include "sim/particles/colliding_particle.h"
#include "sim/particles/particle_search.h"
#include "sim/particles/particle_sweep.h"

namespace offstage::sim {

class ParticleImpacts {
 public:
  static constexpr uint32_t kNone = ~0u;

  /// Resolves the collisions of the particles. ParticleSearch::build() and list_partners() must have been
  /// called for them. Impulses on bodies are added to ParticleStep::impulses, and collisions are appended to
  /// `strikes`.
  void resolve(std::span<CollidingParticle> particles, const ParticleSearch& search, const ParticleStep& step,
               std::vector<ParticleStrike>& strikes);

  /// Indices of the particles that collided.
  std::span<const uint32_t> changed() const { return changed_; }
  /// Obstacle::body of the dynamic body that a particle hit last; kNone if there is none. The body reacts
  /// only in the next sub-step.
  uint32_t struck_body(uint32_t particle) const { return struck_[particle].body; }
  /// The same body, and the speed of approach.
  const CollidingParticle::Carrier& struck(uint32_t particle) const { return struck_[particle]; }
  uint64_t count() const { return count_; }

 private:
  struct Impact {
    Real time;
    uint32_t a, b;  // b: kNone for a collision with an obstacle
    uint32_t stamp_a, stamp_b;
    Vec3 normal;  // points towards a
    const Obstacle* obstacle;

    bool operator>(const Impact& o) const {
      return time != o.time ? time > o.time : a != o.a ? a > o.a : b > o.b;
    }
  };

  void count_neighbours();
  bool is_left_to_resting_contact(uint32_t i, uint32_t j, Real speed) const;
  void find_first();
  template <class Add>
  void find_with(uint32_t i, uint32_t j, Add&& add) const;
  template <class Add>
  void find_obstacle(uint32_t i, NearObstacles& near, Add&& add) const;
  template <class F>
  void for_each_near(const CollidingParticle& particle, F&& f) const;
  void collide_with_obstacle(const Impact& impact);
  void collide_particles(const Impact& impact);
  std::vector<uint32_t> cluster(const Impact& impact) const;
  void collide_cluster(std::span<const uint32_t> members, Real time);
  void strike(uint32_t i, Real time, const Vec3& change, const Vec3& normal);
  void find_again(uint32_t i);

  std::span<CollidingParticle> particles_;
  const ParticleSearch* search_ = nullptr;
  const ParticleStep* step_ = nullptr;
  std::vector<ParticleStrike>* strikes_ = nullptr;
  std::priority_queue<Impact, std::vector<Impact>, std::greater<>> queue_;
  std::vector<std::vector<Impact>> found_;  // by chunk
  std::vector<uint32_t> stamp_;             // number of collisions of each particle so far
  std::vector<uint32_t> neighbours_;        // number of neighbours that nearly touch, for each particle
  std::vector<CollidingParticle::Carrier> struck_;
  std::vector<uint32_t> changed_;
  // The changed particles that are sorted, and the particles changed since then.
  ParticleSearch changed_search_;
  std::vector<uint32_t> sorted_stamp_;
  std::vector<uint32_t> unsorted_;
  uint64_t count_ = 0;
};

}  // namespace offstage::sim
