#pragma once
/// Everything that moves together in one integration: all free dynamic bodies, the particle systems that
/// springs hold on to, and the springs (physics R1, R2, P2).
///
/// Layout: per body x = [position 3, quaternion x y z w], p = [L 3, H 3]; then per particle x = position, p =
/// velocity.

#include <vector>

#include "sim/world_impl.h"

namespace offstage::sim {

class CoupledSystem final : public DynamicSystem {
 public:
  /// Gathers what moves. The world must not gain or lose anything while this is in use.
  explicit CoupledSystem(WorldState& world);

  bool empty() const { return x_size_ == 0; }
  bool holds(const ParticleSystem& system) const;

  /// Advances the world's coupled objects from t to t + h.
  void step(const Integrator& integrator, Real t, Real h);

  void velocity(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dx) const override;
  void force(Real t, std::span<const Real> x, std::span<const Real> p, std::span<Real> dp) const override;

 private:
  static constexpr std::size_t kBodyX = 7, kBodyP = 6;  // numbers per body

  struct Group {
    ParticleSystem* system;
    ParticleForces forces;
    std::vector<std::size_t> members;  // the particles that live through the whole sub-step
    std::size_t offset;                // of the first in units of 3, after the bodies
  };
  /// A spring's end, resolved to where it is in the state.
  struct End {
    enum class Kind { still, kinematic, dynamic, particle } kind = Kind::still;
    Vec3 point =
        Vec3::Zero();  // still: world; bodies: from the centre of mass (dynamic) or the origin, body axes
    const Body* body = nullptr;
    std::size_t index = 0;  // of the body or the particle in the state
    Real mass = 1;          // of the particle
  };
  struct PointMotion {
    Vec3 position, velocity;
  };
  struct ActiveSpring {
    End a, b;
    Real stiffness, damping, rest_length;
  };

  std::size_t particle_x(std::size_t i) const { return kBodyX * bodies_.size() + 3 * i; }
  std::size_t particle_p(std::size_t i) const { return kBodyP * bodies_.size() + 3 * i; }
  void add_springs(const WorldState& world);
  End resolve(const WorldState& world, const Attachment& a) const;
  PointMotion motion(const End& end, Real t, std::span<const Real> x, std::span<const Real> p) const;
  void apply(const End& end, const Vec3& force, std::span<const Real> x, std::span<Real> dp) const;
  void load(std::span<Real> x, std::span<Real> p) const;
  void store(std::span<const Real> x, std::span<const Real> p);

  Vec3 gravity_;
  std::vector<Body*> bodies_;
  std::vector<Group> groups_;
  std::vector<ActiveSpring> springs_;
  std::size_t x_size_ = 0, p_size_ = 0;
};

}  // namespace offstage::sim
