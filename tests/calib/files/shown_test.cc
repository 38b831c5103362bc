#include <gtest/gtest.h>

#include "calib/files/text.h"

namespace cellcal::calib {
namespace {

TEST(Shown, CutsBetweenTwoCharacters) {
  const std::string umlaut = "\xc3\xa4", face = "\xf0\x9f\x98\x80";
  EXPECT_EQ(shown("12345" + umlaut, 6), "12345...");
  EXPECT_EQ(shown("1234" + umlaut + "6", 6), "1234" + umlaut + "...");
  for (std::size_t most = 5; most < 9; ++most)
    EXPECT_EQ(shown("12345" + face + "6", most), "12345...");
  EXPECT_EQ(shown("12345" + face + "6", 9), "12345" + face + "...");
}

TEST(Shown, CutsWhatIsNoTextWhereItMust) {
  EXPECT_EQ(shown(std::string(50, '\x80'), 6), std::string(6, '\x80') + "...");
  EXPECT_EQ(shown("\x80\x80\x80", 2), "\x80\x80...");
  EXPECT_EQ(shown("\xc3\xa4", 1), "...");
}

TEST(Shown, HasAMarkWhereACharacterTurnsTheDirectionOfReadingOrSteersATerminal) {
  for (const char* control :
       {"\x01", "\x7f", "\xc2\x9b", "\xd8\x9c", "\xe2\x80\x8e", "\xe2\x80\x8f", "\xe2\x80\xa8",
        "\xe2\x80\xaa", "\xe2\x80\xae", "\xe2\x81\xa6", "\xe2\x81\xa9"}) {
    EXPECT_TRUE(has_control("S1" + std::string(control)));
    EXPECT_EQ(shown("S" + std::string(control) + "1"), "S?1");
  }
  for (const char* plain :
       {"\xc2\xb5", "\xe2\x80\x93", "\xe2\x80\x99", "\xe2\x81\xb0", "\xd8\xa7", "\xe2\x82\xac"}) {
    EXPECT_FALSE(has_control(plain)) << plain;
    EXPECT_EQ(shown(plain), plain);
  }
}

}  // namespace
}  // namespace cellcal::calib
