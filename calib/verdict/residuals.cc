#include "calib/verdict/residuals.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "calib/estimate/parallel.h"
#include "calib/estimate/solve.h"
#include "calib/estimate/start.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "calib/verdict/held_out.h"

namespace cellcal::calib {

ResidualSummary summary_of(std::span<const double> residuals_m) {
  ResidualSummary summary;
  for (const double residual_m : residuals_m) {
    const double size = std::abs(residual_m);
    summary.mean_m += size;
    summary.max_m = std::max(summary.max_m, size);
    summary.rms_m += size * size;
  }
  if (residuals_m.empty()) return summary;
  summary.count = static_cast<int>(residuals_m.size());
  summary.mean_m /= summary.count;
  summary.rms_m = std::sqrt(summary.rms_m / summary.count);
  return summary;
}

Eigen::VectorXd first_values(const Calibration& calibration, Eigen::Index count) {
  Eigen::VectorXd x(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const ParameterResult& p = calibration.parameters[static_cast<std::size_t>(i)];
    x[i] = p.nominal + p.correction;
  }
  return x;
}

Eigen::VectorXd place_seen_by_nominal_arm(const Problem& problem, int block,
                                          const std::vector<bool>& outlier) {
  const TargetBlock& own = problem.blocks()[static_cast<std::size_t>(block)];
  const Target& target = problem.cell().targets[own.target];
  const TargetPlace& start = problem.place(own);
  const auto touches = problem.touches();
  std::vector<Eigen::Vector3d> points, readings;
  std::vector<double> radii;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    if (problem.block_of(i) != block || outlier[i] || touches[i].set != TouchSet::kFit) continue;
    points.push_back(problem.arm().position(problem.pose(i), nullptr));
    readings.emplace_back(touches[i].tracker_m[0], touches[i].tracker_m[1],
                          touches[i].tracker_m[2]);
    radii.push_back(target.kind == TargetKind::kWire
                        ? touches[i].radius_m
                        : problem.nominal_radius_m(target, problem.tool_of(i)));
  }
  TargetPlace place = start;
  if (target.kind == TargetKind::kPlane) {
    double tip_m = 0.0;
    for (const double r : radii) tip_m = std::max(tip_m, r);
    // With the larger ball's radius the centre would have been farther off by the difference.
    for (std::size_t i = 0; i < points.size(); ++i)
      if (radii[i] < tip_m) points[i] += (tip_m - radii[i]) * start.axes.col(2);
    place = plane_through(points, tip_m, start);
  } else if (target.kind == TargetKind::kTracker) {
    const FrameFit fit = fit_frame(readings, points);
    if (fit.determined) {
      place.centre_m = fit.frame * fit.middle_m;
      place.axes = fit.frame.linear();
      place.middle_m = fit.middle_m;
    }
  } else if (target.kind == TargetKind::kPoint) {
    place.centre_m = mean_of_points(points);
  } else {
    const CentreHints hints{target.has_centre ? &target.centre_m : nullptr, target.centre_sigma_m};
    place.centre_m = fit_centre(points, radii, hints).centre_m;
  }
  return unknowns_at(target.kind, start, place);
}

namespace {

/// Unknowns that do not belong to the arm: the tool's tip, if the cell file leaves it open, the
/// radius offset, and each target's place and radius.
std::vector<int> beside_the_arm(const Problem& problem) {
  std::vector<int> beside;
  for (int i = 0; i < problem.size(); ++i)
    if (i >= problem.arm_size() ||
        problem.arm().parameters()[static_cast<std::size_t>(i)].kind == ParameterKind::kTcp)
      beside.push_back(i);
  return beside;
}

/// The nominal arm with all other unknowns fitted to its fit touches; `x_si` has the targets'
/// places already, which is complete if nothing else is open. A touch of a nominal arm has a sigma
/// of a millimetre; the cell file's statements are priors of the others.
void fit_outside_arm(const Problem& problem, const std::vector<bool>& outlier,
                     Eigen::VectorXd& x_si) {
  constexpr double kWorthM = 1e-3;
  constexpr int kRounds = 6;
  constexpr double kSettled = 1e-6;
  const std::vector<int> beside = beside_the_arm(problem);
  std::size_t places = 0;
  for (const TargetBlock& block : problem.blocks()) places += static_cast<std::size_t>(block.place);
  if (beside.size() == places) return;
  std::vector<bool> use = fit_touches(problem);
  for (std::size_t i = 0; i < use.size(); ++i) use[i] = use[i] && !outlier[i];
  Eigen::VectorXd u = problem.to_u(x_si);
  Linearisation linear;
  for (int round = 0; round < kRounds; ++round) {
    linearise(problem, u, use, linear);
    for (const auto& [touch, row] : linear.touch_row)
      for (int k = row; k < row + problem.rows(touch); ++k) {
        linear.jacobian.row(k) *= problem.sigma_m(touch) / kWorthM;
        linear.residual[k] *= problem.sigma_m(touch) / kWorthM;
      }
    const Eigen::MatrixXd j = linear.jacobian.topRows(linear.length_row)(Eigen::all, beside);
    Eigen::MatrixXd information = j.transpose() * j;
    Eigen::VectorXd pull = j.transpose() * linear.residual.head(linear.length_row);
    for (Eigen::Index k = 0; k < pull.size(); ++k) {
      const int i = beside[static_cast<std::size_t>(k)];
      constexpr double kFlat = 1e-8;
      const Unknown& unknown = problem.unknowns()[i];
      const double precision = std::pow(unknown.prior_weight, 2);
      information(k, k) += std::max(kFlat, precision);
      pull[k] += precision * (u[i] - unknown.prior_mean_u);
    }
    const Eigen::VectorXd step = pivoted_solve(information, pull);
    if (!step.allFinite()) return;
    for (Eigen::Index k = 0; k < step.size(); ++k)
      u[beside[static_cast<std::size_t>(k)]] -= step[k];
    if (step.lpNorm<Eigen::Infinity>() < kSettled) break;
  }
  x_si = problem.to_si(u);
}

/// Leverage above which a touch is determined more by itself than by the others.
constexpr double kHoldsItself = 0.5;

/// Leverage of each touch left out on its own place, had it been used: with j its whitened rows and
/// S the covariance without it, j S j' / (1 + j S j'); mean of three rows.
std::vector<double> leverages(const Problem& problem, const Estimate& e,
                              const std::vector<TouchResidual>& residuals) {
  std::vector<double> result(problem.touches().size(), 0.0);
  std::vector<bool> left_out(problem.touches().size(), false);
  bool any = false;
  for (const TouchResidual& r : residuals)
    if (r.outlier) any = left_out[r.touch] = true;
  if (!any) return result;
  const Linearisation outside = linearise(problem, e.u, left_out);
  for (const auto& [touch, row] : outside.touch_row) {
    const int rows = problem.rows(touch);
    const RowMajor j = outside.jacobian.middleRows(row, rows);
    const Eigen::MatrixXd spread = j * e.posterior.covariance_u * j.transpose();
    const Eigen::MatrixXd held =
        (Eigen::MatrixXd::Identity(rows, rows) + spread).partialPivLu().solve(spread);
    result[touch] = held.trace() / rows;  // (22)
  }
  return result;
}

/// Fewer copies are accidental.
constexpr std::size_t kLeast = 3;
constexpr double kShare = 0.05;
/// Angles of fewer digits may agree by chance at a repeated place: at a reach of a metre one step
/// of the last digit is 0.02 mm.
constexpr double kStepDeg = 1e-3;
/// Likewise a tracker's readings; its angles are often those of the program, equal at each visit.
constexpr double kStepMm = 0.01;

bool has_few_digits(const Touch& touch) {
  const auto is_rounded_mm = [](double value_m) {
    const double steps = value_m * kMmPerM / kStepMm;
    return std::abs(steps - std::round(steps)) < 1e-4;
  };
  const bool read = std::ranges::any_of(touch.tracker_m, [](double m) { return m != 0.0; });
  return is_rounded(touch, kStepDeg) ||
         (read && std::ranges::all_of(touch.tracker_m, is_rounded_mm));
}

bool is_copy(const Touch& a, const Touch& b) {
  return same_reading(a, b) && a.target == b.target && a.tool == b.tool && a.load == b.load;
}

/// Another reading at the same posture.
bool is_visit(Touch a, const Touch& b) {
  std::ranges::copy(b.tracker_m, a.tracker_m);
  a.tracker_abc_rad = b.tracker_abc_rad;
  return is_copy(a, b);
}

/// The touches in the order of the joint that they spread most, and its index.
std::pair<std::vector<std::size_t>, std::size_t> by_widest_joint(std::span<const Touch> touches) {
  std::size_t widest = 0;
  double range_rad = -1.0;
  for (std::size_t j = 0; !touches.empty() && j < touches[0].joint_rad.size(); ++j) {
    const auto angle = [j](const Touch& touch) { return touch.joint_rad[j]; };
    const auto [least, most] = std::ranges::minmax_element(touches, {}, angle);
    if (angle(*most) - angle(*least) <= range_rad) continue;
    range_rad = angle(*most) - angle(*least);
    widest = j;
  }
  std::vector<std::size_t> order(touches.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t i) { return touches[i].joint_rad[widest]; });
  return {order, widest};
}

/// For each touch the last earlier one that it copies.
std::vector<std::optional<std::size_t>> originals(std::span<const Touch> touches) {
  constexpr double kWithinRad = 0.01 * kRadPerDeg;  // same_reading() allows half of it
  const auto [order, joint] = by_widest_joint(touches);
  std::vector<std::optional<std::size_t>> result(touches.size());
  for (std::size_t a = 0; a < order.size(); ++a) {
    const double until_rad = touches[order[a]].joint_rad[joint] + kWithinRad;
    for (std::size_t b = a + 1; b < order.size() && touches[order[b]].joint_rad[joint] <= until_rad;
         ++b) {
      const auto [first, second] = std::minmax(order[a], order[b]);
      if (result[second].value_or(0) <= first && is_copy(touches[first], touches[second]))
        result[second] = first;
    }
  }
  return result;
}

}  // namespace

void fill_residuals(const Problem& problem, const Eigen::VectorXd& x_si,
                    const std::vector<bool>& outlier, Calibration& calibration) {
  const auto touches = problem.touches();
  // The nominal arm, with its own fit of each target's place.
  Eigen::VectorXd nominal_x = Eigen::VectorXd::Zero(problem.size());
  for (std::size_t b = 0; b < problem.blocks().size(); ++b)
    nominal_x.segment(problem.blocks()[b].first, problem.blocks()[b].place) =
        place_seen_by_nominal_arm(problem, static_cast<int>(b), outlier);
  fit_outside_arm(problem, outlier, nominal_x);
  const Problem::At nominal = problem.at(nominal_x.data()), found = problem.at(x_si.data());
  calibration.residuals.resize(touches.size());
  by_parts(touches.size(), [&](std::size_t, std::size_t first, std::size_t behind) {
    for (std::size_t i = first; i < behind; ++i) {
      const int rows = problem.place_rows(i);
      TouchResidual& entry = calibration.residuals[i];
      entry.touch = i;
      entry.outlier = outlier[i];
      if (problem.block_of(i) < 0) {
        constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
        entry.before_m = entry.after_m = entry.whitened = kUnknown;
        continue;
      }
      double r[Problem::kMostRows];
      problem.residual_m(i, nominal, r, nullptr, nullptr);
      entry.before_m = rows == 1 ? r[0] : Eigen::Map<Eigen::Vector3d>(r).norm();
      problem.residual_m(i, found, r, nullptr, nullptr, &entry.direction);
      entry.after_m = rows == 1 ? r[0] : Eigen::Map<Eigen::Vector3d>(r).norm();
      entry.whitened = entry.after_m / problem.sigma_m(i);
    }
  });
  calibration.unseen = judge_unseen(problem, x_si, calibration);
  std::vector<double> before, after, check_before, check;
  for (const TouchResidual& entry : calibration.residuals) {
    if (entry.outlier || std::isnan(entry.after_m)) continue;
    const bool fit = touches[entry.touch].set == TouchSet::kFit;
    (fit ? before : check_before).push_back(entry.before_m);
    (fit ? after : check).push_back(entry.after_m);
  }
  calibration.before = summary_of(before);
  calibration.after = summary_of(after);
  calibration.check_before = summary_of(check_before);
  calibration.check = summary_of(check);
}

std::optional<std::string> lies_on(const Problem& problem, const Calibration& calibration,
                                   const TouchResidual& residual) {
  constexpr double kInconsistentM = 10e-3;
  constexpr double kOnAnotherM = 1e-3;
  if (std::abs(residual.after_m) < kInconsistentM) return std::nullopt;
  const Eigen::VectorXd x = first_values(calibration, problem.arm_size());
  const ArmModel& arm = problem.arm();
  const Touch& touch = problem.touches()[residual.touch];
  for (const TargetResult& target : calibration.targets) {
    if (target.id == touch.target) continue;
    const Target& stated = problem.cell().targets[problem.cell().target_index(target.id)];
    const Eigen::Vector3d tip_m = arm.position(pose_of(arm, touch, stated), x.data());
    double off_m = 0.0;
    switch (target.kind) {
      case TargetKind::kSphere:
      case TargetKind::kPoint:
        off_m = (tip_m - target.centre_m).norm() - target.effective_radius_m;
        break;
      case TargetKind::kPlane:
        off_m = (tip_m - target.centre_m).dot(target.normal) - target.effective_radius_m;
        break;
      case TargetKind::kWire:
      case TargetKind::kTracker: continue;  // the reading there is unknown
    }
    if (std::abs(off_m) < kOnAnotherM) return target.id;
  }
  return std::nullopt;
}

FitTouches fit_touches_of(const std::string& target, std::span<const Touch> touches,
                          const Calibration& calibration) {
  FitTouches own;
  for (const TouchResidual& r : calibration.residuals) {
    if (touches[r.touch].target != target || touches[r.touch].set != TouchSet::kFit) continue;
    ++own.all;
    own.left_out += r.outlier ? 1 : 0;
  }
  return own;
}

std::vector<Outlier> named_outliers(const Problem& problem, const Estimate& estimate,
                                    const Calibration& calibration) {
  const std::vector<double> leverage = leverages(problem, estimate, calibration.residuals);
  std::vector<Outlier> outliers;
  for (const TouchResidual& r : calibration.residuals) {
    if (!r.outlier || problem.touches()[r.touch].set != TouchSet::kFit) continue;
    const std::string& id = problem.touches()[r.touch].target;
    Outlier outlier{r.touch, r.after_m, leverage[r.touch], OutlierKind::kOffItsTarget, id};
    outlier.target_kind = problem.cell().targets[problem.cell().target_index(id)].kind;
    outlier.sigmas = std::abs(r.whitened);
    if (const auto other = lies_on(problem, calibration, r)) {
      outlier.kind = OutlierKind::kOnAnotherTarget;
      outlier.lies_on = *other;
    } else if (outlier.leverage > kHoldsItself) {
      outlier.kind = OutlierKind::kHoldsItself;
    }
    outliers.push_back(std::move(outlier));
  }
  return outliers;
}

std::optional<Finding> duplicate_touches(std::span<const Touch> touches) {
  const auto original = originals(touches);
  // Whole sections repeated in the same order, or too many digits that agree. Visits that an instrument of few digits
  // reads alike by chance are between others that it reads differently.
  constexpr std::size_t kInOrderPerDifferent = 9, kLongRun = 20;
  std::size_t all = 0, in_order = 0, in_long_runs = 0, run = 0, different = 0, fine = 0,
              first = touches.size();
  std::optional<std::size_t> place;  // of the touch before in the section that it repeats
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const std::size_t next = place ? *place + 1 : i;
    const bool goes_on = next < i && is_copy(touches[next], touches[i]);
    place = goes_on ? next : original[i];
    run = goes_on ? run + 1 : 0;
    in_order += run > 0 ? 1 : 0;
    in_long_runs += run > kLongRun ? 1 : run == kLongRun ? kLongRun : 0;
    if (next < i && !goes_on && is_visit(touches[i], touches[next])) ++different;
    if (!original[i]) continue;
    first = std::min(first, i);
    ++all;
    fine += has_few_digits(touches[i]) || has_few_digits(touches[*original[i]]) ? 0 : 1;
  }
  if (in_order < kInOrderPerDifferent * different) in_order = in_long_runs;
  if (all < kLeast || static_cast<double>(all) <= kShare * static_cast<double>(touches.size()) ||
      2 * std::max(in_order, fine) < all)
    return std::nullopt;
  return Finding{FindingKind::kDuplicateTouches,
                 Severity::kWithholds,
                 {},
                 {{"duplicates", all}, {"touches", touches.size()}},
                 {{about_touch(first, touches[first]), {}},
                  {about_touch(*original[first], touches[*original[first]]), {}}}};
}

}  // namespace cellcal::calib
