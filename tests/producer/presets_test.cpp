#include "producer/format/presets.h"

#include <gtest/gtest.h>

#include "producer/build/simulation.h"
#include "producer/format/scene_io.h"

namespace offstage::producer {
namespace {

LoadedScene load(const std::string& text, const std::vector<std::string>& overrides = {}) {
  return parse_scene(text, "s", OFFSTAGE_SOURCE_DIR, overrides);
}
std::string preset_errors(const std::string& text) {
  std::string all;
  try {
    load(text);
  } catch (const SceneError& error) {
    for (const Problem& problem : error.problems()) all += problem.where.path + ": " + problem.what + "\n";
  }
  return all;
}

TEST(Presets, EachIsAValidEffectThatReleasesParticles) {
  const std::vector<std::string> names = preset_names();
  EXPECT_GE(names.size(), 14u);
  for (const std::string& name : names) {
    SCOPED_TRACE(name);
    EXPECT_FALSE(preset_description(name).empty());
    const LoadedScene loaded = load(R"({"output": {"fps": 10, "duration": 1},
      "bodies": [{"motion": "static", "shape": {"type": "plane"}}], "effects": [{"preset": ")" +
                                    name + R"("}]})");
    for (const Problem& warning : loaded.warnings) ADD_FAILURE() << warning.describe();
    const ModelLibrary models;
    Simulation simulation(loaded.scene, models);
    while (simulation.frame() < 10 && simulation.snapshot().point_count() == 0) simulation.advance();
    EXPECT_GT(simulation.snapshot().point_count(), 0u);
  }
}

TEST(Presets, AnEmitterTakesAllKeysThatItDoesNotGive) {
  const Scene plain = load(R"({"emitters": [{"preset": "smoke"}]})").scene,
              own =
                  load(R"({"emitters": [{"preset": "smoke/smoke", "rate": 5, "look": {"ramp": "linear"}}]})")
                      .scene;
  EXPECT_EQ(std::get<Real>(own.emitters[0].rate), 5);
  EXPECT_NE(std::get<Real>(plain.emitters[0].rate), 5);
  EXPECT_EQ(own.emitters[0].look.ramp, effects::RampKind::linear);
  EXPECT_EQ(own.emitters[0].look.style, LookStyle::smoke);
  EXPECT_EQ(own.emitters[0].behaviour.force, plain.emitters[0].behaviour.force);
}

TEST(Presets, AnEffectIsPlacedNamedAndDelayedAsAWhole) {
  const Scene here = load(R"({"effects": [{"preset": "fire"}]})").scene;
  const Scene there =
      load(R"({"effects": [{"preset": "fire", "name": "camp", "position": [1, 2, 3], "start": 4,
      "overrides": {"smoke": {"rate": 7}, "draught": {"speed": 0}}}]})",
           {"effects.0.overrides.flames.speed=9"})
          .scene;
  ASSERT_EQ(here.emitters.size(), there.emitters.size());
  for (std::size_t i = 0; i < here.emitters.size(); ++i) {
    const Emitter &a = here.emitters[i], &b = there.emitters[i];
    EXPECT_EQ(position_of(b.surface) - position_of(a.surface), Vec3(1, 2, 3));
    EXPECT_EQ(b.name, "camp" + a.name.substr(4));
    EXPECT_EQ(b.start, 4);
    EXPECT_EQ(effects::mean(b.rate, 0) == 7, b.name == "camp/smoke");
    EXPECT_EQ(effects::mean(b.speed, 0) == 9, b.name == "camp/flames");
  }
  const auto& draught = std::get<TurbulenceField>(there.forces.at(0));
  EXPECT_EQ(draught.particles.at(0), "camp/flames");
  EXPECT_EQ(draught.speed, 0);
}

TEST(Presets, UnknownPresetsAreReportedWithTheKnownOnes) {
  const std::string text = preset_errors(R"({"emitters": [{"preset": "smoek"}, {"preset": "fire/smok"}],
    "effects": [{"preset": "fire", "overrides": {"flame": {}}}, {"preset": "rain", "overrides": {"rain": {"rat": 1}}}]})");
  EXPECT_NE(text.find("/emitters/0/preset: there is no preset 'smoek'; did you mean 'smoke'?"),
            std::string::npos);
  EXPECT_NE(text.find("/emitters/1/preset: the preset 'fire' has no emitter 'smok'; did you mean 'smoke'?"),
            std::string::npos);
  EXPECT_NE(
      text.find("/effects/0/overrides/flame: the preset 'fire' has no such emitter or force; did you mean "
                "'flames'?"),
      std::string::npos);
  EXPECT_NE(text.find("/rat: unknown key in emitter; did you mean 'rate'?"), std::string::npos) << text;
}

TEST(Presets, ACanonicalSceneNeedsNoPresets) {
  const LoadedScene loaded =
      load(R"({"effects": [{"preset": "fireworks"}], "emitters": [{"preset": "rain"}]})");
  EXPECT_EQ(load(loaded.canonical).canonical, loaded.canonical);
  EXPECT_TRUE(loaded.scene.effects.empty());
}

TEST(Effects, ParticleEventsCreateOtherParticles) {
  const LoadedScene loaded = load(R"({"output": {"fps": 20, "duration": 2},
    "bodies": [{"motion": "static", "shape": {"type": "plane"}}],
    "emitters": [{"name": "ball", "surface": {"position": [0, 1.5, 0]}, "rate": 0, "bursts": [{"count": 4}], "speed": 0,
                  "lifespan": 1,
                  "trails": [{"name": "tail", "rate": 20}],
                  "on_age": [{"name": "half", "age": 0.1, "count": 2, "lifespan": 9}],
                  "on_collision": [{"name": "splash", "count": 3, "lifespan": 9, "collides": false}],
                  "on_death": [{"name": "end", "count": 5, "lifespan": 9}]}]})");
  const ModelLibrary models;
  Simulation simulation(loaded.scene, models);
  const auto counts = [&] {
    std::vector<std::size_t> all;
    for (const PointSet& set : simulation.snapshot().point_sets) all.push_back(set.points.size());
    return all;
  };
  while (simulation.frame() < 9) simulation.advance();  // 0.4 s: all particles are in flight
  EXPECT_EQ(counts(), (std::vector<std::size_t>{4, 32, 8, 0, 0}));
  // 0.6 s: all particles hit the ground once, at 0.55 s.
  while (simulation.frame() < 13) simulation.advance();
  EXPECT_EQ(counts(), (std::vector<std::size_t>{4, 48, 8, 12, 0}));
  while (simulation.frame() < 23) simulation.advance();  // 1.1 s: all particles have died
  const std::vector<std::size_t> end = counts();
  EXPECT_EQ(end[0], 0u);
  EXPECT_EQ(end[4], 20u);
}

}  // namespace
}  // namespace offstage::producer
