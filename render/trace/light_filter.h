#pragma once
/// Private: reduces the noise of traced light by averaging over neighbouring pixels of the same surface. This
/// is an edge-avoiding a-trous filter (H. Dammertz et al., 2010), guided by normals and positions. Indirect
/// light is also guided by hit distances, so that dark corners stay narrow (error bound of G. Ward et al., "A
/// Ray Tracing Solution for Diffuse Interreflection", 1988).

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "render/lanes.h"

namespace offstage::render {

/// A picture with one float per pixel. It has margins of zeros at its left and right sides, so that filters
/// may read beyond the ends of a row.
class LightPlane {
 public:
  static constexpr int kMargin = 32;  ///< width of a margin [px]; at least the widest filter step plus kLanes

  LightPlane() = default;
  LightPlane(int width_px, int height_px)
      : stride_(width_px + 2 * kMargin),
        values_(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(height_px)) {}
  float* at(int x, int y) { return &values_[index(x, y)]; }
  const float* at(int x, int y) const { return &values_[index(x, y)]; }
  /// Returns the values of the eight pixels x ... x + 7.
  Lanes lanes(int x, int y) const {
    Lanes result;
    __builtin_memcpy(&result, at(x, y), sizeof(result));
    return result;
  }
  void set_lanes(int x, int y, Lanes value) { __builtin_memcpy(at(x, y), &value, sizeof(value)); }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(stride_) +
           static_cast<std::size_t>(x + kMargin);
  }
  int stride_ = 0;
  std::vector<float> values_;
};

struct LightGuide;

/// A value for each block of 8 x 8 pixels of a picture. T has +=.
template <class T>
class PixelBlocks {
 public:
  static constexpr int kSide = 8;  ///< width and height of a block [px]
  PixelBlocks(int width_px, int height_px)
      : columns_((width_px + kSide - 1) / kSide),
        rows_((height_px + kSide - 1) / kSide),
        values_(static_cast<std::size_t>(columns_ * rows_)) {}
  int rows() const { return rows_; }
  /// Returns the value of the block that contains pixel (x, y).
  T& at(int x, int y) { return values_[index(x / kSide, y / kSide)]; }
  /// Returns the sum over the block that contains pixel (x, y) and its neighbours.
  T sum_around(int x, int y) const {
    const int column = x / kSide, row = y / kSide;
    T sum{};
    for (int r = std::max(row - 1, 0); r <= std::min(row + 1, rows_ - 1); ++r)
      for (int c = std::max(column - 1, 0); c <= std::min(column + 1, columns_ - 1); ++c)
        sum += values_[index(c, r)];
    return sum;
  }

 private:
  std::size_t index(int column, int row) const { return static_cast<std::size_t>(row * columns_ + column); }

  int columns_, rows_;
  std::vector<T> values_;
};

/// The noise of light in each block of a picture.
class LightNoise {
 public:
  /// Measures the noise. `brightness`: light that one ray found, for each pixel with a surface.
  LightNoise(const LightGuide& guide, const LightPlane& brightness);
  /// Returns variance / mean^2 over the block that contains pixel (x, y) and its neighbours.
  float relative_variance(int x, int y) const;

 private:
  struct Sums {
    float count = 0, value = 0, square = 0;
    Sums& operator+=(const Sums& more) {
      count += more.count;
      value += more.value;
      square += more.square;
      return *this;
    }
  };
  PixelBlocks<Sums> blocks_;
};

/// The visible surfaces in a picture. They determine how far the filters may average light.
struct LightGuide {
  LightGuide(int width_px, int height_px);
  /// Computes the distance over which light may be averaged, as 1 / distance^2 [1/m^2], for each pixel. It is
  /// a fraction of the mean hit distance in the neighbourhood, because one ray says little.
  /// `inverse_distance`: 1 / hit distance of the ray of each pixel [1/m]. `reach2` is for the first steps of
  /// the filter. `noisy_reach2` is for the wider steps, which only average light whose variance exceeds the
  /// square of its mean.
  void find_reach(const LightPlane& inverse_distance, const LightNoise& noise, LightPlane& reach2,
                  LightPlane& noisy_reach2) const;

  /// For each of the pixels x ... x + 7, returns the fraction of the 5x5 pixels around it that have a similar
  /// position and normal, in [0, 1].
  Lanes similar_around(int x, int y) const;
  /// Returns whether pixel (x, y) shows the surface at a point with this unit normal.
  bool shows(int x, int y, const Eigen::Vector3f& position, const Eigen::Vector3f& unit_normal) const;
  /// The same for the pixels x ... x + 7.
  IntLanes shows(int x, int y, const LaneVectors& position, const LaneVectors& unit_normal) const;
  /// Returns the position [m] or normal of a pixel; `planes`: place or normal.
  static Eigen::Vector3f at(const std::array<LightPlane, 3>& planes, int x, int y) {
    return {*planes[0].at(x, y), *planes[1].at(x, y), *planes[2].at(x, y)};
  }

  int width_px, height_px;
  std::array<LightPlane, 3> place, normal;  ///< position [m] and unit normal; x, y, z
  LightPlane filled;                        ///< 1: a surface is visible, 0: not
  LightPlane inverse_size2;                 ///< 1 / (width of a pixel on the surface)^2 [1/m^2]
};

/// Light at each pixel of a picture. A LightGuide describes the surfaces of the same picture.
class LightValues {
 public:
  LightValues() = default;
  /// `channels`: 1, 3, 4, 7 or 10.
  LightValues(int width_px, int height_px, std::size_t channels)
      : values_(channels, LightPlane(width_px, height_px)) {}
  std::span<LightPlane> channels() { return values_; }
  std::span<const LightPlane> channels() const { return values_; }

  /// Replaces each value by its LightAverage. Calls with the steps 1, 2, 4 ... together have a wide, smooth
  /// kernel.
  void average(const LightGuide& guide, const LightPlane& filled, const LightPlane* reach2, int step);

 private:
  std::vector<LightPlane> values_;
  std::vector<LightPlane> next_;  ///< averages; created by the first call of average()
};

/// Weighted means of 3x3 pixels that are `step` pixels apart. Only pixels where `filled` is 1 are read and
/// averaged; the others keep their values. Runs of pixels that equal all pixels around them are copied.
class LightAverage {
 public:
  /// All arguments must outlive this object. `reach2`: see LightGuide::find_reach; null: the distance is not
  /// limited.
  LightAverage(const LightValues& light, const LightGuide& guide, const LightPlane& filled,
               const LightPlane* reach2, int step);
  /// Writes row y of all channels to row `to_row` of `to`, which must not be the averaged planes.
  void write_row(int y, std::span<LightPlane> to, int to_row) const;

 private:
  /// Where results are written.
  struct Target {
    std::span<LightPlane> planes;
    int row;
  };
  void find_even_runs(int y);
  std::size_t even_index(int run, int y) const {
    return static_cast<std::size_t>(y * runs_ + run) * channels_;
  }
  bool is_even(int run, int y) const;
  void average_run(int x0, int y, int length, const Target& to) const;
  template <std::size_t kChannels>
  void average_lanes(int x, int y, const Target& to) const;

  std::span<const LightPlane> values_;
  const LightGuide& guide_;
  const LightPlane& filled_;
  const LightPlane* reach2_;
  int step_, runs_;
  std::size_t channels_;
  /// For each run of pixels and each channel: the common value of all pixels of the run; NaN if they differ.
  std::vector<float> even_;
};

/// The pixels for which no light is traced in a sparse picture.
enum class Gaps {
  half,            ///< every other pixel, as on a chessboard
  three_quarters,  ///< all pixels in odd rows or in odd columns
};
/// Returns whether a pixel is a gap. A pixel is not a gap if none of the neighbours that fill_gaps() would
/// average shows a surface.
bool is_gap(Gaps gaps, const LightGuide& guide, int x, int y);
/// Sets each gap to a weighted mean of four neighbours. Neighbours with a similar position and normal have
/// more weight.
void fill_gaps(Gaps gaps, const LightGuide& guide, std::span<LightPlane* const> planes);

/// Light at half the resolution.
struct CoarseValues {
  const LightValues* values;
  const LightPlane* filled;  ///< 1 for pixels that have a value, else 0
};

/// Interpolates the three channels of `from` for row y of the full resolution, and writes them to `row` as x,
/// y, z of one vector per pixel. Each is a mean of four coarse pixels, in which those with a similar position
/// and normal have more weight. w is taken from `fourth`; without it, w is 1, or 0 where no coarse pixel has
/// a value.
void interpolate(const LightGuide& fine, const LightGuide& coarse, int y, const CoarseValues& from,
                 const float* fourth, Eigen::Vector4f* row);

}  // namespace offstage::render
