#pragma once
/// Private to ContactPair: manifolds are found in a's frame and placed in the world.

#include "sim/collision/manifold.h"
#include "sim/dynamics/body.h"

namespace offstage::sim {

/// A pose for transforming many vectors. Its rotation matrix is computed only once.
struct PoseMatrix {
  explicit PoseMatrix(const Pose& pose)
      : position(pose.position), axes(pose.orientation.toRotationMatrix()) {}

  Vec3 point_to_world(const Vec3& p) const { return axes * p + position; }
  Vec3 point_to_body(const Vec3& p) const { return axes.transpose() * (p - position); }
  Vec3 vector_to_world(const Vec3& v) const { return axes * v; }
  Vec3 vector_to_body(const Vec3& v) const { return axes.transpose() * v; }

  Vec3 position;
  Mat3 axes;
};

/// Returns the pose of b in a's frame.
inline Pose relative_pose(const Pose& a, const Pose& b) {
  return {a.point_to_body(b.position), a.orientation.conjugate() * b.orientation};
}

/// Turns the lines of a manifold into the world. The normal of a face, which is the most frequent one, has
/// none.
void turn_lines(const Manifold& local, const Mat3& axes, Manifold& m);

/// Transforms a manifold from the frame `from` to the world. Only the existing points are copied.
void place_manifold(const Manifold& local, const Pose& from, Manifold& m);

/// Corrects the points of a manifold in a's frame that are on leaning rims. A manifold represents a disc by a
/// polygon; its lowest point may be between two corners.
void follow_rims(Manifold& m, const Body& a, const Body& b, const Pose& a_from_b);

}  // namespace offstage::sim
