#include "daemon/krl/correct_program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bitset>
#include <regex>

#include "calib/estimate/predict.h"
#include "calib/model/error.h"
#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

using krl::correct_program;
using krl::CorrectedProgram;

/// Everything but the numbers of point declarations.
std::string without_points(const std::string& dat) {
  return std::regex_replace(dat, std::regex("E6POS [^\r\n]*"), "");
}

TEST(AProgram, SendsTheRealTcpWhereItWasProgrammed) {
  const auto points = postures(60);
  const KrlProgram program = taught(cell().robot, frames(), points);
  const calib::Calibration c = calibration();
  const CorrectedProgram result = correct_program(c, files(program));
  ASSERT_TRUE(result.refusals.empty()) << all_words(result);
  ASSERT_EQ(result.points.size(), points.size());
  ASSERT_EQ(result.files.size(), 2U);

  const calib::ArmModel nominal(cell());
  const calib::Predictor real(c);
  const auto commanded = run(cell().robot, frames(), result.files[1].text);
  ASSERT_EQ(commanded.size(), points.size());
  double before = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    ASSERT_EQ(commanded[i].size(), 6U) << "P" << i + 1;
    const Eigen::Isometry3d wanted = nominal.nominal_tcp(points[i]);
    const Eigen::Isometry3d there = real.calibrated(commanded[i]).tcp;
    EXPECT_LT((there.translation() - wanted.translation()).norm(), 2e-6) << "P" << i + 1;
    EXPECT_LT((there.linear() - wanted.linear()).norm(), 2e-6) << "P" << i + 1;
    before += (real.calibrated(points[i]).tcp.translation() - wanted.translation()).norm();
  }
  EXPECT_GT(before / static_cast<double>(points.size()), 1e-3) << "there was something to correct";
}

TEST(AProgram, WithoutAnythingToCorrectIsTheSameToTheByte) {
  const KrlProgram program = taught(cell().robot, frames(), postures(40, 2));
  const CorrectedProgram result = correct_program(calibration(1, 0.0), files(program));
  ASSERT_TRUE(result.refusals.empty()) << all_words(result);
  ASSERT_EQ(result.files.size(), 2U);
  EXPECT_EQ(result.files[0].text, program.src);
  EXPECT_EQ(result.files[1].text, program.dat);
  EXPECT_LT(result.largest()->shift_mm.norm(), 1e-6);
}

TEST(AProgram, KeepsAllBytesBesideItsPoints) {
  const KrlProgram program = taught(cell().robot, frames(), postures(10));
  const CorrectedProgram result = correct_program(calibration(), files(program));
  ASSERT_EQ(result.files.size(), 2U) << all_words(result);
  EXPECT_EQ(result.files[0].text, program.src) << "inline forms have no numbers of points";
  EXPECT_NE(result.files[1].text, program.dat);
  EXPECT_EQ(without_points(result.files[1].text), without_points(program.dat));
}

TEST(AProgram, TellsEachPointsShiftAndTheLargest) {
  const auto points = postures(10);
  const CorrectedProgram result =
      correct_program(calibration(), files(taught(cell().robot, frames(), points)));
  ASSERT_EQ(result.points.size(), 10U) << all_words(result);
  for (const krl::CorrectedPoint& point : result.points) {
    EXPECT_EQ(point.file, "weld.dat");
    EXPECT_EQ(point.tool, 1);
    EXPECT_EQ(point.base, 3);
    EXPECT_GT(point.shift_mm.norm(), 0.01);
    EXPECT_GT(point.u95_mm, 0.0);
    EXPECT_LE(point.shift_mm.norm(), result.largest()->shift_mm.norm());
  }
  EXPECT_EQ(result.points[3].name, "XP4");
  EXPECT_EQ(result.points[3].line, 13);
  ASSERT_EQ(result.left.size(), 1U);
  EXPECT_EQ(result.left[0].name, "XHOME");
}

TEST(AProgram, GivesThePosturesOfItsPointsForAPlan) {
  const auto points = postures(12);
  const auto found = krl::program_postures(cell(), files(taught(cell().robot, frames(), points)));
  EXPECT_TRUE(found.refusals.empty());
  const calib::ArmModel nominal(cell());
  std::size_t met = 0;
  for (const calib::JointVector& wanted : points)
    met += std::ranges::any_of(found.postures, [&](const calib::JointVector& q) {
      return (nominal.nominal_tip_m(q) - nominal.nominal_tip_m(wanted)).norm() < 1e-5;
    });
  EXPECT_EQ(met, points.size());
}

TEST(AProgram, TakesAnotherToolAsStiffAndAsStated) {
  Frames other = frames();
  other.tool.translation().z() -= 0.1;
  const auto points = postures(10);
  KrlProgram program = taught(cell().robot, other, points);
  program.config +=
      "LOAD_DATA[1]={M 4.0,CM {X 0.0,Y 0.0,Z 90.0,A 0.0,B 0.0,C 0.0},J {X 0.0,Y 0.0,Z 0.0}}\r\n";
  const calib::Calibration c = calibration();
  const CorrectedProgram result = correct_program(c, files(program));
  ASSERT_TRUE(result.refusals.empty()) << all_words(result);
  ASSERT_EQ(result.tools.size(), 1U);
  EXPECT_FALSE(result.tools[0].cells);
  EXPECT_TRUE(result.tools[0].load_known);
  calib::Tool tool = cell().tool;
  tool.tcp = other.tool;
  tool.mass_kg = 4.0;
  tool.com_m = {0.0, 0.0, 0.09};
  const calib::Predictor real(calib::with_tool(c, tool));
  const calib::ArmModel nominal(cell().robot, tool);
  const auto commanded = run(cell().robot, other, result.files[1].text);
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_LT((real.calibrated(commanded[i]).tcp.translation() -
               nominal.nominal_tcp(points[i]).translation())
                  .norm(),
              2e-6);
}

/// Plain KRL, without inline forms.
krl::ProgramFiles plain(const std::string& body, const std::string& dat = "") {
  krl::ProgramFiles f;
  f.src = {"p.src", "DEF p()\n" + body + "END\n"};
  f.dat = krl::KrlFile{"p.dat", "DEFDAT P\n" + dat + "ENDDAT\n"};
  f.controller = {{"$config.dat",
                   "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"
                   "BASE_DATA[2]={X 100.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n"}};
  return f;
}

TEST(AxisAngles, BecomeThoseThatBringTheRealTcpThere) {
  const calib::Calibration c = calibration();
  const auto result = correct_program(
      c, plain("BAS(#TOOL,1)\nPTP XA\nPTP {A1 20.0,A2 -80.0,A3 80.0,A4 10,A5 +40.0,A6 0.0}\n",
               "DECL E6AXIS XA={A1 10.0,A2 -90.0,A3 90.0,A4 0.0,A5 45.00,A6 0.0,E1 0.0}\n"));
  ASSERT_TRUE(result.refusals.empty()) << all_words(result);
  ASSERT_EQ(result.points.size(), 2U);
  calib::JointVector written(6);
  ASSERT_EQ(
      std::sscanf(result.files[1].text.c_str(),
                  "DEFDAT P\nDECL E6AXIS XA={A1 %lf,A2 %lf,A3 %lf,A4 %lf,A5 %lf,A6 %lf,E1 0.0}",
                  &written[0], &written[1], &written[2], &written[3], &written[4], &written[5]),
      6)
      << result.files[1].text;
  for (double& q : written) q *= calib::kRadPerDeg;
  calib::JointVector taught_rad = {10.0, -90.0, 90.0, 0.0, 45.0, 0.0};
  for (double& q : taught_rad) q *= calib::kRadPerDeg;
  EXPECT_LT((calib::Predictor(c).calibrated(written).tcp.translation() -
             calib::ArmModel(cell()).nominal_tcp(taught_rad).translation())
                .norm(),
            1e-6);
  EXPECT_NE(result.files[0].text.find("A5 +4"), std::string::npos) << "its plus stays";
}

TEST(FramesInPlainKrl, AreFollowedInTheOrderOfTheText) {
  const std::string point = pose_text({-0.2, -1.4, 1.5, 0.3, 0.8, 0.1});
  const auto result = correct_program(
      calibration(), plain("$TOOL=TOOL_DATA[1]\n$BASE=BASE_DATA[2]\nPTP " + point +
                               "\n$BASE=$NULLFRAME\nLIN P1 C_DIS\nBAS(#BASE,1)\nSLIN "
                               "P2 WITH $VEL=1, $BASE=BASE_DATA[2] C_SPL\n",
                           "E6POS P1=" + point + "\nDECL POS P2=" + point + "\n"));
  ASSERT_TRUE(result.refusals.empty()) << all_words(result);
  ASSERT_EQ(result.points.size(), 3U);
  EXPECT_EQ(result.points[0].base, 2);
  EXPECT_EQ(result.points[1].base, 0);
  EXPECT_EQ(result.points[2].base, 2);
  EXPECT_LT((result.points[0].shift_mm - result.points[2].shift_mm).norm(), 1e-9);
  EXPECT_GT((result.points[0].shift_mm - result.points[1].shift_mm).norm(), 1e-3);
}

TEST(AStatement, BehindAFormFeedOrAnotherControlCharacterIsRead) {
  const std::string point = pose_text({-0.2, -1.4, 1.5, 0.3, 0.8, 0.1});
  const auto result = correct_program(
      calibration(), plain("BAS(#TOOL,1)\n\fBAS(#BASE,0)\n\vPTP\f" + point + "\n\fLIN P1\n\x1a",
                           "\fE6POS P1=" + point + "\n\x1a"));
  EXPECT_EQ(all_words(result), "");
  EXPECT_EQ(result.points.size(), 2U);
}

TEST(AStatement, BehindANoBreakSpaceIsRead) {
  const std::string point = pose_text({-0.2, -1.4, 1.5, 0.3, 0.8, 0.1});
  for (const std::string space : {"\xA0", "\xC2\xA0"}) {
    const auto result = correct_program(
        calibration(), plain(space + "BAS(#TOOL,1)\n" + space + " " + space + "\nBAS(#BASE,0)" +
                                 space + "\n" + space + "PTP" + space + point + "\nLIN P1\n",
                             "E6POS" + space + "P1=" + point + "\n" + space));
    EXPECT_EQ(all_words(result), "");
    EXPECT_EQ(result.points.size(), 2U);
  }
}

TEST(StatusAndTurnInBinary, AreReadWithABlankBehindTheB) {
  const calib::JointVector q = {-0.2, -1.4, 1.5, 0.3, 0.8, 0.1};
  const StatusAndTurn st = status_and_turn(cell().robot, q);
  std::string binary = pose_text(q, false);
  binary.insert(binary.size() - 1,
                ",S 'B " + std::bitset<3>(static_cast<unsigned>(st.status)).to_string() +
                    "',T 'B  " + std::bitset<6>(static_cast<unsigned>(st.turn)).to_string() + "'");
  const std::string body = "BAS(#TOOL,1)\nBAS(#BASE,0)\nPTP ";
  const auto result = correct_program(calibration(), plain(body + binary + "\n")),
             decimal = correct_program(calibration(), plain(body + pose_text(q) + "\n"));
  ASSERT_EQ(result.points.size(), 1U) << all_words(result);
  EXPECT_EQ(result.points[0].shift_mm, decimal.points.at(0).shift_mm);
  EXPECT_NE(result.files[0].text.find(",S 'B "), std::string::npos) << "as long as it stays";
}

TEST(AFrameWithoutStatus, IsReachedInThePostureOfTheMotionBeforeIt) {
  const calib::JointVector q = {0.2, -1.4, 1.5, 0.3, 0.8, 0.1};
  const std::string pose = pose_text(q, false), axes = "{A1 10,A2 -80,A3 85,A4 15,A5 45,A6 5}";
  const std::string frames = "BAS(#TOOL,1)\nBAS(#BASE,0)\n";
  const auto good = correct_program(
      calibration(), plain(frames + "PTP " + axes + "\nWAIT SEC 1\nLIN " + pose + "\n"));
  ASSERT_TRUE(good.refusals.empty()) << all_words(good);
  EXPECT_EQ(good.points.size(), 2U);
  for (const std::string between : {"GRIP()\nBAS(#TOOL,1)\nBAS(#BASE,0)\n",
                                    "IF A THEN\nGRIP()\nENDIF\nBAS(#TOOL,1)\nBAS(#BASE,0)\n"}) {
    const auto bad = correct_program(
        calibration(), plain(frames + "PTP " + axes + "\n" + between + "LIN " + pose + "\n"));
    ASSERT_EQ(bad.refusals.size(), 1U) << between << all_words(bad);
    EXPECT_EQ(bad.refusals[0].why, krl::Why::kNoConfiguration) << between;
  }
}

TEST(WhereTheArmStandsInTheWorld, CountsForPointsInBases) {
  const auto points = postures(5);
  KrlProgram program = taught(cell().robot, frames(), points);
  Frames moved = frames();
  const Eigen::Isometry3d robroot = calib::to_isometry({{500.0, 20.0, 800.0}, {15.0, 0.0, 0.0}});
  moved.base = robroot * frames().base;
  KrlProgram in_world = taught(cell().robot, moved, {});
  in_world.src = program.src;
  in_world.dat = program.dat;
  in_world.config += "$ROBROOT={X 500.0,Y 20.0,Z 800.0,A 15.0,B 0.0,C 0.0}\r\n";
  const auto here = correct_program(calibration(), files(program));
  const auto there = correct_program(calibration(), files(in_world));
  ASSERT_TRUE(there.refusals.empty()) << all_words(there);
  EXPECT_TRUE(there.robroot_stated);
  ASSERT_EQ(here.points.size(), there.points.size());
  for (std::size_t i = 0; i < here.points.size(); ++i)
    EXPECT_LT((here.points[i].shift_mm - there.points[i].shift_mm).norm(), 2e-3);
}

/// The joint angles that a controller takes to the points of a program.
std::vector<calib::JointVector> commanded(const std::string& dat) {
  return run(cell().robot, frames(), dat);
}

TEST(AProgramOfAnotherArm, BringsThisArmsTcpToWhereThatOnesWas) {
  const calib::Calibration other = calibration(3), here = calibration(4);
  const auto program = taught(cell().robot, frames(), postures(20));
  krl::CorrectionOptions options;
  options.from = &other;
  const auto result = correct_program(here, files(program), options);
  ASSERT_EQ(all_words(result), "");
  const calib::Predictor there(other), now(here);
  const auto before = commanded(program.dat), after = commanded(result.files.at(1).text);
  ASSERT_EQ(before.size(), after.size());
  double most = 0.0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const Eigen::Vector3d wanted = there.calibrated(before[i]).tcp.translation();
    EXPECT_LT((now.calibrated(after[i]).tcp.translation() - wanted).norm(), 0.02e-3);
    most = std::max(most, (now.calibrated(before[i]).tcp.translation() - wanted).norm());
  }
  EXPECT_GT(most, 0.1e-3);
  options.from = &here;
  EXPECT_EQ(correct_program(here, files(program), options).files.at(1).text, program.dat);
  calib::Calibration longer = other;
  longer.cell.robot.joints[1].a_m += 0.1;
  options.from = &longer;
  EXPECT_THROW(correct_program(here, files(program), options), calib::FileError);
}

TEST(AProgramForTheOfflineSystem, ComesBackToItsTouchedUpPoints) {
  const calib::Calibration here = calibration(5);
  const auto program = taught(cell().robot, frames(), postures(20));
  krl::CorrectionOptions options;
  options.from = &here;
  const auto up = correct_program(krl::as_drawn(here), files(program), options);
  ASSERT_EQ(all_words(up), "");
  krl::ProgramFiles again = files(program);
  again.dat = up.files.at(1);
  const auto down = correct_program(here, again);
  ASSERT_EQ(all_words(down), "");
  const auto before = commanded(program.dat), after = commanded(down.files.at(1).text);
  for (std::size_t i = 0; i < before.size(); ++i)
    for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(before[i][k], after[i][k], 2e-6);
}

}  // namespace
}  // namespace cellcal::daemon::testing
