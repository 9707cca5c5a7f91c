#include "sim/cloth/cloth_springs.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "sim/core/staged_loop.h"
#include "sim/linear/lanes.h"

namespace offstage::sim {
namespace {

/// Springs at a time, and from how many on threads are worth their waking.
constexpr std::size_t kBlock = 2048, kWorthThreads = 60000;
constexpr uint32_t kMaxColors = 64;
/// What is too stiff for the step counts as softer. From h^2 k (1/m_a + 1/m_b) = 10 on in a woven sheet,
/// whose points have four stiff springs, one symmetric sweep leaves so much of the explicit step's excess
/// that it grows (measured; an exact solution has no such limit). What counts is what all springs of both
/// points make of it, four times as much there: in a mesh of triangles, where six meet, each may have less.
constexpr Real kMaxRatio = 6, kMaxRatioOfAll = 24;
/// Of the step squared times the sum of k e / (l m) of the springs at both points, with the elongation e and
/// the length l: the explicit step is stable up to 4 (Anderson and Morley, 1985). The rest is for the stretch
/// that a sub-step of the world adds.
constexpr Real kMaxAcross = 3;
/// Up to this length over rest length, kMaxRatioOfAll keeps that limit: 3 / 24 = 1 - 1 / 1.143.
constexpr Real kShortEnough = 1.14;
/// A spring as soft as this stays as it is.
constexpr Real kSoftRatio = 0.5;
/// Points as near as this have no direction between them [m^2].
constexpr Real kNoLength2 = 1e-24;
/// Between two points that are held [1/kg].
constexpr Real kNoMobility = 1e-100;

/// Of a stiffness that is exactly what the step allows.
constexpr Real kRounding = 1e-5;

/// Four numbers in one instruction, where Eigen's casts go one by one.
typedef float Floats __attribute__((vector_size(16)));

inline Vec4 widened(const Eigen::Vector4f& v) {
  Floats from;
  std::memcpy(&from, v.data(), sizeof(from));
  const Lanes to = __builtin_convertvector(from, Lanes);
  Vec4 result;
  std::memcpy(result.data(), &to, sizeof(to));
  return result;
}

inline Eigen::Vector4f narrowed(const Vec4& v) {
  Lanes from;
  std::memcpy(&from, v.data(), sizeof(from));
  const Floats to = __builtin_convertvector(from, Floats);
  Eigen::Vector4f result;
  std::memcpy(result.data(), &to, sizeof(to));
  return result;
}

/// An impulse (times the step) pulls a and b together. What pins hold passes it on.
inline void give(ClothPoints& points, std::span<Vec4> moves, uint32_t a, uint32_t b, const Vec4& impulse) {
  const Real wa = points.inverse_mass[a], wb = points.inverse_mass[b];
  moves[a] -= wa * impulse;
  moves[b] += wb * impulse;
  if (wa == 0) points.pull[a] -= impulse;
  if (wb == 0) points.pull[b] += impulse;
}

/// Greedy: each spring gets the first colour that neither of its ends has.
std::vector<uint32_t> colors(std::span<const ClothSpring> springs, std::size_t point_count) {
  std::vector<uint64_t> used(point_count, 0);
  std::vector<uint32_t> color(springs.size());
  for (std::size_t i = 0; i < springs.size(); ++i) {
    const uint64_t taken = used[springs[i].a] | used[springs[i].b];
    const uint32_t first = static_cast<uint32_t>(std::countr_one(taken));
    color[i] = std::min(first, kMaxColors);
    if (first == kMaxColors) continue;
    used[springs[i].a] |= uint64_t{1} << first;
    used[springs[i].b] |= uint64_t{1} << first;
  }
  return color;
}

}  // namespace

void ClothSprings::assign(std::span<const ClothSpring> springs, const ClothPoints& points) {
  std::vector<Real> around(points.size(), 0);  // sum of k / m of the springs at each point
  for (const ClothSpring& s : springs)
    for (uint32_t end : {s.a, s.b}) around[end] += s.stiffness / points.mass[end];
  const auto most = [&](const ClothSpring& s) {
    const Real own = s.stiffness * (1 / points.mass[s.a] + 1 / points.mass[s.b]);
    return std::clamp(kMaxRatioOfAll * own / (around[s.a] + around[s.b]), kSoftRatio, kMaxRatio);
  };
  // The last colour takes what finds no other, at points with very many springs. One thread does it.
  const std::vector<uint32_t> color = colors(springs, points.size());
  color_start_.assign(kMaxColors + 2, 0);
  for (uint32_t c : color) ++color_start_[c + 1];
  for (std::size_t c = 1; c < color_start_.size(); ++c) color_start_[c] += color_start_[c - 1];
  std::vector<std::size_t> next(color_start_.begin(), color_start_.end());
  spring_.resize(springs.size());
  material_.resize(springs.size());
  for (std::size_t i = 0; i < springs.size(); ++i) {
    const ClothSpring& s = springs[i];
    const std::size_t at = next[color[i]]++;
    spring_[at] = {s.a, s.b, s.counterpart, s.rest_length, 0, s.counterpart_rest};
    if (s.counterpart_rest == 0) spring_[at].counterpart = {s.a, s.a};
    const Real fastest = s.stiffness * (1 / points.mass[s.a] + 1 / points.mass[s.b]);
    material_[at] = {s.stiffness, s.damping, fastest, most(s), most(s)};
  }
  is_stretched_ = false;
  set_longest_step();
  link_.resize(spring_.size());
  prepared_for_ = -1;
  pull_.clear();
  relax_.clear();
  for (auto kind : {Stage::pull, Stage::forward, Stage::backward}) {
    for (std::size_t c = 0; c + 1 < color_start_.size(); ++c) {
      const std::size_t k = kind == Stage::backward ? color_start_.size() - 2 - c : c;
      if (color_start_[k + 1] > color_start_[k])
        (kind == Stage::pull ? pull_ : relax_)
            .push_back({kind, color_start_[k], color_start_[k + 1], k == kMaxColors});
    }
  }
}

void ClothSprings::set_longest_step() {
  Real square = std::numeric_limits<Real>::infinity();
  for (const Material& m : material_) square = std::min(square, m.most / m.fastest);
  longest_step_ = std::sqrt(square);
}

void ClothSprings::adapt_to_stretch(const ClothPoints& points) {
  const auto length2 = [&](const Spring& s) {
    return (points.position[s.a] - points.position[s.b]).squaredNorm();
  };
  const bool is_stretched = std::ranges::any_of(
      spring_, [&](const Spring& s) { return length2(s) > kShortEnough * kShortEnough * s.rest * s.rest; });
  if (!is_stretched && !is_stretched_) return;
  std::vector<Real> across(points.size(), 0);  // sum of k e / (l m) of the springs at each point
  for (std::size_t i = 0; i < spring_.size(); ++i) {
    const Spring& s = spring_[i];
    const Real length = std::sqrt(length2(s));
    Real elongation = length - s.rest;
    if (s.counterpart_rest > 0) {
      const auto [c, d] = s.counterpart;
      elongation = (elongation - (points.position[c] - points.position[d]).norm() + s.counterpart_rest) / 2;
    }
    if (!(elongation > 0)) continue;
    const Real stiffness = material_[i].stiffness * elongation / length;
    for (uint32_t end : {s.a, s.b}) across[end] += stiffness / points.mass[end];
  }
  for (std::size_t i = 0; i < spring_.size(); ++i) {
    Material& m = material_[i];
    const Real sum = across[spring_[i].a] + across[spring_[i].b];
    m.most = sum > 0 ? std::min(m.most_at_rest, kMaxAcross * m.fastest / sum) : m.most_at_rest;
  }
  is_stretched_ = is_stretched;
  prepared_for_ = -1;
  set_longest_step();
}

uint32_t ClothSprings::Stage::block_count() const {
  return whole ? 1 : static_cast<uint32_t>((end - begin + kBlock - 1) / kBlock);
}

void ClothSprings::pull(ClothPoints& points, std::span<Vec4> moves) {
  run(pull_, points, moves);
}

void ClothSprings::relax(ClothPoints& points, std::span<Vec4> moves) {
  run(relax_, points, moves);
}

void ClothSprings::run(std::span<const Stage> stages, ClothPoints& points, std::span<Vec4> moves) {
  const uint32_t threads = spring_.size() < kWorthThreads ? 1 : available_threads();
  const auto all = [](const Stage&) { return true; };
  run_stages(stages, threads, all, [&](const Stage& stage, uint32_t block) {
    const std::size_t begin = stage.begin + block * kBlock;
    const std::size_t end = stage.whole ? stage.end : std::min(begin + kBlock, stage.end);
    if (stage.kind == Stage::pull)
      pull(points, moves, begin, end);
    else if (stage.kind == Stage::forward)
      for (std::size_t i = begin; i < end; ++i) relax(points, moves, i);
    else
      for (std::size_t i = end; i-- > begin;) relax(points, moves, i);
  });
}

/// What depends on the step and on what pins hold alone. Steps of one rate differ in their last bits, as
/// differences of times do: in single precision they are one.
void ClothSprings::begin(const ClothPoints& points, Real step) {
  const Real h = static_cast<float>(step);
  if (h == prepared_for_ && points.inverse_mass == inverse_mass_) return;
  prepared_for_ = h;
  inverse_mass_ = points.inverse_mass;
  clamped_ = 0;
  least_stiffness_ = 1;
  for (std::size_t i = 0; i < spring_.size(); ++i) {
    Spring& s = spring_[i];
    const Material& material = material_[i];
    const Real mobility = inverse_mass_[s.a] + inverse_mass_[s.b];
    const Real ratio = h * h * material.stiffness * mobility;
    if (ratio > material.most * (1 + kRounding)) {
      ++clamped_;
      least_stiffness_ = std::min(least_stiffness_, material.most / ratio);
    }
    s.stiffness = std::min(h * h * material.stiffness, material.most / std::max(mobility, kNoMobility));
    const Real resists = s.stiffness + h * material.damping, forget = 1 / (1 + resists * mobility);
    link_[i] = {Eigen::Vector4f(0, 0, 0, static_cast<float>(resists * forget)), static_cast<float>(forget), 0,
                s.a, s.b};
  }
}

/// The explicit step, and the directions for the sweeps.
void ClothSprings::pull(ClothPoints& points, std::span<Vec4> moves, std::size_t begin, std::size_t end) {
  constexpr std::size_t kLanes = 16;
  using Batch = Eigen::Array<Real, kLanes, 1>;
  const Vec4* const x = points.start.data();
  for (std::size_t first = begin; first < end; first += kLanes) {
    const std::size_t count = std::min(kLanes, end - first);
    std::array<Vec4, kLanes> direction;
    Batch length2 = Batch::Ones(), other2 = Batch::Zero();
    for (std::size_t k = 0; k < count; ++k) {
      const Spring& s = spring_[first + k];
      direction[k] = x[s.a] - x[s.b];
      length2[static_cast<Eigen::Index>(k)] = std::max(direction[k].squaredNorm(), kNoLength2);
      other2[static_cast<Eigen::Index>(k)] = (x[s.counterpart[0]] - x[s.counterpart[1]]).squaredNorm();
    }
    const Batch length = length2.sqrt(), inverse = length.inverse(), other = other2.sqrt();
    for (std::size_t k = 0; k < count; ++k) {
      const Spring& s = spring_[first + k];
      const auto lane = static_cast<Eigen::Index>(k);
      const Real own = length[lane] - s.rest;
      const Real elongation = s.counterpart_rest > 0 ? (own - other[lane] + s.counterpart_rest) / 2 : own;
      give(points, moves, s.a, s.b, s.stiffness * elongation * inverse[lane] * direction[k]);
      Link& link = link_[first + k];
      const float along = link.axis[3];
      link.axis = narrowed(inverse[lane] * direction[k]);
      link.axis[3] = along;
      link.impulse = 0;
    }
  }
}

/// Gauss-Seidel on the impulses, which are zero at first: the equation of a spring is r + impulse / c = 0.
void ClothSprings::relax(ClothPoints& points, std::span<Vec4> moves, std::size_t spring) {
  Link& link = link_[spring];
  const Vec4 u = widened(link.axis).cwiseProduct(Vec4(1, 1, 1, 0));
  const Real step =
      Real{link.axis[3]} * u.dot(moves[link.a] - moves[link.b]) - Real{link.forget} * link.impulse;
  link.impulse += static_cast<float>(step);
  give(points, moves, link.a, link.b, step * u);
}

}  // namespace offstage::sim
