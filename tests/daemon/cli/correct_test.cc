// cellcal correct as a subprocess: poses and programs.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "calib/check/controller_model.h"
#include "calib/files/calibration_json.h"
#include "tests/daemon/cli/content.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

class Correct : public ::testing::Test {
 protected:
  std::string put(const std::string& name, const std::string& text) const {
    std::ofstream(dir_ / name, std::ios::binary) << text;
    return dir_ / name;
  }
  std::string calibration_file(bool publish = true) const {
    calib::Calibration c = calibration();
    c.verdict.judged = publish;
    return put("cal.json", calib::calibration_to_json(c));
  }
  Outcome run_correct(std::vector<std::string> more) const {
    std::vector<std::string> all = {CELLCAL, "correct", "--calibration", dir_ / "cal.json"};
    all.insert(all.end(), more.begin(), more.end());
    return run_program(all);
  }

  TemporaryDirectory dir_;
};

TEST_F(Correct, RefusesAFileThatWasAlteredAndACorrectionThatNoArmHas) {
  const std::string poses =
      put("poses.csv", "x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\n980.5,-120.25,700,20,75,-10\n");
  calib::Calibration c = calibration();
  c.verdict.judged = true;
  std::string text = calib::calibration_to_json(c);
  put("cal.json", text);
  EXPECT_EQ(run_correct({"--poses", poses}).status, 0);
  const std::size_t digit = text.find_first_of("123456789", text.find("\"correction\""));
  text[digit] = text[digit] == '7' ? '8' : '7';
  put("cal.json", text);
  const Outcome altered = run_correct({"--poses", poses});
  EXPECT_EQ(altered.status, 1);
  EXPECT_EQ(altered.out, "");
  EXPECT_NE(altered.err.find("cal.json: sum: not that of its content"), std::string::npos)
      << altered.err;
  // An earlier version, which wrote no sum.
  const auto without_sum = [](const calib::Calibration& one) {
    auto document = nlohmann::json::parse(calib::calibration_to_json(one));
    document.erase("sum");
    return document.dump();
  };
  put("cal.json", without_sum(c));
  const Outcome earlier = run_correct({"--poses", poses});
  EXPECT_EQ(earlier.status, 0) << earlier.err;
  EXPECT_NE(
      earlier.err.find(
          "cal.json: has no sum: written by an earlier version, or taken out. A changed value does not show"),
      std::string::npos)
      << earlier.err;
  for (calib::ParameterResult& one : c.parameters)
    if (calib::parameter_name(c.cell, one.key) == "A2.a") one.correction = 30e-3;
  put("cal.json", without_sum(c));
  for (const char* command : {"correct", "predict"}) {
    const Outcome far = run_program({CELLCAL, command, "--calibration", dir_ / "cal.json",
                                     command[0] == 'c' ? "--poses" : "--joints", poses});
    EXPECT_EQ(far.status, 1);
    EXPECT_EQ(far.out, "");
    EXPECT_NE(far.err.find("cal.json: 30.000 mm correction of A2.a, at most "), std::string::npos)
        << far.err;
  }
}

constexpr const char* kHead = "x_mm,y_mm,z_mm,a_deg,b_deg,c_deg";

TEST_F(Correct, TurnsPosesIntoJointsThatPredictBringsBack) {
  calibration_file();
  const std::string rows = "980.5,-120.25,700,20,75,-10\n990,-110,705,21,74,-9\n";
  const std::string poses = put("poses.csv", kHead + ("\n" + rows)), joints = dir_ / "joints.csv";
  const Outcome outcome = run_correct({"--poses", poses, "-o", joints});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const Outcome back = run_program(
      {CELLCAL, "predict", "--calibration", dir_ / "cal.json", "--joints", joints, "--json"});
  ASSERT_EQ(back.status, 0) << back.err;
  const auto tcp = nlohmann::json::parse(back.out);
  ASSERT_EQ(tcp.size(), 2U);
  EXPECT_NEAR(tcp[0].at("x_mm").get<double>(), 980.5, 2e-6);
  EXPECT_NEAR(tcp[0].at("b_deg").get<double>(), 75.0, 1e-7);
  EXPECT_NEAR(tcp[1].at("y_mm").get<double>(), -110.0, 2e-6);

  const Outcome json = run_correct({"--poses", poses, "--json"});
  ASSERT_EQ(json.status, 0) << json.err;
  const auto list = nlohmann::json::parse(json.out);
  EXPECT_LT(list[0].at("off_mm").get<double>(), 1e-6);
  EXPECT_GT(list[0].at("u95_mm").get<double>(), 0.0);
  EXPECT_EQ(list[0].at("joints_deg").size(), 6U);
}

TEST_F(Correct, AndTheOthersRefuseATableWithoutRows) {
  calibration_file();
  const std::string poses = put("poses.csv", std::string(kHead) + "\n");
  const Outcome corrected = run_correct({"--poses", poses});
  EXPECT_EQ(corrected.status, 1);
  EXPECT_EQ(corrected.out, "");
  EXPECT_NE(corrected.err.find(poses + ": no row after the header"), std::string::npos)
      << corrected.err;
  const std::string joints = put("joints.csv", "A1,A2,A3,A4,A5,A6\n");
  const Outcome predicted =
      run_program({CELLCAL, "predict", "--calibration", dir_ / "cal.json", "--joints", joints});
  EXPECT_NE(predicted.err.find(joints + ": no row after the header"), std::string::npos)
      << predicted.err;
  const std::string touches = put("touches.csv", "A1,A2,A3,A4,A5,A6,target\n");
  const Outcome identified =
      run_program({CELLCAL, "identify", "--cell", CELLCAL_DEMO_CELL, "--touches", touches});
  EXPECT_EQ(identified.status, 1);
  EXPECT_NE(identified.err.find(touches + ": no row after the header"), std::string::npos)
      << identified.err;
}

TEST_F(Correct, WarnsAsPredictDoesOfPosesOutsideTheScope) {
  calib::Calibration c = calibration();
  c.verdict.judged = true;
  c.verdict.workspace = false;
  c.targets.resize(1);
  c.targets[0].id = cell().targets[0].id;
  c.targets[0].centre_m = {0.98, -0.12, 0.7};
  put("cal.json", calib::calibration_to_json(c));
  const std::string poses = put(
      "poses.csv", std::string(kHead) + "\n980.5,-120.25,700,20,75,-10\n980.5,200,700,20,75,-10\n");
  const std::string joints = dir_ / "joints.csv";
  const Outcome corrected = run_correct({"--poses", poses, "-o", joints});
  ASSERT_EQ(corrected.status, 0) << corrected.err;
  const std::string warning = "1 of 2 poses, the first in row 2, are outside the scope";
  EXPECT_NE(corrected.err.find(warning), std::string::npos) << corrected.err;
  const Outcome predicted =
      run_program({CELLCAL, "predict", "--calibration", dir_ / "cal.json", "--joints", joints});
  ASSERT_EQ(predicted.status, 0) << predicted.err;
  EXPECT_NE(predicted.err.find(warning), std::string::npos) << predicted.err;
  c.verdict.workspace = true;
  put("cal.json", calib::calibration_to_json(c));
  EXPECT_EQ(run_correct({"--poses", poses, "-o", joints}).err.find("scope"), std::string::npos);
}

TEST_F(Correct, TakesTheSeedsConfiguration) {
  calibration_file();
  const auto poses = [&](const char* seed) {
    return put("poses.csv", std::string("A1,A2,A3,A4,A5,A6,") + kHead + "\n" + seed +
                                ",980.5,-120.25,700,20,75,-10\n");
  };
  const auto a4 = [&](const char* seed) {
    const Outcome outcome = run_correct({"--poses", poses(seed), "--json"});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return nlohmann::json::parse(outcome.out).at(0).at("joints_deg").at("A5").get<double>();
  };
  EXPECT_GT(a4("0,-60,80,0,40,0"), 0.0);
  EXPECT_LT(a4("0,-60,80,180,-40,0"), 0.0);
}

TEST_F(Correct, NamesWhatIsNotReachedByLineAndWritesNoCsv) {
  calibration_file();
  const std::string poses =
      put("poses.csv", std::string(kHead) + "\n980,-120,700,20,75,-10\n9800,-120,700,20,75,-10\n");
  const std::string joints = dir_ / "joints.csv";
  const Outcome outcome = run_correct({"--poses", poses, "-o", joints});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(outcome.err.find("cellcal correct: " + poses + ":3: out of reach"), 0U) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(joints));
  const Outcome json = run_correct({"--poses", poses, "--json"});
  EXPECT_EQ(json.status, 1);
  EXPECT_EQ(nlohmann::json::parse(json.out).at(1).at("unreached").at("why"), "too_far");
  const Outcome bad =
      run_correct({"--poses", put("bad.csv", std::string(kHead) + "\n1,2,x,4,5,6\n")});
  EXPECT_EQ(bad.status, 1);
  EXPECT_NE(bad.err.find("bad.csv:2: z_mm"), std::string::npos) << bad.err;
}

TEST_F(Correct, RefusesPosesInMetresInColumnsOfMillimetres) {
  calibration_file();
  const std::string joints = dir_ / "joints.csv";
  const Outcome metres =
      run_correct({"--poses", put("poses.csv", std::string(kHead) + "\n0.98,-0.12,0.7,20,75,-10\n"),
                   "-o", joints});
  EXPECT_EQ(metres.status, 1);
  EXPECT_NE(
      metres.err.find(
          "poses.csv: 1 poses, all within 1.210 mm of the base's origin: x_mm, y_mm, z_mm may be in metres"),
      std::string::npos)
      << metres.err;
  EXPECT_FALSE(std::filesystem::exists(joints));
  EXPECT_EQ(
      run_correct({"--poses",
                   put("poses.csv", "x_m,y_m,z_m,a_deg,b_deg,c_deg\n0.98,-0.12,0.7,20,75,-10\n")})
          .status,
      0);
}

TEST_F(Correct, WarnsOfSeedsInRadians) {
  calibration_file();
  std::string rows = std::string("A1,A2,A3,A4,A5,A6,") + kHead + "\n";
  for (int i = 0; i < 5; ++i) rows += "0,-1.05,1.4,0,0.7,0,980.5,-120.25,700,20,75,-10\n";
  const Outcome outcome = run_correct({"--poses", put("poses.csv", rows)});
  EXPECT_NE(outcome.err.find("largest joint angle 1.4 deg in 5 rows"), std::string::npos)
      << outcome.err;
}

TEST_F(Correct, WritesAProgramBesideAndTellsEachShift) {
  calibration_file();
  const KrlProgram program = taught(cell().robot, frames(), postures(6));
  const std::string src = put("weld.src", program.src), config = put("$config.dat", program.config);
  put("weld.dat", program.dat);
  const std::string folder = dir_ / "out";
  const Outcome outcome = run_correct({"--program", src, "--config", config, "-o", folder});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(content(folder + "/weld.src"), program.src);
  EXPECT_NE(content(folder + "/weld.dat"), program.dat);
  EXPECT_NE(outcome.out.find("6 points corrected; the largest shift is "), std::string::npos);
  EXPECT_NE(outcome.out.find("left as it is: XHOME"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("tool 1: the cell file's"), std::string::npos);
  EXPECT_EQ(content(src), program.src) << "the program itself stays";

  put("out/weld.dat", "another");
  std::filesystem::remove(folder + "/weld.src");
  const Outcome there = run_correct({"--program", src, "--config", config, "-o", folder});
  EXPECT_EQ(there.status, 1);
  EXPECT_NE(there.err.find("--force"), std::string::npos) << there.err;
  EXPECT_EQ(content(folder + "/weld.dat"), "another");
  EXPECT_FALSE(std::filesystem::exists(folder + "/weld.src")) << "both or none";
  EXPECT_EQ(run_correct({"--program", src, "--config", config, "-o", folder, "--force"}).status, 0);
  EXPECT_NE(content(folder + "/weld.dat"), "another");

  const Outcome json = run_correct({"--program", src, "--config", config, "--json"});
  ASSERT_EQ(json.status, 0) << json.err;
  const auto all = nlohmann::json::parse(json.out);
  EXPECT_EQ(all.at("points").size(), 6U);
  EXPECT_TRUE(all.at("written").empty());
  EXPECT_LT(all.at("largest").at("left_mm").get<double>(), 2e-3);

  const Outcome onto_itself = run_correct(
      {"--program", src, "--config", config, "-o", std::filesystem::path(src).parent_path()});
  EXPECT_EQ(onto_itself.status, 1);
  EXPECT_NE(onto_itself.err.find("is the program itself"), std::string::npos) << onto_itself.err;
}

TEST_F(Correct, RefusesWhatWasCorrectedAlready) {
  calibration_file();
  const KrlProgram program = taught(cell().robot, frames(), postures(3));
  const std::string src = put("weld.src", program.src), config = put("$config.dat", program.config);
  put("weld.dat", program.dat);
  const std::string folder = dir_ / "out";
  ASSERT_EQ(run_correct({"--program", src, "--config", config, "-o", folder}).status, 0);
  const auto record = nlohmann::json::parse(content(folder + "/weld.corrected.json"));
  EXPECT_EQ(record.at("format"), "cellcal.corrected/1");
  EXPECT_EQ(record.at("points").size(), 3U);
  EXPECT_EQ(record.at("files").size(), 2U);

  const auto again = [&] {
    return run_correct({"--program", folder + "/weld.src", "--config", config, "--json"});
  };
  EXPECT_EQ(again().status, 1);
  EXPECT_NE(again().err.find("corrected already"), std::string::npos) << again().err;
  put("out/weld.dat", program.dat);
  EXPECT_EQ(again().status, 0) << "the original, put back beside the record";
  for (const char* damaged : {"", "[", "{}", "[1]", "{\"format\":\"cellcal.corrected/1\"}"}) {
    put("out/weld.corrected.json", damaged);
    EXPECT_EQ(again().status, 1) << damaged;
    EXPECT_NE(again().err.find("not a record of a correction"), std::string::npos) << again().err;
  }
}

TEST_F(Correct, WritesNothingWhereAPointIsRefused) {
  calibration_file();
  const std::string src = put("p.src", "DEF p()\nPTP {A1 10}\nEND\n"), folder = dir_ / "out";
  const Outcome outcome = run_correct({"--program", src, "-o", folder});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(outcome.err.find("cellcal correct: " + src + ":2: line 2: "), 0U) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(folder));
  const Outcome json = run_correct({"--program", src, "--json", "--language", "de"});
  EXPECT_EQ(nlohmann::json::parse(json.out).at("refusals").at(0).at("why"), "partial");
  EXPECT_NE(json.out.find("incomplete components"), std::string::npos) << "files stay English";
  EXPECT_NE(json.err.find("unvollständige Komponenten"), std::string::npos) << json.err;
  EXPECT_NE(json.err.find("nichts geschrieben"), std::string::npos) << json.err;
  EXPECT_EQ(outcome.err.find("--at-run-time"), std::string::npos) << outcome.err;
  const std::string computed =
      put("q.src", "DEF q()\nDECL E6POS P\nP=P\nPTP P\nLIN_REL {Z 20.0}\nEND\n");
  EXPECT_NE(run_correct({"--program", computed, "-o", folder}).err.find("--at-run-time"),
            std::string::npos);
}

TEST_F(Correct, RefusesAFileWithoutAProgram) {
  calibration_file();
  const std::string src = put("p.src", "MODULE m\nENDMODULE\n");
  for (const std::vector<std::string>& way :
       {std::vector<std::string>{}, {"--at-run-time", "--serial", "5"}}) {
    std::vector<std::string> command = {"--program", src, "-o", dir_ / "out"};
    command.insert(command.end(), way.begin(), way.end());
    const Outcome outcome = run_correct(command);
    EXPECT_EQ(outcome.status, 1);
    EXPECT_EQ(outcome.err.find("cellcal correct: " + src + ": no DEF"), 0U) << outcome.err;
  }
  EXPECT_FALSE(std::filesystem::exists(dir_ / "out"));
}

TEST_F(Correct, RefusesProgramsWhereTheControllerComputesWithAnotherModel) {
  calibration_file();
  const std::string poses =
      put("poses.csv", kHead + std::string("\n980.5,-120.25,700,20,75,-10\n"));
  const KrlProgram taught_here = taught(cell().robot, frames(), postures(3));
  put("weld.src", taught_here.src);
  put("weld.dat", taught_here.dat);
  const std::string data = put("$config.dat", taught_here.config);
  const std::string out = dir_ / "out";
  const auto program = [&](std::vector<std::string> more = {}) {
    std::filesystem::remove_all(out);
    more.insert(more.begin(), {"--program", dir_ / "weld.src", "--config", data, "-o", out});
    return run_correct(more);
  };
  ASSERT_EQ(program().status, 0) << program().err;
  const auto refused_because = [&](const char* why) {
    const Outcome refused = program();
    EXPECT_EQ(refused.status, 1);
    EXPECT_NE(refused.err.find(why), std::string::npos) << refused.err;
    EXPECT_FALSE(std::filesystem::exists(out));
    EXPECT_EQ(program({"--nominal-controller"}).status, 0) << "stated by the user";
    EXPECT_EQ(run_correct({"--poses", poses}).status, 0) << "joint angles need no model";
  };
  calib::Calibration c = calibration();
  c.verdict.judged = true;
  c.cell.robot.absolute_accuracy = calib::AbsoluteAccuracy::kActive;
  put("cal.json", calib::calibration_to_json(c));
  refused_because("absolute_accuracy = \"active\"");
  c.cell.robot.absolute_accuracy = calib::AbsoluteAccuracy::kOff;
  put("cal.json", calib::calibration_to_json(c));
  EXPECT_EQ(program().status, 0);
  calib::ControllerModel model{calib::ControllerModel::Outcome::kDiffers, 20, 12.3e-3,
                               calib::JointVector(6, 0.0)};
  c.verdict.add(*calib::finding_of(model, c.cell.robot));
  put("cal.json", calib::calibration_to_json(c));
  refused_because("controller's model: 12.30 mm from the robot file");
  calibration_file();
  put("$config.dat", taught_here.config + "$ABS_ACCUR=TRUE\n");
  refused_because("$ABS_ACCUR");
  // Where a KR C2 has it: beside the arm's files, in a folder whose other values do not count.
  std::filesystem::create_directories(dir_ / "KRC/STEU/Mada");
  put("$config.dat", taught_here.config);
  const std::string option = put("KRC/STEU/Mada/$option.dat", "BOOL $ABS_ACCUR=TRUE ;MODELL\n");
  const auto with_option = [&](const std::string& custom) {
    return program({"--config", option, "--config", put("KRC/STEU/Mada/$custom.dat", custom)});
  };
  EXPECT_EQ(with_option("BOOL $DEACTIVATE_ABS_ACCUR=FALSE\n").status, 1);
  EXPECT_EQ(with_option("BOOL $DEACTIVATE_ABS_ACCUR=TRUE\n").status, 0);
  c = calibration();
  c.verdict.judged = true;
  c.cell.robot.absolute_accuracy = calib::AbsoluteAccuracy::kInFile;
  put("cal.json", calib::calibration_to_json(c));
  EXPECT_EQ(program().status, 0) << "its model is given";
}

TEST_F(Correct, OfAWithheldCalibrationEndsWithStatus3) {
  calibration_file(false);
  const std::string poses = put("poses.csv", std::string(kHead) + "\n980,-120,700,20,75,-10\n");
  EXPECT_EQ(run_correct({"--poses", poses}).status, 3);
  EXPECT_EQ(run_correct({"--poses", poses, "--withheld"}).status, 0);
}

TEST_F(Correct, NeedsPosesOrAProgramAndNotBoth) {
  EXPECT_EQ(run_correct({}).status, 2);
  EXPECT_EQ(run_correct({"--poses", "p.csv", "--program", "p.src"}).status, 2);
  EXPECT_EQ(run_correct({"--poses", "p.csv", "--leave", "XHOME"}).status, 2);
}

TEST_F(Correct, AndFramesWriteAKrlProgramWithTheOldValuesInIt) {
  calibration_file();
  const std::string config = put("$config.dat", taught(cell().robot, frames(), {}).config),
                    snippet = dir_ / "cellcal_frames.src";
  const std::vector<std::string> all = {CELLCAL,    "frames",    "--calibration", dir_ / "cal.json",
                                        "--config", config,      "--tool",        "1",
                                        "--base",   "3=S1,S2,S3"};
  auto written = all;
  written.insert(written.end(), {"-o", snippet});
  const Outcome outcome = run_program(written);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_EQ(outcome.out.find("TOOL_DATA[1]={X "), 0U) << outcome.out;
  EXPECT_NE(content(snippet).find(";   BASE_DATA[3]="), std::string::npos);
  EXPECT_NE(content(snippet).find("\nDEF cellcal_frames( )\r\n"), std::string::npos);
  written.back() = dir_ / "Frames_2.src";
  EXPECT_EQ(run_program(written).status, 0);
  EXPECT_NE(content(written.back()).find("\nDEF Frames_2( )\r\n"), std::string::npos);
  for (const char* name : {"2_frames.src", "my-frames.src", "frames_of_line_three_cell.src"}) {
    written.back() = dir_ / name;
    const Outcome refused = run_program(written);
    EXPECT_EQ(refused.status, 1) << refused.out;
    EXPECT_NE(refused.err.find("\" is not a name of a KRL program"), std::string::npos)
        << refused.err;
    EXPECT_FALSE(std::filesystem::exists(written.back()));
  }
  auto as_json = all;
  as_json.emplace_back("--json");
  const auto json = nlohmann::json::parse(run_program(as_json).out);
  EXPECT_EQ(json.at("frames").size(), 2U);
  EXPECT_EQ(json.at("mastering_proposal").size(), 6U);
  auto german = all;
  german.insert(german.end(), {"--language", "de"});
  const std::string words = run_program(german).out;
  EXPECT_NE(words.find("mm und "), std::string::npos) << words;
  EXPECT_NE(words.find("Nullpunkte der Achsen: 'cellcal mastering'"), std::string::npos) << words;
  put("$config.dat", "BASE_DATA[3]={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n");
  const std::string empty = run_program(all).out;
  EXPECT_NE(empty.find("BASE_DATA[3]: was empty (all zeros)\n"), std::string::npos) << empty;
  auto wrong = all;
  wrong.back() = "3=S1,S2";
  EXPECT_EQ(run_program(wrong).status, 2);
}

TEST_F(Correct, TakesAProgramBesideFilesOfCellcalAndRefusesItWhereTheyHoldAnotherFrame) {
  calibration_file();
  const KrlProgram program = taught(cell().robot, frames(), postures(3));
  const std::string src = put("weld.src", program.src), config = put("$config.dat", program.config);
  put("weld.dat", program.dat);
  const auto corrected = [&](std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"--program", src, "--config", config, "-o", dir_ / "out"});
    return run_correct(more);
  };
  ASSERT_EQ(corrected({"--at-run-time", "--serial", "5"}).status, 0);
  for (const char* name : {"cellcal_fix.src", "cellcal_fix.dat"})
    std::filesystem::copy(dir_ / "out" / name, dir_ / name);
  const std::string snippet = dir_ / "cellcal_frames.src";
  ASSERT_EQ(run_program({CELLCAL, "frames", "--calibration", dir_ / "cal.json", "--config", config,
                         "--tool", "1", "-o", snippet})
                .status,
            0);
  for (int k = 0; k < 2; ++k) {
    const Outcome beside = corrected({"--force"});
    EXPECT_EQ(beside.status, 0) << beside.err;
  }
  std::string text = content(snippet);
  const std::size_t value = text.rfind("X 59.9000");
  put("cellcal_frames.src", text.replace(value, 9, "X 59.90002"));
  EXPECT_EQ(corrected({"--force"}).status, 0) << "as a REAL of the controller";
  put("cellcal_frames.src", text.replace(value, 10, "X 60.1000"));
  const Outcome other = corrected({"--force"});
  EXPECT_EQ(other.status, 1);
  EXPECT_NE(other.err.find("cellcal_frames.src:7. Set it in $config.dat only (a value that the "
                           "given $config.dat has is no change)"),
            std::string::npos)
      << other.err;
}

TEST_F(Correct, AndMasteringNamesTheAngleOfEachAxisAndThoseThatNoTouchTells) {
  calib::Calibration found = calibration();
  for (calib::ParameterResult& one : found.parameters)
    if (one.key == calib::joint_parameter(calib::ParameterKind::kTheta, 0))
      one.decided_by = calib::DecidedBy::kFrame;
  put("cal.json", calib::calibration_to_json(found));
  const std::string marks =
      "$MAMES[1]=-20.0\n$MAMES[2]=-120.0\n$MAMES[3]=110.0\n"
      "$MAMES[4]=0.0\n$MAMES[5]=0.0\n$MAMES[6]=0.0\n";
  const std::string data =
      put("$machine.dat", marks + "DECL INDIVIDUAL_MAMES $INDIVIDUAL_MAMES=#NONE\n");
  std::vector<std::string> all = {CELLCAL, "mastering", "--calibration", dir_ / "cal.json"};
  const Outcome relative = run_program(all);
  ASSERT_EQ(relative.status, 0) << relative.err;
  EXPECT_NE(relative.out.find("A1  no touch tells its zero"), std::string::npos) << relative.out;
  EXPECT_NE(relative.out.find("WARNING: another mastering"), std::string::npos);
  EXPECT_NE(relative.out.find("from the angle shown at its mark"), std::string::npos);
  all.insert(all.end(), {"--machine-data", data});
  EXPECT_NE(run_program(all).out.find("deg is shown, and set the mastering there (110.0000)"),
            std::string::npos);
  all.insert(all.end(), {"--language", "de"});
  const std::string german = run_program(all).out;
  EXPECT_NE(german.find("A1  keine Antastung bestimmt ihren Nullpunkt: Er dreht"),
            std::string::npos)
      << german;
  EXPECT_NE(german.find("Grad angezeigt wird, und dort die Justage setzen (110,0000)"),
            std::string::npos)
      << german;
  EXPECT_NE(german.find("WARNUNG: Eine andere Justage"), std::string::npos) << german;
  all.emplace_back("--json");
  const auto json = nlohmann::json::parse(run_program(all).out);
  bool off = false;
  for (const auto& axis : json.at("axes")) {
    const double offset = axis.at("offset_deg"), twice = 2.0 * axis.at("sigma_deg").get<double>();
    const bool is_off = axis.at("decided_by") == "data" && std::abs(offset) > twice;
    EXPECT_EQ(axis.at("off"), is_off) << axis;
    EXPECT_EQ(axis.contains("jog_to_deg"), is_off) << axis;
    if (is_off) {
      EXPECT_DOUBLE_EQ(axis.at("jog_to_deg").get<double>() + offset, axis.at("mark_deg"));
    }
    off = off || is_off;
  }
  EXPECT_TRUE(off);
  EXPECT_EQ(json.at("axes").at(0).at("decided_by"), "frame");
  put("$machine.dat", marks + "DECL INDIVIDUAL_MAMES $INDIVIDUAL_MAMES=#RDC ; Existenz\n");
  for (const auto& axis : nlohmann::json::parse(run_program(all).out).at("axes"))
    EXPECT_FALSE(axis.contains("mark_deg") || axis.contains("jog_to_deg")) << axis;
  all.resize(6);
  const std::string in_arm = run_program(all).out;
  EXPECT_EQ(in_arm.find("deg is shown"), std::string::npos) << in_arm;
  EXPECT_NE(in_arm.find("from the angle shown at its mark"), std::string::npos) << in_arm;
  EXPECT_NE(in_arm.find("$MAMES_ACT[n]"), std::string::npos) << in_arm;
}

/// A backup of two modules that share a point of $config.dat; with `bad` one moves relatively.
std::string put_backup(const std::filesystem::path& folder, bool bad) {
  const auto points = postures(2);
  std::filesystem::create_directories(folder / "KRC/R1/System");
  std::filesystem::create_directories(folder / "KRC/R1/Program");
  const auto put = [&](const char* name, const std::string& text) {
    std::ofstream(folder / "KRC/R1" / name, std::ios::binary) << text;
  };
  put("System/$config.dat",
      "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\nDECL GLOBAL E6POS XG=" +
          pose_text(points[0]) + "\n");
  put("Program/a.src", "DEF A()\nBAS(#TOOL,1)\nBAS(#BASE,0)\nPTP XG\nPTP XA\nEND\n");
  put("Program/A.DAT", "DECL E6POS XA=" + pose_text(points[1]) + "\n");
  put("Program/b.src", std::string("DEF B()\nBAS(#TOOL,1)\nBAS(#BASE,0)\nPTP XG\n") +
                           (bad ? "LIN_REL {Z 5}\n" : "") + "END\n");
  return folder;
}

TEST_F(Correct, ABackupWritesTheChangedFilesAndARecordThatRefusesASecondTime) {
  calibration_file();
  const std::string backup = put_backup(dir_ / "backup", false), out = dir_ / "out";
  const Outcome outcome = run_correct({"--backup", backup, "-o", out});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("2 of 2 modules with motions corrected, 2 points"), std::string::npos)
      << outcome.out;
  for (const char* file : {"KRC/R1/System/$config.dat", "KRC/R1/Program/A.DAT"})
    EXPECT_TRUE(std::filesystem::exists(dir_ / "out" / file)) << file;
  EXPECT_FALSE(std::filesystem::exists(dir_ / "out/KRC/R1/Program/a.src"));
  const Outcome again = run_correct({"--backup", out, "-o", dir_ / "more"});
  EXPECT_EQ(again.status, 1);
  EXPECT_NE(again.err.find("is corrected already"), std::string::npos) << again.err;
  EXPECT_EQ(run_correct({"--backup", backup, "-o", out}).status, 1);
  EXPECT_EQ(run_correct({"--backup", backup, "-o", backup}).status, 1);
}

TEST_F(Correct, ABackupLeavesTemplatesAndBinaryDataOfOptionsAndRefusesADamagedDataList) {
  calibration_file();
  const std::string backup = put_backup(dir_ / "backup", false), out = dir_ / "out";
  std::ofstream(backup + "/SnmpData.dat", std::ios::binary) << std::string("\x01\0\xff data", 8);
  std::filesystem::create_directories(dir_ / "backup/C/KRC/Roboter/Template");
  std::ofstream(backup + "/C/KRC/Roboter/Template/vorgabe.src") << "DEF V()\nPTP XG\nEND\n";
  const Outcome left = run_correct({"--backup", backup, "-o", out});
  EXPECT_NE(left.out.find("2 of 2 modules"), std::string::npos) << left.out << left.err;
  EXPECT_FALSE(std::filesystem::exists(out + "/SnmpData.dat"));
  EXPECT_NE(left.out.find("left as it is: SnmpData.dat (no readable KRL)"), std::string::npos)
      << left.out;
  std::ofstream(backup + "/log.dat") << std::string(20000, 'x') << "\n";
  const Outcome logged = run_correct({"--backup", backup, "-o", dir_ / "logged"});
  EXPECT_NE(logged.out.find("2 of 2 modules"), std::string::npos) << logged.err;
  EXPECT_NE(logged.out.find("left as it is: log.dat"), std::string::npos) << logged.out;
  std::ofstream(backup + "/damaged.dat", std::ios::binary) << std::string("DEFDAT D\0\n", 10);
  const Outcome outcome = run_correct({"--backup", backup, "-o", dir_ / "more"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("damaged.dat: byte 8 is NUL"), std::string::npos) << outcome.err;
}

TEST_F(Correct, ABackupOfAnAbsolutelyAccurateArmIsRefusedByTheControllersOptions) {
  calibration_file();
  const std::string backup = put_backup(dir_ / "backup", false);
  std::filesystem::create_directories(dir_ / "backup/KRC/STEU/Mada");
  const auto corrected = [&](const std::string& accurate, const std::string& deactivated) {
    put("backup/KRC/STEU/Mada/$option.dat",
        "DEFDAT $OPTION\nBOOL $ABS_ACCUR=" + accurate + "\nENDDAT\n");
    put("backup/KRC/STEU/Mada/$custom.dat",
        "DEFDAT $CUSTOM\nBOOL $DEACTIVATE_ABS_ACCUR=" + deactivated + "\nENDDAT\n");
    std::filesystem::remove_all(dir_ / "out");
    return run_correct({"--backup", backup, "-o", dir_ / "out"});
  };
  const Outcome refused = corrected("TRUE", "FALSE");
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("$ABS_ACCUR: absolute accuracy is active"), std::string::npos)
      << refused.err;
  EXPECT_EQ(corrected("TRUE", "TRUE").status, 0);
  EXPECT_EQ(corrected("FALSE", "FALSE").status, 0);
}

TEST_F(Correct, ABackupOfWhichNothingCanBeCorrectedIsStatus3) {
  calibration_file();
  const std::string backup = put_backup(dir_ / "backup", true);
  const Outcome outcome = run_correct({"--backup", backup, "-o", dir_ / "out", "--json"});
  EXPECT_EQ(outcome.status, 3) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(dir_ / "out"));
  const auto report = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(report.at("modules").at(0).at("refusals").at(0).at("why"), "shared");
  EXPECT_EQ(report.at("modules").at(1).at("refusals").at(0).at("why"), "relative_motion");
  EXPECT_NE(outcome.err.find("as they are. Computed points are corrected while the program runs"),
            std::string::npos)
      << outcome.err;
}

TEST_F(Correct, ABackupWithARefusedModuleIsWrittenWithStatus3AndTheReasonOnceOnStandardError) {
  calibration_file();
  const std::string backup = put_backup(dir_ / "backup", false);
  put("backup/KRC/R1/Program/c.src", "DEF C()\nBAS(#TOOL,1)\nBAS(#BASE,0)\nLIN {Z 5}\nEND\n");
  put("backup/KRC/R1/Program/still.src", "DEF STILL()\nXQ.X=5\nEND\n");
  for (const bool at_run_time : {false, true}) {
    std::vector<std::string> command = {"--backup", backup, "-o", dir_ / "out"};
    if (at_run_time) command.insert(command.end(), {"--at-run-time", "--serial", "5", "--force"});
    const Outcome outcome = run_correct(command);
    EXPECT_EQ(outcome.status, 3) << outcome.err;
    EXPECT_NE(outcome.err.find("cellcal correct: KRC/R1/Program/c.src:4: line 4: incomplete"),
              std::string::npos)
        << outcome.err;
    EXPECT_NE(outcome.out.find(" KRC/R1/Program/c.src  1 refusal\n"), std::string::npos)
        << outcome.out;
    EXPECT_EQ(outcome.out.find("incomplete"), std::string::npos) << outcome.out;
    EXPECT_NE(outcome.err.find("1 of 3 modules with motions refused; they stay as they are\n"),
              std::string::npos)
        << outcome.err;
    EXPECT_TRUE(std::filesystem::exists(dir_ / "out/cellcal.corrected.json"));
    EXPECT_TRUE(std::filesystem::exists(
        dir_ / (at_run_time ? "out/KRC/R1/Program/a.src" : "out/KRC/R1/Program/A.DAT")));
    EXPECT_FALSE(std::filesystem::exists(dir_ / "out/KRC/R1/Program/c.src"));
  }
}

TEST_F(Correct, AProgramOfHomesAloneIsStatus3) {
  calibration_file();
  const std::string src = put("p.src", "DEF P()\nPTP XHOME\nEND\n");
  const std::string config =
      put("$config.dat", "DECL E6AXIS XHOME={A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}\n");
  const Outcome outcome = run_correct({"--program", src, "--config", config, "-o", dir_ / "out"});
  EXPECT_EQ(outcome.status, 3);
  EXPECT_NE(outcome.err.find("1 motions and no point to correct"), std::string::npos)
      << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(dir_ / "out"));
}

TEST_F(Correct, ReadsCalledRoutinesOfTheFolderAndThoseThatAreNamed) {
  calibration_file();
  const auto points = postures(1);
  const std::string src = put(
      "p.src", "DEF P()\nBAS(#TOOL,1)\nBAS(#BASE,0)\nPTP XP\nCLAMP()\nGLUE_ON()\nLIN XP\nEND\n");
  put("p.dat", "DECL E6POS XP=" + pose_text(points[0]) + "\n");
  put("clamp.src", "DEF CLAMP()\n$OUT[1]=TRUE\nEND\n");
  const std::string config =
      put("$config.dat", "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n");
  const Outcome unknown = run_correct({"--program", src, "--config", config});
  EXPECT_EQ(unknown.status, 1);
  EXPECT_NE(unknown.err.find("GLUE_ON in line 6"), std::string::npos) << unknown.err;
  EXPECT_EQ(
      run_correct({"--program", src, "--config", config, "--does-not-move", "glue_on"}).status, 0);
}

TEST_F(Correct, ProposesTheCorrectionAtRunTimeForComputedPointsButNotForWhereTheArmIs) {
  calibration_file();
  const std::string config =
      put("$config.dat", "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n");
  put("p.dat", "DECL E6POS XP=" + pose_text(postures(1)[0]) + "\nDECL E6POS XR\n");
  for (const bool own : {false, true}) {
    const std::string src =
        put("p.src", std::string("DEF P()\nBAS(#TOOL,1)\nBAS(#BASE,0)\nPTP XP\nXR=") +
                         (own ? "$POS_ACT" : "NEXT()") + "\nLIN XR\nEND\n");
    const Outcome outcome =
        run_correct({"--program", src, "--config", config, "--does-not-move", "NEXT"});
    EXPECT_EQ(outcome.status, 1);
    EXPECT_EQ(outcome.err.find("--at-run-time") == std::string::npos, own) << outcome.err;
  }
}

TEST_F(Correct, NamesACalledProgramThatMovesAndIsNotCorrected) {
  calibration_file();
  const auto points = postures(2);
  const std::string src =
      put("p.src", "DEF P()\nBAS(#TOOL,1)\nBAS(#BASE,0)\nPTP XP\nPLACE()\nPTP XP\nEND\n");
  put("p.dat", "DECL E6POS XP=" + pose_text(points[0]) + "\n");
  put("place.src", "DEF PLACE()\nPTP XP9\nEND\n");
  put("place.dat", "DECL E6POS XP9=" + pose_text(points[1]) + "\n");
  const std::string config =
      put("$config.dat", "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n");
  for (const bool at_run_time : {false, true}) {
    std::vector<std::string> command = {"--program", src, "--config", config, "--json"};
    if (at_run_time) command.insert(command.end(), {"--at-run-time", "--serial", "5"});
    const Outcome outcome = run_correct(command);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    const std::string warning =
        "moves and is not corrected. Correct all programs together with --backup";
    EXPECT_NE(outcome.err.find(warning), std::string::npos) << outcome.err;
    EXPECT_EQ(nlohmann::json::parse(outcome.out).at("warnings").size(), 1U);
  }
}

TEST_F(Correct, WarnsOnceOfPointsTaughtWithAbsoluteAccuracyWhereNothingStatesIt) {
  calibration_file();
  const auto points = postures(2);
  const auto accurate = [](std::string point) {
    const StatusAndTurn st = status_and_turn(cell().robot, postures(1)[0]);
    const std::string s = ",S " + std::to_string(st.status);
    return point.replace(point.find(s), s.size(), ",S " + std::to_string(st.status + 16));
  };
  const std::string src =
      put("p.src", "DEF P()\nBAS(#TOOL,1)\nBAS(#BASE,0)\nPTP XP\nPTP XQ\nEND\n");
  put("p.dat", "DECL E6POS XP=" + accurate(pose_text(points[0])) +
                   "\nDECL E6POS XQ=" + pose_text(points[1]) + "\n");
  const std::string config =
      put("$config.dat", "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n");
  const std::string words = "1 points were taught with absolute accuracy (S bit 4), the first XP (";
  const auto warned = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all = {"--program", src, "--config", config, "--json"};
    all.insert(all.end(), more.begin(), more.end());
    const Outcome outcome = run_correct(all);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    const bool said = outcome.err.find(words) != std::string::npos;
    EXPECT_EQ(nlohmann::json::parse(outcome.out).at("warnings").size(), said ? 1U : 0U);
    return said;
  };
  EXPECT_TRUE(warned({}));
  EXPECT_FALSE(warned({"--nominal-controller"}));
  EXPECT_FALSE(warned({"--config", put("$machine.dat", "$ABS_ACCUR=#NONE\n")}));
  calib::Calibration c = calibration();
  c.verdict.judged = true;
  c.cell.robot.absolute_accuracy = calib::AbsoluteAccuracy::kOff;
  put("cal.json", calib::calibration_to_json(c));
  EXPECT_FALSE(warned({}));
  calibration_file();
  put("p.dat",
      "DECL E6POS XP=" + pose_text(points[0]) + "\nDECL E6POS XQ=" + pose_text(points[1]) + "\n");
  EXPECT_FALSE(warned({}));
}

/// A point computed by the running program, and a relative motion.
const char* const kAtRunTime =
    "DEF P()\r\nBAS(#TOOL,1)\r\nBAS(#BASE,0)\r\nPTP XHOME\r\nPTP XP\r\nXP.Z=XP.Z+5.0\r\nLIN XP C_DIS\r\n"
    "LIN_REL {Z 5.0}\r\nEND\r\n";

TEST_F(Correct, AtRunTimeRewritesTheMotionsAndWritesTheModuleAndRestoreTakesItBack) {
  calibration_file();
  const std::string src = put("p.src", kAtRunTime), out = dir_ / "out";
  put("p.dat", "DEFDAT P\nDECL E6POS XP=" + pose_text(postures(1)[0]) + "\nENDDAT\n");
  const std::string config =
      put("$config.dat", "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n");
  const std::vector<std::string> at_run_time = {
      "--program", src,  "--config", config,   "--serial",
      "123456",    "-o", out,        "--json", "--at-run-time"};
  const Outcome outcome = run_correct(at_run_time);
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto report = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(report.at("modules").at(0).at("corrected"), 3);
  EXPECT_EQ(report.at("modules").at(0).at("load"), "the tool's own");
  EXPECT_EQ(report.at("modules").at(0).at("left"),
            nlohmann::json::parse(R"([{"name": "XHOME", "why": "home or mastering reference"}])"));
  EXPECT_EQ(report.at("fix_module").at("serial"), 123456);
  EXPECT_GT(report.at("fix_module").at("most_mm").get<double>(), 1.0);
  EXPECT_EQ(report.at("written").size(), 4U);
  for (const char* file : {"cellcal_fix.src", "cellcal_fix.dat", "p.corrected.json"})
    EXPECT_TRUE(std::filesystem::exists(dir_ / "out" / file)) << file;
  EXPECT_NE(content(dir_ / "out/p.src").find("LIN CC_FIX(XP) C_DIS\r\n"), std::string::npos);
  EXPECT_NE(content(dir_ / "out/cellcal_fix.dat").find("CCF_SERIAL=123456\r\n"), std::string::npos);

  EXPECT_EQ(run_correct(at_run_time).status, 1);  // the files exist
  const Outcome again = run_correct({"--program", dir_ / "out/p.src", "--dat", dir_ / "p.dat",
                                     "--at-run-time", "--serial", "123456"});
  EXPECT_EQ(again.status, 1);
  EXPECT_NE(again.err.find("corrected already"), std::string::npos) << again.err;
  const Outcome back =
      run_program({CELLCAL, "correct", "--restore", dir_ / "out/p.src", "-o", dir_ / "back"});
  ASSERT_EQ(back.status, 0) << back.err;
  EXPECT_EQ(content(dir_ / "back/p.src"), kAtRunTime);
  EXPECT_EQ(run_program({CELLCAL, "correct", "--restore", src, "-o", dir_ / "more"}).status, 1);
}

TEST_F(Correct, AtRunTimeTakesAWholeBackupAndPutsTheModuleWithItsPrograms) {
  calibration_file();
  const std::string backup = put_backup(dir_ / "backup", true), out = dir_ / "out";
  const Outcome outcome =
      run_correct({"--backup", backup, "--at-run-time", "--serial", "123456", "-o", out});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("2 of 2 modules with motions corrected at run time, 4 motions"),
            std::string::npos)
      << outcome.out;
  for (const char* file :
       {"KRC/R1/Program/a.src", "KRC/R1/Program/b.src", "KRC/R1/Program/cellcal_fix.src",
        "KRC/R1/Program/cellcal_fix.dat", "cellcal.corrected.json"})
    EXPECT_TRUE(std::filesystem::exists(dir_ / "out" / file)) << file;
  EXPECT_FALSE(std::filesystem::exists(dir_ / "out/KRC/R1/Program/A.DAT"));
}

TEST_F(Correct, AtRunTimeNeedsTheRobotsNumberAndACalibrationForTheWorkspace) {
  calibration_file();
  const std::string src = put("p.src", "DEF P()\nPTP XHOME\nEND\n");
  EXPECT_NE(run_correct({"--program", src, "--at-run-time"}).err.find("--serial"),
            std::string::npos);
  EXPECT_EQ(run_correct({"--program", src, "--at-run-time", "--serial", "0"}).status, 2);
  EXPECT_EQ(run_correct({"--program", src, "--serial", "5"}).status, 2);
  const Outcome homes =
      run_correct({"--program", src, "--at-run-time", "--serial", "5", "-o", dir_ / "out"});
  EXPECT_EQ(homes.status, 0) << homes.err;  // the home is known to the module
  EXPECT_NE(homes.out.find("left as it is: XHOME (home or mastering reference)\n"),
            std::string::npos)
      << homes.out;
  calib::Calibration near = calibration();
  near.verdict.judged = true;
  near.verdict.workspace = false;
  put("cal.json", calib::calibration_to_json(near));
  const Outcome outcome = run_correct({"--program", src, "--at-run-time", "--serial", "5"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("holds near its targets only"), std::string::npos) << outcome.err;
  EXPECT_EQ(run_correct({"--program", src, "--at-run-time", "--serial", "5", "--anywhere"}).status,
            0);
}

}  // namespace
}  // namespace cellcal::daemon::testing
