#include "tune/tabs.h"

#include <gtest/gtest.h>

#include "tune/frame_store.h"

namespace offstage::tune {
namespace {

using std::chrono::milliseconds;

TEST(Tabs, ASlowTabGetsTheLatestMessageOfEachKind) {
  Tabs tabs;
  const auto ticket = tabs.open("a");
  tabs.wait("a", *ticket, milliseconds(0));  // consumes the message that names the writer
  for (int i = 0; i < 1000; ++i) tabs.post("frame", std::to_string(i));
  tabs.post("film", "f");
  EXPECT_EQ(tabs.wait("a", *ticket, milliseconds(0)).message->json, "999");
  EXPECT_EQ(tabs.wait("a", *ticket, milliseconds(0)).message->json, "f");
  EXPECT_FALSE(tabs.wait("a", *ticket, milliseconds(0)).message);
}

TEST(Tabs, ThereIsRoomForEightAndTheFirstWrites) {
  Tabs tabs;
  for (std::size_t i = 0; i < kMostTabs; ++i) EXPECT_TRUE(tabs.open(std::to_string(i)));
  EXPECT_FALSE(tabs.open("ninth"));
  EXPECT_EQ(tabs.writer(), "0");
  const auto again = tabs.open("0");  // the same tab, opened once more
  EXPECT_TRUE(again);
  tabs.close("0", *again);
  EXPECT_EQ(tabs.writer(), "1");
  EXPECT_TRUE(tabs.open("ninth"));
}

TEST(Tabs, ANewStreamOfATabEndsTheOldOne) {
  Tabs tabs;
  const auto old = tabs.open("a");
  const auto fresh = tabs.open("a");
  EXPECT_TRUE(tabs.wait("a", *old, milliseconds(0)).over);
  tabs.close("a", *old);  // a late close of the old stream has no effect
  EXPECT_FALSE(tabs.wait("a", *fresh, milliseconds(0)).over);
  tabs.close_all();
  EXPECT_TRUE(tabs.wait("a", *fresh, milliseconds(0)).over);
}

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
}  // namespace offstage::tune
