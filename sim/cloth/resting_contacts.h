#pragma once
/// Contacts of a dynamic body with the bodies on which it rests, while cloth pushes it. The contacts of
/// bodies are solved before cloths move. Without the contacts in the cloth's sub-step, cloth would push a
/// light body into the ground by F h^2 / m.
///
/// The impulses of cloth change the body's velocity as far as the contacts permit: contacts push, hold by
/// friction, and release the body on the other side. These impulses of the contacts solve a small
/// complementarity problem, which depends only on the sum of all impulses of cloth in the sub-step of the
/// world. A free body on the other side of a contact gets the opposite impulse at once. Where that body is
/// held, the contact solver gets the part of the cloth's impulses that the contact has balanced as a constant
/// force in the next sub-step, and passes it on.

#include <cstdint>
#include <span>
#include <vector>

#include "sim/core/types.h"
#include "sim/linear/block_cholesky.h"

namespace offstage::sim {

struct RestingContact {
  Vec3 arm;        ///< vector from the body's centre of mass to the contact [m]
  Vec3 normal;     ///< unit, from the other body to this one
  Real slack;      ///< change of velocity against the normal that closes the contact, >= 0 [m/s]
  uint32_t other;  ///< the other body, as Obstacle::body
  Real yield;      ///< mobility of the other body at the contact [1/kg]; 0: the other body is held
  Real friction;   ///< coefficient of static friction; 0 if the bodies slide on each other
  Real load;       ///< impulse along the normal in the world's sub-step before cloth acts [N s]
  Vec3 impulse =
      Vec3::Zero();  ///< impulse on the body because of cloth: along the normal and both tangents [N s]
};

class RestingContacts {
 public:
  RestingContacts() = default;
  /// `mobility`: change of [velocity, angular velocity] per unit of [impulse, angular impulse] about the
  /// centre of mass.
  RestingContacts(std::vector<RestingContact> contacts, const Mat6& mobility);

  bool empty() const { return contacts_.empty(); }
  std::span<const RestingContact> contacts() const { return contacts_; }
  /// Returns the impulse of contact k on the body because of cloth, in world axes [N s].
  Vec3 impulse(std::size_t k) const;
  /// Changes the mobility, for impulses on the body together with points that it carries.
  void set_mobility(const Mat6& mobility);
  /// Solves for the impulses of the contacts after a change of the body's velocity, with at most `sweeps`
  /// sweeps. `gained`: all changes of the velocities in the world's sub-step; those by the contacts are
  /// added. Returns the change of the impulse and angular impulse of the contacts.
  Vec6 respond(Vec6& gained, int sweeps = kSweeps);
  /// Returns the change of velocity along `push` per unit of an impulse `push` (a unit force and its torque),
  /// without friction. `response`: the mobility times `push`; `gained`: as in respond().
  Real mobility(const Vec6& gained, const Vec6& push, Vec6 response) const;
  /// Returns the matrix of the mobility for bodies that keep their contacts: those that cloth has pressed
  /// and, before the first impulse of cloth, those with a load. `mobility`: the matrix without contacts.
  Mat6 held_mobility(const Mat6& mobility) const;
  /// Scales all velocities and impulses, for a solver with other units.
  RestingContacts scaled(Real factor) const;

 private:
  static constexpr int kSweeps = 50;
  struct Row {
    Vec6 direction, response;
    Real mobility;  // including that of the other body
  };
  struct Rows {
    Row normal, t, k;  // t and k: tangents
  };

  std::vector<RestingContact> contacts_;
  std::vector<Rows> rows_;  // by contact
  Real tight_ = 1e-3;       // slack up to which a contact counts as closed [m/s]
  bool is_fresh_ = true;    // whether cloth has not yet pushed the body
};

}  // namespace offstage::sim
