#include "sim/dynamics/keyframes.h"

#include <algorithm>
#include <cmath>

#include "sim/dynamics/rigid_jacobian.h"

namespace offstage::sim {
namespace {

/// For rotations below this angle, the Jacobians are approximated linearly [rad].
constexpr Real kSmallAngle = 1e-4;

Interpolation kind(const KeyframeTrack& track, std::size_t i) {
  return track.keys[i].interpolation.value_or(track.interpolation);
}

/// Returns the mean angular velocity between the keys i and i + 1, on the shortest rotation [rad/s]. It is
/// parallel to the axis of this rotation, so it has the same components in the axes of both keys. For a jump
/// it is zero.
Vec3 turn_rate(const KeyframeTrack& track, std::size_t i) {
  const Keyframe &a = track.keys[i], &b = track.keys[i + 1];
  if (kind(track, i) == Interpolation::step) return Vec3::Zero();
  Quat turn = a.pose.orientation.conjugate() * b.pose.orientation;
  if (turn.w() < 0) turn.coeffs() = -turn.coeffs();
  const Eigen::AngleAxisd rotation(turn);
  return rotation.angle() / (b.time - a.time) * rotation.axis();
}

/// turn_jacobian() returns the matrix J in w = J r', for the orientation exp(r) and the angular velocity w in
/// the axes of the body. The second function returns its inverse.
Mat3 turn_jacobian(const Vec3& r) {
  const Real angle = r.norm();
  if (angle < kSmallAngle) return Mat3::Identity() - cross_matrix(r) / 2;
  const Mat3 x = cross_matrix(r);
  return Mat3::Identity() - (1 - std::cos(angle)) / (angle * angle) * x +
         (angle - std::sin(angle)) / (angle * angle * angle) * x * x;
}
Mat3 inverse_turn_jacobian(const Vec3& r) {
  const Real angle = r.norm();
  if (angle < kSmallAngle) return Mat3::Identity() + cross_matrix(r) / 2;
  const Mat3 x = cross_matrix(r);
  return Mat3::Identity() + x / 2 +
         (1 / (angle * angle) - std::cos(angle / 2) / (2 * angle * std::sin(angle / 2))) * x * x;
}

struct TurnSample {
  Quat orientation;
  Vec3 angular_velocity;  // in world axes [rad/s]
};

/// Returns the orientation at time t in segment i. It follows a curve of rotation vectors relative to the
/// segment's first key; positions follow a curve of the same kind. The angular velocity at a key is computed
/// from the mean angular velocities of the segments on both sides, so it does not jump.
TurnSample turn_on_segment(const KeyframeTrack& track, std::size_t i, Real t) {
  const Keyframe &a = track.keys[i], &b = track.keys[i + 1];
  const Real span = b.time - a.time, s = (t - a.time) / span;
  const Vec3 mean = turn_rate(track, i);
  Vec3 r = s * span * mean, rate = mean;
  if (kind(track, i) != Interpolation::linear) {
    const bool limited = kind(track, i) == Interpolation::monotone;
    const std::size_t segments = track.keys.size() - 1;
    const auto tangent = [&](std::size_t before, std::size_t after) -> Vec3 {
      const auto duration = [&](std::size_t k) { return track.keys[k + 1].time - track.keys[k].time; };
      return key_tangent<3>(turn_rate(track, before), duration(before), turn_rate(track, after),
                            duration(after), limited);
    };
    const Vec3 whole = span * mean;
    const Vec3 m0 = i > 0 || track.loop ? tangent((i + segments - 1) % segments, i) : mean;
    const Vec3 end = i + 1 < segments || track.loop ? tangent(i, (i + 1) % segments) : mean;
    const Vec3 m1 = inverse_turn_jacobian(whole) * end;
    const Real s2 = s * s, s3 = s2 * s;
    r = (3 * s2 - 2 * s3) * whole + (s3 - 2 * s2 + s) * span * m0 + (s3 - s2) * span * m1;
    rate = (6 * s - 6 * s2) * mean + (3 * s2 - 4 * s + 1) * m0 + (3 * s2 - 2 * s) * m1;
  }
  const Real angle = r.norm();
  const Quat turned = angle > 0 ? Quat(Eigen::AngleAxisd(angle, r / angle)) : Quat::Identity();
  const Quat orientation = (a.pose.orientation * turned).normalized();
  return {orientation, orientation * (turn_jacobian(r) * rate)};
}

Motion on_segment(const KeyframeTrack& track, std::size_t i, Real t) {
  const Keyframe& a = track.keys[i];
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
  const TurnSample turn = turn_on_segment(track, i, t);
  out.pose.orientation = turn.orientation;
  out.angular_velocity = turn.angular_velocity;
  return out;
}

/// Returns the start of the period that contains time t, for a track that is repeated.
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

/// Whether two poses are equal within the rounding of the numbers in a scene file.
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
  // A jump is in the period that contains `to`, or in the previous period.
  for (std::size_t i = 0; i + 1 < keys.size(); ++i) {
    if (kind(*this, i) != Interpolation::step) continue;
    const Real time = keys[i + 1].time, period = keys.back().time - keys.front().time;
    if (jumps_at(round + time) || (loop && jumps_at(round + time - period))) return true;
  }
  return loop && !same(keys.front().pose, keys.back().pose) && jumps_at(round + keys.front().time);
}

}  // namespace offstage::sim
