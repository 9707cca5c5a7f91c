#pragma once
/// All surfaces and particles of a frame in world coordinates. Formats without a scene graph need this form.

#include <cstdint>
#include <string>
#include <vector>

#include "producer/build/snapshot.h"
#include "producer/export/film_parts.h"

namespace offstage::producer {

/// The surfaces of one object that have one material: a range of the vertices and a range of the indices in
/// WorldGeometry.
struct GeometryGroup {
  std::string object;
  std::size_t material = 0;
  uint32_t id = 0;  ///< number of the object, from 1, in the order bodies, rods, cloths, particles
  std::size_t first_vertex = 0, vertices = 0;
  std::size_t first_index = 0, indices = 0;
};

struct GeometryParticles {
  std::string object;
  uint32_t id = 0;
  const PointSet* set = nullptr;
};

struct WorldGeometry {
  std::vector<Eigen::Vector3f> positions, normals;
  /// Places in the texture of the base colour, v downwards; zero where a mesh has no texture coordinates.
  std::vector<Eigen::Vector2f> uvs;
  /// Vertex colours, linear with straight alpha; white where the material does not use them.
  std::vector<Eigen::Vector4f> colors;
  std::vector<uint32_t> indices;  ///< indices of vertices, three per triangle
  std::vector<GeometryGroup> groups;
  std::vector<GeometryParticles> particles;
};

/// Returns the surfaces and particles of a frame. `snapshot` must outlive the result.
WorldGeometry world_geometry(const FilmParts& parts, const Snapshot& snapshot);

}  // namespace offstage::producer
