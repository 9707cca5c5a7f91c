/// The part of ClothSystem for pinned points. Points are pinned to the world or to bodies, and the cloth
/// exerts forces on these bodies.

#include <algorithm>

#include "sim/cloth/cloth_system.h"
#include "sim/cloth/pinned_bodies.h"

namespace offstage::sim {

/// Finds the pinned points of this sub-step of the world. They have no inverse mass in it.
void ClothSystem::find_held(Real time, std::span<ClothBody> bodies) {
  held_.clear();
  carriers_.clear();
  points_.holder.assign(points_.size(), nullptr);
  points_.carried.assign(points_.size(), 0);
  for (std::size_t i = 0; i < points_.size(); ++i) points_.inverse_mass[i] = 1 / points_.mass[i];
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    Cloth& cloth = *cloths_[c];
    std::erase_if(cloth.pins, [&](const ClothPin& pin) { return pin.until <= time; });
    for (const ClothPin& pin : cloth.pins) {
      const auto point = static_cast<uint32_t>(first_[c]) + pin.vertex;
      ClothBody* body = nullptr;
      if (pin.body) {
        const auto at = std::ranges::lower_bound(bodies, pin.body.index, {},
                                                 [](const ClothBody& b) { return b.obstacle().body; });
        if (at == bodies.end() || at->obstacle().body != pin.body.index) continue;
        body = &*at;
      }
      points_.inverse_mass[point] = 0;
      points_.holder[point] = body;
      held_.push_back({point, body, pin.position});
      if (body && body->is_dynamic()) attach(point, *body, pin.position);
    }
    set_clamps(c);
    if (cloth.stopped)
      std::fill_n(points_.inverse_mass.begin() + static_cast<std::ptrdiff_t>(first_[c]), cloth.points.size(),
                  0.0);
  }
}

void ClothSystem::attach(uint32_t point, ClothBody& body, const Vec3& place) {
  auto at = std::ranges::find(carriers_, &body, &Carrier::body);
  if (at == carriers_.end()) at = carriers_.insert(at, {.body = &body, .points = {}, .places = {}});
  at->points.push_back(point);
  at->places.push_back(place);
  points_.carried[point] = 1;
}

/// Marks triangles as clamped whose corners are all pinned to the same body.
void ClothSystem::set_clamps(std::size_t c) {
  Cloth& cloth = *cloths_[c];
  if (cloth.bending.empty()) return;
  std::vector<uint32_t> clamp(cloth.points.size(), 0);
  for (const Held& held : held_)
    if (points_.cloth[held.point] == c)
      clamp[held.point - first_[c]] = held.body ? 2 + held.body->obstacle().body : 1;
  cloth.bending.set_clamps(clamp);
}

void ClothSystem::move_held() {
  for (Held& held : held_) {
    held.from = points_.position[held.point];
    points_.position[held.point] =
        padded(held.body ? held.body->end().point_to_world(held.position) : held.position);
    points_.pin_impulse[held.point].setZero();
  }
}

/// Applies the impulses at pins to the bodies. Bodies move in the same way as points of the cloth: impulses
/// at the start of the sub-step act at once, impulses at its end act from the next sub-step on, and half of
/// the impulses within it acts at once. Bodies carry the mass of their pinned points, so they also provide
/// the impulse that accelerates these points.
void ClothSystem::apply_pin_impulses_to_bodies(Real dt) {
  const auto impulse_on = [&](uint32_t i) {
    const Vec4 impulse = points_.pin_impulse[i] / dt;
    points_.pin_impulse[i].setZero();
    return Vec3(impulse.head<3>());
  };
  for (const Carrier& carrier : carriers_) {
    const ClothBody& body = *carrier.body;
    auto [sum, moving] = inertia_of(carrier, dt);
    for (uint32_t i : carrier.points) {
      const Vec3 p = points_.at(i), arm = p - body.centre(), load = impulse_on(i);
      const Vec6 impulse = stacked(load, arm.cross(load));
      sum += impulse;
      // With `relaxed`, the body has moved in the steps of the springs, with carrier.early.
      if (cloths_[points_.cloth[i]]->def.integrator != ClothIntegrator::relaxed)
        moving += fraction_at_once(points_.cloth[i], dt) * impulse;
      points_.velocity[i] = padded(body.velocity_now(p));
    }
    carrier.apply_loads(sum, moving + carrier.early, points_);
  }
  for (const Held& held : held_)
    if (held.body && !held.body->is_dynamic()) {
      const Vec4 weight = dt * points_.mass[held.point] * points_.acceleration[held.point];
      held.body->record_pin_impulse(impulse_on(held.point) + weight.head<3>(), points_.at(held.point));
    }
}

/// Returns the impulse and angular impulse of the weight and the inertia of a body's pinned points, and the
/// part of them that displaces the body in this sub-step. The lag is the impulse that the points need to move
/// with the body.
std::pair<Vec6, Vec6> ClothSystem::inertia_of(const Carrier& carrier, Real dt) const {
  const ClothBody& body = *carrier.body;
  Vec6 sum = Vec6::Zero(), moving = Vec6::Zero();
  for (uint32_t i : carrier.points) {
    const Vec3 p = points_.at(i), arm = p - body.centre();
    const Vec3 weight = dt * points_.mass[i] * points_.acceleration[i].head<3>();
    const Vec3 lag = points_.mass[i] * (points_.velocity[i].head<3>() - body.velocity_now(p));
    // The part of the lag that is due to a constant acceleration displaces by half of its impulse, too.
    const Vec3 impulse = weight + lag, early = fraction_at_once(points_.cloth[i], dt) * weight + lag +
                                               points_.mass[i] / 2 * body.steady_change(p);
    sum += stacked(impulse, arm.cross(impulse));
    moving += stacked(early, arm.cross(early));
  }
  return {sum, moving};
}

/// Prepares the bodies for the steps of the springs, in which they move.
void ClothSystem::begin_carriers(Real dt) {
  for (Carrier& carrier : carriers_) {
    carrier.inertia = inertia_of(carrier, dt).second;
    carrier.early.setZero();
  }
}

/// Finds the longest steps of the springs for the bodies to which they are pinned.
void ClothSystem::find_pin_steps() {
  pin_step_.assign(cloths_.size(), kInfinity);
  for (std::size_t c = 0; c < cloths_.size(); ++c)
    if (cloths_[c]->def.integrator == ClothIntegrator::relaxed && !cloths_[c]->def.soften)
      pin_step_[c] = longest_pin_step(points_, springs_of(c), carriers_);
}

/// Returns the fraction of the springs' impulses that moves bodies already in this sub-step.
Real ClothSystem::fraction_at_once(std::size_t cloth, Real dt) const {
  switch (cloths_[cloth]->def.integrator) {
    case ClothIntegrator::implicit:
      return 0;
    case ClothIntegrator::rk4:
      return 0.5;
    case ClothIntegrator::relaxed:
      return 0.5 + 0.5 / spring_steps(cloth, dt);
    case ClothIntegrator::symplectic:
      return 1;
  }
  return 1;
}

/// Applies the impulses of contacts and of the stretch limit on pinned points to the bodies that hold these
/// points.
void ClothSystem::push_holders(Real dt) {
  for (const Held& held : held_) {
    Vec4& pin_impulse = points_.pin_impulse[held.point];
    if (!held.body || pin_impulse.isZero(0)) continue;
    const Vec3 impulse = pin_impulse.head<3>() / dt;
    pin_impulse.setZero();
    if (held.body->is_dynamic())
      held.body->apply_contact_impulse(impulse, points_.at(held.point), 1);
    else
      held.body->record_pin_impulse(impulse, points_.at(held.point));
  }
  for (const Carrier& carrier : carriers_) carrier.place(points_);
}

}  // namespace offstage::sim
