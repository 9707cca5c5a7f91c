#include "sim/collision/contact_candidates.h"

#include <cmath>
#include <utility>
#include <vector>

namespace offstage::sim {
namespace {

/// Returns the point with the largest measure. If several measures are equal within a thousandth, the point
/// with the lowest id is chosen, so that neither rounding nor the order decides.
template <class Measure>
const Candidate& most(std::span<const Candidate> c, Measure&& measure) {
  // Most manifolds have few candidates.
  std::array<Real, Candidates::kMax> few;
  std::vector<Real> many(c.size() > few.size() ? c.size() : 0);
  const std::span<Real> values = many.empty() ? std::span<Real>(few).first(c.size()) : std::span<Real>(many);
  Real largest = -std::numeric_limits<Real>::infinity();
  for (std::size_t k = 0; k < c.size(); ++k) largest = std::max(largest, values[k] = measure(c[k]));
  const Real enough = largest - 1e-3 * std::abs(largest);
  const Candidate* best = nullptr;
  for (std::size_t k = 0; k < c.size(); ++k)
    if (values[k] >= enough && (!best || c[k].id < best->id)) best = &c[k];
  return best ? *best : c.front();
}

Real least_separation(std::span<const Candidate> c) {
  Real least = std::numeric_limits<Real>::infinity();
  for (const Candidate& x : c) least = std::min(least, x.separation);
  return least;
}

/// Signed distance of points from the line from p to q, times the length of pq: twice the area of the
/// triangle. It is positive on the left, seen against the normal.
struct LeftOf {
  Vec3 inward;
  Real offset;

  LeftOf(const Vec3& normal, const Vec3& p, const Vec3& q)
      : inward(normal.cross(q - p)), offset(inward.dot(p)) {}
  Real operator()(const Vec3& x) const { return inward.dot(x) - offset; }
};

}  // namespace

void reduce(Manifold& m, std::span<const Candidate> c, Real slop) {
  m.count = 0;
  const auto keep = [&m](const Candidate& p) {
    m.points[m.count++] = {p.on_a, p.on_b, p.separation, p.id, p.piece};
    return p.on_a;
  };
  if (c.size() <= m.points.size()) {
    for (const Candidate& x : c) keep(x);
    return;
  }
  const Real level = least_separation(c) + slop;
  const Vec3 p = keep(most(c, [&](const Candidate& x) { return x.separation <= level ? 1.0 : 0.0; }));
  const Vec3 q = keep(most(c, [&](const Candidate& x) { return (x.on_a - p).squaredNorm(); }));
  // This term decides between collinear points: it prefers the end that is farther from q.
  constexpr Real kRow = 1e-9;
  const LeftOf pq(m.normal, p, q);
  const Vec3 r = keep(
      most(c, [&](const Candidate& x) { return std::abs(pq(x.on_a)) + kRow * (x.on_a - q).squaredNorm(); }));
  const LeftOf qr(m.normal, q, r), rp(m.normal, r, p);
  const Real sense = pq(r) < 0 ? -1 : 1;
  const auto gain = [&](const Candidate& x) {
    return -std::min({sense * pq(x.on_a), sense * qr(x.on_a), sense * rp(x.on_a)});
  };
  if (const Candidate& last = most(c, gain); gain(last) > 0) keep(last);
}

void reduce(Manifold& m, const Candidates& c, Real slop, Manifold* more) {
  reduce(m, std::span(c.points).first(c.count), slop);
  if (!more || c.count <= m.points.size()) return;
  Candidates rest;
  for (uint32_t k = 0; k < c.count; ++k) {
    const auto is_kept = [&](const ContactPoint& x) { return x.id == c.points[k].id; };
    if (std::none_of(m.points.begin(), m.points.begin() + m.count, is_kept)) rest.add(c.points[k]);
  }
  *more = m;
  reduce(*more, rest, slop);
}

void drop_below(Manifold& m, Real least) {
  const uint32_t count = std::exchange(m.count, 0);
  for (uint32_t k = 0; k < count; ++k)
    if (m.points[k].separation > least) m.points[m.count++] = m.points[k];
}

}  // namespace offstage::sim
