#include "calib/estimate/joint_functions.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/model/error.h"
#include "calib/model/linear.h"
#include "calib/model/long_work.h"
#include "calib/model/product.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

/// Candidate reaches: the waves of strain-wave gears have 8 to 30 periods per turn.
constexpr double kFunctionReaches[] = {3.0 * kRadPerDeg, 6.0 * kRadPerDeg, 12.0 * kRadPerDeg};
/// Prior size of a joint's function, and of its ripple; each counts as one degree of freedom.
constexpr double kUsualFunctionRad = 15.0 * kRadPerArcsec, kUsualFastRad = 5.0 * kRadPerArcsec,
                 kUsualJointNoiseRad = 3.0 * kRadPerArcsec;
constexpr double kPriorFreedom = 1.0;
/// Gain of log likelihood by a joint's fast orders, above which it has them.
constexpr double kGainOfFastOrders = 5.0;
/// Maximum number of rows for the sizes.
constexpr std::size_t kMostRowsOfSizes = 300;
constexpr Eigen::Index kFewestRows = 3;
/// Residuals with a smaller correlation, and a smaller ratio of scatter to the stated noise
/// (variance), are not analysed further.
constexpr double kTestedSigmas = 2.0, kTestedScatter = 4.0;
/// Prior sigma of unknowns without prior, in their scales.
constexpr double kFarAway = 10.0;

/// Rows of some touches in metres.
struct SizedRows {
  RowMajor plain, added;       ///< by the unknowns of the plain arm, and by the others
  Eigen::VectorXd residual_m;  ///< at the estimate
  Eigen::VectorXd own_m2, lever2_m2, sigma_m;
};

std::vector<bool> spread_rows(const Problem& problem, const std::vector<bool>& use) {
  std::vector<std::size_t> used;
  std::size_t rows = 0;
  for (std::size_t i = 0; i < use.size(); ++i)
    if (use[i]) {
      used.push_back(i);
      rows += static_cast<std::size_t>(problem.place_rows(i));
    }
  std::vector<bool> some(use.size(), false);
  const std::size_t wanted =
      rows <= kMostRowsOfSizes ? used.size() : kMostRowsOfSizes * used.size() / rows;
  for (std::size_t k = 0; k < wanted; ++k) some[used[k * used.size() / wanted]] = true;
  return some;
}

/// Unknowns of the richer arm that the plain one lacks, and the others, in the plain one's order.
struct Carried {
  std::vector<int> added, others;
};
Carried carried(const Problem& plain, const Problem& richer) {
  Carried all;
  std::size_t next = 0;
  for (int i = 0; i < richer.size(); ++i) {
    const bool known =
        next < plain.unknowns().size() &&
        plain.unknowns()[next].key == richer.unknowns()[static_cast<std::size_t>(i)].key;
    (known ? all.others : all.added).push_back(i);
    if (known) ++next;
  }
  return all;
}

Eigen::VectorXd carried_over(const Problem& plain, const Problem& richer,
                             const Eigen::VectorXd& plain_u) {
  Eigen::VectorXd u = Eigen::VectorXd::Zero(richer.size());
  u(carried(plain, richer).others) = plain_u;
  return u;
}

SizedRows sized_rows(const Problem& plain, Problem& reference, const Estimate& e) {
  reference.set_ripple(e.levels.ripple_rad);
  const Linearisation at =
      linearise(reference, carried_over(plain, reference, e.u), spread_rows(reference, e.use));
  const Carried which = carried(plain, reference);
  std::vector<int> taken;
  std::vector<double> own, lever, sigma;
  for (const auto& [touch, row] : at.touch_row)
    for (int k = 0; k < reference.place_rows(touch); ++k) {
      taken.push_back(row + k);
      sigma.push_back(reference.sigma_m(touch));
      own.push_back(std::pow(reference.own_sigma_m(touch), 2));
      lever.push_back(std::pow(reference.joint_lever_m(touch), 2));
    }
  const auto n = static_cast<Eigen::Index>(taken.size());
  const auto vector = [n](const std::vector<double>& v) -> Eigen::VectorXd {
    return Eigen::Map<const Eigen::VectorXd>(v.data(), n);
  };
  SizedRows rows{at.jacobian(taken, which.others),
                 at.jacobian(taken, which.added),
                 at.residual(taken),
                 vector(own),
                 vector(lever),
                 vector(sigma)};
  rows.plain = rows.sigma_m.asDiagonal() * rows.plain;
  rows.added = rows.sigma_m.asDiagonal() * rows.added;
  rows.residual_m.array() *= rows.sigma_m.array();
  return rows;
}

/// Orders of a joint's function with a size of their own, and the covariance that they give the rows.
struct Band {
  std::size_t joint = 0;
  bool fast = false;
  Eigen::MatrixXd covariance;
};

/// Those of all joints, of the sizes in `of`, which has the parameters of the reference.
std::vector<Band> bands_of(const Problem& plain, const Problem& reference, const SizedRows& rows,
                           const ArmModel& of) {
  const Carried which = carried(plain, reference);
  const auto parameter = [&](const ArmModel& arm, Eigen::Index k) -> const ArmParameter& {
    return arm.parameters()[static_cast<std::size_t>(which.added[static_cast<std::size_t>(k)])];
  };
  const auto is_fast = [&](Eigen::Index k) { return parameter(of, k).harmonic > kHighestOrder; };
  std::vector<Band> bands;
  const auto count = static_cast<Eigen::Index>(which.added.size());
  for (Eigen::Index first = 0, behind = 0; first < count; first = behind) {
    const int joint = parameter(of, first).joint;
    while (behind < count && parameter(of, behind).joint == joint &&
           is_fast(behind) == is_fast(first))
      ++behind;
    Eigen::MatrixXd columns = rows.added.middleCols(first, behind - first);
    for (Eigen::Index k = first; k < behind; ++k)
      columns.col(k - first) *= parameter(of, k).sigma / parameter(reference.arm(), k).sigma;
    bands.push_back(
        {static_cast<std::size_t>(joint), is_fast(first), product(columns, columns.transpose())});
  }
  return bands;
}

/// True if the residuals of rows that `k` correlates are correlated, (30), or scatter by far more
/// than is stated.
bool correlated(const SizedRows& rows, Eigen::MatrixXd k, const Estimate& e) {
  const Eigen::VectorXd weight = rows.sigma_m.cwiseInverse();
  k = weight.asDiagonal() * k * weight.asDiagonal();
  k.diagonal().setZero();
  const RowMajor j = weight.asDiagonal() * rows.plain;
  Eigen::MatrixXd left = -product(product(j, e.posterior.covariance_u), j.transpose());
  left.diagonal().array() += 1.0;
  const Eigen::VectorXd r = weight.cwiseProduct(rows.residual_m);
  const double scatter = r.squaredNorm() / std::max(1.0, left.trace());
  if (scatter > kTestedScatter) return true;
  const Eigen::MatrixXd through = product(k, left);
  const double variance = 2.0 * through.cwiseProduct(through.transpose()).sum();
  return variance > 0.0 &&
         r.dot(k * r) / scatter - through.trace() > kTestedSigmas * std::sqrt(variance);
}

/// Variance components of the rows: V = what the unknowns make + sum of size times covariance.
struct Components {
  std::vector<Eigen::MatrixXd> covariance;
  std::vector<double> size, usual;
  double log_likelihood = -std::numeric_limits<double>::infinity();
};

Eigen::MatrixXd variance_of(const Eigen::MatrixXd& by_unknowns, const Components& c) {
  Eigen::MatrixXd v = by_unknowns;
  for (std::size_t k = 0; k < c.size.size(); ++k) v += c.size[k] * c.covariance[k];
  return v;
}

/// (27c), maximised by steps that never decrease it (Zhou et al. 2019).
void maximise(const Eigen::MatrixXd& by_unknowns, const Eigen::VectorXd& y, Components& c) {
  constexpr int kRounds = 25;
  constexpr double kEnough = 0.01;
  for (int round = 0; round < kRounds; ++round) {
    poll_cancelled();
    const Cholesky factor(variance_of(by_unknowns, c));
    if (!factor.positive()) return;
    const Eigen::MatrixXd inverse = factor.inverse();
    const Eigen::VectorXd pull = inverse * y;
    c.log_likelihood = -0.5 * y.dot(pull) - 0.5 * factor.log_det();
    double step = 0.0;
    for (std::size_t k = 0; k < c.size.size(); ++k) {
      const double prior = kPriorFreedom * c.usual[k] / c.size[k];
      c.log_likelihood -= 0.5 * (prior + kPriorFreedom * std::log(c.size[k] / c.usual[k]));
      const double wanted = c.size[k] * pull.dot(c.covariance[k] * pull) + prior;
      const double has = c.size[k] * inverse.cwiseProduct(c.covariance[k]).sum() + kPriorFreedom;
      const double factor_of_size = std::sqrt(wanted / has);
      c.size[k] *= factor_of_size;
      step = std::max(step, std::abs(std::log(factor_of_size)));
    }
    if (step < kEnough) return;
  }
}

}  // namespace

Cell with_learnt_of(const Robot& robot, Cell cell) {
  for (std::size_t i = 0; i < cell.robot.joints.size(); ++i) {
    const Joint& from = robot.joints[i];
    Joint& to = cell.robot.joints[i];
    to.bearing_sigma_rad_per_nm = from.bearing_sigma_rad_per_nm;
    to.function_sigma_rad = from.function_sigma_rad;
    to.function_fast_sigma_rad = from.function_fast_sigma_rad;
    to.function_reach_rad = from.function_reach_rad;
    to.function_min_rad = from.function_min_rad;
    to.function_max_rad = from.function_max_rad;
  }
  return cell;
}

Robot with_bearings(Robot robot, double share) {
  double compliance = 0.0;
  for (auto joint = robot.joints.rbegin(); joint != robot.joints.rend(); ++joint) {
    if (joint->is_prismatic()) continue;
    if (joint->compliance_sigma_rad_per_nm > 0.0) compliance = joint->compliance_sigma_rad_per_nm;
    joint->bearing_sigma_rad_per_nm = share * compliance;
  }
  return robot;
}

Robot with_reference_functions(Robot robot) {
  for (Joint& joint : robot.joints) {
    if (joint.is_prismatic()) continue;
    joint.function_sigma_rad = kUsualFunctionRad;
    joint.function_reach_rad = kFunctionReaches[1];
  }
  return robot;
}

bool speaks_for(const Problem& plain, Problem& richer, const Estimate& e) {
  const SizedRows rows = sized_rows(plain, richer, e);
  return rows.residual_m.size() >= kFewestRows &&
         correlated(rows, product(rows.added, rows.added.transpose()), e);
}

namespace {

/// Variances of the rows, and what the unknowns of the plain arm give them.
struct Sizing {
  Sizing(const Problem& plain, const Repeats& repeats, const Estimate& e, const SizedRows& of)
      : rows(of) {
    Eigen::VectorXd prior(plain.size()), off(plain.size());
    for (int i = 0; i < plain.size(); ++i) {
      const Unknown& unknown = plain.unknowns()[static_cast<std::size_t>(i)];
      const bool stated = unknown.prior_weight > 0.0;
      prior[i] = std::min(kFarAway, stated ? 1.0 / unknown.prior_weight : kFarAway);
      off[i] = stated ? unknown.prior_mean_u - e.u[i] : 0.0;
    }
    y = rows.residual_m + rows.plain * off;
    const Eigen::MatrixXd reached = rows.plain * prior.asDiagonal();
    by_unknowns = product(reached, reached.transpose());
    constexpr double kEnoughRepeats = 3.0;
    noise_measured = repeats.degrees_of_freedom >= kEnoughRepeats;
    if (noise_measured) by_unknowns.diagonal() += rows.own_m2;
  }

  /// Likeliest sizes of the bands, over those in `robot`, followed by those of ripple and noise.
  Components sized(const std::vector<Band>& bands, const Robot& robot) const {
    Components c;
    for (const Band& band : bands) {
      const Joint& joint = robot.joints[band.joint];
      c.covariance.push_back(band.covariance);
      c.usual.push_back(std::pow(band.fast ? kUsualFastRad / joint.function_fast_sigma_rad
                                           : kUsualFunctionRad / joint.function_sigma_rad,
                                 2));
    }
    c.covariance.push_back(std::pow(kUsualJointNoiseRad, 2) *
                           rows.lever2_m2.asDiagonal().toDenseMatrix());
    if (!noise_measured) c.covariance.push_back(rows.own_m2.asDiagonal());
    c.size.assign(c.covariance.size(), 1.0);
    c.usual.resize(c.covariance.size(), 1.0);
    maximise(by_unknowns, y, c);
    return c;
  }

  /// log L of the sizes, over that without component k.
  double gain_of(std::size_t k, Components c) const {
    const double with = log_likelihood(c);
    c.size[k] = 0.0;
    return with - log_likelihood(c);
  }

  const SizedRows& rows;
  Eigen::VectorXd y;
  Eigen::MatrixXd by_unknowns;
  bool noise_measured = false;

 private:
  double log_likelihood(const Components& c) const {
    const Cholesky factor(variance_of(by_unknowns, c));
    return -0.5 * factor.whitened(y).squaredNorm() - 0.5 * factor.log_det();
  }
};

/// Angles of the touches that the functions are learnt from.
void set_ranges(const Problem& plain, const Estimate& e, Robot& robot) {
  for (std::size_t i = robot.first_turning(); i < robot.joints.size(); ++i) {
    Joint& joint = robot.joints[i];
    joint.function_min_rad = std::numeric_limits<double>::infinity();
    joint.function_max_rad = -joint.function_min_rad;
    for (std::size_t touch = 0; touch < e.use.size(); ++touch) {
      if (!e.use[touch]) continue;
      const double angle = plain.touches()[touch].joint_rad[i];
      joint.function_min_rad = std::min(joint.function_min_rad, angle);
      joint.function_max_rad = std::max(joint.function_max_rad, angle);
    }
  }
}

}  // namespace

std::optional<Robot> size_functions(const Problem& plain, Problem& reference,
                                    const Repeats& repeats, const Estimate& e) {
  const SizedRows rows = sized_rows(plain, reference, e);
  if (rows.residual_m.size() < kFewestRows ||
      !correlated(rows, product(rows.added, rows.added.transpose()), e))
    return std::nullopt;
  const Sizing sizing(plain, repeats, e, rows);
  Components best;
  Robot robot = reference.arm().robot();
  std::vector<Band> bands;
  double reach_rad = 0.0;
  for (const double reach : kFunctionReaches) {
    for (Joint& joint : robot.joints) joint.function_reach_rad = reach;
    const ArmModel of(robot, reference.arm().tool(), reference.cell().other_tools);
    bands = bands_of(plain, reference, rows, of);
    Components c = sizing.sized(bands, robot);
    if (!(c.log_likelihood > best.log_likelihood)) continue;
    best = std::move(c);
    reach_rad = reach;
  }
  if (reach_rad == 0.0) return std::nullopt;
  for (std::size_t k = 0; k < bands.size(); ++k) {
    Joint& joint = robot.joints[bands[k].joint];
    joint.function_reach_rad = reach_rad;
    joint.function_sigma_rad *= std::sqrt(best.size[k]);
  }
  set_ranges(plain, e, robot);
  return robot;
}

Robot with_fast_orders(Robot robot) {
  for (Joint& joint : robot.joints)
    if (joint.function_sigma_rad > 0.0) joint.function_fast_sigma_rad = kUsualFastRad;
  return robot;
}

Robot size_fast_orders(const Problem& plain, Problem& reference, const Repeats& repeats,
                       const Estimate& e) {
  const SizedRows rows = sized_rows(plain, reference, e);
  const std::vector<Band> bands = bands_of(plain, reference, rows, reference.arm());
  Robot robot = reference.arm().robot();
  const Sizing sizing(plain, repeats, e, rows);
  const Components c = sizing.sized(bands, robot);
  for (std::size_t k = 0; k < bands.size(); ++k) {
    Joint& joint = robot.joints[bands[k].joint];
    if (!bands[k].fast)
      joint.function_sigma_rad *= std::sqrt(c.size[k]);
    else if (c.size[k] > 1.0 && sizing.gain_of(k, c) > kGainOfFastOrders)
      joint.function_fast_sigma_rad *= std::sqrt(c.size[k]);
    else
      joint.function_fast_sigma_rad = 0.0;
  }
  return robot;
}

double evidence_gain(const Problem& plain, Problem& richer, const Estimate& e) {
  const Eigen::VectorXd u = carried_over(plain, richer, e.u);
  richer.set_ripple(e.levels.ripple_rad);
  std::vector<ModelLevel> likely;
  for (const LevelEvidence& l : e.levels.levels)
    if (l.probability > 0.01) likely.push_back(l.level);
  return LevelSums(richer, u, linearise(richer, u, e.use), likely).log_evidence() -
         log_evidence(e.levels.levels);
}

Estimate estimate_richer(const Problem& plain, Problem& richer, const IdentifyOptions& options,
                         const std::vector<ModelLevel>& levels, const Estimate& e) {
  Estimate with;
  with.u = carried_over(plain, richer, e.u);
  with.use = e.use;
  with.gate = e.gate;
  richer.set_ripple(e.levels.ripple_rad);
  linearise(richer, with.u, with.use, with.posterior.linear);
  refine(richer, options, levels, with);
  return with;
}

}  // namespace cellcal::calib
