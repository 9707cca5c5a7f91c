#include "render/particle_rays.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace offstage::render {
namespace {

constexpr float kLeastRadius_px = 1;  // half the width of a cell of mirror images
constexpr float kDot = 1e-3f;         // length of the line of a dot, as a fraction of its diameter

/// Returns the radius with which a particle is drawn. The eye is at least as far from a mirror image as from
/// the particle.
float drawn_radius(const GpuPoint& point, const View& view, float pixel_m) {
  return std::max(point.position.w(),
                  kLeastRadius_px * pixel_m * (point.position.head<3>() - view.eye).norm());
}

void reserve(RayParticleSet& set, std::size_t count) {
  set.places.reserve(set.lines ? 2 * count : count);
  set.colors.reserve(count);
  set.numbers.reserve(count);
}

/// Returns the softness s of a disc with the mean opacity `mean`, which is the mean of coverage() in
/// shaders/points_shape.glsl over the disc, 1 - s + 0.3 s^2. The smallest mean is 0.3.
float softness_of_mean(float mean) {
  return (1 - std::sqrt(std::max(1 - 1.2f * (1 - mean), 0.16f))) / 0.6f;
}

RayParticleSet discs_of(const PointSet& set, const PuffsPass& puffs, const View& view, float pixel_m) {
  const bool fire = set.def.style == PointStyle::fire;
  RayParticleSet result;
  if (set.def.lit && !fire)
    result.scattering = set.is_puffs()                        ? Scattering::puff
                        : set.def.style == PointStyle::sprite ? Scattering::sprite
                                                              : Scattering::flake;
  result.cover = fire ? kFlameCover : set.def.additive ? 0.0f : 1.0f;
  result.softness = std::clamp(
      set.is_puffs() ? softness_of_mean(puffs.mean_cover(set.def.style)) : set.def.softness, 0.01f, 1.0f);
  reserve(result, set.points.size());
  for (std::size_t i = 0; i < set.points.size(); ++i) {
    const GpuPoint& point = set.points[i];
    const float drawn = drawn_radius(point, view, pixel_m), thinning = point.position.w() / drawn;
    Vector4f place = point.position, color = point.color;
    if (set.pictures) {
      const Vector4f mean = set.pictures->mean(static_cast<std::size_t>(set.turns[i].y()));
      if (!(mean.w() > 0)) continue;
      color = color.cwiseProduct(
          Vector4f(mean.x() / mean.w(), mean.y() / mean.w(), mean.z() / mean.w(), mean.w()));
    }
    place.w() = drawn;
    if (fire) color.head<3>() = color.head<3>().cwiseProduct(mean_radiance_of_flame(point.velocity.w()));
    color.w() = std::min(color.w(), 1.0f) * thinning * thinning;
    result.places.push_back(place);
    result.colors.push_back(color);
    result.numbers.push_back(point.velocity.w());
  }
  return result;
}

RayParticleSet lines_of(const PointSet& set, const View& view, float pixel_m) {
  RayParticleSet result{.lines = true};
  if (set.def.lit) result.scattering = Scattering::drop;
  result.cover = set.def.additive ? 0.0f : 1.0f;
  result.softness = std::clamp(set.def.softness, 0.01f, 1.0f);
  result.taper = set.def.taper;
  reserve(result, set.points.size());
  for (const GpuPoint& point : set.points) {
    const float drawn = drawn_radius(point, view, pixel_m);
    const Vector3f half_axis = 0.5f * set.def.stretch_s * point.velocity.head<3>();
    const float half_length = half_axis.norm();
    Vector4f along = Vector4f::Zero(), place = point.position, color = point.color;
    // The length of a streak includes its rounded ends. A streak at rest is a dot; rays meet no line without
    // a length.
    along.head<3>() = half_length > (1 + kDot) * drawn ? Vector3f((1 - drawn / half_length) * half_axis)
                                                       : Vector3f(0, kDot * drawn, 0);
    place.w() = drawn;
    color.w() = std::min(color.w(), 1.0f) * (point.position.w() / drawn);
    result.places.push_back(place + along);
    result.places.push_back(place - along);
    result.colors.push_back(color);
    result.numbers.push_back(point.velocity.w());
  }
  return result;
}

}  // namespace

std::vector<RayParticleSet> particles_for_rays(std::span<const PointSet* const> sets, const PuffsPass& puffs,
                                               const View& view, float pixel_m) {
  std::vector<RayParticleSet> result;
  for (const PointSet* set : sets)
    if (set->def.style != PointStyle::sphere)
      result.push_back(set->def.style == PointStyle::streak ? lines_of(*set, view, pixel_m)
                                                            : discs_of(*set, puffs, view, pixel_m));
  return result;
}

}  // namespace offstage::render
