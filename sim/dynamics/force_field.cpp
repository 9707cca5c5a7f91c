#include "sim/dynamics/force_field.h"

#include <algorithm>
#include <cmath>

#include "sim/collision/distance.h"

namespace offstage::sim {
namespace {

Vec3 direction(const Vec3& v) {
  const Real length = v.norm();
  return length > 0 ? Vec3(v / length) : Vec3(Vec3::Zero());
}

/// A body at a stage of the integration, with the properties that forces need besides its motion.
struct Target {
  const RigidMotion& motion;
  const Vec3& centre;
  Real linear_drag;
};

Wrench at(const ConstantField& f, Real, const Target& t) {
  return {strength(f.region, f.drop_rate, t.motion.position) * f.force, Vec3::Zero()};
}
Wrench at(const PointField& f, Real, const Target& t) {
  return {
      strength(f.region, f.drop_rate, t.motion.position) * f.force * direction(f.point - t.motion.position),
      Vec3::Zero()};
}
template <class Flow>
Wrench in_air(const Flow& f, const Vec3& air, const Target& t) {
  return {strength(f.region, f.drop_rate, t.motion.position) *
              air_drag(f.drag, t.linear_drag, air, t.motion.velocity),
          Vec3::Zero()};
}
Wrench at(const WindField& f, Real, const Target& t) {
  return in_air(f, f.wind, t);
}
Wrench at(const Vortex& f, Real, const Target& t) {
  return in_air(f, velocity(f, t.motion.position), t);
}
Wrench at(const Turbulence& f, Real time, const Target& t) {
  return in_air(f, TurbulentFlow(f, time).velocity(t.motion.position), t);
}
Wrench at(const Grab& f, Real time, const Target& t) {
  const RigidMotion& m = t.motion;
  const Motion hand = f.track.at(time, Pose{});
  const Vec3 arm = m.orientation * (f.point - t.centre);
  const Vec3 gap = m.position + arm - hand.pose.position;
  const Vec3 gap_rate = m.velocity + m.angular_velocity.cross(arm) - hand.velocity;
  const Vec3 force = -f.stiffness * gap - f.damping * gap_rate;
  return {force, arm.cross(force)};
}
Wrench at(const AppliedForce& f, Real time, const Target& t) {
  using Six = Eigen::Array<Real, 6, 1>;
  const auto key = [&](std::size_t k) -> CurveKey<6> {
    Six value;
    value << f.keys[k].force.array(), f.keys[k].torque.array();
    return {f.keys[k].time, value, f.keys[k].interpolation};
  };
  Six now;
  if (!(time > f.keys.front().time))
    now = key(0).value;
  else if (time >= f.keys.back().time)
    now = key(f.keys.size() - 1).value;
  else
    now = sample_segment<6>(f.keys.size(), key, false,
                            segment_at(
                                f.keys.size(), [&](std::size_t k) { return f.keys[k].time; }, time),
                            time)
              .value;
  Vec3 force = now.head<3>(), torque = now.tail<3>();
  if (f.body_axes) force = t.motion.orientation * force, torque = t.motion.orientation * torque;
  const Vec3 arm = f.point ? Vec3(t.motion.orientation * (*f.point - t.centre)) : Vec3(Vec3::Zero());
  return {force, torque + arm.cross(force)};
}
Wrench at(const Explosion&, Real, const Target&) {
  return {};
}
template <class PairLaw>
Wrench at(const PairLaw&, Real, const Target&) {
  static_assert(kIsPairLaw<PairLaw>);
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
  if (!s.centre.allFinite()) return "region.centre must be finite";
  return is_positive(s.radius) ? "" : "region.radius must be a finite number > 0";
}
std::string problem(const BoxRegion& b) {
  if (!b.centre.allFinite()) return "region.centre must be finite";
  return b.size.allFinite() && b.size.minCoeff() > 0 ? "" : "region.size must have finite numbers > 0";
}
std::string problem(const Region& region) {
  return std::visit([](const auto& r) { return problem(r); }, region);
}
std::string problem(const ConstantField& f) {
  return f.force.allFinite() ? problem(f.region) : "force must be finite";
}
std::string problem(const PointField& f) {
  if (!f.point.allFinite()) return "point must be finite";
  return std::isfinite(f.force) ? problem(f.region) : "force must be finite";
}
std::string problem(const WindField& f) {
  if (!f.wind.allFinite()) return "wind must be finite";
  return is_not_negative(f.drag) ? problem(f.region) : "drag must be a finite number >= 0";
}
std::string problem(const Vortex& f) {
  if (!f.point.allFinite()) return "point must be finite";
  if (!f.axis.allFinite() || !(f.axis.norm() > 0)) return "axis must be finite and not 0 0 0";
  if (!std::isfinite(f.circulation)) return "circulation must be finite";
  if (!is_positive(f.radius)) return "radius must be a finite number > 0";
  return is_not_negative(f.drag) ? problem(f.region) : "drag must be a finite number >= 0";
}
std::string problem(const Turbulence& f) {
  if (!is_not_negative(f.speed)) return "speed must be a finite number >= 0";
  if (!is_positive(f.scale)) return "scale must be a finite number > 0";
  if (f.octaves < 1 || f.octaves > Turbulence::kMaxOctaves) return "octaves must be 1 to 8";
  if (!is_not_negative(f.lifetime)) return "lifetime must be a finite number >= 0";
  if (!f.drift.allFinite()) return "drift must be finite";
  return is_not_negative(f.drag) ? problem(f.region) : "drag must be a finite number >= 0";
}
std::string problem(const MutualGravitation& f) {
  if (!is_not_negative(f.constant)) return "constant must be a finite number >= 0";
  if (!is_not_negative(f.softening)) return "softening must be a finite number >= 0";
  return is_not_negative(f.cut_off) ? problem(f.region) : "cut_off must be a finite number >= 0";
}
std::string problem(const Coulomb& f) {
  if (!is_not_negative(f.constant)) return "constant must be a finite number >= 0";
  if (!is_not_negative(f.softening)) return "softening must be a finite number >= 0";
  return is_not_negative(f.cut_off) ? problem(f.region) : "cut_off must be a finite number >= 0";
}
std::string problem(const LennardJones& f) {
  if (!is_not_negative(f.epsilon)) return "epsilon must be a finite number >= 0";
  if (!is_positive(f.sigma)) return "sigma must be a finite number > 0";
  return is_not_negative(f.cut_off) ? problem(f.region) : "cut_off must be a finite number >= 0";
}
std::string problem(const Grab& f) {
  if (!f.point.allFinite()) return "point must be finite";
  if (f.track.keys.empty()) return "track has no keys";
  for (std::size_t i = 0; i < f.track.keys.size(); ++i) {
    const Keyframe& key = f.track.keys[i];
    if (!key.pose.position.allFinite()) return "track.keys: a position must be finite";
    if (!std::isfinite(key.time) || (i > 0 && !(key.time > f.track.keys[i - 1].time)))
      return "track.keys: times must be finite and strictly increasing";
  }
  if (!is_not_negative(f.stiffness)) return "stiffness must be a finite number >= 0";
  if (!is_not_negative(f.damping)) return "damping must be a finite number >= 0";
  return f.reach > 0 ? "" : "reach must be > 0";
}
std::string problem(const AppliedForce& f) {
  if (f.keys.empty()) return "keys are missing, at least one is needed";
  if (f.point && !f.point->allFinite()) return "point must be finite";
  for (std::size_t i = 0; i < f.keys.size(); ++i) {
    const AppliedForce::Key& key = f.keys[i];
    if (!key.force.allFinite() || !key.torque.allFinite()) return "keys: a force or torque must be finite";
    if (!std::isfinite(key.time) || (i > 0 && !(key.time > f.keys[i - 1].time)))
      return "keys: times must be finite and strictly increasing";
  }
  return {};
}
std::string problem(const Explosion& f) {
  if (!f.point.allFinite()) return "point must be finite";
  if (!std::isfinite(f.impulse)) return "impulse must be finite";
  return is_positive(f.radius) ? "" : "radius must be a finite number > 0";
}

}  // namespace

Vec3 velocity(const Vortex& vortex, const Vec3& point) {
  constexpr Real kTwoPi = 6.28318530717958647692;
  const Vec3 axis = vortex.axis.normalized(), turned = axis.cross(point - vortex.point);
  return vortex.circulation / (kTwoPi * (turned.squaredNorm() + vortex.radius * vortex.radius)) * turned;
}

bool ForceDef::acts_on(BodyHandle body) const {
  return is_unrestricted() || std::find(bodies.begin(), bodies.end(), body) != bodies.end();
}
bool ForceDef::acts_on(ParticleSystemHandle system) const {
  return std::find(systems.begin(), systems.end(), system) != systems.end();
}
bool ForceDef::acts_on(ClothHandle cloth) const {
  return (is_unrestricted() && !is_pairwise()) ||
         std::find(cloths.begin(), cloths.end(), cloth) != cloths.end();
}
bool ForceDef::is_pairwise() const {
  return std::visit([]<class E>(const E&) { return kIsPairLaw<E>; }, effect);
}

bool ForceDef::changes() const {
  if (is_explosion() || is_pairwise()) return false;
  const auto* grab = std::get_if<Grab>(&effect);
  const auto* applied = std::get_if<AppliedForce>(&effect);
  return start > 0 || end < std::numeric_limits<Real>::infinity() || (grab && grab->track.moves()) ||
         std::holds_alternative<Turbulence>(effect) || (applied && applied->keys.size() > 1);
}

std::string problem(const ForceDef& def) {
  if (!std::isfinite(def.start)) return "start must be finite";
  if (!(def.end >= def.start)) return "end must not be before start";
  const bool holds_body = def.bodies.size() == 1 && def.systems.empty();
  const bool holds_particles = def.bodies.empty() && !def.systems.empty();
  const bool holds_cloths = def.bodies.empty() && def.systems.empty() && !def.cloths.empty();
  if (std::holds_alternative<Grab>(def.effect) && !holds_body && !holds_particles && !holds_cloths)
    return "bodies: a grab holds exactly one body, or particle systems, or cloths";
  if (std::holds_alternative<AppliedForce>(def.effect) &&
      (def.bodies.empty() || !def.systems.empty() || !def.cloths.empty()))
    return "bodies: an applied force acts on named bodies, and on nothing else";
  if (def.is_pairwise() && !holds_particles)
    return "systems: a force between particles needs particle systems, and no bodies";
  return std::visit([](const auto& effect) { return problem(effect); }, def.effect);
}

Wrench wrench(const ForceDef& def, Real time, const RigidMotion& motion, const Vec3& centre,
              Real linear_drag) {
  return def.is_on(time) ? effect_wrench(def, time, motion, centre, linear_drag) : Wrench{};
}

Wrench effect_wrench(const ForceDef& def, Real time, const RigidMotion& motion, const Vec3& centre,
                     Real linear_drag) {
  const Target target{motion, centre, linear_drag};
  return std::visit([&](const auto& effect) { return at(effect, time, target); }, def.effect);
}

Wrench impulse(const Explosion& explosion, const Solid& solid, const Pose& pose, const Vec3& centre) {
  const Vec3 source = pose.point_to_body(explosion.point);
  const SurfaceDistance surface = signed_distance(solid, source);
  const Real distance = std::max(surface.distance, 0.0);
  const Real size =
      explosion.impulse * strength_at_depth(1 - distance / explosion.radius, explosion.drop_rate);
  if (!(size != 0)) return {};
  // An explosion inside the body pushes it from the explosion towards its centre of mass, without rotation.
  if (surface.distance <= 0) return {size * direction(centre - explosion.point), Vec3::Zero()};
  // The gradient of the distance points from the body to the source.
  const Vec3 push = -size * pose.vector_to_world(surface.normal);
  const Vec3 hit = pose.point_to_world(source - surface.distance * surface.normal);
  return {push, (hit - centre).cross(push)};
}

Vec3 impulse(const Explosion& explosion, const Vec3& point) {
  const Vec3 offset = point - explosion.point;
  return explosion.impulse * strength_at_depth(1 - offset.norm() / explosion.radius, explosion.drop_rate) *
         direction(offset);
}

bool ActiveForce::acts_on(const RigidBody& body) const {
  if (def->bodies.empty()) return def->is_unrestricted();
  return std::binary_search(only.begin(), only.end(), &body);
}

}  // namespace offstage::sim
