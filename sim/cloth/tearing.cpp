#include "sim/cloth/tearing.h"

#include <algorithm>
#include <cmath>

namespace offstage::sim {
namespace {

/// A tear relieves the cloth around it up to this distance in a step, as a multiple of the broken spring's
/// length.
constexpr Real kRelief = 2;

struct Broken {
  uint32_t spring;
  bool at_border;
  Real ratio;  // length over rest length
};

bool holds(const Triangle& t, uint32_t point) {
  return t[0] == point || t[1] == point || t[2] == point;
}

std::vector<uint32_t> triangles_around(const Cloth& cloth, uint32_t point) {
  std::vector<uint32_t> around;
  for (uint32_t t = 0; t < cloth.triangles.size(); ++t)
    if (holds(cloth.triangles[t], point)) around.push_back(t);
  return around;
}

/// Returns the neighbours of a point. A neighbour appears once for each triangle that it shares with the
/// point.
std::vector<uint32_t> points_around(const Cloth& cloth, uint32_t point) {
  std::vector<uint32_t> around;
  for (uint32_t t : triangles_around(cloth, point))
    for (uint32_t i : cloth.triangles[t])
      if (i != point) around.push_back(i);
  std::sort(around.begin(), around.end());
  return around;
}

/// Whether the point is on a border: one of its edges has a triangle on one side only.
bool is_at_border(const Cloth& cloth, uint32_t point) {
  const std::vector<uint32_t> around = points_around(cloth, point);
  return std::any_of(around.begin(), around.end(),
                     [&](uint32_t i) { return std::count(around.begin(), around.end(), i) == 1; });
}

/// Returns the springs over the limit, in the order in which they break.
std::vector<Broken> overstretched(const Cloth& cloth) {
  std::vector<Broken> broken;
  for (uint32_t i = 0; i < cloth.springs.size(); ++i) {
    const ClothSpring& s = cloth.springs[i];
    if (s.kind != SpringKind::stretch) continue;
    const Real longest = cloth.def.tear * s.rest_length;
    const Real length2 = (cloth.points[s.a] - cloth.points[s.b]).squaredNorm();
    if (length2 > longest * longest)
      broken.push_back(
          {i, is_at_border(cloth, s.a) || is_at_border(cloth, s.b), std::sqrt(length2) / s.rest_length});
  }
  std::stable_sort(broken.begin(), broken.end(), [](const Broken& a, const Broken& b) {
    return a.at_border != b.at_border ? a.at_border : a.ratio > b.ratio;
  });
  return broken;
}

Vec3 rest_centre(const Cloth& cloth, const Triangle& t) {
  return (cloth.rest[t[0]] + cloth.rest[t[1]] + cloth.rest[t[2]]) / 3;
}

Real rest_area(const Cloth& cloth, const Triangle& t) {
  const Vec3& a = cloth.rest[t[0]];
  return (cloth.rest[t[1]] - a).cross(cloth.rest[t[2]] - a).norm() / 2;
}

/// Triangles at a point that are connected by shared edges.
struct Fan {
  std::vector<uint32_t> triangles;

  bool holds_point(const Cloth& cloth, uint32_t i) const {
    return std::any_of(triangles.begin(), triangles.end(),
                       [&](uint32_t t) { return holds(cloth.triangles[t], i); });
  }
  Real area(const Cloth& cloth) const {
    Real sum = 0;
    for (uint32_t t : triangles) sum += rest_area(cloth, cloth.triangles[t]);
    return sum;
  }
  /// Returns the greatest cosine between a direction from the point and the directions to the triangles'
  /// centres.
  Real faces(const Cloth& cloth, uint32_t point, const Vec3& direction) const {
    Real most = -1;
    for (uint32_t t : triangles)
      most = std::max(
          most, direction.dot((rest_centre(cloth, cloth.triangles[t]) - cloth.rest[point]).normalized()));
    return most;
  }
};

/// Returns the fans at a point. Edges do not connect triangles on different sides of the plane through the
/// point with this normal. A zero normal is no plane.
std::vector<Fan> fans_at(const Cloth& cloth, uint32_t point, const Vec3& normal) {
  std::vector<uint32_t> left = triangles_around(cloth, point);
  const auto is_beyond = [&](uint32_t t) {
    return normal.dot(rest_centre(cloth, cloth.triangles[t]) - cloth.rest[point]) > 0;
  };
  const auto share_edge = [&](uint32_t t, uint32_t u) {
    return std::any_of(cloth.triangles[t].begin(), cloth.triangles[t].end(),
                       [&](uint32_t i) { return i != point && holds(cloth.triangles[u], i); });
  };
  std::vector<Fan> fans;
  while (!left.empty()) {
    Fan& fan = fans.emplace_back();
    fan.triangles.push_back(left.front());
    left.erase(left.begin());
    for (std::size_t k = 0; k < fan.triangles.size(); ++k) {
      const uint32_t t = fan.triangles[k];
      std::erase_if(left, [&](uint32_t u) {
        const bool joined = share_edge(t, u) && is_beyond(t) == is_beyond(u);
        if (joined) fan.triangles.push_back(u);
        return joined;
      });
    }
  }
  return fans;
}

/// Gives every fan except the first a point of its own, and moves springs to the fans to which they belong.
void part(Cloth& cloth, uint32_t point, const std::vector<Fan>& fans) {
  const auto fans_with = [&](uint32_t i) {
    std::vector<std::size_t> with;
    for (std::size_t f = 0; f < fans.size(); ++f)
      if (fans[f].holds_point(cloth, i)) with.push_back(f);
    return with;
  };
  // Springs across the tear are cut.
  std::erase_if(cloth.springs, [&](const ClothSpring& s) {
    if (s.a == point || s.b == point) return false;
    const std::vector<std::size_t> a = fans_with(s.a), b = fans_with(s.b);
    return !a.empty() && !b.empty() &&
           std::none_of(a.begin(), a.end(), [&](std::size_t f) { return std::ranges::count(b, f) > 0; });
  });

  // The diagonals of a separated cell are no longer counterparts.
  for (ClothSpring& s : cloth.springs)
    if (s.a == point || s.b == point || std::ranges::count(s.counterpart, point) > 0) s.counterpart_rest = 0;

  Real area = 0;
  for (const Fan& fan : fans) area += fan.area(cloth);
  const Real mass = cloth.masses[point];
  std::vector<uint32_t> own(fans.size(), point);  // by fan: its point
  for (std::size_t f = 0; f < fans.size(); ++f) {
    const Real fraction = area > 0 ? fans[f].area(cloth) / area : 1.0 / static_cast<Real>(fans.size());
    if (f == 0) {
      cloth.masses[point] = fraction * mass;
      continue;
    }
    own[f] = static_cast<uint32_t>(cloth.points.size());
    cloth.points.push_back(cloth.points[point]);
    cloth.before.push_back(cloth.before[point]);
    cloth.velocities.push_back(cloth.velocities[point]);
    cloth.rest.push_back(cloth.rest[point]);
    cloth.sources.push_back(cloth.sources[point]);
    cloth.masses.push_back(fraction * mass);
  }

  const std::size_t count = cloth.springs.size();
  for (std::size_t k = 0; k < count; ++k) {
    ClothSpring s = cloth.springs[k];
    if (s.a != point && s.b != point) continue;
    const uint32_t other = s.a == point ? s.b : s.a;
    std::vector<std::size_t> with = fans_with(other);
    if (with.empty()) {
      const Vec3 direction = (cloth.rest[other] - cloth.rest[point]).normalized();
      const auto less = [&](const Fan& a, const Fan& b) {
        return a.faces(cloth, point, direction) < b.faces(cloth, point, direction);
      };
      with.push_back(
          static_cast<std::size_t>(std::max_element(fans.begin(), fans.end(), less) - fans.begin()));
    }
    // A tear along an edge gives each side half of the edge's threads.
    s.stiffness /= static_cast<Real>(with.size());
    s.damping /= static_cast<Real>(with.size());
    for (std::size_t j = 0; j < with.size(); ++j) {
      (s.a == other ? s.b : s.a) = own[with[j]];
      if (j == 0)
        cloth.springs[k] = s;
      else
        cloth.springs.push_back(s);
    }
  }
  for (std::size_t f = 1; f < fans.size(); ++f)
    for (uint32_t t : fans[f].triangles)
      std::replace(cloth.triangles[t].begin(), cloth.triangles[t].end(), point, own[f]);
  ++cloth.version;
}

/// Separates the cloth at a point, and then parts that are connected by a single point only. Returns false if
/// all triangles are on one side of the plane.
bool split(Cloth& cloth, uint32_t point, const Vec3& normal) {
  const std::vector<Fan> fans = fans_at(cloth, point, normal);
  if (fans.size() < 2) return false;
  std::vector<uint32_t> beside = points_around(cloth, point);
  beside.erase(std::unique(beside.begin(), beside.end()), beside.end());
  part(cloth, point, fans);
  for (uint32_t i : beside)
    if (const std::vector<Fan> apart = fans_at(cloth, i, Vec3::Zero()); apart.size() > 1)
      part(cloth, i, apart);
  return true;
}

}  // namespace

uint32_t tear(Cloth& cloth, ClothTear first_tear) {
  if (cloth.def.tear == 0) return 0;
  std::vector<ClothSpring> torn;
  const std::vector<Broken> broken = overstretched(cloth);
  if (!broken.empty() && !cloth.first_tear) {
    const Broken& worst = *std::ranges::max_element(broken, {}, &Broken::ratio);
    const ClothSpring& s = cloth.springs[worst.spring];
    first_tear.stretch = worst.ratio;
    first_tear.place = (cloth.points[s.a] + cloth.points[s.b]) / 2;
    cloth.first_tear = first_tear;
  }
  for (const Broken& b : broken) {
    const ClothSpring& s = cloth.springs[b.spring];
    const bool relieved = std::any_of(torn.begin(), torn.end(), [&](const ClothSpring& t) {
      return (cloth.rest[t.a] - cloth.rest[s.a]).norm() < kRelief * t.rest_length;
    });
    if (!relieved) torn.push_back(s);
  }
  for (const ClothSpring& s : torn) {
    const bool a_first = is_at_border(cloth, s.a) || !is_at_border(cloth, s.b);
    const uint32_t first = a_first ? s.a : s.b, second = a_first ? s.b : s.a;
    const Vec3 along = cloth.rest[second] - cloth.rest[first];
    if (split(cloth, first, along) || split(cloth, second, -along)) continue;
    // A thread without triangles breaks without a tear: only its spring is removed.
    std::erase_if(cloth.springs,
                  [&](const ClothSpring& k) { return k.a == s.a && k.b == s.b && k.kind == s.kind; });
  }
  return static_cast<uint32_t>(torn.size());
}

}  // namespace offstage::sim
