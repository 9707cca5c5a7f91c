#include "render/sky_picture.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include <tbb/parallel_for.h>

namespace offstage::render {
namespace {

constexpr float kSkyPi = std::numbers::pi_v<float>;
const Vector3f kSkyLuminance(0.2126f, 0.7152f, 0.0722f);

std::size_t sky_cell(int column, int row, int columns) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
}

/// Returns the coordinates of a direction in a sky picture, in [0, 1] from the upper left corner.
Vector2f sky_coordinates(const Vector3f& direction) {
  const float u = 0.5f + std::atan2(direction.x(), -direction.z()) * (0.5f / kSkyPi);
  const float v = std::acos(std::clamp(direction.y(), -1.0f, 1.0f)) / kSkyPi;
  return {std::clamp(u, 0.0f, 1.0f), v};
}

Vector3f sky_direction_at(float u, float height) {
  const float angle = (u - 0.5f) * 2 * kSkyPi, r = std::sqrt(std::max(1 - height * height, 0.0f));
  return {r * std::sin(angle), height, -r * std::cos(angle)};
}

Vector3f sky_direction(const SkyGrid& grid, int column, int row) {
  const float v = (static_cast<float>(row) + 0.5f) / static_cast<float>(grid.rows);
  return sky_direction_at((static_cast<float>(column) + 0.5f) / static_cast<float>(grid.columns),
                          std::cos(kSkyPi * v));
}

/// Returns the index of the cell that contains a direction.
std::size_t sky_cell_at(const SkyGrid& grid, const Vector3f& direction) {
  const Vector2f at = sky_coordinates(direction);
  const int column = std::min(static_cast<int>(at.x() * static_cast<float>(grid.columns)), grid.columns - 1);
  const int row = std::min(static_cast<int>(at.y() * static_cast<float>(grid.rows)), grid.rows - 1);
  return sky_cell(column, row, grid.columns);
}

/// Calls get(column, row) for the four cells around a direction, and mixes their values.
template <class Get>
Vector3f sky_interpolated(int columns, int rows, const Vector3f& direction, Get get) {
  const Vector2f at = sky_coordinates(direction);
  const float x = at.x() * static_cast<float>(columns) - 0.5f, y = at.y() * static_cast<float>(rows) - 0.5f;
  const float x0 = std::floor(x), y0 = std::floor(y), s = x - x0, t = y - y0;
  const auto column = [&](int k) { return (static_cast<int>(x0) + k + columns) % columns; };
  const auto row = [&](int k) { return std::clamp(static_cast<int>(y0) + k, 0, rows - 1); };
  const Vector3f upper = (1 - s) * get(column(0), row(0)) + s * get(column(1), row(0));
  const Vector3f lower = (1 - s) * get(column(0), row(1)) + s * get(column(1), row(1));
  return (1 - t) * upper + t * lower;
}

// The format has three mantissas of 9 bits and one exponent, as in the extension EXT_texture_shared_exponent.
constexpr int kSharedMantissaBits = 9, kSharedExponentBias = 15, kMostSharedExponent = 31;

uint32_t packed_color(const Vector3f& color) {
  const Vector3f c = color.cwiseMax(0.0f).cwiseMin(65408.0f);
  const float largest = c.maxCoeff();
  if (largest < 0x1p-25f) return 0;
  int exponent = std::max(std::ilogb(largest), -kSharedExponentBias - 1) + 1 + kSharedExponentBias;
  const auto unit = [&] { return std::ldexp(1.0f, exponent - kSharedExponentBias - kSharedMantissaBits); };
  if (std::floor(largest / unit() + 0.5f) >= 512) ++exponent;
  exponent = std::min(exponent, kMostSharedExponent);
  const float inverse = 1 / unit();
  uint32_t result = static_cast<uint32_t>(exponent) << 27;
  for (int k = 0; k < 3; ++k)
    result |= std::min(static_cast<uint32_t>(c[k] * inverse + 0.5f), 511u) << (9 * k);
  return result;
}

Vector3f unpacked_color(uint32_t packed) {
  const int exponent = static_cast<int>(packed >> 27);
  const float unit = std::ldexp(1.0f, exponent - kSharedExponentBias - kSharedMantissaBits);
  return unit * Vector3f(static_cast<float>(packed & 511u), static_cast<float>(packed >> 9 & 511u),
                         static_cast<float>(packed >> 18 & 511u));
}

SkyPicture::Packed packed_grid(const SkyGrid& grid) {
  SkyPicture::Packed result{grid.columns, grid.rows, {}};
  result.values.reserve(grid.values.size());
  for (const Vector3f& value : grid.values) result.values.push_back(packed_color(value));
  return result;
}

SkyGrid sky_grid_of(const HdrImage& image) {
  if (image.width_px < 2 || image.width_px != 2 * image.height_px)
    throw std::invalid_argument("a picture of the sky must be twice as wide as high, got " +
                                std::to_string(image.width_px) + "x" + std::to_string(image.height_px));
  SkyGrid grid{image.width_px, image.height_px, {}};
  grid.values.reserve(image.pixel_count());
  for (std::size_t i = 0; i < image.pixel_count(); ++i) {
    const Vector3f value(image.rgba[4 * i], image.rgba[4 * i + 1], image.rgba[4 * i + 2]);
    if (!value.allFinite() || value.minCoeff() < 0)
      throw std::invalid_argument(
          "the picture of the sky has a negative, infinite or undefined value; all values must be finite and "
          "at least 0");
    grid.values.push_back(value);
  }
  return grid;
}

/// Returns the convolution with a Gaussian of the angle between directions. A sun can be ten thousand times
/// as bright as the sky around it, so the Gaussian reaches so far that its end is not visible, and the cells
/// are smaller than it.
SkyGrid blurred_sky(const SkyGrid& source, float sigma) {
  constexpr float kReach = 6;  // [sigma]; the Gaussian is 1.5e-8 there
  constexpr int kMostColumns = 2048;
  const int columns = std::clamp(2 * static_cast<int>(2 * kSkyPi / sigma), 32, kMostColumns);
  const SkyGrid grid = resampled(source, columns, columns / 2);
  SkyGrid result = grid;
  const float reach = kReach * sigma, row_angle = kSkyPi / static_cast<float>(grid.rows);
  const int rows_around = static_cast<int>(std::ceil(reach / row_angle));
  tbb::parallel_for(0, grid.rows, [&](int row) {
    std::vector<Vector3f> sums(static_cast<std::size_t>(columns), Vector3f::Zero());
    const Vector3f middle = sky_direction(grid, 0, row);
    float weights = 0;
    for (int y = std::max(row - rows_around, 0); y <= std::min(row + rows_around, grid.rows - 1); ++y) {
      const float sine = std::sin((static_cast<float>(y) + 0.5f) * row_angle);
      const int widest = static_cast<int>(std::ceil(reach / (row_angle * std::max(sine, 1e-3f))));
      const int half = std::min(widest, columns / 2 - 1);
      for (int k = -half; k <= half; ++k) {
        const float cosine = std::min(middle.dot(sky_direction(grid, (k + columns) % columns, y)), 1.0f);
        const float weight = sine * std::exp((cosine - 1) / (sigma * sigma));
        if (!(weight > 0)) continue;
        weights += weight;
        // The columns from 0 take values from `first` on; those at the end take the first ones.
        const int first = (k + columns) % columns;
        for (int column = 0; column < columns - first; ++column)
          sums[static_cast<std::size_t>(column)] += weight * grid.cell(column + first, y);
        for (int column = columns - first; column < columns; ++column)
          sums[static_cast<std::size_t>(column)] += weight * grid.cell(column + first - columns, y);
      }
    }
    for (int column = 0; column < columns; ++column)
      result.cell(column, row) = sums[static_cast<std::size_t>(column)] / weights;
  });
  return result;
}

}  // namespace

Vector3f& SkyGrid::cell(int column, int row) {
  return values[sky_cell(column, row, columns)];
}
const Vector3f& SkyGrid::cell(int column, int row) const {
  return values[sky_cell(column, row, columns)];
}

float SkyGrid::solid_angle(int row) const {
  const float step = kSkyPi / static_cast<float>(rows);
  return 2 * kSkyPi / static_cast<float>(columns) *
         (std::cos(step * static_cast<float>(row)) - std::cos(step * static_cast<float>(row + 1)));
}

Vector3f SkyGrid::at(const Vector3f& direction) const {
  return sky_interpolated(columns, rows, direction, [&](int x, int y) { return cell(x, y); });
}

SkyGrid resampled(const SkyGrid& grid, int columns, int rows) {
  // Sums the cells within each row, and then the rows, weighted by the solid angle of their contribution.
  // Returns the fraction of cell k of `from` that lies in cell j of `to`.
  const auto fraction_of = [](int from, int to, int k, int j) {
    const double a = static_cast<double>(j) * from / to, b = static_cast<double>(j + 1) * from / to;
    return std::max(std::min<double>(k + 1, b) - std::max<double>(k, a), 0.0);
  };
  const auto range_of = [](int from, int to, int j) {
    const int first = static_cast<int>(static_cast<int64_t>(j) * from / to);
    const int last = static_cast<int>((static_cast<int64_t>(j + 1) * from + to - 1) / to) - 1;
    return std::pair(first, std::min(last, from - 1));
  };
  SkyGrid wide{columns, grid.rows, {}};
  wide.values.resize(sky_cell(0, grid.rows, columns));
  tbb::parallel_for(0, grid.rows, [&](int y) {
    for (int x = 0; x < columns; ++x) {
      const auto [first, last] = range_of(grid.columns, columns, x);
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      double weights = 0;
      for (int k = first; k <= last; ++k) {
        const double weight = fraction_of(grid.columns, columns, k, x);
        sum += weight * grid.cell(k, y).cast<double>();
        weights += weight;
      }
      wide.cell(x, y) = (sum / weights).cast<float>();
    }
  });
  SkyGrid result{columns, rows, {}};
  result.values.resize(sky_cell(0, rows, columns));
  tbb::parallel_for(0, rows, [&](int y) {
    const auto [first, last] = range_of(grid.rows, rows, y);
    for (int x = 0; x < columns; ++x) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      double weights = 0;
      for (int k = first; k <= last; ++k) {
        const double weight =
            fraction_of(grid.rows, rows, k, y) * std::sin(std::numbers::pi * (k + 0.5) / grid.rows);
        sum += weight * wide.cell(x, k).cast<double>();
        weights += weight;
      }
      result.cell(x, y) = (sum / weights).cast<float>();
    }
  });
  return result;
}

SkyPicture::SkyPicture(const HdrImage& image, float blur_deg) {
  SkyGrid grid = sky_grid_of(image);
  if (grid.columns > kMostColumns) grid = resampled(grid, kMostColumns, kMostColumns / 2);
  sharp_ = packed_grid(grid);
  if (blur_deg > 0) {
    background_.push_back(packed_grid(blurred_sky(grid, blur_deg * kSkyPi / 180)));
  } else {
    background_.push_back(sharp_);
    for (SkyGrid level = grid; level.columns >= 512 && level.columns % 4 == 0;) {
      level = resampled(level, level.columns / 2, level.rows / 2);
      background_.push_back(packed_grid(level));
    }
  }
  light_ = grid.columns > kMostLightColumns ? resampled(grid, kMostLightColumns, kMostLightColumns / 2)
                                            : std::move(grid);
  split();
  find_beam();
  find_irradiance();
  prefilter();
}

// The bright part is the radiance above four times the mean luminance of the dim part. The mean decreases
// with every iteration, because the dim part gets darker. The sum of both parts does not depend on the limit.
void SkyPicture::split() {
  constexpr float kTimesMean = 4;
  constexpr int kRounds = 8;
  double limit = 1e30;
  for (int round = 0; round < kRounds; ++round) {
    double mean = 0;
    for (int y = 0; y < light_.rows; ++y) {
      double row = 0;
      for (int x = 0; x < light_.columns; ++x)
        row += std::min<double>(kSkyLuminance.dot(light_.cell(x, y)), limit);
      mean += row * light_.solid_angle(y) / (4 * std::numbers::pi);
    }
    limit = kTimesMean * mean;
  }
  fraction_.assign(light_.values.size(), 0.0f);
  sums_.assign(light_.values.size(), 0.0f);
  row_sum_.assign(static_cast<std::size_t>(light_.rows), 0.0f);
  double total = 0;
  for (int y = 0; y < light_.rows; ++y) {
    double row = 0;
    for (int x = 0; x < light_.columns; ++x) {
      const double luminance = kSkyLuminance.dot(light_.cell(x, y));
      const std::size_t k = sky_cell(x, y, light_.columns);
      if (luminance > limit) {
        fraction_[k] = static_cast<float>(1 - limit / luminance);
        row += fraction_[k] * luminance * light_.solid_angle(y);
      }
      sums_[k] = static_cast<float>(row);
    }
    total += row;
    row_sum_[static_cast<std::size_t>(y)] = static_cast<float>(total);
  }
  bright_total_ = static_cast<float>(total);
}

void SkyPicture::find_beam() {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero(), light = Eigen::Vector3d::Zero();
  double weights = 0;
  for (int y = 0; y < light_.rows && has_bright_part(); ++y) {
    for (int x = 0; x < light_.columns; ++x) {
      const std::size_t k = sky_cell(x, y, light_.columns);
      if (fraction_[k] == 0) continue;
      const Eigen::Vector3d bright = (fraction_[k] * light_.solid_angle(y) * light_.values[k]).cast<double>();
      const double weight = kSkyLuminance.cast<double>().dot(bright);
      light += bright;
      direction += weight * sky_direction(light_, x, y).cast<double>();
      weights += weight;
    }
  }
  if (!(direction.norm() > 1e-3 * weights) || weights <= 0) return;
  const double mean_length = direction.norm() / weights;
  beam_.direction = direction.normalized().cast<float>();
  beam_.light = (mean_length * light / std::numbers::pi).cast<float>();
  // The mean of the directions to a disc of radius r has the length (1 + cos r) / 2.
  const double radius = std::acos(std::clamp(2 * mean_length - 1, -1.0, 1.0));
  beam_.size_deg = static_cast<float>(std::clamp(2 * radius * 180 / std::numbers::pi, 0.3, 60.0));
}

Vector3f SkyPicture::unpacked_at(const Vector3f& direction) const {
  return sky_interpolated(sharp_.columns, sharp_.rows, direction, [&](int x, int y) {
    return unpacked_color(sharp_.values[sky_cell(x, y, sharp_.columns)]);
  });
}

Vector3f SkyPicture::dim(const Vector3f& direction) const {
  const std::size_t k = sky_cell_at(light_, direction);
  return (1 - fraction_[k]) * light_.values[k];
}

float SkyPicture::bright_fraction(const Vector3f& direction) const {
  return fraction_[sky_cell_at(light_, direction)];
}

float SkyPicture::density(const Vector3f& direction) const {
  if (!has_bright_part()) return 0;
  const std::size_t k = sky_cell_at(light_, direction);
  return fraction_[k] * kSkyLuminance.dot(light_.values[k]) / bright_total_;
}

SkyPicture::Sample SkyPicture::sample(const Vector2f& uv) const {
  if (!has_bright_part()) return {Vector3f::UnitY(), Vector3f::Zero()};
  // Returns a cell, and sets `at` to the position within this cell.
  const auto find = [](const float* sums, int count, float& at) {
    const float wanted = at * sums[count - 1];
    const float* found = std::upper_bound(sums, sums + count - 1, wanted);
    const float before = found == sums ? 0.0f : found[-1], size = *found - before;
    at = size > 0 ? std::clamp((wanted - before) / size, 0.0f, 1.0f) : 0.5f;
    return static_cast<int>(found - sums);
  };
  float x = uv.x(), y = uv.y();
  const int row = find(row_sum_.data(), light_.rows, y);
  const int column = find(&sums_[sky_cell(0, row, light_.columns)], light_.columns, x);
  const float step = kSkyPi / static_cast<float>(light_.rows);
  const float top = std::cos(step * static_cast<float>(row)),
              bottom = std::cos(step * static_cast<float>(row + 1));
  const std::size_t k = sky_cell(column, row, light_.columns);
  const float luminance = kSkyLuminance.dot(light_.values[k]);
  return {sky_direction_at((static_cast<float>(column) + x) / static_cast<float>(light_.columns),
                           top + y * (bottom - top)),
          bright_total_ / luminance * light_.values[k]};
}

// Radiance of a white surface: the integral of the radiance times max(n * direction, 0) / pi, with the series
// of the clamped cosine up to degree 2 (Ramamoorthi and Hanrahan, 2001): 1/4 + 1/2 c + 5/32 (3 c^2 - 1), over
// pi.
void SkyPicture::find_irradiance() {
  for (int y = 0; y < light_.rows; ++y) {
    for (int x = 0; x < light_.columns; ++x) {
      const std::size_t k = sky_cell(x, y, light_.columns);
      const Vector3f d = sky_direction(light_, x, y);
      const Vector3f light = ((1 - fraction_[k]) * light_.solid_angle(y) / kSkyPi) * light_.values[k];
      irradiance_.constant += 0.25f * light;
      irradiance_.slope += 0.5f * light * d.transpose();
      const Eigen::Matrix3f square = 3 * d * d.transpose() - Eigen::Matrix3f::Identity();
      for (int c = 0; c < 3; ++c)
        irradiance_.curvature[static_cast<std::size_t>(c)] += 5.0f / 32 * light[c] * square;
    }
  }
}

// Each level has the mean of the dim part over the lobe of GGX around the direction, for a surface that is
// seen along its normal (B. Karis, "Real Shading in Unreal Engine 4", 2013).
void SkyPicture::prefilter() {
  SkyGrid dim_part = light_;
  for (std::size_t k = 0; k < dim_part.values.size(); ++k) dim_part.values[k] *= 1 - fraction_[k];
  constexpr int kColumns = 256;
  levels_[0] = resampled(dim_part, kColumns, kColumns / 2);
  const SkyGrid source = resampled(dim_part, kColumns / 2, kColumns / 4);
  std::vector<Vector3f> directions(source.values.size());
  for (int y = 0; y < source.rows; ++y)
    for (int x = 0; x < source.columns; ++x)
      directions[sky_cell(x, y, source.columns)] = sky_direction(source, x, y);
  for (std::size_t level = 1; level < kLevels; ++level) {
    const float roughness = static_cast<float>(level) / (kLevels - 1), a2 = std::pow(roughness, 4.0f);
    SkyGrid& out = levels_[level];
    out.columns = kColumns >> level;
    out.rows = out.columns / 2;
    out.values.resize(sky_cell(0, out.rows, out.columns));
    tbb::parallel_for(0, out.rows, [&](int row) {
      for (int column = 0; column < out.columns; ++column) {
        const Vector3f n = sky_direction(out, column, row);
        Vector3f sum = Vector3f::Zero();
        float weights = 0;
        for (int y = 0; y < source.rows; ++y) {
          const float angle = source.solid_angle(y);
          for (int x = 0; x < source.columns; ++x) {
            const std::size_t k = sky_cell(x, y, source.columns);
            const float cosine = n.dot(directions[k]);
            if (cosine <= 0) continue;
            const float d = 0.5f * (1 + cosine) * (a2 - 1) + 1;  // (1 + cosine) / 2 = (n * h)^2
            const float weight = angle * cosine * a2 / (d * d);
            sum += weight * source.values[k];
            weights += weight;
          }
        }
        out.cell(column, row) = sum / weights;
      }
    });
  }
}

Vector3f SkyPicture::mirrored(const Vector3f& direction, float roughness) const {
  const float level = std::clamp(roughness, 0.0f, 1.0f) * (kLevels - 1);
  const auto low = static_cast<std::size_t>(level);
  const float fraction = level - static_cast<float>(low);
  const Vector3f value = levels_[low].at(direction);
  return fraction > 0 ? Vector3f((1 - fraction) * value + fraction * levels_[low + 1].at(direction)) : value;
}

std::vector<SkyPicture::Packed> SkyPicture::levels() const {
  std::vector<Packed> result;
  for (const SkyGrid& level : levels_) result.push_back(packed_grid(level));
  return result;
}

Vector3f TurnedSky::to_picture(const Vector3f& d) const {
  const float c = std::cos(turn), s = std::sin(turn);
  return {c * d.x() - s * d.z(), d.y(), c * d.z() + s * d.x()};
}
Vector3f TurnedSky::from_picture(const Vector3f& d) const {
  const float c = std::cos(turn), s = std::sin(turn);
  return {c * d.x() + s * d.z(), d.y(), c * d.z() - s * d.x()};
}

std::array<Vector3f, 9> TurnedSky::irradiance() const {
  Eigen::Matrix3f world_from_picture;
  for (int k = 0; k < 3; ++k) world_from_picture.col(k) = from_picture(Vector3f::Unit(k));
  const SkyPicture::Irradiance& light = picture->irradiance();
  const Eigen::Matrix3f slope = light.slope * world_from_picture.transpose();
  std::array<Vector3f, 9> result = {light.constant, slope.col(1), slope.col(2), slope.col(0)};
  for (int c = 0; c < 3; ++c) {
    const Eigen::Matrix3f m =
        world_from_picture * light.curvature[static_cast<std::size_t>(c)] * world_from_picture.transpose();
    const std::array<float, 5> values = {2 * m(0, 1), 2 * m(1, 2), 0.5f * m(2, 2), 2 * m(0, 2),
                                         0.5f * (m(0, 0) - m(1, 1))};
    for (std::size_t k = 0; k < values.size(); ++k) result[4 + k][c] = values[k];
  }
  for (Vector3f& value : result) value *= intensity;
  return result;
}

SkyBeam TurnedSky::beam() const {
  SkyBeam result = picture->beam();
  result.direction = from_picture(result.direction);
  result.light *= intensity;
  return result;
}

}  // namespace offstage::render
