#pragma once
/// A contact of a place within a triangle of cloth with a body.

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
  /// Distance of the place from the body, minus the distance that it must keep [m]; negative.
  Real gap;
};

/// Moves the triangle's points and the body apart in a sub-step of cloth of length dt, with Coulomb friction.
/// An initial overlap is removed slowly, and without a velocity. Appends to `cuts`.
void separate(const TriangleContact& contact, const Triangle& t, ClothPoints& points, ClothBody& body,
              Real dt, std::vector<VelocityCut>& cuts);

}  // namespace offstage::sim
