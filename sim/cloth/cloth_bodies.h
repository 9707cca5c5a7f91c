#pragma once
/// Bodies as obstacles of cloth in a sub-step of the world. They follow the paths that the world gave them,
/// plus the displacement due to cloth. Their reactions are returned to the world, which applies them from its
/// next sub-step on (as for particles, P8).

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "sim/cloth/cloth_points.h"
#include "sim/cloth/resting_contacts.h"
#include "sim/collision/obstacles.h"
#include "sim/core/twist.h"
#include "sim/linear/block_cholesky.h"
#include "sim/linear/rigid_mobility.h"

namespace offstage::sim {

class ClothBody {
 public:
  /// `velocity` and `angular_velocity`: velocities of the body at the end of the world's sub-step, which has
  /// length h [s].
  ClothBody(const Obstacle& obstacle, Real h, const Vec3& velocity, const Vec3& angular_velocity);

  /// Gives a body that carries cloth a constant acceleration within the world's sub-step, as for a body that
  /// collides with nothing. The paths of other bodies are straight lines; on these, a body that hangs at rest
  /// would sag in each sub-step. `gravity` [m/s^2].
  void accelerate_steadily(const Vec3& gravity);
  /// A body to which joints connect this one, and its change of [velocity, angular velocity] per unit of
  /// [impulse, angular impulse] on this one.
  struct Connected {
    ClothBody* body;
    Mat6 response;
  };
  /// The body has joints. `mobility`: its own response to impulses; `connected`: other bodies near cloth.
  void set_joints(const Mat6& mobility, std::vector<Connected> connected) {
    jointed_ = mobility;
    connected_ = std::move(connected);
  }
  bool is_jointed() const { return jointed_.has_value(); }
  /// The path and the velocities contain the effect of this impulse and angular impulse of cloth in the
  /// world's sub-step [N s], [N m s]. Cloth sees the body without it, and adds all of its impulses. `lead`:
  /// lead() after the last sub-step of the world, with which the path began.
  void expect(const Wrench& impulse, const Wrench& lead) {
    expected_ = impulse;
    given_lead_ = unreturned_lead_ = lead;
  }
  /// Velocities of cloth and of the bodies that hold it are those within the last step of the springs. The
  /// lead is the impulse on the body from there to the end of the world's sub-step [N s], [N m s].
  const Wrench& lead() const { return lead_; }
  /// Impulses that the path contains: those expected, and the given lead.
  Wrench contained() const;
  /// Begins a sub-step of cloth, which covers the fractions `from` to `to` of the world's sub-step and lasts
  /// dt [s].
  void begin(Real from, Real to, Real dt);
  /// Takes back the part of contained() that acts in the sub-step of cloth. It is called after begin() of all
  /// bodies, because it also moves bodies to which joints connect this one.
  void take_back_contained();
  Real duration() const { return dt_; }         ///< duration of the cloth's sub-step [s]
  const Pose& start() const { return start_; }  ///< pose at the start of the cloth's sub-step
  const Pose& end() const { return end_; }
  /// Pose at a fraction of the world's sub-step, without further displacements by cloth.
  Pose predicted(Real fraction) const;
  /// As end(), without displacements by impulses on bodies to which joints connect this one.
  Pose own_end() const;
  const Solid& solid() const { return obstacle_.solid; }
  const Obstacle& obstacle() const { return obstacle_; }
  bool is_dynamic() const { return obstacle_.is_dynamic(); }
  /// Whether the body is dynamic or moves in the cloth's sub-step.
  bool moves() const {
    return is_dynamic() || start_.position != end_.position || obstacle_.angular_velocity != Vec3::Zero();
  }
  /// Mass [kg]; infinite for immovable bodies.
  Real mass() const { return 1 / obstacle_.inverse_mass; }
  const Vec3& centre() const { return centre_; }  ///< centre of mass at the end of the cloth's sub-step

  /// Displacement of the centre of mass during the cloth's sub-step [m].
  Vec3 move() const { return centre_ - start_.point_to_world(obstacle_.centre); }

  /// Displacement in the cloth's sub-step of a point that moves rigidly with the body and starts at `p` [m].
  Vec3 rigid_move(const Vec3& p) const;
  /// Displacement of the body's surface during the cloth's sub-step [m], at the surface point that is at `p`
  /// (world) at the end of that sub-step. `n`: unit normal of the surface there.
  Vec3 surface_motion(const Vec3& p, const Vec3& n) const;
  /// Velocity of the body's material point at `p` at the end of the world's sub-step, including the changes
  /// due to cloth.
  Vec3 velocity(const Vec3& p) const { return velocity_ + angular_velocity_.cross(p - centre_); }
  const Vec3& angular_velocity() const {
    return angular_velocity_;
  }  ///< angular velocity at the same time [rad/s]
  /// As velocity(), but at the end of the cloth's sub-step.
  Vec3 velocity_now(const Vec3& p) const { return velocity(p) - point_velocity(left_, p); }
  /// Change of the velocity of the point p in the cloth's sub-step that is due to the body's acceleration.
  Vec3 steady_change(const Vec3& p) const { return point_velocity(steady_change_, p); }
  /// Change of velocity against n (unit) of the point p, per unit of an impulse against n at p [1/kg]. On the
  /// other side, the contacts of the body with others may permit another change.
  Real mobility(const Vec3& p, const Vec3& n) const;
  /// Applies an impulse [N s] at a point, world.
  void apply_impulse(const Vec3& impulse, const Vec3& p);
  /// Applies the impulse of a contact [N s] at a point, and displaces the body already in this sub-step of
  /// the cloth: by `fraction` times the change of velocity times the length of the sub-step. A delayed
  /// response of the body would add energy.
  void apply_contact_impulse(const Vec3& impulse, const Vec3& p, Real fraction);
  /// Applies an impulse [N s] and an angular impulse about centre() [N m s], and displaces the body by a
  /// translation [m] and a small rotation [rad] already in this sub-step of the cloth.
  void apply_impulses(const Vec6& impulse, const Vec6& displacement);
  /// Applies an impulse and an angular impulse about centre(), in this order, to a body together with the
  /// mass of the points pinned to it. `moving` is the part of the impulse that acts from the start of the
  /// cloth's sub-step and displaces the body within it. `carried` is the 6x6 mass matrix of these points
  /// about centre() [kg, kg m, kg m^2]. Returns the change of velocity.
  Vec6 apply_pin_impulses(const Vec6& impulse, const Vec6& moving, const Mat6& carried);
  /// Sets the lead for the body together with the points pinned to it; see apply_pin_impulses().
  void set_lead(const Vec6& impulse, const Mat6& carried);
  /// Change of [velocity, angular velocity] per unit of [impulse, angular impulse] about centre(), with the
  /// mass of the pinned points; see apply_pin_impulses(). The body keeps the contacts that cloth presses.
  Mat6 mobility(const Mat6& carried) const;

  /// Sets the contacts with the bodies on which this body rests.
  void set_resting(std::vector<RestingContact> contacts) {
    resting_ = RestingContacts(std::move(contacts), free_mobility());
  }
  const RestingContacts& resting() const { return resting_; }
  /// Changes of velocity and angular velocity due to cloth in the world's sub-step.
  Vec6 gained() const { return (Vec6() << gained_, gained_spin_).finished(); }
  /// Returns the impulse and angular impulse times the time [N s^2, N m s^2] that would have displaced a body
  /// with joints as cloth on this body did in the world's sub-step.
  Vec6 displacing_impulse() const { return impulse_for(stacked(shift_, turn_) - moved_by_others_); }
  /// Mobility without contacts; as mobility() for a body without pinned points.
  Mat6 free_mobility() const;
  /// Change of the velocities by an impulse and an angular impulse, without contacts.
  Vec6 free_change(const Vec3& impulse, const Vec3& angular) const;
  /// Multiplies the body's displacement relative to `drift` [m] in this sub-step of the cloth by `fraction`,
  /// and changes its velocity accordingly. Returns the change of velocity [m/s].
  Vec3 shorten(Real fraction, const Vec3& drift);

  /// Records the impulse [N s] of a pin at p on a sleeping body, which does not move.
  void record_pin_impulse(const Vec3& impulse, const Vec3& p);
  /// Sum of the impulses and angular impulses of pins in this sub-step of the world; empty if the body has no
  /// pins.
  const std::optional<Reaction>& pin_load() const { return pin_load_; }

  /// Change of the momentum and the angular momentum by cloth, less contained().
  const Reaction& reaction() const { return reaction_; }
  /// Records that a point of cloth touches the body, with this relative speed [m/s].
  void touch(Real speed) {
    touched = true;
    touching_speed = std::max(touching_speed, speed);
  }

  /// A body against which this body presses cloth. The contact solver carries the load from body to body.
  struct Load {
    uint32_t body;      ///< the other body, Obstacle::body
    Real impulse;       ///< along the normal in the world's sub-step [N s]
    bool has_friction;  ///< whether this body exerts friction on the cloth
    Real points = 0;    ///< number of points between the two bodies
  };
  std::vector<Load> loads;
  /// Returns the load against another body, or null.
  const Load* load_against(const ClothBody& other) const {
    const auto load = std::ranges::find(loads, other.obstacle_.body, &Load::body);
    return load == loads.end() ? nullptr : &*load;
  }

  bool touched = false;     ///< whether cloth touched the body in this sub-step of the world
  Real touching_speed = 0;  ///< greatest relative speed of such a contact [m/s]
  /// Whether cloth is pinched between this body and another one in this sub-step of the world.
  bool pinches = false;
  bool collides = true;  ///< whether cloth collides with the body; false: the body only holds pins

 private:
  Vec3 point_velocity(const Vec6& of, const Vec3& p) const {
    return of.head<3>() + of.tail<3>().cross(p - centre_);
  }
  void take_back(const Wrench& impulse, Real displacing_time);
  Vec6 impulse_for(const Vec6& displacement) const;
  void displace_connected(const Vec6& impulse);
  void move_end();
  void accelerate(const Vec3& dv, const Vec3& dw);
  void take(const Vec6& change, const Vec6& impulse);
  Vec6 respond(RestingContacts& contacts, const Vec6& free_change, Vec6& impulse) const;
  void add_impulse(Vec6 impulse);
  Mat6 carrying_mobility(const Mat6& carried) const;
  Pose on_path(Real fraction) const;

  Obstacle obstacle_;
  Real h_;
  Vec3 velocity_, angular_velocity_;  // at the centre of mass, at the end of the world's sub-step
  Vec3 gained_ = Vec3::Zero(), gained_spin_ = Vec3::Zero();  // changes of the velocities due to cloth
  Vec3 shift_ = Vec3::Zero(), turn_ = Vec3::Zero();          // displacement and rotation by cloth
  Vec3 centre_ = Vec3::Zero();  // centre of mass at the end of the cloth's sub-step
  Pose start_, end_;            // poses at the start and the end of the cloth's sub-step
  // Deviations of the path from a line, and of the rotation from a constant rate: half the acceleration times
  // the square of the world's sub-step.
  Vec3 bow_ = Vec3::Zero(), turn_bow_ = Vec3::Zero();
  Vec6 steady_change_ = Vec6::Zero();  // of the velocities in the cloth's sub-step, by constant accelerations
  Vec6 left_ = Vec6::Zero();           // the same from its end to the end of the world's sub-step
  Real dt_ = 0, to_ = 0;               // dt_: length of the cloth's sub-step [s]; to_: its end as a fraction
                                       // of the world's sub-step
  bool is_steady_ = false;             // whether the path has a constant acceleration
  bool is_still_ = false;              // whether its surface stood still at the start of the cloth's sub-step
  RestingContacts resting_;
  std::optional<Mat6> jointed_;  // mobility of a body with joints
  std::vector<Connected> connected_;
  // Parts of shift_ and turn_, and of gained_ and gained_spin_, that are due to impulses on connected bodies.
  Vec6 moved_by_others_ = Vec6::Zero(), gained_by_others_ = Vec6::Zero();
  Wrench expected_, given_lead_, unreturned_lead_, lead_;
  Reaction reaction_;
  std::optional<Reaction> pin_load_;
};

/// A dynamic body and the cloth points that are pinned to it.
struct Carrier {
  ClothBody* body;
  std::vector<uint32_t> points;
  std::vector<Vec3> places;  ///< position of each point, in the body's frame [m]
  /// Impulse and angular impulse of the inertia and the weight of the points that displace the body in the
  /// cloth's sub-step, and those of the springs of cloth with the integrator `relaxed`; see apply_loads().
  Vec6 inertia = Vec6::Zero(), early = Vec6::Zero();

  /// Mass matrix of the points about the body's centre, or about another one.
  Mat6 carried(const ClothPoints& cloth) const { return carried(cloth, body->centre()); }
  Mat6 carried(const ClothPoints& cloth, const Vec3& centre) const;
  /// Moves the points with the body to the end of the cloth's sub-step.
  void place(ClothPoints& points) const;
  /// Applies an impulse to the body and its points, and moves the points. `moving`: the part of the impulse
  /// that also displaces the body within the sub-step, as in ClothBody::apply_pin_impulses().
  void apply_impulses(const Vec6& impulse, const Vec6& moving, ClothPoints& cloth) const {
    apply_impulses(impulse, moving, carried(cloth), cloth);
  }
  /// The same for the impulses of springs and the inertia of the points, which also determine the lead of the
  /// body.
  void apply_loads(const Vec6& impulse, const Vec6& moving, ClothPoints& cloth) const;
  /// Gives body and points the impulses that would change their velocity by `gain` if the body were free.
  void accelerate_whole(const Vec3& gain, ClothPoints& points) const;
  /// Applies a change of the body's velocity and angular velocity to the points. It must have been computed
  /// with the mass of the points included. Other changes of the body's velocity are applied to the points in
  /// ClothSystem::apply_pin_impulses_to_bodies().
  void accelerate(const Vec3& dv, ClothPoints& points) const;

 private:
  void apply_impulses(const Vec6& impulse, const Vec6& moving, const Mat6& mass, ClothPoints& cloth) const;
};

}  // namespace offstage::sim
