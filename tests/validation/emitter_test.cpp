/// Statistics of emitters, and the ballistics of a sprinkler.

#include "effects/emitter.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace offstage::effects {
namespace {

using namespace sim;

constexpr int kDraws = 100'000;

/// Returns all particles of one release at the time of their creation.
ParticleArrays release(const EmitterDef& def) {
  World world({.gravity = Vec3::Zero()});
  const auto system = world.add_particle_system({});
  Emitter emitter(def, system);
  world.step(1e-6, [&](Real start, Real end) { emitter.emit(world, start, end); });
  return world.particles(system);
}

/// Compares mean and deviation of a sample with those of its distribution, within three standard errors.
/// `kurtosis` is the fourth central moment of the distribution divided by its variance squared.
void expect_statistics(const std::vector<Real>& sample, Real mean, Real deviation, Real kurtosis) {
  const Real n = static_cast<Real>(sample.size());
  Real sum = 0, squares = 0;
  for (Real x : sample) sum += x;
  for (Real x : sample) squares += (x - sum / n) * (x - sum / n);
  EXPECT_NEAR(sum / n, mean, 3 * deviation / std::sqrt(n));
  const Real variance = deviation * deviation;
  EXPECT_NEAR(squares / n, variance, 3 * variance * std::sqrt((kurtosis - 1) / n));
}

// The standard normal distribution truncated at one deviation: variance v = 1 - 2 phi(1) / (2 Phi(1) - 1),
// fourth moment 3 v - 2 phi(1) / (2 Phi(1) - 1).
struct CutNormal {
  Real phi = std::exp(-0.5) / std::sqrt(2 * std::numbers::pi), edge = 2 * phi / std::erf(std::sqrt(0.5));
  Real variance = 1 - edge, kurtosis = (3 * variance - edge) / (variance * variance);
};

TEST(EmitterStatistics, EveryParameterHasItsMeanAndDeviation) {
  const ParticleArrays p =
      release({.name = "all",
               .surface = {.size = {10, 10}},
               .release = {.rate = 0.0, .bursts = {{.count = Real(kDraws)}}},
               .particles = {.speed = Normal{4, 1},
                             .spread_deg = Uniform{0, 60},
                             .radius = Uniform{0.01, 0.015},
                             .mass = Normal{.mean = 0.5, .deviation = 0.05, .min = 1e-3, .clip = false},
                             .lifespan = Normal{5, 2},
                             .restitution = Uniform{0.2, 0.6},
                             .friction = Normal{0.5, 0.2}}});
  ASSERT_EQ(p.size(), std::size_t{kDraws});
  const CutNormal cut;
  const Real cut_deviation = std::sqrt(cut.variance), flat = std::sqrt(1.0 / 12);
  std::vector<Real> speed, spread, east;
  for (const Vec3& v : p.velocity) {
    speed.push_back(v.norm());
    spread.push_back(std::acos(std::min(1.0, v.y() / v.norm())) * 180 / std::numbers::pi);
    const Real across = std::hypot(v.x(), v.z());
    if (across > 0) east.push_back(v.x() / across);
  }
  expect_statistics(speed, 4, cut_deviation, cut.kurtosis);
  expect_statistics(spread, 30, 60 * flat, 1.8);
  expect_statistics(east, 0, std::sqrt(0.5), 1.5);  // the cosine of a uniformly distributed angle
  expect_statistics(p.radius, 0.0125, 0.005 * flat, 1.8);
  expect_statistics(p.mass, 0.5, 0.05, 3);
  expect_statistics(p.lifespan, 5, 2 * cut_deviation, cut.kurtosis);
  expect_statistics(p.restitution, 0.4, 0.4 * flat, 1.8);
  expect_statistics(p.friction, 0.5, 0.2 * cut_deviation, cut.kurtosis);
}

TEST(EmitterStatistics, CountsFollowTheMeanRateAndTheMeanRelease) {
  World world({.gravity = Vec3::Zero(), .max_step = 1});
  const auto single = world.add_particle_system({}), grouped = world.add_particle_system({});
  Emitter random_rate({.name = "rate", .release = {.rate = Uniform{0, 40}}, .particles = {.lifespan = 1e9}},
                      single);
  Emitter random_count({.name = "count",
                        .surface = {.size = {1, 1}},
                        .release = {.rate = 0.0, .count = Uniform{-0.5, 20.5}, .interval = 0.5},
                        .particles = {.lifespan = 1e9}},
                       grouped);
  constexpr int kSeconds = 1000;
  for (int i = 0; i < kSeconds; ++i)
    world.step(1, [&](Real start, Real end) {
      random_rate.emit(world, start, end);
      random_count.emit(world, start, end);
    });
  // 10 windows a second, each with a uniformly distributed rate; 2001 releases of 0 to 20 particles.
  const Real windows = kSeconds * 10, releases = kSeconds * 2 + 1;
  EXPECT_NEAR(Real(random_rate.report().released), 20.0 * kSeconds,
              3 * 40 * 0.1 * std::sqrt(windows / 12) + 1);
  EXPECT_NEAR(Real(random_count.report().released), 10 * releases,
              3 * std::sqrt(releases * (21 * 21 - 1) / 12.0));
}

// Height v^2 cos^2 / 2g, range v^2 sin(2 spread) / g, both from the surface at y = 0.
TEST(Sprinkler, HeightAndReach) {
  World world;
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  const auto water = world.add_particle_system({.dies_on_hit = true, .integrator = IntegratorKind::midpoint});
  Emitter emitter({.surface = {.size = {0.001, 0.001}},
                   .release = {.rate = 200.0, .end = 1},
                   .particles = {.speed = 8.0, .spread_deg = 30.0, .radius = 0.002, .lifespan = 1e9}},
                  water);
  Real height = 0, reach = 0;
  while (world.time() < 3) {
    world.step(1.0 / 240, [&](Real start, Real end) { emitter.emit(world, start, end); });
    for (const Vec3& x : world.particles(water).position) {
      height = std::max(height, x.y());
      reach = std::max(reach, std::hypot(x.x(), x.z()));
    }
  }
  EXPECT_EQ(world.particle_count(), 0u);
  const Real tilt = std::numbers::pi / 6;
  EXPECT_NEAR(height / (std::pow(8 * std::cos(tilt), 2) / (2 * 9.81)), 1, 0.01);
  EXPECT_NEAR(reach / (64 * std::sin(2 * tilt) / 9.81), 1, 0.01);
}

}  // namespace
}  // namespace offstage::effects
