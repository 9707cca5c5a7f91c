#include "render/trace/light_tracer.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "render/frame.h"
#include "render/trace/surface_rows.h"

namespace offstage::render {
namespace {

constexpr int kRoundsPerSubFrame = 2, kMostRounds = 8;  // limits of the further rounds of indirect light
// Number of further shadow rays to sun and lamps together, for each pixel in a penumbra. Frames of many
// sub-frames need few.
constexpr int kPenumbraRays = 6, kPenumbraRaysOfMany = 2;
constexpr std::size_t kMostGlowRays = 3;  // shadow rays of a pixel to glowing meshes in a sub-frame
// Further rounds are traced where variance / mean^2 of the filtered indirect light exceeds the target. The
// filter averages at most kMostAveraged cells.
constexpr float kTargetVariance = 0.01f, kMostAveraged = 400, kSmallVariance = 0.5f;
constexpr float kBrightest =
    50;  // limit of radiance found by random directions; brighter samples would be visible as dots
constexpr int kWidestStep = 16;  // widest step of the filter of indirect light [cells]

/// Returns the row of the sampler for a round of a row of pixels or cells.
uint32_t sampler_row(int y, int round) {
  constexpr int kRowsPerRound = 4096;
  return static_cast<uint32_t>(y + kRowsPerRound * round);
}

}  // namespace

Vector3f LightTracer::FoundLight::limited(LightSums& sums) const {
  const Vector3f kept = noisy.cwiseMin(kBrightest);
  const Vector3f luminance(0.2126f, 0.7152f, 0.0722f);
  sums.arriving += static_cast<double>(luminance.dot(certain + noisy));
  sums.removed += static_cast<double>(luminance.dot(noisy - kept));
  return certain + kept;
}

LightBuffer::LightBuffer(int width, int height)
    : pixels(width, height),
      cells((width + 1) / 2, (height + 1) / 2),
      around(cells.width_px, cells.height_px, 3),
      mirrors(cells.width_px, cells.height_px, 3),
      inverse_distance(cells.width_px, cells.height_px),
      brightness(cells.width_px, cells.height_px),
      reach2(cells.width_px, cells.height_px),
      noisy_reach2(cells.width_px, cells.height_px),
      with_mirror(cells.width_px, cells.height_px),
      with_rough_mirror(cells.width_px, cells.height_px) {
  arriving.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  partly_hidden.resize(static_cast<std::size_t>(runs()) * static_cast<std::size_t>(height));
}

LightTracer::LightTracer(const RayScene& scene, const LightSources& sources, StopTest stop)
    : scene_(scene),
      sources_(sources),
      stop_(std::move(stop)),
      sun_disc_(sources.sun, sources.sky.sun_direction) {}

// Returns the mean over the channels; `colored` is set to each of them.
Lanes LightTracer::sun_visibility(const LaneVectors& place, IntLanes active, const SquarePoint<Lanes>& uv,
                                  RayScene::Focus focus, LaneVectors& colored) const {
  Lanes fraction = active ? Lanes{} + 1 : Lanes{};
  if (sources_.smoke != nullptr) {
    for (int i = 0; i < kLanes; ++i)
      if (active[i]) fraction[i] = std::exp(-sources_.smoke->depth({place.x[i], place.y[i], place.z[i]}));
  }
  colored = {fraction, fraction, fraction};
  if (!sources_.sun.shadows) return fraction;
  const LaneVectors light =
      scene_.transmittance(place, sun_disc_.direction(uv), Lanes{} + kFar, active, focus);
  colored = light * fraction;
  return fraction * ((light.x + light.y + light.z) * (1.0f / 3));
}

// Traces one shadow ray for each glowing mesh, but at most kMostGlowRays. The ranges of random numbers that
// choose the meshes of these rays do not overlap.
LaneVectors LightTracer::trace_glow(const Points& points, int x, int y, const LightView& view) const {
  const Lanes none{};
  LaneVectors light{none, none, none};
  const auto rays = static_cast<int>(std::min(sources_.glow.size(), kMostGlowRays));
  const float part = 1 / static_cast<float>(rays);
  for (int ray = 0; ray < rays; ++ray) {
    LaneVectors found{none, none, none}, towards{none, none + 1, none};
    Lanes distance{};
    for (int i = 0; i < kLanes; ++i) {
      if (!points.visible[i]) continue;
      PixelSampler sampler(static_cast<uint32_t>(x + i), static_cast<uint32_t>(y), view.offsets.index,
                           view.offsets.count);
      sampler.skip(1 + static_cast<uint32_t>(sources_.lamps.size()));
      const Point point = points.one(i, view.eye);
      const float choice = part * (static_cast<float>(ray) + sampler.next().x);
      sampler.skip(static_cast<uint32_t>(ray));
      const GlowSample sample = sources_.glow.sample(point.place, point.normal, choice, sampler.next());
      set_lane(found, i, part * light_of_glow(sample, point.normal, point.face));
      set_lane(towards, i, sample.towards);
      distance[i] = kBeforeGlow * sample.distance;
    }
    const IntLanes lit = found.x + found.y + found.z > 0.0f;
    if (!any(lit)) continue;
    const LaneVectors seen = scene_.transmittance(points.place, towards, distance, lit);
    light = light + LaneVectors{found.x * seen.x, found.y * seen.y, found.z * seen.z};
  }
  return light;
}

// Moves the origins of shadow rays onto the smooth surface (RayScene::smooth_place). This is needed where a
// triangle faces away from the light although its smooth normals face it: the triangle would shadow itself.
void LightTracer::lift(const Points& points, IntLanes lanes, const LightView& view,
                       LaneVectors& place) const {
  if (!any(lanes)) return;
  for (int i = 0; i < kLanes; ++i) {
    if (!lanes[i]) continue;
    const Point point = points.one(i, view.eye);
    set_lane(place, i, scene_.smooth_place(view.eye, point.place));
  }
}

// Stores the positions and normals of eight pixels, which guide the filter. `size_px`: width of the area that
// a value represents [px].
void LightTracer::set_guide(const Points& points, int x, int y, const LightView& view, float size_px,
                            LightGuide& guide) {
  const Lanes none{};
  const LaneVectors from_eye = points.place - all_lanes(view.eye);
  const float size_1m = size_px * view.pixel_m;
  guide.filled.set_lanes(x, y, points.visible ? none + 1 : none);
  guide.inverse_size2.set_lanes(x, y, 1 / larger(size_1m * size_1m * dot(from_eye, from_eye), none + 1e-20f));
  store(guide.place, x, y, points.place);
  store(guide.normal, x, y, points.normal);
}

// Returns the visible fraction of the sun at eight pixels, and sets `colored` to that of each channel.
// `partly_hidden`, if not null, is set to whether the sun is visible from some of the pixels only.
Lanes LightTracer::sun_at(const Points& points, const SquarePoint<Lanes>& on_sun, const LightView& view,
                          LaneVectors& colored, bool* partly_hidden) const {
  const LaneVectors to_sun = all_lanes(sources_.sky.sun_direction);
  const Lanes towards_sun = dot(points.normal, to_sun);
  IntLanes sunny = points.visible & (towards_sun > 0.0f);
  LaneVectors place = points.place;
  if (any(points.cloth)) {  // cloth is also lit from behind
    sunny = points.visible & (points.cloth | sunny);
    const IntLanes behind = points.cloth & (towards_sun * dot(points.face, points.normal) < 0.0f);
    const LaneVectors through = place - points.face * (4 * Points::off_surface_m(place));
    place.x = behind ? through.x : place.x;
    place.y = behind ? through.y : place.y;
    place.z = behind ? through.z : place.z;
  }
  if (sources_.sun.intensity <= 0) sunny = IntLanes{};
  lift(points, sunny & ~points.cloth & (dot(points.face, to_sun) < kGrazing), view, place);
  const Lanes fraction = sun_visibility(place, sunny, on_sun, view.focus, colored);
  if (partly_hidden != nullptr) *partly_hidden = differs(fraction, sunny);
  return fraction;
}

// Traces the visible fraction of the sun for the pixels of a row of a sparse picture that are no gaps.
void LightTracer::trace_sparse_sun(const SurfaceBuffer& surfaces, int y, const LightView& view,
                                   LightBuffer& light) const {
  const std::span<LightPlane> direct = light.direct.channels();
  IntLanes at = IntLanes{} - 1, columns{};
  int count = 0;
  const auto trace_collected = [&] {
    Sampler<UintLanes> sampler(reinterpret_cast<UintLanes>(columns) >> 1,
                               UintLanes{} + static_cast<uint32_t>(y), view.offsets.index,
                               view.offsets.count);
    LaneVectors colored;
    const Lanes fractions = sun_at(Points(surfaces, at), sampler.next(), view, colored);
    for (int i = 0; i < count; ++i) *direct[0].at(columns[i], y) = fractions[i];
    for (int i = 0; i < count && sources_.sun_is_tinted; ++i) {
      *direct.last(3)[0].at(columns[i], y) = colored.x[i];
      *direct.last(3)[1].at(columns[i], y) = colored.y[i];
      *direct.last(3)[2].at(columns[i], y) = colored.z[i];
    }
    at = IntLanes{} - 1;
    count = 0;
  };
  for (int x = 0; x < surfaces.width_px; ++x) {
    if (*light.pixels.filled.at(x, y) == 0 || is_gap(Gaps::half, light.pixels, x, y)) continue;
    columns[count] = x;
    at[count++] = y * surfaces.width_px + x;
    if (count == kLanes) trace_collected();
  }
  if (count > 0) trace_collected();
}

// Traces the light of sun, lamps and glowing meshes at eight pixels of a row. The result of a further round
// is averaged with the rounds before it.
void LightTracer::trace_pixels(const SurfaceBuffer& surfaces, int x, int y, int round, const LightView& view,
                               LightBuffer& light) const {
  const Points points(surfaces, pixels_of_row(surfaces, x, y));
  if (round == 0) set_guide(points, x, y, view, 1, light.pixels);
  if (view.sparse && sources_.glow.empty() && sources_.lamps.empty()) return;
  const UintLanes columns = UintLanes{0, 1, 2, 3, 4, 5, 6, 7} + static_cast<uint32_t>(x);
  Sampler<UintLanes> sampler(columns, UintLanes{} + sampler_row(y, round), view.offsets.index,
                             view.offsets.count);
  const float weight = 1 / static_cast<float>(round + 1);
  const auto add = [&](LightPlane& plane, Lanes value) {
    const Lanes before = round == 0 ? value : plane.lanes(x, y);
    plane.set_lanes(x, y, before + weight * (value - before));
  };
  const SquarePoint<Lanes> on_sun = sampler.next();
  bool partly_hidden = false;
  const std::span<LightPlane> direct = light.direct.channels();
  if (!view.sparse) {
    LaneVectors colored;
    add(direct[0], sun_at(points, on_sun, view, colored, &partly_hidden));
    if (sources_.sun_is_tinted) {
      add(direct.last(3)[0], colored.x);
      add(direct.last(3)[1], colored.y);
      add(direct.last(3)[2], colored.z);
    }
  }
  if (!sources_.glow.empty() && round == 0)
    store(light.glow.channels(), x, y, trace_glow(points, x, y, view));
  if (!sources_.lamps.empty()) {
    const LampLight lamps = trace_lamps(points, highlight_variance(surfaces, points, x, y), view, sampler);
    const Lanes none{};
    if (round == 0) lamps.store_directions(row_part(light.lamps, x, y, surfaces.width_px));
    add(direct[1], lamps.diffuse.x);
    add(direct[2], lamps.diffuse.y);
    add(direct[3], lamps.diffuse.z);
    // The highlights of rough surfaces are filtered.
    const Lanes smooth = points.roughness * points.roughness > kSmoothLobe ? none : none + 1;
    const LaneVectors filtered = lamps.lobes * (1 - smooth);
    add(direct[4], filtered.x);
    add(direct[5], filtered.y);
    add(direct[6], filtered.z);
    const std::span<Vector4f> highlights = row_part(light.highlights, x, y, surfaces.width_px);
    for (std::size_t i = 0; i < highlights.size(); ++i) {
      const Vector4f value(smooth[i] * lamps.lobes.x[i], smooth[i] * lamps.lobes.y[i],
                           smooth[i] * lamps.lobes.z[i], lamps.fresnel[i]);
      highlights[i] = round == 0 ? value : highlights[i] + weight * (value - highlights[i]);
    }
    partly_hidden |= lamps.partly_hidden;
  }
  if (round == 0) light.partly_hidden[index_of(x / kLanes, y, light.runs())] = partly_hidden;
}

// Traces further rounds for runs of pixels in penumbras, which are beside runs from which a light source is
// visible in part. The samples of a run do not influence whether it gets further ones, because this would
// change their mean.
void LightTracer::refine_penumbras(const SurfaceBuffer& surfaces, const LightView& view,
                                   LightBuffer& light) const {
  const int runs = light.runs();
  const int sources = static_cast<int>(sources_.lamps.size()) + (sources_.sun.intensity > 0 ? 1 : 0);
  const int rounds = (view.offsets.are_many() ? kPenumbraRaysOfMany : kPenumbraRays) / std::max(sources, 2);
  const auto is_hidden = [&](int run, int y) {
    return run >= 0 && run < runs && y >= 0 && y < surfaces.height_px &&
           light.partly_hidden[index_of(run, y, runs)] != 0;
  };
  if (rounds == 0) return;
  for_rows(surfaces.height_px, [&](int y) {
    for (int run = 0; run < runs; ++run) {
      const bool beside = is_hidden(run, y - 1) || is_hidden(run, y + 1);
      if (!beside && !(is_hidden(run - 1, y) && is_hidden(run + 1, y))) continue;
      for (int round = 1; round <= rounds; ++round)
        trace_pixels(surfaces, kLanes * run, y, round, view, light);
    }
  });
}

// Returns the index of the pixel that represents each of eight cells of a row. The four pixels of a cell take
// turns in the sub-frames; pixels without a surface are skipped.
IntLanes LightTracer::pixels_of_cells(const SurfaceBuffer& surfaces, int x, int y, const LightView& view) {
  const int columns = (surfaces.width_px + 1) / 2;
  IntLanes at = IntLanes{} - 1;
  for (int i = 0; i < kLanes && x + i < columns; ++i) {
    for (int k = view.offsets.index; k < view.offsets.index + 4; ++k) {
      const int px = std::min(2 * (x + i) + (k & 1), surfaces.width_px - 1);
      const int py = std::min(2 * y + ((k >> 1 ^ k) & 1), surfaces.height_px - 1);
      at[i] = py * surfaces.width_px + px;
      if (surfaces.places[static_cast<std::size_t>(at[i])].w() >= 0) break;
    }
  }
  return at;
}

// Traces one path of indirect light for each of eight cells of a row. The result of a further round is
// averaged with the rounds before it.
void LightTracer::trace_cells(const SurfaceBuffer& surfaces, int x, int y, int round, IntLanes active,
                              const LightView& view, LightBuffer& light, LightSums& sums) const {
  const int k = view.offsets.index;
  IntLanes gaps = ~active;
  for (int i = 0; view.sparse && i < kLanes; ++i)
    gaps[i] = x + i >= light.cells.width_px || is_gap(Gaps::three_quarters, light.cells, x + i, y) ? -1 : 0;
  if (!any(~gaps)) return;
  const Points points(surfaces, pixels_of_cells(surfaces, x, y, view));
  if (!view.sparse && round == 0) set_guide(points, x, y, view, 2, light.cells);
  const Lanes none{};
  const int shift = view.sparse ? 1 : 0;  // gives consecutive numbers to the cells that are not gaps
  const uint32_t row = sampler_row(y >> shift, round);
  Sampler<UintLanes> samplers((UintLanes{0, 1, 2, 3, 4, 5, 6, 7} + static_cast<uint32_t>(x)) >> shift,
                              UintLanes{} + row, k, view.offsets.count);
  const LaneVectors directions = cosine_direction(points.normal, samplers.next());
  LaneVectors around{none, none, none};
  Lanes inverse_distance{};
  for (int i = 0; i < kLanes; ++i) {
    if (!points.visible[i] || gaps[i]) continue;
    const Point point = points.one(i, view.eye);
    PixelSampler sampler(static_cast<uint32_t>(x + i) >> shift, row, k, view.offsets.count);
    sampler.skip(1);
    Vector3f outgoing(directions.x[i], directions.y[i], directions.z[i]);
    if (outgoing.dot(point.face) <= 0) outgoing = reflected(outgoing, point.face);
    float met = kFar;
    Path path{.from = point.place, .direction = outgoing, .cone = 0.5f};
    path.scatter(point.normal, outgoing);
    set_lane(around, i, radiance(path, sampler, nullptr, &met).limited(sums));
    inverse_distance[i] = 1 / std::max(met, 8 * view.pixel_m * (point.place - view.eye).norm());
  }
  const std::span<LightPlane> mean = light.around.channels();
  if (round > 0) {
    const auto mean_with = [&](const LightPlane& plane, Lanes value) {
      const Lanes before = plane.lanes(x, y),
                  change = (value - before) * (1.0f / static_cast<float>(round + 1));
      return before + (active ? change : none);
    };
    return store(mean, x, y,
                 {mean_with(mean[0], around.x), mean_with(mean[1], around.y), mean_with(mean[2], around.z)});
  }
  store(mean, x, y, around);
  light.inverse_distance.set_lanes(x, y, inverse_distance);
  light.brightness.set_lanes(x, y, around.x + around.y + around.z);
}

// Traces further rounds for cells whose filtered light would still be noisy. This happens where light comes
// from small bright areas, near corners, and on narrow surfaces.
void LightTracer::refine_cells(const SurfaceBuffer& surfaces, const LightNoise& noise, const LightView& view,
                               LightBuffer& light) const {
  const LightGuide& cells = light.cells;
  const int most = std::min(kRoundsPerSubFrame * view.offsets.count, kMostRounds);
  light.sums += sum_over_rows(cells.height_px, [&](int y, LightSums& sums) {
    for (int x = 0; x < cells.width_px; x += kLanes) {
      const float variance = noise.relative_variance(x, y);
      // Most light has a small variance. Its noise is visible only where few cells are averaged, as at edges
      // between walls.
      const float excess = std::max(variance - 1, std::min(variance, kSmallVariance));
      if (excess <= 0) continue;
      const Lanes one = Lanes{} + 1;
      const Lanes reach2 = cells.inverse_size2.lanes(x, y) / larger(light.reach2.lanes(x, y), one * 1e-20f);
      const Lanes averaged = larger(
          (variance > 1 ? cells.similar_around(x, y) : one * 0.5f) * smaller(3 * reach2, one * kMostAveraged),
          one);
      const Lanes rounds = excess / (kTargetVariance * averaged);
      for (int round = 1; round <= most; ++round) {
        const IntLanes active = (cells.filled.lanes(x, y) > 0.0f) & (rounds > static_cast<float>(round));
        if (!any(active)) break;
        trace_cells(surfaces, x, y, round, active, view, light, sums);
      }
    }
  });
}

// Interpolates the light in the gaps of a sparse picture.
void LightTracer::fill_sparse(LightBuffer& light) const {
  std::vector<LightPlane*> sun = {&light.direct.channels()[0]};
  for (LightPlane& plane : light.direct.channels().last(sources_.sun_is_tinted ? 3 : 0))
    sun.push_back(&plane);
  fill_gaps(Gaps::half, light.pixels, sun);
  const std::span<LightPlane> around = light.around.channels();
  LightPlane* const cells[] = {&around[0], &around[1], &around[2], &light.inverse_distance,
                               &light.brightness};
  fill_gaps(Gaps::three_quarters, light.cells, cells);
}

void LightTracer::trace(const SurfaceBuffer& surfaces, const LightView& view, LightBuffer& light) const {
  LightView focused = view;
  focused.focus = RayScene::Focus::blocks;
  trace_arriving(surfaces, focused, light);
  if (!sources_.glass.empty()) add_caustics(focused, light);
  if (light.has_mirrors) trace_mirrors(surfaces, view, VisibleLight(light, view), light);
}

void LightTracer::trace_body(const SurfaceBuffer& surfaces, const LightView& view,
                             const VisibleLight& visible, LightBuffer& light) const {
  trace_arriving(surfaces, view, light);
  if (light.has_mirrors) trace_mirrors(surfaces, view, visible, light);
}

void LightTracer::trace_arriving(const SurfaceBuffer& surfaces, const LightView& view,
                                 LightBuffer& light) const {
  const int width = surfaces.width_px, height = surfaces.height_px;
  const std::size_t pixels = light.arriving.size(), with_lamps = sources_.lamps.empty() ? 0 : pixels;
  const std::size_t channels = (sources_.lamps.empty() ? 1 : 7) + (sources_.sun_is_tinted ? 3 : 0);
  if (light.direct.channels().size() != channels) light.direct = LightValues(width, height, channels);
  light.lamps.resize(with_lamps);
  light.highlights.resize(with_lamps);
  light.sun.resize(sources_.sun_is_tinted ? pixels : 0);
  const bool glows = !sources_.glow.empty();
  if (glows && light.glow.channels().empty()) light.glow = LightValues(width, height, 3);
  light.has_mirrors = std::ranges::any_of(surfaces.places,
                                          [](const Vector4f& p) { return p.w() >= SurfaceBuffer::kMirrors; });
  if (light.has_mirrors) light.mirrored.resize(pixels);
  for_rows(height, [&](int y) {
    for (int x = 0; x < width; x += kLanes) trace_pixels(surfaces, x, y, 0, view, light);
  });
  if (!view.sparse) refine_penumbras(surfaces, view, light);
  if (view.sparse) {
    for_rows(light.cells.height_px, [&](int y) {
      for (int x = 0; x < light.cells.width_px; x += kLanes)
        set_guide(Points(surfaces, pixels_of_cells(surfaces, x, y, view)), x, y, view, 2, light.cells);
    });
    for_rows(height, [&](int y) { trace_sparse_sun(surfaces, y, view, light); });
  }
  light.sums = sum_over_rows(light.cells.height_px, [&](int y, LightSums& sums) {
    for (int x = 0; x < light.cells.width_px; x += kLanes)
      trace_cells(surfaces, x, y, 0, IntLanes{} - 1, view, light, sums);
  });
  if (view.sparse) fill_sparse(light);
  const LightNoise noise(light.cells, light.brightness);
  light.cells.find_reach(light.inverse_distance, noise, light.reach2, light.noisy_reach2);
  if (!view.sparse) refine_cells(surfaces, noise, view, light);
  const int widest = view.offsets.are_many() ? 4 : 8;
  for (int step = 1; step <= kWidestStep; step *= 2)
    light.around.average(light.cells, light.cells.filled,
                         step <= widest ? &light.reach2 : &light.noisy_reach2, step);
  write_arriving(light);
}

// Writes the results from the intermediate values. The light of sources is averaged over neighbouring pixels.
void LightTracer::write_arriving(LightBuffer& light) const {
  const int width = light.pixels.width_px;
  const LightAverage direct(light.direct, light.pixels, light.pixels.filled, nullptr, 1);
  std::optional<LightAverage> glow;
  if (!sources_.glow.empty()) glow.emplace(light.glow, light.pixels, light.pixels.filled, nullptr, 1);
  for_rows(light.pixels.height_px, [&](int y) {
    const std::size_t start = index_of(0, y, width);
    LightValues row(width, 1, light.direct.channels().size());
    direct.write_row(y, row.channels(), 0);
    const auto value = [&](std::size_t channel, int x) { return *row.channels()[channel].at(x, 0); };
    interpolate(light.pixels, light.cells, y, {&light.around, &light.cells.filled},
                row.channels()[0].at(0, 0), &light.arriving[start]);
    for (int x = 0; x < width && !light.lamps.empty(); ++x) {
      const std::size_t pixel = start + static_cast<std::size_t>(x);
      light.lamps[pixel].head<3>() << value(1, x), value(2, x), value(3, x);
      light.highlights[pixel].head<3>() += Vector3f(value(4, x), value(5, x), value(6, x));
    }
    if (!light.sun.empty()) {
      const std::size_t colors = row.channels().size() - 3;
      for (int x = 0; x < width; ++x)
        light.sun[start + static_cast<std::size_t>(x)] << value(colors, x), value(colors + 1, x),
            value(colors + 2, x), 0;
    }
    if (!glow) return;
    row = LightValues(width, 1, 3);
    glow->write_row(y, row.channels(), 0);
    for (int x = 0; x < width; ++x)
      light.arriving[start + static_cast<std::size_t>(x)].head<3>() +=
          Vector3f(value(0, x), value(1, x), value(2, x));
  });
}

}  // namespace offstage::render
