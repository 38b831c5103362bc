#pragma once
// Figures of a calibration compared with the true arm.

#include <Eigen/Geometry>
#include <algorithm>
#include <string>

#include "calib/estimate/predict.h"
#include "calib/estimate/region.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib::testing {

struct Off {
  double mean_m = 0.0, inside = 0.0, u95_m = 0.0;
};

/// Mean tip error over the workspace after alignment of the base, and the share within u95.
inline Off off(const Calibration& c, const sim::Truth& arm) {
  const auto poses = workspace_poses(ArmModel(demo_cell()), 200, 7);
  const auto n = static_cast<Eigen::Index>(poses.size());
  const Predictor predictor(c);
  Eigen::Matrix3Xd real(3, n), predicted(3, n);
  Eigen::ArrayXd u95(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const JointVector& q = poses[static_cast<std::size_t>(k)];
    const Prediction p = predictor.calibrated(q);
    real.col(k) = arm.arm.position(arm.arm.prepare(q), arm.errors.data());
    predicted.col(k) = p.tcp.translation();
    u95[k] = p.u95_m;
  }
  const Eigen::Matrix4d motion = calib::rigid_motion(predicted, real).matrix();
  const Eigen::ArrayXd e =
      ((motion.topLeftCorner<3, 3>() * predicted).colwise() + motion.topRightCorner<3, 1>() - real)
          .colwise()
          .norm()
          .transpose();
  return {e.mean(), static_cast<double>((e <= u95).count()) / static_cast<double>(n), u95.mean()};
}

/// Three waves per joint, of orders not in any file; those of one joint may be faster.
inline sim::Truth truth_with_waves(const std::string& faster = {}, double arcsec = 25.0) {
  Cell waved = demo_cell();
  for (Joint& joint : waved.robot.joints) {
    joint.harmonics = {7, 15, 23};
    if (joint.name == faster) joint.harmonics = {7, 23, 62};
    joint.harmonic_sigma_rad = arcsec * kRadPerArcsec;
    joint.harmonic_falloff = 0.0;
    joint.gear_ratio = 1.0;
  }
  return plain_truth(waved, 7);
}

inline bool has_functions(const Calibration& c) {
  return std::ranges::any_of(c.parameters,
                             [](const ParameterResult& p) { return is_function(p.key.kind); });
}

}  // namespace cellcal::calib::testing
