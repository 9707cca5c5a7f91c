#pragma once
/// Private: sprites, flakes, streaks, smoke and fire as rays of mirror images meet them: soft discs that face
/// the ray, and soft lines. Embree finds the particles on a ray; their opacity is computed here.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "render/mesh.h"
#include "render/trace/ray_tree.h"

namespace offstage::render {

/// How particles scatter light. `none`: they are not lit, and their colour is their radiance.
enum class Scattering { none, puff, sprite, flake, drop };

/// Light at a point in the air. A white surface there with the unit normal n has the radiance
/// constant + slope * n.
struct AirRadiance {
  Vector3f constant = Vector3f::Zero();
  Eigen::Matrix3f slope = Eigen::Matrix3f::Zero();  ///< rows: red, green, blue
  Vector3f at(const Vector3f& normal) const { return (constant + slope * normal).cwiseMax(0.0f); }
};

/// Light that a white particle scatters.
struct ParticleLight {
  AirRadiance diffuse;                  ///< as a function of the normal of its surface
  Vector3f forward = Vector3f::Zero();  ///< radiance in the direction of the sun's rays, times forward_lobe()
};

/// Returns the light that a particle scatters to the eye, as a fraction of that in the direction of the sun's
/// rays. `cosine`: of the angle between the direction in which the ray is traced and the direction to the
/// sun.
float forward_lobe(Scattering scattering, float cosine);

/// Groups of particles that a ray meets. Drops are too small to be visible in blurred mirror images.
enum class MetParticles { none, no_drops, all };

/// Particles that look alike.
struct RayParticleSet {
  bool lines = false;  ///< whether the particles are lines; otherwise they are discs
  /// Discs: the centre of each particle, and its radius (w). Lines: the head and the tail of each particle,
  /// both with the radius.
  std::vector<Vector4f> places;
  std::vector<Vector4f> colors;  ///< for each particle: linear colour; w: opacity in the middle, in [0, 1]
  std::vector<float> numbers;    ///< for each particle: see AirLight::sun
  Scattering scattering = Scattering::none;
  float cover = 1;  ///< opacity against the background, as a fraction; 0: particles add light
  float softness = 0.5f, taper = 0;  ///< see PointsDef; softness is positive
  std::vector<ParticleLight> light;  ///< for each lit particle

  std::size_t size() const { return colors.size(); }
  Vector3f center(std::size_t i) const {
    return lines ? Vector3f(0.5f * (places[2 * i] + places[2 * i + 1]).head<3>()) : places[i].head<3>();
  }
  float radius(std::size_t i) const { return places[lines ? 2 * i : i].w(); }
};

/// The light between particles.
struct ParticleAir {
  Vector3f to_sun;
  float fog;  ///< density [1/m]
};

/// The particles on a segment of a ray.
struct ParticlesOnRay {
  Vector3f radiance = Vector3f::Zero();  ///< light that the particles send along the ray
  float transmittance = 1;               ///< fraction of the light from behind that passes
};

class RayParticles {
 public:
  /// Replaces the particles. `make` returns the new sets. It is only called if rays can meet particles.
  void reset(std::function<std::vector<RayParticleSet>()> make);
  /// Builds the hierarchies for rays that meet these groups or fewer. Returns the sets whose light must be
  /// set before along(), which are the lit ones that were not built before.
  std::vector<RayParticleSet*> build(MetParticles groups);
  /// Returns the particles on a segment. `direction` is a unit vector; `length` [m]. The groups must have
  /// been built.
  ParticlesOnRay along(const Vector3f& from, const Vector3f& direction, float length, MetParticles groups,
                       const ParticleAir& air) const;

 private:
  std::function<std::vector<RayParticleSet>()> make_;
  std::vector<RayParticleSet> sets_;     ///< sets by Embree's geometry id
  std::vector<uint32_t> first_of_line_;  ///< index of the head of each line; shared by all sets of lines
  RayTree tree_;                         ///< the sets without drops
  RayTree tree_with_drops_;              ///< all sets; null if there are no drops
  MetParticles built_ = MetParticles::none;

  RayTree tree_of(MetParticles groups) const;
};

}  // namespace offstage::render
