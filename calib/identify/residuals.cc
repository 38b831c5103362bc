#include "calib/identify/residuals.h"

#include <cmath>

#include "calib/identify/start.h"

namespace cellcal::calib {

namespace {

/// What an uncalibrated arm is wrong by.
constexpr double kNominalErrorM = 1e-3;

void add(ResidualSummary& summary, double residual_m) {
  const double size = std::abs(residual_m);
  ++summary.count;
  summary.mean_m += size;
  summary.max_m = std::max(summary.max_m, size);
  summary.rms_m += size * size;
}

void finish(ResidualSummary& summary) {
  if (summary.count == 0) return;
  summary.mean_m /= summary.count;
  summary.rms_m = std::sqrt(summary.rms_m / summary.count);
}

}  // namespace

void fill_residuals(const Problem& problem, const Eigen::VectorXd& x_si,
                    const std::vector<bool>& outlier, Calibration& calibration) {
  const auto touches = problem.touches();
  // The nominal arm's own centre of each target.
  std::vector<Eigen::Vector3d> nominal_centre(problem.blocks().size());
  for (std::size_t b = 0; b < problem.blocks().size(); ++b) {
    const Target& target = problem.cell().targets[problem.blocks()[b].target];
    std::vector<Eigen::Vector3d> points;
    std::vector<double> radii;
    for (std::size_t i = 0; i < touches.size(); ++i) {
      if (problem.block_of(i) != static_cast<int>(b) || outlier[i] ||
          touches[i].set != TouchSet::kFit)
        continue;
      points.push_back(problem.arm().position(problem.pose(i), nullptr));
      radii.push_back(target.kind == TargetKind::kWire ? touches[i].radius_m
                                                       : problem.nominal_radius_m(target));
    }
    if (target.kind == TargetKind::kPoint) {
      nominal_centre[b].setZero();
      for (const auto& p : points) nominal_centre[b] += p / static_cast<double>(points.size());
    } else {
      const SphereFit fit =
          fit_centre(points, radii, target.has_centre ? &target.centre_m : nullptr);
      nominal_centre[b] = target.has_centre && target.centre_sigma_m > 0.0
                              ? fit_centre_near(points, radii, kNominalErrorM, target.centre_m,
                                                target.centre_sigma_m)
                              : fit.centre_m;
    }
  }
  Eigen::VectorXd nominal = Eigen::VectorXd::Zero(problem.shared_size());
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const TargetBlock& block = problem.blocks()[problem.block_of(i)];
    const int rows = problem.rows(i);
    TouchResidual entry;
    entry.touch = i;
    entry.outlier = outlier[i];
    double r[3];
    const double centre[4] = {nominal_centre[problem.block_of(i)].x(),
                              nominal_centre[problem.block_of(i)].y(),
                              nominal_centre[problem.block_of(i)].z(), 0.0};
    problem.residual_m(i, nominal.data(), centre, r, nullptr, nullptr);
    entry.before_m = rows == 1 ? r[0] : Eigen::Map<Eigen::Vector3d>(r).norm();
    problem.residual_m(i, x_si.data(), x_si.data() + block.first, r, nullptr, nullptr,
                       &entry.direction);
    entry.after_m = rows == 1 ? r[0] : Eigen::Map<Eigen::Vector3d>(r).norm();
    entry.whitened = entry.after_m / problem.sigma_m(i);
    if (!outlier[i]) {
      const bool fit = touches[i].set == TouchSet::kFit;
      add(fit ? calibration.before : calibration.check_before, entry.before_m);
      add(fit ? calibration.after : calibration.check, entry.after_m);
    }
    calibration.residuals.push_back(entry);
  }
  for (ResidualSummary* summary :
       {&calibration.before, &calibration.after, &calibration.check_before, &calibration.check})
    finish(*summary);
}

}  // namespace cellcal::calib
