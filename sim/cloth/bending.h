#pragma once
/// Bending of a cloth as a thin plate: energy B/2 times the integral of |H x - n b0|^2 over the unstrained
/// cloth, where H x are the second derivatives of the points along the cloth, n is the normal and b0 the
/// curvature at rest. Of a sheet that bends without stretching, |H x| is its curvature, so that B is the
/// flexural rigidity [N m].
///
/// The gradient at a point is that of the quadratic polynomial nearest to the point and its neighbours,
/// unfolded into a plane. Second derivatives on a triangle are those of the linear function between the
/// gradients at its corners. Both are exact for quadratic shapes on every triangulation. (Angles at edges
/// alone, as in discrete shells, depend on the mesh: Grinspun et al., "Computing Discrete Shape Operators on
/// General Meshes", 2006.) The energy is quadratic in the points, as in Bergou et al., "A Quadratic Bending
/// Model for Inextensible Surfaces", 2006; its matrix is the same for x, y and z, and constant.

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/SparseCholesky>

#include "sim/cloth/cloth_points.h"

namespace offstage::sim {

class ClothBending {
 public:
  /// `rigidity` B [N m]; 0: no bending. `damping`: time tau [s]; the moment is B (kappa + tau d kappa/dt).
  /// `rest_fraction` of the curvature of `rest` is unstressed; the remainder is as if the cloth had been
  /// flat. Of a cloth that tore, which has other corners of triangles and more points, only the surroundings
  /// of the tears are computed again. Triangles that were clamped stay so until set_clamps(). `measures`: the
  /// curvature can be measured even if there is no rigidity.
  void assign(std::span<const Vec3> rest, std::span<const Triangle> triangles, std::span<const Real> masses,
              Real rigidity, Real damping, Real rest_fraction, bool measures = false);
  /// Whether nothing resists bending, because the rigidity is 0.
  bool empty() const { return rigidity_ == 0 || patches_.empty(); }
  Real damping() const { return damping_; }

  /// Triangles with all corners held by the same body do not bend: they are clamped. `clamp` is a number of
  /// each point; equal numbers other than 0 are one body.
  void set_clamps(std::span<const uint32_t> clamp);

  /// Upper bound of the eigenvalues of M^-1 K [1/s^2].
  Real fastest() const { return fastest_; }
  /// Energy [J].
  Real energy(std::span<const Vec4> x) const;
  /// Adds scale times the bending forces at x to f. The points are numbered within the cloth, from 0.
  void add_forces(std::span<const Vec4> x, Real scale, std::span<Vec4> f) const;
  /// Adds the bending forces at x, and the damping forces at the velocities v, to f.
  void add_damped_forces(std::span<const Vec4> x, std::span<const Vec4> v, std::span<Vec4> f);
  /// Adds scale K p to y: K is the Hessian of the energy without the curvature at rest.
  void multiply(std::span<const Vec4> p, Real scale, std::span<Vec4> y) const;
  /// The 3 x 3 block of K for a point is this number [N/m] times the unit matrix.
  Real diagonal(uint32_t point) const { return diagonal_[point]; }

  /// The curvature is measured by patches, two to a triangle: one measures the surroundings as a smooth
  /// surface; the other measures shapes that alternate from point to point, which the first misses, and
  /// counts half.
  std::size_t patch_count() const { return patches_.size(); }
  /// Curvature of a patch beyond that at rest, |H x - n b0| [1/m].
  Real curvature(std::size_t patch, std::span<const Vec4> x) const;
  /// Appends the gradient of curvature() by the points. Its sum, and its moment about any point, are zero.
  void add_gradient(std::size_t patch, std::span<const Vec4> x,
                    std::vector<std::pair<uint32_t, Vec4>>& gradient) const;

  /// Solves (M + stiff K) moves = M moves, which turns explicit moves into those of backward Euler. Those of
  /// points without an inverse mass stay. By conjugate gradients, or by a factorisation, which is kept for
  /// the next step, if they would take many iterations. Returns false if they reached the limit of
  /// iterations.
  bool filter(std::span<const Real> masses, std::span<const Real> inverse_masses, Real stiff,
              std::span<Vec4> moves);

 private:
  /// Second derivatives xx, yy and sqrt(2) xy on a triangle, as weights of points.
  struct Patch {
    uint32_t triangle = 0;
    uint32_t first = 0, count = 0;  // of points_ and weights_
    Real area = 0;
    Vec3 rest = Vec3::Zero();  // unstressed curvature
    bool rough = false;        // by jumps of gradients
  };

  std::vector<uint8_t> affected(std::span<const uint8_t> changed, std::vector<uint8_t> near) const;
  void build(std::span<const uint8_t> changed, std::vector<uint8_t> moved_corners);
  void add_patch(Patch patch, std::span<const uint32_t> points, std::span<const Vec3> weights);
  void build_matrix(std::span<const uint8_t> rows);
  void factorize(std::span<const Real> masses, std::span<const Real> inverse_masses, Real stiff);
  void filter_directly(std::span<const Real> inverse_masses, std::span<Vec4> moves);
  Mat3 excess_curvature(const Patch& patch, std::span<const Vec4> x, const Vec3& normal) const;
  void add_rest_forces(std::span<const Vec4> x, Real scale, std::span<Vec4> f) const;

  Real rigidity_ = 0, damping_ = 0, rest_fraction_ = 1, fastest_ = 0;
  bool curved_ = false, measures_ = false;
  std::vector<Triangle> triangles_;
  std::vector<Real> masses_;
  std::vector<Vec3> rest_;
  std::vector<uint8_t> clamped_;  // of each triangle
  std::vector<Patch> patches_;
  std::vector<uint32_t> points_;
  std::vector<Vec3> weights_;
  std::vector<std::size_t> row_;  // of the matrix, and the end
  std::vector<uint32_t> column_;
  std::vector<Real> value_;               // off the diagonal; rows add up to zero with it
  std::vector<Real> diagonal_, row_sum_;  // the latter of absolute values, with the diagonal
  /// The entries above the diagonal. A pair of points gets opposite forces, so these suffice, and multiply()
  /// takes as long as the memory needs to deliver them.
  std::vector<std::size_t> upper_row_;  // and the end
  std::vector<uint32_t> upper_column_;
  std::vector<Real> upper_value_;
  std::vector<Vec4> residual_, direction_, image_;
  /// Factor of M + stiff K without the rows of points that do not move.
  using Factor = Eigen::SimplicialLDLT<Eigen::SparseMatrix<Real>>;
  std::shared_ptr<Factor> factor_;
  float factor_stiff_ = 0;
  std::vector<Real> factor_masses_;  // inverse
};

}  // namespace offstage::sim
