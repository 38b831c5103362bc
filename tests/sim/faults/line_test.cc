// Effects of a line with faults on its messages.

#include "tests/sim/faults/line.h"

#include <gtest/gtest.h>

namespace cellcal::sim {
namespace {

using namespace std::chrono_literals;
using drivers::TimePoint;

constexpr TimePoint kLineStart{std::chrono::hours(1)};

/// Ten messages "0".."9", 4 ms apart; arrivals as "0@1 1@5": text and milliseconds.
std::string over(Line& line) {
  for (int i = 0; i < 10; ++i) line.send(std::to_string(i), kLineStart + i * 4ms);
  std::string result;
  while (const auto message = line.take(TimePoint::max() - 1ns)) {
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(message->t - kLineStart);
    result += (result.empty() ? "" : " ") + message->bytes + '@' + std::to_string(ms.count());
  }
  return result;
}

Line datagrams(Trouble trouble) {
  Line line(LineKind::kDatagrams, 1ms, 1);
  line.add(std::move(trouble));
  return line;
}
Line stream(Trouble trouble) {
  Line line(LineKind::kStream, 1ms, 1);
  line.add(std::move(trouble));
  return line;
}

TEST(FaultyLine, WithoutTroublesTakesItsTransitTime) {
  Line line(LineKind::kDatagrams, 1ms, 1);
  EXPECT_EQ(over(line), "0@1 1@5 2@9 3@13 4@17 5@21 6@25 7@29 8@33 9@37");
  EXPECT_EQ(line.touched(), 0u);
}

TEST(FaultyLine, TouchesOnlyWhatIsSentInTheTroublesTime) {
  Line line = datagrams({LineFaultKind::kDrop, kLineStart + 8ms, kLineStart + 16ms});
  EXPECT_EQ(over(line), "0@1 1@5 4@17 5@21 6@25 7@29 8@33 9@37");
  EXPECT_EQ(line.touched(), 2u);
}

TEST(FaultyLine, TouchesAsManyAsItMay) {
  Line line = datagrams({LineFaultKind::kDrop, kLineStart + 8ms, TimePoint::max(), 1.0, 1});
  EXPECT_EQ(over(line), "0@1 1@5 3@13 4@17 5@21 6@25 7@29 8@33 9@37");
}

TEST(FaultyLine, ThatWasLateDeliversWhatWaitedInABurst) {
  Line line =
      datagrams({LineFaultKind::kDelay, kLineStart + 8ms, kLineStart + 12ms, 1.0, -1, 10ms});
  EXPECT_EQ(over(line), "0@1 1@5 2@19 3@19 4@19 5@21 6@25 7@29 8@33 9@37");
}

TEST(FaultyLine, DoublesAndLetsOvertake) {
  Line twice =
      datagrams({LineFaultKind::kDuplicate, kLineStart + 8ms, kLineStart + 12ms, 1.0, -1, 6ms});
  EXPECT_EQ(over(twice), "0@1 1@5 2@9 3@13 2@15 4@17 5@21 6@25 7@29 8@33 9@37");
  Line overtaken =
      datagrams({LineFaultKind::kReorder, kLineStart + 8ms, kLineStart + 12ms, 1.0, -1, 6ms});
  EXPECT_EQ(over(overtaken), "0@1 1@5 3@13 2@15 4@17 5@21 6@25 7@29 8@33 9@37");
}

TEST(FaultyLine, DamagesExactlyOneByte) {
  Line line = datagrams({LineFaultKind::kCorrupt, kLineStart, TimePoint::max()});
  const std::string sent(100, 'a');
  line.send(sent, kLineStart);
  const auto message = line.take(kLineStart + 1ms);
  ASSERT_TRUE(message.has_value());
  ASSERT_EQ(message->bytes.size(), sent.size());
  EXPECT_EQ(std::count(message->bytes.begin(), message->bytes.end(), 'a'), 99);
}

TEST(FaultyLine, ThatTruncatesDeliversABeginning) {
  Line line = datagrams({LineFaultKind::kTruncate, kLineStart, TimePoint::max()});
  line.send("abcdefghij", kLineStart);
  const auto message = line.take(kLineStart + 1ms);
  ASSERT_TRUE(message.has_value());
  EXPECT_LT(message->bytes.size(), 10u);
  EXPECT_EQ(std::string("abcdefghij").rfind(message->bytes, 0), 0u);
}

TEST(FaultyLine, ThatIsCutLosesDatagramsAndDeliversAStreamWhenItIsMended) {
  Line lost = datagrams({LineFaultKind::kCut, kLineStart + 8ms, kLineStart + 32ms});
  EXPECT_EQ(over(lost), "0@1 1@5 8@33 9@37");
  EXPECT_TRUE(lost.is_cut(kLineStart + 8ms));
  EXPECT_FALSE(lost.is_cut(kLineStart + 32ms));
  Line late = stream({LineFaultKind::kCut, kLineStart + 8ms, kLineStart + 32ms});
  EXPECT_EQ(over(late), "0@1 1@5 2@232 3@232 4@232 5@232 6@232 7@232 8@232 9@232");
}

TEST(StreamLine, SendsAgainWhatWasDroppedAndKeepsTheOrder) {
  Line line = stream({LineFaultKind::kDrop, kLineStart + 32ms, kLineStart + 36ms});
  EXPECT_EQ(over(line), "0@1 1@5 2@9 3@13 4@17 5@21 6@25 7@29 8@233 9@233");
}

TEST(StreamLine, ThatIsTruncatedEndsThereUntilItBeginsAnew) {
  Line line = stream({LineFaultKind::kTruncate, kLineStart + 8ms, TimePoint::max(), 1.0, 1});
  EXPECT_EQ(over(line).substr(0, 7), "0@1 1@5");
  EXPECT_EQ(line.ended(), kLineStart + 9ms);
  line.restart();
  EXPECT_FALSE(line.ended().has_value());
  line.send("new", kLineStart + 100ms);
  EXPECT_EQ(line.take(kLineStart + 101ms)->bytes, "new");
}

}  // namespace
}  // namespace cellcal::sim
