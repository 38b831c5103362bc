#include "calib/verdict/session_order.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "calib/estimate/estimate.h"
#include "calib/estimate/joint_functions.h"
#include "calib/estimate/repeats.h"
#include "calib/estimate/target.h"
#include "calib/model/iso_time.h"
#include "calib/model/long_work.h"
#include "calib/model/product.h"
#include "calib/result/level.h"
#include "calib/verdict/residuals.h"

namespace cellcal::calib {

std::vector<std::size_t> in_order(std::span<const Touch> touches) {
  std::vector<std::size_t> order(touches.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::vector<double> seconds;
  for (const Touch& touch : touches) {
    const auto time = seconds_of(touch.time);
    if (!time) return order;
    seconds.push_back(*time);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return seconds[a] < seconds[b]; });
  return order;
}

void add_rank(std::span<const Touch> touches, std::size_t index, std::vector<Quantity>& evidence) {
  const std::vector<std::size_t> order = in_order(touches);
  if (std::ranges::is_sorted(order)) return;
  const auto behind = std::ranges::find(order, index) + 1;
  evidence.push_back({"rank", behind - order.begin()});
}

std::vector<std::size_t> share_of(std::span<const Touch> touches, std::size_t most) {
  const std::size_t every = (touches.size() + most - 1) / most;
  std::map<std::pair<std::string, TouchSet>, std::size_t> seen;
  std::vector<std::size_t> share;
  for (const std::size_t i : in_order(touches))
    if (seen[{touches[i].target, touches[i].set}]++ % every == 0) share.push_back(i);
  std::sort(share.begin(), share.end());
  return share;
}

TwoPlaces as_two(const Cell& cell, const std::vector<Touch>& touches, const std::string& target,
                 std::size_t after_touch, const std::optional<Eigen::Vector3d>& centre_m,
                 double sigma_m) {
  Target later = cell.targets[cell.target_index(target)];
  do later.id += " later";
  while (std::ranges::find(cell.targets, later.id, &Target::id) != cell.targets.end());
  TwoPlaces two{cell, touches, later.id};
  later.centre_sigma_m = 0.0;
  if (centre_m) {
    later.has_centre = true;
    later.centre_m = *centre_m;
    later.centre_sigma_m = sigma_m;
  }
  two.cell.targets.push_back(later);
  bool passed = false;
  for (const std::size_t i : in_order(touches)) {
    if (passed && two.touches[i].target == target) two.touches[i].target = later.id;
    passed = passed || i == after_touch;
  }
  return two;
}

int jump_columns(const Problem& problem) { return problem.arm().joint_count() + 3; }

void by_jumps(const Problem& problem, const Problem::At& at, std::size_t touch, JumpRows& rows) {
  double residual[Problem::kMostRows];
  Eigen::Vector3d direction;
  problem.residual_m(touch, at, residual, nullptr, nullptr, &direction);
  ArmChain chain;
  problem.arm().walk(problem.pose(touch), at.arm, chain);
  const int joints = problem.arm().joint_count(), count = problem.rows(touch);
  const auto first = static_cast<int>(problem.arm().robot().first_turning());
  rows.leftCols(first).setZero();
  for (int k = 3; k < count; ++k) {  // rotations: a joint's axis, and no effect of a displaced tip
    const double lever = problem.turn_lever_m(touch) / problem.sigma_m(touch);
    for (int i = first; i < joints; ++i)
      rows(k, i) = problem.arm().robot().joints[static_cast<std::size_t>(i)].sign * lever *
                   chain.link[static_cast<std::size_t>(i)].z[k - 3];
    rows.row(k).tail<3>().setZero();
  }
  for (int k = 0; k < problem.place_rows(touch); ++k) {
    const Eigen::Vector3d n = (count == 1 ? direction : Eigen::Vector3d(Eigen::Vector3d::Unit(k))) /
                              problem.sigma_m(touch);
    for (int i = first; i < joints; ++i) {
      const auto& link = chain.link[static_cast<std::size_t>(i)];
      const int sign = problem.arm().robot().joints[static_cast<std::size_t>(i)].sign;
      rows(k, i) = sign * n.dot(link.z.cross(chain.tip - link.z_origin));
    }
    rows.row(k).tail<3>() = n.transpose() * chain.flange;
  }
}

JumpSequence::JumpSequence(const Cell& cell, const std::vector<Touch>& touches,
                           const Calibration& c)
    : levelled_(
          at_level(with_learnt_of(c.cell.robot, cell), {1.0, 1.0, 0.0, c.level.play}, touches)),
      arm_(levelled_),
      problem_(levelled_, arm_, touches, starting_places(levelled_, arm_, touches)) {
  weigh_repeats(problem_);
  problem_.set_ripple(c.level.ripple_rad);
  const int n = problem_.size();
  if (c.parameters.size() != static_cast<std::size_t>(n))
    throw std::invalid_argument("JumpSequence: the calibration is of another model level");
  const Eigen::VectorXd x = first_values(c, n), u = problem_.to_u(x);
  const std::vector<bool> fit = fit_touches(problem_);
  linear_ = linearise(problem_, u, fit);
  set_prior(c, u);
  fill_columns(x);
  for (const std::size_t i : in_order(touches))
    if (fit[i]) order_.push_back(i);
  row_.resize(touches.size(), -1);
  for (const auto& [touch, row] : linear_.touch_row) row_[touch] = row;
}

std::optional<FoundJump> JumpSequence::robust(const JumpSuspect& suspect) const {
  constexpr double kStep = 3.0;
  constexpr int kRoundsAtGate = 3;
  Eigen::VectorXd residual = linear_.residual;
  double width =
      std::max(kOutlierSigma, residual.head(linear_.length_row).lpNorm<Eigen::Infinity>());
  std::optional<FoundJump> found;
  for (int at_gate = 0; at_gate < kRoundsAtGate;) {
    poll_cancelled();
    const double gate = kOutlierSigma * std::max(1.0, scatter(residual));
    if (width <= gate) ++at_gate;
    width = std::max(width, gate);
    const Eigen::VectorXd weight = weights(residual, width);
    found = best_place(suspect, weight, {}, residual);  // (51)
    if (!found) return {};
    width /= kStep;
  }
  return found;
}

std::optional<FoundJump> JumpSequence::at(const JumpSuspect& suspect, std::size_t behind) const {
  Eigen::VectorXd residual = linear_.residual;
  const double gate = kOutlierSigma * std::max(1.0, scatter(residual));
  return best_place(suspect, weights(residual, gate), behind, residual);
}

std::size_t JumpSequence::placed(const JumpSuspect& suspect, const FoundJump& found) const {
  std::vector<double> jumped(order_.size()), not_jumped = jumped;
  for (std::size_t k = 0; k < order_.size(); ++k) {
    const int row = row_[order_[k]], rows = problem_.rows(order_[k]);
    const Eigen::VectorXd is = linear_.residual.segment(row, rows);
    const Eigen::VectorXd by = by_jump_.block(row, suspect.first, rows, suspect.size) * found.size;
    const auto cost = [&](const Eigen::VectorXd& r) {
      return std::min(r.squaredNorm(), kOutlierSigma * kOutlierSigma);
    };
    jumped[k] = cost(k >= found.behind ? is : Eigen::VectorXd(is + by));
    not_jumped[k] = cost(k >= found.behind ? Eigen::VectorXd(is - by) : is);
  }
  double sum = std::accumulate(jumped.begin(), jumped.end(), 0.0);
  std::vector<double> total(order_.size());
  for (std::size_t k = 0; k < order_.size(); ++k) {
    total[k] = sum;
    sum += not_jumped[k] - jumped[k];
  }
  std::size_t best = found.behind;
  for (std::size_t k = kLeastEachSide; k + kLeastEachSide <= order_.size(); ++k)
    if (total[k] < total[best]) best = k;
  return best;
}

void JumpSequence::set_prior(const Calibration& c, const Eigen::VectorXd& u) {
  constexpr double kLeastTransmission = 0.3;
  const double transmission = std::max(kLeastTransmission, c.level.transmission);
  const int n = problem_.size();
  information_ = Eigen::MatrixXd::Zero(n, n);
  gradient_ = Eigen::VectorXd::Zero(n);
  for (int i = 0; i < n; ++i) {
    const Unknown& unknown = problem_.unknowns()[static_cast<std::size_t>(i)];
    double weight = unknown.prior_weight;
    if (i < problem_.arm_size()) {
      const ParameterKind kind = arm_.parameters()[static_cast<std::size_t>(i)].kind;
      if (is_transmission(kind)) weight /= transmission;
    }
    information_(i, i) = weight * weight;
    gradient_[i] = weight * weight * (u[i] - unknown.prior_mean_u);
  }
  const Eigen::Index lengths = linear_.jacobian.rows() - linear_.length_row;
  information_.noalias() +=
      linear_.jacobian.bottomRows(lengths).transpose() * linear_.jacobian.bottomRows(lengths);
  gradient_.noalias() +=
      linear_.jacobian.bottomRows(lengths).transpose() * linear_.residual.tail(lengths);
}

void JumpSequence::fill_columns(const Eigen::VectorXd& x) {
  const int own = jump_columns(problem_), joints = own - 3;
  for (int i = static_cast<int>(arm_.robot().first_turning()); i < joints; ++i)
    suspects_.push_back({Jump::What::kJoint, arm_.robot().joints[static_cast<std::size_t>(i)].name,
                         static_cast<std::size_t>(i), i, 1, kUsualSlipRad});
  suspects_.push_back({Jump::What::kTool, "tool", 0, joints, 3, kUsualKnockM});
  Eigen::Index columns = own;
  for (const TargetBlock& block : problem_.blocks()) {
    const Target& target = levelled_.targets[block.target];
    if (!has_two_places(target.kind)) continue;
    suspects_.push_back(
        {Jump::What::kTarget, target.id, block.target, columns, 3, kUsualKnockM, block.first});
    columns += 3;
  }
  by_jump_ = Eigen::MatrixXd::Zero(linear_.length_row, columns);
  const Problem::At at = problem_.at(x.data());
  JumpRows g(Problem::kMostRows, own);
  for (const auto& [touch, row] : linear_.touch_row) {
    const int rows = problem_.rows(touch);
    by_jumps(problem_, at, touch, g);
    by_jump_.block(row, 0, rows, own) = g.topRows(rows);
  }
  for (const JumpSuspect& s : suspects_)
    if (s.what == Jump::What::kTarget)
      by_jump_.middleCols(s.first, 3) =
          linear_.jacobian.block(0, s.unknown, linear_.length_row, 3) /
          problem_.unknowns()[static_cast<std::size_t>(s.unknown)].scale;
}

double JumpSequence::scatter(const Eigen::VectorXd& residual) const {
  std::vector<double> size(residual.data(), residual.data() + linear_.length_row);
  for (double& r : size) r = std::abs(r);
  return median(std::move(size)) / kNormalMedian;
}

Eigen::VectorXd JumpSequence::weights(const Eigen::VectorXd& residual, double width) const {
  Eigen::VectorXd result(linear_.length_row);
  const double square = width * width;
  for (const auto& [touch, row] : linear_.touch_row) {
    const int rows = problem_.rows(touch);
    const double off = residual.segment(row, rows).lpNorm<Eigen::Infinity>();
    result.segment(row, rows).setConstant(std::pow(square / (square + off * off), 2));  // (52)
  }
  return result;
}

std::optional<FoundJump> JumpSequence::best_place(const JumpSuspect& suspect,
                                                  const Eigen::VectorXd& weight,
                                                  std::optional<std::size_t> only,
                                                  Eigen::VectorXd& residual) const {
  const Eigen::Index rows = linear_.length_row, d = suspect.size;
  const auto j = linear_.jacobian.topRows(rows);
  const auto r = linear_.residual.head(rows);
  const RowMajor weighed = weight.cwiseSqrt().asDiagonal() * j;
  Eigen::MatrixXd information = information_;
  add_square(1.0, weighed.transpose(), information);
  const Cholesky factor(information);
  if (!factor.positive()) return {};
  const Eigen::VectorXd gradient =
      gradient_ + j.transpose() * weight.cwiseProduct(Eigen::VectorXd(r));
  const Eigen::VectorXd step = -factor.solve(gradient);
  const Eigen::VectorXd left = r + j * step;
  const auto g = by_jump_.middleCols(suspect.first, d);
  // With L the information's factor: by rows L^-1 J' all other unknowns have unit covariance.
  const Eigen::MatrixXd lower = factor.whitened(Eigen::MatrixXd(j.transpose()));
  ChangeScore<> later(lower.rows(), d);
  FoundJump best;
  Eigen::MatrixXd best_by_all;
  std::size_t own = 0, all = 0;
  const auto involved = [&](std::size_t touch) {
    return suspect.what != Jump::What::kTarget ||
           levelled_.targets[suspect.index].id == problem_.touches()[touch].target;
  };
  for (const std::size_t touch : order_) all += involved(touch) ? 1 : 0;
  for (std::size_t k = order_.size(); k-- > 0;) {
    const std::size_t touch = order_[k];
    if (!involved(touch)) continue;
    ++own;
    for (Eigen::Index i = row_[touch]; i < row_[touch] + problem_.rows(touch); ++i)
      later.add(g.row(i), lower.col(i).transpose(), -left[i], weight[i]);
    if (only ? k != *only : own < kLeastEachSide || all - own < kLeastEachSide) continue;
    Eigen::MatrixXd free = later.square - later.by_all.transpose() * later.by_all;
    const double squared = squared_sigmas<Eigen::Dynamic>(free, later.gradient, suspect.usual);
    if (!only && squared <= best.squared_sigmas) continue;
    best.behind = k;
    best.squared_sigmas = squared;
    best.information = free;
    free.diagonal().array() += 1.0 / (suspect.usual * suspect.usual);
    best.size = pivoted_solve(free, later.gradient);
    best_by_all = later.by_all;
  }
  if (best.size.size() == 0) return {};
  const Eigen::VectorXd moved = step - factor.coloured(best_by_all * best.size);
  residual.head(rows) = r + j * moved;
  for (std::size_t k = best.behind; k < order_.size(); ++k) {
    const int row = row_[order_[k]], count = problem_.rows(order_[k]);
    residual.segment(row, count) += g.middleRows(row, count) * best.size;
  }
  return best;
}

}  // namespace cellcal::calib
