#pragma once
/// Private: the order in which translucent things are drawn, back to front: bodies (glass, blended meshes,
/// sheer cloth) and, between them, the blended particles of all sets.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "render/frame.h"
#include "render/points_pass.h"

namespace offstage::render {

/// The part of space that a translucent body takes: a box along axes of its own, or a ball in that box.
class Region {
 public:
  /// `round`: the body is the ball that fits the box, which is a cube then.
  Region(const Eigen::AlignedBox3f& box, const Eigen::Affine3f& world_from_box, bool round, const View& view);

  /// Whether the body can hide a place in the world, at this depth along the view axis, and the place cannot
  /// hide the body. A place within the body is behind its surface. Of places on one line of sight, all from
  /// one on are behind.
  bool hides(const Vector3f& place, float depth) const;
  /// Whether this body can hide the other one: by the faces of either box that part the two, else by their
  /// centres.
  bool is_in_front_of(const Region& other) const;
  bool contains(const Vector3f& place) const;

  /// What a body that fills its box badly, such as a wavy cloth, looks like: the depth of its nearest surface
  /// along the view axis for each pixel of `area_px`, by rows, infinite where there is none. Decides for
  /// places within the box.
  void set_surface(const Eigen::AlignedBox2i& area_px, std::vector<float> depths, const Vector2f& size_px);

  const std::array<Vector3f, 8>& corners() const { return corners_; }
  const Eigen::AlignedBox3f& world_box() const { return world_box_; }
  float depth() const { return depth_; }

 private:
  enum class Side { before, behind, neither };
  /// Of a body with these corners, by the faces of this one's box.
  Side side_of(const Region& other) const;
  bool surface_hides(const Vector3f& place, float depth) const;

  Eigen::Affine3f box_from_world_;
  Eigen::AlignedBox3f box_, world_box_;
  std::array<Vector3f, 8> corners_;  ///< in the world
  Vector3f eye_;                     ///< in the box's frame
  Vector3f center_, world_eye_;
  float radius_ = 0;                  ///< of a ball; else 0
  float nearest_ = 0, farthest_ = 0;  ///< along the view axis
  float depth_ = 0;                   ///< of the centre
  Eigen::Matrix4f clip_from_world_;
  Eigen::AlignedBox2i surface_px_;
  Vector2f size_px_ = {0, 0};
  std::vector<float> surface_;
};

/// Numbers of the bodies, back to front. Where each of several hides the next in a circle, the farthest comes
/// first. `areas_px`: what they take of the picture; bodies that share no pixel have no order but that of
/// their depth.
std::vector<uint32_t> back_to_front(std::span<const Region> bodies,
                                    std::span<const Eigen::AlignedBox2i> areas_px);

/// The order of the particles of a sub-frame, among each other and between bodies.
class PaintOrder {
 public:
  enum class Kind : uint8_t { puffs, sprites, flakes, streaks };
  static constexpr std::size_t kKinds = 4;
  /// Particles of one kind that are drawn in one go.
  struct Run {
    Kind kind;
    uint32_t first, last;  ///< in keys(kind), the last one not included
  };
  struct Source {
    const PointSet* set;
    uint32_t first;  ///< number of its first point among those of its kind
  };
  struct Place {
    const PointSet* set;
    std::size_t index;
  };

  /// `bodies` back to front. The sets must stay until the next call.
  void build(std::span<const PointSet* const> sets, std::span<const Region> bodies, const View& view);

  /// Of each visible particle of a kind, nearest first: of equal depth, by set and id.
  std::span<const uint64_t> keys(Kind kind) const { return keys_[index(kind)]; }
  std::span<const Source> sources(Kind kind) const { return sources_[index(kind)]; }
  /// Number of points of a kind, visible or not.
  uint32_t count(Kind kind) const { return counts_[index(kind)]; }
  uint32_t number(Kind kind, uint64_t key) const;
  Place place(Kind kind, uint64_t key) const;

  /// Back to front: particles that are drawn before body `k`; behind the last body, those in front of all.
  std::span<const Run> runs_before(std::size_t body) const;
  std::size_t run_count() const { return runs_.size(); }
  /// The pixels that sprites or flakes of a run can change.
  Eigen::AlignedBox2i area_px(const Run& run, const View& view, int width_px, int height_px) const;

 private:
  static std::size_t index(Kind kind) { return static_cast<std::size_t>(kind); }
  void gather(std::span<const PointSet* const> sets, const View& view);
  void add_layers(std::span<const Region> bodies, const View& view);
  void find_runs(std::size_t bodies);

  std::array<std::vector<uint64_t>, kKinds> keys_;
  std::array<std::vector<Source>, kKinds> sources_;
  std::array<uint32_t, kKinds> counts_{};
  std::size_t group_ = 1;             ///< bodies between which particles are not looked for
  std::vector<Run> runs_;             ///< back to front
  std::vector<uint32_t> run_begins_;  ///< of each body; then of those in front of all; then the end
};

}  // namespace offstage::render
