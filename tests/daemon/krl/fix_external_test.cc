// CELLCAL_FIX for an arm on a linear unit and parts on a positioner, executed with 32-bit REAL: compared with tip and
// part by the calibrated chain, with the controller's chain from frames only, and with the offline correction.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <regex>
#include <span>

#include "calib/estimate/external_axes.h"
#include "calib/estimate/predict.h"
#include "calib/model/error.h"
#include "daemon/krl/fix_lines.h"
#include "daemon/krl/fix_module.h"
#include "daemon/krl/run_time_program.h"
#include "tests/daemon/krl/fixture.h"
#include "tests/daemon/krl/krl_controller.h"

namespace cellcal::daemon::testing {
namespace {

using calib::JointVector;
using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;
using External = KrlController::External;
using State = sim::krl::Interpreter::State;

constexpr double kPreciseM = 4e-6, kPreciseRad = 4e-6;

Isometry3d frame(double x, double y, double z, double a, double b, double c) {
  return calib::to_isometry({{x, y, z}, {a, b, c}});
}
Isometry3d about_z(double deg) {
  return Isometry3d(AngleAxisd(deg * calib::kRadPerDeg, Vector3d::UnitZ()));
}
std::string text_of(const Isometry3d& place) {
  const calib::FrameMmDeg f = calib::to_frame(place);
  return fmt::format("X {:.6f},Y {:.6f},Z {:.6f},A {:.7f},B {:.7f},C {:.7f}", f.xyz_mm[0],
                     f.xyz_mm[1], f.xyz_mm[2], f.abc_deg[0], f.abc_deg[1], f.abc_deg[2]);
}

const Isometry3d kErsysRoot = frame(-500.0, 200.0, 30.0, 20.0, 0.0, 0.0),
                 kTravel = frame(10.0, 0.0, 5.0, 0.0, 90.0, 0.0),  // z along x of the root
    kCarriage = frame(0.0, 40.0, 300.0, 0.0, -90.0, 0.0),
                 kRobroot = frame(15.0, -8.0, 400.0, 90.0, 0.0, 0.0),
                 kTilt = frame(1100.0, 100.0, 400.0, 0.0, 0.0, -90.0),  // in the robot's base
    kTurn = frame(0.0, -100.0, 20.0, 0.0, 0.0, 90.0),
                 kTable = frame(30.0, -20.0, 90.0, 40.0, 0.0, 0.0),
                 kRoot = frame(-200.0, 700.0, 10.0, 60.0, 3.0, 0.0),  // in the world
    kOffset = frame(120.0, 60.0, 45.0, -25.0, 1.0, 2.0),              // BASE_DATA[3]
    kFixed = frame(900.0, 250.0, 500.0, 30.0, 2.0, -1.0);             // BASE_DATA[4], in the world

/// An arm of the demo cell on a unit, with this many positioner axes, or both; and its controller.
struct World {
  bool unit = false;
  int axes = 0;
  calib::Calibration c = {};
  double axis_off_mm = 0.0;  ///< of the positioner's first axis, in the executing controller
  int carrying = 2;          ///< at most this many of the axes carry base 3
  bool as_found = false;     ///< the machine data contain the axes as found

  std::size_t first() const { return unit ? 1 : 0; }  ///< of the positioner, among E1 to E6

  /// The controller's chain, in the world.
  Isometry3d foot(const External& e) const {
    if (!unit) return kRobroot;
    return kErsysRoot * kTravel * Eigen::Translation3d(0.0, 0.0, e[0] * 1e-3) * kCarriage *
           kRobroot;
  }
  Isometry3d axis(std::size_t j) const {
    return as_found ? calib::axis_as_found(c, j) : j == 0 ? kTilt : kTurn;
  }
  /// Angles of the axes that carry base 3, in degrees.
  std::vector<double> angles(const External& e) const {
    const auto begin = e.begin() + static_cast<std::ptrdiff_t>(first());
    return {begin, begin + std::min(axes, carrying)};
  }
  /// Frame carried by them, in the robot's base.
  Isometry3d carried(const External& e, double off_mm = 0.0) const {
    Isometry3d at = Isometry3d::Identity();
    for (std::size_t j = 0; j < angles(e).size(); ++j)
      at = at * axis(j) * frame(j == 0 ? off_mm : 0.0, 0, 0, 0, 0, 0) * about_z(angles(e)[j]);
    return at;
  }
  Isometry3d table(const External& e, double off_mm = 0.0) const {
    return foot({}) * carried(e, off_mm) * kTable;
  }
  /// From the controller's place of the part to that on the calibrated axes, in the robot's base.
  Isometry3d shift(const External& e) const {
    std::vector<double> rad;
    for (int j = 0; j < axes; ++j)
      rad.push_back(e[first() + static_cast<std::size_t>(j)] * calib::kRadPerDeg);
    const std::span<const double> all(rad);
    const std::size_t carriers = angles(e).size();
    return calib::carried_as_found(c, all.first(carriers), all.subspan(carriers)) *
           carried(e).inverse();
  }
  std::string machine() const {
    std::string text = fmt::format("INT $EX_AX_NUM={}\nFRAME $ROBROOT={{{}}}\n",
                                   axes + (unit ? 1 : 0), text_of(kRobroot));
    text += fmt::format("DECL EX_KIN $EX_KIN={{ET1 #{},ET2 #{}}}\n", unit ? "ERSYS" : "NONE",
                        axes > 0 ? "EASYS" : "NONE");
    if (unit)
      text += fmt::format(
          "DECL ET_AX $ET1_AX={{TR_A1 #E1,TR_A2 #NONE}}\n$AXIS_DIR[7]=1\nFRAME $ERSYSROOT={{{}}}\n"
          "FRAME $ET1_TA1KR={{{}}}\nFRAME $ET1_TFLA3={{{}}}\n",
          text_of(kErsysRoot), text_of(kTravel), text_of(kCarriage));
    if (axes > 0)
      text += fmt::format(
          "DECL ET_AX $ET2_AX={{TR_A1 #E{},TR_A2 #{}}}\nFRAME $ET2_TA1KR={{{}}}\nFRAME "
          "$ET2_TA2A1={{{}}}\nFRAME $ET2_TFLA3={{{}}}\n",
          first() + 1, angles({}).size() > 1 ? fmt::format("E{}", first() + 2) : "NONE",
          text_of(kRoot.inverse() * foot({}) * axis(0)), text_of(axes > 1 ? axis(1) : kTurn),
          text_of(kTable));
    return text;
  }
  std::string config() const {
    std::string text = "DEFDAT $CONFIG PUBLIC\nTOOL_DATA[1]={" + text_of(frames().tool) +
                       "}\nBASE_DATA[3]={" + text_of(kOffset) + "}\nBASE_DATA[4]={" +
                       text_of(kFixed) + "}\n";
    if (axes > 0)
      text += "MACHINE_DEF[2]={NAME[] \"DKP\",ROOT {" + text_of(kRoot) +
              "},MECH_TYPE #EASYS}\nMACHINE_FRAME_DAT[3]={MACH_DEF_INDEX 2}\n";
    return text + "ENDDAT\n";
  }
};

calib::PositionerAxis axis_of(const std::string& name, const Isometry3d& at) {
  calib::PositionerAxis axis;
  axis.name = name;
  axis.frame = at;
  axis.min_rad = -3.0;
  axis.max_rad = 3.0;
  axis.place_sigma_m = axis.direction_sigma_rad = 2e-3;
  axis.scale_sigma = 1e-4;
  axis.com_m = Vector3d(0.12, 0.05, 0.2);
  axis.compliance_sigma_rad_per_nm = axis.bearing_sigma_rad_per_nm = 2e-6;
  return axis;
}

/// `load_kg`: on each axis.
World world_of(bool unit, int axes, double load_kg = 0.0) {
  World world{unit, axes};
  calib::Cell on = cell();
  for (int j = 0; j < axes; ++j) {
    on.robot.positioner.push_back(
        axis_of("E" + std::to_string(j + (unit ? 2 : 1)), j == 0 ? kTilt : kTurn));
    on.robot.positioner.back().mass_kg = load_kg;
  }
  if (unit) {
    calib::Joint rail;
    rail.name = "E1";
    rail.min_rad = -0.2;
    rail.max_rad = 3.0;
    calib::LinearGuide& guide = rail.guide.emplace();
    guide.along = (world.foot({}).inverse() * world.foot({1000.0})).translation();
    for (double& component : guide.along) component = std::round(component * 1e9) / 1e9;
    guide.scale_sigma = 5e-4;
    guide.direction_sigma_rad = 3e-3;
    guide.straightness_sigma_m = 3e-4;
    guide.turn_sigma_rad_m = 5e-4;
    guide.turn_sigma_rad = 3e-3;  // so large that the order of the turns counts
    on.robot.joints.insert(on.robot.joints.begin(), rail);
  }
  if (axes > 0) {
    calib::Target sphere;
    sphere.id = "TABLE";
    sphere.diameter_m = 0.05;
    sphere.has_centre = true;
    sphere.carried_by = axes;
    on.targets.push_back(sphere);
  }
  calib::Random random(4);
  world.c = calib::testing::random_calibration(on, random, 1.0, calib::kFullestLevel);
  std::erase_if(world.c.targets, [](const auto& target) { return target.id == "TABLE"; });
  if (axes > 0) world.c.targets.push_back({"TABLE", Vector3d::Zero()});
  return world;
}

struct Point {
  JointVector q;
  External e{};
};

std::vector<Point> points_of(const World& world, int count) {
  calib::Random random(7);
  std::vector<Point> all;
  for (const JointVector& q : postures(8 * count, 11)) {
    if (std::abs(std::sin(q[4])) < 0.2 || static_cast<int>(all.size()) == count) continue;
    Point one{q};
    const auto drawn = [&](double least, double most) {
      return std::round(random.uniform(least, most) * 1000.0) / 1000.0;
    };
    if (world.unit) one.e[0] = drawn(-150.0, 2950.0);
    for (int j = 0; j < world.axes; ++j)
      one.e[world.first() + static_cast<std::size_t>(j)] = drawn(-150.0, 150.0);
    all.push_back(one);
  }
  return all;
}

Isometry3d nominal_tcp(const JointVector& q) {
  calib::Tool tool;
  tool.tcp = frames().tool;
  return calib::ArmModel(cell().robot, tool).nominal_tcp(q);
}

std::string external_text(const World& world, const External& e) {
  std::string text;
  for (std::size_t i = 0; i < world.first() + static_cast<std::size_t>(world.axes); ++i)
    text += fmt::format(",E{} {:.3f}", i + 1, e[i]);
  return text;
}

/// In base 3 on the table, or in base 4 in the world.
std::string pose_of(const World& world, const Point& at, int base, bool external = true) {
  const Isometry3d in = base == 3 ? world.table(at.e) * kOffset : kFixed;
  const auto st = status_and_turn(cell().robot, at.q);
  return fmt::format("{{{},S {},T {}{}}}",
                     text_of(in.inverse() * world.foot(at.e) * nominal_tcp(at.q)), st.status,
                     st.turn, external ? external_text(world, at.e) : "");
}
std::string axes_of(const World& world, const Point& at, bool external = true) {
  std::string text = "{";
  for (std::size_t i = 0; i < 6; ++i)
    text += fmt::format("{}A{} {:.7f}", i > 0 ? "," : "", i + 1, at.q[i] * calib::kDegPerRad);
  return text + (external ? external_text(world, at.e) : "") + "}";
}

krl::BackupFiles files_of(const World& world, const std::string& body, const std::string& data) {
  krl::BackupFiles files;
  files.modules.push_back({{"p.src", "DEF P ( )\n" + body + "\nEND\n"},
                           krl::KrlFile{"p.dat", "DEFDAT P PUBLIC\n" + data + "ENDDAT\n"},
                           {},
                           {}});
  files.controller = {{"$config.dat", world.config()}, {"$machine.dat", world.machine()}};
  return files;
}

krl::FixModule module_of(const World& world, bool anywhere = false) {
  krl::Data data;
  for (const krl::KrlFile& file : files_of(world, "", "").controller) read_data(file, data);
  return fix_module(world.c, data, {4711, "0123456789abcdef", anywhere});
}

/// A program with CELLCAL_FIX on the world's controller.
std::unique_ptr<KrlController> controller_with(const World& world, const std::string& src,
                                               const std::string& data, bool anywhere = false) {
  const krl::FixModule fix = module_of(world, anywhere);
  auto controller = std::make_unique<KrlController>(
      cell().robot,
      std::map<std::string, std::string>{{"p.src", src},
                                         {"p.dat", files_of(world, "", data).modules[0].dat->text},
                                         {"cellcal_fix.src", fix.src.text},
                                         {"cellcal_fix.dat", fix.dat.text}});
  controller->variable("$EX_AX_NUM").set_whole(world.axes + (world.unit ? 1 : 0));
  controller->set_frame("$ROBROOT", calib::to_frame(kRobroot));
  controller->foot = [world](const External& e) { return world.foot(e); };
  controller->table = [world](const External& e) { return world.table(e, world.axis_off_mm); };
  controller->put_data("TOOL_DATA", 1, frames().tool);
  controller->put_data("BASE_DATA", 3, kOffset);
  controller->put_data("BASE_DATA", 4, kFixed);
  if (world.axes > 0)
    controller->variable("MACHINE_FRAME_DAT").parts.at(2).part("MACH_DEF_INDEX").set_whole(2);
  return controller;
}

/// A program corrected at run time, after execution.
std::unique_ptr<KrlController> after(const World& world, const std::string& body,
                                     const std::string& data, bool anywhere = false) {
  const krl::BackupFiles files = files_of(world, body, data);
  const auto rewritten = rewrite_motions(files, {}, krl::external_names(world.c.cell.robot));
  EXPECT_EQ(rewritten.files.size(), 1U);
  EXPECT_EQ(krl::restored(rewritten.files.at(0)), files.modules[0].src.text);
  auto controller = controller_with(world, rewritten.files[0].text, data, anywhere);
  controller->run("P");
  return controller;
}

std::string why(const KrlController& controller) {
  return controller.messages.empty() ? controller.message() : controller.messages.back();
}

/// Compares the calibrated TCP at the executed positions with the wanted ones.
void expect_met(const World& world, const KrlController& controller,
                const std::vector<Point>& points, bool on_table) {
  ASSERT_EQ(controller.state(), State::kEnded) << why(controller);
  ASSERT_EQ(controller.reached.size(), points.size());
  const calib::Predictor real(world.c);
  double before = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const External& e = points[i].e;
    const auto there = [&](JointVector q) {
      if (world.unit) q.insert(q.begin(), e[0] * 1e-3);
      return real.calibrated(q).tcp;
    };
    const Isometry3d wanted = (on_table ? world.shift(e) : Isometry3d::Identity()) *
                              world.foot({}).inverse() * world.foot(e) * nominal_tcp(points[i].q);
    for (std::size_t k = 0; k < e.size(); ++k)
      EXPECT_NEAR(controller.external_reached[i][k], e[k], 2e-4) << i << " E" << k + 1;
    const Isometry3d off = wanted.inverse() * there(controller.reached[i]);
    EXPECT_LT(off.translation().norm(), kPreciseM) << i;
    EXPECT_LT(calib::turn_vector(off.linear()).norm(), kPreciseRad) << i;
    before += (there(points[i].q).translation() - wanted.translation()).norm();
  }
  EXPECT_GT(before / static_cast<double>(points.size()), 1e-3);
}

struct Text {
  std::string body, data;
};
/// PTP and LIN in turn, each LIN in the posture of the preceding PTP with other external axes.
Text program_of(const World& world, std::vector<Point>& points, int base) {
  Text text{fmt::format("BAS(#TOOL,1)\nBAS(#BASE,{})\n", base), ""};
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i % 2 == 1) points[i].q = points[i - 1].q;
    text.body += fmt::format("{} XP{}\n", i % 2 == 1 ? "LIN" : "PTP", i + 1);
    text.data += fmt::format("DECL E6POS XP{}={}\n", i + 1, pose_of(world, points[i], base));
  }
  return text;
}

/// In a base in the world and, with a positioner, on its table.
void expect_precise(const World& world) {
  for (const int base : {4, 3}) {
    if (base == 3 && world.axes == 0) continue;
    auto points = points_of(world, 30);
    const Text text = program_of(world, points, base);
    const auto controller = after(world, text.body, text.data);
    expect_met(world, *controller, points, base == 3);
    const auto& executed = controller->executed();
    const auto count = static_cast<std::int64_t>(points.size());
    // Stated in README.md.
    EXPECT_LT(executed.statements / count, 2000);
    EXPECT_LT(executed.operations / count, 3000);
    EXPECT_LT(executed.frames / count, 250);
  }
}

TEST(FixModuleWithExternalAxes, BringsTheTcpWhereItWasProgrammedOnALinearUnit) {
  expect_precise(world_of(true, 0));
}
TEST(FixModuleWithExternalAxes, BringsTheTcpToThePartOnOneAxis) {
  expect_precise(world_of(false, 1));
}
TEST(FixModuleWithExternalAxes, BringsTheTcpToThePartOnTwoAxes) {
  expect_precise(world_of(false, 2));
}
TEST(FixModuleWithExternalAxes, BringsTheTcpToThePartFromALinearUnit) {
  expect_precise(world_of(true, 1));
  expect_precise(world_of(true, 2));
}

TEST(FixModuleWithExternalAxes, BringsTheTcpToThePartOnAxesThatGiveUnderALoad) {
  World world = world_of(false, 2, 300.0);
  EXPECT_GT(calib::largest_give_rad(world.c, 0) + calib::largest_give_rad(world.c, 1), 5e-4);
  expect_precise(world);
  expect_precise(world_of(true, 1, 300.0));
  world.carrying = 1;  // the second loads the first as it turns
  expect_precise(world);
}

TEST(FixModuleWithExternalAxes, BringsTheTcpToThePartOnTheFirstOfTwoAxes) {
  World world = world_of(false, 2);
  world.carrying = 1;
  expect_precise(world);
}
TEST(FixModuleWithExternalAxes, BringsTheTcpToThePartByMachineDataWithTheAxesAsFound) {
  World world = world_of(false, 2);
  world.as_found = true;
  expect_precise(world);
}

/// X to C of the program's points.
std::vector<Isometry3d> places_in(const std::string& dat, std::size_t count) {
  std::vector<Isometry3d> all;
  for (std::size_t i = 0; i < count; ++i) {
    const std::string head = fmt::format("XP{}={{", i + 1);
    calib::FrameMmDeg f;
    const auto at = dat.find(head);
    if (at == std::string::npos ||
        std::sscanf(dat.c_str() + at + head.size(), "X %lf,Y %lf,Z %lf,A %lf,B %lf,C %lf",
                    &f.xyz_mm[0], &f.xyz_mm[1], &f.xyz_mm[2], &f.abc_deg[0], &f.abc_deg[1],
                    &f.abc_deg[2]) != 6)
      break;
    all.push_back(calib::to_isometry(f));
  }
  return all;
}

TEST(FixModuleWithExternalAxes, GivesThePointsOfTheOfflineCorrection) {
  const World world = world_of(true, 2);
  auto points = points_of(world, 20);
  const Text text = program_of(world, points, 3);
  const krl::BackupFiles files = files_of(world, text.body, text.data);
  krl::ProgramFiles one = files.modules[0];
  one.controller = files.controller;
  const auto offline = correct_program(world.c, one);
  ASSERT_TRUE(offline.refusals.empty()) << all_words(offline);
  const auto wanted = places_in(offline.files.at(1).text, points.size());
  std::string body = "BAS(#TOOL,1)\nBAS(#BASE,3)\n", data = text.data;
  for (std::size_t i = 1; i <= points.size(); ++i) {
    body += fmt::format("XR{0}=CC_FIX_PTP(XP{0})\n", i);
    data += fmt::format("DECL GLOBAL E6POS XR{}\n", i);
  }
  const auto controller = controller_with(world, "DEF P ( )\n" + body + "END\n", data);
  controller->run("P");
  ASSERT_EQ(controller->state(), State::kEnded) << why(*controller);
  ASSERT_EQ(wanted.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto& is = controller->variable(fmt::format("XR{}", i + 1).c_str());
    const auto part = [&](const char* name) { return is.part(name).number(); };
    const Isometry3d there =
        frame(part("X"), part("Y"), part("Z"), part("A"), part("B"), part("C"));
    const Isometry3d off = wanted[i].inverse() * there;
    EXPECT_LT(off.translation().norm(), 2.0 * kPreciseM) << i;
    EXPECT_LT(calib::turn_vector(off.linear()).norm(), 2.0 * kPreciseRad) << i;
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(part(fmt::format("E{}", k + 1).c_str()), points[i].e[k], 2e-4);
  }
}

TEST(FixModuleWithExternalAxes, TakesAxisAnglesAsThePlaceOfTheNominalArm) {
  const World world = world_of(true, 2);
  for (const int base : {3, 4}) {
    const auto points = points_of(world, 20);
    Text text{fmt::format("BAS(#TOOL,1)\nBAS(#BASE,{})\n", base), ""};
    for (std::size_t i = 0; i < points.size(); ++i) {
      text.body += fmt::format("PTP XA{}\n", i);
      text.data += fmt::format("DECL E6AXIS XA{}={}\n", i, axes_of(world, points[i]));
    }
    const auto controller = after(world, text.body, text.data);
    expect_met(world, *controller, points, false);
  }
}

TEST(FixModuleWithExternalAxes, LeavesThemWhereTheMotionBeforeHadThemForPointsWithout) {
  const World world = world_of(true, 1);
  auto points = points_of(world, 1);
  points.insert(points.end(), 4, points[0]);
  const std::string pose = pose_of(world, points[0], 3, false);
  const std::string data = "DECL E6POS XP=" + pose_of(world, points[0], 3) +
                           "\nDECL POS XO=" + pose +
                           "\nDECL FRAME XF=" + pose.substr(0, pose.find(",S")) + "}\n";
  const std::string frames_set = "BAS(#TOOL,1)\nBAS(#BASE,3)\n";
  const auto controller =
      after(world, frames_set + "PTP XP\nLIN XF\nLIN XO\nPTP XO\nPTP XF\n", data);
  expect_met(world, *controller, points, true);

  for (const char* first : {"PTP XO", "LIN XF", "PTP XB"}) {
    const auto alone = after(world, frames_set + first,
                             data + "DECL AXIS XB=" + axes_of(world, points[0], false) + "\n");
    EXPECT_EQ(alone->state(), State::kHalted) << first;
    EXPECT_TRUE(alone->reached.empty()) << first;
    EXPECT_NE(why(*alone).find("posture unknown"), std::string::npos) << first;
  }
}

TEST(FixModuleWithExternalAxes, AreNotKnownAfterAHomeWithoutThem) {
  const World world = world_of(true, 1);
  const Point point = points_of(world, 1)[0];
  const std::string pose = pose_of(world, point, 3, false);
  const auto controller = controller_with(
      world,
      "DEF P ( )\nBAS(#TOOL,1)\nBAS(#BASE,3)\nPTP CC_STAY_AXIS(XB)\nLIN CC_FIX_FRAME(XF)\nEND\n",
      "DECL AXIS XB=" + axes_of(world, point, false) +
          "\nDECL FRAME XF=" + pose.substr(0, pose.find(",S")) + "}\n");
  controller->run("P");
  EXPECT_EQ(controller->state(), State::kHalted);
  EXPECT_EQ(controller->reached.size(), 1U);
  EXPECT_NE(why(*controller).find("posture unknown"), std::string::npos) << why(*controller);
}

TEST(FixModuleWithExternalAxes, CorrectsRelativeMotionsWithTheCarriageWhereItGoes) {
  const World world = world_of(true, 1);
  auto points = points_of(world, 1);
  points[0].e[0] = 1000.0;
  points.insert(points.end(), 2, points[0]);
  points[1].q[0] += 2.0 * calib::kRadPerDeg;
  points[2].q[0] = points[1].q[0];
  points[2].q[2] -= 1.0 * calib::kRadPerDeg;
  points[1].e[0] = points[2].e[0] = 1250.0;
  const auto controller = after(
      world, "BAS(#TOOL,1)\nBAS(#BASE,4)\nPTP XP\nPTP_REL {A1 2.0,E1 250.0}\nPTP_REL {A3 -1.0}\n",
      "DECL E6POS XP=" + pose_of(world, points[0], 4) + "\n");
  expect_met(world, *controller, points, false);
}

TEST(FixModuleWithExternalAxes, TakesABaseOnTheTableOfTheMotionsOwnWith) {
  const World world = world_of(true, 2);
  const auto points = points_of(world, 10);
  const std::string of_its_own = "CC_BASE(3),#BASE,$LOAD,CC_CARRIER(3)",
                    of_the_tool = "$BASE,#BASE,$LOAD,-1";
  for (const auto& [active, with] :
       {std::pair(0, of_its_own), {4, of_its_own}, {3, of_its_own}, {3, of_the_tool}}) {
    Text text;
    for (std::size_t i = 0; i < points.size(); ++i) {
      // Settings of WITH for this motion only.
      text.body += fmt::format(
          "BAS(#TOOL,0)\nBAS(#BASE,{1})\nXP{0}=CC_FIX_PTP_IN(XP{0},TOOL_DATA[1],{2})\n"
          "BAS(#TOOL,1)\nBAS(#BASE,3)\nPTP XP{0}\n",
          i, active, with);
      text.data += fmt::format("DECL E6POS XP{}={}\n", i, pose_of(world, points[i], 3));
    }
    const auto controller = controller_with(world, "DEF P ( )\n" + text.body + "END\n", text.data);
    controller->run("P");
    expect_met(world, *controller, points, true);
  }
}

/// In part 3 where the calibrated axes carry it, and in the world.
TEST(FixModuleWithExternalAxes, MovesTheRealTcpFromAPointThatStaysByWhatIsProgrammed) {
  const World world = world_of(true, 2);
  const Point point = points_of(world, 1)[0];
  const calib::Predictor real(world.c);
  for (const int base : {3, 4})
    for (const char* stays : {"CC_STAY(XH)", "CC_STAY_POS(XP)"}) {
      const auto controller = controller_with(
          world,
          fmt::format("DEF P ( )\nBAS(#TOOL,1)\nBAS(#BASE,{0})\nPTP {1}\nLIN_REL CC_BY(XD)\n"
                      "PTP {1}\nLIN_REL CC_BY_TOOL(XD) #TOOL\nPTP {1}\n"
                      "PTP_REL CC_BY_AXES(XA)\nLIN_REL CC_BY(XD)\nEND\n",
                      base, stays),
          "DECL E6AXIS XH=" + axes_of(world, point) +
              "\nDECL E6POS XP=" + pose_of(world, point, base) +
              "\nDECL FRAME XD={X 3.0,Y -2.0,Z 40.0,A 0.0,B 0.0,C 0.0}\n"
              "DECL E6AXIS XA={A1 1.0,A2 0.0,A3 0.0,A4 0.0,A5 0.0,A6 5.0,E1 -20.0,E2 5.0,E3 5.0}\n");
      controller->run("P");
      ASSERT_EQ(controller->state(), State::kEnded) << why(*controller);
      const auto is = [&](std::size_t i) {
        const External& e = controller->external_reached.at(i);
        JointVector q = controller->reached[i];
        q.insert(q.begin(), e[0] * 1e-3);
        const Isometry3d at =
            base == 3 ? world.shift(e) * world.foot({}).inverse() * world.table(e) * kOffset
                      : world.foot({}).inverse() * kFixed;
        return at.inverse() * real.calibrated(q).tcp;
      };
      const Vector3d by(3e-3, -2e-3, 40e-3);
      EXPECT_LT((is(1).translation() - is(0).translation() - by).norm(), 2.0 * kPreciseM);
      EXPECT_LT((is(3).translation() - is(2) * by).norm(), 2.0 * kPreciseM);
      EXPECT_LT((is(6).translation() - is(5).translation() - by).norm(), 2.0 * kPreciseM);
      EXPECT_NEAR(controller->external_reached[6][0], point.e[0] - 20.0, 2e-4);
    }
}

/// Also between the base of the motion's own WITH and what carries it.
TEST(FixModuleWithExternalAxes, GivesTheSamePointsWhereAnInterruptCallsItInsideOfACall) {
  const World world = world_of(true, 1);
  const auto points = points_of(world, 2);
  const auto controller = controller_with(
      world,
      "DEF P ( )\nINTERRUPT DECL 5 WHEN CALLED DO ASIDE( )\nINTERRUPT ON 5\nBAS(#TOOL,1)\n"
      "BAS(#BASE,4)\nXR=TARGET( )\nEND\nDEFFCT E6POS TARGET ( )\n"
      "RETURN (CC_FIX_PTP_IN(XP,TOOL_DATA[1],CC_BASE(3),#BASE,$LOAD,CC_CARRIER(3)))\nENDFCT\n"
      "DEF ASIDE ( )\nXS=CC_FIX_PTP_IN(XQ,TOOL_DATA[1],CC_BASE(4),#BASE,$LOAD,CC_CARRIER(4))\nEND\n",
      "DECL GLOBAL BOOL CALLED=FALSE\nDECL E6POS XP=" + pose_of(world, points[0], 3) +
          "\nDECL E6POS XQ=" + pose_of(world, points[1], 4) + "\nDECL GLOBAL E6POS XR,XS\n");
  std::vector<float> first;
  std::int64_t n = 1;
  for (; controller->run_interrupted("P", "TARGET", n, "CALLED"); ++n) {
    ASSERT_EQ(controller->state(), State::kEnded) << n << " " << why(*controller);
    std::vector<float> both;
    for (const char* name : {"XR", "XS"})
      for (std::size_t i = 0; i < 6; ++i) both.push_back(controller->variable(name).parts[i].r);
    if (n == 1) first = both;
    ASSERT_EQ(both, first) << n;
  }
  EXPECT_GT(n, 1000);
}

/// Expects a halt before any motion, with this message.
void expect_halt(const World& world, const Point& point, int base, const std::string& words,
                 bool anywhere = false) {
  const auto controller = after(world, fmt::format("BAS(#TOOL,1)\nBAS(#BASE,{})\nPTP XP", base),
                                "DECL E6POS XP=" + pose_of(world, point, base) + "\n", anywhere);
  EXPECT_EQ(controller->state(), words.empty() ? State::kEnded : State::kHalted)
      << why(*controller);
  EXPECT_EQ(controller->reached.empty(), !words.empty());
  EXPECT_NE(why(*controller).find(words), std::string::npos) << why(*controller);
}

TEST(FixModuleWithExternalAxes, HoldsTheArmOutsideOfWhatWasCalibrated) {
  World world = world_of(true, 2);
  Point point = points_of(world, 1)[0];
  expect_halt(world, point, 3, "");
  Point beyond = point;
  beyond.e[0] = 3000.5;
  expect_halt(world, beyond, 3, "outside of what was calibrated");
  expect_halt(world, beyond, 4, "outside of what was calibrated");
  world.c.positioner.resize(2);
  world.c.positioner[1].touched_rad = {0.0, 1.0};
  point.e[2] = 57.2;
  expect_halt(world, point, 3, "");
  point.e[2] = 57.4;
  expect_halt(world, point, 3, "outside of what was calibrated");
  expect_halt(world, point, 3, "", true);
  expect_halt(world, point, 4, "");  // not on the table
}

TEST(FixModuleWithExternalAxes, HoldsTheArmWhoseControllerTurnsTheTableAboutAnotherAxis) {
  World world = world_of(false, 2);
  const Point point = points_of(world, 1)[0];
  world.axis_off_mm = 1.5;
  expect_halt(world, point, 3, "controller computes another place");
  expect_halt(world, point, 4, "");
  // A calibration without touches there.
  world.axis_off_mm = 0.0;
  std::erase_if(world.c.targets, [](const auto& target) { return target.id == "TABLE"; });
  expect_halt(world, point, 3, "controller computes another place");
  expect_halt(world, point, 4, "");
}

TEST(FixModuleWithExternalAxes, MovesNothingToAPointThatDoesNotStateThem) {
  const World world = world_of(true, 1);
  const Point point = points_of(world, 1)[0];
  for (const std::string& declared : {"E6POS XP=" + pose_of(world, point, 3, false),
                                      "E6AXIS XP=" + axes_of(world, point, false)}) {
    const auto controller =
        after(world, "BAS(#TOOL,1)\nBAS(#BASE,3)\nPTP XP", "DECL " + declared + "\n");
    EXPECT_EQ(controller->state(), State::kFailed);
    EXPECT_TRUE(controller->reached.empty());
    EXPECT_NE(controller->message().find("has no value"), std::string::npos)
        << controller->message();
  }
}

TEST(FixModuleWithExternalAxes, IsNotMadeOfDataThatContradictTheCalibration) {
  const World world = world_of(true, 1);
  krl::Data data;
  read_data({"$machine.dat",
             std::regex_replace(world.machine(), std::regex("DIR\\[7\\]=1"), "DIR[7]=-1")},
            data);
  EXPECT_THROW(fix_module(world.c, data, {4711, "0"}), calib::FileError);
  World named = world;
  named.c.cell.robot.positioner[0].name = "TILT";
  EXPECT_THROW(module_of(named), calib::FileError);
}

TEST(RunTimeProgramWithExternalAxes, KeepsWhatCarriesTheBaseOfAMotionsOwnWith) {
  const World world = world_of(false, 1);
  const auto files =
      files_of(world,
               "SLIN XP WITH $TOOL=STOOL2(FP),$BASE=SBASE(FP.BASE_NO)\nPTP_REL {A1 5.0}\n"
               "SLIN XP WITH $TOOL=STOOL2(FP)\nSLIN XP WITH $BASE=BASE_DATA[2]\n"
               "SLIN XP WITH $BASE=SBASE(1):XF\n"
               "SLIN XP WITH $BASE=EK(K_ROOT(FP.BASE_NO),K_TYPE(FP.BASE_NO),K_OFFS(FP.BASE_NO))",
               "DECL E6POS XP\nFRAME XF\n");
  const auto with = rewrite_motions(files, {}, {"E1"}), without = rewrite_motions(files, {});
  ASSERT_EQ(with.files.size(), 1U);
  for (const char* own :
       {"CC_FIX_IN(XP,STOOL2(FP),CC_BASE(FP.BASE_NO),$IPO_MODE,$LOAD,CC_CARRIER(FP.BASE_NO)) WITH",
        ",A6 +0.0,E1 +0.0})", "STOOL2(FP),$BASE,$IPO_MODE,$LOAD,-1)",
        "$TOOL,BASE_DATA[2],$IPO_MODE,$LOAD,0)", ",CC_BASE(1):XF,$IPO_MODE,$LOAD,CC_CARRIER(1))",
        "CC_FIX_IN(XP,$TOOL,CC_BASE(FP.BASE_NO),$IPO_MODE,$LOAD,CC_CARRIER(FP.BASE_NO)) WITH"})
    EXPECT_NE(with.files[0].text.find(own), std::string::npos) << with.files[0].text;
  EXPECT_NE(without.files.at(0).text.find(",SBASE(FP.BASE_NO),"), std::string::npos);
  for (const auto* all : {&with, &without})
    EXPECT_EQ(krl::restored(all->files[0]), files.modules[0].src.text);
}

}  // namespace
}  // namespace cellcal::daemon::testing
