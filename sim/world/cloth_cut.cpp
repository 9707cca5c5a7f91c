/// The part of the world that divides a sub-step for a body that would pass cloth and reach another body
/// behind the cloth in the same sub-step (physics F7). Bodies move before cloths. Without the division the
/// body would collide with the other body at a speed that the cloth would have taken from it, and the cloth
/// would then act on the speed of the rebound.

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "sim/world/world_impl.h"

namespace offstage::sim {
namespace {

/// A sub-step is divided only if cloth and the other body are farther from each other than this along the
/// path of the body, in thicknesses of the cloth.
constexpr Real kLeastDistance = 2;
/// The search looks ahead this far, in lengths of the sub-step: forces may make a body faster, and other
/// bodies may stop it.
constexpr Real kLookAhead = 1.25;
/// Greatest number of steps in the search for the time at which a body reaches another one.
constexpr int kMaxAdvances = 16;

/// A body that moves straight on. It is represented by its box.
struct StraightFlight {
  Aabb box;
  Vec3 velocity;

  Aabb swept(Real h) const { return box.merged(box.translated(Vec3(h * velocity))); }
  /// Half of the extent of the box along a direction.
  Real extent(const Vec3& n) const { return n.cwiseAbs().dot(box.sizes()) / 2; }
};

/// Returns the time within h at which a body may reach a solid that moves with `other`, by conservative
/// advancement: a convex solid is behind the plane through its point nearest to the centre of the box.
std::optional<Real> time_to(const StraightFlight& body, const Solid& solid, const Pose& pose,
                            const Vec3& other, Real h) {
  const Vec3 velocity = body.velocity - other;
  Real time = 0;
  for (int i = 0; i < kMaxAdvances; ++i) {
    const Vec3 centre = body.box.center() + time * velocity;
    const SurfaceDistance s = signed_distance(solid, pose.point_to_body(centre));
    const Vec3 n = pose.vector_to_world(s.normal);
    const Real gap = s.distance - body.extent(n), closing = -n.dot(velocity);
    if (!(closing > 0)) return {};
    if (gap <= 1e-3 * closing * h) return time;
    time += gap / closing;
    if (time >= h) return {};
  }
  return time;
}

}  // namespace

/// Returns the duration of the first part of a sub-step of length h, or h if it is not divided. A part ends
/// in the middle between the times at which the body may reach the cloth and the other body. In the next
/// part the body has the velocity that the cloth has left, so that the parts get shorter until the cloth
/// stops the body or the body is near the other body.
Real World::Impl::first_part(Real h) {
  if (cloths.empty() || active.awake().empty()) return h;
  const Real ahead = kLookAhead * h, thickness = cloth_motion.thinnest();
  std::optional<std::vector<Aabb>> around;
  Real part = h;
  for (const Body* body : active.awake()) {
    if (!body->def.collides) continue;
    const StraightFlight flight{bounds(body->solid, body->pose), body->rigid.velocity()};
    if (!(h * flight.velocity.norm() > kLeastDistance * thickness)) continue;
    if (!around) around = cloth_motion.reaches(ahead);
    const Aabb swept = flight.swept(ahead);
    if (std::ranges::none_of(*around, [&](const Aabb& box) { return box.intersects(swept); })) continue;
    std::optional<Real> reached;
    bodies.for_each([&](BodyHandle, const std::unique_ptr<Body>& other) {
      if (other.get() == body || !other->collides() || joint_groups.is_collision_disabled(*body, *other))
        return;
      Vec3 velocity = Vec3::Zero();
      if (other->is_awake()) velocity = other->rigid.velocity();
      if (other->is_kinematic()) velocity = other->def.track.at(now, other->def.pose).velocity;
      if (!std::holds_alternative<Plane>(other->def.shape)) {
        const StraightFlight moving{bounds(other->solid, other->pose), velocity};
        if (!moving.swept(ahead).intersects(swept)) return;
      }
      const auto time = time_to(flight, other->solid, other->pose, velocity, reached.value_or(ahead));
      if (time) reached = *time;
    });
    if (!reached) continue;
    const auto met = cloth_motion.first_meeting(flight.box, flight.velocity, *reached);
    if (!met || !((*reached - *met) * flight.velocity.norm() > kLeastDistance * thickness)) continue;
    part = std::min(part, (*met + *reached) / 2);
  }
  return part;
}

}  // namespace offstage::sim
