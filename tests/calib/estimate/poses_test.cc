// A tracker that measures poses: orientations determine wrist errors that positions alone do not.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "calib/estimate/region.h"
#include "calib/identify/identify.h"
#include "calib/identify/identify_once.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "tests/calib/findings.h"
#include "tests/calib/millimetre.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using testing::demo_cell;
using testing::kMm;
using testing::words_of;

/// One probe, mounted on the tool in an unknown orientation, measured by one tracker.
struct Poses {
  explicit Poses(int count, unsigned seed = 1) {
    cell = demo_cell();
    cell.targets.clear();
    cell.lengths.clear();
    cell.radius_offset_sigma_m = 0.0;
    cell.touch_sigma_m = 0.02 * kMm;
    cell.turn_sigma_rad = 0.002 * kRadPerDeg;
    Target tracker;
    tracker.id = "L";
    tracker.kind = TargetKind::kTracker;
    cell.targets.push_back(tracker);
    const ArmModel arm(cell);
    Random random(seed);
    x = Eigen::VectorXd::Zero(arm.size());
    for (int p = 0; p < arm.size(); ++p) {
      const ArmParameter& one = arm.parameters()[static_cast<std::size_t>(p)];
      const double draw = std::clamp(random.normal(), -2.0, 2.0);
      x[p] = one.sigma * (one.kind == ParameterKind::kDeflection ? std::abs(draw) : draw);
    }
    Isometry3d tracker_in_base = Isometry3d::Identity();
    tracker_in_base.translate(Vector3d(3.0, -1.0, 0.5));
    tracker_in_base.rotate(Eigen::AngleAxisd(2.0, Vector3d(0.1, -0.2, 1.0).normalized()));
    const Matrix3d probe = turn(Vector3d(1.2, -0.4, 2.0));
    const auto poses = workspace_poses(arm, count, seed + 7);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const PreparedPose pose = arm.prepare(poses[i]);
      const ArmErrors errors = arm.errors(x.data());
      ArmChain chain;
      arm.walk(pose, errors, chain);
      const auto noise = [&](double sigma) {
        return Vector3d(sigma * random.normal(), sigma * random.normal(), sigma * random.normal());
      };
      Isometry3d seen = Isometry3d::Identity();
      seen.translation() = chain.tip + noise(cell.touch_sigma_m);
      seen.linear() = turn(noise(cell.turn_sigma_rad)) * arm.rotation(pose, errors, chain) * probe;
      const FrameMmDeg reading = to_frame(tracker_in_base.inverse() * seen);
      Touch touch;
      touch.joint_rad = poses[i];
      touch.target = "L";
      touch.set = i % 6 == 0 ? TouchSet::kCheck : TouchSet::kFit;
      touch.tracker_abc_rad.emplace();
      for (std::size_t k = 0; k < 3; ++k) {
        touch.tracker_m[k] = reading.xyz_mm[k] * kMm;
        (*touch.tracker_abc_rad)[k] = reading.abc_deg[k] * kRadPerDeg;
      }
      touches.push_back(touch);
    }
  }

  std::vector<Touch> places_alone() const {
    std::vector<Touch> bare = touches;
    for (Touch& touch : bare) touch.tracker_abc_rad.reset();
    return bare;
  }

  Cell cell;
  Eigen::VectorXd x;
  std::vector<Touch> touches;
};

const ParameterResult& parameter(const Calibration& c, const ParameterKey& key) {
  const ParameterResult* found = find(c, key);
  if (found == nullptr) throw std::runtime_error("no parameter " + parameter_name(c.cell, key));
  return *found;
}

TEST(Poses, AreUsedWithTheirTurnsWhereverTheProbeSits) {
  const Poses made(40);
  const Calibration c = identify(made.cell, made.touches);
  EXPECT_TRUE(c.verdict.publish()) << words_of(c);
  EXPECT_TRUE(c.outliers.empty());
  EXPECT_GT(c.chi2_per_dof, 0.5);
  EXPECT_LT(c.chi2_per_dof, 1.5);
  EXPECT_LT(c.check.rms_m, 0.2 * kMm) << "distances alone, no turns among them";
  (void)parameter(c, target_parameter(ParameterKind::kProbeTurn, c.cell.target_index("L")));
}

TEST(Poses, TellOfTheWristWhatPlacesAloneDoNot) {
  const Poses made(40);
  IdentifyOptions options;
  options.level = ModelLevel{0.3, 1.0, 0.0};
  const Calibration with = identify_single_pass(made.cell, made.touches, options);
  const Calibration without = identify_single_pass(made.cell, made.places_alone(), options);
  const ArmModel arm(made.cell);
  for (const std::size_t joint : {3, 4}) {
    const ParameterKey key = joint_parameter(ParameterKind::kAlpha, joint);
    const ParameterResult &p = parameter(with, key), &bare = parameter(without, key);
    const std::string name = parameter_name(with.cell, key);
    std::printf("%s: %.4f deg with turns, %.4f without\n", name.c_str(), p.sigma * p.to_unit,
                bare.sigma * bare.to_unit);
    EXPECT_LT(p.sigma, 0.9 * bare.sigma) << name;
    for (int k = 0; k < arm.size(); ++k) {
      if (arm.parameters()[static_cast<std::size_t>(k)] != key) continue;
      EXPECT_LT(std::abs(p.correction - made.x[k]), 4.0 * p.sigma) << name;
    }
  }
}

TEST(Poses, ThatWereReadWithOtherTurnsAreWithheld) {
  Poses made(40);
  for (Touch& touch : made.touches)
    std::swap((*touch.tracker_abc_rad)[0], (*touch.tracker_abc_rad)[2]);
  EXPECT_FALSE(identify(made.cell, made.touches).verdict.publish());
}

TEST(Poses, OneTurnThatIsWrongIsAnOutlier) {
  Poses made(40);
  (*made.touches[7].tracker_abc_rad)[1] += 1.0 * kRadPerDeg;
  const Calibration c = identify(made.cell, made.touches);
  ASSERT_EQ(c.outliers.size(), 1u) << words_of(c);
  EXPECT_EQ(c.outliers[0].touch, 7u);
}

TEST(Poses, MayStandBesideReadingsOfPlacesAlone) {
  Poses made(48);
  for (std::size_t i = 0; i < made.touches.size(); i += 2) made.touches[i].tracker_abc_rad.reset();
  const Calibration c = identify(made.cell, made.touches);
  EXPECT_TRUE(c.verdict.publish()) << words_of(c);
}

}  // namespace
}  // namespace cellcal::calib
