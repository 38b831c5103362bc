// The plan on the page, and its picture as a document of its own.

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "calib/files/files.h"
#include "calib/model/kinematics.h"
#include "daemon/report/plan_picture.h"
#include "tests/daemon/report/fixture.h"
#include "tests/daemon/report/html_checker.h"

namespace cellcal::daemon::report {
namespace {

using testing::complaints;
using testing::made_up_session;
using testing::occurrences;
using testing::says;
using testing::section_of;

/// Touches of two spheres from above; the position of the arm is irrelevant.
calib::Plan small_plan(const calib::Cell& cell) {
  calib::Plan plan;
  plan.start = calib::JointVector(cell.robot.joints.size(), 0.0);
  for (int k = 0; k < 6; ++k) {
    calib::PlannedTouch touch;
    touch.target = cell.targets[k < 4 ? 0 : 1].id;
    touch.set = k == 3 ? calib::TouchSet::kCheck : calib::TouchSet::kFit;
    touch.standoff = touch.end = touch.clear = plan.start;
    touch.transit = {touch.standoff};
    touch.search_m = 0.024;
    touch.expected_m = 0.012;
    plan.touches.push_back(touch);
  }
  plan.predicted_mean_m = 0.0814e-3;
  plan.predicted_u95_m = 0.2468e-3;
  return plan;
}

ReportInput session_with_plan() {
  ReportInput input = made_up_session();
  for (std::size_t t = 0; t < input.calibration.cell.targets.size(); ++t) {
    calib::Target& target = input.calibration.cell.targets[t];
    target.has_centre = true;
    target.centre_m = {1.0, 0.3 * static_cast<double>(t) - 0.4, 0.5};
  }
  input.plan = small_plan(input.calibration.cell);
  input.planned_s = 252.0;
  return input;
}

TEST(PlanScene, HasAPositionerAtZeroAndItsTouchesAsSeenFromThere) {
  ReportInput input = session_with_plan();
  calib::Cell cell = input.calibration.cell;
  calib::Plan plan = *input.plan;
  const PlanScene floor = scene_of(cell, plan);
  EXPECT_TRUE(floor.axles.empty());
  cell.robot.positioner.resize(1);
  calib::PositionerAxis& axis = cell.robot.positioner[0];
  axis.name = "E1";
  axis.frame.translation() = Eigen::Vector3d(1.0, 0.0, 0.2);
  cell.targets[0].carried_by = 1;
  cell.targets[0].centre_m = {0.1, 0.2, 0.3};
  for (calib::PlannedTouch& touch : plan.touches) touch.positioner_rad = {0.5};
  const PlanScene scene = scene_of(cell, plan);
  ASSERT_EQ(scene.axles.size(), 1u);
  EXPECT_EQ(scene.axles[0].id, "E1");
  EXPECT_LT(
      (0.5 * (scene.axles[0].a + scene.axles[0].b) - Eigen::Vector3d(1000.0, 0.0, 200.0)).norm(),
      1e-9);
  EXPECT_LT((scene.balls[0].centre - Eigen::Vector3d(1100.0, 200.0, 500.0)).norm(), 1e-9);
  EXPECT_EQ(scene.balls[1].centre, floor.balls[1].centre);
  // The arm touched it with the axis half a radian further.
  const Eigen::AngleAxisd back(-0.5, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d middle(1000.0, 0.0, 200.0);
  EXPECT_LT((scene.approaches[0].contact - (middle + back * (floor.approaches[0].contact - middle)))
                .norm(),
            1e-9);
  EXPECT_EQ(scene.approaches[4].contact, floor.approaches[4].contact);
  EXPECT_TRUE(says(plan_svg(cell, plan), ">E1</text>"));
  plan.touches[0].positioner_rad.clear();
  EXPECT_THROW(scene_of(cell, plan), std::invalid_argument);
}

TEST(PlanSection, IsThereOnlyWhereTouchesWerePlanned) {
  ReportInput input = session_with_plan();
  EXPECT_FALSE(section_of(html_report(input), "plan").empty());
  input.plan.reset();
  EXPECT_TRUE(section_of(html_report(input), "plan").empty());
}

TEST(PlanSection, SaysHowManyTouchesWhatTheyPromisedAndHowLongTheyTake) {
  const std::string html = section_of(html_report(session_with_plan()), "plan");
  EXPECT_TRUE(says(html, "5 touches for the fit and 1 held out"));
  EXPECT_TRUE(says(html, "4.2&nbsp;min of robot time"));
  EXPECT_TRUE(says(html, "0.081"));
  EXPECT_TRUE(says(html, "0.247"));
  EXPECT_TRUE(says(html, "Predicted before the first touch"));
}

TEST(PlanSection, NamesWhatWasPlannedOfEachTargetAndWhatWasMade) {
  const ReportInput input = session_with_plan();
  const std::string& first = input.calibration.cell.targets[0].id;
  const auto made = std::count_if(input.touches.begin(), input.touches.end(),
                                  [&](const calib::Touch& t) { return t.target == first; });
  EXPECT_TRUE(says(section_of(html_report(input), "plan"), "<th scope=\"row\">" + first +
                                                               "</th><td>3</td><td>1</td><td>" +
                                                               std::to_string(made) + "</td>"));
}

TEST(PlanSection, IsSoundMarkupWithAPictureOfEveryTouchInBothViews) {
  const std::string html = html_report(session_with_plan());
  EXPECT_TRUE(complaints(html).empty()) << complaints(html).front();
  const std::string plan = section_of(html, "plan");
  EXPECT_EQ(occurrences(plan, "class=\"begin fit\""), 10U);
  EXPECT_EQ(occurrences(plan, "class=\"begin check\""), 2U);
}

TEST(PlanSection, PromisesNothingThatWasNotPredicted) {
  ReportInput input = session_with_plan();
  input.plan->predicted_mean_m = input.plan->predicted_u95_m = 0.0;
  EXPECT_FALSE(says(section_of(html_report(input), "plan"), "Predicted before"));
}

TEST(PlanSection, SaysThatAPlanOfAnotherRobotCannotBeDrawn) {
  ReportInput input = session_with_plan();
  input.plan->start.pop_back();
  EXPECT_TRUE(says(section_of(html_report(input), "plan"), "cannot be drawn"));
}

TEST(PlanSection, StaysSoundWhateverTheNumbersAndNamesAre) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300}) {
    ReportInput input = session_with_plan();
    calib::Cell& cell = input.calibration.cell;
    cell.targets[0].centre_m.x() = bad;
    cell.targets[1].diameter_m = bad;
    cell.robot.joints[0].max_rad = bad;
    cell.floor_m = bad;
    calib::Obstacle box;
    box.id = "<script>alert(1)</script>";
    box.size_m = {bad, 0.1, 0.1};
    cell.obstacles = {box};
    input.plan->touches[0].normal.setConstant(bad);
    input.plan->touches[1].standoff[2] = bad;
    const std::string html = html_report(input);
    EXPECT_TRUE(complaints(html).empty()) << complaints(html).front();
  }
}

TEST(PlanPicture, IsADocumentOfItsOwnThatNeedsNoCssVariables) {
  const calib::Cell cell = session_with_plan().calibration.cell;
  const std::string svg = plan_svg(cell, small_plan(cell));
  EXPECT_TRUE(svg.starts_with("<?xml version=\"1.0\""));
  EXPECT_EQ(occurrences(svg, "xmlns=\"http://www.w3.org/2000/svg\""), 1U);
  EXPECT_EQ(occurrences(svg, "<svg"), 3U);
  EXPECT_EQ(occurrences(svg, "</svg>"), 3U);
  EXPECT_EQ(svg.find("var("), std::string::npos);
  EXPECT_NE(svg.find("svg .approach.fit { stroke: #0a5fa8;"), std::string::npos);
  EXPECT_NE(svg.find("5 touches for the fit, 1 held out"), std::string::npos);
  for (const calib::Target& target : cell.targets)
    EXPECT_GE(occurrences(svg, ">" + target.id + ":"), 2U) << target.id;
}

TEST(PlanPicture, ShowsObstaclesWithinReachAndTheFloor) {
  calib::Cell cell = session_with_plan().calibration.cell;
  cell.floor_m = -0.2;
  calib::Obstacle box;
  box.id = "table & chair";
  box.size_m = {0.5, 0.5, 0.1};
  box.frame.translation() = Eigen::Vector3d(0.8, 0.0, 0.1);
  cell.obstacles = {box};
  const std::string svg = plan_svg(cell, small_plan(cell));
  EXPECT_EQ(occurrences(svg, ">table &amp; chair<"), 2U);
  EXPECT_EQ(occurrences(svg, ">floor<"), 1U);
}

TEST(PlanPicture, ThrowsForAPlanOfAnotherRobot) {
  const calib::Cell cell = session_with_plan().calibration.cell;
  calib::Plan plan = small_plan(cell);
  plan.touches[2].standoff.push_back(0.0);
  EXPECT_THROW((void)plan_svg(cell, plan), std::exception);
}

TEST(Reach, HoldsTheTipInEveryPostureInsideTheLimits) {
  const calib::Cell cell = calib::load_cell(CELLCAL_DEMO_CELL);
  const calib::ArmModel arm(cell.robot, cell.tool);
  const auto outline = reach_of(cell, 0, 2);
  ASSERT_GE(outline.size(), 10U);
  std::mt19937 engine(5);
  double furthest = 0.0;
  for (int k = 0; k < 3000; ++k) {
    calib::JointVector q;
    for (const calib::Joint& joint : cell.robot.joints)
      q.push_back(joint.min_rad + (joint.max_rad - joint.min_rad) * static_cast<double>(engine()) /
                                      std::mt19937::max());
    const Eigen::Vector3d tip = 1e3 * arm.nominal_tip_m(q);
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Eigen::Vector2d a = outline[i], side = outline[(i + 1) % outline.size()] - a;
      const Eigen::Vector2d outward = Eigen::Vector2d(side.y(), -side.x()).normalized();
      furthest = std::max(furthest, outward.dot(Eigen::Vector2d(tip.x(), tip.z()) - a));
    }
  }
  EXPECT_LT(furthest, 10.0);  // mm; straight sides between the corners of a rounded outline
}

TEST(Outline, GoesRoundThePointsAndLeavesOutWhatLiesWithin) {
  const auto square = outline_of({{0, 0}, {1, 1}, {1, 0}, {0.5, 0.5}, {0, 1}, {0.5, 0.0}, {1, 1}});
  ASSERT_EQ(square.size(), 4U);
  double area = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto &a = square[i], &b = square[(i + 1) % 4];
    area += 0.5 * (a.x() * b.y() - a.y() * b.x());
  }
  EXPECT_DOUBLE_EQ(area, 1.0);  // counter-clockwise
  EXPECT_EQ(outline_of({{1, 1}, {1, 1}}).size(), 1U);
}

}  // namespace
}  // namespace cellcal::daemon::report
