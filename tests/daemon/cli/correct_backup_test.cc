// cellcal correct --backup with what other people's backups hold, and with controller files of another robot.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "tests/daemon/cli/content.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

constexpr const char* kTool = "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n";
constexpr const char* kOtherTool = "TOOL_DATA[1]={X 59.9,Y 54.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n";
const std::vector<std::string> kRunTimeWay = {"--at-run-time", "--serial", "5"};

class CorrectBackup : public ::testing::Test {
 protected:
  CorrectBackup() {
    publish(calibration());
    put("bk/KRC/R1/System/$config.dat", kTool);
    put("bk/KRC/R1/Program/a.src", "DEF A()\nBAS(#TOOL,1)\nBAS(#BASE,0)\nPTP XA\nEND\n");
    put("bk/KRC/R1/Program/a.dat", "DECL E6POS XA=" + pose_text(postures(1)[0]) + "\n");
  }
  void publish(calib::Calibration c) const {
    c.verdict.judged = true;
    put("cal.json", calib::calibration_to_json(c));
  }
  std::string put(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((dir_ / name).parent_path());
    std::ofstream(dir_ / name, std::ios::binary) << text;
    return dir_ / name;
  }
  Outcome run_correct(const std::vector<std::string>& what,
                      const std::vector<std::string>& more = {}) const {
    std::filesystem::remove_all(dir_ / "out");
    std::vector<std::string> all = {CELLCAL,           "correct", "--calibration",
                                    dir_ / "cal.json", "-o",      dir_ / "out"};
    all.insert(all.end(), what.begin(), what.end());
    all.insert(all.end(), more.begin(), more.end());
    return run_program(all);
  }
  Outcome backup(const std::vector<std::string>& more = {}) const {
    return run_correct({"--backup", dir_ / "bk"}, more);
  }
  /// With what a refusal of either way says.
  void expect_refused(const std::vector<std::string>& what, const std::string& words) const {
    for (const auto& way : {std::vector<std::string>{}, kRunTimeWay}) {
      const Outcome outcome = run_correct(what, way);
      EXPECT_EQ(outcome.status, 1) << outcome.out;
      EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
      EXPECT_FALSE(std::filesystem::exists(dir_ / "out"));
    }
  }
  bool written(const std::string& name) const {
    return std::filesystem::exists(dir_ / "out" / name);
  }

  TemporaryDirectory dir_;
};

TEST_F(CorrectBackup, IsRefusedWithTheFilesOfTwoRobots) {
  put("bk/KRC/STEU/$config.dat", kOtherTool);  // the controller's side has its own
  EXPECT_EQ(backup().status, 0);
  put("bk/old/$config.dat", kOtherTool);
  expect_refused({"--backup", dir_ / "bk"},
                 "both KRC/R1/System/$config.dat and old/$config.dat. Give the files of one robot");
}

TEST_F(CorrectBackup, AndProgramRefuseAToolThatTwoGivenFilesStateOtherwise) {
  const std::string other = put("other.dat", kOtherTool), same = put("same.dat", kTool);
  const std::string words = "other.dat:1: TOOL_DATA[1] is not as stated before";
  expect_refused({"--backup", dir_ / "bk", "--config", other}, words);
  const std::vector<std::string> program = {"--program", dir_ / "bk/KRC/R1/Program/a.src",
                                            "--config", same};
  expect_refused({program[0], program[1], program[2], program[3], "--config", other}, words);
  EXPECT_EQ(run_correct(program, {"--config", put("more.dat", kTool)}).status, 0);
}

TEST_F(CorrectBackup, OfAProgramFolderAloneTakesTheConfigurationAndWritesItsPoints) {
  std::filesystem::remove(dir_ / "bk/KRC/R1/System/$config.dat");
  const std::string config = put("mine/$config.dat", kTool + std::string("DECL GLOBAL E6POS XG=") +
                                                         pose_text(postures(2)[1]) + "\n");
  put("bk/b.src", "DEF B()\nBAS(#TOOL,1)\nBAS(#BASE,0)\nPTP XG\nEND\n");
  const Outcome outcome = backup({"--config", config});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("2 of 2 modules with motions corrected, 2 points"), std::string::npos)
      << outcome.out;
  EXPECT_NE(outcome.out.find(" mm (95 %) or less at the 2 points with tool 1"), std::string::npos)
      << outcome.out;
  EXPECT_NE(content(dir_ / "out/$config.dat"), "");
  EXPECT_NE(content(dir_ / "out/$config.dat"), content(config));
  EXPECT_TRUE(written("KRC/R1/Program/a.dat"));
  const Outcome onto_itself =
      run_program({CELLCAL, "correct", "--calibration", dir_ / "cal.json", "--backup", dir_ / "bk",
                   "--config", config, "-o", dir_ / "mine", "--force"});
  EXPECT_NE(onto_itself.err.find("is the program itself"), std::string::npos) << onto_itself.err;
  EXPECT_EQ(backup({"--config", config, kRunTimeWay[0], kRunTimeWay[1], kRunTimeWay[2]}).status, 0);
  EXPECT_EQ(backup({"--config", dir_ / "bk/b.src"}).status, 1);
}

TEST_F(CorrectBackup, GivenItsOwnConfigurationOnceMoreIsAsWithout) {
  EXPECT_EQ(backup({"--config", dir_ / "bk/KRC/R1/System/$config.dat"}).status, 0);
}

TEST_F(CorrectBackup, IsRefusedWhereTheControllerHasAnotherArm) {
  const auto machine = [&](const char* length) {
    put("bk/KRC/R1/Mada/$machine.dat", std::string("$LENGTH_A=") + length + "\n$LENGTH_B=600.0\n");
  };
  machine("180.0");
  EXPECT_EQ(backup().status, 0) << backup().err;
  machine("410.0");
  expect_refused({"--backup", dir_ / "bk"}, "cellcal correct: $LENGTH_A 410.000 mm (180.000): ");
  expect_refused(
      {"--program", dir_ / "bk/KRC/R1/Program/a.src", "--config",
       dir_ / "bk/KRC/R1/System/$config.dat", "--config", dir_ / "bk/KRC/R1/Mada/$machine.dat"},
      "$LENGTH_A 410.000 mm (180.000)");
  EXPECT_EQ(backup({"--nominal-controller"}).status, 0);
  calib::Calibration measured = calibration();
  measured.cell.robot.absolute_accuracy = calib::AbsoluteAccuracy::kInFile;
  publish(measured);
  EXPECT_EQ(backup().status, 0) << "its lengths are measured ones";
}

TEST_F(CorrectBackup, OfAnArmThatTurnsTheOtherWayIsRefused) {
  put("bk/KRC/R1/Mada/$machine.dat", "$LENGTH_A=180.0\n$AXIS_DIR[2]=-1\n");
  expect_refused({"--backup", dir_ / "bk"}, "cellcal correct: $AXIS_DIR: ");
}

TEST_F(CorrectBackup, WithoutAProgramIsRefusedAndNamesAnArchiveInIt) {
  std::filesystem::create_directories(dir_ / "empty");
  expect_refused({"--backup", dir_ / "empty"}, "empty: no KRL program (.src) in it\n");
  put("empty/Robot1.zip", "PK");
  expect_refused({"--backup", dir_ / "empty"}, "empty/Robot1.zip and give that");
  std::string archive = content(std::filesystem::path(CELLCAL_ZIP_CORPUS) / "deflated.zip");
  for (const auto& [from, to] :
       {std::pair("pick.src", "pick.zip"), std::pair("pick.dat", "pick.txt")})
    for (std::size_t at = 0; (at = archive.find(from, at)) != std::string::npos;)
      archive.replace(at, 8, to);
  expect_refused({"--backup", put("outer.zip", archive)},
                 "Unpack KRC/R1/Program/pick.zip and give that");
}

TEST_F(CorrectBackup, ThatIsAnotherArchiveOrAProgramSaysWhatToGive) {
  for (const std::string& place :
       {put("b.rar", "Rar!"), std::string(dir_ / "bk/KRC/R1/Program/a.src")})
    expect_refused({"--backup", place}, place + ": neither folder nor ZIP archive.");
}

TEST_F(CorrectBackup, AndProgramThatDoNotMoveAreStatus0OfflineAndAtRunTime) {
  put("still/still.src", "DEF STILL()\nWAIT SEC 1\nEND\n");
  for (const auto& way : {std::vector<std::string>{}, kRunTimeWay})
    for (const auto& what : {std::vector<std::string>{"--backup", dir_ / "still"},
                             std::vector<std::string>{"--program", dir_ / "still/still.src"}}) {
      const Outcome outcome = run_correct(what, way);
      EXPECT_EQ(outcome.status, 0) << outcome.err;
      EXPECT_EQ(outcome.out.find("-o FOLDER"), std::string::npos) << outcome.out;
    }
}

TEST_F(CorrectBackup, LeavesSourcesThatAreNoKrlAndNamesThem) {
  std::string wide;
  for (const char c : std::string("DEF U()\nPTP XA\nEND\n")) wide += std::string{c, '\0'};
  put("bk/KRC/R1/Program/wide.src", "\xff\xfe" + wide);
  put("bk/KRC/R1/Program/._a.src", std::string("\x00\x05\x16\x07\x00", 5));
  put("bk/KRC/R1/Program/all.sub", std::string(1, '\0') + "ABCDEFGHabcdefgh");
  const std::string large = "DEFDAT large\n;" + std::string(17u << 20, 'x') + "\nENDDAT\n";
  put("bk/KRC/R1/Program/large.dat", large);
  put("bk/KRC/R1/Program/long.src", "DEF LONG()\n;" + std::string(20000, 'x') + "\nEND\n");
  for (const auto& way : {std::vector<std::string>{}, kRunTimeWay}) {
    const Outcome outcome = backup(way);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    EXPECT_NE(outcome.out.find("1 of 1 modules"), std::string::npos) << outcome.out;
    for (const char* name : {"wide.src", "._a.src", "all.sub"})
      EXPECT_NE(outcome.out.find(std::string("left as it is: KRC/R1/Program/") + name +
                                 " (no readable KRL)"),
                std::string::npos)
          << outcome.out;
    EXPECT_NE(outcome.out.find("left as it is: KRC/R1/Program/large.dat (above 16 MB)"),
              std::string::npos)
        << outcome.out;
    EXPECT_EQ(outcome.out.find("long.src"), std::string::npos) << outcome.out;
  }
  put("bk/KRC/R1/System/$config.dat", large);
  expect_refused({"--backup", dir_ / "bk"}, "$config.dat: more than 16 MB");
  put("bk/KRC/R1/System/$config.dat", kTool);
  // Its own points, and what it changes for others, cannot be left out.
  for (const char* name : {"large.src", "Large.SUB"}) {
    put(std::string("bk/KRC/R1/Program/") + name, "DEF LARGE()\nEND\n");
    expect_refused({"--backup", dir_ / "bk"}, "large.dat: more than 16 MB");
    std::filesystem::remove(dir_ / "bk/KRC/R1/Program" / name);
  }
  const std::string program =
      put("bk/KRC/R1/Program/huge.src", "DEF HUGE()\n;" + std::string(17u << 20, 'x') + "\nEND\n");
  expect_refused({"--backup", dir_ / "bk"}, "huge.src: more than 16 MB");
  std::filesystem::remove(program);
  put("bk/KRC/R1/Program/damaged.src", std::string("DEF D()\n\0END\n", 13));
  EXPECT_NE(backup().err.find("damaged.src: byte 8 is NUL"), std::string::npos) << backup().err;
}

TEST_F(CorrectBackup, IsRefusedByTheNameOfAConfigurationThatCannotBeRead) {
  for (const char* name : {"System/$config.dat", "Mada/$machine.dat"}) {
    put(std::string("bk/KRC/R1/") + name, std::string("\xff\xfeT\0", 4));
    expect_refused({"--backup", dir_ / "bk"}, std::string(name) + ": byte 3 is NUL");
    put(std::string("bk/KRC/R1/") + name, kTool);
  }
}

}  // namespace
}  // namespace cellcal::daemon::testing
