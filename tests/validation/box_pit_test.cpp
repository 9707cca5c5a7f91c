/// Unit boxes dropped into a pit, as in the benchmarks of other engines. The test computes the overlaps
/// itself.

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tests/box_scene.h"
#include "tests/validation/both_solvers.h"

namespace offstage::sim {
namespace {

struct PlacedBox {
  Vec3 half, centre;
  Mat3 axes;
};

/// Returns the depth of the overlap of two boxes by the separating axis theorem; 0 if they are apart.
Real overlap(const PlacedBox& a, const PlacedBox& b) {
  const Vec3 way = b.centre - a.centre;
  if (way.norm() >= a.half.norm() + b.half.norm()) return 0;
  Real least = std::numeric_limits<Real>::infinity();
  const auto try_axis = [&](const Vec3& axis) {
    const Real length = axis.norm();
    if (length < 1e-7) return;  // parallel edges: a face normal gives the same axis
    const Real reach = a.half.dot((a.axes.transpose() * axis).cwiseAbs()) +
                       b.half.dot((b.axes.transpose() * axis).cwiseAbs());
    least = std::min(least, (reach - std::abs(axis.dot(way))) / length);
  };
  for (int i = 0; i < 3 && least > 0; ++i) {
    try_axis(a.axes.col(i));
    try_axis(b.axes.col(i));
  }
  for (int i = 0; i < 3 && least > 0; ++i)
    for (int j = 0; j < 3; ++j) try_axis(a.axes.col(i).cross(b.axes.col(j)));
  return std::max<Real>(least, 0);
}

class Pit : public BothSolvers {
 protected:
  /// Samples sixty times a second for 6 s; `most` is the greatest overlap [m].
  static void expect_keeps_apart(int count, Real most) {
    World world(def());
    std::vector<BodyHandle> bodies;
    std::vector<PlacedBox> boxes;
    const BoxScene scene = box_pile(count);
    // half width of the pit; the floor is 2 m wider on each side
    const Real wide = scene.bodies.front().size.x() / 2 - 2;
    for (const BoxBody& b : scene.bodies) {
      bodies.push_back(world.add_body({.shape = Box{b.size},
                                       .motion = b.mass == 0 ? MotionType::static_body : MotionType::dynamic,
                                       .pose = b.pose,
                                       .mass = b.mass,
                                       .restitution = 0}));
      boxes.push_back({b.size / 2, b.pose.position, b.pose.orientation.toRotationMatrix()});
    }
    const Real highest = scene.bodies.back().pose.position.y() + 0.5;
    Tally all;
    Real deepest = 0;
    for (int k = 0; k < 360; ++k) {
      all.add(world.step(1.0 / 60));
      for (std::size_t i = 0; i < bodies.size(); ++i) {
        const Pose pose = world.body(bodies[i]).pose;
        boxes[i].centre = pose.position;
        boxes[i].axes = pose.orientation.toRotationMatrix();
        if (scene.bodies[i].mass == 0) continue;
        const Vec3& at = pose.position;
        ASSERT_TRUE(std::abs(at.x()) < wide && std::abs(at.z()) < wide && at.y() > 0 && at.y() < highest)
            << at.transpose() << " after " << world.time() << " s";
      }
      for (std::size_t i = 0; i < boxes.size(); ++i) {
        if (scene.bodies[i].mass == 0) continue;
        for (std::size_t j = 0; j < i; ++j) deepest = std::max(deepest, overlap(boxes[i], boxes[j]));
      }
    }
    EXPECT_TRUE(all.finite);
    EXPECT_LT(deepest, most);
  }
};
class LongPit : public Pit {};

TEST_P(Pit, NothingEscapesOrOverlapsByMoreThanMillimetres) {
  expect_keeps_apart(is_exact() ? 100 : 500, is_exact() ? 1e-3 : 4e-3);
}
TEST_P(LongPit, NothingEscapesOrOverlapsByMoreThanMillimetres) {
  expect_keeps_apart(is_exact() ? 500 : 1500, is_exact() ? 2e-3 : 4e-3);
}
OFFSTAGE_BOTH_SOLVERS(Solvers, Pit);
OFFSTAGE_BOTH_SOLVERS(Long, LongPit);

}  // namespace
}  // namespace offstage::sim
