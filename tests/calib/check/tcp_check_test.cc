// A few touches decide whether a calibration still holds, and identify the change otherwise: a knocked tool,
// a moved sphere, a slipped joint, a warm arm. Missed touches are included.

#include "calib/check/tcp_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <string>

#include "calib/check/explain.h"
#include "calib/files/calibration_json.h"
#include "calib/model/error.h"
#include "calib/plan/check_plan.h"
#include "calib/plan/duration.h"
#include "calib/result/tcp_check.h"
#include "tests/calib/check/changed_cell.h"
#include "tests/calib/plan/meet.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

using testing::calibration, testing::demo_cell, testing::knocked, testing::moved, testing::truth,
    testing::with_robot;

const Plan& plan() {
  static const Plan made = make_check_plan(calibration(), {});
  return made;
}

/// Data of a session: touches, their indices in the plan, and the missed ones.
struct Made {
  std::vector<Touch> touches;
  std::vector<std::size_t> planned;
  std::vector<MissedTouch> missed;

  TcpCheck judged(const std::vector<std::vector<Touch>>& references = {}) const {
    return check_tcp(calibration(), touches, planned, missed, references);
  }
};

Made made_by(const sim::Truth& arm, std::uint64_t seed = 1) {
  Random random(seed);
  Made made;
  for (std::size_t i = 0; i < plan().touches.size(); ++i) {
    const PlannedTouch& planned = plan().touches[i];
    if (auto met = testing::meet(demo_cell(), arm, planned, random)) {
      made.touches.push_back(met->touch);
      made.planned.push_back(i);
      continue;
    }
    MissedTouch missed{i, {}};
    missed.at_end.target = planned.target;
    missed.at_end.joint_rad = planned.end;
    made.missed.push_back(missed);
  }
  return made;
}

const PlannedTouch& first_of(const std::string& sphere) {
  return *std::ranges::find(plan().touches, sphere, &PlannedTouch::target);
}

TEST(ACheckTouch, IsResumedFromItsNearStandoffFromBeforeItAndFromItsSearch) {
  const auto halfway = [](const JointVector& from, const JointVector& to) {
    JointVector at = from;
    for (std::size_t i = 0; i < at.size(); ++i) at[i] = 0.5 * (from[i] + to[i]);
    return at;
  };
  for (std::size_t next = 0; next < plan().touches.size(); ++next) {
    const PlannedTouch& touch = plan().touches[next];
    ASSERT_GE(touch.transit.size(), 2u);
    const JointVector& far = touch.transit[touch.transit.size() - 2];
    for (const JointVector& from :
         {touch.standoff, halfway(far, touch.standoff), halfway(touch.standoff, touch.end)})
      EXPECT_NO_THROW(
          EXPECT_EQ(check_touch_from(calibration(), plan(), next, from, false).end, touch.end))
          << next;
  }
}

TEST(CheckPlan, TouchesEverySphereByClearShortSearchesWithinTwentySeconds) {
  EXPECT_GE(plan().touches.size(), 6U);
  EXPECT_LE(plan().touches.size(), 8U);
  Pace pace;
  pace.predicted_m = CheckPlanOptions{}.before_m;
  EXPECT_LE(duration_s(plan(), demo_cell().robot, pace), 20.0);
  std::set<std::string> touched;
  Random random(3);
  for (const PlannedTouch& touch : plan().touches) {
    touched.insert(touch.target);
    EXPECT_TRUE(touch.may_miss);
    const auto met = testing::meet(demo_cell(), truth(), touch, random);
    ASSERT_TRUE(met.has_value());
    // The line was planned for the calibrated arm, not for the robot file.
    EXPECT_NEAR(met->travel_m, touch.expected_m, 0.3e-3);
    EXPECT_GT(touch.expected_sigma_m, 0.0);
  }
  EXPECT_EQ(touched.size(), demo_cell().targets.size());
}

TEST(CheckPlan, IsRefusedForACalibrationThatKnowsOfNoSphere) {
  Calibration empty = calibration();
  empty.targets.clear();
  EXPECT_EQ(testing::thrown<PlanError>([&] { (void)make_check_plan(empty, {}); }).kind,
            PlanError::Kind::kCalibration);
}

TEST(TcpCheck, HoldsWhereNothingChanged) {
  const TcpCheck check = made_by(truth()).judged();
  EXPECT_TRUE(check.holds);
  EXPECT_LT(check.shift_m.norm(), 2.0 * check.u_along_m());
  EXPECT_EQ(check.explanations.front().kind, ChangeKind::kNothing);
  EXPECT_TRUE(verdict_words(check).starts_with("holds: TCP shift 0.")) << verdict_words(check);
  EXPECT_EQ(change_words(check), "");
}

TEST(TcpCheck, FindsAToolThatWasKnockedAndSaysByHowMuch) {
  const Eigen::Vector3d shift_m(0.2e-3, -0.2e-3, 0.1e-3);
  const TcpCheck check = made_by(knocked(shift_m)).judged();
  EXPECT_FALSE(check.holds);
  ASSERT_NE(check.change(), nullptr);
  EXPECT_EQ(check.change()->kind, ChangeKind::kTool);
  EXPECT_LT((check.shift_m - shift_m).norm(), 0.15e-3);
  EXPECT_GT(check.change()->probability, 0.9);
  EXPECT_EQ(check.change()->shift_m, check.shift_m) << "one shift has one size";
  EXPECT_NEAR(2.0 * check.change()->sigma, check.u_along_m(), 1e-12);
  EXPECT_NE(change_words(check).find("fastening"), std::string::npos);
}

TEST(TcpCheck, MeasuresAShiftOfMillimetresAsWell) {
  const Eigen::Vector3d shift_m(1.5e-3, 1e-3, -1e-3);
  const TcpCheck check = made_by(knocked(shift_m)).judged();
  EXPECT_FALSE(check.holds);
  EXPECT_EQ(check.change()->kind, ChangeKind::kTool);
  EXPECT_LT((check.shift_m - shift_m).norm(), 0.15e-3);
}

TEST(TcpCheck, FindsTheSphereThatMoved) {
  const std::string& id = demo_cell().targets[2].id;
  const TcpCheck check = made_by(moved(id, 1e-3 * first_of(id).normal)).judged();
  EXPECT_FALSE(check.holds);
  EXPECT_EQ(check.change()->kind, ChangeKind::kSphere);
  EXPECT_EQ(check.change()->name, id);
  EXPECT_NE(change_words(check).find("Clamp the stand of " + id), std::string::npos);
}

TEST(TcpCheck, OfASphereThatIsKnownAlongItsTouchesOnlyStatesTheLeastThatItMoved) {
  // Across the touch more than along it.
  const std::string& id = demo_cell().targets[2].id;
  const Eigen::Vector3d along = first_of(id).normal, across = along.unitOrthogonal();
  const Eigen::Vector3d by_m = 1e-3 * along + 2e-3 * across;
  const Made all = made_by(moved(id, by_m));
  Made made;
  for (std::size_t i = 0; i < all.touches.size(); ++i) {
    if (all.touches[i].target == id && std::ranges::count(made.touches, id, &Touch::target) > 0)
      continue;
    made.touches.push_back(all.touches[i]);
    made.planned.push_back(all.planned[i]);
  }
  const TcpCheck check = made.judged();
  ASSERT_NE(check.change(), nullptr);
  const Explanation& sphere = *check.change();
  ASSERT_EQ(sphere.kind, ChangeKind::kSphere);
  EXPECT_LT((sphere.shift_m - by_m).norm(), 2.0 * std::sqrt(3.0) * sphere.sigma);
  EXPECT_GT(sphere.amount, 0.5e-3);
  EXPECT_LT(sphere.amount, by_m.norm());
  EXPECT_NE(words(sphere).find(id + " moved by at least "), std::string::npos) << words(sphere);
  EXPECT_TRUE(verdict_words(check).starts_with("does not hold: " + id + " moved by at least "))
      << verdict_words(check);
  EXPECT_EQ(change_words(check).find("Clamp the stand of " + id), 0U) << change_words(check);
}

TEST(TcpCheck, FindsTheJointThatSlipped) {
  constexpr std::size_t kJoint = 2;
  const TcpCheck check =
      made_by(with_robot([](Robot& robot) { robot.joints[kJoint].offset_rad += 1e-3; })).judged();
  EXPECT_FALSE(check.holds);
  EXPECT_EQ(check.change()->kind, ChangeKind::kJoint);
  EXPECT_EQ(check.change()->name, demo_cell().robot.joints[kJoint].name);
  // In the controller's sense.
  EXPECT_NEAR(check.change()->amount * demo_cell().robot.joints[kJoint].sign, 1e-3, 0.2e-3);
}

TEST(TcpCheck, FindsAnArmThatWarmedUp) {
  constexpr double kGrowth = 300e-6;
  const TcpCheck check = made_by(with_robot([](Robot& robot) {
                           for (Joint& joint : robot.joints) {
                             joint.d_m *= 1.0 + kGrowth;
                             joint.a_m *= 1.0 + kGrowth;
                           }
                         })).judged();
  EXPECT_FALSE(check.holds);
  EXPECT_EQ(check.change()->kind, ChangeKind::kGrowth);
  EXPECT_NEAR(check.change()->amount, kGrowth, 100e-6);
}

TEST(TcpCheck, ASphereThatIsGoneIsNotFoundAndNotDropped) {
  const std::string& id = demo_cell().targets[1].id;
  const Made made = made_by(moved(id, Eigen::Vector3d(0.0, 0.0, -0.3)));
  ASSERT_FALSE(made.missed.empty());
  const TcpCheck check = made.judged();
  EXPECT_FALSE(check.holds);
  ASSERT_EQ(check.not_found.size(), made.missed.size());
  EXPECT_EQ(check.not_found.front().target, id);
  EXPECT_NEAR(check.not_found.front().beyond_m, CheckPlanOptions{}.behind_m, 0.5e-3);
  EXPECT_EQ(check.change()->kind, ChangeKind::kSphere);
  EXPECT_EQ(check.change()->name, id);
  const auto lines = words(check);
  EXPECT_TRUE(std::ranges::any_of(lines, [&](const std::string& line) {
    return line.find("no contact up to 12 mm beyond the expected surface of " + id) !=
           std::string::npos;
  }));
}

TEST(TcpCheck, NamesTheExplanationsThatAreAPercentLikelyAndCountsTheOthers) {
  const TcpCheck check = made_by(knocked({0.0, 0.0, -1e-3})).judged();
  const auto likely = std::ranges::count_if(
      check.explanations, [](const Explanation& one) { return one.probability >= 0.01; });
  const auto unlikely = static_cast<std::ptrdiff_t>(check.explanations.size()) - likely;
  ASSERT_GT(likely, 0);
  ASSERT_GT(unlikely, 0);
  const auto lines = words(check);
  EXPECT_EQ(std::ranges::count_if(
                lines, [](const auto& line) { return line.find(" %  log ") != std::string::npos; }),
            likely);
  EXPECT_EQ(lines.back(), std::to_string(unlikely) + " more, each below 1 %");
}

TEST(TcpCheck, OfAToolThatIsGoneNothingIsMetAndThatIsTheAnswer) {
  const Made made = made_by(knocked({0.0, 0.0, -0.1}));
  EXPECT_TRUE(made.touches.empty());
  const TcpCheck check = made.judged();
  EXPECT_FALSE(check.holds);
  EXPECT_EQ(check.not_found.size(), plan().touches.size());
  EXPECT_EQ(check.change(), nullptr);
  const std::string all = std::to_string(check.not_found.size());
  EXPECT_EQ(verdict_words(check),
            "does not hold: " + all + " of " + all + " touches without a contact point");
  EXPECT_NE(check_to_json(check).find("\"holds\": false"), std::string::npos);
}

TEST(TcpCheck, ChecksThatHeldBeforeMakeTheNextOneSharper) {
  std::vector<std::vector<Touch>> before;
  for (const std::uint64_t seed : {11, 12, 13}) before.push_back(made_by(truth(), seed).touches);
  const TcpCheck alone = made_by(truth()).judged(), sharper = made_by(truth()).judged(before);
  EXPECT_TRUE(sharper.holds);
  EXPECT_GT(sharper.found, alone.found);
  EXPECT_LT(sharper.covariance_m2.trace(), alone.covariance_m2.trace());
  EXPECT_FALSE(made_by(knocked({0.0, 0.3e-3, 0.0})).judged(before).holds);
}

TEST(TcpCheck, ReferencesThatScatterMoreThanStatedMakeTheNextOneLessSharp) {
  const auto shaken = [](std::uint64_t seed) {
    Made made = made_by(truth(), seed);
    Random random(seed + 50);
    for (Touch& touch : made.touches) touch.joint_rad[1] += 1.5e-4 * random.normal();
    return made.touches;
  };
  const std::vector<std::vector<Touch>> calm{
      made_by(truth(), 2).touches, made_by(truth(), 3).touches, made_by(truth(), 4).touches,
      made_by(truth(), 5).touches};
  const std::vector<std::vector<Touch>> wild{shaken(2), shaken(3), shaken(4), shaken(5)};
  const TcpCheck sharp = made_by(truth(), 6).judged(calm), rough = made_by(truth(), 6).judged(wild);
  EXPECT_LT(rough.found, sharp.found - 0.1);
  EXPECT_GT(rough.covariance_m2.trace(), 1.5 * sharp.covariance_m2.trace());
}

TEST(TcpCheck, WhatIsWrongInAReferenceIsExpectedAgain) {
  // A constant error of the calibration is not a change.
  const sim::Truth always = knocked({0.12e-3, 0.0, 0.0});
  std::vector<std::vector<Touch>> before;
  for (const std::uint64_t seed : {11, 12, 13}) before.push_back(made_by(always, seed).touches);
  const TcpCheck without = made_by(always).judged(), with = made_by(always).judged(before);
  EXPECT_TRUE(with.holds);
  EXPECT_LT(with.shift_m.norm(), without.shift_m.norm());
}

TEST(TcpCheck, RefusesWhatItCannotJudge) {
  const Made made = made_by(truth());
  const std::vector<Touch> few(made.touches.begin(), made.touches.begin() + 3);
  const auto refusal = [](const auto& act) { return testing::thrown<IdentifyError>(act); };
  using Kind = IdentifyError::Kind;
  EXPECT_EQ(refusal([&] { TcpChecker(calibration(), few); }).kind, Kind::kUndetermined);
  const TcpChecker whole(calibration(), made.touches);
  EXPECT_EQ(refusal([&] { (void)whole.judge(few); }).kind, Kind::kTouches);
  EXPECT_EQ(refusal([&] { TcpChecker(calibration(), made.touches, {few}); }).kind, Kind::kTouches);
  Calibration bare = calibration();
  bare.covariance.resize(0, 0);
  EXPECT_EQ(refusal([&] { TcpChecker(bare, made.touches); }).kind, Kind::kCalibration);
  Calibration elsewhere = calibration();
  const std::string gone = elsewhere.targets.back().id;
  elsewhere.targets.pop_back();
  const IdentifyError nowhere = refusal([&] { TcpChecker(elsewhere, made.touches); });
  EXPECT_EQ(nowhere.kind, Kind::kCalibration);
  EXPECT_EQ(nowhere.target, gone);
}

TEST(TcpCheck, OfAShiftThatIsKnownInAllDirectionsHasItsUncertaintyAlongIt) {
  const Eigen::Matrix3d covariance = Eigen::Vector3d(1e-10, 1e-10, 9e-10).asDiagonal();
  Explanation known, partly;
  put_size(Eigen::Vector3d(1e-3, 0.0, 0.0), covariance, known);
  EXPECT_NEAR(known.sigma, 1e-5, 1e-12);
  EXPECT_EQ(known.amount, 0.0);
  put_size(Eigen::Vector3d(4e-5, 0.0, 0.0), covariance, partly);
  EXPECT_NEAR(partly.sigma, 3e-5, 1e-12) << "of its least known direction";
  EXPECT_NEAR(partly.amount, 2e-5, 1e-12);
  // A verdict and its reason have one uncertainty of one shift, but for what is usual.
  const TcpCheck check = made_by(knocked({0.4e-3, 0.0, 0.3e-3})).judged();
  ASSERT_EQ(check.change()->kind, ChangeKind::kTool);
  EXPECT_NEAR(2.0 * check.change()->sigma, check.u_along_m(), 0.05 * check.u_along_m());
}

TEST(TcpCheck, AsADocumentHasEveryExplanationWithItsLikelihood) {
  const TcpCheck check = made_by(knocked({0.4e-3, 0.0, 0.0})).judged();
  const std::string json = check_to_json(check);
  for (const char* key : {"\"format\": \"cellcal.check/1\"", "\"changed\": \"tool\"",
                          "\"tcp_shift_mm\"", "\"log_likelihood\"", "\"probability\"", "\"words\""})
    EXPECT_NE(json.find(key), std::string::npos) << key;
  double sum = 0.0;
  for (const Explanation& one : check.explanations) sum += one.probability;
  EXPECT_NEAR(sum, 1.0, 1e-9);
}

TEST(ChangeKind, IsFoundByItsNameAndNoOther) {
  for (const ChangeKind kind : {ChangeKind::kNothing, ChangeKind::kTool, ChangeKind::kSphere,
                                ChangeKind::kJoint, ChangeKind::kGrowth, ChangeKind::kTouch})
    EXPECT_EQ(by_own_name<ChangeKind>(to_string(kind)), kind);
  EXPECT_FALSE(by_own_name<ChangeKind>("thing").has_value());
}

}  // namespace
}  // namespace cellcal::calib
