// Hostile TOML and JSON.

#include <gtest/gtest.h>

#include "calib/files/calibration_json.h"
#include "calib/files/toml.h"
#include "tests/calib/files/documents.h"

namespace cellcal::calib {
namespace {

using namespace std::string_literals;
using testing::cell_refusal;
using testing::expect_words;
using testing::kCell;
using testing::kRobot;
using testing::refusal;
using testing::robot_refusal;
using testing::with;

std::string repeated(const std::string& text, int count) {
  std::string out;
  for (int i = 0; i < count; ++i) out += text;
  return out;
}

TEST(HostileToml, NulsAndBytesThatAreNotUtf8AreRefused) {
  expect_words(robot_refusal("name = \"a\0b\""s), {"robot.toml:1:"});
  expect_words(robot_refusal("\0\0\0\0"s), {"robot.toml:"});
  expect_words(robot_refusal("name = \"\xFF\xFE\""), {"robot.toml:1:"});
  expect_words(robot_refusal("\xFF\xFEn\0a\0"s), {"robot.toml"});
}

TEST(HostileToml, OfAnotherEncodingIsRefusedWithWhatToDo) {
  // As Notepad saves "ANSI": a sharp s in a string, in a comment, an umlaut at the end.
  for (const char* source : {"\"gro\xDF\"", "\"made up\"  # gro\xDF, 1,5 m"})
    expect_words(robot_refusal(with(kRobot, "\"made up\"", source)),
                 {"robot.toml:3:", "Windows-1252", "Save it as UTF-8"});
  expect_words(robot_refusal(std::string(kRobot) + "# H\xF6"), {"robot.toml:", "Save it as UTF-8"});
  std::string little = "\xFF\xFE", big = "\xFE\xFF";  // as PowerShell saves
  for (const char c : std::string(kRobot)) {
    little += {c, '\0'};
    big += {'\0', c};
  }
  for (const std::string& text : {little, big})
    expect_words(robot_refusal(text), {"robot.toml:1:", "UTF-16", "Save it as UTF-8"});
  EXPECT_EQ(robot_refusal(with(kRobot, "\"made up\"", "utf-8")).find("Save it"), std::string::npos);
}

TEST(HostileToml, DeepNestingIsRefusedInEveryForm) {
  constexpr int kDeep = 100000;
  expect_words(robot_refusal("a = " + repeated("[", kDeep)), {"robot.toml:1:"});
  expect_words(robot_refusal("a = " + repeated("[", kDeep) + repeated("]", kDeep)),
               {"robot.toml:1:"});
  expect_words(robot_refusal("a = " + repeated("{a=", kDeep)), {"robot.toml:1:"});
  expect_words(robot_refusal(repeated("a.", kDeep) + "a = 1"), {"robot.toml"});
  expect_words(robot_refusal("[" + repeated("a.", kDeep) + "a]"), {"robot.toml"});
  expect_words(robot_refusal("[[" + repeated("a.", kDeep) + "a]]"), {"robot.toml"});
}

TEST(HostileToml, HugeLinesKeysAndNumbersAreRefused) {
  expect_words(robot_refusal(std::string(1 << 20, 'a')), {"robot.toml:1:"});
  expect_words(robot_refusal(std::string(1 << 20, 'a') + " = 1"), {"robot.toml"});
  expect_words(robot_refusal("a = " + std::string(1 << 20, '9')), {"robot.toml:1:"});
  expect_words(robot_refusal("a = 99999999999999999999999"), {"robot.toml:1:"});
  expect_words(robot_refusal("a = \"" + std::string(1 << 20, 'x')), {"robot.toml:1:"});
}

TEST(HostileToml, MessagesStayShortAndPrintable) {
  const std::string key = "\"\\u001b[31m" + std::string(1 << 16, 'k') + "\"";
  const std::string value = "\"\\u001b" + std::string(1 << 16, 'v') + "\"";
  for (const std::string& message :
       {robot_refusal(with(kRobot, "sign = -1", key + " = 1")),
        robot_refusal(with(kRobot, "\"cellcal.robot/1\"", value)),
        robot_refusal(with(kRobot, "[\"theta\", \"beta\"]", "[" + value + "]")),
        cell_refusal(with(kCell, "\"wire\"", value)),
        cell_refusal(with(kCell, "[\"S1\", \"S2\"]", "[\"S1\", " + value + "]"))}) {
    EXPECT_LT(message.size(), 1000u);
    EXPECT_EQ(message.find('\x1b'), std::string::npos);
  }
}

TEST(HostileToml, ControlCharactersInIdsAndPathsAreRefusedWithTheirKey) {
  for (const std::string& bad :
       {"\"S\\u0001\""s, "\"S\\n1\""s, "\"S1\\t\""s, "\"S\\u001b[2J\""s, "\"S\\u007f\""s,
        "\"S\\u009b2J\""s, "\"S\\u202e1\""s, "\"S\\u2066\""s, "\"\"\"S\n1\"\"\""s}) {
    SCOPED_TRACE(bad);
    expect_words(cell_refusal(with(kCell, "id = \"S1\"", "id = " + bad)),
                 {"cell.toml:", "id", "control characters"});
    expect_words(cell_refusal(with(kCell, "\"two.toml\"", bad)), {"cell.toml:2", "robot"});
    expect_words(cell_refusal(with(kCell, "[\"S1\", \"S2\"]", "[" + bad + ", \"S2\"]")),
                 {"cell.toml:", "between", "control characters"});
    expect_words(robot_refusal(with(kRobot, "name = \"A1\"", "name = " + bad)),
                 {"robot.toml:", "name", "control characters"});
    expect_words(robot_refusal(with(kRobot, "name = \"Two axes\"", "name = " + bad)),
                 {"robot.toml:2", "name", "control characters"});
  }
}

TEST(HostileToml, AnIdThatACellFileTakesComesBackFromATableOfTouches) {
  // Every byte allowed in an id, one at a time, at the start, the end and in the middle.
  for (int byte = 1; byte < 0x80; ++byte)
    for (const std::string& id : {"S"s + static_cast<char>(byte), static_cast<char>(byte) + "S"s,
                                  "S"s + static_cast<char>(byte) + "1"}) {
      Cell cell;
      try {
        cell =
            read_cell(TomlTable::parse(with(with(kCell, "[\"S1\", ", "[" + toml_string(id) + ", "),
                                            "id = \"S1\"", "id = " + toml_string(id)),
                                       "cell.toml"),
                      testing::robot());
      } catch (const FileError&) {
        continue;
      }
      Touch touch;
      touch.joint_rad = {0.1, 0.2};
      touch.target = id;
      const auto back = parse_touches(format_touches({touch}, cell.robot), "touches.csv", cell);
      ASSERT_EQ(back.size(), 1u) << byte;
      EXPECT_EQ(back[0].target, id) << byte;
    }
}

TEST(HostileToml, ARobotsSourceMayHaveLinesAndNoEscapes) {
  const std::string lines = with(kRobot, "\"made up\"", "\"\"\"of a table\n\tof another\"\"\"");
  EXPECT_EQ(read_robot(TomlTable::parse(lines, "robot.toml")).source, "of a table\n\tof another");
  expect_words(robot_refusal(with(kRobot, "\"made up\"", "\"\\u001b[2J\"")),
               {"robot.toml:3", "source", "control characters"});
}

TEST(HostileToml, AJointIsNotNamedLikeAColumnOfTouches) {
  for (const char* column : {"target", "set", "time", "x_mm", "sigma_mm"})
    expect_words(robot_refusal(with(kRobot, "name = \"A1\"", "name = \""s + column + "\"")),
                 {"robot.toml:", "joint[1].name", column});
}

TEST(HostileToml, ByteOrderMarksWindowsLineEndsAndCommentsAreHarmless) {
  std::string windows;
  for (const char c : std::string(kRobot)) windows += c == '\n' ? "\r\n" : std::string(1, c);
  for (const std::string& text : {"\xEF\xBB\xBF" + std::string(kRobot), windows,
                                  "# a comment = 1\n" + std::string(kRobot) + "# end"})
    EXPECT_EQ(robot_to_toml(read_robot(TomlTable::parse(text, "robot.toml"))),
              robot_to_toml(testing::robot()));
}

TEST(HostileToml, EveryTruncationIsReadOrRefusedWithItsName) {
  const std::string whole(kCell);
  for (std::size_t length = 0; length < whole.size(); ++length) {
    try {
      (void)read_cell(TomlTable::parse(whole.substr(0, length), "cell.toml"), testing::robot());
      EXPECT_GE(length, whole.find("radius_offset_sigma_mm") - 1);
    } catch (const FileError& error) {
      EXPECT_EQ(error.file, "cell.toml") << error.what();
    }
  }
}

std::string json_refusal(const std::string& text) {
  return refusal([&] { (void)calibration_from_json(text, "cal.json"); }, "cal.json");
}

TEST(HostileJson, GarbageIsRefusedByName) {
  for (const std::string& text :
       {""s, "{"s, "[]"s, "null"s, "1"s, "\"x\""s, "{}"s, "\0"s, "{\"format\": 1}"s,
        "{\"format\": null}"s, "\xFF"s, "{\"format\": \"cellcal.calibration/2\"}"s,
        "{\"format\": \"cellcal.calibration/1\"}"s})
    expect_words(json_refusal(text), {"cal.json"});
}

TEST(HostileJson, DeepNestingIsRefused) {
  constexpr int kDeep = 200000;
  const std::string head = "{\"format\": \"cellcal.calibration/1\", \"robot\": ";
  for (const std::string& text :
       {repeated("[", kDeep), repeated("[", kDeep) + repeated("]", kDeep),
        repeated("{\"a\":", kDeep) + "1" + repeated("}", kDeep),
        head + repeated("{\"a\":", kDeep) + "1" + repeated("}", kDeep) + "}",
        head + "{\"a\":" + repeated("[", kDeep) + repeated("]", kDeep) + "}}"})
    expect_words(json_refusal(text), {"cal.json"});
}

}  // namespace
}  // namespace cellcal::calib
