#pragma once
// Where the TCP really is, by a calibration, and how sure that is.

#include <Eigen/Geometry>
#include <memory>
#include <span>

#include "calib/identify/calibration.h"

namespace cellcal::calib {

struct Prediction {
  Eigen::Isometry3d tcp = Eigen::Isometry3d::Identity();  ///< base frame
  /// Radius that holds the position error at 95 % of the region where the
  /// base was fixed, with 98 % confidence; where the
  /// base frame lies is left aside (calib/identify/bound.h).
  double u95_m = 0.0;
};

/// Evaluates a calibration at poses. Holds its own copies; cheap to call.
class Predictor {
 public:
  explicit Predictor(const Calibration& calibration);
  ~Predictor();
  Predictor(Predictor&&) noexcept;

  Prediction calibrated(std::span<const double> joint_rad) const;
  Eigen::Isometry3d nominal(std::span<const double> joint_rad) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::calib
