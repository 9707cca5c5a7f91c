#pragma once
/// Area of a cloth as seen from above, for drape coefficients.

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "sim/cloth/cloth.h"

namespace offstage::sim {

/// Returns the area that a cloth covers when seen from above [m^2]. Only the square of 0.32 m around `centre`
/// is counted, in cells of 0.5 mm.
inline Real shadow_area(const ClothView& cloth, const Vec3& centre) {
  constexpr int kSquares = 640;
  constexpr Real kSquare = 5e-4;
  std::vector<uint8_t> dark(kSquares * kSquares, 0);
  for (const Triangle& t : cloth.triangles) {
    std::array<Eigen::Array2d, 3> p;
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 place = (cloth.points[t[k]] - centre) / kSquare;
      p[k] = Eigen::Array2d(place.x(), place.z()) + kSquares / 2.0;
    }
    const Eigen::Array2d low = p[0].min(p[1]).min(p[2]).floor().max(0.0);
    const Eigen::Array2d high = p[0].max(p[1]).max(p[2]).ceil().min(kSquares - 1.0);
    const auto side = [&](std::size_t k, const Eigen::Array2d& at) {
      const Eigen::Array2d along = p[(k + 1) % 3] - p[k], across = at - p[k];
      return along.x() * across.y() - along.y() * across.x();
    };
    for (int i = static_cast<int>(low.x()); i <= static_cast<int>(high.x()); ++i)
      for (int j = static_cast<int>(low.y()); j <= static_cast<int>(high.y()); ++j) {
        const Eigen::Array2d at(i + 0.5, j + 0.5);
        const Real a = side(0, at), b = side(1, at), c = side(2, at);
        if (std::min({a, b, c}) >= 0 || std::max({a, b, c}) <= 0)
          dark[static_cast<std::size_t>(i * kSquares + j)] = 1;
      }
  }
  return kSquare * kSquare * static_cast<Real>(std::ranges::count(dark, 1));
}

}  // namespace offstage::sim
