// CELLCAL_FIX, executed with 32-bit REAL, compared with the correction in double precision.

#include "daemon/krl/fix_module.h"

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <numbers>

#include "calib/estimate/predict.h"
#include "calib/files/files.h"
#include "calib/model/error.h"
#include "tests/daemon/krl/fixture.h"
#include "tests/daemon/krl/krl_controller.h"

namespace cellcal::daemon::testing {
namespace {

using State = sim::krl::Interpreter::State;
constexpr int kSerial = 4711;
constexpr double kPreciseMm = 0.02, kPreciseDeg = 0.002;

/// All effects on the tip: compliance, play, harmonics, functions, bearings, a bending tool.
calib::Cell rich(calib::Cell one) {
  for (calib::Joint& joint : one.robot.joints) {
    joint.function_sigma_rad = 40.0 * calib::kRadPerArcsec;
    joint.function_reach_rad = 5.0 * calib::kRadPerDeg;
    joint.function_min_rad = joint.min_rad;
    joint.function_max_rad = joint.max_rad;
    joint.bearing_sigma_rad_per_nm = 1e-7;
    joint.counterbalance_sigma_rad = 20.0 * calib::kRadPerArcsec;
    joint.stiffening_sigma_rad = 30.0 * calib::kRadPerArcsec;
    joint.stiffening_nm = 300.0;
  }
  one.robot.joints[2].function_fast_sigma_rad = 8.0 * calib::kRadPerArcsec;
  one.robot.joints[1].waves = {{143, 8.0 * calib::kRadPerArcsec}};
  return one;
}

calib::Cell cell_with(const char* robot) {
  calib::Cell one = cell();
  one.robot = calib::load_robot(std::string(CELLCAL_ROBOTS_FOLDER "/") + robot);
  return one;
}

calib::Calibration calibration_of(const calib::Cell& one, double scale = 1.0) {
  calib::Random random(3);
  return calib::testing::random_calibration(one, random, scale, calib::kFullestLevel);
}

std::vector<calib::JointVector> regular_postures(const calib::Robot& robot, int count) {
  const calib::ArmModel arm(robot, cell().tool);
  calib::Random random(5);
  std::vector<calib::JointVector> all;
  while (static_cast<int>(all.size()) < count) {
    calib::JointVector q;
    for (const calib::Joint& joint : robot.joints)
      q.push_back(random.uniform(joint.min_rad + 0.15, joint.max_rad - 0.15));
    const auto j = arm.nominal_jacobian(q);
    if (std::abs((j * j.transpose()).determinant()) > 1e-2 && std::abs(std::sin(q[4])) > 0.2)
      all.push_back(q);
  }
  return all;
}

const Frames kFrames = frames();

std::string point_text(const calib::Robot& robot, const calib::JointVector& q,
                       const Frames& in = kFrames) {
  calib::Tool tool;
  tool.tcp = in.tool;
  const auto f = calib::to_frame(in.base.inverse() * calib::ArmModel(robot, tool).nominal_tcp(q));
  const auto [s, t] = status_and_turn(robot, q);
  char text[250];
  std::snprintf(text, sizeof text, "{X %.4f,Y %.4f,Z %.4f,A %.5f,B %.5f,C %.5f,S %d,T %d}",
                f.xyz_mm[0], f.xyz_mm[1], f.xyz_mm[2], f.abc_deg[0], f.abc_deg[1], f.abc_deg[2], s,
                t);
  return text;
}

krl::FixModule module_of(const calib::Calibration& c, const std::string& config = {}) {
  krl::Data data;
  if (!config.empty()) read_data({"$config.dat", config}, data);
  return fix_module(c, data, {kSerial, "0123456789abcdef"});
}

/// A controller with CELLCAL_FIX and a program of these statements and declarations.
struct Rig {
  Rig(const calib::Robot& robot, const krl::FixModule& module, const std::string& body,
      const std::string& data = {})
      : controller(robot, {{"cellcal_fix.src", module.src.text},
                           {"cellcal_fix.dat", module.dat.text},
                           {"p.src", "DEF P ( )\n" + body + "\nEND\n"},
                           {"p.dat", "DEFDAT P PUBLIC\n" + data + "\nENDDAT\n"}}) {
    controller.set_frame("$TOOL", calib::to_frame(kFrames.tool));
    controller.set_frame("$BASE", calib::to_frame(kFrames.base));
  }
  KrlController& run() {
    controller.run("P");
    return controller;
  }
  KrlController controller;
};

struct Missed {
  double mm = 0.0, deg = 0.0;
};
/// Largest distance of the calibrated TCP from the nominal one at `taught`.
Missed missed(const calib::Calibration& c, const std::vector<calib::JointVector>& commanded,
              const std::vector<calib::JointVector>& taught, std::size_t from = 0) {
  const calib::Predictor predictor(c);
  Missed worst;
  for (std::size_t i = 0; i < taught.size(); ++i) {
    const Eigen::Isometry3d off =
        predictor.nominal(taught[i]).inverse() * predictor.calibrated(commanded.at(i + from)).tcp;
    worst.mm = std::max(worst.mm, off.translation().norm() * calib::kMmPerM);
    worst.deg = std::max(worst.deg, calib::turn_vector(off.linear()).norm() * calib::kDegPerRad);
  }
  return worst;
}

struct Points {
  std::string body, data;
};
Points ptp_to(const calib::Robot& robot, const std::vector<calib::JointVector>& taught,
              const char* function = "CC_FIX_PTP") {
  Points p{"PTP CC_STAY(XHOME)\n", ""};
  for (std::size_t i = 0; i < taught.size(); ++i) {
    const std::string name = "XP" + std::to_string(i + 1);
    p.body += "PTP " + std::string(function) + "(" + name + ")\n";
    p.data += "DECL E6POS " + name + "=" + point_text(robot, taught[i]) + "\n";
  }
  return p;
}

void expect_precise(const calib::Cell& one) {
  const auto taught = regular_postures(one.robot, 100);
  const auto c = calibration_of(one);
  const Points p = ptp_to(one.robot, taught);
  Rig rig(one.robot, module_of(c), p.body, p.data);
  KrlController& controller = rig.run();
  ASSERT_EQ(controller.state(), State::kEnded)
      << controller.message() << (controller.messages.empty() ? "" : controller.messages[0]);
  EXPECT_GT(missed(c, taught, taught).mm, 1.0);  // without correction
  const Missed off = missed(c, controller.reached, taught, 1);
  EXPECT_LT(off.mm, kPreciseMm);
  EXPECT_LT(off.deg, kPreciseDeg);
  const auto& executed = controller.executed();
  const auto count = static_cast<std::int64_t>(taught.size());
  // Stated in README.md.
  EXPECT_LT(executed.statements / count, 1200);
  EXPECT_LT(executed.operations / count, 5000);
  EXPECT_LT(executed.frames / count, 250);
}

TEST(FixModule, BringsTheRealTcpWithin20MicrometresOnTheDemoArm) { expect_precise(rich(cell())); }
TEST(FixModule, BringsTheRealTcpWithin20MicrometresOnAKr16) {
  expect_precise(rich(cell_with("kr16_r1610_2.toml")));
}
TEST(FixModule, BringsTheRealTcpWithin20MicrometresOnAKr6) {
  expect_precise(rich(cell_with("kr6_r900_2.toml")));
}

std::string why(const KrlController& controller) {
  return controller.messages.empty() ? controller.message() : controller.messages.back();
}

const calib::Calibration& demo_calibration() {
  static const calib::Calibration c = calibration_of(rich(cell()));
  return c;
}
const krl::FixModule& demo_module() {
  static const krl::FixModule module = module_of(demo_calibration());
  return module;
}
const calib::Robot& demo() { return demo_calibration().cell.robot; }

TEST(FixModule, CorrectsPointsOfEveryTypeInThePostureOfTheMotionBefore) {
  const auto taught = regular_postures(demo(), 12);
  const std::vector<std::pair<const char*, const char*>> kinds = {
      {"E6POS", "CC_FIX"}, {"POS", "CC_FIX_POS"}, {"FRAME", "CC_FIX_FRAME"}};
  for (const auto& [type, function] : kinds) {
    Points p;
    std::vector<calib::JointVector> ends;
    for (std::size_t i = 0; i < taught.size(); ++i) {
      const std::string n = std::to_string(i);
      std::string text = point_text(demo(), taught[i]);
      p.body += "PTP CC_FIX_PTP(XA" + n + ")\nLIN " + function + "(XB" + n + ")\n";
      p.data += "DECL E6POS XA" + n + "=" + text + "\n";
      if (std::string(type) == "FRAME") text = text.substr(0, text.find(",S")) + "}";
      p.data += "DECL " + std::string(type) + " XB" + n + "=" + text + "\n";
      ends.insert(ends.end(), 2, taught[i]);
    }
    Rig rig(demo(), demo_module(), p.body, p.data);
    KrlController& controller = rig.run();
    ASSERT_EQ(controller.state(), State::kEnded) << type << " " << why(controller);
    EXPECT_LT(missed(demo_calibration(), controller.reached, ends).mm, kPreciseMm) << type;
  }
}

TEST(FixModule, CorrectsAxisAnglesAsThePlaceOfTheNominalArm) {
  const auto taught = regular_postures(demo(), 20);
  for (const char* type : {"E6AXIS", "AXIS"}) {
    std::string body, data;
    for (std::size_t i = 0; i < taught.size(); ++i) {
      const std::string name = "XP" + std::to_string(i);
      body += "PTP CC_FIX_" + std::string(type) + "(" + name + ")\n";
      data += "DECL " + std::string(type) + " " + name + "={";
      for (std::size_t k = 0; k < 6; ++k)
        data += (k ? ",A" : "A") + std::to_string(k + 1) + " " +
                std::to_string(taught[i][k] * calib::kDegPerRad);
      data += "}\n";
    }
    Rig rig(demo(), demo_module(), body, data);
    KrlController& controller = rig.run();
    ASSERT_EQ(controller.state(), State::kEnded) << why(controller);
    EXPECT_LT(missed(demo_calibration(), controller.reached, taught).mm, kPreciseMm);
  }
}

TEST(FixModule, CorrectsComputedAndShiftedPointsAndElementsInALoop) {
  const auto taught = regular_postures(demo(), 1);
  Rig rig(demo(), demo_module(),
          "DECL INT I\nDECL E6POS P\nPTP CC_FIX_PTP(XP[1])\nFOR I=1 TO 3\nP=XP[1]\n"
          "P.Z=P.Z+10.0*I\nLIN CC_FIX(P)\nENDFOR\n"
          "LIN CC_FIX_FRAME(XP[1]:SHIFT)",
          "DECL E6POS XP[1]\nXP[1]=" + point_text(demo(), taught[0]) +
              "\nDECL FRAME SHIFT={X 1.0,Y 2.0,Z -5.0,A 0.0,B 0.0,C 0.0}");
  KrlController& controller = rig.run();
  ASSERT_EQ(controller.state(), State::kEnded) << why(controller);
  const calib::Predictor predictor(demo_calibration());
  const Eigen::Isometry3d first = kFrames.base.inverse() * predictor.nominal(taught[0]);
  for (std::size_t i = 1; i < controller.reached.size(); ++i) {
    Eigen::Isometry3d wanted = first;
    if (i <= 3)
      wanted.translation().z() += 0.01 * static_cast<double>(i);
    else
      wanted = wanted * calib::to_isometry({{1.0, 2.0, -5.0}, {}});
    const Eigen::Isometry3d is =
        kFrames.base.inverse() * predictor.calibrated(controller.reached[i]).tcp;
    EXPECT_LT((is.translation() - wanted.translation()).norm() * calib::kMmPerM, kPreciseMm) << i;
  }
}

TEST(FixModule, CorrectsTheWayOfARelativeMotion) {
  const auto taught = regular_postures(demo(), 1);
  Rig rig(demo(), demo_module(),
          "PTP CC_FIX_PTP(XP)\nLIN_REL CC_BY({X 30.0,Y -20.0,Z 10.0,A 0.0,B 0.0,C 0.0})\n"
          "LIN_REL CC_BY_TOOL({X 0.0,Y 5.0,Z -40.0,A 3.0,B 0.0,C 1.0}) #TOOL\n"
          "PTP_REL CC_BY_AXES({A1 2.0,A2 0.0,A3 -1.0,A4 0.0,A5 0.0,A6 4.0})",
          "DECL E6POS XP=" + point_text(demo(), taught[0]));
  KrlController& controller = rig.run();
  ASSERT_EQ(controller.state(), State::kEnded) << why(controller);
  const calib::Predictor predictor(demo_calibration());
  Eigen::Isometry3d wanted = kFrames.base.inverse() * predictor.nominal(taught[0]);
  const auto off_mm = [&](std::size_t i) {
    const Eigen::Isometry3d is =
        kFrames.base.inverse() * predictor.calibrated(controller.reached.at(i)).tcp;
    return (is.translation() - wanted.translation()).norm() * calib::kMmPerM;
  };
  wanted.translation() += Eigen::Vector3d(0.03, -0.02, 0.01);
  EXPECT_LT(off_mm(1), kPreciseMm);
  wanted = wanted * calib::to_isometry({{0.0, 5.0, -40.0}, {3.0, 0.0, 1.0}});
  EXPECT_LT(off_mm(2), kPreciseMm);
}

/// The real TCP does not stand where the program says.
TEST(FixModule, MovesTheRealTcpFromAPointThatStaysByWhatIsProgrammed) {
  const auto taught = regular_postures(demo(), 1);
  const std::string data = "DECL E6POS XP=" + point_text(demo(), taught[0]);
  const calib::Predictor predictor(demo_calibration());
  const calib::FrameMmDeg by_tool{{0.0, 5.0, -40.0}, {3.0, 0.0, 1.0}};
  for (const char* stays :
       {"PTP CC_STAY(XHOME)", "PTP CC_STAY_POS(XP)", "PTP CC_STAY($AXIS_ACT)"}) {
    Rig rig(demo(), demo_module(),
            std::string(stays) + "\nLIN_REL CC_BY({X 30.0,Y -20.0,Z 10.0,A 0.0,B 0.0,C 0.0})\n" +
                stays + "\nLIN_REL CC_BY_TOOL({X 0.0,Y 5.0,Z -40.0,A 3.0,B 0.0,C 1.0}) #TOOL\n" +
                stays +
                "\nPTP_REL CC_BY_AXES({A1 2.0,A2 0.0,A3 -1.0,A4 0.0,A5 0.0,A6 4.0})\n"
                "LIN_REL CC_BY({X 0.0,Y 0.0,Z 15.0,A 0.0,B 0.0,C 0.0})",
            data);
    rig.controller.at = taught[0];
    KrlController& controller = rig.run();
    ASSERT_EQ(controller.state(), State::kEnded) << stays << " " << why(controller);
    const auto is = [&](std::size_t i) {
      return kFrames.base.inverse() * predictor.calibrated(controller.reached.at(i)).tcp;
    };
    const auto off_mm = [&](std::size_t i, const Eigen::Isometry3d& wanted) {
      return (is(i).translation() - wanted.translation()).norm() * calib::kMmPerM;
    };
    EXPECT_LT(off_mm(1, Eigen::Translation3d(0.03, -0.02, 0.01) * is(0)), kPreciseMm) << stays;
    EXPECT_LT(off_mm(3, is(2) * calib::to_isometry(by_tool)), kPreciseMm) << stays;
    const std::array turned = {2.0, 0.0, -1.0, 0.0, 0.0, 4.0};
    for (std::size_t i = 0; i < 6; ++i)
      EXPECT_NEAR(controller.reached[5][i] - controller.reached[4][i],
                  turned[i] * calib::kRadPerDeg, 1e-6);
    EXPECT_LT(off_mm(6, Eigen::Translation3d(0.0, 0.0, 0.015) * is(5)), kPreciseMm) << stays;
  }
}

TEST(FixModule, ARelativeMotionAfterTheArmWasMovedElsewhereRemainsAsShort) {
  const auto taught = regular_postures(demo(), 2);
  Rig rig(demo(), demo_module(),
          "PTP CC_FIX_PTP(XP1)\nPTP XP2\nLIN_REL CC_BY({X 0.0,Y 0.0,Z -30.0,A 0.0,B 0.0,C 0.0})",
          "DECL E6POS XP1=" + point_text(demo(), taught[0]) +
              "\nDECL E6POS XP2=" + point_text(demo(), taught[1]));
  KrlController& controller = rig.run();
  ASSERT_EQ(controller.state(), State::kEnded) << why(controller);
  const calib::ArmModel arm(cell());
  const double way =
      (arm.nominal_tip_m(controller.reached[2]) - arm.nominal_tip_m(controller.reached[1])).norm();
  EXPECT_NEAR(way * calib::kMmPerM, 30.0, 2.0 * demo_module().most_mm);
}

/// An interrupt's routine goes elsewhere, in another posture, and back, at every statement of a call.
TEST(FixModule, BringsTheTcpToThePointsOfAProgramAndOfItsInterruptInsideOfACall) {
  const calib::Calibration c = calibration();
  const auto taught = regular_postures(demo(), 3);
  ASSERT_NE(status_and_turn(demo(), taught[0]).status, status_and_turn(demo(), taught[1]).status);
  std::string frame = point_text(demo(), taught[0]);
  frame = frame.substr(0, frame.find(",S")) + "}";
  for (const auto& [within, motion] : {std::pair("CC_FIX_FRAME", "LIN CC_FIX_FRAME(XF)"),
                                       std::pair("CC_BY", "LIN_REL CC_BY(XNONE)")}) {
    Rig rig(demo(), module_of(c),
            "INTERRUPT DECL 5 WHEN CALLED DO ASIDE( )\nINTERRUPT ON 5\nPTP CC_FIX_PTP(XP)\n" +
                std::string(motion) +
                "\nEND\nDEF ASIDE ( )\nPTP CC_FIX_PTP(XQ)\nPTP CC_FIX_PTP(XP)",
            "DECL GLOBAL BOOL CALLED=FALSE\nDECL E6POS XP=" + point_text(demo(), taught[0]) +
                "\nDECL E6POS XQ=" + point_text(demo(), taught[1]) + "\nDECL FRAME XF=" + frame +
                "\nDECL FRAME XNONE={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}");
    std::vector<calib::JointVector> ends;
    for (std::int64_t n = 1; rig.controller.run_interrupted("P", within, n, "CALLED"); ++n) {
      ASSERT_EQ(rig.controller.state(), State::kEnded) << n << " " << why(rig.controller);
      ASSERT_EQ(rig.controller.reached.size(), 4 * static_cast<std::size_t>(n));
      ends.insert(ends.end(), {taught[0], taught[1], taught[0], taught[0]});
    }
    EXPECT_GT(ends.size(), 4U * 300U);
    EXPECT_LT(missed(c, rig.controller.reached, ends).mm, kPreciseMm) << motion;
  }
}

TEST(FixModule, TakesToolAndBaseOfTheMotionsOwnWith) {
  const auto taught = regular_postures(demo(), 5);
  Points p{"PTP CC_STAY(XHOME)\n", ""};
  for (std::size_t i = 0; i < taught.size(); ++i) {
    const std::string name = "XP" + std::to_string(i + 1);
    p.body += "$TOOL=TOOL_DATA[1]\n$BASE=BASE_DATA[1]\nPTP CC_STAY(XHOME)\n";
    // Settings of WITH for this motion only.
    p.body += name + "=CC_FIX_PTP_IN(" + name + ",TOOL_DATA[2],BASE_DATA[2],#BASE,$LOAD)\n";
    p.body += "$TOOL=TOOL_DATA[2]\n$BASE=BASE_DATA[2]\nPTP " + name + "\n";
    p.data += "DECL E6POS " + name + "=" + point_text(demo(), taught[i]) + "\n";
  }
  Rig rig(demo(), demo_module(), p.body, p.data);
  rig.controller.put_data("TOOL_DATA", 1, Eigen::Isometry3d::Identity());
  rig.controller.put_data("BASE_DATA", 1, Eigen::Isometry3d::Identity());
  rig.controller.put_data("TOOL_DATA", 2, kFrames.tool);
  rig.controller.put_data("BASE_DATA", 2, kFrames.base);
  KrlController& controller = rig.run();
  ASSERT_EQ(controller.state(), State::kEnded) << why(controller);
  std::vector<calib::JointVector> ends;
  for (std::size_t i = 2; i < controller.reached.size(); i += 2)
    ends.push_back(controller.reached[i]);
  EXPECT_LT(missed(demo_calibration(), ends, taught).mm, kPreciseMm);
}

TEST(FixModule, TakesAnotherToolAsStatedWithItsLoad) {
  const Eigen::Isometry3d gripper = calib::to_isometry({{10.0, -20.0, 150.0}, {0.0, 30.0, 5.0}});
  const std::string load =
      "LOAD_DATA[3]={M 9.0,CM {X 0.0,Y 5.0,Z 80.0,A 0.0,B 0.0,C 0.0},J {X "
      "0.0,Y 0.0,Z 0.0}}\n";
  const std::string config =
      "DEFDAT $CONFIG PUBLIC\nTOOL_DATA[3]={X 10.0,Y -20.0,Z 150.0,A 0.0,B 30.0,C 5.0}\n" + load +
      "ENDDAT\n";
  const krl::FixModule module = module_of(demo_calibration(), config);
  const auto taught = regular_postures(demo(), 20);
  const Frames in{gripper, kFrames.base};
  Points p{"PTP CC_STAY(XHOME)\n", ""};
  for (std::size_t i = 0; i < taught.size(); ++i) {
    const std::string name = "XP" + std::to_string(i + 1);
    p.body += "PTP CC_FIX_PTP(" + name + ")\n";
    p.data += "DECL E6POS " + name + "=" + point_text(demo(), taught[i], in) + "\n";
  }
  Rig rig(demo(), module, p.body, p.data);
  rig.controller.set_frame("$TOOL", calib::to_frame(gripper));
  KrlController& controller = rig.run();
  ASSERT_EQ(controller.state(), State::kEnded) << why(controller);
  calib::Tool tool = cell().tool;
  tool.tcp = gripper;
  tool.length_m = gripper.translation().norm();
  tool.mass_kg = 9.0;
  tool.com_m = {0.0, 0.005, 0.08};
  EXPECT_LT(missed(with_tool(demo_calibration(), tool), controller.reached, taught, 1).mm,
            kPreciseMm);
}

/// Expects a halt before the first corrected motion, with this message, even after the start key.
void expect_halt(Rig& rig, const std::string& words) {
  KrlController& controller = rig.run();
  EXPECT_EQ(controller.state(), State::kHalted) << controller.message();
  EXPECT_EQ(controller.reached.size(), 1U);
  EXPECT_NE(why(controller).find(words), std::string::npos) << why(controller);
  controller.press_start();
  EXPECT_EQ(controller.state(), State::kHalted);
  EXPECT_EQ(controller.reached.size(), 1U);
}

/// A gripper without and with a part, as two tools of one TCP; and the cell's tool with a part.
TEST(FixModule, TellsToolsOfOneTcpApartByTheLoadInForce) {
  const Frames grips{calib::to_isometry({{10.0, -20.0, 150.0}, {0.0, 30.0, 5.0}}), kFrames.base};
  const auto load = [](double kg) {
    return "{M " + std::to_string(kg) +
           ",CM {X 0.0,Y 5.0,Z 80.0,A 0.0,B 0.0,C 0.0},J {X 0.0,Y 0.0,Z 0.0}}\n";
  };
  const std::string gripper = "={X 10.0,Y -20.0,Z 150.0,A 0.0,B 30.0,C 5.0}\n";
  const krl::FixModule module =
      module_of(demo_calibration(),
                "DEFDAT $CONFIG PUBLIC\nTOOL_DATA[3]" + gripper + "LOAD_DATA[3]=" + load(0.5) +
                    "TOOL_DATA[4]" + gripper + "LOAD_DATA[4]=" + load(9.0) +
                    "TOOL_DATA[5]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"
                    "LOAD_DATA[5]=" +
                    load(9.0) + "ENDDAT\n");
  const auto q = regular_postures(demo(), 1);
  const auto reached = [&](const std::string& body, const Frames& in) {
    Rig rig(demo(), module, body,
            "DECL LOAD XEMPTY=" + load(0.5) + "DECL LOAD XFULL=" + load(9.0) + "DECL LOAD XOTHER=" +
                load(4.0) + "DECL GLOBAL E6POS XP=" + point_text(demo(), q[0], in));
    rig.controller.set_frame("$TOOL", calib::to_frame(in.tool));
    rig.run();
    EXPECT_EQ(rig.controller.state(), State::kEnded) << body << " " << why(rig.controller);
    return rig.controller.reached;
  };
  const auto bearing = [&](double kg) {
    calib::Tool tool = cell().tool;
    tool.tcp = grips.tool;
    tool.length_m = tool.tcp.translation().norm();
    tool.mass_kg = kg;
    tool.com_m = {0.0, 0.005, 0.08};
    return calib::with_tool(demo_calibration(), tool);
  };
  for (const auto& [empty, full] :
       {std::pair("$LOAD=XEMPTY\nPTP CC_FIX_PTP(XP)\n", "$LOAD=XFULL\nPTP CC_FIX_PTP(XP)\n"),
        std::pair("PTP CC_FIX_PTP_IN(XP,$TOOL,$BASE,#BASE,XEMPTY)\n",
                  "PTP CC_FIX_PTP_IN(XP,$TOOL,$BASE,#BASE,XFULL)\n")}) {
    const auto at = reached(empty + std::string(full), grips);
    ASSERT_EQ(at.size(), 2U);
    EXPECT_LT(missed(bearing(0.5), at, q).mm, kPreciseMm);
    EXPECT_LT(missed(bearing(9.0), at, q, 1).mm, kPreciseMm);
    EXPECT_GT(missed(bearing(9.0), at, q).mm, 0.1);
  }
  const auto own =
      reached("$LOAD=XFULL\nPTP CC_FIX_PTP(XP)\n$LOAD=XOTHER\nPTP CC_FIX_PTP(XP)\n", kFrames);
  ASSERT_EQ(own.size(), 2U);
  const calib::FlangeLoad nine{9.0, {0.0, 0.005, 0.08}};
  EXPECT_LT(missed(calib::with_load(demo_calibration(), nine), own, q).mm, kPreciseMm);
  EXPECT_LT(missed(demo_calibration(), own, q, 1).mm, kPreciseMm) << "its own";
  Rig other(demo(), module, "PTP CC_STAY(XHOME)\n$LOAD=XOTHER\nPTP CC_FIX_PTP(XP)",
            "DECL LOAD XOTHER=" + load(4.0) + "DECL E6POS XP=" + point_text(demo(), q[0], grips));
  other.controller.set_frame("$TOOL", calib::to_frame(grips.tool));
  expect_halt(other, "no correction for the active tool and load");
}

TEST(FixModule, OffByOneVariableItGivesTheSamePoints) {
  const auto taught = regular_postures(demo(), 10);
  const Points plain = ptp_to(demo(), taught, "");
  std::string body = plain.body;
  body.replace(body.find("CC_STAY"), 7, "");
  Rig without(demo(), demo_module(), body, plain.data);
  const Points p = ptp_to(demo(), taught);
  Rig off(demo(), demo_module(), "CC_FIX_ON=FALSE\n" + p.body, p.data);
  const auto a = without.run().reached, b = off.run().reached;
  ASSERT_EQ(a.size(), taught.size() + 1);
  EXPECT_EQ(a, b);
}

TEST(FixModule, HoldsTheArmWhereItIsNotThatOfTheCalibration) {
  const Points p = ptp_to(demo(), regular_postures(demo(), 1));
  const auto rig = [&](const krl::FixModule& module) {
    return std::make_unique<Rig>(demo(), module, p.body, p.data);
  };
  auto other = rig(demo_module());
  other->controller.variable("$KR_SERIALNO").set(815);
  expect_halt(*other, "another serial number");

  auto tool = rig(demo_module());
  auto moved = calib::to_frame(kFrames.tool);
  moved.xyz_mm[2] += 0.2;
  tool->controller.set_frame("$TOOL", moved);
  expect_halt(*tool, "no correction for the active tool");

  krl::FixModule mixed = demo_module();
  krl::Data none;
  mixed.dat = fix_module(demo_calibration(), none, {kSerial, "fedcba9876543210"}).dat;
  expect_halt(*rig(mixed), "two calibrations");

  auto root = rig(demo_module());
  root->controller.set_frame("$ROBROOT", {{0.0, 0.0, 5.0}, {0.0, 0.0, 0.0}});
  EXPECT_EQ(root->run().state(), State::kEnded);  // with its former base: another place

  auto tcp = rig(demo_module());
  tcp->controller.variable("$IPO_MODE").set_whole(2);
  expect_halt(*tcp, "IPO_MODE #TCP");
}

TEST(FixModule, HoldsTheArmWhoseControllerHasAnotherGeometry) {
  calib::Robot longer = demo();
  longer.joints[3].d_m += 0.5e-3;
  const Points p = ptp_to(demo(), regular_postures(demo(), 1));
  Rig rig(longer, demo_module(), p.body, p.data);
  expect_halt(rig, "controller computes another place");
}

TEST(FixModule, HoldsTheArmBeforeALargerCorrectionThanAnyOfTheCalibration) {
  krl::FixModule module = demo_module();
  const auto at = module.dat.text.find("CCF_D[1]=");
  module.dat.text.insert(at + 9, "5.0 ;");
  const Points p = ptp_to(demo(), regular_postures(demo(), 1));
  Rig rig(demo(), module, p.body, p.data);
  expect_halt(rig, "correction larger than any");
}

TEST(FixModule, HoldsTheArmWherePostureOrReachAreInDoubt) {
  const auto taught = regular_postures(demo(), 1);
  const std::string point = "DECL E6POS XP=" + point_text(demo(), taught[0]) + "\n";
  Rig first(demo(), demo_module(), "PTP XHOME\nLIN CC_FIX(XP)", point);
  expect_halt(first, "posture unknown");

  calib::JointVector flipped = taught[0];
  flipped[3] += flipped[3] > 0.0 ? -std::numbers::pi : std::numbers::pi;
  flipped[4] = -flipped[4];
  Rig posture(demo(), demo_module(), "PTP CC_FIX_PTP(XQ)\nLIN CC_FIX(XP)",
              point + "DECL E6POS XQ=" + point_text(demo(), flipped) + "\n");
  expect_halt(posture, "posture changes");

  Rig far(demo(), demo_module(), "PTP CC_STAY(XHOME)\nPTP CC_FIX_PTP(XP)",
          "DECL E6POS XP={X 9000.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0,S 2,T 0}\n");
  expect_halt(far, "point not reached");

  Rig turned(demo(), demo_module(),
             "PTP CC_STAY(XHOME)\nLIN_REL CC_BY({X 0.0,Y 0.0,Z 0.0,A 5.0,B 0.0,C 0.0})");
  expect_halt(turned, "relative motion turns");
}

TEST(FixModule, GoesOnUncorrectedOnlyWhenItIsTurnedOff) {
  const Points p = ptp_to(demo(), regular_postures(demo(), 1));
  Rig rig(demo(), demo_module(), p.body, p.data);
  rig.controller.variable("$KR_SERIALNO").set(815);
  ASSERT_EQ(rig.run().state(), State::kHalted);
  EXPECT_EQ(rig.controller.variable("CC_FIX_WHY").i, 2);
  rig.controller.variable("CC_FIX_ON").set_whole(0);
  rig.controller.press_start();
  EXPECT_EQ(rig.controller.state(), State::kEnded);
}

TEST(FixModule, OnAPathTurnDoesNotCountAndHigherBitsOfAPtpStay) {
  const auto taught = regular_postures(demo(), 1);
  std::string right = point_text(demo(), taught[0]), wrong = right, higher = right;
  const auto turn = static_cast<std::size_t>(right.find(",T ")) + 3;
  const int t = std::stoi(right.substr(turn));
  wrong.replace(turn, std::string::npos, std::to_string(t ^ 2) + "}");  // A2 cannot
  const auto status = right.find(",S ") + 3;
  higher.replace(
      status, std::string::npos,
      std::to_string(std::stoi(right.substr(status)) | 16) + ",T " + std::to_string(t | 64) + "}");
  Rig rig(
      demo(), demo_module(), "PTP CC_FIX_PTP(XP)\nLIN CC_FIX(XQ)\nXR=CC_FIX_PTP(XR)",
      "DECL E6POS XP=" + right + "\nDECL E6POS XQ=" + wrong + "\nDECL GLOBAL E6POS XR=" + higher);
  KrlController& controller = rig.run();
  ASSERT_EQ(controller.state(), State::kEnded) << why(controller);
  EXPECT_LT(missed(demo_calibration(), controller.reached, {taught[0], taught[0]}).mm, kPreciseMm);
  EXPECT_EQ(controller.variable("XR").part("S").i, std::stoi(right.substr(status)) | 16);
  EXPECT_EQ(controller.variable("XR").part("T").i, t | 64);
}

TEST(FixModule, KeepsThePostureAndTurnsAnAxisNearZeroOnlyAsFarAsTheCorrection) {
  auto taught = regular_postures(demo(), 10);
  for (auto& q : taught) q[3] = q[5] = 0.0;
  const Points p = ptp_to(demo(), taught);
  Rig rig(demo(), demo_module(), p.body, p.data);
  KrlController& controller = rig.run();
  ASSERT_EQ(controller.state(), State::kEnded) << why(controller);
  for (std::size_t i = 0; i < taught.size(); ++i) {
    for (std::size_t k = 0; k < 6; ++k)
      EXPECT_NEAR(controller.reached[i + 1][k], taught[i][k], 0.1) << i << " A" << k + 1;
    EXPECT_EQ(controller.targets[i + 1],
              "E6POS " + std::to_string(status_and_turn(demo(), taught[i]).status));
  }
}

TEST(FixModule, IsNotMadeForAnArmThatTheControllersInverseDoesNotFit) {
  EXPECT_THROW(module_of(calibration_of(cell_with("iiwa14.toml"))), calib::FileError);
  calib::Calibration infinite = demo_calibration();
  infinite.parameters[0].correction = std::numeric_limits<double>::infinity();
  EXPECT_THROW(module_of(infinite), calib::FileError);
}

TEST(FixModule, HasNamesThatAControllerTakesAndNumbersThatItReads) {
  for (const auto* file : {&demo_module().src, &demo_module().dat})
    for (const auto& line : read_lines(*file))
      for (const auto& token : line.tokens) {
        if (token.kind == calib::krl::Token::Kind::kWord) {
          EXPECT_LE(token.word.size(), 24U);
        } else if (token.kind == calib::krl::Token::Kind::kNumber) {
          EXPECT_TRUE(std::isfinite(token.value));
        }
      }
}

TEST(FixModule, IsRefusedWhereItIsCutShort) {
  for (const double share : {0.2, 0.5, 0.9}) {
    krl::FixModule cut = demo_module();
    cut.dat.text.resize(static_cast<std::size_t>(share * static_cast<double>(cut.dat.text.size())));
    EXPECT_THROW(Rig(demo(), cut, "PTP XHOME"), calib::FileError);
    cut = demo_module();
    cut.src.text.resize(static_cast<std::size_t>(share * static_cast<double>(cut.src.text.size())));
    EXPECT_THROW(Rig(demo(), cut, "PTP XHOME"), calib::FileError);
  }
}

}  // namespace
}  // namespace cellcal::daemon::testing
