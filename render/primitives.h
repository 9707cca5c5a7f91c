#pragma once
/// Creates meshes of primitive shapes with normals and texture coordinates. Shapes are centred at the origin,
/// and their axes of revolution are along Y. Lengths are in metres. A texture covers each side of a box, the
/// profile of a body of revolution, or the ground once; it is upright on surfaces that face sideways.

#include "render/model.h"

namespace offstage::render {

Mesh make_sphere(float radius, int segments = 48);
/// Returns a box. `bevel`: radius of rounded edges [m], which reflect light as edges of real objects do; 0:
/// sharp edges.
Mesh make_box(const Vector3f& size, float bevel = 0);
/// Returns a capsule. `height`: distance between the centres of the caps [m].
Mesh make_capsule(float radius, float height, int segments = 48);
Mesh make_cylinder(float radius, float height, int segments = 64);
/// Returns a cone with its base at -height/2 and its apex at +height/2.
Mesh make_cone(float radius, float height, int segments = 64);
/// Returns a cone with its tip cut off: the base is at -height/2, the top at +height/2.
Mesh make_frustum(float radius, float top_radius, float height, int segments = 64);
/// Returns an ellipsoid. `radii`: half axes along x, y and z [m].
Mesh make_ellipsoid(const Vector3f& radii, int segments = 48);
/// Returns a torus. `radius`: distance of the tube's centre line from the axis [m].
Mesh make_torus(float radius, float tube_radius, int segments = 72);
/// Returns a hollow cylinder, open at both ends; `radius` is the outer radius.
Mesh make_tube(float radius, float height, float thickness, int segments = 64);
/// Returns a cuboid without its top at +Y; `size` is the outer size.
Mesh make_open_box(const Vector3f& size, float thickness);
/// Creates a square in the plane y = 0, facing +Y. Its cells get finer towards the centre, so that distant
/// ground is cheap. It represents an infinite plane (see Mesh::endless).
Mesh make_ground(float half_size);

}  // namespace offstage::render
