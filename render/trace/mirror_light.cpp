#include <algorithm>
#include <bit>
#include <cmath>

#include "render/frame.h"
#include "render/trace/surface_rows.h"

namespace offstage::render {
namespace {

// Number of paths that leave the diffuse surfaces in a mirror image that is not filtered, or behind glass.
// Frames of many sub-frames need few.
constexpr int kMirrorSplits = 8, kMirrorSplitsOfMany = 2;
constexpr int kGlassForks = 2;  // see Path::forks
constexpr int kMirrorRays = 2;  // number of rays in a mirror image that is neither sharp nor filtered

/// Returns the particles that are visible in mirror images by a surface.
MetParticles particles_in_mirror(float roughness) {
  return roughness > kSharpMirror ? MetParticles::no_drops : MetParticles::all;
}

/// Returns the particles that are visible in mirror images by any of the surfaces.
MetParticles particles_in_mirrors(const SurfaceBuffer& surfaces) {
  MetParticles met = MetParticles::none;
  for (const Vector4f& place : surfaces.places) {
    if (place.w() < SurfaceBuffer::kMirrors) continue;
    met = std::max(met, particles_in_mirror(std::fmod(place.w(), SurfaceBuffer::kMirrors)));
    if (met == MetParticles::all) break;
  }
  return met;
}

}  // namespace

// Returns the light that a surface mirrors to the eye. `rays`: number of mirrored rays, if these differ;
// `splits`: number of paths that leave the diffuse surfaces that they meet.
Vector3f LightTracer::mirrored_light(const Point& point, const LightView& view, PixelSampler& sampler,
                                     const VisibleLight& visible, LightSums& sums, int rays,
                                     int splits) const {
  // A cone that is narrower than a pixel does not blur, and has no noise.
  if (point.roughness * point.roughness < std::min(view.pixel_m, kSharp))
    return mirrored_along(point, point.normal, view, sampler, visible, sums, splits);
  const SquarePoint<float> first = sampler.next();
  Vector3f sum = Vector3f::Zero();
  for (int k = 0; k < rays; ++k) {
    const Vector3f facet = visible_facet(point.normal, point.view, point.roughness * point.roughness,
                                         lattice_point(first, k, rays));
    sum += mirrored_along(point, facet, view, sampler, visible, sums, std::max(splits / rays, 1));
  }
  return sum / static_cast<float>(rays);
}

// Returns the light that a facet of a surface mirrors to the eye.
Vector3f LightTracer::mirrored_along(const Point& point, const Vector3f& facet, const LightView& view,
                                     PixelSampler& sampler, const VisibleLight& visible, LightSums& sums,
                                     int splits) const {
  const float a = point.roughness * point.roughness;
  Vector3f outgoing = reflected(-point.view, facet);
  if (outgoing.dot(point.face) <= 0) outgoing = reflected(outgoing, point.face);
  const float nv = std::max(point.normal.dot(point.view), 1e-3f);
  const float nh = std::clamp(point.normal.dot((outgoing + point.view).normalized()), 0.0f, 1.0f);
  const Path path{
      .from = point.place,
      .direction = outgoing,
      .cone = std::max(a, view.pixel_m),
      .width = view.pixel_m * (point.place - view.eye).norm(),
      .mirrored = true,
      .is_picture = true,
      .splits = splits,
      .particles = sources_.particles == nullptr ? MetParticles::none : particles_in_mirror(point.roughness),
      .by_chance = a >= kSharp,
      .density = mirror_density(a, nv, nh)};
  return radiance(path, sampler, &visible).limited(sums);
}

// Traces mirror images: per pixel for smooth metals, per cell for other surfaces.
void LightTracer::trace_mirrors(const SurfaceBuffer& surfaces, const LightView& view,
                                const VisibleLight& visible, LightBuffer& light) const {
  const int width = surfaces.width_px;
  if (sources_.particles != nullptr) prepare_particles(particles_in_mirrors(surfaces), view.offsets);
  const bool many = view.offsets.are_many();
  const Lanes none{};
  const auto mirrored = [&](const Points& points, int i, int x, int y, int rays, int splits,
                            LightSums& sums) {
    PixelSampler sampler(static_cast<uint32_t>(x + i), static_cast<uint32_t>(y), view.offsets.index,
                         view.offsets.count);
    sampler.skip(1 + static_cast<uint32_t>(sources_.lamps.size()));
    return mirrored_light(points.one(i, view.eye), view, sampler, visible, sums, rays, splits);
  };
  light.sums += sum_over_rows(light.cells.height_px, [&](int y, LightSums& sums) {
    for (int x = 0; x < light.cells.width_px; x += kLanes) {
      const Points points(surfaces, pixels_of_cells(surfaces, x, y, view));
      const IntLanes mirrors = points.mirrors & ~points.own_mirrors;
      light.with_mirror.set_lanes(x, y, mirrors ? none + 1 : none);
      light.with_rough_mirror.set_lanes(x, y,
                                        (mirrors & (points.roughness > kSharpMirror)) ? none + 1 : none);
      LaneVectors values{none, none, none};
      for (int i = 0; i < kLanes; ++i)
        if (mirrors[i]) set_lane(values, i, mirrored(points, i, x, y, 1, 1, sums));
      store(light.mirrors.channels(), x, y, values);
    }
  });
  for (const int step : {1, 2}) light.mirrors.average(light.cells, light.with_rough_mirror, nullptr, step);
  light.sums += sum_over_rows(surfaces.height_px, [&](int y, LightSums& sums) {
    Vector4f* row = &light.mirrored[index_of(0, y, width)];
    interpolate(light.pixels, light.cells, y, {&light.mirrors, &light.with_mirror}, nullptr, row);
    for (int x = 0; x < width; x += kLanes) {
      const Points points(surfaces, pixels_of_row(surfaces, x, y));
      for (int i = 0; i < kLanes; ++i)
        if (points.own_mirrors[i])
          row[x + i] << mirrored(points, i, x, y, many ? 1 : kMirrorRays,
                                 many ? kMirrorSplitsOfMany : kMirrorSplits, sums),
              1;
    }
  });
}

// Returns the light that arrives at the eye through a glass surface. The path starts just before the surface,
// at a distance of few significant bits from the eye: inside glass, paths are so sensitive to rounding errors
// that pictures would otherwise depend on the driver that drew the surface.
LightTracer::FoundLight LightTracer::light_through(const Point& point, const LightView& view,
                                                   PixelSampler& sampler, const VisibleLight& visible,
                                                   bool from_background) const {
  const float before = (1 - 0x1p-12f) * point.view.dot(view.eye - point.place);
  const float distance = std::bit_cast<float>(std::bit_cast<uint32_t>(before) & ~0x1fffu);
  Path path{.from = view.eye - distance * point.view,
            .direction = -point.view,
            .cone = view.pixel_m,
            .width = view.pixel_m * distance,
            .is_picture = true,
            .splits = view.offsets.are_many() ? kMirrorSplitsOfMany : kMirrorSplits,
            .forks = kGlassForks};
  path.from_background = from_background;
  Hit hit;
  if (!scene_.first_seen(path.from, path.direction, kFar, hit)) return radiance(path, sampler, &visible);
  const RaySurface surface = hit.material->surface(hit, path.width, true);
  path.fraction *= 1 - mirrored_fraction(hit, path.direction);
  path.by_chance = is_rough_glass(surface.roughness);
  path.fraction = path.fraction.cwiseProduct(
      enter(hit, surface.roughness, surface.color.head<3>(), sampler, path.from, path.direction));
  return radiance(path, sampler, &visible);
}

void LightTracer::trace_glass(const SurfaceBuffer& surfaces, int x0, int y0, const LightView& view,
                              const VisibleLight& behind, GlassBuffer& glass) const {
  glass.through.assign(surfaces.places.size(), Vector4f::Zero());
  glass.mirrored.assign(surfaces.places.size(), Vector4f::Zero());
  const std::size_t with_lamps = sources_.lamps.empty() ? 0 : surfaces.places.size();
  glass.lamps.resize(with_lamps);
  glass.highlights.resize(with_lamps);
  const int width = surfaces.width_px;
  prepare_particles(MetParticles::all, view.offsets);
  glass.sums = sum_over_rows(surfaces.height_px, [&](int y, LightSums& sums) {
    for (int x = 0; x < width; x += kLanes) {
      Points points(surfaces, pixels_of_row(surfaces, x, y));
      points.mirrors = points.visible;  // mirror images of glass are traced for any roughness
      points.own_mirrors = points.visible & (points.roughness <= kSharpMirror);
      if (with_lamps > 0) {
        Sampler<UintLanes> sampler(UintLanes{0, 1, 2, 3, 4, 5, 6, 7} + static_cast<uint32_t>(x0 + x),
                                   UintLanes{} + static_cast<uint32_t>(y0 + y), view.offsets.index,
                                   view.offsets.count);
        const LampLight lamps =
            trace_lamps(points, highlight_variance(surfaces, points, x, y), view, sampler);
        lamps.store_diffuse(row_part(glass.lamps, x, y, width));
        lamps.store_highlights(row_part(glass.highlights, x, y, width));
      }
      for (int i = 0; i < kLanes; ++i) {
        if (!points.visible[i]) continue;
        Point point = points.one(i, view.eye);
        point.view = -behind.direction_through(x0 + x + i, y0 + y);
        PixelSampler sampler(static_cast<uint32_t>(x0 + x + i), static_cast<uint32_t>(y0 + y),
                             view.offsets.index, view.offsets.count);
        const SquarePoint<float> on_sun = sampler.next();
        const bool sunny = sources_.sun.intensity > 0 && point.normal.dot(sources_.sky.sun_direction) > 0;
        const std::size_t pixel = index_of(x + i, y, width);
        const Vector3f mirrored = mirrored_light(point, view, sampler, behind, sums, 1, 1);
        const bool from_background =
            !sources_.sky_is_visible && behind.opacity(behind.pixel(x0 + x + i, y0 + y)) == 0;
        const FoundLight through = light_through(point, view, sampler, behind, from_background);
        glass.mirrored[pixel] << mirrored, through.background;
        glass.through[pixel] << through.limited(sums),
            sunny ? sun_visibility(point.place, on_sun).mean() : 0.0f;
      }
    }
  });
}

}  // namespace offstage::render
