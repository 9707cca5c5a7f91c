/// Shapes of cloth against the theory of heavy elastic strips: hanging loops (Peirce, "The 'handle' of cloth
/// as a measurable quantity", 1930), curvature at rest, damping of bending.

#include <cmath>
#include <numbers>
#include <string>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr Real kShapesGravity = 9.81;

/// Half of a loop: a heavy strip of the length `half` that bends without stretching. It begins at a clamp at
/// the origin, where its angle to the horizontal is `start`, and ends in the middle of the loop, where its
/// angle is -pi by symmetry. The angle theta satisfies B theta'' = F sin theta + w (half - s) cos theta,
/// where F is the force along x in the loop and w the weight per area.
class HeavyLoop {
 public:
  HeavyLoop(Real start, Real half, Real rigidity, Real weight)
      : start_(start), half_(half), rigidity_(rigidity) {
    // The iteration starts with the weightless loop, whose curvature is about constant.
    Eigen::Vector2d unknown(0, -(start + std::numbers::pi) / half);
    for (int i = 0; i <= kSteps; ++i) {
      weight_ = weight * i / kSteps;
      for (int newton = 0; newton < 30; ++newton) {
        const Eigen::Vector2d miss = residual(unknown);
        if (miss.norm() < 1e-10) break;
        Eigen::Matrix2d slope;
        const Eigen::Vector2d small(1e-6 * rigidity / (half * half), 1e-6 / half);
        for (int k = 0; k < 2; ++k)
          slope.col(k) = (residual(unknown + small[k] * Eigen::Vector2d::Unit(k)) - miss) / small[k];
        unknown -= slope.partialPivLu().solve(miss);
      }
    }
    miss_ = residual(unknown).norm();
  }
  Real height() const { return -lowest_; }  ///< height from the clamp to the middle [m]
  Real miss() const { return miss_; }

 private:
  static constexpr int kSteps = 20, kPoints = 400;

  /// Returns the differences between the actual and the required angle and position of the middle.
  Eigen::Vector2d residual(const Eigen::Vector2d& unknown) {
    using State = Eigen::Vector4d;  // theta, theta', x, y
    const auto slope = [&](Real s, const State& y) {
      const Real moment = unknown[0] * std::sin(y[0]) + weight_ * (half_ - s) * std::cos(y[0]);
      return State(y[1], moment / rigidity_, std::cos(y[0]), std::sin(y[0]));
    };
    State y(start_, unknown[1], 0, 0);
    const Real h = half_ / kPoints;
    for (int i = 0; i < kPoints; ++i) {
      const Real s = i * h;
      const State a = slope(s, y), b = slope(s + h / 2, y + h / 2 * a), c = slope(s + h / 2, y + h / 2 * b),
                  d = slope(s + h, y + h * c);
      y += h / 6 * (a + 2 * b + 2 * c + d);
    }
    lowest_ = y[3];
    return {y[0] + std::numbers::pi, y[2] / half_};
  }

  Real start_, half_, rigidity_, weight_ = 0, lowest_ = 0, miss_ = 0;
};

TEST(HeavyLoop, AgreesWithPeircesWeightlessLoops) {
  // Heights of Peirce's ring and heart loops, as fractions of the length of the strip.
  EXPECT_NEAR(HeavyLoop(0, 0.5, 1, 0).height(), 0.3183, 1e-3);
  EXPECT_NEAR(HeavyLoop(std::numbers::pi / 2, 0.5, 1, 0).height(), 0.1337, 1e-3);
}

/// Parameter: angle at the clamp, 0 for a ring loop, pi/2 for a heart loop.
class ClothLoop : public testing::TestWithParam<Real> {};

TEST_P(ClothLoop, HangsAsAHeavyElasticStrip) {
  constexpr Real kLength = 0.2, kDensity = 0.15, kRigidity = 1.2e-4;
  constexpr uint32_t kCells = 80;  // the bends of the heart loop have a radius of 10 mm
  const Real start = GetParam(), cell = kLength / kCells, half = kLength / 2;
  const HeavyLoop expected(start, half, kRigidity, kDensity * kShapesGravity);
  ASSERT_LT(expected.miss(), 1e-6);
  // The weight changes the shape by more than the tolerance.
  const HeavyLoop weightless(start, half, kRigidity, 0);
  ASSERT_GT(expected.height(), 1.06 * weightless.height());

  effects::Fabric fabric = effects::find_fabric("cotton")->fabric;
  fabric.areal_density = kDensity;
  fabric.bend = kRigidity;
  fabric.bend_damping = 0.02;
  // The strip has an additional, clamped cell at each end.
  ClothDef def = effects::grid_cloth({kLength + 2 * cell, 3 * cell, kCells + 2, 3}, {}, fabric);
  def.self_collision = def.collides = false;
  def.rest_vertices = def.vertices;
  // At the start, each half is an arc; in a heart loop, a straight piece as long as the radius of the arc
  // follows.
  const Real turn = start + std::numbers::pi, radius = half / (turn + (start > 0 ? 1 : 0));
  const auto place = [&](Real s) {
    if (s < 0) return Eigen::Vector2d(s * std::cos(start), s * std::sin(start));
    const Real angle = start - std::min(s / radius, turn), straight = std::max(0.0, s - radius * turn);
    return Eigen::Vector2d(radius * (std::sin(start) - std::sin(angle)) - straight,
                           radius * (std::cos(angle) - std::cos(start)));
  };
  for (uint32_t i = 0; i < def.vertices.size(); ++i) {
    Vec3& p = def.vertices[i];
    const bool left = p.x() < 0;
    const Eigen::Vector2d at = place(half - std::abs(p.x()));
    p = Vec3(left ? -at.x() : at.x(), at.y(), p.z());
    if (std::abs(def.rest_vertices[i].x()) > half - cell / 2)
      def.pins.push_back({.vertex = i, .position = p});
  }
  World world;
  const ClothHandle cloth = world.add_cloth(def);
  for (int i = 0; i < 48; ++i) world.step(1.0 / 24);
  Real height = 0, count = 0;
  for (uint32_t i = 0; i < def.vertices.size(); ++i)
    if (std::abs(def.rest_vertices[i].x()) < cell / 4) {
      height -= world.cloth(cloth).points[i].y();
      ++count;
    }
  EXPECT_NEAR(height / count / expected.height(), 1, 0.03);
}

INSTANTIATE_TEST_SUITE_P(Loops, ClothLoop, testing::Values(0, std::numbers::pi / 2));

/// Returns a free strip along x that is bent to a part of a cylinder with the radius 1 / `curvature`.
ClothDef bent_strip(const effects::Fabric& fabric, uint32_t cells, Real length, Real curvature) {
  ClothDef def = effects::grid_cloth({length, 0.2 * length, cells, cells / 5}, {}, fabric);
  for (Vec3& p : def.vertices) {
    const Real angle = curvature * p.x();
    p = Vec3(std::sin(angle) / curvature, (1 - std::cos(angle)) / curvature, p.z());
  }
  def.self_collision = def.collides = false;
  def.air.density = 0;
  return def;
}

Real end_to_end(const ClothView& view, uint32_t cells) {
  return (view.points[cells] - view.points[0]).norm();
}

TEST(ClothRestCurvature, IsTheFractionThatIsUnstressed) {
  // A cloth without loads takes the curvature at rest: the ends of a strip of the length l are 2 sin(k l / 2)
  // / k apart.
  constexpr uint32_t kCells = 20;
  constexpr Real kLength = 0.2, kCurvature = 8;
  effects::Fabric fabric = effects::find_fabric("denim")->fabric;
  fabric.bend_damping = 0.1;  // 0.7 of the critical damping
  for (Real fraction : {0.0, 0.5, 1.0}) {
    ClothDef def = bent_strip(fabric, kCells, kLength, kCurvature);
    def.rest_curvature = fraction;
    World world({.gravity = Vec3::Zero()});
    const ClothHandle cloth = world.add_cloth(def);
    for (int i = 0; i < 24; ++i) world.step(1.0 / 24);
    const Real k = fraction * kCurvature;
    const Real expected = k > 0 ? 2 * std::sin(k * kLength / 2) / k : kLength;
    // The difference to the flat strip is 0.02 m of 0.2 m.
    EXPECT_NEAR(end_to_end(world.cloth(cloth), kCells), expected, 0.002) << fraction;
  }
}

TEST(ClothBendDamping, EndsVibrationAtTheRateOfItsTime) {
  // The first free vibration of a free strip: w^2 = (4.730 / l)^4 B / rho; its amplitude falls by
  // exp(-tau w^2 t / 2) where the moment is B (kappa + tau d kappa / dt).
  constexpr uint32_t kCells = 30;
  constexpr Real kLength = 0.2;
  effects::Fabric fabric = effects::find_fabric("denim")->fabric;
  fabric.bend = 2e-3;
  fabric.damping = 0;
  const Real w2 = std::pow(4.7300 / kLength, 4) * fabric.bend / fabric.areal_density, w = std::sqrt(w2);
  for (Real ratio : {0.0, 0.03, 0.1}) {
    fabric.bend_damping = 2 * ratio / w;
    ClothDef def = effects::grid_cloth({kLength, 0.04, kCells, 6}, {}, fabric);
    def.self_collision = def.collides = false;
    def.air.density = 0;
    def.rest_vertices = def.vertices;
    // The mode of a free beam, with an amplitude of a hundredth of its length at the ends.
    const auto mode = [&](Real x) {
      const Real b = 4.7300 / kLength;
      return 0.01 * kLength / 2 *
             (std::cosh(b * x) / std::cosh(b * kLength / 2) + std::cos(b * x) / std::cos(b * kLength / 2));
    };
    for (Vec3& p : def.vertices) p.y() = mode(p.x());
    constexpr Real kStep = 2e-4;
    World world({.gravity = Vec3::Zero(), .max_step = kStep});
    const ClothHandle cloth = world.add_cloth(def);
    // Greatest deflection of an end against the middle around the times of the first and the third maximum.
    const Real period = 2 * std::numbers::pi / w;
    const auto deflection = [&] {
      const ClothView view = world.cloth(cloth);
      return view.points[3 * (kCells + 1)].y() - view.points[3 * (kCells + 1) + kCells / 2].y();
    };
    const Real first = deflection();
    Real later = 0;
    for (Real t = 0; t < 2.4 * period; t += kStep) {
      world.step(kStep);
      if (t > 1.6 * period) later = std::max(later, deflection());
    }
    const Real damped = std::sqrt(1 - ratio * ratio);
    // Backward Euler with the step h adds numerical damping at the rate w^2 h / 2.
    EXPECT_NEAR(std::log(first / later), 4 * std::numbers::pi * ratio / damped, 0.1 + 0.05 * ratio) << ratio;
  }
}

/// Returns the amplitude of an undamped strip's third symmetric free vibration after ten periods, as a
/// fraction of the amplitude at the start, with the default sub-step. `bend`: rigidity [N m].
Real amplitude_after_ten_periods(Real bend) {
  constexpr uint32_t kCells = 30, kMiddleRow = 3 * (kCells + 1);
  constexpr Real kLength = 0.2, kMode = 10.9956;
  effects::Fabric fabric = effects::find_fabric("denim")->fabric;
  fabric.bend = bend;
  fabric.damping = fabric.bend_damping = 0;
  ClothDef def = effects::grid_cloth({kLength, 0.04, kCells, 6}, {}, fabric);
  def.self_collision = def.collides = false;
  def.air.density = 0;
  def.rest_vertices = def.vertices;
  for (Vec3& p : def.vertices) {
    const Real b = kMode / kLength;
    p.y() = 2e-4 * (std::cosh(b * p.x()) / std::cosh(kMode / 2) + std::cos(b * p.x()) / std::cos(kMode / 2));
  }
  World world({.gravity = Vec3::Zero()});
  const ClothHandle cloth = world.add_cloth(def);
  const auto deflection = [&] {
    const auto points = world.cloth(cloth).points;
    return std::abs(points[kMiddleRow].y() - points[kMiddleRow + kCells / 2].y());
  };
  const Real first = deflection();
  const Real period =
      2 * std::numbers::pi * std::pow(kLength / kMode, 2) * std::sqrt(fabric.areal_density / bend);
  Real last = 0;
  for (Real t = 0; t < 10 * period; t += def.substep) {
    world.step(def.substep);
    if (t > 8.5 * period) last = std::max(last, deflection());
  }
  return last / first;
}

TEST(ClothBendDamping, UndampedVibrationKeepsItsAmplitude) {
  // Backward Euler in each of the 14 steps of the springs would take 9 %, 29 % and 50 %.
  for (Real bend : {2e-5, 1e-3, 5e-3}) EXPECT_NEAR(amplitude_after_ten_periods(bend), 1, 0.05) << bend;
}

}  // namespace
}  // namespace offstage::sim
