#include "render/trace/light_tracer.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "render/frame.h"

namespace offstage::render {
namespace {

constexpr float kFar = 1e9f;      // [m]; nothing is farther away
constexpr int kMostBounces = 16;  // between diffuse surfaces
constexpr int kMostSteps = 32;    // along a path, mirrors and glass included
constexpr int kRowsPerTask = 8;
constexpr float kBrightest =
    50;  // of light that arrives after bounces; brighter samples would stay visible as dots
constexpr float kSmoothMetal = 0.35f;  // with less roughness, a path goes on in the mirrored direction

std::size_t index_of(int x, int y, int width) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
}

Vector3f from_octahedral(float x, float y) {
  Vector3f n(x, 1 - std::abs(x) - std::abs(y), y);
  if (n.y() < 0) {
    const float nx = (1 - std::abs(n.z())) * (n.x() < 0 ? -1.0f : 1.0f);
    n.z() = (1 - std::abs(n.x())) * (n.z() < 0 ? -1.0f : 1.0f);
    n.x() = nx;
  }
  return n.normalized();
}

float unpacked(uint16_t v) {
  return static_cast<float>(v) * (2.0f / 65535) - 1;
}

/// Any two directions across n (T. Duff et al., "Building an Orthonormal Basis, Revisited", 2017).
void basis(const Vector3f& n, Vector3f& a, Vector3f& b) {
  const float sign = std::copysign(1.0f, n.z());
  const float s = -1 / (sign + n.z()), t = n.x() * n.y() * s;
  a = {1 + sign * n.x() * n.x() * s, sign * t, -sign * n.x()};
  b = {t, sign + n.y() * n.y() * s, -n.y()};
}

/// Maps the unit square to the unit disc with equal areas (Shirley and Chiu, 1997). Sine and cosine of angles
/// up to pi / 4 are short series, with an error below 4e-6.
Vector2f disc(const Vector2f& uv) {
  const float x = 2 * uv.x() - 1, y = 2 * uv.y() - 1;
  const bool wide = std::abs(x) > std::abs(y);
  const float radius = wide ? x : y, other = wide ? y : x;
  if (radius == 0) return Vector2f::Zero();
  const float angle = 0.25f * std::numbers::pi_v<float> * (other / radius), a2 = angle * angle;
  const float sine = angle * (1 - a2 / 6 * (1 - a2 / 20 * (1 - a2 / 42)));
  const float cosine = 1 - a2 / 2 * (1 - a2 / 12 * (1 - a2 / 30));
  return wide ? Vector2f(radius * cosine, radius * sine) : Vector2f(radius * sine, radius * cosine);
}

/// A direction around n, with a density in proportion to the cosine.
Vector3f cosine_direction(const Vector3f& n, const Vector2f& uv) {
  const Vector2f d = disc(uv);
  Vector3f a, b;
  basis(n, a, b);
  return (d.x() * a + d.y() * b + std::sqrt(std::max(1 - d.squaredNorm(), 0.0f)) * n).normalized();
}

/// A normal of the microfacets that are visible from `view`, for GGX with a = roughness^2 (J. Dupuy and
/// A. Benyoub, "Sampling Visible GGX Normals with Spherical Caps", 2023).
Vector3f visible_facet(const Vector3f& n, const Vector3f& view, float a, const Vector2f& uv) {
  Vector3f x, y;
  basis(n, x, y);
  const Vector3f local(view.dot(x), view.dot(y), std::max(view.dot(n), 1e-3f));
  const Vector3f stretched = Vector3f(a * local.x(), a * local.y(), local.z()).normalized();
  const float angle = 2 * std::numbers::pi_v<float> * uv.x();
  const float z = (1 - uv.y()) * (1 + stretched.z()) - stretched.z();
  const float r = std::sqrt(std::clamp(1 - z * z, 0.0f, 1.0f));
  const Vector3f h = Vector3f(r * std::cos(angle), r * std::sin(angle), z) + stretched;
  const Vector3f facet = Vector3f(a * h.x(), a * h.y(), std::max(h.z(), 1e-6f)).normalized();
  return facet.x() * x + facet.y() * y + facet.z() * n;
}

Vector3f reflected(const Vector3f& direction, const Vector3f& n) {
  return direction - 2 * direction.dot(n) * n;
}

float fresnel_of_glass(float cosine, float ratio) {
  const float sine2 = ratio * ratio * (1 - cosine * cosine);
  if (sine2 >= 1) return 1;
  const float t = std::sqrt(1 - sine2);
  const float s = (ratio * cosine - t) / (ratio * cosine + t),
              p = (cosine - ratio * t) / (cosine + ratio * t);
  return 0.5f * (s * s + p * p);
}

float lobe_of(float a, float nl, float nv, float nh) {
  const float a2 = a * a, d = nh * nh * (a2 - 1) + 1;
  const float mean = 2 * nl * nv * (1 - a) + (nl + nv) * a;
  return std::min(a2 / (d * d) * 0.5f / std::max(mean, 1e-6f), 40.0f);
}

}  // namespace

struct LightTracer::Point {
  Vector3f place, normal, face, view;
  float roughness = 0;
  bool mirrors = false, cloth = false;

  static bool read(const SurfaceBuffer& surfaces, std::size_t pixel, const Vector3f& eye, Point& point) {
    const Vector4f& place = surfaces.places[pixel];
    if (place.w() < 0) return false;
    float rest = place.w();
    point.cloth = rest >= SurfaceBuffer::kCloth;
    if (point.cloth) rest -= SurfaceBuffer::kCloth;
    point.mirrors = rest >= SurfaceBuffer::kMirrors;
    if (point.mirrors) rest -= SurfaceBuffer::kMirrors;
    point.roughness = rest;
    const std::array<uint16_t, 4>& n = surfaces.normals[pixel];
    point.normal = from_octahedral(unpacked(n[0]), unpacked(n[1]));
    point.face = from_octahedral(unpacked(n[2]), unpacked(n[3]));
    point.place = off_surface(place.head<3>(), point.face);
    point.view = (eye - place.head<3>()).normalized();
    return true;
  }
};

LightBuffer::LightBuffer(int width, int height)
    : width_px(width),
      height_px(height),
      direct_filter(width, height),
      around_filter((width + 1) / 2, (height + 1) / 2) {
  direct.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  mirrored.resize(direct.size());
  around.resize(static_cast<std::size_t>(half_width()) * static_cast<std::size_t>(half_height()));
  around_normals.resize(around.size());
}

LightTracer::LightTracer(const RayScene& scene, const LightSources& sources)
    : scene_(scene), sources_(sources) {
  const float radius = std::tan(0.5f * sources.sun.size_deg * std::numbers::pi_v<float> / 180);
  basis(sources.sky.sun_direction, sun_across_, sun_along_);
  sun_across_ *= radius;
  sun_along_ *= radius;
}

RayLamp::RayLamp(const Lamp& lamp) : def(lamp) {
  def.direction.normalize();
  Vector3f side = def.direction.cross(std::abs(def.direction.y()) < 0.99f ? Vector3f(Vector3f::UnitY())
                                                                          : Vector3f(Vector3f::UnitX()));
  right = side.normalized();
  up = right.cross(def.direction);
  if (def.cone_deg > 0) {
    const float half = 0.5f * def.cone_deg * std::numbers::pi_v<float> / 180;
    const float edge = std::cos(half), full = std::cos(half * (1 - std::clamp(def.softness, 0.02f, 1.0f)));
    cone_factor = 1 / (full - edge);
    cone_offset = -edge / (full - edge);
  }
}

Vector3f RayLamp::light(const Vector3f& place, const Vector2f& uv, Vector3f& towards, float& distance) const {
  Vector3f point = def.position;
  float share = 1, softening = 0;
  if (def.size.x() > 0) {
    point += (uv.x() - 0.5f) * def.size.x() * right + (uv.y() - 0.5f) * def.size.y() * up;
  } else {
    // The disc that the ball shows to the place.
    Vector3f a, b;
    const Vector3f axis = (place - def.position).normalized();
    basis(axis, a, b);
    const Vector2f d = disc(uv) * def.radius;
    point += d.x() * a + d.y() * b;
    softening = 0.25f * def.radius * def.radius;
  }
  const Vector3f way = point - place;
  distance = way.norm();
  towards = way / std::max(distance, 1e-12f);
  const float cosine = -towards.dot(def.direction);
  if (def.size.x() > 0) share = std::max(cosine, 0.0f);
  if (def.cone_deg > 0) share = std::clamp(cone_factor * cosine + cone_offset, 0.0f, 1.0f);
  return def.intensity * (share / (distance * distance + softening + 1e-12f));
}

// As the sky that the eye sees (shaders/sky.frag), without clouds and the sun's disc.
Vector3f LightTracer::sky_seen(const Vector3f& direction) const {
  if (direction.y() >= 0) return sky_radiance(sources_.sky, direction);
  const Vector3f level = Vector3f(direction.x(), 0, direction.z()).normalized();
  const Vector3f haze = level.allFinite() ? sky_radiance(sources_.sky, level) : sources_.sky.horizon;
  const float x = std::clamp((-direction.y() - 0.03f) / 0.47f, 0.0f, 1.0f), share = x * x * (3 - 2 * x);
  return haze + share * (sources_.sky.ground - haze);
}

float LightTracer::sun_visibility(const Vector3f& place, const Vector2f& uv) const {
  const Sun& sun = sources_.sun;
  float share = sources_.smoke != nullptr ? std::exp(-sources_.smoke->depth(place)) : 1.0f;
  if (!sun.shadows) return share;
  const Vector2f d = disc(uv);
  const Vector3f direction =
      (sources_.sky.sun_direction + d.x() * sun_across_ + d.y() * sun_along_).normalized();
  return share * scene_.transmittance(place, direction, kFar).mean();
}

// One lamp is chosen in proportion to its light without shadows.
Vector3f LightTracer::lamps_at(const Vector3f& place, const Vector3f& normal, const Vector3f& face,
                               PixelSampler& sampler) const {
  if (sources_.lamps.empty()) return Vector3f::Zero();
  const Vector2f choice = sampler.next(), uv = sampler.next();
  Vector3f kept = Vector3f::Zero(), kept_towards = Vector3f::Zero();
  float sum = 0, kept_weight = 0, kept_distance = 0, random = choice.x();
  bool shadows = false;
  for (const RayLamp& lamp : sources_.lamps) {
    Vector3f towards = Vector3f::Zero();
    float distance = 0;
    const Vector3f light = lamp.light(place, uv, towards, distance) * std::max(normal.dot(towards), 0.0f);
    const float weight = light.sum();
    if (!(weight > 0) || face.dot(towards) <= 0) continue;
    sum += weight;
    const float share = weight / sum;
    if (random < share) {
      random /= share;
      kept = light;
      kept_weight = weight;
      kept_towards = towards;
      kept_distance = distance;
      shadows = lamp.def.shadows;
    } else {
      random = (random - share) / (1 - share);
    }
  }
  if (kept_weight <= 0) return Vector3f::Zero();
  const Vector3f visible =
      shadows ? scene_.transmittance(place, kept_towards, kept_distance) : Vector3f(Vector3f::Ones());
  return kept.cwiseProduct(visible) * (sum / kept_weight);
}

Vector3f LightTracer::radiance(Vector3f from, Vector3f direction, float cone, PixelSampler& sampler,
                               float* met) const {
  Vector3f sum = Vector3f::Zero(), share = Vector3f::Ones();
  float travelled = 0;
  bool sharp = cone < 0.1f;
  int bounces = 0;
  for (int step = 0; step < kMostSteps; ++step) {
    Hit hit;
    if (!scene_.first_hit(from, direction, kFar, hit))
      return sum + share.cwiseProduct(sharp ? sky_seen(direction) : sky_radiance(sources_.sky, direction));
    if (step == 0 && met != nullptr) *met = hit.distance;
    travelled += hit.distance;
    if (sources_.fog > 0) {
      const float clear = std::exp(-sources_.fog * hit.distance);
      sum += share.cwiseProduct(sky_seen(direction)) * (1 - clear);
      share *= clear;
    }
    const RayMaterial& material = *hit.material;
    const Vector4f color = material.color(hit, travelled * cone);
    const Vector2f choice = sampler.next();
    float random = choice.x();
    if (random >= color.w()) {  // through a hole, or a translucent surface
      from = off_surface(hit.position, -hit.face);
      continue;
    }
    random /= color.w();
    const Vector3f albedo = color.head<3>();
    if (material.unlit) return sum + share.cwiseProduct(albedo);
    sum += share.cwiseProduct(material.emission);
    if (random < material.transmission) {
      const float ratio = hit.front ? 1 / material.refraction : material.refraction;
      const float cosine = std::min(-hit.normal.dot(direction), 1.0f);
      const float mirrored = fresnel_of_glass(cosine, material.thin ? 1 / material.refraction : ratio);
      if (choice.y() < mirrored) {
        direction = reflected(direction, hit.normal);
        from = off_surface(hit.position, hit.face);
        if (direction.dot(hit.face) <= 0) direction = reflected(direction, hit.face);
        continue;
      }
      share = share.cwiseProduct(albedo.cwiseMax(0).cwiseSqrt());
      if (material.thin) share = share.cwiseProduct(albedo.cwiseMax(0).cwiseSqrt());
      const float sine2 = ratio * ratio * std::max(1 - cosine * cosine, 0.0f);
      if (!material.thin)
        direction = (ratio * direction + (ratio * cosine - std::sqrt(std::max(1 - sine2, 0.0f))) * hit.normal)
                        .normalized();
      from = off_surface(hit.position, -hit.face);
      continue;
    }
    from = off_surface(hit.position, hit.face);
    const float cosine = std::min(-hit.normal.dot(direction), 1.0f), m = 1 - cosine;
    const float fresnel = 0.04f + 0.96f * m * m * m * m * m;
    const bool metal = material.metallic > 0.5f;
    const bool smooth = material.roughness < kSmoothMetal;
    if (smooth && (metal || (sharp && choice.y() < fresnel))) {
      const float a = std::max(material.roughness * material.roughness, bounces > 0 ? 0.04f : 1e-4f);
      const Vector3f facet = visible_facet(hit.normal, -direction, a, sampler.next());
      direction = reflected(direction, facet);
      if (direction.dot(hit.face) <= 0) direction = reflected(direction, hit.face);
      if (metal) share = share.cwiseProduct(albedo + (Vector3f::Ones() - albedo) * (m * m * m * m * m));
      continue;
    }
    const Vector3f& n = hit.normal;
    Vector3f direct = Vector3f::Zero();
    const float towards_sun = n.dot(sources_.sky.sun_direction);
    const Vector2f on_sun = sampler.next();
    if (towards_sun > 0 && sources_.sun.intensity > 0)
      direct += sources_.sun.intensity * towards_sun * sun_visibility(from, on_sun) * sources_.sun.color;
    direct += lamps_at(from, n, hit.face, sampler);
    share = share.cwiseProduct(albedo);
    sum += share.cwiseProduct(direct);
    // Paths end at random in proportion to the light that they can still carry.
    const float survives = std::min(share.maxCoeff(), 0.95f);
    const Vector2f end = sampler.next();
    if (++bounces >= kMostBounces || end.x() >= survives) return sum;
    share /= survives;
    direction = cosine_direction(n, sampler.next());
    if (direction.dot(hit.face) <= 0) direction = reflected(direction, hit.face);
    sharp = false;
    cone = 0.5f;
  }
  return sum;
}

void LightTracer::trace_direct(const Point& point, PixelSampler& sampler, Vector4f& direct,
                               Vector4f& highlight) const {
  const Vector2f on_sun = sampler.next();
  const float towards_sun = point.normal.dot(sources_.sky.sun_direction);
  direct.setZero();
  if (point.cloth) {  // lit through
    const Vector3f place = towards_sun * point.face.dot(point.normal) < 0
                               ? off_surface(point.place, -3 * point.face)
                               : point.place;
    direct.x() = sun_visibility(place, on_sun);
  } else if (towards_sun > 0 && sources_.sun.intensity > 0) {
    direct.x() = sun_visibility(point.place, on_sun);
  }
  if (sources_.lamps.empty()) return;
  const Vector3f& n = point.normal;
  const float nv = std::max(std::abs(n.dot(point.view)), 1e-3f);
  Vector3f lobes = Vector3f::Zero();
  float grazing = 0;
  for (const RayLamp& lamp : sources_.lamps) {
    Vector3f towards = Vector3f::Zero();
    float distance = 0;
    Vector3f light = lamp.light(point.place, sampler.next(), towards, distance);
    const float nl = n.dot(towards);
    if (nl <= 0 || !(light.sum() > 0)) continue;
    if (lamp.def.shadows && point.face.dot(towards) > 0)
      light = light.cwiseProduct(scene_.transmittance(point.place, towards, distance));
    light *= nl;
    direct.tail<3>() += light;
    const Vector3f h = (towards + point.view).normalized();
    const float a = std::min(std::max(point.roughness * point.roughness,
                                      0.5f * lamp.def.radius / std::max(distance, 1e-6f) + 0.002f),
                             1.0f);
    const float m = 1 - std::clamp(point.view.dot(h), 0.0f, 1.0f);
    const Vector3f lobe = light * lobe_of(a, nl, nv, std::clamp(n.dot(h), 0.0f, 1.0f));
    lobes += lobe;
    grazing += lobe.sum() * m * m * m * m * m;
  }
  highlight << lobes, grazing / std::max(lobes.sum(), 1e-12f);
}

namespace {

// Mirror images that the roughness blurs anyway. Pixels of other surfaces are left out.
void smooth_rough_mirrors(const SurfaceBuffer& surfaces, const auto& for_rows, LightBuffer& light) {
  constexpr float kRough = 0.12f;
  const auto roughness = [&](std::size_t pixel) {
    const float w = surfaces.places[pixel].w();
    return w - (w >= SurfaceBuffer::kCloth ? SurfaceBuffer::kCloth : 0) - SurfaceBuffer::kMirrors;
  };
  const auto is_rough = [&](std::size_t pixel) {
    return light.mirrored[pixel].w() > 0 && roughness(pixel) > kRough;
  };
  bool any = false;
  for (std::size_t pixel = 0; pixel < light.mirrored.size() && !any; ++pixel) any = is_rough(pixel);
  if (!any) return;
  for_rows(light.width_px, light.height_px, [&](const auto& place) {
    const std::size_t pixel = index_of(place.x, place.y, light.width_px);
    if (is_rough(pixel))
      light.direct_filter.set_values(place.x, place.y, light.mirrored[pixel]);
    else
      light.direct_filter.clear(place.x, place.y);
  });
  for (const int step : {1, 2, 4}) light.direct_filter.average(step, 3);
  for_rows(light.width_px, light.height_px, [&](const auto& place) {
    const std::size_t pixel = index_of(place.x, place.y, light.width_px);
    const Vector4f mean = light.direct_filter.values(place.x, place.y);
    if (is_rough(pixel)) light.mirrored[pixel].head<3>() = mean.head<3>();
  });
}

}  // namespace

struct LightTracer::Place {
  int x, y;
  Vector3f eye, forward;
  float pixel_m;
  SampleOffsets offsets;
};

void LightTracer::trace_pixel(const SurfaceBuffer& surfaces, const Place& place, LightBuffer& light) const {
  const std::size_t pixel = index_of(place.x, place.y, surfaces.width_px);
  Vector4f direct = Vector4f::Zero(), highlight = Vector4f::Zero(), mirrored = Vector4f::Zero();
  Point point;
  if (Point::read(surfaces, pixel, place.eye, point)) {
    PixelSampler sampler(static_cast<uint32_t>(place.x), static_cast<uint32_t>(place.y), place.offsets.index,
                         place.offsets.count);
    trace_direct(point, sampler, direct, highlight);
    light.direct_filter.set(place.x, place.y, point.place, point.normal,
                            place.pixel_m * (point.place - place.eye).norm(), direct, 0);
    if (point.mirrors) {
      const float a = point.roughness * point.roughness;
      const Vector3f facet =
          a < 1e-4f ? point.normal : visible_facet(point.normal, point.view, a, sampler.next());
      Vector3f way = reflected(-point.view, facet);
      if (way.dot(point.face) <= 0) way = reflected(way, point.face);
      mirrored << radiance(point.place, way, std::max(a, place.pixel_m), sampler).cwiseMin(kBrightest), 1;
    }
  } else {
    light.direct_filter.clear(place.x, place.y);
  }
  light.mirrored[pixel] = mirrored;
  if (!light.highlights.empty()) light.highlights[pixel] = highlight;
}

// The light around is computed for one pixel of four, another one in each sub-frame.
void LightTracer::trace_around(const SurfaceBuffer& surfaces, const Place& place, LightBuffer& light) const {
  const int k = place.offsets.index;
  const int px = std::min(2 * place.x + (k & 1), surfaces.width_px - 1);
  const int py = std::min(2 * place.y + ((k >> 1 ^ k) & 1), surfaces.height_px - 1);
  const std::size_t cell = index_of(place.x, place.y, light.half_width());
  light.around[cell].setZero();
  light.around_filter.clear(place.x, place.y);
  Point point;
  if (!Point::read(surfaces, index_of(px, py, surfaces.width_px), place.eye, point)) return;
  PixelSampler sampler(static_cast<uint32_t>(place.x), static_cast<uint32_t>(place.y), place.offsets.index,
                       place.offsets.count);
  Vector3f way = cosine_direction(point.normal, sampler.next());
  if (way.dot(point.face) <= 0) way = reflected(way, point.face);
  float met = kFar;
  Vector4f value;
  value << radiance(point.place, way, 0.5f, sampler, &met).cwiseMin(kBrightest),
      place.forward.dot(point.place - place.eye);
  const float size = 2 * place.pixel_m * (point.place - place.eye).norm();
  light.around[cell] = value;
  light.around_normals[cell] << point.normal, 0;
  light.around_filter.set(place.x, place.y, point.place, point.normal, size, value,
                          1 / std::max(met, 4 * size));
}

void LightTracer::trace(const SurfaceBuffer& surfaces, const Vector3f& eye, const Vector3f& forward,
                        float pixel_m, const SampleOffsets& offsets, LightBuffer& light) const {
  light.highlights.resize(sources_.lamps.empty() ? 0 : light.direct.size());
  const auto for_rows = [&](int width, int height, const auto& each) {
    tbb::parallel_for(tbb::blocked_range<int>(0, height, kRowsPerTask), [&, width](const auto& rows) {
      Place place{0, 0, eye, forward, pixel_m, offsets};
      for (place.y = rows.begin(); place.y < rows.end(); ++place.y)
        for (place.x = 0; place.x < width; ++place.x) each(place);
    });
  };
  const int half_width = light.half_width(), half_height = light.half_height();
  for_rows(light.width_px, light.height_px, [&](const Place& place) { trace_pixel(surfaces, place, light); });
  for_rows(half_width, half_height, [&](const Place& place) { trace_around(surfaces, place, light); });
  light.direct_filter.average(1, sources_.lamps.empty() ? 1 : 4);
  light.around_filter.smooth_reach();
  const int widest = offsets.count >= 16 ? 4 : 8;
  for (int step = 1; step <= widest; step *= 2) light.around_filter.average(step, 3);
  for_rows(light.width_px, light.height_px, [&](const Place& place) {
    light.direct[index_of(place.x, place.y, light.width_px)] = light.direct_filter.values(place.x, place.y);
  });
  smooth_rough_mirrors(surfaces, for_rows, light);
  for_rows(half_width, half_height, [&](const Place& place) {
    Vector4f& value = light.around[index_of(place.x, place.y, half_width)];
    value.head<3>() = light.around_filter.values(place.x, place.y).head<3>();
  });
}

}  // namespace offstage::render
