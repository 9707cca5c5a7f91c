#include "render/primitives.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace offstage::render {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

// A point of the profile of a body of revolution. Two consecutive points at the same position make a sharp
// edge.
struct ProfilePoint {
  float radius, y;
  Vector2f normal;  // (outwards, up)
};

// Revolves a profile, given from the bottom up, about the Y axis.
Mesh revolve(const std::vector<ProfilePoint>& profile, int segments) {
  float total = 0;
  std::vector<float> along(profile.size(), 0.0f);
  for (std::size_t i = 1; i < profile.size(); ++i) {
    total += std::hypot(profile[i].radius - profile[i - 1].radius, profile[i].y - profile[i - 1].y);
    along[i] = total;
  }

  Mesh mesh;
  for (std::size_t i = 0; i < profile.size(); ++i) {
    const ProfilePoint& point = profile[i];
    for (int j = 0; j <= segments; ++j) {
      // The two columns at the seam have the same bits, so the surface is closed.
      const float angle = 2 * kPi * static_cast<float>(j % segments) / static_cast<float>(segments);
      const float c = std::cos(angle), s = std::sin(angle);
      mesh.positions.emplace_back(point.radius * c, point.y, -point.radius * s);
      mesh.normals.emplace_back(point.normal.x() * c, point.normal.y(), -point.normal.x() * s);
      mesh.uvs.emplace_back(static_cast<float>(j) / static_cast<float>(segments), 1 - along[i] / total);
    }
  }
  const auto columns = static_cast<uint32_t>(segments + 1);
  for (uint32_t i = 0; i + 1 < profile.size(); ++i) {
    if (along[i] == along[i + 1]) continue;
    for (uint32_t j = 0; j + 1 < columns; ++j) {
      const uint32_t a = i * columns + j, b = a + 1, c = b + columns, d = a + columns;
      if (profile[i].radius > 0) mesh.indices.insert(mesh.indices.end(), {a, b, c});
      if (profile[i + 1].radius > 0) mesh.indices.insert(mesh.indices.end(), {a, c, d});
    }
  }
  return mesh;
}

// Appends a quarter circle: from the equator to the top (sign 1), or from the bottom to the equator (sign
// -1).
void append_cap(std::vector<ProfilePoint>& profile, float radius, float center_y, int rings, int sign) {
  for (int k = 0; k <= rings; ++k) {
    const int step = sign > 0 ? k : rings - k;
    const float angle = 0.5f * kPi * static_cast<float>(step) / static_cast<float>(rings);
    const float up = static_cast<float>(sign) * std::sin(angle);
    const float out = step == rings ? 0.0f : std::cos(angle);  // exactly zero at the pole
    profile.push_back({radius * out, center_y + radius * up, {out, up}});
  }
}

/// The directions to the right and upwards on a face of a box, as seen from outside. On the sides, up is +Y.
/// The top and the bottom are seen from the front, so up is -Z on the top and +Z on the bottom.
struct FaceAxes {
  explicit FaceAxes(const Vector3f& normal)
      : up(normal.y() == 0 ? Vector3f(Vector3f::UnitY()) : Vector3f(-normal.y() * Vector3f::UnitZ())),
        right(up.cross(normal)) {}
  /// Returns the texture coordinates of a point of a rectangle on the face. `offset`: from the middle of the
  /// rectangle. `size`: edges of a box that has the rectangle as a face.
  Vector2f uv(const Vector3f& offset, const Vector3f& size) const {
    return {0.5f + right.dot(offset) / right.cwiseAbs().dot(size),
            0.5f - up.dot(offset) / up.cwiseAbs().dot(size)};
  }
  Vector3f up, right;
};

// Returns the grid lines along one axis of a box. They bound the flat part and two bevels of one facet each.
// Their normals make the bevels look round. Finer bevels would dominate the cost of a scene of boxes.
std::vector<float> box_lines(float half, float bevel) {
  if (bevel <= 0) return {-half, half};
  return {-half, bevel - half, half - bevel, half};
}

// Adds the vertex of a rounded box that corresponds to a point of the sharp box. Its distance from the inner
// box is `bevel` [m].
void add_box_vertex(Mesh& mesh, const Vector3f& point, const Vector3f& half, float bevel,
                    const Vector3f& face_normal) {
  const Vector3f inner_half = half - Vector3f::Constant(bevel);
  const Vector3f inner = point.cwiseMax(-inner_half).cwiseMin(inner_half);
  const Vector3f offset = point - inner;
  const bool flat = bevel <= 0 || (offset.array() != 0).count() == 1;
  const Vector3f normal = flat ? face_normal : Vector3f(offset.normalized());
  mesh.positions.push_back(flat ? point : Vector3f(inner + bevel * normal));
  mesh.normals.push_back(normal);
}

}  // namespace

Mesh make_sphere(float radius, int segments) {
  std::vector<ProfilePoint> profile;
  const int rings = std::max(segments / 4, 2);
  append_cap(profile, radius, 0, rings, -1);
  profile.pop_back();  // the upper half adds the equator
  append_cap(profile, radius, 0, rings, 1);
  return revolve(profile, std::max(segments, 3));
}

Mesh make_capsule(float radius, float height, int segments) {
  std::vector<ProfilePoint> profile;
  const int rings = std::max(segments / 4, 2);
  append_cap(profile, radius, -0.5f * height, rings, -1);
  append_cap(profile, radius, 0.5f * height, rings, 1);
  return revolve(profile, std::max(segments, 3));
}

Mesh make_cylinder(float radius, float height, int segments) {
  const float h = 0.5f * height;
  return revolve({{0, -h, {0, -1}},
                  {radius, -h, {0, -1}},
                  {radius, -h, {1, 0}},
                  {radius, h, {1, 0}},
                  {radius, h, {0, 1}},
                  {0, h, {0, 1}}},
                 std::max(segments, 3));
}

Mesh make_cone(float radius, float height, int segments) {
  const float h = 0.5f * height;
  const Vector2f side = Vector2f(height, radius).normalized();
  return revolve({{0, -h, {0, -1}}, {radius, -h, {0, -1}}, {radius, -h, side}, {0, h, side}},
                 std::max(segments, 3));
}

Mesh make_box(const Vector3f& size, float bevel) {
  const Vector3f half = 0.5f * size;
  bevel = std::clamp(bevel, 0.0f, half.minCoeff());
  std::array<std::vector<float>, 3> lines;
  for (int axis = 0; axis < 3; ++axis) lines[static_cast<std::size_t>(axis)] = box_lines(half[axis], bevel);

  Mesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const auto& us = lines[static_cast<std::size_t>(u)];
    const auto& vs = lines[static_cast<std::size_t>(v)];
    for (const float sign : {-1.0f, 1.0f}) {
      const Vector3f face_normal = sign * Vector3f::Unit(axis);
      const FaceAxes axes(face_normal);
      const auto first = static_cast<uint32_t>(mesh.positions.size());
      for (const float pv : vs) {
        for (const float pu : us) {
          Vector3f point;
          point[axis] = sign * half[axis];
          point[u] = pu;
          point[v] = pv;
          add_box_vertex(mesh, point, half, bevel, face_normal);
          mesh.uvs.push_back(axes.uv(point, size));
        }
      }
      const auto columns = static_cast<uint32_t>(us.size());
      for (uint32_t j = 0; j + 1 < vs.size(); ++j) {
        for (uint32_t i = 0; i + 1 < columns; ++i) {
          const uint32_t a = first + j * columns + i, b = a + 1, c = b + columns, d = a + columns;
          if (sign > 0) {
            mesh.indices.insert(mesh.indices.end(), {a, b, c, a, c, d});
          } else {
            mesh.indices.insert(mesh.indices.end(), {a, c, b, a, d, c});
          }
        }
      }
    }
  }
  return mesh;
}

Mesh make_frustum(float radius, float top_radius, float height, int segments) {
  const float half = 0.5f * height;
  const Vector2f slope = Vector2f(height, radius - top_radius).normalized();
  return revolve({{0, -half, {0, -1}},
                  {radius, -half, {0, -1}},
                  {radius, -half, slope},
                  {top_radius, half, slope},
                  {top_radius, half, {0, 1}},
                  {0, half, {0, 1}}},
                 std::max(segments, 3));
}

Mesh make_ellipsoid(const Vector3f& radii, int segments) {
  Mesh mesh = make_sphere(1, segments);
  for (Vector3f& p : mesh.positions) p = p.cwiseProduct(radii);
  for (Vector3f& n : mesh.normals) n = n.cwiseQuotient(radii).normalized();
  return mesh;
}

Mesh make_torus(float radius, float tube_radius, int segments) {
  constexpr int kAround = 36;
  std::vector<ProfilePoint> profile;
  for (int k = 0; k <= kAround; ++k) {
    // The first and the last point have the same bits, so the surface is closed.
    const float angle = 2 * kPi * static_cast<float>(k % kAround) / static_cast<float>(kAround);
    const Vector2f n(std::cos(angle), std::sin(angle));
    profile.push_back({radius + tube_radius * n.x(), tube_radius * n.y(), n});
  }
  return revolve(profile, std::max(segments, 3));
}

Mesh make_tube(float radius, float height, float thickness, int segments) {
  const float half = 0.5f * height, inner = radius - thickness;
  const Vector2f out(1, 0), in(-1, 0), up(0, 1), down(0, -1);
  return revolve({{inner, -half, down},
                  {radius, -half, down},
                  {radius, -half, out},
                  {radius, half, out},
                  {radius, half, up},
                  {inner, half, up},
                  {inner, half, in},
                  {inner, -half, in}},
                 std::max(segments, 3));
}

Mesh make_open_box(const Vector3f& size, float thickness) {
  Mesh mesh;
  // Adds a rectangle with a corner and two edges u and v. Its normal is along u x v.
  const auto add = [&](const Vector3f& corner, const Vector3f& u, const Vector3f& v) {
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    const Vector3f normal = u.cross(v).normalized(), sides = u.cwiseAbs() + v.cwiseAbs();
    const FaceAxes axes(normal);
    for (const auto& [s, t] : {std::pair(0.f, 0.f), {1.f, 0.f}, {1.f, 1.f}, {0.f, 1.f}}) {
      mesh.positions.push_back(corner + s * u + t * v);
      mesh.normals.push_back(normal);
      mesh.uvs.push_back(axes.uv((s - 0.5f) * u + (t - 0.5f) * v, sides));
    }
    for (const uint32_t k : {0u, 1u, 2u, 0u, 2u, 3u}) mesh.indices.push_back(first + k);
  };
  const Vector3f o = size / 2, i = o - Vector3f::Constant(thickness);
  const Vector3f x = Vector3f::UnitX(), y = Vector3f::UnitY(), z = Vector3f::UnitZ();
  const float depth = size.y() - thickness;  // depth of the inside
  add(-o, size.x() * x, size.z() * z);
  add({-i.x(), -i.y(), -i.z()}, 2 * i.z() * z, 2 * i.x() * x);
  for (const float side : {-1.f, 1.f}) {
    // Adds the outside and then the inside of the walls across x and across z.
    const auto facing = [&](const Vector3f& corner, const Vector3f& u, const Vector3f& v, bool swap) {
      swap ? add(corner, v, u) : add(corner, u, v);
    };
    facing({side * o.x(), -o.y(), -o.z()}, size.y() * y, size.z() * z, side < 0);
    facing({side * i.x(), -i.y(), -i.z()}, depth * y, 2 * i.z() * z, side > 0);
    facing({-o.x(), -o.y(), side * o.z()}, size.x() * x, size.y() * y, side < 0);
    facing({-i.x(), -i.y(), side * i.z()}, 2 * i.x() * x, depth * y, side > 0);
    // Adds the rim.
    const float low_x = side < 0 ? -o.x() : i.x(), low_z = side < 0 ? -o.z() : i.z();
    add({low_x, o.y(), -o.z()}, size.z() * z, thickness * x);
    add({-i.x(), o.y(), low_z}, thickness * z, 2 * i.x() * x);
  }
  return mesh;
}

Mesh make_ground(float half_size) {
  // Each ring of cells is twice as wide as the one inside it, so that triangles near the middle are small.
  const int rings = std::clamp(static_cast<int>(std::ceil(std::log2(half_size))), 0, 24);
  std::vector<float> lines;
  for (int k = 0; k <= rings; ++k) lines.push_back(-std::ldexp(half_size, -k));
  lines.push_back(0);
  for (int k = rings; k >= 0; --k) lines.push_back(-lines[static_cast<std::size_t>(k)]);

  Mesh mesh;
  mesh.endless = true;
  for (const float z : lines) {
    for (const float x : lines) {
      mesh.positions.emplace_back(x, 0.0f, z);
      mesh.normals.push_back(Vector3f::UnitY());
      mesh.uvs.emplace_back(0.5f + 0.5f * x / half_size, 0.5f + 0.5f * z / half_size);
    }
  }
  const auto columns = static_cast<uint32_t>(lines.size());
  for (uint32_t j = 0; j + 1 < columns; ++j) {
    for (uint32_t i = 0; i + 1 < columns; ++i) {
      const uint32_t a = j * columns + i, b = a + 1, c = b + columns, d = a + columns;
      mesh.indices.insert(mesh.indices.end(), {a, d, c, a, c, b});
    }
  }
  return mesh;
}

}  // namespace offstage::render
