#include "calib/identify/verdict.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "calib/identify/frame.h"

namespace cellcal::calib {

namespace {

/// Residuals twice as large as stated leave chi^2/dof at 4: the noise is not what the cell file
/// says, or the arm has errors that the model lacks.
constexpr double kChi2Limit = 4.0;
constexpr double kOutlierShare = 0.10;
/// Held-out touches may be worse than the fit, but not by this much: then it is over-fitted.
constexpr double kCheckRatio = 4.0;
/// A target whose place is not known to this along its weakest axis (1 sigma, frame aside) was
/// touched from too few directions: its touches then say little about the arm.
constexpr double kPlaceSigmaM = 0.5e-3;

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
  const Eigen::MatrixXd covariance = without_frame(c.covariance, c.frame_basis);
  for (const TargetBlock& block : problem.blocks()) {
    const double sigma_m =
        std::sqrt(std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(
                                    covariance.block<3, 3>(block.first, block.first))
                                    .eigenvalues()[2]));
    if (sigma_m > kPlaceSigmaM)
      blocking.push_back(fmt::format(
          "too few directions: {} is known to {:.2f} mm only along its weakest axis; touch it from "
          "more sides",
          problem.cell().targets[block.target].id, sigma_m * 1e3));
  }
  if (c.check.count > 0 && c.after.rms_m > 0.0 &&
      c.check.rms_m > kCheckRatio * std::max(c.after.rms_m, c.touch_noise_m))
    blocking.push_back(fmt::format(
        "check touches: held-out touches leave {:.3f} mm rms, the fitted ones {:.3f} mm",
        c.check.rms_m * 1e3, c.after.rms_m * 1e3));

  verdict.publish = blocking.empty();
  verdict.workspace = !problem.lengths().empty();
  verdict.reasons = std::move(blocking);
  if (verdict.workspace)
    verdict.reasons.push_back(
        fmt::format("scope: {} certified length{} touched at both ends hold the scale",
                    problem.lengths().size(), problem.lengths().size() == 1 ? "" : "s"));
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
