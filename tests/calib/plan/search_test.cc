// Allowed contacts of a search for a sphere, and its information on the sphere's place.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "calib/plan/centre_particles.h"
#include "calib/plan/pool.h"
#include "calib/plan/finder.h"
#include "calib/plan/search_line.h"
#include "calib/plan/track.h"
#include "tests/calib/plan/find_drive.h"
#include "tests/calib/simulate.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

using Eigen::Vector3d;
using testing::demo_cell;

TEST(CentreParticles, KeepsTheTruthAndRulesOutWhatWasMissed) {
  Target target;
  target.has_centre = true;
  target.centre_sigma_m = 0.01;
  CentreParticles particles(target, 0.03, kLeastArmSigmaM, 1);
  EXPECT_NEAR(particles.mean().norm(), 0.0, 1e-3);
  const double before = particles.covariance().trace();
  // A sphere at (8, 0, 0) mm met from above.
  const Vector3d centre(0.008, 0, 0);
  particles.hit({0, 0, 0.1}, {0, 0, std::sqrt(0.03 * 0.03 - 0.008 * 0.008)});
  particles.hit({0.1, 0, 0}, {0.038, 0, 0});
  particles.hit({0, 0.1, 0}, {0, std::sqrt(0.03 * 0.03 - 0.008 * 0.008), 0});
  EXPECT_LT((particles.mean() - centre).norm(), 0.004);
  EXPECT_LT(particles.covariance().trace(), before / 10.0);
  EXPECT_FALSE(particles.empty());
  particles.miss({0.008, 0, 0.1}, {0.008, 0, 0});
  EXPECT_TRUE(particles.empty()) << "a line through all of them met nothing";
}

TEST(CentreParticles, ThinsPlacesAsSurelyAsTheyWouldHaveBeenMet) {
  Target target;
  target.has_box = true;
  target.low_m = Vector3d::Constant(-0.02);
  target.high_m = Vector3d::Constant(0.02);
  CentreParticles particles(target, 0.01, kLeastArmSigmaM, 1);
  const Vector3d from(0, 0, 0.1), to(0, 0, -0.1);
  const auto at = [&](double low_m, double high_m) {
    return static_cast<double>(
        std::ranges::count_if(particles.places(), [&](const Vector3d& place) {
          const double off = CentreParticles::distance_m(place, from, to);
          return off >= low_m && off < high_m;
        }));
  };
  const double sure = at(0.0, 0.006), grazing = at(0.009, 0.010), beside = at(0.010, 0.02);
  ASSERT_GT(sure, 100.0);
  particles.miss(from, to);
  EXPECT_EQ(at(0.0, 0.006), 0.0);
  EXPECT_EQ(at(0.010, 0.02), beside) << "a place outside of the line is not doubted";
  // (70a) half a millimetre inside: Phi(-0.25) = 0.40.
  EXPECT_NEAR(at(0.009, 0.010) / grazing, 0.40, 0.10);
}

TEST(CentreParticles, OfALargeArmSurviveTouchesThatItsTolerancesPutOff) {
  constexpr double kRadiusM = 0.03, kOffM = 0.010;
  Target target;
  target.has_centre = true;
  target.centre_sigma_m = 0.01;
  const auto left = [&](double arm_sigma_m) {
    CentreParticles particles(target, kRadiusM, arm_sigma_m, 1);
    for (const Vector3d& side : {Vector3d(0, 1, 0), Vector3d(0, -1, 0), Vector3d(0, 0, 1)})
      particles.hit(0.1 * side, kRadiusM * side);
    // In two postures that are off to opposite sides.
    for (const Vector3d& side : {Vector3d(1, 0, 0), Vector3d(-1, 0, 0)})
      particles.hit(0.1 * side, (kRadiusM - kOffM) * side);
    return !particles.empty();
  };
  EXPECT_FALSE(left(kLeastArmSigmaM));
  EXPECT_TRUE(left(0.0032));
}

TEST(Sought, WhoseTouchesLieOnNoSphereNamesTheArmAsACause) {
  constexpr double kRadiusM = 0.012, kTrueM = 0.03;
  for (const double arm_sigma_m : {kLeastArmSigmaM, 0.004}) {
    Target target;
    target.id = "S1";
    target.has_centre = true;
    target.diameter_m = 2.0 * kRadiusM;
    Sought one{0, kRadiusM, Eigen::Isometry3d::Identity(),
               CentreParticles(target, kRadiusM, arm_sigma_m, 1)};
    const auto error = testing::thrown<PlanError>([&] {
      for (int k = 0; k < 12; ++k) {
        const Vector3d side = Vector3d::Unit(k % 3) * (k % 2 == 0 ? 1.0 : -1.0);
        one.touched(0.1 * side, kTrueM * side, target);
      }
    });
    EXPECT_EQ(error.kind, PlanError::Kind::kNotFound);
    const std::string words = error.what();
    EXPECT_NE(words.find("do not lie on a sphere of 24.0 mm"), std::string::npos) << words;
    const char* const off = arm_sigma_m > kLeastArmSigmaM ? "16" : "8";
    EXPECT_NE(words.find(std::string("the arm is off by more than ") + off +
                         " mm: check its mastering and offset_deg, or state larger tolerances"),
              std::string::npos)
        << words;
  }
}

TEST(Sought, KnownRoughlyFromAllTouchesThatFitIsFoundWhereACalibrationMeetsIt) {
  constexpr double kRadiusM = 0.020;
  const auto touched = [kRadiusM](double up, int touches) {
    Target target;
    target.id = "S1";
    target.has_centre = true;
    target.diameter_m = 2.0 * kRadiusM;
    target.centre_sigma_m = 0.005;
    Sought one{0, kRadiusM, Eigen::Isometry3d::Identity(),
               CentreParticles(target, kRadiusM, kLeastArmSigmaM, 1)};
    for (int k = 0; k < touches; ++k) {
      const Vector3d side = Vector3d(std::cos(0.524 * k), std::sin(0.524 * k), up).normalized();
      one.touched(0.1 * side, kRadiusM * side, target);
    }
    return one;
  };
  const Sought before = touched(0.15, 11), found = touched(0.15, 12);
  EXPECT_FALSE(before.found);
  EXPECT_TRUE(found.found);
  EXPECT_GT(found.sigma_m, found_sigma_m(kLeastArmSigmaM));
  EXPECT_LT(found.sigma_m, 0.004);
  const auto error = testing::thrown<PlanError>([&] { (void)touched(0.0, 12); });
  EXPECT_NE(std::string(error.what()).find("after 12 touches, limit 8.0 mm"), std::string::npos)
      << error.what();
}

TEST(CentreParticles, OfABoxWithoutExtentHaveASpreadOfTheirPrior) {
  Target target;
  target.has_box = true;
  target.low_m = target.high_m = Vector3d(0.8, 0.1, 0.3);
  const CentreParticles particles(target, 0.03, kLeastArmSigmaM, 1);
  EXPECT_LT((particles.mean() - target.low_m).norm(), 1e-9);
  EXPECT_GT(particles.prior_sigma_m(), kLeastArmSigmaM);
  EXPECT_LT(particles.prior_sigma_m(), 10.0 * kLeastArmSigmaM);
}

TEST(Shaft, OfATcpOnTheFlangeIsTheFlangesZ) {
  Tool tool;
  tool.tcp.linear() = Eigen::AngleAxisd(0.7, Vector3d::UnitY()).toRotationMatrix();
  EXPECT_EQ(shaft_of(tool), Vector3d(0.0, 0.0, 1.0));
  EXPECT_NEAR(shaft_in_tool(tool).norm(), 1.0, 1e-12);
  EXPECT_LT((tool.tcp.linear() * shaft_in_tool(tool) - shaft_of(tool)).norm(), 1e-12);
}

const SearchStand kNoStand{Eigen::Vector3d::UnitZ(), 0.0};

TEST(SearchDepth, EndsBeforeTheShaftMeetsWhatTheTipHasPassed) {
  Tool tool;
  tool.radius_m = 0.02;
  tool.slim_length_m = 0.05;
  const SearchLine down{Vector3d::Zero(), Vector3d::UnitZ(), -Vector3d::UnitZ()};
  // A sphere of 30 mm straight below is hit; one 40 mm aside is passed, and the shaft, 20 mm wide,
  // would meet it with the tip 50 mm below that place.
  const double radius = 0.03;
  const auto depth =
      search_depth(down, {Vector3d(0, 0, -0.02), Vector3d(0.04, 0, 0)}, radius, kNoStand, tool);
  const double shaft = 0.02 + radius + 0.005;
  EXPECT_NEAR(depth.end_m, std::sqrt(shaft * shaft - 0.04 * 0.04) - 0.05, 1e-12);
  EXPECT_NEAR(depth.share, 0.5, 1e-12);
  // The one straight below alone may be searched down to its centre.
  EXPECT_NEAR(search_depth(down, {Vector3d::Zero()}, radius, kNoStand, tool).end_m, 0.0, 1e-12);
}

TEST(SearchDepth, LearnsNothingFromALineThatWasSearchedBefore) {
  // Remaining uncertainty after a touch at the origin from above of a sphere of 40 mm: centres at
  // 20 mm.
  constexpr double kRadiusM = 0.02;
  Random random(1);
  std::vector<Vector3d> places;
  while (places.size() < 600) {
    const Vector3d draw(random.normal(), random.normal(), random.normal());
    if (draw.normalized().z() < -0.4)
      places.push_back((kRadiusM + 0.002 * random.normal()) * draw.normalized());
  }
  const auto told = [&](const Vector3d& aim, const Vector3d& normal) {
    const SearchLine line{aim, normal, -normal};
    return expected_reduction_m2(search_depth(line, places, kRadiusM, kNoStand, Tool{}), places,
                                 kLeastArmSigmaM);
  };
  const double again = told(Vector3d::Zero(), Vector3d::UnitZ());
  const double aside = told(Vector3d(0.0, 0.0, -0.014), Vector3d::UnitX());
  EXPECT_LT(again, 0.2 * aside) << again * 1e6 << " and " << aside * 1e6 << " mm2";
}

TEST(SearchDepth, KeepsTheShaftFromASphereThatAnArmThatIsOffWouldMiss) {
  Tool tool;
  tool.radius_m = 0.02;
  tool.slim_length_m = 0.05;
  const SearchLine down{Vector3d::Zero(), Vector3d::UnitZ(), -Vector3d::UnitZ()};
  // The nominal tip meets the sphere 26 mm aside, of 30 mm: by less than an arm's error.
  const double radius = 0.03, aside = 0.026;
  const std::vector<Vector3d> places{Vector3d(0, 0, -0.08), Vector3d(aside, 0, 0)};
  const double shaft = 0.02 + radius + 0.005;
  EXPECT_NEAR(search_depth(down, places, radius, kNoStand, tool).end_m,
              std::sqrt(shaft * shaft - aside * aside) - 0.05, 1e-12);
  const std::vector<Vector3d> surely{places[0], Vector3d(0.015, 0, 0)};
  EXPECT_NEAR(search_depth(down, surely, radius, kNoStand, tool).end_m, -0.08, 1e-12);
}

TEST(LineLeader, PassesALongLineOnBothSides) {
  const Cell& cell = testing::small_cell();
  const ArmModel arm(cell.robot, cell.tool);
  JointVector near(cell.robot.joints.size(), 0.0);
  near[1] = -1.2, near[2] = 1.6, near[4] = 1.0;
  const Eigen::Isometry3d middle = arm.nominal_tcp(near);
  const LineLeader leader(arm, cell.tool, 0.02);
  const Vector3d back = -(middle.linear() * shaft_in_tool(cell.tool));
  const LineToLead line{middle.translation(), back, middle.linear(), near};
  constexpr double kLongM = 0.05;
  const auto led = leader.lead(line, {kLongM + 0.008, kLongM, -kLongM});
  ASSERT_TRUE(led);
  const double bow = leader.bow_m(led->standoff, led->end).norm();
  std::printf("%.2f mm of bow\n", bow * 1e3);
  EXPECT_GT(bow, kMostBowM);
  constexpr int kSteps = 40;
  for (int k = 0; k <= kSteps; ++k) {
    JointVector q(near.size());
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] = led->standoff[i] + (led->end[i] - led->standoff[i]) * k / kSteps;
    EXPECT_LT(CentreParticles::distance_m(arm.nominal_tcp(q).translation(), led->from, led->to),
              kMostBowM + 1e-4);
  }
  EXPECT_FALSE(leader.lead(line, {3 * kLongM, 3 * kLongM, -3 * kLongM}));
}

TEST(SearchDepth, EndsBeforeTipOrShaftMeetTheStandOfASphereThatIsPassed) {
  Tool tool;
  tool.radius_m = 0.02;
  tool.slim_length_m = 0.05;
  tool.slim_radius_m = 0.004;
  const double radius = 0.03;
  const SearchStand stand{Vector3d::UnitZ(), 0.012};
  // Level, 40 mm below the centre: the tip would run into the post.
  const SearchLine level{{0, 0, -0.04}, Vector3d::UnitX(), -Vector3d::UnitX()};
  const std::vector<Vector3d> place{Vector3d::Zero()};
  EXPECT_NEAR(search_depth(level, place, radius, stand, tool).end_m, 0.012 + 0.004 + 0.004, 1e-12);
  EXPECT_NEAR(search_depth(level, place, radius, kNoStand, tool).end_m, 0.0, 1e-12);
  // At 25 mm from the post, for a place further on: the tip passes, the shaft, 50 mm after it,
  // would not.
  const SearchLine beside{{0, 0.025, -0.08}, Vector3d::UnitX(), -Vector3d::UnitX()};
  const std::vector<Vector3d> two{Vector3d::Zero(), Vector3d(-0.1, 0.3, 0.0)};
  const double shaft = 0.012 + 0.02 + 0.005;
  EXPECT_NEAR(search_depth(beside, two, radius, stand, tool).end_m,
              std::sqrt(shaft * shaft - 0.025 * 0.025) - 0.05, 1e-12);
  EXPECT_NEAR(search_depth(beside, two, radius, kNoStand, tool).end_m, -0.1, 1e-12);
  // The sphere itself is hit before its post: unchanged.
  const SearchLine middle{Vector3d::Zero(), Vector3d::UnitX(), -Vector3d::UnitX()};
  EXPECT_EQ(search_depth(middle, place, radius, stand, tool).end_m,
            search_depth(middle, place, radius, kNoStand, tool).end_m);
  // When descending next to the sphere it stays clear of what is below.
  const SearchLine aslant{{0.034, 0, 0}, Vector3d(1, 0, 3).normalized(), -Vector3d::UnitZ()};
  const SearchDepth depth = search_depth(aslant, place, radius, stand, tool);
  const Vector3d tip = aslant.aim_m + depth.end_m * aslant.normal;
  EXPECT_TRUE(tip.head<2>().norm() > 0.0199 || tip.z() > 0.0) << tip.transpose();
  // A post that leans with the cell: upside down from the ceiling.
  const SearchLine above{{0, 0, 0.04}, Vector3d::UnitX(), -Vector3d::UnitX()};
  EXPECT_NEAR(search_depth(above, place, radius, {-Vector3d::UnitZ(), 0.012}, tool).end_m, 0.02,
              1e-12);
}

TEST(SearchDepth, LetsASmallSphereBeTouchedFromTheSideAboveItsStand) {
  Tool tool;
  tool.radius_m = 0.0;
  tool.slim_radius_m = 0.004;
  const SearchStand stand{Vector3d::UnitZ(), 0.015};
  const std::vector<Vector3d> place{Vector3d::Zero()};
  const auto end_m = [&](double below_m) {
    const SearchLine level{{0, 0, -below_m}, Vector3d::UnitX(), -Vector3d::UnitX()};
    return search_depth(level, place, 0.02, stand, tool).end_m;
  };
  EXPECT_NEAR(end_m(0.005), 0.0, 1e-12) << "the sphere of 40 mm is met first";
  EXPECT_NEAR(end_m(0.012), 0.015 + 0.004 + 0.004, 1e-12) << "the stand would be met";
}

}  // namespace
}  // namespace cellcal::calib
