#include "render/puff_light.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace offstage::render {

ParticleLight SmokeLight::of_puff(const Vector3f& place, float radius, const Vector3f& albedo,
                                  float number) const {
  // The optical depth and its gradient are computed from the corners of a tetrahedron in the puff.
  static const std::array<Vector3f, 4> kCorners = {Vector3f(1, 1, 1), Vector3f(1, -1, -1),
                                                   Vector3f(-1, 1, -1), Vector3f(-1, -1, 1)};
  const float reach = std::max(0.5f * radius, 0.5f * grid.cell_m());
  float depth = 0;
  Vector3f slope = Vector3f::Zero();
  for (const Vector3f& corner : kCorners) {
    const float d = grid.depth(place + reach * corner);
    depth += 0.25f * d;
    slope += d / (4 * reach) * corner;
  }
  // Smoke above reduces the ambient light. The steps become longer, because distant smoke needs no detail.
  float above = 0, step = grid.cell_m();
  Vector3f p = place;
  for (int k = 0; k < 4 && !grid.empty(); ++k, step *= 2) {
    p.y() += step;
    above += step * grid.density(p);
  }

  const float white = albedo.maxCoeff();
  const float steepness = slope.norm();
  const float change = std::min(radius * steepness, 3.0f);
  const float middle = sun_fraction_in_smoke(depth, white), direct = std::exp(-depth);
  const float bright = sun_fraction_in_smoke(std::max(depth - change, 0.0f), white),
              dark = sun_fraction_in_smoke(depth + change, white);
  const Vector3f sun = air.sun(place, radius, number) * sun_radiance;
  const float sky_fraction = 0.25f + 0.75f * std::exp(-0.6f * above);

  const AirRadiance lit_around = around.at(place).light;
  ParticleLight light;
  light.forward = 0.9f * direct * sun;
  AirRadiance& result = light.diffuse;
  result.constant = 0.68f * middle * sun + sky_fraction * lit_around.constant;
  Vector3f towards_light = 0.36f * direct * to_sun;
  if (steepness > 1e-6f) towards_light -= 0.65f * (bright - dark) / steepness * slope;
  result.slope = sun * towards_light.transpose();
  air.for_each_lamp(place, radius, number, [&](const Vector3f& lamp, const Vector3f& towards) {
    result.constant += 0.3f * lamp;
    result.slope += 0.3f * lamp * towards.transpose();
  });
  result.slope += sky_fraction * lit_around.slope;
  return light;
}

ParticleLight SmokeLight::of_particle(Scattering scattering, const Vector3f& place, float radius,
                                      float number) const {
  const bool sprite = scattering == Scattering::sprite, drop = scattering == Scattering::drop;
  float fraction = air.sun(place, radius, number) * std::exp(-grid.depth(place));
  if (sprite) fraction = 0.2f + 0.8f * fraction;  // some light reaches the shadow of a cloud from all sides
  const float to_all_sides = sprite ? 0.45f : drop ? kDropAround : 0.4f;
  ParticleLight light{.diffuse = around.at(place).light,
                      .forward = (drop ? kDropForward : 0.8f) * fraction * sun_radiance};
  light.diffuse.constant += air.lamps_around(place, radius, number) + to_all_sides * fraction * sun_radiance;
  if (sprite) light.diffuse.slope += 0.35f * fraction * sun_radiance * to_sun.transpose();
  return light;
}

Vector3f PuffLight::ambient(const Vector3f& n) const {
  const std::array<float, 9> basis = sky_basis(n);
  Vector3f sum = Vector3f::Zero();
  for (std::size_t k = 0; k < basis.size(); ++k) sum += basis[k] * frame.irradiance_at(k);
  return sum.cwiseMax(0.0f);
}

Vector3f PuffLight::sky_reflection(const Vector3f& direction, float roughness) const {
  return sky_mirrored(sky, direction, roughness, ambient(direction));
}

Vector4f PuffLight::fog_to(const Vector3f& place) const {
  const Vector3f ray = place - frame.eye.head<3>();
  const float transmittance = std::exp(-frame.zenith.w() * ray.norm());
  Vector4f result;
  result << horizon_color(sky, ray) * (1 - transmittance), transmittance;
  return result;
}

}  // namespace offstage::render
