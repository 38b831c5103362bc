#include <gtest/gtest.h>

#include <clocale>
#include <limits>
#include <locale>
#include <string>

#include "daemon/report/say.h"

namespace cellcal::daemon::report {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Numbers, HaveFixedDecimalsAndARealMinus) {
  EXPECT_EQ(fixed(1.23456, 3), "1.235");
  EXPECT_EQ(fixed(-1.5, 1),
            "\xE2\x88\x92"
            "1.5");
  EXPECT_EQ(ascii_fixed(-1.5, 1), "-1.5");
  EXPECT_EQ(signed_fixed(0.25, 2), "+0.25");
}

TEST(Numbers, AreNeverMinusZero) {
  EXPECT_EQ(fixed(-0.0001, 3), "0.000");
  EXPECT_EQ(signed_fixed(-0.0001, 3), "0.000");
  EXPECT_EQ(signed_fixed(0.0001, 3), "0.000");
}

TEST(Numbers, ThatAreNotFiniteAreADash) {
  for (const double value : {kNan, kInfinity, -kInfinity}) {
    EXPECT_EQ(fixed(value, 3), "\xE2\x80\x93");
    EXPECT_EQ(signed_fixed(value, 3), "\xE2\x80\x93");
    EXPECT_EQ(significant(value, 3), "\xE2\x80\x93");
    EXPECT_EQ(mm(value), "\xE2\x80\x93");
  }
}

TEST(Numbers, StayShortWhenTheyAreHuge) {
  EXPECT_LT(fixed(std::numeric_limits<double>::max(), 3).size(), 16U);
}

TEST(Numbers, ShowMicrometresOfMetres) {
  EXPECT_EQ(mm(0.0309134), "30.913");
  EXPECT_EQ(signed_mm(-0.000213),
            "\xE2\x88\x92"
            "0.213");
}

TEST(Numbers, ThatMustBePositiveAreADashWhenTheyAreNot) {
  EXPECT_EQ(positive_mm(0.0), "\xE2\x80\x93");
  EXPECT_EQ(positive_mm(-1.0), "\xE2\x80\x93");
  EXPECT_EQ(positive_mm(kNan), "\xE2\x80\x93");
  EXPECT_EQ(positive_mm(0.00003), "0.030");
}

TEST(Numbers, IgnoreTheLocale) {
  class Comma : public std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new Comma));
  EXPECT_EQ(fixed(12345.678, 3), "12345.678");
  EXPECT_EQ(significant(0.00036, 3), "0.00036");
  EXPECT_EQ(counted(12345, "say.report.touches."), "12345 touches");
  std::locale::global(before);
}

TEST(Numbers, HaveTheDecimalMarkOfTheDocument) {
  {
    const Speaking german(*calib::Language::of("de"));
    EXPECT_EQ(fixed(-1234.5, 2),
              "\xE2\x88\x92"
              "1234,50");
    EXPECT_EQ(signed_fixed(0.25, 2), "+0,25");
    EXPECT_EQ(significant(0.00036, 3), "0,00036");
    EXPECT_EQ(mm_words(3.1e-5), "0,031\xC2\xA0mm");
    EXPECT_EQ(ascii_fixed(-0.5, 2), "-0.50") << "as in files";
    const Speaking english((calib::Language()));
    EXPECT_EQ(fixed(0.5, 1), "0.5");
  }
  EXPECT_EQ(fixed(0.5, 1), "0.5") << "until its end";
}

TEST(Counted, AgreesWithTheNumber) {
  EXPECT_EQ(counted(0, "say.report.touches."), "0 touches");
  EXPECT_EQ(counted(1, "say.report.touches."), "1 touch");
  EXPECT_EQ(counted(2, "say.report.touches."), "2 touches");
}

TEST(Times, InUtcReadLikeAClock) {
  EXPECT_EQ(readable_time("2025-03-14T02:10:00Z"), "2025-03-14 02:10:00 UTC");
  EXPECT_EQ(readable_time("2025-03-14T02:10:00.125Z"), "2025-03-14 02:10:00 UTC");
}

TEST(Times, OfAnyOtherFormStayAsTheyAre) {
  for (const char* text :
       {"", "yesterday", "2025-03-14T02:10:00", "2025-03-14T02:10:00+01:00",
        "2025-03-14T02:10:00 Z", "2025-03-14T02:1x:00Z", "2025-03-14T02:10:00<b>Z"}) {
    EXPECT_EQ(readable_time(text), text);
  }
}

TEST(Numbers, InSentencesStayWithTheirUnit) { EXPECT_EQ(mm_words(0.00125), "1.250\xC2\xA0mm"); }

}  // namespace
}  // namespace cellcal::daemon::report
