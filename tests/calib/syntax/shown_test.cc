#include "calib/syntax/shown.h"

#include <gtest/gtest.h>

namespace cellcal::calib {
namespace {

TEST(shown, cuts_between_two_characters) {
  const std::string umlaut = "\xc3\xa4", face = "\xf0\x9f\x98\x80";
  EXPECT_EQ(shown("12345" + umlaut, 6), "12345...");
  EXPECT_EQ(shown("1234" + umlaut + "6", 6), "1234" + umlaut + "...");
  for (std::size_t most = 5; most < 9; ++most)
    EXPECT_EQ(shown("12345" + face + "6", most), "12345...");
  EXPECT_EQ(shown("12345" + face + "6", 9), "12345" + face + "...");
}

TEST(shown, cuts_what_is_no_text_where_it_must) {
  EXPECT_EQ(shown(std::string(50, '\x80'), 6), std::string(6, '\x80') + "...");
  EXPECT_EQ(shown("\x80\x80\x80", 2), "\x80\x80...");
  EXPECT_EQ(shown("\xc3\xa4", 1), "...");
}

}  // namespace
}  // namespace cellcal::calib
