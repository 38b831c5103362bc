// Posture at a point: S and T in all their spellings, and motions that keep theirs.

#include <gtest/gtest.h>

#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

using krl::Why;

const calib::JointVector kUp = {-0.2, -1.4, 1.5, 0.3, 0.8, 0.1},
                         kNear = {-0.1, -1.3, 1.4, 0.4, 0.7, 0.2},
                         kFlipped = {-0.2, -1.4, 1.5, 0.3, -0.8, 0.1};

krl::CorrectedProgram correct_motions(const std::string& body,
                                      const krl::CorrectionOptions& options = {},
                                      const std::string& config = "",
                                      const calib::Calibration& c = calibration()) {
  krl::ProgramFiles f;
  f.src = {"p.src", "DEF p()\nBAS(#TOOL,1)\nBAS(#BASE,0)\n" + body + "END\n"};
  f.dat = krl::KrlFile{"p.dat", "DECL E6POS XUP=" + pose_text(kUp) +
                                    "\nDECL E6POS XNEAR=" + pose_text(kNear) +
                                    "\nDECL E6POS XFLIPPED=" + pose_text(kFlipped) + "\n"};
  f.controller = {
      {"$config.dat",
       "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\nDECL E6AXIS XHOME={A1 "
       "0.0,A2 -90.0,A3 90.0,A4 0.0,A5 20.0,A6 0.0}\n" +
           config}};
  return correct_program(c, f, options);
}

std::string based(int bits, int base) {
  std::string digits;
  for (; bits > 0; bits /= base) digits.insert(digits.begin(), "0123456789ABCDEF"[bits % base]);
  return (base == 2 ? "'B" : "'H") + (digits.empty() ? "0" : digits) + "'";
}

TEST(StatusAndTurn, AsBinaryOrHexadecimalConstantsAreTheSameNumbers) {
  for (const auto& q : {kUp, kFlipped}) {
    const StatusAndTurn st = status_and_turn(cell().robot, q);
    const auto plain = correct_motions("PTP " + pose_text(q) + "\n");
    ASSERT_EQ(plain.points.size(), 1U) << all_words(plain);
    for (const int base : {2, 16}) {
      // After a motion in the other posture, which would be kept without S and T.
      std::string pose = pose_text(q, false);
      pose.insert(pose.size() - 1, ",S " + based(st.status, base) + ",T " + based(st.turn, base));
      const auto result =
          correct_motions((q == kUp ? "PTP XFLIPPED\nPTP " : "PTP XUP\nPTP ") + pose + "\n");
      ASSERT_EQ(result.points.size(), 2U) << all_words(result);
      EXPECT_LT((result.points[1].shift_mm - plain.points[0].shift_mm).norm(), 1e-9) << pose;
      EXPECT_NE(result.files[0].text.find(based(st.turn, base)), std::string::npos)
          << "what stays keeps its text";
    }
  }
}

TEST(StatusAndTurn, BecomeDecimalWhereTheyChange) {
  // A6 passes 0 due to the correction of its own axis.
  calib::Calibration c = calibration();
  calib::JointVector q = kUp;
  for (const double a6 : {1e-5, -1e-5}) {
    q[5] = a6;
    const StatusAndTurn st = status_and_turn(cell().robot, q);
    std::string pose = pose_text(q, false);
    pose.insert(pose.size() - 1, ",S " + based(st.status, 2) + ",T " + based(st.turn, 2));
    const auto result = correct_motions("PTP " + pose + "\n");
    ASSERT_EQ(result.points.size(), 1U) << all_words(result);
    if (!result.points[0].status_changed) continue;
    EXPECT_NE(result.files[0].text.find(",T " + std::to_string(st.turn ^ 32) + "}"),
              std::string::npos)
        << result.files[0].text;
    return;
  }
  ADD_FAILURE() << "neither turn changed";
}

TEST(StatusAndTurn, WithTheBitOfAbsoluteAccuracyAreNamedWithThePoint) {
  for (const int bit : {0, 16}) {
    std::string pose = pose_text(kUp, false);
    const StatusAndTurn st = status_and_turn(cell().robot, kUp);
    pose.insert(pose.size() - 1,
                ",S " + std::to_string(st.status + bit) + ",T " + std::to_string(st.turn));
    const auto result = correct_motions("PTP " + pose + "\n");
    ASSERT_EQ(result.points.size(), 1U) << all_words(result);
    EXPECT_EQ(result.points[0].taught_accurately, bit == 16);
  }
}

TEST(ALinearMotion, ToAPointOfThePostureItBeginsInIsCorrected) {
  for (const char* kind : {"LIN", "SLIN"}) {
    const auto result =
        correct_motions("PTP XUP\n" + std::string(kind) + " XNEAR\n" + kind + " XUP\n");
    EXPECT_TRUE(result.refusals.empty()) << all_words(result);
    EXPECT_EQ(result.points.size(), 2U);
  }
  EXPECT_TRUE(correct_motions("PTP XUP\nSPLINE\nSPL XNEAR\nENDSPLINE\n").refusals.empty());
  EXPECT_TRUE(correct_motions("PTP XUP\nCIRC XNEAR,XUP\n").refusals.empty());
}

TEST(ALinearMotion, ToAPointThatAPtpSelectsInAnotherPostureIsRefused) {
  for (const char* motion : {"LIN XFLIPPED", "SLIN XFLIPPED", "CIRC XNEAR,XFLIPPED",
                             "SCIRC XFLIPPED,XNEAR", "SPL XFLIPPED"}) {
    const auto result = correct_motions("PTP XFLIPPED\nPTP XUP\n" + std::string(motion) + "\n");
    ASSERT_FALSE(result.refusals.empty()) << motion;
    EXPECT_EQ(result.refusals[0].why, Why::kOtherPosture) << motion << "\n" << all_words(result);
    EXPECT_EQ(result.refusals[0].line, 6);
    EXPECT_TRUE(result.files.empty());
  }
  EXPECT_TRUE(correct_motions("PTP XUP\nPTP XFLIPPED\nSPTP XNEAR\n").refusals.empty());
}

TEST(ALinearMotion, WhoseBeginningIsNotKnownIsRefused) {
  for (const char* before : {"", "PTP XUP\nGRIP()\nBAS(#TOOL,1)\nBAS(#BASE,0)\n"}) {
    const auto result = correct_motions(before + std::string("LIN XNEAR\n"));
    ASSERT_EQ(result.refusals.size(), 1U) << before << all_words(result);
    EXPECT_EQ(result.refusals[0].why, Why::kPostureNotKnown) << before;
  }
}

/// Of a post-processor that writes the same S and T in all points.
std::string constant(const calib::JointVector& q, const std::string& bits = ",S 0,T 0") {
  return pose_text(q, false).insert(pose_text(q, false).size() - 1, bits);
}

TEST(ALinearMotion, ToAPointWhoseStatusFitsNoPostureKeepsItsOwnWithAWarning) {
  const std::string near = constant(kNear),
                    body = "PTP XUP\nLIN " + near + "\nLIN XNEAR\nLIN " + near + "\n";
  const auto result = correct_motions(body);
  const auto plain = correct_motions("PTP XUP\nLIN XNEAR\n");
  ASSERT_TRUE(result.refusals.empty()) << all_words(result);
  ASSERT_EQ(result.points.size(), 4U);
  for (const std::size_t i : {1U, 3U})
    EXPECT_LT((result.points[i].shift_mm - plain.points.at(1).shift_mm).norm(), 1e-9);
  EXPECT_FALSE(result.points[1].status_changed);
  EXPECT_NE(result.files[0].text.find(",S 0,T 0}"), std::string::npos);
  ASSERT_EQ(result.warnings.size(), 1U);
  EXPECT_NE(calib::words(result.warnings[0])
                .find("which the controller keeps on a path: 2, the first line 5 (p.src:5)"),
            std::string::npos)
      << calib::words(result.warnings[0]);
  EXPECT_TRUE(plain.warnings.empty());
}

TEST(ALinearMotion, ToAPointWhoseStatusFitsNoPostureIsRefusedWhereAPtpUsesItOrTheStartIsUnknown) {
  const std::string point = "XC=" + constant(kNear) + "\n";
  const auto refused_as = [&](const std::string& body) {
    std::string all;
    for (const krl::Refusal& one : correct_motions("DECL E6POS XC\n" + point + body).refusals)
      all += krl::name_of(one.why) + std::string(" ");
    return all;
  };
  EXPECT_EQ(refused_as("PTP XUP\nLIN XC\n"), "");
  EXPECT_EQ(refused_as("PTP XUP\nCIRC XNEAR,XC\n"), "");
  EXPECT_EQ(refused_as("PTP XUP\nLIN XC\nPTP XC\n"), "wrong_turn ");
  EXPECT_EQ(refused_as("LIN XC\n"), "wrong_turn ");
  EXPECT_EQ(refused_as("IF $IN[1] THEN\nPTP XUP\nELSE\nPTP XFLIPPED\nENDIF\nLIN XC\n"),
            "other_posture ");
}

/// The controller looks at S and T of a PTP alone: those of another posture, or of a whole turn more, change nothing.
TEST(ALinearMotion, KeepsThePostureBeforeWhateverStatusItsPointStates) {
  const StatusAndTurn right = status_and_turn(cell().robot, kNear);
  const auto bits = [](int status, int turn) {
    return ",S " + std::to_string(status) + ",T " + std::to_string(turn);
  };
  const std::string frame = pose_text(kUp, false);
  const auto plain = correct_motions("PTP XUP\nLIN XNEAR\nLIN " + frame + "\n");
  ASSERT_EQ(plain.points.size(), 3U) << all_words(plain);
  for (const std::string& other :
       {bits(right.status ^ 4, 10), bits(right.status, right.turn ^ 8),
        bits(right.status, right.turn ^ 32), bits(right.status ^ 1, right.turn)}) {
    const auto result = correct_motions("PTP XUP\nLIN " + constant(kNear, other) + "\nLIN " +
                                        frame + "\nLIN XUP\n");
    ASSERT_EQ(result.points.size(), 3U) << other << all_words(result);
    for (const std::size_t i : {1U, 2U})
      EXPECT_LT((result.points[i].shift_mm - plain.points[i].shift_mm).norm(), 1e-9) << other;
    EXPECT_NE(result.files[0].text.find(other), std::string::npos);
    EXPECT_EQ(result.warnings.size(), 1U) << other;
  }
}

TEST(ALinearMotion, FromA5AtZeroHasTheSideThatItsPointStates) {
  const std::string home = "DECL E6AXIS XHOME={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 0.0,A6 0.0}\n";
  krl::ProgramFiles f = {
      {"p.src", "DEF p()\nBAS(#TOOL,1)\nBAS(#BASE,0)\nPTP XHOME\nLIN XP\nEND\n"}, {}, {}};
  f.controller = {
      {"$config.dat", "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n" + home}};
  const auto to = [&](const calib::JointVector& q) {
    f.dat = krl::KrlFile{"p.dat", "DECL E6POS XP=" + pose_text(q) + "\n"};
    return correct_program(calibration(), f);
  };
  const auto near = to(kNear), flipped = to(kFlipped);
  EXPECT_NE(near.refusals.empty(), flipped.refusals.empty()) << "A5 at 0 is of one side";
  for (const auto* one : {&near, &flipped}) {
    EXPECT_TRUE(one->warnings.empty());
    for (const krl::Refusal& refusal : one->refusals) EXPECT_EQ(refusal.why, Why::kOtherPosture);
  }
}

TEST(ALinearMotion, MayBeginAtAPointThatIsLeft) {
  EXPECT_TRUE(correct_motions("PTP XHOME\nLIN XNEAR\n").refusals.empty());
  const auto left = correct_motions("PTP XUP\nLIN XNEAR\n", {{"XUP"}});
  EXPECT_TRUE(left.refusals.empty()) << all_words(left);
  EXPECT_EQ(left.points.size(), 1U);
  const auto other = correct_motions("PTP XFLIPPED\nLIN XNEAR\n", {{"XFLIPPED"}});
  EXPECT_TRUE(other.refusals.empty()) << all_words(other);
  EXPECT_EQ(other.warnings.size(), 1U);
  const auto twice =
      correct_motions("PTP XHOME\nLIN XNEAR\n", {},
                      "DECL E6AXIS XHOME={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 -20.0,A6 0.0}\n");
  ASSERT_EQ(twice.refusals.size(), 1U) << all_words(twice);
  EXPECT_EQ(twice.refusals[0].why, Why::kPostureNotKnown);
}

/// Of a tool fixed in the cell the axes are not known, and S is.
TEST(ALinearMotion, BeginsInThePostureOfALeftPtpOfAnExternalTool) {
  const auto after = [](const std::string& before, const std::string& then = "LIN XNEAR\n",
                        const calib::Calibration& c = calibration()) {
    return correct_motions("$IPO_MODE=#TCP\n" + before + "$IPO_MODE=#BASE\n" + then,
                           {{"XUP", "XFLIPPED"}}, "", c);
  };
  const auto plain = correct_motions("PTP XUP\nLIN XNEAR\n", {{"XUP"}});
  ASSERT_EQ(plain.points.size(), 1U);
  for (const char* before :
       {"PTP XUP\n", "PTP XUP\nLIN XFLIPPED\n",
        "IF A THEN\nPTP XUP\nELSE\nPTP XUP\nLIN XUP\nENDIF\n",
        "PTP XUP\nLOOP\nLIN XUP\nLIN XFLIPPED\nIF A THEN\nEXIT\nENDIF\nENDLOOP\n"}) {
    const auto result = after(before);
    ASSERT_EQ(result.points.size(), 1U) << before << all_words(result);
    EXPECT_LT((result.points[0].shift_mm - plain.points[0].shift_mm).norm(), 1e-9) << before;
    EXPECT_EQ(result.files[1].text, plain.files[1].text) << before;
  }
  const auto why = [&](const auto&... body) {
    const auto result = after(body...);
    return result.refusals.empty() ? "" : krl::name_of(result.refusals[0].why);
  };
  EXPECT_STREQ(why("LIN XUP\n"), "posture_not_known");
  EXPECT_STREQ(why("PTP XFLIPPED\n"), "other_posture");
  EXPECT_STREQ(why("IF A THEN\nPTP XUP\nELSE\nPTP XFLIPPED\nENDIF\n"), "other_posture");
  EXPECT_STREQ(why("PTP XUP\nIF A THEN\nPTP XFLIPPED\nENDIF\nLIN XUP\n"), "posture_not_known");
  EXPECT_STREQ(why("PTP XUP\n", "LIN " + pose_text(kNear, false) + "\n"), "no_configuration");
}

TEST(ALinearMotion, OfUnknownWholeTurnsIsRefusedWhereTheyMoveTheRealTcp) {
  const std::string body = "$IPO_MODE=#TCP\nPTP XUP\n$IPO_MODE=#BASE\nLIN XNEAR\nLIN " +
                           pose_text({-0.1, -1.3, 1.4, 0.4, 0.7, 0.4}, false) + "\n";
  for (const double ratio : {100.0, 100.5}) {
    calib::Cell other = cell();
    other.robot.joints[5].gear_ratio = ratio;
    other.robot.joints[5].harmonics = {1};
    other.robot.joints[5].harmonic_sigma_rad = 1e-3;
    calib::Random random(1);
    const auto result =
        correct_motions(body, {{"XUP"}}, "", calib::testing::random_calibration(other, random));
    EXPECT_EQ(result.refusals.size(), ratio == 100.0 ? 0U : 2U) << all_words(result);
    for (const krl::Refusal& one : result.refusals) EXPECT_EQ(one.why, Why::kPostureNotKnown);
  }
}

TEST(ALinearMotion, MayBeginAtTheHomeOfItsInlineFormUnlessTheProgramChangesIt) {
  const std::string home = "$H_POS = XHOME\nPTP XHOME\nLIN XNEAR\n";
  EXPECT_EQ(all_words(correct_motions(home)), "");
  const std::string machine = "E6AXIS $H_POS={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 20.0,A6 0.0}\n";
  EXPECT_EQ(all_words(correct_motions("PTP $H_POS\nLIN XNEAR\n", {}, machine)), "");
  for (const char* set : {"", "$H_POS=XHOME\n"}) {
    const auto result =
        correct_motions(set + std::string("PTP $H_POS\nLIN XNEAR\n"), {}, *set != 0 ? machine : "");
    ASSERT_EQ(result.refusals.size(), 1U) << all_words(result);
    EXPECT_EQ(result.refusals[0].why, Why::kPostureNotKnown);
  }
  for (const char* change :
       {"XHOME.A5=-20\n", "XHOME.A1=5\n", "XHOME=XOTHER\n", "SHIFT(XHOME)\n"}) {
    const auto changed = correct_motions(
        change + std::string("BAS(#TOOL,1)\nBAS(#BASE,0)\n") + home, {.still = {"SHIFT"}});
    ASSERT_EQ(changed.refusals.size(), 1U) << change << all_words(changed);
    EXPECT_EQ(changed.refusals[0].why, Why::kPostureNotKnown) << change;
  }
}

}  // namespace
}  // namespace cellcal::daemon::testing
