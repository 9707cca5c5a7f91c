// The pipeline between the threads of a render: order, limits, and that a failure of any stage ends all
// threads.

#include "producer/run/pipeline.h"

#include <algorithm>
#include <atomic>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace offstage::producer {
namespace {

/// Runs a pipeline of `count` frames with `drawers` threads; each stage can throw at one frame.
struct Relay {
  int count = 200, drawers = 3, window = 4;
  int throw_in_shoot = -1, throw_in_draw = -1, throw_in_print = -1;

  std::vector<int> printed;
  int most_ahead = 0;
  std::string failure;

  void operator()() {
    Pipeline pipeline(window);
    std::atomic<int> pushed = 0, taken = 0;
    {
      std::vector<std::jthread> workers;
      for (int i = 0; i < drawers; ++i)
        workers.emplace_back([&] {
          guarded(pipeline, [&] {
            while (auto frame_job = pipeline.take_job()) {
              if (frame_job->index == throw_in_draw) throw std::runtime_error("draw");
              if (frame_job->index % 7 == 0) std::this_thread::yield();
              pipeline.give_rendered({std::move(*frame_job), {}, 0});
            }
          });
        });
      workers.emplace_back([&] {
        guarded(pipeline, [&] {
          while (auto rendered = pipeline.take_rendered()) {
            if (rendered->frame_job.index == throw_in_print) throw std::runtime_error("print");
            printed.push_back(rendered->frame_job.index);
            ++taken;
          }
        });
      });
      guarded(pipeline, [&] {
        for (int i = 0; i < count; ++i) {
          if (i == throw_in_shoot) throw std::runtime_error("shoot");
          if (!pipeline.push({.index = i, .frame = i + 1})) return;
          most_ahead = std::max(most_ahead, ++pushed - taken);
        }
        pipeline.finish_jobs();
      });
    }
    try {
      pipeline.rethrow_failure();
    } catch (const std::exception& error) {
      failure = error.what();
    }
  }
};

TEST(Pipeline, DeliversEveryFrameInOrderWithinItsWindow) {
  for (const int drawers : {1, 2, 5}) {
    Relay run{.drawers = drawers};
    run();
    ASSERT_EQ(run.printed.size(), 200u);
    for (int i = 0; i < 200; ++i) EXPECT_EQ(run.printed[static_cast<std::size_t>(i)], i);
    EXPECT_LE(run.most_ahead, run.window + 1);
    EXPECT_EQ(run.failure, "");
  }
}

TEST(Pipeline, AFailureOfAnyStageEndsAllAndIsTheOneReported) {
  for (const int at : {0, 1, 57, 199}) {
    Relay shoot{.throw_in_shoot = at}, draw{.throw_in_draw = at}, print{.throw_in_print = at};
    shoot(), draw(), print();
    EXPECT_EQ(shoot.failure, "shoot");
    EXPECT_EQ(draw.failure, "draw");
    EXPECT_EQ(print.failure, "print");
    EXPECT_LE(draw.printed.size(), static_cast<std::size_t>(at)) << "nothing after the missing frame";
  }
}

TEST(Pipeline, EndsWithoutFramesAndWithoutDrawingThreads) {
  Relay empty{.count = 0};
  empty();
  EXPECT_TRUE(empty.printed.empty());

  // If no drawing thread could be started, the waiting threads get the failure.
  Pipeline pipeline(2);
  std::jthread sink([&] { EXPECT_FALSE(pipeline.take_rendered()); });
  std::jthread shooter([&] {
    for (int i = 0; pipeline.push({.index = i, .frame = i + 1}); ++i)
      ASSERT_LT(i, 2) << "the window was ignored";
  });
  pipeline.fail(std::make_exception_ptr(std::runtime_error("no thread")));
  sink.join();
  shooter.join();
  EXPECT_TRUE(pipeline.failed());
}

}  // namespace
}  // namespace offstage::producer
