// Spheres away from their stated places, or anywhere in a box.

#include "calib/plan/finder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "calib/files/files.h"
#include "calib/model/linear.h"
#include "calib/plan/pool.h"
#include "calib/plan/touch_sequence.h"
#include "calib/plan/track.h"
#include "tests/calib/plan/find_drive.h"
#include "tests/calib/simulate.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

using Eigen::Vector3d;
using testing::as_rough_as_stated;
using testing::demo_cell;
using testing::Found;
using testing::search;

Found drive(const Cell& cell, const sim::Truth& truth, bool all) {
  const Found found = testing::drive(cell, truth, all, cell.targets.size());
  EXPECT_FALSE(found.began_inside) << "a search begins inside the sphere";
  EXPECT_TRUE(found.done);
  return found;
}

/// Touches planned on the places found meet the spheres, none of them in the first millimetre. (The
/// distance from the true places is less relevant: the place as seen by the nominal arm counts.)
void expect_planned_touches_meet(const Found& found, const sim::Truth& truth) {
  PlanOptions options;
  options.fit_touches = 32;
  options.check_touches = 0;
  const ArmModel nominal(found.cell.robot, found.cell.tool);
  for (const PlannedTouch& touch : make_plan(found.cell, options).touches) {
    const auto met = search(found.cell, truth, touch);
    ASSERT_TRUE(met) << touch.target;
    const double travel = (nominal.nominal_tcp(met->joint_rad).translation() -
                           nominal.nominal_tcp(touch.standoff).translation())
                              .norm();
    EXPECT_GT(travel, 0.001) << touch.target;
  }
}

/// Errors of the cell file of up to 10 mm.
Cell rough(unsigned seed) {
  Cell cell = demo_cell();
  Random random(seed);
  for (Target& target : cell.targets) {
    Vector3d off(random.normal(), random.normal(), random.normal());
    target.centre_m += random.uniform(0.004, 0.010) * off.normalized();
    target.centre_sigma_m = 0.005;
  }
  return cell;
}

TEST(Finder, FindsSpheresWhoseCentresAreRoughWellEnoughToPlanOn) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const sim::Truth truth = testing::plain_truth(demo_cell(), seed);
    const Found found = drive(rough(seed), truth, true);
    expect_planned_touches_meet(found, truth);
    EXPECT_LE(found.touches, 4 * 9);
    EXPECT_LE(found.misses, 4 * 4);
    EXPECT_GT(found.nearest.tip_m, 0.003) << "the tip met a sphere where it did not search";
    EXPECT_GT(found.nearest.shaft_m, 0.0) << "the shaft met a sphere";
  }
}

class FindingTest : public ::testing::TestWithParam<int> {};

TEST_P(FindingTest, NeedsNoBetterCentresThanTheirSigmaSays) {
  const double sigma_m = GetParam() * 1e-3;
  // Particles within a sphere's size differ little.
  const unsigned most = GetParam() <= 10 ? 1 : GetParam() <= 15 ? 2 : 3;
  for (const Cell* cell : {&demo_cell(), &testing::small_cell()})
    for (unsigned seed = 1; seed <= most; ++seed) {
      SCOPED_TRACE(cell->robot.name + ", seed " + std::to_string(seed));
      const sim::Truth truth = testing::plain_truth(*cell, seed);
      Found found;
      try {
        found = drive(as_rough_as_stated(*cell, sigma_m, seed), truth, true);
      } catch (const PlanError& error) {
        ADD_FAILURE() << error.what();
        continue;
      }
      std::printf("%s, sigma %d mm: %d touches, %d misses\n", cell->robot.name.c_str(), GetParam(),
                  found.touches, found.misses);
      EXPECT_LE(found.touches, 4 * 7) << "the same side is touched again and again";
      EXPECT_GT(found.nearest.tip_m, 0.003) << "the tip met a sphere where it did not search";
      EXPECT_GT(found.nearest.shaft_m, 0.0) << "the shaft met a sphere";
    }
}

INSTANTIATE_TEST_SUITE_P(With, FindingTest, ::testing::Values(5, 10, 15, 20));

struct SmallSphere {
  int diameter_mm, sigma_mm;
  double tip_radius_m;
};
class SmallSphereSearch : public ::testing::TestWithParam<SmallSphere> {};

TEST_P(SmallSphereSearch, IsFoundByTouchesFromAllSides) {
  const auto [diameter_mm, sigma_mm, tip_radius_m] = GetParam();
  for (unsigned seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Cell cell = testing::table_cell(diameter_mm * 1e-3, tip_radius_m, seed);
    const sim::Truth truth = testing::plain_truth(cell, seed);
    try {
      const Found found =
          testing::drive(as_rough_as_stated(cell, sigma_mm * 1e-3, seed), truth, true, 1);
      std::printf("%d mm, sigma %d mm: %d touches, %d misses\n", diameter_mm, sigma_mm,
                  found.touches, found.misses);
      EXPECT_TRUE(found.done);
      EXPECT_FALSE(found.began_inside);
      EXPECT_GT(found.nearest.tip_m, 0.003) << "the tip met a sphere where it did not search";
      EXPECT_GT(found.nearest.shaft_m, 0.0) << "the shaft met a sphere";
    } catch (const PlanError& error) {
      ADD_FAILURE() << error.what();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Of, SmallSphereSearch,
                         ::testing::Values(SmallSphere{40, 5, 0.0}, SmallSphere{40, 10, 0.003},
                                           SmallSphere{20, 5, 0.0}));

/// Spheres of 60 and 25 mm.
Cell large_cell() {
  Cell cell = testing::table_cell(0.06, 0.002, 0);
  cell.robot = load_robot(std::filesystem::path(CELLCAL_ROBOTS_FOLDER) / "kr210_r2700_2.toml");
  const Vector3d places[] = {
      {1.75, -0.60, 0.60}, {1.70, 0.70, 0.70}, {1.10, -1.30, 0.90}, {1.20, 1.25, 1.00}};
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    cell.targets[t].centre_m = places[t];
    if (t % 2 == 1) cell.targets[t].diameter_m = 0.025;
  }
  return cell;
}

TEST(Finder, TakesTheErrorOfALargeArmFromItsTolerances) {
  EXPECT_EQ(arm_sigma_m(demo_cell()), kLeastArmSigmaM);
  EXPECT_EQ(arm_sigma_m(testing::table_cell(0.06, 0.0, 0)), kLeastArmSigmaM);
  EXPECT_EQ(found_sigma_m(kLeastArmSigmaM), 0.0025);
  Cell large = large_cell();
  EXPECT_NEAR(arm_sigma_m(large), 0.0032, 1e-4);
  EXPECT_NEAR(found_sigma_m(arm_sigma_m(large)), 0.0040, 2e-4);
  for (Joint& joint : large.robot.joints) joint.tolerance_length_m = 1.0;
  EXPECT_NEAR(arm_sigma_m(large), 0.0044, 1e-4);
}

TEST(Finder, FindsSmallSpheresWithALargeArm) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Cell cell = large_cell();
    const sim::Truth truth = testing::plain_truth(cell, seed);
    try {
      const Found found = drive(as_rough_as_stated(cell, 0.010, seed), truth, true);
      std::printf("KR 210: %d touches, %d misses\n", found.touches, found.misses);
    } catch (const PlanError& error) {
      ADD_FAILURE() << error.what();
    }
  }
}

TEST(Finder, ThatGivesUpLeadsToWhereAnotherCanBegin) {
  const Cell small = testing::table_cell(0.04, 0.0, 0);
  const sim::Truth truth = testing::plain_truth(small, 1);
  const Cell cell = as_rough_as_stated(small, 0.005, 1);
  Finder first(cell, {}, true, {});
  EXPECT_TRUE(first.way_home({}).empty()) << "nothing was searched yet";
  JointVector at(6, 0.0);
  at[1] = -1.2, at[2] = 1.6, at[4] = 1.0;
  for (int k = 0; k < 4; ++k) {
    const auto line = first.next(at);
    ASSERT_TRUE(line);
    at = line->clear;
    const auto touch = search(cell, truth, *line);
    if (touch)
      first.touched(*touch);
    else
      first.missed();
  }
  const auto home = first.way_home(at);
  ASSERT_FALSE(home.empty());
  JointVector elsewhere = at;
  elsewhere[0] += 0.01;
  EXPECT_TRUE(first.way_home(elsewhere).empty());
  EXPECT_TRUE(Finder(cell, {}, true, {}).next(home.back()));
}

TEST(TouchSequence, ThatOnlyFindsForeseesItsTouches) {
  const sim::Truth truth = testing::plain_truth(demo_cell(), 1);
  const Cell cell = rough(1);
  TouchSequenceOptions options;
  options.only_find = options.find = true;
  TouchSequence sequence(cell, options, {});
  JointVector at(6, 0.0);
  at[1] = -1.2, at[2] = 1.6, at[4] = 1.0;
  int made = 0;
  const int foreseen = sequence.progress().touches_left;
  while (const auto line = sequence.next(at, false)) {
    EXPECT_GE(sequence.progress().touches_left, 1);
    at = line->clear;
    if (const auto touch = search(cell, truth, *line)) {
      ++made;
      sequence.touched(*touch);
    } else {
      sequence.failed(NotMade::kMissed);
    }
  }
  EXPECT_EQ(sequence.progress().touches_left, 0);
  EXPECT_NEAR(foreseen, made, 8);
}

TEST(Finder, FindsASphereSomewhereInABox) {
  Cell cell = demo_cell();
  const sim::Truth truth = testing::plain_truth(cell, 2);
  Target& target = cell.targets[0];
  target.has_box = true;
  target.low_m = truth.centre_m[0] - Vector3d(0.055, 0.01, 0.03);
  target.high_m = truth.centre_m[0] + Vector3d(0.015, 0.06, 0.02);
  target.has_centre = false;
  target.centre_m.setZero();
  cell.lengths.clear();
  const Found found = drive(cell, truth, false);
  EXPECT_GT(found.nearest.tip_m, 0.003);
  EXPECT_GT(found.nearest.shaft_m, 0.0);
  EXPECT_TRUE(found.cell.targets[0].has_centre);
  expect_planned_touches_meet(found, truth);
}

TEST(Finder, MakesNoSearchesThatStayShortOfTheSphere) {
  Cell cell = demo_cell();
  Target& target = cell.targets[0];
  target.has_box = true;
  target.low_m = Vector3d(1.05, -0.34, 0.31);
  target.high_m = Vector3d(1.11, -0.30, 0.35);
  target.has_centre = false;
  target.centre_m.setZero();
  cell.lengths.clear();
  int misses = 0;
  constexpr int kArms = 8;
  for (unsigned seed = 1; seed <= kArms; ++seed)
    misses += drive(cell, testing::plain_truth(demo_cell(), seed), false).misses;
  std::printf("%.1f searches met nothing\n", static_cast<double>(misses) / kArms);
  EXPECT_LE(misses, kArms);
}

TEST(Finder, LeavesSpheresAloneWhoseCentresAreStated) {
  EXPECT_TRUE(Finder(demo_cell(), {}, false, {}).done());
  EXPECT_FALSE(Finder(demo_cell(), {}, true, {}).done());
}

TEST(Finder, SaysWhichSphereIsNotThere) {
  const sim::Truth truth = testing::plain_truth(demo_cell(), 2);
  Cell cell = demo_cell();
  cell.targets[1].centre_m.y() += 0.12;
  cell.targets[1].centre_sigma_m = 0.004;
  const auto error = testing::thrown<PlanError>([&] { drive(cell, truth, true); });
  EXPECT_EQ(error.kind, PlanError::Kind::kNotFound);
  EXPECT_EQ(error.target, "S2");
  EXPECT_EQ(std::string(error.what()).find("sphere S2 was not found after"), 0U) << error.what();
}

TEST(Finder, RefusesASphereOfWhichNothingIsKnown) {
  Cell cell = demo_cell();
  cell.targets[0].has_centre = false;
  const auto error = testing::thrown<PlanError>([&] { Finder(cell, {}, false, {}); });
  EXPECT_EQ(error.kind, PlanError::Kind::kCell);
  EXPECT_EQ(error.target, cell.targets[0].id);
}

TEST(Finder, GoesOnWithTheTouchesOfASessionThatWasInterrupted) {
  const sim::Truth truth = testing::plain_truth(demo_cell(), 1);
  const Cell cell = rough(1);
  Finder first(cell, {}, true, {});
  std::vector<Touch> made;
  JointVector at(6, 0.0);
  at[1] = -1.2, at[2] = 1.6, at[4] = 1.0;
  while (made.size() < 8) {
    const auto line = first.next(at);
    ASSERT_TRUE(line);
    at = line->clear;
    if (const auto touch = search(cell, truth, *line)) {
      made.push_back(*touch);
      first.touched(*touch);
    } else {
      first.missed();
    }
  }
  Finder second(cell, {}, true, made);
  EXPECT_NEAR((second.located().targets[0].centre_m - first.located().targets[0].centre_m).norm(),
              0.0, 1e-3);
  EXPECT_EQ(second.next(at)->target, first.next(at)->target);
}

TEST(TouchSequence, LeadsOutOfThePlateThatTheTipTouches) {
  Cell cell = demo_cell();
  cell.tool.tip_radius_m = 0.003;
  Target plate;
  plate.id = "P";
  plate.kind = TargetKind::kPlane;
  plate.has_centre = plate.has_normal = true;
  plate.centre_m = {0.95, 0.05, 0.25};
  plate.normal = Eigen::Vector3d(-0.3, 0.1, 1.0).normalized();
  plate.normal_sigma_rad = 0.02;
  plate.extent_m = 0.2;
  cell.targets.push_back(plate);
  TouchSequenceOptions options;
  const ArmModel arm = planning_arm(cell);
  const Plan plan = make_plan(cell, options.plan);
  const auto touch = std::find_if(plan.touches.begin(), plan.touches.end(),
                                  [](const PlannedTouch& t) { return t.target == "P"; });
  ASSERT_NE(touch, plan.touches.end());
  const auto above = [&](const JointVector& q) {
    return (arm.nominal_tip_m(q) - plate.centre_m).dot(plate.normal) - cell.tool.tip_radius_m;
  };
  TouchSequence sequence(cell, options, {});
  // Slightly inside the nominal plate, as possible for an inaccurate arm.
  JointVector at = touch->standoff;
  const double share = 0.52;
  for (std::size_t i = 0; i < at.size(); ++i) at[i] += share * (touch->end[i] - touch->standoff[i]);
  EXPECT_LT(above(at), 0.0);
  const auto next = sequence.next(at, true);
  ASSERT_TRUE(next);
  ASSERT_GE(next->transit.size(), 2U);
  EXPECT_NEAR(above(next->transit.front()), options.plan.clear_m, 1e-6);
}

TEST(TouchSequence, ThatWasInterruptedInContactWhileItFindsLeadsOutByItself) {
  const sim::Truth truth = testing::plain_truth(demo_cell(), 3);
  const Cell cell = rough(3);
  TouchSequenceOptions options;
  options.find = true;
  Finder finder(cell, options.plan, true, {});
  const ArmModel& real = truth.arm;
  std::vector<Touch> made;
  JointVector at(6, 0.0);
  at[1] = -1.2, at[2] = 1.6, at[4] = 1.0;
  int led_out = 0, contacts = 0;
  for (int k = 0; k < 16; ++k) {
    const auto line = finder.next(at);
    if (!line) break;
    at = line->clear;
    const auto touch = search(cell, truth, *line);
    if (!touch) {
      finder.missed();
      continue;
    }
    ++contacts;
    // Before the touch was recorded, and after.
    for (const bool known : {false, true}) {
      std::vector<Touch> before = made;
      if (known) before.push_back(*touch);
      TouchSequence again(cell, options, before);
      std::optional<PlannedTouch> next;
      try {
        next = again.next(touch->joint_rad, true);
      } catch (const PlanError& error) {
        EXPECT_EQ(error.kind, PlanError::Kind::kArmStands) << error.what();
        continue;
      }
      ASSERT_TRUE(next);
      ++led_out;
      const JointVector& out = next->transit.front();
      const std::size_t target = cell.target_index(touch->target);
      double gap = 0.0;
      constexpr int kSteps = 20;
      for (int s = 1; s <= kSteps; ++s) {
        JointVector q(out.size());
        for (std::size_t i = 0; i < q.size(); ++i)
          q[i] = touch->joint_rad[i] + (out[i] - touch->joint_rad[i]) * s / kSteps;
        const double now =
            (real.position(real.prepare(q), truth.errors.data()) - truth.centre_m[target]).norm() -
            truth.radius_m[target];
        EXPECT_GT(now, gap - 1e-5) << k << " " << s;
        gap = now;
      }
      EXPECT_GT(gap, 0.008);
    }
    made.push_back(*touch);
    finder.touched(*touch);
  }
  std::printf("%d of %d left by themselves\n", led_out, 2 * contacts);
  EXPECT_GE(contacts, 8);
  EXPECT_GE(led_out, 3 * contacts / 2);  // the others require jogging
}

TEST(TouchSequence, ThatWasInterruptedInContactElsewhereWhileItFindsHasToBeJogged) {
  TouchSequenceOptions options;
  options.find = true;
  TouchSequence sequence(rough(3), options, {});
  JointVector at(6, 0.0);
  at[1] = -1.2, at[2] = 1.6, at[4] = 1.0;  // no known object there
  EXPECT_EQ(testing::thrown<PlanError>([&] { (void)sequence.next(at, true); }).kind,
            PlanError::Kind::kArmStands);
  EXPECT_TRUE(sequence.next(at, false));
}

TEST(TouchSequence, InContactOutsideOfWhereTheSphereIsStatedLeadsFartherOut) {
  Cell cell = demo_cell();
  cell.lengths.clear();
  Target& sought = cell.targets[3];  // so that no plan of all touches is made
  sought.has_centre = false;
  sought.has_box = true;
  sought.low_m = sought.centre_m.array() - 0.01;
  sought.high_m = sought.centre_m.array() + 0.01;
  const ArmModel arm = planning_arm(cell);
  JointVector at(6, 0.0);
  at[1] = -1.2, at[2] = 1.6, at[4] = 1.0;  // the tool points down
  constexpr double kOutsideM = 0.025;
  Target& touched = cell.targets[0];
  const double radius = touched.diameter_m / 2.0;
  touched.centre_m = arm.nominal_tip_m(at) - (radius + kOutsideM) * Vector3d::UnitZ();
  const TouchSequenceOptions options;
  const auto next = TouchSequence(cell, options, {}).next(at, true);
  ASSERT_TRUE(next);
  const Vector3d out = arm.nominal_tip_m(next->transit.front()) - touched.centre_m;
  EXPECT_GT(out.norm() - radius, kOutsideM + options.plan.clear_m - 1e-6);
}

TEST(TouchSequence, FindsTheSpheresAndThenTouchesThemToTheGoal) {
  const sim::Truth truth = testing::plain_truth(demo_cell(), 1);
  const Cell cell = rough(1);
  TouchSequenceOptions options;
  options.plan.check_touches = 3;
  options.goal = {.u95_m = 0.6e-3};
  options.find = true;
  TouchSequence sequence(cell, options, {});
  JointVector at(6, 0.0);
  at[1] = -1.2, at[2] = 1.6, at[4] = 1.0;
  int found = 0, all = 0, checks = 0;
  while (const auto line = sequence.next(at, false)) {
    at = line->clear;
    found += line->may_miss;
    checks += line->set == TouchSet::kCheck;
    auto touch = search(cell, truth, *line);
    if (touch) {
      ++all;
      touch->set = line->set;
      sequence.touched(*touch);
    } else {
      sequence.failed(NotMade::kMissed);
    }
    EXPECT_EQ(sequence.progress().finding, sequence.stage().id() == "say.stage.finding")
        << words(sequence.stage());
  }
  EXPECT_TRUE(sequence.progress().done);
  EXPECT_LE(sequence.progress().u95_m, 0.6e-3);
  EXPECT_GE(found, 24);
  EXPECT_EQ(checks, 3);
  EXPECT_EQ(sequence.progress().touches + checks, all);
  EXPECT_FALSE(sequence.way_home(at).empty());
}

}  // namespace
}  // namespace cellcal::calib
