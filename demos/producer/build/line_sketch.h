#pragma once
/// Drawing tools of overlays: lines, rings, dots and arrows in the world, and distinct colours.

#include <cstdint>

#include <Eigen/Core>

#include "producer/build/snapshot.h"
#include "sim/core/types.h"

namespace offstage::producer {

/// Returns a linear colour of the given hue; 1 is the full colour circle. All hues look equally bright
/// (Ottosson, "A perceptual color space for image processing", 2020).
Eigen::Vector3f hue_color(double turns);
/// Returns the i-th of a series of clearly different colours. Successive hues differ by 0.618 of the colour
/// circle.
Eigen::Vector3f distinct_color(std::size_t i);

/// Collects the lines of one overlay. A line has the same id in every frame if its object's lines are added
/// in the same order.
class LineSketch {
 public:
  /// Begins the lines of the object with the unique number `id`.
  void object(uint64_t id);

  void line(const sim::Vec3& a, const sim::Vec3& b, const Eigen::Vector4f& color, float width_a = 1,
            float width_b = 1);
  void dot(const sim::Vec3& at, const Eigen::Vector4f& color, float width);
  /// Adds a circle about an axis. The axis may have any length except 0.
  void ring(const sim::Vec3& centre, const sim::Vec3& axis, sim::Real radius, const Eigen::Vector4f& color,
            int segments = 24);
  void arrow(const sim::Vec3& from, const sim::Vec3& to, const Eigen::Vector4f& color);

  LineSet take() { return std::move(set_); }

 private:
  LineSet set_;
  uint64_t next_id_ = 0;
};

}  // namespace offstage::producer
