#include "engine/engine.h"

#include <condition_variable>
#include <mutex>
#include <thread>

#include <gtest/gtest.h>

#include "producer/format/scene_io.h"
#include "producer/run/production.h"
#include "tests/render/gltf_samples.h"
#include "tests/render/scratch.h"

namespace offstage::engine {
namespace {

using producer::LoadedScene;

/// Returns a scene with a few particles and a falling ball; different rates make different versions of it.
Engine::Loaded fountain(int rate, double duration = 0.5) {
  const std::string text =
      R"({"bodies": [{"name": "ball", "position": [0, 2, 0], "shape": {"type": "sphere", "radius": 0.3}}],
    "emitters": [{"rate": )" +
      std::to_string(rate) + R"(, "overlap": true}], "render": {"size": [160, 90]},
    "output": {"fps": 20, "duration": )" +
      std::to_string(duration) + "}}";
  return std::make_shared<const LoadedScene>(producer::parse_scene(text, "fountain", ""));
}

/// Collects the events of an engine, so that a test can wait for them.
class Events {
 public:
  void operator()(const EngineEvent& event) {
    const std::lock_guard lock(mutex_);
    events_.push_back(event);
    changed_.notify_all();
  }
  /// Waits for an event of a type that satisfies the condition; false after a minute.
  template <class Event, class Condition>
  bool wait_for(Condition&& condition) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::minutes(1), [&] {
      return std::ranges::any_of(events_, [&](const EngineEvent& event) {
        const Event* e = std::get_if<Event>(&event);
        return e && condition(*e);
      });
    });
  }
  bool wait_until_complete(uint64_t run) {
    return wait_for<FilmEvent>(
        [&](const FilmEvent& e) { return e.run == run && e.phase == FilmEvent::Phase::complete; });
  }
  std::vector<EngineEvent> all() {
    const std::lock_guard lock(mutex_);
    return events_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<EngineEvent> events_;
};

EngineSettings small_settings() {
  EngineSettings settings;
  settings.draft_px = {160, 90};
  return settings;
}

class Engines : public testing::Test {
 protected:
  Events events_;
  Engine engine_{small_settings(), std::ref(events_)};
};

TEST_F(Engines, EndWithTheStateThatASimulationHas) {
  const Engine::Loaded scene = fountain(200);
  const Engine::Run run = engine_.show(scene, {});
  ASSERT_TRUE(events_.wait_until_complete(run.number));
  const producer::RunStats stats = producer::simulate_frames(*scene, producer::ModelLibrary(), {}, {});
  EXPECT_EQ(engine_.figures().back().state_hash, stats.state_hash);
  EXPECT_EQ(engine_.ranges(run.film), (std::vector<std::pair<int, int>>{{1, 10}}));
}

TEST_F(Engines, EndAnOldRunWithinOneFrame) {
  const Engine::Run slow = engine_.show(fountain(2000, 30), {});
  ASSERT_TRUE(events_.wait_for<FrameEvent>([&](const FrameEvent& e) { return e.run == slow.number; }));
  const Engine::Run next = engine_.show(fountain(100), {});
  const std::size_t before = events_.all().size();
  ASSERT_TRUE(events_.wait_until_complete(next.number));
  std::size_t late = 0;
  const std::vector<EngineEvent> all = events_.all();
  for (std::size_t i = before; i < all.size(); ++i)
    if (const auto* frame = std::get_if<FrameEvent>(&all[i])) late += frame->run == slow.number;
  EXPECT_LE(late, 1u);
}

TEST_F(Engines, KeepNoPictureOfAnEndedDraft) {
  render::Context context;
  PhysicsStore physics(1 << 20);
  FrameStore frames(1 << 20);
  JpegWriter jpeg;
  FilmRun run({fountain(100), {}, "film", "physics"}, std::make_shared<const producer::ModelLibrary>(),
              {physics, frames, context, jpeg, {160, 90}});
  while (!run.has_state(1)) run.simulated().simulate();
  EXPECT_FALSE(run.draw_draft(1, [] { return true; }));
  EXPECT_FALSE(run.has_draft(1));
  EXPECT_TRUE(run.draw_draft(1, {}));
  EXPECT_TRUE(run.has_draft(1));
}

TEST_F(Engines, StartNoWorkWhileAChangeIsPending) {
  const Engine::Run run = engine_.show(fountain(100, 60), {});
  ASSERT_TRUE(events_.wait_for<FrameEvent>([&](const FrameEvent& e) { return e.run == run.number; }));
  std::size_t before = 0;
  {
    const Engine::Hold hold(engine_);
    bool still = false;  // the current work has ended before all 1200 frames
    for (int i = 0; i < 10 && !still; ++i) {
      before = events_.all().size();
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
      still = events_.all().size() == before;
    }
    EXPECT_TRUE(still);
  }
  const auto frame_after = [&] { return events_.all().size() > before; };
  for (int i = 0; i < 600 && !frame_after(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_TRUE(frame_after());
}

TEST_F(Engines, KeepTheFramesOfEarlierVersions) {
  const Engine::Run first = engine_.show(fountain(100), {});
  ASSERT_TRUE(events_.wait_until_complete(first.number));
  const std::shared_ptr<const std::string> frame = engine_.frame(first.film, 10, Detail::draft)->jpeg;
  ASSERT_TRUE(events_.wait_until_complete(engine_.show(fountain(300), {}).number));
  const Engine::Run again = engine_.show(fountain(100), {});
  EXPECT_EQ(again.film, first.film);
  EXPECT_EQ(engine_.frame(again.film, 10, Detail::draft)->jpeg, frame);
}

TEST_F(Engines, ReuseStatesForAnotherCamera) {
  const Engine::Loaded scene = fountain(100);
  ASSERT_TRUE(events_.wait_until_complete(engine_.show(scene, {}).number));
  const std::string state = engine_.figures().back().state_hash;
  const Engine::Run other = engine_.show(scene, ViewCamera{{0, 1, 3}, {0, 1, 0}});
  ASSERT_TRUE(events_.wait_until_complete(other.number));
  EXPECT_EQ(engine_.figures().back().state_hash, state);
  EXPECT_TRUE(engine_.frame(other.film, 10));
}

// Models, pictures and decompositions stay in memory while only numbers and colours change.
TEST_F(Engines, ReadFilesAgainWhenTheSceneUsesThemOtherwise) {
  render::GltfSample room;
  const render::ScratchFolder folder;
  folder.put("room.gltf", room.text());
  folder.put("broken.hdr", "not a picture");
  const auto show = [&](const std::string& more) {
    const std::string text =
        R"({"bodies": [{"name": "room", "motion": "static", "shape": {"type": "mesh", "file": "room.gltf"}}],
            "render": {"size": [64, 36]}, "output": {"fps": 20, "duration": 0.1})" +
        more + "}";
    return engine_
        .show(std::make_shared<const LoadedScene>(producer::parse_scene(text, "room", folder.path())), {})
        .number;
  };
  const auto fails = [&](uint64_t run) {
    bool failed = false;
    events_.wait_for<FilmEvent>([&](const FilmEvent& e) {
      failed = e.phase == FilmEvent::Phase::failed;
      return e.run == run && (failed || e.phase == FilmEvent::Phase::complete);
    });
    return failed;
  };
  EXPECT_FALSE(fails(show("")));
  EXPECT_TRUE(fails(show(R"(, "environment": {"picture": {"file": "broken.hdr"}})")));
  EXPECT_FALSE(fails(show("")));
  EXPECT_TRUE(fails(show(R"(, "camera": {"type": "model", "body": "room", "name": "missing"})")));
}

// While the user moves the view, the scene's camera keeps its field of view, which several keys can state.
TEST_F(Engines, KeepTheFieldOfViewOfAMovedCamera) {
  render::GltfSample room;
  room.document["nodes"].push_back({{"camera", 0}, {"translation", {0, 0, 5}}});
  room.document["scenes"][0]["nodes"] = {0, 1};
  room.document["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1}}}}};
  const render::ScratchFolder folder;
  folder.put("room.gltf", room.text());
  const auto fov_of = [&](const std::string& camera, const std::optional<ViewCamera>& moved) {
    const std::string text =
        R"({"bodies": [{"name": "room", "motion": "static", "collides": false,
                        "shape": {"type": "mesh", "file": "room.gltf"}}],
            "render": {"size": [64, 36]}, "output": {"fps": 20, "duration": 0.1}, "camera": )" +
        camera + "}";
    const auto scene =
        std::make_shared<const LoadedScene>(producer::parse_scene(text, "room", folder.path()));
    const Engine::Run run = engine_.show(scene, moved);
    float fov = 0;
    events_.wait_for<FrameEvent>([&](const FrameEvent& e) {
      if (e.run == run.number) fov = e.camera.fov_deg;
      return e.run == run.number;
    });
    return fov;
  };
  const ViewCamera moved{{0, 1, 4}, {0, 0, 0}};
  const std::string of_model = R"({"type": "model", "body": "room")";
  EXPECT_NEAR(fov_of(of_model + "}", {}), 57.29578f, 1e-4f);
  EXPECT_NEAR(fov_of(of_model + "}", moved), 57.29578f, 1e-4f);
  const float by_length = fov_of(of_model + R"(, "focal_mm": 50})", {});
  EXPECT_LT(by_length, 30);
  EXPECT_EQ(fov_of(of_model + R"(, "focal_mm": 50})", moved), by_length);
  const std::string keyed = R"({"type": "keyframes", "keyframes": [
      {"time": 0, "eye": [0, 0, 5], "target": [0, 0, 0], "fov_deg": 25},
      {"time": 1, "eye": [1, 0, 5], "target": [0, 0, 0], "fov_deg": 25}]})";
  EXPECT_NEAR(fov_of(keyed, moved), 25, 1e-4f);
}

TEST_F(Engines, NameTheObjectUnderThePointer) {
  const Engine::Run run = engine_.show(fountain(1), ViewCamera{{0, 2, 3}, {0, 2, 0}});
  ASSERT_TRUE(events_.wait_until_complete(run.number));
  EXPECT_EQ(engine_.pick(1, 0.5, 0.5).get(), "ball");
  EXPECT_EQ(engine_.pick(1, 0.02, 0.02).get(), "");
}

TEST_F(Engines, DrawASheetOfVersionsAndReportMissingOnes) {
  const auto sheet = engine_.sweep({fountain(50), nullptr}, 3);
  ASSERT_TRUE(events_.wait_for<CellEvent>(
      [&](const CellEvent& e) { return e.sweep == sheet && e.index == 0 && e.fault.empty(); }));
  ASSERT_TRUE(
      events_.wait_for<CellEvent>([&](const CellEvent& e) { return e.index == 1 && !e.fault.empty(); }));
  EXPECT_TRUE(engine_.cell(sheet, 0));
}

}  // namespace
}  // namespace offstage::engine
