#include "sim/dynamics/keyframes.h"

#include <algorithm>
#include <cmath>

namespace offstage::sim {
namespace {

Interpolation kind(const KeyframeTrack& track, std::size_t i) {
  return track.keys[i].interpolation.value_or(track.interpolation);
}

Motion on_segment(const KeyframeTrack& track, std::size_t i, Real t) {
  const Keyframe &a = track.keys[i], &b = track.keys[i + 1];
  const auto key = [&](std::size_t k) -> CurveKey<3> {
    return {track.keys[k].time, track.keys[k].pose.position, kind(track, k)};
  };
  const CurveSample<3> position = sample_segment<3>(track.keys.size(), key, track.loop, i, t);
  Motion out;
  out.pose.position = position.value;
  out.velocity = position.rate;
  if (kind(track, i) == Interpolation::step) {
    out.pose.orientation = a.pose.orientation;
    return out;
  }
  // Slerp turns at a constant rate about one axis, along the shortest arc.
  const Real span = b.time - a.time, s = (t - a.time) / span;
  Quat turn = b.pose.orientation * a.pose.orientation.conjugate();
  if (turn.w() < 0) turn.coeffs() = -turn.coeffs();
  const Eigen::AngleAxisd rotation(turn);
  out.pose.orientation = a.pose.orientation.slerp(s, b.pose.orientation).normalized();
  out.angular_velocity = rotation.angle() / span * rotation.axis();
  return out;
}

/// Start of the period of a loop that contains a time.
Real round_start(const KeyframeTrack& track, Real t) {
  const Real first = track.keys.front().time, period = track.keys.back().time - first;
  return first + period * std::floor((t - first) / period);
}

Motion on_keys(const KeyframeTrack& track, Real t, const Pose& rest) {
  const auto& keys = track.keys;
  if (keys.empty()) return {.pose = rest};
  if (keys.size() == 1) return {.pose = keys.front().pose};
  if (track.loop) t = keys.front().time + (t - round_start(track, t));
  if (t < keys.front().time) return {.pose = keys.front().pose};
  if (t >= keys.back().time) return {.pose = keys.back().pose};
  return on_segment(track,
                    segment_at(
                        keys.size(), [&](std::size_t k) { return keys[k].time; }, t),
                    t);
}

/// Equality within the rounding of the numbers in a scene.
bool same(const Pose& a, const Pose& b) {
  constexpr Real kRounding = 1e-9;
  return (a.position - b.position).norm() < kRounding &&
         std::abs(a.orientation.dot(b.orientation)) > 1 - kRounding * kRounding;
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

bool KeyframeTrack::jumps(Real from, Real to) const {
  if (keys.size() < 2) return false;
  const auto jumps_at = [&](Real time) { return from < time && time <= to; };
  const Real round = loop ? round_start(*this, to) - keys.front().time : 0;
  // A jump is in the period that contains `to`, or in the one before.
  for (std::size_t i = 0; i + 1 < keys.size(); ++i) {
    if (kind(*this, i) != Interpolation::step) continue;
    const Real time = keys[i + 1].time, period = keys.back().time - keys.front().time;
    if (jumps_at(round + time) || (loop && jumps_at(round + time - period))) return true;
  }
  return loop && !same(keys.front().pose, keys.back().pose) && jumps_at(round + keys.front().time);
}

}  // namespace offstage::sim
