// "cellcal.cell/1": semantics, and refusal of every kind of error.

#include "calib/files/cell_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "calib/files/input_file.h"
#include "calib/model/units.h"
#include "tests/calib/files/documents.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

using testing::Broken;
using testing::cell_refusal;
using testing::expect_words;
using testing::kCell;
using testing::kRobot;
using testing::line_of;
using testing::refusal;
using testing::with;
using testing::without;

TEST(CellFile, ReadsMillimetresIntoMetres) {
  const Cell cell = testing::cell();
  EXPECT_LT((cell.tool.tcp.translation() - Eigen::Vector3d(0.0599, 0.0505, 0.4103)).norm(), 1e-15);
  EXPECT_LT((cell.tool.tcp_sigma_m - Eigen::Vector3d(0.5e-3, 0.0, 0.25e-3)).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(cell.tool.mass_kg, 1.535);
  EXPECT_LT((cell.tool.com_m - Eigen::Vector3d(0.030, 0.025, 0.205)).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(cell.tool.length_m, 0.4177);
  EXPECT_DOUBLE_EQ(cell.tool.tip_radius_m, 0.6e-3);
  EXPECT_DOUBLE_EQ(cell.tool.deflection_sigma, 0.003);
  ASSERT_EQ(cell.targets.size(), 3u);
  EXPECT_EQ(cell.targets[0].kind, TargetKind::kSphere);
  EXPECT_DOUBLE_EQ(cell.targets[0].diameter_m, 0.0614);
  EXPECT_DOUBLE_EQ(cell.targets[0].diameter_sigma_m, 2e-6);
  EXPECT_TRUE(cell.targets[0].has_centre);
  EXPECT_LT((cell.targets[0].centre_m - Eigen::Vector3d(1.34, 0.24, 0.35)).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(cell.targets[0].centre_sigma_m, 0.010);
  EXPECT_FALSE(cell.targets[1].has_centre);
  EXPECT_EQ(cell.targets[1].diameter_sigma_m, 0.0);
  EXPECT_EQ(cell.targets[2].kind, TargetKind::kWire);
  ASSERT_EQ(cell.lengths.size(), 1u);
  EXPECT_EQ(cell.lengths[0].from, "S1");
  EXPECT_EQ(cell.lengths[0].to, "S2");
  EXPECT_DOUBLE_EQ(cell.lengths[0].length_m, 0.500012);
  EXPECT_DOUBLE_EQ(cell.lengths[0].sigma_m, 5e-6);
  EXPECT_DOUBLE_EQ(cell.touch_sigma_m, 3e-5);
  EXPECT_DOUBLE_EQ(cell.radius_offset_sigma_m, 3e-4);
  EXPECT_EQ(cell.target_index("W"), 2u);
  EXPECT_THROW((void)cell.target_index("S9"), std::out_of_range);
}

TEST(CellFile, TakesSerialNumbersAndCertificatesAndRefusesWhatIsNone) {
  const auto read = [](const std::string& what, const std::string& by) -> std::string {
    const std::string text = by.empty() ? kCell + what : with(kCell, what, by);
    try {
      read_cell(TomlTable::parse(text, "cell.toml"), testing::robot());
      return "";
    } catch (const FileError& error) {
      return error.what();
    }
  };
  const std::string target = "id = \"S1\"", length = "mm = 500.012";
  EXPECT_EQ(read(target, target + "\nserial = \"7\"\ncertificate = \"L 12, PTB\"\n"
                                  "certificate_date = \"2024-02-29\""),
            "");
  EXPECT_EQ(read(length, length + "\ncertificate = \"L 13\"\ncertificate_date = \"2026-04-01\""),
            "");
  EXPECT_EQ(read("\n[identity]\nsite = \"Hall 3\"\noperator = \"A\"\nrobot_serial = \"1\"\n"
                 "controller_serial = \"2\"\nsensor = \"board\"\nsensor_serial = \"3\"\n",
                 ""),
            "");
  for (const char* wrong :
       {"2026-02-30", "2026-4-1", "yesterday", "2026-04-01x", "+026-04-01", ""}) {
    const std::string day = "\ncertificate_date = \"" + std::string(wrong) + "\"";
    EXPECT_NE(read(length, length + day).find("certificate_date: must be a day"), std::string::npos)
        << wrong;
  }
  EXPECT_NE(read(length, length + "\nserial = \"1\"").find("serial"), std::string::npos);
  EXPECT_NE(read("\n[identity]\nboss = \"B\"\n", "").find("boss"), std::string::npos);
  EXPECT_NE(read("\n[identity]\nsite = \"" + std::string(201, 'x') + "\"\n", "").find("200 bytes"),
            std::string::npos);
  EXPECT_NE(read("\n[identity]\nsite = 3\n", "").find("site"), std::string::npos);
}

TEST(CellFile, KeepsTheErrorThatIsRequired) {
  const auto read = [](const std::string& text) {
    return read_cell(TomlTable::parse(text, "cell.toml"), testing::robot());
  };
  EXPECT_FALSE(read(kCell).required_m);
  const auto with_key = [](const std::string& value) {
    return with(kCell, "robot = \"two.toml\"", "robot = \"two.toml\"\nrequired_mm = " + value);
  };
  const Cell cell = read(with_key("0.25"));
  EXPECT_DOUBLE_EQ(cell.required_m.value_or(0.0), 0.25e-3);
  EXPECT_DOUBLE_EQ(read(cell_to_toml(cell, "two.toml")).required_m.value_or(0.0), 0.25e-3);
  for (const char* bad : {"0", "-1", "nan", "inf", "1e9", "[1]", "\"fine\""})
    expect_words(cell_refusal(with_key(bad)), {"required_mm"});
}

TEST(CellFile, PutsTheToolsMassHalfWayAndTakesItsLengthFromTheTcp) {
  const std::string plain =
      without(without(kCell, "com_mm = [30.0, 25.0, 205.0]"), "length_mm = 417.7");
  const Cell cell = read_cell(TomlTable::parse(plain, "cell.toml"), testing::robot());
  EXPECT_LT((cell.tool.com_m - cell.tool.tcp.translation() / 2).norm(), 1e-15);
  EXPECT_NEAR(cell.tool.length_m, cell.tool.tcp.translation().norm(), 1e-15);
}

TEST(CellFile, NeedsEveryKeyThatHasNoDefault) {
  for (const char* line :
       {"format = \"cellcal.cell/1\"", "robot = \"two.toml\"", "xyz_mm = [59.9, 50.5, 410.3]",
        "id = \"S1\"", "kind = \"sphere\"", "diameter_mm = 61.4", "between = [\"S1\", \"S2\"]",
        "mm = 500.012", "sigma_mm = 0.005", "sigma_mm = 0.03"}) {
    const std::string key(line, std::string_view(line).find(' '));
    expect_words(cell_refusal(without(kCell, line)), {"cell.toml:", key, "missing"});
  }
  expect_words(cell_refusal(with(kCell, "[tool]", "[tule]")), {"cell.toml:", "[tool]", "missing"});
}

void expect_named_in_cell(const Broken& broken) {
  SCOPED_TRACE(broken.now);
  const std::string text = with(kCell, broken.line, broken.now);
  expect_words(cell_refusal(text),
               {"cell.toml:" + std::to_string(line_of(kCell, broken.line)) + ": ", broken.key});
}

TEST(CellFile, MayStateHowLateTheLatchIs) {
  const std::string stated = std::string(kCell) + "delay_ms = 3.5\ndelay_sigma_ms = 1.25\n";
  const Cell cell = read_cell(TomlTable::parse(stated, "cell.toml"), testing::robot());
  EXPECT_DOUBLE_EQ(cell.latch_delay_s, 3.5e-3);
  EXPECT_DOUBLE_EQ(cell.latch_delay_sigma_s, 1.25e-3);
  const Cell silent = testing::cell();
  EXPECT_EQ(silent.latch_delay_s, 0.0);
  EXPECT_EQ(silent.latch_delay_sigma_s, 0.2e-3);
  EXPECT_EQ(cell_to_toml(silent, "two.toml").find("delay"), std::string::npos);
  for (const Cell& one : {cell, silent}) {
    const Cell back =
        read_cell(TomlTable::parse(cell_to_toml(one, "two.toml"), "cell.toml"), testing::robot());
    EXPECT_DOUBLE_EQ(back.latch_delay_s, one.latch_delay_s);
    EXPECT_DOUBLE_EQ(back.latch_delay_sigma_s, one.latch_delay_sigma_s);
  }
}

TEST(CellFile, NamesLineAndKeyOfAWrongType) {
  for (const Broken& broken : std::initializer_list<Broken>{
           {"robot = \"two.toml\"", "robot = 5", "robot"},
           {"xyz_mm = [59.9, 50.5, 410.3]", "xyz_mm = [59.9, 50.5]", "tool.xyz_mm"},
           {"abc_deg = [38.84, 3.59, 0.5]", "abc_deg = 5", "tool.abc_deg"},
           {"mass_kg = 1.535", "mass_kg = \"1.535\"", "tool.mass_kg"},
           {"id = \"S2\"", "id = 2", "target[2].id"},
           {"kind = \"wire\"", "kind = 1", "target[3].kind"},
           {"diameter_mm = 38.1", "diameter_mm = [38.1]", "target[2].diameter_mm"},
           {"centre_mm = [1340.0, 240.0, 350.0]", "centre_mm = 5", "target[1].centre_mm"},
           {"between = [\"S1\", \"S2\"]", "between = \"S1 S2\"", "length[1].between"},
           {"between = [\"S1\", \"S2\"]", "between = [1, 2]", "length[1].between"}})
    expect_named_in_cell(broken);
}

TEST(CellFile, NamesLineAndKeyOfANumberOutOfRangeOrNotFinite) {
  for (const Broken& broken : std::initializer_list<Broken>{
           {"xyz_mm = [59.9, 50.5, 410.3]", "xyz_mm = [1e6, 0, 0]", "tool.xyz_mm"},
           {"xyz_mm = [59.9, 50.5, 410.3]", "xyz_mm = [nan, 0, 0]", "tool.xyz_mm"},
           {"xyz_sigma_mm = [0.5, 0, 0.25]", "xyz_sigma_mm = [-1, 0, 0]", "tool.xyz_sigma_mm"},
           {"mass_kg = 1.535", "mass_kg = -1.535", "tool.mass_kg"},
           {"mass_kg = 1.535", "mass_kg = inf", "tool.mass_kg"},
           {"length_mm = 417.7", "length_mm = -1", "tool.length_mm"},
           {"tip_radius_mm = 0.6", "tip_radius_mm = -0.6", "tool.tip_radius_mm"},
           {"deflection_sigma = 0.003", "deflection_sigma = -0.003", "tool.deflection_sigma"},
           {"diameter_mm = 61.4", "diameter_mm = 0", "target[1].diameter_mm"},
           {"diameter_mm = 61.4", "diameter_mm = -61.4", "target[1].diameter_mm"},
           {"diameter_sigma_mm = 0.002", "diameter_sigma_mm = -1", "target[1].diameter_sigma_mm"},
           {"centre_sigma_mm = 10.0", "centre_sigma_mm = nan", "target[1].centre_sigma_mm"},
           {"mm = 500.012", "mm = 0", "length[1].mm"},
           {"sigma_mm = 0.005", "sigma_mm = 0", "length[1].sigma_mm"},
           {"sigma_mm = 0.03", "sigma_mm = 0", "touch.sigma_mm"},
           {"sigma_mm = 0.03", "sigma_mm = -0.03", "touch.sigma_mm"},
           {"radius_offset_sigma_mm = 0.3", "radius_offset_sigma_mm = -inf",
            "touch.radius_offset_sigma_mm"},
           {"radius_offset_sigma_mm = 0.3", "delay_ms = 1e4", "touch.delay_ms"},
           {"radius_offset_sigma_mm = 0.3", "delay_sigma_ms = nan", "touch.delay_sigma_ms"},
           {"radius_offset_sigma_mm = 0.3", "delay_sigma_ms = -1", "touch.delay_sigma_ms"}})
    expect_named_in_cell(broken);
}

TEST(CellFile, NamesLineAndKeyOfWhatMakesNoSense) {
  for (const Broken& broken : std::initializer_list<Broken>{
           {"kind = \"wire\"", "kind = \"rope\"", "sphere"},
           {"id = \"S2\"", "id = \"S1\"", "occurs twice"},
           {"id = \"S2\"", "id = \"S,2\"", "target[2].id"},
           {"id = \"S2\"", "id = \"\"", "target[2].id"},
           {"id = \"S2\"", "id = \" S2\"", "must not begin or end with a blank"},
           {"id = \"S2\"", "id = \"tool\"", "target[2].id"},
           {"between = [\"S1\", \"S2\"]", "between = [\"S1\", \"S1\"]", "two different"},
           {"between = [\"S1\", \"S2\"]", "between = [\"S1\"]", "two different"},
           {"between = [\"S1\", \"S2\"]", "between = [\"S1\", \"S9\"]", "\"S9\""}})
    expect_named_in_cell(broken);
}

TEST(CellFile, NamesAnUnknownKeyInEveryTable) {
  for (const Broken& broken : std::initializer_list<Broken>{
           {"mass_kg = 1.535", "mass = 1.535", "tool.mass"},
           {"kind = \"wire\"", "kind = \"wire\"\ndiameter_mm = 3.0", "target[3].diameter_mm"},
           {"mm = 500.012", "mm = 500.012\ncm = 50", "length[1].cm"},
           {"radius_offset_sigma_mm = 0.3", "rho = 0.3", "touch.rho"},
           {"robot = \"two.toml\"", "robot = \"two.toml\"\nrobots = 2", "robots"}})
    expect_words(cell_refusal(with(kCell, broken.line, broken.now)),
                 {"cell.toml:", broken.key, "unknown key"});
}

TEST(CellFile, KeepsTheRoleOfACertifiedLength) {
  const auto with_role = [](const std::string& value) {
    return with(kCell, "sigma_mm = 0.005", "sigma_mm = 0.005\nrole = " + value);
  };
  const auto read = [](const std::string& text) {
    return read_cell(TomlTable::parse(text, "cell.toml"), testing::robot());
  };
  EXPECT_FALSE(read(kCell).lengths.front().is_check);
  EXPECT_FALSE(read(with_role("\"fit\"")).lengths.front().is_check);
  const Cell cell = read(with_role("\"check\""));
  EXPECT_TRUE(cell.lengths.front().is_check);
  EXPECT_TRUE(read(cell_to_toml(cell, "two.toml")).lengths.front().is_check);
  for (const char* bad : {"\"cheque\"", "1", "[]"})
    expect_words(cell_refusal(with_role(bad)), {"cell.toml:36: ", "length[1].role"});
}

TEST(CellFile, NamesTheKeyThatAMissingOneMayHaveBeenWrittenAs) {
  for (const char* now : {"diameter", "diameter_cm", "Diameter_mm", "diamter_mm", "daimeter_mm"}) {
    SCOPED_TRACE(now);
    const std::string text = with(kCell, "diameter_mm = 61.4", std::string(now) + " = 61.4");
    expect_words(cell_refusal(text),
                 {"target[1].diameter_mm: missing",
                  "\"" + std::string(now) + "\" in line " + std::to_string(line_of(text, now))});
  }
  // A key that is valid by itself is not a misspelling.
  EXPECT_EQ(cell_refusal(with(kCell, "diameter_mm = 61.4", "")).find("similar"), std::string::npos);
}

TEST(CellFile, SuggestsTheTableThatAMissingOneMayHaveBeenWrittenAs) {
  expect_words(cell_refusal(with(kCell, "[touch]", "[toch]")),
               {"the table [touch] is missing", "\"toch\" in line"});
  expect_words(cell_refusal(with(kCell, "[tool]", "[tol]")), {"the table [tool] is missing"});
  expect_words(cell_refusal(with(kCell, "[[length]]", "[[lenght]]")),
               {"lenght", "unknown key (similar: \"length\")"});
  expect_words(cell_refusal(with(kCell, "tip_radius_mm", "tip_radus_mm")),
               {"tool.tip_radus_mm", "similar: \"tip_radius_mm\""});
}

TEST(CellFile, NamesAMissingQuoteAndADecimalCommaAsWhatTheyAre) {
  for (const char* now : {"id = \"S1", "id = S1\"", "id = 'S1  # the first"}) {
    SCOPED_TRACE(now);
    const std::string text = with(kCell, "id = \"S1\"", now);
    expect_words(cell_refusal(text), {"a quote is missing"});
    const std::string line = std::to_string(line_of(text, now));
    EXPECT_NE(cell_refusal(text).find(line), std::string::npos) << cell_refusal(text);
  }
  const std::string comma = with(kCell, "diameter_mm = 61.4", "diameter_mm = 38,1");
  expect_words(cell_refusal(comma),
               {"cell.toml:" + std::to_string(line_of(comma, "38,1")), "decimal comma", "'.'"});
  expect_words(cell_refusal(with(kCell, "[1340.0, 240.0, 350.0]", "[1340,5, 240.0, 350.0]")),
               {"3 numbers, but has 4", "decimal mark is '.'"});
  // Commas in comments and strings are ignored; other errors are reported in the parser's words.
  expect_words(cell_refusal(with(kCell, "diameter_mm = 61.4", "diameter_mm = = 61.4  # 38,1")),
               {"not valid TOML"});
  EXPECT_EQ(cell_refusal(with(kCell, "mass_kg = 1.535", "mass_kg = 1.5x5  # \"1,5\" kg"))
                .find("decimal comma"),
            std::string::npos);
}

constexpr const char* kWire = "kind = \"wire\"\ncentre_sigma_mm = 5.0";

TEST(CellFile, ReadsAPlanesNormalAsADirectionAndATrackerWithoutAPlace) {
  const auto read = [](const std::string& text) {
    return read_cell(TomlTable::parse(text, "cell.toml"), testing::robot()).targets[2];
  };
  Target target = read(with(kCell, kWire,
                            "kind = \"plane\"\nnormal = [0, 3, -4]\nnormal_sigma_deg = 2\n"
                            "centre_mm = [1, 2, 3]\ncentre_sigma_mm = 5\nextent_mm = 120"));
  EXPECT_EQ(target.kind, TargetKind::kPlane);
  EXPECT_DOUBLE_EQ(target.extent_m, 0.12);
  EXPECT_TRUE(target.has_normal);
  EXPECT_LT((target.normal - Eigen::Vector3d(0.0, 0.6, -0.8)).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(target.normal_sigma_rad, 2.0 * kRadPerDeg);
  EXPECT_TRUE(target.has_centre);
  EXPECT_DOUBLE_EQ(target.centre_sigma_m, 0.005);
  target = read(with(kCell, kWire, "kind = \"plane\""));
  EXPECT_FALSE(target.has_normal);
  EXPECT_FALSE(target.has_centre);
  target = read(with(kCell, kWire, "kind = \"tracker\""));
  EXPECT_EQ(target.kind, TargetKind::kTracker);
  EXPECT_FALSE(target.has_centre);
}

TEST(CellFile, NamesLineAndKeyOfWhatAPlaneOrTrackerCannotHave) {
  const std::string line = "cell.toml:" + std::to_string(line_of(kCell, "kind = \"wire\"") + 1);
  for (const auto& [now, key] : std::initializer_list<std::pair<const char*, const char*>>{
           {"kind = \"plane\"\nnormal = [0, 0, 0]", "target[3].normal"},
           {"kind = \"plane\"\nnormal = [0, 1]", "target[3].normal"},
           {"kind = \"plane\"\nnormal = [0, nan, 1]", "target[3].normal"},
           {"kind = \"plane\"\nnormal = [0, 1e300, 1]", "target[3].normal"},
           {"kind = \"plane\"\nnormal = 1", "target[3].normal"},
           {"kind = \"plane\"\nnormal_sigma_deg = 2", "Add normal"},
           {"kind = \"plane\"\nnormal_sigma_deg = -2", "target[3].normal_sigma_deg"},
           {"kind = \"plane\"\nextent_mm = 0", "target[3].extent_mm"},
           {"kind = \"plane\"\nextent_mm = nan", "target[3].extent_mm"},
           {"kind = \"plane\"\nextent_mm = 100", "Add centre_mm and normal"},
           {"kind = \"wire\"\nextent_mm = 100", "unknown key"},
           {"kind = \"plane\"\ndiameter_mm = 2", "unknown key"},
           {"kind = \"wire\"\nnormal = [0, 0, 1]", "unknown key"},
           {"kind = \"tracker\"\nnormal = [0, 0, 1]", "unknown key"},
           {"kind = \"tracker\"\ncentre_mm = [0, 0, 1]", "unknown key"},
           {"kind = \"tracker\"\ncentre_sigma_mm = 5.0", "unknown key"}}) {
    SCOPED_TRACE(now);
    expect_words(cell_refusal(with(kCell, kWire, now)), {line, key});
  }
}

TEST(CellFile, NamesLineAndKeyOfALengthThatEndsWhereThereIsNoCentre) {
  for (const char* kind : {"plane", "tracker"}) {
    std::string text = with(kCell, kWire, std::string("kind = \"") + kind + "\"");
    const std::string between = "between = [\"S1\", \"W\"]";
    text = with(text, "between = [\"S1\", \"S2\"]", between);
    expect_words(cell_refusal(text), {"cell.toml:" + std::to_string(line_of(text, between)) + ": ",
                                      "length[1].between", "\"W\" has no centre"});
  }
}

TEST(CellFile, RefusesAnotherFormatAndACellWithoutTargets) {
  expect_words(cell_refusal(with(kCell, "cell/1", "cell/9")), {"cell.toml:1: format", "cell/1"});
  const std::string text(kCell);
  const std::string bare =
      text.substr(0, text.find("[[target]]")) + text.substr(text.find("[touch]"));
  expect_words(cell_refusal(bare), {"cell.toml:", "[[target]]", "has 0"});
}

/// A temporary directory.
class CellOnDisk : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::path(::testing::TempDir()) /
              ("cellcal-cell-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path write(const std::string& name, const std::string& text) {
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  std::filesystem::path folder_;
};

TEST_F(CellOnDisk, FindsItsRobotBesideItself) {
  write("two.toml", kRobot);
  const auto path = write("cell.toml", kCell);
  EXPECT_EQ(load_cell(path).robot.name, "Two axes");
  const CellText text = read_cell_text(path);
  EXPECT_EQ(text.robot_name, folder_ / "two.toml");
  EXPECT_EQ(text.robot_text, kRobot);
  EXPECT_EQ(text.cell_text, kCell);
}

TEST_F(CellOnDisk, FindsShippedRobotsByNameWithOrWithoutEnding) {
  for (const char* name : {"kr5_r1400", "kr5_r1400.toml"}) {
    const auto path = write("cell.toml", with(kCell, "two.toml", name));
    EXPECT_EQ(load_cell(path).robot.joints.size(), 6u) << name;
  }
}

TEST_F(CellOnDisk, SaysWhereItLookedForARobotThatIsNotThere) {
  const auto path = write("cell.toml", kCell);
  expect_words(refusal([&] { (void)load_cell(path); }),
               {"cell.toml:2: robot", "two.toml", folder_.string(), "looked for"});
}

TEST_F(CellOnDisk, ARobotThatIsNotThereIsKeptByNameWithThePlaces) {
  const auto error =
      testing::thrown<UnknownRobot>([&] { (void)find_robot_file("kr5_none", folder_); });
  EXPECT_EQ(error.name, "kr5_none");
  ASSERT_GE(error.searched.size(), 3u);
  EXPECT_EQ(error.searched[0], folder_ / "kr5_none");
  EXPECT_EQ(error.searched[2].filename(), "kr5_none.toml");
  EXPECT_EQ(error.nowhere(), "no robot file \"kr5_none\"");
  EXPECT_EQ(
      std::string(error.what())
          .find(error.nowhere() + "; looked for\n  " + (folder_ / "kr5_none").string() + "\n"),
      0u)
      << error.what();
}

TEST_F(CellOnDisk, NamesTheRobotFileWhenThatOneIsWrong) {
  write("two.toml", with(kRobot, "sign = -1", "sign = 7"));
  const auto path = write("cell.toml", kCell);
  expect_words(refusal([&] { (void)load_cell(path); }, folder_ / "two.toml"),
               {"two.toml:12: joint[1].sign"});
}

TEST_F(CellOnDisk, RefusesDirectoriesMissingFilesAndFilesTooLarge) {
  expect_words(refusal([&] { (void)load_cell(folder_); }), {folder_.string(), "directory"});
  expect_words(refusal([&] { (void)load_robot(folder_); }), {folder_.string(), "directory"});
  expect_words(refusal([&] { (void)load_touches(folder_, testing::cell()); }),
               {folder_.string(), "directory"});
  expect_words(refusal([&] { (void)load_cell(folder_ / "none.toml"); }),
               {"none.toml", "no such file"});
  expect_words(refusal([&] { (void)load_cell("/proc/self/root/dev/null/x"); }), {"/x"});
  const auto large = write("large.toml", std::string(5u << 20, '#'));
  expect_words(refusal([&] { (void)load_cell(large); }), {"large.toml", "larger than"});
  EXPECT_EQ(read_file(large).size(), 5u << 20);
  expect_words(refusal([&] { (void)read_file(large, 100); }), {"larger than 100 bytes"});
}

TEST_F(CellOnDisk, AFileThatIsADirectoryByAnotherNameIsNotARobot) {
  std::filesystem::create_directory(folder_ / "two.toml");
  const auto path = write("cell.toml", kCell);
  expect_words(refusal([&] { (void)load_cell(path); }), {"cell.toml:2: robot"});
}

TEST(Sha256, IsTheStandards) {
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(sha256(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

}  // namespace
}  // namespace cellcal::calib
