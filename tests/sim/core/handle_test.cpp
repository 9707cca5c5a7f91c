#include "sim/core/handle.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace offstage::sim {
namespace {

using Map = SlotMap<std::string, struct NameTag>;

TEST(SlotMap, FindsItsElementsAndNothingElse) {
  Map map;
  const auto a = map.insert("a"), b = map.insert("b");
  EXPECT_EQ(map[a], "a");
  EXPECT_EQ(map[b], "b");
  EXPECT_EQ(map.find({}), nullptr) << "null";
  EXPECT_EQ(map.find({7, 1}), nullptr) << "never made";
  EXPECT_EQ(map.size(), 2u);
}

TEST(SlotMap, AStaleHandleNeverReachesTheNextTenantOfItsSlot) {
  Map map;
  auto old = map.insert("first");
  for (int i = 0; i < 100; ++i) {
    EXPECT_TRUE(map.erase(old));
    EXPECT_FALSE(map.erase(old)) << "twice";
    const auto next = map.insert("next");
    EXPECT_EQ(next.index, old.index) << "the slot is used again";
    EXPECT_EQ(map.find(old), nullptr);
    EXPECT_EQ(*map.find(next), "next");
    old = next;
  }
  EXPECT_EQ(map.size(), 1u);
}

TEST(SlotMap, IteratesInSlotOrder) {
  Map map;
  std::vector<Handle<NameTag>> handles;
  for (const char* name : {"a", "b", "c", "d"}) handles.push_back(map.insert(name));
  map.erase(handles[1]);
  map.erase(handles[2]);
  map.insert("e");
  std::string seen;
  map.for_each([&](Handle<NameTag>, const std::string& name) { seen += name; });
  EXPECT_EQ(seen, "aed");
}

}  // namespace
}  // namespace offstage::sim
