#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "calib/files/priors_file.h"
#include "calib/model/error.h"
#include "calib/model/units.h"
#include "calib/priors/learn.h"
#include "tests/calib/priors/simulated_fleet.h"

namespace cellcal::calib::testing {
namespace {

constexpr std::array kGeometry{SpreadKind::kLength, SpreadKind::kAngle};

double truth_of(const Truth& truth, std::size_t joint, SpreadKind kind) {
  return kind == SpreadKind::kLength ? truth.length[joint] : truth.angle[joint];
}

double log_sigma(const Spread& s) { return s.found_sigma / s.found; }

SetAsideKind kind_of(const Learned& learned, const std::string& name) {
  const auto found = std::ranges::find(learned.set_aside, name, &SetAside::name);
  EXPECT_NE(found, learned.set_aside.end()) << name << " was not set aside";
  return found == learned.set_aside.end() ? SetAsideKind::kUnreadable : found->kind;
}

TEST(LargeFleet, TellTheirSpreadsWithinWhatIsStated) {
  const Truth truth = uneven();
  const Learned learned = learn(drawn_robot(), evidence_of_all(fleet_of(150, truth)));
  ASSERT_FALSE(learned.none);
  EXPECT_GE(learned.priors.arms, 149);
  double squares = 0.0;
  int count = 0;
  for (std::size_t joint = 0; joint < 6; ++joint)
    for (const SpreadKind kind : kGeometry) {
      const Spread& s = spread(learned, joint, kind);
      const double off = std::log(s.found / s.drawn / truth_of(truth, joint, kind)) / log_sigma(s);
      EXPECT_LT(std::abs(off), 3.5)
          << learned.priors.joints[joint].joint << " " << static_cast<int>(kind) << ": "
          << s.found / s.drawn << " +- " << s.found_sigma / s.drawn << " by " << s.arms << " arms";
      squares += off * off;
      ++count;
    }
  EXPECT_LT(squares / count, 2.5);
  const Spread& wide = spread(learned, 2, SpreadKind::kLength);
  EXPECT_LT(log_sigma(wide), 0.12);
  EXPECT_GT(offered(wide), wide.found);
}

TEST(SmallFleet, DoNotOverruleTheNominalGeometry) {
  Truth narrow;
  narrow.length = narrow.angle = {0.25, 0.25, 0.25, 0.25, 0.25, 0.25};
  const Learned few = learn(drawn_robot(), evidence_of_all(fleet_of(4, narrow)));
  const Learned many = learn(drawn_robot(), evidence_of_all(fleet_of(100, narrow)));
  ASSERT_FALSE(few.none);
  ASSERT_FALSE(many.none);
  for (std::size_t joint = 1; joint < 4; ++joint)
    for (const SpreadKind kind : kGeometry) {
      const Spread &by_few = spread(few, joint, kind), &by_many = spread(many, joint, kind);
      EXPECT_GT(by_few.found / by_few.drawn, 0.6);
      EXPECT_LT(by_few.found, by_few.drawn) << "but they are heard";
      EXPECT_LT(by_many.found / by_many.drawn, 0.4);
      EXPECT_LT(by_few.arms, 4.0);
    }
}

TEST(SmallFleet, ThatAreAllNearerThanDrawnAreNotTooNear) {
  Truth narrow;
  narrow.length = narrow.angle = {0.25, 0.25, 0.25, 0.25, 0.25, 0.25};
  narrow.gear = 0.25;
  const Learned learned = learn(drawn_robot(), evidence_of_all(fleet_of(8, narrow, 200)));
  EXPECT_FALSE(learned.none);
  EXPECT_EQ(learned.priors.arms, 8);
}

TEST(SmallFleet, AreNoFleet) {
  const Learned learned = learn(drawn_robot(), evidence_of_all(fleet_of(2, uneven())));
  EXPECT_EQ(learned.none, NoPriors::kTooFewArms);
  EXPECT_TRUE(learned.priors.joints.empty());
}

TEST(WhatPriorsDecided, LeavesTheNominalGeometryWhereItIs) {
  // Thirteen touches of four spheres with twelve unknown coordinates: these calibrations are determined almost
  // entirely by their priors. Taken at face value, two hundred posteriors near zero would narrow every tolerance to
  // zero.
  const Learned learned = learn(drawn_robot(), evidence_of_all(fleet_of(200, uneven(), 13)));
  ASSERT_FALSE(learned.none);
  int undetermined = 0;
  for (std::size_t joint = 0; joint < 6; ++joint)
    for (const SpreadKind kind : kGeometry) {
      const Spread& s = spread(learned, joint, kind);
      EXPECT_LT(s.arms, 20.0);
      if (s.arms > 2.0) continue;
      ++undetermined;
      EXPECT_GT(s.found / s.drawn, 0.7) << joint;
      EXPECT_LT(s.found / s.drawn, 1.4) << joint;
      EXPECT_GT(log_sigma(s), 0.15) << "and little is claimed";
      EXPECT_GE(offered(s), s.drawn) << "nobody narrows what no arm shows";
    }
  EXPECT_GE(undetermined, 4);
}

TEST(WhatPriorsDecided, IsNotReadBackHoweverOftenTheyAreTaken) {
  // Ten generations, each calibrated with the priors of the preceding one by touches that carry half of the
  // information: using the posterior's own spread would shrink it each time.
  const Truth truth = uneven();
  Robot stated = drawn_robot();
  Random random(5);
  Learned learned;
  for (int generation = 0; generation < 6; ++generation) {
    std::vector<Calibration> fleet;
    for (int k = 0; k < 60; ++k)
      fleet.push_back(calibration_of(drawn_robot(), stated, truth, 20, random));
    learned = learn(stated, evidence_of_all(fleet));
    ASSERT_FALSE(learned.none);
    stated = std::get<Accepted>(accept(stated, learned.priors)).robot;
  }
  const Robot drawn = drawn_robot();
  for (std::size_t joint = 0; joint < 6; ++joint) {
    const Joint &is = stated.joints[joint], &was = drawn.joints[joint];
    EXPECT_GT(is.tolerance_length_m / was.tolerance_length_m, 0.75 * truth.length[joint]) << joint;
    EXPECT_GT(is.tolerance_angle_rad / was.tolerance_angle_rad, 0.75 * truth.angle[joint]) << joint;
  }
}

TEST(CorruptedArms, DoNotMoveTheSpreads) {
  const std::vector<Calibration> honest = fleet_of(114, uneven());
  std::vector<Calibration> poisoned = honest;
  const auto poison = [&](std::size_t of, double factor) {
    poisoned.push_back(times(honest[of], factor));
  };
  poison(0, 100.0);
  poison(1, 6.0);
  poison(2, 1e6);
  poison(3, 0.0);
  poisoned.push_back(times(honest[4], 5.0));
  poisoned.back().covariance *= 1e-6;  // and is overconfident
  poisoned.push_back(honest[5]);
  poisoned.back().parameters[2].correction = 1e300;
  const Learned clean = learn(drawn_robot(), evidence_of_all(honest));
  const Learned learned = learn(drawn_robot(), evidence_of_all(poisoned));
  ASSERT_FALSE(learned.none);
  EXPECT_EQ(learned.priors.arms, clean.priors.arms);
  EXPECT_EQ(kind_of(learned, "arm 114.json"), SetAsideKind::kTooFar);
  EXPECT_EQ(kind_of(learned, "arm 115.json"), SetAsideKind::kTooFar);
  EXPECT_EQ(kind_of(learned, "arm 116.json"), SetAsideKind::kTooFar);
  EXPECT_EQ(kind_of(learned, "arm 117.json"), SetAsideKind::kTooNear);
  EXPECT_EQ(kind_of(learned, "arm 118.json"), SetAsideKind::kTooFar);
  EXPECT_EQ(kind_of(learned, "arm 119.json"), SetAsideKind::kTooFar);
  for (std::size_t joint = 0; joint < 6; ++joint)
    for (const SpreadKind kind : kGeometry) {
      const Spread &a = spread(clean, joint, kind), &b = spread(learned, joint, kind);
      EXPECT_NEAR(std::log(b.found / a.found), 0.0, 0.1 * log_sigma(a)) << joint;
    }
}

TEST(CorruptedArms, ThatStayWithinTheSpreadMoveItNoMoreThanItsUncertainty) {
  std::vector<Calibration> fleet = fleet_of(114, uneven());
  const Learned clean = learn(drawn_robot(), evidence_of_all(fleet));
  for (std::size_t k = 0; k < 6; ++k) fleet.push_back(times(fleet_of(6, uneven(), 40, 9)[k], 1.6));
  const Learned learned = learn(drawn_robot(), evidence_of_all(fleet));
  ASSERT_FALSE(learned.none);
  for (std::size_t joint = 0; joint < 6; ++joint)
    for (const SpreadKind kind : kGeometry) {
      const Spread &a = spread(clean, joint, kind), &b = spread(learned, joint, kind);
      EXPECT_NEAR(std::log(b.found / a.found), 0.0, 2.0 * log_sigma(a)) << joint;
    }
}

TEST(MixedFleet, AreNotOnePopulation) {
  std::vector<Calibration> fleet = fleet_of(30, uneven());
  for (const Calibration& c : fleet_of(15, uneven(), 40, 8)) fleet.push_back(times(c, 20.0));
  const Learned learned = learn(drawn_robot(), evidence_of_all(fleet));
  EXPECT_EQ(learned.none, NoPriors::kNotOnePopulation);
  EXPECT_TRUE(learned.priors.joints.empty());
}

TEST(SingleArm, CountsOnceByItsName) {
  std::vector<ArmEvidence> arms = evidence_of_all(fleet_of(10, uneven()));
  for (const std::size_t k : {2, 3, 4}) arms[k].arm = "serial 17";
  arms[2].time = "2026-01-01T00:00:00Z";
  arms[3].time = "2026-03-01T00:00:00Z";
  arms[4].time = "2026-04-01T00:00:00Z";
  arms[4].update = true;  // updated from another
  const Learned learned = learn(drawn_robot(), arms);
  EXPECT_EQ(learned.priors.arms, 8);
  EXPECT_EQ(kind_of(learned, "arm 002.json"), SetAsideKind::kSameArm);
  EXPECT_EQ(kind_of(learned, "arm 004.json"), SetAsideKind::kSameArm);
  EXPECT_EQ(learned.set_aside.front().other, "arm 003.json");
}

TEST(SingleArm, CountsOnceUnderOtherNamesToo) {
  std::vector<Calibration> fleet = fleet_of(40, uneven());
  const Learned once = learn(drawn_robot(), evidence_of_all(fleet));
  for (int k = 0; k < 20; ++k) fleet.push_back(fleet[7]);
  const Learned copied = learn(drawn_robot(), evidence_of_all(fleet));
  ASSERT_FALSE(copied.none);
  EXPECT_EQ(copied.priors.arms, once.priors.arms);
  EXPECT_EQ(kind_of(copied, "arm 059.json"), SetAsideKind::kSameArm);
  EXPECT_NEAR(spread(copied, 1, SpreadKind::kLength).found,
              spread(once, 1, SpreadKind::kLength).found, 1e-9);
}

TEST(OtherGeometryArms, AreSetAsideByTheirNominalGeometry) {
  std::vector<ArmEvidence> arms = evidence_of_all(fleet_of(6, uneven()));
  Robot longer = drawn_robot();
  longer.joints[1].a_m += 0.08;
  Random random(3);
  std::vector<ArmEvidence> other =
      evidence_of_all({calibration_of(longer, longer, uneven(), 40, random)});
  other.front().name = "other.json";
  arms.push_back(other.front());
  const Learned learned = learn(commonest_nominal_geometry(arms), arms);
  EXPECT_EQ(learned.priors.arms, 6);
  EXPECT_EQ(kind_of(learned, "other.json"), SetAsideKind::kOtherNominalGeometry);
}

TEST(TheNominalGeometry, IsNotThatOfAFewWhoStateOtherTolerances) {
  std::vector<ArmEvidence> arms = evidence_of_all(fleet_of(9, uneven()));
  for (const std::size_t k : {1, 4}) {
    arms[k].robot.name = "another file of the arm";
    for (Joint& joint : arms[k].robot.joints) joint.tolerance_length_m = k == 1 ? 1.0 : 1e-9;
  }
  EXPECT_EQ(commonest_nominal_geometry(arms).joints[1].tolerance_length_m,
            drawn_robot().joints[1].tolerance_length_m);
}

TEST(FleetOrder, InWhichCalibrationsComeDoesNotMatter) {
  std::vector<ArmEvidence> arms = evidence_of_all(fleet_of(25, uneven()));
  const Learned forth = learn(drawn_robot(), arms);
  std::ranges::reverse(arms);
  std::swap(arms[3], arms[17]);
  const Learned back = learn(drawn_robot(), arms);
  for (std::size_t joint = 0; joint < 6; ++joint)
    for (const SpreadKind kind : kGeometry) {
      EXPECT_EQ(spread(forth, joint, kind).found, spread(back, joint, kind).found);
      EXPECT_EQ(spread(forth, joint, kind).found_sigma, spread(back, joint, kind).found_sigma);
    }
}

/// Each joint with a function of this size.
Robot with_functions(double sigma_rad) {
  Robot robot = drawn_robot();
  for (Joint& joint : robot.joints) {
    joint.function_sigma_rad = sigma_rad;
    joint.function_reach_rad = 6.0 * kRadPerDeg;
  }
  return robot;
}

std::vector<ArmEvidence> arms_with_functions(int arms, double real_rad, double stated_rad) {
  constexpr int kTouches = 250;
  Random random(7);
  std::vector<Calibration> fleet;
  for (int k = 0; k < arms; ++k)
    fleet.push_back(calibration_of(with_functions(real_rad), with_functions(stated_rad), uneven(),
                                   kTouches, random));
  return evidence_of_all(fleet);
}

TEST(FunctionsOfAFleet, HaveTheirSizeWhateverTheArmsCalibrationsAssumed) {
  constexpr double kReal = 30.0 * kRadPerArcsec;
  for (const double stated : {20.0 * kRadPerArcsec, 45.0 * kRadPerArcsec}) {
    const Learned learned = learn(drawn_robot(), arms_with_functions(6, kReal, stated));
    ASSERT_FALSE(learned.none);
    for (std::size_t j = 0; j < 3; ++j) {
      const Spread& found = spread(learned, j, SpreadKind::kFunction);
      EXPECT_NEAR(std::log(found.found / kReal), 0.0, 0.25) << j << " " << stated;
      EXPECT_EQ(found.arms, 6.0);
      EXPECT_NEAR(learned.priors.joints[j].function_reach_rad, 6.0 * kRadPerDeg, 1e-12);
    }
  }
}

TEST(FunctionsOfAFleet, AreNoneWhereLessThanHalfOfTheArmsHaveThem) {
  std::vector<ArmEvidence> arms = arms_with_functions(3, 3e-4, 3e-4);
  for (ArmEvidence& plain : evidence_of_all(fleet_of(4, uneven()))) {
    plain.name = "plain " + plain.name;
    arms.push_back(std::move(plain));
  }
  for (const JointPriors& joint : learn(drawn_robot(), arms).priors.joints)
    EXPECT_FALSE(joint.of(SpreadKind::kFunction));
}

TEST(FunctionsOfAFleet, AreInTheirFileAndInTheRobotThatAcceptsThem) {
  FleetPriors priors = learn(drawn_robot(), arms_with_functions(4, 1.5e-4, 1.5e-4)).priors;
  priors.made = "2026-11-22T20:15:00Z";
  const FleetPriors read = parse_priors(priors_to_toml(priors), "priors.toml");
  EXPECT_EQ(priors_to_toml(read), priors_to_toml(priors));
  const auto accepted = std::get<Accepted>(accept(drawn_robot(), read));
  const Joint& joint = accepted.robot.joints[1];
  EXPECT_NEAR(joint.function_sigma_rad, offered(spread({priors, {}, {}}, 1, SpreadKind::kFunction)),
              1e-12);
  EXPECT_NEAR(joint.function_reach_rad, 6.0 * kRadPerDeg, 1e-9);
  EXPECT_TRUE(std::ranges::any_of(accepted.changes, [](const PriorChange& one) {
    return one.kind == SpreadKind::kFunction && one.before == 0.0;
  }));
  const std::string text = priors_to_toml(priors);
  const auto at = text.find("function_reach_deg");
  EXPECT_THROW(
      (void)parse_priors(text.substr(0, at) + text.substr(text.find('\n', at) + 1), "priors.toml"),
      FileError)
      << "a size without its reach";
}

}  // namespace
}  // namespace cellcal::calib::testing
