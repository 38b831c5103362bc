// Tables as spreadsheets and measuring programs write them.

#include "calib/files/csv.h"

#include <gtest/gtest.h>

#include "calib/model/units.h"
#include "tests/calib/files/documents.h"

namespace cellcal::calib {
namespace {

using testing::expect_words;
using testing::touches_refusal;

constexpr const char* kPlain = "A1,A2,target,sigma_mm\n-34.5,2.25,S1,0.03\n1,-2.5,S1,0.04\n";

std::vector<Touch> rows_of(const std::string& text) {
  return parse_touches(text, "touches.csv", testing::cell());
}

std::string exchanged(std::string text, char from, const std::string& to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, 1, to);
  return text;
}

std::string utf16(const std::string& text, bool little) {
  std::string all = little ? "\xFF\xFE" : "\xFE\xFF";
  for (const char c : text) {
    if (!little) all += '\0';
    all += c;
    if (little) all += '\0';
  }
  return all;
}

std::string with_decimal_commas(const std::string& separator) {
  return exchanged(exchanged(exchanged(kPlain, ',', "|"), '.', ","), '|', separator);
}

void expect_plain(const std::string& text, const std::string& reading) {
  const auto rows = rows_of(text), plain = rows_of(kPlain);
  ASSERT_EQ(rows.size(), plain.size()) << text;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].joint_rad, plain[i].joint_rad) << text;
    EXPECT_DOUBLE_EQ(rows[i].sigma_m, plain[i].sigma_m) << text;
  }
  EXPECT_EQ(csv_form(text, "t").reading, reading) << text;
}

TEST(ATableOfAnotherForm, IsReadAsThePlainOne) {
  const std::string plain = kPlain;
  expect_plain(plain, "");
  expect_plain(exchanged(plain, ',', ";"), ";");
  expect_plain(exchanged(plain, ',', "\t"), "tab");
  expect_plain(with_decimal_commas(";"), "; with decimal comma");
  expect_plain(with_decimal_commas("\t"), "tab with decimal comma");
  expect_plain("sep=;\r\n" + exchanged(with_decimal_commas(";"), '\n', "\r\n"),
               "; with decimal comma");
  expect_plain(utf16(plain, true), "UTF-16");
  expect_plain(utf16(with_decimal_commas(";"), false), "; with decimal comma, UTF-16");
  expect_plain(exchanged(plain, '\n', "\r"), "lines that end in CR");
  expect_plain(exchanged(plain, '-', "\xE2\x88\x92"), "Unicode minus");
  expect_plain(exchanged(plain, '\n', ",\n"), "");  // a trailing separator
  expect_plain("a1,a2,TARGET,Sigma_mm" + plain.substr(plain.find('\n')), "");
  expect_plain("Touches of cell 3\n" + plain, "a title line");
  expect_plain("A1 [deg],A2 (\xC2\xB0),target,sigma [mm]" + plain.substr(plain.find('\n')), "");
  expect_plain(
      "\"A1\",\"A2\",\"target\",\"sigma_mm\"\n\"-34.5\",\"2.25\",\"S1\",0.03\n"
      "\"\xC2\xA0"
      "1\",\"-2.5\",S1,\"0.04\"\n",
      "");
}

TEST(ATableOfAnotherForm, InWindows1252IsReadAsUtf8) {
  expect_plain(
      "A1 [\xB0],A2 [\xB0],target,sigma_mm\n-34.5,\xA0"
      "2.25,S1,0.03\n1,-2.5,S1,0.04\n",
      "Windows-1252");
  expect_plain("K\xFChler \x96 \x80\n" + std::string(kPlain), "Windows-1252, a title line");
  EXPECT_EQ(csv_form("\x80 \xB5m \xFC", "t").text, "\xE2\x82\xAC \xC2\xB5m \xC3\xBC");
  EXPECT_EQ(csv_form("\xE2\x82\xAC \xF0\x9F\x98\x80", "t").reading, "");
  for (const char* none : {"\xE2\x82", "\xC0\xAF", "\xED\xA0\xA0", "\xF5\xA0\xA0\xA0", "\xF0\xA0"})
    EXPECT_EQ(csv_form(none, "t").reading, "Windows-1252");
  expect_words(touches_refusal("A1,A2,target\n1,2,S1\n1,2,\x81\n"),
               {"touches.csv:3:", "neither UTF-8 nor Windows-1252"});
  expect_words(touches_refusal("A1,A2,target\n1,2,S1\n1,2,\xFC\x1B\n"),
               {"touches.csv:3:", "control"});
  using namespace std::string_literals;
  expect_words(touches_refusal("\x7F\x45LF\x02\0\0\xFF\xFE\n"s), {"touches.csv:1:", "control"});
}

TEST(ATableOfAnotherForm, HasLinesThatEndInCrCrLf) {
  const std::string plain = kPlain;
  expect_plain(exchanged(plain, '\n', "\r\r\n"), "lines that end in CR CR LF");
  expect_plain("# of cell 3\r\n" + exchanged(plain, '\n', "\r\r\n"), "lines that end in CR CR LF");
}

TEST(AUnitInTheHeader, IsConvertedToTheTables) {
  const auto rows = rows_of("A1 [rad],A2 [deg],target,sigma [um]\n0.5,2,S1,30\n");
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_NEAR(rows[0].joint_rad[0], 0.5, 1e-12);
  EXPECT_NEAR(rows[0].sigma_m, 30e-6, 1e-12);
  expect_words(touches_refusal("A1 [inch],A2,target\n1,2,S1\n"), {"unknown column", "A1 [inch]"});
  expect_words(touches_refusal("A1 [mm],A2,target\n1,2,S1\n"), {"unknown column"});
  expect_words(touches_refusal("A1,A2,target,sigma_mm [um]\n1,2,S1,30\n"), {"unknown column"});
}

TEST(ATableWithTwoReadings, IsRefused) {
  expect_words(touches_refusal("A1;A2;target\n1,5;2,5;S1\n1.5;2;S1\n"),
               {"touches.csv:3:", "decimal comma (line 2)", "decimal point (line 3)"});
  expect_words(touches_refusal("A1;A2;target\n1.234,5;2;S1\n"), {"touches.csv:2: A1", "number"});
  expect_words(touches_refusal("A1;A2;target\n1,234,5;2;S1\n"), {"touches.csv:2: A1", "number"});
  expect_words(touches_refusal("A1\tA2;target\n1\t2\tS1\n"), {"tabs", "semicolons"});
  expect_words(touches_refusal("A1,a1,A2,target\n1,1,2,S1\n"), {"stands twice"});
  expect_words(touches_refusal("A1 [deg],A1,A2,target\n1,1,2,S1\n"), {"stands twice"});
  expect_words(touches_refusal("sep=x\nA1,A2,target\n"), {"sep="});
}

TEST(AUtf16TextThatIsDamaged, IsRefused) {
  const std::string whole = utf16(kPlain, true);
  expect_words(touches_refusal(whole.substr(0, whole.size() - 1)), {"UTF-16"});
  expect_words(touches_refusal(std::string("\xFF\xFE\x00\xD8", 4)), {"UTF-16"});
  expect_words(touches_refusal(std::string("\xFF\xFE\x00\xDC\x41\x00", 6)), {"UTF-16"});
  expect_words(touches_refusal("\xFF\xFE"), {"empty"});
  for (std::size_t length = 0; length < whole.size(); ++length) {
    try {
      EXPECT_LE(rows_of(whole.substr(0, length)).size(), 2U);
    } catch (const FileError& error) {
      EXPECT_EQ(error.file, "touches.csv");
    }
  }
}

}  // namespace
}  // namespace cellcal::calib
