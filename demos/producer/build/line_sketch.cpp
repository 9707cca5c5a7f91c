#include "producer/build/line_sketch.h"

#include <cmath>
#include <numbers>

namespace offstage::producer {

using sim::Real;
using sim::Vec3;

namespace {

constexpr float kHeadWidth = 5;     // width of an arrow's head, in widths of its shaft
constexpr Real kHeadLength = 0.35;  // length of the head as a fraction of the arrow

}  // namespace

Eigen::Vector3f hue_color(double turns) {
  constexpr double kLightness = 0.74, kChroma = 0.145;
  const double angle = 2 * std::numbers::pi * turns;
  const double a = kChroma * std::cos(angle), b = kChroma * std::sin(angle);
  const Vec3 root(kLightness + 0.3963377774 * a + 0.2158037573 * b,
                  kLightness - 0.1055613458 * a - 0.0638541728 * b,
                  kLightness - 0.0894841775 * a - 1.2914855480 * b);
  const Vec3 lms = root.array().cube();
  sim::Mat3 rgb_from_lms;
  rgb_from_lms << 4.0767416621, -3.3077115913, 0.2309699292,  //
      -1.2684380046, 2.6097574011, -0.3413193965,             //
      -0.0041960863, -0.7034186147, 1.7076147010;
  return (rgb_from_lms * lms).cwiseMax(0).cast<float>();
}

Eigen::Vector3f distinct_color(std::size_t i) {
  return hue_color(0.07 + static_cast<double>(i) / std::numbers::phi);
}

void LineSketch::object(uint64_t id) {
  next_id_ = id * 0x9E3779B97F4A7C15ull;
}

void LineSketch::line(const Vec3& a, const Vec3& b, const Eigen::Vector4f& color, float width_a,
                      float width_b) {
  set_.lines.push_back({a.cast<float>(), b.cast<float>(), color, width_a, width_b});
  set_.ids.push_back(next_id_++);
}

void LineSketch::dot(const Vec3& at, const Eigen::Vector4f& color, float width) {
  line(at, at, color, width, width);
}

void LineSketch::ring(const Vec3& centre, const Vec3& axis, Real radius, const Eigen::Vector4f& color,
                      int segments) {
  const Vec3 u = radius * axis.unitOrthogonal(), v = axis.normalized().cross(u);
  Vec3 from = centre + u;
  for (int i = 1; i <= segments; ++i) {
    const Real angle = 2 * std::numbers::pi * i / segments;
    const Vec3 to = centre + std::cos(angle) * u + std::sin(angle) * v;
    line(from, to, color);
    from = to;
  }
}

void LineSketch::arrow(const Vec3& from, const Vec3& to, const Eigen::Vector4f& color) {
  const Vec3 neck = to - kHeadLength * (to - from);
  line(from, neck, color);
  line(neck, to, color, kHeadWidth, 0);
}

}  // namespace offstage::producer
