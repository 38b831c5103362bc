#include "calib/identify/verdict.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "calib/identify/solve.h"

namespace cellcal::calib {

namespace {

/// Residuals twice as large as stated leave chi^2/dof at 4: the noise is not what the cell file
/// says, or the arm has errors that the model lacks.
constexpr double kChi2Limit = 4.0;
constexpr double kOutlierShare = 0.10;
/// Held-out touches may be worse than the calibration predicts for them, but not by this much.
constexpr double kCheckRatio = 2.0;
/// An arm this many tolerances off its drawing is another arm: real ones stay within five
/// (real-data tests), a wrong row of the robot file makes twenty and more and can still be
/// explained away.
constexpr double kFarFromDrawing = 8.0;
/// The effective radius may be off by what its prior says, and a little luck.
constexpr double kFarRadius = 5.0;
/// With a perfect arm a sphere's touches would hold its centre to sigma / sqrt(n lambda), lambda
/// the smallest eigenvalue of the mean of the outer products of their directions. Where that is
/// worse than this they say more about the sphere's place than about the arm.
constexpr double kPlaceSigmaM = 0.3e-3;

/// Held-out residuals over their predicted sigmas, rms: of the touch and of what the fit leaves
/// open there. 0 without check touches or covariance.
double check_against_prediction(const Problem& problem, const Calibration& c) {
  if (c.covariance.rows() != problem.size()) return 0.0;
  Eigen::VectorXd x(problem.size());
  for (int i = 0; i < problem.size(); ++i)
    x[i] = c.parameters[static_cast<std::size_t>(i)].nominal +
           c.parameters[static_cast<std::size_t>(i)].correction;
  double sum = 0.0;
  int count = 0;
  for (std::size_t t = 0; t < problem.touches().size(); ++t) {
    if (problem.touches()[t].set != TouchSet::kCheck || problem.block_of(t) < 0) continue;
    const TargetBlock& block = problem.blocks()[problem.block_of(t)];
    const int rows = problem.rows(t), shared = problem.shared_size();
    Eigen::VectorXd residual(rows);
    RowMajor by_shared(rows, shared), by_target(rows, block.size());
    problem.residual_m(t, x.data(), x.data() + block.first, residual.data(), by_shared.data(),
                       by_target.data());
    RowMajor j = RowMajor::Zero(rows, problem.size());
    j.leftCols(shared) = by_shared;
    j.middleCols(block.first, block.size()) = by_target;
    const Eigen::VectorXd variance = (j * c.covariance).cwiseProduct(j).rowwise().sum().array() +
                                     std::pow(problem.sigma_m(t), 2);
    sum += residual.cwiseAbs2().cwiseQuotient(variance).sum();
    count += rows;
  }
  return count == 0 ? 0.0 : std::sqrt(sum / count);
}

}  // namespace

Verdict judge(const Problem& problem, const Calibration& c) {
  Verdict verdict;
  const auto touches = problem.touches();
  int fit = 0, outliers = 0;
  for (const TouchResidual& r : c.residuals) {
    if (touches[r.touch].set != TouchSet::kFit) continue;
    ++fit;
    if (r.outlier) ++outliers;
  }
  std::vector<std::string> blocking;
  if (c.chi2_per_dof > kChi2Limit)
    blocking.push_back(fmt::format(
        "chi^2: the touches scatter {:.1f} times more than the cell file states ({:.3f} instead of "
        "{:.3f} mm)",
        std::sqrt(c.chi2_per_dof), c.touch_noise_m * 1e3, problem.cell().touch_sigma_m * 1e3));
  if (outliers > kOutlierShare * fit)
    blocking.push_back(fmt::format("outliers: {} of {} fit touches are not what the sphere allows",
                                   outliers, fit));
  for (const TargetBlock& block : problem.blocks()) {
    const Target& target = problem.cell().targets[block.target];
    if (target.kind == TargetKind::kPoint) continue;  // one touch tells all three directions
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    int count = 0;
    for (const TouchResidual& r : c.residuals) {
      if (touches[r.touch].target != target.id || r.outlier ||
          touches[r.touch].set != TouchSet::kFit)
        continue;
      information += r.direction * r.direction.transpose() / std::pow(problem.sigma_m(r.touch), 2);
      ++count;
    }
    const double least =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(information).eigenvalues()[0];
    if (!(least * kPlaceSigmaM * kPlaceSigmaM > 1.0))
      blocking.push_back(fmt::format(
          "too few directions: {} was touched {} times in directions too much alike; touch it from "
          "more sides",
          target.id, count));
  }
  if (problem.rho() >= 0) {
    const double off_m = c.parameters[static_cast<std::size_t>(problem.rho())].correction;
    const double sigma_m = problem.unknowns()[problem.rho()].scale;
    if (std::abs(off_m) > kFarRadius * sigma_m)
      blocking.push_back(fmt::format(
          "effective radius: the tip meets the spheres {:+.2f} mm from where diameter and tip "
          "radius "
          "put it, {:.0f} times radius_offset_sigma_mm; check diameter_mm and tip_radius_mm",
          off_m * 1e3, std::abs(off_m) / sigma_m));
  }
  for (int p = 0; p < problem.arm_size(); ++p) {
    const ArmParameterKind kind = problem.arm().parameters()[p].kind;
    if (kind > ArmParameterKind::kBeta && kind != ArmParameterKind::kTcp) continue;
    const ParameterResult& found = c.parameters[static_cast<std::size_t>(p)];
    const double tolerances = std::abs(found.correction) / problem.unknowns()[p].scale;
    if (tolerances > kFarFromDrawing)
      blocking.push_back(fmt::format(
          "far from the drawing: {} is off by {:.3g} {}, {:.0f} times its tolerance; is it the "
          "right "
          "robot file, and is the arm mastered? If both are so, state a larger tolerance",
          found.name, found.correction * found.to_unit, found.unit, tolerances));
  }
  if (const double ratio = check_against_prediction(problem, c); ratio > kCheckRatio)
    blocking.push_back(
        fmt::format("check touches: held-out touches leave {:.3f} mm rms, {:.1f} times what the "
                    "calibration predicts for them",
                    c.check.rms_m * 1e3, ratio));

  verdict.publish = blocking.empty();
  verdict.workspace = !problem.lengths().empty();
  verdict.reasons = std::move(blocking);
  if (verdict.workspace)
    verdict.reasons.push_back(
        fmt::format("scope: {} certified length{} the scale, touched at both ends",
                    problem.lengths().size(), problem.lengths().size() == 1 ? " holds" : "s hold"));
  else
    verdict.reasons.push_back(
        "scope: no certified length was touched, so only the sphere's size holds the scale; the "
        "result claims nothing away from the targets. Touch a second sphere at a certified "
        "distance");
  if (c.check.count == 0)
    verdict.reasons.push_back("no check touches: the residuals are of the fit itself");
  return verdict;
}

}  // namespace cellcal::calib
