#include "render/primitives.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace offstage::render {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

// A point of the half-section of a body of revolution. Two consecutive points at one position make a sharp
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
      mesh.uvs.emplace_back(static_cast<float>(j) / static_cast<float>(segments), along[i] / total);
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

// A quarter circle: from the equator to the top (sign 1), or from the bottom to the equator (sign -1).
void append_cap(std::vector<ProfilePoint>& profile, float radius, float center_y, int rings, int sign) {
  for (int k = 0; k <= rings; ++k) {
    const int step = sign > 0 ? k : rings - k;
    const float angle = 0.5f * kPi * static_cast<float>(step) / static_cast<float>(rings);
    const float up = static_cast<float>(sign) * std::sin(angle);
    const float out = step == rings ? 0.0f : std::cos(angle);  // exactly zero at the pole
    profile.push_back({radius * out, center_y + radius * up, {out, up}});
  }
}

// Grid lines along one axis of a box: the flat part between two bevels of one facet each. Their normals make
// the bevels look round. Finer bevels would dominate the cost of a scene of boxes.
std::vector<float> box_lines(float half, float bevel) {
  if (bevel <= 0) return {-half, half};
  return {-half, bevel - half, half - bevel, half};
}

// Adds the point of the rounded box for a point of the sharp one; it is at the distance `bevel` from the
// inner box.
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

// The flat parts of a bevelled box's faces, connected by one facet at each edge and corner: two fifths of its
// triangles.
void add_coarse_box(Mesh& mesh) {
  constexpr int kColumns = 4, kFace = kColumns * kColumns;  // number of vertices, in the layout of make_box
  // The corner of the flat part of the face across `axis`, towards (or away from) each axis.
  const auto corner = [](int axis, const std::array<bool, 3>& towards) {
    const auto along = [&](int offset) { return towards[static_cast<std::size_t>((axis + offset) % 3)]; };
    return static_cast<uint32_t>((2 * axis + along(0)) * kFace + (1 + along(2)) * kColumns + 1 + along(1));
  };
  const auto add = [&](std::vector<uint32_t> polygon, bool outwards) {
    if (!outwards) std::ranges::reverse(polygon);
    for (std::size_t k = 2; k < polygon.size(); ++k)
      mesh.coarse_indices.insert(mesh.coarse_indices.end(), {polygon[0], polygon[k - 1], polygon[k]});
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const bool a : {false, true}) {
      const auto at = [&](int face, bool towards_u, bool towards_v, bool towards_axis) {
        std::array<bool, 3> towards;
        towards[static_cast<std::size_t>(u)] = towards_u;
        towards[static_cast<std::size_t>(v)] = towards_v;
        towards[static_cast<std::size_t>(axis)] = towards_axis;
        return corner(face, towards);
      };
      add({at(axis, false, false, a), at(axis, true, false, a), at(axis, true, true, a),
           at(axis, false, true, a)},
          a);
      // Edges along the axis.
      for (const bool b : {false, true})
        add({at(u, a, b, false), at(v, a, b, false), at(v, a, b, true), at(u, a, b, true)}, a == b);
    }
  }
  for (int k = 0; k < 8; ++k) {
    const std::array<bool, 3> towards = {(k & 1) != 0, (k & 2) != 0, (k & 4) != 0};
    add({corner(0, towards), corner(1, towards), corner(2, towards)},
        (towards[0] == towards[1]) == towards[2]);
  }
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
      const auto first = static_cast<uint32_t>(mesh.positions.size());
      for (const float pv : vs) {
        for (const float pu : us) {
          Vector3f point;
          point[axis] = sign * half[axis];
          point[u] = pu;
          point[v] = pv;
          add_box_vertex(mesh, point, half, bevel, face_normal);
          mesh.uvs.emplace_back(0.5f + 0.5f * sign * pu / half[u], 0.5f + 0.5f * pv / half[v]);
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
  // Bevel below which one facet is enough for the shadow, as a share of half a side.
  constexpr float kFine = 0.1f;
  if (bevel > 0 && bevel <= kFine * half.minCoeff()) add_coarse_box(mesh);
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
      mesh.uvs.emplace_back(0.5f + 0.5f * x / half_size, 0.5f - 0.5f * z / half_size);
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
