#include "sim/cloth/cloth_system.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "sim/cloth/cloth_integrators.h"
#include "sim/cloth/tearing.h"

namespace offstage::sim {
namespace {

/// Rounds of shortening moves; what is not right then is put back to where it started.
constexpr int kMaxRounds = 64;
/// Turns of contacts with bodies and of the stretch limit.
constexpr int kMaxTurns = 4;
/// Substeps of cloth in one of the world.
constexpr Real kMaxParts = 1000;
/// Stretch is not limited so that cloth could not tear: the limit is at least this much above.
constexpr Real kBeyondTear = 1.2;
/// How long a span is, at most [s].
constexpr Real kSpan = 1.0 / 480;
/// For how long pairs of cloth with cloth are sought at a time [s].
constexpr Real kHorizon = 1.0 / 80;

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
  std::vector<ClothSpring> swept;
  std::vector<StretchLimit::Limit> limits, ties;
  std::vector<Triangle> colliding, touching;  // cloth; bodies
  for (uint32_t c = 0; c < cloths_.size(); ++c) {
    const Cloth& cloth = *cloths_[c];
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
      all_springs_.push_back(s);
      if (cloth.def.integrator == ClothIntegrator::relaxed) swept.push_back(s);
      Real limit = s.kind == SpringKind::stretch ? cloth.def.max_stretch
                   : s.kind == SpringKind::shear ? cloth.def.max_shear
                                                 : 0;
      if (limit > 0 && s.kind == SpringKind::stretch) limit = std::max(limit, kBeyondTear * cloth.def.tear);
      if (limit > 0) limits.push_back({s.a, s.b, s.rest_length, limit * s.rest_length});
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
  moves_.assign(points_.size(), Vec4::Zero());
  points_.start = points_.position;
  points_.acceleration.assign(points_.size(), Vec4::Zero());
  points_.pull.assign(points_.size(), Vec4::Zero());
  springs_.assign(swept, points_);
  drift_.assign(points_.size(), Vec4::Zero());
  pieces_.assign(points_.size());
  for (const ClothSpring& s : all_springs_) pieces_.join(s.a, s.b);
  for (const StretchLimit::Limit& t : ties) pieces_.join(t.a, t.b);
  pieces_.keep();
  limit_.assign(std::move(limits), std::move(ties), points_.size());
  self_contacts_.assign(std::move(colliding), points_);
  corner_contacts_.assign(std::move(touching), points_);
  span_ = 0;
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
  points_.holder.assign(points_.size(), nullptr);
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
    }
    if (cloth.stopped)
      std::fill_n(points_.inverse_mass.begin() + static_cast<std::ptrdiff_t>(first_[c]), cloth.points.size(),
                  0.0);
  }
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
  }
  const Real parts = std::clamp(std::ceil(weather.h / longest * (1 - 1e-12)), 1.0, kMaxParts);
  const Real dt = weather.h / parts;
  parts_ = parts;
  find_held(weather.time, bodies);
  contacts_.find(points_, collides_, bodies, weather.h);
  corner_contacts_.find(points_, bodies, weather.h);
  const Real span = std::max(1.0, std::floor(kSpan / dt * (1 + 1e-9)));
  for (Real k = 0; k < parts; ++k) {
    for (Cloth* cloth : cloths_) cloth->age += dt;
    substep(k / parts, (k + 1) / parts, dt, k + 1 == parts || span_ + 1 >= span);
  }
  count_penetration();
  write_back();
}

/// Contact of cloth with cloth is dearest, and looked at once in a span of several sub-steps.
void ClothSystem::substep(Real from, Real to, Real dt, bool ends_span) {
  if (span_++ == 0) span_start_ = points_.position;
  for (ClothBody& body : bodies_) body.begin(from, to, dt);
  points_.start = points_.position;
  cuts_.clear();
  move_held();
  integrate(dt);
  close_seams(dt);
  limit_.project(points_);
  if (ends_span && !self_contacts_.empty()) push_apart(dt);
  touch_bodies(dt);
  shorten_moves(dt, ends_span);
  end_substep(dt);
  pull_bodies(dt);
  if (ends_span) span_ = 0;
}

/// Pushes layers of cloth apart that came too near in the span. That changes velocities as spread over it.
void ClothSystem::push_apart(Real dt) {
  points_.start.swap(span_start_);
  free_ = points_.position;
  self_contacts_.find(points_, span_ * dt, kHorizon);
  self_contacts_.solve(points_);
  points_.start.swap(span_start_);
  if (span_ == 1) return;
  for (uint32_t i = 0; i < points_.size(); ++i)
    if (points_.position[i] != free_[i])
      cuts_.push_back({i, (1 - 1.0 / span_) * (points_.position[i] - free_[i])});
}

/// Bodies push cloth that pulls at what is too long, which pushes back: in turns.
void ClothSystem::touch_bodies(Real dt) {
  contacts_.find_runaways(points_);
  corner_contacts_.solve(points_, dt, cuts_);
  contacts_.solve(points_, dt, parts_, cuts_);
  for (int round = 1; round < kMaxTurns && contacts_.any_dynamic() && limit_.project(points_); ++round)
    contacts_.solve(points_, dt, parts_, cuts_);
}

void ClothSystem::move_held() {
  for (Held& held : held_) {
    held.from = points_.position[held.point];
    points_.position[held.point] =
        padded(held.body ? held.body->end().point_to_world(held.position) : held.position);
    points_.pull[held.point].setZero();
  }
}

void ClothSystem::integrate(Real dt) {
  // Springs begin where bodies are, which they have pulled since points were put on them.
  for (const Held& held : held_)
    if (held.body) points_.start[held.point] = padded(held.body->start().point_to_world(held.position));
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    const ClothIntegrator integrator = cloths_[c]->def.integrator;
    const std::span springs(all_springs_);
    const ClothRange range{first_[c], first_[c] + cloths_[c]->points.size(),
                           springs.subspan(first_spring_[c], first_spring_[c + 1] - first_spring_[c])};
    if (integrator == ClothIntegrator::symplectic) step_symplectic(points_, range, dt);
    if (integrator == ClothIntegrator::rk4) step_rk4(points_, range, dt, kick_);
    if (integrator == ClothIntegrator::implicit && !step_implicit(points_, range, dt))
      ++cloths_[c]->report.unconverged;
    if (integrator != ClothIntegrator::relaxed) continue;
    for (std::size_t i = range.begin; i < range.end; ++i)
      moves_[i] = points_.inverse_mass[i] > 0
                      ? Vec4(dt * (points_.velocity[i] + dt * points_.acceleration[i]))
                      : Vec4(points_.position[i] - points_.start[i]);
  }
  springs_.step(points_, moves_, dt);
  for (std::size_t c = 0; c < cloths_.size(); ++c)
    if (cloths_[c]->def.integrator == ClothIntegrator::relaxed)
      for (std::size_t i = first_[c], end = i + cloths_[c]->points.size(); i < end; ++i)
        if (points_.inverse_mass[i] > 0) points_.position[i] = points_.start[i] + moves_[i];
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

/// The moves in whose frames moves are shortened, or what flies or falls would be held back in the air: of a
/// piece of cloth with all that it may cross the mean one if it is free, that of its pins if one body holds
/// them all; none if it is near another body. Whether any move.
bool ClothSystem::find_drifts() {
  pieces_.forget();
  self_contacts_.for_doubtful([&](const auto& p) { pieces_.join(p[0], p[3]); });
  frames_.assign(pieces_.count(), {});
  const auto add = [&](uint32_t i) {
    Frame& frame = frame_of(i);
    frame.move += points_.mass[i] * (points_.position[i] - points_.start[i]);
    frame.mass += points_.mass[i];
  };
  for (const Held& held : held_) {
    Frame& frame = frame_of(held.point);
    frame.rests |= !held.body || (frame.holder && frame.holder != held.body);
    frame.holder = held.body;
    add(held.point);
  }
  const auto all_rest = [&] { return std::ranges::all_of(frames_, &Frame::rests); };
  if (all_rest()) return false;
  for (uint32_t i = 0; i < points_.size(); ++i) {
    Frame& frame = frame_of(i);
    if (frame.rests) continue;
    frame.rests = cloths_[points_.cloth[i]]->stopped || contacts_.is_near_other_than(i, frame.holder);
    if (!frame.holder) add(i);
  }
  if (all_rest()) return false;
  for (Frame& frame : frames_)
    if (!frame.rests) frame.move /= frame.mass;
  for (uint32_t i = 0; i < points_.size(); ++i)
    if (!frame_of(i).rests) drift_[i] = frame_of(i).move;
  return true;
}

/// Until nothing is too long and nothing crossed. What is held back in a moving frame goes ways that its
/// pairs were not sought for, and is looked at once more in the world's.
void ClothSystem::shorten_moves(Real dt, bool ends_span) {
  const bool self = ends_span && !self_contacts_.empty();
  if (limit_.empty() && !self) return;
  if (self) points_.start.swap(span_start_);                           // the moves of the whole span
  const std::vector<Vec4>& from = self ? span_start_ : points_.start;  // of the sub-step
  const auto find_doubtful = [&] {
    self ? self_contacts_.find_doubtful(points_, span_ * dt, kHorizon, drift_) : self_contacts_.find_none();
  };
  shortened_.assign(points_.size(), kWhole);
  find_doubtful();
  bool any = false, any_in_piece = false;
  if (find_drifts()) {
    add_momenta(1, from, dt);
    find_doubtful();
    any = any_in_piece = shorten_in_pieces();
    self_contacts_.take_crossed();  // in the world's frame nothing has to
    drift_.assign(points_.size(), Vec4::Zero());
    if (any && self) find_doubtful();
    if (any && self) shorten_doubtful(kInWorld);
  } else {
    any = shorten_doubtful(kInWorld);
  }
  for (uint32_t i : self_contacts_.take_crossed()) ++cloths_[points_.cloth[i]]->report.crossings;
  for (std::size_t i = 0; any && i < points_.size(); ++i) {
    if (shortened_[i] == kWhole) continue;
    ++cloths_[points_.cloth[i]]->report.limited;
    // Its velocity is that of the shortened move, which in a span is not that of the last sub-step.
    if (self)
      kick_[i] =
          (points_.position[i] - points_.start[i]) / (span_ * dt) - (points_.position[i] - from[i]) / dt;
  }
  if (self) std::erase_if(cuts_, [&](const VelocityCut& cut) { return shortened_[cut.point] != kWhole; });
  if (any_in_piece) {
    add_momenta(-1, from, dt);
    give_momenta_back();
  }
  if (self) {
    self_contacts_.end_substep(points_, span_ * dt);
    points_.start.swap(span_start_);
  }
  stop_bodies();
}

/// In the frames of the pieces; whether any. A free piece goes on as a whole as it would have: what is held
/// back within it is inner forces' doing.
bool ClothSystem::shorten_in_pieces() {
  const auto shift_starts = [&](Real sign) {
    for (std::size_t i = 0; i < points_.size(); ++i) points_.start[i] += sign * drift_[i];
  };
  shift_starts(1);
  const bool any = shorten_doubtful(kInPiece);
  shift_starts(-1);
  if (!any) return false;
  for (uint32_t i = 0; i < points_.size(); ++i) {
    Frame& frame = frame_of(i);
    if (frame.is_free())
      frame.move -= points_.mass[i] / frame.mass * (points_.position[i] - points_.start[i]);
  }
  for (uint32_t i = 0; i < points_.size(); ++i)
    if (frame_of(i).is_free()) points_.position[i] += frame_of(i).move;
  return true;
}

/// Adds (or takes, with the sign) the momenta of free pieces at the end of the sub-step that began at `from`.
void ClothSystem::add_momenta(Real sign, std::span<const Vec4> from, Real dt) {
  for (uint32_t i = 0; i < points_.size(); ++i)
    frame_of(i).momentum += sign * points_.mass[i] * ((points_.position[i] - from[i]) / dt + kick_[i]);
  for (const VelocityCut& cut : cuts_)
    frame_of(cut.point).momentum -= sign * points_.mass[cut.point] / dt * cut.move;
}

/// What pieces lost by shortening in their own frames. What the world's frame took is lost to what they met.
void ClothSystem::give_momenta_back() {
  for (uint32_t i = 0; i < points_.size(); ++i) frame_of(i).met |= shortened_[i] == kInWorld;
  for (uint32_t i = 0; i < points_.size(); ++i) {
    const Frame& frame = frame_of(i);
    if (frame.is_free() && !frame.met) kick_[i] += frame.momentum / frame.mass;
  }
}

/// Shortens moves from where points started; whether any. Notes `how` of the points.
bool ClothSystem::shorten_doubtful(Shortened how) {
  shares_.assign(points_.size(), 1);
  bool again = true, any = false;
  for (int round = 0; again && round < kMaxRounds; ++round) {
    again = round == 0 ? limit_.shorten_whole_moves(points_, shares_, lowered_)
                       : limit_.shorten(points_, shares_, lowered_);
    again |= self_contacts_.shorten(points_, shares_, lowered_);
    any |= again;
  }
  if (!any) return false;
  for (uint32_t i : self_contacts_.take_held_back()) ++cloths_[points_.cloth[i]]->report.held_back;
  any = false;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Real share = again ? 0 : shares_[i];
    if (share == 1 || !(points_.inverse_mass[i] > 0)) continue;
    points_.position[i] = points_.start[i] + share * (points_.position[i] - points_.start[i]);
    shortened_[i] = how;
    any = true;
  }
  return any;
}

/// A cloth that gives no more stops bodies as one with those that it hangs on.
void ClothSystem::stop_bodies() {
  const std::vector<Real> recoil = recoils();
  const std::vector<Vec3> taken = contacts_.stop_bodies(points_, shortened_, recoil);
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    if (!(recoil[c] > 0) || taken[c] == Vec3::Zero()) continue;
    const Vec3 gain = recoil[c] * taken[c];
    for (std::size_t i = first_[c], end = i + cloths_[c]->points.size(); i < end; ++i)
      kick_[i] += padded(gain);
    for (ClothBody* body : holders(c)) body->push(body->mass() * gain, body->centre());
  }
}

/// The bodies that hold pins of a cloth, each once.
std::vector<ClothBody*> ClothSystem::holders(std::size_t cloth) const {
  std::vector<ClothBody*> found;
  for (const Held& held : held_)
    if (points_.cloth[held.point] == cloth && held.body && !std::ranges::count(found, held.body))
      found.push_back(held.body);
  return found;
}

/// Of each cloth the inverse of its mass and of that of the bodies which hold it; 0 if anything fixed does,
/// which takes up what it is pushed.
std::vector<Real> ClothSystem::recoils() const {
  std::vector<Real> mass;
  for (const Cloth* cloth : cloths_)
    mass.push_back(std::accumulate(cloth->masses.begin(), cloth->masses.end(), 0.0));
  for (const Held& held : held_)
    if (!held.body || !held.body->is_dynamic())
      mass[points_.cloth[held.point]] = std::numeric_limits<Real>::infinity();
  std::vector<Real> recoil;
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    for (const ClothBody* body : holders(c)) mass[c] += body->mass();
    recoil.push_back(1 / mass[c]);
  }
  return recoil;
}

void ClothSystem::end_substep(Real dt) {
  for (std::size_t i = 0; i < points_.size(); ++i)
    points_.velocity[i] = (points_.position[i] - points_.start[i]) / dt + kick_[i];
  std::fill(kick_.begin(), kick_.end(), Vec4::Zero());
  for (const VelocityCut& cut : cuts_) points_.velocity[cut.point] -= cut.move / dt;
}

/// Bodies feel what hangs on their pins, and move by it as the points of the cloth did: by forces of the
/// start of the sub-step at once, by those of its end from the next on, by those between half.
void ClothSystem::pull_bodies(Real dt) {
  for (const Held& held : held_) {
    if (!held.body) continue;
    const ClothIntegrator integrator = cloths_[points_.cloth[held.point]]->def.integrator;
    const Real share = integrator == ClothIntegrator::implicit ? 0
                       : integrator == ClothIntegrator::rk4    ? 0.5
                                                               : 1;
    const Vec4 weight = dt * points_.mass[held.point] * points_.acceleration[held.point];
    const Vec3 impulse = (points_.pull[held.point] / dt + weight).head<3>();
    if (held.body->is_dynamic())
      held.body->pull(impulse, points_.at(held.point), share);
    else
      held.body->load(impulse, points_.at(held.point));
  }
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
    cloth.before = cloth.points;
    for (std::size_t i = 0; i < cloth.points.size(); ++i) {
      cloth.points[i] = points_.at(first_[c] + i);
      cloth.velocities[i] = points_.velocity[first_[c] + i].head<3>();
    }
    const uint32_t torn = tear(cloth);
    cloth.report.torn += torn;
    changed_ |= torn > 0;
  }
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
    if (!changed_ && c < springs_.clamped().size()) cloth.report.clamped = springs_.clamped()[c];
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

/// A cloth that lost its numbers stays where it last was.
void ClothSystem::stop(Cloth& cloth, std::size_t first) {
  cloth.stopped = true;
  cloth.report.finite = false;
  for (std::size_t i = 0; i < cloth.points.size(); ++i) {
    cloth.velocities[i].setZero();
    points_.position[first + i] = padded(cloth.points[i]);
    points_.velocity[first + i].setZero();
  }
  changed_ = true;
}

}  // namespace offstage::sim
