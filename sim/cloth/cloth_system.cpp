#include "sim/cloth/cloth_system.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "sim/cloth/cloth_integrators.h"
#include "sim/cloth/tearing.h"

namespace offstage::sim {
namespace {

/// Solutions for contacts with bodies and the stretch limit together.
constexpr int kMaxTurns = 16;
/// Substeps of cloth in one of the world.
constexpr Real kMaxParts = 1000;
/// Stretch is not limited so that cloth could not tear: the limit is at least this much above.
constexpr Real kBeyondTear = 1.2;
/// How far a body that pushes cloth may come towards it in a sub-step, in edges of triangles.
constexpr Real kMostApproach = 0.1;
/// Into how many a sub-step is divided for that, at most.
constexpr Real kMostDivision = 16;
/// How far the ends of a spring may move against each other in a sub-step, in lengths of the spring.
constexpr Real kMostStrain = 1;
/// A cloth with a point that is faster than this has diverged [m/s]; waves along a thread are ten times
/// slower.
constexpr Real kLostSpeed = 5000;

}  // namespace

void ClothSystem::assign(std::vector<Cloth*> cloths) {
  cloths_ = std::move(cloths);
  changed_ = true;
}

/// Lays out the points and springs of all cloths after each other.
void ClothSystem::assemble() {
  changed_ = false;
  points_ = {};
  first_.clear();
  collides_.clear();
  seams_.clear();
  all_springs_.clear();
  first_spring_.clear();
  std::vector<StretchLimit::Limit> limits, ties;
  std::vector<Triangle> colliding, touching;  // cloth; bodies
  for (uint32_t c = 0; c < cloths_.size(); ++c) {
    Cloth& cloth = *cloths_[c];
    cloth.assign_bending();
    if (cloth.def.pressure != 0) cloth.gas.assign(cloth.triangles);
    const auto first = static_cast<uint32_t>(points_.size());
    first_.push_back(first);
    for (std::size_t i = 0; i < cloth.points.size(); ++i) {
      points_.position.push_back(padded(cloth.points[i]));
      points_.velocity.push_back(padded(cloth.velocities[i]));
      points_.rest.push_back(padded(cloth.rest[i]));
      points_.mass.push_back(cloth.masses[i]);
      points_.thickness.push_back(cloth.def.thickness);
      points_.friction.push_back(cloth.def.friction);
      points_.self_friction.push_back(cloth.def.self_friction);
      points_.cloth.push_back(c);
      collides_.push_back(cloth.def.collides && !cloth.stopped);
    }
    first_spring_.push_back(all_springs_.size());
    for (ClothSpring s : cloth.springs) {
      s.a += first;
      s.b += first;
      for (uint32_t& end : s.counterpart) end += first;
      all_springs_.push_back(s);
      Real limit = s.kind == SpringKind::stretch ? cloth.def.max_stretch
                   : s.kind == SpringKind::shear ? cloth.def.max_shear
                                                 : 0;
      if (limit > 0 && s.kind == SpringKind::stretch) limit = std::max(limit, kBeyondTear * cloth.def.tear);
      if (limit > 0) limits.push_back({s.a, s.b, s.rest_length, limit * s.rest_length, cloth.def.tear > 0});
    }
    if (cloth.def.collides && !cloth.stopped)
      for (const Triangle& t : cloth.triangles)
        touching.push_back({first + t[0], first + t[1], first + t[2]});
    if (cloth.def.self_collision)
      for (const Triangle& t : cloth.triangles)
        colliding.push_back({first + t[0], first + t[1], first + t[2]});
    for (std::size_t k = 0; k < cloth.def.seams.size(); ++k) {
      seams_.push_back({c, cloth.seam_lengths[k]});
      ties.push_back({first + cloth.def.seams[k].a, first + cloth.def.seams[k].b, 0, 0});
    }
  }
  first_spring_.push_back(all_springs_.size());
  kick_.assign(points_.size(), Vec4::Zero());
  points_.moves.assign(points_.size(), Vec4::Zero());
  points_.start = points_.position;
  points_.outer.assign(points_.size(), Vec4::Zero());
  points_.acceleration = points_.flow = points_.outer;
  points_.field_drag.assign(points_.size(), 0);
  points_.pull.assign(points_.size(), Vec4::Zero());
  springs_.clear();
  springs_.resize(cloths_.size());
  for (std::size_t c = 0; c < cloths_.size(); ++c)
    if (cloths_[c]->def.integrator == ClothIntegrator::relaxed) springs_[c].assign(springs_of(c), points_);
  air_.resize(cloths_.size());
  for (std::size_t c = 0; c < cloths_.size(); ++c) air_[c].assign(*cloths_[c], first_[c]);
  drift_.assign(points_.size(), Vec4::Zero());
  pieces_.assign(points_.size());
  for (const ClothSpring& s : all_springs_) pieces_.join(s.a, s.b);
  for (const StretchLimit::Limit& t : ties) pieces_.join(t.a, t.b);
  pieces_.keep();
  limit_.assign(std::move(limits), std::move(ties), points_.size());
  self_contacts_.assign(std::move(colliding), points_);
  corner_contacts_.assign(std::move(touching), points_);
}

Aabb ClothSystem::reach(Real h) const {
  Aabb box;
  for (const Cloth* cloth : cloths_)
    for (std::size_t i = 0; i < cloth->points.size(); ++i) {
      const Vec3 around = Vec3::Constant(2 * cloth->def.thickness + 2 * h * cloth->velocities[i].norm());
      box.extend(Vec3(cloth->points[i] - around));
      box.extend(Vec3(cloth->points[i] + around));
    }
  return box;
}

/// What pins hold has no inverse mass in this sub-step of the world.
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
                                                 [](const ClothBody& b) { return b.way().body; });
        if (at == bodies.end() || at->way().body != pin.body.index) continue;
        body = &*at;
      }
      points_.inverse_mass[point] = 0;
      points_.holder[point] = body;
      held_.push_back({point, body, pin.position});
      if (body && body->is_dynamic()) carry(point, *body, pin.position);
    }
    set_clamps(c);
    if (cloth.stopped)
      std::fill_n(points_.inverse_mass.begin() + static_cast<std::ptrdiff_t>(first_[c]), cloth.points.size(),
                  0.0);
  }
}

void ClothSystem::carry(uint32_t point, ClothBody& body, const Vec3& place) {
  auto at = std::ranges::find(carriers_, &body, &Carrier::body);
  if (at == carriers_.end()) at = carriers_.insert(at, {&body, {}, {}});
  at->points.push_back(point);
  at->places.push_back(place);
  points_.carried[point] = 1;
}

/// Triangles whose corners are all pinned to one body are clamped.
void ClothSystem::set_clamps(std::size_t c) {
  Cloth& cloth = *cloths_[c];
  if (cloth.bending.empty()) return;
  std::vector<uint32_t> clamp(cloth.points.size(), 0);
  for (const Held& held : held_)
    if (points_.cloth[held.point] == c)
      clamp[held.point - first_[c]] = held.body ? 2 + held.body->way().body : 1;
  cloth.bending.set_clamps(clamp);
}

void ClothSystem::step(const ClothWeather& weather, std::span<ClothBody> bodies) {
  if (cloths_.empty()) return;
  if (changed_) assemble();
  bodies_ = bodies;
  points_.inverse_mass.resize(points_.size());
  Real longest = weather.h;
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    longest = std::min(longest, cloths_[c]->def.substep);
    for (std::size_t i = 0; i < cloths_[c]->points.size(); ++i)  // impacts may have changed them
      points_.velocity[first_[c] + i] = padded(cloths_[c]->velocities[i]);
    add_outer_forces(*cloths_[c], first_[c], weather, points_);
    air_[c].expire();
  }
  for (Cloth* cloth : cloths_) cloth->before = cloth->points;
  adapt_springs();
  find_held(weather.time, bodies);
  for (const Carrier& carrier : carriers_) carrier.body->fall_along_parabola(weather.gravity);
  contacts_.find(points_, collides_, bodies, weather.h);
  corner_contacts_.find(points_, bodies, weather.h);
  const Real speed = contacts_.fastest_approach(points_);
  if (speed > 0)
    longest = std::min(longest, std::max(kMostApproach * corner_contacts_.mean_edge() / speed,
                                         std::min(longest, weather.h) / kMostDivision));
  // What whips and snaps, such as torn skin, would be held back only when it is far from where it began: then
  // springs between points that are held and points that are not would gain much more than motion lost.
  if (const Real rate = fastest_strain_rate(); rate > 0)
    longest = std::min(longest, std::max(kMostStrain / rate, std::min(longest, weather.h) / kMostDivision));
  const Real parts = std::clamp(std::ceil(weather.h / longest * (1 - 1e-12)), 1.0, kMaxParts);
  const Real dt = weather.h / parts;
  parts_ = parts;
  dt_ = dt;
  time_ = weather.time + weather.h;
  Real since_look = 0;  // way of the fastest body [m]
  for (Real k = 0; k < parts; ++k) {
    for (Cloth* cloth : cloths_) cloth->age += dt;
    blow(dt, parts - k);
    substep(k / parts, (k + 1) / parts, dt);
    ClothWeather next = weather;
    next.time += (k + 1) * dt;
    next.h = dt;
    for (std::size_t c = 0; c < cloths_.size(); ++c)
      if (step_leak(*cloths_[c], first_[c], next, points_)) air_[c].expire();
    // A body that goes by more than an edge of the cloth in a sub-step of the world must find the holes that
    // it tears.
    since_look += speed * dt;
    if (since_look > corner_contacts_.mean_edge() && k + 1 < parts) {
      since_look = 0;
      if (any_tears()) tear_within(weather, (k + 1) / parts);
    }
  }
  count_penetration();
  write_back();
}

void ClothSystem::substep(Real from, Real to, Real dt) {
  for (ClothBody& body : bodies_) body.begin(from, to, dt);
  points_.start = points_.position;
  cuts_.clear();
  move_held();
  integrate(dt);
  stop_lost(dt);
  pull_bodies(dt);
  close_seams(dt);
  limit_.project(points_, carriers_, dt, kick_, cuts_);
  if (!self_contacts_.empty()) self_contacts_.push_apart(points_, dt);
  touch_bodies(dt);
  push_holders(dt);
  shorten_moves(dt);
  end_substep(dt);
}

/// Bodies push cloth out of their way. Where springs are too long, contacts and springs are solved for
/// together, and linearised again in each turn. That includes bodies that cloth does not touch in this
/// sub-step but soon may: cloth under a body often flies ahead of it for a sub-step.
void ClothSystem::touch_bodies(Real dt) {
  contacts_.find_runaways(points_);
  corner_contacts_.solve(points_, dt, cuts_);
  contacts_.solve(points_, dt, parts_, cuts_);
  for (int round = 1; round < kMaxTurns && limit_.any_too_long(points_); ++round) {
    body_contacts_.clear();
    contacts_.collect(points_, body_contacts_);
    collect_triangles();
    if (body_contacts_.empty()) break;
    limit_.project_with(body_contacts_, points_, carriers_, dt, kick_, cuts_);
  }
}

/// Triangles at dynamic bodies. An overlap of the start is taken back slowly: the correction counts as
/// velocity.
void ClothSystem::collect_triangles() {
  const std::size_t first = body_contacts_.size();
  corner_contacts_.collect(points_, 1, body_contacts_);
  for (BodyContact& c : std::span(body_contacts_).subspan(first)) {
    Vec3 motion = -c.body->surface_motion(c.on_body);
    for (std::size_t k = 0; k < 3; ++k)
      motion += c.weights[k] * (points_.at(c.points[k]) - points_.start_at(c.points[k]));
    c.gap -= (1 - kTautRecovery) * std::min(c.gap - c.normal.dot(motion), 0.0);
  }
}

/// The greatest relative speed of both ends of a spring over its length at rest, in cloths with
/// self-collision [1/s].
Real ClothSystem::fastest_strain_rate() const {
  Real fastest2 = 0;
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    if (!cloths_[c]->def.self_collision || cloths_[c]->stopped) continue;
    for (const ClothSpring& s : springs_of(c))
      fastest2 = std::max(fastest2, (points_.velocity[s.a] - points_.velocity[s.b]).squaredNorm() /
                                        (s.rest_length * s.rest_length));
  }
  return std::sqrt(fastest2);
}

void ClothSystem::move_held() {
  for (Held& held : held_) {
    held.from = points_.position[held.point];
    points_.position[held.point] =
        padded(held.body ? held.body->end().point_to_world(held.position) : held.position);
    points_.pull[held.point].setZero();
  }
}

void ClothSystem::adapt_springs() {
  for (std::size_t c = 0; c < cloths_.size(); ++c)
    if (cloths_[c]->def.integrator == ClothIntegrator::relaxed) springs_[c].adapt_to_stretch(points_);
}

/// Before a sub-step, with as many `left` in that of the world.
void ClothSystem::blow(Real dt, Real left) {
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    const bool relaxed = cloths_[c]->def.integrator == ClothIntegrator::relaxed;
    air_[c].renew(points_, dt, static_cast<uint32_t>(left), relaxed ? spring_steps(c, dt) : 1);
  }
}

/// Number of steps of the springs in a sub-step of a `relaxed` cloth.
uint32_t ClothSystem::spring_steps(std::size_t cloth, Real dt) const {
  if (cloths_[cloth]->def.soften) return 1;
  const Real longest = std::max(springs_[cloth].longest_step(), kShortestSpringStep);
  return static_cast<uint32_t>(std::max(1.0, std::ceil(dt / longest * (1 - 1e-6))));
}

void ClothSystem::integrate(Real dt) {
  // Springs begin where bodies are, which they have pulled since points were put on them.
  for (const Held& held : held_)
    if (held.body) points_.start[held.point] = padded(held.body->start().point_to_world(held.position));
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    const ClothIntegrator integrator = cloths_[c]->def.integrator;
    const ClothRange range{first_[c], first_[c] + cloths_[c]->points.size(), springs_of(c),
                           cloths_[c]->bending, air_[c]};
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

/// Seams draw together evenly in their time and then hold. One that was held up goes on no faster: more than
/// the cloth beside it can follow in a sub-step would only be taken back.
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

void ClothSystem::end_substep(Real dt) {
  for (std::size_t i = 0; i < points_.size(); ++i)
    if (!points_.carried[i]) points_.velocity[i] = (points_.position[i] - points_.start[i]) / dt + kick_[i];
  std::fill(kick_.begin(), kick_.end(), Vec4::Zero());
  for (const VelocityCut& cut : cuts_) points_.velocity[cut.point] -= cut.move / dt;
}

/// Bodies feel what hangs on their pins, and move by it as the points of the cloth did: by forces of the
/// start of the sub-step at once, by those of its end from the next on, by those between half. They carry the
/// mass of the points: what these need to follow their body is taken from it.
void ClothSystem::pull_bodies(Real dt) {
  const auto impulse_on = [&](uint32_t i) {
    const Vec4 load = points_.pull[i] / dt + dt * points_.mass[i] * points_.acceleration[i];
    points_.pull[i].setZero();
    return Vec3(load.head<3>());
  };
  for (const Carrier& carrier : carriers_) {
    ClothBody& body = *carrier.body;
    Vec6 sum = Vec6::Zero(), moving = Vec6::Zero();
    for (uint32_t i : carrier.points) {
      const Vec3 p = points_.at(i), arm = p - body.centre();
      const Vec3 load = impulse_on(i);
      const Vec3 lag = points_.mass[i] * (points_.velocity[i].head<3>() - body.velocity(p));
      const Vec3 impulse = load + lag, early = share_at_once(points_.cloth[i], dt) * load + lag;
      sum += (Vec6() << impulse, arm.cross(impulse)).finished();
      moving += (Vec6() << early, arm.cross(early)).finished();
      points_.velocity[i] = padded(body.velocity(p));
    }
    carrier.pull(sum, moving, points_);
  }
  for (const Held& held : held_)
    if (held.body && !held.body->is_dynamic())
      held.body->load(impulse_on(held.point), points_.at(held.point));
}

/// Share of the impulses of a cloth's springs that moves bodies already in the sub-step.
Real ClothSystem::share_at_once(std::size_t cloth, Real dt) const {
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

/// Bodies feel what contacts and the stretch limit did to the points that they hold.
void ClothSystem::push_holders(Real dt) {
  for (const Held& held : held_) {
    Vec4& pull = points_.pull[held.point];
    if (!held.body || pull.isZero(0)) continue;
    const Vec3 impulse = pull.head<3>() / dt;
    pull.setZero();
    if (held.body->is_dynamic())
      held.body->pull(impulse, points_.at(held.point), 1);
    else
      held.body->load(impulse, points_.at(held.point));
  }
  for (const Carrier& carrier : carriers_) carrier.place(points_);
}

void ClothSystem::write_back() {
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    Cloth& cloth = *cloths_[c];
    bool finite = true;
    for (std::size_t i = 0; i < cloth.points.size(); ++i) {
      finite &= points_.position[first_[c] + i].allFinite() && points_.velocity[first_[c] + i].allFinite();
    }
    if (!finite) {
      stop(cloth, first_[c]);
      continue;
    }
    for (std::size_t i = 0; i < cloth.points.size(); ++i) {
      cloth.points[i] = points_.at(first_[c] + i);
      cloth.velocities[i] = points_.velocity[first_[c] + i].head<3>();
    }
    const uint32_t torn = tear_at(c, time_);
    cloth.report.torn += torn;
    changed_ |= torn > 0;
  }
}

bool ClothSystem::any_tears() const {
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    const Real tear = cloths_[c]->def.tear;
    if (tear == 0 || cloths_[c]->stopped) continue;
    for (const ClothSpring& s : springs_of(c)) {
      const Real longest = tear * s.rest_length;
      if (s.kind == SpringKind::stretch &&
          (points_.position[s.a] - points_.position[s.b]).squaredNorm() > longest * longest)
        return true;
    }
  }
  return false;
}

/// Tears cloths after a fraction of the world's sub-step, and begins again with what is left of them.
void ClothSystem::tear_within(const ClothWeather& weather, Real fraction) {
  time_ = weather.time + fraction * weather.h;
  write_back();
  time_ = weather.time + weather.h;
  if (!changed_) return;
  assemble();
  points_.inverse_mass.resize(points_.size());
  ClothWeather now = weather;
  now.time += fraction * weather.h;
  for (std::size_t c = 0; c < cloths_.size(); ++c) add_outer_forces(*cloths_[c], first_[c], now, points_);
  adapt_springs();
  find_held(weather.time, bodies_);
  contacts_.find(points_, collides_, bodies_, weather.h, fraction);
  corner_contacts_.find(points_, bodies_, weather.h);
}

/// Tears the threads that are too long, and reports the first tear.
uint32_t ClothSystem::tear_at(std::size_t c, Real time) {
  Cloth& cloth = *cloths_[c];
  ClothTear first{.time = time};
  first.by_pressure = cloth.def.pressure != 0;
  first.touches_body = c < contacts_.active().size() && contacts_.active()[c] > 0;
  const uint32_t torn = tear(cloth, first);
  cloth.report.first_tear = cloth.first_tear;
  return torn;
}

void ClothSystem::count_penetration() {
  std::vector<Real> deepest(cloths_.size(), 0);
  contacts_.measure(points_, deepest);
  for (std::size_t c = 0; c < cloths_.size(); ++c)
    cloths_[c]->report.penetration = std::max(cloths_[c]->report.penetration, deepest[c]);
}

void ClothSystem::measure() {
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    Cloth& cloth = *cloths_[c];
    if (!changed_ && c < springs_.size() && cloth.def.integrator == ClothIntegrator::relaxed) {
      cloth.report.clamped = springs_[c].clamped();
      cloth.report.least_stiffness = springs_[c].least_stiffness();
      cloth.report.spring_steps = spring_steps(c, dt_);
    }
    Eigen::ArrayXd length2(cloth.springs.size()), rest(cloth.springs.size());
    Eigen::Index count = 0;
    for (const ClothSpring& s : cloth.springs) {
      if (s.kind != SpringKind::stretch) continue;
      length2[count] = (cloth.points[s.a] - cloth.points[s.b]).squaredNorm();
      rest[count++] = s.rest_length;
    }
    const Eigen::ArrayXd strain = length2.head(count).sqrt() / rest.head(count) - 1;
    cloth.report.max_strain = count > 0 ? std::max(cloth.report.max_strain, strain.maxCoeff()) : 0;
    cloth.report.mean_strain = count > 0 ? strain.abs().mean() : 0;
    if (c < contacts_.active().size()) cloth.report.contacts = contacts_.active()[c];
    if (c < self_contacts_.active().size()) cloth.report.self_contacts = self_contacts_.active()[c];
  }
}

/// Stops cloths that diverge, before their contacts are sought: in a cloth that is scattered everywhere,
/// nearly all pairs of triangles may touch, and the search would not end.
void ClothSystem::stop_lost(Real dt) {
  const Real farthest2 = kLostSpeed * kLostSpeed * dt * dt;
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    if (cloths_[c]->stopped) continue;
    bool lost = false;
    for (std::size_t i = first_[c], end = i + cloths_[c]->points.size(); i < end; ++i)
      lost |= points_.inverse_mass[i] > 0 &&
              !((points_.position[i] - points_.start[i]).squaredNorm() <= farthest2);
    if (lost) stop(*cloths_[c], first_[c]);
  }
}

/// A cloth that lost its numbers stays where it last was.
void ClothSystem::stop(Cloth& cloth, std::size_t first) {
  cloth.stopped = true;
  cloth.report.finite = false;
  for (std::size_t i = 0; i < cloth.points.size(); ++i) {
    cloth.velocities[i].setZero();
    points_.position[first + i] = padded(cloth.points[i]);
    points_.velocity[first + i].setZero();
    points_.start[first + i] = points_.position[first + i];
    points_.inverse_mass[first + i] = 0;
    kick_[first + i].setZero();
  }
  changed_ = true;
}

}  // namespace offstage::sim
