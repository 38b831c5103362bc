// Consistency check of cell files, on a valid cell with one error.

#include "calib/plan/cell_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "calib/files/files.h"
#include "calib/model/linear.h"
#include "calib/plan/bodies.h"
#include "calib/plan/duration.h"
#include "calib/plan/pool.h"
#include "tests/calib/plan/box.h"
#include "tests/calib/simulate.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

using Eigen::Vector3d;
using testing::box;
using testing::demo_cell;

std::string all_words(const std::vector<CellFault>& faults) {
  std::string words;
  for (const CellFault& fault : faults)
    words += calib::words(found_phrase(fault)) + " -> " + calib::words(advice_phrase(fault)) + "\n";
  return words;
}

/// The only fault of a cell; fails the test if there are others.
CellFault only_fault(const Cell& cell, CellFaultKind kind) {
  const auto faults = faults_of(cell);
  EXPECT_EQ(faults.size(), 1u) << all_words(faults);
  if (faults.empty()) return {};
  EXPECT_EQ(faults.front().kind, kind) << all_words(faults);
  return faults.front();
}

void expect_words(const CellFault& fault, std::initializer_list<std::string> words) {
  const std::string all = all_words({fault});
  for (const std::string& word : words) EXPECT_NE(all.find(word), std::string::npos) << all;
}

TEST(CellCheck, FindsNothingInASoundCell) {
  EXPECT_EQ(all_words(faults_of(demo_cell())), "");
  EXPECT_TRUE(refuse_faulty(demo_cell()).empty());
  Cell honest = demo_cell();  // centres as inaccurate as stated
  honest.targets[0].centre_m += Vector3d(0.02, -0.02, 0.01);
  for (Target& target : honest.targets) target.centre_sigma_m = 0.02;
  EXPECT_TRUE(refuse_faulty(honest, false).empty());
}

TEST(CellCheck, NamesACertifiedLengthWithItsDecimalPointInTheWrongPlace) {
  for (const double factor : {10.0, 100.0, 0.1, 0.001}) {
    Cell cell = demo_cell();
    cell.lengths[1].length_m *= factor;
    const CellFault fault = only_fault(cell, CellFaultKind::kDecimalPoint);
    EXPECT_TRUE(fault.refused);
    EXPECT_NEAR(fault.c_m, 0.616198, 1e-9);
    expect_words(fault, {"S1-S3", "616.198 mm would fit"});
  }
}

TEST(CellCheck, NamesTwoCentresThatAreExchanged) {
  Cell cell = demo_cell();
  std::swap(cell.targets[1].centre_m, cell.targets[2].centre_m);
  expect_words(only_fault(cell, CellFaultKind::kCentresExchanged), {"S2 and S3", "Exchange"});
}

TEST(CellCheck, NamesTheCentreThatTheLengthsAtItDoNotFit) {
  Cell cell = demo_cell();
  cell.targets[3].centre_m += Vector3d(-0.1, -0.1, 0.1);
  for (Target& target : cell.targets) target.centre_sigma_m = 0.002;
  const CellFault fault = only_fault(cell, CellFaultKind::kCentre);
  EXPECT_TRUE(fault.refused);
  expect_words(fault, {"centre of S4"});
  // Errors that touches correct are warnings.
  cell.targets[3].centre_m = demo_cell().targets[3].centre_m + Vector3d(0, 0, 0.008);
  for (Target& target : cell.targets) target.centre_sigma_m = 0.0005;
  EXPECT_FALSE(only_fault(cell, CellFaultKind::kCentre).refused);
}

TEST(CellCheck, SaysWhereALengthWasTakenBetweenSurfaces) {
  Cell cell = demo_cell();
  for (Target& target : cell.targets) target.centre_sigma_m = 0.001;
  cell.lengths[4].length_m -= cell.targets[1].diameter_m;
  expect_words(only_fault(cell, CellFaultKind::kSurfaces),
               {"S2-S4", "between centres, not surfaces"});
}

TEST(CellCheck, NamesLengthsThatCannotBeWithoutAnyCentre) {
  Cell cell = demo_cell();
  for (Target& target : cell.targets) target.has_centre = false;
  EXPECT_EQ(all_words(faults_of(cell)), "");
  cell.lengths[0].length_m = 5.02239;
  EXPECT_TRUE(only_fault(cell, CellFaultKind::kTriangle).refused);
  cell.lengths[0].length_m = 0.050;
  EXPECT_GE(faults_of(cell).size(), 1u);
  EXPECT_EQ(faults_of(cell).front().kind, CellFaultKind::kLengthTooShort);
}

TEST(CellCheck, NamesTwoLengthsOfOnePairThatDisagreeBesideWarningsToo) {
  Cell cell = demo_cell();
  for (Target& target : cell.targets) target.has_centre = false;
  CertifiedLength again = cell.lengths[0];
  std::swap(again.from, again.to);
  again.length_m += 5.0 * again.sigma_m;  // 3.5 sigma of both
  cell.lengths.push_back(again);
  EXPECT_EQ(all_words(faults_of(cell)), "");
  cell.lengths.back().length_m += 0.089;
  const CellFault fault = only_fault(cell, CellFaultKind::kTwoLengths);
  EXPECT_TRUE(fault.refused);
  expect_words(fault, {"S1-S2: ", " mm stated (", "One of the two is wrong"});
  cell.radius_offset_sigma_m = 0.0;
  EXPECT_EQ(faults_of(cell).front().kind, CellFaultKind::kTwoLengths);
}

TEST(CellCheck, NamesALengthThatIsStatedTwice) {
  Cell cell = demo_cell();
  CertifiedLength again = cell.lengths[0];
  std::swap(again.from, again.to);
  cell.lengths.push_back(again);
  const CellFault fault = only_fault(cell, CellFaultKind::kLengthTwice);
  EXPECT_TRUE(fault.refused);
  expect_words(fault, {"S1-S2: ", " mm stated twice", "Remove one"});
}

TEST(CellCheck, NamesSpheresInEachOtherInATableAndInTheFloor) {
  Cell cell = demo_cell();
  cell.lengths.clear();
  cell.targets[1].centre_m = cell.targets[0].centre_m + Vector3d(0.0, 0.02, 0.0);
  EXPECT_FALSE(
      only_fault(cell, CellFaultKind::kOverlap).refused);  // their centres may be off by this
  for (Target& target : cell.targets) target.centre_sigma_m = 0.001;
  EXPECT_TRUE(only_fault(cell, CellFaultKind::kOverlap).refused);

  cell = demo_cell();
  cell.obstacles = {
      box("table", {1.08, -0.32, 0.2}, {0.4, 0.3, 0.2})};  // its top at the sphere's lowest
  EXPECT_EQ(all_words(faults_of(cell)), "");
  cell.obstacles[0].frame.translation().z() += 0.005;
  const CellFault sunk = only_fault(cell, CellFaultKind::kInside);
  EXPECT_FALSE(sunk.refused);
  expect_words(sunk, {"sphere S1: 5.7 mm deep in obstacle table"});
  cell.obstacles[0].frame.translation().z() += 0.1;
  EXPECT_TRUE(only_fault(cell, CellFaultKind::kInside).refused);

  cell = demo_cell();
  cell.floor_m = 0.5;
  const auto faults = faults_of(cell);
  ASSERT_EQ(faults.size(), 2u) << all_words(faults);
  expect_words(faults[0], {"sphere S1", "in the floor"});
}

TEST(CellCheck, NamesATargetOutOfReachAndOneInMetres) {
  Cell cell = demo_cell();
  cell.lengths.clear();
  cell.targets[2].centre_m = {2.4, 0.0, 0.5};
  expect_words(only_fault(cell, CellFaultKind::kOutOfReach), {"S3: 2452 mm"});
  cell.targets[2].centre_m = {0.00064, -0.00062, 0.00064};
  expect_words(only_fault(cell, CellFaultKind::kCentreInMetres), {"S3", "in metres"});
}

TEST(CellCheck, NamesAToolOrADiameterInMetresAndATouchTooGoodToBeTrue) {
  Cell cell = demo_cell();
  cell.tool.tcp.translation() *= 1e-3;
  expect_words(only_fault(cell, CellFaultKind::kToolInMetres),
               {"0.418 mm from the flange", "metres"});
  cell = demo_cell();
  cell.targets[0].diameter_m *= 1e-3;
  EXPECT_EQ(faults_of(cell).front().kind, CellFaultKind::kDiameterInMetres);
  cell.targets[0].diameter_m = 0.002;  // 2 inches, stated as such
  EXPECT_EQ(faults_of(cell).front().kind, CellFaultKind::kDiameterInMetres);
  cell = demo_cell();
  cell.targets[0].diameter_m = 0.0254;
  cell.targets[0].centre_sigma_m = 0.004;
  EXPECT_FALSE(only_fault(cell, CellFaultKind::kUnusualDiameter).refused);
  cell = demo_cell();
  cell.touch_sigma_m = 3e-8;
  EXPECT_FALSE(only_fault(cell, CellFaultKind::kTouchSigma).refused);
  EXPECT_EQ(refuse_faulty(cell).size(), 1u);
}

TEST(CellCheck, WarnsOfRadiiThatCountAsExactSinceTheirOffsetIsNotStated) {
  Cell cell = demo_cell();
  cell.radius_offset_sigma_m = 0.0;
  const CellFault fault = only_fault(cell, CellFaultKind::kRadiusOffset);
  EXPECT_FALSE(fault.refused);
  expect_words(fault, {"radius_offset_sigma_mm = 0:", "state radius_offset_sigma_mm = 0.3"});
}

TEST(CellCheck, WarnsOfASphereThatTheFirstSearchMayPass) {
  Cell cell = demo_cell();
  cell.lengths.clear();
  Target& small = cell.targets[1];
  small.diameter_m = 0.040;
  const CellFault fault = only_fault(cell, CellFaultKind::kRoughCentre);
  EXPECT_FALSE(fault.refused);
  EXPECT_NEAR(fault.b_m, 0.00715, 1e-5);
  expect_words(fault, {"sphere S2: centre_sigma_mm = 10.0, limit 7.2 mm", "'cellcal run --find'",
                       "smaller centre_sigma_mm"});
  EXPECT_EQ(refuse_faulty(cell).size(), 1u);
  EXPECT_TRUE(refuse_faulty(cell, false).empty()) << "no search goes to the stated centre";
  // Every 50th sphere is farther aside than its radius.
  Random random(1);
  int passed = 0;
  constexpr int kSpheres = 100000;
  for (int k = 0; k < kSpheres; ++k)
    passed += std::hypot(random.normal(), random.normal()) * fault.b_m > small.diameter_m / 2.0;
  EXPECT_NEAR(passed, kSpheres / 50, kSpheres / 500);
  small.centre_sigma_m = 0.008;
  EXPECT_EQ(only_fault(cell, CellFaultKind::kRoughCentre).ids.front(), "S2");
  cell.tool.tip_radius_m = 0.003;  // a ball reaches farther aside
  EXPECT_EQ(all_words(faults_of(cell)), "");
  cell = demo_cell();
  cell.lengths.clear();
  cell.targets[1].diameter_m = 0.040;
  cell.targets[1].centre_sigma_m = 0.0;  // not stated
  EXPECT_EQ(all_words(faults_of(cell)), "");
}

TEST(CellCheck, NamesAMeshInMetres) {
  Cell cell = demo_cell();
  cell.obstacles = {box("fixture", {-0.9, 0.9, 0.2}, Vector3d::Zero())};
  cell.obstacles[0].shape = ObstacleShape::kMesh;
  cell.obstacles[0].mesh_file = "fixture.stl";
  const auto with_mesh =
      [&](double per_m) {  // 0.4 m x 0.3 m x 0.25 m, far from the origin of its file
        Mesh mesh{{{2, 1, 0}, {2.4, 1, 0}, {2.4, 1.3, 0}, {2, 1, 0.25}},
                  {{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}}};
        for (Vector3d& vertex : mesh.vertices_m) vertex *= per_m;
        cell.obstacles[0].mesh = std::make_shared<const Mesh>(mesh);
        return cell;
      };
  EXPECT_EQ(all_words(faults_of(with_mesh(1.0))), "");
  const CellFault fault = only_fault(with_mesh(1e-3), CellFaultKind::kMeshInMetres);
  EXPECT_TRUE(fault.refused);
  expect_words(fault, {"obstacle fixture: fixture.stl is 0.4 x 0.3 x 0.25 mm", "metres",
                       "Export it in millimetres"});
  EXPECT_EQ(calib::words(found_phrase(fault), *Language::of("de")),
            "Hindernis fixture: fixture.stl misst 0,4 x 0,3 x 0,25 mm");
  EXPECT_EQ(all_words(faults_of(with_mesh(0.03))), "") << "12 mm may be a bolt";
}

TEST(CellCheck, NamesASigmaThatACertificateStatesInMicrometres) {
  Cell cell = demo_cell();
  cell.lengths[0].sigma_m = 4e-3;
  const CellFault length = only_fault(cell, CellFaultKind::kCertifiedSigma);
  EXPECT_FALSE(length.refused);
  expect_words(length, {"S1-S2: sigma_mm = 4", "If 4 um is meant, state 0.004"});
  cell = demo_cell();
  cell.targets[1].diameter_sigma_m = 2e-3;
  expect_words(only_fault(cell, CellFaultKind::kCertifiedSigma),
               {"sphere S2: diameter_sigma_mm = 2", "0.002"});
  cell.targets[1].diameter_sigma_m = 1e-3;
  EXPECT_EQ(all_words(faults_of(cell)), "");
}

TEST(CellCheck, NamesAToolThatTheRobotCannotCarry) {
  Cell cell = demo_cell();
  cell.robot.name = "KUKA KR 16 R1610-2";
  cell.tool.mass_kg = 45.0;
  const CellFault heavy = only_fault(cell, CellFaultKind::kToolTooHeavy);
  EXPECT_TRUE(heavy.refused);
  expect_words(heavy, {"45 kg", "limit 16 kg", "mass_kg"});
  cell.tool.mass_kg = 17.0;  // slight overload is common
  EXPECT_FALSE(only_fault(cell, CellFaultKind::kToolTooHeavy).refused);
  cell.tool.mass_kg = 16.0;
  EXPECT_EQ(all_words(faults_of(cell)), "");
  cell.robot.name = "an arm";
  cell.tool.mass_kg = 4500.0;
  EXPECT_TRUE(only_fault(cell, CellFaultKind::kToolTooHeavy).refused);
}

TEST(CellCheck, TakesTheRatedPayloadFromTheModelName) {
  Robot robot;
  for (const auto& [name, kg] : {std::pair("KUKA KR 16 R1610-2", 16.0),
                                 {"KUKA KR 210 R3300-2 K", 210.0},
                                 {"KUKA KR 16-2", 16.0},
                                 {"KUKA KR 150 L110-2", 110.0},
                                 {"KUKA LBR iiwa 14 R820", 14.0},
                                 {"Franka Panda", 0.0}}) {
    robot.name = name;
    EXPECT_EQ(rated_payload_kg(robot), kg) << name;
  }
}

TEST(CellCheck, NamesAnObstacleThroughTheColumn) {
  Cell cell = demo_cell();
  cell.obstacles = {box("post", {0.0, 0.0, 0.3}, {0.1, 0.1, 2.0})};
  const CellFault fault = only_fault(cell, CellFaultKind::kInColumn);
  EXPECT_TRUE(fault.refused);
  expect_words(fault, {"obstacle post", "axis A1"});
  cell.obstacles = {box("pedestal", {0.0, 0.0, -0.25}, {0.4, 0.4, 0.5}),
                    box("cabinet", {-0.4, 0.0, 0.5}, {0.3, 0.6, 1.0})};
  EXPECT_EQ(all_words(faults_of(cell)), "");
}

TEST(CellCheck, NamesAPositionerWhoseLoadIsNotStated) {
  Cell cell = demo_cell();
  cell.robot.positioner.resize(2);
  cell.robot.positioner[0].name = "E1";
  cell.robot.positioner[1].name = "E2";
  const CellFault fault = only_fault(cell, CellFaultKind::kPositionerUnloaded);
  EXPECT_FALSE(fault.refused);
  expect_words(fault, {"E2", "count as stiff", "mass_kg"});
  cell.robot.positioner[0].mass_kg = 80.0;
  EXPECT_EQ(all_words(faults_of(cell)), "");
}

TEST(CellCheck, NamesABallLargerThanThePlannedClearance) {
  Cell cell = demo_cell();
  cell.tool.tip_radius_m = 0.025;
  expect_words(only_fault(cell, CellFaultKind::kLargeBall),
               {"25.0 mm", "20.0 mm", "not the diameter"});
  cell.tool.tip_radius_m = 0.019;
  EXPECT_EQ(all_words(faults_of(cell)), "");
}

TEST(CellCheck, NamesAToolWhoseSideMeetsTheSphereFirst) {
  Cell cell = demo_cell();
  cell.tool.slim_length_m = 0.008;
  const CellFault shaft = only_fault(cell, CellFaultKind::kShaftTouchesFirst);
  EXPECT_TRUE(shaft.refused);
  expect_words(shaft, {"8.0 mm from tip to shaft", "35.0 mm"});
  cell = demo_cell();
  cell.tool.tip_radius_m = 0.002;
  cell.tool.slim_radius_m = 0.005;
  expect_words(only_fault(cell, CellFaultKind::kShankTouchesFirst), {"2.0 mm", "5.0 mm"});
  cell.tool.slim_radius_m = 0.002;
  EXPECT_EQ(all_words(faults_of(cell)), "");
}

TEST(CellCheck, NamesAPointTipWhoseShankMeetsTheSphereFirst) {
  Cell cell = demo_cell();
  cell.tool.tip_radius_m = 0.0;
  cell.tool.radius_m = 0.004;  // a shank of 8 mm over the whole length
  cell.tool.slim_length_m = 0.003;
  const CellFault shank = only_fault(cell, CellFaultKind::kShaftTouchesFirst);
  EXPECT_TRUE(shank.refused);
  expect_words(shank, {"3.0 mm from tip to shaft", "9.0 mm needed", "tip_length_mm"});
  cell.tool.slim_length_m = 0.010;
  EXPECT_EQ(all_words(faults_of(cell)), "");
}

TEST(CellCheck, CountsTheMistakesThatItDoesNotList) {
  CellFault fault{CellFaultKind::kDescription};
  fault.mistakes.resize(3);
  EXPECT_EQ(calib::words(advice_phrase(fault)).find("more"), std::string::npos);
  fault.more = 2;
  EXPECT_NE(calib::words(advice_phrase(fault)).find(", or 2 more would fit"), std::string::npos);
}

TEST(CellCheck, NamesTheSignThatPutsTheArmIntoTheFloor) {
  Cell cell = demo_cell();
  cell.floor_m = 0.0;
  EXPECT_EQ(all_words(faults_of(cell)), "");
  cell.robot.joints[1].sign = -cell.robot.joints[1].sign;
  const CellFault fault = only_fault(cell, CellFaultKind::kDescription);
  EXPECT_TRUE(fault.refused);
  ASSERT_FALSE(fault.mistakes.empty());
  EXPECT_EQ(fault.mistakes[0].kind, DescriptionMistake::Kind::kSign);
  EXPECT_EQ(fault.mistakes[0].joint, "A2");
  EXPECT_EQ(fault.mistakes[0].sign, demo_cell().robot.joints[1].sign);
  expect_words(fault, {"into the floor", "sign = 1 of A2"});
}

TEST(CellCheck, AcceptsAToolThatPointsBackBesideTheFlangeWhereTheArmRestsWithItOnAnotherSide) {
  Cell cell = demo_cell();
  cell.robot = load_robot(std::string(CELLCAL_ROBOTS_FOLDER) + "/kr16_r2010_2.toml");
  cell.floor_m = 0.0;
  cell.tool.tcp = Eigen::Isometry3d::Identity();
  cell.tool.tcp.translation() = Vector3d(0.25, 0.0, -0.1);
  cell.tool.radius_m = 0.025;
  EXPECT_EQ(all_words(faults_of(cell)), "");
  const ArmModel arm = planning_arm(cell);
  const Clearance clearance(cell, arm);
  const JointVector rest = resting_posture(cell.robot, clearance);
  EXPECT_TRUE(clearance.clear(rest));
  EXPECT_NE(rest[5], middle_posture(cell.robot)[5]);
}

TEST(CellCheck, NamesAToolThatPointsAlongXInsteadOfZ) {
  Cell cell = demo_cell();
  cell.tool.tcp = Eigen::Isometry3d::Identity();
  cell.tool.tcp.translation() = Vector3d(0.3, 0.0, 0.0);
  const CellFault fault = only_fault(cell, CellFaultKind::kToolAcross);
  expect_words(fault, {"0 mm along the flange's Z axis", "300 mm across it", "point along Z"});
}

TEST(CellCheck, NamesARequirementThatThePlanDoesNotReach) {
  Cell cell = demo_cell();
  Plan plan;
  plan.predicted_mean_m = 1.2e-4;
  EXPECT_FALSE(fault_of(cell, plan));
  cell.required_m = 0.5e-4;
  const auto fault = fault_of(cell, plan);
  ASSERT_TRUE(fault);
  EXPECT_EQ(fault->kind, CellFaultKind::kRequired);
  expect_words(*fault, {"0.050", "0.120 mm"});
  cell.required_m = 2e-4;
  EXPECT_FALSE(fault_of(cell, plan));
}

/// A cell for any arm: a tool of 300 mm along Z on the shipped robot.
TEST(CellCheck, FindsNothingOnAnyShippedRobotOrExample) {
  int robots = 0;
  for (const auto& entry : std::filesystem::directory_iterator(CELLCAL_ROBOTS_FOLDER)) {
    if (entry.path().extension() != ".toml") continue;
    Cell cell;
    cell.robot = load_robot(entry.path());
    cell.tool.tcp.translation() = Vector3d(0.0, 0.0, 0.3);
    cell.tool.mass_kg = 2.0;
    cell.touch_sigma_m = 3e-5;
    EXPECT_EQ(all_words(faults_of(cell)), "") << entry.path();
    cell.floor_m = 0.0;
    EXPECT_EQ(all_words(faults_of(cell)), "") << entry.path();
    ++robots;
  }
  EXPECT_GE(robots, 46);
  ::setenv("CELLCAL_ROBOTS", CELLCAL_ROBOTS_FOLDER, 1);
  int cells = 0;
  for (const char* file :
       {CELLCAL_DEMO_CELL, CELLCAL_SOURCE "/calib/examples/cell.toml", CELLCAL_CONSTRAINTS_CELL,
        CELLCAL_TESTS_FOLDER "/real-data/mukca/panda_1/front/cell.toml"}) {
    EXPECT_EQ(all_words(faults_of(load_cell(file))), "") << file;
    ++cells;
  }
  EXPECT_GE(cells, 4);
}

TEST(CellCheck, FindsNothingOnAnyShippedArmWithTheFloorAtItsFootOnALinearUnit) {
  const Joint unit = load_robot(CELLCAL_TRACK_ROBOT).joints[0];
  int robots = 0;
  for (const auto& entry : std::filesystem::directory_iterator(CELLCAL_ROBOTS_FOLDER)) {
    if (entry.path().extension() != ".toml") continue;
    Cell cell;
    cell.robot = load_robot(entry.path());
    if (cell.robot.joints.size() != 6) continue;
    cell.tool.tcp.translation() = Vector3d(0.0, 0.0, 0.3);
    cell.tool.mass_kg = 2.0;
    cell.touch_sigma_m = 3e-5;
    cell.floor_m = 0.0;
    for (const bool moves : {false, true}) {
      if (moves) cell.robot.joints.insert(cell.robot.joints.begin(), unit);
      EXPECT_EQ(all_words(faults_of(cell)), "") << entry.path() << (moves ? ", on a unit" : "");
      if (!moves) continue;
      const ArmModel arm(cell);
      const Bodies bodies(arm);
      std::vector<Segment> axes;
      bodies.place(middle_posture(cell.robot), axes);
      // Of the column the whole height but its rounded foot, 30 mm above the floor.
      EXPECT_NEAR(axes[1].a.z(), bodies.list()[1].radius_m + 0.03, 1e-9) << entry.path();
      EXPECT_NEAR(axes[1].b.z(), cell.robot.joints[1].d_m, 1e-9) << entry.path();
    }
    ++robots;
  }
  EXPECT_GE(robots, 44);
}

TEST(CellCheck, RefusesWithAllThatIsWrong) {
  Cell cell = demo_cell();
  cell.lengths[1].length_m *= 10.0;
  cell.tool.tcp.translation() *= 1e-3;
  const auto error = testing::thrown<PlanError>([&] { (void)refuse_faulty(cell); });
  EXPECT_EQ(error.kind, PlanError::Kind::kCell);
  const std::string words = error.what();
  EXPECT_NE(words.find("S1-S3"), std::string::npos) << words;
  EXPECT_NE(words.find("tool: "), std::string::npos) << words;
}

TEST(AxisTravel, IsThatOfEveryWaypointFromWhereTheArmStands) {
  Plan plan;
  PlannedTouch first, second;
  first.transit = {{0.5, -1.0}};
  first.standoff = {0.6, -1.0};
  first.end = {0.7, -1.1};
  first.clear = {0.6, -0.9};
  second = first;
  second.transit = {{-2.0, 0.1}};
  plan.touches = {first, second};
  plan.home = {{0.0, 0.4}};
  const JointVector begin{0.2, 0.0};
  const AxisTravel all = axis_travel(plan, begin);
  EXPECT_EQ(all.low_rad, (JointVector{-2.0, -1.1}));
  EXPECT_EQ(all.high_rad, (JointVector{0.7, 0.4}));
  EXPECT_EQ(all.from(begin).axis, 0u);
  EXPECT_DOUBLE_EQ(all.from(begin).angle_rad, 2.2);
  EXPECT_DOUBLE_EQ(all.from_anywhere().angle_rad, 2.7);
  // Completed touches do not count.
  plan.touches[0].transit = {{-3.0, 0.0}};
  EXPECT_DOUBLE_EQ(axis_travel(plan, begin, 1).low_rad[0], -2.0);
  // Only a return path.
  EXPECT_EQ(axis_travel(plan, begin, 2).from(begin).axis, 1u);
}

}  // namespace
}  // namespace cellcal::calib
