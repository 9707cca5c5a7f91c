#include "sim/world/body_load.h"

#include <algorithm>

#include "sim/dynamics/expected_acceleration.h"

namespace offstage::sim {

void BodyLoad::expect(const RigidBody& body) {
  std::array<Twist, 3> accelerations;
  for (std::size_t i = 0; i < last_.size(); ++i)
    accelerations[i] = {last_[i].force / body.mass, body.angular_velocity(body.orientation, last_[i].torque)};
  const auto& [now, before, first] = accelerations;
  const Twist smaller = square(body, now) < square(body, before) ? now : before;
  const Twist expected = expected_acceleration(body, accelerations).value_or(smaller);
  expected_ = {body.mass * expected.velocity,
               body.spin_momentum(body.orientation, expected.angular_velocity)};
}

bool BodyLoad::is_over() const {
  return std::ranges::all_of(last_, is_zero);
}

}  // namespace offstage::sim
