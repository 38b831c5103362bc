// Programs of offline programming systems (such as RoboDK's KUKA post): no .dat, explicit frames and points, axis
// angles for PTP, points without S and T for LIN, a constant E1.

#include <gtest/gtest.h>

#include <regex>

#include "calib/estimate/predict.h"
#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

std::string axes_text(const calib::JointVector& q) {
  std::string text = "{";
  for (std::size_t i = 0; i < q.size(); ++i) {
    char one[40];
    std::snprintf(one, sizeof one, "A%zu %.5f,", i + 1, q[i] * calib::kDegPerRad);
    text += one;
  }
  return text + "E1 0.00000}";
}

/// Near `from`, since a LIN keeps its posture.
calib::JointVector beside(calib::JointVector from) {
  for (double& q : from) q += 0.02;
  return from;
}

std::string offline_program(const std::vector<calib::JointVector>& from) {
  std::string src =
      "&ACCESS RVP\r\n&COMMENT Generated offline\r\nDEF Prog1 ( )\r\n"
      "GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )\r\nINTERRUPT ON 3\r\n"
      "BAS (#INITMOV,0 )\r\n$ADVANCE = 5\r\n$APO.CDIS = 1.000\r\n"
      "$BASE = {FRAME: X 0.000,Y 0.000,Z 0.000,A 0.000,B 0.000,C 0.000}\r\n"
      "$TOOL = {FRAME: X 59.900,Y 50.500,Z 410.300,A 38.840,B 3.590,C 0.000}\r\n$VEL.CP = 0.50000\r\n";
  for (const calib::JointVector& q : from) {
    src += "PTP " + axes_text(q) + " C_PTP\r\n";
    std::string pose = pose_text(beside(q), false);
    pose.insert(pose.size() - 1, ",E1 0.00000");
    src += "LIN " + pose + " C_DIS\r\n";
  }
  return src + "END\r\n";
}

/// All {...} after PTP or LIN.
std::vector<std::string> points_of(const std::string& src, const std::string& motion) {
  std::vector<std::string> all;
  const std::regex point("\r\n" + motion + " \\{([^}]*)\\}");
  for (std::sregex_iterator one(src.begin(), src.end(), point), end; one != end; ++one)
    all.push_back((*one)[1]);
  return all;
}

calib::JointVector axes_of(const std::string& text) {
  calib::JointVector q(6);
  EXPECT_EQ(std::sscanf(text.c_str(), "A1 %lf,A2 %lf,A3 %lf,A4 %lf,A5 %lf,A6 %lf", &q[0], &q[1],
                        &q[2], &q[3], &q[4], &q[5]),
            6);
  for (double& one : q) one *= calib::kRadPerDeg;
  return q;
}

TEST(AnOfflineProgram, SendsTheRealTcpWhereItWasProgrammed) {
  const auto from = postures(8, 3);
  const std::string src = offline_program(from);
  const calib::Calibration c = calibration();
  const krl::CorrectedProgram result =
      krl::correct_program(c, {{"Prog1.src", src}, std::nullopt, {}});
  ASSERT_TRUE(result.refusals.empty()) << all_words(result);
  ASSERT_EQ(result.points.size(), 2 * from.size());
  const std::string& corrected = result.files.at(0).text;
  const auto ptp = points_of(corrected, "PTP"), lin = points_of(corrected, "LIN");
  ASSERT_EQ(ptp.size(), from.size());
  ASSERT_EQ(lin.size(), from.size());

  const calib::ArmModel nominal(cell());
  const calib::Predictor real(c);
  Frames frames = testing::frames();
  frames.base = Eigen::Isometry3d::Identity();
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Eigen::Vector3d there = real.calibrated(axes_of(ptp[i])).tcp.translation();
    EXPECT_LT((there - nominal.nominal_tcp(from[i]).translation()).norm(), 5e-6) << "PTP " << i;

    // In the posture of the preceding PTP.
    const StatusAndTurn st = status_and_turn(cell().robot, beside(from[i]));
    std::string e6 = "DECL E6POS XP1={" + lin[i];
    e6.replace(
        e6.find(",E1 "), std::string::npos,
        ",S " + std::to_string(st.status) + ",T " + std::to_string(st.turn) + ",E1 0.0}\r\n");
    const auto commanded = run(cell().robot, frames, e6);
    ASSERT_EQ(commanded.size(), 1U);
    ASSERT_EQ(commanded[0].size(), 6U) << lin[i];
    const Eigen::Vector3d at = real.calibrated(commanded[0]).tcp.translation();
    EXPECT_LT((at - nominal.nominal_tcp(beside(from[i])).translation()).norm(), 5e-6)
        << "LIN " << i;
  }
}

TEST(AnOfflineProgram, KeepsEverythingBesideItsPoints) {
  const std::string src = offline_program(postures(3, 3));
  const krl::CorrectedProgram result =
      krl::correct_program(calibration(), {{"Prog1.src", src}, std::nullopt, {}});
  const std::regex points("\\{[XA][^}]*\\}");
  ASSERT_EQ(result.files.size(), 1U) << all_words(result);
  EXPECT_EQ(std::regex_replace(result.files[0].text, points, "{}"),
            std::regex_replace(src, points, "{}"));
  EXPECT_NE(result.files[0].text, src);
}

/// The program with tool and base by number, set again before each motion.
std::string with_numbered_frames(std::string src, const std::string& again) {
  const std::string frames =
      "BASE_DATA[2]={FRAME: X 0.000,Y 0.000,Z 0.000,A 0.000,B 0.000,C 0.000}\r\n"
      "$BASE=BASE_DATA[2]\r\n"
      "TOOL_DATA[3]={FRAME: X 59.900,Y 50.500,Z 410.300,A 38.840,B 3.590,C 0.000}\r\n"
      "$TOOL=TOOL_DATA[3]\r\n";
  const auto from = src.find("$BASE"), to = src.find("$VEL");
  src.replace(from, to - from, frames);
  for (auto at = src.find("LIN {"); at != std::string::npos; at = src.find("LIN {", at + 1)) {
    const std::string more = again.empty() ? frames : again;
    src.insert(at, more);
    at += more.size();
  }
  return src;
}

TEST(AnOfflineProgram, MaySetTheSameFramesMoreThanOnce) {
  const std::string src = offline_program(postures(3, 3));
  const auto correct = [](const std::string& text,
                          const std::vector<krl::KrlFile>& controller = {}) {
    return krl::correct_program(calibration(), {{"Prog1.src", text}, std::nullopt, controller});
  };
  const auto once = correct(src), again = correct(with_numbered_frames(src, {}));
  ASSERT_EQ(all_words(again), "");
  ASSERT_EQ(again.points.size(), once.points.size());
  for (std::size_t i = 0; i < once.points.size(); ++i)
    EXPECT_LT((again.points[i].shift_mm - once.points[i].shift_mm).norm(), 1e-9);

  const std::string other =
      "TOOL_DATA[3]={FRAME: X 59.900,Y 50.500,Z 411.300,A 38.840,B 3.590,C 0.000}\r\n";
  for (const std::string& changes :
       {other, std::string("TOOL_DATA[3].X=60\r\n"), std::string("TOOL_DATA[3]=T\r\n")}) {
    const auto refused = correct(with_numbered_frames(src, changes));
    ASSERT_FALSE(refused.refusals.empty()) << changes;
    EXPECT_EQ(refused.refusals[0].why, krl::Why::kFrameChanged) << changes;
  }
  EXPECT_FALSE(correct(with_numbered_frames(src, other), {{"$config.dat", other}}).refusals.empty())
      << "also where the controller's files state the other value";
}

}  // namespace
}  // namespace cellcal::daemon::testing
