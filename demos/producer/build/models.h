#pragma once
/// The model and texture files of a scene, each read once and shared by the simulation and every stage.

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "producer/base/scene_folder.h"
#include "producer/build/decomposition_cache.h"
#include "producer/scene/scene.h"
#include "render/model.h"
#include "render/sky_picture.h"
#include "sim/geometry/convex_decomposition.h"
#include "sim/geometry/mesh.h"

namespace offstage::producer {

/// A colliding part of an animated model: the triangles of a node, or the convex hull of the skin around a
/// bone. The model's scale and the node's scale are not applied; coordinates are in the node's frame.
struct AnimatedPiece {
  std::string name;  ///< name of the node
  int node = 0;      ///< index in the rig
  sim::TriangleMesh mesh;
  sim::ConvexDecomposition parts;
};

class ModelLibrary {
 public:
  ModelLibrary() = default;
  /// Function that is called with a description before each step that may take seconds, and with an empty
  /// text after the step. It may throw to stop the work.
  using StepCallback = std::function<void(const std::string& step)>;

  /// Reads every model and texture that the (flat) scene names, relative to `folder` (or see `model_file`),
  /// and decomposes models into convex parts where collisions of bodies or an overlay need them. Throws
  /// SceneError with every unusable file; repairs of a model and approximations are added to `warnings`.
  ModelLibrary(const Scene& scene, const SceneFolder& folder, const DecompositionCache& cache,
               std::vector<Problem>& warnings, const StepCallback& on_step = {});

  const render::Model& model(const std::string& file) const { return models_.at(file); }
  /// Returns the key of the convex parts of a model: its file and the settings of the decomposition.
  static std::string parts_key(const MeshFile& mesh);
  /// Returns the unscaled convex parts of a model, or null if no object needs them.
  const sim::ConvexDecomposition* parts(const MeshFile& mesh) const {
    const auto it = parts_.find(parts_key(mesh));
    return it == parts_.end() ? nullptr : &it->second;
  }
  /// Returns the colliding pieces of a body with an animated shape.
  const std::vector<AnimatedPiece>& pieces(const Body& body) const { return pieces_.at(animation_key(body)); }
  const render::Image& texture(const std::string& file) const { return textures_.at(file); }
  /// Returns the picture of the sky; null if the scene has none.
  const std::shared_ptr<const render::SkyPicture>& sky() const { return sky_; }
  /// A model that was decomposed into convex parts, and the time that this took. Parts from the cache take
  /// little time.
  struct Decomposed {
    std::string file;
    std::size_t triangles = 0;
    const sim::ConvexDecomposition* parts = nullptr;
    double seconds = 0;
  };
  const std::vector<Decomposed>& decomposed() const { return decomposed_; }

  /// Returns a hash of all data that were read. It shows a run whether a file has changed.
  const std::string& digest() const { return digest_; }

 private:
  /// Adds a problem for each sprite sheet whose size in pixels is not divisible by its rows and columns.
  void check_sheets(const Scene& scene, std::vector<Problem>& problems) const;
  /// Reads the picture of the sky, and returns its pixels for the digest.
  std::vector<float> read_sky(const Scene& scene, const SceneFolder& folder, std::vector<Problem>& problems,
                              std::vector<Problem>& warnings);
  static std::string animation_key(const Body& body);
  void read_animations(const Scene& scene, const DecompositionCache& cache, std::vector<Problem>& problems);
  /// Adds a problem for each dynamic body whose model is not closed. The decomposition of such a model may
  /// take minutes.
  void check_solids(const Scene& scene, std::vector<Problem>& problems) const;
  void decompose_models(const Scene& scene, const DecompositionCache& cache, std::vector<Problem>& warnings,
                        const StepCallback& on_step);

  std::map<std::string, render::Model> models_;
  std::map<std::string, render::Image> textures_;
  std::shared_ptr<const render::SkyPicture> sky_;
  std::map<std::string, sim::ConvexDecomposition> parts_;  ///< convex parts of models, by parts_key()
  /// Colliding pieces of bodies, by animation_key().
  std::map<std::string, std::vector<AnimatedPiece>> pieces_;
  std::vector<Decomposed> decomposed_;
  std::string digest_;
};

/// Returns the model file whose animation a body plays.
const std::string& animated_file(const Body& body);

/// A scale factor, and the reason for it as text.
struct ChosenScale {
  Real factor = 1;
  std::string reason;
};
/// Returns the factor that brings a model from its file's likely unit to metres: 1, 0.01 (centimetres) or
/// 0.001 (millimetres). `largest_side`: longest edge of the box around the file's content, in the unit that
/// was read or assumed [m].
ChosenScale automatic_scale(Real largest_side, render::Model::UnitSource unit);
/// Returns the factor for a model that was read; Model::file_size must be known.
ChosenScale automatic_scale(const render::Model& model);

/// Returns the total scale factor of a model: `scale`, times the factor that fits the model's bounding box of
/// size `size` into the box `fit` if that is given. Axes along which the model is flat are ignored. `likely`:
/// factor of automatic_scale().
Real fitted_scale(const ModelScale& scale, const std::optional<Vec3>& fit, const Vec3& size, Real likely);
Real fitted_scale(const ModelScale& scale, const std::optional<Vec3>& fit, const render::Model& model);
template <class Use>
Real scale_of(const Use& use, const ModelLibrary& models) {
  if constexpr (requires { use.fit; })
    return fitted_scale(use.scale, use.fit, models.model(use.file));
  else
    return fitted_scale(use.scale, {}, models.model(use.file));
}

/// Returns all triangles of a model as one mesh for the simulation, multiplied by the scale factor.
sim::TriangleMesh collision_mesh(const render::Model& model, double scale);
/// Returns the name of a method of decomposition: "exact", "approximate" ...
std::string method_name(sim::ConvexDecomposition::Method method);

/// Returns the convex parts of a model, scaled like its mesh.
sim::ConvexDecomposition scaled(sim::ConvexDecomposition decomposition, double scale);

/// Returns the hash XXH3-128 of a mesh in hexadecimal.
std::string mesh_hash(const sim::TriangleMesh& mesh);
/// Returns the hash XXH3-128 of a text in hexadecimal.
std::string text_hash(const std::string& text);

}  // namespace offstage::producer
