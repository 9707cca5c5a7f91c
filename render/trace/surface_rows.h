#pragma once
/// Private: the visible surfaces of a picture, eight pixels at a time, for the files that define LightTracer.

#include <algorithm>
#include <array>
#include <atomic>
#include <span>
#include <vector>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include "render/error.h"
#include "render/trace/light_path.h"
#include "render/trace/packed_direction.h"

namespace offstage::render {

/// Roughness^2 of surfaces, above which highlights are filtered and have no mirrored rays.
inline constexpr float kSmoothLobe = 0.1f;
/// Roughness above which mirror images are filtered.
inline constexpr float kSharpMirror = 0.12f;

/// Returns unit vectors from octahedral coordinates.
inline LaneVectors from_octahedral(Lanes x, Lanes z) {
  const Lanes one = Lanes{} + 1, y = 1 - absolute(x) - absolute(z);
  const Lanes folded_x = (1 - absolute(z)) * (x < 0.0f ? -one : one);
  const Lanes folded_z = (1 - absolute(x)) * (z < 0.0f ? -one : one);
  return normalized(LaneVectors{y < 0.0f ? folded_x : x, y, y < 0.0f ? folded_z : z});
}

inline void set_lane(LaneVectors& lanes, int i, const Vector3f& value) {
  lanes.x[i] = value.x();
  lanes.y[i] = value.y();
  lanes.z[i] = value.z();
}

/// Returns the indices of the pixels x ... x + 7 of a row; -1 beyond its end.
inline IntLanes pixels_of_row(const SurfaceBuffer& surfaces, int x, int y) {
  const IntLanes columns = IntLanes{0, 1, 2, 3, 4, 5, 6, 7} + x;
  return columns < surfaces.width_px ? columns + y * surfaces.width_px : IntLanes{} - 1;
}

/// Returns whether the fraction of the light that arrives differs between the active lanes.
inline bool differs(Lanes fraction, IntLanes active) {
  constexpr float kDifferent = 0.3f;
  float least = 1, most = 0;
  for (int i = 0; i < kLanes; ++i) {
    if (!active[i]) continue;
    least = std::min(least, fraction[i]);
    most = std::max(most, fraction[i]);
  }
  return most - least > kDifferent;
}

/// Stores vectors for the pixels x ... x + 7 of a row.
inline void store(std::span<LightPlane> planes, int x, int y, const LaneVectors& value) {
  planes[0].set_lanes(x, y, value.x);
  planes[1].set_lanes(x, y, value.y);
  planes[2].set_lanes(x, y, value.z);
}

/// Returns the values of the pixels x ... x + 7 of a row, without those beyond its end.
inline std::span<Vector4f> row_part(std::vector<Vector4f>& values, int x, int y, int width) {
  return std::span(values).subspan(index_of(x, y, width),
                                   static_cast<std::size_t>(std::min(kLanes, width - x)));
}

/// A visible surface.
struct LightTracer::Point {
  Vector3f place, normal, face, view;
  float roughness = 0;
};

/// Eight visible surfaces.
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

/// Light of lamps at eight surfaces.
struct LightTracer::LampLight {
  LaneVectors diffuse, lobes;
  LaneVectors towards;  ///< sum of the directions to the lamps, times their light
  Lanes fresnel;        ///< factor of the lobes
  bool partly_hidden;   ///< whether some of the surfaces are in shadow, and others less

  void store_diffuse(std::span<Vector4f> lamps) const {
    for (std::size_t i = 0; i < lamps.size(); ++i) lamps[i] = {diffuse.x[i], diffuse.y[i], diffuse.z[i], 0};
  }
  void store_directions(std::span<Vector4f> lamps) const {
    for (std::size_t i = 0; i < lamps.size(); ++i)
      lamps[i].w() = packed_direction({towards.x[i], towards.y[i], towards.z[i]});
  }
  void store_highlights(std::span<Vector4f> highlights) const {
    for (std::size_t i = 0; i < highlights.size(); ++i)
      highlights[i] = {lobes.x[i], lobes.y[i], lobes.z[i], fresnel[i]};
  }
};

/// Calls each(y) for all rows in parallel. Each task of kRowsPerTask rows first checks for a request to stop.
void LightTracer::for_rows(int height, const auto& each) const {
  constexpr int kRowsPerTask = 8;
  std::atomic<bool> stopped = false;
  tbb::parallel_for(tbb::blocked_range<int>(0, height, kRowsPerTask), [&](const auto& rows) {
    if (stop_ && !stopped && stop_()) stopped = true;
    for (int y = rows.begin(); y < rows.end() && !stopped; ++y) each(y);
  });
  if (stopped) throw StoppedError("the light is no longer needed");
}

/// Calls each(y, sums) for all rows in parallel and returns the total. Each row has its own sums, so that the
/// total does not depend on the threads.
LightSums LightTracer::sum_over_rows(int height, const auto& each) const {
  std::vector<LightSums> rows(static_cast<std::size_t>(height));
  for_rows(height, [&](int y) { each(y, rows[static_cast<std::size_t>(y)]); });
  LightSums total;
  for (const LightSums& row : rows) total += row;
  return total;
}

}  // namespace offstage::render
