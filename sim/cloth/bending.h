#pragma once
/// Bending of a cloth as a thin plate: energy B/2 times the integral of |H x - n b0|^2 over the unstrained
/// cloth, where H x are the second derivatives of the points along the cloth, n is the normal and b0 the
/// curvature at rest. For a sheet that bends without stretching, |H x| is its curvature. B is then the
/// flexural rigidity [N m].
///
/// The gradient at a point is computed from a quadratic polynomial fitted to the point and its neighbours,
/// unfolded into a plane. Second derivatives on a triangle are the derivatives of the linear interpolation of
/// the gradients at its corners. Both are exact for quadratic shapes on every triangulation. (Angles at edges
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
  /// Sets the triangles of a cloth and computes its bending. `rigidity` B [N m]; 0: no bending. `damping`:
  /// time tau [s]; the moment is B (kappa + tau d kappa/dt). `rest_fraction`: fraction of the curvature of
  /// `rest` that is free of stress, 0 to 1; with 0 the cloth tends to be flat. After a cloth has torn, only
  /// the surroundings of the tears are computed again. Triangles stay clamped until set_clamps(). `measures`:
  /// whether curvature() is needed even if the rigidity is 0.
  void assign(std::span<const Vec3> rest, std::span<const Triangle> triangles, std::span<const Real> masses,
              Real rigidity, Real damping, Real rest_fraction, bool measures = false);
  /// Whether nothing resists bending, because the rigidity is 0.
  bool empty() const { return rigidity_ == 0 || patches_.empty(); }
  Real damping() const { return damping_; }

  /// Sets the clamped triangles, which do not bend: the same body holds all of their corners. `clamp`: by
  /// point, the number of the body that holds it; 0: none.
  void set_clamps(std::span<const uint32_t> clamp);

  /// Upper bound of the eigenvalues of M^-1 K [1/s^2].
  Real fastest() const { return fastest_; }
  /// Energy [J].
  Real energy(std::span<const Vec4> x) const;
  /// Adds scale times the bending forces at x to f. The points are numbered within the cloth, from 0.
  void add_forces(std::span<const Vec4> x, Real scale, std::span<Vec4> f) const;
  /// Adds the bending forces at x, and the damping forces at the velocities rate v, to f.
  void add_damped_forces(std::span<const Vec4> x, std::span<const Vec4> v, Real rate, std::span<Vec4> f);
  /// Adds scale K p to y, where K is the Hessian of the energy without the curvature at rest.
  void multiply(std::span<const Vec4> p, Real scale, std::span<Vec4> y) const;
  /// Returns the factor d [N/m] of the diagonal block of K for a point, which is d times the 3 x 3 unit
  /// matrix.
  Real diagonal(uint32_t point) const { return diagonal_[point]; }

  /// Number of patches, on which curvature is measured. Each triangle has two (see TrianglePatches).
  std::size_t patch_count() const { return patches_.size(); }
  /// Curvature of a patch in excess of its curvature at rest, |H x - n b0| [1/m].
  Real curvature(std::size_t patch, std::span<const Vec4> x) const;
  /// Appends the derivatives of curvature() with respect to the points, as pairs of point and derivative
  /// [1/m^2]. Their sum, and their moment about any point, are zero.
  void add_gradient(std::size_t patch, std::span<const Vec4> x,
                    std::vector<std::pair<uint32_t, Vec4>>& gradient) const;

  /// Replaces explicit displacements `moves` by the displacements y of backward Euler: (M + stiff K) y = M
  /// moves. Points with the inverse mass 0 keep theirs. The system is solved by conjugate gradients. If these
  /// would take many iterations, it is solved by a factorisation, which is kept for the next step. Returns
  /// false if the limit of iterations was reached.
  bool filter(std::span<const Real> masses, std::span<const Real> inverse_masses, Real stiff,
              std::span<Vec4> moves);

 private:
  /// Second derivatives xx, yy and sqrt(2) xy on a triangle, as weights of points.
  struct Patch {
    uint32_t triangle = 0;
    uint32_t first = 0, count = 0;  // range in points_ and weights_
    Real area = 0;
    Vec3 rest = Vec3::Zero();  // unstressed curvature
    Real divisor = 1;          // see TrianglePatch
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
  std::vector<uint8_t> clamped_;  // by triangle
  std::vector<Patch> patches_;
  std::vector<uint32_t> points_;
  std::vector<Vec3> weights_;
  std::vector<std::size_t> row_;  // start of each row of the matrix, and the end
  std::vector<uint32_t> column_;
  std::vector<Real> value_;               // elements off the diagonal; with the diagonal, each row sums to 0
  std::vector<Real> diagonal_, row_sum_;  // row_sum_: sum of absolute values in each row
  /// The entries above the diagonal. Each pair of points gets opposite forces, so these entries are
  /// sufficient. multiply() takes as long as reading them from memory.
  std::vector<std::size_t> upper_row_;  // start of each row, and the end
  std::vector<uint32_t> upper_column_;
  std::vector<Real> upper_value_;
  std::vector<Vec4> residual_, direction_, image_;
  /// Factor of M + stiff K without the rows of points that do not move.
  using Factor = Eigen::SimplicialLDLT<Eigen::SparseMatrix<Real>>;
  std::shared_ptr<Factor> factor_;
  float factor_stiff_ = 0;
  std::vector<Real> factor_masses_;  // inverse masses
};

}  // namespace offstage::sim
