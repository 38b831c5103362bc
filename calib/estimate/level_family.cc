#include "calib/estimate/level_family.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "calib/estimate/parallel.h"

namespace cellcal::calib {

namespace {

/// Keeps a centre without prior, which turns with the frame, finite.
constexpr double kRegularisation = 1.0 + 1e-12;

/// Inverse of a lower triangle. A solve with the identity would take three times as long, since it
/// does not exploit that one half of the result is zero.
Eigen::MatrixXd inverse_of_lower(const Eigen::MatrixXd& lower) {
  const Eigen::Index n = lower.rows();
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index c = 0; c < n; ++c) {
    auto column = inverse.col(c);
    column[c] = 1.0;
    for (Eigen::Index k = c; k < n; ++k) {
      column[k] /= lower(k, k);
      column.tail(n - k - 1) -= column[k] * lower.col(k).tail(n - k - 1);
    }
  }
  return inverse;
}

}  // namespace

Groups::Groups(const Problem& problem) {
  std::vector<int> compliant, playing, wobbling;
  for (int i = 0; i < problem.size(); ++i) {
    const bool arm = i < problem.arm_size();
    const auto kind = arm ? problem.arm().parameters()[i].kind : ParameterKind::kTheta;
    (is_compliance(kind)            ? compliant
     : kind == ParameterKind::kPlay ? playing
     : is_transmission(kind)        ? wobbling
                                    : order)
        .push_back(i);
  }
  plain = static_cast<Eigen::Index>(order.size());
  compliance = static_cast<Eigen::Index>(compliant.size());
  play = static_cast<Eigen::Index>(playing.size());
  transmission = static_cast<Eigen::Index>(wobbling.size());
  order.insert(order.end(), compliant.begin(), compliant.end());
  order.insert(order.end(), playing.begin(), playing.end());
  order.insert(order.end(), wobbling.begin(), wobbling.end());
  precision.resize(problem.size());
  mean.resize(problem.size());
  for (Eigen::Index k = 0; k < precision.size(); ++k) {
    const Unknown& unknown = problem.unknowns()[order[static_cast<std::size_t>(k)]];
    precision[k] = unknown.prior_weight > 0.0 ? std::pow(unknown.prior_weight, 2) : kFlatPrecision;
    mean[k] = unknown.prior_mean_u;
  }
}

void gather(const Problem& problem, const Linearisation& at, const Groups& groups, Gathered& g) {
  // From the weights of the linearisation to those of this ripple.
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(at.residual.size());
  for (const auto& [touch, row] : at.touch_row) {
    const double own = problem.own_sigma_m(touch);
    const double sigma = problem.sigma_m(touch, g.ripple_rad);
    weight.segment(row, problem.rows(touch)).setConstant(problem.sigma_m(touch) / sigma);
    g.log_weight += 2.0 * problem.rows(touch) * std::log(own / sigma);  // (25), sum log w
  }
  const Eigen::Index n = problem.size();
  struct Sum {
    Eigen::MatrixXd gram;
    Eigen::VectorXd gradient;
    double square = 0.0;
  };
  const auto row_count = static_cast<std::size_t>(at.residual.size());
  std::vector<Sum> sums(parts_of(row_count),
                        {Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)});
  by_parts(row_count, [&](std::size_t part, std::size_t begin, std::size_t behind) {
    Sum& sum = sums[part];
    // By blocks that fit into the cache.
    constexpr Eigen::Index kRows = 128;
    const auto end = static_cast<Eigen::Index>(behind);
    RowMajor rows;
    Eigen::VectorXd residual;
    for (auto first = static_cast<Eigen::Index>(begin); first < end; first += kRows) {
      const Eigen::Index count = std::min(kRows, end - first);
      const auto w = weight.segment(first, count);
      rows = w.asDiagonal() * at.jacobian.middleRows(first, count);
      residual = w.cwiseProduct(at.residual.segment(first, count));
      sum.gram.selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
      sum.gradient.noalias() += rows.transpose() * residual;
      sum.square += residual.squaredNorm();
    }
  });
  Eigen::MatrixXd gram = std::move(sums[0].gram);
  Eigen::VectorXd gradient = std::move(sums[0].gradient);
  g.square += sums[0].square;
  for (std::size_t part = 1; part < sums.size(); ++part) {
    gram += sums[part].gram;
    gradient += sums[part].gradient;
    g.square += sums[part].square;
  }
  gram.triangularView<Eigen::StrictlyUpper>() = gram.transpose();
  g.gram += gram(groups.order, groups.order);
  g.gradient += gradient(groups.order);
}

Eliminated::Eliminated(const Groups& groups, const Gathered& gathered) : g(gathered) {
  const Eigen::Index p = groups.plain, others = g.gram.cols() - p;
  Eigen::MatrixXd information = g.gram.topLeftCorner(p, p);
  information.diagonal() = kRegularisation * (information.diagonal() + groups.precision.head(p));
  factor = Cholesky(information);
  if (!factor.positive()) return;
  coupling = factor.whitened(Eigen::MatrixXd(g.gram.topRightCorner(p, others)));
  reduced = g.gram.bottomRightCorner(others, others);
  reduced.diagonal() *= kRegularisation;
  reduced.noalias() -= coupling.transpose() * coupling;  // (26)
}

Family::Family(const Groups& groups, const Eliminated& plain, const Eigen::VectorXd& u,
               double compliance, double play)
    : groups_(groups), g_(plain.g), u_(u), compliance_(compliance), play_(play) {
  const Eigen::Index p = groups.plain, t = groups.transmission;
  const Eigen::Index soft = compliance > 0.0 ? groups.compliance : 0;
  const Eigen::Index played = compliance > 0.0 && play > 0.0 ? groups.play : 0;
  const Eigen::Index c = soft + played;
  size_ = p + c;
  precision_ = groups.precision.head(size_);
  precision_.segment(p, soft) /= compliance * compliance;
  precision_.tail(played) /= play * play;
  if (!plain.factor.positive()) return;
  Eigen::MatrixXd bearing = plain.reduced.topLeftCorner(c, c);
  bearing.diagonal() += kRegularisation * precision_.tail(c);
  const Cholesky factor(bearing);
  if (!factor.positive()) return;
  lower_ = Eigen::MatrixXd::Zero(size_, size_);
  lower_.topLeftCorner(p, p) = plain.factor.lower();
  lower_.bottomLeftCorner(c, p) = plain.coupling.leftCols(c).transpose();
  lower_.bottomRightCorner(c, c) = factor.lower();
  coupling_.resize(size_, t);
  coupling_.topRows(p) = plain.coupling.rightCols(t);
  auto borne = coupling_.bottomRows(c);
  borne = factor.whitened(Eigen::MatrixXd(plain.reduced.rightCols(t).topRows(c)));
  reduced_ = plain.reduced.bottomRightCorner(t, t);
  reduced_.noalias() -= borne.transpose() * borne;
  log_det_ = 2.0 * lower_.diagonal().array().log().sum();
  solvable_ = true;
}

Step Family::solve(const ModelLevel& level) {
  Step s;
  s.level = level;
  if (!solvable_) return s;
  const Right& right = level.transmission > 0.0 ? right_with() : right_without();
  double square = right.square, gain = right.rest.squaredNorm();
  double log_dets = log_det_, log_precision = precision_.array().log().sum();
  s.rest = right.rest;
  if (level.transmission > 0.0) {
    const Eigen::Index t = groups_.transmission;
    const Eigen::VectorXd precision =
        groups_.precision.tail(t) / (level.transmission * level.transmission);
    const Eigen::VectorXd off = u_.tail(t) - groups_.mean.tail(t);
    Eigen::MatrixXd reduced = reduced_;
    reduced.diagonal() += kRegularisation * precision;
    s.reduced.emplace(reduced);
    if (!s.reduced->positive()) return s;
    const Eigen::VectorXd pull = right.transmission - precision.cwiseProduct(off);
    s.transmission = s.reduced->solve(pull);
    s.rest.noalias() -= coupling_ * s.transmission;
    square += precision.dot(off.cwiseAbs2());
    gain += pull.dot(s.transmission);
    log_dets += s.reduced->log_det();
    log_precision += precision.array().log().sum();
  }
  s.log_evidence = 0.5 * (g_.log_weight - (square - gain) - log_dets + log_precision);  // (25)
  s.solved = true;
  return s;
}

Eigen::VectorXd Family::solution(const Step& s) const {
  Eigen::VectorXd u = Eigen::VectorXd::Zero(u_.size());
  u.head(size_) = u_.head(size_) + lower_.transpose().triangularView<Eigen::Upper>().solve(s.rest);
  if (s.transmission.size() > 0)
    u.tail(groups_.transmission) = u_.tail(groups_.transmission) + s.transmission;
  return u;
}

void Family::add_covariance(const std::vector<std::pair<const Step*, double>>& steps,
                            Eigen::MatrixXd& covariance) const {
  const Eigen::Index t = groups_.transmission;
  double weight = 0.0;
  Eigen::MatrixXd inner = Eigen::MatrixXd::Zero(t, t);
  for (const auto& [step, w] : steps) {
    weight += w;
    if (step->transmission.size() > 0)
      inner.selfadjointView<Eigen::Lower>().rankUpdate(
          inverse_of_lower(step->reduced->packed()).transpose(), w);
  }
  inner.triangularView<Eigen::StrictlyUpper>() = inner.transpose();
  const Eigen::MatrixXd root = inverse_of_lower(lower_);
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(size_, size_);
  inverse.selfadjointView<Eigen::Lower>().rankUpdate(root.transpose(), weight);
  inverse.triangularView<Eigen::StrictlyUpper>() = inverse.transpose();
  covariance.topLeftCorner(size_, size_) += inverse;
  const Eigen::MatrixXd through = root.transpose() * coupling_;
  const Eigen::MatrixXd shared = through * inner;
  covariance.topLeftCorner(size_, size_).noalias() += shared * through.transpose();
  covariance.block(0, covariance.cols() - t, size_, t) -= shared;
  covariance.block(covariance.rows() - t, 0, t, size_) -= shared.transpose();
  covariance.bottomRightCorner(t, t) += inner;
}

const Family::Right& Family::right(Right& r, Eigen::Index transmission) {
  if (r.known) return r;
  r.known = true;
  const Eigen::Index missing = u_.size() - size_ - transmission;
  Eigen::VectorXd gradient = g_.gradient;
  r.square = g_.square;
  if (missing > 0) {
    const Eigen::VectorXd forced = -u_.segment(size_, missing);
    const auto columns = g_.gram.middleCols(size_, missing);
    const Eigen::VectorXd pulled = columns * forced;
    r.square += 2.0 * g_.gradient.segment(size_, missing).dot(forced) +
                forced.dot(pulled.segment(size_, missing));
    gradient += pulled;
  }
  const Eigen::VectorXd off = u_.head(size_) - groups_.mean.head(size_);
  r.square += precision_.dot(off.cwiseAbs2());
  r.rest = -gradient.head(size_) - precision_.cwiseProduct(off);
  lower_.triangularView<Eigen::Lower>().solveInPlace(r.rest);
  r.transmission = -gradient.tail(transmission);
  if (transmission > 0) r.transmission.noalias() -= coupling_.transpose() * r.rest;
  return r;
}

}  // namespace cellcal::calib
