#pragma once
/// Meshes of the primitive shapes, centred, axes of revolution along Y, with normals and texture coordinates.

#include "render/model.h"

namespace offstage::render {

Mesh make_sphere(float radius, int segments = 48);
/// `bevel` rounds the edges by that radius: a sharp box looks like a diagram.
Mesh make_box(const Vector3f& size, float bevel = 0);
/// `height` between the centres of the caps.
Mesh make_capsule(float radius, float height, int segments = 48);
Mesh make_cylinder(float radius, float height, int segments = 64);
/// Base at -height/2, apex at +height/2.
Mesh make_cone(float radius, float height, int segments = 64);
/// A square in the plane y = 0, facing +Y, finer towards its centre so that distant ground costs little. It
/// stands for an endless plane (see Mesh::endless).
Mesh make_ground(float half_size);

}  // namespace offstage::render
