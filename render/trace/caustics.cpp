/// Sunlight that pieces of glass focus (H. W. Jensen, "Global Illumination using Photon Maps", 1996). Rays
/// from the sun are refracted by the glass, and their light is added to the pixels that show the places where
/// they end.

#include <algorithm>
#include <cmath>
#include <numbers>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "render/trace/light_path.h"

namespace offstage::render {
namespace {

// Rays per pixel that a piece covers: of a frame, and at most of a sub-frame.
constexpr float kRaysPerPixel = 4, kMostRaysPerPixel = 2;
constexpr float kMostRays = 4e5f;     // of a sub-frame
constexpr float kRaysPerMean = 36;    // over which a pixel of a frame is averaged
constexpr int kWidestMean_px = 4;     // half-width of the square of pixels
constexpr int kMostSurfaces = 16;     // of glass that a ray meets
constexpr float kSameSurface = 0.9f;  // cosine between normals

float pixels_of(const GlassPiece& piece, const LightView& view) {
  const float pixel = view.pixel_m * (piece.center - view.eye).norm();
  return std::numbers::pi_v<float> * piece.radius * piece.radius / std::max(pixel * pixel, 1e-20f);
}

/// Area that a pixel shows of a surface [m^2]. Its solid angle is in proportion to the cube of the cosine
/// between its direction and the axis of the view.
float area_of_pixel(const Vector3f& place, const Vector3f& normal, const LightView& view) {
  const Vector3f to_eye = view.eye - place;
  const float depth = (view.clip_from_world * place.homogeneous()).w();
  const float cosine_times_distance = std::max(std::abs(normal.dot(to_eye)), 0.02f * to_eye.norm());
  return view.pixel_m * view.pixel_m * depth * depth * depth / cosine_times_distance;
}

}  // namespace

/// Where a ray from the sun ends.
struct LightTracer::Photon {
  int pixel = -1;  ///< that shows the place; negative: none
  Vector3f light = Vector3f::Zero();
};

// Follows a ray that enters the disc around a piece of glass. Of those that meet other glass before it, the
// rays towards that glass have the light.
LightTracer::Photon LightTracer::trace_photon(const GlassPiece& piece, uint32_t number, const LightView& view,
                                              const VisibleLight& visible) const {
  PixelSampler sampler(number & 1023, number >> 10, view.offsets.index, view.offsets.count);
  const SquarePoint<float> on_piece = on_disc(sampler.next());
  const Vector3f to_sun = sun_disc_.direction(sampler.next());
  Three<float> a, b;
  make_basis(from_eigen(to_sun), a, b);
  const float r = 1.01f * piece.radius;
  const Vector3f start = piece.center + r * (to_sun + on_piece.x * to_eigen(a) + on_piece.y * to_eigen(b));
  Vector3f from = start, direction = -to_sun;
  Photon photon;
  Vector3f fraction = Vector3f::Ones();
  for (int k = 0; k < kMostSurfaces; ++k) {
    Hit hit;
    if (!scene_.first_hit(from, direction, kFar, hit) || (k == 0 && hit.object != piece.object))
      return photon;
    const RayMaterial& material = *hit.material;
    if (material.transmission <= 0) {
      photon.pixel = visible.find(hit);
      break;
    }
    const Vector3f albedo = material.transmission * material.color(hit, 0).head<3>();
    if (sampler.next().x < mirrored_fraction(hit, direction)) {
      direction = reflected(direction, hit.normal);
      if (direction.dot(hit.face) <= 0) direction = reflected(direction, hit.face);
      from = off_surface(hit.position, hit.face);
    } else {
      fraction = fraction.cwiseProduct(enter(hit, albedo, sampler, from, direction));
    }
  }
  if (photon.pixel < 0) return photon;
  const float smoke = sources_.smoke != nullptr ? std::exp(-sources_.smoke->depth(start)) : 1.0f;
  photon.light =
      smoke * fraction.cwiseProduct(scene_.transmittance(start, to_sun, kFar, RayScene::Focus::blocks));
  return photon;
}

// Spreads the light over the pixels of the same surface around.
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
  const VisibleLight visible(light, view);
  const auto sub_frames = static_cast<float>(view.offsets.count);
  const float wanted = std::min(kRaysPerPixel / sub_frames, kMostRaysPerPixel);
  float pixels = 0;
  for (const GlassPiece& piece : sources_.glass) pixels += pixels_of(piece, view);
  const float per_pixel = std::min(wanted, kMostRays / std::max(pixels, 1.0f));
  const float side = std::sqrt(kRaysPerMean / (per_pixel * sub_frames));
  const int half_px = std::clamp(static_cast<int>(std::ceil(0.5f * (side - 1))), 1, kWidestMean_px);
  std::vector<Photon> photons;
  for (const GlassPiece& piece : sources_.glass) {
    const float count = std::max(std::ceil(per_pixel * pixels_of(piece, view)), 1.0f);
    const float area = std::numbers::pi_v<float> * std::pow(1.01f * piece.radius, 2.0f);
    const Vector3f power = sources_.sun.intensity * area / count * sources_.sun.color;
    photons.resize(static_cast<std::size_t>(count));
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, photons.size(), 256), [&](const auto& range) {
      for (std::size_t k = range.begin(); k < range.end(); ++k) {
        photons[k] = trace_photon(piece, static_cast<uint32_t>(k), view, visible);
        photons[k].light = photons[k].light.cwiseProduct(power);
      }
    });
    // One after the other, so that the sums do not depend on the threads.
    for (const Photon& photon : photons)
      if (photon.pixel >= 0) add_photon(photon, half_px, view, light);
  }
}

}  // namespace offstage::render
