// Accuracy of a calibration: its predicted error, what determined each parameter, and the pair of
// parameters with the largest correlation.
//   03_read_the_bound calibration.json
#include <cmath>
#include <exception>
#include <iostream>

#include "calib/files/calibration_json.h"

int main(int argc, char** argv) try {
  using namespace cellcal::calib;
  if (argc != 2) {
    std::cerr << "03_read_the_bound CALIBRATION\n";
    return 2;
  }
  const Calibration c = load_calibration(argv[1]);
  std::cout << "mean error over the workspace, as the covariance foresees it: "
            << 1e3 * c.predicted_workspace_m << " mm (nominal arm: " << 1e3 * c.nominal_workspace_m
            << " mm)\n";
  for (const ParameterResult& p : c.parameters) {
    if (p.decided_by != DecidedBy::kData) continue;
    std::cout << parameter_name(c.cell, p.key) << "  " << p.correction * p.to_unit << " +- "
              << 2.0 * p.sigma * p.to_unit << ' ' << p.unit << " (k=2)\n";
  }
  // c.covariance refers to c.parameters, in the same order, in SI units and radians.
  Eigen::Index a = 0, b = 0;
  double largest = 0.0;
  for (Eigen::Index i = 0; i < c.covariance.rows(); ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      const double r = c.covariance(i, j) / std::sqrt(c.covariance(i, i) * c.covariance(j, j));
      if (std::abs(r) > std::abs(largest)) largest = r, a = i, b = j;
    }
  }
  if (a != b) {
    std::cout << "strongest correlation: "
              << parameter_name(c.cell, c.parameters[static_cast<std::size_t>(a)].key) << " and "
              << parameter_name(c.cell, c.parameters[static_cast<std::size_t>(b)].key) << ", "
              << largest << '\n';
  }
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
