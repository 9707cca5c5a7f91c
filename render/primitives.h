#pragma once
/// Creates meshes of the primitive shapes: centred, axes of revolution along Y, with normals and texture
/// coordinates.

#include "render/model.h"

namespace offstage::render {

Mesh make_sphere(float radius, int segments = 48);
/// `bevel`: radius that rounds the edges [m], so that they catch light; 0 leaves them sharp.
Mesh make_box(const Vector3f& size, float bevel = 0);
/// `height`: distance between the centres of the caps.
Mesh make_capsule(float radius, float height, int segments = 48);
Mesh make_cylinder(float radius, float height, int segments = 64);
/// The base is at -height/2, the apex at +height/2.
Mesh make_cone(float radius, float height, int segments = 64);
/// Creates a square in the plane y = 0, facing +Y. Its cells get finer towards the centre, so that distant
/// ground is cheap. It represents an infinite plane (see Mesh::endless).
Mesh make_ground(float half_size);

}  // namespace offstage::render
