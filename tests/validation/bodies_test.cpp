/// Bodies of several shapes, applied forces, lifetimes, and the joints that couple motions, compared with
/// closed forms.

#include <cmath>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include "sim/core/rotation.h"
#include "tests/validation/both_solvers.h"

namespace offstage::sim {
namespace {

constexpr Real kWeight = 9.81, kPi = std::numbers::pi;

WorldDef sleepless(Real max_step = 1.0 / 240) {
  return {.max_step = max_step, .sleep = false};
}
WorldDef no_gravity() {
  return {.gravity = Vec3::Zero(), .sleep = false};
}

BodyHandle add(World& world, const Shape& shape, const Vec3& position, Real mass = 1, bool collides = false) {
  BodyDef def;
  def.shape = shape;
  def.mass = mass;
  def.pose.position = position;
  def.collides = collides;
  return world.add_body(def);
}

void add_floor(World& world, Real restitution = 0) {
  BodyDef floor;
  floor.shape = Plane{};
  floor.motion = MotionType::static_body;
  floor.restitution = restitution;
  world.add_body(floor);
}

// --- Shapes ---

class ShapesAtRest : public BothSolvers {};

// A body of each shape is set down and stays at the height that its shape has.
TEST_P(ShapesAtRest, LieAtTheirHeights) {
  World world(def());
  add_floor(world);
  const auto place = [&](BodyDef body, Real height, Real x) {
    body.restitution = 0;
    body.pose.position = Vec3(x, height, 0);
    return world.add_body(body);
  };
  BodyDef frustum, ellipsoid;
  frustum.shape = Frustum{0.3, 0.2, 0.4};
  ellipsoid.shape = Ellipsoid{{0.3, 0.1, 0.2}};
  const auto hollow = [&](const SolidMesh& solid, const MassProperties& unit) {
    BodyDef body;
    body.shape = MeshShape{world.add_compound({solid})};
    body.mass = 100 * unit.volume;
    body.centre = unit.centre;
    body.inertia = 100 * unit.inertia;
    return body;
  };
  const Tube pipe{0.3, 0.4, 0.05};
  const OpenBox tray{{0.5, 0.3, 0.4}, 0.04};
  const Torus ring{0.3, 0.1};
  const std::array bodies = {place(frustum, 0.2, 0), place(ellipsoid, 0.1, 1),
                             place(hollow(solid_mesh(ring), mass_properties(ring)), 0.1, 2),
                             place(hollow(solid_mesh(pipe), mass_properties(pipe)), 0.2, 3),
                             place(hollow(solid_mesh(tray), mass_properties(tray)), 0.15, 4)};
  const std::array heights = {0.2, 0.1, 0.1, 0.2, 0.15};
  run(world, 1.0);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    EXPECT_NEAR(world.body(bodies[i]).pose.position.y(), heights[i], 2e-4) << i;
    EXPECT_LT(world.body(bodies[i]).velocity.norm(), 1e-3) << i;
  }
}

// A small ball falls through a ring and stays in a tray; a large one stays on the ring, where its centre is
// at the distance R of the tube's centre line.
TEST_P(ShapesAtRest, RingsHaveHolesAndTraysHaveInsides) {
  World world(def());
  const auto still = [&](const SolidMesh& solid, const Vec3& place) {
    BodyDef body;
    body.shape = MeshShape{world.add_compound({solid})};
    body.motion = MotionType::static_body;
    body.restitution = 0;
    body.pose.position = place;
    world.add_body(body);
  };
  still(solid_mesh(Torus{0.3, 0.1}), {0, 1, 0});
  still(solid_mesh(OpenBox{{1, 0.4, 1}, 0.1}), {0, 0.2, 0});
  still(solid_mesh(Torus{0.3, 0.1}), {3, 1, 0});
  BodyDef ball;
  ball.restitution = 0;
  ball.shape = Sphere{0.15};
  ball.pose.position = {0, 2, 0};
  const BodyHandle small = world.add_body(ball);
  ball.shape = Sphere{0.35};
  ball.pose.position = {3, 1.6, 0};
  const BodyHandle large = world.add_body(ball);
  run(world, 2.5);
  EXPECT_NEAR(world.body(small).pose.position.y(), 0.1 + 0.15, 2e-3);
  // The hole's rim is 48 chords, which are up to 0.3 % of R nearer to the axis.
  EXPECT_NEAR(world.body(large).pose.position.y(), 1 + std::sqrt(0.45 * 0.45 - 0.09), 4e-3);
}

OFFSTAGE_BOTH_SOLVERS(Solvers, ShapesAtRest);

// A spheroid that rocks without sliding: m g (rho - h) phi = -(I + m h^2) phi'', where rho = a^2 / b is the
// radius of curvature at the lowest point and h = b the height of the centre.
TEST(Ellipsoids, RockWithTheirPeriod) {
  World world({.max_step = 1.0 / 960, .solver = SolverKind::exact, .sleep = false});
  add_floor(world);
  BodyDef def;
  const Real a = 0.3, b = 0.15;
  def.shape = Ellipsoid{{a, b, a}};
  def.restitution = 0;
  def.friction = 5;
  const Real start = 0.02;
  def.pose.orientation = Quat(Eigen::AngleAxisd(start, Vec3::UnitZ()));
  const Real support = std::hypot(a * std::sin(start), b * std::cos(start));
  def.pose.position = {0, support, 0};
  const BodyHandle body = world.add_body(def);
  const Real I = (a * a + b * b) / 5;
  const Real period = 2 * kPi / std::sqrt(kWeight * (a * a / b - b) / (I + b * b));
  const auto tilt = [&] {
    const Vec3 up = world.body(body).pose.orientation * Vec3::UnitY();
    return -up.x();
  };
  Real crossing = 0, before = tilt();
  for (int i = 0; i < 3000 && crossing == 0; ++i) {
    world.step(1.0 / 960);
    const Real now = tilt();
    if (before > 0 && now <= 0) crossing = world.time() - (1.0 / 960) * now / (now - before);
    before = now;
  }
  EXPECT_NEAR(crossing / (period / 4), 1, 0.02);
}

// A compound moves about the centre of mass of its parts, and spins about it with their inertia.
TEST(Compounds, FlyAboutTheCentreOfTheirParts) {
  World world(no_gravity());
  const Pose head{Vec3(0, 0.3, 0), Quat::Identity()};
  const BodyMass mass = sum_of({{mass_properties(Shape(Box{{0.1, 0.05, 0.1}})), head, 8000},
                                {mass_properties(Shape(Cylinder{0.015, 0.5})), {}, 600}});
  BodyDef def;
  def.shape = MeshShape{world.add_compound(
      {placed(solid_mesh(Shape(Box{{0.1, 0.05, 0.1}})), head), solid_mesh(Shape(Cylinder{0.015, 0.5}))})};
  def.mass = mass.mass;
  def.centre = mass.centre;
  def.inertia = mass.inertia;
  def.angular_velocity = {0, 0, 3};
  const BodyHandle hammer = world.add_body(def);
  ForceDef push{.name = "push", .bodies = {hammer}, .effect = ConstantField{.force = {0, 0, 2}}};
  world.add_force(push);
  run(world, 1.0);
  const BodyState state = world.body(hammer);
  EXPECT_LT((state.centre - mass.centre - Vec3(0, 0, 1 / mass.mass)).norm(), 1e-9);
  EXPECT_NEAR(state.angular_velocity.z(), 3, 1e-9);
  EXPECT_NEAR(state.angular_momentum.z(), 3 * mass.inertia(2, 2), 1e-9);
}

TEST(Compounds, InvalidMassesAreRefused) {
  World world(sleepless());
  BodyDef def;
  def.shape = Box{};
  def.inertia = Vec3(1, 1, 3).asDiagonal();
  EXPECT_THROW(world.add_body(def), std::invalid_argument);  // 3 > 1 + 1
  def.inertia = Vec3(1, -1, 1).asDiagonal();
  EXPECT_THROW(world.add_body(def), std::invalid_argument);
  def.inertia = Vec3(1, 2, 3).asDiagonal();
  EXPECT_NO_THROW(world.add_body(def));
}

// --- Forces ---

// A torque about a principal axis: w = tau t / I. With linear keys the angular momentum is the integral of
// the curve.
TEST(AppliedForces, TorquesSpinABodyByTheirIntegral) {
  World world(no_gravity());
  const BodyHandle steady = add(world, Box{{1, 2, 3}}, {0, 0, 0}),
                   varying = add(world, Box{{1, 2, 3}}, {5, 0, 0});
  world.add_force({.name = "steady",
                   .bodies = {steady},
                   .effect = AppliedForce{.keys = {{.time = 0, .torque = {0, 0, 2}}}, .body_axes = true}});
  world.add_force(
      {.name = "varying",
       .bodies = {varying},
       .effect = AppliedForce{.keys = {{.time = 0}, {.time = 1, .torque = {0, 0, 4}}, {.time = 2}}}});
  run(world, 2.5);
  const Real I = (1.0 + 4.0) / 12;
  EXPECT_NEAR(world.body(steady).angular_velocity.z(), 2 * 2.5 / I, 1e-9);
  EXPECT_NEAR(world.body(varying).angular_velocity.z(), 4 / I, 1e-6);
}

// A force at a point: it accelerates the centre as if it acted there, and turns the body by its moment. In
// the body's axes it turns with the body: constant thrust across a spinning body goes around in a circle.
TEST(AppliedForces, ActAtAPointInTheBodysAxes) {
  World world(no_gravity());
  const BodyHandle pushed = add(world, Box{{1, 1, 1}}, {0, 0, 0}, 2);
  world.add_force({.name = "push",
                   .bodies = {pushed},
                   .effect = AppliedForce{.keys = {{.force = {0, 0, 3}}}, .point = Vec3(0.5, 0, 0)}});
  world.step(1e-3);
  EXPECT_NEAR(world.body(pushed).velocity.z(), 1.5e-3, 1e-9);
  EXPECT_NEAR(world.body(pushed).angular_velocity.y(), -1.5 / (2.0 / 6) * 1e-3, 1e-8);

  World other(no_gravity());
  BodyDef def;
  def.shape = Sphere{0.5};
  def.mass = 2;
  def.angular_velocity = {0, 0, 2 * kPi};
  const BodyHandle spinning = other.add_body(def);
  other.add_force({.name = "thrust",
                   .bodies = {spinning},
                   .effect = AppliedForce{.keys = {{.force = {2, 0, 0}}}, .body_axes = true}});
  run(other, 1.0);
  // The velocity is the integral of (cos wt, sin wt): zero after one turn; the displacement is t / w along y.
  EXPECT_LT(other.body(spinning).velocity.norm(), 1e-6);
  EXPECT_NEAR(other.body(spinning).pose.position.y(), 1 / (2 * kPi), 1e-6);
}

// --- Lifetimes ---

TEST(Lifetimes, BodiesFallFromWhenTheyAppearAndSupportsVanish) {
  World world(sleepless());
  BodyDef def;
  def.shape = Sphere{0.1};
  def.pose.position = {0, 10, 0};
  def.appear_at = 0.5;
  const BodyHandle late = world.add_body(def);
  BodyDef shelf;
  shelf.shape = Box{{1, 0.2, 1}};
  shelf.motion = MotionType::static_body;
  shelf.pose.position = {5, 0, 0};
  shelf.remove_at = 0.75;
  const BodyHandle support = world.add_body(shelf);
  def.appear_at = 0;
  def.pose.position = {5, 0.2, 0};
  def.restitution = 0;
  const BodyHandle resting = world.add_body(def);
  run(world, 0.25);
  EXPECT_FALSE(world.is_present(late));
  EXPECT_TRUE(world.is_present(support));
  EXPECT_EQ(world.body(late).pose.position.y(), 10);
  run(world, 1.0);
  EXPECT_TRUE(world.is_present(late));
  EXPECT_FALSE(world.is_present(support));
  EXPECT_NEAR(world.body(late).pose.position.y(), 10 - kWeight / 2 * 0.75 * 0.75, 1e-9);
  EXPECT_NEAR(world.body(resting).pose.position.y(), 0.2 - kWeight / 2 * 0.25, 1e-3);
  run(world, 0.1);
  const StateHash once = world.state_hash();
  EXPECT_FALSE(once.hex().empty());
}

// The state at a time shows the bodies that exist at this time.
TEST(Lifetimes, BeginAndEndWithTheStateOfTheirTime) {
  World world(sleepless());
  BodyDef def;
  def.shape = Sphere{0.1};
  def.pose.position = {0, 10, 0};
  def.appear_at = 0.5;
  def.remove_at = 1;
  const BodyHandle body = world.add_body(def);
  run(world, 0.5 - 1.0 / 60);
  EXPECT_FALSE(world.is_present(body));
  run(world, 1.0 / 60);
  EXPECT_TRUE(world.is_present(body));
  EXPECT_EQ(world.body(body).pose.position.y(), 10);
  run(world, 0.5 - 1.0 / 60);
  EXPECT_TRUE(world.is_present(body));
  run(world, 1.0 / 60);
  EXPECT_FALSE(world.is_present(body));
}

// A sleeping body wakes when its support is removed; particles fall through where a body was.
TEST(Lifetimes, RemovalWakesWhatRestedOnTheBody) {
  World world(WorldDef{});
  BodyDef shelf;
  shelf.shape = Box{{1, 0.2, 1}};
  shelf.motion = MotionType::static_body;
  shelf.remove_at = 3;
  world.add_body(shelf);
  BodyDef box;
  box.shape = Box{{0.2, 0.2, 0.2}};
  box.restitution = 0;
  box.pose.position = {0, 0.2, 0};
  const BodyHandle body = world.add_body(box);
  run(world, 2.5);
  EXPECT_TRUE(world.is_asleep(body));
  run(world, 1.0);
  EXPECT_NEAR(world.body(body).pose.position.y(), 0.2 - kWeight / 2 * 0.25, 2e-3);
}

// A joint that appears later holds the bodies where they are then; one that is removed releases them.
TEST(Lifetimes, OfJointsAndSprings) {
  World world(sleepless());
  const BodyHandle a = add(world, Sphere{0.1}, {0, 0, 0}), b = add(world, Sphere{0.1}, {3, 0, 0}, 1);
  world.add_joint({.name = "late", .type = JointType::fixed, .a = a, .anchor = {0, 0, 0}, .appear_at = 0.5});
  world.add_joint({.name = "early", .type = JointType::fixed, .a = b, .anchor = {3, 0, 0}, .remove_at = 0.5});
  BodyDef holder;
  holder.shape = Sphere{0.1};
  holder.collides = false;
  holder.motion = MotionType::static_body;
  holder.pose.position = {6, 1, 0};
  holder.remove_at = 0.5;
  const BodyHandle hook = world.add_body(holder), hung = add(world, Sphere{0.1}, {6, 0, 0}, 1);
  world.add_spring({.name = "cord",
                    .a = BodyPoint{hook, Vec3::Zero()},
                    .b = BodyPoint{hung, Vec3::Zero()},
                    .stiffness = 1e4,
                    .damping = 200});
  run(world, 1.0);
  EXPECT_NEAR(world.body(a).pose.position.y(), -kWeight / 2 * 0.25, 1e-6);
  EXPECT_NEAR(world.body(b).pose.position.y(), -kWeight / 2 * 0.25, 1e-6);
  EXPECT_NEAR(world.body(hung).pose.position.y(), -kWeight / 1e4 - kWeight / 2 * 0.25, 1e-4);
}

// --- Joints that couple motions ---

struct Wheel {
  BodyHandle body;
  Real inertia;  // moment of inertia about the axle
};

Wheel add_wheel(World& world, Real radius, Real mass, const Vec3& place, const Vec3& axis = Vec3::UnitZ()) {
  BodyDef def;
  def.shape = Cylinder{radius, 0.1};
  def.mass = mass;
  def.collides = false;
  def.pose = {place, rotation_between(Vec3::UnitY(), axis)};
  const BodyHandle body = world.add_body(def);
  world.add_joint({.name = "axle", .type = JointType::revolute, .a = body, .anchor = place, .axis = axis});
  return {body, mass * radius * radius / 2};
}

void twist(World& world, BodyHandle body, const Vec3& torque) {
  world.add_force({.name = "torque", .bodies = {body}, .effect = AppliedForce{.keys = {{.torque = torque}}}});
}

// angle_a + r angle_b = 0: w_b = -w_a / r, and the torque accelerates I_a + I_b / r^2. Also about other axes,
// after many turns.
TEST(Gears, ShareATorqueByTheirRatio) {
  World world(no_gravity());
  const Wheel a = add_wheel(world, 0.2, 3, {0, 0, 0}),
              b = add_wheel(world, 0.5, 2, {0.7, 0, 0}, Vec3::UnitX());
  world.add_joint({.name = "gear",
                   .type = JointType::gear,
                   .a = a.body,
                   .b = b.body,
                   .axis = Vec3::UnitZ(),
                   .second_axis = Vec3::UnitX(),
                   .ratio = 2.5});
  twist(world, a.body, {0, 0, 0.5});
  Real error = 0;
  for (int i = 0; i < 2400; ++i) error = std::max(error, world.step(1.0 / 240).joints.error);
  const Real acceleration = 0.5 / (a.inertia + b.inertia / 6.25), w = world.body(a.body).angular_velocity.z();
  EXPECT_NEAR(w / (acceleration * 10), 1, 1e-6);
  EXPECT_GT(w * 10 / 2 / (2 * kPi), 20);  // turns
  EXPECT_NEAR(world.body(b.body).angular_velocity.x(), -w / 2.5, 1e-9);
  EXPECT_LT(error, 1e-9);
}

// The torque accelerates I + m R^2.
TEST(Racks, MoveByTheRadiusOfTheirPinion) {
  World world(no_gravity());
  const Wheel pinion = add_wheel(world, 0.2, 3, {0, 0, 0});
  const BodyHandle rack = add(world, Box{{2, 0.1, 0.1}}, {0, -0.25, 0}, 4);
  world.add_joint({.name = "way",
                   .type = JointType::prismatic,
                   .a = rack,
                   .anchor = {0, -0.25, 0},
                   .axis = Vec3::UnitX()});
  world.add_joint({.name = "teeth",
                   .type = JointType::rack,
                   .a = pinion.body,
                   .b = rack,
                   .anchor_b = {0, -0.25, 0},
                   .axis = Vec3::UnitZ(),
                   .second_axis = Vec3::UnitX(),
                   .ratio = 0.2});
  twist(world, pinion.body, {0, 0, 0.5});
  run(world, 4.0);
  const Real acceleration = 0.5 / (pinion.inertia + 4 * 0.04);
  EXPECT_NEAR(world.body(rack).velocity.x() / (0.2 * acceleration * 4), 1, 1e-6);
  EXPECT_NEAR(world.body(rack).pose.position.x() / (0.2 * acceleration * 8), 1, 1e-4);
}

// A nut on a vertical screw falls with a = g / (1 + I / (m p^2)) with the lead 2 pi p.
TEST(Screws, FallByTheirLead) {
  World world(sleepless());
  BodyDef def;
  def.shape = Cylinder{0.2, 0.1};
  def.mass = 2;
  def.collides = false;
  const BodyHandle nut = world.add_body(def);
  const Real lead = 0.3, p = lead / (2 * kPi), I = 2 * 0.04 / 2;
  const JointHandle screw = world.add_joint(
      {.name = "screw", .type = JointType::screw, .a = nut, .axis = Vec3::UnitY(), .ratio = lead});
  run(world, 3.0);
  const Real a = kWeight / (1 + I / (2 * p * p));
  const BodyState state = world.body(nut);
  EXPECT_NEAR(state.velocity.y() / (-a * 3), 1, 1e-5);
  EXPECT_NEAR(state.angular_velocity.y() / (state.velocity.y() / p), 1, 1e-9);
  EXPECT_NEAR(world.joint(screw).coordinate * p / state.pose.position.y(), 1, 1e-6);
}

// Atwood: with n strands at b, a_a = (m_a - m_b / n) g / (m_a + m_b / n^2), downwards.
TEST(Pulleys, AreAtwoodsMachines) {
  for (const Real strands : {1.0, 2.0}) {
    World world(sleepless());
    const BodyHandle a = add(world, Sphere{0.1}, {0, 0, 0}, 3), b = add(world, Sphere{0.1}, {1, 0, 0}, 2);
    world.add_joint({.name = "rope",
                     .type = JointType::pulley,
                     .a = a,
                     .b = b,
                     .anchor = {0, 0, 0},
                     .anchor_b = {1, 0, 0},
                     .ratio = strands,
                     .pulley_a = {0, 5, 0},
                     .pulley_b = {1, 5, 0}});
    run(world, 0.75);
    const Real down = kWeight * (3 - 2 / strands) / (3 + 2 / (strands * strands));
    EXPECT_NEAR(world.body(a).velocity.y() / (-down * 0.75), 1, 1e-3) << strands;
    EXPECT_NEAR(world.body(b).velocity.y() / (down * 0.75 / strands), 1, 1e-3) << strands;
  }
}

// --- Limits ---

// A slider falls on its limit and rebounds with e times its speed, so it rises to e^2 times the height, up to
// the distance that it moves in a sub-step.
TEST(JointLimits, HaveARestitution) {
  for (const Real e : {0.5, 0.9}) {
    World world(sleepless());
    const BodyHandle slider = add(world, Box{{0.1, 0.1, 0.1}}, {0, 0, 0});
    world.add_joint({.name = "rail",
                     .type = JointType::prismatic,
                     .a = slider,
                     .axis = Vec3::UnitY(),
                     .lower = -1,
                     .restitution = e});
    Real highest = -2;
    bool has_hit = false;
    for (int i = 0; i < 400; ++i) {
      world.step(1.0 / 240);
      const BodyState state = world.body(slider);
      has_hit |= state.velocity.y() > 0;
      if (has_hit && state.velocity.y() < 0) break;
      if (has_hit) highest = std::max(highest, state.pose.position.y());
    }
    EXPECT_NEAR(highest, -1 + e * e, 0.025) << e;
  }
}

// A bar on a joint with a stiffness: k theta = m g l / 2 cos(theta) at rest.
TEST(JointStiffness, HoldsABarUp) {
  World world(sleepless());
  const BodyHandle bar = add(world, Box{{1, 0.05, 0.05}}, {0.5, 0, 0}, 2);
  world.add_joint({.name = "root",
                   .type = JointType::spherical,
                   .a = bar,
                   .axis = Vec3::UnitX(),
                   .stiffness = 40,
                   .damping = 8});
  run(world, 6.0);
  const Vec3 along = world.body(bar).pose.orientation * Vec3::UnitX();
  const Real theta = std::atan2(-along.y(), along.x());
  EXPECT_NEAR(40 * theta / (2 * kWeight * 0.5 * std::cos(theta)), 1, 1e-3);
}

// A torsion pendulum without damping: its energy goes back and forth between motion and the spring of its
// joint. The spring of a spherical joint acts at the end of a sub-step, which takes at most about the
// fraction omega^2 h t of the energy, as backward Euler does. The tolerance of the solver takes as much again
// from it at this step, and more at shorter ones. A motor acts in the middle of the sub-step and keeps the
// energy.
TEST(JointStiffness, StoresTheEnergyOfATorsionPendulum) {
  const Real k = 2, start_speed = 0.5, step = 1.0 / 1000;
  for (const bool by_motor : {false, true}) {
    World world({.gravity = Vec3::Zero(), .max_step = step, .sleep = false});
    const BodyHandle disc = add(world, Cylinder{0.5, 0.1}, {0, 0, 0}, 4);
    JointDef joint{.name = "wire", .a = disc, .axis = Vec3::UnitY()};
    if (by_motor) {
      joint.type = JointType::revolute;
      joint.motor = {.mode = Motor::Mode::position, .stiffness = k};
    } else {
      joint.stiffness = k;
    }
    world.add_joint(joint);
    world.set_velocity(disc, Vec3::Zero(), {0, start_speed, 0});
    const Real inertia = 4 * 0.5 * 0.5 / 2, first = inertia * start_speed * start_speed / 2;
    const Real omega2 = k / inertia;
    Real most_elastic = 0;
    for (int frame = 1; frame <= 60; ++frame) {
      world.step(1.0 / 20);
      const Energy energy = world.energy();
      most_elastic = std::max(most_elastic, energy.elastic);
      const Real left = energy.total() / first;
      EXPECT_GT(left, 0.998 - (by_motor ? 0 : 2 * omega2 * step * world.time())) << by_motor << " " << frame;
      EXPECT_LT(left, 1.002) << by_motor << " " << frame;
    }
    EXPECT_NEAR(most_elastic / first, 1, 0.02) << by_motor;
  }
}

// --- Algorithms ---

// The methods of collision detection give the same stack: a drop of polyhedra onto a floor and each other.
TEST(CollisionMethods, GiveTheSameMotion) {
  const auto heights = [](const CollisionMethods& methods) {
    World world({.solver = SolverKind::exact, .collision = methods, .sleep = false});
    add_floor(world, 0.3);
    const MeshHandle mesh = world.add_compound({solid_mesh(Shape(Frustum{0.3, 0.2, 0.4}))});
    std::vector<BodyHandle> bodies;
    for (int i = 0; i < 3; ++i) {
      BodyDef def;
      def.shape = MeshShape{mesh};
      def.restitution = 0.3;
      def.pose.position = {0, 0.3 + 0.5 * i, 0};
      bodies.push_back(world.add_body(def));
    }
    run(world, 2.0);
    std::vector<Real> result;
    for (const BodyHandle body : bodies) result.push_back(world.body(body).pose.position.y());
    return result;
  };
  const std::vector<Real> usual = heights({});
  EXPECT_NEAR(usual[2], 0.2 + 0.8, 1e-3);
  using Methods = CollisionMethods;
  for (const Methods& other : {Methods{.narrow_phase = Methods::NarrowPhase::vclip},
                               Methods{.broad_phase = Methods::BroadPhase::grid},
                               Methods{.broad_phase = Methods::BroadPhase::grid, .cell_factor = 0.7},
                               Methods{.impact_time = Methods::ImpactTime::bisection}}) {
    const std::vector<Real> now = heights(other);
    for (std::size_t i = 0; i < now.size(); ++i) EXPECT_NEAR(now[i], usual[i], 1e-4) << i;
  }
}

/// Two rings that fall on a floor and on each other, and come to rest.
struct FallenRings {
  std::vector<Real> heights;
  uint64_t volume_tests = 0, piece_tests = 0;
  Real penetration = 0;
  bool finite = true;
};

FallenRings fallen_rings(const CollisionMethods& methods) {
  World world({.solver = SolverKind::exact, .collision = methods, .sleep = false});
  add_floor(world, 0);
  const MeshHandle mesh = world.add_compound({solid_mesh(Torus{0.3, 0.1})});
  std::vector<BodyHandle> bodies;
  for (int i = 0; i < 2; ++i) {
    BodyDef def;
    def.shape = MeshShape{mesh};
    def.restitution = 0;
    def.pose.position = {0, 0.1 + 0.21 * i, 0};
    bodies.push_back(world.add_body(def));
  }
  FallenRings result;
  while (world.time() < 0.4) {
    const StepReport r = world.step(1.0 / 240);
    result.volume_tests += r.contacts.volume_tests;
    result.piece_tests += r.contacts.piece_tests;
    result.penetration = std::max(result.penetration, r.contacts.penetration);
    result.finite &= r.finite;
  }
  for (const BodyHandle body : bodies) result.heights.push_back(world.body(body).pose.position.y());
  return result;
}

// All kinds of trees find the same pairs, with different numbers of tests. Triangles give the same heights.
TEST(CollisionMethods, TreesAndTrianglesGiveTheSameHeights) {
  using Methods = CollisionMethods;
  const FallenRings usual = fallen_rings({});
  EXPECT_NEAR(usual.heights[0], 0.1, 1e-3);
  EXPECT_NEAR(usual.heights[1], 0.3, 1e-3);
  EXPECT_GT(usual.volume_tests, usual.piece_tests);
  std::set<uint64_t> counts = {usual.volume_tests};
  for (const Methods& other :
       {Methods{.trees = Methods::Trees::obb}, Methods{.trees = Methods::Trees::sphere},
        Methods{.trees = Methods::Trees::mixed}, Methods{.tree_split = TreeSplit::mean},
        Methods{.mesh_pairs = Methods::MeshPairs::triangles},
        Methods{.trees = Methods::Trees::obb, .mesh_pairs = Methods::MeshPairs::triangles}}) {
    const FallenRings now = fallen_rings(other);
    EXPECT_TRUE(now.finite);
    EXPECT_LT(now.penetration, 1e-3);
    for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(now.heights[i], usual.heights[i], 5e-4) << i;
    counts.insert(now.volume_tests);
  }
  EXPECT_GE(counts.size(), 5u);
}

}  // namespace
}  // namespace offstage::sim
