#include "sim/cloth/stretch_limit.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace offstage::sim {
namespace {

constexpr uint8_t kSweeps = 8;
/// Number of rounds that solve for all springs that are too long. Each is linearised at the result of the
/// previous one.
constexpr int kSolves = 4;
/// Fraction by which lengths may exceed a limit because of rounding; far below the guaranteed accuracy.
constexpr Real kSlack = 1e-12;

/// Returns the greatest s in [0, 1] with |k1 + s k2| <= longest, or 0 if there is none.
Real greatest_fraction(const Vec4& k1, const Vec4& k2, Real longest) {
  const Real a = k2.squaredNorm(), b = k1.dot(k2), c = k1.squaredNorm() - longest * longest;
  const Real root = b * b - a * c;
  if (!(a > 0) || !(root >= 0)) return 0;
  // This is the larger root (-b + sqrt(root)) / a, in a form without cancellation.
  const Real s = b > 0 ? -c / (b + std::sqrt(root)) : (std::sqrt(root) - b) / a;
  return std::clamp(s * (1 - kSlack), 0.0, 1.0);
}

}  // namespace

void StretchLimit::assign(std::vector<Limit> limits, std::vector<Limit> ties, std::size_t point_count) {
  limits_ = std::move(limits);
  ties_ = std::move(ties);
  looked_in_.assign(limits_.size(), round_);
  first_at_.assign(point_count + 1, 0);
  for (const Limit& l : limits_)
    for (const uint32_t end : {l.a, l.b}) ++first_at_[end + 1];
  for (std::size_t i = 0; i < point_count; ++i) first_at_[i + 1] += first_at_[i];
  limits_at_.resize(2 * limits_.size());
  std::vector<uint32_t> next(first_at_);
  for (uint32_t k = 0; k < limits_.size(); ++k)
    for (const uint32_t end : {limits_[k].a, limits_[k].b}) limits_at_[next[end]++] = k;
}

bool StretchLimit::project(ClothPoints& points, std::span<const Carrier> carriers, Real dt,
                           std::span<const Vec4> kick, std::vector<VelocityCut>& cuts) {
  bool all_hold = true;
  if (!sweep(points, all_hold)) return false;
  if (carriers.empty())
    return true;  // points without bodies are light: the sweeps and the shortening of moves are enough
  for (int round = 0; round < kSolves && !all_hold; ++round) {
    TautSprings taut(points, carriers);
    for (const auto* some : {&limits_, &ties_})
      for (const Limit& l : *some) taut.add(l);
    all_hold = !taut.any_too_long();
    if (all_hold) break;
    taut.solve();
    taut.apply(points, dt, kick, cuts);
  }
  return true;
}

bool StretchLimit::any_too_long(const ClothPoints& points) const {
  return std::ranges::any_of(limits_, [&](const Limit& l) {
    return !l.tears && (points.position[l.a] - points.position[l.b]).squaredNorm() > l.longest * l.longest;
  });
}

bool StretchLimit::any_beyond(const ClothPoints& points) const {
  return std::ranges::any_of(limits_, [&](const Limit& l) {
    return (points.position[l.a] - points.position[l.b]).squaredNorm() > l.longest * l.longest;
  });
}

void StretchLimit::project_with(std::span<const BodyContact> contacts, ClothPoints& points,
                                std::span<const Carrier> carriers, Real dt, std::span<const Vec4> kick,
                                std::vector<VelocityCut>& cuts) const {
  TautSprings taut(points, carriers);
  for (const auto* some : {&limits_, &ties_})
    for (const Limit& l : *some) taut.add(l);
  for (const BodyContact& contact : contacts) taut.add(contact);
  taut.solve();
  taut.apply(points, dt, kick, cuts);
}

/// Shortens springs that are too long by sweeps over all of them. Returns whether any was too long. Sets
/// `all_hold` to whether all limits now hold, except those for which bodies have to move.
bool StretchLimit::sweep(ClothPoints& points, bool& all_hold) const {
  Vec4* const x = points.position.data();
  const Real* const w = points.inverse_mass.data();
  bool again = true, any = false;
  std::vector<uint8_t> moved_in(points.size(), 0);  // by point: the last sweep that moved it; 0: none
  for (uint8_t sweep = 1; sweep <= kSweeps && again; ++sweep) {
    again = false;
    const auto draw = [&](const Limit& l) {
      // If neither point has moved since the last sweep, the result is unchanged.
      if (sweep > 1 && moved_in[l.a] < sweep - 1 && moved_in[l.b] < sweep - 1) return;
      const Vec4 d = x[l.a] - x[l.b];
      const Real length2 = d.squaredNorm();
      if (length2 <= l.longest * l.longest) return;
      any = true;
      if (!l.tears && (points.carried[l.a] || points.carried[l.b])) {
        all_hold = false;  // it is solved together with the body
        return;
      }
      const Real mass = w[l.a] + w[l.b];
      if (!(mass > 0)) return;
      again = true;
      const Real length = std::sqrt(length2), aim = l.rest + kStretchAim * (l.longest - l.rest);
      const Vec4 move = ((length - aim) / (length * mass)) * d;
      x[l.a] -= w[l.a] * move;
      x[l.b] += w[l.b] * move;
      moved_in[l.a] = moved_in[l.b] = sweep;
      if (w[l.a] == 0) points.pin_impulse[l.a] -= move;
      if (w[l.b] == 0) points.pin_impulse[l.b] += move;
    };
    std::for_each(limits_.begin(), limits_.end(), draw);
    std::for_each(ties_.begin(), ties_.end(), draw);
  }
  all_hold &= !again;
  return any;
}

bool StretchLimit::shorten_whole_moves(const ClothPoints& points, std::span<const Carrier> carriers,
                                       MoveFractions& fractions, std::vector<uint32_t>& lowered) const {
  lowered.clear();
  for (const Limit& l : limits_) {
    const bool whole = fractions[l.a] == 1 && fractions[l.b] == 1;
    if (whole && (points.position[l.a] - points.position[l.b]).squaredNorm() <= l.longest * l.longest)
      continue;
    look(l, points, fractions, lowered);
  }
  even_ties(points, fractions, lowered);
  even_carriers(carriers, fractions, lowered);
  return !lowered.empty();
}

bool StretchLimit::shorten(const ClothPoints& points, std::span<const Carrier> carriers,
                           MoveFractions& fractions, std::vector<uint32_t>& lowered) {
  std::vector<uint32_t> now;
  ++round_;
  for (const uint32_t i : lowered)
    for (uint32_t k = first_at_[i]; k < first_at_[i + 1]; ++k)
      if (std::exchange(looked_in_[limits_at_[k]], round_) != round_)
        look(limits_[limits_at_[k]], points, fractions, now);
  lowered = std::move(now);
  even_ties(points, fractions, lowered);
  even_carriers(carriers, fractions, lowered);
  return !lowered.empty();
}

void StretchLimit::even_ties(const ClothPoints& points, MoveFractions& fractions,
                             std::vector<uint32_t>& lowered) const {
  for (const Limit& t : ties_) {
    if (fractions[t.a] == fractions[t.b]) continue;
    const uint32_t ahead = fractions[t.a] > fractions[t.b] ? t.a : t.b;
    if (points.inverse_mass[ahead] == 0 && !points.carried[ahead]) continue;
    fractions[ahead] = std::min(fractions[t.a], fractions[t.b]);
    lowered.push_back(ahead);
  }
}

void StretchLimit::even_carriers(std::span<const Carrier> carriers, MoveFractions& fractions,
                                 std::vector<uint32_t>& lowered) {
  for (const Carrier& carrier : carriers) {
    Real least = 1;
    for (uint32_t i : carrier.points) least = std::min(least, fractions[i]);
    for (uint32_t i : carrier.points)
      if (std::exchange(fractions[i], least) != least) lowered.push_back(i);
  }
}

void StretchLimit::look(const Limit& l, const ClothPoints& points, MoveFractions& fractions,
                        std::vector<uint32_t>& lowered) const {
  const Vec4 move_a = points.position[l.a] - points.start[l.a];
  const Vec4 move_b = points.position[l.b] - points.start[l.b];
  const Vec4 d = points.start[l.a] - points.start[l.b];
  const Vec4 move = fractions[l.a] * move_a - fractions[l.b] * move_b;
  // A spring that was too long at the start must not get longer.
  const Real allowed2 = std::max(l.longest * l.longest, d.squaredNorm());
  if ((d + move).squaredNorm() <= allowed2 * (1 + kSlack)) return;
  const auto can_shorten = [&](uint32_t i) {
    return (points.inverse_mass[i] > 0 || (points.carried[i] && !l.tears)) && fractions[i] > 0;
  };
  const bool free_a = can_shorten(l.a), free_b = can_shorten(l.b);
  if (!free_a && !free_b) return;
  Vec4 k1 = d, k2 = Vec4::Zero();
  free_a ? k2 += fractions[l.a]* move_a : k1 += fractions[l.a] * move_a;
  free_b ? k2 -= fractions[l.b]* move_b : k1 -= fractions[l.b] * move_b;
  Real s = greatest_fraction(k1, k2, std::sqrt(std::max(allowed2, k1.squaredNorm())));
  if (s > 1 - 1e-9) s = 0;  // within rounding there is no progress
  if (free_a) {
    fractions[l.a] *= s;
    lowered.push_back(l.a);
  }
  if (free_b) {
    fractions[l.b] *= s;
    lowered.push_back(l.b);
  }
}

}  // namespace offstage::sim
