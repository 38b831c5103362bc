#include "calib/estimate/level_family.h"

#include <algorithm>
#include <cmath>

#include "calib/estimate/parallel.h"
#include "calib/model/product.h"

namespace cellcal::calib {

namespace {

/// Keeps a centre without prior, which turns with the frame, finite.
constexpr double kRegularisation = 1.0 + 1e-12;

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

void gather(const Problem& problem, const MeanRows& mean, const Groups& groups, Gathered& g) {
  const Linearisation& at = mean.linear;
  // From the weights of the linearisation to those of this ripple.
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(at.residual.size());
  for (const auto& [touch, row] : at.touch_row) {
    const double own = problem.own_sigma_m(touch);
    const double sigma = problem.sigma_m(touch, g.ripple_rad);
    weight.segment(row, problem.rows(touch)).setConstant(problem.sigma_m(touch) / sigma);
    g.log_weight += 2.0 * problem.rows(touch) * std::log(own / sigma);  // (25), sum log w
  }
  const Eigen::Index n = problem.size();
  const auto row_count = static_cast<std::size_t>(at.residual.size());
  std::vector<Gathered> sums(parts_of(row_count),
                             {g.ripple_rad, Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd::Zero(n)});
  by_parts(row_count, [&](std::size_t part, std::size_t begin, std::size_t behind) {
    Gathered& sum = sums[part];
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
      add_square(1.0, rows.transpose(), sum.gram);
      sum.gradient.noalias() += rows.transpose() * residual;
      sum.square += residual.squaredNorm();
    }
  });
  Gathered& all = sums[0];
  g.square += all.square + mean.differences;
  for (std::size_t part = 1; part < sums.size(); ++part) {
    all.gram += sums[part].gram;
    all.gradient += sums[part].gradient;
    g.square += sums[part].square;
  }
  all.gram.triangularView<Eigen::StrictlyUpper>() = all.gram.transpose();
  g.gram += all.gram(groups.order, groups.order);
  g.gradient += all.gradient(groups.order);
}

Eliminated::Eliminated(const Groups& groups, const Gathered& gathered) : g(gathered) {
  const Eigen::Index p = groups.plain, others = g.gram.cols() - p;
  Eigen::MatrixXd information = g.gram.topLeftCorner(p, p);
  information.diagonal() = kRegularisation * (information.diagonal() + groups.precision.head(p));
  factor = Cholesky(information);
  if (!factor.positive()) return;
  root = factor.lower_inverse();
  coupling = product(root, g.gram.topRightCorner(p, others));
  reduced = g.gram.bottomRightCorner(others, others);
  reduced.diagonal() *= kRegularisation;
  add_product(-1.0, coupling.transpose(), coupling, reduced);  // (26)
}

void Eliminated::add_covariance(double weight, const Eigen::MatrixXd& others,
                                Eigen::MatrixXd& covariance) const {
  const Eigen::Index p = coupling.rows(), o = coupling.cols();
  const Eigen::MatrixXd through = product(root.transpose(), coupling);
  const Eigen::MatrixXd shared = product(through, others);
  auto plain = covariance.topLeftCorner(p, p);
  add_product(1.0, shared, through.transpose(), plain);
  add_square(weight, root.transpose(), plain);
  plain.triangularView<Eigen::StrictlyUpper>() = plain.transpose();
  covariance.topRightCorner(p, o) -= shared;
  covariance.bottomLeftCorner(o, p) -= shared.transpose();
  covariance.bottomRightCorner(o, o) += others;
}

Family::Family(const Groups& groups, const Eliminated& plain, const Eigen::VectorXd& u,
               double compliance, double play)
    : groups_(groups), plain_(plain), u_(u), compliance_(compliance), play_(play) {
  const Eigen::Index p = groups.plain, t = groups.transmission;
  const Eigen::Index soft = compliance > 0.0 ? groups.compliance : 0;
  const Eigen::Index played = compliance > 0.0 && play > 0.0 ? groups.play : 0;
  bearing_ = soft + played;
  precision_ = groups.precision.head(p + bearing_);
  precision_.segment(p, soft) /= compliance * compliance;
  precision_.tail(played) /= play * play;
  if (!plain.factor.positive()) return;
  Eigen::MatrixXd information = plain.reduced.topLeftCorner(bearing_, bearing_);
  information.diagonal() += kRegularisation * precision_.tail(bearing_);
  factor_ = Cholesky(information);
  if (!factor_.positive()) return;
  coupling_ = factor_.whitened(Eigen::MatrixXd(plain.reduced.topRightCorner(bearing_, t)));
  reduced_ = plain.reduced.bottomRightCorner(t, t);
  add_product(-1.0, coupling_.transpose(), coupling_, reduced_);
  log_det_ = plain.factor.log_det() + factor_.log_det();
  solvable_ = true;
}

Step Family::solve(const ModelLevel& level) {
  Step s;
  s.level = level;
  if (!solvable_) return s;
  const Right& right = level.transmission > 0.0 ? this->right(with_, groups_.transmission)
                                                : this->right(without_, 0);
  double square = right.square, gain = right.plain.squaredNorm() + right.bearing.squaredNorm();
  double log_dets = log_det_, log_precision = precision_.array().log().sum();
  s.plain = right.plain;
  s.bearing = right.bearing;
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
    s.plain.noalias() -= plain_.coupling.rightCols(t) * s.transmission;
    s.bearing.noalias() -= coupling_ * s.transmission;
    square += precision.dot(off.cwiseAbs2());
    gain += pull.dot(s.transmission);
    log_dets += s.reduced->log_det();
    log_precision += precision.array().log().sum();
  }
  s.log_evidence =
      0.5 * (plain_.g.log_weight - (square - gain) - log_dets + log_precision);  // (25)
  s.solved = true;
  return s;
}

Eigen::VectorXd Family::solution(const Step& s) const {
  const Eigen::Index p = groups_.plain;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(u_.size());
  const Eigen::VectorXd bearing = factor_.coloured(s.bearing);
  u.head(p) = u_.head(p) + plain_.factor.coloured(Eigen::VectorXd(
                               s.plain - plain_.coupling.leftCols(bearing_) * bearing));
  u.segment(p, bearing_) = u_.segment(p, bearing_) + bearing;
  if (s.transmission.size() > 0)
    u.tail(groups_.transmission) = u_.tail(groups_.transmission) + s.transmission;
  return u;
}

void Family::add_covariance(const std::vector<std::pair<const Step*, double>>& steps,
                            Eigen::MatrixXd& others) const {
  const Eigen::Index t = groups_.transmission;
  double weight = 0.0;
  Eigen::MatrixXd inner = Eigen::MatrixXd::Zero(t, t);
  for (const auto& [step, w] : steps) {
    weight += w;
    if (step->transmission.size() > 0)
      add_square(w, step->reduced->lower_inverse().transpose(), inner);
  }
  inner.triangularView<Eigen::StrictlyUpper>() = inner.transpose();
  const Eigen::MatrixXd root = factor_.lower_inverse();
  const Eigen::MatrixXd through = product(root.transpose(), coupling_);
  const Eigen::MatrixXd shared = product(through, inner);
  add_product(weight, root.transpose(), root, others.topLeftCorner(bearing_, bearing_));
  add_product(1.0, shared, through.transpose(), others.topLeftCorner(bearing_, bearing_));
  others.topRightCorner(bearing_, t) -= shared;
  others.bottomLeftCorner(t, bearing_) -= shared.transpose();
  others.bottomRightCorner(t, t) += inner;
}

const Family::Right& Family::right(Right& r, Eigen::Index transmission) {
  if (r.known) return r;
  r.known = true;
  const Eigen::Index p = groups_.plain, size = p + bearing_;
  const Eigen::Index missing = u_.size() - size - transmission;
  Eigen::VectorXd gradient = plain_.g.gradient;
  r.square = plain_.g.square;
  if (missing > 0) {
    const Eigen::VectorXd forced = -u_.segment(size, missing);
    const auto columns = plain_.g.gram.middleCols(size, missing);
    const Eigen::VectorXd pulled = columns * forced;
    r.square += 2.0 * plain_.g.gradient.segment(size, missing).dot(forced) +
                forced.dot(pulled.segment(size, missing));
    gradient += pulled;
  }
  const Eigen::VectorXd off = u_.head(size) - groups_.mean.head(size);
  r.square += precision_.dot(off.cwiseAbs2());
  const Eigen::VectorXd pull = -gradient.head(size) - precision_.cwiseProduct(off);
  r.plain = plain_.factor.whitened(Eigen::VectorXd(pull.head(p)));
  r.bearing = factor_.whitened(Eigen::VectorXd(
      pull.tail(bearing_) - plain_.coupling.leftCols(bearing_).transpose() * r.plain));
  r.transmission = -gradient.tail(transmission);
  if (transmission > 0) {
    r.transmission.noalias() -= plain_.coupling.rightCols(transmission).transpose() * r.plain;
    r.transmission.noalias() -= coupling_.transpose() * r.bearing;
  }
  return r;
}

}  // namespace cellcal::calib
