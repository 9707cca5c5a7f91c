#pragma once
/// The distance and the penetration depth of convex polyhedra by brute force over all pairs of features: a
/// reference for GJK, V-Clip and EPA. The cost is quadratic in the number of edges; there is no iteration
/// that could fail to converge.

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "sim/collision/separation.h"
#include "sim/geometry/convex_polyhedron.h"

namespace offstage::sim {

class ConvexOracle {
 public:
  ConvexOracle(const ConvexPolyhedron& a, const ConvexPolyhedron& b, const Pose& a_from_b)
      : a_(a, {}), b_(b, a_from_b), scale_(a.reach() + b.reach() + a_from_b.position.norm()) {}

  /// Returns the signed distance and the normal, as gjk() and vclip() do. Closest points are given only for
  /// separate solids, because deepest points are not unique.
  Separation signed_distance() {
    for (const Vec3& n : a_.normals) separate(n);
    for (const Vec3& n : b_.normals) separate(n);
    if (!(axis_.distance > 0)) separate_by_edges();
    // For coplanar flat solids and for touching solids the separating axis has the distance zero. The
    // distances of the features then give the result.
    if (std::isfinite(axis_.distance) && axis_.distance < -1e-13 * scale_) return axis_;
    vertices_to_faces(a_, b_, 1);
    vertices_to_faces(b_, a_, -1);
    vertices_to_edges(a_, b_, 1);
    vertices_to_edges(b_, a_, -1);
    edges_to_edges();
    return closest_;
  }

 private:
  /// A polyhedron transformed to A's frame.
  struct Placed {
    Placed(const ConvexPolyhedron& p, const Pose& pose) : shape(p) {
      const Mat3 R = pose.orientation.normalized().toRotationMatrix();
      for (const Vec3& v : p.vertices()) vertices.push_back(R * v + pose.position);
      for (uint32_t f = 0; f < p.face_count(); ++f) normals.push_back(R * p.plane(f).normal);
    }
    Vec3 along(const ConvexPolyhedron::Edge& e) const { return vertices[e.head] - vertices[e.tail]; }

    const ConvexPolyhedron& shape;
    std::vector<Vec3> vertices, normals;
  };

  /// Tests an axis in both directions; keeps the separation along it if it is the largest so far.
  void separate(const Vec3& axis) {
    for (const Vec3& n : {axis, Vec3(-axis)}) {
      Real low = std::numeric_limits<Real>::infinity(), high = -low;
      for (const Vec3& v : b_.vertices) high = std::max(high, n.dot(v));
      for (const Vec3& v : a_.vertices) {
        low = std::min(low, n.dot(v));
        if (low - high <= axis_.distance) break;
      }
      if (low - high > axis_.distance) {
        axis_.distance = low - high;
        axis_.normal = n;
      }
    }
  }

  /// Tries the cross products of all pairs of non-parallel edges until one separates the solids.
  void separate_by_edges() {
    for (const ConvexPolyhedron::Edge& e : a_.shape.edges())
      for (const ConvexPolyhedron::Edge& f : b_.shape.edges()) {
        const Vec3 n = a_.along(e).normalized().cross(b_.along(f).normalized());
        if (n.norm() > 1e-9) separate(n.normalized());
        if (axis_.distance > 0) return;
      }
  }

  /// Keeps the pair of a point p of one solid and a point q of the other if it is the closest so far; `sign`
  /// is -1 if p belongs to B.
  void keep(const Vec3& p, const Vec3& q, Real sign) {
    const Real distance = (p - q).norm();
    if (distance >= closest_.distance) return;
    closest_.distance = distance;
    closest_.on_a = sign > 0 ? p : q;
    closest_.on_b = sign > 0 ? q : p;
    if (distance > 0) closest_.normal = sign * (p - q) / distance;
  }

  void vertices_to_faces(const Placed& one, const Placed& other, Real sign) {
    for (const Vec3& v : one.vertices)
      for (uint32_t f = 0; f < other.shape.face_count(); ++f) {
        const Vec3& n = other.normals[f];
        const std::span<const uint32_t> loop = other.shape.face_vertices(f);
        bool over = true;
        for (std::size_t k = 0; k < loop.size() && over; ++k) {
          const Vec3 &p = other.vertices[loop[k]], &q = other.vertices[loop[(k + 1) % loop.size()]];
          over = n.cross(q - p).dot(v - p) >= 0;
        }
        if (over) keep(v, v - n.dot(v - other.vertices[loop[0]]) * n, sign);
      }
  }

  static Vec3 nearest_on_segment(const Vec3& x, const Vec3& p, const Vec3& q) {
    const Vec3 u = q - p;
    return p + std::clamp((x - p).dot(u) / u.squaredNorm(), 0.0, 1.0) * u;
  }

  /// Distances of vertices to edges and to vertices.
  void vertices_to_edges(const Placed& one, const Placed& other, Real sign) {
    for (const Vec3& v : one.vertices) {
      for (const Vec3& w : other.vertices) keep(v, w, sign);
      for (const ConvexPolyhedron::Edge& e : other.shape.edges())
        keep(v, nearest_on_segment(v, other.vertices[e.tail], other.vertices[e.head]), sign);
    }
  }

  /// Distances of edges to edges, at the feet of their common perpendicular.
  void edges_to_edges() {
    for (const ConvexPolyhedron::Edge& e : a_.shape.edges())
      for (const ConvexPolyhedron::Edge& f : b_.shape.edges()) {
        const Vec3 &p = a_.vertices[e.tail], &q = b_.vertices[f.tail];
        const Vec3 u = a_.along(e), w = b_.along(f), m = u.cross(w);
        if (m.squaredNorm() <= 1e-24 * u.squaredNorm() * w.squaredNorm()) continue;
        const Real t = w.cross(m).dot(q - p) / m.squaredNorm();
        if (t < 0 || t > 1) continue;
        const Vec3 on_a = p + t * u;
        keep(on_a, nearest_on_segment(on_a, q, q + w), 1);
      }
  }

  Placed a_, b_;
  Real scale_;  ///< size of the coordinates, to which rounding is relative [m]
  Separation axis_{.distance = -std::numeric_limits<Real>::infinity()};
  Separation closest_{.distance = std::numeric_limits<Real>::infinity()};
};

/// Returns the exact signed distance of two convex polyhedra.
inline Separation brute_force_separation(const ConvexPolyhedron& a, const ConvexPolyhedron& b,
                                         const Pose& a_from_b) {
  return ConvexOracle(a, b, a_from_b).signed_distance();
}

}  // namespace offstage::sim
