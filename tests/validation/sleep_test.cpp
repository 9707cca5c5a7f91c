/// Sleeping and waking, overlaps at the start, leaving the world, bodies connected by springs, and particles
/// among bodies.

#include <cmath>
#include <vector>

#include "tests/validation/both_solvers.h"

namespace offstage::sim {
namespace {

constexpr Real kGravity = 9.81;

class Sleep : public BothSolvers {
 protected:
  struct Scene {
    World world;
    BodyHandle support;
    std::vector<BodyHandle> stack;
  };
  /// Returns a sleeping stack of three boxes on a block.
  static Scene sleeping_stack() {
    WorldDef sleepy = def();
    sleepy.sleep = true;
    Scene s{World(sleepy), {}, {}};
    s.world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0});
    s.support = s.world.add_body({.shape = Box{{1, 0.5, 1}},
                                  .motion = MotionType::static_body,
                                  .pose = {Vec3(0, 0.25, 0)},
                                  .restitution = 0});
    for (int i = 0; i < 3; ++i)
      s.stack.push_back(s.world.add_body(
          {.shape = Box{Vec3::Constant(0.2)}, .pose = {Vec3(0, 0.6 + 0.2 * i, 0)}, .restitution = 0}));
    run(s.world, 1.5);
    for (const BodyHandle b : s.stack) EXPECT_TRUE(s.world.is_asleep(b));
    return s;
  }
};

TEST_P(Sleep, ASettledStackCostsNothing) {
  Scene s = sleeping_stack();
  const StateHash before = s.world.state_hash();
  const StepReport r = s.world.step(1.0 / 60);
  EXPECT_EQ(r.bodies.asleep, 3u);
  EXPECT_EQ(r.bodies.awake, 0u);
  EXPECT_EQ(r.bodies.islands, 0u);
  EXPECT_EQ(r.solvers.exact.solves + r.solvers.fast.solves, 0u);
  EXPECT_TRUE(s.world.moved().empty());
  EXPECT_EQ(s.world.energy().kinetic, 0);
  run(s.world, 1);
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(s.world.body(s.stack[std::size_t(i)]).centre.y(), 0.6 + 0.2 * i, 1e-3);
  EXPECT_NE(before, StateHash{});
}

TEST_P(Sleep, ABodyOnALiftThatHasStoppedSleeps) {
  WorldDef sleepy = def();
  sleepy.sleep = true;
  World world(sleepy);
  KeyframeTrack track;
  track.keys = {{0, {Vec3::Zero()}}, {1, {Vec3(0, 0.5, 0)}}};
  world.add_body(
      {.shape = Box{{1, 0.2, 1}}, .motion = MotionType::kinematic, .restitution = 0, .track = track});
  const BodyHandle box =
      world.add_body({.shape = Box{Vec3::Constant(0.2)}, .pose = {Vec3(0, 0.2, 0)}, .restitution = 0});
  run(world, 0.9);
  EXPECT_FALSE(world.is_asleep(box));
  run(world, 1.1);
  EXPECT_TRUE(world.is_asleep(box));
  EXPECT_NEAR(world.body(box).centre.y(), 0.7, 1e-6);
}

TEST_P(Sleep, AnImpactWakesIt) {
  Scene s = sleeping_stack();
  s.world.add_body({.shape = Sphere{0.1}, .pose = {Vec3(-1.1, 1, 0)}, .velocity = {6, 1, 0}});
  const Tally t = run(s.world, 0.3);
  EXPECT_GT(t.collisions, 0u);
  EXPECT_FALSE(s.world.is_asleep(s.stack[2]));
  EXPECT_GT(s.world.body(s.stack[2]).centre.x(), 0.01);
}

TEST_P(Sleep, AFastBulletWakesIt) {
  Scene s = sleeping_stack();
  s.world.add_body({.shape = Sphere{0.02}, .pose = {Vec3(-3, 1, 0)}, .velocity = {300, 0, 0}});
  run(s.world, 0.1);
  EXPECT_GT(s.world.body(s.stack[2]).centre.x(), 1e-3);
}

TEST_P(Sleep, LosingItsSupportWakesIt) {
  Scene s = sleeping_stack();
  s.world.remove(s.support);
  run(s.world, 0.2);
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(s.world.body(s.stack[std::size_t(i)]).centre.y(), 0.6 + 0.2 * i - 0.5 * kGravity * 0.04,
                5e-3);
}

TEST_P(Sleep, LosingOneOfItsOwnWakesIt) {
  Scene s = sleeping_stack();
  s.world.remove(s.stack[0]);
  run(s.world, 0.1);
  EXPECT_LT(s.world.body(s.stack[2]).centre.y(), 1 - 0.04);
}

TEST_P(Sleep, ForcesExplosionsAndCallsWakeIt) {
  Scene pushed = sleeping_stack();
  pushed.world.add_force({.effect = ConstantField{.force = {100, 0, 0}}});
  run(pushed.world, 0.5);
  EXPECT_GT(pushed.world.body(pushed.stack[2]).centre.x(), 0.1);

  Scene blown = sleeping_stack();
  const Real soon = blown.world.time() + 0.1;
  blown.world.add_force(
      {.start = soon, .effect = Explosion{.point = {-0.5, 1, 0}, .impulse = 40, .radius = 2}});
  run(blown.world, 1);
  EXPECT_GT(blown.world.body(blown.stack[2]).centre.x(), 0.1);

  Scene told = sleeping_stack();
  told.world.set_velocity(told.stack[2], {0, 2, 0}, Vec3::Zero());
  run(told.world, 0.1);
  EXPECT_GT(told.world.body(told.stack[2]).centre.y(), 1.1);
}

TEST_P(Sleep, ALaterForceAGrabAndTheEndOfASupportForceWakeIt) {
  Scene pushed = sleeping_stack();
  const Real soon = pushed.world.time() + 1;
  pushed.world.add_force({.start = soon, .effect = ConstantField{.force = {100, 0, 0}}});
  run(pushed.world, 0.99);
  EXPECT_TRUE(pushed.world.is_asleep(pushed.stack[2]));
  run(pushed.world, 0.5);
  EXPECT_GT(pushed.world.body(pushed.stack[2]).centre.x(), 0.1);

  Scene pulled = sleeping_stack();
  const Real now = pulled.world.time();
  const Vec3 top = pulled.world.body(pulled.stack[2]).centre;
  Grab grab{.stiffness = 1000, .damping = 10};
  for (const auto& [time, height] : {std::pair(now, 0.0), {now + 1, 0.0}, {now + 2, 0.5}})
    grab.track.keys.push_back({time, {.position = top + Vec3(0, height, 0)}});
  grab.track.interpolation = Interpolation::linear;
  pulled.world.add_force({.bodies = {pulled.stack[2]}, .effect = grab});
  run(pulled.world, 0.99);
  EXPECT_TRUE(pulled.world.is_asleep(pulled.stack[2]));
  run(pulled.world, 1.2);
  EXPECT_GT(pulled.world.body(pulled.stack[2]).centre.y(), top.y() + 0.2);

  WorldDef sleepy = def();
  sleepy.sleep = true;
  World held(sleepy);
  const BodyHandle ball = held.add_body({.shape = Sphere{0.1}, .pose = {.position = {0, 2, 0}}, .mass = 2});
  held.add_force({.end = 2, .effect = ConstantField{.force = -2 * sleepy.gravity}});
  run(held, 1.9);
  EXPECT_TRUE(held.is_asleep(ball));
  run(held, 0.3);
  EXPECT_NEAR(held.body(ball).velocity.y(), 0.2 * sleepy.gravity.y(), 0.05);
}

// The other end of the spring may be a kinematic body, whose keys may make it jump, or a particle that moves
// away.
TEST_P(Sleep, ASpringWhoseOtherEndMovesWakesIt) {
  for (const Interpolation kind : {Interpolation::monotone, Interpolation::step}) {
    Scene s = sleeping_stack();
    const Real now = s.world.time();
    const Vec3 top = s.world.body(s.stack[2]).centre, side = top + Vec3(1, 0, 0);
    const BodyHandle hand = s.world.add_body(
        {.shape = Sphere{0.1},
         .motion = MotionType::kinematic,
         .pose = {side},
         .collides = false,
         .track = {.keys = {{now, {side}}, {now + 1, {side}, kind}, {now + 1.2, {side + Vec3(2, 0, 0)}}}}});
    s.world.add_spring({.a = BodyPoint{s.stack[2]}, .b = BodyPoint{hand}, .stiffness = 2000, .damping = 50});
    run(s.world, 0.95);
    EXPECT_TRUE(s.world.is_asleep(s.stack[2]));
    EXPECT_EQ(s.world.step(1.0 / 240).bodies.awake, 0u);  // no cost until the other end moves
    run(s.world, 1);
    EXPECT_GT(s.world.body(s.stack[2]).centre.x(), 0.5);
  }
}

TEST_P(Sleep, ASpringToAParticleThatMovesOrDiesWakesIt) {
  Scene s = sleeping_stack();
  const Vec3 top = s.world.body(s.stack[2]).centre;
  const auto system = s.world.add_particle_system({.gravity = false, .collides = false});
  const uint64_t id =
      s.world.add_particle(system, {.position = top + Vec3(0, 1, 0), .mass = 5, .lifespan = 4});
  s.world.add_spring(
      {.a = BodyPoint{s.stack[2]}, .b = ParticlePoint{system, id}, .stiffness = 20, .damping = 5});
  run(s.world, 1);
  EXPECT_TRUE(s.world.is_asleep(s.stack[2]));
  s.world.add_force(
      {.systems = {system}, .start = s.world.time() + 1, .effect = ConstantField{.force = {20, 0, 0}}});
  run(s.world, 0.9);
  EXPECT_TRUE(s.world.is_asleep(s.stack[2]));
  run(s.world, 0.8);
  EXPECT_FALSE(s.world.is_asleep(s.stack[2]));
}

TEST_P(Sleep, LosingASpringWithTheBodyAtItsOtherEndWakesIt) {
  WorldDef sleepy = def();
  sleepy.sleep = true;
  World world(sleepy);
  const BodyHandle hook =
      world.add_body({.shape = Sphere{0.1}, .motion = MotionType::static_body, .pose = {Vec3(0, 3, 0)}});
  const BodyHandle ball = world.add_body({.shape = Sphere{0.1}, .pose = {Vec3(0, 2, 0)}, .mass = 1});
  world.add_spring({.a = BodyPoint{hook},
                    .b = BodyPoint{ball},
                    .stiffness = 1000,
                    .damping = 60,
                    .rest_length = 1 - kGravity / 1000});
  run(world, 1);
  ASSERT_TRUE(world.is_asleep(ball));
  world.remove(hook);
  run(world, 0.5);
  EXPECT_LT(world.body(ball).centre.y(), 1.5);
}

TEST_P(Sleep, AnArrivingKinematicBodyWakesIt) {
  Scene s = sleeping_stack();
  const Real t = s.world.time();
  s.world.add_body({.shape = Box{{0.2, 0.1, 0.2}},
                    .motion = MotionType::kinematic,
                    .track = {.keys = {{t, {Vec3(-1.5, 1, 0)}}, {t + 1, {Vec3(0, 1, 0)}}},
                              .interpolation = Interpolation::linear}});
  run(s.world, 1);
  EXPECT_GT(s.world.body(s.stack[2]).centre.x(), 0.15);
}

// A sleeping box is lifted by a body that jumps or appears into it, and does not sleep while it overlaps.
TEST_P(Sleep, ABodyThatJumpsOrAppearsInItWakesIt) {
  for (const bool jumps : {true, false}) {
    WorldDef sleepy = def();
    sleepy.sleep = true;
    World world(sleepy);
    world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0});
    const BodyHandle box =
        world.add_body({.shape = Box{Vec3::Constant(0.2)}, .pose = {Vec3(0, 0.1, 0)}, .restitution = 0});
    BodyDef slab{.shape = Box{{1, 0.2, 1}}, .pose = {Vec3(0, -0.07, 0)}, .restitution = 0};
    if (jumps) {
      slab.motion = MotionType::kinematic;
      slab.track = {.keys = {{0, {Vec3(0, -0.5, 0)}}, {1.5, {Vec3(0, -0.07, 0)}}},
                    .interpolation = Interpolation::step};
    } else {
      slab.motion = MotionType::static_body;
      slab.appear_at = 1.5;
    }
    world.add_body(slab);
    run(world, 1.4);
    ASSERT_TRUE(world.is_asleep(box));
    run(world, 8);
    EXPECT_TRUE(world.is_asleep(box)) << jumps;
    EXPECT_NEAR(world.body(box).centre.y(), 0.13, 1.1e-3) << jumps;
  }
}

// A spring begins to pull when the body at its other end appears. It moves both ends as it does without
// sleep.
TEST_P(Sleep, ABodyThatAppearsAtASpringWakesTheOtherEnd) {
  for (const MotionType type : {MotionType::static_body, MotionType::kinematic, MotionType::dynamic}) {
    std::array<Vec3, 2> end[2];
    for (const bool sleeps : {false, true}) {
      WorldDef with = def();
      with.sleep = sleeps;
      World world(with);
      world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0});
      const BodyDef box{.shape = Box{Vec3::Constant(0.4)}, .pose = {Vec3(0, 0.2, 0)}, .restitution = 0};
      const BodyHandle own = world.add_body(box);
      BodyDef late = box;
      late.motion = type;
      late.pose.position.x() = 2;
      late.appear_at = 2;
      const BodyHandle other = world.add_body(late);
      world.add_spring({.a = BodyPoint{own, Vec3::Zero()},
                        .b = BodyPoint{other, Vec3::Zero()},
                        .stiffness = 3000,
                        .damping = 100,
                        .rest_length = 0.5});
      run(world, 1.9);
      ASSERT_EQ(world.is_asleep(own), sleeps);
      run(world, 2);
      end[sleeps] = {world.body(own).centre, world.body(other).centre};
    }
    EXPECT_GT(end[0][0].x(), 0.3);
    for (const std::size_t i : {0, 1}) EXPECT_LT((end[1][i] - end[0][i]).norm(), 1e-3) << i;
  }
}
OFFSTAGE_BOTH_SOLVERS(Solvers, Sleep);

// A box that stands on a face, but not quite flat, falls onto its corners one after the other and stays
// there. Contacts that pushed while they moved apart gave it the energy to rock for ever, by micrometres.
TEST(Rocking, OfABoxOnItsCornersEnds) {
  for (const Real about_x : {2e-5, 1e-4, 3e-4, 1e-3})
    for (const Real about_z : {0.0, 2e-5, 1.5e-4, 1e-3}) {
      World world({.solver = SolverKind::exact});
      world.add_body(
          {.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0, .friction = 0.8});
      const BodyHandle box = world.add_body({.shape = Box{{0.125, 0.27, 0.2}},
                                             .pose = {{0, 0.135 + 0.1 * about_x + 0.0625 * about_z, 0},
                                                      Quat(1, about_x / 2, 0, about_z / 2).normalized()},
                                             .restitution = 0,
                                             .friction = 0.8});
      run(world, 2);
      EXPECT_TRUE(world.is_asleep(box)) << about_x << " " << about_z;
    }
}

// A solid with many corners wobbles around its rim and comes to rest. Its corners overlapped the floor by
// millimetres in the course of this, and the speed at which they were pushed out kept it wobbling.
TEST(Rocking, OfAFacetedConeEnds) {
  for (const uint32_t sides : {32u, 64u}) {
    TriangleMesh cone;
    for (uint32_t i = 0; i < sides; ++i) {
      const Real angle = 2 * M_PI * i / sides;
      cone.vertices.emplace_back(0.2 * std::cos(angle), -0.2, 0.2 * std::sin(angle));
    }
    cone.vertices.emplace_back(0, 0.2, 0);
    for (uint32_t i = 0; i < sides; ++i) cone.triangles.push_back({(i + 1) % sides, i, sides});
    for (uint32_t i = 2; i < sides; ++i) cone.triangles.push_back({0, i - 1, i});
    World world({.solver = SolverKind::exact});
    world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0, .friction = 0.5});
    const Vec3 axis = Vec3(1, 2, 0.5).normalized();
    const BodyHandle body = world.add_body({.shape = MeshShape{world.add_mesh(cone)},
                                            .pose = {{0, 0.4, 0}, Quat(Eigen::AngleAxisd(0.873, axis))},
                                            .mass = 13,
                                            .restitution = 0,
                                            .friction = 0.5});
    run(world, 4);
    EXPECT_TRUE(world.is_asleep(body)) << sides << " " << world.body(body).angular_momentum.norm();
  }
}

class Overlap : public BothSolvers {};

// Without gravity, two boxes that overlap at the start come apart and hardly move afterwards.
TEST_P(Overlap, LeavesNoVelocity) {
  for (const Real step : {1.0 / 60, 1.0 / 240}) {
    World world(weightless(step));
    std::vector<BodyHandle> boxes;
    for (const Real x : {-0.495, 0.495})
      boxes.push_back(
          world.add_body({.shape = Box{Vec3::Ones()}, .pose = {Vec3(x, 0, 0)}, .restitution = 0}));
    const Tally t = run(world, 4, step);
    EXPECT_LT(t.last.contacts.penetration, 2e-4);
    for (const BodyHandle b : boxes) EXPECT_LT(world.body(b).velocity.norm(), 1.1e-3) << step;
  }
}

// Overlaps are removed at no more than the correction speed, and no velocity remains.
TEST_P(Overlap, IsPushedApartGently) {
  for (const Real depth : {0.005, 0.05}) {
    World world(def());
    world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0.5});
    const auto box = world.add_body({.shape = Box{Vec3::Constant(0.4)}, .pose = {Vec3(0, 0.2 - depth, 0)}});
    const auto above =
        world.add_body({.shape = Box{Vec3::Constant(0.4)}, .pose = {Vec3(0, 0.6 - 2 * depth, 0)}});
    Real fastest = 0;
    for (int i = 0; i < 480; ++i) {
      EXPECT_TRUE(world.step(1.0 / 240).finite);
      for (const BodyHandle b : {box, above}) fastest = std::max(fastest, world.body(b).velocity.norm());
    }
    EXPECT_LT(fastest, 1.2) << depth;
    EXPECT_NEAR(world.body(box).centre.y(), 0.2, 1e-3) << depth;
    EXPECT_NEAR(world.body(above).centre.y(), 0.6, 1e-3) << depth;
  }
}

TEST_P(Overlap, CoincidentBodiesComeApart) {
  World world(weightless());
  std::vector<BodyHandle> bodies;
  for (const Shape& s : {Shape(Sphere{0.1}), Shape(Sphere{0.1}), Shape(Box{Vec3::Constant(0.2)})})
    bodies.push_back(world.add_body({.shape = s, .restitution = 0}));
  const Tally t = run(world, 2);
  EXPECT_TRUE(t.finite);
  EXPECT_LT(t.last.contacts.penetration, 1e-3);
  for (const BodyHandle b : bodies) EXPECT_LT(world.body(b).velocity.norm(), 2);
}
OFFSTAGE_BOTH_SOLVERS(Solvers, Overlap);

class Bounds : public BothSolvers {};

TEST_P(Bounds, BodiesThatLeaveInContactAreRetiredOnceEach) {
  WorldDef small = def();
  small.bounds = Aabb(Vec3(-2, -2, -2), Vec3(2, 2, 2));
  World world(small);
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0, .friction = 0});
  std::vector<BodyHandle> stack;
  for (int i = 0; i < 3; ++i)
    stack.push_back(world.add_body({.shape = Box{Vec3::Constant(0.2)},
                                    .pose = {Vec3(1.5 - 0.03 * i, 0.1 + 0.2 * i, 0)},
                                    .velocity = {1, 0, 0},
                                    .restitution = 0}));
  std::size_t retired = 0;
  for (int i = 0; i < 240; ++i) {
    const StepReport r = world.step(1.0 / 240);
    EXPECT_TRUE(r.finite);
    retired += r.bodies_retired.size();
  }
  EXPECT_EQ(retired, 3u);
  for (const BodyHandle b : stack) EXPECT_NEAR(world.body(b).centre.x(), 2, 0.1);
}
OFFSTAGE_BOTH_SOLVERS(Solvers, Bounds);

class Joined : public BothSolvers {};

// A bob on a stiff spring swings into a ball of equal mass at the lowest point: the ball takes over all the
// speed.
TEST_P(Joined, APendulumOnAStiffSpringTransfersItsSpeed) {
  constexpr Real kLength = 1, kRadius = 0.05, kStart = 1;
  WorldDef light = def();
  World world(light);
  world.add_body({.shape = Box{{0.04, 1, 0.04}},
                  .motion = MotionType::static_body,
                  .pose = {Vec3(2 * kRadius, -0.5 - kRadius, 0)},
                  .restitution = 0,
                  .friction = 0});
  const auto bob = world.add_body({.shape = Sphere{kRadius},
                                   .pose = {kLength * Vec3(-std::sin(kStart), 1 - std::cos(kStart), 0)},
                                   .mass = 1,
                                   .restitution = 1,
                                   .friction = 0});
  const auto ball = world.add_body({.shape = Sphere{kRadius},
                                    .pose = {Vec3(2 * kRadius, 0, 0)},
                                    .mass = 1,
                                    .restitution = 1,
                                    .friction = 0});
  world.add_spring(
      {.a = WorldPoint{{0, kLength, 0}}, .b = BodyPoint{bob}, .stiffness = 1e5, .rest_length = kLength});
  const Real before = world.energy().total();
  uint64_t collisions = 0;
  for (int i = 0; i < 240 && collisions == 0; ++i) collisions += world.step(1.0 / 240).impacts.collisions;
  ASSERT_EQ(collisions, 1u);
  const Real speed = std::sqrt(2 * kGravity * kLength * (1 - std::cos(kStart)));
  EXPECT_NEAR(world.body(ball).velocity.x() / speed, 1, 0.01);
  EXPECT_LT(std::abs(world.body(bob).velocity.x()), 0.02 * speed);
  EXPECT_NEAR(world.energy().total(), before, 0.01 * before + 0.05);
}

// E7: bodies connected by a spring are traced back together, so larger steps give the same motion.
TEST_P(Joined, BodiesOnASpringAreTracedBackTogether) {
  const auto finish = [](Real max_step) {
    World world(weightless(max_step));
    world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 1, .friction = 0});
    const auto ball = [&](Real y) {
      return world.add_body({.shape = Sphere{0.1},
                             .pose = {Vec3(0, y, 0)},
                             .velocity = {0.3, -2, 0},
                             .mass = 1,
                             .restitution = 1,
                             .friction = 0});
    };
    const auto low = ball(0.7), high = ball(1.7);
    world.add_spring({.a = BodyPoint{low}, .b = BodyPoint{high}, .stiffness = 200, .rest_length = 1});
    const Real before = world.energy().total();
    const Tally t = run(world, 1.5, max_step);
    EXPECT_GE(t.tracebacks, 1u);
    EXPECT_NEAR(world.energy().total() / before, 1, 1e-3) << max_step;
    return std::pair(world.body(low).centre, world.body(high).centre);
  };
  const auto [low, high] = finish(1.0 / 60);
  const auto [low_exact, high_exact] = finish(1.0 / 1920);
  EXPECT_LT((low - low_exact).norm(), 1e-3);
  EXPECT_LT((high - high_exact).norm(), 1e-3);
}
OFFSTAGE_BOTH_SOLVERS(Solvers, Joined);

class Rain : public BothSolvers {};

// Particles fall on a falling stack: none gets inside a body, and the stack lands as without particles.
TEST_P(Rain, OnBodiesThatMove) {
  World world(def());
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body, .restitution = 0});
  std::vector<BodyHandle> boxes;
  for (int i = 0; i < 3; ++i)
    boxes.push_back(world.add_body(
        {.shape = Box{Vec3::Constant(0.4)}, .pose = {Vec3(0, 0.3 + 0.45 * i, 0)}, .restitution = 0}));
  const auto system = world.add_particle_system({});
  for (int i = 0; i < 200; ++i)
    world.add_particle(system, {.position = {-0.4 + 0.004 * i, 2 + 0.01 * (i % 7), 0.05 * (i % 5) - 0.1},
                                .mass = 1e-3,
                                .radius = 0.005,
                                .restitution = 0.3});
  const Tally t = run(world, 1.5);
  EXPECT_EQ(t.last.particles.removed, 0u);
  EXPECT_NEAR(world.body(boxes[2]).centre.y(), 1, 1e-3);
  for (const Vec3& p : world.particles(system).position) {
    for (const BodyHandle b : boxes) {
      const Vec3 q = world.body(b).pose.point_to_body(p).cwiseAbs();
      EXPECT_GT(q.maxCoeff(), 0.2);
    }
    EXPECT_GT(p.y(), 0);
  }
}
OFFSTAGE_BOTH_SOLVERS(Solvers, Rain);

}  // namespace
}  // namespace offstage::sim
