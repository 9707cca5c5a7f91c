#include "engine/frame_store.h"

#include <gtest/gtest.h>

namespace offstage::engine {
namespace {

StoredFrame frame_of(std::size_t bytes) {
  return {Detail::draft, 1, std::make_shared<const std::string>(bytes, 'x'), {}};
}

TEST(FrameStore, StaysWithinItsLimitAndKeepsTheShownFilm) {
  FrameStore store(1000);
  store.protect({"shown"});
  for (int i = 1; i <= 5; ++i) store.put("shown", i, frame_of(100));
  for (int i = 1; i <= 50; ++i) store.put("other" + std::to_string(i), 1, frame_of(100));
  EXPECT_LE(store.bytes(), 1000u);
  EXPECT_EQ(store.ranges("shown"), (std::vector<std::pair<int, int>>{{1, 5}}));
  EXPECT_TRUE(store.get("other50", 1));
  EXPECT_FALSE(store.get("other1", 1));
}

TEST(FrameStore, ReturnsTheFinestPictureUpToTheRequestedDetail) {
  FrameStore store(1000);
  store.put("film", 1, frame_of(10));
  StoredFrame fine = frame_of(20);
  fine.detail = Detail::final;
  store.put("film", 1, fine);
  EXPECT_EQ(store.get("film", 1)->jpeg->size(), 20u);
  EXPECT_EQ(store.get("film", 1, Detail::preview)->jpeg->size(), 10u);
}

}  // namespace
}  // namespace offstage::engine
