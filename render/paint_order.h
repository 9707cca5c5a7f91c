#pragma once
/// Private: the back-to-front order of translucent objects: bodies (glass, blended meshes, translucent cloth)
/// and, between them, the blended particles of all sets.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/frame.h"
#include "render/points_pass.h"

namespace offstage::render {

/// The space that a translucent body occupies: an oriented box, or the ball inscribed in it.
class Region {
 public:
  /// Creates the region of a body. `round`: whether the body is the ball inscribed in the box, which is then
  /// a cube.
  Region(const Eigen::AlignedBox3f& box, const Eigen::Affine3f& world_from_box, bool round, const View& view);

  /// Returns whether a point in the world counts as behind the body. `depth`: depth of the point along the
  /// view axis [m]. A point inside of the body is behind it. If a point is behind the body, all farther
  /// points on the same line of sight are also behind it.
  bool hides(const Vector3f& place, float depth) const;
  /// Returns whether this body can hide `other`. If their ranges of depth overlap, a face of either box that
  /// separates the bodies decides. If there is none, the depths of their centres decide.
  bool is_in_front_of(const Region& other) const;
  bool contains(const Vector3f& place) const;

  /// Sets the visible surface of a body that fills only a small part of its box, such as a wavy cloth.
  /// hides() then uses it for points inside of the box. `depths`: depth of the nearest surface along the view
  /// axis [m] for each pixel of `area_px`, by rows; infinite where there is none.
  void set_surface(const Eigen::AlignedBox2i& area_px, std::vector<float> depths, const Vector2f& size_px);

  const std::array<Vector3f, 8>& corners() const { return corners_; }
  const Eigen::AlignedBox3f& world_box() const { return world_box_; }
  float depth() const { return depth_; }

 private:
  enum class Side { before, behind, neither };
  /// Returns the sides of this box's faces on which a body with these corners lies.
  Side side_of(const Region& other) const;
  bool surface_hides(const Vector3f& place, float depth) const;

  Eigen::Affine3f box_from_world_;
  Eigen::AlignedBox3f box_, world_box_;
  std::array<Vector3f, 8> corners_;  ///< corners of the box in the world
  Vector3f eye_;                     ///< position of the eye in the box's frame
  Vector3f center_, world_eye_;
  float radius_ = 0;                  ///< radius of a ball; 0 for a box
  float nearest_ = 0, farthest_ = 0;  ///< range of depth along the view axis
  float depth_ = 0;                   ///< depth of the centre
  Eigen::Matrix4f clip_from_world_;
  Eigen::AlignedBox2i surface_px_;
  Vector2f size_px_ = {0, 0};
  std::vector<float> surface_;
};

/// Orders bodies back to front and returns their indices. In a cycle of bodies that hide each other, the
/// farthest comes first. `areas_px`: the pixels that the bodies cover; bodies that share no pixel are ordered
/// by depth only.
std::vector<uint32_t> back_to_front(std::span<const Region> bodies,
                                    std::span<const Eigen::AlignedBox2i> areas_px);

/// The order of the particles of a sub-frame, among each other and relative to the bodies.
class PaintOrder {
 public:
  enum class Kind : uint8_t { puffs, sprites, flakes, streaks };
  static constexpr std::size_t kKinds = 4;
  /// Consecutive particles of one kind, drawn together.
  struct Run {
    Kind kind;
    uint32_t first, last;  ///< range in keys(kind); `last` is excluded
  };
  struct Source {
    const PointSet* set;
    uint32_t first;  ///< index of the set's first point among all points of its kind
  };
  struct Place {
    const PointSet* set;
    std::size_t index;
  };

  /// Builds the order. `bodies` are back to front. The sets must stay in memory until the next call.
  void build(std::span<const PointSet* const> sets, std::span<const Region> bodies, const View& view);

  /// Keys of the visible particles of a kind, nearest first; equal depths are ordered by set and id.
  std::span<const uint64_t> keys(Kind kind) const { return keys_[index(kind)]; }
  std::span<const Source> sources(Kind kind) const { return sources_[index(kind)]; }
  /// Returns the number of all points of a kind, whether visible or not.
  uint32_t count(Kind kind) const { return counts_[index(kind)]; }
  uint32_t number(Kind kind, uint64_t key) const;
  Place place(Kind kind, uint64_t key) const;

  /// Returns the runs that are drawn after body `body` - 1 and before body `body`, from back to front. If
  /// `body` is the number of bodies, these are the runs in front of all bodies.
  std::span<const Run> runs_before(std::size_t body) const;
  std::size_t run_count() const { return runs_.size(); }
  /// Returns the pixels that the sprites or flakes of a run can change.
  Eigen::AlignedBox2i area_px(const Run& run, const View& view, int width_px, int height_px) const;

 private:
  static std::size_t index(Kind kind) { return static_cast<std::size_t>(kind); }
  void gather(std::span<const PointSet* const> sets, const View& view);
  void add_layers(std::span<const Region> bodies, const View& view);
  void find_runs(std::size_t bodies);

  std::array<std::vector<uint64_t>, kKinds> keys_;
  std::array<std::vector<Source>, kKinds> sources_;
  std::array<uint32_t, kKinds> counts_{};
  std::size_t group_ =
      1;  ///< number of bodies per group; particles are not inserted between the bodies of a group
  std::vector<Run> runs_;  ///< back to front
  std::vector<uint32_t>
      /// For each body, the index of the first run that is drawn before it. Then the index of the first run
      /// in front of all bodies, and the number of runs.
      run_begins_;
};

}  // namespace offstage::render
