// Spheres located on a stationary positioner, and by an arm on a linear unit.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "calib/model/error.h"
#include "calib/model/kinematics.h"
#include "calib/plan/centre_particles.h"
#include "calib/plan/clearance.h"
#include "calib/plan/pool.h"
#include "calib/plan/positioner_plan.h"
#include "calib/plan/touch_sequence.h"
#include "calib/plan/track.h"
#include "sim/cell/truth.h"
#include "tests/calib/plan/find_drive.h"
#include "tests/calib/positioner_cell.h"
#include "tests/calib/track_cell.h"

namespace cellcal::calib {
namespace {

using Eigen::Vector3d;
using testing::Found;

const std::vector<double> kTurned = {0.35, -0.9};

sim::Truth truth_of(const Cell& cell, unsigned seed) {
  sim::TruthOptions options;
  options.seed = seed;
  return sim::draw_truth(cell, options);
}

/// As stiff as a real arm of this size; the experiments' arms are softer.
Cell stiff(Cell cell) {
  for (Joint& joint : cell.robot.joints) joint.compliance_sigma_rad_per_nm *= 0.1;
  return cell;
}

Cell table() { return stiff(testing::positioner_cell(CELLCAL_POSITIONER_ROBOT)); }

/// Inaccurate centres in the file, on table and floor; the second sphere is known by a box in its frame.
Cell rough_on_table(const Cell& taught, unsigned seed) {
  Cell cell = testing::as_rough_as_stated(taught, 0.006, seed);
  Target& boxed = cell.targets[1];
  boxed.has_centre = false;
  boxed.has_box = true;
  boxed.low_m = taught.targets[1].centre_m - Vector3d(0.02, 0.03, 0.012);
  boxed.high_m = taught.targets[1].centre_m + Vector3d(0.03, 0.015, 0.015);
  cell.lengths.clear();
  return cell;
}

TouchSequenceOptions only_find() {
  TouchSequenceOptions options;
  options.find = options.only_find = true;
  return options;
}

/// Centre as seen by the nominal arm: its tip with the true tip at the centre, to first order.
Vector3d seen_m(const Cell& cell, const sim::Truth& truth, std::size_t target,
                const JointVector& near, const std::vector<double>& positioner_rad) {
  const ArmModel nominal(at_setting(cell, positioner_rad));
  const auto carrier =
      std::span(positioner_rad).first(static_cast<std::size_t>(cell.targets[target].carried_by));
  const Eigen::Isometry3d place = carried_at(cell.robot, carrier);
  const Vector3d tip = nominal.nominal_tcp(near).translation();
  const Vector3d true_tip =
      truth.arm.position(truth.arm.prepare(near, 0, nullptr, carrier), truth.errors.data());
  // The arm's errors hardly change over the radius of the sphere.
  return place.inverse() * tip + (truth.centre_m[target] - true_tip);
}

TEST(FindOnPositioner, FindsSpheresOnTheTurnedTableAndOnTheFloorInTheFramesTheyStandOn) {
  const Cell taught = table();
  for (const unsigned seed : {1u, 2u}) {
    const sim::Truth truth = truth_of(taught, seed);
    const Cell cell = rough_on_table(taught, seed);
    const Found found = testing::drive(cell, truth, true, cell.targets.size(), kTurned);
    ASSERT_TRUE(found.done);
    EXPECT_FALSE(found.began_inside);
    EXPECT_GT(found.nearest.tip_m, 0.003);
    EXPECT_GT(found.nearest.shaft_m, 0.0);
    EXPECT_EQ(found.cell.robot.positioner.size(), 2u);
    for (std::size_t t = 0; t < cell.targets.size(); ++t) {
      const Target& target = found.cell.targets[t];
      const auto touch = std::ranges::find(found.made, target.id, &Touch::target);
      ASSERT_NE(touch, found.made.end());
      EXPECT_EQ(target.carried_by, cell.targets[t].carried_by);
      EXPECT_EQ(target.taught_rad, target.carried_by > 0 ? kTurned : std::vector<double>());
      const double off_m =
          (target.centre_m - seen_m(cell, truth, t, touch->joint_rad, kTurned)).norm();
      EXPECT_LT(off_m, 3.0 * found_sigma_m(kLeastArmSigmaM)) << target.id;
    }
    std::printf("seed %u: %d touches, %d misses\n", seed, found.touches, found.misses);
  }
}

TEST(FindOnPositioner, EverySearchLeavesItWhereItStands) {
  const Cell taught = table();
  TouchSequence sequence(rough_on_table(taught, 1), only_find(), {});
  const JointVector rest = waiting_posture(taught);
  std::vector<double> stands = kTurned;
  const auto first = sequence.next(rest, false, stands);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->positioner_rad, kTurned);
  EXPECT_TRUE(first->wait.empty());
  stands[1] += 0.001;  // as the controller left it
  EXPECT_EQ(sequence.next(rest, false, stands)->positioner_rad, stands);
}

TEST(FindOnPositioner, AnAxisThatRestsAtTheEndOfItsRangeIsNotCommandedBeyond) {
  Cell cell = rough_on_table(table(), 1);
  cell.robot.positioner[0].min_rad = kTurned[0];
  TouchSequence sequence(cell, only_find(), {});
  const auto line = sequence.next(waiting_posture(cell), false, {kTurned[0] - 1e-6, kTurned[1]});
  ASSERT_TRUE(line);
  EXPECT_EQ(line->positioner_rad, kTurned);
}

TEST(FindOnPositioner, TouchesAtAnotherSettingCount) {
  const Cell taught = table();
  const sim::Truth truth = truth_of(taught, 1);
  const Cell cell = rough_on_table(taught, 1);
  const Found found = testing::drive(cell, truth, true, cell.targets.size(), kTurned);
  const Finder again(cell, {}, true, found.made, {0.0, 0.5});
  EXPECT_TRUE(again.done());
  const Cell located = again.located();
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    EXPECT_LT((located.targets[t].centre_m - found.cell.targets[t].centre_m).norm(), 1e-4);
    EXPECT_EQ(located.targets[t].taught_rad, found.cell.targets[t].taught_rad);
  }
  EXPECT_GT(again.here().targets[0].off_m, 1e-3) << "it has turned since";
  EXPECT_LT(Finder(cell, {}, true, found.made, kTurned).here().targets[0].off_m, 1e-12);
}

TEST(FindOnPositioner, ThePlanBehindItKnowsAtWhichAnglesTheyWereFound) {
  Cell cell = table();
  const double from_zero_m = at_setting(cell, kTurned).targets[0].off_m;
  EXPECT_GT(from_zero_m, 2e-3);
  EXPECT_LT(at_setting(cell, {0.0, 0.0}).targets[0].off_m, 1e-12);
  cell.targets[0].taught_rad = kTurned;
  EXPECT_LT(at_setting(cell, kTurned).targets[0].off_m, 1e-12);
  EXPECT_NEAR(at_setting(cell, {0.0, 0.0}).targets[0].off_m, from_zero_m, 0.5 * from_zero_m);
  EXPECT_EQ(at_setting(cell, kTurned).targets[3].off_m, 0.0) << "on the floor";
}

TEST(FindOnPositioner, AnAbandonedSearchIsNotLeftByItsMovesOnceThePositionerHasTurned) {
  const Cell taught = table();
  const Cell cell = rough_on_table(taught, 1);
  TouchSequenceOptions options = only_find();
  TouchSequence first(cell, options, {});
  const JointVector rest = waiting_posture(taught);
  const auto line = first.next(rest, false, kTurned);
  options.left = first.under_way(rest, line);
  ASSERT_TRUE(options.left);
  EXPECT_EQ(options.left->way.front().size(), 8u);
  JointVector deep = line->standoff;
  for (std::size_t i = 0; i < deep.size(); ++i) deep[i] += 0.4 * (line->end[i] - deep[i]);
  const auto way_from = [&](std::vector<double> stands) {
    JointVector all = deep;
    all.insert(all.end(), stands.begin(), stands.end());
    return way_out_of(*options.left, all, false);
  };
  ASSERT_TRUE(way_from(kTurned));
  EXPECT_FALSE(way_from({0.35, -0.95}));
  TouchSequence next(cell, options, {});
  const auto onward = next.next(deep, false, kTurned);
  ASSERT_TRUE(onward);
  EXPECT_EQ(onward->transit.front().size(), 6u);
  EXPECT_EQ(onward->transit.front(), line->clear);
}

TEST(FindOnPositioner, WithoutItsAnglesNothingIsPlanned) {
  const Cell cell = table();
  EXPECT_THROW(Finder(cell, {}, true, {}, {0.1}), PlanError);
}

/// (64b): also for the margin of a path.
TEST(PositionerMargins, WaysKeepFartherFromWhatThePositionerMayHaveMoved) {
  Cell cell = table();
  Cell exact = cell;
  for (PositionerAxis& axis : exact.robot.positioner)
    axis.place_sigma_m = axis.direction_sigma_rad = axis.scale_sigma = 0.0;
  const ArmModel arm = planning_arm(at_setting(cell, kTurned));
  const double off_m = at_setting(cell, kTurned).targets[0].off_m;
  ASSERT_GT(off_m, 2e-3);
  Cell near = at_setting(exact, kTurned);
  EXPECT_EQ(near.targets[0].off_m, 0.0);
  near.targets.resize(1);
  near.lengths.clear();
  Target& sphere = near.targets[0];
  sphere.has_stand = false;
  const JointVector rest = waiting_posture(cell);
  const Eigen::Isometry3d tcp = arm.nominal_tcp(rest);
  const Vector3d ahead = tcp.linear() * cell.tool.tcp.translation().normalized();
  const auto clear_at = [&](double beyond_m, double off) {
    sphere.centre_m = tcp.translation() + beyond_m * ahead;
    sphere.off_m = off;
    return Clearance(near, arm).clear(rest);
  };
  double least_m = 0.0;  // where the tip's margin begins
  while (!clear_at(least_m, 0.0)) least_m += 1e-4;
  const double wider_m = std::hypot(kTipMarginM, off_m) - kTipMarginM;
  EXPECT_FALSE(clear_at(least_m + wider_m - 2e-4, off_m));
  EXPECT_TRUE(clear_at(least_m + wider_m + 2e-4, off_m));
}

TEST(PositionerMargins, OfAnObstacleAreThoseOfItsFarthestCorner) {
  Cell cell = table();
  Obstacle plate;
  plate.id = "plate";
  plate.carried_by = 2;
  plate.frame = Eigen::Translation3d(0.0, 0.0, -0.02);
  plate.size_m = Vector3d(0.8, 0.8, 0.02);
  cell.obstacles = {plate};
  cell.obstacles.push_back(plate);
  cell.obstacles[1].size_m = Vector3d(0.1, 0.1, 0.02);
  const Cell here = at_setting(cell, kTurned);
  EXPECT_GT(here.obstacles[0].off_m, here.obstacles[1].off_m);
  Target corner = cell.targets[0];
  corner.centre_m = Vector3d(0.4, 0.4, -0.03);
  cell.targets[0] = corner;
  EXPECT_GE(here.obstacles[0].off_m, at_setting(cell, kTurned).targets[0].off_m - 1e-12);
  EXPECT_LT(at_setting(cell, {0.0, 0.0}).obstacles[0].off_m, 1e-12);
}

TEST(FindOnTrack, FindsSpheresFromNearTheCarriagesPlaceOppositeThem) {
  Cell taught = stiff(testing::track_cell(CELLCAL_TRACK_ROBOT));
  taught.lengths.clear();
  for (const unsigned seed : {1u, 2u}) {
    const sim::Truth truth = truth_of(taught, seed);
    const Cell cell = testing::as_rough_as_stated(taught, 0.006, seed);
    const Found found = testing::drive(cell, truth, true, cell.targets.size());
    ASSERT_TRUE(found.done);
    EXPECT_FALSE(found.began_inside);
    EXPECT_GT(found.nearest.tip_m, 0.003);
    EXPECT_GT(found.nearest.shaft_m, 0.0);
    double least_m = 9.0, most_m = -9.0;
    const TrackOff unit(cell.robot);
    for (const Touch& touch : found.made) {
      const Vector3d centre_m = found.cell.targets[cell.target_index(touch.target)].centre_m;
      const TrackOff::Place place = unit.place(centre_m);
      EXPECT_LT(unit.off_m(place, touch.joint_rad[0]),
                1.1 * std::hypot(unit.off_m(place, place.opposite_m), 3.0 * kLeastArmSigmaM));
      least_m = std::min(least_m, touch.joint_rad[0]);
      most_m = std::max(most_m, touch.joint_rad[0]);
    }
    EXPECT_GT(most_m - least_m, 1.5);
    for (std::size_t t = 0; t < cell.targets.size(); ++t) {
      const auto touch = std::ranges::find(found.made, cell.targets[t].id, &Touch::target);
      const double off_m =
          (found.cell.targets[t].centre_m - seen_m(cell, truth, t, touch->joint_rad, {})).norm();
      EXPECT_LT(off_m, 4.0 * found_sigma_m(kLeastArmSigmaM)) << cell.targets[t].id;
    }
    std::printf("seed %u: %d touches, %d misses\n", seed, found.touches, found.misses);
  }
}

TEST(FindOnTrack, TheCarriageStandsDuringASearch) {
  Cell cell = testing::track_cell(CELLCAL_TRACK_ROBOT);
  Finder finder(cell, {}, true, {});
  const auto line = finder.next(middle_posture(cell.robot));
  ASSERT_TRUE(line);
  EXPECT_EQ(line->standoff[0], line->end[0]);
  EXPECT_EQ(line->standoff[0], line->clear[0]);
}

}  // namespace
}  // namespace cellcal::calib
