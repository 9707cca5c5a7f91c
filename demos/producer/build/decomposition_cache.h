#pragma once
/// Convex decompositions stored on disk between runs, because computing them is slow. A file is named by the
/// hash of the mesh and of the settings, so a changed model never uses an outdated file. It contains every
/// bit of the result, so a run with the cache gives the same bits as one without.

#include <filesystem>

#include "sim/geometry/convex_decomposition.h"

namespace offstage::producer {

class DecompositionCache {
 public:
  /// Uses a folder, which is created when the first result is stored. `reads`: whether stored results are
  /// used; if not, all are computed and replace the stored ones.
  explicit DecompositionCache(std::filesystem::path folder, bool reads = true)
      : folder_(std::move(folder)), reads_(reads) {}
  /// Creates a cache that stores nothing.
  DecompositionCache() = default;
  /// Uses $XDG_CACHE_HOME/offstage, else $HOME/.cache/offstage; stores nothing if neither is set.
  static DecompositionCache of_user();

  /// Returns a decomposition from the disk, or computes and stores it. If the file is damaged, the
  /// decomposition is computed again. A folder that cannot be written to is not an error, because the cache
  /// only saves time.
  sim::ConvexDecomposition decompose(const sim::TriangleMesh& mesh,
                                     const sim::DecompositionSettings& settings = {}) const;

  /// Returns the file of a mesh's decomposition, whether it exists or not; empty if nothing is stored.
  std::filesystem::path file(const sim::TriangleMesh& mesh,
                             const sim::DecompositionSettings& settings = {}) const;

 private:
  std::filesystem::path folder_;
  bool reads_ = true;
};

}  // namespace offstage::producer
