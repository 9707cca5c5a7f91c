#include "sim/cloth/cloth_system.h"

#include <algorithm>
#include <cmath>

#include "sim/cloth/cloth_integrators.h"

namespace offstage::sim {
namespace {

/// Greatest number of rounds that solve contacts with bodies and the stretch limit together.
constexpr int kMaxTurns = 16;
/// Greatest number of parts into which a sub-step of the world is divided for cloth.
constexpr Real kMaxParts = 1000;
/// Greatest distance by which a body may approach cloth in a sub-step, as a fraction of the mean edge of the
/// triangles.
constexpr Real kMostApproach = 0.1;
/// Number of sub-steps of cloth for which features of bodies near triangles are searched at once. The longer
/// this time is, the more triangles a fast body or cloth may reach in it, and each sub-step looks at all.
constexpr Real kSubstepsPerSearch = 4;
/// Greatest relative displacement of a spring's ends in a sub-step, as a fraction of the spring's length. It
/// is also the greatest angle by which a spring turns; in air and without self-collision, kMostTurn is.
constexpr Real kMostStrain = 1, kMostTurn = 0.25;
/// Greatest number of parts into which a sub-step is divided because of kMostApproach and kMostStrain.
constexpr Real kMostDivision = 16;

/// A cloth is flat if its points are out of a plane by at most this, relative to its size.
constexpr Real kFlat = 1e-9;
/// Velocity with which a flat cloth begins to bend when its seams close, as a fraction of their speed.
constexpr Real kDisturbance = 0.01;

}  // namespace

void ClothSystem::step(const ClothWeather& weather, std::span<ClothBody> bodies) {
  if (cloths_.empty()) return;
  begin_step(weather, bodies);
  const Real speed = contacts_.fastest_approach(points_);
  parts_ = parts_in(weather.h, speed);
  dt_ = weather.h / parts_;
  time_ = weather.time + weather.h;
  Real since_look = 0;  // distance moved by the fastest body since the last look for tears [m]
  Real searched = 0;    // number of sub-steps for which the features near triangles are known
  for (Real k = 0; k < parts_; ++k) {
    if (k >= searched) {
      searched = std::min(k + kSubstepsPerSearch, parts_);
      corner_contacts_.find(points_, contacts_, bodies_, k / parts_, searched / parts_, (searched - k) * dt_);
    }
    for (Cloth* cloth : cloths_) cloth->age += dt_;
    apply_air(dt_, parts_ - k);
    substep(k / parts_, (k + 1) / parts_, dt_);
    ClothWeather next = weather;
    next.time += (k + 1) * dt_;
    next.h = dt_;
    for (std::size_t c = 0; c < cloths_.size(); ++c)
      if (step_leak(*cloths_[c], first_[c], next, points_)) air_[c].expire();
    // A body that moves by more than an edge of the cloth in a sub-step of the world must pass through the
    // holes that it has torn. So torn cloth is updated on the way.
    since_look += speed * dt_;
    if (since_look > corner_contacts_.mean_edge() && k + 1 < parts_) {
      since_look = 0;
      if (any_tears()) {
        tear_within(weather, (k + 1) / parts_);
        searched = k + 1;
      }
    }
  }
  count_penetration();
  write_back();
}

/// Prepares the values that are constant in a sub-step of the world: forces from outside, pins, and the
/// bodies near the points.
void ClothSystem::begin_step(const ClothWeather& weather, std::span<ClothBody> bodies) {
  if (changed_) assemble();
  bodies_ = bodies;
  points_.inverse_mass.resize(points_.size());
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    for (std::size_t i = 0; i < cloths_[c]->points.size(); ++i)  // impacts may have changed them
      points_.velocity[first_[c] + i] = padded(cloths_[c]->velocities[i]);
    add_outer_forces(*cloths_[c], first_[c], weather, points_);
    air_[c].expire();
  }
  disturb_flat_seams();
  for (Cloth* cloth : cloths_) cloth->before = cloth->points;
  adapt_springs();
  find_held(weather.time, bodies);
  find_pin_steps();
  for (const Carrier& carrier : carriers_) carrier.body->accelerate_steadily(weather.gravity);
  contacts_.set_up(-weather.gravity);
  contacts_.find(points_, collides_, bodies, weather.h);
}

/// Returns into how many sub-steps of cloth a sub-step of the world is divided, if bodies approach it at
/// `speed` [m/s].
Real ClothSystem::parts_in(Real h, Real speed) const {
  Real longest = h;
  for (const Cloth* cloth : cloths_) longest = std::min(longest, cloth->def.substep);
  const Real shortest = longest / kMostDivision;
  if (speed > 0)
    longest = std::min(longest, std::max(kMostApproach * corner_contacts_.mean_edge() / speed, shortest));
  // Fast cloth such as torn skin needs short sub-steps. In a long one, springs between a point whose move is
  // shortened and a point whose move is not would gain much more energy than the motion loses.
  // Shreds without self-collision turn fast in the wind. In a long sub-step, the lift of the normal at its
  // start would do work on the rotation.
  if (const Real rate = parts_by_strain(); rate > 0)
    longest = std::min(longest, std::max(1 / rate, shortest));
  return std::clamp(std::ceil(h / longest * (1 - 1e-12)), 1.0, kMaxParts);
}

void ClothSystem::substep(Real from, Real to, Real dt) {
  for (ClothBody& body : bodies_) body.begin(from, to, dt);
  for (ClothBody& body : bodies_) body.take_back_contained();
  points_.start = points_.position;
  cuts_.clear();
  move_held();
  contacts_.find_supports(points_, dt);
  corner_contacts_.find_supports(points_, contacts_, dt);
  integrate(dt);
  stop_diverged(dt);
  apply_pin_impulses_to_bodies(dt);
  close_seams(dt);
  limit_bending(dt);
  limit_.project(points_, carriers_, dt, kick_, cuts_);
  if (!self_contacts_.empty()) self_contacts_.push_apart(points_, dt);
  touch_bodies(dt);
  push_holders(dt);
  shorten_moves(dt);
  end_substep(dt);
}

/// Solves the contacts of cloth with bodies, which push the cloth out of their way. Where springs are too
/// long, contacts and springs are solved together, and linearised again in each round. This includes bodies
/// that cloth does not touch in this sub-step but soon may: cloth under a body often moves ahead of it for a
/// sub-step.
void ClothSystem::touch_bodies(Real dt) {
  contacts_.find_runaways(points_);
  corner_contacts_.solve(points_, contacts_, dt, cuts_);
  contacts_.solve(points_, dt, parts_, cuts_);
  for (int round = 1; round < kMaxTurns && limit_.any_too_long(points_); ++round) {
    body_contacts_.clear();
    contacts_.collect(points_, body_contacts_);
    collect_triangles();
    if (body_contacts_.empty()) break;
    limit_.project_with(body_contacts_, points_, carriers_, dt, kick_, cuts_);
  }
}

/// Collects the contacts of triangles with dynamic bodies. An initial overlap is removed slowly, because the
/// correction counts as velocity.
void ClothSystem::collect_triangles() {
  const std::size_t first = body_contacts_.size();
  corner_contacts_.collect(points_, contacts_, 1, body_contacts_);
  for (BodyContact& c : std::span(body_contacts_).subspan(first)) {
    Vec3 motion = -c.body->surface_motion(c.on_body, c.normal);
    for (std::size_t k = 0; k < 3; ++k)
      motion += c.weights[k] * (points_.at(c.points[k]) - points_.start_at(c.points[k]));
    c.gap -= (1 - kTautRecovery) * std::min(c.gap - c.normal.dot(motion), 0.0);
  }
}

/// Returns into how many parts a second must be divided so that no spring deforms or turns too far in any of
/// them [1/s]; 0 if no cloth needs it.
Real ClothSystem::parts_by_strain() const {
  Real fastest = 0;
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    const ClothDef& def = cloths_[c]->def;
    const bool in_air = def.air.density > 0 && def.air.lift > 0;
    if (cloths_[c]->stopped || (!def.self_collision && !in_air)) continue;
    fastest = std::max(fastest, fastest_spring_rate(points_, springs_of(c)) /
                                    (def.self_collision ? kMostStrain : kMostTurn));
  }
  return fastest;
}

void ClothSystem::adapt_springs() {
  for (std::size_t c = 0; c < cloths_.size(); ++c)
    if (cloths_[c]->def.integrator == ClothIntegrator::relaxed) springs_[c].adapt_to_stretch(points_);
}

/// Updates the drag of the air before a sub-step of length `dt`. `left`: how many sub-steps of cloth remain
/// in the world's sub-step.
void ClothSystem::apply_air(Real dt, Real left) {
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    const bool relaxed = cloths_[c]->def.integrator == ClothIntegrator::relaxed;
    air_[c].renew(points_, dt, static_cast<uint32_t>(left), relaxed ? spring_steps(c, dt) : 1);
  }
}

/// Returns the number of steps of the springs in a sub-step of a cloth with the integrator `relaxed`.
uint32_t ClothSystem::spring_steps(std::size_t cloth, Real dt) const {
  if (cloths_[cloth]->def.soften) return 1;
  const Real longest =
      std::max(std::min(springs_[cloth].longest_step(), pin_step_[cloth]), kShortestSpringStep);
  return static_cast<uint32_t>(std::max(1.0, std::ceil(dt / longest * (1 - 1e-6))));
}

void ClothSystem::integrate(Real dt) {
  // Springs have moved the bodies since the pinned points were placed on them, so the points are placed
  // again.
  for (const Held& held : held_)
    if (held.body) points_.start[held.point] = padded(held.body->start().point_to_world(held.position));
  begin_carriers(dt);
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    const ClothIntegrator integrator = cloths_[c]->def.integrator;
    const ClothRange range{first_[c],        first_[c] + cloths_[c]->points.size(),
                           springs_of(c),    cloths_[c]->bending,
                           air_[c],          gas_[c],
                           bend_limit_of(c), carriers_};
    if (c > 0)  // cloths that were integrated before may have moved the bodies
      update_supports(range);
    if (integrator == ClothIntegrator::symplectic) step_symplectic(points_, range, dt);
    if (integrator == ClothIntegrator::rk4) step_rk4(points_, range, dt, kick_);
    if (integrator == ClothIntegrator::implicit && !step_implicit(points_, range, dt))
      ++cloths_[c]->report.unconverged;
    if (integrator == ClothIntegrator::relaxed &&
        !step_relaxed(points_, range, springs_[c], spring_steps(c, dt), dt, kick_))
      ++cloths_[c]->report.unconverged;
  }
  for (const Held& held : held_) points_.start[held.point] = held.from;
}

/// Updates the motion of dynamic bodies under the supports of a cloth.
void ClothSystem::update_supports(const ClothRange& cloth) {
  const auto update = [](Support& s) {
    if (s.body) s.surface = padded(s.body->surface_motion(s.on_body, s.normal.head<3>()));
  };
  std::ranges::for_each(cloth.supports(points_), update);
  std::ranges::for_each(cloth.triangle_supports(points_), update);
}

/// Limits the bending of cloths whose integrator does not.
void ClothSystem::limit_bending(Real dt) {
  for (BendLimit& limit : bend_limits_) {
    Cloth& cloth = *cloths_[limit.cloth()];
    if (cloth.def.integrator != ClothIntegrator::relaxed) limit.project(points_, dt, kick_, cuts_);
    if (limit.take_acted()) ++cloth.report.bend_limited;
  }
}

BendLimit* ClothSystem::bend_limit_of(std::size_t cloth) {
  const auto at = std::ranges::find(bend_limits_, cloth, &BendLimit::cloth);
  return at == bend_limits_.end() ? nullptr : &*at;
}

/// Shortens seams at a constant rate within their time, and then keeps them closed. A delayed seam does not
/// close faster, because the stretch limit would remove any motion that the neighbouring cloth cannot follow.
void ClothSystem::close_seams(Real dt) {
  for (std::size_t k = 0; k < seams_.size(); ++k) {
    const Cloth& cloth = *cloths_[seams_[k].cloth];
    const Real closed = cloth.def.self_collision ? cloth.def.thickness : 0;
    const Real speed = std::max(seams_[k].open_length, cloth.def.thickness) / cloth.def.seam_time;
    const Real now = limit_.tie_length(k, points_);
    const Real planned = seams_[k].open_length - speed * cloth.age;
    limit_.set_tie(k, std::max({planned, closed, now - speed * dt}));
  }
}

/// Gives the points of an exactly flat cloth with seams a small velocity out of its plane before its first
/// sub-step. Without it the seams compress the cloth in its plane, an equilibrium that no exact computation
/// leaves, and do not close. The momentum is unchanged.
void ClothSystem::disturb_flat_seams() {
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    const Cloth& cloth = *cloths_[c];
    if (cloth.age > 0 || cloth.def.seams.empty() || cloth.stopped || cloth.triangles.empty()) continue;
    const std::span<const Vec4> at = std::span(points_.position).subspan(first_[c], cloth.points.size());
    Vec3 normal = Vec3::Zero();
    Real size2 = 0;
    for (const Triangle& t : cloth.triangles) {
      const Vec3 cross = (at[t[1]] - at[t[0]]).head<3>().cross((at[t[2]] - at[t[0]]).head<3>());
      if (cross.squaredNorm() > normal.squaredNorm()) normal = cross;
    }
    normal.normalize();
    const Vec4 n = padded(normal), origin = at[0];
    for (const Vec4& p : at) size2 = std::max(size2, (p - origin).squaredNorm());
    const auto is_off = [&](const Vec4& p) { return std::abs(n.dot(p - origin)) > kFlat * std::sqrt(size2); };
    if (std::ranges::any_of(at, is_off)) continue;
    // The ends of the seams lag behind the middle of the cloth between them.
    Vec4 along = Vec4::Zero();
    Real open = 0;
    for (const ClothSeam& seam : cloth.def.seams) {
      const Vec4 d = at[seam.b] - at[seam.a];
      along += d.dot(along) < 0 ? Vec4(-d) : d;
      open = std::max(open, d.norm());
    }
    if (!(along.norm() > 0)) continue;
    along.normalize();
    Real low = kInfinity, high = -kInfinity, mass = 0, mean = 0;
    for (const Vec4& p : at) {
      low = std::min(low, along.dot(p));
      high = std::max(high, along.dot(p));
    }
    const auto ahead = [&](const Vec4& p) {
      const Real s = (2 * along.dot(p) - low - high) / (high - low);
      return 1 - s * s;
    };
    for (std::size_t i = 0; i < at.size(); ++i) {
      mass += points_.mass[first_[c] + i];
      mean += points_.mass[first_[c] + i] * ahead(at[i]);
    }

    const Real speed = kDisturbance * open / cloth.def.seam_time;
    for (std::size_t i = 0; i < at.size(); ++i)
      points_.velocity[first_[c] + i] += speed * (ahead(at[i]) - mean / mass) * n;
  }
}

void ClothSystem::end_substep(Real dt) {
  for (std::size_t i = 0; i < points_.size(); ++i)
    if (!points_.carried[i]) points_.velocity[i] = (points_.position[i] - points_.start[i]) / dt + kick_[i];
  std::fill(kick_.begin(), kick_.end(), Vec4::Zero());
  for (const VelocityCut& cut : cuts_) points_.velocity[cut.point] -= cut.move / dt;
}

}  // namespace offstage::sim
