#include "render/trace/light_filter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace offstage::render {
namespace {

constexpr int kRowsPerFilterTask = 16;
// Fractions of the mean hit distance over which all light, and noisy light, is averaged.
constexpr float kFractionOfReach = 0.3f, kNoisyFractionOfReach = 0.2f;
// Least hit distance that is used for noisy light: the smaller one of a fraction of the picture's height and
// a number of pixels. Smaller values leave noise in corners.
constexpr float kLeastNoisyFraction = 0.1f, kLeastNoisy_px = 36;
constexpr float kSameSurface = 0.9f;  // least cosine between two normals of one surface
constexpr float kNoReach = 1e30f;     // 1 / distance^2: nothing is averaged
constexpr int kRun = 32;              // pixels per run; runs of equal values are skipped

void for_filter_rows(int height_px, const auto& each) {
  tbb::parallel_for(tbb::blocked_range<int>(0, height_px, kRowsPerFilterTask), [&](const auto& rows) {
    for (int y = rows.begin(); y < rows.end(); ++y) each(y);
  });
}

LaneVectors lanes_of(const auto& planes, int x, int y) {
  return {planes[0].lanes(x, y), planes[1].lanes(x, y), planes[2].lanes(x, y)};
}

}  // namespace

LightGuide::LightGuide(int width, int height)
    : width_px(width),
      height_px(height),
      place{LightPlane(width, height), LightPlane(width, height), LightPlane(width, height)},
      normal{LightPlane(width, height), LightPlane(width, height), LightPlane(width, height)},
      filled(width, height),
      inverse_size2(width, height) {}

LightNoise::LightNoise(const LightGuide& guide, const LightPlane& brightness)
    : blocks_(guide.width_px, guide.height_px) {
  constexpr int kSide = PixelBlocks<Sums>::kSide;
  tbb::parallel_for(0, blocks_.rows(), [&](int row) {
    for (int y = row * kSide; y < std::min((row + 1) * kSide, guide.height_px); ++y) {
      const float *value = brightness.at(0, y), *filled = guide.filled.at(0, y);
      for (int x = 0; x < guide.width_px; ++x)
        blocks_.at(x, y) += {filled[x], filled[x] * value[x], filled[x] * value[x] * value[x]};
    }
  });
}

float LightNoise::relative_variance(int x, int y) const {
  const Sums total = blocks_.sum_around(x, y);
  if (!(total.value > 0)) return 0;
  return std::max(total.count * total.square / (total.value * total.value) - 1, 0.0f);
}

bool LightGuide::shows(int x, int y, const Eigen::Vector3f& position,
                       const Eigen::Vector3f& unit_normal) const {
  if (*filled.at(x, y) == 0) return false;
  const Eigen::Vector3f own = at(normal, x, y);
  const float off = own.dot(at(place, x, y) - position);
  return own.dot(unit_normal) > kSameSurface && off * off * *inverse_size2.at(x, y) < 1;
}

IntLanes LightGuide::shows(int x, int y, const LaneVectors& position, const LaneVectors& unit_normal) const {
  const LaneVectors own = lanes_of(normal, x, y);
  const Lanes off = dot(own, lanes_of(place, x, y) - position);
  return (filled.lanes(x, y) > 0.0f) & (dot(own, unit_normal) > kSameSurface) &
         (off * off * inverse_size2.lanes(x, y) < 1.0f);
}

void LightGuide::find_reach(const LightPlane& inverse_distance, const LightNoise& noise, LightPlane& reach2,
                            LightPlane& noisy_reach2) const {
  const float least_px = std::min(kLeastNoisyFraction * static_cast<float>(height_px), kLeastNoisy_px);
  for_filter_rows(height_px, [&](int y) {
    for (int x = 0; x < width_px; x += kLanes) {
      Lanes sum{}, count{};
      for (int row = std::max(y - 2, 0); row <= std::min(y + 2, height_px - 1); ++row)
        for (int dx = -2; dx <= 2; ++dx) {
          const Lanes present = filled.lanes(x + dx, row);
          sum += present * inverse_distance.lanes(x + dx, row);
          count += present;
        }
      const float noisy = std::max(1 - 1 / std::max(noise.relative_variance(x, y), 1e-6f), 0.0f);
      const Lanes mean = sum / larger(count, Lanes{} + 1);
      const Lanes most = square_root(inverse_size2.lanes(x, y)) * (1 / least_px);
      const Lanes inverse = mean + noisy * (smaller(mean, most) - mean);
      const float noisy_fraction = kNoisyFractionOfReach * noisy;
      reach2.set_lanes(x, y, inverse * inverse * (1 / (kFractionOfReach * kFractionOfReach)));
      noisy_reach2.set_lanes(
          x, y, noisy > 0 ? inverse * inverse * (1 / (noisy_fraction * noisy_fraction)) : Lanes{} + kNoReach);
    }
  });
}

Lanes LightGuide::similar_around(int x, int y) const {
  const LaneVectors p = lanes_of(place, x, y), n = lanes_of(normal, x, y);
  const Lanes size2 = inverse_size2.lanes(x, y);
  Lanes sum{};
  for (int row = std::max(y - 2, 0); row <= std::min(y + 2, height_px - 1); ++row)
    for (int there = x - 2; there <= x + 2; ++there) {
      const Lanes off = dot(lanes_of(place, there, row) - p, n);
      const Lanes facing = larger(dot(n, lanes_of(normal, there, row)), Lanes{});
      const Lanes f2 = facing * facing, f4 = f2 * f2, f8 = f4 * f4, apart = 1 + off * off * size2;
      sum += filled.lanes(there, row) * f8 * f8 / (apart * apart);
    }
  return sum * (1.0f / 25);
}

void LightValues::average(const LightGuide& guide, const LightPlane& filled, const LightPlane* reach2,
                          int step) {
  if (next_.empty()) next_.assign(values_.size(), LightPlane(guide.width_px, guide.height_px));
  const LightAverage means(*this, guide, filled, reach2, step);
  for_filter_rows(guide.height_px, [&](int y) { means.write_row(y, next_, y); });
  values_.swap(next_);
}

LightAverage::LightAverage(const LightValues& light, const LightGuide& guide, const LightPlane& filled,
                           const LightPlane* reach2, int step)
    : values_(light.channels()),
      guide_(guide),
      filled_(filled),
      reach2_(reach2),
      step_(step),
      runs_((guide.width_px + kRun - 1) / kRun),
      channels_(values_.size()),
      even_(static_cast<std::size_t>(runs_ * guide.height_px) * channels_) {
  for_filter_rows(guide.height_px, [&](int y) { find_even_runs(y); });
}

void LightAverage::find_even_runs(int y) {
  for (int run = 0; run < runs_; ++run) {
    const auto length = static_cast<std::size_t>(std::min(kRun, guide_.width_px - run * kRun));
    for (std::size_t i = 0; i < channels_; ++i) {
      const float* values = values_[i].at(run * kRun, y);
      std::size_t equal = 0;
      for (std::size_t x = 0; x < length; ++x) equal += values[x] == values[0] ? 1 : 0;
      even_[even_index(run, y) + i] = equal == length ? values[0] : std::numeric_limits<float>::quiet_NaN();
    }
  }
}

bool LightAverage::is_even(int run, int y) const {
  const float* here = &even_[even_index(run, y)];
  for (int row = std::max(y - step_, y % step_); row <= std::min(y + step_, guide_.height_px - 1);
       row += step_)
    for (int r = std::max(run - 1, 0); r <= std::min(run + 1, runs_ - 1); ++r)
      if (!std::equal(here, here + channels_, &even_[even_index(r, row)]))
        return false;  // a NaN is not equal to any value
  return true;
}

// Averages the pixels x ... x + 7 of row y.
template <std::size_t kChannels>
void LightAverage::average_lanes(int x, int y, const Target& to) const {
  const LaneVectors p = lanes_of(guide_.place, x, y), n = lanes_of(guide_.normal, x, y);
  const Lanes size2 = guide_.inverse_size2.lanes(x, y);
  const Lanes reach2 = reach2_ ? reach2_->lanes(x, y) : Lanes{};
  Lanes sum_of_weights{};
  std::array<Lanes, kChannels> sums{};
  for (int row = y - step_; row <= y + step_; row += step_) {
    if (row < 0 || row >= guide_.height_px) continue;
    for (int there = x - step_; there <= x + step_; there += step_) {
      const LaneVectors offset = lanes_of(guide_.place, there, row) - p;
      const Lanes off = dot(offset, n), facing = larger(dot(n, lanes_of(guide_.normal, there, row)), Lanes{});
      const Lanes f2 = facing * facing, f4 = f2 * f2, f8 = f4 * f4;
      const Lanes spread = (1 + off * off * size2) * (1 + dot(offset, offset) * reach2);
      const float kernel = (there == x ? 2.0f : 1.0f) * (row == y ? 2.0f : 1.0f);
      const Lanes weight = kernel * filled_.lanes(there, row) * f8 * f8 / (spread * spread);
      sum_of_weights += weight;
      for (std::size_t i = 0; i < kChannels; ++i) sums[i] += weight * values_[i].lanes(there, row);
    }
  }
  const IntLanes filled = filled_.lanes(x, y) > 0.0f;
  const Lanes scale = 1 / larger(sum_of_weights, Lanes{} + 1e-20f);
  for (std::size_t i = 0; i < kChannels; ++i) {
    const Lanes mean = sums[i] * scale;
    to.planes[i].set_lanes(x, to.row, filled ? mean : values_[i].lanes(x, y));
  }
}

void LightAverage::average_run(int x0, int y, int length, const Target& to) const {
  for (int x = x0; x < x0 + length; x += kLanes) {
    if (channels_ == 1)
      average_lanes<1>(x, y, to);
    else if (channels_ == 3)
      average_lanes<3>(x, y, to);
    else if (channels_ == 4)
      average_lanes<4>(x, y, to);
    else if (channels_ == 7)
      average_lanes<7>(x, y, to);
    else
      average_lanes<10>(x, y, to);
  }
}

void LightAverage::write_row(int y, std::span<LightPlane> planes, int to_row) const {
  const Target to{planes, to_row};
  for (int run = 0; run < runs_; ++run) {
    const int x = run * kRun;
    const int length = std::min(kRun, guide_.width_px - x);
    if (!is_even(run, y)) {
      average_run(x, y, length, to);
      continue;
    }
    for (std::size_t i = 0; i < channels_; ++i)
      std::copy_n(values_[i].at(x, y), length, to.planes[i].at(x, to.row));
  }
}

namespace {

using Neighbours = std::array<std::array<int, 2>, 4>;
constexpr Neighbours kBeside = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};
constexpr Neighbours kDiagonal = {{{-1, -1}, {1, -1}, {-1, 1}, {1, 1}}};

bool has_any(const LightGuide& guide, int x, int y, const Neighbours& neighbours) {
  return std::ranges::any_of(neighbours, [&](const auto& step) {
    const int row = y + step[1];
    if (row < 0 || row >= guide.height_px) return false;
    return *guide.filled.at(x + step[0], row) > 0;
  });
}

/// Fills every other pixel of a row, starting with pixel `first`.
void fill_row(const LightGuide& guide, int first, int y, const Neighbours& neighbours,
              std::span<LightPlane* const> planes) {
  constexpr float kLeast = 0.01f;  // weight of a pixel of another surface
  for (int x = 0; x < guide.width_px; x += kLanes) {
    const LaneVectors p = lanes_of(guide.place, x, y), n = lanes_of(guide.normal, x, y);
    const Lanes size2 = guide.inverse_size2.lanes(x, y);
    std::array<Lanes, 4> weights;
    Lanes sum{};
    for (std::size_t k = 0; k < 4; ++k) {
      const int there = x + neighbours[k][0], row = y + neighbours[k][1];
      weights[k] = Lanes{};
      if (row < 0 || row >= guide.height_px) continue;
      const Lanes off = dot(lanes_of(guide.place, there, row) - p, n);
      const Lanes facing = larger(dot(n, lanes_of(guide.normal, there, row)), Lanes{});
      const Lanes f2 = facing * facing, apart = 1 + off * off * size2;
      weights[k] = guide.filled.lanes(there, row) * (f2 * f2 / (apart * apart) + kLeast);
      sum += weights[k];
    }
    const Lanes scale = 1 / larger(sum, Lanes{} + 1e-20f);
    for (LightPlane* plane : planes) {
      Lanes mean{};
      for (std::size_t k = 0; k < 4; ++k)
        if (const int row = y + neighbours[k][1]; row >= 0 && row < guide.height_px)
          mean += weights[k] * plane->lanes(x + neighbours[k][0], row);
      mean *= scale;
      for (int i = first; i < kLanes; i += 2)
        if (sum[i] > 0) *plane->at(x + i, y) = mean[i];
    }
  }
}

}  // namespace

// Gaps::three_quarters are filled in two steps. The first one fills pixels in both odd rows and odd columns
// from their diagonal neighbours.
bool is_gap(Gaps gaps, const LightGuide& guide, int x, int y) {
  if (((x ^ y) & 1) != 0) return has_any(guide, x, y, kBeside);
  return gaps == Gaps::three_quarters && (x & 1) != 0 && has_any(guide, x, y, kDiagonal);
}

void fill_gaps(Gaps gaps, const LightGuide& guide, std::span<LightPlane* const> planes) {
  if (gaps == Gaps::three_quarters)
    for_filter_rows(guide.height_px / 2, [&](int k) { fill_row(guide, 1, 2 * k + 1, kDiagonal, planes); });
  // First even, then odd rows, because each row reads the rows beside it.
  for (const int first : {0, 1})
    for_filter_rows((guide.height_px - first + 1) / 2,
                    [&](int k) { fill_row(guide, 1 - first, first + 2 * k, kBeside, planes); });
}

namespace {

/// Returns the pixels 0, 2 ... 14 of 16 pixels.
Lanes even_pixels(const float* pixels) {
  Lanes a, b;
  __builtin_memcpy(&a, pixels, sizeof(a));
  __builtin_memcpy(&b, pixels + kLanes, sizeof(b));
  return __builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14);
}

}  // namespace

// The coarse pixel c covers the fine pixels 2c (side 0) and 2c + 1 (side 1). The nearest coarse pixels of
// each are c and the neighbour of c on that side. Eight fine pixels of one side are computed at a time.
void interpolate(const LightGuide& fine, const LightGuide& coarse, int y, const CoarseValues& from,
                 const float* fourth, Eigen::Vector4f* row) {
  const int near_row = y / 2, far_row = std::clamp(near_row + (y % 2 == 0 ? -1 : 1), 0, coarse.height_px - 1);
  for (int x0 = 0; x0 < fine.width_px; x0 += 2 * kLanes) {
    for (int side = 0; side < 2; ++side) {
      LaneVectors p, n;
      p = {even_pixels(fine.place[0].at(x0 + side, y)), even_pixels(fine.place[1].at(x0 + side, y)),
           even_pixels(fine.place[2].at(x0 + side, y))};
      n = {even_pixels(fine.normal[0].at(x0 + side, y)), even_pixels(fine.normal[1].at(x0 + side, y)),
           even_pixels(fine.normal[2].at(x0 + side, y))};
      const Lanes size2 = even_pixels(fine.inverse_size2.at(x0 + side, y));
      Lanes sum_of_weights{};
      LaneVectors sum{};
      for (int k = 0; k < 4; ++k) {
        const int there = x0 / 2 + (k & 1) * (side == 0 ? -1 : 1), q = k < 2 ? near_row : far_row;
        const float fraction = ((k & 1) == 0 ? 0.75f : 0.25f) * (k < 2 ? 0.75f : 0.25f) + 0.002f;
        const LaneVectors offset = lanes_of(coarse.place, there, q) - p,
                          m = lanes_of(coarse.normal, there, q);
        const Lanes off = dot(offset, n), facing = larger(dot(n, m), Lanes{});
        const Lanes f2 = facing * facing, apart = 1 + off * off * size2;
        const Lanes weight = fraction * from.filled->lanes(there, q) * (f2 * f2 + 1e-4f) / (apart * apart);
        sum_of_weights += weight;
        sum = sum + lanes_of(from.values->channels(), there, q) * weight;
      }
      sum = sum * (1 / larger(sum_of_weights, Lanes{} + 1e-30f));
      const Lanes last = fourth               ? even_pixels(fourth + x0 + side)
                         : sum_of_weights > 0 ? Lanes{} + 1
                                              : Lanes{};
      for (int i = 0; i < kLanes && x0 + 2 * i + side < fine.width_px; ++i)
        row[x0 + 2 * i + side] = {sum.x[i], sum.y[i], sum.z[i], last[i]};
    }
  }
}

}  // namespace offstage::render
