// CSV of touches and of joints: semantics, and refusal of every kind of error.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "calib/files/csv.h"
#include "calib/model/units.h"
#include "tests/calib/files/documents.h"

namespace cellcal::calib {
namespace {

using testing::expect_words;
using testing::kTouches;
using testing::refusal;
using testing::touches_refusal;
using testing::with;

std::vector<Touch> parse(const std::string& text) {
  return parse_touches(text, "touches.csv", testing::cell());
}

TEST(Touches, ReadsDegreesMillimetresSetsAndTimes) {
  const auto touches = parse(kTouches);
  ASSERT_EQ(touches.size(), 3u);
  EXPECT_EQ(touches[0].joint_rad, (std::vector<double>{10.5 * kRadPerDeg, -20.25 * kRadPerDeg}));
  EXPECT_EQ(touches[0].target, "S1");
  EXPECT_EQ(touches[0].set, TouchSet::kFit);
  EXPECT_EQ(touches[0].sigma_m, 0.0);
  EXPECT_EQ(touches[0].time, "2024-09-24T10:00:00Z");
  EXPECT_EQ(touches[0].line, 3);
  EXPECT_EQ(touches[1].set, TouchSet::kCheck);
  EXPECT_DOUBLE_EQ(touches[1].sigma_m, 5e-5);
  EXPECT_DOUBLE_EQ(touches[1].joint_rad[1], 35.0 * kRadPerDeg);
  EXPECT_EQ(touches[2].set, TouchSet::kFit);
  EXPECT_DOUBLE_EQ(touches[2].radius_m, 0.812345);
}

TEST(Touches, TakesColumnsInAnyOrderAndSpacesAroundFields) {
  const auto touches = parse("target , A2,\tA1\n S1 , 2 ,1\t\n");
  ASSERT_EQ(touches.size(), 1u);
  EXPECT_EQ(touches[0].joint_rad, (std::vector<double>{1 * kRadPerDeg, 2 * kRadPerDeg}));
}

TEST(Touches, TakesWindowsLineEndsByteOrderMarksCommentsAndEmptyLines) {
  std::string windows;
  for (const char c : std::string(kTouches)) windows += c == '\n' ? "\r\n" : std::string(1, c);
  EXPECT_EQ(parse(windows), parse(kTouches));
  EXPECT_EQ(parse("\xEF\xBB\xBF" + std::string(kTouches)), parse(kTouches));
  const auto touches = parse("A1,A2,target\n# 5,5,S9\n\n   \n1,2,S1\n  # end");
  ASSERT_EQ(touches.size(), 1u);
  EXPECT_EQ(touches[0].line, 5);
}

TEST(Touches, TakesAFileWithoutAnEndOfLineAndOneWithoutRows) {
  EXPECT_EQ(parse("A1,A2,target\n1,2,S1").size(), 1u);
  EXPECT_TRUE(parse("A1,A2,target").empty());
}

TEST(Touches, NamesTheLineAndColumnOfAFieldThatIsNotANumber) {
  for (const char* field : {"", "abc", "1,5", "0x10", "1e", "--1", "+-1", "1 2", "1.2.3", "١",
                            "nan", "inf", "-inf", "infinity", "1e999", "1d3"}) {
    SCOPED_TRACE(field);
    const std::string text = "A1,A2,target\n1,2,S1\n1," + std::string(field) + ",S1\n";
    const std::string message = touches_refusal(text);
    expect_words(message, {"touches.csv:3:"});
    if (std::string_view(field).find(',') == std::string_view::npos) expect_words(message, {"A2"});
  }
}

TEST(Touches, NamesTheLineAndColumnOfAnAngleThatTheJointCannotHave) {
  EXPECT_EQ(parse("A1,A2,target\n160,0,S1\n").size(), 1u);  // limits may be slightly wider
  expect_words(touches_refusal("A1,A2,target\n1,2,S1\n166,0,S1\n"),
               {"touches.csv:3: A1", "166", "-155 to 155"});
  expect_words(touches_refusal("A1,A2,target\n0,1e7,S1\n"), {"touches.csv:2: A2", "range"});
}

TEST(Touches, NamesTheLineAndColumnOfEverythingElseThatIsWrong) {
  expect_words(touches_refusal("A1,A2,target\n1,2,S9\n"), {"touches.csv:2: target", "S9"});
  expect_words(touches_refusal("A1,A2,target\n1,2,\n"), {"touches.csv:2: target"});
  expect_words(touches_refusal("A1,A2,target,set\n1,2,S1,Fit\n"),
               {"touches.csv:2: set", "fit or check"});
  expect_words(touches_refusal("A1,A2,target,sigma_mm\n1,2,S1,0\n"),
               {"touches.csv:2: sigma_mm", "between 1e-9 and 1000 mm"});
  expect_words(touches_refusal("A1,A2,target,sigma_mm\n1,2,S1,1e-200\n"),
               {"touches.csv:2: sigma_mm", "between 1e-9 and 1000 mm"});
  expect_words(touches_refusal("A1,A2,target,radius_mm\n1,2,S1,1e300\n"),
               {"touches.csv:2: radius_mm", "at most 1000000 mm"});
  expect_words(touches_refusal("A1,A2,target,sigma_mm\n1,2,S1,-0.1\n"),
               {"touches.csv:2: sigma_mm"});
  expect_words(touches_refusal("A1,A2,target,radius_mm\n1,2,W,-5\n"), {"touches.csv:2: radius_mm"});
  expect_words(touches_refusal("A1,A2,target\n1,2,S1\n1,2,W\n"),
               {"touches.csv:3: radius_mm", "missing"});
  expect_words(touches_refusal("A1,A2,target,x_mm\n1,2,S1,nan\n"), {"touches.csv:2: x_mm"});
}

TEST(Touches, MayStateTheirSpeedAndWhereTheTipWasGoing) {
  const auto touches = parse(
      "A1,A2,target,speed_mm_s,approach_x,approach_y,approach_z\n"
      "1,2,S1,10,0,0.6,-0.8\n1,2,S1,2,,,\n1,2,S1,,,,\n1,2,S1,10,0.577,0.577,-0.577\n");
  EXPECT_DOUBLE_EQ(touches[0].speed_m_s, 0.010);
  ASSERT_TRUE(touches[0].approach);
  EXPECT_DOUBLE_EQ((*touches[0].approach)[1], 0.6);
  EXPECT_DOUBLE_EQ((*touches[0].approach)[2], -0.8);
  EXPECT_DOUBLE_EQ(touches[1].speed_m_s, 0.002);
  EXPECT_FALSE(touches[1].approach);
  EXPECT_EQ(touches[2].speed_m_s, 0.0);
  const auto& rounded = touches[3].approach.value();
  EXPECT_DOUBLE_EQ(std::hypot(rounded[0], rounded[1], rounded[2]), 1.0);
}

TEST(Touches, NameTheLineAndColumnOfASpeedOrDirectionThatIsNone) {
  for (const char* speed : {"0", "-10", "1e-4", "1e4", "nan", "inf", "fast", "1e999"})
    expect_words(
        touches_refusal("A1,A2,target,speed_mm_s\n1,2,S1,10\n1,2,S1," + std::string(speed) + "\n"),
        {"touches.csv:3: speed_mm_s"});
  for (const auto& [row, words] : std::initializer_list<std::pair<const char*, const char*>>{
           {"1,,-1", "approach_y: missing; approach_x, approach_y and approach_z"},
           {",0,", "approach_x: missing"},
           {"0,0,nan", "approach_z"},
           {"0,0,-1e300", "approach_z: must be between -1 and 1"},
           {"10,0,0", "approach_x: must be between -1 and 1"},
           {"0,0,0", "approach_x: approach_x, approach_y, approach_z have length 0"},
           {"0.5,0.5,0.5", "have length 0.866, but a direction"}})
    expect_words(touches_refusal("A1,A2,target,approach_x,approach_y,approach_z\n1,2,S1," +
                                 std::string(row) + "\n"),
                 {"touches.csv:2: ", words});
}

TEST(Touches, OfATrackerOfAnArmAtRestCountAsTheirMean) {
  Cell cell = testing::cell();
  cell.targets[2].kind = TargetKind::kTracker;
  const auto read = [&](const std::string& rows) {
    return parse_touches("A1,A2,target,set,x_mm,y_mm,z_mm\n" + rows, "touches.csv", cell);
  };
  const auto touches = read(
      "1,2,W,,100,200,300\n1,2,W,,100.003,200,299.997\n1,2,W,,100.003,200,300\n"
      "1,2,W,check,100,200,300\n3,2,W,,100,200,300\n1,2,W,,100,200,300.1\n1,2,S1,,,,\n1,2,S1,,,,\n");
  ASSERT_EQ(touches.size(), 6u);
  EXPECT_EQ(touches[0].readings, 3);
  EXPECT_NEAR(touches[0].tracker_m[0], 0.100002, 1e-12);
  EXPECT_NEAR(touches[0].tracker_m[2], 0.299999, 1e-12);
  EXPECT_EQ(touches[0].line, 2);
  for (std::size_t i = 1; i < touches.size(); ++i) EXPECT_EQ(touches[i].readings, 0) << i;
}

TEST(Touches, OfATrackerThatScatterAsAnArmReturnsAreAllKept) {
  Cell cell = testing::cell();
  cell.targets[2].kind = TargetKind::kTracker;
  const auto touches = parse_touches(
      "A1,A2,target,x_mm,y_mm,z_mm\n1,2,W,100,200,300\n1,2,W,100.02,200,300\n"
      "3,2,W,100,200,300\n3,2,W,100,200.02,300\n",
      "touches.csv", cell);
  EXPECT_EQ(touches.size(), 4u);
}

TEST(Touches, OfATrackerNeedAWholeReading) {
  Cell cell = testing::cell();
  cell.targets[2].kind = TargetKind::kTracker;
  const auto read = [&](const std::string& rows) {
    return parse_touches("A1,A2,target,x_mm,y_mm,z_mm\n" + rows, "touches.csv", cell);
  };
  const auto touches = read("1,2,W,0,-2.5e3,3\n1,2,S1,,,\n");
  EXPECT_EQ(touches[0].tracker_m[0], 0.0);
  EXPECT_DOUBLE_EQ(touches[0].tracker_m[1], -2.5);
  EXPECT_DOUBLE_EQ(touches[0].tracker_m[2], 0.003);
  for (const auto& [row, column] : std::initializer_list<std::pair<const char*, const char*>>{
           {"1,2,W,,2,3", "x_mm: missing"},
           {"1,2,W,1,,3", "y_mm: missing"},
           {"1,2,W,1,2,", "z_mm: missing"},
           {"1,2,W,1,nan,3", "y_mm"},
           {"1,2,W,1,2,1e7", "z_mm: is out of range"}})
    expect_words(refusal([&] { (void)read(std::string("1,2,S1,,,\n") + row + "\n"); }),
                 {"touches.csv:3: ", column});
  expect_words(refusal([&] { (void)parse_touches("A1,A2,target\n1,2,W\n", "touches.csv", cell); }),
               {"touches.csv:2: x_mm: missing", "x_mm, y_mm, z_mm"});
}

TEST(Touches, NamesAMissingOrUnknownOrDoubledColumnAndTheHeadersLine) {
  expect_words(touches_refusal("A1,target\n1,S1\n"), {"touches.csv:1:", "\"A2\""});
  expect_words(touches_refusal("A1,A2\n1,2\n"), {"touches.csv:1:", "\"target\""});
  expect_words(touches_refusal("A1,A2,A3,target\n1,2,3,S1\n"),
               {"touches.csv:1:", "\"A3\"", "known here are"});
  expect_words(touches_refusal("A1,A2,A1,target\n1,2,3,S1\n"), {"touches.csv:1:", "twice"});
  expect_words(touches_refusal("A1,,A2,target\n"), {"touches.csv:1:", "no name"});
  for (const char* rows : {"0,0,S1\n", "12.5,-3,S1\n", "-1e1,+2,S1,fit\n"})
    expect_words(touches_refusal(rows), {"touches.csv:1:", "header row is missing", "A1,A2"});
  const std::string comments = "# one\n# two\n";
  expect_words(touches_refusal(comments + "A1,A2,taget\n1,2,S1\n"), {"touches.csv:3:", "taget"});
  expect_words(touches_refusal(comments + "A1,target\n1,S1\n"), {"touches.csv:3:", "\"A2\""});
  expect_words(touches_refusal(comments + "A1,A2\n1,2\n"), {"touches.csv:3:", "\"target\""});
}

TEST(Poses, WithoutAHeaderAreRefusedWithTheirOwnColumns) {
  expect_words(refusal([] { parse_poses("1;2;3;4;5;6\n", "p.csv", testing::cell().robot); }),
               {"p.csv:1: the header row is missing", "as in x_mm;y_mm;z_mm;a_deg;b_deg;c_deg"});
}

TEST(Poses, MayHaveAQuaternion) {
  const Robot robot = testing::cell().robot;
  const auto rows =
      parse_poses("X [m],Y [m],Z [m],qx,qy,qz,qw,J1,J2\n1,2,3,0,0,0.6,0.8,10,20\n", "p.csv", robot);
  ASSERT_EQ(rows.size(), 1u);
  EXPECT_TRUE(rows[0].tcp.linear().isApprox(
      Eigen::Quaterniond(0.8, 0.0, 0.0, 0.6).toRotationMatrix(), 1e-12));
  EXPECT_DOUBLE_EQ(rows[0].tcp.translation().z(), 3.0);
  EXPECT_DOUBLE_EQ(rows[0].seed_rad[1], 20.0 * kRadPerDeg);
  for (const char* head : {"x_mm,y_mm,z_mm,qw,qx,qy,qz,c_deg", "x_mm,y_mm,qw,qx,qy,qz,A1,A2"})
    expect_words(
        refusal([&] { parse_poses(head + std::string("\n1,2,3,1,0,0,0,0\n"), "p.csv", robot); }),
        {"p.csv:1:"});
}

TEST(Touches, NamesTheLineOfATruncatedRowAndGuessesWhy) {
  expect_words(touches_refusal("A1,A2,target\n1,2,S1\n1,2"),
               {"touches.csv:3:", "2 fields", "3 columns", "cut off"});
  expect_words(touches_refusal("A1,A2,target\n1,2,S1,fit\n"), {"touches.csv:2:", "4 fields"});
  expect_words(touches_refusal("A1,A2,target\n1,-2.5,S1,fit\n"),
               {"touches.csv:2:", "4 fields", "one field per column"});
}

TEST(Touches, OfASpreadsheetThatWritesSemicolonsOrDecimalCommasAreToldApart) {
  expect_words(touches_refusal("A1,A2,target\n1,2,S1\n1,5,-2,25,S1\n"),
               {"touches.csv:3:", "5 fields", "decimal commas", "'.'"});
  expect_words(touches_refusal("A1,A2,target\n1,-2,25,S1\n"),
               {"touches.csv:2:", "4 fields", "decimal commas"});
}

TEST(Touches, AreNamedByNumberAndByTheLineThatTheyCameFrom) {
  EXPECT_EQ(touch_words(1, parse(kTouches)[1]), "touch 2 (line 4)");
  EXPECT_EQ(touch_words(11, Touch{}), "touch 12");
}

TEST(Touches, EveryTruncationIsReadOrRefusedAndNeverGuessed) {
  const std::string whole(kTouches);
  const auto rows = parse(whole);
  for (std::size_t length = 0; length < whole.size(); ++length) {
    try {
      const auto read = parse(whole.substr(0, length));
      // A row is complete with its last separator: only its time field may then be truncated.
      ASSERT_LE(read.size(), rows.size());
      for (std::size_t i = 0; i < read.size(); ++i) {
        EXPECT_EQ(read[i].joint_rad, rows[i].joint_rad) << length;
        EXPECT_EQ(read[i].target, rows[i].target) << length;
        EXPECT_EQ(read[i].radius_m, rows[i].radius_m) << length;
      }
    } catch (const FileError& error) {
      EXPECT_EQ(error.file, "touches.csv") << error.what();
    }
  }
}

TEST(Touches, RefusesHostileText) {
  using namespace std::string_literals;
  expect_words(touches_refusal(""), {"touches.csv", "empty"});
  expect_words(touches_refusal("#\n\n"), {"touches.csv", "empty"});
  expect_words(touches_refusal("A1,A2,target\n1,2\0,S1\n"s), {"touches.csv:2:", "NUL"});
  expect_words(touches_refusal("A1,A2,target\n1,\"2,S1\n"), {"touches.csv:2:", "quotes"});
  expect_words(touches_refusal("A1,A2,target\n1,2\"3\",S1\n"), {"touches.csv:2:", "quotes"});
  expect_words(touches_refusal("A1,A2,target\n1,\"2\" 3,S1\n"), {"touches.csv:2:", "quotes"});
  expect_words(touches_refusal("A1,A2,target,time\n1,2,S1,no\rw\n"),
               {"touches.csv:2:", "control characters"});
  expect_words(touches_refusal("A1,A2,target,time\n1,2,S1,\x1b[2J\n"), {"touches.csv:2:"});
  expect_words(touches_refusal("A1,A2,target\n" + std::string(100000, '1') + "\n"),
               {"touches.csv:2:", "longer than"});
  std::string columns = "A1,A2,target";
  for (int i = 0; i < 10000; ++i) columns += ",c" + std::to_string(i);
  expect_words(touches_refusal(columns + "\n"), {"touches.csv:1:", "columns"});
  expect_words(touches_refusal(std::string(50000, ',') + "\n"), {"touches.csv", "empty"});
  expect_words(touches_refusal("A1,A2,target" + std::string(50000, ',') + "x\n"),
               {"touches.csv:1:", "columns"});
}

TEST(Touches, KeepsMessagesShort) {
  const std::string field(60000, 'x');
  for (const std::string& text :
       {"A1,A2,target\n1," + field + ",S1\n", "A1,A2,target\n1,2," + field + "\n",
        "A1,A2,target," + field + "\n", "A1,A2,target,set\n1,2,S1," + field + "\n",
        "A1,A2,target\n1,1" + std::string(60000, '0') + ",S1\n"})
    EXPECT_LT(touches_refusal(text).size(), 400u);
}

class Joints : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }
  JointRows read(const std::string& text) {
    std::ofstream(path_, std::ios::binary) << text;
    return load_joints(path_, testing::robot());
  }
  std::string refused(const std::string& text) {
    return refusal([&] { (void)read(text); });
  }
  std::filesystem::path path_ = std::filesystem::path(::testing::TempDir()) /
                                ("joints-" + std::to_string(::getpid()) + ".csv");
};

TEST_F(Joints, AreReadInTheRobotsOrderBeyondItsLimitsToo) {
  const auto [rows, of_positioner, beyond, words] = read("A2,A1\n1,2\n300,-300\n");
  EXPECT_TRUE(of_positioner.empty());
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0], (std::vector<double>{2 * kRadPerDeg, 1 * kRadPerDeg}));
  EXPECT_EQ(rows[1], (std::vector<double>{-300 * kRadPerDeg, 300 * kRadPerDeg}));
  EXPECT_EQ(beyond, 1u);
  ASSERT_EQ(words.size(), 1u);
  expect_words(words[0], {"csv:3: A1: -300 deg is outside", "-155 to 155 deg"});
}

TEST_F(Joints, ManyBeyondTheirLimitsAreCountedAndAFewPutIntoWords) {
  std::string text = "A2,A1\n";
  for (int row = 0; row < 1000; ++row) text += "300,-300\n";
  const JointRows rows = read(text);
  EXPECT_EQ(rows.joint_rad.size(), 1000u);
  EXPECT_EQ(rows.beyond_limits, 1000u);
  EXPECT_EQ(rows.beyond_limits_words.size(), 5u);
}

TEST_F(Joints, RefusesOtherColumnsNonsenseAndDirectories) {
  expect_words(refused("A1,A2,target\n1,2,S1\n"), {"csv:1:", "\"target\""});
  expect_words(refused("A1\n1\n"), {"csv:1:", "\"A2\""});
  expect_words(refused("A1,A2\n1,5000\n"), {"csv:2: A2", "range"});
  expect_words(refused("A1,A2\n1,nan\n"), {"csv:2: A2"});
  expect_words(refused("A1,A2\n1\n"), {"csv:2:", "fields"});
  expect_words(refused(""), {"csv", "empty"});
  expect_words(refusal([] { (void)load_joints("/tmp", testing::robot()); }), {"/tmp", "directory"});
}

}  // namespace
}  // namespace cellcal::calib
