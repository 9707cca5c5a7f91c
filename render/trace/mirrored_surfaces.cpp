#include "render/trace/mirrored_surfaces.h"

namespace offstage::render {
namespace {

constexpr int kWidestStep = 16;  // widest step of the filter [px]

LightPlane plane_like(const LightGuide& guide) {
  return {guide.width_px, guide.height_px};
}

}  // namespace

void MirroredSurface::add(const MirroredSurface& more) {
  sums += more.sums;
  if (fraction.isZero()) {
    const LightSums all = sums;
    *this = more;
    sums = all;
    return;
  }
  const Eigen::Vector3f total = fraction + more.fraction;
  around = (fraction.cwiseProduct(around) + more.fraction.cwiseProduct(more.around))
               .cwiseQuotient(total.cwiseMax(1e-20f));
  inverse_distance = std::max(inverse_distance, more.inverse_distance);
  fraction = total;
}

MirroredSurfaces::MirroredSurfaces(const Eigen::AlignedBox2i& area_px)
    : first_px_(area_px.min()),
      guide_(area_px.sizes().x(), area_px.sizes().y()),
      around_(guide_.width_px, guide_.height_px, 3),
      fraction_{plane_like(guide_), plane_like(guide_), plane_like(guide_)},
      inverse_distance_(plane_like(guide_)),
      brightness_(plane_like(guide_)),
      reach2_(plane_like(guide_)),
      noisy_reach2_(plane_like(guide_)) {}

void MirroredSurfaces::set(int x, int y, const MirroredSurface& surface) {
  x -= first_px_.x();
  y -= first_px_.y();
  if (surface.fraction.isZero()) return;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    *guide_.place[i].at(x, y) = surface.place[k];
    *guide_.normal[i].at(x, y) = surface.normal[k];
    *fraction_[i].at(x, y) = surface.fraction[k];
    *around_.channels()[i].at(x, y) = surface.around[k];
  }
  *guide_.filled.at(x, y) = 1;
  *inverse_distance_.at(x, y) = surface.inverse_distance;
  *brightness_.at(x, y) = surface.around.sum();
}

// Sets the width of each pixel on the surface that it shows to the distance to the nearest of the surfaces
// beside it. A curved mirror spreads them.
void MirroredSurfaces::measure_pixels() {
  constexpr float kLeast_m = 1e-5f, kFar2 = 1e20f;
  for (int y = 0; y < guide_.height_px; ++y)
    for (int x = 0; x < guide_.width_px; ++x) {
      if (*guide_.filled.at(x, y) == 0) continue;
      const Eigen::Vector3f here = LightGuide::at(guide_.place, x, y);
      const auto nearest2 = [&](int dx, int dy) {
        float result = kFar2;
        for (const int side : {-1, 1}) {
          const int column = x + side * dx, row = y + side * dy;
          if (column < 0 || row < 0 || column >= guide_.width_px || row >= guide_.height_px) continue;
          if (*guide_.filled.at(column, row) == 0) continue;
          result = std::min(result, (LightGuide::at(guide_.place, column, row) - here).squaredNorm());
        }
        return result;
      };
      const float across = nearest2(1, 0), along = nearest2(0, 1);
      const float size2 = std::max(across, along) < kFar2 ? std::max(across, along) : std::min(across, along);
      *guide_.inverse_size2.at(x, y) = 1 / std::max(size2, kLeast_m * kLeast_m);
    }
}

void MirroredSurfaces::filter(int widest) {
  measure_pixels();
  const LightNoise noise(guide_, brightness_);
  guide_.find_reach(inverse_distance_, noise, reach2_, noisy_reach2_);
  for (int step = 1; step <= kWidestStep; step *= 2)
    around_.average(guide_, guide_.filled, step <= widest ? &reach2_ : &noisy_reach2_, step);
}

Eigen::Vector3f MirroredSurfaces::light(int x, int y) const {
  x -= first_px_.x();
  y -= first_px_.y();
  Eigen::Vector3f result;
  for (std::size_t i = 0; i < 3; ++i)
    result[static_cast<Eigen::Index>(i)] = *fraction_[i].at(x, y) * *around_.channels()[i].at(x, y);
  return result;
}

}  // namespace offstage::render
