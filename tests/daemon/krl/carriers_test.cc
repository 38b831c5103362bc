// Programs of an arm on a linear unit, and of parts on a positioner. The controller's chain in the world, and the part
// as carried by the calibrated axes, are computed here from frames only.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <regex>

#include "calib/estimate/predict.h"
#include "calib/model/error.h"
#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

using calib::JointVector;
using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using krl::correct_program;
using krl::CorrectedProgram;
using krl::Why;

Isometry3d frame(double x, double y, double z, double a, double b, double c) {
  return calib::to_isometry({{x, y, z}, {a, b, c}});
}
Isometry3d about_z(double rad) { return Isometry3d(AngleAxisd(rad, Vector3d::UnitZ())); }
Isometry3d along_z(double m) { return Isometry3d(Eigen::Translation3d(0.0, 0.0, m)); }

std::string text_of(const Isometry3d& place) {
  const calib::FrameMmDeg f = calib::to_frame(place);
  return fmt::format("{{X {:.6f},Y {:.6f},Z {:.6f},A {:.8f},B {:.8f},C {:.8f}}}", f.xyz_mm[0],
                     f.xyz_mm[1], f.xyz_mm[2], f.abc_deg[0], f.abc_deg[1], f.abc_deg[2]);
}

std::string refusals_of(const CorrectedProgram& result) {
  std::string all;
  for (const krl::Refusal& one : result.refusals) all += std::string(name_of(one.why)) + " ";
  return all;
}

/// Every point of a .dat at these positions, "E1 250.0,E2 0.0".
std::string at_external(const std::string& dat, const std::string& values) {
  std::string text = std::regex_replace(dat, std::regex("E1 0\\.0,E2 0\\.0,E3 0\\.0"), values);
  return text;
}

// A linear unit: the world, its kinematic and the robot on it.

const Isometry3d kErsysRoot = frame(-500.0, 200.0, 30.0, 20.0, 0.0, 0.0),
                 kTravel = frame(10.0, 0.0, 5.0, 0.0, 90.0, 0.0),  // z along x of the root
    kCarriage = frame(0.0, 40.0, 300.0, 0.0, -90.0, 0.0),
                 kRobroot = frame(15.0, -8.0, 400.0, 90.0, 0.0, 0.0);

Isometry3d foot_at(double e1_m) {
  return kErsysRoot * kTravel * along_z(e1_m) * kCarriage * kRobroot;
}

calib::Cell cell_on_unit() {
  calib::Cell on = cell();
  calib::Joint unit;
  unit.name = "E1";
  unit.min_rad = -0.2;
  unit.max_rad = 3.0;
  calib::LinearGuide& guide = unit.guide.emplace();
  // From the foot at 0 to the foot at a metre, rounded as by import-robot.
  guide.along = (foot_at(0.0).inverse() * foot_at(1.0)).translation();
  for (double& component : guide.along) component = std::round(component * 1e9) / 1e9;
  guide.scale_sigma = 5e-4;
  guide.direction_sigma_rad = 3e-3;
  guide.straightness_sigma_m = 3e-4;
  guide.turn_sigma_rad_m = 5e-4;
  guide.turn_sigma_rad = 3e-4;
  on.robot.joints.insert(on.robot.joints.begin(), unit);
  return on;
}

const calib::Calibration& unit_calibration() {
  static const calib::Calibration one = [] {
    calib::Random random(3);
    return calib::testing::random_calibration(cell_on_unit(), random);
  }();
  return one;
}

std::string unit_machine() {
  return "INT $EX_AX_NUM=1\nDECL EX_KIN $EX_KIN={ET1 #ERSYS,ET2 #NONE}\n"
         "DECL ET_AX $ET1_AX={TR_A1 #E1,TR_A2 #NONE,TR_A3 #NONE}\n$AXIS_DIR[7]=1\n"
         "FRAME $ERSYSROOT=" +
         text_of(kErsysRoot) + "\nFRAME $ET1_TA1KR=" + text_of(kTravel) +
         "\nFRAME $ET1_TFLA3=" + text_of(kCarriage) + "\nFRAME $ROBROOT=" + text_of(kRobroot) +
         "\n";
}

const Isometry3d& base_in_world() {
  static const Isometry3d base = frame(900.0, 250.0, 500.0, 30.0, 2.0, -1.0);
  return base;
}

struct Taught {
  std::vector<JointVector> points = postures(25);
  Frames seen = frames();  ///< base relative to the robot at its position
  krl::ProgramFiles files;
};

/// Taught with the carriage at this position, the base fixed in the world.
Taught taught_on_unit(double e1_m, const std::string& machine = unit_machine()) {
  Taught one;
  one.seen.base = foot_at(e1_m).inverse() * base_in_world();
  KrlProgram program = taught(cell().robot, one.seen, one.points);
  program.dat = at_external(program.dat, fmt::format("E1 {:.3f},E2 0.0,E3 0.0", e1_m * 1e3));
  program.config = std::regex_replace(program.config, std::regex("BASE_DATA\\[3\\]=[^\r\n]*"),
                                      "BASE_DATA[3]=" + text_of(base_in_world()));
  one.files = files(program);
  one.files.controller.push_back({"$machine.dat", machine});
  return one;
}

TEST(AProgramOnALinearUnit, SendsTheRealTcpWhereItWasProgrammedAndLeavesE1) {
  for (const double e1 : {0.0, 1.2345, 2.9}) {
    const Taught program = taught_on_unit(e1);
    const CorrectedProgram result = correct_program(unit_calibration(), program.files);
    ASSERT_TRUE(result.refusals.empty()) << refusals_of(result);
    ASSERT_EQ(result.points.size(), program.points.size());
    const std::string& dat = result.files[1].text;
    EXPECT_EQ(std::count(dat.begin(), dat.end(), '\n'),
              std::count(program.files.dat->text.begin(), program.files.dat->text.end(), '\n'));
    EXPECT_NE(dat.find(fmt::format(",E1 {:.3f},E2 0.0", e1 * 1e3)), std::string::npos);
    const auto commanded = run(cell().robot, program.seen, dat);
    ASSERT_EQ(commanded.size(), program.points.size());
    const calib::ArmModel nominal(cell());
    const calib::Predictor real(unit_calibration());
    double before = 0.0;
    for (std::size_t i = 0; i < commanded.size(); ++i) {
      ASSERT_EQ(commanded[i].size(), 6U) << "P" << i + 1;
      const Isometry3d wanted =
          foot_at(0.0).inverse() * foot_at(e1) * nominal.nominal_tcp(program.points[i]);
      const auto there = [&](JointVector q) {
        q.insert(q.begin(), e1);
        return real.calibrated(q).tcp;
      };
      EXPECT_LT((there(commanded[i]).translation() - wanted.translation()).norm(), 3e-6);
      EXPECT_LT((there(commanded[i]).linear() - wanted.linear()).norm(), 3e-6);
      before += (there(program.points[i]).translation() - wanted.translation()).norm();
    }
    EXPECT_GT(before / static_cast<double>(commanded.size()), 1e-3);
  }
}

TEST(AProgramOnALinearUnit, GivesThePosturesOfItsPointsForAPlan) {
  const Taught program = taught_on_unit(1.2345);
  const auto found = krl::program_postures(cell_on_unit(), program.files);
  EXPECT_TRUE(found.refusals.empty());
  std::size_t met = 0;
  for (const JointVector& q : found.postures) {
    if (q.size() != 7) continue;
    EXPECT_NEAR(q[0], q[0] == 0.0 ? 0.0 : 1.2345, 1e-12);  // home, or a point
    met += std::ranges::any_of(program.points, [&](const JointVector& taught_at) {
      return std::equal(taught_at.begin(), taught_at.end(), q.begin() + 1,
                        [](double a, double b) {  // a path takes the nearest turn
                          return std::abs(std::remainder(a - b, calib::kRadPerTurn)) < 1e-5;
                        });
    });
  }
  EXPECT_EQ(met, program.points.size());
}

/// Result of a PTP to these axis angles.
CorrectedProgram axes_with(const std::string& value, const std::string& machine = unit_machine()) {
  return correct_program(
      unit_calibration(),
      {{"p.src", "DEF P()\nBAS(#TOOL,1)\nBAS(#BASE,0)\nPTP XA\nEND\n"},
       krl::KrlFile{"p.dat", "DEFDAT P\nDECL E6AXIS XA={" + value + "}\nENDDAT\n"},
       {{"$config.dat", "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"},
        {"$machine.dat", machine}}});
}

TEST(AxisAnglesOnALinearUnit, ChangeWhereTheCarriageStands) {
  constexpr const char* kArm = "A1 10.0,A2 -80.0,A3 95.0,A4 5.0,A5 45.0,A6 -10.0";
  const CorrectedProgram result = axes_with(std::string(kArm) + ",E1 2500.0");
  ASSERT_TRUE(result.refusals.empty()) << refusals_of(result);
  double a[6];
  ASSERT_EQ(
      std::sscanf(result.files[1].text.c_str(),
                  "DEFDAT P\nDECL E6AXIS XA={A1 %lf,A2 %lf,A3 %lf,A4 %lf,A5 %lf,A6 %lf,E1 2500.0}",
                  &a[0], &a[1], &a[2], &a[3], &a[4], &a[5]),
      6)
      << result.files[1].text;
  JointVector q = {2.5}, taught_at;
  for (const double one : a) q.push_back(one * calib::kRadPerDeg);
  for (const double one : {10.0, -80.0, 95.0, 5.0, 45.0, -10.0})
    taught_at.push_back(one * calib::kRadPerDeg);
  const Isometry3d wanted =
      foot_at(0.0).inverse() * foot_at(2.5) * calib::ArmModel(cell()).nominal_tcp(taught_at);
  EXPECT_LT(
      (calib::Predictor(unit_calibration()).calibrated(q).tcp.translation() - wanted.translation())
          .norm(),
      3e-6);
  EXPECT_EQ(refusals_of(axes_with(kArm)), "no_external_value ");
  EXPECT_EQ(refusals_of(axes_with(std::string(kArm) + ",E1 3100.0")), "not_reached ");
  EXPECT_EQ(refusals_of(axes_with(std::string(kArm) + ",E1 1E9")), "not_a_number ");
  EXPECT_EQ(refusals_of(axes_with(std::string(kArm) + ",E1 10.0,E2 5.0")), "") << "$EX_AX_NUM is 1";
  EXPECT_EQ(refusals_of(axes_with(std::string(kArm) + ",E1 10.0,E2 5.0", "")), "external_axes ");
}

TEST(ALinearUnitOfOtherMachineData, IsRefusedByName) {
  const auto refused = [](const std::string& what, const std::string& by) {
    const std::string machine = unit_machine();
    EXPECT_NE(machine.find(what), std::string::npos) << what;
    std::string other = machine;
    other.replace(other.find(what), what.size(), by);
    const auto result = correct_program(unit_calibration(), taught_on_unit(1.0, other).files);
    return result.refusals.empty() ? std::string() : std::string(name_of(result.refusals[0].why));
  };
  EXPECT_EQ(refused("INT $EX_AX_NUM", "INT $EX_AX_NUM"), "");
  EXPECT_EQ(refused("ET1 #ERSYS", "ET1 #EASYS"), "other_unit");
  EXPECT_EQ(refused("TR_A1 #E1", "TR_A1 #E2"), "other_unit");
  EXPECT_EQ(refused("TR_A2 #NONE", "TR_A2 #E2"), "other_unit");
  EXPECT_EQ(refused("$AXIS_DIR[7]=1", "$AXIS_DIR[7]=-1"), "other_unit");
  EXPECT_EQ(refused("FRAME $ET1_TFLA3={", "FRAME $ET1_TFLA3={Q 1,"), "")
      << "further members do no harm";
  EXPECT_EQ(refused("FRAME $ET1_TFLA3={X", "FRAME $ET1_TFLA3={Q"), "other_unit");
  EXPECT_EQ(refused("FRAME $ET1_TA1KR={X", "FRAME $ET1_TA1KR={Q"), "other_unit");
  EXPECT_EQ(refused(text_of(kCarriage), text_of(kCarriage * about_z(1e-4))), "other_unit");
  const auto alone = correct_program(calibration(), taught_on_unit(1.0).files);
  ASSERT_FALSE(alone.refusals.empty());
  EXPECT_EQ(alone.refusals[0].why, Why::kExternalAxes) << "a calibration of six axes, as before";
}

// A positioner that tilts and turns, and an arm whose foot is not the world's origin.

const Isometry3d kFoot = frame(100.0, -50.0, 600.0, 15.0, 0.0, 0.0),
                 kTilt = frame(1100.0, 100.0, 400.0, 0.0, 0.0, -90.0),
                 kTurn = frame(0.0, -100.0, 20.0, 0.0, 0.0, 90.0),
                 kTable = frame(30.0, -20.0, 90.0, 40.0, 0.0, 0.0),
                 kOffset = frame(120.0, 60.0, 45.0, -25.0, 1.0, 2.0);  // BASE_DATA[3]

calib::Cell cell_with_positioner() {
  calib::Cell with = cell();
  with.robot.positioner.resize(2);
  calib::PositionerAxis &tilt = with.robot.positioner[0], &turn = with.robot.positioner[1];
  tilt.name = "E1";
  tilt.frame = kTilt;
  tilt.min_rad = -1.6;
  tilt.max_rad = 1.6;
  turn.name = "E2";
  turn.frame = kTurn;
  turn.min_rad = -6.0;
  turn.max_rad = 6.0;
  for (calib::PositionerAxis* axis : {&tilt, &turn}) {
    axis->place_sigma_m = axis->direction_sigma_rad = 2e-3;
    axis->scale_sigma = 1e-4;
  }
  calib::Target sphere;
  sphere.id = "TABLE";
  sphere.diameter_m = 0.05;
  sphere.has_centre = true;
  sphere.centre_m = Vector3d(0.1, 0.0, 0.1);
  sphere.carried_by = 2;
  with.targets.push_back(sphere);
  return with;
}

const calib::Calibration& positioner_calibration() {
  static const calib::Calibration one = [] {
    calib::Random random(4);
    calib::Calibration c = calib::testing::random_calibration(cell_with_positioner(), random);
    std::erase_if(c.targets,
                  [](const calib::TargetResult& target) { return target.id == "TABLE"; });
    c.targets.push_back({"TABLE", Vector3d(0.1, 0.0, 0.1)});
    return c;
  }();
  return one;
}

/// An axis by (1c), its errors by name.
Isometry3d axis_found(std::size_t j, const Isometry3d& drawn) {
  const auto error = [&](calib::AxisError one) {
    return calib::correction_of(positioner_calibration(), calib::positioner_parameter(j, one));
  };
  return drawn *
         Eigen::Translation3d(error(calib::AxisError::kX), error(calib::AxisError::kY), 0.0) *
         AngleAxisd(error(calib::AxisError::kTurnX), Vector3d::UnitX()) *
         AngleAxisd(error(calib::AxisError::kTurnY), Vector3d::UnitY());
}
double scaled(std::size_t j, double rad) {
  return rad *
         (1.0 + calib::correction_of(positioner_calibration(),
                                     calib::positioner_parameter(j, calib::AxisError::kScale)));
}

/// The table's flange in the robot's base: as drawn, and as calibrated.
Isometry3d table_drawn(double e1, double e2) {
  return kTilt * about_z(e1) * kTurn * about_z(e2) * kTable;
}
Isometry3d table_found(double e1, double e2) {
  return axis_found(0, kTilt) * about_z(scaled(0, e1)) * axis_found(1, kTurn) *
         about_z(scaled(1, e2)) * kTable;
}

const Isometry3d& root() {
  static const Isometry3d place = frame(-200.0, 700.0, 10.0, 60.0, 3.0, 0.0);  // in the world
  return place;
}

std::string positioner_machine(const Isometry3d& tilt = kTilt, const Isometry3d& turn = kTurn) {
  return "INT $EX_AX_NUM=2\nDECL EX_KIN $EX_KIN={ET1 #EASYS,ET2 #NONE}\n"
         "DECL ET_AX $ET1_AX={TR_A1 #E1,TR_A2 #E2,TR_A3 #NONE}\nFRAME $ROBROOT=" +
         text_of(kFoot) + "\nFRAME $ET1_TA1KR=" + text_of(root().inverse() * kFoot * tilt) +
         "\nFRAME $ET1_TA2A1=" + text_of(turn) + "\nFRAME $ET1_TFLA3=" + text_of(kTable) + "\n";
}
std::string positioner_config() {
  return "MACHINE_DEF[2]={NAME[] \"DKP_400\",COOP_KRC_INDEX 1,PARENT[] \"WORLD\",ROOT " +
         text_of(root()) + ",MECH_TYPE #EASYS,GEOMETRY[] \" \"}\n" +
         "MACHINE_FRAME_DAT[3]={MACH_DEF_INDEX 2,PARENT[] \"DKP_400\",GEOMETRY[] \" \"}\n";
}

constexpr double kE1Deg = 35.0, kE2Deg = -70.0;
constexpr double kE1 = kE1Deg * calib::kRadPerDeg, kE2 = kE2Deg * calib::kRadPerDeg;

/// Points on the table, taught with the drawn axes.
Taught taught_on_table(const std::string& machine, const std::string& config,
                       const std::string& values = "E1 35.0,E2 -70.0,E3 0.0") {
  Taught one;
  one.seen.base = table_drawn(kE1, kE2) * kOffset;
  KrlProgram program = taught(cell().robot, one.seen, one.points);
  program.dat = at_external(program.dat, values);
  program.config = std::regex_replace(program.config, std::regex("BASE_DATA\\[3\\]=[^\r\n]*"),
                                      "BASE_DATA[3]=" + text_of(kOffset)) +
                   config;
  one.files = files(program);
  one.files.controller.push_back({"$machine.dat", machine});
  return one;
}

void expect_on_the_part(const Taught& program, const CorrectedProgram& result,
                        const Isometry3d& base_of_controller, const Isometry3d& part) {
  ASSERT_TRUE(result.refusals.empty()) << refusals_of(result);
  ASSERT_EQ(result.points.size(), program.points.size());
  EXPECT_NE(result.files[1].text.find(",E1 35.0,E2 -70.0"), std::string::npos);
  Frames seen = program.seen;
  seen.base = base_of_controller;
  const auto commanded = run(cell().robot, seen, result.files[1].text);
  ASSERT_EQ(commanded.size(), program.points.size());
  const calib::ArmModel nominal(cell());
  const calib::Predictor real(positioner_calibration());
  for (std::size_t i = 0; i < commanded.size(); ++i) {
    ASSERT_EQ(commanded[i].size(), 6U) << "P" << i + 1;
    const Isometry3d on_part = program.seen.base.inverse() * nominal.nominal_tcp(program.points[i]);
    const Isometry3d wanted = part * on_part, there = real.calibrated(commanded[i]).tcp;
    EXPECT_LT((there.translation() - wanted.translation()).norm(), 3e-6) << "P" << i + 1;
    EXPECT_LT((there.linear() - wanted.linear()).norm(), 3e-6) << "P" << i + 1;
  }
}

TEST(AProgramOnAPositioner, MeetsThePartWhereTheCalibratedAxesHaveIt) {
  const Taught program = taught_on_table(positioner_machine(), positioner_config());
  const CorrectedProgram result = correct_program(positioner_calibration(), program.files);
  const Isometry3d part = table_found(kE1, kE2) * kOffset;
  EXPECT_GT((part.translation() - program.seen.base.translation()).norm(), 5e-4);
  expect_on_the_part(program, result, table_drawn(kE1, kE2) * kOffset, part);
  for (const krl::CorrectedPoint& one : result.points) {
    EXPECT_EQ(one.base, 3);
    EXPECT_GT(one.u95_mm, 0.0);
  }
}

TEST(AProgramOnAPositioner, GivesThePosturesOfItsPointsForAPlan) {
  const Taught program = taught_on_table(positioner_machine(), positioner_config());
  const auto found = krl::program_postures(cell_with_positioner(), program.files);
  EXPECT_TRUE(found.refusals.empty());
  EXPECT_EQ(found.postures.size(), program.points.size() + 1);  // and home
}

TEST(AProgramOnAPositioner, IsUnderstoodByEkToo) {
  Taught program = taught_on_table(positioner_machine(), positioner_config());
  const std::string by_ek =
      "$BASE=EK(MACHINE_DEF[2].ROOT,MACHINE_DEF[2].MECH_TYPE,BASE_DATA[3])\r\n";
  std::string& src = program.files.src.text;
  const std::string plain = src;
  src = std::regex_replace(src, std::regex("(\r\n)((PTP|LIN) XP)"), "$1$" + by_ek + "$2");
  ASSERT_NE(src, plain);
  const CorrectedProgram result = correct_program(positioner_calibration(), program.files);
  expect_on_the_part(program, result, table_drawn(kE1, kE2) * kOffset,
                     table_found(kE1, kE2) * kOffset);
}

TEST(AProgramOnAPositioner, OfAControllerThatHasTheAxesAsFoundIsCorrectedForTheArm) {
  const Taught program = taught_on_table(
      positioner_machine(axis_found(0, kTilt), axis_found(1, kTurn)), positioner_config());
  const CorrectedProgram result = correct_program(positioner_calibration(), program.files);
  const Isometry3d there =
      axis_found(0, kTilt) * about_z(kE1) * axis_found(1, kTurn) * about_z(kE2) * kTable * kOffset;
  // The text was taught in the drawn base; the controller has another one, and the scales place the part.
  expect_on_the_part(program, result, there, table_found(kE1, kE2) * kOffset);
}

TEST(AProgramOnAPositioner, OfOtherDataIsRefusedByName) {
  const auto first = [](const calib::Calibration& c, const Taught& program,
                        const krl::CorrectionOptions& options = {}) {
    const auto result = correct_program(c, program.files, options);
    return result.refusals.empty() ? std::string() : std::string(name_of(result.refusals[0].why));
  };
  const calib::Calibration& c = positioner_calibration();
  const std::string machine = positioner_machine(), config = positioner_config();
  EXPECT_EQ(first(calibration(), taught_on_table(machine, config)), "external_base");
  EXPECT_EQ(first(c, taught_on_table("", config)), "other_kinematic");
  EXPECT_EQ(first(c, taught_on_table(machine, "MACHINE_FRAME_DAT[3]={MACH_DEF_INDEX 2}\n")),
            "external_base");
  EXPECT_EQ(
      first(c, taught_on_table(positioner_machine(kTilt * frame(0.2, 0, 0, 0, 0, 0)), config)),
      "other_kinematic");
  EXPECT_EQ(first(c, taught_on_table(positioner_machine(kTilt, kTurn * frame(0, 0, 0, 0, 0.02, 0)),
                                     config)),
            "other_kinematic");
  EXPECT_EQ(first(c, taught_on_table(machine, config, "E3 0.0")), "no_external_value");
  calib::Calibration untouched = c;
  std::erase_if(untouched.targets,
                [](const calib::TargetResult& target) { return target.id == "TABLE"; });
  EXPECT_EQ(first(untouched, taught_on_table(machine, config)), "external_base");
  calib::Calibration touched = c;
  touched.positioner.resize(2);
  touched.positioner[1].touched_rad = {0.0, 1.0};
  EXPECT_EQ(first(touched, taught_on_table(machine, config)), "outside_touched");
  EXPECT_EQ(first(touched, taught_on_table(machine, config), {.anywhere = true}), "");
  // $BASE=BASE_DATA[3] alone does not turn with the axes, so that the intended base is unknown.
  Taught set = taught_on_table(machine, config);
  set.files.src.text = std::regex_replace(set.files.src.text, std::regex("(\r\n)((PTP|LIN) XP)"),
                                          "$1$$BASE=BASE_DATA[3]\r\n$2");
  EXPECT_EQ(first(c, set), "uncoupled_base");
  EXPECT_NE(all_words(correct_program(c, set.files)).find("Set it by BAS(#BASE,3), SBASE or EK"),
            std::string::npos);
  // A program that changes the root itself.
  Taught moved = taught_on_table(machine, config);
  moved.files.src.text = std::regex_replace(
      moved.files.src.text, std::regex("(\r\n)((PTP|LIN) XP)"),
      "$1MACHINE_DEF[2].ROOT=$$NULLFRAME\r\n$2", std::regex_constants::format_first_only);
  ASSERT_NE(moved.files.src.text.find("ROOT=$NULLFRAME"), std::string::npos);
  EXPECT_EQ(first(c, moved), "frame_changed");
}

TEST(AProgramBesideAPositioner, IsCorrectedAsWithoutOneAtAnyOfItsAngles) {
  calib::Calibration alone = positioner_calibration();
  alone.cell.robot.positioner.clear();
  std::erase_if(alone.parameters, [](const calib::ParameterResult& p) {
    return p.key.kind == calib::ParameterKind::kPositioner;
  });
  alone.covariance.resize(0, 0);
  alone.cell.targets.pop_back();
  alone.targets.pop_back();
  const KrlProgram program = taught(cell().robot, frames(), postures(10));
  KrlProgram turned = program;
  turned.dat = at_external(program.dat, "E1 50.0,E2 -70.0,E3 0.0");
  const auto one = correct_program(alone, files(program)),
             other = correct_program(positioner_calibration(), files(turned));
  ASSERT_TRUE(other.refusals.empty()) << refusals_of(other);
  EXPECT_EQ(at_external(one.files[1].text, "E1 50.0,E2 -70.0,E3 0.0"), other.files[1].text);
}

TEST(ExternalKinematics, OfCutDataEndInARefusalOrACorrection) {
  const std::string machine = positioner_machine(), config = positioner_config();
  Taught program = taught_on_table(machine, config);
  program.points.resize(1);
  const auto ends = [&](const std::string& some_machine, const std::string& some_config) {
    krl::ProgramFiles given = program.files;
    given.src.text = "DEF P()\nBAS(#TOOL,1)\nBAS(#BASE,3)\nPTP XP1\nEND\n";
    given.controller = {{"$config.dat",
                         "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"
                         "BASE_DATA[3]=" +
                             text_of(kOffset) + "\n" + some_config},
                        {"$machine.dat", some_machine}};
    try {
      const auto result = correct_program(positioner_calibration(), given);
      return result.refusals.empty() != result.files.empty();
    } catch (const calib::FileError& error) {
      return std::string(error.what()).find("$ROBROOT") != std::string::npos;
    }
  };
  EXPECT_TRUE(ends(machine, config));
  for (std::size_t cut = 0; cut < machine.size(); cut += 31)
    EXPECT_TRUE(ends(machine.substr(0, cut) + "\n", config)) << cut;
  for (std::size_t cut = 0; cut < config.size(); cut += 31)
    EXPECT_TRUE(ends(machine, config.substr(0, cut) + "\n")) << cut;
  for (const char* hostile : {"1E30", "1E400", "-", "", "{X 1}", "#E1"})
    EXPECT_TRUE(
        ends(machine + "FRAME $ET1_TA1KR={X " + hostile + ",Y 0,Z 0,A 0,B 0,C 0}\n", config))
        << hostile;
}

}  // namespace
}  // namespace cellcal::daemon::testing
