#include <numbers>

#include "render/trace/surface_rows.h"

namespace offstage::render {
namespace {

constexpr float kBrightestLobe = 40;  // limit of the lobes of surfaces without mirrored rays

}  // namespace

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
    a = rough;
    smooth = IntLanes{};
    if (lamp.is_sky() || !any(points.visible & (rough <= kSmoothLobe))) return;
    const Lanes density = lamp.point(points.place, {none + 0.5f, none + 0.5f}).density;
    const Lanes size2 = 0.25f / (std::numbers::pi_v<float> * larger(density, none + 1e-12f));
    a = square_root(smaller(rough * rough + larger(variance - size2, none), none + 1));
    smooth = points.visible & (a <= kSmoothLobe);
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
    add_lobe(light, weight * nl * smaller(lobe_of(larger(a, none + kSharp), nl, nv, nh), most), h);
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
  LaneVectors diffuse{none, none, none}, towards = diffuse;
  Lanes without_shadows{};  // sum of all channels of `diffuse`
  for (const RayLamp& lamp : sources_.lamps) {
    const IntLanes shiny = points.visible & ~(lamp.def().in_mirrors ? points.mirrors : IntLanes{});
    const auto lit = [&](const LampPoint<Lanes>& point) {
      return (dot(points.normal, point.towards) > 0.0f) & (point.fraction > 0.0f);
    };
    const LampPoint<Lanes> point = lamp.point(points.place, sampler.next());
    const IntLanes lanes = points.visible & lit(point);
    const LaneVectors light = light_of_lamp(lamp, point, points, lanes, view);
    const Lanes nl = larger(dot(points.normal, point.towards), none);
    diffuse = diffuse + light * nl;
    towards = towards + point.towards * (light.x + light.y + light.z);
    without_shadows += (lanes ? nl : none) * (point.arriving.x + point.arriving.y + point.arriving.z);
    highlights.begin(lamp);
    highlights.add(lamp, point, light * (shiny ? none + 1 : none));
    if (!any(highlights.smooth & shiny)) continue;
    const LampPoint<Lanes> met = lamp.point_towards(points.place, highlights.mirrored);
    const IntLanes hit = highlights.smooth & shiny & lit(met);
    if (any(hit)) highlights.add_mirrored(met, light_of_lamp(lamp, met, points, hit, view));
  }
  const LaneVectors& lobes = highlights.lobes;
  return {diffuse, lobes, towards, highlights.grazing / larger(lobes.x + lobes.y + lobes.z, none + 1e-12f),
          differs((diffuse.x + diffuse.y + diffuse.z) / without_shadows, without_shadows > 0.0f)};
}

// Returns by how much roughness^4 of the highlights of small lamps is increased at eight pixels of a row,
// because the normal varies within a pixel. Only for mirrors that are traced per pixel; for other surfaces,
// filtered_roughness() in shaders/mesh.frag has done so already.
Lanes LightTracer::highlight_variance(const SurfaceBuffer& surfaces, const Points& points, int x, int y) {
  Lanes variance{};
  if (!any(points.own_mirrors)) return variance;
  const auto change2 = [&](int dx, int dy) {
    constexpr float kOther = 4;  // nothing is visible
    if (x + dx < 0 || y + dy < 0 || y + dy >= surfaces.height_px) return Lanes{} + kOther;
    const Points beside(surfaces, pixels_of_row(surfaces, x + dx, y + dy));
    const LaneVectors change = beside.normal - points.normal;
    return beside.visible ? dot(change, change) : Lanes{} + kOther;
  };
  // The smaller one of two differences does not cross the outline of an object.
  for (const auto& [right, up] : {std::pair(1, 0), std::pair(0, 1)})
    variance += 0.5f * smaller(change2(right, up), change2(-right, -up));
  return points.own_mirrors ? smaller(variance, Lanes{} + 0.18f) : Lanes{};
}

}  // namespace offstage::render
