#include "sim/cloth/cloth_springs.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/cloth/four_vectors.h"
#include "sim/core/staged_loop.h"

namespace offstage::sim {
namespace {

/// Number of springs in a block, and the least number for which several threads are faster.
constexpr std::size_t kBlock = 2048, kWorthThreads = 60000;
/// Limits of the stiffness of springs; stiffer springs are clamped. Otherwise the error of the explicit step
/// that remains after one symmetric sweep would grow. kMaxRatio limits h^2 k (1/m_a + 1/m_b). The stable
/// limit depends on all springs at both points. Without damping, a flat weave is stable up to 10, a weave
/// sheared by 30 degrees up to 2 to 3, and a mesh of triangles, where six springs meet, up to 2 to 3
/// (measured; an exact solution has no such limit). kMaxRatioOfAll limits the sum over all springs at both
/// points, which limits the ratio of the sheared weave to 3.5 and of the mesh to 2.3.
constexpr Real kMaxRatio = 6, kMaxRatioOfAll = 14;
/// Limit of h^2 times the sum of k e / (l m) over the springs at both points, with the elongation e and the
/// length l. The explicit step is stable up to 4 (Anderson and Morley, 1985). The rest is a reserve for the
/// stretch that a sub-step of the world adds.
constexpr Real kMaxAcross = 3;
/// Springs up to this multiple of their rest length obey kMaxAcross if they obey kMaxRatioOfAll: 3 / 14 > 1 -
/// 1 / 1.14. The sums of transverse stiffness are needed only if the few springs beyond it use up the rest.
constexpr Real kShortEnough = 1.14;
/// A spring softer than this is never clamped.
constexpr Real kSoftRatio = 0.5;
/// Points whose squared distance is below this have no direction between them [m^2].
constexpr Real kNoLength2 = 1e-24;
/// Mobility used for a spring between two pinned points; it avoids a division by zero [1/kg].
constexpr Real kNoMobility = 1e-100;

/// A stiffness counts as equal to the limit of the step within this fraction.
constexpr Real kRounding = 1e-5;

typedef float SpringFloats __attribute__((vector_size(16)));

/// Calls act(n) for n = 0 to 3, the four chains of a sweep. The calls are written out so that the state of
/// each chain stays in registers.
template <class Act>
[[gnu::always_inline]] inline void in_turns(Act&& act) {
  act(0);
  act(1);
  act(2);
  act(3);
}

inline Lanes widened(SpringFloats v) {
  return _mm256_cvtps_pd(v);
}
inline SpringFloats narrowed(Lanes v) {
  return _mm256_cvtpd_ps(v);
}
inline FourVectors widened(const std::array<SpringFloats, 3>& v) {
  return {widened(v[0]), widened(v[1]), widened(v[2])};
}

}  // namespace

Real fastest_spring_rate(const ClothPoints& points, std::span<const ClothSpring> springs, std::size_t first) {
  Real fastest2 = 0;
  for (const ClothSpring& s : springs)
    fastest2 =
        std::max(fastest2, (points.velocity[first + s.a] - points.velocity[first + s.b]).squaredNorm() /
                               (s.rest_length * s.rest_length));
  return std::sqrt(fastest2);
}

void ClothSprings::assign(std::span<const ClothSpring> springs, const ClothPoints& points) {
  std::vector<Real> around(points.size(), 0);  // by point: sum of k / m of its springs
  std::vector<uint32_t> count(points.size(), 0);
  for (const ClothSpring& s : springs)
    for (uint32_t end : {s.a, s.b}) {
      around[end] += s.stiffness / points.mass[end];
      ++count[end];
    }
  most_around_ = springs.empty() ? 0 : std::ranges::max(around);
  most_springs_ = springs.empty() ? 0 : std::ranges::max(count);
  material_.clear();
  for (const ClothSpring& s : springs) {
    const Real own = s.stiffness * (1 / points.mass[s.a] + 1 / points.mass[s.b]);
    const Real most = std::clamp(kMaxRatioOfAll * own / (around[s.a] + around[s.b]), kSoftRatio, kMaxRatio);
    material_.push_back({s.a, s.b, s.stiffness, s.damping, own, most, most});
  }
  const std::vector<SpringPath> paths = spring_paths(springs, points);
  const std::vector<uint32_t> color = path_colors(paths, points.size());
  std::vector<const SpringPath*> order(paths.size());
  for (std::size_t i = 0; i < paths.size(); ++i) order[i] = &paths[i];
  const auto color_of = [&](const SpringPath* path) {
    return color[static_cast<std::size_t>(path - paths.data())];
  };
  std::ranges::stable_sort(order, [&](const SpringPath* a, const SpringPath* b) {
    return color_of(a) != color_of(b) ? color_of(a) < color_of(b) : a->springs.size() > b->springs.size();
  });
  row_.clear();
  spring_.clear();
  elastic_.clear();
  counterparts_.clear();
  batch_.clear();
  std::vector<std::size_t> ends;  // by colour: the end of its batches
  for (std::size_t i = 0; i < order.size();) {
    const uint32_t own = color_of(order[i]);
    // The last colour gets the paths for which no other colour is left, at points with very many springs.
    // These paths are swept one at a time.
    const std::size_t most = own + 1 == kPathColors ? 1 : kLanes;
    std::size_t end = i;
    while (end < order.size() && end < i + most && color_of(order[end]) == own) ++end;
    add_batch(std::span(order).subspan(i, end - i), springs);
    ends.resize(own, ends.empty() ? 0 : ends.back());
    ends.resize(own + 1);
    ends[own] = batch_.size();
    i = end;
  }
  axis_.assign(row_.size(), AxisFloats{});
  impulse_.assign(row_.size(), Floats{});
  add_stages(ends);
  prepared_for_ = -1;
  is_stretched_ = false;
  set_longest_step();
  longest_at_rest_ = longest_step_;
}

/// Adds paths of equal or decreasing length as one batch.
void ClothSprings::add_batch(std::span<const SpringPath* const> paths, std::span<const ClothSpring> springs) {
  Batch batch{row_.size(), paths[0]->springs.size(), kNone};
  const auto has_counterpart = [&](uint32_t spring) { return springs[spring].counterpart_rest > 0; };
  if (std::ranges::any_of(
          paths, [&](const SpringPath* p) { return std::ranges::any_of(p->springs, has_counterpart); }))
    batch.counterparts = counterparts_.size();
  for (std::size_t k = 0; k <= batch.length; ++k) {
    Row row{};
    Elastic elastic{};
    std::array<uint32_t, kLanes> own_springs;
    own_springs.fill(kNoSpring);
    Counterparts counterparts{};
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const SpringPath& path = *paths[std::min(lane, paths.size() - 1)];
      // Lanes without a path, and the rest of shorter paths, are read but have no stiffness.
      row.point[lane] = path.points[std::min(k, path.points.size() - 1)];
      counterparts.a[lane] = counterparts.b[lane] = row.point[lane];
      if (lane >= paths.size() || k >= path.points.size()) continue;
      row.count = static_cast<uint32_t>(lane) + 1;
      if (k == path.springs.size()) continue;
      const ClothSpring& s = springs[path.springs[k]];
      own_springs[lane] = path.springs[k];
      elastic.rest[lane] = s.rest_length;
      if (s.counterpart_rest == 0) continue;
      counterparts.a[lane] = s.counterpart[0];
      counterparts.b[lane] = s.counterpart[1];
      counterparts.rest[lane] = s.counterpart_rest;
    }
    row_.push_back(row);
    spring_.push_back(own_springs);
    elastic_.push_back(elastic);
    if (batch.counterparts != kNone) counterparts_.push_back(counterparts);
  }
  batch_.push_back(batch);
}

void ClothSprings::add_stages(std::span<const std::size_t> color_ends) {
  apply_.clear();
  forward_.clear();
  backward_.clear();
  const auto add = [&](std::size_t color, decltype(Stage::kind) kind, std::vector<Stage>& stages) {
    const std::size_t begin = color == 0 ? 0 : color_ends[color - 1], end = color_ends[color];
    if (begin == end) return;
    std::size_t longest = 1;
    for (std::size_t i = begin; i < end; ++i) longest = std::max(longest, batch_[i].length);
    // Paths of the last colour may share points, so they are swept in order.
    const bool alone = color + 1 == kPathColors;
    const std::size_t block = alone ? end - begin : (kBlock / (kLanes * kChains * longest) + 1) * kChains;
    stages.push_back({kind, begin, end, block, alone});
  };
  for (std::size_t c = 0; c < color_ends.size(); ++c) add(c, Stage::apply, apply_);
  for (std::size_t c = 0; c < color_ends.size(); ++c) add(c, Stage::forward, forward_);
  for (std::size_t c = color_ends.size(); c-- > 0;) add(c, Stage::backward, backward_);
}

void ClothSprings::set_longest_step() {
  Real square = std::numeric_limits<Real>::infinity();
  for (const Material& m : material_) square = std::min(square, m.most / m.fastest);
  longest_step_ = std::sqrt(square);
}

/// Returns the elongations of the springs of a row, from their lengths [m].
inline Lanes ClothSprings::elongations(const Batch& batch, std::size_t r, Lanes length, const Vec4* x) const {
  const Lanes own = length - elastic_[r].rest;
  if (batch.counterparts == kNone) return own;
  const Counterparts& c = counterparts_[batch.counterparts + r - batch.first];
  const FourVectors d = FourVectors::of(x, c.a) - FourVectors::of(x, c.b);
  const Lanes none = {};
  return c.rest > none ? (own - lane_root(d.dot(d)) + c.rest) / 2 : own;
}

/// Calls look(batch, row, d) for each row, where d holds the vectors from the second to the first points of
/// its springs.
template <class Look>
inline void ClothSprings::for_rows(const Vec4* x, Look&& look) const {
  for (const Batch& batch : batch_) {
    FourVectors at = FourVectors::of(x, row_[batch.first].point);
    for (std::size_t r = batch.first, end = r + batch.length; r < end; ++r) {
      const FourVectors next = FourVectors::of(x, row_[r + 1].point);
      look(batch, r, at - next);
      at = next;
    }
  }
}

/// Returns an upper bound of the transverse stiffness at a point, the sum of k e / (l m) of its springs
/// [1/s^2], from the springs that are longer than kShortEnough alone. Returns 0 if there are none.
Real ClothSprings::bound_across(const ClothPoints& points) const {
  const Vec4* const x = points.position.data();
  Real steepest = 0;
  for_rows(x, [&](const Batch& batch, std::size_t r, const FourVectors& d) {
    const Lanes square = d.dot(d);
    const auto too_long = square > kShortEnough * kShortEnough * elastic_[r].rest * elastic_[r].rest;
    if ((too_long[0] | too_long[1] | too_long[2] | too_long[3]) == 0) return;
    const Lanes length = lane_root(square), elongation = elongations(batch, r, length, x);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const uint32_t spring = spring_[r][lane];
      if (too_long[lane] == 0 || spring == kNoSpring) continue;
      const Material& m = material_[spring];
      const Real strain = std::max(elongation[lane] / length[lane], 0.0);
      steepest = std::max(steepest, m.stiffness * strain / std::min(points.mass[m.a], points.mass[m.b]));
    }
  });
  return steepest > 0 ? (1 - 1 / kShortEnough) * most_around_ + most_springs_ * steepest : 0;
}

void ClothSprings::adapt_to_stretch(const ClothPoints& points) {
  const Real across_bound = bound_across(points);
  // Neither end of a spring has more than the bound, so most steps need no sums over all springs.
  const Real at_rest = longest_at_rest_ * longest_at_rest_;
  const bool is_stretched = clamped_ > 0 ? across_bound > 0 : 2 * across_bound * at_rest > kMaxAcross;
  if (!is_stretched && !is_stretched_) return;
  const Vec4* const x = points.position.data();
  std::vector<Real> across(points.size(), 0);  // by point: sum of k e / (l m) of its springs
  for_rows(x, [&](const Batch& batch, std::size_t r, const FourVectors& d) {
    const Lanes length = lane_root(d.dot(d)), elongation = elongations(batch, r, length, x);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const uint32_t spring = spring_[r][lane];
      if (spring == kNoSpring || !(elongation[lane] > 0)) continue;
      const Real stiffness = material_[spring].stiffness * elongation[lane] / length[lane];
      for (uint32_t end : {row_[r].point[lane], row_[r + 1].point[lane]})
        across[end] += stiffness / points.mass[end];
    }
  });
  for (Material& m : material_) {
    const Real sum = across[m.a] + across[m.b];
    m.most = sum > 0 ? std::min(m.most_at_rest, kMaxAcross * m.fastest / sum) : m.most_at_rest;
  }
  is_stretched_ = is_stretched;
  set_longest_step();
  if (clamped_ > 0 || prepared_for_ > longest_step_) prepared_for_ = -1;  // otherwise no stiffness changes
}

void ClothSprings::apply(ClothPoints& points, std::span<Vec4> moves) {
  run(apply_, points, moves);
}

void ClothSprings::run(std::span<const Stage> stages, ClothPoints& points, std::span<Vec4> moves) {
  const uint32_t threads = material_.size() < kWorthThreads ? 1 : available_threads();
  const auto all = [](const Stage&) { return true; };
  run_stages(stages, threads, all, [&](const Stage& stage, uint32_t block) {
    const std::size_t begin = stage.begin + block * stage.block,
                      end = std::min(begin + stage.block, stage.end);
    const std::size_t together = stage.alone ? 1 : kChains;
    for (std::size_t i = begin; i < end; i += together) {
      const std::span<const Batch> batches(&batch_[i], std::min(together, end - i));
      if (stage.kind == Stage::apply)
        for (const Batch& batch : batches) apply(points, moves, batch);
      else
        stage.kind == Stage::forward ? sweep_forward(points, moves, batches)
                                     : sweep_backward(points, moves, batches);
    }
  });
}

/// Prepares the values that depend only on the length of the step and on which points are pinned. Lengths of
/// equal steps may differ by rounding, so they are compared in single precision.
void ClothSprings::begin(const ClothPoints& points, Real step) {
  const Real h = static_cast<float>(step);
  if (h == prepared_for_ && points.inverse_mass == inverse_mass_) return;
  prepared_for_ = h;
  inverse_mass_ = points.inverse_mass;
  clamped_ = 0;
  least_stiffness_ = 1;
  for (std::size_t r = 0; r < row_.size(); ++r) {
    Row& row = row_[r];
    row.held = 0;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const bool is_there = lane < row.count;
      row.weight[lane] = is_there ? inverse_mass_[row.point[lane]] : 0;
      if (is_there && row.weight[lane] == 0) row.held |= 1u << lane;
      const uint32_t i = spring_[r][lane];
      if (i == kNoSpring) continue;
      const Material& material = material_[i];
      const Real mobility = inverse_mass_[material.a] + inverse_mass_[material.b];
      const Real ratio = h * h * material.stiffness * mobility;
      if (ratio > material.most * (1 + kRounding)) {
        ++clamped_;
        least_stiffness_ = std::min(least_stiffness_, material.most / ratio);
      }
      const Real stiffness =
          std::min(h * h * material.stiffness, material.most / std::max(mobility, kNoMobility));
      elastic_[r].stiffness[lane] = stiffness;
      const Real resists = stiffness + h * material.damping, forget = 1 / (1 + resists * mobility);
      row.along[lane] = static_cast<float>(resists * forget);
      row.forget[lane] = static_cast<float>(forget);
    }
  }
}

/// Calls act(lane) for the lanes of a row that have a point. Most rows have one in every lane. The calls are
/// then written out, so that the values stay in registers.
template <class Act>
inline void ClothSprings::for_lanes(const Row& row, Act&& act) {
  if (row.count == kLanes) {
    act(0);
    act(1);
    act(2);
    act(3);
    return;
  }
  for (std::size_t lane = 0; lane < row.count; ++lane) act(lane);
}

/// Adds the impulses of a row of springs to the pinned points among its points.
void ClothSprings::pass_on(ClothPoints& points, const Row& row, const FourVectors& impulse) {
  for (uint32_t lane = 0; lane < row.count; ++lane)
    if ((row.held >> lane & 1) != 0)
      points.pin_impulse[row.point[lane]] += Vec4(impulse.x[lane], impulse.y[lane], impulse.z[lane], 0);
}

inline void ClothSprings::store(std::span<Vec4> moves, const Row& row, const FourVectors& move) {
  const std::array<Lanes, kLanes> each = move.apart();
  const auto put = [&](std::size_t lane) { _mm256_store_pd(moves[row.point[lane]].data(), each[lane]); };
  for_lanes(row, put);
}

/// Makes the explicit step of a batch, and stores the directions of the springs for the sweep.
void ClothSprings::apply(ClothPoints& points, std::span<Vec4> moves, const Batch& batch) {
  const Vec4* const x = points.start.data();
  FourVectors at = FourVectors::of(x, row_[batch.first].point), before = {};
  const auto give = [&](const Row& row, const FourVectors& impulse) {
    const std::array<Lanes, kLanes> each = (impulse * row.weight).apart();
    for_lanes(row, [&](std::size_t lane) {
      Real* const move = moves[row.point[lane]].data();
      _mm256_store_pd(move, _mm256_load_pd(move) + each[lane]);
    });
    if (row.held != 0) pass_on(points, row, impulse);
  };
  for (std::size_t r = batch.first, end = r + batch.length; r < end; ++r) {
    const FourVectors next = FourVectors::of(x, row_[r + 1].point), d = at - next;
    const Lanes square = d.dot(d), least = kNoLength2 + Lanes{}, length = lane_root(lane_max(square, least));
    const FourVectors axis = d * (1 / length);
    const FourVectors impulse = axis * (elastic_[r].stiffness * elongations(batch, r, length, x));
    give(row_[r], before - impulse);
    axis_[r] = {narrowed(axis.x), narrowed(axis.y), narrowed(axis.z)};
    before = impulse;
    at = next;
  }
  give(row_[batch.first + batch.length], before);
}

/// Relaxes the springs of a row by Gauss-Seidel on their impulses: r + impulse / c = 0 for each spring, where
/// `impulse` is that of the sweep so far. Returns the change of the impulses. `at` and `next`: moves of the
/// points of this row and of the row `after` it.
inline Lanes ClothSprings::relax(ClothPoints& points, const Row& row, const Row& after,
                                 const FourVectors& axis, Lanes impulse, FourVectors& at, FourVectors& next) {
  const Lanes step = widened(row.along) * axis.dot(at - next) - widened(row.forget) * impulse;
  const FourVectors change = axis * step;
  at = at - change * row.weight;
  next = next + change * after.weight;
  if (row.held != 0) pass_on(points, row, FourVectors{} - change);
  if (after.held != 0) pass_on(points, after, change);
  return step;
}

/// The impulses of the sweep forwards are 0 at first.
inline void ClothSprings::relax_forward(ClothPoints& points, std::span<Vec4> moves, std::size_t r,
                                        FourVectors& at) {
  const Row& after = row_[r + 1];
  FourVectors next = FourVectors::of(moves.data(), after.point);
  impulse_[r] = narrowed(relax(points, row_[r], after, widened(axis_[r]), Lanes{}, at, next));
  store(moves, row_[r], at);
  at = next;
}

inline void ClothSprings::relax_backward(ClothPoints& points, std::span<Vec4> moves, std::size_t r,
                                         FourVectors& next) {
  const Row& after = row_[r + 1];
  FourVectors at = FourVectors::of(moves.data(), row_[r].point);
  relax(points, row_[r], after, widened(axis_[r]), widened(impulse_[r]), at, next);
  store(moves, after, next);
  next = at;
}

/// Sweeps up to kChains batches of one colour in turns. Each row of a batch waits for the result of the
/// previous one; meanwhile the processor can work on the other batches.
void ClothSprings::sweep_forward(ClothPoints& points, std::span<Vec4> moves, std::span<const Batch> batches) {
  std::array<FourVectors, kChains> at;
  for (std::size_t n = 0; n < batches.size(); ++n)
    at[n] = FourVectors::of(moves.data(), row_[batches[n].first].point);
  const std::size_t common =
      batches.size() == kChains ? std::ranges::min(batches, {}, &Batch::length).length : 0;
  for (std::size_t k = 0; k < common; ++k)
    in_turns([&](std::size_t n) { relax_forward(points, moves, batches[n].first + k, at[n]); });
  for (std::size_t n = 0; n < batches.size(); ++n) {
    const std::size_t first = batches[n].first, end = first + batches[n].length;
    for (std::size_t r = first + common; r < end; ++r) relax_forward(points, moves, r, at[n]);
    store(moves, row_[end], at[n]);
  }
}

void ClothSprings::sweep_backward(ClothPoints& points, std::span<Vec4> moves,
                                  std::span<const Batch> batches) {
  std::array<FourVectors, kChains> next;
  const std::size_t common =
      batches.size() == kChains ? std::ranges::min(batches, {}, &Batch::length).length : 0;
  for (std::size_t n = 0; n < batches.size(); ++n) {
    const std::size_t first = batches[n].first, end = first + batches[n].length;
    next[n] = FourVectors::of(moves.data(), row_[end].point);
    for (std::size_t r = end; r-- > first + common;) relax_backward(points, moves, r, next[n]);
  }
  for (std::size_t k = common; k-- > 0;)
    in_turns([&](std::size_t n) { relax_backward(points, moves, batches[n].first + k, next[n]); });
  for (std::size_t n = 0; n < batches.size(); ++n) store(moves, row_[batches[n].first], next[n]);
}

}  // namespace offstage::sim
