#pragma once
/// Private: averages the noise of traced light over neighbouring pixels of the same surface: an edge-avoiding
/// a-trous filter (H. Dammertz et al., 2010), guided by normals and positions, and for the light from all
/// around by the hit distances (the error bound of G. Ward et al., "A Ray Tracing Solution for Diffuse
/// Interreflection", 1988), so that dark corners stay narrow.

#include <array>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "render/lanes.h"

namespace offstage::render {

/// A picture of numbers with empty margins at the sides, so that filters need not check for them.
class LightPlane {
 public:
  static constexpr int kMargin = 32;  ///< pixels; at least the largest step plus a vector

  LightPlane() = default;
  LightPlane(int width_px, int height_px)
      : stride_(width_px + 2 * kMargin),
        values_(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(height_px)) {}
  float* at(int x, int y) { return &values_[index(x, y)]; }
  const float* at(int x, int y) const { return &values_[index(x, y)]; }
  /// Eight pixels from x on.
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

/// How noisy light is in each part of a picture.
class LightNoise {
 public:
  static constexpr int kBlock = 8;  ///< pixels; side of a part
  /// `brightness`: of the light that one ray found, for each pixel with a surface.
  LightNoise(const LightGuide& guide, const LightPlane& brightness);
  /// Variance over the square of the mean, in the block of a pixel and its neighbours.
  float relative_variance(int x, int y) const;

 private:
  struct Sums {
    float count = 0, value = 0, square = 0;
  };
  Sums& at(int column, int row) { return sums_[static_cast<std::size_t>(row * columns_ + column)]; }
  const Sums& at(int column, int row) const {
    return sums_[static_cast<std::size_t>(row * columns_ + column)];
  }

  int columns_, rows_;
  std::vector<Sums> sums_;
};

/// The surfaces in a picture, which say how far light may be averaged.
struct LightGuide {
  LightGuide(int width_px, int height_px);
  /// From 1 / (distance that a ray went), for each pixel, computes 1 / distance^2 over which light may be
  /// averaged: a fraction of the mean distance around. `noisy_reach2` is that of further steps, which only
  /// noisy light needs: light whose variance exceeds the square of its mean. Both are means of the
  /// neighbourhood, since a single ray says little.
  void find_reach(const LightPlane& inverse_distance, const LightNoise& noise, LightPlane& reach2,
                  LightPlane& noisy_reach2) const;

  /// For eight pixels from x on, the fraction of the 25 pixels around each that have a similar place and
  /// normal.
  Lanes similar_around(int x, int y) const;

  int width_px, height_px;
  std::array<LightPlane, 3> place, normal;
  LightPlane filled;         ///< 1: a surface is visible, 0: not
  LightPlane inverse_size2;  ///< 1 / (width of a pixel on the surface)^2 [1/m^2]
};

/// Values of light at the pixels of a picture, whose surfaces a LightGuide describes.
class LightValues {
 public:
  LightValues() = default;
  /// `channels`: 1, 3 or 4.
  LightValues(int width_px, int height_px, std::size_t channels);
  std::span<LightPlane> channels() { return values_; }
  std::span<const LightPlane> channels() const { return values_; }

  /// Averages over 3x3 pixels that are `step` apart; repeated with 1, 2, 4 ... it has a wide, smooth kernel.
  /// Only pixels where `filled` is 1 are read and changed. `reach2`: 1 / distance^2 over which the values may
  /// vary; null: any. Where all values around are equal, nothing is computed.
  void average(const LightGuide& guide, const LightPlane& filled, const LightPlane* reach2, int step);

 private:
  class Averaging;
  std::vector<LightPlane> values_, next_;
  /// For each run of pixels and each channel: the value if all pixels of the run have the same one, else NaN.
  std::vector<float> even_;
};

/// The pixels whose light a sparse picture leaves out.
enum class Gaps {
  half,            ///< every other one, as on a chessboard
  three_quarters,  ///< all in odd rows and columns
};
/// Whether a pixel is a gap. A pixel without a visible neighbour to take its light from is none.
bool is_gap(Gaps gaps, const LightGuide& guide, int x, int y);
/// Sets the values of gaps to means of four neighbours, above all of those with a similar place and normal.
void fill_gaps(Gaps gaps, const LightGuide& guide, std::span<LightPlane* const> planes);

/// Values at half the size, and where they are present.
struct CoarseValues {
  const LightValues* values;
  const LightPlane* filled;
};

/// Writes four values for each of the pixels of row y at full size: three channels, interpolated between
/// those of four coarse pixels with a similar place and normal, and 1, or four zeros where none is present.
/// The fourth one is replaced by `fourth` if not null. Rows of the result have no margins.
void interpolate(const LightGuide& fine, const LightGuide& coarse, int y, const CoarseValues& from,
                 const LightPlane* fourth, Eigen::Vector4f* row);

}  // namespace offstage::render
