#pragma once
/// Convex decompositions kept on disk from run to run, because making them is slow. A file is named by the
/// hash of the mesh and of the settings, so that a changed model never meets a stale one, and holds every bit
/// of the result, so that a run with the cache has the same bits as one without.

#include <filesystem>

#include "sim/geometry/convex_decomposition.h"

namespace offstage::producer {

class DecompositionCache {
 public:
  /// In a folder; it is made when there is something to keep.
  explicit DecompositionCache(std::filesystem::path folder) : folder_(std::move(folder)) {}
  /// Keeps nothing.
  DecompositionCache() = default;
  /// In $XDG_CACHE_HOME/offstage, else $HOME/.cache/offstage; keeps nothing if neither is set.
  static DecompositionCache of_user();

  /// From disk, or made and kept. A file that is damaged is made again; a folder that cannot be written to is
  /// not an error, for the cache only saves time.
  sim::ConvexDecomposition decompose(const sim::TriangleMesh& mesh) const;

  /// Where a mesh's decomposition is, or would be, kept; empty if nothing is.
  std::filesystem::path file(const sim::TriangleMesh& mesh) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace offstage::producer
