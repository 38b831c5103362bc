#include "calib/check/explain.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "calib/estimate/predict.h"
#include "calib/model/error.h"
#include "calib/result/level.h"

namespace cellcal::calib {

namespace {

/// Probability that a sensor that has proved to work misses a contact.
constexpr double kBlind = 1e-6;

/// Log probability that the search ends outside the surface.
double log_unmet_under(const Unmet& unmet, const PossibleChange& change, const Fitted& fitted) {
  if (change.kind == ChangeKind::kTouch)
    return std::log(kBlind);  // a touch alone has no effect on others
  const Changed at = changed(change, fitted.size, {unmet.at_end});
  const double gap = at.off_m[0];
  const double variance = unmet.sigma_m * unmet.sigma_m +
                          (at.by_size * fitted.covariance * at.by_size.transpose())(0, 0);
  return std::log(kBlind + (1.0 - kBlind) * normal_above(-gap / std::sqrt(variance)));
}

/// The sigma in the least known direction.
double largest_sigma(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, axes.eigenvalues()[2]));
}

constexpr double kCoverage = 2.0;

/// The arm with every error that a calibration may have identified.
Cell levelled(const Calibration& c) { return at_level(c.cell, {1.0, 1.0, 0.0, c.level.play}); }

std::vector<Touch> all_fit(std::vector<Touch> touches) {
  for (Touch& touch : touches) touch.set = TouchSet::kFit;
  return touches;
}

std::vector<TargetPlace> places_of(const Calibration& c, const std::vector<Touch>& touches) {
  std::vector<TargetPlace> places(c.cell.targets.size());
  for (const Touch& touch : touches) {
    const std::size_t t = c.cell.target_index(touch.target);
    const auto known = std::ranges::find(c.targets, touch.target, &TargetResult::id);
    if (c.cell.targets[t].kind != TargetKind::kSphere)
      throw IdentifyError(IdentifyError::Kind::kTouches, touch.target,
                          fmt::format("target {}: a check touches spheres only", touch.target));
    if (known == c.targets.end())
      throw IdentifyError(
          IdentifyError::Kind::kCalibration, touch.target,
          fmt::format("target {}: the calibration does not contain its place. Use one whose "
                      "session touched it",
                      touch.target));
    places[t] = TargetPlace(known->centre_m);
  }
  return places;
}

}  // namespace

Fitted fit(const PossibleChange& change, double usual, const std::vector<ForeseenContact>& contacts,
           const Cholesky& covariance) {
  const double prior = 1.0 / (usual * usual);
  Fitted fitted{Eigen::VectorXd::Zero(change.size), {}, 0.0};
  Eigen::VectorXd off;
  Eigen::MatrixXd by, information;
  const auto evaluate = [&](const Eigen::VectorXd& size) {
    const Changed at = changed(change, size, contacts);
    off = covariance.whitened(at.off_m);
    by = covariance.whitened(at.by_size);
    return off.squaredNorm() + prior * size.squaredNorm();
  };
  const double nothing = evaluate(fitted.size);
  double least = nothing;
  // Gauss-Newton iterations: for a shift of millimetres against a sphere of some ten millimetres, each
  // leaves a tenth or less.
  constexpr int kSteps = 12, kHalvings = 6;
  // Convergence threshold of a sum of squares whose differences are judged in integers.
  constexpr double kSettled = 1e-6;
  for (int k = 0; k < kSteps; ++k) {
    information = by.transpose() * by;
    information.diagonal().array() += prior;
    const Eigen::VectorXd pull = -(by.transpose() * off + prior * fitted.size);
    Eigen::VectorXd step = pivoted_solve(information, pull);
    if (pull.dot(step) < kSettled) break;  // predicted decrease
    double reached = evaluate(fitted.size + step);
    for (int h = 0; h < kHalvings && !(reached < least); ++h) {
      step /= 2.0;
      reached = evaluate(fitted.size + step);
    }
    if (!(reached < least)) break;
    fitted.size += step;
    least = reached;
  }
  const Cholesky factor(information);
  fitted.covariance = factor.inverse();
  fitted.log_likelihood =  // (95)
      0.5 * (nothing - least - factor.log_det() - change.size * std::log(usual * usual));
  return fitted;
}

Explanation explain(const PossibleChange& change, const std::vector<ForeseenContact>& contacts,
                    const Cholesky& covariance, const std::vector<Unmet>& unmet) {
  Explanation explanation;
  explanation.kind = change.kind;
  explanation.name = change.name;
  explanation.touch = change.kind == ChangeKind::kTouch ? change.index : 0;
  Fitted best;
  std::vector<double> logs;
  for (const double usual : change.usual) {
    Fitted one = fit(change, usual, contacts, covariance);
    for (const Unmet& touch : unmet) one.log_likelihood += log_unmet_under(touch, change, one);
    logs.push_back(one.log_likelihood);
    if (logs.size() == 1 || one.log_likelihood > best.log_likelihood) best = std::move(one);
  }
  double sum = 0.0;
  for (const double one : logs) sum += std::exp(one - best.log_likelihood);
  explanation.log_likelihood =
      best.log_likelihood + std::log(sum / static_cast<double>(logs.size()));
  put_size(best.size, best.covariance, explanation);
  return explanation;
}

double sigma_along(const Eigen::Matrix3d& covariance, const Eigen::Vector3d& v) {
  const double length = v.norm();
  const Eigen::Vector3d along =
      length > 0.0 ? Eigen::Vector3d(v / length) : Eigen::Vector3d(Eigen::Vector3d::UnitX());
  return std::sqrt(std::max(0.0, along.dot(covariance * along)));
}

void put_size(const Eigen::VectorXd& size, const Eigen::MatrixXd& covariance,
              Explanation& explanation) {
  if (size.size() == 1) {
    explanation.amount = size[0];
    explanation.sigma = std::sqrt(std::max(0.0, covariance(0, 0)));
  }
  if (size.size() < 3) return;
  explanation.shift_m = size.head<3>();
  const Eigen::Matrix3d of_shift = covariance.topLeftCorner<3, 3>();
  const double length = explanation.shift_m.norm(), widest = largest_sigma(of_shift);
  explanation.sigma = sigma_along(of_shift, explanation.shift_m);
  if (size.size() < 6) {
    const double least = length - kCoverage * explanation.sigma;
    if (kCoverage * widest <= length || least <= 0.0) return;
    explanation.amount = least;
    explanation.sigma = widest;
    return;
  }
  explanation.amount = size.tail<3>().norm();
  explanation.turn_sigma = largest_sigma(covariance.bottomRightCorner<3, 3>());
}

void share_out(std::vector<Explanation>& explanations, const std::vector<double>& weight) {
  double most = -std::numeric_limits<double>::infinity(), sum = 0.0;
  for (std::size_t k = 0; k < explanations.size(); ++k)
    most = std::max(most, explanations[k].log_likelihood + std::log(weight[k]));
  for (std::size_t k = 0; k < explanations.size(); ++k) {
    explanations[k].probability =
        std::exp(explanations[k].log_likelihood + std::log(weight[k]) - most);
    sum += explanations[k].probability;
  }
  for (Explanation& one : explanations) one.probability /= sum;
  std::ranges::stable_sort(explanations, std::greater{}, &Explanation::probability);
}

double log_unmet(const std::vector<Unmet>& unmet) {
  return static_cast<double>(unmet.size()) * std::log(kBlind);
}

KnownTouches::KnownTouches(const Calibration& c, const std::vector<Touch>& touches)
    : touches_(all_fit(touches)),
      cell_(levelled(c)),
      arm_(cell_),
      problem_(cell_, arm_, touches_, places_of(c, touches_)),
      x_(problem_.size()) {
  if (c.repeats.used_m > 0.0) problem_.set_noise(c.repeats.used_m);
  // At postures without a touch of the calibration, as in its bounds.
  problem_.set_ripple(ripple_elsewhere_rad(c));
  for (int i = 0; i < problem_.size(); ++i) {
    const Unknown& unknown = unknowns()[static_cast<std::size_t>(i)];
    const ParameterResult* found = find(c, unknown.key);
    x_[i] = found != nullptr ? found->nominal + found->correction : unknown.nominal;
  }
}

Eigen::VectorXd KnownTouches::off_m(const Eigen::VectorXd& x) const {
  const Problem::At here = problem_.at(x.data());
  Eigen::VectorXd off(static_cast<Eigen::Index>(touches_.size()));
  for (std::size_t t = 0; t < touches_.size(); ++t)
    problem_.residual_m(t, here, &off[static_cast<Eigen::Index>(t)], nullptr, nullptr);
  return off;
}

KnownTouches::RowMajor KnownTouches::rows(const Eigen::VectorXd& x) const {
  const Problem::At here = problem_.at(x.data());
  RowMajor j = RowMajor::Zero(static_cast<Eigen::Index>(touches_.size()), problem_.size());
  Eigen::RowVectorXd by_shared(problem_.shared_size());
  Eigen::Matrix<double, 1, TargetBlock::kMost> by_target;
  for (std::size_t t = 0; t < touches_.size(); ++t) {
    const TargetBlock& block = problem_.blocks()[static_cast<std::size_t>(problem_.block_of(t))];
    double residual = 0.0;
    problem_.residual_m(t, here, &residual, by_shared.data(), by_target.data());
    const auto row = static_cast<Eigen::Index>(t);
    j.row(row).head(problem_.shared_size()) = by_shared;
    j.row(row).segment(block.first, block.size()) = by_target.head(block.size());
  }
  return j;
}

void KnownTouches::add_carriers(const ArmChain& chain, int carriers,
                                ForeseenContact& contact) const {
  const std::vector<PositionerAxis>& axes = cell_.robot.positioner;
  for (std::size_t j = 0; j < static_cast<std::size_t>(carriers); ++j)
    contact.axes.push_back({-axes[j].sign * chain.carrier[j].z, chain.carrier[j].origin});
  if (carriers == 0) return;
  const ArmChain::Carrier& first = chain.carrier[0];
  Eigen::Matrix3d frame;  // of the first axis, without its errors
  frame << first.x, first.y, first.x.cross(first.y);
  contact.foot = {frame * axes[0].frame.linear().transpose(), first.origin};
}

ForeseenContact KnownTouches::contact(std::size_t t) const {
  const Problem::At here = problem_.at(x_.data());
  ForeseenContact contact;
  Eigen::Vector3d direction;
  double residual = 0.0;
  problem_.residual_m(t, here, &residual, nullptr, nullptr, &direction);
  ArmChain chain;
  arm_.walk(problem_.pose(t), here.arm, chain);
  contact.target = touches_[t].target;
  contact.tip_m = chain.tip;
  contact.flange = chain.flange;
  // A linear unit does not grow with the arm.
  contact.by_growth_m = chain.flange_origin - chain.link[cell_.robot.first_turning()].z_origin;
  const std::vector<Joint>& joints = cell_.robot.joints;
  for (std::size_t i = 0; i < joints.size(); ++i)
    contact.axes.push_back({joints[i].sign * chain.link[i].z, chain.link[i].z_origin});
  add_carriers(chain, problem_.pose(t).carriers, contact);
  const TargetBlock& block = problem_.blocks()[static_cast<std::size_t>(problem_.block_of(t))];
  contact.centre_m = Eigen::Map<const Eigen::Vector3d>(here.x + block.first);
  contact.radius_m = (contact.tip_m - contact.centre_m).norm() - residual;
  return contact;
}

}  // namespace cellcal::calib
