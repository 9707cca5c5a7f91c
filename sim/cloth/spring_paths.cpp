#include "sim/cloth/spring_paths.h"

#include <algorithm>
#include <bit>
#include <numeric>

namespace offstage::sim {
namespace {

/// Least cosine of the angle between consecutive springs of a path.
constexpr Real kStraight = 0.7;
constexpr uint32_t kPathEnd = ~0u;

/// Finds the springs at each point.
class SpringStars {
 public:
  SpringStars(std::span<const ClothSpring> springs, std::size_t point_count) : first_(point_count + 1, 0) {
    for (const ClothSpring& s : springs)
      for (uint32_t end : {s.a, s.b}) ++first_[end + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    at_.resize(2 * springs.size());
    std::vector<uint32_t> next(first_.begin(), first_.end() - 1);
    for (uint32_t i = 0; i < springs.size(); ++i)
      for (uint32_t end : {springs[i].a, springs[i].b}) at_[next[end]++] = i;
  }
  std::span<const uint32_t> of(std::size_t point) const {
    return std::span(at_).subspan(first_[point], first_[point + 1] - first_[point]);
  }

 private:
  std::vector<uint32_t> first_, at_;
};

uint32_t other_end(const ClothSpring& s, uint32_t point) {
  return s.a == point ? s.b : s.a;
}

/// By spring: for each of its two ends, the next spring of its path; kPathEnd if the path ends there.
using Continuations = std::vector<std::array<uint32_t, 2>>;

uint32_t& at_end(Continuations& next, std::span<const ClothSpring> springs, uint32_t spring, uint32_t point) {
  return next[spring][springs[spring].a == point ? 0 : 1];
}

Continuations continuations(std::span<const ClothSpring> springs, const ClothPoints& points) {
  Continuations next(springs.size(), {kPathEnd, kPathEnd});
  const SpringStars stars(springs, points.size());
  struct Match {
    Real cosine;
    uint32_t first, second;
  };
  std::vector<Match> matches;
  std::vector<Vec4> away;
  for (uint32_t point = 0; point < points.size(); ++point) {
    const std::span<const uint32_t> star = stars.of(point);
    away.clear();
    for (uint32_t i : star) {
      const Vec4 d = points.rest[other_end(springs[i], point)] - points.rest[point];
      const Real length = d.norm();
      away.push_back(length > 0 ? Vec4(d / length) : Vec4(Vec4::Zero()));
    }
    matches.clear();
    for (std::size_t i = 0; i < star.size(); ++i)
      for (std::size_t j = i + 1; j < star.size(); ++j)
        if (const Real cosine = -away[i].dot(away[j]);
            cosine > kStraight && springs[star[i]].kind == springs[star[j]].kind)
          matches.push_back({cosine, star[i], star[j]});
    std::ranges::stable_sort(matches, std::greater<>(), &Match::cosine);
    for (const Match& m : matches) {
      uint32_t &a = at_end(next, springs, m.first, point), &b = at_end(next, springs, m.second, point);
      if (a != kPathEnd || b != kPathEnd) continue;
      a = m.second;
      b = m.first;
    }
  }
  return next;
}

}  // namespace

std::vector<SpringPath> spring_paths(std::span<const ClothSpring> springs, const ClothPoints& points) {
  Continuations next = continuations(springs, points);
  std::vector<SpringPath> paths;
  std::vector<uint8_t> taken(springs.size(), 0);
  const auto follow = [&](uint32_t spring, uint32_t from) {
    SpringPath path{{from}, {}};
    for (uint32_t i = spring; i != kPathEnd && !taken[i];) {
      taken[i] = 1;
      path.springs.push_back(i);
      path.points.push_back(other_end(springs[i], path.points.back()));
      i = at_end(next, springs, i, path.points.back());
    }
    paths.push_back(std::move(path));
  };
  for (uint32_t i = 0; i < springs.size(); ++i)
    if (!taken[i] && (next[i][0] == kPathEnd || next[i][1] == kPathEnd))
      follow(i, next[i][0] == kPathEnd ? springs[i].a : springs[i].b);
  for (uint32_t i = 0; i < springs.size(); ++i)  // closed paths
    if (!taken[i]) follow(i, springs[i].a);
  return paths;
}

/// Colours paths greedily: each path gets the first colour that no path at its points has.
std::vector<uint32_t> path_colors(std::span<const SpringPath> paths, std::size_t point_count) {
  constexpr uint32_t kLast = kPathColors - 1;
  std::vector<uint64_t> used(point_count, 0);
  std::vector<uint32_t> color;
  for (const SpringPath& path : paths) {
    uint64_t taken = 0;
    for (uint32_t i : path.points) taken |= used[i];
    const auto first = static_cast<uint32_t>(std::countr_one(taken));
    color.push_back(first);
    if (first == kLast) continue;
    for (uint32_t i : path.points) used[i] |= uint64_t{1} << first;
  }
  return color;
}

}  // namespace offstage::sim
