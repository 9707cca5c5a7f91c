#pragma once
/// Private: paths of light rays. light_tracer.cpp, mirror_light.cpp and caustics.cpp start them;
/// light_path.cpp follows them.

#include <numbers>

#include "render/trace/light_tracer.h"

namespace offstage::render {

inline constexpr float kFar = 1e9f;  // length of rays without an end [m]
// Shadow rays to a glowing surface end at this fraction of the distance, so that rounding errors do not make
// them hit the surface itself.
inline constexpr float kBeforeGlow = 1 - 2e-5f;

inline std::size_t index_of(int x, int y, int width) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
}

/// Returns the fraction of the light along a ray that a glass surface reflects (Fresnel), in [0, 1].
float mirrored_fraction(const Hit& hit, const Vector3f& direction);

/// Returns whether glass is so rough that refracted rays get a random direction.
bool is_rough_glass(float roughness);

/// Moves a ray to the other side of a glass surface and refracts its direction. Returns the transmitted
/// fraction of the light per channel: the colour `albedo` of a thin sheet. A solid piece applies the square
/// root of its colour where the ray enters and where it leaves.
Vector3f enter(const Hit& hit, float roughness, const Vector3f& albedo, PixelSampler& sampler, Vector3f& from,
               Vector3f& direction);

/// Returns the radiance that a white surface scatters from a sample of a glowing mesh, without shadows. It is
/// weighted by multiple importance sampling, because rays that hit the mesh by chance contribute the rest.
/// `normal`: shading normal of the surface; `face`: normal of its triangle.
Vector3f light_of_glow(const GlowSample& sample, const Vector3f& normal, const Vector3f& face);

/// Probability density of uniformly distributed directions [1/sr].
inline constexpr float kEvenDensity = 0.25f / std::numbers::pi_v<float>;

/// Cosine between light and triangle, below which the triangle may shadow itself.
inline constexpr float kGrazing = 0.02f;

/// Surfaces with a smaller roughness^2 reflect and refract in a single direction.
inline constexpr float kSharp = 0.002f;

/// Returns the probability density of directions reflected at a visible_facet() [1/sr]. a: roughness^2; nv,
/// nh: cosines between the normal and the direction to the eye or the half vector.
template <class T>
T mirror_density(T a, T nv, T nh) {
  const T a2 = a * a, d = nh * nh * (a2 - 1.0f) + 1.0f;
  const T density =
      a2 / (2 * std::numbers::pi_v<float> * d * d * (nv + square_root(a2 + (1.0f - a2) * nv * nv)));
  return a < kSharp ? T{} + 1e18f : density;
}

/// Returns the GGX lobe of a surface, as in shaders/light.glsl. a: roughness^2; nl, nv, nh: cosines between
/// the normal and the directions to the light and to the eye, and the half vector.
template <class T>
T lobe_of(T a, T nl, T nv, T nh) {
  const T a2 = a * a, d = nh * nh * (a2 - 1.0f) + 1.0f;
  const T mean = 2.0f * nl * nv * (1.0f - a) + (nl + nv) * a;
  return a2 / (d * d) * 0.5f / larger(mean, T{} + 1e-6f);
}

/// Returns the weight of a direction that one sampling technique chose with density a, if another technique
/// chooses it with density b: the power heuristic (E. Veach, "Robust Monte Carlo Methods", 1997).
template <class T>
T power_heuristic(T a, T b) {
  return a * a / (a * a + b * b + 1e-30f);
}

struct LightTracer::Path {
  Vector3f from, direction;
  float cone;                     ///< angle of the cone of directions that the ray represents [rad]
  float width = 0;                ///< width of the area that the ray represents at its origin [m]
  Vector3f fraction = {1, 1, 1};  ///< throughput of the path per channel
  bool mirrored = false;          ///< whether mirrors have reflected the path so far
  /// Whether the path shows a picture in a mirror or behind glass; false after a diffuse surface.
  bool is_picture = false;
  int bounces = 0;        ///< number of diffuse surfaces that radiance() has followed the path from
  bool branched = false;  ///< whether the path is the mirror image of a varnished surface in a picture
  int splits = 1;         ///< number of paths that leave the first diffuse surface
  /// If not null, the first diffuse surface and its indirect light are stored there, and the light is not
  /// part of the result.
  MirroredSurface* shown = nullptr;
  /// Number of glass surfaces, before the first diffuse surface, at which both the reflected and the
  /// refracted path are followed.
  int forks = 0;
  MetParticles particles = MetParticles::none;  ///< particles that are visible along the path
  bool from_background =
      false;  ///< whether the path shows a transparent background if it leaves the scene unmirrored
  /// Whether the directions depend on random numbers. Only such paths can cause bright dots of noise, so only
  /// their light is limited.
  bool by_chance = false;
  /// Probability density of the direction [1/sr], if the bright part of the sky is also sampled as a lamp;
  /// otherwise negative.
  float density = -1;
  /// Position and normal of the last point at which glowing meshes are also sampled directly. It is on a
  /// diffuse surface, or in the air with a normal of zero.
  Vector3f sampled_place = Vector3f::Zero(), sampled_normal = Vector3f::Zero();
  bool glow_is_sampled = false;  ///< whether there was such a point

  /// Continues the path from a diffuse surface, or from a point in the air if `normal` is zero.
  void scatter(const Vector3f& normal, const Vector3f& outgoing) {
    sampled_place = from;
    sampled_normal = normal;
    glow_is_sampled = true;
    particles = MetParticles::none;
    is_picture = false;
    forks = 0;
    direction = outgoing;
    by_chance = true;
    density = -1;
  }
  /// Returns the weight of emitted light that the path hits by chance, in [0, 1]; Glow::sample() finds the
  /// rest.
  float fraction_of_glow(const Hit& hit, const Glow& glow) const {
    if (glow.empty() || !glow_is_sampled) return 1;
    const Vector3f outgoing = (hit.position - sampled_place).normalized();
    const float own = sampled_normal.isZero()
                          ? kEvenDensity
                          : std::max(outgoing.dot(sampled_normal), 1e-3f) / std::numbers::pi_v<float>;
    return own / (own + glow.density(sampled_place, sampled_normal, hit));
  }
  /// Continues the path from a surface in a reflected direction.
  void turn(const Vector3f& outgoing, const Hit& hit) {
    mirrored = true;
    density = -1;
    glow_is_sampled = false;
    direction = outgoing.dot(hit.face) > 0 ? outgoing : reflected(outgoing, hit.face);
    from = off_surface(hit.position, hit.face);
  }
};

}  // namespace offstage::render
