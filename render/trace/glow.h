#pragma once
/// Private: glowing meshes as light sources. Each sample is a random point of one of the meshes. The
/// probability density of such samples is also known for points that other rays hit by chance, which is
/// needed for multiple importance sampling (E. Veach and L. Guibas, "Optimally Combining Sampling Techniques
/// for Monte Carlo Rendering", 1995).

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
  float density = 0;  ///< probability density of the direction [1/sr]; 0: there is no sample
};

class Glow {
 public:
  /// Adds a glowing object. `object`: its number in the RayScene. `center` and `radius`: its bounding sphere
  /// in the world [m]. `is_ball`: the object is that sphere. `mesh` and `material` must stay in memory.
  void add(unsigned object, const RayMesh& mesh, const RayMaterial& material,
           const Eigen::Affine3f& world_from_mesh, const Vector3f& center, float radius, bool is_ball);
  /// Keeps the kMost sources with the greatest power. Light of the others is found only by rays that hit them
  /// by chance.
  void limit();
  bool empty() const { return sources_.empty(); }
  std::size_t size() const { return sources_.size(); }
  /// Returns a random point of a source, as seen from a surface at `place`. A source is chosen in proportion
  /// to an estimate of its light on the surface. The point is uniformly distributed over the area of a mesh,
  /// or over the solid angle of a ball. `normal`: unit normal of the surface, or zero for a point in the air.
  GlowSample sample(const Vector3f& place, const Vector3f& normal, float random,
                    const SquarePoint<float>& uv) const;
  /// Returns the probability density with which sample() chooses the direction to `hit` [1/sr]; 0 if the hit
  /// is not on a source.
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

    /// Returns the area of a triangle in the world [m^2], divided by the probability to choose the triangle.
    float area_per_chance(unsigned triangle) const;
    /// Returns the solid angle of a ball as seen from `place`, divided by 2 pi; 0 if `place` is in the ball.
    float cap(const Vector3f& place) const;
    GlowSample sample_ball(const Vector3f& place, const SquarePoint<float>& uv) const;
    GlowSample sample_area(const Vector3f& place, float choice, const SquarePoint<float>& uv) const;
  };
  static float estimate(const Source& source, const Vector3f& place, const Vector3f& normal);

  std::vector<Source> sources_;
};

}  // namespace offstage::render
