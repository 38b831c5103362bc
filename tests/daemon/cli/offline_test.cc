// identify, predict and plan as subprocesses, on the demonstration's cell.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <regex>
#include <thread>

#include "calib/files/files.h"
#include "tests/daemon/cli/content.h"
#include "tests/daemon/cli/mistaken_cells.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

const std::string kCell = CELLCAL_DEMO_CELL;

std::size_t lines(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

TEST(AMissingFile, IsAFailedJobNamedInTheFirstLine) {
  const Outcome outcome =
      run_program({CELLCAL, "identify", "--cell", "/none.toml", "--touches", "t.csv"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(outcome.err.find("cellcal identify: /none.toml"), 0u) << outcome.err;
  EXPECT_EQ(run_program({CELLCAL, "plan", "--cell", "/none.toml", "--touches", "4"}).status, 1);
  EXPECT_EQ(
      run_program({CELLCAL, "predict", "--calibration", "/none.json", "--joints", "j.csv"}).status,
      1);
}

TEST(TheRobots, AreListedWithReachAndThePlacesThatAreLookedInThoseOfOnesOwnFirst) {
  const TemporaryDirectory dir;
  std::filesystem::copy_file(CELLCAL_ROBOTS_FOLDER "/kr16_r1610_2.toml", dir / "mine.toml");
  std::ofstream(dir / "broken.toml") << "format = 3";
  ASSERT_EQ(::setenv("CELLCAL_ROBOTS", (dir / "").string().c_str(), 1), 0);
  const Outcome listed = run_program({CELLCAL, "robots", "--json"});
  const Outcome words = run_program({CELLCAL, "robots"});
  ::unsetenv("CELLCAL_ROBOTS");
  ASSERT_EQ(listed.status, 0) << listed.err;
  const auto json = nlohmann::json::parse(listed.out);
  std::map<std::string, nlohmann::json> robots;
  for (const auto& one : json.at("robots")) robots[one.at("name")] = one;
  EXPECT_GT(robots.size(), 40u);
  EXPECT_EQ(robots.at("mine").at("own"), true);
  EXPECT_NEAR(robots.at("mine").at("reach_mm").get<double>(), 1611.0, 2.0);
  EXPECT_EQ(robots.at("kr16_r1610_2").at("own"), false);
  EXPECT_TRUE(robots.at("iiwa14").at("reach_mm").is_null());
  EXPECT_FALSE(robots.at("broken").at("error").is_null());
  EXPECT_NE(words.out.find("CELLCAL_ROBOTS"), std::string::npos);
  EXPECT_NE(words.out.find("KUKA KR 16 R1610-2"), std::string::npos) << words.out;
}

TEST(AReaderThatWentAway, EndsTheCommandQuietlyWithItsUsualStatus) {
  const Outcome outcome = run_program(
      {"/bin/bash", "-c", std::string(CELLCAL) + " robots | true; exit ${PIPESTATUS[0]}"});
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(outcome.err, "");
}

TEST(AnUnknownMethod, IsWrongUsage) {
  EXPECT_EQ(
      run_program({CELLCAL, "identify", "--cell", kCell, "--touches", "t.csv", "--method", "guess"})
          .status,
      2);
}

TEST(APlan, IsATouchFileThatIdentifyReadsAndPredictContinuesFrom) {
  const TemporaryDirectory dir;
  const std::string plan = dir / "plan.csv", picture = dir / "plan.svg";
  const Outcome planned = run_program({CELLCAL, "plan", "--cell", kCell, "--touches", "16",
                                       "--check", "4", "-o", plan, "--picture", picture});
  ASSERT_EQ(planned.status, 0) << planned.err;
  EXPECT_NE(content(picture).find("16 touches for the fit, 4 held out"), std::string::npos);
  EXPECT_EQ(lines(content(plan)), 24u) << "three comments, header, twenty touches";
  EXPECT_EQ(planned.out.find(plan + ": 20 touches written\n"), 0u) << planned.out;
  EXPECT_NE(planned.out.find("mean error "), std::string::npos) << planned.out;
  EXPECT_NE(planned.out.find("robot time "), std::string::npos) << planned.out;
  EXPECT_NE(planned.out.find("correction_limit_deg"), std::string::npos) << planned.out;

  // Nominal touches lie on nominal spheres, up to the tip: the identified errors are small, and an
  // unpublishable result is written nevertheless.
  const std::string calibration = dir / "calibration.json";
  const Outcome identified =
      run_program({CELLCAL, "identify", "--cell", kCell, "--touches", plan, "-o", calibration});
  ASSERT_TRUE(identified.status == 0 || identified.status == 3) << identified.err;
  EXPECT_NE(identified.out.find("fit after"), std::string::npos);
  EXPECT_NE(identified.out.find("verdict: "), std::string::npos);
  const auto json = nlohmann::json::parse(content(calibration));
  EXPECT_EQ(json.at("format"), "cellcal.calibration/1");
  EXPECT_EQ(json.at("verdict").at("publish").get<bool>(), identified.status == 0);

  std::ofstream(dir / "joints.csv") << "A1,A2,A3,A4,A5,A6\n0,-90,90,0,0,0\n10,-80,80,20,30,40\n";
  const Outcome predicted = run_program({CELLCAL, "predict", "--calibration", calibration,
                                         "--joints", dir / "joints.csv", "--withheld"});
  ASSERT_EQ(predicted.status, 0) << predicted.err;
  EXPECT_EQ(predicted.out.find("x_mm,y_mm,z_mm,a_deg,b_deg,c_deg,u95_mm\n"), 0u);
  EXPECT_EQ(lines(predicted.out), 3u);
  EXPECT_NE(predicted.err.find("2 of 2 poses, the first in row 1, are outside the scope"),
            std::string::npos)
      << predicted.err;
  const auto by_values = [&](const std::string& values) {
    return run_program(
        {CELLCAL, "predict", "--calibration", calibration, "--joints", values, "--withheld"});
  };
  EXPECT_TRUE(predicted.out.starts_with(by_values("0,-90,90,0,0,0").out));
  EXPECT_EQ(by_values("-10, -80.5,80,20,30,+40").status, 0);
  const Outcome five = by_values("0,-90,90,0,0");
  EXPECT_EQ(five.status, 1);
  EXPECT_NE(five.err.find("--joints: 5 angles given, 6 needed: A1, A2, A3, A4, A5, A6\n"),
            std::string::npos)
      << five.err;
  for (const std::string& unusual : {std::string("none.csv"), std::string("-20,5;-80;90;0;30;0"),
                                     std::string("{A1 20.5,A2 -80}"), std::string(400, '0') + ",x"})
    EXPECT_NE(by_values(unusual).err.find(
                  ": no such file. Give a CSV file, or one row by its values, with decimal "
                  "points and commas between: A1,A2,A3,A4,A5,A6\n"),
              std::string::npos)
        << by_values(unusual).err;
  EXPECT_NE(
      by_values("0,-90,90,0,,0").err.find("cellcal predict: --joints: A5: \"\" is not a number"),
      std::string::npos)
      << by_values("0,-90,90,0,,0").err;
  EXPECT_NE(by_values("0,400,90,0,0,0").err.find("warning: --joints: A2: 400 deg is outside"),
            std::string::npos)
      << by_values("0,400,90,0,0,0").err;
  std::ofstream(dir / "beyond.csv") << "A1,A2,A3,A4,A5,A6\n0,-90,90,0,0,0\n200,-80,80,20,30,40\n";
  const Outcome beyond = run_program({CELLCAL, "predict", "--calibration", calibration, "--joints",
                                      dir / "beyond.csv", "--withheld"});
  EXPECT_EQ(beyond.status, 0);
  EXPECT_EQ(lines(beyond.out), 3u);
  EXPECT_NE(beyond.err.find("beyond.csv:3: A1: 200 deg is outside the joint's limits"),
            std::string::npos)
      << beyond.err;
  const auto warned_of_radians = [&](const std::string& row, int rows) {
    std::ofstream table(dir / "small.csv");
    table << "A1,A2,A3,A4,A5,A6\n";
    for (int i = 0; i < rows; ++i) table << row;
    table.close();
    const Outcome small = run_program({CELLCAL, "predict", "--calibration", calibration, "--joints",
                                       dir / "small.csv", "--withheld"});
    EXPECT_EQ(small.status, 0);
    return small.err.find("largest joint angle 3.1 deg in") != std::string::npos;
  };
  EXPECT_TRUE(warned_of_radians("0.1,-1.5,1.5,-3.1,1,0\n", 5));
  EXPECT_FALSE(warned_of_radians("0.1,-1.5,1.5,-3.1,1,0\n", 4));
  EXPECT_FALSE(warned_of_radians("0,0,0,0,0,0\n", 5));
  EXPECT_FALSE(warned_of_radians("0.1,-90,90,-3.1,1,0\n", 5));
  const auto with_load = [&](const std::string& load) {
    return run_program({CELLCAL, "predict", "--calibration", calibration, "--joints",
                        dir / "joints.csv", "--withheld", "--load", load});
  };
  EXPECT_NE(with_load("5,0,0,150").out, predicted.out);
  EXPECT_EQ(lines(with_load("5,0,0,150").out), 3u);
  EXPECT_EQ(with_load("-5,0,0,150").status, 1);
  EXPECT_NE(with_load("nan,0,0,150").status, 0);
  EXPECT_EQ(with_load("5,0,0").status, 1);
  EXPECT_EQ(with_load("2,0,0,150").err.find("in the touches"), std::string::npos);
  EXPECT_NE(
      with_load("80,0,0,150").err.find("80 kg on the flange: in the touches 1.535 kg were on it"),
      std::string::npos)
      << with_load("80,0,0,150").err;
  const auto with_tool = [&](const std::string& tool) {
    return run_program({CELLCAL, "predict", "--calibration", calibration, "--joints",
                        dir / "joints.csv", "--withheld", "--tool", tool});
  };
  EXPECT_EQ(with_tool("tool").out, "");
  EXPECT_NE(with_tool("tool").err.find("--tool tool: no tool \"tool\" on the flange"),
            std::string::npos);
  EXPECT_EQ(lines(with_tool("0,0,300,0,90,0").out), 3u);
  EXPECT_NE(with_tool("0,0,300").out, predicted.out);
  EXPECT_EQ(with_tool("0,0").status, 1);
  std::ofstream(dir / "other.csv") << "J1;J2;J3;J4;J5;J6\n0;-90;90;0;0;0\n10;-80;80;20;30;40\n";
  const Outcome other = run_program({CELLCAL, "predict", "--calibration", calibration, "--joints",
                                     dir / "other.csv", "--withheld"});
  EXPECT_EQ(other.out, predicted.out);
  EXPECT_NE(other.err.find("other.csv: read as ;, J1 to J6 as A1 to A6"), std::string::npos)
      << other.err;
  const Outcome unknown = with_load("full");
  EXPECT_EQ(unknown.status, 1);
  EXPECT_NE(unknown.err.find("--load full: the calibration's cell has no such [[load]]"),
            std::string::npos)
      << unknown.err;
  const Outcome nominal = run_program({CELLCAL, "predict", "--calibration", calibration, "--joints",
                                       dir / "joints.csv", "--nominal", "--json"});
  ASSERT_EQ(nominal.status, 0) << nominal.err;
  EXPECT_EQ(nlohmann::json::parse(nominal.out).size(), 2u);
}

/// Expects neither English words nor decimal points in German output.
void expect_german(std::string said) {
  said = std::regex_replace(said, std::regex("'[^']*'"), "");  // commands
  static const std::regex kEnglish(
      "\\b(the|of|and|with|is|are|not|from|touches|mean|verdict|check|before|after|[0-9]+\\.[0-9]+)\\b");
  std::smatch left;
  EXPECT_FALSE(std::regex_search(said, left, kEnglish)) << left.str() << " in " << said;
  EXPECT_EQ(said.find("say."), std::string::npos) << said;
  EXPECT_FALSE(std::regex_search(said, std::regex("\\{[a-z_]+(:[^}]*)?\\}"))) << said;
}

TEST(APlanAndItsResult, AreToldInTheLanguageAskedForAndWrittenInNone) {
  const TemporaryDirectory dir;
  const std::string plan = dir / "p.csv", calibration = dir / "c.json";
  const auto in_german = [](std::vector<std::string> command) {
    command.insert(command.end(), {"--language", "de"});
    return run_program(command);
  };
  const Outcome planned =
      in_german({CELLCAL, "plan", "--cell", kCell, "--touches", "30", "--check", "6", "-o", plan});
  ASSERT_EQ(planned.status, 0) << planned.err;
  EXPECT_EQ(planned.out.find(plan + ": 36 Antastungen geschrieben\n"), 0u) << planned.out;
  expect_german(planned.out.substr(planned.out.find('\n')));
  EXPECT_NE(content(plan).find("# predicted mean error "), std::string::npos);
  const Outcome identified = in_german(
      {CELLCAL, "identify", "--cell", kCell, "--touches", plan, "-o", calibration, "--verbose"});
  ASSERT_TRUE(identified.status == 0 || identified.status == 3) << identified.err;
  EXPECT_NE(identified.out.find("Fit nachher"), std::string::npos) << identified.out;
  EXPECT_NE(identified.out.find("Urteil: "), std::string::npos) << identified.out;
  EXPECT_NE(identified.out.find("Beobachtbarkeit: "), std::string::npos) << identified.out;
  expect_german(identified.out);
  const auto json = nlohmann::json::parse(content(calibration));
  EXPECT_NE(json.at("verdict").dump().find("certified lengths hold the scale"), std::string::npos);
}

TEST(AResultThatMustNotBePublished, IsWrittenAndEndsWithStatus3) {
  const TemporaryDirectory dir;
  const std::string plan = dir / "plan.csv", calibration = dir / "c.json";
  ASSERT_EQ(run_program({CELLCAL, "plan", "--cell", kCell, "--touches", "8", "-o", plan}).status,
            0);
  const Outcome outcome = run_program(
      {CELLCAL, "identify", "--cell", kCell, "--touches", plan, "-o", calibration, "--json"});
  EXPECT_EQ(outcome.status, 3) << outcome.err;
  EXPECT_FALSE(nlohmann::json::parse(outcome.out).at("verdict").at("publish").get<bool>());
  EXPECT_EQ(outcome.out, content(calibration));

  // Predictions require --withheld; the nominal arm is no result.
  std::ofstream(dir / "joints.csv") << "A1,A2,A3,A4,A5,A6\n0,-90,90,0,0,0\n";
  std::vector<std::string> predict{CELLCAL,     "predict",    "--calibration",
                                   calibration, "--joints",   dir / "joints.csv",
                                   "-o",        dir / "p.csv"};
  const Outcome refused = run_program(predict);
  EXPECT_EQ(refused.status, 3);
  EXPECT_EQ(refused.err.find("cellcal predict: " + calibration + ": this calibration was withheld"),
            0u)
      << refused.err;
  EXPECT_NE(refused.err.find("--withheld"), std::string::npos);
  EXPECT_EQ(refused.out, "");
  EXPECT_FALSE(std::filesystem::exists(dir / "p.csv"));
  // Five rows of small angles may be in radians, of which a warning is.
  std::ofstream small(dir / "small.csv");
  small << "A1,A2,A3,A4,A5,A6\n";
  for (int k = 0; k < 5; ++k) small << "0,-1.57,1.57,0," << 0.1 * k << ",0\n";
  small.close();
  ::setenv("LC_ALL", "de_DE.UTF-8", 1);
  const std::string german = run_program(predict).err;
  const std::string warned = run_program({CELLCAL, "predict", "--withheld", "--calibration",
                                          calibration, "--joints", dir / "small.csv"})
                                 .err;
  ::unsetenv("LC_ALL");
  EXPECT_NE(german.find(": Diese Kalibrierung wurde zurückgehalten"), std::string::npos) << german;
  expect_german(german.substr(german.find("\n  - ")));
  EXPECT_EQ(warned.find("Warnung: "), 0u) << warned;

  for (const char* flag : {"--withheld", "--nominal"}) {
    predict.resize(8);
    predict.push_back(flag);
    EXPECT_EQ(run_program(predict).status, 0) << flag;
    EXPECT_TRUE(std::filesystem::remove(dir / "p.csv")) << flag;
  }
}

TEST(AFirstSession, EndsInWhatItHasShownAndNotInWhatItLacks) {
  const TemporaryDirectory dir;
  const std::string plan = dir / "plan.csv";
  ASSERT_EQ(run_program({CELLCAL, "plan", "--cell", kCell, "--touches", "4", "-o", plan}).status,
            0);
  const Outcome outcome =
      run_program({CELLCAL, "identify", "--cell", kCell, "--touches", plan, "-o", dir / "c.json"});
  EXPECT_EQ(outcome.status, 3);
  EXPECT_NE(outcome.out.find("the cell works, 4 of 4 touches within 0."), std::string::npos)
      << outcome.out;
  EXPECT_NE(outcome.out.find("Now calibrate with 100 touches and 10 to check"), std::string::npos)
      << outcome.out;
  EXPECT_LE(lines(outcome.out), 4u) << outcome.out;
  const auto json = nlohmann::json::parse(content(dir / "c.json"));
  EXPECT_TRUE(json.at("verdict").at("too_few_touches").get<bool>());
}

TEST(APlan, ServesThePointsOfAProgram) {
  const TemporaryDirectory dir;
  const KrlProgram program = taught(cell().robot, frames(), postures(6));
  const std::string src = dir / "weld.src", config = dir / "$config.dat";
  std::ofstream(src, std::ios::binary) << program.src;
  std::ofstream(dir / "weld.dat", std::ios::binary) << program.dat;
  std::ofstream(config, std::ios::binary) << program.config;
  const Outcome planned = run_program(
      {CELLCAL, "plan", "--cell", kCell, "--touches", "8", "--program", src, "--config", config});
  ASSERT_EQ(planned.status, 0) << planned.err;
  EXPECT_NE(planned.out.find("(points of the programs)"), std::string::npos) << planned.out;

  std::ofstream(src, std::ios::binary) << "DEF weld()\nEND\n";
  const Outcome without = run_program(
      {CELLCAL, "plan", "--cell", kCell, "--touches", "8", "--program", src, "--config", config});
  EXPECT_EQ(without.status, 1);
  EXPECT_NE(without.err.find("--program: 0 points"), std::string::npos) << without.err;
}

TEST(APlan, TakesPointsAndRoutinesAsCorrectDoesWhereItsWarningsNameThem) {
  const TemporaryDirectory dir;
  const KrlProgram program = taught(cell().robot, frames(), postures(6));
  const std::string src = dir / "weld.src", other = dir / "other.src", config = dir / "$config.dat";
  std::string calling = program.src;
  const std::size_t motion = calling.rfind('\n', calling.find(" XP2")) + 1;
  calling.insert(motion, "CLAMP()\r\n");
  calling.insert(calling.rfind("END"), "PTP XELSEWHERE\r\n");
  std::ofstream(src, std::ios::binary) << calling;
  std::ofstream(other, std::ios::binary) << program.src;
  for (const char* dat : {"weld.dat", "other.dat"})
    std::ofstream(dir / dat, std::ios::binary) << program.dat;
  std::ofstream(config, std::ios::binary) << program.config;
  const auto planned = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all = {CELLCAL,     "plan", "--cell",    kCell, "--touches", "8",
                                    "--program", src,    "--program", other, "--config",  config};
    all.insert(all.end(), more.begin(), more.end());
    return run_program(all);
  };
  const Outcome warned = planned({});
  for (const char* remedy : {"XP2: active tool unknown since CLAMP", "name it with --does-not-move",
                             "XELSEWHERE: not declared", "with --leave"})
    EXPECT_NE(warned.err.find(remedy), std::string::npos) << warned.err;
  const Outcome named = planned({"--does-not-move", "clamp", "--leave", "xelsewhere"});
  EXPECT_EQ(named.status, 0);
  for (const char* name : {"CLAMP", "XP2", "XELSEWHERE"})
    EXPECT_EQ(named.err.find(name), std::string::npos) << named.err;
  const Outcome nowhere = planned({"--leave", "XNOWHERE"});
  EXPECT_EQ(nowhere.status, 1);
  EXPECT_NE(nowhere.err.find("no point is named XNOWHERE"), std::string::npos) << nowhere.err;
}

TEST(APlan, OfACellFileThatContradictsItselfIsRefused) {
  const TemporaryDirectory dir;
  std::string text = content(kCell);
  text.replace(text.find("kr5_worn.toml"), 13,
               std::filesystem::path(kCell).replace_filename("kr5_worn.toml").string());
  text.replace(text.find("mm = 1128.051"), 13, "mm = 11280.51");
  std::ofstream(dir / "cell.toml") << text;
  const Outcome outcome =
      run_program({CELLCAL, "plan", "--cell", dir / "cell.toml", "--touches", "8"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("S2-S3: 11280.510 mm stated, 1128.1"), std::string::npos)
      << outcome.err;
  EXPECT_NE(outcome.err.find("decimal point"), std::string::npos) << outcome.err;
}

TEST(AMistakeInACellFile, IsNamedByPlanAndIdentifyWithItsValue) {
  const TemporaryDirectory dir;
  const std::string touches = dir / "touches.csv";
  ASSERT_EQ(run_program({CELLCAL, "plan", "--cell", kCell, "--touches", "8", "-o", touches}).status,
            0);
  for (const MistakenCell& one : mistaken_cells()) {
    const std::string cell = write(one, dir.path());
    const bool of_the_plan = one.kind == calib::CellFaultKind::kRequired;
    const auto faults = calib::faults_of(calib::load_cell(cell));
    if (!of_the_plan) {
      ASSERT_EQ(faults.size(), 1u) << one.name;
      EXPECT_EQ(faults[0].kind, one.kind) << one.name << ": " << words(phrase(faults[0]));
      EXPECT_EQ(faults[0].refused, one.refused) << one.name;
    }
    const Outcome plan = run_program({CELLCAL, "plan", "--cell", cell, "--touches", "8"});
    EXPECT_EQ(plan.status == 1, one.refused) << one.name << "\n" << plan.err;
    EXPECT_EQ(plan.err.find("warning: ") == 0, !one.refused) << one.name << "\n" << plan.err;
    const Outcome identified =
        run_program({CELLCAL, "identify", "--cell", cell, "--touches", touches});
    for (const std::string& value : one.values) {
      EXPECT_NE(plan.err.find(value), std::string::npos) << one.name << "\n" << plan.err;
      EXPECT_EQ(identified.err.find(value) != std::string::npos, !of_the_plan) << one.name << "\n"
                                                                               << identified.err;
    }
  }
}

TEST(APlan, SaysHowFarTheAxesGoFromWhereTheArmStands) {
  const auto limit = [](const std::string& from) {
    const Outcome outcome =
        run_program({CELLCAL, "plan", "--cell", kCell, "--touches", "8", "--from", from, "--json"});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    const auto json = nlohmann::json::parse(outcome.out);
    EXPECT_GT(json.at("correction_limit_deg"), json.at("farthest_turn_deg"));
    return json.at("correction_limit_deg").get<double>();
  };
  EXPECT_GT(limit("0,-90,90,0,60,170"), limit("0,-90,90,0,60,0"));
  const Outcome beyond =
      run_program({CELLCAL, "plan", "--cell", kCell, "--touches", "8", "--from", "400,0,0,0,0,0"});
  EXPECT_EQ(beyond.status, 1);
  EXPECT_NE(beyond.err.find("400 deg for A1"), std::string::npos) << beyond.err;
}

TEST(APlan, ToAGoalNamesWhatIsMissing) {
  const Outcome planned = run_program(
      {CELLCAL, "plan", "--cell", kCell, "--goal", "0.02", "--touches", "24", "--json"});
  ASSERT_EQ(planned.status, 0) << planned.err;
  const auto json = nlohmann::json::parse(planned.out);
  EXPECT_EQ(json["touches"].size(), 24u);
  EXPECT_EQ(json["goal_mm"], 0.02);
  EXPECT_GT(json["predicted_u95_mm"], 0.02);
  EXPECT_GT(json["missing"]["share"], 0.0);
  EXPECT_NE(planned.err.find("predicted at touch 24, the last allowed; goal 0.020 mm. "),
            std::string::npos)
      << planned.err;
  EXPECT_EQ(run_program({CELLCAL, "plan", "--cell", kCell}).status, 2);
}

TEST(APlan, ForTheTipAloneStatesNoBound) {
  const Outcome planned =
      run_program({CELLCAL, "plan", "--cell", kCell, "--region", "tcp", "--touches", "24"});
  ASSERT_EQ(planned.status, 0) << planned.err;
  EXPECT_EQ(planned.out.find("u95"), std::string::npos) << planned.out;
  const auto json = nlohmann::json::parse(run_program({CELLCAL, "plan", "--cell", kCell, "--region",
                                                       "tcp", "--touches", "24", "--json"})
                                              .out);
  EXPECT_TRUE(json["predicted_u95_mm"].is_null());
  EXPECT_GT(json["predicted_m3_mm"], 0.0);
}

TEST(AnUnknownCommand, IsNamed) {
  const Outcome outcome = run_program({CELLCAL, "dance", "--poses", "p.csv"});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.err.find("cellcal: unknown command \"dance\". The commands: run, "), 0u)
      << outcome.err;
}

TEST(AnUnknownCommand, OrOptionIsShownWithTheNearestThatThereIs) {
  const Outcome command = run_program({CELLCAL, "identfy"});
  EXPECT_EQ(command.status, 2);
  EXPECT_EQ(command.err.find("cellcal: unknown command \"identfy\". Did you mean \"identify\"? "),
            0u)
      << command.err;
  const Outcome option = run_program({CELLCAL, "run", "--cell", "c.toml", "--touch", "4"});
  EXPECT_EQ(option.status, 2);
  EXPECT_EQ(
      option.err.find("cellcal run: unknown option \"--touch\". Did you mean \"--touches\"?\n"), 0u)
      << option.err;
  const Outcome none = run_program({CELLCAL, "versions", "--cell", "c.toml"});
  EXPECT_EQ(none.err.find("cellcal versions: unknown option \"--cell\".\n"), 0u) << none.err;
  const Outcome nested = run_program({CELLCAL, "fleet", "status", "--language", "de"});
  EXPECT_EQ(nested.err.find("cellcal fleet status: unknown option \"--language\"."), 0u)
      << nested.err;
  const Outcome near =
      run_program({CELLCAL, "proposals", "accept", "p-17", "--reson", "no", "--socket", "x"});
  EXPECT_EQ(near.err.find("cellcal proposals accept: unknown option \"--reson\". Did you mean "
                          "\"--reason\"?\n"),
            0u)
      << near.err;
  const Outcome behind = run_program({CELLCAL, "proposals", "accept", "p-17", "--socket", "/no"});
  EXPECT_EQ(behind.status, 1) << "an option of the connection may follow: " << behind.err;
  const Outcome before = run_program({CELLCAL, "--cell=c.toml", "run"});
  EXPECT_EQ(before.status, 2);
  EXPECT_EQ(before.err.find("cellcal run: --cell=c.toml is before the command. "), 0u)
      << before.err;
}

TEST(AMissingCommand, IsAnsweredWithTheList) {
  const Outcome outcome = run_program({CELLCAL});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.err.find("cellcal: no command given; commands: run, "), 0u) << outcome.err;
}

TEST(AnOutput, ThatIsALinkOrAPipeStaysOne) {
  const TemporaryDirectory dir;
  std::ofstream(dir / "real.csv") << "old";
  std::filesystem::create_symlink("real.csv", dir / "link.csv");
  const auto plan = [&](const std::string& output) {
    return run_program({CELLCAL, "plan", "--cell", kCell, "--touches", "4", "-o", output}).status;
  };
  EXPECT_EQ(plan(dir / "link.csv"), 0);
  EXPECT_TRUE(std::filesystem::is_symlink(dir / "link.csv"));
  EXPECT_GT(lines(content(dir / "real.csv")), 4u);
  std::filesystem::create_symlink("later.csv", dir / "dangling.csv");
  EXPECT_EQ(plan(dir / "dangling.csv"), 0);
  EXPECT_TRUE(std::filesystem::is_symlink(dir / "dangling.csv"));
  EXPECT_EQ(content(dir / "later.csv"), content(dir / "real.csv"));
  EXPECT_EQ(run_program({CELLCAL, "plan", "--cell", kCell, "--touches", "4", "-o", "/dev/stdout"})
                .out.find(content(dir / "real.csv")),
            0u);

  ASSERT_EQ(::mkfifo((dir / "pipe").c_str(), 0600), 0);
  std::string read;
  std::thread reader([&] { read = content(dir / "pipe"); });
  EXPECT_EQ(plan(dir / "pipe"), 0);
  reader.join();
  EXPECT_TRUE(std::filesystem::is_fifo(dir / "pipe"));
  EXPECT_EQ(read, content(dir / "real.csv"));
}

TEST(TouchesThatLeadToNoCalibration, AreToldWithTheCauseInAResultWithStatus3) {
  const TemporaryDirectory dir;
  const std::string plan = dir / "plan.csv", calibration = dir / "c.json";
  ASSERT_EQ(run_program({CELLCAL, "plan", "--cell", kCell, "--touches", "40", "-o", plan}).status,
            0);
  std::string text = content(plan);
  for (const auto& [from, to] : {std::pair{",S1,", ",S0,"}, {",S3,", ",S1,"}, {",S0,", ",S3,"}})
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at))
      text.replace(at, 4, to);
  std::ofstream(dir / "wrong.csv") << text;
  const Outcome outcome = run_program(
      {CELLCAL, "identify", "--cell", kCell, "--touches", dir / "wrong.csv", "-o", calibration});
  EXPECT_EQ(outcome.status, 3) << outcome.err;
  EXPECT_NE(outcome.out.find("  - likely cause: "), std::string::npos) << outcome.out;
  EXPECT_FALSE(nlohmann::json::parse(content(calibration)).at("verdict").at("publish").get<bool>());
}

TEST(AnOutputThatCannotBeWritten, IsAFailedJob) {
  const Outcome outcome = run_program(
      {CELLCAL, "plan", "--cell", kCell, "--touches", "4", "-o", "/nonexistent/plan.csv"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(outcome.err,
            "cellcal plan: folder /nonexistent does not exist. Create it, or choose another\n");
  const TemporaryDirectory dir;
  EXPECT_EQ(run_program({CELLCAL, "plan", "--cell", kCell, "--touches", "4", "-o", dir / ""}).err,
            "cellcal plan: " + (dir / "").string() + " is a folder. Give a file in it\n");
}

TEST(TouchesWithAWrongRow, AreRefusedByFileLineAndColumn) {
  const TemporaryDirectory dir;
  std::ofstream(dir / "t.csv") << "A1,A2,A3,A4,A5,A6,target\n0,0,0,0,0,nan,S1\n";
  const Outcome outcome =
      run_program({CELLCAL, "identify", "--cell", kCell, "--touches", dir / "t.csv"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("t.csv"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("A6"), std::string::npos) << outcome.err;
}

std::string demo_calibration(const TemporaryDirectory& dir) {
  const std::string plan = dir / "plan.csv", calibration = dir / "calibration.json";
  run_program({CELLCAL, "plan", "--cell", kCell, "--touches", "16", "-o", plan});
  run_program({CELLCAL, "identify", "--cell", kCell, "--touches", plan, "-o", calibration});
  return calibration;
}

TEST(ACalibratedArm, IsWrittenForOtherProgramsAndItsUrdfReadAsARobotFile) {
  const TemporaryDirectory dir;
  const std::string calibration = demo_calibration(dir), urdf = dir / "arm.urdf";
  const Outcome withheld =
      run_program({CELLCAL, "export-robot", "--calibration", calibration, "-o", urdf});
  EXPECT_EQ(withheld.status, 3) << withheld.err;
  EXPECT_FALSE(std::filesystem::exists(urdf));
  const Outcome written = run_program(
      {CELLCAL, "export-robot", "--calibration", calibration, "--withheld", "-o", urdf});
  ASSERT_EQ(written.status, 0) << written.err;
  EXPECT_NE(written.err.find("left out: "), std::string::npos) << written.err;
  for (const char* as : {"yaml", "dh", "json"}) {
    const Outcome one = run_program(
        {CELLCAL, "export-robot", "--calibration", calibration, "--withheld", "--as", as});
    EXPECT_EQ(one.status, 0) << one.err;
    EXPECT_NE(one.out.find(as == std::string("yaml") ? "joint_a6:" : "A6"), std::string::npos)
        << as;
  }
  // The URDF merged into itself again is the same arm.
  const std::string again = dir / "again.urdf", robot = dir / "robot.toml";
  EXPECT_EQ(run_program({CELLCAL, "import-robot", "--urdf", urdf, "-o", robot}).status, 0);
  EXPECT_NE(content(robot).find("name = \"A6\""), std::string::npos) << content(robot);
  const Outcome other = run_program({CELLCAL, "export-robot", "--calibration", calibration,
                                     "--withheld", "--urdf", urdf, "-o", again});
  EXPECT_EQ(other.status, 1) << "its joints are the calibrated ones, not the nominal ones";
  EXPECT_NE(other.err.find("joint \"joint_a"), std::string::npos) << other.err;
}

TEST(MachineData, OfAControllerAreHeldAgainstTheRobotFileAndGiveItsLimits) {
  const TemporaryDirectory dir;
  const std::string data = dir / "$machine.dat", robot = dir / "robot.toml";
  std::ofstream(data)
      << "$SOFTN_END[1]=-100.0\r\n$TFLWP={X 0.0,Y 0.0,Z 115.0,A 0.0,B 0.0,C 0.0}\r\n";
  const Outcome made = run_program(
      {CELLCAL, "import-robot", "--robot", "kr5_r1400", "--machine-data", data, "-o", robot});
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_NE(content(robot).find("min_deg = -100"), std::string::npos);
  EXPECT_NE(made.err.find("$TFLWP Z 115.000 mm in the controller, 80.000 mm in the robot file"),
            std::string::npos)
      << made.err;
  std::ofstream(data) << "BOOL $ABS_ACCUR=TRUE\r\n";
  const Outcome accurate = run_program(
      {CELLCAL, "import-robot", "--robot", "kr5_r1400", "--machine-data", data, "-o", robot});
  ASSERT_EQ(accurate.status, 0) << accurate.err;
  EXPECT_NE(accurate.err.find("$ABS_ACCUR: absolute accuracy is active"), std::string::npos)
      << accurate.err;
  EXPECT_EQ(calib::load_robot(robot).absolute_accuracy, calib::AbsoluteAccuracy::kActive);
  std::filesystem::create_directory(dir / "other");
  const std::string other = dir / "other/$machine.dat";
  std::ofstream(other) << "$TFLWP={X 0.0,Y 0.0,Z 158.0,A 0.0,B 0.0,C 0.0}\r\n";
  const Outcome two = run_program({CELLCAL, "import-robot", "--robot", "kr5_r1400",
                                   "--machine-data", data, other, "-o", robot});
  EXPECT_EQ(two.status, 1);
  EXPECT_NE(two.err.find("both " + data + " and " + other), std::string::npos) << two.err;
  EXPECT_EQ(run_program({CELLCAL, "import-robot", "--robot", "kr9999"}).status, 1);
  EXPECT_EQ(run_program({CELLCAL, "import-robot"}).status, 2);
}

/// Two revolute joints, a prefix, a root "world"; with one text replaced.
std::string small_urdf(const std::string& what = {}, const std::string& with = {}) {
  std::string text =
      "<robot name=\"r\"><link name=\"world\"/><link name=\"p_base\"/><link name=\"p_link_1\"/>"
      "<link name=\"p_link_2\"/><link name=\"p_tool0\"/>"
      "<joint name=\"mount\" type=\"fixed\"><parent link=\"world\"/><child link=\"p_base\"/>"
      "<origin xyz=\"1 0 0.8\"/></joint>"
      "<joint name=\"p_joint_1\" type=\"revolute\"><parent link=\"p_base\"/><child link=\"p_link_1\"/>"
      "<origin xyz=\"0 0 0.4\"/><axis xyz=\"0 0 1\"/><limit lower=\"-2\" upper=\"2.5\" "
      "velocity=\"1\"/></joint>"
      "<joint name=\"p_joint_2\" type=\"revolute\"><parent link=\"p_link_1\"/><child "
      "link=\"p_link_2\"/><origin xyz=\"0.3 0 0\"/><axis xyz=\"0 1 0\"/><limit lower=\"-2\" "
      "upper=\"2\" velocity=\"1\"/></joint>"
      "<joint name=\"p_end\" type=\"fixed\"><parent link=\"p_link_2\"/><child link=\"p_tool0\"/>"
      "<origin xyz=\"0.2 0 0\"/></joint></robot>";
  if (const auto at = text.find(what); !what.empty()) text.replace(at, what.size(), with);
  return text;
}

TEST(AUrdf, WithAPrefixAndNumbersGivesKukasNamesTheFlangeAndTheArmsOwnBase) {
  const TemporaryDirectory dir;
  std::ofstream(dir / "r.urdf") << small_urdf();
  const Outcome made =
      run_program({CELLCAL, "import-robot", "--urdf", dir / "r.urdf", "-o", dir / "r.toml"});
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_NE(made.err.find("\"p_base\" to \"p_tool0\""), std::string::npos) << made.err;
  const calib::Robot robot = calib::load_robot(dir / "r.toml");
  EXPECT_EQ(robot.joints[0].name, "A1");
  EXPECT_EQ(robot.joints[1].name, "A2");
  EXPECT_NEAR(robot.base_fixed.translation().x(), 0.0, 1e-9);
}

TEST(AUrdf, OfAnArmOnACeilingGivesItsGravity) {
  const TemporaryDirectory dir;
  std::ofstream(dir / "r.urdf") << small_urdf("xyz=\"1 0 0.8\"",
                                              "xyz=\"1 0 3\" rpy=\"0 3.14159 0\"");
  const auto made = [&] {
    return run_program({CELLCAL, "import-robot", "--urdf", dir / "r.urdf", "-o", dir / "r.toml"});
  };
  const Outcome ceiling = made();
  ASSERT_EQ(ceiling.status, 0) << ceiling.err;
  EXPECT_NE(ceiling.err.find("mounting: gravity along [0, 0, 1] of the arm's foot"),
            std::string::npos)
      << ceiling.err;
  EXPECT_NEAR(calib::load_robot(dir / "r.toml").gravity_m_s2.z(), 9.81, 1e-6);
  std::ofstream(dir / "r.urdf") << small_urdf();
  EXPECT_EQ(made().err.find("mounting"), std::string::npos);
}

TEST(MachineData, OfAnArmOnACeilingGiveTheRobotFilesArmItsGravity) {
  const TemporaryDirectory dir;
  std::ofstream(dir / "$machine.dat") << "$ROBROOT={X 0.0,Y 0.0,Z 3000.0,A 0.0,B 0.0,C 180.0}\n";
  const Outcome made = run_program({CELLCAL, "import-robot", "--robot", "kr5_r1400",
                                    "--machine-data", dir / "$machine.dat", "-o", dir / "r.toml"});
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_NE(made.err.find(
                "warning: gravity along [0, 0, 1] of the arm's foot in the controller ($ROBROOT), "
                "along [0, 0, -1] in kr5_r1400. The controller's is taken"),
            std::string::npos)
      << made.err;
  EXPECT_NE(made.err.find("mounting: gravity along [0, 0, 1]"), std::string::npos) << made.err;
  EXPECT_NEAR(calib::load_robot(dir / "r.toml").gravity_m_s2.z(), 9.81, 1e-9);
  const Outcome again = run_program({CELLCAL, "import-robot", "--robot", dir / "r.toml",
                                     "--machine-data", dir / "$machine.dat", "-o", dir / "s.toml"});
  EXPECT_EQ(again.err.find("warning"), std::string::npos) << again.err;
}

TEST(AUrdf, ThatNoPlanCouldUseIsRefusedByJoint) {
  const TemporaryDirectory dir;
  const auto why = [&](const std::string& what, const std::string& with) {
    std::ofstream(dir / "r.urdf") << small_urdf(what, with);
    const Outcome made =
        run_program({CELLCAL, "import-robot", "--urdf", dir / "r.urdf", "-o", dir / "r.toml"});
    EXPECT_EQ(made.status, 1) << with;
    EXPECT_FALSE(std::filesystem::exists(dir / "r.toml")) << with;
    return made.err;
  };
  const std::string limit = "<limit lower=\"-2\" upper=\"2.5\" velocity=\"1\"/>";
  for (const auto& [what, with, words] : std::vector<std::array<std::string, 3>>{
           {"type=\"revolute\"", "type=\"continuous\"", ""},
           {limit, "", "joint \"p_joint_1\": limits 0.000 to 0.000 deg"},
           {limit, "<limit lower=\"2\" upper=\"-2\" velocity=\"1\"/>", "lower not below the upper"},
           {limit, "<limit lower=\"-170\" upper=\"170\" velocity=\"1\"/>", "radians"},
           {limit, "<limit lower=\"-2\" upper=\"2\" velocity=\"0\"/>", "no speed"},
           {limit, "<limit lower=\"-2\" upper=\"2\" velocity=\"200\"/>",
            "velocity 200 rad/s: no arm's"},
           {limit, "<limit lower=\"-2\" upper=\"2\" velocity=\"inf\"/>", "velocity"},
           {"0.3 0 0", "300 0 0", "metres"},
           {"p_joint_1", "target", "target"},
           {"p_joint_1", "joint_2", "A2"},
           {"p_joint_1", "gelenk_\xE4", ""}}) {
    if (with.find("continuous") != std::string::npos) continue;  // its limits may be stated
    EXPECT_NE(why(what, with).find(words), std::string::npos) << with << ": " << why(what, with);
  }
}

TEST(AUrdf, IsImportedWithAWordOnWhatWasTakenForGranted) {
  const TemporaryDirectory dir;
  const auto told = [&](const std::string& what, const std::string& with) {
    std::ofstream(dir / "r.urdf") << small_urdf(what, with);
    const Outcome made =
        run_program({CELLCAL, "import-robot", "--urdf", dir / "r.urdf", "-o", dir / "r.toml"});
    EXPECT_EQ(made.status, 0) << made.err;
    return made.err;
  };
  EXPECT_EQ(told("", "").find("warning"), std::string::npos);
  const std::string turning =
      "type=\"revolute\"><parent link=\"p_base\"/><child link=\"p_link_1\"/><origin xyz=\"0 0 0.4\"/>"
      "<axis xyz=\"0 0 1\"/><limit lower=\"-2\" upper=\"2.5\" velocity=\"1\"/>";
  const std::string endless =
      told(turning,
           "type=\"continuous\"><parent link=\"p_base\"/><child link=\"p_link_1\"/>"
           "<axis xyz=\"0 0 1\"/><limit velocity=\"1\"/>");
  EXPECT_NE(endless.find("joint \"p_joint_1\" turns without limits"), std::string::npos) << endless;
  EXPECT_NEAR(calib::load_robot(dir / "r.toml").joints[0].max_rad, 2.0 * std::numbers::pi, 1e-9);
  const std::string flange = told("<child link=\"p_tool0\"/>", "<child link=\"p_camera\"/>");
  EXPECT_NE(flange.find("\"p_camera\" (200 0 0 mm from it"), std::string::npos) << flange;
  const std::string rod =
      told("</robot>",
           "<joint name=\"rod\" type=\"revolute\"><parent link=\"p_base\"/><child link=\"rod\"/>"
           "<mimic joint=\"p_joint_2\"/></joint></robot>");
  EXPECT_NE(rod.find("joint \"p_joint_2\" is mimicked by \"rod\""), std::string::npos) << rod;
  const std::string spindle = told(
      "</robot>",
      "<joint name=\"spindle\" type=\"revolute\"><parent link=\"p_tool0\"/><child link=\"cutter\"/>"
      "</joint></robot>");
  EXPECT_NE(spindle.find("2 joints"), std::string::npos) << spindle;
  EXPECT_NE(spindle.find("left out behind the flange: \"spindle\""), std::string::npos) << spindle;
}

/// Runs `import-robot --urdf r.xacro` with this program xacro on the PATH, and further arguments.
Outcome with_xacro(const TemporaryDirectory& dir, const std::string& script,
                   const std::vector<std::string>& more = {}) {
  std::filesystem::create_directories(dir / "bin");
  std::ofstream(dir / "bin/xacro") << "#!/bin/sh\n" << script;
  std::filesystem::permissions(dir / "bin/xacro", std::filesystem::perms::owner_all);
  const std::string path = "PATH=" + (dir / "bin").string() + ":/usr/bin:/bin";
  std::vector<std::string> words{"/usr/bin/env",  path, CELLCAL,       "import-robot", "--urdf",
                                 dir / "r.xacro", "-o", dir / "r.toml"};
  words.insert(words.end(), more.begin(), more.end());
  return run_program(words);
}

TEST(AXacroFile, IsExpandedByXacroWhereItIsInstalled) {
  const TemporaryDirectory dir;
  std::ofstream(dir / "r.xacro") << "<robot xmlns:xacro=\"x\">\n<xacro:include/></robot>";
  std::ofstream(dir / "r.urdf") << small_urdf();
  const Outcome none = run_program({"/usr/bin/env", "PATH=" + (dir / "none").string(), CELLCAL,
                                    "import-robot", "--urdf", dir / "r.xacro"});
  EXPECT_EQ(none.status, 1);
  EXPECT_NE(none.err.find("r.xacro:2: <xacro:include>: a xacro file"), std::string::npos)
      << none.err;
  const Outcome done = with_xacro(dir, "[ \"$1\" = '" + (dir / "r.xacro").string() +
                                           "' ] && cat '" + (dir / "r.urdf").string() + "'\n");
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_EQ(calib::load_robot(dir / "r.toml").joints.size(), 2U);
}

TEST(AXacroFile, GetsItsArguments) {
  const TemporaryDirectory dir;
  std::ofstream(dir / "r.xacro") << "<robot/>";
  std::ofstream(dir / "r.urdf") << small_urdf();
  const std::string script =
      "[ \"$2 $3\" = 'type:=kr6 prefix:=a b' ] && cat '" + (dir / "r.urdf").string() + "'\n";
  EXPECT_EQ(
      with_xacro(dir, script, {"--xacro-arg", "type:=kr6", "--xacro-arg", "prefix:=a b"}).status,
      0);
  EXPECT_EQ(with_xacro(dir, script).status, 1);
  for (const char* wrong : {"type=kr6", ":=x", "--inorder:=1"})
    EXPECT_NE(with_xacro(dir, script, {std::string("--xacro-arg=") + wrong}).status, 0) << wrong;
}

TEST(AXacroFile, ThatXacroRefusesIsNamedWithItsLine) {
  const TemporaryDirectory dir;
  std::ofstream(dir / "r.xacro") << "<robot/>";
  for (const auto& [script, words] : std::vector<std::pair<std::string, std::string>>{
           {"echo 'Undefined [a]' >&2; echo 'when processing file: b.xacro:7' >&2; exit 2",
            "r.xacro: xacro: Undefined [a]; when processing file: b.xacro:7"},
           {"exit 1", "xacro: failed without a reason"},
           {"kill -9 $$", "xacro: failed without a reason"},
           {"yes", "xacro writes more than 16 MB"},
           {"printf '\\033[2J' >&2; exit 1", "?[2J"},
           {"exit 0", "r.xacro: "}}) {
    const Outcome refused = with_xacro(dir, script);
    EXPECT_EQ(refused.status, 1) << script;
    EXPECT_NE(refused.err.find(words), std::string::npos) << refused.err;
    EXPECT_FALSE(std::filesystem::exists(dir / "r.toml")) << script;
  }
}

/// The KR 6 R900 as in ROS, with one text replaced.
std::string kr6_urdf(const std::string& what = {}, const std::string& with = {}) {
  std::string text = "<robot name=\"kr6\">";
  const std::vector<std::array<std::string, 2>> joints{
      {"0 0 0.4", "0 0 -1"},   {"0.025 0 0", "0 1 0"}, {"0.455 0 0", "0 1 0"},
      {"0 0 0.035", "-1 0 0"}, {"0.42 0 0", "0 1 0"},  {"0.08 0 0", "-1 0 0"}};
  for (std::size_t i = 0; i < 6; ++i) {
    const std::string n = std::to_string(i + 1);
    text += "<joint name=\"joint_a" + n + "\" type=\"revolute\"><parent link=\"l" +
            std::to_string(i) + "\"/><child link=\"l" + n + "\"/><origin xyz=\"" + joints[i][0] +
            "\" rpy=\"0 0 0\"/><axis xyz=\"" + joints[i][1] +
            "\"/><limit lower=\"-2\" upper=\"2\" " + "velocity=\"3\"/></joint>";
  }
  text +=
      "<joint name=\"t\" type=\"fixed\"><parent link=\"l6\"/><child link=\"tool0\"/><origin "
      "xyz=\"0 0 0\" rpy=\"0 1.5707963267948966 0\"/></joint></robot>";
  if (const auto at = text.find(what); !what.empty()) text.replace(at, what.size(), with);
  return text;
}

TEST(AUrdf, ThatCountsAnglesOtherwiseThanTheControllerIsRefusedByJoint) {
  const TemporaryDirectory dir;
  std::ofstream machine(dir / "$machine.dat");
  machine << "$TIRORO={X 0,Y 0,Z 400,A 0,B 0,C 0}\n$LENGTH_A=25\n$LENGTH_B=455\n"
             "$TX3P3={X 420,Y 0,Z 35,A 0,B 90,C 0}\n$TFLWP={X 0,Y 0,Z 80,A 0,B 0,C 0}\n"
             "$SOFTN_END[2]=-190\n$SOFTP_END[2]=45\n";
  machine.close();
  const auto import = [&](const std::string& what, const std::string& with) {
    std::filesystem::remove(dir / "r.toml");
    std::ofstream(dir / "r.urdf") << kr6_urdf(what, with);
    Outcome made = run_program({CELLCAL, "import-robot", "--urdf", dir / "r.urdf", "--machine-data",
                                dir / "$machine.dat", "-o", dir / "r.toml"});
    EXPECT_EQ(made.status == 0, std::filesystem::exists(dir / "r.toml"));
    return made;
  };
  const Outcome same = import("", "");
  EXPECT_EQ(same.status, 0) << same.err;
  EXPECT_NE(same.err.find("A2: limits -114.592 to 114.592 deg in the URDF, -190.000 to 45.000 deg"),
            std::string::npos)
      << same.err;
  EXPECT_EQ(import("0.455 0 0", "0.445 0 0").status, 0) << "another length is a warning";
  for (const auto& [what, with, words] : std::vector<std::array<std::string, 3>>{
           {"0 0 -1", "0 0 1", "A1: zero 0.00 deg from the controller's, opposite sense;"},
           {"0.455 0 0\" rpy=\"0 0 0", "0 0 0.455\" rpy=\"0 -1.5707963267948966 0",
            "A2: zero -90.00 deg from the controller's;"},
           {"0.42 0 0\" rpy=\"0 0 0", "0.42 0 0\" rpy=\"0 0.1 0",
            "A5: zero 5.73 deg from the controller's;"},
           {"0 1.5707963267948966 0", "0 0 0", "flange: turned by 90.000 deg"}}) {
    const Outcome made = import(what, with);
    EXPECT_EQ(made.status, 1) << with;
    EXPECT_NE(made.err.find(words), std::string::npos) << made.err;
  }
}

TEST(MachineData, OfAWholeArmMakeItsRobotFromABackup) {
  const TemporaryDirectory dir;
  std::filesystem::create_directories(dir / "backup/KRC/R1/Mada");
  std::filesystem::create_directories(dir / "backup/KRC/STEU/Mada");
  std::ofstream(dir / "backup/KRC/STEU/Mada/$machine.dat") << "$NUM_AX=9\n";
  std::ofstream machine(dir / "backup/KRC/R1/Mada/$machine.dat");
  machine
      << "$TRAFONAME[]=\"#KR5 R1400\"\n$TIRORO={x 0,y 0,z 400,a 0,b 0,c 0}\n$LENGTH_A=180\n"
         "$LENGTH_B=600\n$TX3P3={x 620,y 0,z 40,a 0,b 90,c 0}\n$TFLWP={x 0,y 0,z 80,a 0,b 0,c 0}\n";
  for (int i = 1; i <= 6; ++i)
    machine << "$SOFTN_END[" << i << "]=-100\n$SOFTP_END[" << i << "]=100\n$VEL_AXIS_MA[" << i
            << "]=3000\n$RAT_MOT_AX[" << i << "]={N 6485103,D 49400}\n";
  machine.close();
  const Outcome made = run_program(
      {CELLCAL, "import-robot", "--machine-data", dir / "backup", "-o", dir / "r.toml"});
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(calib::load_robot(dir / "r.toml").name, "KR5 R1400");
  EXPECT_NE(run_program({CELLCAL, "import-robot", "--machine-data",
                         dir / "backup/KRC/STEU/Mada/$machine.dat"})
                .err.find("no lengths of an arm in the machine data. Give $machine.dat of KRC:"),
            std::string::npos);
  const Outcome against = run_program({CELLCAL, "import-robot", "--robot", "kr5_r1400",
                                       "--machine-data", dir / "backup", "-o", dir / "s.toml"});
  EXPECT_EQ(against.status, 0);
  EXPECT_EQ(against.err.find("warning"), std::string::npos) << against.err;
  // The controller's options count for absolute accuracy, and its other values do not.
  std::ofstream(dir / "backup/KRC/STEU/Mada/$option.dat") << "BOOL $ABS_ACCUR=TRUE\n$LENGTH_A=1\n";
  const Outcome accurate = run_program(
      {CELLCAL, "import-robot", "--machine-data", dir / "backup", "-o", dir / "r.toml"});
  EXPECT_NE(accurate.err.find("$ABS_ACCUR: absolute accuracy is active"), std::string::npos)
      << accurate.err;
  EXPECT_EQ(calib::load_robot(dir / "r.toml").joints[0].a_m, 0.18);
  std::ofstream(dir / "backup/KRC/STEU/Mada/$custom.dat") << "BOOL $DEACTIVATE_ABS_ACCUR=TRUE\n";
  EXPECT_EQ(run_program({CELLCAL, "import-robot", "--machine-data", dir / "backup"})
                .err.find("absolute accuracy is active"),
            std::string::npos);
  std::ofstream(dir / "backup/KRC/R1/Mada/$robcor.dat") << "$MODEL_NAME[]=\"#KR30L16_3A C4\"\n";
  const Outcome two = run_program(
      {CELLCAL, "import-robot", "--machine-data", dir / "backup", "-o", dir / "r.toml"});
  EXPECT_EQ(two.status, 0) << two.err;
  EXPECT_NE(two.err.find("warning: KRC/R1/Mada/$machine.dat:1: $TRAFONAME \"#KR5 R1400\", "
                         "KRC/R1/Mada/$robcor.dat:1: $MODEL_NAME \"#KR30L16_3A C4\": two robots"),
            std::string::npos)
      << two.err;
  EXPECT_EQ(calib::load_robot(dir / "r.toml").name, "KR5 R1400");
}

}  // namespace
}  // namespace cellcal::daemon::testing
