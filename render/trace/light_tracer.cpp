#include "render/trace/light_tracer.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "render/error.h"
#include "render/frame.h"
#include "render/trace/light_path.h"

namespace offstage::render {
namespace {

constexpr int kRowsPerTask = 8;
constexpr uint32_t kRowsPerRound = 4096;                // offset of the sampler's row from round to round
constexpr int kRoundsPerSubFrame = 2, kMostRounds = 8;  // limits of the further rounds of indirect light
// Further rounds are traced where variance / mean^2 of the filtered indirect light exceeds the target. The
// filter averages at most kMostAveraged cells.
constexpr float kTargetVariance = 0.0256f, kMostAveraged = 400;
constexpr float kBrightest =
    50;  // limit of radiance found by random directions; brighter samples would be visible as dots
constexpr int kWidestStep = 16;  // widest step of the filter of indirect light [cells]

constexpr float kGrazing =
    0.02f;  // cosine between light and triangle; below it, a triangle may shadow itself
constexpr float kSharpMirror = 0.12f;  // roughness above which mirror images are filtered
// Number of paths that leave a diffuse surface in a mirror image that is not filtered. Frames of many
// sub-frames need few.
constexpr int kMirrorSplits = 8, kMirrorSplitsOfMany = 2;
constexpr int kMirrorRays = 2;        // number of rays in a mirror image that is neither sharp nor filtered
constexpr float kSmoothLobe = 0.1f;   // largest roughness^2 of surfaces whose highlights have mirrored rays
constexpr float kBrightestLobe = 40;  // limit of the lobes of other surfaces

LaneVectors from_octahedral(Lanes x, Lanes z) {
  const Lanes one = Lanes{} + 1, y = 1 - absolute(x) - absolute(z);
  const Lanes folded_x = (1 - absolute(z)) * (x < 0.0f ? -one : one);
  const Lanes folded_z = (1 - absolute(x)) * (z < 0.0f ? -one : one);
  return normalized(LaneVectors{y < 0.0f ? folded_x : x, y, y < 0.0f ? folded_z : z});
}

void set_lane(LaneVectors& lanes, int i, const Vector3f& value) {
  lanes.x[i] = value.x();
  lanes.y[i] = value.y();
  lanes.z[i] = value.z();
}

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

/// Returns the indices of the pixels x ... x + 7 of a row; -1 beyond its end.
IntLanes pixels_of_row(const SurfaceBuffer& surfaces, int x, int y) {
  const IntLanes columns = IntLanes{0, 1, 2, 3, 4, 5, 6, 7} + x;
  return columns < surfaces.width_px ? columns + y * surfaces.width_px : IntLanes{} - 1;
}

void store(std::span<LightPlane> planes, int x, int y, const LaneVectors& value) {
  planes[0].set_lanes(x, y, value.x);
  planes[1].set_lanes(x, y, value.y);
  planes[2].set_lanes(x, y, value.z);
}

// The GGX lobe as in shaders/light.glsl, limited to `most`.
Lanes lobe_of(Lanes a, Lanes nl, Lanes nv, Lanes nh, Lanes most) {
  const Lanes a2 = a * a, d = nh * nh * (a2 - 1) + 1;
  const Lanes mean = 2 * nl * nv * (1 - a) + (nl + nv) * a;
  return smaller(a2 / (d * d) * 0.5f / larger(mean, Lanes{} + 1e-6f), most);
}

}  // namespace

Vector3f LightTracer::FoundLight::limited(LightSums& sums) const {
  const Vector3f kept = noisy.cwiseMin(kBrightest);
  const Vector3f luminance(0.2126f, 0.7152f, 0.0722f);
  sums.arriving += static_cast<double>(luminance.dot(certain + noisy));
  sums.removed += static_cast<double>(luminance.dot(noisy - kept));
  return certain + kept;
}

struct LightTracer::Point {
  Vector3f place, normal, face, view;
  float roughness = 0;
};

struct LightTracer::Points {
  LaneVectors place, normal, face;
  Lanes roughness;
  IntLanes visible, cloth, mirrors;
  IntLanes own_mirrors;  ///< smooth metals, whose mirror image is traced per pixel

  /// `at`: indices of eight pixels; negative: none.
  Points(const SurfaceBuffer& surfaces, IntLanes at) {
    std::array<Lanes, 4> p, n;
    p.fill(Lanes{});
    n.fill(Lanes{});
    p[3] = Lanes{} - 1;
    for (int i = 0; i < kLanes; ++i) {
      if (at[i] < 0) continue;
      const auto pixel = static_cast<std::size_t>(at[i]);
      for (std::size_t k = 0; k < 4; ++k) {
        p[k][i] = surfaces.places[pixel][static_cast<int>(k)];
        n[k][i] = static_cast<float>(surfaces.normals[pixel][k]);
      }
    }
    for (Lanes& value : n) value = value * (2.0f / 65535) - 1;
    normal = from_octahedral(n[0], n[1]);
    face = from_octahedral(n[2], n[3]);
    place = {p[0], p[1], p[2]};
    place = place + face * off_surface_m(place);
    visible = p[3] >= 0.0f;
    roughness = p[3];
    const auto flag = [&](float value) {
      const IntLanes set = roughness >= value;
      roughness = set ? roughness - value : roughness;
      return set;
    };
    const IntLanes metal = flag(SurfaceBuffer::kMetal);
    cloth = flag(SurfaceBuffer::kCloth);
    mirrors = flag(SurfaceBuffer::kMirrors);
    own_mirrors = metal & (roughness <= kSharpMirror);
  }
  Point one(int lane, const Vector3f& eye) const {
    const auto of = [&](const LaneVectors& v) { return Vector3f(v.x[lane], v.y[lane], v.z[lane]); };
    const Vector3f from = of(place);
    return {from, of(normal), of(face), (eye - from).normalized(), roughness[lane]};
  }
  static Lanes off_surface_m(const LaneVectors& p) {
    return kUnitsOffSurface * larger(larger(absolute(p.x), absolute(p.y)), absolute(p.z)) +
           kLeastOffSurface_m;
  }
};

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
}

LightTracer::LightTracer(const RayScene& scene, const LightSources& sources, StopTest stop)
    : scene_(scene),
      sources_(sources),
      stop_(std::move(stop)),
      sun_disc_(sources.sun, sources.sky.sun_direction) {}

Lanes LightTracer::sun_visibility(const LaneVectors& place, IntLanes active, const SquarePoint<Lanes>& uv,
                                  RayScene::Focus focus) const {
  Lanes fraction = active ? Lanes{} + 1 : Lanes{};
  if (sources_.smoke != nullptr) {
    for (int i = 0; i < kLanes; ++i)
      if (active[i]) fraction[i] = std::exp(-sources_.smoke->depth({place.x[i], place.y[i], place.z[i]}));
  }
  if (!sources_.sun.shadows) return fraction;
  const LaneVectors light =
      scene_.transmittance(place, sun_disc_.direction(uv), Lanes{} + kFar, active, focus);
  return fraction * ((light.x + light.y + light.z) * (1.0f / 3));
}

LaneVectors LightTracer::trace_glow(const Points& points, int x, int y, const LightView& view) const {
  const Lanes none{};
  LaneVectors light{none, none, none}, towards{none, none + 1, none};
  Lanes distance{};
  for (int i = 0; i < kLanes; ++i) {
    if (!points.visible[i]) continue;
    PixelSampler sampler(static_cast<uint32_t>(x + i), static_cast<uint32_t>(y), view.offsets.index,
                         view.offsets.count);
    sampler.skip(1 + static_cast<uint32_t>(sources_.lamps.size()));
    const Point point = points.one(i, view.eye);
    const float choice = sampler.next().x;
    const GlowSample sample = sources_.glow.sample(point.place, point.normal, choice, sampler.next());
    set_lane(light, i, light_of_glow(sample, point.normal, point.face));
    set_lane(towards, i, sample.towards);
    distance[i] = kBeforeGlow * sample.distance;
  }
  const IntLanes lit = light.x + light.y + light.z > 0.0f;
  if (!any(lit)) return light;
  const LaneVectors seen = scene_.transmittance(points.place, towards, distance, lit);
  return {light.x * seen.x, light.y * seen.y, light.z * seen.z};
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

struct LightTracer::LampLight {
  LaneVectors diffuse, lobes;
  Lanes fresnel;  ///< factor of the lobes

  void store(std::span<Vector4f> lamps, std::span<Vector4f> highlights) const {
    for (std::size_t i = 0; i < lamps.size(); ++i) {
      lamps[i] = {diffuse.x[i], diffuse.y[i], diffuse.z[i], 0};
      highlights[i] = {lobes.x[i], lobes.y[i], lobes.z[i], fresnel[i]};
    }
  }
};

/// The highlights of lamps on eight surfaces. Smooth surfaces have two samples of each lamp: a point of the
/// lamp, and the point that a mirrored ray hits. Each has the weight of multiple importance sampling.
struct LightTracer::Highlights {
  const Points& points;
  Lanes variance;  ///< see highlight_variance()
  Vector3f eye;
  SquarePoint<Lanes> uv;  ///< selects the mirrored rays
  LaneVectors to_eye;
  Lanes nv;

  Lanes a{};          ///< roughness^2
  IntLanes smooth{};  ///< surfaces with a mirrored ray
  LaneVectors mirrored{};
  LaneVectors lobes{};
  Lanes grazing{};  ///< sum of all channels of `lobes`, each times its Fresnel factor

  Highlights(const Points& surfaces, Lanes variance_of_normals, const Vector3f& from,
             const SquarePoint<Lanes>& sample)
      : points(surfaces),
        variance(variance_of_normals),
        eye(from),
        uv(sample),
        to_eye(normalized(all_lanes(eye) - surfaces.place)),
        nv(larger(absolute(dot(points.normal, to_eye)), Lanes{} + 1e-3f)) {}

  /// Prepares the highlights of a lamp. If it is smaller than the solid angle from which a pixel mirrors
  /// light, the roughness is increased.
  void begin(const RayLamp& lamp) {
    const Lanes none{}, rough = points.roughness * points.roughness;
    const Lanes density =
        lamp.is_sky() ? none + 1e12f : lamp.point(points.place, {none + 0.5f, none + 0.5f}).density;
    const Lanes size2 = 0.25f / (std::numbers::pi_v<float> * larger(density, none + 1e-12f));
    a = square_root(smaller(rough * rough + larger(variance - size2, none), none + 1));
    smooth = lamp.is_sky() ? IntLanes{} : points.visible & (a <= kSmoothLobe);
    for (int i = 0; i < kLanes; ++i) {
      if (!smooth[i]) continue;
      const Point point = points.one(i, eye);
      const Vector3f facet =
          a[i] < kSharp ? point.normal : visible_facet(point.normal, point.view, a[i], {uv.x[i], uv.y[i]});
      set_lane(mirrored, i, reflected(-point.view, facet));
    }
  }
  /// Adds the light of a point of a lamp. `light`: radiance of a white surface that faces the point.
  void add(const RayLamp& lamp, const LampPoint<Lanes>& point, const LaneVectors& light) {
    const LaneVectors h = normalized(point.towards + to_eye);
    const Lanes none{}, nh = clamped_to(dot(points.normal, h), 0, 1);
    const IntLanes twice = lamp.is_sky() ? points.mirrors : smooth;
    // One point represents the lamp on rough surfaces, so their highlights are limited.
    const Lanes most = twice ? none + 1e12f : none + kBrightestLobe;
    const Lanes weight = twice ? power_heuristic(point.density, mirror_density(a, nv, nh)) : none + 1;
    const Lanes nl = larger(dot(points.normal, point.towards), none);
    add_lobe(light, weight * nl * lobe_of(larger(a, none + kSharp), nl, nv, nh, most), h);
  }
  /// Adds the light of a point of a lamp that the mirrored ray hits.
  void add_mirrored(const LampPoint<Lanes>& point, const LaneVectors& light) {
    const LaneVectors h = normalized(mirrored + to_eye);
    const Lanes none{}, nh = clamped_to(dot(points.normal, h), 0, 1);
    const Lanes nl = larger(dot(points.normal, mirrored), none), a2 = a * a;
    // The lobe divided by mirror_density().
    const Lanes scale = std::numbers::pi_v<float> * nl * (nv + square_root(a2 + (1 - a2) * nv * nv)) /
                        larger(2 * nl * nv * (1 - a) + (nl + nv) * a, none + 1e-6f);
    add_lobe(light, scale * point.density * power_heuristic(mirror_density(a, nv, nh), point.density), h);
  }

 private:
  void add_lobe(const LaneVectors& light, Lanes lobe, const LaneVectors& h) {
    const LaneVectors bright = light * lobe;
    const Lanes m = 1 - clamped_to(dot(to_eye, h), 0, 1), m2 = m * m;
    lobes = lobes + bright;
    grazing += (bright.x + bright.y + bright.z) * (m2 * m2 * m);
  }
};

// Returns the light at eight surfaces from points of a lamp. `lanes`: the surfaces that are computed.
LaneVectors LightTracer::light_of_lamp(const RayLamp& lamp, const LampPoint<Lanes>& point,
                                       const Points& points, IntLanes lanes, const LightView& view) const {
  const Lanes none{};
  const LaneVectors light = point.arriving * (lanes ? none + 1 : none);
  if (!lamp.def().shadows || !any(lanes)) return light;
  const RayScene::Focus focus = lamp.is_focused() ? view.focus : RayScene::Focus::passes;
  LaneVectors place = points.place;
  lift(points, lanes & (dot(points.face, point.towards) < kGrazing), view, place);
  const LaneVectors seen = scene_.transmittance(place, point.towards, point.distance, lanes, focus);
  return {light.x * seen.x, light.y * seen.y, light.z * seen.z};
}

// Returns the light of all lamps at eight surfaces. `variance`: see highlight_variance().
LightTracer::LampLight LightTracer::trace_lamps(const Points& points, Lanes variance, const LightView& view,
                                                Sampler<UintLanes>& sampler) const {
  const Lanes none{};
  Sampler<UintLanes> after_lamps = sampler;
  after_lamps.skip(static_cast<uint32_t>(sources_.lamps.size()));
  Highlights highlights(points, variance, view.eye, after_lamps.next());
  LaneVectors diffuse{none, none, none};
  for (const RayLamp& lamp : sources_.lamps) {
    const IntLanes shiny = points.visible & ~(lamp.def().in_mirrors ? points.mirrors : IntLanes{});
    const auto lit = [&](const LampPoint<Lanes>& point) {
      return (dot(points.normal, point.towards) > 0.0f) & (point.fraction > 0.0f);
    };
    const LampPoint<Lanes> point = lamp.point(points.place, sampler.next());
    const LaneVectors light = light_of_lamp(lamp, point, points, points.visible & lit(point), view);
    diffuse = diffuse + light * larger(dot(points.normal, point.towards), none);
    highlights.begin(lamp);
    highlights.add(lamp, point, light * (shiny ? none + 1 : none));
    if (!any(highlights.smooth & shiny)) continue;
    const LampPoint<Lanes> met = lamp.point_towards(points.place, highlights.mirrored);
    const IntLanes lanes = highlights.smooth & shiny & lit(met);
    if (any(lanes)) highlights.add_mirrored(met, light_of_lamp(lamp, met, points, lanes, view));
  }
  const LaneVectors& lobes = highlights.lobes;
  return {diffuse, lobes, highlights.grazing / larger(lobes.x + lobes.y + lobes.z, none + 1e-12f)};
}

namespace {

/// Returns the values of the pixels x ... x + 7 of a row, without those beyond its end.
std::span<Vector4f> row_part(std::vector<Vector4f>& values, int x, int y, int width) {
  return std::span(values).subspan(index_of(x, y, width),
                                   static_cast<std::size_t>(std::min(kLanes, width - x)));
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
      .mirrored = true,
      .splits = splits,
      .particles = sources_.particles == nullptr ? MetParticles::none : particles_in_mirror(point.roughness),
      .by_chance = a >= kSharp,
      .density = mirror_density(a, nv, nh)};
  return radiance(path, sampler, &visible).limited(sums);
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

// Returns the visible fraction of the sun at eight pixels.
Lanes LightTracer::sun_at(const Points& points, const SquarePoint<Lanes>& on_sun,
                          const LightView& view) const {
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
  return sun_visibility(place, sunny, on_sun, view.focus);
}

// Traces the visible fraction of the sun for the pixels of a row of a sparse picture that are no gaps.
void LightTracer::trace_sparse_sun(const SurfaceBuffer& surfaces, int y, const LightView& view,
                                   LightBuffer& light) const {
  LightPlane& sun = light.direct.channels()[0];
  IntLanes at = IntLanes{} - 1, columns{};
  int count = 0;
  const auto trace_collected = [&] {
    Sampler<UintLanes> sampler(reinterpret_cast<UintLanes>(columns) >> 1,
                               UintLanes{} + static_cast<uint32_t>(y), view.offsets.index,
                               view.offsets.count);
    const Lanes fractions = sun_at(Points(surfaces, at), sampler.next(), view);
    for (int i = 0; i < count; ++i) *sun.at(columns[i], y) = fractions[i];
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

// Returns by how much roughness^4 of the highlights of small lamps is increased at eight pixels of a row,
// because the normal varies within a pixel. Only for mirrors that are traced per pixel; for other surfaces,
// filtered_roughness() in shaders/mesh.frag has done so already.
Lanes LightTracer::highlight_variance(const SurfaceBuffer& surfaces, const Points& points, int x, int y) {
  Lanes variance{};
  if (!any(points.own_mirrors)) return variance;
  const auto change2 = [&](int dx, int dy) {
    constexpr float kOther = 4;  // another object
    if (x + dx < 0 || y + dy < 0 || y + dy >= surfaces.height_px) return Lanes{} + kOther;
    const Points beside(surfaces, pixels_of_row(surfaces, x + dx, y + dy));
    const LaneVectors change = beside.normal - points.normal;
    return beside.own_mirrors ? dot(change, change) : Lanes{} + kOther;
  };
  // The smaller one of two differences does not cross the outline of an object.
  for (const auto& [right, up] : {std::pair(1, 0), std::pair(0, 1)})
    variance += 0.5f * smaller(change2(right, up), change2(-right, -up));
  return points.own_mirrors ? smaller(variance, Lanes{} + 0.18f) : Lanes{};
}

// Traces the light of sun, lamps and glowing meshes at eight pixels of a row.
void LightTracer::trace_pixels(const SurfaceBuffer& surfaces, int x, int y, const LightView& view,
                               LightBuffer& light) const {
  const Points points(surfaces, pixels_of_row(surfaces, x, y));
  set_guide(points, x, y, view, 1, light.pixels);
  if (view.sparse && sources_.glow.empty() && sources_.lamps.empty()) return;
  const UintLanes columns = UintLanes{0, 1, 2, 3, 4, 5, 6, 7} + static_cast<uint32_t>(x);
  Sampler<UintLanes> sampler(columns, UintLanes{} + static_cast<uint32_t>(y), view.offsets.index,
                             view.offsets.count);
  const SquarePoint<Lanes> on_sun = sampler.next();
  if (!view.sparse) light.direct.channels()[0].set_lanes(x, y, sun_at(points, on_sun, view));
  if (!sources_.glow.empty()) store(light.glow.channels(), x, y, trace_glow(points, x, y, view));
  if (sources_.lamps.empty()) return;
  const LampLight lamps = trace_lamps(points, highlight_variance(surfaces, points, x, y), view, sampler);
  store(light.direct.channels().subspan(1), x, y, lamps.diffuse);
  const int width = surfaces.width_px;
  lamps.store(row_part(light.lamps, x, y, width), row_part(light.highlights, x, y, width));
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
  const uint32_t row = (static_cast<uint32_t>(y) >> shift) + static_cast<uint32_t>(round) * kRowsPerRound;
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
      const float excess = noise.relative_variance(x, y) - 1;
      if (excess <= 0) continue;
      const Lanes one = Lanes{} + 1;
      const Lanes reach2 = cells.inverse_size2.lanes(x, y) / larger(light.reach2.lanes(x, y), one * 1e-20f);
      const Lanes averaged =
          larger(cells.similar_around(x, y) * smaller(3 * reach2, one * kMostAveraged), one);
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
void LightTracer::fill_sparse(LightBuffer& light) {
  LightPlane* const sun[] = {&light.direct.channels()[0]};
  fill_gaps(Gaps::half, light.pixels, sun);
  const std::span<LightPlane> around = light.around.channels();
  LightPlane* const cells[] = {&around[0], &around[1], &around[2], &light.inverse_distance,
                               &light.brightness};
  fill_gaps(Gaps::three_quarters, light.cells, cells);
}

// Calls each(y) for all rows in parallel. Each task of kRowsPerTask rows first checks for a request to stop.
void LightTracer::for_rows(int height, const auto& each) const {
  std::atomic<bool> stopped = false;
  tbb::parallel_for(tbb::blocked_range<int>(0, height, kRowsPerTask), [&](const auto& rows) {
    if (stop_ && !stopped && stop_()) stopped = true;
    for (int y = rows.begin(); y < rows.end() && !stopped; ++y) each(y);
  });
  if (stopped) throw StoppedError("the light is no longer needed");
}

// Calls each(y, sums) for all rows in parallel and returns the total. Each row has its own sums, so that the
// total does not depend on the threads.
LightSums LightTracer::sum_over_rows(int height, const auto& each) const {
  std::vector<LightSums> rows(static_cast<std::size_t>(height));
  for_rows(height, [&](int y) { each(y, rows[static_cast<std::size_t>(y)]); });
  LightSums total;
  for (const LightSums& row : rows) total += row;
  return total;
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
  const std::size_t channels = sources_.lamps.empty() ? 1 : 4;
  if (light.direct.channels().size() != channels) light.direct = LightValues(width, height, channels);
  light.lamps.resize(with_lamps);
  light.highlights.resize(with_lamps);
  const bool glows = !sources_.glow.empty();
  if (glows && light.glow.channels().empty()) light.glow = LightValues(width, height, 3);
  light.has_mirrors = std::ranges::any_of(surfaces.places,
                                          [](const Vector4f& p) { return p.w() >= SurfaceBuffer::kMirrors; });
  if (light.has_mirrors) light.mirrored.resize(pixels);
  if (light.has_mirrors && sources_.particles != nullptr)
    prepare_particles(particles_in_mirrors(surfaces), view.offsets);
  for_rows(height, [&](int y) {
    for (int x = 0; x < width; x += kLanes) trace_pixels(surfaces, x, y, view, light);
  });
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
  light.direct.average(light.pixels, light.pixels.filled, nullptr, 1);
  if (glows) light.glow.average(light.pixels, light.pixels.filled, nullptr, 1);
  const int widest = view.offsets.count >= 16 ? 4 : 8;
  for (int step = 1; step <= kWidestStep; step *= 2)
    light.around.average(light.cells, light.cells.filled,
                         step <= widest ? &light.reach2 : &light.noisy_reach2, step);
  for_rows(height, [&](int y) {
    const std::size_t row = index_of(0, y, width);
    interpolate(light.pixels, light.cells, y, {&light.around, &light.cells.filled},
                &light.direct.channels()[0], &light.arriving[row]);
    for (int x = 0; x < width && glows; ++x)
      for (std::size_t i = 0; i < 3; ++i)
        light.arriving[row + static_cast<std::size_t>(x)][static_cast<int>(i)] +=
            *light.glow.channels()[i].at(x, y);
    for (int x = 0; x < width && !light.lamps.empty(); ++x) {
      Vector4f& lamps = light.lamps[row + static_cast<std::size_t>(x)];
      for (std::size_t i = 0; i < 3; ++i)
        lamps[static_cast<int>(i)] = *light.direct.channels()[i + 1].at(x, y);
    }
  });
}

// Traces mirror images: per pixel for smooth metals, per cell for other surfaces.
void LightTracer::trace_mirrors(const SurfaceBuffer& surfaces, const LightView& view,
                                const VisibleLight& visible, LightBuffer& light) const {
  const int width = surfaces.width_px;
  const bool many = view.offsets.count >= 16;
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
Vector3f LightTracer::light_through(const Point& point, const Vector3f& eye, PixelSampler& sampler,
                                    const VisibleLight& visible, LightSums& sums) const {
  const float before = (1 - 0x1p-12f) * point.view.dot(eye - point.place);
  const float distance = std::bit_cast<float>(std::bit_cast<uint32_t>(before) & ~0x1fffu);
  Path path{.from = eye - distance * point.view, .direction = -point.view, .cone = 1e-3f};
  Hit hit;
  if (!scene_.first_hit(path.from, path.direction, kFar, hit)) return sky_seen(path.direction);
  const Vector3f albedo = hit.material->color(hit, 0).head<3>();
  path.fraction *= 1 - mirrored_fraction(hit, path.direction);
  path.by_chance = is_rough_glass(*hit.material);
  path.fraction = path.fraction.cwiseProduct(enter(hit, albedo, sampler, path.from, path.direction));
  return radiance(path, sampler, &visible).limited(sums);
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
        trace_lamps(points, highlight_variance(surfaces, points, x, y), view, sampler)
            .store(row_part(glass.lamps, x, y, width), row_part(glass.highlights, x, y, width));
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
        glass.mirrored[pixel] << mirrored_light(point, view, sampler, behind, sums, 1, 1), 1;
        glass.through[pixel] << light_through(point, view.eye, sampler, behind, sums),
            sunny ? sun_visibility(point.place, on_sun) : 0.0f;
      }
    }
  });
}

}  // namespace offstage::render
