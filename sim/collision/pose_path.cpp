#include "sim/collision/pose_path.h"

#include <cmath>

namespace offstage::sim {

// Let f be half the angle, and a(s) half of the angle turned up to the fraction s. Then
//   tan a = s sin f / ((1 - s) + s cos f),  da/ds = sin f / D,  D = 1 - 2 s (1 - s) (1 - cos f).
// The angular speed 2 da/ds has its maximum 4 tan(f/2) at s = 1/2, and its derivative is at most 16
// tan^3(f/2). A point at distance 1 from the axis has the centripetal acceleration (2 da/ds)^2, and this
// derivative as its tangential acceleration.
PosePath::PosePath(const Pose& start, const Pose& end)
    : start_(start), end_(end), velocity_(end.position - start.position) {
  if (start_.orientation.dot(end_.orientation) < 0) end_.orientation.coeffs() = -end_.orientation.coeffs();
  const Quat rotation = end_.orientation * start_.orientation.conjugate();
  sine_ = rotation.vec().norm();
  // Orientations that differ only by rounding do not turn.
  if (start_.orientation.coeffs() == end_.orientation.coeffs() || sine_ < 1e-15) sine_ = 0;
  cosine_ = std::max(0.0, rotation.w());
  axis_ = sine_ > 0 ? Vec3(rotation.vec() / sine_) : Vec3::Zero();
  const Real half_tangent = sine_ / (1 + cosine_);
  max_acceleration_ = 16 * half_tangent * half_tangent * (1 + half_tangent);
}

Real PosePath::turn() const {
  return sine_ > 0 ? 2 * std::atan2(sine_, cosine_) : 0;
}

Pose PosePath::at(Real fraction) const {
  Pose pose = start_;
  pose.position += fraction * velocity_;
  if (sine_ > 0)
    pose.orientation.coeffs() =
        ((1 - fraction) * start_.orientation.coeffs() + fraction * end_.orientation.coeffs()).normalized();
  return pose;
}

Vec3 PosePath::angular_velocity(Real fraction) const {
  return 2 * sine_ / (1 - 2 * fraction * (1 - fraction) * (1 - cosine_)) * axis_;
}

}  // namespace offstage::sim
