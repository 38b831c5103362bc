#include "calib/estimate/seed_paper.h"

#include <Eigen/Core>
#include <cmath>

#include "calib/model/kinematics.h"
#include "calib/model/linear.h"

namespace cellcal::calib {

namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
constexpr int kCentre = 3;
/// The linear sphere fit has four unknowns.
constexpr std::size_t kLeastTouches = 4;

bool in_paper(ParameterKind kind) {
  return kind <= ParameterKind::kBeta || kind == ParameterKind::kDeflection;
}

/// One touch in the paper's model: p = nominal + a * x (Eq. 27).
struct LinearTouch {
  Vector3d nominal;
  MatrixXd a;  // 3 x parameters
};

LinearTouch linearise(const ArmModel& model, const std::vector<double>& joint_rad) {
  Eigen::Matrix3Xd a(3, model.size());
  LinearTouch touch{model.position(model.prepare(joint_rad), nullptr, a), a};
  for (int p = 0; p < model.size(); ++p)
    if (!in_paper(model.parameters()[p].kind)) touch.a.col(p).setZero();
  return touch;
}

/// Algebraic sphere fit: |p|^2 = 2 c.p + (r^2 - |c|^2), linear in c and the bracket.
Vector3d fit_centre(const std::vector<LinearTouch>& touches) {
  MatrixXd rows(touches.size(), 4);
  VectorXd squares(touches.size());
  const Vector3d origin = touches.front().nominal;  // near the points: keeps the squares small
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const Vector3d p = touches[i].nominal - origin;
    rows.row(i) << 2.0 * p.transpose(), 1.0;
    squares[i] = p.squaredNorm();
  }
  const VectorXd solution = least_squares(rows, squares);
  return origin + solution.head<3>();
}

/// Eq. 39, signed.
double distance_error(const LinearTouch& touch, const VectorXd& x, double radius) {
  const auto arm = x.head(x.size() - kCentre);
  return (touch.nominal + touch.a * arm - x.tail<kCentre>()).norm() - radius;
}

ResidualSummary summarise(const std::vector<LinearTouch>& touches, const VectorXd& x,
                          double radius) {
  ResidualSummary summary;
  for (const LinearTouch& touch : touches) {
    const double error = std::abs(distance_error(touch, x, radius));
    ++summary.count;
    summary.mean_m += error;
    summary.rms_m += error * error;
    summary.max_m = std::max(summary.max_m, error);
  }
  if (summary.count > 0) {
    summary.mean_m /= summary.count;
    summary.rms_m = std::sqrt(summary.rms_m / summary.count);
  }
  return summary;
}

/// Eqs. 32-38.
VectorXd solve(const std::vector<LinearTouch>& fit, VectorXd x, double radius,
               const PaperOptions& options, PaperTrace* trace) {
  const auto record = [&](double step) {
    if (trace == nullptr) return;
    const ResidualSummary summary = summarise(fit, x, radius);
    trace->iterations.push_back({summary.mean_m, summary.max_m, step});
  };
  const int arm = static_cast<int>(x.size()) - kCentre;
  MatrixXd jacobian(fit.size(), x.size());
  VectorXd f(fit.size());
  record(0.0);
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    for (std::size_t i = 0; i < fit.size(); ++i) {
      const Vector3d v = fit[i].nominal + fit[i].a * x.head(arm) - x.tail<kCentre>();
      f[i] = v.squaredNorm() - radius * radius;
      jacobian.row(i).head(arm) = 2.0 * v.transpose() * fit[i].a;
      jacobian.row(i).tail<kCentre>() = -2.0 * v.transpose();
    }
    const MatrixXd normal =
        jacobian.transpose() * jacobian + options.lambda * MatrixXd::Identity(x.size(), x.size());
    const VectorXd step = -pivoted_solve(normal, jacobian.transpose() * f);
    x += step;
    record(step.norm());
    if (!(step.norm() >= options.step_tolerance)) break;
  }
  if (!x.allFinite())
    throw IdentifyError(IdentifyError::Kind::kNotSolved,
                        "the paper's estimator diverged at lambda " +
                            std::to_string(options.lambda) + "; choose a larger lambda");
  return x;
}

const Target& only_sphere(const Cell& cell, const std::vector<Touch>& touches) {
  if (touches.empty())
    throw IdentifyError(IdentifyError::Kind::kUndetermined,
                        "no touches; the paper's estimator needs at least 4");
  const Target& target = cell.targets.at(cell.target_index(touches.front().target));
  for (const Touch& touch : touches)
    if (touch.target != target.id)
      throw IdentifyError(IdentifyError::Kind::kTouches, touch.target,
                          "the paper's estimator knows one sphere, but the touches lie on " +
                              target.id + " and " + touch.target +
                              "; leave one out or use the default method");
  if (target.kind != TargetKind::kSphere)
    throw IdentifyError(IdentifyError::Kind::kTouches, target.id,
                        "the paper's estimator knows spheres only, and " + target.id +
                            " is none; use the default method");
  return target;
}

std::vector<ParameterResult> parameters_of(const ArmModel& model, const Target& sphere,
                                           std::size_t target, const VectorXd& x) {
  std::vector<ParameterResult> results;
  for (int p = 0; p < model.size(); ++p) {
    const ArmParameter& parameter = model.parameters()[p];
    // Without a sigma of its own; the tolerance is used so that a bound derived from it is not too
    // small.
    results.push_back({parameter, parameter.unit, parameter.to_unit, 0.0, x[p], parameter.sigma,
                       in_paper(parameter.kind) ? DecidedBy::kData : DecidedBy::kPrior});
  }
  for (int axis = 0; axis < kCentre; ++axis) {
    const double nominal = sphere.has_centre ? sphere.centre_m[axis] : 0.0;
    results.push_back({target_parameter(ParameterKind::kCentre, target, axis), "mm", 1000.0,
                       nominal, x[model.size() + axis] - nominal, sphere.centre_sigma_m,
                       DecidedBy::kData});
  }
  return results;
}

}  // namespace

Calibration identify_paper(const Cell& cell, const std::vector<Touch>& touches,
                           const PaperOptions& options, PaperTrace* trace) {
  if (!(options.lambda > 0.0) || options.iterations < 1)
    throw IdentifyError(IdentifyError::Kind::kOptions,
                        "the paper's estimator needs lambda > 0 and at least one iteration");
  const Target& sphere = only_sphere(cell, touches);
  const double radius = sphere.diameter_m / 2.0 + cell.tool.tip_radius_m;
  const ArmModel model(cell.robot, cell.tool);

  std::vector<LinearTouch> all, fit, check;
  for (const Touch& touch : touches) {
    if (touch.joint_rad.size() != cell.robot.joints.size())
      throw IdentifyError(IdentifyError::Kind::kTouches,
                          "a touch has " + std::to_string(touch.joint_rad.size()) +
                              " joint angles, the robot " +
                              std::to_string(cell.robot.joints.size()) + " joints");
    if (!touch.tool.empty())
      throw IdentifyError(IdentifyError::Kind::kTouches,
                          "the paper's estimator knows one tool, but a touch is of " + touch.tool);
    all.push_back(linearise(model, touch.joint_rad));
    (touch.set == TouchSet::kFit ? fit : check).push_back(all.back());
  }
  if (fit.size() < kLeastTouches)
    throw IdentifyError(IdentifyError::Kind::kUndetermined, sphere.id,
                        "the paper's estimator needs at least " + std::to_string(kLeastTouches) +
                            " fit touches on " + sphere.id + ", found " +
                            std::to_string(fit.size()));

  VectorXd start = VectorXd::Zero(model.size() + kCentre);
  start.tail<kCentre>() = fit_centre(fit);
  const VectorXd x = solve(fit, start, radius, options, trace);

  Calibration result;
  result.cell = cell;
  result.method = "paper";
  result.parameters = parameters_of(model, sphere, cell.target_index(sphere.id), x);
  result.targets.push_back({sphere.id, x.tail<kCentre>(), radius});
  result.before = summarise(fit, start, radius);
  result.after = summarise(fit, x, radius);
  result.check_before = summarise(check, start, radius);
  result.check = summarise(check, x, radius);
  result.touch_noise_m = result.after.rms_m;
  for (std::size_t i = 0; i < all.size(); ++i) {
    TouchResidual residual;
    residual.touch = i;
    residual.before_m = distance_error(all[i], start, radius);
    residual.after_m = distance_error(all[i], x, radius);
    const double sigma = touches[i].sigma_m > 0.0 ? touches[i].sigma_m : cell.touch_sigma_m;
    residual.whitened = sigma > 0.0 ? residual.after_m / sigma : 0.0;
    residual.direction =
        (all[i].nominal + all[i].a * x.head(model.size()) - x.tail<kCentre>()).normalized();
    result.residuals.push_back(residual);
  }
  VectorXd variance(x.size());
  for (Eigen::Index p = 0; p < x.size(); ++p)
    variance[p] = result.parameters[p].sigma * result.parameters[p].sigma;
  result.covariance = variance.asDiagonal();
  result.frame_basis = MatrixXd(x.size(), 0);
  result.verdict.add({FindingKind::kReferenceMethod, Severity::kWithholds});
  return result;
}

}  // namespace cellcal::calib
