#pragma once
/// Extrapolation of the acceleration that contacts or particles cause.

#include <array>
#include <optional>

#include "sim/dynamics/rigid_body.h"

namespace offstage::sim {

/// Returns twice the kinetic energy of a body with this motion, as the measure of an acceleration.
Real square(const RigidBody& body, const Twist& motion);

/// Returns the acceleration of a body that is expected in the next sub-step. It is extrapolated from the
/// accelerations in the last three sub-steps, newest first. The result is empty if the sub-steps do not
/// resolve their course: an impact does not repeat.
std::optional<Twist> expected_acceleration(const RigidBody& body, const std::array<Twist, 3>& last);

}  // namespace offstage::sim
