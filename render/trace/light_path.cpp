#include "render/trace/light_path.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <tbb/parallel_for.h>

#include "render/opacity_grid.h"
#include "render/puff_light.h"
#include "render/smooth_surface.h"
#include "render/trace/air_field.h"
#include "render/trace/air_light.h"
#include "render/trace/packed_direction.h"

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

/// Returns the reflectance in all directions, as sky_reflectance() in shaders/light.glsl. `f0`: reflectance
/// at perpendicular incidence; `nv`: cosine between the normal and the direction to the eye.
Vector3f sky_reflectance(const Vector3f& f0, float roughness, float nv) {
  const Vector4f r =
      roughness * Vector4f(-1, -0.0275f, -0.572f, 0.022f) + Vector4f(1, 0.0425f, 1.04f, -0.04f);
  const float t = std::min(r.x() * r.x(), std::exp2(-9.28f * nv)) * r.x() + r.y();
  return f0 * (-1.04f * t + r.z()) + Vector3f::Constant(1.04f * t + r.w());
}

/// Returns Schlick's approximation of the Fresnel reflectance.
Vector3f fresnel_at(const Vector3f& f0, float cosine) {
  const float m = 1 - std::clamp(cosine, 0.0f, 1.0f), grazing = m * m * m * m * m;
  return f0 + (Vector3f::Ones() - f0) * grazing;
}

/// Returns the mean of the GGX distribution over a source, times pi, as mean_over_disc() in
/// shaders/light.glsl. `u`: square of the slope of the half vector; `disc`: square of the radius of the disc
/// of half vectors.
float mean_over_disc(float a2, float u, float disc) {
  const float x = disc / a2, sum = x < 0.01f ? 1 + 0.5f * x : x / (1 + x) + std::log(1 + x) / x;
  return a2 / ((a2 + std::max(u, disc)) * (a2 + std::max(u - disc, 0.0f)) * sum);
}

/// Returns the reflectance of a surface at perpendicular incidence.
Vector3f reflectance_at_right_angle(const RaySurface& surface) {
  return surface.reflectance + surface.metallic * (surface.color.head<3>() - surface.reflectance);
}

/// Returns the fraction of the mirrored light that an occlusion map leaves, as in shaders/mesh.frag.
float mirrored_fraction_of(float occlusion, float roughness, float nv) {
  if (occlusion >= 1) return 1;
  return std::clamp(std::pow(nv + occlusion, std::exp2(-16 * roughness - 1)) - 1 + occlusion, 0.0f, 1.0f);
}

/// Returns the cosine between the normal and the direction to the origin of the ray.
float facing_cosine(const Hit& hit, const Vector3f& direction) {
  return std::clamp(-hit.normal.dot(direction), 1e-3f, 1.0f);
}

/// Returns the fraction of light that the fibres of a sheen scatter from the sky; see with_layers() in
/// shaders/mesh.frag.
float sheen_in_sky(float nv) {
  const float grazing = 1 - nv;
  return 0.03f + 0.45f * grazing * grazing * grazing;
}

/// Returns the fraction of the sun's light that the fibres of a sheen scatter to the eye. `h`: half vector.
float sheen_in_sun(const Vector3f& normal, float nv, const Vector3f& h, const Vector3f& to_sun) {
  const float nl = std::max(normal.dot(to_sun), 0.0f), nh = std::clamp(normal.dot(h), 0.0f, 1.0f);
  const float sine2 = 1 - nh * nh;
  return 0.75f * sine2 * sine2 / (nl + nv - nl * nv);
}

/// The fractions of the light of a white surface that a surface in a picture sends to the eye.
struct Response {
  Vector3f sun, lamps, around;

  /// Returns the response of a surface that scatters the fraction `albedo` of all light.
  static Response scattered(const Vector3f& albedo) { return {albedo, albedo, albedo}; }
  /// Returns the response of a surface that a ray sees, as shade() in shaders/light.glsl and shade_fabric()
  /// in fabric.glsl. Rough surfaces mirror the light from all around.
  static Response seen(const Hit& hit, const RaySurface& surface, const Vector3f& direction,
                       const Vector3f& to_sun) {
    const Vector3f f0 = reflectance_at_right_angle(surface), one = Vector3f::Ones();
    const float nv = facing_cosine(hit, direction), from_sky = sheen_in_sky(nv);
    const Vector3f mirrored = sky_reflectance(f0, surface.roughness, nv);
    const Vector3f h = (to_sun - direction).normalized();
    Vector3f diffuse = (1 - surface.metallic) * surface.color.head<3>(), sheen;
    if (hit.is_cloth) {
      sheen = hit.material->fabric_sheen.cwiseProduct(surface.color.head<3>().cwiseSqrt());
      diffuse *= 1 - sheen.maxCoeff() * from_sky;
    } else {  // add_layers() has already removed the light that the sheen keeps from the surface
      sheen = hit.material->sheen_color;
      sheen /= 1 - sheen.maxCoeff() * from_sky;
    }
    Response result;
    result.sun = diffuse.cwiseProduct(one - fresnel_at(f0, -h.dot(direction)));
    result.lamps = result.around = diffuse.cwiseProduct(one - mirrored);
    if (surface.roughness >= kSmoothMetal) result.around += mirrored;
    if (sheen.maxCoeff() > 0) {
      result.sun += sheen_in_sun(hit.normal, nv, h, to_sun) * sheen;
      result.lamps += from_sky * sheen;
      result.around += from_sky * sheen;
    }
    result.around *= surface.occlusion;
    return result;
  }
};

float refraction_ratio(const Hit& hit) {
  return hit.front || hit.material->thin ? 1 / hit.material->refraction : hit.material->refraction;
}

}  // namespace

float mirrored_fraction(const Hit& hit, const Vector3f& direction) {
  return fresnel_of_glass(std::min(-hit.normal.dot(direction), 1.0f), refraction_ratio(hit));
}

bool is_rough_glass(float roughness) {
  return roughness * roughness >= kSharp;
}

Vector3f enter(const Hit& hit, float roughness, const Vector3f& albedo, PixelSampler& sampler, Vector3f& from,
               Vector3f& direction) {
  from = off_surface(hit.position, -hit.face);
  const Vector3f color = albedo.cwiseMax(0);
  const float a = roughness * roughness;
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

Vector3f LightTracer::sun_visibility(const Vector3f& place, const SquarePoint<float>& uv) const {
  const float fraction = sources_.smoke != nullptr ? std::exp(-sources_.smoke->depth(place)) : 1.0f;
  if (!sources_.sun.shadows) return Vector3f::Constant(fraction);
  return fraction * scene_.transmittance(place, sun_disc_.direction(uv), kFar);
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
  static const OpacityGrid no_smoke;
  const SmokeLight smoke{sources_.smoke != nullptr ? *sources_.smoke : no_smoke, air, around,
                         sources_.sky.sun_direction, sources_.sun.intensity * sources_.sun.color};
  for (RayParticleSet* set : sets) {
    set->light.resize(set->size());
    tbb::parallel_for(std::size_t{0}, set->size(), [&](std::size_t i) {
      const Vector3f place = set->center(i);
      const float radius = set->radius(i), number = set->numbers[i];
      set->light[i] = set->scattering == Scattering::puff
                          ? smoke.of_puff(place, radius, set->colors[i].head<3>(), number)
                          : smoke.of_particle(set->scattering, place, radius, number);
    });
  }
}

// Adds the light of the particles on a segment of a path, and reduces its throughput.
void LightTracer::meet_particles(float length, Path& path, FoundLight& found) const {
  const ParticlesOnRay met = sources_.particles->along(path.from, path.direction, length, path.particles,
                                                       {sources_.sky.sun_direction, sources_.fog});
  (path.by_chance ? found.noisy : found.certain) += path.fraction.cwiseProduct(met.radiance);
  path.fraction *= met.transmittance;
}

// Returns the origin of a shadow ray from a surface in a picture; see lift().
Vector3f LightTracer::start_of_shadow(const Hit& hit, const Vector3f& from, const Vector3f& towards) const {
  return hit.is_cloth || hit.face.dot(towards) >= kGrazing ? from : scene_.smooth_place(hit);
}

// Returns the light of lamps on a white surface. `in_picture`: by a shadow ray to each of them, if there are
// few; else by one shadow ray to a lamp that is chosen at random, in proportion to its light without shadows.
Vector3f LightTracer::lamps_at(const Hit& hit, const Vector3f& from, PixelSampler& sampler,
                               bool in_picture) const {
  constexpr std::size_t kFewLamps = 8;
  if (sources_.lamps.empty()) return Vector3f::Zero();
  const bool each = in_picture && sources_.lamps.size() <= kFewLamps;
  WeightedChoice choice(sampler.next().x);
  const SquarePoint<float> uv = sampler.next();
  const auto light = [&](const RayLamp& lamp, const LampPoint<float>& point) {
    const Vector3f towards = to_eigen(point.towards);
    const Vector3f arriving = std::max(hit.normal.dot(towards), 0.0f) * to_eigen(point.arriving);
    if (!lamp.def().shadows) return arriving;
    const Vector3f start = in_picture ? start_of_shadow(hit, from, towards) : from;
    return Vector3f(arriving.cwiseProduct(scene_.transmittance(start, towards, point.distance)));
  };
  Vector3f sum = Vector3f::Zero();
  const RayLamp* kept = nullptr;
  LampPoint<float> kept_point{};
  for (const RayLamp& lamp : sources_.lamps) {
    const LampPoint<float> point = lamp.point(from_eigen(from), uv);
    const Vector3f towards = to_eigen(point.towards);
    const float weight = std::max(hit.normal.dot(towards), 0.0f) * to_eigen(point.arriving).sum();
    const bool behind = hit.face.dot(towards) <= 0 && (hit.is_cloth || !in_picture);
    if (!(weight > 0) || behind) continue;
    if (each) sum += light(lamp, point);
    if (each || !choice.take(weight)) continue;
    kept = &lamp;
    kept_point = point;
  }
  return kept == nullptr ? sum : Vector3f(light(*kept, kept_point) * (choice.sum() / choice.weight()));
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

Vector3f VisibleLight::lamps(int pixel, const Vector3f& traced, const Vector3f& normal) const {
  if (light_.lamps.empty()) return Vector3f::Zero();
  const Vector4f& light = light_.lamps[static_cast<std::size_t>(pixel)];
  return lamp_relief(unpacked_direction(light.w()), traced, normal) * light.head<3>();
}

// Refracts or reflects a path at a glass surface, and adds the light that the surface scatters. Returns false
// if the surface is not glass. To reduce noise, a reflection of less than a tenth is not followed: outside of
// the glass it shows the sky, and inside its light is added to the refracted light. For the same reason, both
// paths are followed at the first surfaces behind the visible one: the rim of a ball was dotted, because it
// reflects between a tenth and all of the light inside.
bool LightTracer::follow_glass(const Hit& hit, const RaySurface& surface, PixelSampler& sampler,
                               const VisibleLight* visible, Path& path, FoundLight& found) const {
  if (surface.transmission <= 0) return false;
  const Vector3f albedo = surface.color.head<3>();
  if (hit.front && surface.transmission < 1) {
    const Vector3f light = direct_light(hit, off_surface(hit.position, hit.face), sampler, false).sum() +
                           sources_.open_air.at(hit.normal);
    found.noisy += (1 - surface.transmission) * path.fraction.cwiseProduct(albedo).cwiseProduct(light);
    path.fraction *= surface.transmission;
  }
  const float mirrored = mirrored_fraction(hit, path.direction);
  const Vector3f mirrored_direction = reflected(path.direction, hit.normal);
  const bool forks = mirrored >= 0.1f && mirrored < 1 && path.forks > 0;
  if (forks) {
    --path.forks;
    Path branch = path;
    branch.shown = nullptr;
    branch.fraction *= mirrored;
    branch.turn(mirrored_direction, hit);
    found.add(radiance(branch, sampler, visible));
    path.fraction *= 1 - mirrored;
  } else if (mirrored >= 0.1f && sampler.next().x < mirrored) {
    path.turn(mirrored_direction, hit);
    path.by_chance |= mirrored < 0.5f;  // the more likely choice causes no bright dots
    return true;
  }
  const bool came_by_chance = path.by_chance;
  path.by_chance |= (mirrored >= 0.5f && !forks) || is_rough_glass(surface.roughness);
  if (mirrored < 0.1f && hit.front) {
    (came_by_chance ? found.noisy : found.certain) +=
        mirrored * path.fraction.cwiseProduct(sky_radiance(sources_.sky, mirrored_direction));
    path.fraction *= 1 - mirrored;
  }
  path.fraction =
      path.fraction.cwiseProduct(enter(hit, surface.roughness, albedo, sampler, path.from, path.direction));
  return true;
}

// Returns the light of a source that a surface mirrors. The lobe is the mean over the source, as sun_lobe()
// in shaders/light.glsl, so one point of the source is enough. `reflectance`: at perpendicular incidence.
Vector3f LightTracer::highlight(const Hit& hit, const LampPoint<float>& point, bool shadows, float roughness,
                                const Vector3f& reflectance) const {
  constexpr float kBrightest = 1e4f;
  const Vector3f to_eye = -hit.direction, from = off_surface(hit.position, hit.face);
  const Vector3f towards = to_eigen(point.towards), h = (towards + to_eye).normalized();
  const float nl = hit.normal.dot(towards), nv = facing_cosine(hit, hit.direction);
  if (nl <= 0 || hit.face.dot(towards) <= 0) return Vector3f::Zero();
  const float a = std::max(roughness * roughness, 1e-4f);
  const float disc = 0.25f / (std::numbers::pi_v<float> * std::max(point.density, 1e-12f));
  const float cosine = std::max(hit.normal.dot(h), 0.01f), cos2 = cosine * cosine;
  const float slope2 = (h - hit.normal * hit.normal.dot(h)).squaredNorm() / cos2;
  const float visibility = 0.5f / (2 * nl * nv * (1 - a) + (nl + nv) * a);
  const float lobe =
      nl * std::min(mean_over_disc(a * a, slope2, disc) / (cos2 * cos2) * visibility, kBrightest);
  const Vector3f light = lobe * fresnel_at(reflectance, h.dot(to_eye)).cwiseProduct(to_eigen(point.arriving));
  if (!shadows || light.maxCoeff() < kFaintest) return light;
  return light.cwiseProduct(scene_.transmittance(from, towards, point.distance));
}

Vector3f LightTracer::highlight_of_sun(const Hit& hit, float roughness, const Vector3f& reflectance) const {
  const Sun& sun = sources_.sun;
  if (sun.intensity <= 0) return Vector3f::Zero();
  const float radius = 0.5f * sun.size_deg * std::numbers::pi_v<float> / 180;
  return highlight(hit,
                   {from_eigen(sources_.sky.sun_direction), kFar, 1, from_eigen(sun.intensity * sun.color),
                    1 / (std::numbers::pi_v<float> * std::max(radius * radius, 1e-8f))},
                   sun.shadows, roughness, reflectance);
}

// Returns the light of sun and lamps that a surface in a picture mirrors.
Vector3f LightTracer::highlights(const Hit& hit, float roughness, const Vector3f& reflectance) const {
  Vector3f sum = highlight_of_sun(hit, roughness, reflectance);
  const Vector3f from = off_surface(hit.position, hit.face);
  Hit by_lamps = hit;
  by_lamps.normal = hit.lamp_normal;
  for (const RayLamp& lamp : sources_.lamps)
    if (!lamp.is_sky() && !lamp.def().in_mirrors)
      sum += highlight(by_lamps, lamp.point(from_eigen(from), {0.5f, 0.5f}), lamp.def().shadows, roughness,
                       reflectance);
  return sum;
}

// Returns the light of sun, lamps and glowing meshes on a white surface. `in_picture`: whether a mirror or
// glass shows the surface.
LightTracer::DirectLight LightTracer::direct_light(const Hit& hit, const Vector3f& from,
                                                   PixelSampler& sampler, bool in_picture) const {
  DirectLight result;
  const float towards_sun = hit.normal.dot(sources_.sky.sun_direction);
  const SquarePoint<float> on_sun = sampler.next();
  if (towards_sun > 0 && sources_.sun.intensity > 0) {
    const Vector3f start = in_picture ? start_of_shadow(hit, from, sources_.sky.sun_direction) : from;
    result.sun = (sources_.sun.intensity * towards_sun * sun_visibility(start, on_sun))
                     .cwiseProduct(sources_.sun.color);
  }
  result.lamps = lamps_at(hit, from, sampler, in_picture);
  result.glow = glow_at(from, hit.lamp_normal, hit.face, sampler);
  return result;
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

// Returns the sky in the mirrored direction, if nothing is in the way.
Vector3f LightTracer::mirrored_sky(const Hit& hit, const Path& path) const {
  Path sky = path;
  sky.turn(reflected(path.direction, hit.normal), hit);
  return sky_seen(sky.direction).cwiseProduct(scene_.transmittance(sky.from, sky.direction, kFar));
}

// Adds the light of the layers over a surface in a picture, as with_layers() in shaders/mesh.frag, and
// reduces the fraction of the path to that which the layers leave to the surface below.
void LightTracer::add_layers(const Hit& hit, Path& path, FoundLight& light) const {
  const RayMaterial& material = *hit.material;
  const float nv_of_sheen = facing_cosine(hit, path.direction);
  if (const float coat = material.clearcoat; coat > 0) {
    Hit over = hit;
    over.normal = hit.smooth_normal;
    const float nv = facing_cosine(over, path.direction);
    const float roughness = material.clearcoat_roughness;
    const Vector3f f0 = Vector3f::Constant(0.04f);
    (path.by_chance ? light.noisy : light.certain) +=
        coat *
        path.fraction.cwiseProduct(highlight_of_sun(over, roughness, f0) +
                                   sky_reflectance(f0, roughness, nv).cwiseProduct(mirrored_sky(over, path)));
    path.fraction *= 1 - coat * fresnel_at(f0, nv).x();
  }
  path.fraction *= 1 - material.sheen_color.maxCoeff() * sheen_in_sky(nv_of_sheen);
}

// Reflects a path at a smooth metal and returns true. At other smooth surfaces it adds the light that
// their varnish mirrors, if the path is sharp, and returns false.
bool LightTracer::follow_smooth(const Hit& hit, const RaySurface& surface, PixelSampler& sampler, bool sharp,
                                const VisibleLight* visible, Path& path, FoundLight& light) const {
  if (surface.roughness >= kSmoothMetal) return false;
  const float nv = facing_cosine(hit, path.direction);
  const Vector3f mirrored =
      mirrored_fraction_of(surface.occlusion, surface.roughness, nv) *
      (sharp ? sky_reflectance(reflectance_at_right_angle(surface), surface.roughness, nv)
             : fresnel_at(surface.color.head<3>(), -hit.normal.dot(path.direction)));
  if (surface.metallic > 0.5f) {
    const float a = std::max(surface.roughness * surface.roughness, path.bounces > 0 ? 0.04f : 1e-4f);
    path.by_chance |= a >= kSharp;
    path.turn(reflected(path.direction, visible_facet(hit.normal, -path.direction, a, sampler.next())), hit);
    path.fraction = path.fraction.cwiseProduct(mirrored);
    return true;
  }
  if (sharp) add_varnish(hit, surface, mirrored, sampler, visible, path, light);
  return false;
}

// Adds the light that a varnished surface in a picture mirrors: the scene, if the shaders would show it, too,
// and otherwise the sky. A varnished surface that is seen in another one mirrors only the sky. `mirrored`:
// fraction.
void LightTracer::add_varnish(const Hit& hit, const RaySurface& surface, const Vector3f& mirrored,
                              PixelSampler& sampler, const VisibleLight* visible, const Path& path,
                              FoundLight& light) const {
  if (path.branched || surface.roughness >= kMirrorRoughness) {
    (path.by_chance ? light.noisy : light.certain) +=
        path.fraction.cwiseProduct(mirrored).cwiseProduct(mirrored_sky(hit, path));
    return;
  }
  Path branch = path;
  branch.branched = true;
  branch.splits = 1;
  branch.shown = nullptr;
  branch.fraction = path.fraction.cwiseProduct(mirrored);
  const float a = surface.roughness * surface.roughness;
  branch.by_chance |= a >= kSharp;
  const Vector3f facet =
      a < kSharp ? hit.normal : visible_facet(hit.normal, -path.direction, a, sampler.next());
  branch.turn(reflected(path.direction, facet), hit);
  light.add(radiance(branch, sampler, visible));
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
  bool sharp = path.cone < 0.1f;
  for (int step = 0; step < kMostSteps; ++step) {
    Hit hit;
    const bool hits = path.is_picture ? scene_.first_seen(path.from, path.direction, kFar, hit)
                                      : scene_.first_hit(path.from, path.direction, kFar, hit);
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
    int pixel = visible != nullptr && sharp ? visible->find(hit) : -1;
    if (pixel >= 0 && visible->has_picture() && !path.mirrored) {
      add_source(visible->color(pixel));
      return light;
    }
    path.width += hit.distance * path.cone;
    if (sources_.fog > 0) {
      const float clear = std::exp(-sources_.fog * hit.distance);
      // In a picture, fog has the colour of the horizon in all directions, as in shaders/sky.glsl.
      const bool horizon = path.is_picture || sources_.sky.turned.picture;
      const Vector3f haze = horizon ? horizon_color(sources_.sky, path.direction) : sky_seen(path.direction);
      sum += path.fraction.cwiseProduct(haze) * (1 - clear);
      path.fraction *= clear;
    }
    const RayMaterial& material = *hit.material;
    const RaySurface surface = material.surface(hit, path.width, sharp);
    if (pixel < 0 && visible != nullptr && sharp && material.has_relief()) pixel = visible->find(hit);
    const Vector4f& color = surface.color;
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
    // Glass glows, and has layers and highlights, only on its front, as in the shaders.
    const bool is_shaded = hit.front || material.transmission <= 0;
    if (sharp && is_shaded && (material.clearcoat > 0 || material.sheen_color.maxCoeff() > 0))
      add_layers(hit, path, light);
    if (is_shaded && !material.mean_emission().isZero())
      (path.by_chance ? light.noisy : light.certain) +=
          path.fraction_of_glow(hit, sources_.glow) *
          path.fraction.cwiseProduct(material.emission_at(hit.uvs));
    if (sharp && is_shaded)
      (path.by_chance ? light.noisy : light.certain) +=
          path.fraction.cwiseProduct(highlights(hit, surface.roughness, reflectance_at_right_angle(surface)));
    if (follow_glass(hit, surface, sampler, visible, path, light)) continue;
    path.from = off_surface(hit.position, hit.face);
    if (follow_smooth(hit, surface, sampler, sharp, visible, path, light)) continue;
    Response response = sharp ? Response::seen(hit, surface, path.direction, sources_.sky.sun_direction)
                              : Response::scattered(albedo);
    if (pixel >= 0) {
      const Vector4f& arriving = visible->arriving(pixel);
      const float cosine = hit.normal.dot(sources_.sky.sun_direction), through = hit.translucency;
      const Vector3f sun = (sources_.sun.intensity * visible->sun(pixel)).cwiseProduct(sources_.sun.color);
      const Vector3f from_front =
          response.around.cwiseProduct(arriving.head<3>()) +
          response.lamps.cwiseProduct(visible->lamps(pixel, hit.lamp_normal, hit.normal)) +
          std::max(cosine, 0.0f) * response.sun.cwiseProduct(sun);
      const Vector3f from_behind =
          surface.transmitted.cwiseProduct(arriving.head<3>() + std::max(-cosine, 0.0f) * sun);
      sum += path.fraction.cwiseProduct((1 - through) * from_front + through * from_behind);
      return light;
    }
    if (hit.translucency > 0 && sampler.next().x < hit.translucency) {  // light from the other side
      hit.normal = -hit.normal;
      hit.lamp_normal = -hit.lamp_normal;
      hit.face = -hit.face;
      path.from = off_surface(hit.position, hit.face);
      response = Response::scattered(surface.transmitted);
    }
    if (response.lamps.isZero() && response.sun.isZero()) {
      sum += path.fraction.cwiseProduct(response.around)
                 .cwiseProduct(glow_at(path.from, hit.lamp_normal, hit.face, sampler));
    } else if (!sharp) {  // all fractions are equal
      sum += path.fraction.cwiseProduct(response.around)
                 .cwiseProduct(direct_light(hit, path.from, sampler, false).sum());
    } else {
      const DirectLight direct = direct_light(hit, path.from, sampler, true);
      sum += path.fraction.cwiseProduct(response.sun.cwiseProduct(direct.sun) +
                                        response.lamps.cwiseProduct(direct.lamps) +
                                        response.around.cwiseProduct(direct.glow));
    }
    path.fraction = path.fraction.cwiseProduct(response.around);
    if (path.splits > 1 || path.shown != nullptr) {
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

// Adds the light of several paths from a diffuse surface, or stores their mean with the surface.
void LightTracer::split(const Hit& hit, const Path& path, PixelSampler& sampler, FoundLight& light) const {
  const SquarePoint<float> first = sampler.next();
  const float share = 1 / static_cast<float>(path.splits);
  FoundLight around;
  float inverse_distance = 0;
  for (int k = 0; k < path.splits; ++k) {
    const Vector3f outgoing =
        to_eigen(cosine_direction(from_eigen(hit.normal), lattice_point(first, k, path.splits)));
    Path part = path;
    part.splits = 1;
    part.shown = nullptr;
    part.bounces = 1;
    part.cone = 0.5f;
    part.fraction = Vector3f::Ones();  // faint paths end early, which would cause bright dots
    part.scatter(hit.normal, outgoing.dot(hit.face) > 0 ? outgoing : reflected(outgoing, hit.face));
    float met = kFar;
    around.add(radiance(part, sampler, nullptr, &met), Vector3f::Constant(share));
    inverse_distance += share / std::max(met, 8 * path.width);
  }
  if (path.shown == nullptr) return light.add(around, path.fraction);
  LightSums sums;
  const Vector3f limited = around.limited(sums);
  path.shown->add({hit.position, hit.normal, path.fraction, limited, inverse_distance, sums});
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
