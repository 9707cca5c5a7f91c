/// Contacts that move along the bodies, compared with closed forms: rolling, precession on a rim, sliding
/// with spin, rest on moving bodies. Each test runs with all solvers, with the default step and with a step
/// of one frame.

#include <cmath>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "sim/geometry/solid_mesh.h"
#include "sim/world.h"
#include "solids.h"
#include "tests/validation/both_solvers.h"

namespace offstage::sim {
namespace {

using std::numbers::pi;

class MovingContact : public testing::TestWithParam<std::tuple<SolverKind, int>> {
 protected:
  static SolverKind solver() { return std::get<0>(GetParam()); }
  static Real step() { return 1.0 / std::get<1>(GetParam()); }
  static World world() { return World(WorldDef{.max_step = step(), .solver = solver(), .sleep = false}); }
  static BodyDef ground(Real friction) {
    return {.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0, .friction = friction};
  }
  static void run(World& world, Real seconds) {
    const int frames = static_cast<int>(std::lround(60 * seconds));
    for (int i = 0; i < frames; ++i) world.step(1.0 / 60);
  }
};

const Quat kLying(Eigen::AngleAxisd(pi / 2, Vec3::UnitX()));

TEST_P(MovingContact, RollingBodiesKeepTheirSpeed) {
  constexpr Real kRadius = 0.3;
  const std::vector<Shape> shapes = {Sphere{kRadius}, Cylinder{kRadius, 0.8}, Capsule{kRadius, 0.5},
                                     Cylinder{kRadius, 0.1}};
  for (std::size_t i = 0; i < shapes.size(); ++i)
    for (const Real speed : {2.0, 10.0}) {
      World w = world();
      w.add_body(ground(0.8));
      const BodyHandle body = w.add_body({.shape = shapes[i],
                                          .pose = {Vec3(0, kRadius, 0), kLying},
                                          .velocity = Vec3(speed, 0, 0),
                                          .angular_velocity = Vec3(0, 0, -speed / kRadius),
                                          .mass = 10,
                                          .restitution = 0,
                                          .friction = 0.8});
      Real highest = 0;
      for (int frame = 0; frame < 600; ++frame) {
        w.step(1.0 / 60);
        highest = std::max(highest, w.body(body).centre.y());
      }
      EXPECT_NEAR(w.body(body).velocity.x(), speed, 1e-3 * speed) << "shape " << i;
      EXPECT_LT(highest, kRadius + 1e-4) << "shape " << i;
    }
}

/// Returns a cart: two axles with wheels on a chassis that touches nothing else. The rear axle may have a
/// motor.
BodyHandle add_cart(World& w, Real speed, Real torque, Real mass = 80) {
  constexpr Real kRadius = 0.3;
  const BodyHandle chassis = w.add_body({.shape = Box{{2, 0.2, 1}},
                                         .pose = {Vec3(0, kRadius, 0), Quat::Identity()},
                                         .velocity = Vec3(speed, 0, 0),
                                         .mass = mass,
                                         .collides = false});
  for (const Real x : {-0.8, 0.8}) {
    const Vec3 place(x, kRadius, 0);
    const BodyHandle wheel = w.add_body({.shape = Cylinder{kRadius, 0.8},
                                         .pose = {place, kLying},
                                         .velocity = Vec3(speed, 0, 0),
                                         .angular_velocity = Vec3(0, 0, -speed / kRadius),
                                         .mass = 10,
                                         .restitution = 0,
                                         .friction = 1});
    JointDef axle{.type = JointType::revolute, .a = chassis, .b = wheel, .anchor = place};
    if (torque > 0 && x < 0)
      axle.motor = {.mode = Motor::Mode::speed, .targets = {{0, 1000}}, .max_effort = torque};
    w.add_joint(axle);
  }
  return chassis;
}

TEST_P(MovingContact, ACartOnFreeWheelsKeepsItsSpeed) {
  World w = world();
  w.add_body(ground(1));
  const BodyHandle chassis = add_cart(w, 8, 0);
  run(w, 5);
  EXPECT_NEAR(w.body(chassis).velocity.x(), 8, 8e-3);
  EXPECT_NEAR(w.body(chassis).velocity.y(), 0, 5e-3);
}

TEST_P(MovingContact, LightWheelsCarryAHeavyCart) {
  World w = world();
  w.add_body(ground(1));
  const BodyHandle chassis = add_cart(w, 5, 0, 2000);
  Real lowest = 1;
  for (int i = 0; i < 60; ++i) {
    run(w, 0.05);
    lowest = std::min(lowest, w.body(chassis).centre.y());
  }
  EXPECT_GT(lowest, 0.3 - 1e-3);
  EXPECT_NEAR(w.body(chassis).velocity.x(), 5, 5e-4);
}

// The torque T on wheels of radius R accelerates the mass m and rotates the wheels, each with I = m_w R^2 /
// 2.
TEST_P(MovingContact, AMotorAcceleratesACartByItsTorque) {
  World w = world();
  w.add_body(ground(1));
  const BodyHandle chassis = add_cart(w, 0, 60);
  run(w, 3);
  const Real acceleration = 60 / 0.3 / (100 + 2 * 0.5 * 10);
  EXPECT_NEAR(w.body(chassis).velocity.norm(), 3 * acceleration, 0.01 * 3 * acceleration);
}

/// A coin that rolls on its rim around a point below its centre of mass, which is at rest.
struct Coin {
  Real radius, height, tilt;
  Real hole = 0;         ///< radius of a hole through the coin [m]
  bool is_part = false;  ///< whether it is the only part of a compound; a coin with a hole is
  Real mass = 0.44;

  Vec3 axis() const { return {std::sin(tilt), std::cos(tilt), 0}; }
  /// Returns the vector from the centre to the contact.
  Vec3 arm() const {
    const Vec3 down = -(Vec3::UnitY() - std::cos(tilt) * axis()).normalized();
    return radius * down - height / 2 * axis();
  }
  /// Returns the angular velocity for a precession of 1 rad/s. The contact point and the centre are at rest,
  /// so the coin rotates about the line through both. This rotation is the sum of the precession about the
  /// vertical and a spin about the coin's axis.
  Vec3 angular_velocity_per_precession() const {
    const Vec3 line = arm().normalized();
    Eigen::Matrix2d parts;
    parts << line.x(), -axis().x(), line.y(), -axis().y();
    return Vec3((parts.inverse() * Eigen::Vector2d(0, 1)).x() * line);
  }
  /// Returns the rate of precession at which the torque of the normal force rotates the angular momentum
  /// about the vertical.
  Real precession() const {
    const Real squares = radius * radius + hole * hole;
    const Real across = mass * (3 * squares + height * height) / 12, along = mass * squares / 2;
    const Vec3 w = angular_velocity_per_precession();
    const Vec3 momentum = across * w + (along - across) * w.dot(axis()) * axis();
    return std::sqrt(arm().cross(Vec3(0, mass * 9.81, 0)).z() / Vec3::UnitY().cross(momentum).z());
  }
  BodyHandle add_to(World& w, Real friction) const {
    Shape shape = Cylinder{radius, height};
    if (hole > 0)
      shape = MeshShape{w.add_compound({solid_mesh(Tube{radius, height, radius - hole})})};
    else if (is_part)
      shape = MeshShape{w.add_compound({solid_mesh(shape)})};
    const Real squares = radius * radius + hole * hole, across = mass * (3 * squares + height * height) / 12;
    return w.add_body({.shape = shape,
                       .pose = {Vec3(0, -arm().y(), 0), Quat(Eigen::AngleAxisd(-tilt, Vec3::UnitZ()))},
                       .angular_velocity = precession() * angular_velocity_per_precession(),
                       .mass = mass,
                       .inertia = Vec3(across, mass * squares / 2, across).asDiagonal().toDenseMatrix(),
                       .restitution = 0,
                       .friction = friction});
  }
};

/// Returns the relative energy gain of a coin within two seconds. The ground is a plane or a box.
Real gain(const Coin& coin, const WorldDef& def, Real friction, bool on_box = false) {
  World w(def);
  w.add_body({.shape = on_box ? Shape(Box{Vec3(10, 0.2, 10)}) : Shape(Plane{}),
              .motion = MotionType::static_body,
              .pose = {Vec3(0, on_box ? -0.1 : 0, 0), Quat::Identity()},
              .restitution = 0,
              .friction = friction});
  coin.add_to(w, friction);
  const Real before = w.energy().total();
  for (int i = 0; i < 120; ++i) w.step(1.0 / 60);
  return w.energy().total() / before - 1;
}

TEST_P(MovingContact, ACoinInSteadyPrecessionKeepsItsEnergy) {
  const WorldDef def{.max_step = step(), .solver = solver(), .sleep = false};
  EXPECT_NEAR(gain({0.3, 0.05, 70 * pi / 180}, def, 0.5), 0, 5e-3);
  // The next coins turn by up to 0.8 rad in a frame.
  const Real tolerance = solver() == SolverKind::fast ? 0.006 : 0.002;
  EXPECT_NEAR(gain({0.0375, 0.0127, 60 * pi / 180}, def, 0.5), 0, tolerance);
  EXPECT_NEAR(gain({0.0375, 0.0127, 60 * pi / 180}, def, 0.3), 0, tolerance);
  EXPECT_NEAR(gain({0.0375, 0.0127, 30 * pi / 180}, def, 2), 0, tolerance);
}

// A disc as part of a compound, and a ring. Where their rims did not follow the lowest point within a step,
// they lost 2 to 88 % and lay down. At 1/60 s with `fast`, any disc on a box loses 10 %; a ring does not.
TEST_P(MovingContact, RoundPartsInSteadyPrecessionKeepTheirEnergy) {
  const WorldDef def{.max_step = step(), .solver = solver(), .sleep = false};
  const bool is_fast = solver() == SolverKind::fast;
  const Real tolerance = is_fast ? 0.005 : 0.001;
  for (const Real tilt : {10 * pi / 180, 30 * pi / 180})
    for (const bool on_box : {false, true}) {
      EXPECT_NEAR(gain({0.2, 0.04, tilt, 0.18}, def, 2, on_box), 0, tolerance) << tilt << on_box;
      if (on_box && is_fast && step() > 0.01) continue;
      EXPECT_NEAR(gain({0.2, 0.04, tilt, 0, true}, def, 2, on_box), 0, tolerance) << tilt << on_box;
    }
}

// At half the step the error is a quarter, where a first-order method would have a half.
TEST_P(MovingContact, TheErrorOfPrecessionIsOfTheSecondOrder) {
  const Coin coin{0.3, 0.05, 70 * pi / 180};
  const auto height_after = [&](Real step_length) {
    World w(WorldDef{.max_step = step_length, .solver = solver(), .sleep = false});
    w.add_body(ground(0.5));
    const BodyHandle body = coin.add_to(w, 0.5);
    Real turned = 0;
    Vec3 last = w.body(body).pose.orientation * Vec3::UnitY();
    for (int i = 0; i < 60; ++i) {
      w.step(1.0 / 60);
      const Vec3 axis = w.body(body).pose.orientation * Vec3::UnitY();
      turned +=
          std::atan2(last.z() * axis.x() - last.x() * axis.z(), last.x() * axis.x() + last.z() * axis.z());
      last = axis;
    }
    return std::abs(turned) - coin.precession();
  };
  // A turn of more than 0.1 rad is divided, so the steps are at most 1/240 s.
  const Real longest = std::min(step(), 1.0 / 240);
  const Real coarse = std::abs(height_after(longest)), fine = std::abs(height_after(longest / 2));
  EXPECT_LT(fine, 0.35 * coarse + 1e-4);
}

// The heavy side goes up and down while the body rolls, so that its speed changes all the time.
TEST_P(MovingContact, UnbalancedCylindersAndBallsKeepTheirEnergy) {
  constexpr Real kRadius = 0.3, kSpin = 6;
  for (const Shape& shape : {Shape(Cylinder{kRadius, 0.4}), Shape(Sphere{kRadius})})
    for (const Real off_axis : {0.05, 0.15}) {
      World w = world();
      w.add_body(ground(1));
      w.add_body({.shape = shape,
                  .pose = {Vec3(0, kRadius, 0), kLying},
                  .velocity = Vec3(0, 0, -kSpin).cross(Vec3(off_axis, kRadius, 0)),
                  .angular_velocity = Vec3(0, 0, -kSpin),
                  .mass = 5,
                  .centre = Vec3(off_axis, 0, 0),
                  .restitution = 0,
                  .friction = 1});
      const Real energy = w.energy().total();
      // The error is of second order in the step; the body turns by 0.1 rad and more in 1/60 s.
      const Real tolerance = step() > 0.01 && off_axis > 0.1 ? 1e-2 : 5e-4;
      for (int i = 0; i < 240; ++i) {
        w.step(1.0 / 60);
        ASSERT_NEAR(w.energy().total(), energy, tolerance * energy)
            << shape.index() << ", " << off_axis << " at " << w.time() << " s";
      }
    }
}

// A toy that stands up again: its centre of mass is below the middle of the ball.
TEST_P(MovingContact, ABallWithALowCentreRocksForEver) {
  constexpr Real kTilt = 1;
  World w = world();
  w.add_body(ground(1));
  w.add_body({.shape = Sphere{0.5},
              .pose = {Vec3(0, 0.5, 0), Quat(Eigen::AngleAxisd(kTilt, Vec3::UnitZ()))},
              .mass = 2,
              .centre = Vec3(0, -0.2, 0),
              .inertia = Mat3(0.3 * Mat3::Identity()),
              .restitution = 0,
              .friction = 1});
  const Real energy = w.energy().total();
  for (int i = 0; i < 720; ++i) {
    w.step(1.0 / 60);
    ASSERT_NEAR(w.energy().total(), energy, 2e-3 * energy) << w.time();
  }
}

// The contact moves along the body however little this turns in a step.
TEST_P(MovingContact, AnEllipsoidRocksForEverInShortSteps) {
  constexpr Real kTilt = 0.05;
  const Vec3 radii(0.5, 0.3, 0.4);
  for (const Real short_step : {step(), step() / 4}) {
    World w(WorldDef{.max_step = short_step, .solver = solver(), .sleep = false});
    w.add_body(ground(1));
    const Real height = std::hypot(radii.x() * std::sin(kTilt), radii.y() * std::cos(kTilt));
    const BodyHandle body =
        w.add_body({.shape = Ellipsoid{radii},
                    .pose = {Vec3(0, height, 0), Quat(Eigen::AngleAxisd(kTilt, Vec3::UnitZ()))},
                    .mass = 2,
                    .restitution = 0,
                    .friction = 1});
    Real greatest = 0;
    for (int i = 0; i < 720; ++i) {
      w.step(1.0 / 60);
      if (i > 600) greatest = std::max(greatest, 2 * std::abs(w.body(body).pose.orientation.z()));
    }
    EXPECT_NEAR(greatest, kTilt, 0.01 * kTilt) << short_step;
  }
}

/// A cone or frustum that rolls on its side around its apex, or the apex of the extended side, on the ground.
/// It rotates about the line of contact at any speed: the forces along this line supply the torque.
struct RollingCone {
  Real radius, top, height;

  void expect_steady(const WorldDef& def, Real spin) const {
    const Shape shape = top > 0 ? Shape(Frustum{radius, top, height}) : Shape(Cone{radius, height});
    const Real whole = height * radius / (radius - top), angle = std::atan2(radius, whole);
    const Vec3 axis(std::cos(angle), std::sin(angle), 0);  // from the apex to the base
    World w(def);
    w.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0, .friction = 0.8});
    BodyDef cone{.shape = shape,
                 .pose = {(whole - height / 2) * axis, Quat::FromTwoVectors(Vec3::UnitY(), -axis)},
                 .angular_velocity = Vec3(spin, 0, 0),
                 .mass = 1,
                 .restitution = 0,
                 .friction = 0.8};
    {
      World other{WorldDef{}};
      cone.velocity = cone.angular_velocity.cross(other.body(other.add_body(cone)).centre);
    }
    const BodyHandle body = w.add_body(cone);
    const Real energy = w.energy().total(), y = w.body(body).centre.y();
    for (int i = 0; i < 240; ++i) {
      w.step(1.0 / 60);
      ASSERT_NEAR(w.body(body).centre.y(), y, 2e-5);
    }
    EXPECT_NEAR(w.energy().total(), energy, 1e-3 * energy);
    EXPECT_NEAR(w.body(body).angular_velocity.norm(), spin, 1e-3 * spin);
  }
};

TEST_P(MovingContact, ConesOnTheirSidesRollAroundTheirApex) {
  const WorldDef def{.max_step = step(), .solver = solver(), .sleep = false};
  for (const Real spin : {2.0, 6.0})
    for (const RollingCone& cone :
         {RollingCone{0.05, 0, 0.3}, {0.1, 0, 0.3}, {0.3, 0, 0.3}, {0.1, 0.05, 0.3}, {0.3, 0.15, 0.3}}) {
      SCOPED_TRACE(std::to_string(cone.radius) + " " + std::to_string(cone.top));
      cone.expect_steady(def, spin);
    }
}

// Each corner carries the normal force of a pressure that grows linearly in the sliding direction, and its
// friction opposes its own velocity. Integration by a Runge-Kutta method gives 2.816 m, and 2.718 m without
// the rotation. The exact solver distributes the load over the four corners differently.
TEST_P(MovingContact, ARotatingBoxSlidesFartherAndStopsBothMotionsTogether) {
  World w = world();
  w.add_body(ground(0.3));
  const BodyHandle box =
      w.add_body({.shape = Box{{1, 0.4, 0.7}},
                  .pose = {Vec3(0, 0.2, 0), Quat(Eigen::AngleAxisd(25 * pi / 180, Vec3::UnitY()))},
                  .velocity = Vec3(4, 0, 0),
                  .angular_velocity = Vec3(0, 3, 0),
                  .mass = 2,
                  .restitution = 0,
                  .friction = 0.3});
  Real slides_until = 0, turns_until = 0;
  for (int i = 0; i < 150; ++i) {
    w.step(1.0 / 60);
    if (w.body(box).velocity.norm() > 0.05) slides_until = w.time();
    if (w.body(box).angular_velocity.norm() > 0.05) turns_until = w.time();
  }
  EXPECT_NEAR(w.body(box).centre.x(), 2.816, 0.008);
  EXPECT_NEAR(slides_until, turns_until, 0.07);
}

// The load of three corners is unique. They turn by up to 0.8 rad in a frame. Steps of 1/3840 s give the
// expected distances with all solvers.
TEST_P(MovingContact, AFastTurningPlateSlidesAsFarAtAnyStep) {
  struct Case {
    Real height, friction, speed, spin, distance;
  };
  for (const Case& c :
       {Case{0.02, 0.3, 4, 30, 4.3027}, {0.02, 0.3, 4, 50, 5.944}, {0.2, 0.3, 4, 40, 5.126}}) {
    World w = world();
    w.add_body(ground(c.friction));
    std::vector<Eigen::Vector2d> corners;
    for (const Real angle : {0.0, 2 * pi / 3, 4 * pi / 3})
      corners.emplace_back(0.3 * std::cos(angle), 0.3 * std::sin(angle));
    const BodyHandle plate =
        w.add_body({.shape = MeshShape{w.add_mesh(star_shaped_prism(corners, c.height))},
                    .pose = {Vec3::Zero(), Quat(Eigen::AngleAxisd(-pi / 2, Vec3::UnitX()))},
                    .velocity = Vec3(c.speed, 0, 0),
                    .angular_velocity = Vec3(0, c.spin, 0),
                    .mass = 2,
                    .restitution = 0,
                    .friction = c.friction});
    const Real from = w.body(plate).centre.x();
    run(w, 3);
    EXPECT_NEAR(w.body(plate).centre.x() - from, c.distance, 2e-3 * c.distance) << c.spin;
    EXPECT_LT(w.body(plate).velocity.norm(), 1e-3) << c.spin;
    EXPECT_LT(w.body(plate).angular_velocity.norm(), 1e-3) << c.spin;
  }
}

TEST_P(MovingContact, ABoxOnATurntableStaysWhereItIs) {
  for (const Real spin : {2.0, 4.0}) {
    constexpr Real kRadius = 0.3;
    World w = world();
    w.add_body({.shape = Cylinder{3, 0.2},
                .motion = MotionType::kinematic,
                .pose = {Vec3(0, -0.1, 0), Quat::Identity()},
                .friction = 0.8,
                .track = {.spin = Vec3(0, spin, 0)}});
    const BodyHandle box = w.add_body({.shape = Box{{0.1, 0.05, 0.1}},
                                       .pose = {Vec3(kRadius, 0.025, 0), Quat::Identity()},
                                       .velocity = Vec3(0, 0, -kRadius * spin),
                                       .angular_velocity = Vec3(0, spin, 0),
                                       .friction = 0.8});
    run(w, 5);
    const Vec3 place = w.body(box).centre;
    EXPECT_NEAR(std::hypot(place.x(), place.z()), kRadius, 1e-5) << spin;
    const Real angle = std::atan2(-place.z(), place.x());
    EXPECT_NEAR(kRadius * std::remainder(angle - spin * w.time(), 2 * pi), 0, 2e-5) << spin;
  }
}

// A turntable rotates and moves to and fro. Two boxes on each other slip until they have its first velocity,
// and keep their places on it from then on.
TEST_P(MovingContact, AStackFollowsATurntableThatMovesAway) {
  World w = world();
  KeyframeTrack track{.spin = Vec3(0, 3, 0)};
  for (int i = 0; i < 7; ++i)
    track.keys.push_back(
        {.time = static_cast<Real>(i), .pose = {Vec3(i % 2 * 0.4, -0.1, 0), Quat::Identity()}});
  const BodyHandle table = w.add_body({.shape = Cylinder{3, 0.2},
                                       .motion = MotionType::kinematic,
                                       .pose = {Vec3(0, -0.1, 0), Quat::Identity()},
                                       .friction = 0.8,
                                       .track = track});
  constexpr Real kRadius = 0.2;
  std::vector<BodyHandle> boxes;
  for (const Real height : {0.025, 0.075})
    boxes.push_back(w.add_body({.shape = Box{{0.1, 0.05, 0.1}},
                                .pose = {Vec3(kRadius, height, 0), Quat::Identity()},
                                .velocity = Vec3(0, 0, -kRadius * 3),
                                .angular_velocity = Vec3(0, 3, 0),
                                .friction = 0.8}));
  const auto place = [&](BodyHandle box) { return w.body(table).pose.point_to_body(w.body(box).centre); };
  run(w, 0.5);
  const std::vector<Vec3> from = {place(boxes[0]), place(boxes[1])};
  run(w, 4.5);
  for (int i : {0, 1}) EXPECT_LT((place(boxes[i]) - from[i]).norm(), 5e-5) << i;
}

// Two boxes with a hinge between them ride on a turntable. Both ride, or the joint would pull one of them
// back.
TEST_P(MovingContact, HingedBoxesOnATurntableStayWhereTheyAre) {
  constexpr Real kSpin = 2, kRadius = 0.3, kArm = 0.06;
  World w = world();
  w.add_body({.shape = Cylinder{3, 0.2},
              .motion = MotionType::kinematic,
              .pose = {Vec3(0, -0.1, 0), Quat::Identity()},
              .friction = 0.8,
              .track = {.spin = Vec3(0, kSpin, 0)}});
  std::vector<BodyHandle> boxes;
  for (const Real z : {-kArm, kArm})
    boxes.push_back(w.add_body({.shape = Box{{0.1, 0.05, 0.1}},
                                .pose = {Vec3(kRadius, 0.025, z), Quat::Identity()},
                                .velocity = Vec3(0, kSpin, 0).cross(Vec3(kRadius, 0, z)),
                                .angular_velocity = Vec3(0, kSpin, 0),
                                .friction = 0.8}));
  w.add_joint({.type = JointType::revolute,
               .a = boxes[0],
               .b = boxes[1],
               .anchor = {kRadius, 0.025, 0},
               .axis = Vec3::UnitY()});
  run(w, 5);
  const Quat back = Quat(Eigen::AngleAxis<Real>(-kSpin * w.time(), Vec3::UnitY()));
  for (int i : {0, 1}) {
    const Vec3 place = back * w.body(boxes[i]).centre;
    EXPECT_LT((place - Vec3(kRadius, 0.025, i == 0 ? -kArm : kArm)).norm(), 1e-4) << i;
  }
}

OFFSTAGE_SOLVERS_AND_RATES(Solvers, MovingContact);

/// Simulates a heap of boxes, balls and cylinders that fall and slide, and returns their poses. The bodies
/// are added in a permuted order.
std::vector<Pose> heap_after(SolverKind solver, std::size_t first, std::size_t stride) {
  constexpr std::size_t kCount = 19;
  World w(WorldDef{.solver = solver});
  w.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0.2, .friction = 0.5});
  std::vector<BodyHandle> bodies(kCount);
  for (std::size_t n = 0; n < kCount; ++n) {
    const std::size_t i = (first + n * stride) % kCount;
    const Real layer = static_cast<Real>(i / 6), at = static_cast<Real>(i % 6);
    BodyDef def{.restitution = 0.2, .friction = 0.5};
    def.pose.position = {0.45 * std::cos(at + 0.4 * layer), 0.3 + 0.5 * layer,
                         0.45 * std::sin(at + 0.4 * layer)};
    def.pose.orientation = Quat(Eigen::AngleAxisd(0.3 * at, Vec3(1, 2, at).normalized()));
    if (i % 3 == 0) def.shape = Box{{0.4, 0.3, 0.35}};
    if (i % 3 == 1) def.shape = Sphere{0.2};
    if (i % 3 == 2) def.shape = Cylinder{0.18, 0.3};
    bodies[i] = w.add_body(def);
  }
  for (int i = 0; i < 48; ++i) w.step(1.0 / 60);
  std::vector<Pose> poses;
  for (const BodyHandle body : bodies) poses.push_back(w.body(body).pose);
  return poses;
}

// Rounding differences of 1e-16 m would grow about tenfold with each collision; another order of the sweeps
// made 0.2 m in this second.
TEST(OrderOfBodies, DoesNotChangeTheirMotion) {
  for (const SolverKind solver : {SolverKind::fast, SolverKind::automatic, SolverKind::exact}) {
    const std::vector<Pose> expected = heap_after(solver, 0, 1);
    for (const auto& [first, stride] : {std::pair<std::size_t, std::size_t>{18, 18}, {5, 11}}) {
      const std::vector<Pose> poses = heap_after(solver, first, stride);
      for (std::size_t i = 0; i < poses.size(); ++i)
        EXPECT_LT((poses[i].position - expected[i].position).norm(), 1e-9) << i;
    }
  }
}

}  // namespace
}  // namespace offstage::sim
