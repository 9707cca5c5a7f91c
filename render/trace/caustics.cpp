/// Caustics: light of the sun and of lamps that pieces of glass focus, by photons (H. W. Jensen, "Global
/// Illumination using Photon Maps", 1996). Photons start at the sources, and glass refracts them. Their light
/// is added to the pixels that show their end points.

#include <algorithm>
#include <cmath>
#include <numeric>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "render/trace/light_path.h"

namespace offstage::render {
namespace {

constexpr float kRaysPerPixel = 1;    // photons per pixel that a piece of glass covers, in a sub-frame
constexpr float kMostRays = 4e5f;     // approximate limit of the photons of a sub-frame
constexpr float kRaysPerMean = 64;    // photons over which a pixel of a frame is averaged
constexpr int kWidestMean_px = 8;     // largest half-width of the averaged square of pixels
constexpr int kMostSurfaces = 16;     // largest number of glass surfaces on the path of a photon
constexpr float kSameSurface = 0.9f;  // least cosine between normals of one surface

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

/// A source of photons: the sun or a lamp.
struct LightTracer::Source {
  const Sun* sun;  ///< null: a lamp
  const SunDisc& disc;
  const RayLamp* lamp;

  /// Returns a point of the source as seen from `place`. `uv` is uniform in the unit square.
  LampPoint<float> point(const Vector3f& place, const SquarePoint<float>& uv) const {
    if (sun == nullptr) return lamp->point(from_eigen(place), uv);
    return {from_eigen(disc.direction(uv)), kFar, 1, from_eigen(sun->intensity * sun->color), 0};
  }
  /// Estimates the power that arrives at a face of a box without shadows. `middle`: centre of the face;
  /// `outward`: its outward normal, whose length is its area.
  Vector3f light(const Vector3f& middle, const Vector3f& outward) const {
    const LampPoint<float> at = point(middle, {0.5f, 0.5f});
    // Other points of a lamp may be on the other side of the face, and those of the sky are all around.
    const float least = lamp != nullptr && lamp->is_sky() ? 1.0f : 0.02f;
    return to_eigen(at.arriving) * std::max(outward.dot(to_eigen(at.towards)), least * outward.norm());
  }
};

/// The end point and the light of a photon.
struct LightTracer::Photon {
  int pixel = -1;  ///< pixel that shows the end point; negative: none
  Vector3f light = Vector3f::Zero();
};

// Traces photon `number` of `count` photons that enter the box around a piece of glass. A photon counts only
// if this piece is the first surface that it hits. Other pieces have their own photons.
LightTracer::Photon LightTracer::trace_photon(const GlassPiece& piece, const Source& source, uint32_t number,
                                              float count, const LightView& view,
                                              const VisibleLight& visible) const {
  PixelSampler sampler(number, view.offsets.index, view.offsets.count);
  Photon photon;
  WeightedChoice choice(sampler.next().x);
  int chosen = -1;
  for (int face = 0; face < 6; ++face)
    if (const float weight = source.light(piece.middle_of(face), piece.outward(face)).sum();
        weight > 0 && choice.take(weight))
      chosen = face;
  if (chosen < 0) return photon;
  const SquarePoint<float> on_face = sampler.next();
  // The photon starts a little outside of the box, because the glass may fill the box.
  const Vector3f entry = piece.center() + 1.001f * (piece.middle_of(chosen) - piece.center()) +
                         (on_face.x - 0.5f) * piece.edges.col((chosen + 1) % 3) +
                         (on_face.y - 0.5f) * piece.edges.col((chosen + 2) % 3);
  const LampPoint<float> origin = source.point(entry, sampler.next());
  const Vector3f towards = to_eigen(origin.towards);
  const float area = piece.outward(chosen).dot(towards) * choice.sum() / choice.weight();
  if (area <= 0) return photon;

  Vector3f from = entry, direction = -towards, fraction = Vector3f::Ones();
  for (int k = 0; k < kMostSurfaces; ++k) {
    Hit hit;
    if (!scene_.first_hit(from, direction, kFar, hit) || (k == 0 && hit.object != piece.object))
      return photon;
    const RayMaterial& material = *hit.material;
    const Vector4f color = material.color(hit, 0);
    if (color.w() < 1 && sampler.next().x >= color.w()) {  // through a hole, or a translucent surface
      from = off_surface(hit.position, -hit.face);
      continue;
    }
    if (material.transmission <= 0) {
      photon.pixel = visible.find(hit);
      break;
    }
    const Vector3f albedo = material.transmission * color.head<3>();
    if (sampler.next().x < mirrored_fraction(hit, direction)) {
      direction = reflected(direction, hit.normal);
      if (direction.dot(hit.face) <= 0) direction = reflected(direction, hit.face);
      from = off_surface(hit.position, hit.face);
    } else {
      fraction = fraction.cwiseProduct(enter(hit, albedo, sampler, from, direction));
    }
  }
  if (photon.pixel < 0) return photon;
  fraction *= area / count;
  if (source.sun != nullptr && sources_.smoke != nullptr) fraction *= std::exp(-sources_.smoke->depth(entry));
  photon.light =
      fraction.cwiseProduct(to_eigen(origin.arriving))
          .cwiseProduct(scene_.transmittance(entry, towards, origin.distance, RayScene::Focus::blocks));
  return photon;
}

/// The number of photons per pixel in each block of 8 x 8 pixels.
class LightTracer::PhotonDensity {
 public:
  PhotonDensity(std::span<const Photon> photons, int width_px, int height_px)
      : width_px_(width_px),
        columns_((width_px + kBlock_px - 1) / kBlock_px),
        rows_((height_px + kBlock_px - 1) / kBlock_px),
        counts_(static_cast<std::size_t>(columns_ * rows_)) {
    for (const Photon& photon : photons) ++counts_[block(column_of(photon.pixel), row_of(photon.pixel))];
  }
  /// Returns the mean density over the block of a pixel and its neighbours.
  float at(int pixel) const {
    float sum = 0;
    int blocks = 0;
    for (int y = std::max(row_of(pixel) - 1, 0); y <= std::min(row_of(pixel) + 1, rows_ - 1); ++y)
      for (int x = std::max(column_of(pixel) - 1, 0); x <= std::min(column_of(pixel) + 1, columns_ - 1);
           ++x) {
        sum += counts_[block(x, y)];
        ++blocks;
      }
    return sum / static_cast<float>(blocks * kBlock_px * kBlock_px);
  }

 private:
  static constexpr int kBlock_px = 8;
  int column_of(int pixel) const { return pixel % width_px_ / kBlock_px; }
  int row_of(int pixel) const { return pixel / width_px_ / kBlock_px; }
  std::size_t block(int column, int row) const { return static_cast<std::size_t>(row * columns_ + column); }

  int width_px_, columns_, rows_;
  std::vector<float> counts_;
};

// Distributes the light of a photon over the pixels around its end point that show the same surface.
void LightTracer::add_photon(const Photon& photon, int half_px, const LightView& view, LightBuffer& light) {
  const LightGuide& guide = light.pixels;
  const int x0 = photon.pixel % guide.width_px, y0 = photon.pixel / guide.width_px;
  const auto three = [](const std::array<LightPlane, 3>& planes, int x, int y) {
    return Vector3f(*planes[0].at(x, y), *planes[1].at(x, y), *planes[2].at(x, y));
  };
  const Vector3f normal = three(guide.normal, x0, y0), place = three(guide.place, x0, y0);
  const float inverse_size2 = *guide.inverse_size2.at(x0, y0);
  const Vector3f each = photon.light / area_of_pixel(place, normal, view);
  const auto for_pixels = [&](auto&& use) {
    for (int y = std::max(y0 - half_px, 0); y <= std::min(y0 + half_px, guide.height_px - 1); ++y)
      for (int x = std::max(x0 - half_px, 0); x <= std::min(x0 + half_px, guide.width_px - 1); ++x) {
        const float off = normal.dot(three(guide.place, x, y) - place);
        if (*guide.filled.at(x, y) > 0 && normal.dot(three(guide.normal, x, y)) > kSameSurface &&
            off * off * inverse_size2 < 1)
          use(x, y, static_cast<float>((half_px + 1 - std::abs(x - x0)) * (half_px + 1 - std::abs(y - y0))));
      }
  };
  float sum = 0;
  for_pixels([&](int, int, float weight) { sum += weight; });
  for_pixels([&](int x, int y, float weight) {
    light.arriving[index_of(x, y, guide.width_px)].head<3>() += weight / sum * each;
  });
}

void LightTracer::add_caustics(const LightView& view, LightBuffer& light) const {
  std::vector<Source> sources;
  if (sources_.sun.intensity > 0 && sources_.sun.shadows)
    sources.push_back({.sun = &sources_.sun, .disc = sun_disc_, .lamp = nullptr});
  for (const RayLamp& lamp : sources_.lamps)
    if (lamp.focus() == RayScene::Focus::blocks)
      sources.push_back({.sun = nullptr, .disc = sun_disc_, .lamp = &lamp});

  float pixels = 0;
  for (const GlassPiece& piece : sources_.glass) pixels += pixels_of(piece, view);
  const float per_pixel = std::min(kRaysPerPixel, kMostRays / std::max(pixels, 1.0f));
  const VisibleLight visible(light, view);
  std::vector<Photon> photons;
  for (const GlassPiece& piece : sources_.glass) {
    std::vector<float> powers;  // all photons of a piece get about the same power
    for (const Source& source : sources) {
      float& power = powers.emplace_back(0.0f);
      for (int face = 0; face < 6; ++face)
        power += source.light(piece.middle_of(face), piece.outward(face)).sum();
    }
    const float all = std::accumulate(powers.begin(), powers.end(), 0.0f);
    for (std::size_t k = 0; k < sources.size(); ++k) {
      if (!(powers[k] > 0) || !std::isfinite(all)) continue;
      const float count = std::ceil(per_pixel * pixels_of(piece, view) * powers[k] / all);
      const std::size_t first = photons.size();
      photons.resize(first + static_cast<std::size_t>(count));
      tbb::parallel_for(tbb::blocked_range<std::size_t>(first, photons.size(), 256), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i)
          photons[i] =
              trace_photon(piece, sources[k], static_cast<uint32_t>(i - first), count, view, visible);
      });
    }
  }
  std::erase_if(photons, [](const Photon& photon) { return photon.pixel < 0; });
  const PhotonDensity density(photons, light.pixels.width_px, light.pixels.height_px);
  // Light is added in one thread, so that the sums do not depend on the number of threads.
  for (const Photon& photon : photons) {
    const float wanted = kRaysPerMean / (density.at(photon.pixel) * static_cast<float>(view.offsets.count));
    const int half_px = static_cast<int>(std::ceil(0.5f * (std::sqrt(wanted) - 1)));
    add_photon(photon, std::clamp(half_px, 1, kWidestMean_px), view, light);
  }
}

}  // namespace offstage::render
