#include "producer/run/frame_list.h"

#include <stdexcept>

#include <gtest/gtest.h>

namespace offstage::producer {
namespace {

using Frames = std::vector<int>;

TEST(FrameList, RangesStepsAndNumbersFromTheEnd) {
  EXPECT_EQ(parse_frames("", 3), (Frames{1, 2, 3}));
  EXPECT_EQ(parse_frames("1-3,7", 10), (Frames{1, 2, 3, 7}));
  EXPECT_EQ(parse_frames("2-9x3", 10), (Frames{2, 5, 8}));
  EXPECT_EQ(parse_frames("-1", 10), (Frames{10}));
  EXPECT_EQ(parse_frames("-3--1", 10), (Frames{8, 9, 10}));
  EXPECT_EQ(parse_frames("5,1-2,2", 10), (Frames{1, 2, 5}));
}

TEST(FrameList, RefusalsNameTheAllowedText) {
  for (const char* text :
       {"a", "1-", "1..5", "3-1", "0", "11", "1-11", "1-4x0", "1,,2", "-11", "1 2", "99999999999"})
    EXPECT_THROW(parse_frames(text, 10), std::invalid_argument) << text;
}

TEST(FrameList, ChunksCoverEveryFrameOnce) {
  const Frames all = parse_frames("1-50x3,7", 100);
  for (int n = 1; n <= 20; ++n) {
    Frames joined;
    for (int i = 1; i <= n; ++i) {
      const Frames part = chunk_of(all, std::to_string(i) + "/" + std::to_string(n));
      EXPECT_LE(part.size(), all.size() / static_cast<std::size_t>(n) + 1);
      joined.insert(joined.end(), part.begin(), part.end());
    }
    EXPECT_EQ(joined, all);
  }
  for (const char* text : {"0/2", "3/2", "1", "1/0", "a/b", "1/2x"})
    EXPECT_THROW(chunk_of(all, text), std::invalid_argument);
}

}  // namespace
}  // namespace offstage::producer
