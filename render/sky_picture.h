#pragma once
/// A picture of the whole sky (equirectangular projection) as a light source and as a background.
///
/// The picture is the sum of two parts. Rays and prefiltered levels sample the dim part with little noise.
/// The bright part (the sun, windows) is a light source, whose directions are sampled in proportion to
/// luminance times solid angle. The centre of the picture is at -Z, its upper edge at +Y, and its right half
/// at +X.

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

#include "render/image.h"

namespace offstage::render {

using Eigen::Vector2f;
using Eigen::Vector3f;

/// Values over the sphere of directions, by rows from the top.
struct SkyGrid {
  int columns = 0, rows = 0;
  std::vector<Vector3f> values;

  /// Returns the value in a direction, interpolated between cells. The left and right edges adjoin.
  Vector3f at(const Vector3f& direction) const;
  Vector3f& cell(int column, int row);
  const Vector3f& cell(int column, int row) const;
  /// Returns the solid angle of the cells of a row [sr].
  float solid_angle(int row) const;
};

/// Returns a grid of this size. Each cell has the mean of the part of `grid` that it covers, weighted by
/// solid angle.
SkyGrid resampled(const SkyGrid& grid, int columns, int rows);

/// A directional light that represents the whole bright part of a sky picture.
struct SkyBeam {
  Vector3f direction = Vector3f::UnitY();
  Vector3f light = Vector3f::Zero();  ///< radiance of a white surface that faces it
  float size_deg = 0;                 ///< diameter of a disc with the same spread
};

class SkyPicture {
 public:
  static constexpr int kMostColumns =
      4096;  ///< greatest width of the visible picture; larger pictures are reduced
  static constexpr int kMostLightColumns = 1024;  ///< greatest width of the picture that gives light
  static constexpr int kLevels = 5;               ///< prefiltered for the roughness 0, 1/4 ... 1

  /// Prepares a picture. `image` must be twice as wide as high, with finite values of at least 0; otherwise
  /// throws std::invalid_argument. `blur_deg`: standard deviation of a Gaussian that blurs the background,
  /// but not the light; 0: none.
  explicit SkyPicture(const HdrImage& image, float blur_deg = 0);

  /// Returns the radiance from a unit direction, the sum of both parts.
  Vector3f seen(const Vector3f& direction) const { return unpacked_at(direction); }
  /// Returns the radiance of the dim part from a unit direction.
  Vector3f dim(const Vector3f& direction) const;
  /// Returns the radiance of the dim part that a surface with this roughness reflects. `direction`: the
  /// mirrored direction.
  Vector3f mirrored(const Vector3f& direction, float roughness) const;
  /// Light of the dim part on a white surface with normal n: constant + slope * n + n * curvature * n.
  struct Irradiance {
    Vector3f constant = Vector3f::Zero();
    Eigen::Matrix3f slope = Eigen::Matrix3f::Zero();  ///< rows: red, green, blue
    /// Symmetric matrices with the trace 0.
    std::array<Eigen::Matrix3f, 3> curvature = {Eigen::Matrix3f::Zero(), Eigen::Matrix3f::Zero(),
                                                Eigen::Matrix3f::Zero()};
  };
  const Irradiance& irradiance() const { return irradiance_; }

  bool has_bright_part() const { return bright_total_ > 0; }
  /// Returns the fraction of the luminance from a direction that belongs to the bright part.
  float bright_fraction(const Vector3f& direction) const;
  /// Returns the probability density of sample() [1/sr].
  float density(const Vector3f& direction) const;
  struct Sample {
    Vector3f direction;
    Vector3f light;  ///< radiance of the bright part divided by the density
  };
  /// Maps a point of the unit square to a direction in the bright part. Points with a uniform distribution
  /// give directions with the distribution density().
  Sample sample(const Vector2f& uv) const;
  const SkyBeam& beam() const { return beam_; }  ///< the bright part as a whole

  /// A picture in the format GL_RGB9_E5.
  struct Packed {
    int columns = 0, rows = 0;
    std::vector<uint32_t> values;
  };
  /// Returns the background: the picture that seen() reads with its reduced levels, or only the blurred
  /// picture if there is a blur.
  const std::vector<Packed>& background() const { return background_; }
  std::vector<Packed> levels() const;  ///< prefiltered, as mirrored() reads them

 private:
  Vector3f unpacked_at(const Vector3f& direction) const;
  void split();
  void find_beam();
  void find_irradiance();
  void prefilter();

  Packed sharp_;
  std::vector<Packed> background_;
  SkyGrid light_;                ///< radiance of both parts together
  std::vector<float> fraction_;  ///< fraction of the bright part in each cell of light_
  std::vector<float> row_sum_;   ///< sum of luminance * solid angle of the bright part, up to each row
  /// Sums of luminance * solid angle of the bright part within each row, up to each cell.
  std::vector<float> sums_;
  float bright_total_ = 0;
  SkyBeam beam_;
  Irradiance irradiance_;
  std::array<SkyGrid, kLevels> levels_;
};

/// A sky picture as a scene uses it.
struct TurnedSky {
  std::shared_ptr<const SkyPicture> picture;  ///< the picture; null: there is none
  float turn = 0;                             ///< counter-clockwise as seen from above [rad]
  float intensity = 1;

  Vector3f to_picture(const Vector3f& direction) const;
  Vector3f from_picture(const Vector3f& direction) const;
  /// Returns the light of the dim part as the weights of the nine functions of sky_irradiance().
  std::array<Vector3f, 9> irradiance() const;
  SkyBeam beam() const;
};

}  // namespace offstage::render
