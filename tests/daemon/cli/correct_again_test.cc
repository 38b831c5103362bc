// cellcal correct of programs that it has written: a second correction, another calibration, the way back.

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "calib/files/input_file.h"
#include "tests/daemon/cli/content.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

class CorrectedAgain : public ::testing::Test {
 protected:
  CorrectedAgain() {
    calib::Calibration c = calibration();
    c.verdict.judged = true;
    put("old.json", calib::calibration_to_json(c));
    for (calib::ParameterResult& one : c.parameters)
      if (calib::parameter_name(c.cell, one.key) == "A2.a") one.correction += 4e-4;
    put("new.json", calib::calibration_to_json(c));
    const KrlProgram program = taught(cell().robot, frames(), postures(3));
    put("weld.src", program.src);
    put("weld.dat", program.dat);
    put("$config.dat", program.config);
    put("bk/KRC/R1/System/$config.dat", program.config);
    put("bk/KRC/R1/Program/weld.src", program.src);
    put("bk/KRC/R1/Program/weld.dat", program.dat);
  }
  void put(const std::string& name, const std::string& text) const {
    std::filesystem::create_directories((dir_ / name).parent_path());
    std::ofstream(dir_ / name, std::ios::binary) << text;
  }
  /// `way`: --from or --upload, too.
  Outcome corrected(const std::string& calibration, const std::string& program,
                    const std::string& to, const std::vector<std::string>& way = {}) const {
    std::vector<std::string> all = {CELLCAL, "correct", "--calibration", dir_ / calibration,
                                    "-o",    dir_ / to};
    if (program.ends_with(".src"))
      all.insert(all.end(), {"--program", dir_ / program, "--config", dir_ / "$config.dat"});
    else
      all.insert(all.end(), {"--backup", dir_ / program});
    all.insert(all.end(), way.begin(), way.end());
    return run_program(all);
  }
  std::vector<std::string> from(const char* calibration) const {
    return {"--from", dir_ / calibration};
  }
  void expect_refused(const Outcome& outcome, const std::string& words) const {
    EXPECT_EQ(outcome.status, 1) << outcome.out;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(dir_ / "none"));
  }
  /// Largest difference of two numbers of the points: mm or deg.
  double apart(const std::string& one, const std::string& other) const {
    const std::vector<double> a = numbers_in(one), b = numbers_in(other);
    EXPECT_EQ(a.size(), b.size());
    EXPECT_GT(a.size(), 17U);
    double most = 0.0;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
      most = std::max(most, std::abs(a[i] - b[i]));
    return most;
  }
  std::vector<double> numbers_in(const std::string& file) const {
    const std::string text = content(dir_ / file);
    std::vector<double> all;
    for (std::size_t at = text.find_first_of("0123456789"); at < text.size();
         at = text.find_first_of("0123456789", at)) {
      std::size_t length = 0;
      const double value = std::stod(text.substr(at), &length);
      all.push_back(text[at - 1] == '-' ? -value : value);
      at += length;
    }
    return all;
  }

  TemporaryDirectory dir_;
};

constexpr double kRoundings = 0.003;  // mm, deg; the calibrations are 0.4 mm apart

TEST_F(CorrectedAgain, ByTheNextCalibrationIsAsTheOriginalCorrectedByIt) {
  const Outcome first = corrected("old.json", "weld.src", "out");
  ASSERT_EQ(first.status, 0) << first.err;
  EXPECT_NE(first.out.find(
                "keep the originals: after the next calibration correct them again, or the written "
                "programs with --from " +
                std::string(dir_ / "old.json")),
            std::string::npos)
      << first.out;
  expect_refused(
      corrected("new.json", "out/weld.src", "none"),
      "weld.corrected.json). Correct the original program instead, or give the calibration "
      "that it was corrected with: --from OLD.json");
  ASSERT_EQ(corrected("new.json", "weld.src", "direct").status, 0);
  const Outcome carried = corrected("new.json", "out/weld.src", "carried", from("old.json"));
  ASSERT_EQ(carried.status, 0) << carried.err;
  EXPECT_LT(apart("carried/weld.dat", "direct/weld.dat"), kRoundings);
  EXPECT_GT(apart("carried/weld.dat", "out/weld.dat"), 20 * kRoundings);
  expect_refused(corrected("new.json", "out/weld.src", "none", from("new.json")),
                 "was corrected with another calibration than " + std::string(dir_ / "new.json") +
                     ": old.json, SHA-256 " + calib::sha256(content(dir_ / "old.json")));
}

TEST_F(CorrectedAgain, BackToTheOriginalOnlyWithItsOwnCalibrationAndOnce) {
  ASSERT_EQ(corrected("old.json", "weld.src", "out").status, 0);
  expect_refused(corrected("new.json", "out/weld.src", "none", {"--upload"}),
                 "another calibration than " + std::string(dir_ / "new.json") + ": old.json");
  const Outcome back = corrected("old.json", "out/weld.src", "back", {"--upload"});
  ASSERT_EQ(back.status, 0) << back.err;
  EXPECT_EQ(back.out.find("keep the originals"), std::string::npos) << back.out;
  EXPECT_LT(apart("back/weld.dat", "weld.dat"), kRoundings);
  expect_refused(corrected("old.json", "back/weld.src", "none", {"--upload"}),
                 "is taken back already");
  expect_refused(corrected("new.json", "back/weld.src", "none", from("old.json")),
                 "Correct it without --from");
  EXPECT_EQ(corrected("new.json", "back/weld.src", "again").status, 0);
}

TEST_F(CorrectedAgain, ABackupIsLikewiseAndItsProgramsAreRefusedOneByOne) {
  ASSERT_EQ(corrected("old.json", "bk", "out").status, 0);
  put("out/KRC/R1/System/$config.dat",
      content(dir_ / "$config.dat"));  // unchanged files, as on the controller
  put("out/KRC/R1/Program/weld.src", content(dir_ / "weld.src"));
  expect_refused(corrected("new.json", "out", "none"), "is corrected already");
  expect_refused(corrected("new.json", "out/KRC/R1/Program/weld.src", "none"),
                 "cellcal.corrected.json). Correct the original program instead");
  expect_refused(corrected("new.json", "out", "none", from("new.json")),
                 "another calibration than " + std::string(dir_ / "new.json") + ": old.json");
  ASSERT_EQ(corrected("new.json", "bk", "direct").status, 0);
  const Outcome carried = corrected("new.json", "out", "carried", from("old.json"));
  ASSERT_EQ(carried.status, 0) << carried.err;
  EXPECT_LT(apart("carried/KRC/R1/Program/weld.dat", "direct/KRC/R1/Program/weld.dat"), kRoundings);
}

TEST_F(CorrectedAgain, OneOfRunTimeIsTakenBackFirst) {
  ASSERT_EQ(corrected("old.json", "weld.src", "out", {"--at-run-time", "--serial", "5"}).status, 0);
  put("out/weld.dat", content(dir_ / "weld.dat"));
  expect_refused(corrected("new.json", "out/weld.src", "none", from("old.json")),
                 "which --restore gives back");
}

}  // namespace
}  // namespace cellcal::daemon::testing
