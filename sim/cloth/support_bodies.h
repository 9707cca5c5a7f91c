#pragma once
/// Dynamic bodies under the supports of a cloth's points and triangles (ClothPoints::supports) in a sub-step
/// of an integrator. They get the impulses of the supports within the steps of the integrator and move in the
/// same way as the points. If a body followed only after the sub-step, its plane would stop the cloth like a
/// wall, and a light body would get more energy than the cloth loses.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/cloth/cloth_points.h"
#include "sim/cloth/resting_contacts.h"

namespace offstage::sim {

class ClothBody;

class SupportBodies {
 public:
  /// `supports` and `of_triangles`: those of the cloth that is integrated. The latter have the indices behind
  /// those of the former. `h`: length of a step [s].
  SupportBodies(const ClothPoints& points, std::span<const Support> supports,
                std::span<const TriangleSupport> of_triangles, Real h);

  std::size_t count() const { return bodies_.size(); }
  ClothBody& body(std::size_t index) const { return *bodies_[index].body; }
  static constexpr uint32_t kNone = ~uint32_t{0};
  /// Returns the index of the body under support k; kNone if no impulse moves the body.
  uint32_t body_of(std::size_t k) const { return contacts_[k].body; }
  /// Contact of support k relative to the body's centre of mass [m].
  const Vec3& arm(std::size_t k) const { return contacts_[k].arm; }

  /// Returns the mass of a point, or of the point in the triangle, on support k [kg].
  Real point_mass(std::size_t k) const { return 1 / contacts_[k].inverse_mass; }
  /// Returns the mass that an impulse between point and body along the normal of support k moves [kg].
  Real effective_mass(std::size_t k) const { return contacts_[k].effective_mass; }
  /// Returns the distance along the normal by which the impulses so far have moved the body's surface at
  /// support k, from the start of the sub-step to the end of the current step [m].
  Real displacement(std::size_t k, const Support& support) const;
  /// Applies the impulse of a point to the body under support k, times the length of a step [kg m].
  void push(std::size_t k, const Vec4& impulse);
  /// Applies friction to the body under support k for the displacement `move` of the supported point in a
  /// step that is the fraction `part` of the sub-step. Returns the change of the point's displacement.
  Vec4 apply_friction(std::size_t k, const Support& support, Real part, const Vec4& move);
  /// Begins the next step.
  void advance();
  /// Gives the bodies their impulses and displacements after the last step.
  void apply();

 private:
  struct Moved {
    ClothBody* body;
    Vec3 shift = Vec3::Zero(), turn = Vec3::Zero();  // displacement up to the start of the step [m], [rad]
    Vec3 move = Vec3::Zero(), spin = Vec3::Zero();   // displacement in the step [m], [rad]
    Vec3 impulse = Vec3::Zero(), angular = Vec3::Zero();  // sum of impulses times a step [kg m], [kg m^2]
    RestingContacts resting;                              // with velocities and impulses times a step
  };
  struct Contact {
    uint32_t body;
    Vec3 arm;
    Real inverse_mass;    // of the point, or of the point in the triangle [1/kg]
    Real effective_mass;  // [kg]
  };

  void add(const Support& support, Real inverse_mass, Real mass);

  Real h_;
  std::vector<Moved> bodies_;
  std::vector<Contact> contacts_;  // by support
};

}  // namespace offstage::sim
