#pragma once
/// Private: glowing meshes as light sources. A point of one of them is chosen for each sample. The density of
/// the choice is known for any point that a ray meets by chance, so that both ways to find light can be
/// weighted (E. Veach and L. Guibas, "Optimally Combining Sampling Techniques for Monte Carlo Rendering",
/// 1995).

#include <span>
#include <vector>

#include "render/trace/ray_scene.h"
#include "render/trace/sampler.h"

namespace offstage::render {

/// A point of a glowing mesh as seen from a place.
struct GlowSample {
  Vector3f towards = Vector3f::UnitY();
  float distance = 0;                    ///< [m]
  Vector3f radiance = Vector3f::Zero();  ///< radiance of the point
  float density = 0;  ///< probability density of the sample, per solid angle; 0: nothing was found
};

class Glow {
 public:
  /// Adds object `object` of the RayScene. `center` and `radius` are those of a ball around it; `is_ball`: it
  /// fills that ball. Mesh and material must stay in memory.
  void add(unsigned object, const RayMesh& mesh, const RayMaterial& material,
           const Eigen::Affine3f& world_from_mesh, const Vector3f& center, float radius, bool is_ball);
  /// Keeps the kMost sources with the greatest power. The others give light only where rays meet them by
  /// chance.
  void limit();
  bool empty() const { return sources_.empty(); }
  /// Chooses a source in proportion to an estimate of its light on a surface at `place`, and a point of it in
  /// proportion to its area, or to its solid angle if it is a ball.
  GlowSample sample(const Vector3f& place, const Vector3f& normal, float random,
                    const SquarePoint<float>& uv) const;
  /// The density with which sample() chooses the point that a ray from `place` hit; 0 if it is not on a
  /// source.
  float density(const Vector3f& place, const Vector3f& normal, const Hit& hit) const;

  static constexpr std::size_t kMost = 64;

 private:
  struct Source {
    unsigned object;
    const RayMesh* mesh;
    const RayMaterial* material;
    Eigen::Affine3f world_from_mesh;
    Vector3f center;
    float radius;
    bool is_ball;
    float power;

    /// Area of a triangle in the world over the chance to choose it, which is its fraction of the mesh.
    float area_per_chance(unsigned triangle) const;
    /// Solid angle of a ball over 2 pi, or 0 from within.
    float cap(const Vector3f& place) const;
    GlowSample sample_ball(const Vector3f& place, const SquarePoint<float>& uv) const;
    GlowSample sample_area(const Vector3f& place, float choice, const SquarePoint<float>& uv) const;
  };
  static float estimate(const Source& source, const Vector3f& place, const Vector3f& normal);

  std::vector<Source> sources_;
};

}  // namespace offstage::render
