#include "render/trace/light_filter.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace offstage::render {
namespace {

constexpr int kRowsPerFilterTask = 16;
constexpr float kShareOfReach = 0.3f;  // of the mean distance around, over which light is taken as even
constexpr int kRun = 32;               // pixels that are averaged together

}  // namespace

LightFilter::LightFilter(int width_px, int height_px)
    : width_(width_px),
      height_(height_px),
      stride_(width_px + 2 * kMargin),
      runs_((width_px + kRun - 1) / kRun) {
  run_values_.resize(static_cast<std::size_t>(runs_) * static_cast<std::size_t>(height_));
  const auto size = static_cast<std::size_t>(stride_) * static_cast<std::size_t>(height_);
  for (Plane& plane : place_) plane.resize(size);
  for (Plane& plane : normal_) plane.resize(size);
  for (Plane* plane : {&filled_, &inverse_size2_, &reach2_, &mean_reach2_}) plane->resize(size);
  for (Plane& plane : values_) plane.resize(size);
  for (Plane& plane : next_) plane.resize(size);
}

void LightFilter::set(int x, int y, const Eigen::Vector3f& place, const Eigen::Vector3f& normal,
                      float pixel_size_m, const Eigen::Vector4f& values, float inverse_reach) {
  const std::size_t k = at(x, y);
  for (std::size_t i = 0; i < 3; ++i) {
    place_[i][k] = place[static_cast<int>(i)];
    normal_[i][k] = normal[static_cast<int>(i)];
  }
  filled_[k] = 1;
  inverse_size2_[k] = 1 / std::max(pixel_size_m * pixel_size_m, 1e-20f);
  reach2_[k] = inverse_reach;
  set_values(x, y, values);
}

void LightFilter::smooth_reach() {
  tbb::parallel_for(tbb::blocked_range<int>(0, height_, kRowsPerFilterTask), [&](const auto& rows) {
    for (int y = rows.begin(); y < rows.end(); ++y)
      for (int x = 0; x < width_; ++x) {
        float sum = 0, count = 0;
        for (int dy = -2; dy <= 2; ++dy) {
          const int row = y + dy;
          if (row < 0 || row >= height_) continue;
          const float* reach = &reach2_[at(x, row)];
          const float* filled = &filled_[at(x, row)];
          for (int dx = -2; dx <= 2; ++dx) {
            sum += reach[dx] * filled[dx];
            count += filled[dx];
          }
        }
        const float inverse = sum / std::max(count, 1.0f);
        mean_reach2_[at(x, y)] = inverse * inverse / (kShareOfReach * kShareOfReach);
      }
  });
  reach2_.swap(mean_reach2_);
}

void LightFilter::find_even_runs(std::size_t channels) {
  tbb::parallel_for(tbb::blocked_range<int>(0, height_, kRowsPerFilterTask), [&](const auto& rows) {
    for (int y = rows.begin(); y < rows.end(); ++y)
      for (int run = 0; run < runs_; ++run) {
        const auto count = static_cast<std::size_t>(std::min(kRun, width_ - run * kRun));
        Eigen::Vector4f value = Eigen::Vector4f::Zero();
        for (std::size_t i = 0; i < channels; ++i) {
          const float* values = &values_[i][at(run * kRun, y)];
          std::size_t equal = 0;
          for (std::size_t x = 0; x < count; ++x) equal += values[x] == values[0] ? 1 : 0;
          value[static_cast<int>(i)] = equal == count ? values[0] : std::numeric_limits<float>::quiet_NaN();
        }
        run_values_[static_cast<std::size_t>(y) * static_cast<std::size_t>(runs_) +
                    static_cast<std::size_t>(run)] = value;
      }
  });
}

bool LightFilter::is_even(int run, int y, int step) const {
  const auto value = [&](int r, int row) -> const Eigen::Vector4f& {
    return run_values_[static_cast<std::size_t>(row) * static_cast<std::size_t>(runs_) +
                       static_cast<std::size_t>(r)];
  };
  const Eigen::Vector4f& here = value(run, y);
  for (int row = std::max(y - step, y % step); row <= std::min(y + step, height_ - 1); row += step)
    for (int r = std::max(run - 1, 0); r <= std::min(run + 1, runs_ - 1); ++r)
      if (value(r, row) != here) return false;  // not a number differs from everything
  return true;
}

void LightFilter::average_run(int x0, int y, int step, int count, std::size_t channels) {
  std::array<float, kRun> sum_of_weights{}, weights;
  std::array<std::array<float, kRun>, 4> sums{};
  const auto length = static_cast<std::size_t>(count);
  const std::size_t here = at(x0, y);
  const float *px = &place_[0][here], *py = &place_[1][here], *pz = &place_[2][here];
  const float *nx = &normal_[0][here], *ny = &normal_[1][here], *nz = &normal_[2][here];
  const float *size2 = &inverse_size2_[here], *reach2 = &reach2_[here];
  for (int dy = -1; dy <= 1; ++dy) {
    const int row = y + dy * step;
    if (row < 0 || row >= height_) continue;
    for (int dx = -1; dx <= 1; ++dx) {
      const float kernel = (dx == 0 ? 2.0f : 1.0f) * (dy == 0 ? 2.0f : 1.0f);
      const std::size_t there = at(x0 + dx * step, row);
      const float *qx = &place_[0][there], *qy = &place_[1][there], *qz = &place_[2][there];
      const float *mx = &normal_[0][there], *my = &normal_[1][there], *mz = &normal_[2][there];
      const float* filled = &filled_[there];
      for (std::size_t x = 0; x < length; ++x) {
        const float wx = qx[x] - px[x], wy = qy[x] - py[x], wz = qz[x] - pz[x];
        const float off = wx * nx[x] + wy * ny[x] + wz * nz[x];
        const float distance2 = wx * wx + wy * wy + wz * wz;
        const float facing = std::max(nx[x] * mx[x] + ny[x] * my[x] + nz[x] * mz[x], 0.0f);
        const float f2 = facing * facing, f4 = f2 * f2, f8 = f4 * f4;
        const float apart = 1 + off * off * size2[x], far = 1 + distance2 * reach2[x];
        weights[x] = kernel * filled[x] * f8 * f8 / (apart * apart * far * far);
        sum_of_weights[x] += weights[x];
      }
      for (std::size_t i = 0; i < channels; ++i) {
        const float* values = &values_[i][there];
        for (std::size_t x = 0; x < length; ++x) sums[i][x] += weights[x] * values[x];
      }
    }
  }
  for (std::size_t i = 0; i < channels; ++i) {
    float* target = &next_[i][here];
    for (std::size_t x = 0; x < length; ++x) target[x] = sums[i][x] / std::max(sum_of_weights[x], 1e-20f);
  }
}

void LightFilter::average(int step, std::size_t channels) {
  find_even_runs(channels);
  tbb::parallel_for(tbb::blocked_range<int>(0, height_, kRowsPerFilterTask), [&](const auto& rows) {
    for (int y = rows.begin(); y < rows.end(); ++y)
      for (int run = 0; run < runs_; ++run) {
        const int x = run * kRun, count = std::min(kRun, width_ - x);
        if (!is_even(run, y, step)) {
          average_run(x, y, step, count, channels);
          continue;
        }
        for (std::size_t i = 0; i < channels; ++i)
          std::copy_n(&values_[i][at(x, y)], count, &next_[i][at(x, y)]);
      }
  });
  for (std::size_t i = 0; i < channels; ++i) values_[i].swap(next_[i]);
}

}  // namespace offstage::render
