// Completed steps are derived from existing data, and revoked if the data is gone.

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

#include "calib/files/calibration_json.h"
#include "daemon/doctor/steps.h"
#include "daemon/result/outcome.h"
#include "daemon/tasks/options.h"
#include "tests/calib/random_calibration.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon {
namespace {

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

struct ACell : ::testing::Test {
  ACell() {
    const std::filesystem::path demo = CELLCAL_DEMO_CELL;
    text = content(demo);
    write(text);
    std::filesystem::copy_file(demo.parent_path() / "kr5_worn.toml", dir / "kr5_worn.toml");
    examination.cell = dir / "cell.toml";
  }
  void write(const std::string& cell) const { std::ofstream(dir / "cell.toml") << cell; }
  std::string with(const std::string& what, const std::string& instead) const {
    return std::regex_replace(text, std::regex(what), instead);
  }
  void examined(Outcome outcome) {
    examination.whole = true;
    examination.cell_text = text_of_cell(examination.cell);
    examination.checks = {{"rsi packets", outcome, "found", "advice"}};
  }
  std::int64_t session(SessionKind kind, Ending ending, const std::string& result = "") {
    SessionOptions options;
    options.kind = kind;
    SessionInputs inputs = read_inputs(dir / "cell.toml");
    inputs.options = options_to_json(options);
    const std::int64_t id = journal.begin(inputs, "t0");
    RecordEnd end{ending, ""};
    if (kind == SessionKind::kQualify && !result.empty()) {
      Qualification q;
      if (result == "passed") {
        q.noise_m = Figure{};
        q.delay = ContactDelay{};
      }
      end.result = std::make_shared<const SessionResult>(SessionResult{q});
    } else if (!result.empty()) {
      journal.store_calibration(id, result, {});
      const auto verdict = nlohmann::json::parse(result).at("verdict");
      calib::Calibration calibration;
      calibration.verdict.judged = verdict.at("publish");
      if (verdict.value("too_few_touches", false))
        calibration.verdict.findings = {{calib::FindingKind::kTooFewTouches}};
      end.result = std::make_shared<const SessionResult>(SessionResult{calibration});
    }
    journal.record(id, end, "t1");
    return id;
  }
  /// "cell done, robot done, spheres todo, ..."
  std::string steps() {
    evidence = evidence_of(examination, journal);
    std::string all;
    for (const StepSeen& one : steps_of(evidence))
      all +=
          std::string(all.empty() ? "" : ", ") + to_string(one.step) + " " + to_string(one.state);
    return all;
  }
  std::string next() {
    steps();
    const auto step = next_of(steps_of(evidence));
    return step ? to_string(*step) : "none";
  }

  testing::TemporaryDirectory dir;
  Journal journal{dir / "journal.db"};
  Examination examination;
  Evidence evidence;
  std::string text;
};

const std::string kNothing =
    "cell todo, robot todo, spheres todo, doctor todo, qualify todo, dry-run todo, first todo, calibration todo";
const std::string kPublish =
                      [] {
                        calib::Random random(1);
                        return calib::calibration_to_json(calib::testing::random_calibration(
                            cell_of(read_inputs(CELLCAL_DEMO_CELL)), random));
                      }(),
                  kUnreadable = R"({"verdict": {"publish": true}})",
                  kWithhold = R"({"verdict": {"publish": false}})";

TEST_F(ACell, ThatNobodyNamedHasEveryStepBeforeIt) {
  examination = {};
  EXPECT_EQ(steps(), kNothing);
  EXPECT_EQ(next(), "cell");
}

TEST_F(ACell, IsKnownByTheNewestSessionWhereNobodyNamedOne) {
  session(SessionKind::kCalibrate, Ending::kFailed);
  examination = {};
  EXPECT_EQ(next(), "doctor");
  EXPECT_EQ(evidence.cell, dir / "cell.toml");
}

TEST_F(ACell, ThatTheDoctorSawIsTheGuidesUntilASessionOfAnotherBegins) {
  std::filesystem::copy_file(dir / "cell.toml", dir / "other.toml");
  examination.cell = dir / "other.toml";
  examined(Outcome::kOk);
  examination.ended = "t/";
  EXPECT_EQ(next(), "qualify");
  EXPECT_EQ(evidence.cell, dir / "other.toml");
  session(SessionKind::kQualify, Ending::kFailed);
  EXPECT_EQ(next(), "doctor") << "of the session's cell nothing was seen";
  EXPECT_EQ(evidence.cell, dir / "cell.toml");
  examination.ended = "t1";
  EXPECT_EQ(next(), "qualify") << "seen again since";
  examination.ended.clear();
  examination.running = true;
  EXPECT_EQ(next(), "qualify") << "seen at present";
}

TEST_F(ACell, ThatIsSoundNeedsTheDoctorNext) {
  EXPECT_EQ(next(), "doctor");
  EXPECT_EQ(evidence.spheres, 4u);
  EXPECT_EQ(evidence.placed, 4u);
  EXPECT_EQ(evidence.lengths, 6u);
  EXPECT_NE(evidence.robot.find("KR 5"), std::string::npos);
}

TEST_F(ACell, WhoseFileIsWrongOrGoneSaysSoByLineAndKey) {
  write(with("kind = \"sphere\"", "kind = \"cube\""));
  EXPECT_EQ(next(), "cell");
  EXPECT_EQ(words(evidence.cell_file->words).find((dir / "cell.toml").string() + ":"), 0u)
      << words(evidence.cell_file->words);
  std::filesystem::remove(dir / "cell.toml");
  EXPECT_EQ(steps(), "cell wrong" + kNothing.substr(std::string("cell todo").size()));
  for (const std::string& hostile : {std::string(), std::string("\xff\xfe\0x", 4),
                                     std::string(100000, '['), text.substr(0, 700)}) {
    write(hostile);
    EXPECT_EQ(steps().find("cell wrong, robot todo"), 0u) << hostile.substr(0, 20);
  }
}

TEST_F(ACell, WhoseRobotFileIsWrongSaysWhichOfTheTwoItIs) {
  std::ofstream(dir / "kr5_worn.toml") << "format = \"cellcal.robot/1\"\n";
  EXPECT_EQ(steps().find("cell done, robot wrong, spheres todo"), 0u) << steps();
  std::filesystem::remove(dir / "kr5_worn.toml");
  EXPECT_EQ(steps().find("cell wrong, robot todo"), 0u) << "it names a file that is not there";
}

TEST_F(ACell, WhoseMeshIsNotThereIsWrongItselfAndNotItsRobotFile) {
  write(text +
        "\n[[obstacle]]\nid = \"fixture\"\nshape = \"mesh\"\nfile = \"none.stl\"\n"
        "xyz_mm = [0.0, 0.0, 0.0]\n");
  EXPECT_EQ(steps().find("cell wrong, robot todo"), 0u) << steps();
  EXPECT_NE(words(evidence.cell_file->words).find("none.stl"), std::string::npos)
      << words(evidence.cell_file->words);
}

TEST_F(ACell, ThatContradictsItselfOrHasASphereNowhereStopsAtTheSpheres) {
  write(with("mm = 700.286", "mm = 770.286"));
  EXPECT_EQ(next(), "spheres");
  EXPECT_NE(words(evidence.targets->words).find("770"), std::string::npos)
      << words(evidence.targets->words);
  write(with("centre_mm = \\[760[^\n]*\n", ""));
  EXPECT_EQ(next(), "spheres");
  EXPECT_EQ(evidence.placed, 3u);
}

TEST_F(ACell, IsExaminedWhenNothingFailedAndNoMoreWhenItsFileHasChanged) {
  examined(Outcome::kFailed);
  EXPECT_EQ(next(), "doctor");
  EXPECT_EQ(words(evidence.doctor->words), "rsi packets");
  examined(Outcome::kWarning);
  EXPECT_EQ(next(), "qualify");
  write(with("mass_kg = 1.535", "mass_kg = 1.5"));
  EXPECT_EQ(next(), "doctor") << "it looked at another file";
  examined(Outcome::kOk);
  EXPECT_EQ(next(), "qualify");
  examination.whole = false;
  EXPECT_EQ(next(), "doctor") << "it did not come to its end";
}

TEST_F(ACell, IsQualifiedByItsNewestQualification) {
  examined(Outcome::kOk);
  session(SessionKind::kQualify, Ending::kFailed);
  EXPECT_EQ(next(), "qualify");
  const auto good = session(SessionKind::kQualify, Ending::kDone, "passed");
  EXPECT_EQ(next(), "dry-run");
  EXPECT_EQ(evidence.qualification->session, good);
  for (const char* not_passed : {"not passed", ""}) {
    session(SessionKind::kQualify, Ending::kDone, not_passed);
    EXPECT_EQ(next(), "qualify") << not_passed;
    EXPECT_FALSE(evidence.qualification->good);
  }
}

TEST_F(ACell, IsCalibratedWhenItsNewestResultIsPublishable) {
  examined(Outcome::kOk);
  session(SessionKind::kQualify, Ending::kDone, "passed");
  session(SessionKind::kCalibrate, Ending::kAborted);
  session(SessionKind::kDryRun, Ending::kFailed);
  EXPECT_EQ(next(), "dry-run");
  const auto dry = session(SessionKind::kDryRun, Ending::kDone);
  EXPECT_EQ(next(), "first");
  EXPECT_EQ(evidence.dry_run->session, dry);
  write(with("mass_kg = 1.535", "mass_kg = 1.5"));
  steps();
  EXPECT_FALSE(evidence.dry_run) << "it was of another file";
  write(with("", ""));
  const auto first = session(SessionKind::kCalibrate, Ending::kDone,
                             R"({"verdict": {"publish": false, "too_few_touches": true}})");
  EXPECT_EQ(next(), "calibration");
  EXPECT_FALSE(evidence.calibration) << "a look at whether the cell works is no calibration";
  session(SessionKind::kCalibrate, Ending::kDone, kWithhold);
  EXPECT_EQ(next(), "calibration");
  ASSERT_TRUE(evidence.calibration);
  EXPECT_FALSE(evidence.calibration->good);
  session(SessionKind::kCalibrate, Ending::kDone, kPublish);
  EXPECT_EQ(next(), "none");
  EXPECT_EQ(evidence.first->session, first);
  session(SessionKind::kCalibrate, Ending::kDone, kWithhold);
  EXPECT_EQ(next(), "calibration");
}

TEST_F(ACell, ThatWasTouchedAllAroundNeedsNoDryRun) {
  examined(Outcome::kOk);
  session(SessionKind::kQualify, Ending::kDone, "passed");
  session(SessionKind::kCalibrate, Ending::kDone, kPublish);
  EXPECT_EQ(next(), "none");
}

TEST_F(ACell, WhoseCalibrationInUseCannotBeUsedIsNotCalibratedThoughAnOlderOneCan) {
  session(SessionKind::kCalibrate, Ending::kDone, kPublish);
  const auto newest = session(SessionKind::kCalibrate, Ending::kDone, kUnreadable);
  steps();
  ASSERT_TRUE(evidence.calibration);
  EXPECT_FALSE(evidence.calibration->good);
  EXPECT_EQ(evidence.calibration->session, newest);
  EXPECT_NE(words(evidence.calibration->words).find("'cellcal activate ID"), std::string::npos)
      << words(evidence.calibration->words);
}

TEST_F(ACell, WhoseFileChangedSinceItsCalibrationIsNotCalibrated) {
  examined(Outcome::kOk);
  session(SessionKind::kQualify, Ending::kDone, "passed");
  const auto published = session(SessionKind::kCalibrate, Ending::kDone, kPublish);
  EXPECT_EQ(next(), "none");
  write(text + "\n# another table\n");
  examined(Outcome::kOk);
  EXPECT_EQ(next(), "calibration");
  EXPECT_EQ(evidence.calibration->session, published);
  EXPECT_NE(words(evidence.calibration->words).find("changed since session"), std::string::npos);
  write(text);
  examined(Outcome::kOk);
  EXPECT_EQ(next(), "none");
}

TEST_F(ACell, HasNoPartInWhatAnotherCellFileCameTo) {
  session(SessionKind::kQualify, Ending::kDone, "passed");
  session(SessionKind::kCalibrate, Ending::kDone, kPublish);
  std::filesystem::copy_file(dir / "cell.toml", dir / "other.toml");
  examination.cell = dir / "other.toml";
  EXPECT_EQ(
      steps(),
      "cell done, robot done, spheres done, doctor todo, qualify todo, dry-run todo, first todo, "
      "calibration todo");
}

}  // namespace
}  // namespace cellcal::daemon
