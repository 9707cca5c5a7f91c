#pragma once
/// Private: computes the optical depth of smoke between the sun and a point. The opacity of puffs is
/// deposited in a coarse grid whose Z axis points away from the sun. Sums along Z are the optical depth, as
/// in deep opacity maps (Yuksel and Keyser, 2008). The transmittance is exp(-depth).

#include <array>
#include <span>
#include <vector>

#include <Eigen/Geometry>

namespace offstage::render {

using Eigen::Vector3f;

/// Returns the fraction of sunlight that arrives at an optical depth in smoke with the reflectance `albedo`.
/// It is the sum of light that was scattered once, a few times and many times.
float sun_fraction_in_smoke(float depth, float albedo);

class OpacityGrid {
 public:
  struct Absorber {
    Vector3f position;
    float radius;   ///< radius over which the absorber is spread [m]
    float section;  ///< optical depth times area of an absorber [m^2]
  };
  /// Builds the grid. `away` is the unit direction in which the light travels. Clears the grid if there are
  /// no absorbers.
  void build(std::span<const Absorber> absorbers, const Vector3f& away);

  bool empty() const { return sums_.empty(); }
  /// Returns the optical depth between the sun and a point, at least 0.
  float depth(const Vector3f& place) const;
  /// Returns the optical depth per metre.
  float density(const Vector3f& place) const;
  float cell_m() const { return cell_; }

 private:
  void fit(std::span<const Absorber> absorbers, const Vector3f& away);
  void deposit(const Vector3f& place, float depth);
  float trilinear(const std::vector<float>& values, int slices, Vector3f cell_place) const;
  Vector3f local(const Vector3f& place) const { return axes_ * (place - origin_) / cell_; }

  Eigen::Matrix3f axes_ = Eigen::Matrix3f::Identity();  ///< light space from world
  Vector3f origin_ = Vector3f::Zero();                  ///< position of the grid's first corner in the world
  float cell_ = 1;
  int nx_ = 0, ny_ = 0, nz_ = 0;
  std::vector<float> amounts_, sums_;
};

}  // namespace offstage::render
