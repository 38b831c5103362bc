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

TEST(ATableOfAnotherForm, ThatIsAWorkbookIsRefusedWithTheWayOut) {
  for (const char* begin :
       {"PK\x03\x04\x14", "\xD0\xCF\x11\xE0\xA1", "MATLAB 5.0 MAT-file", "\x89HDF\r\n"})
    expect_words(touches_refusal(begin), {"touches.csv: is a", "Save the table as CSV"});
}

TEST(ATableOfAnotherForm, IsASpreadsheetsRectangle) {
  const std::string plain = kPlain;
  expect_plain(exchanged(plain, '\n', ",,,\n"), "");
  expect_plain(exchanged(plain, '\n', "\n , ,,\n\n\"\",\"\",\n"), "");
  const std::string semicolons = exchanged(with_decimal_commas(";"), '\n', ";;\n");
  for (const char* title : {"Cell 3;;;;;\n;;;;;\n", "Cell 3, hall 2\n", "Cell 3, hall 2;;;;;\n",
                            "\"Cell 3; hall 2\";;;;;\n", "a, b, c, 3,5;;\n"})
    expect_plain(title + semicolons, "; with decimal comma, a title line");
  expect_plain("Cell 3,,,,,\n" + plain, "a title line");
  expect_plain("Cell 3, hall 2\n" + exchanged(plain, ',', "\t"), "tab, a title line");
  expect_plain("sep=;\nCell 3, hall 2;;\n" + semicolons, "; with decimal comma, a title line");
  expect_words(touches_refusal("A1,A2,target,,\n1,2,S1,,\n,2,S1,,\n"), {"touches.csv:3: A1"});
  expect_words(touches_refusal("A1,A2,target,,\n1,2,,,\n"), {"touches.csv:2: target"});
  expect_words(touches_refusal("A1,A2,target,,\n1,2,S1,,fit\n"), {"touches.csv:2: 5 fields"});
  expect_words(touches_refusal("A1,A2,target\n1,2,S1\n\"\n"), {"touches.csv:3:", "quotes"});
}

TEST(ATableOfAnotherForm, MayHaveCommasAndSemicolonsInItsTexts) {
  const std::string text = "target,tool,A1,A2\nS1,,1,2\n";
  EXPECT_EQ(rows_of(text).size(), 1U);
  EXPECT_EQ(csv_form("id,serial\nS1,3; 4\n", "t").title_lines, 0);
  EXPECT_EQ(csv_form("id;serial\nS1;3, 4\n", "t").title_lines, 0);
}

TEST(ATableOfAnotherForm, HasLinesThatEndInCrCrLf) {
  const std::string plain = kPlain;
  expect_plain(exchanged(plain, '\n', "\r\r\n"), "lines that end in CR CR LF");
  expect_plain("# of cell 3\r\n" + exchanged(plain, '\n', "\r\r\n"), "lines that end in CR CR LF");
}

TEST(ATableOfAnotherForm, MayHaveTimesWithADecimalComma) {
  const auto rows = rows_of("A1;A2;target;time\n1.5;2;S1;2024-09-24 10:00:00,250\n");
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].time, "2024-09-24 10:00:00.250");
  EXPECT_EQ(csv_form("A1;time\n1.5;2024-09-24 10:00:00,250\n", "t").reading, ";");
}

TEST(ARowOfUnits, CountsAsTheHeaders) {
  const auto rows = rows_of("A1;A2;target;sigma;;\nrad;[deg];;\xC2\xB5m;;\n0,5;2;S1;30;;\n");
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].line, 3);
  EXPECT_NEAR(rows[0].joint_rad[0], 0.5, 1e-12);
  EXPECT_NEAR(rows[0].sigma_m, 30e-6, 1e-12);
  const std::string rest = std::string(kPlain).substr(std::string(kPlain).find('\n'));
  expect_plain("A1,A2,target,sigma_mm\ndeg,deg,,mm" + rest, "a row of units");
  expect_plain("Cell 3\nA1 [deg],A2_deg,target,sigma\n(deg),deg,,mm" + rest,
               "a title line, a row of units");
  expect_words(touches_refusal("A1 [deg],A2,target\nrad,deg,\n1,2,S1\n"),
               {"touches.csv:2: A1 [deg]", "\"rad\"", "contradicts"});
  expect_words(touches_refusal("A1,A2,target,sigma_mm\ndeg,deg,,um\n1,2,S1,30\n"),
               {"touches.csv:2: sigma_mm", "contradicts"});
  expect_words(touches_refusal("A1,A2,target\nmm,deg,\n1,2,S1\n"), {"unknown column", "A1 [mm]"});
  expect_words(touches_refusal("A1,A2,target\ndeg,cubit,-\n1,2,S1\n"),
               {"touches.csv:2: A2: unknown unit \"cubit\" in the row of units"});
  expect_words(touches_refusal("A1,A2,target\n1,2,S1\ndeg,deg,\n"), {"touches.csv:3: A1"});
  expect_words(touches_refusal("A1,A2,target\ndeg\n1,2,S1\n"), {"touches.csv:2: 1 fields"});
}

TEST(AUnitAtTheEndOfAHeading, IsThatOfTheColumn) {
  const auto rows = rows_of("A1_rad,a2_DEG,target,sigma_um\n0.5,2,S1,30\n");
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_NEAR(rows[0].joint_rad[0], 0.5, 1e-12);
  EXPECT_DOUBLE_EQ(rows[0].joint_rad[1], 2 * kRadPerDeg);
  EXPECT_NEAR(rows[0].sigma_m, 30e-6, 1e-12);
  expect_words(touches_refusal("A1,A1_deg,A2,target\n1,1,2,S1\n"), {"unknown column", "A1_deg"});
  expect_words(touches_refusal("A1_rad,A1_deg,A2,target\n1,1,2,S1\n"), {"unknown column"});
  expect_words(touches_refusal("A1_mm,A2,target\n1,2,S1\n"), {"unknown column", "A1_mm"});
  // A joint's whole name, and a column that could be two.
  Cell cell = testing::cell();
  cell.robot.joints[0].name = "a";
  cell.robot.joints[1].name = "b_rad";
  const std::string row = "\n1,2,S1\n";
  const auto named = parse_touches("a,b_rad,target" + row, "touches.csv", cell);
  EXPECT_DOUBLE_EQ(named[0].joint_rad[1], 2 * kRadPerDeg);
  expect_words(testing::refusal(
                   [&] { (void)parse_touches("a_rad,b_rad,target" + row, "touches.csv", cell); }),
               {"unknown column", "a_rad"});
}

TEST(ANameOfAColumn, MayBeAnotherUsualOne) {
  const std::string rest = "\n-34.5,2.25,S1,0.03\n1,-2.5,S1,0.04\n";
  const auto plain = rows_of(kPlain);
  for (const char* head : {"J1,J2,target,sigma_mm", "Joint 1,Joint 2,Target,Sigma mm",
                           "q0 [deg],q1 [deg],target,sigma / mm",
                           "\xCE\xB8"
                           "1 (\xC2\xB0),\xCE\xB8"
                           "2 (\xC2\xB0),target,sigma [mm]",
                           "Achse_1,Achse_2,target,Sigma-mm", "A 1,a_2,target,sigma_mm"}) {
    const auto rows = rows_of(head + rest);
    ASSERT_EQ(rows.size(), 2U) << head;
    EXPECT_EQ(rows[0].joint_rad, plain[0].joint_rad) << head;
    EXPECT_DOUBLE_EQ(rows[1].sigma_m, 0.04e-3) << head;
  }
  const auto rows = rows_of("J1_rad,J2 rad,target\n0.5,-0.25,S1\n");
  EXPECT_DOUBLE_EQ(rows[0].joint_rad[1], -0.25);
  CsvTable table("J1;J2;target\n1;2;S1\n", "t", "");
  table.take_for_joints({"A1", "A2"});
  EXPECT_EQ(table.reading(), ";, J1 to J2 as A1 to A2");
  const auto seen = rows_of(
      "A1,A2,target,Px [m],Pos Y [in],Z-Coordinate [inch],Time stamp\n1,2,S1,1,2,3,2024-09-24\n");
  EXPECT_DOUBLE_EQ(seen[0].tracker_m[0], 1.0);
  EXPECT_DOUBLE_EQ(seen[0].tracker_m[1], 2 * 25.4e-3);
  EXPECT_DOUBLE_EQ(seen[0].tracker_m[2], 3 * 25.4e-3);
  EXPECT_EQ(seen[0].time, "2024-09-24");
}

TEST(ANameOfAColumn, WithTwoReadingsIsRefused) {
  // Not all joints, both series, the robot's own beside another, more of them than joints.
  for (const char* head : {"J1,target", "J1,J2,q1,q2,target", "A1,J2,target", "J1,J2,J3,target"})
    expect_words(touches_refusal(std::string(head) + "\n1,2,3,4,S1\n"),
                 {"touches.csv:1:", "column"});
  expect_words(touches_refusal("A1,A2,target,Px,y,z\n1,2,S1,1,2,3\n"),
               {"touches.csv:1: column \"Px\" has no unit. Name it x_mm, or Px [m] and the like"});
  expect_words(touches_refusal("A1,A2,target,x_mm,y_mm,z_mm,a\n1,2,S1,1,2,3,4\n"),
               {"column \"a\" has no unit. Name it a_deg, or a [rad] and the like"});
  expect_words(touches_refusal("A1,A2,target,x_mm,x [m]\n1,2,S1,1,1\n"), {"stands twice"});
  expect_words(touches_refusal(",A1,A2,target\n0,1,2,S1\n"),
               {"touches.csv:1: column 1 has no name. Name or remove it"});
  expect_words(touches_refusal("A1,A2,target,Rx\n1,2,S1,1\n"),
               {"unknown column \"Rx\". Rename or remove it; known here are"});
}

TEST(AComment, BeginsAsInOtherPrograms) {
  EXPECT_EQ(rows_of("% exported\n// by a tracker\nA1,A2,target\n# one\n1,2,S1\n%2,3,S1\n").size(),
            1U);
  expect_words(touches_refusal("# A1,A2,target\n1,2,S1\n"),
               {"touches.csv:2: the header row is missing", "in a comment above, remove the mark"});
}

TEST(AComment, WithTheFieldsOfARowIsRefused) {
  for (const char* row :
       {"#VALUE!,2,S1", "#DIV/0!,#DIV/0!,S1", "%x,2,S1,", "//,2,S1", "#WERT!,2,\"S1\""})
    expect_words(touches_refusal(std::string("A1,A2,target\n1,2,S1\n") + row + "\n"),
                 {"touches.csv:3: 3 fields as in a row", "begins a comment", "remove the line"});
  CsvTable spheres("id,x_mm,y_mm\nS0,1,2\n#1,5,6\n", "s.csv", "");
  ASSERT_TRUE(spheres.next());
  EXPECT_THROW(spheres.next(), FileError);
  // Prose, fewer fields, quotes, and a row of numbers with a mark before it.
  for (const char* comment : {"# by A, B, C", "# 5 mm", "# remark, 5", "# remark,,",
                              "# 5\" ball, 1, 2", "#5,2,S1", "#S1,2,3", "# 1, 2, 3, 4, 5"})
    EXPECT_EQ(rows_of(std::string("A1,A2,target\n") + comment + "\n1,2,S1\n").size(), 1U)
        << comment;
}

TEST(AQuote, IsDoubledWithinQuotes) {
  CsvTable table("id,\"serial \"\"x\"\"\"\n\"\"\"a\"\", \"\"b\"\"\",\"\"\nc,\"\"\"\"\n", "t.csv",
                 "");
  const int serial = table.find("serial \"x\"");
  ASSERT_EQ(serial, 1);
  ASSERT_TRUE(table.next());
  EXPECT_EQ(table.text(0), "\"a\", \"b\"");
  EXPECT_EQ(table.text(serial), "");
  ASSERT_TRUE(table.next());
  EXPECT_EQ(table.text(serial), "\"");
  expect_words(touches_refusal("A1,A2,target\n1,2,\"\"\"\n"), {"touches.csv:2:", "quotes"});
}

TEST(ATableWithoutRows, IsNamed) {
  CsvTable table("id,x_mm\n# none\n", "s.csv", "");
  try {
    table.next();
    ADD_FAILURE();
  } catch (const FileError& error) {
    expect_words(error.what(), {"s.csv: no row after the header"});
  }
}

TEST(ARowWithoutAMeasurement, IsNamedWithWhatToDo) {
  for (const char* none : {"NaN", "inf", "---", "no beam", "", "#N/A"})
    expect_words(
        touches_refusal(std::string("A1,A2,target\n1,2,S1\n1,") + none + ",S1\n"),
        {"touches.csv:3: A2: ", "is not a number", "Leave out rows in which nothing was measured"});
}

TEST(ARefusal, NamesTheFormThatTheFileHas) {
  expect_words(touches_refusal("A1;A2;target\n1,5;2,5;S1\n1,5;2,5\n"),
               {"touches.csv:3:", "cut off", "other than semicolons"});
  expect_words(touches_refusal("A1;A2;target\n1;5;2;S1\n"), {"one field per column"});
  expect_words(touches_refusal("A1\tA2\ttarget\n1\n"), {"other than tabs"});
  expect_words(touches_refusal("A1;A2;target\n1,5;2;S1\n1x;2,5;S1\n"),
               {"touches.csv:3: A1", "the decimal mark is ','"});
  expect_words(touches_refusal("A1,A2,target\n1x,2.5,S1\n"), {"the decimal mark is '.'"});
  expect_words(
      touches_refusal("A1,A2,target\n\"2,713.5163\",2.5,S1\n"),
      {"\"2,713.5163\" is not a number (the decimal mark is '.', with none between thousands)"});
  expect_words(touches_refusal("A1;A2;target\n2.713,5163;2,5;S1\n"), {"the decimal mark is ','"});
  expect_words(touches_refusal("1,5;2,5;S1\n"), {"header row is missing", "A1;A2;"});
  expect_words(touches_refusal("A1 A2 target\n1,5 2,5 S1\n"),
               {"touches.csv:1:", "separate fields by , ; or tab"});
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
