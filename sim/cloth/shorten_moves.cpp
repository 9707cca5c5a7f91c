/// The part of ClothSystem that shortens the moves of a sub-step until no spring is too long and no cloth has
/// passed through cloth.
///
/// Moves are shortened relative to a frame that moves with the mean velocity of the piece of cloth. Otherwise
/// flying and falling cloth would be slowed down in the air. Shortening acts like forces within the piece. So
/// a piece that only dynamic bodies hold keeps its momentum together with these bodies.

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "sim/cloth/cloth_system.h"

namespace offstage::sim {
namespace {

/// Greatest number of rounds of shortening moves. If a limit is still violated after them, all points return
/// to their start.
constexpr int kMaxRounds = 64;
/// Greatest number of passes for bodies that turn.
constexpr int kMaxPasses = 6;
/// A cloth near a body is frozen after this many successive sub-steps in which shortening left its points
/// less than this fraction of their moves. Then its pieces that no fixed object holds are shortened in their
/// own frames for so many sub-steps.
constexpr uint32_t kFrozenAfter = 3, kThawedFor = 60;
constexpr Real kFrozenMove = 0.01;

}  // namespace

/// Joins pieces that may cross each other, and pieces that are pinned to the same body, to one frame.
void ClothSystem::find_frames() {
  pieces_.forget();
  self_contacts_.for_doubtful([&](const auto& p) { pieces_.join(p[0], p[3]); });
  for (const Carrier& carrier : carriers_)
    for (uint32_t i : carrier.points) pieces_.join(carrier.points[0], i);
  frames_.assign(pieces_.count(), {});
  for (const Held& held : held_) {
    if (points_.carried[held.point]) continue;
    Frame& frame = frame_of(held.point);
    frame.rests |= !held.body || (frame.leader && frame.leader != held.body);
    frame.leader = held.body;
    frame.anchored = true;
  }
  for (uint32_t i = 0; i < points_.size(); ++i) {
    Frame& frame = frame_of(i);
    frame.total_mass += points_.mass[i];
    if (cloths_[points_.cloth[i]]->stopped) frame.rests = frame.anchored = true;
  }
  for (const Carrier& carrier : carriers_) {
    Frame& frame = frame_of(carrier.points[0]);
    frame.total_mass += carrier.body->mass();
    frame.carries = true;
  }
}

/// Returns a body that the point may soon touch and that does not hold its piece, or null.
const ClothBody* ClothSystem::nearby_other_body(uint32_t point) {
  const ClothBody* near = contacts_.near_to(point);
  if (!near) return nullptr;
  if (contacts_.is_near_several(point)) return near;
  const Frame& frame = frame_of(point);
  if (frame.leader) return near != frame.leader ? near : nullptr;
  const auto carrier = std::ranges::find(carriers_, near, &Carrier::body);
  return carrier == carriers_.end() || &frame_of(carrier->points[0]) != &frame ? near : nullptr;
}

/// Chooses the frame of a point's piece. A free piece that a single moving body pushes or carries gets a
/// frame that moves with this body: in the world's frame, it would be left behind inside a body that pushes
/// it, and it would come to a stop on a body that turns.
void ClothSystem::choose_frame(uint32_t point) {
  Frame& frame = frame_of(point);
  const ClothBody* near = frame.rests ? nullptr : nearby_other_body(point);
  if (!near) return;
  if (!frame.anchored && frozen_[points_.cloth[point]].thawed > 0) return;
  const bool is_loose = !frame.anchored && !frame.carries && near->moves();
  const bool is_one = !contacts_.is_near_several(point) && (!frame.pusher || frame.pusher == near);
  if (is_loose && is_one)
    frame.pusher = near;
  else
    frame.rests = true;
}

/// Returns the displacement of a point that moves with the frame of its piece. On a keyframed body this is
/// the fraction `follows` of the body's motion, which keeps all lengths.
Vec4 ClothSystem::frame_move(uint32_t point) {
  const Frame& frame = frame_of(point);
  if (!frame.follows_keys()) return frame.move;
  return frame.follows * padded(frame.pusher->rigid_move(points_.start_at(point)));
}

/// Computes the fraction of the motion of keyframed bodies that their pieces have taken up.
void ClothSystem::find_followers() {
  std::vector<Real> together(frames_.size(), 0), whole(frames_.size(), 0);
  for (uint32_t i = 0; i < points_.size(); ++i) {
    const Frame& frame = frame_of(i);
    if (frame.rests || !frame.follows_keys()) continue;
    const Vec3 along = frame.pusher->rigid_move(points_.start_at(i));
    together[pieces_.of(i)] += points_.mass[i] * along.dot(points_.at(i) - points_.start_at(i));
    whole[pieces_.of(i)] += points_.mass[i] * along.squaredNorm();
  }
  for (std::size_t k = 0; k < frames_.size(); ++k)
    frames_[k].follows = whole[k] > 0 ? std::clamp(together[k] / whole[k], 0.0, 1.0) : 0;
}

/// Computes the move of each frame. It is the move of its leader or of its pusher, or the mean move of the
/// piece and the bodies that hang on it, or zero if the piece is near another body. Returns whether any frame
/// moves.
bool ClothSystem::find_drifts() {
  find_frames();
  const auto all_rest = [&] { return std::ranges::all_of(frames_, &Frame::rests); };
  if (all_rest()) return false;
  const auto add = [&](Frame& frame, Real mass, const Vec4& move) {
    frame.move += mass * move;
    frame.mass += mass;
  };
  for (uint32_t i = 0; i < points_.size(); ++i) {
    Frame& frame = frame_of(i);
    choose_frame(i);
    if (!frame.leader || points_.holder[i] == frame.leader)
      add(frame, points_.mass[i], points_.position[i] - points_.start[i]);
  }
  for (const Carrier& carrier : carriers_)
    if (Frame& frame = frame_of(carrier.points[0]); !frame.leader)
      add(frame, carrier.body->mass(), padded(carrier.body->move()));
  if (all_rest()) return false;
  for (Frame& frame : frames_) {
    if (!frame.rests && frame.mass > 0) frame.move /= frame.mass;
    if (frame.pusher) frame.move = padded(frame.pusher->move());
  }
  find_followers();
  for (uint32_t i = 0; i < points_.size(); ++i)
    if (!frame_of(i).rests) drift_[i] = frame_move(i);
  return true;
}

/// Shortens moves until no spring is too long and no pair has crossed. A move that was shortened in a moving
/// frame follows a path that the search for pairs did not consider. It is therefore checked again in the
/// world's frame.
void ClothSystem::shorten_moves(Real dt) {
  const bool self = !self_contacts_.empty();
  if (limit_.empty() && !self) return;
  for (Frozen& frozen : frozen_) {
    frozen.thawed -= frozen.thawed > 0;
    if (!std::exchange(frozen.stopped, false)) frozen.since = 0;
  }
  const auto find_doubtful = [&] {
    self ? self_contacts_.find_doubtful(points_, dt, drift_) : self_contacts_.find_none();
  };
  shortened_.assign(points_.size(), kWhole);
  find_doubtful();
  if (!limit_.any_beyond(points_) && !(self && self_contacts_.any_crossed(points_))) {
    if (self) self_contacts_.end_substep(points_, dt);
    return;  // most sub-steps end here: whole moves are allowed in every frame
  }
  const bool any_drifts = find_drifts();
  add_momenta(1, dt);
  const bool any_free = !std::ranges::all_of(frames_, &Frame::anchored);
  std::vector<Vec4> whole, velocity;
  if (any_free) {
    whole = points_.position;
    velocity = end_velocities(dt);
  }
  if (any_drifts) find_doubtful();
  bool any = any_drifts ? shorten_in_pieces() : shorten_until_valid(kInWorld);
  if (any_drifts) {
    self_contacts_.take_crossed();  // these pairs need not cross in the world's frame
    drift_.assign(points_.size(), Vec4::Zero());
    if (any && self) find_doubtful();
    if (any && self) shorten_until_valid(kInWorld);
  }
  for (uint32_t i : self_contacts_.take_crossed()) ++cloths_[points_.cloth[i]]->report.crossings;
  for (std::size_t i = 0; any && i < points_.size(); ++i) {
    if (shortened_[i] == kWhole) continue;
    ++cloths_[points_.cloth[i]]->report.limited;
    if (self) kick_[i].setZero();  // its velocity follows from the shortened move
  }
  if (self) std::erase_if(cuts_, [&](const VelocityCut& cut) { return shortened_[cut.point] != kWhole; });
  if (any) {
    if (any_free) remove_energy_gains(whole, velocity, end_velocities(dt));
    add_momenta(-1, dt);
    restore_momenta();
    watch_frozen(end_velocities(dt), dt);
  }
  if (self) self_contacts_.end_substep(points_, dt);
  if (any) stop_bodies(dt);
}

/// Shortens moves in the frames of the pieces; returns whether any was shortened.
bool ClothSystem::shorten_in_pieces() {
  const auto shift_starts = [&](Real sign) {
    for (std::size_t i = 0; i < points_.size(); ++i) points_.start[i] += sign * drift_[i];
  };
  shift_starts(1);
  const bool any = shorten_until_valid(kInPiece);
  shift_starts(-1);
  if (!any) return false;
  // The centre of mass of a free piece moves on as without shortening.
  const auto is_loose = [](const Frame& frame) {
    return !frame.rests && !frame.leader && !frame.pusher && !frame.carries;
  };
  for (uint32_t i = 0; i < points_.size(); ++i)
    if (Frame& frame = frame_of(i); is_loose(frame))
      frame.move -= points_.mass[i] / frame.mass * (points_.position[i] - points_.start[i]);
  for (uint32_t i = 0; i < points_.size(); ++i)
    if (const Frame& frame = frame_of(i); is_loose(frame)) points_.position[i] += frame.move;
  return true;
}

/// Finds cloths that shortening has stopped, while they keep their momentum. In the world's frame this would
/// repeat for ever: taut cloth cannot move unless all of its points move, and one that a body stops is enough
/// to stop all.
void ClothSystem::watch_frozen(std::span<const Vec4> velocity, Real dt) {
  std::vector<Real> moved(cloths_.size(), 0), would_move(cloths_.size(), 0);
  for (uint32_t i = 0; i < points_.size(); ++i) {
    if (!(points_.inverse_mass[i] > 0)) continue;
    moved[points_.cloth[i]] += (points_.position[i] - points_.start[i]).squaredNorm();
    would_move[points_.cloth[i]] += (dt * velocity[i]).squaredNorm();
  }
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    Frozen& frozen = frozen_[c];
    frozen.stopped = moved[c] < kFrozenMove * kFrozenMove * would_move[c];
    frozen.since += frozen.stopped;
    if (frozen.since >= kFrozenAfter) frozen = {.thawed = kThawedFor};
  }
}

/// Adds the momenta of free points at the end of the sub-step, times `sign`, to their frames.
void ClothSystem::add_momenta(Real sign, Real dt) {
  for (uint32_t i = 0; i < points_.size(); ++i)
    if (points_.inverse_mass[i] > 0)
      frame_of(i).momentum +=
          sign * points_.mass[i] * ((points_.position[i] - points_.start[i]) / dt + kick_[i]);
  for (const VelocityCut& cut : cuts_)
    if (points_.inverse_mass[cut.point] > 0)
      frame_of(cut.point).momentum -= sign * points_.mass[cut.point] / dt * cut.move;
}

/// Returns the velocities of all points at the end of the sub-step.
std::vector<Vec4> ClothSystem::end_velocities(Real dt) const {
  std::vector<Vec4> velocity(points_.size());
  for (uint32_t i = 0; i < points_.size(); ++i)
    velocity[i] = points_.carried[i] ? points_.velocity[i]
                                     : Vec4((points_.position[i] - points_.start[i]) / dt + kick_[i]);
  for (const VelocityCut& cut : cuts_) velocity[cut.point] -= cut.move / dt;
  return velocity;
}

/// Returns, for each piece that no fixed object holds, twice the kinetic energy of its points relative to the
/// mean velocity. The mean includes the bodies that hang on the piece, and is stored in the frames.
std::vector<Real> ClothSystem::inner_energies(std::span<const Vec4> velocity) {
  for (Frame& frame : frames_) frame.velocity.setZero();
  const auto add = [](Frame& frame, Real mass, const Vec4& v) {
    frame.velocity += mass / frame.total_mass * v;
  };
  for (uint32_t i = 0; i < points_.size(); ++i) add(frame_of(i), points_.mass[i], velocity[i]);
  for (const Carrier& carrier : carriers_) {
    const ClothBody& body = *carrier.body;
    add(frame_of(carrier.points[0]), body.mass(), padded(body.velocity(body.centre())));
  }
  std::vector<Real> energy(frames_.size(), 0);
  for (uint32_t i = 0; i < points_.size(); ++i)
    if (const Frame& frame = frame_of(i); !frame.anchored && points_.inverse_mass[i] > 0)
      energy[pieces_.of(i)] += points_.mass[i] * (velocity[i] - frame.velocity).squaredNorm();
  return energy;
}

/// Returns, for each free piece, twice the energy that its springs gained by shortening, at least 0. The gain
/// is their energy now minus their energy with the points at `whole`. Other pieces get 0: their moves are
/// shortened in each sub-step, and removing the gain from their motion each time would stop a flag in the
/// wind or cloth on a turning ball.
std::vector<Real> ClothSystem::elastic_gains(std::span<const Vec4> whole) {
  std::vector<Real> gain(frames_.size(), 0);
  for (const ClothSpring& s : all_springs_) {
    if (const Frame& frame = frame_of(s.a); frame.anchored || frame.rests || frame.follows_keys()) continue;
    const bool alone = s.counterpart_rest == 0;
    if (shortened_[s.a] == kWhole && shortened_[s.b] == kWhole &&
        (alone || (shortened_[s.counterpart[0]] == kWhole && shortened_[s.counterpart[1]] == kWhole)))
      continue;
    const auto& at = points_.position;
    const Real before = s.elongation((whole[s.a] - whole[s.b]).norm(), whole);
    const Real now = s.elongation((at[s.a] - at[s.b]).norm(), at);
    gain[pieces_.of(s.a)] += s.stiffness * (now * now - before * before);
  }
  for (Real& g : gain) g = std::max(g, 0.0);
  return gain;
}

/// Slows the motion within each piece, so that shortening adds no energy. Shortening different fractions of
/// equal moves compresses the springs between the points, and restoring the momentum of the piece also adds
/// energy. The remaining energy is that with the points at `whole` and the velocity `before`, minus the gain
/// of the springs.
void ClothSystem::remove_energy_gains(std::span<const Vec4> whole, std::span<const Vec4> before,
                                      std::span<const Vec4> velocity) {
  const std::vector<Real> first = inner_energies(before), now = inner_energies(velocity);
  const std::vector<Real> elastic = elastic_gains(whole);
  for (uint32_t i = 0; i < points_.size(); ++i) {
    const uint32_t piece = pieces_.of(i);
    const Real left = std::max(first[piece] - elastic[piece], 0.0);
    if (frames_[piece].anchored || !(points_.inverse_mass[i] > 0) || !(now[piece] > left)) continue;
    kick_[i] -= (1 - std::sqrt(left / now[piece])) * (velocity[i] - frames_[piece].velocity);
  }
}

/// Restores the momentum that shortening took from pieces and the bodies that hang on them. Pieces held by a
/// fixed object lost their momentum to that object.
void ClothSystem::restore_momenta() {
  for (uint32_t i = 0; i < points_.size(); ++i)
    if (const Frame& frame = frame_of(i); !frame.anchored && points_.inverse_mass[i] > 0)
      kick_[i] += frame.momentum / frame.total_mass;
  for (const Carrier& carrier : carriers_) {
    const Frame& frame = frame_of(carrier.points[0]);
    if (frame.anchored) continue;
    const Vec3 gain = (frame.momentum / frame.total_mass).head<3>();
    carrier.accelerate_whole(gain, points_);
  }
}

/// Shortens the points' moves from their starts, until all limits hold. Records `how` for the shortened
/// points. Returns whether any move was shortened.
bool ClothSystem::shorten_until_valid(Shortened how) {
  bool any = false, turned = false;
  // The points of a rotating body do not move on straight lines, so they are checked again.
  for (int pass = 0; pass < kMaxPasses; ++pass) {
    turned = false;
    if (!shorten_straight(how, turned)) break;
    any = true;
    if (!turned) break;
  }
  return any;
}

/// Shortens moves once, as if all paths were straight. Sets `turned` if moves of bodies were shortened.
bool ClothSystem::shorten_straight(Shortened how, bool& turned) {
  fractions_.assign(points_.size(), 1);
  bool again = true, any = false;
  for (int round = 0; again && round < kMaxRounds; ++round) {
    again = round == 0 ? limit_.shorten_whole_moves(points_, carriers_, fractions_, lowered_)
                       : limit_.shorten(points_, carriers_, fractions_, lowered_);
    again |= self_contacts_.shorten(points_, fractions_, lowered_);
    any |= again;
  }
  if (!any) return false;
  for (uint32_t i : self_contacts_.take_held_back()) ++cloths_[points_.cloth[i]]->report.held_back;
  any = false;
  const auto fraction_of = [&](std::size_t i) { return again ? 0 : fractions_[i]; };
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Real fraction = fraction_of(i);
    if (fraction == 1 || !(points_.inverse_mass[i] > 0)) continue;
    points_.position[i] = points_.start[i] + fraction * (points_.position[i] - points_.start[i]);
    shortened_[i] = how;
    any = true;
  }
  for (Carrier& carrier : carriers_)
    if (const Real fraction = fraction_of(carrier.points[0]); fraction < 1) {
      shorten_carrier(carrier, fraction);
      any = turned = true;
    }
  return any;
}

/// Shortens the displacement of a body that hangs on cloth at its stretch limit.
void ClothSystem::shorten_carrier(Carrier& carrier, Real fraction) {
  ClothBody& body = *carrier.body;
  const uint32_t first = carrier.points[0];
  Real mass = body.mass();
  for (uint32_t i : carrier.points) mass += points_.mass[i];
  const Vec3 change = body.shorten(fraction, drift_[first].head<3>());
  frame_of(first).momentum -= mass * padded(change);
  carrier.accelerate(change, points_);
  carrier.place(points_);
}

/// Stops bodies at cloths whose moves were shortened. Such a cloth acts as one rigid body together with the
/// bodies on which it hangs.
void ClothSystem::stop_bodies(Real dt) {
  const std::vector<Real> recoil = recoils();
  const auto whole = whole_velocities(recoil, end_velocities(dt));
  body_contacts_.clear();
  corner_contacts_.collect(points_, contacts_, 0, body_contacts_);
  const std::vector<Vec3> taken =
      contacts_.stop_bodies(points_, shortened_, kick_, recoil, whole, body_contacts_);
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    if (!(recoil[c] > 0) || taken[c] == Vec3::Zero()) continue;
    const Vec3 gain = recoil[c] * taken[c];
    for (std::size_t i = first_[c], end = i + cloths_[c]->points.size(); i < end; ++i)
      if (points_.inverse_mass[i] > 0) kick_[i] += padded(gain);
    for (const Carrier* carrier : carriers_of(c)) carrier->accelerate_whole(gain, points_);
  }
}

/// Returns the dynamic bodies that hold pins of a cloth.
std::vector<const Carrier*> ClothSystem::carriers_of(std::size_t cloth) const {
  std::vector<const Carrier*> found;
  for (const Carrier& carrier : carriers_)
    if (std::ranges::any_of(carrier.points, [&](uint32_t i) { return points_.cloth[i] == cloth; }))
      found.push_back(&carrier);
  return found;
}

/// Returns, for each cloth, the inverse of its mass together with the mass of the bodies that hold it [1/kg];
/// 0 if a fixed object holds it.
std::vector<Real> ClothSystem::recoils() const {
  std::vector<Real> mass;
  for (const Cloth* cloth : cloths_)
    mass.push_back(std::accumulate(cloth->masses.begin(), cloth->masses.end(), 0.0));
  for (const Held& held : held_)
    if (!points_.carried[held.point]) mass[points_.cloth[held.point]] = std::numeric_limits<Real>::infinity();
  std::vector<Real> recoil;
  for (std::size_t c = 0; c < cloths_.size(); ++c) {
    for (const Carrier* carrier : carriers_of(c)) mass[c] += carrier->body->mass();
    recoil.push_back(1 / mass[c]);
  }
  return recoil;
}

/// Returns, for each cloth, its mean velocity together with the bodies that hold it. If one immovable body
/// holds it, this is the velocity of that body. It is empty if several such bodies hold the cloth, or one
/// that turns.
std::vector<std::optional<Vec3>> ClothSystem::whole_velocities(std::span<const Real> recoil,
                                                               std::span<const Vec4> velocity) const {
  std::vector<std::optional<Vec3>> whole(cloths_.size(), Vec3(Vec3::Zero()));
  std::vector<const ClothBody*> holder(cloths_.size(), nullptr);
  std::vector<uint8_t> is_held(cloths_.size(), 0);
  for (const Held& held : held_) {
    if (points_.carried[held.point]) continue;
    const uint32_t c = points_.cloth[held.point];
    const bool is_first = std::exchange(is_held[c], uint8_t{1}) == 0;
    if (is_first) holder[c] = held.body;
    if (held.body != holder[c] || (held.body && held.body->angular_velocity() != Vec3::Zero()))
      whole[c].reset();
    if (is_first && held.body && whole[c]) whole[c] = held.body->velocity(held.body->centre());
  }
  for (uint32_t i = 0; i < points_.size(); ++i)
    if (const uint32_t c = points_.cloth[i]; recoil[c] > 0)
      *whole[c] += recoil[c] * points_.mass[i] * velocity[i].head<3>();
  for (std::size_t c = 0; c < cloths_.size(); ++c)
    for (const Carrier* carrier : carriers_of(c))
      if (recoil[c] > 0)
        *whole[c] += recoil[c] * carrier->body->mass() * carrier->body->velocity(carrier->body->centre());
  return whole;
}

}  // namespace offstage::sim
