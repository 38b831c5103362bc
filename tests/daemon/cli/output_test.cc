// An output never replaces what the same command has read or written.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "calib/files/calibration_json.h"
#include "calib/files/cell_file.h"
#include "tests/daemon/cli/content.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

namespace fs = std::filesystem;

class OutputOfACommand : public ::testing::Test {
 protected:
  OutputOfACommand() {
    put("robot.toml", calib::robot_to_toml(cell().robot));
    std::string text = content(CELLCAL_DEMO_CELL);
    const std::size_t at = text.find("robot = \"");
    put("cell.toml", text.replace(at, text.find('\n', at) - at, "robot = \"robot.toml\""));
    calib::Calibration c = calibration();
    c.verdict.judged = true;
    put("cal.json", calib::calibration_to_json(c));
    put("poses.csv", "x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\n980.5,-120.25,700,20,75,-10\n");
    put("joints.csv", "A1,A2,A3,A4,A5,A6\n0,-90,90,0,30,0\n");
    put("config.dat", taught(cell().robot, frames(), {}).config);
    EXPECT_EQ(run_program({CELLCAL, "plan", "--cell", dir_ / "cell.toml", "--touches", "12", "-o",
                           dir_ / "touches.csv"})
                  .status,
              0);
  }
  void put(const std::string& name, const std::string& text) const {
    std::ofstream(dir_ / name, std::ios::binary) << text;
  }
  /// Words with a dot are files of the folder.
  Outcome run(const std::string& words) const {
    std::vector<std::string> all{CELLCAL};
    std::istringstream in(words);
    for (std::string word; in >> word;)
      all.push_back(word.find('.') == std::string::npos ? word : (dir_ / word).string());
    return run_program(all);
  }

  TemporaryDirectory dir_;
};

TEST(AnOutputFolder, OfAReadOnlyDiskIsNamedSoAndSudoIsNotAdvised) {
  const TemporaryDirectory dir;
  const Outcome outcome = run_program(
      {"/usr/bin/unshare", "-rm", "sh", "-c",
       "mount -t tmpfs -o ro none \"$1\" || exit 77; exec \"$0\" new-cell -o \"$1/cell.toml\"",
       CELLCAL, dir.path()});
  if (outcome.status == 77 || outcome.status == 127 || outcome.err.starts_with("unshare"))
    GTEST_SKIP() << "no file system can be mounted here: " << outcome.err;
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("Read-only file system. Choose another folder"), std::string::npos)
      << outcome.err;
  EXPECT_EQ(outcome.err.find("sudo"), std::string::npos) << outcome.err;
}

TEST_F(OutputOfACommand, IsRefusedWhereItIsAnInputOfTheCommand) {
  fs::create_hard_link(dir_ / "touches.csv", dir_ / "same.csv");
  fs::create_symlink("cell.toml", dir_ / "link.toml");
  for (const auto& [command, output] :
       {std::pair{"identify --cell cell.toml --touches touches.csv", "-o cell.toml"},
        {"identify --cell cell.toml --touches touches.csv", "-o link.toml"},
        {"identify --cell cell.toml --touches touches.csv", "-o touches.csv"},
        {"identify --cell cell.toml --touches touches.csv", "-o same.csv"},
        {"plan --touches 12 --cell cell.toml", "-o cell.toml"},
        {"plan --touches 12 --cell cell.toml", "-o robot.toml"},
        {"plan --touches 12 --cell cell.toml", "--picture cell.toml"},
        {"predict --calibration cal.json --joints joints.csv", "-o cal.json"},
        {"correct --calibration cal.json --poses poses.csv", "-o poses.csv"},
        {"correct --calibration cal.json --poses poses.csv", "-o cal.json"},
        {"frames --calibration cal.json --config config.dat", "-o config.dat"},
        {"export-robot --calibration cal.json", "-o cal.json"},
        {"import-robot --robot robot.toml", "-o robot.toml"}}) {
    SCOPED_TRACE(std::string(command) + " " + output);
    const fs::path file = dir_ / std::string(output).substr(std::string(output).find(' ') + 1);
    const std::string before = content(file);
    const Outcome refused = run(std::string(command) + " " + output);
    EXPECT_EQ(refused.status, 1) << refused.out;
    EXPECT_NE(
        refused.err.find(file.string() + " is an input of this command. Choose another file\n"),
        std::string::npos)
        << refused.err;
    EXPECT_EQ(content(file), before);
  }
}

TEST_F(OutputOfACommand, IsRefusedWhereItIsAnotherOutputOfTheCommand) {
  const Outcome refused = run("plan --touches 12 --cell cell.toml --picture both.csv -o both.csv");
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("both.csv is another output of this command. Choose another file\n"),
            std::string::npos)
      << refused.err;
  EXPECT_EQ(run("plan --touches 12 --cell cell.toml --picture p.svg -o p.csv").status, 0);
  EXPECT_EQ(run("plan --touches 12 --cell cell.toml --picture p.svg -o p.csv").status, 0)
      << "an earlier output is replaced";
}

TEST_F(OutputOfACommand, ThatIsANewCellIsNeitherItsRobotNorItsSpheres) {
  put("spheres.csv", "id,diameter_mm\nS1,25\nS2,25\nS3,25\n");
  for (const char* output : {"robot.toml", "spheres.csv"}) {
    const std::string before = content(dir_ / output);
    const Outcome refused = run_program({CELLCAL, "new-cell", "--force", "-o", dir_ / output,
                                         "--robot", dir_ / "robot.toml", "--tool", "0,0,300",
                                         "--mass", "2", "--spheres", dir_ / "spheres.csv"});
    EXPECT_EQ(refused.status, 1) << refused.out;
    EXPECT_NE(refused.err.find(" is an input of this command"), std::string::npos) << refused.err;
    EXPECT_EQ(content(dir_ / output), before);
  }
}

}  // namespace
}  // namespace cellcal::daemon::testing
