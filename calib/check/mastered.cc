#include "calib/check/mastered.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/model/error.h"
#include "calib/model/linear.h"
#include "calib/model/parameter_key.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

std::size_t joint_index(const Calibration& calibration, const std::string& name) {
  const std::vector<Joint>& joints = calibration.cell.robot.joints;
  const auto found = std::ranges::find(joints, name, &Joint::name);
  if (found != joints.end()) return static_cast<std::size_t>(found - joints.begin());
  std::string all;
  for (const Joint& joint : joints) all += (all.empty() ? "" : ", ") + joint.name;
  throw IdentifyError(IdentifyError::Kind::kOptions,
                      fmt::format("no joint {}. There are: {}", name, all));
}

}  // namespace

Phrase phrase(const MasteredZero& zero) {
  return {zero.holds() ? "say.mastered.holds" : "say.mastered.off",
          {{"joint", zero.joint},
           {"deg", zero.error_rad * kDegPerRad},
           {"u", zero.u_rad() * kDegPerRad}}};
}

Calibration as_mastered(const Calibration& calibration, const std::vector<std::string>& joints) {
  Calibration mastered = calibration;
  std::string by_frame, by_tolerance;
  for (const std::string& name : joints) {
    const ParameterKey key = joint_parameter(ParameterKind::kTheta, joint_index(calibration, name));
    const auto zero = std::ranges::find(mastered.parameters, key, &ParameterResult::key);
    if (zero != mastered.parameters.end() && zero->decided_by == DecidedBy::kData) {
      zero->correction = 0.0;
      continue;
    }
    const bool frame = zero == mastered.parameters.end() || zero->decided_by == DecidedBy::kFrame;
    std::string& names = frame ? by_frame : by_tolerance;
    names += (names.empty() ? "" : ", ") + name;
  }
  if (!by_frame.empty())
    throw IdentifyError(
        IdentifyError::Kind::kUndetermined,
        fmt::format(
            "no touch tells the zero of {}: it turns arm and base alike, or the tool about its own axis. "
            "Leave it out, and master it by its mark",
            by_frame));
  if (!by_tolerance.empty())
    throw IdentifyError(IdentifyError::Kind::kUndetermined,
                        fmt::format("the touches of this calibration leave the zero of {} to its "
                                    "tolerance. Leave it out, or calibrate with more touches first",
                                    by_tolerance));
  return mastered;
}

Eigen::MatrixXd by_zeros(const Calibration& calibration, const std::vector<std::string>& joints,
                         const std::vector<ForeseenContact>& contacts) {
  Eigen::MatrixXd by(static_cast<Eigen::Index>(contacts.size()),
                     static_cast<Eigen::Index>(joints.size()));
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const std::size_t joint = joint_index(calibration, joints[j]);
    for (std::size_t t = 0; t < contacts.size(); ++t) {
      const ForeseenContact& at = contacts[t];
      const ForeseenContact::Axis& axis = at.axes[joint];
      const Eigen::Vector3d outwards = (at.tip_m - at.centre_m).normalized();
      by(static_cast<Eigen::Index>(t), static_cast<Eigen::Index>(j)) =
          outwards.dot(axis.direction.cross(at.tip_m - axis.origin));
    }
  }
  return by;
}

std::vector<MasteredZero> zeros_left(const Calibration& mastered,
                                     const std::vector<std::string>& joints,
                                     const std::vector<Touch>& made) {
  const Foresight foresight = foresee(mastered, made);
  const Cholesky covariance(foresight.covariance_m2());
  const Eigen::MatrixXd by = covariance.whitened(by_zeros(mastered, joints, foresight.contacts));
  const Eigen::VectorXd off = covariance.whitened(residuals_m(foresight.contacts));
  const Cholesky information(Eigen::MatrixXd(by.transpose() * by));
  if (made.size() < joints.size() || !information.positive())
    throw IdentifyError(
        IdentifyError::Kind::kUndetermined,
        fmt::format("{} touches do not tell {} zeros apart. Check fewer joints at a time",
                    made.size(), joints.size()));
  const Eigen::VectorXd error = -information.solve(Eigen::VectorXd(by.transpose() * off));
  const Eigen::MatrixXd spread = information.inverse();
  std::vector<MasteredZero> zeros;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const auto i = static_cast<Eigen::Index>(j);
    zeros.push_back({joints[j], error[i], std::sqrt(spread(i, i))});
  }
  return zeros;
}

}  // namespace cellcal::calib
