#pragma once
/// Resting contact of particles with each other and with bodies, including the collisions that
/// ParticleImpacts leaves (physics P6, P7, P8, R10). It is a complementarity problem on the velocities at the
/// end of the sub-step with Coulomb's round cone, as for bodies (contact_problem.h). Particles do not rotate,
/// or are balls. Therefore a contact's mobility consists of two numbers, along the normal and perpendicular
/// to it, and a single contact is solved in closed form. The problem is solved by projected Gauss-Seidel from
/// the impulses of the previous sub-step; a heap at rest starts with its solution. Particles are sorted into
/// layers (NeighborGrid); two layers form a slab. Contacts of a slab extend at most to the adjacent layers.
/// Therefore all even slabs can be solved in parallel, and then all odd ones.

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <tuple>
#include <unordered_map>
#include <vector>

#include "sim/contact/contact_problem.h"
#include "sim/linear/lanes.h"
#include "sim/linear/rigid_mobility.h"
#include "sim/particles/colliding_particle.h"
#include "sim/particles/particle_impacts.h"
#include "sim/particles/particle_search.h"
#include "sim/particles/particle_sweep.h"

namespace offstage::sim {

class ParticleContacts {
 public:
  static constexpr uint32_t kNone = ~0u;
  /// Gaps smaller than this fraction of the radii count as contacts, because impulses of the sub-step may
  /// close them.
  static constexpr Real kMargin = 0.1;

  /// The particles ordered by layers.
  struct Order {
    /// First particle of each layer, and the end; the number of layers is even.
    std::span<const uint32_t> layer_begin;
    std::span<const uint32_t> layer;   ///< layer of each particle
    std::span<const uint32_t> before;  ///< index of each particle in the previous solution, or kNone
  };

  /// A point at which a particle touches an obstacle in the sub-step.
  struct Touch {
    const Obstacle* obstacle;
    Vec3 normal, place;
    Real gap;              ///< gap at the end of the sub-step [m]; 0 if `meets`
    Real time;             ///< start of the contact, since the sub-step's start [s]
    bool meets;            ///< whether the particle reaches the surface in the sub-step
    bool on_face = false;  ///< whether the contact is on a face, if other obstacles are touched, too
  };

  /// Solves the contacts and moves the particles to the end of the sub-step. Clusters of at most
  /// `lcp_cluster` contacts are solved by pivoting (contact_lcp.h), others by relaxation; 0: all by
  /// relaxation. Velocities are stored in `particles`, positions in `end`, and in `touched` whether a
  /// particle touches anything. Impulses on bodies are appended to `reactions`, collisions to `strikes`.
  void solve(std::span<CollidingParticle> particles, const Order& order, const ParticleSearch& search,
             const ParticleImpacts& impacts, const ParticleStep& step, uint32_t lcp_cluster,
             std::span<Vec3> end, std::span<uint8_t> touched, std::vector<Reaction>& reactions,
             std::vector<ParticleStrike>& strikes);

  /// The carrier of a particle in the last solution, by its index there.
  CollidingParticle::Carrier carrier(uint32_t particle) const;
  std::size_t contacts() const { return pairs_.size() + surfaces_.size(); }
  uint32_t sweeps() const { return sweeps_; }
  /// Work of pivoting in the last solve(); its fall-backs are the clusters that relaxation has solved.
  const ContactWork& lcp_work() const { return lcp_work_; }

 private:
  static constexpr Real kNever = std::numeric_limits<Real>::infinity();

  /// A contact, with the data that sweeps read. Numbers are in single precision, because the time of a sweep
  /// is the time to read the contacts. The impulses on the two particles are nevertheless exactly opposite,
  /// and velocities are in double precision.
  struct Contact {
    Eigen::Vector3f normal_single;
    Eigen::Vector3f impulse_single;
    float target;        // smallest normal velocity at the end [m/s]
    float friction;      // Coulomb's coefficient
    float mass;          // effective mass [kg]
    float sliding_mass;  // effective mass for impulses across the normal [kg]
    float time;          // start of the contact [s]

    Vec3 normal() const { return normal_single.cast<Real>(); }
    /// Impulse on the first particle, world axes [N s].
    Vec3 impulse() const { return impulse_single.cast<Real>(); }
    /// Returns a tangential impulse, shortened to the friction `limit` [N s].
    Vec3 held(const Vec3& along, Real limit) const {
      const Real size2 = along.squaredNorm();
      return size2 > limit * limit ? Vec3(limit / std::sqrt(size2) * along) : along;
    }
    bool acts() const { return impulse_single != Eigen::Vector3f::Zero(); }
  };
  static constexpr uint32_t kIndex = 0x7fffffff;  // mask of a particle's index
  struct Pair : Contact {
    uint32_t a : 31, is_impact : 1;
    uint32_t b : 31, is_far : 1;  // is_far: not in neighbouring layers
  };
  struct Surface : Contact {
    uint32_t particle;
    bool is_impact;
    uint32_t body;
    const Obstacle* obstacle;
    Vec3 velocity;            // velocity of the surface
    Vec3 friction_axis;       // Obstacle::friction_axis_on() of the surface
    uint32_t pushed = kNone;  // index of the dynamic body in pushed_
    Vec3 arm = Vec3::Zero();  // vector from the body's centre of mass to the contact

    /// Does the same as Contact::held(). With a friction axis, the limits along and across the axis are
    /// separate.
    Vec3 held(const Vec3& along, Real limit) const {
      if (friction_axis.isZero()) return Contact::held(along, limit);
      const Vec3 across = normal().cross(friction_axis);
      const Real most = limit * obstacle->cross_friction;
      return std::clamp(friction_axis.dot(along), -limit, limit) * friction_axis +
             std::clamp(across.dot(along), -most, most) * across;
    }
  };
  /// A particle's velocity and, in the fourth lane of the same register, its inverse mass.
  struct Motion {
    Lanes velocity;
    Vec3 at() const { return vector_of(velocity); }
    Real inverse_mass() const { return velocity[3]; }
  };
  /// Rotation of a ball (see CollidingParticle): the spin of its surface, and turning / mass [1/kg].
  struct Turn {
    Lanes surface_spin;
    Vec3 at() const { return vector_of(surface_spin); }
  };
  /// A dynamic body that particles touch. The contacts change its velocity at the end of the sub-step.
  struct PushedBody {
    const Obstacle* obstacle;
    Mat6 mobility = Mat6::Zero();
    Vec6 gained = Vec6::Zero();  // change of its velocity by the impulses beyond the expected ones
    Vec6 kick = Vec6::Zero();    // the part of `gained` by impacts

    /// Change of the velocity of a point [m/s].
    static Vec3 at(const Vec6& change, const Vec3& arm) {
      return change.head<3>() + Vec3(change.tail<3>()).cross(arm);
    }
    void push(const Vec3& impulse, const Vec3& arm) {
      gained += mobility * stacked(impulse, arm.cross(impulse));
    }
  };
  /// Two particles that would pass through each other on their paths.
  struct Passing {
    Real time;
    uint32_t a, b;
    bool a_stands, b_stands;  // whether each of them has stopped by then

    bool operator>(const Passing& o) const { return std::tie(time, a, b) > std::tie(o.time, o.a, o.b); }
  };
  struct Found {
    std::vector<Touch> touches;  // of one particle
    std::vector<Pair> pairs;
    std::vector<Surface> surfaces;
    std::vector<Reaction> reactions;
    std::vector<ParticleStrike> strikes;
    std::vector<Passing> passing;
  };

  std::size_t chunk_count() const;
  template <class F>
  void for_each_chunk(F&& f) const;
  template <class OnPair, class OnSurface>
  void for_each_contact(OnPair&& on_pair, OnSurface&& on_surface);

  // particle_contacts.cpp
  void find();
  void find_pairs(uint32_t i, Found& found) const;
  void find_surfaces(uint32_t i, NearObstacles& near, Found& found) const;
  bool hits_later(uint32_t i, const ObstacleHit& hit) const;
  void add_surface(uint32_t i, const Obstacle& o, const Vec3& normal, Real target_or_gap, Real time,
                   bool meets, std::size_t first, Found& found) const;
  void recall(Pair& pair) const;
  void recall(Surface& surface) const;
  void collect();
  void find_pushed_bodies();
  // particle_lcp.cpp
  struct Cluster {
    std::vector<uint32_t> pairs, surfaces;
  };
  std::vector<Cluster> find_clusters(uint32_t most);
  bool solve_cluster(const Cluster& cluster, ContactWork& work);
  void solve_clusters(uint32_t most);
  bool is_solved(uint32_t particle) const { return !solved_.empty() && solved_[particle] != 0; }
  // particle_relaxation.cpp
  void start_motion();
  Lanes relative_velocity(const Pair& c, Lanes normal) const;
  Lanes relative_velocity(const Surface& c, Lanes normal) const;
  void apply(const Pair& c, Lanes normal, Lanes impulse);
  void apply(const Surface& c, Lanes normal, Lanes impulse);
  void relax();
  void displace(std::span<Vec3> end, std::span<uint8_t> touched);
  void displace_bodies();
  const PushedBody* pushed_body(const Obstacle& o) const;
  void push_apart(std::span<Vec3> end);
  // carried_particles.cpp
  std::vector<const Obstacle*> find_carriers() const;
  void follow_carriers(std::span<Vec3> end) const;
  // tunneling_guard.cpp
  void stop_passing(std::span<Vec3> end);
  bool predict_paths(std::span<const Vec3> end);
  void find_passing();
  void list_near();
  template <class Add>
  void find_passing(uint32_t i, uint32_t j, Real after, Add&& add) const;
  void stop(const Passing& passing);
  bool stands(uint32_t i) const { return stop_[i] < kNever; }
  // particle_relaxation.cpp
  void keep_outside(std::span<Vec3> end, std::vector<Reaction>& reactions,
                    std::vector<ParticleStrike>& strikes);
  void keep_outside(uint32_t i, NearObstacles& near, Vec3& end, Found& found);
  void report(uint32_t i, Found& found) const;

  std::span<CollidingParticle> particles_;
  Order order_;
  const ParticleSearch* search_ = nullptr;
  const ParticleImpacts* impacts_ = nullptr;
  const ParticleStep* step_ = nullptr;
  std::span<const Vec3> free_end_;  // ends of the paths without the contacts
  std::vector<Found> found_;        // by chunk
  std::vector<Pair> pairs_, pairs_before_;
  std::vector<Surface> surfaces_, surfaces_before_;
  // Index of the first contact of each particle; a pair belongs to its first particle.
  std::vector<uint32_t> pair_begin_, surface_begin_, pair_begin_before_, surface_begin_before_;
  std::vector<uint32_t> far_;
  std::vector<PushedBody> pushed_;
  std::unordered_map<uint32_t, uint32_t> pushed_index_;  // by body
  std::vector<uint32_t> on_pushed_;                      // contacts with pushed_
  std::vector<Motion> motion_;
  std::vector<Turn> turns_;  // by particle; empty if none turns
  std::vector<Real> slab_change2_;
  // Paths after contact, whether they are long, and the time at which a particle stopped.
  std::vector<CollidingParticle> paths_;
  std::vector<uint8_t> is_long_;
  std::vector<Real> stop_;
  ParticleSearch path_search_;
  // For each particle, the particles whose paths may come near its own, if one of the two paths is long.
  std::vector<uint32_t> near_begin_, near_;
  Real h_before_ = 0;
  uint32_t sweeps_ = 0;
  std::vector<uint8_t> solved_;  // by particle: whether pivoting has solved its contacts; empty without it
  ContactWork lcp_work_;
};

}  // namespace offstage::sim
