#pragma once
// Where the TCP really is, by a calibration, and how sure that is.

#include <Eigen/Geometry>
#include <memory>
#include <span>
#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

struct Prediction {
  Eigen::Isometry3d tcp = Eigen::Isometry3d::Identity();  ///< base frame
  /// Radius that holds the position error at 95 % of the region where the
  /// base was fixed, with 98 % confidence; where the
  /// base frame lies is left aside (calib/uncertainty/bound.h).
  double u95_m = 0.0;
};

/// Evaluates a calibration at poses. Holds its own copies; cheap to call.
class Predictor {
 public:
  explicit Predictor(const Calibration& calibration);
  ~Predictor();
  Predictor(Predictor&&) noexcept;

  Prediction calibrated(std::span<const double> joint_rad) const;
  /// Mean 3-D error over at least 3 poses that the covariance foresees, a motion of the base taken
  /// out; what gears do beside the model is not in it. 0 without covariance.
  double mean_error_m(const std::vector<JointVector>& poses) const;
  Eigen::Isometry3d nominal(std::span<const double> joint_rad) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::calib
