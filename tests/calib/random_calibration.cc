#include "tests/calib/random_calibration.h"

#include "calib/model/kinematics.h"

namespace cellcal::calib::testing {

Calibration random_calibration(const Cell& cell, Random& random, double scale,
                               const ModelLevel& level) {
  Calibration c;
  c.cell = cell;
  c.level = level;
  const ArmModel arm(at_level(cell, level));
  for (const ArmParameter& parameter : arm.parameters()) {
    ParameterResult one;
    one.key = parameter;
    one.unit = parameter.unit;
    one.to_unit = parameter.to_unit;
    one.correction = scale * parameter.sigma * random.normal();
    one.sigma = 0.1 * parameter.sigma;
    c.parameters.push_back(one);
  }
  c.covariance = Eigen::MatrixXd::Zero(arm.size(), arm.size());
  for (int i = 0; i < arm.size(); ++i) {
    const double sigma = c.parameters[static_cast<std::size_t>(i)].sigma;
    c.covariance(i, i) = sigma * sigma;
  }
  c.frame_basis = Eigen::MatrixXd::Zero(arm.size(), 0);
  for (const Target& target : cell.targets)
    c.targets.push_back({target.id, target.centre_m, target.diameter_m / 2.0});
  c.verdict.judged = c.verdict.workspace = true;
  return c;
}

}  // namespace cellcal::calib::testing
