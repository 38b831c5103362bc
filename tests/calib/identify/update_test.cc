// After a single change of the arm a few touches and the last calibration restore it. A result that one change does
// not explain is not published.

#include "calib/identify/update.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calib/estimate/predict.h"
#include "calib/estimate/region.h"
#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/identify/explained.h"
#include "calib/model/error.h"
#include "calib/plan/check_plan.h"
#include "calib/plan/duration.h"
#include "tests/calib/check/changed_cell.h"
#include "tests/calib/files/documents.h"
#include "tests/calib/findings.h"
#include "tests/calib/identify/judged.h"
#include "tests/calib/plan/meet.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

using testing::calibration, testing::demo_cell, testing::knocked, testing::moved, testing::off,
    testing::Off, testing::truth, testing::with_robot;

const UpdateFacts kFacts{"session 3 of 2026-11-20", 1.0, {}, 60};

double seconds_of(const Plan& plan) {
  Pace pace;
  pace.predicted_m = first_update_touches().before_m;
  return duration_s(plan, demo_cell().robot, pace);
}

/// The touches of a check, then of what these leave open.
class Session {
 public:
  enum class How { kWhole, kFirstTouches };
  explicit Session(sim::Truth arm, How how = How::kWhole) : arm_(std::move(arm)), random_(1) {
    static const Plan first = make_check_plan(calibration(), {}, first_update_touches());
    make(first);
    if (how == How::kFirstTouches) return;
    const Calibration so_far = update(calibration(), touches, kFacts);
    if (!further_touches_pay(*so_far.update)) return;
    make(make_update_plan(so_far, {},
                          further_update_touches(static_cast<int>(touches.size()), seconds),
                          first.touches.back().clear));
  }

  Calibration result() const { return update(calibration(), touches, kFacts); }

  std::vector<Touch> touches;
  double seconds = 0.0;

 private:
  void make(const Plan& plan) {
    seconds += seconds_of(plan);
    for (const PlannedTouch& planned : plan.touches)
      if (auto met = testing::meet(demo_cell(), arm_, planned, random_))
        touches.push_back(std::move(met->touch));
  }

  sim::Truth arm_;
  Random random_;
};

/// As accurate as before to within a fifth, with a valid bound.
void expect_as_before(const Calibration& c, const sim::Truth& arm) {
  EXPECT_TRUE(c.verdict.publish()) << testing::words_of(c);
  EXPECT_EQ(c.update->outcome, UpdateOutcome::kUpdated);
  const Off after = off(c, arm);
  EXPECT_LT(after.mean_m, kUpdateGoal * off(calibration(), truth()).mean_m);
  EXPECT_GT(after.inside, 0.9);
}

TEST(Update, AfterAKnockOfTheToolTheArmIsAsAccurateAsBefore) {
  const sim::Truth arm = knocked({1.5e-3, 1e-3, -1e-3});
  const Session session(arm);
  EXPECT_LE(session.touches.size(), 15U);
  EXPECT_LE(session.seconds, 40.0);
  const Calibration c = session.result();
  expect_as_before(c, arm);
  EXPECT_EQ(c.update->explanations.front().kind, ChangeKind::kTool);
  EXPECT_GT(off(calibration(), arm).mean_m, 1e-3);
  EXPECT_EQ(c.update->stands_on, kFacts.stands_on);
  EXPECT_FALSE(calibration().uncertainty.empty());
  EXPECT_TRUE(c.uncertainty.empty()) << "the last session's would contradict its predictions";
  EXPECT_TRUE(testing::found(c, FindingKind::kUpdated));
}

TEST(Update, IsWithheldAboveTheErrorThatTheCellFileRequires) {
  const Session session(knocked({1.5e-3, 1e-3, -1e-3}));
  Calibration last = calibration();
  const Calibration good = update(last, session.touches, kFacts);
  ASSERT_TRUE(good.verdict.publish());
  ASSERT_EQ(good.verdict.findings.size(), 2u);
  EXPECT_EQ(good.verdict.findings[1].kind, FindingKind::kGain);
  const double reached_m =
      good.verdict.workspace ? good.predicted_workspace_m : good.predicted_near_targets_m;
  last.cell.required_m = 1.01 * reached_m;
  EXPECT_TRUE(update(last, session.touches, kFacts).verdict.publish());
  last.cell.required_m = 0.99 * reached_m;
  const Calibration bad = update(last, session.touches, kFacts);
  EXPECT_FALSE(bad.verdict.publish());
  EXPECT_EQ(bad.verdict.findings.front().kind, FindingKind::kRequired);
}

TEST(Update, ASphereThatMovedIsKnownWhereItStandsNow) {
  const std::size_t sphere = 2;
  const sim::Truth arm = moved(demo_cell().targets[sphere].id, {1e-3, -1e-3, 1.5e-3});
  const Calibration c = Session(arm).result();
  expect_as_before(c, arm);
  EXPECT_EQ(c.update->explanations.front().kind, ChangeKind::kSphere);
  EXPECT_EQ(c.update->explanations.front().name, demo_cell().targets[sphere].id);
  const Eigen::Vector3d by_m = c.targets[sphere].centre_m - calibration().targets[sphere].centre_m;
  EXPECT_LT((by_m - Eigen::Vector3d(1e-3, -1e-3, 1.5e-3)).norm(), 0.2e-3);
  for (const LengthResult& length : c.lengths) {
    EXPECT_NE(length.from, demo_cell().targets[sphere].id);
    EXPECT_NE(length.to, demo_cell().targets[sphere].id);
  }
}

TEST(Update, OfASlippedJointTheZeroIsFoundAnewAndOfAWarmArmItsLengths) {
  constexpr std::size_t kJoint = 4;
  const sim::Truth arm =
      with_robot([](Robot& robot) { robot.joints[kJoint].offset_rad += 1.5e-3; });
  const Calibration c = Session(arm).result();
  expect_as_before(c, arm);
  EXPECT_EQ(c.update->explanations.front().kind, ChangeKind::kJoint);
  const ParameterKey zero = joint_parameter(ParameterKind::kTheta, kJoint);
  EXPECT_NEAR(correction_of(c, zero) - correction_of(calibration(), zero), 1.5e-3, 0.2e-3);

  const sim::Truth warm = with_robot([](Robot& robot) {
    for (Joint& joint : robot.joints) {
      joint.d_m *= 1.0 + 300e-6;
      joint.a_m *= 1.0 + 300e-6;
    }
  });
  const Calibration grown = Session(warm).result();
  expect_as_before(grown, warm);
  EXPECT_EQ(grown.update->explanations.front().kind, ChangeKind::kGrowth);
}

TEST(Update, WhereNothingChangedTheLastCalibrationHoldsAndNothingIsPublished) {
  const Calibration c = Session(truth(), Session::How::kFirstTouches).result();
  EXPECT_EQ(c.update->outcome, UpdateOutcome::kNothingChanged);
  EXPECT_FALSE(c.verdict.publish());
  EXPECT_TRUE(testing::found(c, FindingKind::kUpdateNotNeeded));
}

TEST(Update, OfTwoChangesNoneIsMadeUp) {
  sim::Truth arm = knocked({1e-3, 0.0, 0.0});
  arm.centre_m[0] += Eigen::Vector3d(0.0, 0.0, 2e-3);
  const Calibration c = Session(arm, Session::How::kFirstTouches).result();
  EXPECT_EQ(c.update->outcome, UpdateOutcome::kContradicted);
  EXPECT_FALSE(c.verdict.publish());
  EXPECT_TRUE(testing::found(c, FindingKind::kUpdateContradicted));
}

TEST(Update, NoTouchIsBlamedForASecondChange) {
  // One change and one wrong touch explain the residuals as well as chance; two changes do better.
  const sim::Truth arm = with_robot([](Robot& robot) {
    robot.joints[2].offset_rad += 0.5e-3;
    robot.joints[3].offset_rad += 0.6e-3;
  });
  const Calibration c = Session(arm).result();
  EXPECT_FALSE(c.update->set_aside.empty());
  EXPECT_GT(c.update->by_chance, 0.01);
  EXPECT_GT(c.update->log_odds_second, std::log(10.0));
  EXPECT_EQ(c.update->outcome, UpdateOutcome::kContradicted);
  EXPECT_FALSE(c.verdict.publish());
}

TEST(Update, ATouchThatIsWrongByItselfIsSetAside) {
  const sim::Truth arm = knocked({0.0, 1e-3, 0.0});
  Session session(arm);
  constexpr std::size_t kWrong = 4;
  session.touches[kWrong].joint_rad[1] += 1.5e-3;
  const Calibration c = session.result();
  expect_as_before(c, arm);
  EXPECT_EQ(c.update->set_aside, std::vector<std::size_t>{kWrong});
  EXPECT_TRUE(c.residuals[kWrong].outlier);
  ASSERT_EQ(c.outliers.size(), 1u);
  EXPECT_EQ(c.outliers[0].touch, kWrong);
  EXPECT_EQ(c.outliers[0].target, session.touches[kWrong].target);
  EXPECT_GT(c.outliers[0].sigmas, 3.0);
  EXPECT_LT(c.update->log_odds_second, std::log(0.1));
}

TEST(Update, ASphereThatWasNotFoundOrTooFewTouchesEndIt) {
  const Session session(knocked({0.0, 1e-3, 0.0}), Session::How::kFirstTouches);
  UpdateFacts facts = kFacts;
  facts.not_found = {demo_cell().targets[1].id};
  const Calibration lost = update(calibration(), session.touches, facts);
  EXPECT_EQ(lost.update->outcome, UpdateOutcome::kNotFound);
  EXPECT_TRUE(testing::found(lost, FindingKind::kUpdateNotFound));
  EXPECT_FALSE(lost.verdict.publish());
  const std::vector<Touch> few(session.touches.begin(), session.touches.begin() + 5);
  const Calibration short_of = update(calibration(), few, kFacts);
  EXPECT_EQ(short_of.update->outcome, UpdateOutcome::kTooFewTouches);
  EXPECT_FALSE(short_of.verdict.publish());
}

TEST(Update, RefusesWhatNothingCanStandOnAndWhatCreptMakesItLessSure) {
  const Session session(knocked({1e-3, 0.0, 0.0}), Session::How::kFirstTouches);
  UpdateFacts late = kFacts;
  late.months = 60.0;
  EXPECT_GT(update(calibration(), session.touches, late).update->reached_m,
            session.result().update->reached_m);
  Calibration bare = calibration();
  bare.covariance.resize(0, 0);
  const auto kind = [&](const Calibration& last) {
    return testing::thrown<IdentifyError>([&] { (void)update(last, session.touches, kFacts); })
        .kind;
  };
  EXPECT_EQ(kind(bare), IdentifyError::Kind::kCalibration);
  Calibration elsewhere = calibration();
  elsewhere.targets.pop_back();
  EXPECT_EQ(kind(elsewhere), IdentifyError::Kind::kCalibration);
}

TEST(Update, StandsOnAnUpdateAsOnAnyCalibration) {
  const Calibration once = Session(knocked({1e-3, 0.0, 0.0}), Session::How::kFirstTouches).result();
  ASSERT_TRUE(once.verdict.publish());
  const sim::Truth arm = knocked({1e-3, -1e-3, 0.0});
  const Session session(arm, Session::How::kFirstTouches);
  const Calibration twice = update(once, session.touches, kFacts);
  EXPECT_TRUE(twice.verdict.publish()) << testing::words_of(twice);
  EXPECT_LT(off(twice, arm).mean_m, kUpdateGoal * off(calibration(), truth()).mean_m);
}

TEST(UpdateFile, IsReadBackWithAllThatItStandsOnAndRefusesWhatIsNone) {
  const Calibration c = Session(knocked({1e-3, 0.0, 0.0}), Session::How::kFirstTouches).result();
  const std::string json = calibration_to_json(c);
  const Calibration again = calibration_from_json(json, "x");
  ASSERT_TRUE(again.update.has_value());
  const UpdateOrigin &was = *c.update, &is = *again.update;
  EXPECT_EQ(is.outcome, was.outcome);
  EXPECT_EQ(is.stands_on, was.stands_on);
  EXPECT_EQ(is.touches, was.touches);
  EXPECT_EQ(is.months, was.months);
  EXPECT_NEAR(is.chi2, was.chi2, 1e-9);
  EXPECT_NEAR(is.reached_m, was.reached_m, 1e-12);
  ASSERT_EQ(is.explanations.size(), was.explanations.size());
  for (std::size_t k = 0; k < was.explanations.size(); ++k) {
    EXPECT_EQ(is.explanations[k].kind, was.explanations[k].kind);
    EXPECT_EQ(is.explanations[k].name, was.explanations[k].name);
    EXPECT_EQ(is.explanations[k].touch, was.explanations[k].touch);
    EXPECT_NEAR(is.explanations[k].amount, was.explanations[k].amount, 1e-12);
    EXPECT_LT((is.explanations[k].shift_m - was.explanations[k].shift_m).norm(), 1e-12);
    EXPECT_NEAR(is.explanations[k].sigma, was.explanations[k].sigma, 1e-12);
  }
  EXPECT_EQ(again.parameters.size(), c.parameters.size());
  // A calibration read back predicts the same tip.
  const JointVector q{0.1, -1.2, 1.3, 0.2, 0.7, -0.3};
  EXPECT_LT((Predictor(again).calibrated(q).tcp.translation() -
             Predictor(c).calibrated(q).tcp.translation())
                .norm(),
            1e-9);
  for (const auto& [good, bad] : {std::pair("\"outcome\": \"updated\"", "\"outcome\": \"mended\""),
                                  std::pair("\"kind\": \"tool\"", "\"kind\": \"hammer\""),
                                  std::pair("\"months\": 1", "\"months\": -1"),
                                  std::pair("\"set_aside\": []", "\"set_aside\": [-3]")}) {
    std::string broken = testing::without_sum(json);
    const auto update_at = broken.find("\"update\": {");
    const auto at = broken.find(good, update_at);
    ASSERT_NE(at, std::string::npos) << good;
    broken.replace(at, std::string(good).size(), bad);
    EXPECT_THROW((void)calibration_from_json(broken, "x"), FileError) << bad;
  }
}

}  // namespace
}  // namespace cellcal::calib
