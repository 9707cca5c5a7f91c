// Films from the store of states have the same states and pictures as films from the simulation.

#include "engine/simulated_film.h"

#include <atomic>

#include <gtest/gtest.h>

#include "producer/format/scene_io.h"
#include "producer/run/production.h"
#include "render/error.h"
#include "tests/render/scratch.h"

namespace offstage::engine {
namespace {

using producer::LoadedScene;
using producer::ModelLibrary;
using producer::RunStats;

constexpr int kFrames = 10;

const LoadedScene& jet() {
  static const LoadedScene loaded = producer::parse_scene(
      R"({"bodies": [{"name": "ball", "position": [0, 2, 0], "shape": {"type": "sphere", "radius": 0.3}}],
    "emitters": [{"rate": 400, "overlap": true}], "render": {"size": [64, 36], "quality": "preview"},
    "output": {"fps": 20, "duration": 0.5}})",
      "jet", "");
  return loaded;
}

std::string last_state() {
  static const std::string hash = producer::simulate_frames(jet(), ModelLibrary(), {}, {}).state_hash;
  return hash;
}

/// A film in a store, and the number of pieces that it has simulated.
struct Film {
  explicit Film(PhysicsStore& store)
      : simulated(jet().scene, models, store, "jet", kFrames),
        advances_before(simulated.advances_to(kFrames)) {}
  /// Requests the states of all frames in order, and returns the state hash of the last frame.
  std::string state_hash() {
    for (int frame = 1; frame < kFrames; ++frame) EXPECT_TRUE(simulated.at(frame, count));
    return simulated.at(kFrames, count)->state_hash.hex();
  }
  const ModelLibrary models;
  SimulatedFilm simulated;
  int advances_before = 0, advances = 0;
  const std::function<bool()> count = [this] { return ++advances > 0; };
};

TEST(SimulatedFilms, AreSimulatedOnce) {
  PhysicsStore store(kPhysicsBytes);
  Film first(store);
  EXPECT_EQ(first.state_hash(), last_state());
  EXPECT_EQ(first.advances, first.advances_before);
  Film second(store);
  EXPECT_EQ(second.advances_before, 0);
  EXPECT_EQ(second.state_hash(), last_state());
  EXPECT_EQ(second.advances, 0);
}

TEST(SimulatedFilms, AreSimulatedAgainIfTheStoreHasNoRoom) {
  PhysicsStore all(kPhysicsBytes);
  EXPECT_EQ(Film(all).state_hash(), last_state());
  for (const std::size_t room : {std::size_t{0}, all.bytes() / 3}) {
    PhysicsStore store(room);
    EXPECT_EQ(Film(store).state_hash(), last_state());
    Film second(store);
    EXPECT_EQ(second.advances_before, kFrames);
    EXPECT_EQ(second.state_hash(), last_state());
    EXPECT_EQ(second.advances, kFrames);
    EXPECT_LE(store.bytes(), room);
  }
}

TEST(SimulatedFilms, ContinueAfterAStoppedOne) {
  PhysicsStore store(kPhysicsBytes);
  Film stopped(store);
  int advances = 0;
  EXPECT_FALSE(stopped.simulated.at(kFrames, [&] { return ++advances < 4; }));
  EXPECT_EQ(stopped.simulated.simulated_to(), 4);
  Film next(store);
  EXPECT_TRUE(next.simulated.has_state(4));
  EXPECT_EQ(next.state_hash(), last_state());
}

TEST(SimulatedFilms, ShareTheMeshesOfModelsWithLaterVersions) {
  const render::ScratchFolder folder;
  folder.put("wedge.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const auto scene = [&](double height, double scale) {
    const std::string text = R"({"bodies": [{"name": "wedge", "position": [0, )" + std::to_string(height) +
                             R"(, 0], "shape": {"type": "mesh", "file": "wedge.obj", "scale": )" +
                             std::to_string(scale) +
                             R"(}}, {"name": "floor", "motion": "static", "shape": {"type": "plane"}}],
      "output": {"fps": 20, "duration": 0.5}})";
    return producer::parse_scene(text, "wedge", folder.path());
  };
  PhysicsStore store(kPhysicsBytes);
  const auto simulate = [&](const LoadedScene& loaded) {
    std::vector<Problem> warnings;
    const ModelLibrary models(loaded.scene, loaded.folder, {}, warnings);
    SimulatedFilm film(loaded.scene, models, store, loaded.canonical, kFrames);
    const std::string hash = film.at(kFrames, [] { return true; })->state_hash.hex();
    EXPECT_EQ(hash, producer::simulate_frames(loaded, models, {}, {}).state_hash);
    EXPECT_EQ(store.meshes().size(), 1u);
    return store.meshes().begin()->second;
  };
  const auto first = simulate(scene(0.5, 1));
  EXPECT_EQ(simulate(scene(0.7, 1)), first);
  EXPECT_NE(simulate(scene(0.7, 0.9)), first);
}

/// Hashes of the pictures of a film.
class Pictures : public render::FrameSink {
 public:
  void write(int, const render::Image& image) override { hashes.push_back(render::pixel_hash(image)); }
  void close() override { closed = true; }
  std::vector<std::string> hashes;
  bool closed = false;
};

producer::RenderJob job_of(producer::StateSource* states) {
  producer::RenderJob job{.cache = {}, .states = states};
  for (int frame = 1; frame <= kFrames; ++frame) job.frames.push_back(frame);
  return job;
}

TEST(EnginesSimulatedFilms, AreDrawnAsTheSimulationIs) {
  const ModelLibrary models;
  Pictures expected;
  const RunStats stats = producer::render_frames(jet(), models, job_of(nullptr), expected, {});
  ASSERT_EQ(expected.hashes.size(), std::size_t{kFrames});
  for (const std::size_t room : {kPhysicsBytes, std::size_t{10'000}}) {
    PhysicsStore store(room);
    for (int run = 0; run < 2; ++run) {
      SimulatedFilm film(jet().scene, models, store, "jet", kFrames);
      Pictures pictures;
      const RunStats again = producer::render_frames(jet(), models, job_of(&film), pictures, {});
      EXPECT_EQ(pictures.hashes, expected.hashes) << room << " bytes, run " << run;
      EXPECT_EQ(again.bodies, stats.bodies);
      EXPECT_EQ(again.totals.most_contacts, stats.totals.most_contacts);
      EXPECT_EQ(again.energy_end->kinetic, stats.energy_end->kinetic);
    }
  }
}

TEST(EnginesSimulatedFilms, EndWithoutOutputOnRequest) {
  const ModelLibrary models;
  PhysicsStore store(kPhysicsBytes);
  SimulatedFilm film(jet().scene, models, store, "jet", kFrames);
  Pictures pictures;
  producer::RenderJob job = job_of(&film);
  std::atomic<int> asked = 0;
  job.stop = [&] { return ++asked > 3; };
  EXPECT_THROW(producer::render_frames(jet(), models, job, pictures, {}), render::StoppedError);
  EXPECT_LT(film.simulated_to(), kFrames);
  EXPECT_FALSE(pictures.closed);
}

}  // namespace
}  // namespace offstage::engine
