#include "daemon/fleet/store/corrections.h"

#include <cmath>

#include "calib/files/calibration_json.h"

namespace cellcal::daemon::fleet {

namespace {

using calib::ParameterResult;

Correction correction_of(const calib::Cell& cell, const ParameterResult& one) {
  const std::string& joint = cell.robot.joints.at(static_cast<std::size_t>(one.key.joint)).name;
  // "A3.theta" without the joint that stands in a column of its own.
  const std::string parameter = calib::parameter_name(cell, one.key).substr(joint.size() + 1);
  return {joint,
          parameter,
          one.unit,
          one.correction * one.to_unit,
          one.sigma * one.to_unit,
          calib::to_string(one.decided_by)};
}

}  // namespace

std::vector<Correction> corrections_of(std::string_view document) {
  std::vector<Correction> all;
  try {
    const calib::Calibration calibration = calib::calibration_from_json(document, "calibration");
    for (const ParameterResult& one : calibration.parameters) {
      const bool of_the_arm = one.key.kind <= calib::ParameterKind::kPlay && one.key.joint >= 0;
      if (!of_the_arm) continue;
      Correction made = correction_of(calibration.cell, one);
      if (std::isfinite(made.correction) && std::isfinite(made.sigma))
        all.push_back(std::move(made));
    }
  } catch (const std::exception&) {  // whatever it is: the document is stored as it came
    return {};
  }
  return all;
}

}  // namespace cellcal::daemon::fleet
