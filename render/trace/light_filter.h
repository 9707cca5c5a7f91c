#pragma once
/// Private: averages the noise of traced light over neighbouring pixels of the same surface: an edge-avoiding
/// a-trous filter (H. Dammertz et al., 2010), guided by normals and positions, and for the light from all
/// around by the distance of what was met (the error bound of G. Ward et al., "A Ray Tracing Solution for
/// Diffuse Interreflection", 1988), so that dark corners stay narrow.

#include <array>
#include <vector>

#include <Eigen/Core>

namespace offstage::render {

class LightFilter {
 public:
  LightFilter(int width_px, int height_px);

  /// Makes a pixel empty: it has no value, and none is taken from it.
  void clear(int x, int y) {
    filled_[at(x, y)] = 0;
    set_values(x, y, Eigen::Vector4f::Zero());
  }
  void set_values(int x, int y, const Eigen::Vector4f& values) {
    const std::size_t k = at(x, y);
    for (std::size_t i = 0; i < 4; ++i) values_[i][k] = values[static_cast<int>(i)];
  }
  /// Sets a pixel: position, normal, distance from the eye, and the values to be averaged. `inverse_reach`:
  /// 1 / distance over which the values may vary; 0: any. Other pixels stay empty.
  void set(int x, int y, const Eigen::Vector3f& place, const Eigen::Vector3f& normal, float pixel_size_m,
           const Eigen::Vector4f& values, float inverse_reach);
  /// Averages over 3x3 pixels that are `step` apart; repeated with 1, 2, 4 ... it has a wide, smooth kernel.
  /// Where all values around are equal, nothing is computed. Only the first `channels` of the values are
  /// averaged, the others stay.
  void average(int step, std::size_t channels = 4);
  /// Spreads the reach over neighbours, since that of a single ray is noisy. Before average().
  void smooth_reach();
  Eigen::Vector4f values(int x, int y) const {
    const std::size_t k = at(x, y);
    return {values_[0][k], values_[1][k], values_[2][k], values_[3][k]};
  }

 private:
  /// Averages a part of a row, `count` pixels from x on.
  void average_run(int x, int y, int step, int count, std::size_t channels);
  void find_even_runs(std::size_t channels);
  bool is_even(int run, int y, int step) const;

  static constexpr int kMargin = 16;  ///< empty pixels at both ends of a row, at least the largest step
  using Plane = std::vector<float>;
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(stride_) +
           static_cast<std::size_t>(x + kMargin);
  }

  int width_, height_, stride_;
  std::array<Plane, 3> place_, normal_;
  Plane filled_, inverse_size2_, reach2_, mean_reach2_;
  std::array<Plane, 4> values_, next_;
  int runs_;                                 ///< number of runs of pixels in a row that are averaged together
  std::vector<Eigen::Vector4f> run_values_;  ///< value of each run whose pixels are equal, else not a number
};

}  // namespace offstage::render
