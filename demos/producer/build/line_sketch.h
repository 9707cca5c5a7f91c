#pragma once
/// Drawing tools of overlays: lines, rings, dots and arrows in the world, and distinct colours.

#include <cstdint>

#include <Eigen/Core>

#include "producer/build/snapshot.h"
#include "sim/core/types.h"

namespace offstage::producer {

/// A linear colour of the given hue; one turn is the full circle. Hues look equally bright (Ottosson, "A
/// perceptual color space for image processing", 2020).
Eigen::Vector3f hue_color(double turns);
/// Colours of neighbouring numbers are very different: hues by the golden ratio.
Eigen::Vector3f distinct_color(std::size_t i);

/// Collects the lines of one overlay. The lines of an object that are added in the same order have the same
/// ids.
class LineSketch {
 public:
  /// Begins the lines of an object with a unique number.
  void object(uint64_t id);

  void line(const sim::Vec3& a, const sim::Vec3& b, const Eigen::Vector4f& color, float width_a = 1,
            float width_b = 1);
  void dot(const sim::Vec3& at, const Eigen::Vector4f& color, float width);
  /// Adds a circle about an axis of any length but 0.
  void ring(const sim::Vec3& centre, const sim::Vec3& axis, sim::Real radius, const Eigen::Vector4f& color,
            int segments = 24);
  void arrow(const sim::Vec3& from, const sim::Vec3& to, const Eigen::Vector4f& color);

  LineSet take() { return std::move(set_); }

 private:
  LineSet set_;
  uint64_t next_id_ = 0;
};

}  // namespace offstage::producer
