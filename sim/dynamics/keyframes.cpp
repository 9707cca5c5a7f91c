#include "sim/dynamics/keyframes.h"

#include <algorithm>
#include <cmath>

namespace offstage::sim {
namespace {

/// The velocity of the parabola through three successive keys, at the middle one: the tangent of a
/// Catmull-Rom spline over uneven times. `before` and `after` are the mean velocities on either side, lasting
/// h0 and h1.
Vec3 tangent(const Vec3& before, Real h0, const Vec3& after, Real h1) {
  return (h1 * before + h0 * after) / (h0 + h1);
}

/// Tangents at both ends of segment i. At an open end the tangent is the segment's mean velocity; a loop
/// wraps.
std::pair<Vec3, Vec3> segment_tangents(const KeyframeTrack& track, std::size_t i) {
  const auto& keys = track.keys;
  const std::size_t segments = keys.size() - 1;
  const auto duration = [&](std::size_t s) { return keys[s + 1].time - keys[s].time; };
  const auto slope = [&](std::size_t s) -> Vec3 {
    return (keys[s + 1].pose.position - keys[s].pose.position) / duration(s);
  };
  const auto joint = [&](std::size_t s0, std::size_t s1) {
    return tangent(slope(s0), duration(s0), slope(s1), duration(s1));
  };
  const bool has_before = i > 0 || track.loop, has_after = i + 1 < segments || track.loop;
  return {has_before ? joint((i + segments - 1) % segments, i) : slope(i),
          has_after ? joint(i, (i + 1) % segments) : slope(i)};
}

/// Cubic Hermite from p0 to p1 over `span` at s in [0, 1], and its derivative in time.
void hermite(const Vec3& p0, const Vec3& m0, const Vec3& p1, const Vec3& m1, Real span, Real s, Motion& out) {
  const Real s2 = s * s, s3 = s2 * s;
  out.pose.position = (2 * s3 - 3 * s2 + 1) * p0 + (s3 - 2 * s2 + s) * span * m0 + (3 * s2 - 2 * s3) * p1 +
                      (s3 - s2) * span * m1;
  out.velocity = (6 * s2 - 6 * s) / span * (p0 - p1) + (3 * s2 - 4 * s + 1) * m0 + (3 * s2 - 2 * s) * m1;
}

Motion on_segment(const KeyframeTrack& track, std::size_t i, Real t) {
  const Keyframe &a = track.keys[i], &b = track.keys[i + 1];
  const Real span = b.time - a.time, s = (t - a.time) / span;
  Motion out;
  if (track.interpolation == Interpolation::smooth) {
    const auto [m0, m1] = segment_tangents(track, i);
    hermite(a.pose.position, m0, b.pose.position, m1, span, s, out);
  } else {
    out.velocity = (b.pose.position - a.pose.position) / span;
    out.pose.position = a.pose.position + (t - a.time) * out.velocity;
  }
  // Slerp turns at a constant rate about one axis, the short way round.
  Quat turn = b.pose.orientation * a.pose.orientation.conjugate();
  if (turn.w() < 0) turn.coeffs() = -turn.coeffs();
  const Eigen::AngleAxisd rotation(turn);
  out.pose.orientation = a.pose.orientation.slerp(s, b.pose.orientation).normalized();
  out.angular_velocity = rotation.angle() / span * rotation.axis();
  return out;
}

Motion on_keys(const KeyframeTrack& track, Real t, const Pose& rest) {
  const auto& keys = track.keys;
  if (keys.empty()) return {.pose = rest};
  const Real first = keys.front().time, period = keys.back().time - first;
  if (track.loop && period > 0) t = first + (t - first) - period * std::floor((t - first) / period);
  if (t < first || keys.size() == 1) return {.pose = keys.front().pose};
  if (t >= keys.back().time) return {.pose = keys.back().pose};
  const auto after =
      std::upper_bound(keys.begin(), keys.end(), t, [](Real v, const Keyframe& k) { return v < k.time; });
  return on_segment(track, static_cast<std::size_t>(after - keys.begin()) - 1, t);
}

}  // namespace

Motion KeyframeTrack::at(Real t, const Pose& rest) const {
  Motion motion = on_keys(*this, t, rest);
  const Real rate = spin.norm();
  if (rate > 0) {
    motion.angular_velocity += motion.pose.orientation * spin;
    motion.pose.orientation =
        (motion.pose.orientation * Quat(Eigen::AngleAxisd(rate * t, spin / rate))).normalized();
  }
  return motion;
}

}  // namespace offstage::sim
