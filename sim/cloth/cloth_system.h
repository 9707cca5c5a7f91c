#pragma once
/// Steps all cloths of a world. A sub-step of the world computes the external forces and the possible
/// contacts, and then runs sub-steps of cloth. In each of these the integrator moves every cloth and keeps
/// its points out of fixed and keyframed bodies. Then the stretch limit, other contacts with cloth and
/// contacts with bodies are solved. Finally moves are shortened until no spring is too long and no cloth has
/// passed through cloth.

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "sim/cloth/air_drag.h"
#include "sim/cloth/bend_limit.h"
#include "sim/cloth/cloth_bodies.h"
#include "sim/cloth/cloth_contacts.h"
#include "sim/cloth/cloth_forces.h"
#include "sim/cloth/cloth_pieces.h"
#include "sim/cloth/cloth_points.h"
#include "sim/cloth/cloth_springs.h"
#include "sim/cloth/cloth_state.h"
#include "sim/cloth/corner_contacts.h"
#include "sim/cloth/gas_force.h"
#include "sim/cloth/self_contacts.h"
#include "sim/cloth/stretch_limit.h"

namespace offstage::sim {

struct ClothRange;

class ClothSystem {
 public:
  bool empty() const { return cloths_.empty(); }
  /// Sets the cloths to step. Their addresses must stay valid until the next call.
  void assign(std::vector<Cloth*> cloths);

  /// Advances the cloths through a sub-step of the world. `bodies`: all bodies that may touch cloth or hold
  /// pins.
  void step(const ClothWeather& weather, std::span<ClothBody> bodies);

  /// Writes strains and counts of contacts into the cloths' reports.
  void measure();

  /// Returns the bounding box of all points and of the positions that they may reach within the time h [s].
  Aabb reach(Real h) const;
  /// Returns this box for each cloth that collides with bodies and moves.
  std::vector<Aabb> reaches(Real h) const;
  /// Smallest thickness of these cloths [m]; infinite if there are none.
  Real thinnest() const;
  /// Returns the time within h [s] at which a box that moves at `velocity` may meet a triangle of a cloth
  /// that collides with bodies.
  std::optional<Real> first_meeting(const Aabb& box, const Vec3& velocity, Real h) const;

 private:
  static Aabb reach_of(const Cloth& cloth, Real h);
  struct Held {
    uint32_t point;
    ClothBody* body;  // null: the world
    Vec3 position;
    Vec4 from = Vec4::Zero();  // position at the start of the sub-step
  };
  /// The frame in which a point's move was shortened.
  enum Shortened : uint8_t { kWhole, kInPiece, kInWorld };
  /// The frame in which the moves of a piece of cloth are shortened. The frame moves with the piece, all
  /// cloth that it may cross and the dynamic bodies that hold it.
  struct Frame {
    bool rests = false;                 // whether it is the world's frame
    bool anchored = false;              // a fixed object holds it
    bool carries = false;               // dynamic bodies are pinned to it
    const ClothBody* leader = nullptr;  // the only body that holds it, if that is not dynamic
    const ClothBody* pusher = nullptr;  // the only body that it touches or is near, if that moves
    Vec4 move = Vec4::Zero();           // mean move of the leader's points, or of all points and bodies
    Real mass = 0;                      // mass of the same points and bodies
    Vec4 momentum = Vec4::Zero();       // momentum lost by shortening
    Vec4 velocity = Vec4::Zero();       // mean velocity of points and bodies
    Real total_mass = 0;                // mass of points and bodies
    Real follows = 0;  // fraction of the motion of a keyframed pusher with which the frame moves

    bool follows_keys() const { return pusher && !pusher->is_dynamic(); }
  };
  struct Seam {
    uint32_t cloth;
    Real open_length;  // length at the start [m]
  };

  void adapt_springs();
  void apply_air(Real dt, Real left);
  uint32_t spring_steps(std::size_t cloth, Real dt) const;
  std::span<const ClothSpring> springs_of(std::size_t cloth) const {
    return std::span(all_springs_)
        .subspan(first_spring_[cloth], first_spring_[cloth + 1] - first_spring_[cloth]);
  }
  void begin_step(const ClothWeather& weather, std::span<ClothBody> bodies);
  Real parts_in(Real h, Real speed) const;
  Real parts_by_strain() const;
  void substep(Real from, Real to, Real dt);
  void integrate(Real dt);
  void update_supports(const ClothRange& cloth);
  void limit_bending(Real dt);
  BendLimit* bend_limit_of(std::size_t cloth);
  void close_seams(Real dt);
  void disturb_flat_seams();
  void end_substep(Real dt);
  void touch_bodies(Real dt);
  void collect_triangles();

  // In cloth_assembly.cpp:
  void assemble();
  void assign_forces();

  // In cloth_holders.cpp:
  void find_held(Real time, std::span<ClothBody> bodies);
  void attach(uint32_t point, ClothBody& body, const Vec3& place);
  void set_clamps(std::size_t cloth);
  void find_pin_steps();
  void move_held();
  std::pair<Vec6, Vec6> inertia_of(const Carrier& carrier, Real dt) const;
  void begin_carriers(Real dt);
  void apply_pin_impulses_to_bodies(Real dt);
  Real fraction_at_once(std::size_t cloth, Real dt) const;
  void push_holders(Real dt);

  // In shorten_moves.cpp:
  void find_frames();
  const ClothBody* nearby_other_body(uint32_t point);
  void choose_frame(uint32_t point);
  Vec4 frame_move(uint32_t point);
  void find_followers();
  bool find_drifts();
  void shorten_moves(Real dt);
  bool shorten_in_pieces();
  bool shorten_until_valid(Shortened how);
  bool shorten_straight(Shortened how, bool& turned);
  void shorten_carrier(Carrier& carrier, Real fraction);
  void watch_frozen(std::span<const Vec4> velocity, Real dt);
  void add_momenta(Real sign, Real dt);
  std::vector<Vec4> end_velocities(Real dt) const;
  std::vector<Real> inner_energies(std::span<const Vec4> velocity);
  std::vector<Real> elastic_gains(std::span<const Vec4> whole);
  void remove_energy_gains(std::span<const Vec4> whole, std::span<const Vec4> before,
                           std::span<const Vec4> velocity);
  void restore_momenta();
  Frame& frame_of(uint32_t point) { return frames_[pieces_.of(point)]; }
  void stop_bodies(Real dt);
  std::vector<const Carrier*> carriers_of(std::size_t cloth) const;
  std::vector<Real> recoils() const;
  std::vector<std::optional<Vec3>> whole_velocities(std::span<const Real> recoil,
                                                    std::span<const Vec4> velocity) const;

  // In cloth_outcome.cpp:
  void write_back();
  bool any_tears() const;
  void tear_within(const ClothWeather& weather, Real fraction);
  uint32_t tear_at(std::size_t cloth, Real time);
  const ClothBody* touching_body(std::size_t cloth, const Vec3& place) const;
  void stop(Cloth& cloth, std::size_t first);
  void stop_diverged(Real dt);
  void count_penetration();

  std::vector<Cloth*> cloths_;
  std::vector<std::size_t> first_;         // by cloth: index of its first point
  std::vector<ClothSpring> all_springs_;   // springs of all cloths; their ends are indices into all points
  std::vector<std::size_t> first_spring_;  // by cloth: index of its first spring; and the end
  std::vector<Vec4> kick_;  // velocities at the end of a sub-step minus the velocities of the moves
  bool changed_ = false;
  Real dt_ = 0;     // length of a sub-step of cloth [s]
  Real time_ = 0;   // end of the world's sub-step [s]
  Real parts_ = 1;  // number of sub-steps of cloth in the world's sub-step

  ClothPoints points_;
  std::vector<ClothSprings> springs_;   // by `relaxed` cloth
  std::vector<Real> pin_step_;          // by cloth: the longest step of its springs for its pins [s]
  std::vector<AirDrag> air_;            // by cloth
  std::vector<GasForce> gas_;           // by cloth
  std::vector<BendLimit> bend_limits_;  // one for each cloth with such a limit
  StretchLimit limit_;
  ClothContacts contacts_;
  CornerContacts corner_contacts_;
  SelfContacts self_contacts_;
  std::vector<uint8_t> collides_;
  std::vector<Held> held_;
  std::vector<Carrier> carriers_;  // for the current sub-step of the world
  std::vector<Seam> seams_;
  std::vector<VelocityCut> cuts_;
  std::vector<BodyContact> body_contacts_;
  ClothPieces pieces_;
  std::vector<Vec4> drift_;  // the move of the frame in which each point's move is shortened
  MoveFractions fractions_;
  std::vector<Frame> frames_;       // by piece
  std::vector<uint8_t> shortened_;  // by point: the frame in which its move was shortened in this sub-step
  struct Frozen {
    uint32_t since = 0;    // number of successive sub-steps in which shortening stopped the whole cloth
    uint32_t thawed = 0;   // number of sub-steps left in which bodies near it do not stop it
    bool stopped = false;  // whether shortening stopped it in the last sub-step
  };
  std::vector<Frozen> frozen_;     // by cloth
  std::vector<uint32_t> lowered_;  // points whose fractions were lowered in a round
  std::span<ClothBody> bodies_;
};

}  // namespace offstage::sim
