#include "sim/cloth/self_contacts.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

#include "sim/geometry/closest_points.h"

namespace offstage::sim {
namespace {

/// The search finds pairs whose gap is up to this many thicknesses. Points may deviate from their predicted
/// paths by half of this gap.
constexpr Real kMargin = 0.8;
/// The margin for pairs that are searched again while the other points keep their predicted paths. The other
/// points may deviate by a quarter of kMargin.
constexpr Real kStrayMargin = 1.5 * kMargin;
/// If at most one in this many points deviates, only the pairs of these points are searched again.
constexpr std::size_t kFew = 3;
/// Work of fitting a triangle's box, of testing a pair, and of finding its closest points. The unit is the
/// check of a known pair in a sub-step (measured).
constexpr std::size_t kFitWork = 10;
constexpr Real kPairWork = 3, kClosestWork = 8;
/// Pairs that are near each other in the cloth at rest are pushed apart only to this fraction of their
/// distance at rest.
constexpr Real kRestFraction = 0.8;
/// Fraction of an overlap that is removed per sub-step, so that layers do not fly apart.
constexpr Real kSelfRecovery = 0.05;
/// kLeft: fraction of the distance of a pair that remains in a sub-step, so that a plane always separates it.
/// kNearest: a pair nearer than this fraction of its thickness does not approach further, because its
/// distance and its side would soon be lost in rounding.
constexpr Real kLeft = 0.1, kNearest = 0.02;
/// Sine of the angle by which the surface around a closest point may rise towards the other surface, so that
/// curved layers touch at several places. A contact inclined by it takes kRise^2 of the speed of sliding.
constexpr Real kRise = 0.05;
/// Distance below which the normal is undefined [m].
constexpr Real kNoSide = 1e-9;
/// A unit vector in single precision has at least this length.
constexpr Real kUnit = 1 - 1e-6;
/// Number of sweeps over the pairs that would cross. The distance that they keep exceeds the necessary one by
/// the factor kBeyondLeast.
constexpr int kSideSweeps = 8;
constexpr Real kBeyondLeast = 1.01;
/// Moves are halved until they are below this fraction, and then set to 0.
constexpr Real kLeastFraction = 0.1;

Vec3 place(std::span<const Vec4> points, uint32_t i) {
  return points[i].head<3>();
}

struct Closest {
  std::array<Real, 4> weights;  // weights of the points: (1, -b), or (1 - s, s, t - 1, -t)
  Vec4 apart;                   // vector from the second element's nearest point to the first element's
  bool inner;                   // for two edges: neither nearest point is an end of its edge
};

Real fraction_along(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Real length2 = (b - a).squaredNorm();
  return length2 > 0 ? std::clamp((p - a).dot(b - a) / length2, 0.0, 1.0) : 0;
}

Closest closest(std::span<const Vec4> x, const std::array<uint32_t, 4>& p, bool edges) {
  const Vec3 p0 = place(x, p[0]), p1 = place(x, p[1]), p2 = place(x, p[2]), p3 = place(x, p[3]);
  if (!edges) {
    const TrianglePoint q = closest_on_triangle(p0, p1, p2, p3);
    return {{1, -q.weights[0], -q.weights[1], -q.weights[2]}, padded(p0 - q.point), true};
  }
  const ClosestPoints q = closest_on_segments(p0, p1, p2, p3);
  const Real s = fraction_along(q.on_a, p0, p1), t = fraction_along(q.on_b, p2, p3);
  const bool inner = s > 0 && s < 1 && t > 0 && t < 1;
  return {{1 - s, s, t - 1, -t}, padded(q.on_a - q.on_b), inner};
}

/// Whether the bounding boxes of a pair's elements are more than `reach` apart along the same axis, both at
/// the start and at the end. The test is fast and true for most pairs.
bool boxes_apart(std::span<const Vec4> start, std::span<const Vec4> end, const std::array<uint32_t, 4>& p,
                 bool edges, Real reach) {
  Vec4 over = Vec4::Constant(1e300), under = over;
  for (std::span<const Vec4> x : {start, end}) {
    const Vec4 &p0 = x[p[0]], &p1 = x[p[1]], &p2 = x[p[2]], &p3 = x[p[3]];
    const Vec4 low_a = edges ? Vec4(p0.cwiseMin(p1)) : p0, high_a = edges ? Vec4(p0.cwiseMax(p1)) : p0;
    Vec4 low_b = p2.cwiseMin(p3), high_b = p2.cwiseMax(p3);
    if (!edges) {
      low_b = low_b.cwiseMin(p1);
      high_b = high_b.cwiseMax(p1);
    }
    over = over.cwiseMin(low_a - high_b);
    under = under.cwiseMin(low_b - high_a);
  }
  return over.cwiseMax(under).maxCoeff() > reach;
}

/// Returns the smallest n . (x_i - x_j), over the points i of the pair's first element and j of its second.
Real separation(std::span<const Vec4> x, const std::array<uint32_t, 4>& p, bool edges, const Vec4& n) {
  const Real h0 = n.dot(x[p[0]]), h1 = n.dot(x[p[1]]), h2 = n.dot(x[p[2]]), h3 = n.dot(x[p[3]]);
  return edges ? std::min(h0, h1) - std::max(h2, h3) : h0 - std::max({h1, h2, h3});
}

/// Whether a plane with the normal n (of any length) separates both elements by more than `reach` [m] at the
/// start and at the end. Points move on straight lines, so their heights above the plane change linearly, and
/// the plane separates them all the time.
bool plane_separates(std::span<const Vec4> start, std::span<const Vec4> end, const std::array<uint32_t, 4>& p,
                     bool edges, const Vec4& n, Real reach) {
  const Real from = separation(start, p, edges, n);
  if (!(from > 0)) return false;
  const Real to = separation(end, p, edges, n), least = std::min(from, to);
  return least > 0 && least * least > reach * reach * n.squaredNorm();
}

/// Returns the vector from the middle of the pair's second element to the middle of the first one [m]. For
/// two edges it is twice as long, because only its direction is used.
Vec4 middle_to_middle(std::span<const Vec4> x, const std::array<uint32_t, 4>& p, bool edges) {
  if (edges) return x[p[0]] + x[p[1]] - x[p[2]] - x[p[3]];
  return x[p[0]] - (x[p[1]] + x[p[2]] + x[p[3]]) / 3;
}

/// Returns the normal of the pair towards its first element, of any length: perpendicular to both edges, or
/// to the triangle.
Vec4 common_normal(std::span<const Vec4> x, const std::array<uint32_t, 4>& p, bool edges) {
  const Vec3 p0 = place(x, p[0]), p1 = place(x, p[1]), p2 = place(x, p[2]), p3 = place(x, p[3]);
  const Vec3 n = edges ? (p1 - p0).cross(p3 - p2) : (p2 - p1).cross(p3 - p1);
  return padded(n.dot(p0 - p2) < 0 ? Vec3(-n) : n);
}

Real least_distance(Real distance, Real nearest) {
  return (1 - 1e-9) * std::max(kLeft * distance, std::min(distance, nearest));
}

/// Returns how many of a pair's four points belong to its first element.
std::size_t first_side(bool edges) {
  return edges ? 2 : 1;
}

}  // namespace

void SelfContacts::assign(std::vector<Triangle> triangles, const ClothPoints& points) {
  triangles_ = std::move(triangles);
  tree_.build(triangles_, points.rest);
  std::vector<uint8_t> point_taken(points.size(), 0);
  std::map<std::pair<uint32_t, uint32_t>, bool> edge_taken;
  owns_point_.assign(triangles_.size(), {});
  owns_edge_.assign(triangles_.size(), {});
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const uint32_t a = triangles_[t][k], b = triangles_[t][(k + 1) % 3];
      owns_point_[t][k] = !std::exchange(point_taken[a], uint8_t{1});
      owns_edge_[t][k] = edge_taken.try_emplace(std::minmax(a, b)).second;
    }
  find_neighbours(points.size());
  pairs_.clear();
  contacts_.clear();
  travel_.assign(points.size(), 0);
  move_.assign(points.size(), 0);
  still_.assign(points.size(), Vec4::Zero());
  for (auto* predicted : {&predicted_from_, &predicted_to_, &predicted_velocity_})
    predicted->assign(points.size(), Vec4::Zero());
  margin_.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) margin_[i] = points.thickness[i] * (1 + kMargin) / 2;
  horizon_ = -1;
}

void SelfContacts::find_neighbours(std::size_t point_count) {
  std::vector<std::pair<uint32_t, uint32_t>> pairs;
  for (const Triangle& t : triangles_)
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t j : {(k + 1) % 3, (k + 2) % 3}) pairs.emplace_back(t[k], t[j]);
  std::ranges::sort(pairs);
  pairs.erase(std::ranges::unique(pairs).begin(), pairs.end());
  neighbours_.clear();
  first_neighbour_.assign(point_count + 1, 0);
  for (const auto& [point, neighbour] : pairs) {
    neighbours_.push_back(neighbour);
    ++first_neighbour_[point + 1];
  }
  std::partial_sum(first_neighbour_.begin(), first_neighbour_.end(), first_neighbour_.begin());
}

/// Adds the pairs of the points and edges of two triangles that may touch within the horizon, if
/// `wanted(points)`.
template <class Wanted>
void SelfContacts::add_pairs(const ClothPoints& points, uint32_t ta, uint32_t tb, Real slack,
                             Wanted&& wanted) {
  const Triangle &a = triangles_[ta], &b = triangles_[tb];
  const auto seek = [&](const std::array<uint32_t, 4>& p, bool edges) {
    if (wanted(p)) add(points, p, edges, slack);
  };
  for (std::size_t k = 0; k < 3; ++k) {
    if (owns_point_[ta][k]) seek({a[k], b[0], b[1], b[2]}, false);
    if (owns_point_[tb][k]) seek({b[k], a[0], a[1], a[2]}, false);
    if (!owns_edge_[ta][k]) continue;
    for (std::size_t j = 0; j < 3; ++j)
      if (owns_edge_[tb][j]) seek({a[k], a[(k + 1) % 3], b[j], b[(j + 1) % 3]}, true);
  }
}

void SelfContacts::add(const ClothPoints& points, const std::array<uint32_t, 4>& p, bool edges, Real slack) {
  const auto first = std::span(p).first(first_side(edges)), second = std::span(p).subspan(first_side(edges));
  for (uint32_t i : first)
    if (std::ranges::find(second, i) != second.end()) return;
  length_.add_work(kPairWork);
  Real thickness = (points.thickness[p[0]] + points.thickness[p[3]]) / 2;
  const Real near = thickness * (1 + slack);
  if (boxes_apart(points.start, predicted_to_, p, edges, near)) return;
  const auto separates = [&](const Vec4& n) {
    return plane_separates(points.start, predicted_to_, p, edges, n, near);
  };
  if (separates(middle_to_middle(points.start, p, edges))) return;
  if (separates(common_normal(points.start, p, edges))) return;
  length_.add_work(kClosestWork);
  const Closest c = closest(points.start, p, edges);
  const Real distance = c.apart.norm();
  if (!(distance > kNoSide) || separates(c.apart)) return;
  const Real nearest = kNearest * thickness;
  if (points.cloth[p[0]] == points.cloth[p[3]]) {
    const Real at_rest = closest(points.rest, p, edges).apart.norm();
    // Parts that a tear has just divided are ignored like neighbours: a plane between them would be so close
    // to both that they could not turn.
    if (at_rest < kNoSide) return;
    thickness = std::min(thickness, kRestFraction * at_rest);
  }
  pairs_.push_back({p, edges, thickness, nearest, distance, 0, (c.apart / distance).head<3>().cast<float>()});
  pairs_.back().travel = travelled(pairs_.back());
}

/// Predicts the path of a point until the horizon: it keeps its velocity of this sub-step.
void SelfContacts::predict(const ClothPoints& points, std::size_t i, Real dt) {
  const Vec4 velocity = (points.position[i] - points.start[i]) / dt;
  predicted_velocity_[i] = velocity;
  predicted_from_[i] = points.start[i] - since_ * velocity;
  predicted_to_[i] = points.start[i] + (horizon_ - since_) * velocity;
}

void SelfContacts::search(const ClothPoints& points, Real dt) {
  horizon_ = length_.next(std::exchange(since_, 0)) * dt;
  for (std::size_t i = 0; i < points.size(); ++i) predict(points, i, dt);
  tree_.fit(predicted_from_, predicted_to_, margin_);
  std::fill(travel_.begin(), travel_.end(), 0.0);
  pairs_.clear();
  tree_.pairs(points.start, [&](uint32_t ta, uint32_t tb) {
    add_pairs(points, ta, tb, kMargin, [](const auto&) { return true; });
  });
  length_.add_work(kFitWork * static_cast<Real>(triangles_.size()));
}

bool SelfContacts::expired(Real dt) const {
  return since_ + dt > horizon_ * (1 + 1e-9);
}

/// Returns the deviation of a point from its predicted path.
Vec4 SelfContacts::off_course(const ClothPoints& points, std::size_t i, Real dt) const {
  return points.position[i] - predicted_from_[i] - (since_ + dt) * predicted_velocity_[i];
}

/// Whether any point deviates so far from its predicted path that the known pairs no longer suffice.
bool SelfContacts::strayed(const ClothPoints& points, Real dt) const {
  if (expired(dt)) return true;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Real far = kMargin / 2 * points.thickness[i];
    if (off_course(points, i, dt).squaredNorm() > far * far) return true;
  }
  return false;
}

/// Searches for pairs, from the positions at the start of the sub-step with the velocities in it. If only a
/// few points deviated before the horizon, only their pairs are searched again, up to the same horizon.
void SelfContacts::search_again(const ClothPoints& points, Real dt) {
  if (expired(dt)) return search(points, dt);
  std::vector<uint8_t> strays(points.size(), 0);
  std::size_t count = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Real far = kMargin / 4 * points.thickness[i];
    strays[i] = off_course(points, i, dt).squaredNorm() > far * far;
    count += strays[i];
  }
  if (count > points.size() / kFew) return search(points, dt);

  for (std::size_t i = 0; i < points.size(); ++i)
    if (strays[i]) predict(points, i, dt);
  const auto is_stray = [&](const auto& p) {
    return std::ranges::any_of(p, [&](uint32_t i) { return strays[i] != 0; });
  };
  std::vector<uint32_t> seeking;
  for (uint32_t t = 0; t < triangles_.size(); ++t)
    if (is_stray(triangles_[t])) seeking.push_back(t);
  tree_.refit(seeking, predicted_from_, predicted_to_, margin_);
  std::erase_if(pairs_, [&](const Pair& pair) { return is_stray(pair.points); });
  tree_.pairs(points.start,
              [&](uint32_t ta, uint32_t tb) { add_pairs(points, ta, tb, kStrayMargin, is_stray); });
  length_.add_work(static_cast<Real>(points.size() + kFitWork * seeking.size()));
}

/// Returns two points of a pair, by their heights above a plane through `origin`: the lowest of the first
/// element and the highest of the second. at(point) returns the place of a point.
template <class At>
SelfContacts::Sides SelfContacts::sides_of(const Pair& pair, const Vec4& normal, const Vec4& origin,
                                           At&& at) {
  Sides sides{pair.points[0], pair.points[3], 1e300, -1e300};
  for (std::size_t k = 0; k < 4; ++k) {
    const uint32_t i = pair.points[k];
    const Real height = normal.dot(at(i) - origin);
    if (k < first_side(pair.edges)) {
      if (height < sides.low) std::tie(sides.first, sides.low) = std::pair(i, height);
    } else if (height > sides.high) {
      std::tie(sides.second, sides.high) = std::pair(i, height);
    }
  }
  return sides;
}

/// Returns the sum of the normals of the triangles at an edge, of any length and sign.
Vec4 SelfContacts::normal_at_edge(const ClothPoints& points, uint32_t a, uint32_t b) const {
  const Vec3 from = points.start_at(a), along = points.start_at(b) - from;
  const std::span<const uint32_t> beside = neighbours(b);
  Vec3 sum = Vec3::Zero();
  for (uint32_t i : neighbours(a)) {
    if (std::ranges::find(beside, i) == beside.end()) continue;
    const Vec3 normal = along.cross(points.start_at(i) - from);
    sum += normal.dot(sum) < 0 ? Vec3(-normal) : normal;
  }
  return padded(sum);
}

/// Returns other normals, of any length and sign, of planes that may separate a pair in its whole sub-step,
/// if a plane perpendicular to the line between its closest points does not. That line may be inclined to
/// layers that slide on each other by more than their distance. Parallel edges have no common normal; those
/// of their surfaces take its place.
std::array<Vec4, 3> SelfContacts::other_normals(const ClothPoints& points, const Pair& pair) const {
  const auto& p = pair.points;
  const Vec4 common = common_normal(points.start, p, pair.edges);
  if (!pair.edges) return {common, Vec4(Vec4::Zero()), Vec4(Vec4::Zero())};
  return {common, normal_at_edge(points, p[0], p[1]), normal_at_edge(points, p[2], p[3])};
}

/// Seeks a normal along which a pair is at least `least` apart at the start of the sub-step, there after its
/// drift, and at the end. Then no fractions of its moves can make it cross. Returns whether there is one; it
/// becomes the normal of the contact.
bool SelfContacts::turn_plane(const ClothPoints& points, Contact& contact, Real least,
                              std::span<const Vec4> drift) const {
  const Pair& pair = pairs_[contact.pair];
  const Vec4& origin = points.start[pair.points[0]];
  for (const Vec4& other : other_normals(points, pair)) {
    const Real length = other.norm();
    if (!(length > 0)) continue;
    const Vec4 normal = other / (other.dot(contact.normal) < 0 ? -length : length);
    const auto separates = [&](auto&& at) { return sides_of(pair, normal, origin, at).apart() >= least; };
    if (!separates([&](uint32_t i) -> const Vec4& { return points.start[i]; }) ||
        !separates([&](uint32_t i) { return Vec4(points.start[i] + drift[i]); }) ||
        !separates([&](uint32_t i) -> const Vec4& { return points.position[i]; }))
      continue;
    contact.normal = normal;
    return true;
  }
  return false;
}

SelfContacts::Contact SelfContacts::look(const ClothPoints& points, uint32_t k) {
  Pair& pair = pairs_[k];
  const Closest c = closest(points.start, pair.points, pair.edges);
  pair.distance = c.apart.norm();
  pair.travel = travelled(pair);
  const Vec4 normal = pair.distance > 0 ? Vec4(c.apart / pair.distance) : Vec4(Vec4::UnitY());
  pair.normal = normal.head<3>().cast<float>();
  return {k, c.weights, normal, pair.distance, c.inner};
}

/// Returns a lower bound of the distance of a pair, along its separating direction at the last check. It
/// holds for any fractions of the points' current moves.
Real SelfContacts::left_between(const ClothPoints& points, const Pair& pair, std::span<const Vec4> drift) {
  const Vec4 normal = padded(pair.normal.cast<Real>());
  const Vec4& origin = points.start[pair.points[0]];
  Real first = 1e300, second = -1e300;
  for (std::size_t k = 0; k < 4; ++k) {
    const uint32_t i = pair.points[k];
    const Real from = normal.dot(points.start[i] + drift[i] - origin),
               to = normal.dot(points.position[i] - origin);
    k < first_side(pair.edges) ? first = std::min({first, from, to}) : second = std::max({second, from, to});
  }
  return (first - second) * kUnit;
}

/// Collects the pairs that may come nearer than `reach(pair)`, for any fractions of the points' moves
/// relative to their drifts.
template <class Reach>
void SelfContacts::gather(const ClothPoints& points, Real dt, std::span<const Vec4> drift, Reach&& reach) {
  if (strayed(points, dt)) search_again(points, dt);
  length_.add_work(static_cast<Real>(pairs_.size()));
  for (std::size_t i = 0; i < move_.size(); ++i)
    move_[i] = (points.position[i] - points.start[i] - drift[i]).norm();
  contacts_.clear();
  for (uint32_t k = 0; k < pairs_.size(); ++k) {
    const Pair& pair = pairs_[k];
    const auto& p = pair.points;
    const Real moved = move_[p[0]] + move_[p[1]] + move_[p[2]] + move_[p[3]] +
                       (drift[p[0]] == drift[p[3]] ? 0 : (drift[p[0]] - drift[p[3]]).norm());
    if (pair.distance - (travelled(pair) - pair.travel) - moved > reach(pair)) continue;
    if (left_between(points, pair, drift) > reach(pair)) continue;
    const Contact contact = look(points, k);
    if (contact.distance - moved <= reach(pair)) contacts_.push_back(contact);
  }
}

void SelfContacts::push_apart(ClothPoints& points, Real dt) {
  gather(points, dt, still_, [](const Pair& pair) {
    return std::max(pair.thickness, least_distance(pair.distance, pair.nearest));
  });
  keep_thickness(points);
  keep_sides(points);
}

void SelfContacts::find_doubtful(const ClothPoints& points, Real dt, std::span<const Vec4> drift) {
  gather(points, dt, drift, [](const Pair& pair) { return least_distance(pair.distance, pair.nearest); });
  for (Contact& c : contacts_) {
    const Pair& pair = pairs_[c.pair];
    const Real least = least_distance(c.distance, pair.nearest);
    const Sides sides = sides_of(pair, c.normal, points.start[pair.points[0]],
                                 [&](uint32_t i) -> const Vec4& { return points.position[i]; });
    if (sides.apart() < least) turn_plane(points, c, least, drift);
  }
}

/// Whether no point of the surface near a feature is farther along `normal` than the feature, which is a
/// point or an edge perpendicular to `normal`.
bool SelfContacts::is_farthest(const ClothPoints& points, std::span<const uint32_t> feature,
                               const Vec4& normal) const {
  const Vec4& origin = points.start[feature.front()];
  const std::span<const uint32_t> beside = neighbours(feature.back());
  return std::ranges::all_of(neighbours(feature.front()), [&](uint32_t i) {
    if (feature.size() > 1 && std::ranges::find(beside, i) == beside.end()) return true;
    const Vec4 d = points.start[i] - origin;
    return normal.dot(d) <= kRise * d.norm();
  });
}

/// Whether the closest points of a pair are also the closest ones of the surfaces around them. Where they are
/// not, the pair's normal is inclined to the surfaces, and would stop layers that slide on each other. Other
/// pairs are closer, and they push.
bool SelfContacts::is_closest(const ClothPoints& points, const Contact& contact) const {
  const Pair& pair = pairs_[contact.pair];
  const auto& p = pair.points;
  const bool is_near_at_rest = pair.thickness < (points.thickness[p[0]] + points.thickness[p[3]]) / 2;
  if (is_near_at_rest) return true;
  std::array<uint32_t, 3> feature;
  std::size_t count = 0;
  for (std::size_t k = first_side(pair.edges); k < 4; ++k)
    if (contact.weights[k] != 0) feature[count++] = p[k];
  if (count > 2) return true;  // the normal of a triangle
  const auto first = std::span(p).first(first_side(pair.edges));
  return is_farthest(points, first, -contact.normal) &&
         is_farthest(points, std::span(feature).first(count), contact.normal);
}

/// Makes one sweep that keeps the thickness between all pairs, with friction.
void SelfContacts::keep_thickness(ClothPoints& points) {
  active_.assign(points.cloth.back() + 1, 0);
  for (const Contact& c : contacts_) {
    if (!c.pushes) continue;
    const Pair& pair = pairs_[c.pair];
    Vec4 apart = Vec4::Zero(), moved = Vec4::Zero();
    Real mobility = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const uint32_t i = pair.points[k];
      apart += c.weights[k] * points.position[i];
      moved += c.weights[k] * (points.position[i] - points.start[i]);
      mobility += c.weights[k] * c.weights[k] * points.inverse_mass[i];
    }
    const Real kept = c.distance >= pair.thickness
                          ? pair.thickness
                          : c.distance + kSelfRecovery * (pair.thickness - c.distance);
    const Real push = kept - c.normal.dot(apart);
    if (!(push > 0) || !(mobility > 0) || !is_closest(points, c)) continue;
    ++active_[points.cloth[pair.points[0]]];
    Vec4 move = push * c.normal;
    const Vec4 slip = moved - c.normal.dot(moved) * c.normal;
    const Real length = slip.norm();
    const Real friction =
        std::sqrt(points.self_friction[pair.points[0]] * points.self_friction[pair.points[3]]);
    if (length > 0) move -= std::min(1.0, friction * push / length) * slip;
    for (std::size_t k = 0; k < 4; ++k) {
      const uint32_t i = pair.points[k];
      const Vec4 impulse = (c.weights[k] / mobility) * move;
      points.position[i] += points.inverse_mass[i] * impulse;
      if (points.inverse_mass[i] == 0) points.pin_impulse[i] += impulse;
    }
  }
}

/// Prevents pairs from crossing by impulses along the normal of the plane between them. The impulse acts on
/// that point of each element that would go farthest beyond the plane. Pairs that remain are left to
/// shorten(), which stops points in all directions. Springs to points that still move then gain energy, and
/// many pressed layers jam.
void SelfContacts::keep_sides(ClothPoints& points) {
  bool again = true;
  for (int sweep = 0; again && sweep < kSideSweeps; ++sweep) {
    again = false;
    for (Contact& c : contacts_) {
      const Pair& pair = pairs_[c.pair];
      const Sides sides = sides_of(pair, c.normal, points.start[pair.points[0]],
                                   [&](uint32_t i) -> const Vec4& { return points.position[i]; });
      const Real least = kBeyondLeast * least_distance(c.distance, pair.nearest);
      const Real push = least - sides.apart();
      const Real mobility = points.inverse_mass[sides.first] + points.inverse_mass[sides.second];
      if (!(push > 0) || !(mobility > 0) || turn_plane(points, c, least, still_)) continue;
      again = true;
      const Vec4 impulse = push / mobility * c.normal;
      for (const auto& [i, sign] : {std::pair(sides.first, 1.0), std::pair(sides.second, -1.0)}) {
        points.position[i] += sign * points.inverse_mass[i] * impulse;
        if (points.inverse_mass[i] == 0) points.pin_impulse[i] += sign * impulse;
      }
    }
  }
}

bool SelfContacts::any_crossed(const ClothPoints& points) const {
  return std::ranges::any_of(contacts_, [&](const Contact& c) {
    const Pair& pair = pairs_[c.pair];
    const Sides sides = sides_of(pair, c.normal, points.start[pair.points[0]],
                                 [&](uint32_t i) -> const Vec4& { return points.position[i]; });
    return sides.apart() < least_distance(c.distance, pair.nearest);
  });
}

bool SelfContacts::shorten(const ClothPoints& points, MoveFractions& fractions,
                           std::vector<uint32_t>& lowered) {
  bool any = false;
  for (const Contact& c : contacts_) {
    const Pair& pair = pairs_[c.pair];
    const Sides sides = sides_of(pair, c.normal, points.start[pair.points[0]], [&](uint32_t i) {
      return Vec4(points.start[i] + fractions[i] * (points.position[i] - points.start[i]));
    });
    if (sides.apart() >= least_distance(c.distance, pair.nearest)) continue;
    bool any_here = false;
    for (uint32_t i : pair.points) {
      if (!(points.inverse_mass[i] > 0) || fractions[i] == 0) continue;
      fractions[i] = fractions[i] / 2 < kLeastFraction ? 0 : fractions[i] / 2;
      held_back_.push_back(i);
      lowered.push_back(i);
      any_here = true;
    }
    any |= any_here;
    if (!any_here) crossed_.push_back(pair.points[0]);
  }
  return any;
}

void SelfContacts::end_substep(const ClothPoints& points, Real dt) {
  since_ += dt;
  for (std::size_t i = 0; i < travel_.size(); ++i)
    travel_[i] += (points.position[i] - points.start[i]).norm();
}

}  // namespace offstage::sim
