#include "sim/geometry/solid_of_mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <tbb/parallel_for.h>

#include "sim/core/disjoint_sets.h"
#include "sim/geometry/winding_number.h"

namespace offstage::sim {
namespace {

using Index3 = Eigen::Array3i;

/// Lower bounds of the mean winding number inside: kHardlyInside for a solid, kSurelyInside for a surface
/// whose two sides together count as inside.
constexpr Real kHardlyInside = 0.6, kSurelyInside = 0.9;
/// Number of times that the surface of voxels is smoothed.
constexpr int kSmoothings = 2;
/// Greatest relative difference between the volume with closed holes and the volume of the voxels.
constexpr Real kSameSolid = 0.1;

/// The voxels of a mesh's box, and whether the centre of each is inside.
class VoxelGrid {
 public:
  /// `size`: side of a voxel [m].
  VoxelGrid(const TriangleMesh& mesh, const Aabb& box, Real size) : winding_(mesh), size_(size) {
    counts_ = (box.sizes().array() / size_ - 1e-9).ceil().max(1).cast<int>();
    low_ = box.center() - size_ / 2 * counts_.matrix().cast<Real>();
    find_inside();
  }

  Real volume() const {
    return size_ * size_ * size_ * static_cast<Real>(std::count(inside_.begin(), inside_.end(), 1));
  }

  /// Returns the boundary between the inside and the outside, with one quadrilateral for each side of a
  /// voxel. The corners are moved so that the steps of the voxels disappear.
  SolidPiece surface() const {
    SolidPiece piece = squares();
    for (int k = 0; k < kSmoothings; ++k) smooth(piece);
    return piece;
  }

 private:
  /// Moves each point to the mean of the centres of the polygons around it, then back by the mean of these
  /// moves, so that the volume remains. Taubin, "A signal processing approach to fair surface design" (1995).
  static void smooth(SolidPiece& piece) {
    const std::vector<Vec3> before = piece.points;
    spread(piece, piece.points);
    std::vector<Vec3> moved(before.size());
    for (std::size_t i = 0; i < before.size(); ++i) moved[i] = piece.points[i] - before[i];
    spread(piece, moved);
    for (std::size_t i = 0; i < before.size(); ++i) piece.points[i] -= moved[i];
  }

  /// Replaces the value of each point by a mean over the polygons around it: each polygon contributes the
  /// mean of its corners' values.
  static void spread(const SolidPiece& piece, std::vector<Vec3>& values) {
    std::vector<Vec3> sums(values.size(), Vec3::Zero());
    std::vector<int> counts(values.size(), 0);
    for (std::size_t k = 0; k < piece.polygon_count(); ++k) {
      Vec3 mean = Vec3::Zero();
      for (uint32_t i = piece.first[k]; i < piece.first[k + 1]; ++i) mean += values[piece.corners[i]];
      mean /= piece.first[k + 1] - piece.first[k];
      for (uint32_t i = piece.first[k]; i < piece.first[k + 1]; ++i) {
        sums[piece.corners[i]] += mean;
        ++counts[piece.corners[i]];
      }
    }
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = sums[i] / counts[i];
  }

  /// Returns the boundary between the inside and the outside, as squares.
  SolidPiece squares() const {
    SolidPiece piece;
    std::map<std::size_t, uint32_t> places;
    Index3 i;
    for (i.z() = 0; i.z() < counts_.z(); ++i.z())
      for (i.y() = 0; i.y() < counts_.y(); ++i.y())
        for (i.x() = 0; i.x() < counts_.x(); ++i.x())
          for (int axis = 0; axis < 3 && inside(i); ++axis)
            for (int side = 0; side < 2; ++side) {
              Index3 neighbour = i;
              neighbour[axis] += side == 0 ? -1 : 1;
              if (!inside(neighbour)) add_square(i, axis, side, places, piece);
            }
    return piece;
  }

  std::size_t slot(const Index3& i) const {
    return static_cast<std::size_t>(i.x() + counts_.x() * (i.y() + counts_.y() * i.z()));
  }
  bool inside(const Index3& i) const {
    return (i >= 0).all() && (i < counts_).all() && inside_[slot(i)] != 0;
  }

  void add_square(const Index3& i, int axis, int side, std::map<std::size_t, uint32_t>& places,
                  SolidPiece& piece) const {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int k = 0; k < 4; ++k) {
      // The corners of the upper side are counter-clockwise about the axis, the corners of the lower side
      // clockwise.
      const int turn = side == 1 ? k : 3 - k;
      Index3 corner = i;
      corner[axis] += side;
      corner[u] += turn == 1 || turn == 2;
      corner[v] += turn >= 2;
      const auto key = static_cast<std::size_t>(
          corner.x() + (counts_.x() + 1) * (corner.y() + (counts_.y() + 1) * corner.z()));
      const auto [place, is_new] = places.try_emplace(key, static_cast<uint32_t>(piece.points.size()));
      if (is_new) piece.points.push_back(low_ + size_ * corner.matrix().cast<Real>());
      piece.corners.push_back(place->second);
    }
    piece.first.push_back(static_cast<uint32_t>(piece.corners.size()));
  }

  /// Finds the voxels inside. A solid has winding numbers near 1 inside, or near -1 if its surface is inside
  /// out. Next to an open sheet they are slightly above 1/2 on the hollow sides, possibly on both.
  void find_inside() {
    struct Sum {
      Real positive = 0, negative = 0;
      int count = 0;
    };
    inside_.resize(static_cast<std::size_t>(counts_.prod()));
    std::vector<Sum> sums(static_cast<std::size_t>(counts_.z()));
    tbb::parallel_for(0, counts_.z(), [&](int z) {
      Sum& sum = sums[static_cast<std::size_t>(z)];
      for (int y = 0; y < counts_.y(); ++y)
        for (int x = 0; x < counts_.x(); ++x) {
          const Index3 i(x, y, z);
          const Real w = winding_.at(low_ + size_ * (i.matrix().cast<Real>() + Vec3::Constant(0.5)));
          if (std::abs(w) <= 0.5) continue;
          inside_[slot(i)] = 1;
          (w > 0 ? sum.positive : sum.negative) += std::abs(w);
          ++sum.count;
        }
    });
    Sum all;
    for (const Sum& s : sums)
      all = {all.positive + s.positive, all.negative + s.negative, all.count + s.count};
    const auto [less, more] = std::minmax(all.positive, all.negative);
    if (less + more < (less > more / 4 ? kSurelyInside : kHardlyInside) * all.count)
      std::fill(inside_.begin(), inside_.end(), char{0});
  }

  WindingNumber winding_;
  Real size_ = 0;
  Index3 counts_;
  Vec3 low_;
  std::vector<char> inside_;  // not bool, because threads write neighbouring elements
};

/// Returns the mesh with its holes closed by a fan of triangles for each connected piece of the border. The
/// faces along each edge then cancel in pairs of opposite directions.
TriangleMesh with_closed_holes(TriangleMesh mesh) {
  std::map<std::array<uint32_t, 2>, int> net;
  for (const Triangle& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const uint32_t a = t[k], b = t[(k + 1) % 3];
      net[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  std::erase_if(net, [](const auto& edge) { return edge.second == 0; });
  DisjointSets holes(mesh.vertices.size());
  for (const auto& [edge, count] : net) holes.join(edge[0], edge[1]);
  struct Middle {
    Vec3 sum = Vec3::Zero();
    Real weight = 0;
    uint32_t vertex = 0;
  };
  std::map<uint32_t, Middle> middles;
  for (const auto& [edge, count] : net) {
    const Vec3 &a = mesh.vertices[edge[0]], &b = mesh.vertices[edge[1]];
    Middle& middle = middles[holes.find(edge[0])];
    middle.sum += (b - a).norm() * (a + b) / 2;
    middle.weight += (b - a).norm();
  }
  for (auto& [hole, middle] : middles) {
    middle.vertex = static_cast<uint32_t>(mesh.vertices.size());
    mesh.vertices.push_back(middle.weight > 0 ? Vec3(middle.sum / middle.weight) : mesh.vertices[hole]);
  }
  for (const auto& [edge, count] : net)
    for (int k = 0; k < std::abs(count); ++k) {
      const uint32_t a = edge[0], b = edge[1], m = middles[holes.find(a)].vertex;
      mesh.triangles.push_back(count > 0 ? Triangle{b, a, m} : Triangle{a, b, m});
    }
  return mesh;
}

void turn_over(SolidPiece& piece) {
  for (std::size_t k = 0; k < piece.polygon_count(); ++k)
    std::reverse(piece.corners.begin() + piece.first[k], piece.corners.begin() + piece.first[k + 1]);
}

/// Returns the connected pieces of a surface, each with only its own vertices. If there are more than `most`
/// pieces, returns the whole surface as one piece.
std::vector<TriangleMesh> connected_pieces(const TriangleMesh& mesh, std::size_t most) {
  DisjointSets shells(mesh.vertices.size());
  for (const Triangle& t : mesh.triangles) {
    shells.join(t[0], t[1]);
    shells.join(t[0], t[2]);
  }
  std::map<uint32_t, TriangleMesh> meshes;
  for (const Triangle& t : mesh.triangles) meshes[shells.find(t[0])].triangles.push_back(t);
  if (meshes.size() > most) return {mesh};
  std::vector<TriangleMesh> pieces;
  for (auto& [shell, piece] : meshes) {
    piece.vertices = mesh.vertices;
    pieces.push_back(weld(piece));  // without the vertices of other pieces
  }
  return pieces;
}

Aabb box_of(const TriangleMesh& mesh) {
  Aabb box;
  for (const Vec3& v : mesh.vertices) box.extend(v);
  return box;
}

/// Returns the solid of one piece of a surface. The solid has no points if the piece has no inside. `voxel`:
/// size of the voxels [m].
SolidPiece solid_of_piece(const TriangleMesh& mesh, Real voxel) {
  const Aabb box = box_of(mesh);
  const bool was_closed = MeshTopology(mesh).defects().closed();
  SolidPiece closed = solid_piece(was_closed ? mesh : with_closed_holes(mesh));
  Real volume = moments(closed).volume;
  if (was_closed) return volume > 0 ? closed : SolidPiece{};
  const VoxelGrid grid(mesh, box, voxel);
  const Real inside = grid.volume();
  if (!(inside > 0)) return {};
  if (volume < 0) {
    turn_over(closed);
    volume = -volume;
  }
  if (std::abs(volume - inside) <= kSameSolid * inside) return closed;
  return grid.surface();
}

/// Whether a closed piece is inside out. It is then a cavity of another piece.
bool is_cavity(const TriangleMesh& piece) {
  return MeshTopology(piece).defects().closed() && moments(solid_piece(piece)).volume < 0;
}

}  // namespace

std::vector<SolidPiece> solids_of_closed(const TriangleMesh& mesh, std::size_t most) {
  std::vector<SolidPiece> solids;
  for (const TriangleMesh& piece : connected_pieces(mesh, most)) {
    solids.push_back(solid_piece(piece));
    if (!(moments(solids.back()).volume > 0)) return {solid_piece(mesh)};
  }
  return solids;
}

std::vector<SolidPiece> solids_of_open(const TriangleMesh& mesh, uint32_t resolution, std::size_t most) {
  const Real longest = box_of(mesh).sizes().maxCoeff();
  if (mesh.triangles.empty() || !(longest > 0)) return {};
  std::vector<TriangleMesh> pieces = connected_pieces(mesh, most);
  if (std::any_of(pieces.begin(), pieces.end(), is_cavity)) pieces = {mesh};
  std::vector<SolidPiece> solids;
  for (const TriangleMesh& piece : pieces)
    if (SolidPiece solid = solid_of_piece(piece, longest / resolution); !solid.points.empty())
      solids.push_back(std::move(solid));
  return solids;
}

}  // namespace offstage::sim
