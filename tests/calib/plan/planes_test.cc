// Touches of planes: on the face, inside its extent, along its normal, and clear of everything
// else.

#include <gtest/gtest.h>

#include "calib/files/files.h"
#include "calib/identify/identify.h"
#include "calib/plan/candidates.h"
#include "calib/plan/pool.h"
#include "tests/calib/plan/collisions.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

/// The demo cell with a plate in front of the arm, tilted towards it.
Cell with_plate() {
  Cell cell = load_cell(CELLCAL_DEMO_CELL);
  Target plate;
  plate.id = "P";
  plate.kind = TargetKind::kPlane;
  plate.has_centre = plate.has_normal = true;
  plate.centre_m = {0.95, 0.05, 0.25};
  plate.centre_sigma_m = 0.005;
  plate.normal = Eigen::Vector3d(-0.3, 0.1, 1.0).normalized();
  plate.normal_sigma_rad = 0.02;
  plate.extent_m = 0.2;
  cell.tool.tip_radius_m = 0.003;
  cell.targets.push_back(plate);
  return cell;
}

const Plan& plate_plan() {
  static const Plan made = [] {
    PlanOptions options;
    options.fit_touches = 40;
    options.check_touches = 10;
    return make_plan(with_plate(), options);
  }();
  return made;
}

std::vector<const PlannedTouch*> of_plate(const Plan& made) {
  std::vector<const PlannedTouch*> touches;
  for (const PlannedTouch& touch : made.touches)
    if (touch.target == "P") touches.push_back(&touch);
  return touches;
}

TEST(PlannedPlane, IsTouchedOnItsFaceInsideItsExtentAlongItsNormal) {
  const Cell cell = with_plate();
  const Target& plate = cell.targets.back();
  const ArmModel arm = planning_arm(cell);
  const auto touches = of_plate(plate_plan());
  ASSERT_GE(touches.size(), 5U);
  EXPECT_TRUE(plate_plan().left_out.empty());
  double furthest = 0.0;
  for (const PlannedTouch* touch : touches) {
    EXPECT_LT((touch->normal - plate.normal).norm(), 1e-12);
    const auto outside = [&](const JointVector& q) {
      return (arm.nominal_tip_m(q) - plate.centre_m).dot(plate.normal) - cell.tool.tip_radius_m;
    };
    EXPECT_NEAR(outside(touch->standoff), 0.012, 1e-8);
    EXPECT_NEAR(outside(touch->end), -0.012, 1e-8);
    EXPECT_NEAR(outside(touch->clear), 0.020, 1e-8);
    const Eigen::Vector3d place = arm.nominal_tip_m(touch->standoff) - plate.centre_m;
    const double off = (place - place.dot(plate.normal) * plate.normal).norm();
    EXPECT_LE(off, plate.extent_m / 2.0 + 1e-8);
    furthest = std::max(furthest, off);
  }
  EXPECT_GT(furthest, 0.05);  // spread out, for its tilt
}

/// Contact of the nominal tip with the target during a search: moves are straight in joint space,
/// the tip's path is not exactly.
JointVector met(const Cell& cell, const ArmModel& arm, const PlannedTouch& planned) {
  const Target& target = cell.targets[cell.target_index(planned.target)];
  const auto outside_m = [&](const JointVector& q) {
    const Eigen::Vector3d off = arm.nominal_tip_m(q) - target.centre_m;
    return (target.kind == TargetKind::kPlane ? off.dot(target.normal)
                                              : off.norm() - target.diameter_m / 2.0) -
           cell.tool.tip_radius_m;
  };
  double out = 0.0, in = 1.0;
  JointVector q(planned.standoff.size());
  for (int k = 0; k < 40; ++k) {
    const double share = (out + in) / 2.0;
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] = planned.standoff[i] + share * (planned.end[i] - planned.standoff[i]);
    (outside_m(q) > 0.0 ? out : in) = share;
  }
  return q;
}

TEST(PlannedPlane, IsIdentifiedFromWhatWasPlanned) {
  // Nominal touches of a nominal arm: only their places can be wrong.
  const Cell cell = with_plate();
  const ArmModel arm = planning_arm(cell);
  std::vector<Touch> touches;
  for (const PlannedTouch& planned : plate_plan().touches) {
    Touch touch;
    touch.target = planned.target;
    touch.set = planned.set;
    touch.joint_rad = met(cell, arm, planned);
    touches.push_back(std::move(touch));
  }
  const Calibration calibration = identify(cell, touches);
  EXPECT_FALSE(has(calibration.verdict.findings, FindingKind::kTooFewDirections));
  const TargetResult& found = calibration.targets.back();
  ASSERT_EQ(found.id, "P");
  EXPECT_LT((found.normal - cell.targets.back().normal).norm(), 1e-4);
}

TEST(PlannedPlane, IsNotRunIntoOnTheWayToOtherTouches) {
  const Cell cell = with_plate();
  const ArmModel arm = planning_arm(cell);
  const Target& plate = cell.targets.back();
  // By the independent check, with a thin cylinder in place of the plane.
  Cell seen = cell;
  Obstacle disc;
  disc.id = "plate";
  disc.shape = ObstacleShape::kCylinder;
  disc.frame.linear() =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), plate.normal).toRotationMatrix();
  disc.frame.translation() = plate.centre_m - 0.005 * plate.normal;
  disc.diameter_m = plate.extent_m;
  disc.height_m = 0.01;
  seen.obstacles = {disc};
  Plan others = plate_plan();
  for (std::size_t k = 0; k < others.touches.size(); ++k)
    if (others.touches[k].target == "P")  // excluded: its own search lines meet it
      others.touches[k].standoff = others.touches[k].end = others.touches[k].clear;
  const testing::Approach approach = testing::Collisions(seen).of(others);
  EXPECT_GT(approach.tip.gap_m, 0.0034) << approach.tip.words;
  EXPECT_GT(approach.body.gap_m, 0.0024) << approach.body.words;
}

TEST(PlannedPlane, IsLeftOutWithTheReasonWhereItIsNotKnownHowFarItGoes) {
  Cell cell = with_plate();
  cell.targets.back().extent_m = 0.0;
  PlanOptions options;
  options.fit_touches = 20;
  options.check_touches = 0;
  EXPECT_EQ(make_plan(cell, options).left_out, std::vector<std::string>{"P"});
  EXPECT_EQ(why_not_planned(cell.targets.back()), NotPlanned::kSizeUnknown);
  cell.targets.back().kind = TargetKind::kPoint;
  EXPECT_EQ(why_not_planned(cell.targets.back()), NotPlanned::kSeated);
  EXPECT_STREQ(words(NotPlanned::kSeated), "the tip has to be seated in a point by hand");
  EXPECT_EQ(make_plan(cell, options).left_out, std::vector<std::string>{"P"});
  EXPECT_EQ(why_not_planned(cell.targets.front()), std::nullopt);
}

TEST(PlannedPlane, OutOfReachIsNamedAsAPlane) {
  Cell cell = with_plate();
  cell.targets.back().centre_m = {4.0, 0.0, 0.2};
  const auto error = testing::thrown<PlanError>([&] { (void)make_plan(cell, {}); });
  EXPECT_EQ(error.kind, PlanError::Kind::kOutOfReach);
  EXPECT_EQ(error.target, "P");
  EXPECT_EQ(std::string(error.what()).find("plane P"), 0U) << error.what();
}

}  // namespace
}  // namespace cellcal::calib
