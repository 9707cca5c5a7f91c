#pragma once
/// Private: collects the surfaces of a model file in one part per material and kind of vertex. Surfaces are
/// transformed by their nodes, and elements that cannot be drawn are skipped.

#include <map>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "render/model.h"

namespace offstage::render {

/// Triangles as a file has them, in the frame of their node. `mesh.normals` may have any length.
struct FileSurface {
  Mesh mesh;
  int material = 0;  ///< index into Model::materials
};

class PartBuilder {
 public:
  explicit PartBuilder(Model& model) : model_(model) {}

  void add(const FileSurface& surface, const Eigen::Affine3d& world_from_mesh);
  /// Records elements that are omitted, because only triangles are drawn.
  void count_skipped(std::size_t points, std::size_t lines) {
    points_ += points;
    lines_ += lines;
  }
  /// Returns one line for each kind of element that was omitted.
  std::vector<std::string> left_out() const;

 private:
  Mesh& part(const FileSurface& surface, bool normals);
  bool accept(const uint32_t* corners, const std::vector<Vector3f>& positions);

  Model& model_;
  std::map<std::tuple<int, bool, bool, bool, bool, bool>, std::size_t> parts_;
  std::size_t points_ = 0, lines_ = 0, bad_index_ = 0, not_finite_ = 0, no_area_ = 0, bad_normals_ = 0;
};

/// Makes the names of nodes unique.
class NodeNames {
 public:
  std::string next(const std::string& name);

 private:
  std::map<std::string, int> counts_;
  std::set<std::string> taken_;
};

/// Returns the rotation and translation of a transform, without its scale. The result for a flat or mirrored
/// node has the nearest rotation.
Eigen::Affine3d turned_and_moved(const Eigen::Affine3d& m);

/// Returns a node with a rigid pose.
Model::Node model_node(std::string name, int parent, const Eigen::Affine3d& rigid);

}  // namespace offstage::render
