/// Caustics: light of the sun and of lamps that pieces of glass focus, by photons (H. W. Jensen, "Global
/// Illumination using Photon Maps", 1996). Photons start at the sources, and glass refracts them. Their light
/// is added to the pixels that show their end points.

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "render/trace/light_path.h"

namespace offstage::render {
namespace {

constexpr float kRaysPerPixel = 1;  // photons per pixel that a piece of glass covers, in a sub-frame
constexpr float kMostRays = 4e5f;   // approximate limit of the photons of a sub-frame, at most one per pixel
// Small pieces of glass have more photons: in total one for so many pixels of the picture. Fewer photons
// would be visible as single spots on distant walls.
constexpr float kPixelsPerRay = 32;
constexpr float kMostRaysPerPixel = 64;
constexpr float kRaysPerMean = 64;  // photons over which a pixel of a frame is averaged
constexpr int kWidestMean_px = 12;  // largest half-width of the averaged square of pixels
constexpr int kMostSurfaces = 16;   // largest number of glass surfaces on the path of a photon

/// Estimates the number of pixels that a piece covers, from the mean projected area of its box over all
/// directions, which is a quarter of its surface.
float pixels_of(const GlassPiece& piece, const LightView& view) {
  const float pixel = view.pixel_m * (piece.center() - view.eye).norm();
  float area = 0;
  for (int k = 0; k < 3; ++k) area += 0.5f * piece.side(k).norm();
  return area / std::max(pixel * pixel, 1e-20f);
}

/// Returns the area of a surface that one pixel covers [m^2]. The solid angle of a pixel is in proportion to
/// the cube of the cosine between its direction and the view axis.
float area_of_pixel(const Vector3f& place, const Vector3f& normal, const LightView& view) {
  const Vector3f to_eye = view.eye - place;
  const float depth = (view.clip_from_world * place.homogeneous()).w();
  const float cosine_times_distance = std::max(std::abs(normal.dot(to_eye)), 0.02f * to_eye.norm());
  return view.pixel_m * view.pixel_m * depth * depth * depth / cosine_times_distance;
}

}  // namespace

/// The light of the sun or of a lamp that falls on the box around a piece of glass.
struct LightTracer::Beam {
  const GlassPiece* piece;
  const Sun* sun;  ///< the sun; null: the source is a lamp
  const SunDisc* disc;
  const RayLamp* lamp;
  std::array<float, 6> powers = {};  ///< estimated power at each face of the box, sum of the three colours

  Beam(const GlassPiece* glass, const Sun* the_sun, const SunDisc* sun_disc, const RayLamp* the_lamp)
      : piece(glass), sun(the_sun), disc(sun_disc), lamp(the_lamp) {
    // The least cosine between the light and a face. Light also arrives from other points of a lamp than its
    // centre, and from all sides of a sky.
    const float least = lamp != nullptr && lamp->is_sky() ? 1.0f : 0.02f;
    for (int face = 0; face < 6; ++face) {
      const LampPoint<float> at = point(piece->middle_of(face), {0.5f, 0.5f});
      const Vector3f outward = piece->outward(face);
      powers[static_cast<std::size_t>(face)] =
          to_eigen(at.arriving).sum() * std::max(outward.dot(to_eigen(at.towards)), least * outward.norm());
    }
  }
  float power() const { return std::accumulate(powers.begin(), powers.end(), 0.0f); }
  /// Returns a point of the source as seen from `place`. `uv` is uniform in the unit square.
  LampPoint<float> point(const Vector3f& place, const SquarePoint<float>& uv) const {
    if (sun == nullptr) return lamp->point(from_eigen(place), uv);
    return {from_eigen(disc->direction(uv)), kFar, 1, from_eigen(sun->intensity * sun->color), 0};
  }
};

/// The end point and the light of a photon.
struct LightTracer::Photon {
  int pixel = -1;  ///< pixel that shows the end point; negative: none
  Vector3f light = Vector3f::Zero();
};

// Traces photon `number` of the `count` photons of a beam. A photon counts only if the piece of glass is the
// first surface that it hits. Other pieces have their own photons.
LightTracer::Photon LightTracer::trace_photon(const Beam& beam, uint32_t number, float count,
                                              const LightView& view, const VisibleLight& visible) const {
  const GlassPiece& piece = *beam.piece;
  PixelSampler sampler(number, view.offsets.index, view.offsets.count);
  Photon photon;
  WeightedChoice choice(sampler.next().x);
  int chosen = -1;
  for (int face = 0; face < 6; ++face)
    if (const float power = beam.powers[static_cast<std::size_t>(face)]; power > 0 && choice.take(power))
      chosen = face;
  if (chosen < 0) return photon;
  const SquarePoint<float> on_face = sampler.next();
  // The photon starts a little outside of the box, because the glass may fill the box.
  const Vector3f entry = piece.center() + 1.001f * (piece.middle_of(chosen) - piece.center()) +
                         (on_face.x - 0.5f) * piece.edges.col((chosen + 1) % 3) +
                         (on_face.y - 0.5f) * piece.edges.col((chosen + 2) % 3);
  const LampPoint<float> origin = beam.point(entry, sampler.next());
  const Vector3f towards = to_eigen(origin.towards);
  const float area = piece.outward(chosen).dot(towards) * choice.sum() / choice.weight();
  if (area <= 0) return photon;

  Path path{.from = entry, .direction = -towards, .cone = 0};
  for (int k = 0; k < kMostSurfaces; ++k) {
    Hit hit;
    if (!scene_.first_hit(path.from, path.direction, kFar, hit) || (k == 0 && hit.object != piece.object))
      return photon;
    const RayMaterial& material = *hit.material;
    const RaySurface surface = material.surface(hit, 0, false);
    const Vector4f& color = surface.color;
    // The photon passes through a hole or a translucent surface.
    if (color.w() < 1 && sampler.next().x >= color.w()) {
      path.from = off_surface(hit.position, -hit.face);
    } else if (surface.transmission <= 0) {
      photon.pixel = visible.find(hit);
      break;
    } else if (sampler.next().x < mirrored_fraction(hit, path.direction)) {
      path.turn(reflected(path.direction, hit.normal), hit);
    } else {
      path.fraction =
          path.fraction.cwiseProduct(enter(hit, surface.roughness, surface.transmission * color.head<3>(),
                                           sampler, path.from, path.direction));
    }
  }
  if (photon.pixel < 0) return photon;
  path.fraction *= area / count;
  if (beam.sun != nullptr && sources_.smoke != nullptr)
    path.fraction *= std::exp(-sources_.smoke->depth(entry));
  photon.light =
      path.fraction.cwiseProduct(to_eigen(origin.arriving))
          .cwiseProduct(scene_.transmittance(entry, towards, origin.distance, RayScene::Focus::blocks));
  return photon;
}

// Distributes the light of a photon over the pixels around its end point that show the same surface.
void LightTracer::add_photon(const Photon& photon, int half_px, const LightView& view, LightBuffer& light) {
  constexpr int kSide = 2 * kWidestMean_px + 1, kGroups = (kSide + kLanes - 1) / kLanes;
  const LightGuide& guide = light.pixels;
  const int x0 = photon.pixel % guide.width_px, y0 = photon.pixel / guide.width_px;
  const Vector3f normal = guide.at(guide.normal, x0, y0), place = guide.at(guide.place, x0, y0);
  const int left = x0 - half_px, low = std::max(y0 - half_px, 0),
            high = std::min(y0 + half_px, guide.height_px - 1), groups = (2 * half_px + kLanes) / kLanes;
  const auto slope = [&](auto distance) { return static_cast<float>(half_px + 1) - absolute(distance); };
  std::array<std::array<Lanes, kGroups>, kSide> weights;
  Lanes sums{};
  for (int y = low; y <= high; ++y)
    for (int group = 0; group < groups; ++group) {
      const int x = left + group * kLanes;
      const Lanes column = Lanes{0, 1, 2, 3, 4, 5, 6, 7} + static_cast<float>(x - x0);
      const Lanes weight = larger(slope(column), Lanes{}) * slope(static_cast<float>(y - y0));
      Lanes& kept = weights[static_cast<std::size_t>(y - low)][static_cast<std::size_t>(group)];
      kept = guide.shows(x, y, all_lanes(place), all_lanes(normal)) ? weight : Lanes{};
      sums += kept;
    }
  float sum = 0;
  for (int i = 0; i < kLanes; ++i) sum += sums[i];
  const Vector3f each = photon.light / (sum * area_of_pixel(place, normal, view));
  for (int y = low; y <= high; ++y)
    for (int group = 0; group < groups; ++group) {
      const Lanes& weight = weights[static_cast<std::size_t>(y - low)][static_cast<std::size_t>(group)];
      for (int i = 0; i < kLanes; ++i)
        if (weight[i] > 0)
          light.arriving[index_of(left + group * kLanes + i, y, guide.width_px)].head<3>() +=
              weight[i] * each;
    }
}

std::vector<LightTracer::Beam> LightTracer::beams_to(const GlassPiece& piece) const {
  std::vector<Beam> result;
  if (sources_.sun.intensity > 0 && sources_.sun.shadows)
    result.emplace_back(&piece, &sources_.sun, &sun_disc_, nullptr);
  for (const RayLamp& lamp : sources_.lamps)
    if (lamp.is_focused()) result.emplace_back(&piece, nullptr, nullptr, &lamp);
  return result;
}

// Each piece of glass has photons in proportion to its pixels, and each beam has a share of them in
// proportion to its power.
void LightTracer::add_caustics(const LightView& view, LightBuffer& light) const {
  float pixels = 0;
  for (const GlassPiece& piece : sources_.glass) pixels += pixels_of(piece, view);
  const int size = light.pixels.width_px * light.pixels.height_px;
  const float most = std::min(kMostRays, static_cast<float>(size));
  const float planned = std::min(kRaysPerPixel * pixels, most),
              least = static_cast<float>(size) / kPixelsPerRay;
  const float per_pixel = std::min(std::max(planned, least) / std::max(pixels, 1.0f), kMostRaysPerPixel);
  const VisibleLight visible(light, view);
  std::vector<Photon> photons;
  for (const GlassPiece& piece : sources_.glass) {
    const std::vector<Beam> beams = beams_to(piece);
    float power = 0;
    for (const Beam& beam : beams) power += beam.power();
    for (const Beam& beam : beams) {
      if (!(beam.power() > 0) || !std::isfinite(power)) continue;
      const float count = std::ceil(per_pixel * pixels_of(piece, view) * beam.power() / power);
      const std::size_t first = photons.size();
      photons.resize(first + static_cast<std::size_t>(count));
      tbb::parallel_for(tbb::blocked_range<std::size_t>(first, photons.size(), 256), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i)
          photons[i] = trace_photon(beam, static_cast<uint32_t>(i - first), count, view, visible);
      });
    }
  }
  std::erase_if(photons, [](const Photon& photon) { return photon.pixel < 0; });

  const int width = light.pixels.width_px;
  PixelBlocks<float> ends(width, light.pixels.height_px);
  for (const Photon& photon : photons) ends.at(photon.pixel % width, photon.pixel / width) += 1;
  constexpr float kPixels = 9 * PixelBlocks<float>::kSide * PixelBlocks<float>::kSide;
  // Light is added in one thread, so that the sums do not depend on the number of threads.
  for (const Photon& photon : photons) {
    const float density = ends.sum_around(photon.pixel % width, photon.pixel / width) / kPixels;
    const float wanted = kRaysPerMean / (density * static_cast<float>(view.offsets.count));
    const int half_px = static_cast<int>(std::ceil(0.5f * (std::sqrt(wanted) - 1)));
    add_photon(photon, std::clamp(half_px, 1, kWidestMean_px), view, light);
  }
}

}  // namespace offstage::render
