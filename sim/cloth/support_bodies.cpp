#include "sim/cloth/support_bodies.h"

#include <algorithm>

#include "sim/cloth/cloth_bodies.h"

namespace offstage::sim {

SupportBodies::SupportBodies(const ClothPoints& points, std::span<const Support> supports,
                             std::span<const TriangleSupport> of_triangles, Real h)
    : h_(h) {
  contacts_.reserve(supports.size() + of_triangles.size());
  for (const Support& s : supports) add(s, points.inverse_mass[s.point], points.mass[s.point]);
  for (const TriangleSupport& s : of_triangles) {
    Real inverse_mass = 0;
    for (std::size_t k = 0; k < 3; ++k)
      inverse_mass += s.weights[k] * s.weights[k] * points.inverse_mass[s.corners[k]];
    add(s, inverse_mass, 1 / inverse_mass);
  }
}

void SupportBodies::add(const Support& s, Real inverse_mass, Real mass) {
  Contact contact{kNone, Vec3::Zero(), inverse_mass, mass};
  if (s.body) {
    const auto at = std::ranges::find(bodies_, s.body, &Moved::body);
    contact.body = static_cast<uint32_t>(at - bodies_.begin());
    if (at == bodies_.end()) bodies_.push_back({.body = s.body, .resting = s.body->resting().scaled(h_)});
    contact.arm = s.on_body - s.body->centre();
    contact.effective_mass = 1 / (inverse_mass + s.body->mobility(s.on_body, s.normal.head<3>()));
  }
  contacts_.push_back(contact);
}

Real SupportBodies::displacement(std::size_t k, const Support& support) const {
  const Contact& contact = contacts_[k];
  if (contact.body == kNone) return 0;
  const Moved& on = bodies_[contact.body];
  return support.normal.head<3>().dot(on.shift + on.move + (on.turn + on.spin).cross(contact.arm));
}

void SupportBodies::push(std::size_t k, const Vec4& impulse) {
  const Contact& contact = contacts_[k];
  if (contact.body == kNone || impulse.isZero(0)) return;
  Moved& on = bodies_[contact.body];
  const Vec3 given = impulse.head<3>(), turning = contact.arm.cross(given);
  const Vec6 change = on.body->free_change(given, turning);
  on.impulse += given;
  on.angular += turning;
  on.move += change.head<3>();
  on.spin += change.tail<3>();
  if (on.resting.empty()) return;
  // One sweep is enough: each impulse of a point makes another one, and ClothBody solves to the end.
  const Vec6 before = h_ * on.body->gained();
  Vec6 gained = before + (Vec6() << on.move, on.spin).finished();
  on.resting.respond(gained, 1);
  on.move = (gained - before).head<3>();
  on.spin = (gained - before).tail<3>();
}

Vec4 SupportBodies::apply_friction(std::size_t k, const Support& support, Real part, const Vec4& move) {
  const Contact& contact = contacts_[k];
  Vec4 relative = move - part * support.surface;
  if (contact.body != kNone) {
    const Moved& on = bodies_[contact.body];
    relative -= padded(on.move + on.spin.cross(contact.arm));
  }
  const Vec4 slip = relative - support.normal.dot(relative) * support.normal;
  const Real length = slip.norm();
  if (!(length > 0)) return Vec4::Zero();
  Real mobility = contact.inverse_mass;
  if (contact.body != kNone) mobility += support.body->mobility(support.on_body, -slip.head<3>() / length);
  const Real pressed = support.impulse + part * part * support.load;
  const Real stopped = std::min(1.0, support.friction * pressed * mobility / length);
  const Vec4 change = stopped * (contact.inverse_mass / mobility) * slip;
  push(k, change / contact.inverse_mass);
  return -change;
}

void SupportBodies::advance() {
  for (Moved& on : bodies_) {
    on.shift += on.move;
    on.turn += on.spin;
  }
}

void SupportBodies::apply() {
  for (const Moved& on : bodies_) {
    if (on.impulse == Vec3::Zero() && on.angular == Vec3::Zero()) continue;
    const auto both = [](const Vec3& a, const Vec3& b) { return (Vec6() << a, b).finished(); };
    on.body->apply_impulses(both(on.impulse, on.angular) / h_, both(on.shift, on.turn));
  }
}

}  // namespace offstage::sim
