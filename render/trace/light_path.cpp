#include "render/trace/light_path.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <tbb/parallel_for.h>

#include "render/opacity_grid.h"
#include "render/trace/air_field.h"
#include "render/trace/air_light.h"

namespace offstage::render {
namespace {

constexpr int kMostBounces = 16;       // largest number of diffuse surfaces on a path
constexpr int kMostSteps = 32;         // largest number of surfaces on a path, including mirrors and glass
constexpr int kAirRays = 8;            // rays from each point in the air
constexpr float kFaintest = 1e-3f;     // radiance of highlights that need no shadow ray
constexpr float kSmoothMetal = 0.35f;  // roughness of metals below which a path is reflected

float fresnel_of_glass(float cosine, float ratio) {
  const float sine2 = ratio * ratio * (1 - cosine * cosine);
  if (sine2 >= 1) return 1;
  const float t = std::sqrt(1 - sine2);
  const float s = (ratio * cosine - t) / (ratio * cosine + t),
              p = (cosine - ratio * t) / (cosine + ratio * t);
  return 0.5f * (s * s + p * p);
}

float refraction_ratio(const Hit& hit) {
  return hit.front || hit.material->thin ? 1 / hit.material->refraction : hit.material->refraction;
}

}  // namespace

float mirrored_fraction(const Hit& hit, const Vector3f& direction) {
  return fresnel_of_glass(std::min(-hit.normal.dot(direction), 1.0f), refraction_ratio(hit));
}

bool is_rough_glass(const RayMaterial& material) {
  return material.roughness * material.roughness >= kSharp;
}

Vector3f enter(const Hit& hit, const Vector3f& albedo, PixelSampler& sampler, Vector3f& from,
               Vector3f& direction) {
  from = off_surface(hit.position, -hit.face);
  const Vector3f color = albedo.cwiseMax(0);
  const float a = hit.material->roughness * hit.material->roughness;
  const bool smooth = a < 1e-3f;
  if (hit.material->thin && smooth) return color;
  const Vector3f n = smooth ? hit.normal : visible_facet(hit.normal, -direction, a, sampler.next());
  if (hit.material->thin) {  // a thin sheet spreads the transmitted light like its mirror image, but to the
                             // other side (KHR_materials_transmission)
    direction = reflected(reflected(direction, n), hit.normal);
    if (direction.dot(hit.face) >= 0) direction = reflected(direction, hit.face);
    return color;
  }
  const float ratio = refraction_ratio(hit), cosine = std::min(-n.dot(direction), 1.0f);
  const float sine2 = ratio * ratio * std::max(1 - cosine * cosine, 0.0f);
  const Vector3f refracted = ratio * direction + (ratio * cosine - std::sqrt(std::max(1 - sine2, 0.0f))) * n;
  direction = refracted.normalized();
  if (direction.dot(hit.face) >= 0)
    direction = reflected(direction, hit.face);  // smooth normals are not exact
  return color.cwiseSqrt();
}

Vector3f light_of_glow(const GlowSample& sample, const Vector3f& normal, const Vector3f& face) {
  const float cosine = normal.dot(sample.towards);
  if (!(sample.density > 0) || cosine <= 0 || face.dot(sample.towards) <= 0) return Vector3f::Zero();
  const float by_chance = cosine / std::numbers::pi_v<float>;
  return sample.radiance * (by_chance / (sample.density + by_chance));
}

// Returns the radiance of the sky as shaders/sky.frag draws it, without clouds and the sun's disc.
Vector3f LightTracer::sky_seen(const Vector3f& direction) const {
  if (direction.y() >= 0 || sources_.sky.turned.picture) return sky_radiance(sources_.sky, direction);
  const Vector3f level = Vector3f(direction.x(), 0, direction.z()).normalized();
  const Vector3f haze = level.allFinite() ? sky_radiance(sources_.sky, level) : sources_.sky.horizon;
  const float x = std::clamp((-direction.y() - 0.03f) / 0.47f, 0.0f, 1.0f), fraction = x * x * (3 - 2 * x);
  return haze + fraction * (sources_.sky.ground - haze);
}

// Returns the radiance of the sky for a ray that leaves the scene. The bright part of a sky picture is also
// sampled as a lamp at diffuse surfaces. Paths from diffuse surfaces therefore get its dim part only.
// `density`: see Path.
Vector3f LightTracer::sky_met(const Vector3f& direction, bool sharp, float density) const {
  const TurnedSky& turned = sources_.sky.turned;
  if (!turned.picture) return sharp ? sky_seen(direction) : sky_radiance(sources_.sky, direction);
  const Vector3f there = turned.to_picture(direction);
  if (!sharp && density < 0) return turned.intensity * turned.picture->dim(there);
  float fraction = 1;
  if (density >= 0)
    fraction -=
        turned.picture->bright_fraction(there) * power_heuristic(turned.picture->density(there), density);
  return fraction * turned.intensity * turned.picture->seen(there);
}

float LightTracer::sun_visibility(const Vector3f& place, const SquarePoint<float>& uv) const {
  const Sun& sun = sources_.sun;
  float fraction = sources_.smoke != nullptr ? std::exp(-sources_.smoke->depth(place)) : 1.0f;
  if (!sun.shadows) return fraction;
  return fraction * scene_.transmittance(place, sun_disc_.direction(uv), kFar).mean();
}

// Prepares particles for rays, before any ray is traced that can meet them. Computes their light.
void LightTracer::prepare_particles(MetParticles groups, const SampleOffsets& offsets) const {
  if (sources_.particles == nullptr || groups == MetParticles::none) return;
  const std::vector<RayParticleSet*> sets = sources_.particles->build(groups);
  std::vector<AirField::Ball> balls;
  for (const RayParticleSet* set : sets)
    for (std::size_t i = 0; i < set->size(); ++i) balls.push_back({set->center(i), set->numbers[i]});
  if (balls.empty()) return;
  const AirField around(*this, offsets, balls, sources_.open_air);
  const AirLight air(scene_, sources_, offsets);
  for (RayParticleSet* set : sets) {
    set->light.resize(set->size());
    tbb::parallel_for(std::size_t{0}, set->size(), [&](std::size_t i) {
      const Vector3f place = set->center(i);
      const float radius = set->radius(i), number = set->numbers[i];
      const float depth = sources_.smoke != nullptr ? sources_.smoke->depth(place) : 0.0f;
      const float arrives = set->scattering == Scattering::puff
                                ? sun_fraction_in_smoke(depth, set->colors[i].head<3>().maxCoeff())
                                : std::exp(-depth);
      set->light[i] << around.at(place).light.constant + air.lamps_around(place, radius, number),
          arrives * air.sun(place, radius, number);
    });
  }
}

// Adds the light of the particles on a segment of a path, and reduces its throughput.
void LightTracer::meet_particles(float length, Path& path, FoundLight& found) const {
  const ParticlesOnRay met = sources_.particles->along(
      path.from, path.direction, length, path.particles,
      {sources_.sky.sun_direction, sources_.sun.intensity * sources_.sun.color, sources_.fog});
  (path.by_chance ? found.noisy : found.certain) += path.fraction.cwiseProduct(met.radiance);
  path.fraction *= met.transmittance;
}

// Returns the light of lamps on a white surface, by one shadow ray. One lamp is chosen at random, in
// proportion to its light without shadows.
Vector3f LightTracer::lamps_at(const Vector3f& place, const Vector3f& normal, const Vector3f& face,
                               PixelSampler& sampler) const {
  if (sources_.lamps.empty()) return Vector3f::Zero();
  WeightedChoice choice(sampler.next().x);
  const SquarePoint<float> uv = sampler.next();
  const RayLamp* kept = nullptr;
  LampPoint<float> kept_point{};
  float kept_cosine = 0;
  for (const RayLamp& lamp : sources_.lamps) {
    const LampPoint<float> point = lamp.point(from_eigen(place), uv);
    const Vector3f towards = to_eigen(point.towards);
    const float cosine = std::max(normal.dot(towards), 0.0f);
    const float weight = cosine * to_eigen(point.arriving).sum();
    if (!(weight > 0) || face.dot(towards) <= 0 || !choice.take(weight)) continue;
    kept = &lamp;
    kept_point = point;
    kept_cosine = cosine;
  }
  if (kept == nullptr) return Vector3f::Zero();
  const Vector3f visible =
      kept->def().shadows ? scene_.transmittance(place, to_eigen(kept_point.towards), kept_point.distance)
                          : Vector3f(Vector3f::Ones());
  return to_eigen(kept_point.arriving).cwiseProduct(visible) * (kept_cosine * choice.sum() / choice.weight());
}

int VisibleLight::find(const Hit& hit) const {
  const LightGuide& guide = light_.pixels;
  const Vector4f clip = view_.clip_from_world * hit.position.homogeneous();
  if (!(clip.w() > 0)) return -1;
  const float x = (0.5f + 0.5f * clip.x() / clip.w()) * static_cast<float>(guide.width_px);
  const float y = (0.5f + 0.5f * clip.y() / clip.w()) * static_cast<float>(guide.height_px);
  if (!(x >= 0 && y >= 0 && x < static_cast<float>(guide.width_px) &&
        y < static_cast<float>(guide.height_px)))
    return -1;
  const int column = static_cast<int>(x), row = static_cast<int>(y);
  if (!guide.shows(column, row, hit.position, hit.normal)) return -1;
  return static_cast<int>(index_of(column, row, guide.width_px));
}

// The pixel at (x, y) in clip coordinates shows the directions d with row_x . d = x row_w . d and row_y . d =
// y row_w . d, where the rows are those of the matrix from world to clip coordinates.
Vector3f VisibleLight::direction_through(int x, int y) const {
  const Eigen::Matrix<double, 3, 4> rows = view_.clip_from_world.transpose().topRows<3>().cast<double>();
  const Eigen::Vector3d row_w = rows.col(3);
  const double clip_x = (2 * x + 1) / static_cast<double>(light_.pixels.width_px) - 1;
  const double clip_y = (2 * y + 1) / static_cast<double>(light_.pixels.height_px) - 1;
  const Eigen::Vector3d direction =
      (rows.col(0) - clip_x * row_w).cross(rows.col(1) - clip_y * row_w).normalized();
  return (row_w.dot(direction) > 0 ? direction : Eigen::Vector3d(-direction)).cast<float>();
}

Vector4f VisibleLight::arriving(int pixel) const {
  const auto k = static_cast<std::size_t>(pixel);
  Vector4f result = light_.arriving[k];
  if (!light_.lamps.empty()) result.head<3>() += light_.lamps[k].head<3>();
  return result;
}

// Refracts or reflects a path at a glass surface, and adds the light that the surface scatters. Returns false
// if the surface is not glass. To reduce noise, a reflection of less than a tenth is not followed: outside of
// the glass it shows the sky, and inside its light is added to the refracted light.
bool LightTracer::follow_glass(const Hit& hit, const Vector3f& albedo, PixelSampler& sampler, Path& path,
                               FoundLight& found) const {
  const RayMaterial& material = *hit.material;
  if (material.transmission <= 0) return false;
  if (hit.front && material.transmission < 1) {
    const Vector3f light =
        direct_light(hit, off_surface(hit.position, hit.face), sampler) + sky_met(hit.normal, false, -1);
    found.noisy += (1 - material.transmission) * path.fraction.cwiseProduct(albedo).cwiseProduct(light);
    path.fraction *= material.transmission;
  }
  const float mirrored = mirrored_fraction(hit, path.direction);
  const Vector3f mirrored_direction = reflected(path.direction, hit.normal);
  if (mirrored >= 0.1f && sampler.next().x < mirrored) {
    path.turn(mirrored_direction, hit);
    path.by_chance |= mirrored < 0.5f;  // the more likely choice causes no bright dots
    return true;
  }
  const bool came_by_chance = path.by_chance;
  path.by_chance |= mirrored >= 0.5f || is_rough_glass(material);
  if (mirrored < 0.1f && hit.front) {
    (came_by_chance ? found.noisy : found.certain) +=
        mirrored * path.fraction.cwiseProduct(sky_radiance(sources_.sky, mirrored_direction));
    path.fraction *= 1 - mirrored;
  }
  path.fraction = path.fraction.cwiseProduct(enter(hit, albedo, sampler, path.from, path.direction));
  return true;
}

// Returns the light of sun and lamps that a surface in a mirror image mirrors. Its lobe is widened by the
// size of the light source, so that one point of the source is enough.
Vector3f LightTracer::highlights(const Hit& hit, const Vector3f& albedo, const Path& path) const {
  const RayMaterial& material = *hit.material;
  const Vector3f to_eye = -path.direction, from = off_surface(hit.position, hit.face);
  const Vector3f f0 = material.metallic > 0.5f ? albedo : Vector3f(Vector3f::Constant(0.04f));
  const float a = material.roughness * material.roughness, nv = std::max(hit.normal.dot(to_eye), 1e-3f);
  Vector3f sum = Vector3f::Zero();
  const auto add = [&](const LampPoint<float>& point, bool shadows) {
    const Vector3f towards = to_eigen(point.towards), h = (towards + to_eye).normalized();
    const float nl = hit.normal.dot(towards);
    if (nl <= 0 || hit.face.dot(towards) <= 0) return;
    const float wide = 0.25f / (std::numbers::pi_v<float> * std::max(point.density, 1e-12f));
    const float lobe =
        nl * lobe_of(std::min(std::sqrt(a * a + wide), 1.0f), nl, nv, std::min(hit.normal.dot(h), 1.0f));
    const float m = 1 - std::clamp(h.dot(to_eye), 0.0f, 1.0f), grazing = m * m * m * m * m;
    const Vector3f light =
        lobe * (f0 + (Vector3f::Ones() - f0) * grazing).cwiseProduct(to_eigen(point.arriving));
    if (light.maxCoeff() < kFaintest) return;
    sum +=
        shadows ? Vector3f(light.cwiseProduct(scene_.transmittance(from, towards, point.distance))) : light;
  };
  const Sun& sun = sources_.sun;
  const float radius = 0.5f * sun.size_deg * std::numbers::pi_v<float> / 180;
  if (sun.intensity > 0)
    add({from_eigen(sources_.sky.sun_direction), kFar, 1, from_eigen(sun.intensity * sun.color),
         1 / (std::numbers::pi_v<float> * std::max(radius * radius, 1e-8f))},
        sun.shadows);
  for (const RayLamp& lamp : sources_.lamps)
    if (!lamp.is_sky() && !lamp.def().in_mirrors)
      add(lamp.point(from_eigen(from), {0.5f, 0.5f}), lamp.def().shadows);
  return sum;
}

// Returns the light of sun, lamps and glowing meshes on a white surface.
Vector3f LightTracer::direct_light(const Hit& hit, const Vector3f& from, PixelSampler& sampler) const {
  Vector3f result = Vector3f::Zero();
  const float towards_sun = hit.normal.dot(sources_.sky.sun_direction);
  const SquarePoint<float> on_sun = sampler.next();
  if (towards_sun > 0 && sources_.sun.intensity > 0)
    result = sources_.sun.intensity * towards_sun * sun_visibility(from, on_sun) * sources_.sun.color;
  return result + lamps_at(from, hit.normal, hit.face, sampler) +
         glow_at(from, hit.normal, hit.face, sampler);
}

Vector3f LightTracer::glow_at(const Vector3f& place, const Vector3f& normal, const Vector3f& face,
                              PixelSampler& sampler) const {
  if (sources_.glow.empty()) return Vector3f::Zero();
  const float choice = sampler.next().x;
  const GlowSample sample = sources_.glow.sample(place, normal, choice, sampler.next());
  const Vector3f light = light_of_glow(sample, normal, face);
  if (light.isZero()) return light;
  return light.cwiseProduct(scene_.transmittance(place, sample.towards, kBeforeGlow * sample.distance));
}

// Reflects a path at a smooth metal and returns true. At other smooth surfaces it adds the sky that their
// varnish reflects, if the path is sharp, and returns false.
bool LightTracer::follow_smooth(const Hit& hit, const Vector3f& albedo, PixelSampler& sampler, bool sharp,
                                bool scattered, Path& path, FoundLight& light) const {
  const RayMaterial& material = *hit.material;
  if (material.roughness >= kSmoothMetal) return false;
  const float m = 1 - std::min(-hit.normal.dot(path.direction), 1.0f), grazing = m * m * m * m * m;
  if (material.metallic > 0.5f) {
    const float a = std::max(material.roughness * material.roughness, scattered ? 0.04f : 1e-4f);
    path.by_chance |= a >= kSharp;
    path.turn(reflected(path.direction, visible_facet(hit.normal, -path.direction, a, sampler.next())), hit);
    path.fraction = path.fraction.cwiseProduct(albedo + (Vector3f::Ones() - albedo) * grazing);
    return true;
  }
  if (sharp) {  // in a mirror image, a varnished surface mirrors only the sky
    const float fresnel = 0.04f + 0.96f * grazing;
    Path sky = path;
    sky.turn(reflected(path.direction, hit.normal), hit);
    (path.by_chance ? light.noisy : light.certain) +=
        fresnel * path.fraction.cwiseProduct(sky_seen(sky.direction))
                      .cwiseProduct(scene_.transmittance(sky.from, sky.direction, kFar));
    path.fraction *= 1 - fresnel;
  }
  return false;
}

// Returns the radiance that arrives along a path. `met`, if not null, is set to the distance of the first hit
// [m]; without a hit it is not changed. A path is sharp until it reaches the first diffuse surface.
LightTracer::FoundLight LightTracer::radiance(Path path, PixelSampler& sampler, const VisibleLight* visible,
                                              float* met) const {
  FoundLight light;
  Vector3f& sum = light.noisy;
  // Adds radiance at the end of the path. It is not limited if the path has a density, because it has a
  // weight.
  const auto add_source = [&](const Vector3f& radiance) {
    (path.by_chance && path.density < 0 ? light.noisy : light.certain) +=
        path.fraction.cwiseProduct(radiance);
  };
  float travelled = 0;
  bool sharp = path.cone < 0.1f;
  for (int step = 0; step < kMostSteps; ++step) {
    Hit hit;
    const bool hits = scene_.first_hit(path.from, path.direction, kFar, hit);
    if (path.particles != MetParticles::none) meet_particles(hits ? hit.distance : kFar, path, light);
    if (!hits && path.from_background && sharp && !path.mirrored) {
      light.background = path.fraction.mean();
      return light;
    }
    if (!hits) {
      add_source(sky_met(path.direction, sharp, path.density));
      return light;
    }
    if (step == 0 && met != nullptr) *met = hit.distance;
    const int pixel = visible != nullptr && sharp ? visible->find(hit) : -1;
    if (pixel >= 0 && visible->has_picture() && !path.mirrored) {
      add_source(visible->color(pixel));
      return light;
    }
    travelled += hit.distance;
    if (sources_.fog > 0) {
      const float clear = std::exp(-sources_.fog * hit.distance);
      const Vector3f haze = sources_.sky.turned.picture ? horizon_color(sources_.sky, path.direction)
                                                        : sky_seen(path.direction);
      sum += path.fraction.cwiseProduct(haze) * (1 - clear);
      path.fraction *= clear;
    }
    const RayMaterial& material = *hit.material;
    const Vector4f color = material.color(hit, travelled * path.cone);
    path.by_chance |= color.w() > 0 && color.w() < 1;
    // The path passes through a hole or a translucent surface.
    if (color.w() < 1 && sampler.next().x >= color.w()) {
      path.from = off_surface(hit.position, -hit.face);
      continue;
    }
    const Vector3f albedo = color.head<3>();
    if (material.unlit) {
      sum += path.fraction.cwiseProduct(albedo);
      return light;
    }
    // Glass only glows on its front, as in the shaders.
    if ((hit.front || material.transmission <= 0) && !material.mean_emission().isZero())
      (path.by_chance ? light.noisy : light.certain) +=
          path.fraction_of_glow(hit, sources_.glow) *
          path.fraction.cwiseProduct(material.emission_at(hit.uv));
    const bool in_mirror = sharp && path.mirrored;
    if (in_mirror && (hit.front || material.transmission <= 0))
      (path.by_chance ? light.noisy : light.certain) +=
          path.fraction.cwiseProduct(highlights(hit, albedo, path));
    if (follow_glass(hit, albedo, sampler, path, light)) continue;
    path.from = off_surface(hit.position, hit.face);
    if (follow_smooth(hit, albedo, sampler, sharp, path.bounces > 0, path, light)) continue;
    path.fraction = path.fraction.cwiseProduct(albedo);
    const bool has_highlights_only = in_mirror && material.metallic > 0.5f;
    if (pixel >= 0 && has_highlights_only) {
      sum += path.fraction.cwiseProduct(visible->around(pixel));
      return light;
    }
    if (pixel >= 0) {
      const Vector4f arriving = visible->arriving(pixel);
      const float cosine = hit.normal.dot(sources_.sky.sun_direction);
      const float sun = sources_.sun.intensity * (std::max((1 - hit.translucency) * cosine, 0.0f) +
                                                  std::max(-hit.translucency * cosine, 0.0f));
      sum += path.fraction.cwiseProduct(arriving.head<3>() + sun * arriving.w() * sources_.sun.color);
      return light;
    }
    if (hit.translucency > 0 && sampler.next().x < hit.translucency) {  // light from the other side
      hit.normal = -hit.normal;
      hit.face = -hit.face;
      path.from = off_surface(hit.position, hit.face);
    }
    sum += path.fraction.cwiseProduct(has_highlights_only ? glow_at(path.from, hit.normal, hit.face, sampler)
                                                          : direct_light(hit, path.from, sampler));
    if (path.splits > 1) {
      split(hit, path, sampler, light);
      return light;
    }
    // Russian roulette: a path survives with a probability in proportion to its remaining light.
    const float survives = std::min(path.fraction.maxCoeff(), 0.95f);
    if (path.bounces + 1 >= kMostBounces || sampler.next().x >= survives) return light;
    path.fraction /= survives;
    const Vector3f outgoing = to_eigen(cosine_direction(from_eigen(hit.normal), sampler.next()));
    path.scatter(hit.normal, outgoing.dot(hit.face) > 0 ? outgoing : reflected(outgoing, hit.face));
    ++path.bounces;
    path.cone = 0.5f;
    sharp = false;
  }
  return light;
}

// Adds the light of several paths from a diffuse surface.
void LightTracer::split(const Hit& hit, const Path& path, PixelSampler& sampler, FoundLight& light) const {
  const SquarePoint<float> first = sampler.next();
  for (int k = 0; k < path.splits; ++k) {
    const Vector3f outgoing =
        to_eigen(cosine_direction(from_eigen(hit.normal), lattice_point(first, k, path.splits)));
    Path part = path;
    part.splits = 1;
    part.bounces = 1;
    part.cone = 0.5f;
    part.fraction /= static_cast<float>(path.splits);
    part.scatter(hit.normal, outgoing.dot(hit.face) > 0 ? outgoing : reflected(outgoing, hit.face));
    const FoundLight found = radiance(part, sampler);
    light.noisy += found.noisy;
    light.certain += found.certain;
  }
}

// The arriving fraction of the sky's light is the sum over the rays without a hit, divided by the sum over
// all rays. It multiplies the exact light `open`, so that unobstructed points have no noise.
AirLightAround LightTracer::trace_air(const Vector3f& place, float number, const SampleOffsets& offsets,
                                      const AirRadiance& open) const {
  const auto bits = static_cast<uint32_t>(number * 0x1p24f);
  AirRadiance all, arrived, from_objects;
  const auto add = [](AirRadiance& sum, const Vector3f& radiance, const Vector3f& direction) {
    sum.constant += radiance / kAirRays;
    sum.slope += 2.0f / kAirRays * radiance * direction.transpose();
  };
  float above = 0, above_arrived = 0;
  LightSums removed;  // not reported: the statistics are about surfaces
  for (int k = 0; k < kAirRays; ++k) {
    PixelSampler sampler(bits >> 12, bits & 4095, kAirRays * offsets.index + k, kAirRays * offsets.count);
    Path path{.from = place, .direction = even_direction(sampler.next()), .cone = 0.5f};
    path.scatter(Vector3f::Zero(), path.direction);
    const Vector3f direction = path.direction, there = sky_met(direction, false, -1);
    float met = kFar;
    const FoundLight found = radiance(path, sampler, nullptr, &met);
    const bool free = met == kFar;
    if (!free) add(from_objects, found.limited(removed), direction);
    if (free) add(arrived, there, direction);
    add(all, there, direction);
    if (direction.y() > 0) above += there.sum();
    if (direction.y() > 0 && free) above_arrived += there.sum();
  }
  if (!sources_.glow.empty()) {
    PixelSampler sampler(bits >> 12, bits & 4095, offsets.index, offsets.count);
    const float choice = sampler.next().x;
    const GlowSample sample = sources_.glow.sample(place, Vector3f::Zero(), choice, sampler.next());
    if (sample.density > 0) {
      const Vector3f seen = scene_.transmittance(place, sample.towards, kBeforeGlow * sample.distance);
      add(from_objects,
          kAirRays * kEvenDensity / (sample.density + kEvenDensity) * seen.cwiseProduct(sample.radiance),
          sample.towards);
    }
  }
  AirLightAround result{.light = {}, .sky = above > 0 ? above_arrived / above : 1};
  for (int c = 0; c < 3; ++c) {
    const float fraction = all.constant[c] > 0 ? arrived.constant[c] / all.constant[c] : 1;
    float& constant = result.light.constant[c];
    constant = fraction * open.constant[c] + from_objects.constant[c];
    auto slope = result.light.slope.row(c);
    slope = fraction * open.slope.row(c) + arrived.slope.row(c) - fraction * all.slope.row(c) +
            from_objects.slope.row(c);
    // With few rays, the slope can be so steep that the light from one side would be negative.
    const float steepness = slope.norm();
    if (steepness > constant) slope *= constant / steepness;
  }
  return result;
}

}  // namespace offstage::render
