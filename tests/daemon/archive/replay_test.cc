// Differences between two results, by name and size.

#include <gtest/gtest.h>

#include "daemon/archive/archive.h"

namespace cellcal::daemon {
namespace {

constexpr const char* kRecorded =
    R"({"inputs":{"software":"1.0"},"a":[1.0,2.5,{"b":-0.0}],"verdict":{"publish":true}})";

Replay with(const std::string& what, const std::string& by) {
  std::string replayed = kRecorded;
  replayed.replace(replayed.find(what), what.size(), by);
  return compare(kRecorded, replayed);
}

TEST(TwoResults, ThatAreTheSameToTheBitSaySo) {
  const Replay replay = compare(kRecorded, kRecorded);
  EXPECT_TRUE(replay.same());
  EXPECT_EQ(replay.values, 4u);
  EXPECT_NE(in_words(replay).find("4 values: same to the bit\nrecorded and replayed by 1.0"),
            std::string::npos);
}

TEST(TwoResults, OfTwoVersionsThatAreTheSameAreTheSameAndNameBoth) {
  const Replay replay = with("\"1.0\"", "\"1.1\"");
  EXPECT_TRUE(replay.same());
  EXPECT_NE(in_words(replay).find("recorded by 1.0, replayed by 1.1"), std::string::npos);
}

TEST(TwoResults, ThatDifferNameTheFirstNumberAndByHowMuch) {
  const Replay replay = with("2.5", "2.5000000000000004");
  EXPECT_EQ(replay.differing, 1u);
  ASSERT_TRUE(replay.first);
  EXPECT_EQ(replay.first->where, "/a/1");
  EXPECT_EQ(replay.first->recorded, "2.5");
  EXPECT_EQ(replay.first->replayed, "2.5000000000000004");
  ASSERT_TRUE(replay.first->by);
  EXPECT_EQ(*replay.first->by, 4.440892098500626e-16);
  EXPECT_NE(in_words(replay).find("(difference 4.44e-16)"), std::string::npos);
}

TEST(TwoResults, DifferInASignOfNoughtATypeAndInWhatOnlyOneHas) {
  EXPECT_FALSE(with("-0.0", "0.0").same());
  EXPECT_FALSE(with("1.0,", "1,").same());
  EXPECT_FALSE(with("true", "false").same());
  const Replay more = with("2.5", "2.5,7");
  EXPECT_EQ(more.differing, 2u);  // the former third value, and the fourth
  const Replay gone = with("\"a\":[1.0,2.5,{\"b\":-0.0}],", "");
  ASSERT_TRUE(gone.first);
  EXPECT_EQ(gone.first->where, "/a");
  EXPECT_EQ(gone.first->replayed, "");
}

}  // namespace
}  // namespace cellcal::daemon
