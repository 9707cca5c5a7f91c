#pragma once
/// Private: traces the light that arrives at the visible surfaces of a sub-frame. It consists of the light of
/// sun and lamps with shadows, the light from the sky and from other surfaces, and mirror images. The shaders
/// combine this light with the materials.

#include <array>
#include <cstdint>
#include <vector>

#include "render/file_io.h"
#include "render/trace/light_filter.h"
#include "render/trace/light_sources.h"
#include "render/trace/mirrored_surfaces.h"
#include "render/trace/ray_scene.h"

namespace offstage::render {

/// The visible surfaces in a picture or in a part of a picture: one value per pixel, rows from the bottom up.
struct SurfaceBuffer {
  int width_px = 0, height_px = 0;
  /// Position in the world [m]; w: roughness plus the flags below, or negative where nothing is visible.
  std::vector<Vector4f> places;
  /// Smooth normal and normal of the triangle, both on the visible side, in octahedral coordinates.
  std::vector<std::array<uint16_t, 4>> normals;

  /// Flags that are added to the roughness: the surface shows a mirror image, is cloth, is metal.
  static constexpr float kMirrors = 2, kCloth = 4, kMetal = 8;
};

/// Light at the visible surfaces, as the radiance of a white surface.
struct LightBuffer {
  LightBuffer(int width_px, int height_px);
  int runs() const { return (pixels.width_px + kLanes - 1) / kLanes; }  ///< runs of eight pixels per row

  // Results, rows from the bottom up.
  std::vector<Vector4f>
      arriving;  ///< light from the sky and other surfaces; w: fraction of the sun that is visible
  std::vector<Vector4f>
      sun;  ///< visible fraction of the sun per channel; empty if it is equal for all channels
  std::vector<Vector4f> mirrored;  ///< light from the mirrored direction; w: 1 where it was computed
  bool has_mirrors = false;        ///< whether any surface mirrors; if not, `mirrored` is not updated
  /// Diffuse light of lamps; w: mean direction to them, see packed_direction(). Empty if there are no lamps.
  std::vector<Vector4f> lamps;
  std::vector<Vector4f> highlights;  ///< specular light of lamps, without reflectance; w: Fresnel factor
  LightSums sums;

  // Intermediate values. Indirect light is traced per cell of 2x2 pixels.
  LightGuide pixels, cells;
  /// For each pixel: visible fraction of the sun; if there are lamps, their diffuse light and the highlights
  /// of rough surfaces; if the sun is tinted, its visible fraction per channel.
  LightValues direct;
  LightValues glow;             ///< for each pixel: light of glowing meshes; empty if there are none
  LightValues around, mirrors;  ///< for each cell: diffuse indirect light, and mirrored light
  LightPlane inverse_distance, brightness, reach2, noisy_reach2;  ///< see LightGuide::find_reach
  /// For each cell: 1 if its surface has a mirror image that is traced per cell, or a blurred one; else 0.
  LightPlane with_mirror, with_rough_mirror;
  /// For each run of eight pixels of a row: whether some of the pixels are in shadow, and others less.
  std::vector<uint8_t> partly_hidden;
};

/// Light at the glass surfaces in a part of the picture, rows from the bottom up.
struct GlassBuffer {
  std::vector<Vector4f>
      through;  ///< light that comes through the glass; w: fraction of the sun that is visible
  /// Light from the mirrored direction; w: fraction of a transparent background that is visible through the
  /// glass.
  std::vector<Vector4f> mirrored;
  std::vector<Vector4f> lamps, highlights;  ///< light of lamps; see LightBuffer
  LightSums sums;
};

/// The camera of a SurfaceBuffer, and the samples of its sub-frame.
struct LightView {
  Vector3f eye;
  Eigen::Matrix4f clip_from_world;
  float pixel_m;  ///< width of a pixel at a distance of 1 m [m]
  SampleOffsets offsets;
  bool sparse = false;  ///< whether most pixels get interpolated light; see Gaps
  /// How shadow rays from the surfaces meet glass. With `blocks`, the light that glass focuses is added.
  RayScene::Focus focus = RayScene::Focus::passes;
};

/// The light of the visible surfaces, for rays that hit these surfaces. It is filtered already, and such a
/// ray needs no further bounces.
class VisibleLight {
 public:
  /// `picture`: the picture of the opaque objects, rows from the bottom up; empty if it is not available.
  VisibleLight(const LightBuffer& light, const LightView& view, std::span<const Vector4f> picture = {})
      : light_(light), view_(view), picture_(picture) {}
  /// Returns the index of the pixel that shows the hit point, or -1 if the point is not visible.
  int find(const Hit& hit) const;
  /// Returns the unit direction from the eye through the middle of a pixel.
  Vector3f direction_through(int x, int y) const;
  int pixel(int x, int y) const { return y * light_.pixels.width_px + x; }
  bool has_picture() const { return !picture_.empty(); }
  Vector3f color(int pixel) const { return picture_[static_cast<std::size_t>(pixel)].head<3>(); }
  float opacity(int pixel) const { return picture_[static_cast<std::size_t>(pixel)].w(); }
  /// Returns the light at the surface in a pixel from the sky and other surfaces; w: visible fraction of the
  /// sun.
  const Vector4f& arriving(int pixel) const { return light_.arriving[static_cast<std::size_t>(pixel)]; }
  /// Returns the visible fraction of the sun at the surface in a pixel, per channel.
  Vector3f sun(int pixel) const {
    if (light_.sun.empty()) return Vector3f::Constant(arriving(pixel).w());
    return light_.sun[static_cast<std::size_t>(pixel)].head<3>();
  }
  /// Returns the light of lamps at the surface in a pixel, for a surface with the unit normal `normal`. The
  /// light was traced for the normal `traced`, which lacks the relief of the material.
  Vector3f lamps(int pixel, const Vector3f& traced, const Vector3f& normal) const;

 private:
  const LightBuffer& light_;
  const LightView& view_;
  std::span<const Vector4f> picture_;
};

class LightTracer {
 public:
  /// Prepares the tracing of a sub-frame. `scene` and `sources` must outlive this object. Several threads
  /// call `stop`; once it returns true, the functions for surfaces throw StoppedError.
  LightTracer(const RayScene& scene, const LightSources& sources, StopTest stop = {});

  /// Computes the light at all opaque surfaces of the picture.
  void trace(const SurfaceBuffer& surfaces, const LightView& view, LightBuffer& light) const;
  /// Computes the light at the surfaces of a translucent body. `visible`: light of the opaque objects.
  void trace_body(const SurfaceBuffer& surfaces, const LightView& view, const VisibleLight& visible,
                  LightBuffer& light) const;

  /// Computes the light at the surfaces of glass in a part of the picture, whose first pixel is (x, y).
  /// `behind`: light of the opaque objects, with their picture.
  void trace_glass(const SurfaceBuffer& surfaces, int x, int y, const LightView& view,
                   const VisibleLight& behind, GlassBuffer& glass) const;

  /// Traces the light at a point in the air from the sky and from objects, without the sun's disc and lamps.
  /// `number`, in [0, 1), selects the rays. `open`: the light of the sky without objects.
  AirLightAround trace_air(const Vector3f& place, float number, const SampleOffsets& offsets,
                           const AirRadiance& open) const;

 private:
  struct Point;   ///< a visible surface
  struct Points;  ///< eight visible surfaces
  struct Path;    ///< a path of light rays, traced from the eye
  /// Radiance that arrives along a path.
  struct FoundLight {
    Vector3f noisy = Vector3f::Zero();  ///< light found by random directions
    /// Light found without random directions, or with a weight because its source is also sampled.
    Vector3f certain = Vector3f::Zero();
    float background = 0;  ///< fraction of a transparent background that is visible along the path
    /// Returns the sum of both parts, the noisy one limited to a maximum brightness. Adds to `sums`.
    Vector3f limited(LightSums& sums) const;
    /// Adds a fraction of the light of another path to the same point.
    void add(const FoundLight& more, const Vector3f& fraction = Vector3f::Ones()) {
      noisy += fraction.cwiseProduct(more.noisy);
      certain += fraction.cwiseProduct(more.certain);
    }
  };
  /// Light that comes through glass.
  struct ThroughGlass {
    FoundLight light;         ///< without the indirect light of `shown`
    MirroredSurface shown;    ///< the diffuse surface behind the glass
    bool is_frosted = false;  ///< whether the glass spreads the light
  };
  FoundLight radiance(Path path, PixelSampler& sampler, const VisibleLight* visible = nullptr,
                      float* met = nullptr) const;
  void split(const Hit& hit, const Path& path, PixelSampler& sampler, FoundLight& light) const;
  bool follow_glass(const Hit& hit, const RaySurface& surface, PixelSampler& sampler,
                    const VisibleLight* visible, Path& path, FoundLight& found) const;
  bool follow_smooth(const Hit& hit, const RaySurface& surface, PixelSampler& sampler, bool sharp,
                     const VisibleLight* visible, Path& path, FoundLight& light) const;
  void add_varnish(const Hit& hit, const RaySurface& surface, const Vector3f& mirrored, PixelSampler& sampler,
                   const VisibleLight* visible, const Path& path, FoundLight& light) const;
  Vector3f mirrored_sky(const Hit& hit, const Path& path) const;
  void add_layers(const Hit& hit, Path& path, FoundLight& light) const;
  void prepare_particles(MetParticles groups, const SampleOffsets& offsets) const;
  void meet_particles(float length, Path& path, FoundLight& found) const;
  Vector3f highlight(const Hit& hit, const LampPoint<float>& point, bool shadows, float roughness,
                     const Vector3f& reflectance) const;
  Vector3f highlight_of_sun(const Hit& hit, float roughness, const Vector3f& reflectance) const;
  Vector3f highlights(const Hit& hit, float roughness, const Vector3f& reflectance) const;
  /// Light of sources on a white surface.
  struct DirectLight {
    Vector3f sun = Vector3f::Zero(), lamps = Vector3f::Zero(), glow = Vector3f::Zero();
    Vector3f sum() const { return sun + lamps + glow; }
  };
  DirectLight direct_light(const Hit& hit, const Vector3f& from, PixelSampler& sampler,
                           bool in_picture) const;
  Vector3f glow_at(const Vector3f& place, const Vector3f& normal, const Vector3f& face,
                   PixelSampler& sampler) const;
  LaneVectors trace_glow(const Points& points, int x, int y, const LightView& view) const;
  Vector3f lamps_at(const Hit& hit, const Vector3f& from, PixelSampler& sampler, bool in_picture) const;
  Vector3f start_of_shadow(const Hit& hit, const Vector3f& from, const Vector3f& towards) const;
  Vector3f sun_visibility(const Vector3f& place, const SquarePoint<float>& uv) const;
  Lanes sun_visibility(const LaneVectors& place, IntLanes active, const SquarePoint<Lanes>& uv,
                       RayScene::Focus focus, LaneVectors& colored) const;
  ThroughGlass light_through(const Point& point, const LightView& view, PixelSampler& sampler,
                             const VisibleLight& visible, bool from_background) const;
  void average_frosted(const SurfaceBuffer& surfaces, const LightPlane& frosted, const LightView& view,
                       GlassBuffer& glass) const;
  Vector3f mirrored_light(const Point& point, const LightView& view, PixelSampler& sampler,
                          const VisibleLight& visible, LightSums& sums, int rays, int splits,
                          MirroredSurface* shown = nullptr) const;
  Vector3f mirrored_along(const Point& point, const Vector3f& facet, const LightView& view,
                          PixelSampler& sampler, const VisibleLight& visible, LightSums& sums, int splits,
                          MirroredSurface* shown) const;
  void lift(const Points& points, IntLanes lanes, const LightView& view, LaneVectors& place) const;
  struct LampLight;
  struct Highlights;
  LaneVectors light_of_lamp(const RayLamp& lamp, const LampPoint<Lanes>& point, const Points& points,
                            IntLanes lanes, const LightView& view) const;
  LampLight trace_lamps(const Points& points, Lanes variance, const LightView& view,
                        Sampler<UintLanes>& sampler) const;
  static Lanes highlight_variance(const SurfaceBuffer& surfaces, const Points& points, int x, int y);
  void trace_pixels(const SurfaceBuffer& surfaces, int x, int y, int round, const LightView& view,
                    LightBuffer& light) const;
  void refine_penumbras(const SurfaceBuffer& surfaces, const LightView& view, LightBuffer& light) const;
  Lanes sun_at(const Points& points, const SquarePoint<Lanes>& on_sun, const LightView& view,
               LaneVectors& colored, bool* partly_hidden = nullptr) const;
  void trace_sparse_sun(const SurfaceBuffer& surfaces, int y, const LightView& view,
                        LightBuffer& light) const;
  void fill_sparse(LightBuffer& light) const;
  static IntLanes pixels_of_cells(const SurfaceBuffer& surfaces, int x, int y, const LightView& view);
  void trace_arriving(const SurfaceBuffer& surfaces, const LightView& view, LightBuffer& light) const;
  void write_arriving(LightBuffer& light) const;
  void for_rows(int height, const auto& each) const;
  LightSums sum_over_rows(int height, const auto& each) const;
  void trace_mirrors(const SurfaceBuffer& surfaces, const LightView& view, const VisibleLight& visible,
                     LightBuffer& light) const;
  static void set_guide(const Points& points, int x, int y, const LightView& view, float size_px,
                        LightGuide& guide);
  void trace_cells(const SurfaceBuffer& surfaces, int x, int y, int round, IntLanes active,
                   const LightView& view, LightBuffer& light, LightSums& sums) const;
  struct Beam;
  struct Photon;
  Photon trace_photon(const Beam& beam, uint32_t number, float count, const LightView& view,
                      const VisibleLight& visible) const;
  std::vector<Beam> beams_to(const GlassPiece& piece) const;
  static void add_photon(const Photon& photon, int half_px, const LightView& view, LightBuffer& light);
  void add_caustics(const LightView& view, LightBuffer& light) const;
  void refine_cells(const SurfaceBuffer& surfaces, const LightNoise& noise, const LightView& view,
                    LightBuffer& light) const;
  Vector3f sky_seen(const Vector3f& direction) const;
  Vector3f sky_met(const Vector3f& direction, bool sharp, float density) const;

  const RayScene& scene_;
  const LightSources& sources_;
  const StopTest stop_;
  SunDisc sun_disc_;
};

}  // namespace offstage::render
