#include "sim/dynamics/force_field.h"

#include <algorithm>
#include <cmath>

#include "sim/collision/distance.h"

namespace offstage::sim {
namespace {

/// 1 in the middle of a region, falling linearly to 0 at the edge, negative outside.
Real depth(const Everywhere&, const Vec3&) {
  return 1;
}
Real depth(const SphereRegion& s, const Vec3& point) {
  return 1 - (point - s.centre).norm() / s.radius;
}
Real depth(const BoxRegion& b, const Vec3& point) {
  return 1 - ((point - b.centre).cwiseAbs().array() / (b.size / 2).array()).maxCoeff();
}

/// A whole power by multiplication: the same bits everywhere.
Real power(Real base, uint32_t exponent) {
  Real result = 1;
  for (; exponent > 0; exponent /= 2, base *= base)
    if (exponent % 2) result *= base;
  return result;
}

Real strength_at_depth(Real depth, uint32_t drop_rate) {
  return depth > 0 ? power(depth, drop_rate) : 0;
}

Vec3 direction(const Vec3& v) {
  const Real length = v.norm();
  return length > 0 ? Vec3(v / length) : Vec3(Vec3::Zero());
}

Wrench at(const ConstantField& f, Real, const RigidMotion& m, const Vec3&) {
  return {strength(f.region, f.drop_rate, m.position) * f.force, Vec3::Zero()};
}
Wrench at(const PointField& f, Real, const RigidMotion& m, const Vec3&) {
  return {strength(f.region, f.drop_rate, m.position) * f.force * direction(f.point - m.position),
          Vec3::Zero()};
}
Wrench at(const WindField& f, Real, const RigidMotion& m, const Vec3&) {
  return {strength(f.region, f.drop_rate, m.position) * f.drag * (f.wind - m.velocity), Vec3::Zero()};
}
Wrench at(const Grab& f, Real time, const RigidMotion& m, const Vec3& centre) {
  const Motion hand = f.track.at(time, Pose{});
  const Vec3 arm = m.orientation * (f.point - centre);
  const Vec3 gap = m.position + arm - hand.pose.position;
  const Vec3 gap_rate = m.velocity + m.angular_velocity.cross(arm) - hand.velocity;
  const Vec3 force = -f.stiffness * gap - f.damping * gap_rate;
  return {force, arm.cross(force)};
}
Wrench at(const Explosion&, Real, const RigidMotion&, const Vec3&) {
  return {};
}

bool is_positive(Real v) {
  return v > 0 && std::isfinite(v);
}
bool is_not_negative(Real v) {
  return v >= 0 && std::isfinite(v);
}

std::string problem(const Everywhere&) {
  return {};
}
std::string problem(const SphereRegion& s) {
  if (!s.centre.allFinite()) return "region.centre is not finite";
  return is_positive(s.radius) ? "" : "region.radius must be a finite number > 0";
}
std::string problem(const BoxRegion& b) {
  if (!b.centre.allFinite()) return "region.centre is not finite";
  return b.size.allFinite() && b.size.minCoeff() > 0 ? "" : "region.size must be finite numbers > 0";
}
std::string problem(const Region& region) {
  return std::visit([](const auto& r) { return problem(r); }, region);
}
std::string problem(const ConstantField& f) {
  return f.force.allFinite() ? problem(f.region) : "force is not finite";
}
std::string problem(const PointField& f) {
  if (!f.point.allFinite()) return "point is not finite";
  return std::isfinite(f.force) ? problem(f.region) : "force is not finite";
}
std::string problem(const WindField& f) {
  if (!f.wind.allFinite()) return "wind is not finite";
  return is_not_negative(f.drag) ? problem(f.region) : "drag must be a finite number >= 0";
}
std::string problem(const Grab& f) {
  if (!f.point.allFinite()) return "point is not finite";
  if (f.track.keys.empty()) return "track has no keys";
  for (std::size_t i = 0; i < f.track.keys.size(); ++i) {
    const Keyframe& key = f.track.keys[i];
    if (!key.pose.position.allFinite()) return "track.keys: a position is not finite";
    if (!std::isfinite(key.time) || (i > 0 && !(key.time > f.track.keys[i - 1].time)))
      return "track.keys: times must be finite and strictly increasing";
  }
  if (!is_not_negative(f.stiffness)) return "stiffness must be a finite number >= 0";
  return is_not_negative(f.damping) ? "" : "damping must be a finite number >= 0";
}
std::string problem(const Explosion& f) {
  if (!f.point.allFinite()) return "point is not finite";
  if (!std::isfinite(f.impulse)) return "impulse is not finite";
  return is_positive(f.radius) ? "" : "radius must be a finite number > 0";
}

}  // namespace

Real strength(const Region& region, uint32_t drop_rate, const Vec3& point) {
  return std::visit([&](const auto& r) { return strength_at_depth(depth(r, point), drop_rate); }, region);
}

std::string problem(const ForceDef& def) {
  if (!std::isfinite(def.start)) return "start is not finite";
  if (!(def.end >= def.start)) return "end must not be before start";
  if (std::holds_alternative<Grab>(def.effect) && def.bodies.size() != 1)
    return "bodies: a grab holds exactly one body";
  return std::visit([](const auto& effect) { return problem(effect); }, def.effect);
}

Wrench wrench(const ForceDef& def, Real time, const RigidMotion& motion, const Vec3& centre) {
  if (!def.is_on(time)) return {};
  return std::visit([&](const auto& effect) { return at(effect, time, motion, centre); }, def.effect);
}

Wrench impulse(const Explosion& explosion, const Solid& solid, const Pose& pose, const Vec3& centre) {
  const Vec3 source = pose.point_to_body(explosion.point);
  const SurfaceDistance surface = signed_distance(solid, source);
  const Real distance = std::max(surface.distance, 0.0);
  const Real size =
      explosion.impulse * strength_at_depth(1 - distance / explosion.radius, explosion.drop_rate);
  if (!(size != 0)) return {};
  // Inside of the body no side is nearer in a way that matters: it is thrown off as a whole.
  if (surface.distance <= 0) return {size * direction(centre - explosion.point), Vec3::Zero()};
  // The gradient of the distance points from the body to the source.
  const Vec3 blow = -size * pose.vector_to_world(surface.normal);
  const Vec3 hit = pose.point_to_world(source - surface.distance * surface.normal);
  return {blow, (hit - centre).cross(blow)};
}

bool ActiveForce::acts_on(const RigidBody& body) const {
  return def->bodies.empty() || std::binary_search(only.begin(), only.end(), &body);
}

}  // namespace offstage::sim
