#pragma once
/// All cloths of a world at work. In a sub-step of the world: outer forces, what can touch, then sub-steps of
/// cloth, in each of which every cloth moves by its integrator, then its stretch limit, its contacts with
/// cloth and those with bodies are solved, and at last moves are shortened until nothing is too long and no
/// cloth went through cloth.

#include <span>
#include <vector>

#include "sim/cloth/cloth_bodies.h"
#include "sim/cloth/cloth_contacts.h"
#include "sim/cloth/cloth_forces.h"
#include "sim/cloth/cloth_pieces.h"
#include "sim/cloth/cloth_points.h"
#include "sim/cloth/cloth_springs.h"
#include "sim/cloth/cloth_state.h"
#include "sim/cloth/corner_contacts.h"
#include "sim/cloth/self_contacts.h"
#include "sim/cloth/stretch_limit.h"

namespace offstage::sim {

class ClothSystem {
 public:
  /// The cloths to step, which must stay where they are until the next call.
  void assign(std::vector<Cloth*> cloths);

  /// Takes them through a sub-step of the world. `bodies` are those that may be touched or hold pins.
  void step(const ClothWeather& weather, std::span<ClothBody> bodies);

  /// Writes strains and counts of contacts into the cloths' reports.
  void measure();

  /// Around all points and where they may come to within h.
  Aabb reach(Real h) const;

 private:
  struct Held {
    uint32_t point;
    ClothBody* body;  // null: the world
    Vec3 position;
    Vec4 from = Vec4::Zero();  // where the sub-step began
  };
  /// In which frame a point's move was shortened.
  enum Shortened : uint8_t { kWhole, kInPiece, kInWorld };
  /// Of a piece of cloth with all that it may cross, in which its moves are shortened.
  struct Frame {
    bool rests = false;  // in the world
    bool met = false;    // what is not of the piece, in the world's frame
    const ClothBody* holder = nullptr;
    Vec4 move = Vec4::Zero(), momentum = Vec4::Zero();  // of its points, or of its pins; of a free piece
    Real mass = 0;                                      // of the same

    bool is_free() const { return !rests && !holder; }
  };
  struct Seam {
    uint32_t cloth;
    Real open_length;  // at the start [m]
  };

  void assemble();
  void find_held(Real time, std::span<ClothBody> bodies);
  void substep(Real from, Real to, Real dt, bool ends_span);
  void push_apart(Real dt);
  void move_held();
  void integrate(Real dt);
  void close_seams(Real dt);
  void touch_bodies(Real dt);
  bool find_drifts();
  void shorten_moves(Real dt, bool ends_span);
  bool shorten_in_pieces();
  bool shorten_doubtful(Shortened how);
  void add_momenta(Real sign, std::span<const Vec4> from, Real dt);
  void give_momenta_back();
  Frame& frame_of(uint32_t point) { return frames_[pieces_.of(point)]; }
  void stop_bodies();
  std::vector<ClothBody*> holders(std::size_t cloth) const;
  std::vector<Real> recoils() const;
  void end_substep(Real dt);
  void pull_bodies(Real dt);
  void write_back();
  void stop(Cloth& cloth, std::size_t first);
  void count_penetration();

  std::vector<Cloth*> cloths_;
  std::vector<std::size_t> first_;         // point of each cloth
  std::vector<ClothSpring> all_springs_;   // by cloth, between points of all
  std::vector<std::size_t> first_spring_;  // of each cloth, and the end
  std::vector<Vec4> moves_;                // of a sub-step, by outer forces and springs
  std::vector<Vec4> kick_;                 // of velocities at the end of a sub-step, beside their moves
  bool changed_ = false;
  Real parts_ = 1;  // sub-steps of cloth in one of the world

  ClothPoints points_;
  ClothSprings springs_;
  StretchLimit limit_;
  ClothContacts contacts_;
  CornerContacts corner_contacts_;
  SelfContacts self_contacts_;
  std::vector<Vec4> span_start_, free_;  // positions when the span of self-contact began; before its pushes
  uint32_t span_ = 0;                    // sub-steps of cloth since then
  std::vector<uint8_t> collides_;
  std::vector<Held> held_;
  std::vector<Seam> seams_;
  std::vector<VelocityCut> cuts_;
  ClothPieces pieces_;
  std::vector<Vec4> drift_;  // the move of the frame in which each point's move is shortened
  MoveShares shares_;
  std::vector<Frame> frames_;       // of the pieces
  std::vector<uint8_t> shortened_;  // how a point's move was, in the sub-step
  std::vector<uint32_t> lowered_;   // points whose shares were lowered in a round
  std::span<ClothBody> bodies_;
};

}  // namespace offstage::sim
