#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>

#include "render/frame.h"
#include "render/trace/surface_rows.h"

namespace offstage::render {
namespace {

// Number of paths that leave the diffuse surfaces in a smooth mirror or behind glass. Frames of many
// sub-frames need few.
constexpr int kMirrorSplits = 4, kMirrorSplitsOfMany = 1;
constexpr int kWidest = 16, kWidestOfMany = 8;  // see MirroredSurfaces::filter
constexpr int kGlassForks = 2;                  // see Path::forks
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

/// Returns the smallest rectangle that contains all pixels whose mirror image is traced per pixel; a point if
/// there are none.
Eigen::AlignedBox2i own_mirrors(const SurfaceBuffer& surfaces) {
  Eigen::AlignedBox2i result;
  for (int y = 0; y < surfaces.height_px; ++y)
    for (int x = 0; x < surfaces.width_px; ++x) {
      const float kind = surfaces.places[index_of(x, y, surfaces.width_px)].w();
      if (kind < SurfaceBuffer::kMetal || std::fmod(kind, SurfaceBuffer::kMirrors) > kSharpMirror) continue;
      result.extend(Eigen::Vector2i(x, y));
      result.extend(Eigen::Vector2i(x + 1, y + 1));
    }
  return result.isEmpty() ? Eigen::AlignedBox2i(Eigen::Vector2i::Zero()) : result;
}

}  // namespace

// Returns the light that a surface mirrors to the eye. `rays`: number of mirrored rays, if these differ;
// `splits`: number of paths that leave the diffuse surfaces that they meet. If `shown` is not null, it is set
// to these surfaces, whose indirect light is not part of the result.
Vector3f LightTracer::mirrored_light(const Point& point, const LightView& view, PixelSampler& sampler,
                                     const VisibleLight& visible, LightSums& sums, int rays, int splits,
                                     MirroredSurface* shown) const {
  // A cone that is narrower than a pixel does not blur, and has no noise.
  if (point.roughness * point.roughness < std::min(view.pixel_m, kSharp))
    return mirrored_along(point, point.normal, view, sampler, visible, sums, splits, shown);
  const SquarePoint<float> first = sampler.next();
  Vector3f sum = Vector3f::Zero();
  for (int k = 0; k < rays; ++k) {
    const Vector3f facet = visible_facet(point.normal, point.view, point.roughness * point.roughness,
                                         lattice_point(first, k, rays));
    sum += mirrored_along(point, facet, view, sampler, visible, sums, std::max(splits / rays, 1), shown);
  }
  if (shown != nullptr) shown->fraction /= static_cast<float>(rays);
  return sum / static_cast<float>(rays);
}

// Returns the light that a facet of a surface mirrors to the eye.
Vector3f LightTracer::mirrored_along(const Point& point, const Vector3f& facet, const LightView& view,
                                     PixelSampler& sampler, const VisibleLight& visible, LightSums& sums,
                                     int splits, MirroredSurface* shown) const {
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
      .shown = shown,
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
  const auto mirrored = [&](const Points& points, int i, int x, int y, int rays, int splits, LightSums& sums,
                            MirroredSurface* shown = nullptr) {
    PixelSampler sampler(static_cast<uint32_t>(x + i), static_cast<uint32_t>(y), view.offsets.index,
                         view.offsets.count);
    sampler.skip(1 + static_cast<uint32_t>(sources_.lamps.size()));
    return mirrored_light(points.one(i, view.eye), view, sampler, visible, sums, rays, splits, shown);
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
  const Eigen::AlignedBox2i own_px = own_mirrors(surfaces);
  MirroredSurfaces shown(own_px);
  light.sums += sum_over_rows(surfaces.height_px, [&](int y, LightSums& sums) {
    Vector4f* row = &light.mirrored[index_of(0, y, width)];
    interpolate(light.pixels, light.cells, y, {&light.mirrors, &light.with_mirror}, nullptr, row);
    for (int x = 0; x < width; x += kLanes) {
      const Points points(surfaces, pixels_of_row(surfaces, x, y));
      for (int i = 0; i < kLanes; ++i) {
        if (!points.own_mirrors[i]) continue;
        MirroredSurface surface;
        row[x + i] << mirrored(points, i, x, y, many ? 1 : kMirrorRays,
                               many ? kMirrorSplitsOfMany : kMirrorSplits, sums, &surface),
            1;
        shown.set(x + i, y, surface);
        sums += surface.sums;
      }
    }
  });
  if (own_px.volume() == 0) return;
  shown.filter(many ? kWidestOfMany : kWidest);
  for_rows(own_px.sizes().y(), [&](int k) {
    const int y = own_px.min().y() + k;
    for (int x = own_px.min().x(); x < own_px.max().x(); ++x)
      light.mirrored[index_of(x, y, width)].head<3>() += shown.light(x, y);
  });
}

// Returns the light that arrives at the eye through a glass surface. The path starts just before the surface,
// at a distance of few significant bits from the eye: inside glass, paths are so sensitive to rounding errors
// that pictures would otherwise depend on the driver that drew the surface.
LightTracer::ThroughGlass LightTracer::light_through(const Point& point, const LightView& view,
                                                     PixelSampler& sampler, const VisibleLight& visible,
                                                     bool from_background) const {
  ThroughGlass result;
  const float before = (1 - 0x1p-12f) * point.view.dot(view.eye - point.place);
  const float distance = std::bit_cast<float>(std::bit_cast<uint32_t>(before) & ~0x1fffu);
  Path path{.from = view.eye - distance * point.view,
            .direction = -point.view,
            .cone = view.pixel_m,
            .width = view.pixel_m * distance,
            .is_picture = true,
            .splits = view.offsets.are_many() ? kMirrorSplitsOfMany : kMirrorSplits,
            .shown = &result.shown,
            .forks = kGlassForks};
  path.from_background = from_background;
  if (Hit hit; scene_.first_seen(path.from, path.direction, kFar, hit)) {
    const RaySurface surface = hit.material->surface(hit, path.width, true);
    result.is_frosted = is_rough_glass(surface.roughness);
    path.fraction *= 1 - mirrored_fraction(hit, path.direction);
    path.by_chance = result.is_frosted;
    path.fraction = path.fraction.cwiseProduct(
        enter(hit, surface.roughness, surface.color.head<3>(), sampler, path.from, path.direction));
  }
  result.light = radiance(path, sampler, &visible);
  return result;
}

// Averages the light of frosted glass, whose rays have random directions, over neighbouring pixels.
void LightTracer::average_frosted(const SurfaceBuffer& surfaces, const LightPlane& frosted,
                                  const LightView& view, GlassBuffer& glass) const {
  const int width = surfaces.width_px, height = surfaces.height_px;
  LightGuide guide(width, height);
  for_rows(height, [&](int y) {
    for (int x = 0; x < width; x += kLanes)
      set_guide(Points(surfaces, pixels_of_row(surfaces, x, y)), x, y, view, 1, guide);
  });
  for (std::vector<Vector4f>* light : {&glass.through, &glass.mirrored}) {
    LightValues values(width, height, 3);
    const auto for_values = [&](const auto& each) {
      for_rows(height, [&](int y) {
        for (int x = 0; x < width; ++x)
          for (std::size_t i = 0; i < 3; ++i)
            each(*values.channels()[i].at(x, y),
                 (*light)[index_of(x, y, width)][static_cast<Eigen::Index>(i)]);
      });
    };
    for_values([](float& value, float pixel) { value = pixel; });
    for (const int step : {1, 2}) values.average(guide, frosted, nullptr, step);
    for_values([](float value, float& pixel) { pixel = value; });
  }
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
  MirroredSurfaces shown({Eigen::Vector2i(0, 0), Eigen::Vector2i(width, surfaces.height_px)});
  LightPlane frosted(width, surfaces.height_px);
  std::atomic<bool> has_frosted = false;
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
        const ThroughGlass through = light_through(point, view, sampler, behind, from_background);
        shown.set(x + i, y, through.shown);
        sums += through.shown.sums;
        *frosted.at(x + i, y) = through.is_frosted ? 1.0f : 0.0f;
        if (through.is_frosted) has_frosted = true;
        glass.mirrored[pixel] << mirrored, through.light.background;
        glass.through[pixel] << through.light.limited(sums),
            sunny ? sun_visibility(point.place, on_sun).mean() : 0.0f;
      }
    }
  });
  shown.filter(view.offsets.are_many() ? kWidestOfMany : kWidest);
  for_rows(surfaces.height_px, [&](int y) {
    for (int x = 0; x < width; ++x) glass.through[index_of(x, y, width)].head<3>() += shown.light(x, y);
  });
  if (has_frosted) average_frosted(surfaces, frosted, view, glass);
}

}  // namespace offstage::render
