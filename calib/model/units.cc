#include "calib/model/units.h"

namespace cellcal::calib {

Eigen::Isometry3d to_isometry(const FrameMmDeg& frame) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.translation() =
      Eigen::Vector3d(frame.xyz_mm[0], frame.xyz_mm[1], frame.xyz_mm[2]) / 1000.0;
  result.linear() = (Eigen::AngleAxisd(frame.abc_deg[0] * kRadPerDeg, Eigen::Vector3d::UnitZ()) *
                     Eigen::AngleAxisd(frame.abc_deg[1] * kRadPerDeg, Eigen::Vector3d::UnitY()) *
                     Eigen::AngleAxisd(frame.abc_deg[2] * kRadPerDeg, Eigen::Vector3d::UnitX()))
                        .toRotationMatrix();
  return result;
}

FrameMmDeg to_frame(const Eigen::Isometry3d& isometry) {
  const Eigen::Matrix3d r = isometry.linear();
  const double cos_b = std::hypot(r(0, 0), r(1, 0));
  double a, c;
  // Below this cosine A and C turn about the same axis to within rounding.
  constexpr double kDegenerate = 1e-9;
  if (cos_b > kDegenerate) {
    a = std::atan2(r(1, 0), r(0, 0));
    c = std::atan2(r(2, 1), r(2, 2));
  } else {
    a = std::atan2(-r(0, 1), r(1, 1));
    c = 0.0;
  }
  const double b = std::atan2(-r(2, 0), cos_b);
  FrameMmDeg frame;
  for (int i = 0; i < 3; ++i) frame.xyz_mm[i] = isometry.translation()[i] * 1000.0;
  frame.abc_deg = {a * kDegPerRad, b * kDegPerRad, c * kDegPerRad};
  return frame;
}

}  // namespace cellcal::calib
