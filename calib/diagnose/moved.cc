#include "calib/diagnose/moved.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "calib/consistency/outliers.h"
#include "calib/consistency/session_order.h"
#include "calib/consistency/suspected_moves.h"
#include "calib/diagnose/trial.h"
#include "calib/estimate/discrepancy.h"

namespace cellcal::calib {

namespace {

/// Squared sigmas of a shift, three degrees of freedom, that are believed.
constexpr double kConfirmed = 25.0;

/// An arm that warms up grows by 25e-6 of what it reaches, and its play is not the same all day;
/// each makes targets seem to creep by about this, in each direction.
constexpr double kCreepM = 0.02e-3;

/// Squared sigmas for squared estimated ones: as unlikely, where the sigmas rest on so few degrees of
/// freedom (Student's t), as so many of known sigmas are.
double of_known_sigmas(double squared, double freedom) {
  constexpr double kAxes = 3.0;
  return (freedom + kAxes) * std::log1p(squared / freedom);  // (60a)
}

/// From a target's place to that where it stood later.
struct Shift {
  Eigen::Vector3d by_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();
  double variance_along() const { return by_m.dot(covariance_m2 * by_m) / by_m.squaredNorm(); }
};

Shift shift_of(const Calibration& two, const std::string& target, const std::string& later) {
  Shift shift;
  Eigen::MatrixXd by = Eigen::MatrixXd::Zero(3, two.covariance.cols());
  for (std::size_t p = 0; p < two.parameters.size(); ++p)
    for (int axis = 0; axis < 3; ++axis) {
      const auto is_of = [&](const std::string& id) {
        return two.parameters[p].key ==
               target_parameter(ParameterKind::kCentre, two.cell.target_index(id), axis);
      };
      const bool is_later = is_of(later);
      if (!is_later && !is_of(target)) continue;
      by(axis, static_cast<Eigen::Index>(p)) = is_later ? 1.0 : -1.0;
      shift.by_m[axis] +=
          (is_later ? 1.0 : -1.0) * (two.parameters[p].nominal + two.parameters[p].correction);
    }
  shift.covariance_m2 =
      by * two.covariance * by.transpose() + kCreepM * kCreepM * Eigen::Matrix3d::Identity();
  return shift;
}

/// Whether a target has no fit touch, or more of them are left out than gross errors would be: then
/// it does not stand where the others say either. Of a move that is known from the evidence of all
/// touches, a few may be on the wrong side.
bool disagree(const Calibration& c, const std::vector<Touch>& touches, const std::string& target,
              bool known) {
  const double most = known ? 0.4 : 0.2;
  const FitTouches own = fit_touches_of(target, touches, c);
  return own.all == 0 || own.left_out > most * own.all;
}

/// Identifies with the target taken as two and says by how much they lie apart; 0 where that does
/// not come out.
/// `without`: along it, where the model's own error was not estimated [m^2].
MovedTarget measured(const Cell& cell, const std::vector<Touch>& touches,
                     const IdentifyOptions& options, const Calibration& as_one, MovedTarget moved,
                     std::optional<double> without = {}) {
  std::optional<Eigen::Vector3d> centre_m;
  for (const TargetResult& t : as_one.targets)
    if (t.id == moved.target) centre_m = t.centre_m + moved.shift_m;
  const TwoPlaces places = as_two(cell, touches, moved.target, moved.after_touch, centre_m,
                                  std::max(kUsualMoveM, moved.shift_m.norm()));
  const bool known = moved.shift_m.norm() > 0.0;
  moved.squared_sigmas = 0.0;
  const std::optional<Calibration> found = tried(places.cell, places.touches, options);
  if (!found) return moved;  // too little on one side to tell
  const Calibration& two = *found;
  if (disagree(two, places.touches, moved.target, known) ||
      disagree(two, places.touches, places.later, known))
    return moved;
  // What the arm does beside its model pulls targets about, and touches of one posture share it.
  constexpr double kAsStated = 1.5;
  if (!options.with_discrepancy && !options.level &&
      (two.discrepancy.alike > kFieldSigmas || two.chi2_per_dof > kAsStated ||
       two.repeats.touches > 0)) {
    IdentifyOptions beside = options;
    beside.with_discrepancy = true;
    return measured(cell, touches, beside, as_one, std::move(moved),
                    shift_of(two, moved.target, places.later).variance_along());
  }
  const Shift shift = shift_of(two, moved.target, places.later);
  moved.shift_m = shift.by_m;
  moved.sigma_m = std::sqrt(shift.variance_along());
  moved.squared_sigmas = shift.by_m.dot(shift.covariance_m2.ldlt().solve(shift.by_m));  // (60)
  if (two.discrepancy.estimated && two.discrepancy.degrees_of_freedom > 0.0 && without) {
    // The error's share of the variance rests on few degrees of freedom, the rest on many.
    const double share = std::max(0.0, 1.0 - *without / shift.variance_along());
    if (share > 0.0)
      moved.squared_sigmas = of_known_sigmas(moved.squared_sigmas,
                                             two.discrepancy.degrees_of_freedom / (share * share));
  }
  return moved;
}

Finding finding_of(const Cell& cell, const std::vector<Touch>& touches, const MovedTarget& moved) {
  return {FindingKind::kMovedTarget, Severity::kWithholds,
          after(about_target(cell.targets[cell.target_index(moved.target)]), moved.after_touch,
                touches[moved.after_touch]),
          shift_in_mm(moved.shift_m, moved.sigma_m)};
}

}  // namespace

void confirm_moves(const Cell& cell, const std::vector<Touch>& touches,
                   const IdentifyOptions& options, Calibration& calibration) {
  std::optional<MovedTarget> worst;
  for (const MovedTarget& suspect : calibration.moved) {
    std::vector<Touch> kept = touches;
    if (!suspect.many_left_out)
      for (const Outlier& outlier : calibration.outliers)
        kept[outlier.touch].set = TouchSet::kCheck;
    MovedTarget moved = measured(cell, kept, options, calibration, suspect);
    if (moved.squared_sigmas > kConfirmed &&
        (!worst || moved.squared_sigmas > worst->squared_sigmas))
      worst = moved;
  }
  calibration.moved.clear();
  if (!worst) return;
  calibration.moved.push_back(*worst);
  calibration.verdict.publish = false;
  auto& findings = calibration.verdict.findings;
  findings.insert(findings.begin(), finding_of(cell, touches, *worst));
}

}  // namespace cellcal::calib
