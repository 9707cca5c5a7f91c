#include "tune/tabs.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace offstage::tune
