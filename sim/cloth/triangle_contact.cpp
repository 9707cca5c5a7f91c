#include "sim/cloth/triangle_contact.h"

#include <algorithm>
#include <cmath>

namespace offstage::sim {
namespace {

/// Fraction of an initial overlap that is removed per sub-step.
constexpr Real kTriangleRecovery = 0.2;

}  // namespace

void separate(const TriangleContact& c, const Triangle& t, ClothPoints& points, ClothBody& body, Real dt,
              std::vector<VelocityCut>& cuts) {
  Vec3 motion = -body.surface_motion(c.on_body, c.normal);
  Real mobility = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    motion += c.weights[k] * (points.at(t[k]) - points.start_at(t[k]));
    mobility += c.weights[k] * c.weights[k] * points.inverse_mass[t[k]];
  }
  const Real before = std::min(c.gap - c.normal.dot(motion), 0.0);
  const Real push = -c.gap + (1 - kTriangleRecovery) * before;
  const Real total = mobility + body.mobility(c.on_body, c.normal);
  if (!(push > 0) || !(total > 0)) return;
  Vec3 impulse = push / total * c.normal;
  const Vec3 slip = motion - c.normal.dot(motion) * c.normal;
  const Real length = slip.norm();
  if (length > 0) {
    const Real friction = std::sqrt(points.friction[t[0]] * body.obstacle().friction);
    impulse -= std::min(length, friction * push) / (total * length) * slip;
  }
  // Removing an initial overlap gives no velocity to either side.
  const Vec3 recovery = std::min(push, -kTriangleRecovery * before) / total * c.normal;
  for (std::size_t k = 0; k < 3; ++k) {
    const Real w = points.inverse_mass[t[k]];
    points.position[t[k]] += padded(w * c.weights[k] * impulse);
    if (w == 0) points.pin_impulse[t[k]] += padded(c.weights[k] * (impulse - recovery));
    if (before < 0) cuts.push_back({t[k], padded(w * c.weights[k] * recovery)});
  }
  body.touch(0);
  body.apply_contact_impulse((recovery - impulse) / dt, c.on_body, 1);
}

}  // namespace offstage::sim
