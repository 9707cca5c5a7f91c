#include "sim/cloth/tearing.h"

#include <algorithm>
#include <cmath>

namespace offstage::sim {
namespace {

struct Broken {
  uint32_t spring;
  Real ratio;  // of length over rest length
};

/// Over the limit, the worst first.
std::vector<Broken> overstretched(const Cloth& cloth) {
  std::vector<Broken> broken;
  for (uint32_t i = 0; i < cloth.springs.size(); ++i) {
    const ClothSpring& s = cloth.springs[i];
    if (s.kind != SpringKind::stretch) continue;
    const Real ratio = (cloth.points[s.a] - cloth.points[s.b]).norm() / s.rest_length;
    if (ratio > cloth.def.tear) broken.push_back({i, ratio});
  }
  std::stable_sort(broken.begin(), broken.end(),
                   [](const Broken& a, const Broken& b) { return a.ratio > b.ratio; });
  return broken;
}

Real area(const Cloth& cloth, const Triangle& t) {
  const Vec3& a = cloth.rest[t[0]];
  return (cloth.rest[t[1]] - a).cross(cloth.rest[t[2]] - a).norm() / 2;
}

bool holds(const Triangle& t, uint32_t point) {
  return t[0] == point || t[1] == point || t[2] == point;
}

/// On which side of the plane through a point, in the unstrained cloth, a place lies; `along` is its normal.
bool is_beyond(const Cloth& cloth, uint32_t point, const Vec3& along, const Vec3& place) {
  return along.dot(place - cloth.rest[point]) > 0;
}

/// Parts the cloth at a point: the triangles beyond the plane get a new one. None if all are on one side.
bool split(Cloth& cloth, uint32_t point, const Vec3& along) {
  Real kept = 0, moved = 0;
  std::vector<Triangle*> beyond;
  for (Triangle& t : cloth.triangles) {
    if (!holds(t, point)) continue;
    const Vec3 centre = (cloth.rest[t[0]] + cloth.rest[t[1]] + cloth.rest[t[2]]) / 3;
    const bool far = is_beyond(cloth, point, along, centre);
    (far ? moved : kept) += area(cloth, t);
    if (far) beyond.push_back(&t);
  }
  if (!(kept > 0) || !(moved > 0)) return false;
  const auto added = static_cast<uint32_t>(cloth.points.size());
  for (Triangle* t : beyond) std::replace(t->begin(), t->end(), point, added);
  cloth.points.push_back(cloth.points[point]);
  cloth.before.push_back(cloth.before[point]);
  cloth.velocities.push_back(cloth.velocities[point]);
  cloth.rest.push_back(cloth.rest[point]);
  cloth.sources.push_back(cloth.sources[point]);
  const Real share = moved / (kept + moved);
  cloth.masses.push_back(share * cloth.masses[point]);
  cloth.masses[point] *= 1 - share;
  // A spring goes with the side of its other end; one that reaches over the tear is cut.
  std::erase_if(cloth.springs, [&](ClothSpring& s) {
    if (s.a != point && s.b != point) return false;
    uint32_t& end = s.a == point ? s.a : s.b;
    const uint32_t other = s.a == point ? s.b : s.a;
    if (is_beyond(cloth, point, along, cloth.rest[other])) end = added;
    if (s.kind != SpringKind::stretch) return false;
    // A thread without a triangle beside it is none.
    return std::none_of(cloth.triangles.begin(), cloth.triangles.end(),
                        [&](const Triangle& t) { return holds(t, end) && holds(t, other); });
  });
  ++cloth.version;
  return true;
}

std::size_t triangles_around(const Cloth& cloth, uint32_t point) {
  return static_cast<std::size_t>(std::count_if(cloth.triangles.begin(), cloth.triangles.end(),
                                                [&](const Triangle& t) { return holds(t, point); }));
}

}  // namespace

uint32_t tear(Cloth& cloth) {
  if (cloth.def.tear == 0) return 0;
  std::vector<ClothSpring> torn;
  std::vector<uint8_t> used(cloth.points.size(), 0);
  for (const Broken& b : overstretched(cloth)) {
    const ClothSpring& s = cloth.springs[b.spring];
    if (used[s.a] || used[s.b]) continue;
    used[s.a] = used[s.b] = 1;
    torn.push_back(s);
  }
  for (const ClothSpring& s : torn) {
    const bool a_first = triangles_around(cloth, s.a) >= triangles_around(cloth, s.b);
    const uint32_t through = a_first ? s.a : s.b, other = a_first ? s.b : s.a;
    if (split(cloth, through, cloth.rest[other] - cloth.rest[through])) continue;
    // A lone thread: nothing but the spring parts.
    std::erase_if(cloth.springs,
                  [&](const ClothSpring& k) { return k.a == s.a && k.b == s.b && k.kind == s.kind; });
  }
  return static_cast<uint32_t>(torn.size());
}

}  // namespace offstage::sim
