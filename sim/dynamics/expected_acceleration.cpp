#include "sim/dynamics/expected_acceleration.h"

namespace offstage::sim {
namespace {

/// Greatest change of an acceleration in a sub-step, relative to its value, that can be extrapolated. A
/// greater one is an impact, or a contact that begins or ends.
constexpr Real kResolved = 0.5;

Twist operator-(const Twist& a, const Twist& b) {
  return {a.velocity - b.velocity, a.angular_velocity - b.angular_velocity};
}

Real product(const RigidBody& body, const Twist& a, const Twist& b) {
  return body.mass * a.velocity.dot(b.velocity) +
         body.spin_momentum(body.orientation, a.angular_velocity).dot(b.angular_velocity);
}

}  // namespace

Real square(const RigidBody& body, const Twist& motion) {
  return product(body, motion, motion);
}

std::optional<Twist> expected_acceleration(const RigidBody& body, const std::array<Twist, 3>& last) {
  const Twist slope = last[0] - last[1], slope_before = last[1] - last[2];
  if (square(body, slope) > kResolved * kResolved * square(body, last[0])) return {};
  // Without a slope the acceleration would lag behind an oscillation, and springs would add energy to it.
  Twist expected = last[0];
  if (product(body, slope, slope_before) > 0) {
    const bool is_smaller = square(body, slope) < square(body, slope_before);
    const Twist& smaller = is_smaller ? slope : slope_before;
    expected.velocity += smaller.velocity;
    expected.angular_velocity += smaller.angular_velocity;
  }
  return expected;
}

}  // namespace offstage::sim
