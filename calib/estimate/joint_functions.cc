#include "calib/estimate/joint_functions.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/estimate/discrepancy.h"
#include "calib/model/error.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/model/long_work.h"
#include "calib/model/product.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

/// Candidate reaches: the waves of strain-wave gears have 8 to 30 periods per turn.
constexpr double kFunctionReaches[] = {3.0 * kRadPerDeg, 6.0 * kRadPerDeg, 12.0 * kRadPerDeg};
/// Prior size of the joints' functions, of their fast orders, and of ripple. Each counts as one degree
/// of freedom; of a single function, about the size of all, as kFreedomOfOne.
constexpr double kUsualFunctionRad = 15.0 * kRadPerArcsec, kUsualFastRad = 5.0 * kRadPerArcsec,
                 kUsualJointNoiseRad = 3.0 * kRadPerArcsec;
constexpr double kPriorFreedom = 1.0, kFreedomOfOne = 4.0;
/// Gain of log likelihood by a joint's fast orders, above which it has them.
constexpr double kGainOfFastOrders = 5.0;
/// Maximum number of rows for the sizes.
constexpr std::size_t kMostRowsOfSizes = 300;
constexpr Eigen::Index kFewestRows = 3;
/// Residuals with a smaller correlation, and a smaller ratio of scatter to the stated noise
/// (variance), are not analysed further.
constexpr double kTestedSigmas = 2.0, kTestedScatter = 4.0;

/// Rows of some places in metres; repeats of a place are one row, their mean.
struct SizedRows {
  RowMajor plain;              ///< by the unknowns
  Eigen::VectorXd residual_m;  ///< at the estimate
  Eigen::VectorXd own_m2, lever2_m2, sigma_m;
  std::vector<int> taken;  ///< of the linearisation
};

/// The used touches of all places, or of some that are spread over them.
std::vector<bool> spread_rows(const Problem& problem, const std::vector<bool>& use) {
  std::vector<std::size_t> places;  // first touches
  std::vector<bool> known(use.size(), false), chosen = known, some = known;
  std::size_t rows = 0;
  for (std::size_t i = 0; i < use.size(); ++i) {
    const std::size_t first = problem.first_of_place(i);
    if (!use[i] || known[first]) continue;
    known[first] = true;
    places.push_back(first);
    rows += static_cast<std::size_t>(problem.place_rows(i));
  }
  const std::size_t wanted =
      rows <= kMostRowsOfSizes ? places.size() : kMostRowsOfSizes * places.size() / rows;
  for (std::size_t k = 0; k < wanted; ++k) chosen[places[k * places.size() / wanted]] = true;
  for (std::size_t i = 0; i < use.size(); ++i)
    some[i] = use[i] && chosen[problem.first_of_place(i)];
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
  const std::vector<int> others = carried(plain, richer).others;
  for (std::size_t k = 0; k < others.size(); ++k)  // a wave widens the prior of an order
    u[others[k]] =
        plain_u[static_cast<Eigen::Index>(k)] *
        (plain.unknowns()[k].scale / richer.unknowns()[static_cast<std::size_t>(others[k])].scale);
  return u;
}

/// Rows of the touches' places in a linearisation of the problem, of the touches that `some` marks.
std::vector<int> place_rows(const Problem& problem, const Linearisation& at,
                            const std::vector<bool>& some) {
  std::vector<int> taken;
  for (const auto& [touch, row] : at.touch_row)
    for (int k = 0; some[touch] && k < problem.place_rows(touch); ++k) taken.push_back(row + k);
  return taken;
}

SizedRows sized_rows(const Problem& problem, const Estimate& e) {
  const MeanRows mean = mean_rows(problem, e.posterior.linear);
  const Linearisation& at = mean.linear;
  const std::vector<bool> some = spread_rows(problem, e.use);
  SizedRows rows{{}, {}, {}, {}, {}, place_rows(problem, at, some)};
  const auto n = static_cast<Eigen::Index>(rows.taken.size());
  for (Eigen::VectorXd* all : {&rows.sigma_m, &rows.own_m2, &rows.lever2_m2}) all->resize(n);
  Eigen::Index next = 0;
  for (const auto& [touch, row] : at.touch_row)
    for (int k = 0; some[touch] && k < problem.place_rows(touch); ++k, ++next) {
      const double times = mean.times[touch];
      rows.sigma_m[next] = problem.sigma_m(touch) / std::sqrt(times);
      rows.own_m2[next] = std::pow(problem.own_sigma_m(touch), 2) / times;
      rows.lever2_m2[next] = std::pow(problem.joint_lever_m(touch), 2) / times;
    }
  rows.plain = rows.sigma_m.asDiagonal() * at.jacobian(rows.taken, Eigen::all);
  rows.residual_m = rows.sigma_m.cwiseProduct(at.residual(rows.taken));
  return rows;
}

/// Orders of a joint's function with a size of their own, and how they move the rows.
struct Band {
  std::size_t joint;
  bool fast;
  double usual_rad;  ///< expected size
  Eigen::MatrixXd waves;

  int lowest() const { return fast ? kHighestOrder + 1 : kLowestOrder; }
  int highest() const { return fast ? kFastestOrder : kHighestOrder; }
  /// Covariance of the rows by orders of the expected size.
  Eigen::MatrixXd covariance(double reach_rad) const {
    Eigen::VectorXd sigma(waves.cols());
    Eigen::Index next = 0;
    for (const double share : function_shares(reach_rad, lowest(), highest()))
      for (int k = 0; k < 2; ++k) sigma[next++] = usual_rad * share;
    const Eigen::MatrixXd columns = waves * sigma.asDiagonal();
    return product(columns, columns.transpose());
  }
};

std::vector<Band> bands_of(const Problem& problem, const SizedRows& rows, const Estimate& e,
                           bool fast) {
  std::vector<Band> bands;
  for (const RowsOfJoint& all :
       rows_by_joint(problem, e.u, mean_rows(problem, e.posterior.linear))) {
    bands.push_back({all.joint, fast, fast ? kUsualFastRad : kUsualFunctionRad, {}});
    bands.back().waves = waves_of(
        {all.joint, rows.sigma_m.cwiseProduct(all.lever(rows.taken)), all.angle_rad(rows.taken)},
        bands.back().lowest(), bands.back().highest());
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
  const Eigen::MatrixXd left = left_by_fit(j, e.posterior.covariance_u);
  const Eigen::VectorXd r = weight.cwiseProduct(rows.residual_m);
  const double scatter = r.squaredNorm() / std::max(1.0, left.trace());
  return scatter > kTestedScatter || correlation_sigmas(r, k, left, scatter) > kTestedSigmas;
}

/// Variance components of the rows: V = what the unknowns make + sum of size times covariance; each
/// size is expected at 1.
struct Components {
  std::vector<Eigen::MatrixXd> covariance;
  std::vector<double> size, freedom;
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
      const double prior = c.freedom[k] / c.size[k];
      c.log_likelihood -= 0.5 * (prior + c.freedom[k] * std::log(c.size[k]));
      const double wanted = c.size[k] * pull.dot(c.covariance[k] * pull) + prior;
      const double has = c.size[k] * inverse.cwiseProduct(c.covariance[k]).sum() + c.freedom[k];
      const double factor_of_size = std::sqrt(wanted / has);
      c.size[k] *= factor_of_size;
      step = std::max(step, std::abs(std::log(factor_of_size)));
    }
    if (step < kEnough) return;
  }
}

/// Variances of the rows, and what the unknowns of the plain arm give them.
struct Sizing {
  Sizing(const Problem& plain, const Repeats& repeats, const Estimate& e, const SizedRows& of)
      : rows(of), integrated(plain, e.u, of.plain, of.residual_m) {
    constexpr double kEnoughRepeats = 3.0;
    noise_measured = repeats.used_degrees >= kEnoughRepeats;
    if (noise_measured) integrated.by_unknowns.diagonal() += rows.own_m2;
  }

  /// Likeliest sizes of the bands' covariances, followed by those of ripple and noise. `freedom`: that
  /// the expected size of a band counts as.
  Components sized(std::vector<Eigen::MatrixXd> of_bands, double freedom = kPriorFreedom) const {
    Components c{std::move(of_bands), {}, {}};
    c.freedom.assign(c.covariance.size(), freedom);
    c.covariance.push_back(std::pow(kUsualJointNoiseRad, 2) *
                           rows.lever2_m2.asDiagonal().toDenseMatrix());
    if (!noise_measured) c.covariance.push_back(rows.own_m2.asDiagonal());
    c.freedom.resize(c.covariance.size(), kPriorFreedom);
    c.size.assign(c.covariance.size(), 1.0);
    maximise(integrated.by_unknowns, integrated.y, c);
    return c;
  }

  /// log L of the sizes, over that without component k.
  double gain_of(std::size_t k, Components c) const {
    const double with = log_likelihood(c);
    c.size[k] = 0.0;
    return with - log_likelihood(c);
  }

  const SizedRows& rows;
  IntegratedRows integrated;
  bool noise_measured = false;

 private:
  double log_likelihood(const Components& c) const {
    const Cholesky factor(variance_of(integrated.by_unknowns, c));
    return -0.5 * factor.whitened(integrated.y).squaredNorm() - 0.5 * factor.log_det();
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

/// The estimate `e` of `plain` in the unknowns of `richer`, linearised there.
Estimate begun_with(const Problem& plain, Problem& richer, const Estimate& e) {
  Estimate with;
  with.u = carried_over(plain, richer, e.u);
  with.use = e.use;
  with.gate = e.gate;
  richer.set_ripple(e.levels.ripple_rad);
  linearise(richer, with.u, with.use, with.posterior.linear);
  return with;
}

double log_evidence(const Problem& problem, const Estimate& e,
                    const std::vector<ModelLevel>& levels) {
  return LevelSums(problem, e.u, e.posterior.linear, levels).log_evidence();
}

}  // namespace

bool has_functions(const Robot& robot) {
  return std::ranges::any_of(robot.joints, [](const Joint& joint) {
    return joint.function_sigma_rad > 0.0 || !joint.waves.empty();
  });
}

Cell with_learnt_of(const Robot& robot, Cell cell) {
  for (std::size_t i = 0; i < cell.robot.joints.size(); ++i) {
    const Joint& from = robot.joints[i];
    Joint& to = cell.robot.joints[i];
    to.bearing_sigma_rad_per_nm = from.bearing_sigma_rad_per_nm;
    to.function_sigma_rad = from.function_sigma_rad;
    to.function_fast_sigma_rad = from.function_fast_sigma_rad;
    to.function_reach_rad = from.function_reach_rad;
    to.waves = from.waves;
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

bool speaks_for(const Problem& plain, Problem& richer, const Estimate& e) {
  const SizedRows rows = sized_rows(plain, e);
  if (rows.residual_m.size() < kFewestRows) return false;
  richer.set_ripple(e.levels.ripple_rad);
  const std::vector<bool> some = spread_rows(richer, e.use);
  const Linearisation at =
      mean_rows(richer, linearise(richer, carried_over(plain, richer, e.u), some)).linear;
  const Eigen::MatrixXd added =
      rows.sigma_m.asDiagonal() *
      at.jacobian(place_rows(richer, at, some), carried(plain, richer).added);
  return correlated(rows, product(added, added.transpose()), e);
}

std::optional<Robot> size_functions(const Problem& problem, const Repeats& repeats,
                                    const Estimate& e) {
  const SizedRows rows = sized_rows(problem, e);
  if (rows.residual_m.size() < kFewestRows) return std::nullopt;
  const std::vector<Band> slow = bands_of(problem, rows, e, false);
  const auto covariances = [&](double reach) {
    std::vector<Eigen::MatrixXd> all;
    for (const Band& band : slow) all.push_back(band.covariance(reach));
    return all;
  };
  const auto together = [](const std::vector<Eigen::MatrixXd>& all) {
    Eigen::MatrixXd sum = all.front();
    for (std::size_t k = 1; k < all.size(); ++k) sum += all[k];
    return sum;
  };
  if (!correlated(rows, together(covariances(kFunctionReaches[1])), e)) return std::nullopt;
  const Sizing sizing(problem, repeats, e, rows);
  Components best;
  double reach_rad = 0.0;
  for (const double reach : kFunctionReaches) {
    std::vector<Eigen::MatrixXd> each = covariances(reach);
    const double common = sizing.sized({together(each)}).size.front();
    for (Eigen::MatrixXd& one : each) one *= common;
    Components c = sizing.sized(std::move(each), kFreedomOfOne);
    if (!(c.log_likelihood > best.log_likelihood)) continue;
    for (std::size_t k = 0; k < slow.size(); ++k) c.size[k] *= common;
    best = std::move(c);
    reach_rad = reach;
  }
  if (reach_rad == 0.0) return std::nullopt;
  Robot robot = problem.arm().robot();
  for (std::size_t k = 0; k < slow.size(); ++k) {
    Joint& joint = robot.joints[slow[k].joint];
    joint.function_reach_rad = reach_rad;
    joint.function_sigma_rad = slow[k].usual_rad * std::sqrt(best.size[k]);
  }
  set_ranges(problem, e, robot);
  return robot;
}

std::optional<Robot> size_fast_orders(const Problem& problem, const Repeats& repeats,
                                      const Estimate& e) {
  Robot robot = problem.arm().robot();
  const SizedRows rows = sized_rows(problem, e);
  const std::vector<Band> fast = bands_of(problem, rows, e, true);
  std::vector<Eigen::MatrixXd> covariances;
  for (const Band& band : fast)
    covariances.push_back(band.covariance(robot.joints[band.joint].function_reach_rad));
  const Sizing sizing(problem, repeats, e, rows);
  const Components c = sizing.sized(std::move(covariances));
  bool any = false;
  for (std::size_t k = 0; k < fast.size(); ++k) {
    if (!(c.size[k] > 1.0) || !(sizing.gain_of(k, c) > kGainOfFastOrders)) continue;
    robot.joints[fast[k].joint].function_fast_sigma_rad = fast[k].usual_rad * std::sqrt(c.size[k]);
    any = true;
  }
  return any ? std::optional(std::move(robot)) : std::nullopt;
}

double evidence_gain(const Problem& plain, Problem& richer, const Estimate& e) {
  std::vector<ModelLevel> likely;
  for (const LevelEvidence& l : e.levels.levels)
    if (l.probability > 0.01) likely.push_back(l.level);
  return log_evidence(richer, begun_with(plain, richer, e), likely) - log_evidence(e.levels.levels);
}

Estimate estimate_richer(const Problem& plain, Problem& richer, const IdentifyOptions& options,
                         const std::vector<ModelLevel>& levels, const Estimate& e) {
  Estimate with = begun_with(plain, richer, e);
  refine(richer, options, levels, with);
  return with;
}

bool estimate_with_play(const Problem& plain, Problem& played, const IdentifyOptions& options,
                        Estimate& e) {
  if (played.size() == plain.size()) return false;
  Estimate with = begun_with(plain, played, e);
  std::vector<ModelLevel> levels = usual_levels(true), only_play = levels;
  std::erase_if(only_play, [](const ModelLevel& level) { return level.play == 0.0; });
  std::vector<LevelEvidence> likewise = e.levels.levels;  // the same levels without play
  std::erase_if(likewise, [&](const LevelEvidence& l) {
    return l.level.compliance != only_play.front().compliance;
  });
  try {
    const double with_play = log_evidence(played, with, only_play);
    const PlayBeforehand beforehand = play_beforehand();
    constexpr double kNotByChance = 1.0;  // joints without torque leave the odds unchanged
    const bool speaks_for_it =            // (27a)
        with_play - log_evidence(likewise) >
        std::log(beforehand.odds_at_its_compliance) + kNotByChance;
    const bool is_influential =
        with_play - log_evidence(e.levels.levels) > std::log(beforehand.odds);  // (27b)
    if (!speaks_for_it || !is_influential) return false;
    refine(played, options, std::move(levels), with);
  } catch (const IdentifyError&) {
    return false;  // no such arm: another error, diagnosed elsewhere
  }
  e = std::move(with);
  return true;
}

}  // namespace cellcal::calib
