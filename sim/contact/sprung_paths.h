#pragma once
/// Corrects the paths of bodies that springs move while contacts hold them (physics R7). The free motion
/// integrates the force of a spring along the path of a body without contacts. Where a contact holds the
/// body, the spring force does not change in this way, but the position would still contain the deviation of
/// the free path from uniform motion. A body that a stiff spring presses on the ground would sink.

#include <array>
#include <span>
#include <vector>

#include "sim/contact/contact_graph.h"

namespace offstage::sim {

class SprungPaths {
 public:
  /// Stores the deviations of the free paths from uniform motion. The bodies of the islands must have moved
  /// freely through an interval of this duration [s].
  SprungPaths(std::span<Island* const> islands, Real duration);

  /// Removes the deviations along the normals of the contacts that pushed in the interval, and along the
  /// tangents where friction held the bodies. Stores the accelerations by contacts for the next sub-step (see
  /// HeldMotion). Must be called after the contacts have changed the velocities.
  void keep_on_contacts();

 private:
  struct Path {
    Body* body;
    Vec3 shift, turn;  // deviation from the mean velocity times the duration [m], [rad]
    Vec3 shift_before, turn_before;
    Twist free;            // velocities at the end of the free motion
    Mat3 inverse_inertia;  // in world axes
  };
  struct Held {
    struct End {
      Path* path = nullptr;
      Vec3 direction, turning;  // direction of the row at this end, and arm x direction
    };
    std::array<End, 2> ends;
    Real mobility = 0;
  };
  Path* path_of(const Body& body);
  static Held hold(const std::array<Path*, 2>& paths, const Vec3& place, const Vec3& direction);

  std::span<Island* const> islands_;
  Real duration_;
  std::vector<Path> paths_;  // by rank of the bodies
};

}  // namespace offstage::sim
