#include "sim/geometry/mass_properties.h"

#include <algorithm>
#include <numbers>
#include <stdexcept>

#include <Eigen/Eigenvalues>
#include <oneapi/tbb/parallel_for.h>

namespace offstage::sim {
namespace {

/// Integrals of 1, x and x x^T over a solid.
struct Moments {
  Real volume = 0;
  Vec3 first = Vec3::Zero();
  Mat3 second = Mat3::Zero();

  Moments& operator+=(const Moments& m) {
    volume += m.volume;
    first += m.first;
    second += m.second;
    return *this;
  }
};

/// Sums the signed tetrahedra that some triangles span with `origin`. A tetrahedron (0, a, b, c) with D =
/// a.(b x c) and s = a + b + c has the volume D/6, the first moment D s/24 and the second moment D (aa' + bb'
/// + cc' + ss')/120.
Moments tetrahedra(const TriangleMesh& mesh, const Vec3& origin, std::size_t begin, std::size_t end) {
  Moments sum;
  for (std::size_t i = begin; i < end; ++i) {
    const Triangle& t = mesh.triangles[i];
    const Vec3 a = mesh.vertices[t[0]] - origin, b = mesh.vertices[t[1]] - origin,
               c = mesh.vertices[t[2]] - origin;
    const Vec3 s = a + b + c;
    const Real det = a.dot(b.cross(c));
    sum.volume += det;
    sum.first += det * s;
    sum.second += det * (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose());
  }
  return {sum.volume / 6, sum.first / 24, sum.second / 120};
}

Vec3 middle(const TriangleMesh& mesh) {
  Aabb box;
  for (const Vec3& v : mesh.vertices) box.extend(v);
  return mesh.vertices.empty() ? Vec3::Zero() : Vec3(box.center());
}

Mat3 diagonal(Real x, Real y, Real z) {
  return Vec3(x, y, z).asDiagonal();
}

MassProperties closed_form(const Sphere& s) {
  const Real volume = 4.0 / 3 * std::numbers::pi * s.radius * s.radius * s.radius;
  const Real i = 0.4 * volume * s.radius * s.radius;
  return {volume, Vec3::Zero(), diagonal(i, i, i)};
}

MassProperties closed_form(const Box& b) {
  const Real volume = b.size.prod();
  const Vec3 q = b.size.cwiseAbs2() * (volume / 12);
  return {volume, Vec3::Zero(), diagonal(q.y() + q.z(), q.z() + q.x(), q.x() + q.y())};
}

MassProperties closed_form(const Cylinder& c) {
  const Real r2 = c.radius * c.radius, volume = std::numbers::pi * r2 * c.height;
  const Real across = volume * (3 * r2 + c.height * c.height) / 12;
  return {volume, Vec3::Zero(), diagonal(across, volume * r2 / 2, across)};
}

/// Adds a cylinder and two hemispheres, whose centroids are 3r/8 beyond the centres of the caps.
MassProperties closed_form(const Capsule& c) {
  const Real r = c.radius, h = c.height;
  const MassProperties side = closed_form(Cylinder{r, h}), ball = closed_form(Sphere{r});
  const Real across = side.inertia(0, 0) + ball.inertia(0, 0) + ball.volume * (h * h / 4 + 3 * h * r / 8);
  const Real along = side.inertia(1, 1) + ball.inertia(1, 1);
  return {side.volume + ball.volume, Vec3::Zero(), diagonal(across, along, across)};
}

/// Uses the centroid of a cone, which is a quarter of the height above the base.
MassProperties closed_form(const Cone& c) {
  const Real r2 = c.radius * c.radius, volume = std::numbers::pi * r2 * c.height / 3;
  const Real across = volume * 3 * (4 * r2 + c.height * c.height) / 80;
  return {volume, Vec3(0, -c.height / 4, 0), diagonal(across, volume * 3 * r2 / 10, across)};
}

/// Integrates over the discs of a frustum. The disc at the height s h above the base has the radius R + (r -
/// R) s, so the integrals are polynomials of both radii.
MassProperties closed_form(const Frustum& c) {
  const Real R = c.radius, r = c.top_radius, h = c.height, pi = std::numbers::pi;
  const Real area = (R * R + R * r + r * r) / 3, volume = pi * h * area;
  const Real above_base = h * (R * R + 2 * R * r + 3 * r * r) / (12 * area);
  const Real fourth = (R * R * R * R + R * R * R * r + R * R * r * r + R * r * r * r + r * r * r * r) / 5;
  const Real along = pi * h * fourth / 2;
  const Real second = pi * h * h * h * (R * R / 30 + R * r / 10 + r * r / 5);
  const Real across = along / 2 + second - volume * above_base * above_base;
  return {volume, Vec3(0, above_base - h / 2, 0), diagonal(across, along, across)};
}

MassProperties closed_form(const Ellipsoid& e) {
  const Real volume = 4.0 / 3 * std::numbers::pi * e.radii.prod();
  const Vec3 q = e.radii.cwiseAbs2() * (volume / 5);
  return {volume, Vec3::Zero(), diagonal(q.y() + q.z(), q.z() + q.x(), q.x() + q.y())};
}

MassProperties closed_form(const Plane&) {
  return {};
}

MassProperties closed_form(const MeshShape&) {
  throw std::invalid_argument("mass_properties: a mesh shape needs its mesh");
}

}  // namespace

MassProperties mass_properties(const TriangleMesh& mesh) {
  // Blocks of fixed size are summed in order, for the same bits with any number of threads.
  constexpr std::size_t kBlock = 8192;
  const std::size_t count = mesh.triangles.size();
  const Vec3 origin = middle(mesh);
  std::vector<Moments> partial((count + kBlock - 1) / kBlock);
  tbb::parallel_for(std::size_t{0}, partial.size(), [&](std::size_t k) {
    partial[k] = tetrahedra(mesh, origin, k * kBlock, std::min(count, (k + 1) * kBlock));
  });
  Moments sum;
  for (const Moments& m : partial) sum += m;

  MassProperties out;
  out.volume = sum.volume;
  if (sum.volume == 0) return out;
  const Vec3 c = sum.first / sum.volume;
  const Mat3 central = sum.second - sum.volume * c * c.transpose();
  out.centre = origin + c;
  out.inertia = central.trace() * Mat3::Identity() - central;
  return out;
}

MassProperties mass_properties(const Shape& primitive) {
  return std::visit([](const auto& shape) { return closed_form(shape); }, primitive);
}

PrincipalInertia diagonalise(const Mat3& inertia) {
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(inertia);
  Mat3 axes = solver.eigenvectors();
  if (axes.determinant() < 0) axes.col(2) = -axes.col(2);
  return {solver.eigenvalues(), Quat(axes).normalized()};
}

}  // namespace offstage::sim
