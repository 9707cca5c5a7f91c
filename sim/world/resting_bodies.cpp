#include "sim/world/resting_bodies.h"

#include <algorithm>
#include <array>
#include <map>
#include <vector>

#include "sim/contact/contact_terms.h"

namespace offstage::sim {
namespace {

/// Bodies slide on each other above this speed [m/s]. Their friction has then acted already.
constexpr Real kSlides = 0.01;
/// A body on a chain of bodies is held along a contact's normal if the normals of the chain turn by less than
/// 45 degrees from body to body, and if there are at most this many bodies between it and a held one.
constexpr Real kSameWay = 0.7;
constexpr int kLongestChain = 8;

/// One of the bodies of a pair, and the other one.
struct Side {
  const Body *body, *other;
  Real sign;  // of the pair's normal, to the body
};

std::array<Side, 2> sides(const ContactPair& pair) {
  return {Side{&pair.a(), &pair.b(), 1}, Side{&pair.b(), &pair.a(), -1}};
}

/// The dynamic bodies that others hold along some normals.
class HeldBodies {
 public:
  /// Finds the bodies on chains of contacts with force, which begin at a body that cloth cannot move.
  explicit HeldBodies(std::span<ContactPair* const> pairs) {
    bool changed = true;
    for (int n = 0; n < kLongestChain && changed; ++n) {
      changed = false;
      for (const ContactPair* pair : pairs)
        for (const Side& side : sides(*pair)) changed |= side.body->is_awake() && extend(*pair, side);
    }
  }
  /// Whether nothing but a contact with a held body ends the motion of a body against `normal`.
  bool is_held(const Body& body, const Vec3& normal) const {
    if (!body.is_awake()) return true;
    const auto found = normals_.find(body.handle.index);
    return found != normals_.end() &&
           std::ranges::any_of(found->second, [&](const Vec3& n) { return n.dot(normal) > kSameWay; });
  }

 private:
  bool extend(const ContactPair& pair, const Side& side) {
    bool changed = false;
    for (const PlacedManifold& m : pair.manifolds()) {
      const Vec3 normal = side.sign * m.frame.n;
      bool has_force = false;
      for (uint32_t k = 0; k < m.manifold.count; ++k) has_force |= m.forces[k].now.x() > 0;
      if (!has_force || !is_held(*side.other, normal) || is_held(*side.body, normal)) continue;
      normals_[side.body->handle.index].push_back(normal);
      changed = true;
    }
    return changed;
  }

  std::map<uint32_t, std::vector<Vec3>> normals_;  // by slot
};

/// Displacement in the interval of the point of a body at `place` at its start, for small rotations.
Vec3 displacement(const Body& body, const Vec3& place) {
  if (!body.can_move()) return Vec3::Zero();
  const bool dynamic = body.is_dynamic();
  const Vec3 from = dynamic ? body.start.position : body.start_pose.position;
  const Vec3 to = dynamic ? body.rigid.position : body.pose.position;
  const Vec3 turn = rotation_vector(body.start_pose.orientation, body.pose.orientation);
  return to - from + turn.cross(place - from);
}

/// Velocity of the body's surface at `place` at the end of the interval.
Vec3 surface_velocity(const Body& body, const Vec3& place) {
  const Vec3 conveyed = body.pose.vector_to_world(body.def.surface_velocity);
  if (body.is_awake())
    return conveyed + body.rigid.velocity() +
           body.rigid.angular_velocity().cross(place - body.rigid.position);
  return body.is_kinematic() ? Vec3(conveyed + body.drive.at(place - body.pose.position)) : conveyed;
}

Real mobility(const Body& body, const Vec3& place, const Vec3& normal) {
  const Vec3 turning = (place - body.rigid.position).cross(normal);
  return 1 / body.rigid.mass + turning.dot(body.rigid.angular_velocity(body.rigid.orientation, turning));
}

uint32_t point_count(const ContactPair& pair) {
  uint32_t count = 0;
  for (const PlacedManifold& m : pair.manifolds()) count += m.manifold.count;
  return count;
}

void add_contacts(const ContactPair& pair, const Side& side, const HeldBodies& held, Real h,
                  std::vector<RestingContact>& found) {
  for (const PlacedManifold& m : pair.manifolds()) {
    const Vec3 normal = side.sign * m.frame.n;
    const bool is_held = held.is_held(*side.other, normal);
    for (uint32_t k = 0; k < m.manifold.count; ++k) {
      const ContactPoint& point = m.manifold.points[k];
      const Vec3 place = (point.on_a + point.on_b) / 2;
      const Real gap =
          point.separation + normal.dot(displacement(*side.body, place) - displacement(*side.other, place));
      const Vec3 arm = place - side.body->start.position, at = side.body->rigid.position + arm;
      const Vec3 velocity = surface_velocity(*side.body, at) - surface_velocity(*side.other, at);
      const Real leaves = normal.dot(velocity);
      const Real slack = gap <= kTouching ? 0 : std::max(std::min(gap / h, gap / h + leaves), 0.0);
      const bool slides = (velocity - leaves * normal).norm() > kSlides;
      // The impulses of all contacts of the pair move the other body.
      const Real yield = is_held ? 0 : point_count(pair) * mobility(*side.other, at, normal);
      found.push_back({arm, normal, slack, side.other->handle.index, yield,
                       slides ? 0 : pair.surface().friction, std::max(m.forces[k].now.x(), 0.0) * h});
    }
  }
}

}  // namespace

void find_resting_contacts(std::span<ContactPair* const> pairs, Real h,
                           std::map<uint32_t, std::vector<RestingContact>>& contacts) {
  if (contacts.empty()) return;
  const HeldBodies held(pairs);
  for (const ContactPair* pair : pairs)
    for (const Side& side : sides(*pair))
      if (const auto of_body = contacts.find(side.body->handle.index); of_body != contacts.end())
        add_contacts(*pair, side, held, h, of_body->second);
}

void set_resting_contacts(const WorldState& world, std::span<ContactPair* const> pairs, Real h,
                          std::span<ClothBody> near) {
  std::map<uint32_t, std::vector<RestingContact>> contacts;  // by slot
  for (const ClothBody& body : near)
    if (body.is_dynamic() && world.body_at(body.obstacle().body).is_awake()) contacts[body.obstacle().body];
  find_resting_contacts(pairs, h, contacts);
  for (ClothBody& body : near)
    if (const auto found = contacts.find(body.obstacle().body); found != contacts.end())
      body.set_resting(std::move(found->second));
}

}  // namespace offstage::sim
