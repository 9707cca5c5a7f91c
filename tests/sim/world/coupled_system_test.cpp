#include "sim/world/coupled_system.h"

#include <array>
#include <memory>

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "sim/world/coupling_graph.h"
#include "tests/random.h"

namespace offstage::sim {
namespace {

/// A world of bodies without collision shapes, free or connected by springs.
struct Sky {
  WorldState world;

  BodyHandle add(uint64_t i) {
    const Scatter s{17};
    auto body = std::make_unique<Body>();
    RigidBody& r = body->rigid;
    r.mass = 1 + s.uniform(i, 0);
    r.inertia = Vec3(0.1, 0.1 + 0.05 * s.uniform(i, 1), 0.2).asDiagonal();
    if (i % 2) r.inertia = 0.1 * Mat3::Identity();
    r.inverse_inertia = r.inertia.inverse();
    if (i % 5 == 0) r.linear_drag = 0.1;
    r.position = {static_cast<Real>(i), s.uniform(i, 2), s.uniform(i, 3)};
    r.set_velocity({s.uniform(i, 4), s.uniform(i, 5), 0}, {5 * s.uniform(i, 6), 1, -3 * s.uniform(i, 7)});
    return world.bodies.insert(std::move(body));
  }
  void join(const Attachment& a, const Attachment& b) {
    world.springs.insert({{.a = a, .b = b, .stiffness = 200, .damping = 0.5}, 0.7});
  }
  RigidBody& operator[](BodyHandle h) { return world.bodies[h]->rigid; }
  Body* body(BodyHandle h) { return world.bodies[h].get(); }
};

bool same_state(const RigidBody& a, const RigidBody& b) {
  return a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs() &&
         a.momentum == b.momentum && a.angular_momentum == b.angular_momentum && a.next_step == b.next_step;
}

constexpr std::array kSomeKinds = {IntegratorKind::rk4, IntegratorKind::implicit_euler,
                                   IntegratorKind::dormand_prince};

TEST(CoupledSystem, ABodyMovesIndependentlyOfUnconnectedOnes) {
  for (IntegratorKind kind : kSomeKinds) {
    std::vector<RigidBody> expected;
    for (bool crowded : {false, true})
      for (std::size_t threads : {1, 4}) {
        const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                                threads);
        Sky sky;
        std::vector<BodyHandle> bodies;
        for (uint64_t i = 0; i < (crowded ? 1000 : 8); ++i) bodies.push_back(sky.add(i));
        sky.join(BodyPoint{bodies[0], {0.1, 0, 0}}, BodyPoint{bodies[1]});
        sky.join(BodyPoint{bodies[2], {0, 0.1, 0}}, WorldPoint{{2, 3, 0}});
        if (crowded)
          for (std::size_t i = 500; i < 520; ++i) sky.join(BodyPoint{bodies[i]}, BodyPoint{bodies[i + 1]});
        for (int i = 0; i < 10; ++i) CoupledSystem(sky.world).step(integrator(kind), i / 60.0, 1.0 / 60);
        std::vector<RigidBody> found;
        for (std::size_t i = 0; i < 8; ++i) found.push_back(sky[bodies[i]]);
        if (expected.empty()) expected = found;
        for (std::size_t i = 0; i < 8; ++i)
          EXPECT_TRUE(same_state(found[i], expected[i])) << i << " of kind " << static_cast<int>(kind);
      }
  }
}

TEST(CoupledSystem, APartResetAndSteppedAgainMovesTheSame) {
  for (IntegratorKind kind : kSomeKinds) {
    Sky sky;
    std::vector<BodyHandle> bodies;
    for (uint64_t i = 0; i < 6; ++i) bodies.push_back(sky.add(i));
    const ParticleSystemHandle beads = sky.world.systems.insert({});
    const uint64_t bead = sky.world.systems[beads].add({.position = {1, 1, 1}, .mass = 0.3}, -1);
    sky.join(BodyPoint{bodies[1]}, ParticlePoint{beads, bead});
    sky.join(BodyPoint{bodies[3]}, ParticlePoint{beads, bead});
    CoupledSystem all(sky.world);
    all.save();
    all.step(integrator(kind), 0, 0.02);
    const RigidBody lone = sky[bodies[0]], tied = sky[bodies[1]], other = sky[bodies[5]];
    const Vec3 held = sky.world.systems[beads].arrays.position[0];

    Body* const involved[] = {sky.body(bodies[0]), sky.body(bodies[1])};
    all.restore(involved);
    EXPECT_NE(sky[bodies[0]].position, lone.position);
    EXPECT_NE(sky.world.systems[beads].arrays.position[0], held);
    EXPECT_TRUE(same_state(sky[bodies[5]], other));  // not connected, so the body is unchanged
    const std::vector<Body*> part = connected(sky.world, involved);
    ASSERT_EQ(part, (std::vector<Body*>{sky.body(bodies[0]), sky.body(bodies[1]), sky.body(bodies[3])}));
    CoupledSystem again(sky.world, part);
    EXPECT_TRUE(again.holds(sky.world.systems[beads]));
    again.step(integrator(kind), 0, 0.02);
    EXPECT_TRUE(same_state(sky[bodies[0]], lone));
    EXPECT_TRUE(same_state(sky[bodies[1]], tied));
    EXPECT_EQ(sky.world.systems[beads].arrays.position[0], held);
  }
}

TEST(CouplingGraph, ConnectsThroughParticleSystemsButNotThroughTheWorld) {
  Sky sky;
  std::vector<BodyHandle> b;
  for (uint64_t i = 0; i < 6; ++i) b.push_back(sky.add(i));
  const ParticleSystemHandle beads = sky.world.systems.insert({});
  sky.world.systems[beads].add({}, -1);
  sky.world.bodies[b[5]]->type = MotionType::static_body;
  sky.join(BodyPoint{b[3]}, BodyPoint{b[1]});
  sky.join(ParticlePoint{beads, 0}, BodyPoint{b[3]});
  sky.join(ParticlePoint{beads, 0}, BodyPoint{b[0]});
  sky.join(BodyPoint{b[2]}, BodyPoint{b[5]});
  sky.join(BodyPoint{b[1]}, BodyPoint{b[5]});
  sky.join(BodyPoint{b[2]}, WorldPoint{});
  const CouplingGraph graph(sky.world);
  EXPECT_EQ(graph.component(*sky.body(b[0])), graph.component(*sky.body(b[1])));
  EXPECT_EQ(graph.component(*sky.body(b[0])), graph.component(sky.world.systems[beads]));
  EXPECT_NE(graph.component(*sky.body(b[2])), graph.component(*sky.body(b[1])));
  EXPECT_EQ(graph.component(*sky.body(b[4])), CouplingGraph::kNone);
  EXPECT_EQ(graph.component(*sky.body(b[5])), CouplingGraph::kNone);
}

TEST(CoupledGroup, JacobianAgreesWithDifferences) {
  Sky sky;
  GroupMembers members;
  std::vector<BodyHandle> b;
  for (uint64_t i = 0; i < 3; ++i) {
    b.push_back(sky.add(i));
    members.bodies.push_back(sky.body(b[i]));
  }
  const ParticleSystemHandle beads = sky.world.systems.insert({});
  sky.world.systems[beads].def.linear_drag = 0.2;
  members.systems = {&sky.world.systems[beads]};
  for (int i = 0; i < 2; ++i)
    members.systems[0]->add({.position = {0.5 * i, 1, 2}, .velocity = {1, i + 0.0, 0}, .mass = 0.3 + i}, -1);
  sky.join(BodyPoint{b[0], {0.3, 0.1, -0.2}}, BodyPoint{b[1], {0.1, 0.5, 0.3}});
  sky.join(BodyPoint{b[1], {0, -0.1, 0.2}}, ParticlePoint{beads, 1});
  sky.join(ParticlePoint{beads, 0}, ParticlePoint{beads, 1});
  sky.join(WorldPoint{{4, 1, 0}}, BodyPoint{b[2], {0, 0.2, 0}});
  sky.join(BodyPoint{b[2], {0.5, 0, 0}}, BodyPoint{b[2], {0, 0.5, 0.1}});  // connects a body with itself
  sky.world.springs.for_each([&](SpringHandle, const Spring& s) { members.springs.push_back(&s); });
  const BodyForces forces{{0, -9.81, 0}, {}};
  const CoupledGroup network(sky.world, members, forces);

  std::vector<Real> x(3 * kBodyX + 6), p(3 * kBodyP + 6);
  for (std::size_t i = 0; i < 3; ++i)
    load(sky[b[i]], std::span(x).subspan(kBodyX * i, kBodyX), std::span(p).subspan(kBodyP * i, kBodyP));
  for (std::size_t i = 0; i < 6; ++i) {
    x[3 * kBodyX + i] = 0.3 * static_cast<Real>(i);
    p[3 * kBodyP + i] = 1 - 0.5 * static_cast<Real>(i);
  }
  const auto size = static_cast<Eigen::Index>(x.size() + p.size());
  Eigen::SparseMatrix<Real> exact(size, size), differences(size, size);
  SparseEntries entries;
  network.jacobian(0, x, p, entries);
  exact.setFromTriplets(entries.begin(), entries.end());
  entries.clear();
  network.DynamicSystem::jacobian(0, x, p, entries);
  differences.setFromTriplets(entries.begin(), entries.end());
  EXPECT_NEAR((Eigen::MatrixXd(exact) - Eigen::MatrixXd(differences)).cwiseAbs().maxCoeff(), 0, 1e-5);
}

TEST(CoupledSystem, ForcesReachTheBodiesThatTheyName) {
  std::array<std::array<Vec3, 4>, 2> momentum;
  for (bool pushed : {false, true}) {
    Sky sky;
    std::vector<BodyHandle> b;
    for (uint64_t i = 0; i < 4; ++i) b.push_back(sky.add(2 * i + 1));
    sky.join(BodyPoint{b[2]}, WorldPoint{{5, 0, 0}});
    sky.join(BodyPoint{b[3]}, WorldPoint{{7, 0, 0}});
    const ForceDef push{.bodies = {b[1], b[2]}, .effect = ConstantField{.force = {0, 0, 100}}};
    const ForceDef* const forces[] = {&push};
    CoupledSystem(sky.world, std::span(forces).first(pushed)).step(integrator(IntegratorKind::rk4), 0, 1e-3);
    for (std::size_t i = 0; i < 4; ++i) momentum[pushed][i] = sky[b[i]].momentum;
  }
  // up to the change of the spring and damper forces that this motion causes
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR((momentum[1][i] - momentum[0][i]).z(), i == 1 || i == 2 ? 0.1 : 0, 1e-4) << i;
}

}  // namespace
}  // namespace offstage::sim
