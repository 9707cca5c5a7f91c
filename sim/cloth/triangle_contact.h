#pragma once
/// Contact of a point within a cloth triangle with a body.

#include <array>
#include <vector>

#include "sim/cloth/cloth_bodies.h"
#include "sim/cloth/cloth_contacts.h"
#include "sim/cloth/cloth_points.h"

namespace offstage::sim {

/// Distance that points within triangles keep from bodies, as a fraction of the cloth's thickness. Vertices
/// keep the whole thickness, so flat parts of bodies touch only vertices.
inline constexpr Real kTriangleDistance = 0.5;

struct TriangleContact {
  std::array<Real, 3> weights;  ///< weights of the triangle's corners
  Vec3 on_body;                 ///< contact point on the body at the end of the sub-step, world [m]
  Vec3 normal;                  ///< unit normal from the body to the triangle
  /// Distance of the point from the body minus the required distance [m]; negative in contact.
  Real gap;
};

/// Separates the triangle's points and the body in a sub-step of the cloth of length dt [s], with Coulomb
/// friction. An overlap at the start is removed slowly and without adding velocity: that part of the
/// displacements is appended to `cuts`.
void separate(const TriangleContact& contact, const Triangle& t, ClothPoints& points, ClothBody& body,
              Real dt, std::vector<VelocityCut>& cuts);

}  // namespace offstage::sim
