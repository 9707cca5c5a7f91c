#pragma once
/// Private: the paths of single rays, for light_path.cpp, which follows them, and light_tracer.cpp, which
/// starts them.

#include <numbers>

#include "render/trace/light_tracer.h"

namespace offstage::render {

inline constexpr float kFar = 1e9f;  // [m]; nothing is farther away
// Shadow rays end before the surface that glows, by more than their rounding.
inline constexpr float kBeforeGlow = 1 - 2e-5f;

inline std::size_t index_of(int x, int y, int width) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
}

/// Fraction of the light along a ray that a surface of glass mirrors.
float mirrored_fraction(const Hit& hit, const Vector3f& direction);

/// Whether rays that enter a piece of glass are scattered at random.
bool is_rough_glass(const RayMaterial& material);

/// Moves a ray through a surface of glass, which it refracts; returns the fraction of the light that the
/// colour leaves. A solid piece takes half of its colour, as a factor, where the ray enters, and half where
/// it leaves.
Vector3f enter(const Hit& hit, const Vector3f& albedo, PixelSampler& sampler, Vector3f& from,
               Vector3f& direction);

/// Radiance that a sample of a glowing mesh gives to a white surface, if nothing is between the two. It is
/// reduced by a weight, because rays that meet the mesh by chance contribute the rest of this light.
/// `normal`: shading normal of the surface; `face`: normal of its triangle.
Vector3f light_of_glow(const GlowSample& sample, const Vector3f& normal, const Vector3f& face);

/// Probability density of a direction, if all are equally likely [1/sr].
inline constexpr float kEvenDensity = 0.25f / std::numbers::pi_v<float>;

/// Surfaces with less roughness^2 mirror and refract a single direction.
inline constexpr float kSharp = 0.002f;

/// Probability density of a direction that visible_facet() mirrors, for a = roughness^2 [1/sr].
template <class T>
T mirror_density(T a, T nv, T nh) {
  const T a2 = a * a, d = nh * nh * (a2 - 1.0f) + 1.0f;
  const T density =
      a2 / (2 * std::numbers::pi_v<float> * d * d * (nv + square_root(a2 + (1.0f - a2) * nv * nv)));
  return a < kSharp ? T{} + 1e18f : density;
}

/// Weight of a direction that was found with density a, and could have been found in another way with density
/// b: the power heuristic (E. Veach, "Robust Monte Carlo Methods", 1997).
template <class T>
T power_heuristic(T a, T b) {
  return a * a / (a * a + b * b + 1e-30f);
}

struct LightTracer::Path {
  Vector3f from, direction;
  float cone;  ///< angle that the ray stands for [rad]
  Vector3f fraction = {1, 1, 1};
  bool mirrored = false;  ///< whether mirrors have reflected the path so far
  /// Whether its directions depend on random numbers. If not, its hits are a part of the picture at any
  /// brightness, and not dots of noise.
  bool by_chance = false;
  /// Probability density of the direction [1/sr] if the bright part of the sky was sampled, too; else
  /// negative.
  float density = -1;
  /// The last point whose light from glowing meshes is also sampled: on a diffuse surface with this normal,
  /// or in the air, where the normal is zero.
  Vector3f sampled_place = Vector3f::Zero(), sampled_normal = Vector3f::Zero();
  bool glow_is_sampled = false;  ///< whether there was such a point

  /// Leaves a diffuse surface, or a point in the air if the normal is zero.
  void scatter(const Vector3f& normal, const Vector3f& outgoing) {
    sampled_place = from;
    sampled_normal = normal;
    glow_is_sampled = true;
    direction = outgoing;
    by_chance = true;
    density = -1;
  }
  /// Weight of the glow that a ray meets by chance at a hit, because Glow::sample() finds the same light.
  float fraction_of_glow(const Hit& hit, const Glow& glow) const {
    if (glow.empty() || !glow_is_sampled) return 1;
    const Vector3f outgoing = (hit.position - sampled_place).normalized();
    const float own = sampled_normal.isZero()
                          ? kEvenDensity
                          : std::max(outgoing.dot(sampled_normal), 1e-3f) / std::numbers::pi_v<float>;
    return own / (own + glow.density(sampled_place, sampled_normal, hit));
  }
  /// Leaves a surface in a mirrored direction.
  void turn(const Vector3f& outgoing, const Hit& hit) {
    mirrored = true;
    density = -1;
    glow_is_sampled = false;
    direction = outgoing.dot(hit.face) > 0 ? outgoing : reflected(outgoing, hit.face);
    from = off_surface(hit.position, hit.face);
  }
};

}  // namespace offstage::render
