/// Effects of air, pressure, seams and weight on cloth, compared with closed forms.

#include <cmath>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "meshes.h"
#include "sim/cloth/cloth_state.h"
#include "sim/dynamics/free_body.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr Real kClothGravity = 9.81;

const effects::Fabric& cotton() {
  return effects::find_fabric("cotton")->fabric;
}

Vec3 momentum(const ClothDef& def, const ClothView& view) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < view.points.size(); ++i) sum += def.masses[i] * view.velocities[i];
  return sum;
}

TEST(ClothAir, AFlatSheetFallsAtItsTerminalSpeed) {
  // Square to the air: m g = rho A C_D v^2 / 2, and before that v = v_t tanh(g t / v_t).
  World world;
  const ClothDef def = effects::grid_cloth({1, 1, 10, 10}, {}, cotton());
  const ClothHandle cloth = world.add_cloth(def);
  const Real terminal = std::sqrt(2 * cotton().areal_density * kClothGravity / (1.2 * cotton().drag));
  Real mass = 0;
  for (Real m : def.masses) mass += m;
  for (int frame = 1; frame <= 48; ++frame) {
    world.step(1.0 / 48);
    const Real speed = -momentum(def, world.cloth(cloth)).y() / mass;
    EXPECT_NEAR(speed, terminal * std::tanh(kClothGravity * frame / 48 / terminal), 0.001 * terminal)
        << frame;
  }
}

TEST(ClothAir, LiftsAndDragsAPlateAslantAsItsCoefficientsSay) {
  // F = rho A / 2 U^2 ((C_D - C_L) u + C_L (u.n) n), with the unit vectors u and n; its components are
  // along the wind and across it.
  constexpr Real kWind = 10, kStep = 1e-4, kSide = 0.8;
  for (Real angle : {0.2, 0.7, 1.3}) {
    World world({.gravity = Vec3::Zero(), .wind = {kWind, 0, 0}, .max_step = kStep});
    const Pose pose{Vec3::Zero(), Quat(Eigen::AngleAxis<Real>(angle, Vec3::UnitZ()))};
    ClothDef def = effects::grid_cloth({kSide, kSide, 6, 6}, pose, cotton());
    def.air = {.drag = 1.1, .lift = 0.8, .density = 1.25};
    const ClothHandle cloth = world.add_cloth(def);
    world.step(kStep);
    const Vec3 force = momentum(def, world.cloth(cloth)) / kStep;
    const Real sine = std::sin(angle), cosine = std::cos(angle);
    const Real dynamic = 1.25 * kSide * kSide / 2 * kWind * kWind;
    // n = (-sin, cos, 0), u.n = -sin.
    EXPECT_NEAR(force.x(), dynamic * (0.3 + 0.8 * sine * sine), 0.01 * dynamic) << angle;
    EXPECT_NEAR(force.y(), -dynamic * 0.8 * sine * cosine, 0.01 * dynamic) << angle;
    EXPECT_NEAR(force.z(), 0, 1e-9);
  }
}

TEST(ClothAir, AnOpenBoxTakesTheStagnationPressureOfItsMouth) {
  // Four walls and a lid: walls cancel each other, and the lid is as large as the mouth.
  constexpr Real kWind = 6, kStep = 1e-4;
  World world({.gravity = Vec3::Zero(), .wind = {0, kWind, 0}, .max_step = kStep});
  TriangleMesh box = box_mesh({0.5, 0.5, 0.5});
  std::erase_if(box.triangles, [&](const Triangle& t) {
    return box.vertices[t[0]].y() + box.vertices[t[1]].y() + box.vertices[t[2]].y() < -0.7;
  });
  ASSERT_EQ(box.triangles.size(), 10u);
  ClothDef def = effects::mesh_cloth(box, {}, cotton());
  def.air = {.drag = 0, .lift = 0, .density = 1.2};
  def.ram_pressure = 0.9;
  def.self_collision = false;
  const ClothHandle cloth = world.add_cloth(def);
  world.step(kStep);
  const Vec3 force = momentum(def, world.cloth(cloth)) / kStep;
  EXPECT_NEAR(force.y(), 0.9 * 1.2 / 2 * kWind * kWind * 0.25, 0.01 * force.y());
  EXPECT_NEAR(force.x(), 0, 1e-9);

  // Wind from behind has no effect.
  World lee({.gravity = Vec3::Zero(), .wind = {0, -kWind, 0}, .max_step = kStep});
  const ClothHandle other = lee.add_cloth(def);
  lee.step(kStep);
  EXPECT_LT(momentum(def, lee.cloth(other)).norm(), 1e-12);
}

TEST(ClothPressure, HoldsASkinByBoylesLaw) {
  // At rest, the virial of the springs equals that of the pressure: sum k (l - L) l = 3 p V. The gas has p V
  // = p0 V0.
  effects::Fabric rubber = effects::find_fabric("rubber")->fabric;
  rubber.damping = 0.3;
  World world({.gravity = Vec3::Zero()});
  ClothDef def = effects::mesh_cloth(sphere_mesh(0.3, 20, 12), {}, rubber);
  def.pressure = 300;
  def.self_collision = false;
  const ClothHandle cloth = world.add_cloth(def);
  for (int i = 0; i < 96; ++i) world.step(1.0 / 24);
  const ClothView view = world.cloth(cloth);
  Real virial = 0;
  for (const ClothSpring& s : def.springs) {
    const Real length = (view.points[s.a] - view.points[s.b]).norm();
    virial += s.stiffness * (length - s.rest_length) * length;
  }
  const Real rest = enclosed_volume(def.vertices, def.triangles);
  EXPECT_NEAR(virial, 3 * def.pressure * rest, 0.01 * virial);
  EXPECT_GT(enclosed_volume(view.points, view.triangles), 1.05 * rest);
}

/// Parameters: stretch limit, width of the open seam at first [m].
class ClothSeams : public testing::TestWithParam<std::pair<Real, Real>> {};

TEST_P(ClothSeams, HoldAWeightClosed) {
  // Two sheets, one above the other, sewn together; a body hangs on the lower one. By its springs alone the
  // cloth would stretch by 0.15: a limit below that carries, and must let the seam close nevertheless.
  const auto [limit, gap] = GetParam();
  constexpr uint32_t kCells = 10;
  ClothDef def = effects::grid_cloth({0.5, 0.4, kCells, 8}, {}, cotton());
  const auto per_sheet = static_cast<uint32_t>(def.vertices.size());
  const auto add_sheet = [&](ClothDef lower) {
    for (ClothSpring s : lower.springs) {
      s.a += per_sheet;
      s.b += per_sheet;
      def.springs.push_back(s);
    }
    for (const Triangle& t : lower.triangles)
      def.triangles.push_back({t[0] + per_sheet, t[1] + per_sheet, t[2] + per_sheet});
    def.vertices.insert(def.vertices.end(), lower.vertices.begin(), lower.vertices.end());
    def.masses.insert(def.masses.end(), lower.masses.begin(), lower.masses.end());
  };
  add_sheet(effects::grid_cloth({0.5, 0.4, kCells, 8}, {Vec3(0, 0, 0.4 + gap)}, cotton()));
  for (Vec3& v : def.vertices) v = Vec3(v.x(), 2 - v.z(), 0);  // hangs
  def.seam_time = 0.5;
  def.max_stretch = def.max_shear = limit;
  World world;
  const Vec3 place(0, 1.37 - gap, 0);
  const BodyHandle weight =
      world.add_body({.shape = Box{{0.5, 0.05, 0.05}}, .pose = {place}, .mass = 1, .collides = false});
  const uint32_t last = per_sheet + 8 * (kCells + 1);
  for (uint32_t c = 0; c <= kCells; ++c) {
    def.pins.push_back({.vertex = c, .position = def.vertices[c]});
    def.pins.push_back({.vertex = last + c, .body = weight, .position = def.vertices[last + c] - place});
    def.seams.push_back({8 * (kCells + 1) + c, per_sheet + c});
  }
  const ClothHandle cloth = world.add_cloth(def);
  for (int i = 0; i < 96; ++i) world.step(1.0 / 24);
  const ClothView view = world.cloth(cloth);
  for (const ClothSeam& s : def.seams)
    EXPECT_LT((view.points[s.a] - view.points[s.b]).norm(), 1.05 * def.thickness);
  // The seam carries the weight, which would otherwise have fallen by metres.
  EXPECT_GT(world.body(weight).centre.y(), 1.2);
}

INSTANTIATE_TEST_SUITE_P(Limits, ClothSeams,
                         testing::Values(std::pair(0.0, 0.05), std::pair(1.1, 0.05), std::pair(1.1, 0.0)));

TEST(FlatPanel, ClosesItsSeams) {
  // The seams compress the flat panel in its plane. It has to bend out of the plane to close.
  for (const char* fabric : {"cotton", "denim"})
    for (const bool touches_itself : {false, true}) {
      constexpr uint32_t kCells = 20, kRows = 10;
      ClothDef def = effects::grid_cloth({1, 0.5, kCells, kRows}, {}, effects::find_fabric(fabric)->fabric);
      def.self_collision = touches_itself;
      for (uint32_t row = 0; row <= kRows; ++row)
        def.seams.push_back({row * (kCells + 1), row * (kCells + 1) + kCells});
      World world({.gravity = Vec3::Zero(), .max_step = 1.0 / 60});
      const ClothHandle cloth = world.add_cloth(def);
      Vec3 momentum = Vec3::Zero();
      world.step(1.0 / 60);
      const ClothView view = world.cloth(cloth);
      for (std::size_t i = 0; i < def.masses.size(); ++i) momentum += def.masses[i] * view.velocities[i];
      EXPECT_LT(momentum.norm(), 1e-5)
          << fabric << touches_itself;  // of the air; the disturbance of one side has 1e-3
      for (int i = 0; i < 90; ++i) world.step(1.0 / 60);
      for (const ClothSeam& seam : def.seams) {
        const Real gap = (world.cloth(cloth).points[seam.a] - world.cloth(cloth).points[seam.b]).norm();
        ASSERT_LT(gap, 0.007)  // layers that touch are 5 mm apart
            << fabric << touches_itself;
      }
    }
}

/// Heights of a body in each second, lowest and highest.
struct Swing {
  Real lowest, highest;
};
std::vector<Swing> swings(World& world, BodyHandle body, int seconds) {
  std::vector<Swing> result;
  for (int s = 0; s < seconds; ++s) {
    result.push_back({world.body(body).centre.y(), world.body(body).centre.y()});
    for (int i = 0; i < 120; ++i) {
      world.step(1.0 / 120);
      const Real y = world.body(body).centre.y();
      result.back() = {std::min(result.back().lowest, y), std::max(result.back().highest, y)};
    }
  }
  return result;
}

/// Removes all dissipation of a cloth.
ClothDef lossless(ClothDef def) {
  for (ClothSpring& s : def.springs) s.damping = 0;
  def.air.density = 0;
  def.friction = 0;
  def.max_stretch = def.max_shear = 0;
  return def;
}

class ClothSwing : public testing::TestWithParam<std::pair<ClothIntegrator, Real>> {};

TEST_P(ClothSwing, AWeightThatBouncesOnThemGainsNoEnergy) {
  // The cloth swings about its position of rest, equally far down and up. Explicit integrators keep this
  // amplitude; others damp it.
  const auto [integrator, rate] = GetParam();
  ClothDef def = lossless(effects::grid_cloth({0.5, 0.8, 10, 16}, {}, cotton()));
  for (Vec3& v : def.vertices) v = Vec3(v.x(), 1.6 - v.z(), 0);  // hangs
  def.integrator = integrator;
  def.substep = 1 / rate;
  World world;
  const Vec3 place(0, 1.2, 0);
  const BodyHandle weight =
      world.add_body({.shape = Box{{0.5, 0.05, 0.05}}, .pose = {place}, .mass = 0.3, .collides = false});
  for (uint32_t c = 0; c <= 10; ++c) {
    const uint32_t low = 16 * 11 + c;
    def.pins.push_back({.vertex = c, .position = def.vertices[c]});
    def.pins.push_back({.vertex = low, .body = weight, .position = def.vertices[low] - place});
  }
  world.add_cloth(def);
  const std::vector<Swing> swing = swings(world, weight, 8);
  const Real first = swing.front().highest - swing.front().lowest;
  const bool is_explicit = integrator == ClothIntegrator::symplectic || integrator == ClothIntegrator::rk4;
  EXPECT_GT(first, 0.005);
  for (const Swing& s : swing) {
    EXPECT_LT(s.highest, 1.2 + 0.01 * first);
    EXPECT_LT(s.highest - s.lowest, 1.01 * first);
    EXPECT_GT(s.highest - s.lowest, is_explicit ? 0.99 * first : 0);
  }
}

INSTANTIATE_TEST_SUITE_P(Integrators, ClothSwing,
                         testing::Values(std::pair{ClothIntegrator::relaxed, 960.0},
                                         std::pair{ClothIntegrator::relaxed, 240.0},
                                         std::pair{ClothIntegrator::implicit, 960.0},
                                         std::pair{ClothIntegrator::symplectic, 4000.0},
                                         std::pair{ClothIntegrator::rk4, 4000.0}));

TEST(ClothTrampoline, NeverThrowsABallHigherThanItCame) {
  for (Real mass : {0.3, 1.0, 5.0}) {
    ClothDef def = lossless(effects::grid_cloth({2, 2, 20, 20}, {Vec3(0, 1, 0)}, cotton()));
    World world;
    const BodyHandle ball = world.add_body({.shape = Sphere{0.3}, .pose = {{0, 1.31, 0}}, .mass = mass});
    for (uint32_t i = 0; i < def.vertices.size(); ++i)
      if (std::max(std::abs(def.vertices[i].x()), std::abs(def.vertices[i].z())) > 0.99)
        def.pins.push_back({.vertex = i, .position = def.vertices[i]});
    world.add_cloth(def);
    const std::vector<Swing> swing = swings(world, ball, 8);
    for (std::size_t s = 1; s < swing.size(); ++s)
      EXPECT_LT(swing[s].highest, swing[s - 1].highest + 1e-4) << mass << " kg, second " << s;
  }
}

TEST(ClothHanging, AStripHangsInACatenary) {
  // y = a cosh(x / a), with 2 a sinh(w / 2a) = l for ends w apart at one height.
  constexpr Real kSpan = 1;
  constexpr uint32_t kCells = 60;
  effects::Fabric tape = cotton();
  tape.stretch = 20000;
  tape.bend = 0;
  tape.max_stretch = 0;
  ClothDef def = effects::grid_cloth({1.5, 0.05, kCells, 2}, {}, tape);
  def.air.density = 0.4;  // the air damps the swinging
  def.self_collision = false;
  def.integrator = ClothIntegrator::implicit;
  // The tape starts as two straight halves.
  def.rest_vertices = def.vertices;
  const Real slope = std::sqrt(1.5 * 1.5 - kSpan * kSpan) / kSpan;
  for (Vec3& v : def.vertices) {
    const Real x = v.x() * kSpan / 1.5;
    v = Vec3(x, (std::abs(x) - kSpan / 2) * slope, v.z());
  }
  for (uint32_t r = 0; r <= 2; ++r)
    for (uint32_t c : {0u, kCells}) {
      const uint32_t k = r * (kCells + 1) + c;
      def.pins.push_back({.vertex = k, .position = def.vertices[k]});
    }
  World world;
  const ClothHandle cloth = world.add_cloth(def);
  for (int i = 0; i < 240; ++i) world.step(1.0 / 24);
  const ClothView view = world.cloth(cloth);
  const uint32_t middle = kCells + 1;  // the middle row
  Real length = 0;
  for (uint32_t c = 0; c < kCells; ++c)
    length += (view.points[middle + c + 1] - view.points[middle + c]).norm();
  EXPECT_NEAR(length, 1.5, 1.5e-3);
  Real low = 0.01, high = 10;  // a: its length falls with a
  for (int i = 0; i < 100; ++i) {
    const Real a = (low + high) / 2;
    (2 * a * std::sinh(kSpan / (2 * a)) > length ? low : high) = a;
  }
  const Real sag = low * (std::cosh(kSpan / (2 * low)) - 1);
  for (uint32_t c = 0; c <= kCells; ++c) {
    const Vec3& p = view.points[middle + c];
    EXPECT_NEAR(p.y(), low * std::cosh(p.x() / low) - low - sag, 0.005 * sag) << c;
  }
}

TEST(ClothPins, AClothOnABodyTransmitsImpactsToIt) {
  // A frame in free space carries a taut cloth; a ball flies into it. Nothing else can take up momentum.
  World world({.gravity = Vec3::Zero()});
  const BodyHandle frame = world.add_body({.shape = Box{{1, 0.02, 1}}, .mass = 2, .collides = false});
  constexpr uint32_t kCells = 16;
  ClothDef def = effects::grid_cloth({0.9, 0.9, kCells, kCells}, {}, cotton());
  def.air.density = 0;
  def.max_stretch = 1.02;
  for (uint32_t i = 0; i <= kCells; ++i)
    for (uint32_t k : {i, kCells * (kCells + 1) + i, (kCells + 1) * i, (kCells + 1) * i + kCells})
      def.pins.push_back({.vertex = k, .body = frame, .position = def.vertices[k]});
  const ClothHandle cloth = world.add_cloth(def);
  constexpr Real kMass = 0.5, kSpeed = 3;
  const BodyHandle ball = world.add_body(
      {.shape = Sphere{0.1}, .pose = {{0, 0.3, 0}}, .velocity = {0, -kSpeed, 0}, .mass = kMass});
  for (int i = 0; i < 24; ++i) world.step(1.0 / 24);
  EXPECT_LT(world.body(frame).velocity.y(), -0.3);
  const Vec3 sum =
      kMass * world.body(ball).velocity + 2 * world.body(frame).velocity + momentum(def, world.cloth(cloth));
  EXPECT_LT((sum - Vec3(0, -kSpeed * kMass, 0)).norm(), 0.02 * kSpeed * kMass);
}

/// Adds up the rotation of a body by its angular velocity, and returns how far its orientation is from it
/// [rad].
class TurnError {
 public:
  explicit TurnError(const BodyState& body)
      : expected_(body.pose.orientation), last_(body.angular_velocity) {}
  Real after(const BodyState& body, Real duration) {
    expected_ = rotation((last_ + body.angular_velocity) / 2, duration) * expected_;
    last_ = body.angular_velocity;
    return expected_.angularDistance(body.pose.orientation);
  }

 private:
  Quat expected_;
  Vec3 last_;
};

// The pins move with the ball's surface. If they stayed behind, their torque would spin the ball up.
TEST(ClothPins, ABallOnAStripGainsNoEnergyAndTurnsByItsAngularVelocity) {
  for (const Real step : {1.0 / 240, 1.0 / 60}) {
    World world({.max_step = step});
    const BodyHandle ball = world.add_body({.shape = Sphere{0.05}, .pose = {{0, 0, 0.55}}, .mass = 1});
    ClothDef def = effects::grid_cloth({0.1, 1, 2, 10}, {}, cotton());
    for (uint32_t i = 0; i < def.vertices.size(); ++i) {
      if (def.vertices[i].z() < -0.499) def.pins.push_back({.vertex = i, .position = def.vertices[i]});
      if (def.vertices[i].z() > 0.499)
        def.pins.push_back({.vertex = i, .body = ball, .position = def.vertices[i] - Vec3(0, 0, 0.55)});
    }
    world.add_cloth(def);
    const Real first = world.energy().total();
    TurnError error(world.body(ball));
    for (int i = 0; i < 2 / step; ++i) {
      world.step(step);
      ASSERT_LT(world.energy().total(), first + 1e-3 * 9.81) << step << " " << world.time();
      ASSERT_LT(error.after(world.body(ball), step), 0.2) << step << " " << world.time();
    }
  }
}

TEST(ClothTrampoline, ABallThatSpinsOnItTurns) {
  World world({.max_step = 1.0 / 240});
  constexpr uint32_t kCells = 12;
  ClothDef def = effects::grid_cloth({1, 1, kCells, kCells}, {}, cotton());
  for (uint32_t i = 0; i <= kCells; ++i)
    for (uint32_t k : {i, kCells * (kCells + 1) + i, (kCells + 1) * i, (kCells + 1) * i + kCells})
      def.pins.push_back({.vertex = k, .position = def.vertices[k]});
  world.add_cloth(def);
  const BodyHandle ball = world.add_body(
      {.shape = Sphere{0.1}, .pose = {{0, 0.11, 0}}, .angular_velocity = {0, 6, 0}, .mass = 1});
  TurnError error(world.body(ball));
  for (int i = 0; i < 240; ++i) {
    world.step(1.0 / 240);
    ASSERT_LT(error.after(world.body(ball), 1.0 / 240), 0.05) << world.time();
  }
}

// The points that a hand holds share its spring: it carries the whole sheet by a corner, k d = m g. A stiff
// spring at a light point is stable.
TEST(ClothGrab, CarriesASheetByItsCorner) {
  for (const Real stiffness : {100.0, 1e5}) {
    World world({.max_step = 1.0 / 60});
    ClothDef def = effects::grid_cloth({0.5, 0.5, 5, 5}, {}, cotton());
    def.air.density = 0.5;
    const ClothHandle cloth = world.add_cloth(def);
    world.add_force({.name = "hand",
                     .cloths = {cloth},
                     .effect = Grab{.track = {.keys = {{0, {def.vertices[0]}}}},
                                    .stiffness = stiffness,
                                    .damping = 5,
                                    .reach = 0.09}});
    for (int i = 0; i < 600; ++i) world.step(1.0 / 60);
    Real mass = 0;
    for (Real m : def.masses) mass += m;
    const Real sag = mass * kClothGravity / stiffness;
    EXPECT_NEAR(def.vertices[0].y() - world.cloth(cloth).points[0].y(), sag, 0.03 * sag + 2e-4) << stiffness;
  }
}

// A flat sheet that lands on a floor has no motion left along the floor, except for rounding.
TEST(ClothOnFloor, AFlatSheetComesToRestWithEachIntegrator) {
  for (const ClothIntegrator integrator : {ClothIntegrator::relaxed, ClothIntegrator::implicit})
    for (const uint32_t cells : {4u, 6u, 10u}) {
      World world;
      world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
      ClothDef def = effects::grid_cloth({0.6, 0.6, cells, cells}, {Vec3(0, 0.1, 0)}, cotton());
      def.integrator = integrator;
      const ClothHandle cloth = world.add_cloth(def);
      for (int i = 0; i < 60; ++i) ASSERT_TRUE(world.step(1.0 / 60).finite) << cells;
      for (const Vec3& p : world.cloth(cloth).points) EXPECT_NEAR(p.y(), def.thickness, 1e-4);
      for (const Vec3& v : world.cloth(cloth).velocities) EXPECT_LT(v.norm(), 1e-3);
    }
}

}  // namespace
}  // namespace offstage::sim
