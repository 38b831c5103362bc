#include "calib/estimate/discrepancy.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/estimate/joint_functions.h"
#include "calib/model/error.h"
#include "calib/model/linear.h"
#include "calib/model/long_work.h"
#include "calib/model/product.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

/// Candidate correlation lengths: a tenth of a radian is about 0.1 m at a distance of 1 m.
constexpr double kReachesRad[] = {0.1, 0.3, 1.0};
/// Distance below which postures count as the same, so that the rough share is nearly constant too.
/// A step in place of the Gaussian would give a correlation matrix that is not positive definite.
constexpr double kSamePlaceRad = 5e-3;
/// Candidate shares of the field that differ between postures at any distance.
constexpr double kRough[] = {0.0, 0.5, 1.0};
/// Maximum number of rows for the sizes; more would not improve their accuracy notably.
constexpr std::size_t kEnoughRows = 200;
/// Upper limits of the usual repeatability of an electrical contact or a seated ball, and of a
/// tracker. Scatter beyond them that no repeats show to be noise is attributed to the arm.
constexpr double kUsualNoiseM = 0.05e-3, kUsualTrackerNoiseM = 0.015e-3;
/// Fewest degrees of freedom for a measured repeatability.
constexpr double kEnoughRepeats = 3.0;

/// Direction of the tip that a row measures.
struct Row {
  std::size_t touch;
  Eigen::Vector3d along;
};

std::vector<Row> rows_of(const Problem& problem, const Eigen::VectorXd& u,
                         const std::vector<std::size_t>& touches) {
  const Eigen::VectorXd x = problem.to_si(u);
  const Problem::At at = problem.at(x.data());
  std::vector<Row> rows;
  for (const std::size_t i : touches) {
    if (problem.rows(i) >= 3) {
      for (int axis = 0; axis < 3; ++axis) rows.push_back({i, Eigen::Vector3d::Unit(axis)});
      // Rotation rows of a tracker: the field is one of positions.
      for (int k = 3; k < problem.rows(i); ++k) rows.push_back({i, Eigen::Vector3d::Zero()});
      continue;
    }
    double r[Problem::kMostRows];
    Row row{i, Eigen::Vector3d::Zero()};
    problem.residual_m(i, at, r, nullptr, nullptr, &row.along);
    rows.push_back(row);
  }
  return rows;
}

/// Joint angles, each scaled by its share in moving the tip; a column per touch.
Eigen::MatrixXd postures_of(const Problem& problem) {
  const auto touches = problem.touches();
  const auto count = static_cast<Eigen::Index>(touches.size());
  Eigen::MatrixXd postures(problem.arm().joint_count(), count);
  Eigen::VectorXd lever = Eigen::VectorXd::Zero(postures.rows());
  for (Eigen::Index i = 0; i < count; ++i) {
    const JointVector& q = touches[static_cast<std::size_t>(i)].joint_rad;
    postures.col(i) = Eigen::Map<const Eigen::VectorXd>(q.data(), postures.rows());
    lever += problem.arm().nominal_jacobian(q).topRows<3>().colwise().squaredNorm().transpose();
  }
  lever = lever.cwiseSqrt();
  return (lever / lever.maxCoeff()).asDiagonal() * postures;  // (29)
}

Eigen::MatrixXd distances(const Eigen::MatrixXd& postures, const std::vector<Row>& rows) {
  const auto n = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd apart(n, n);
  const auto posture = [&](Eigen::Index i) {
    return postures.col(static_cast<Eigen::Index>(rows[static_cast<std::size_t>(i)].touch));
  };
  for (Eigen::Index a = 0; a < n; ++a)
    for (Eigen::Index b = 0; b <= a; ++b)
      apart(a, b) = apart(b, a) = (posture(a) - posture(b)).norm();
  return apart;
}

/// Correlation of the field between rows.
Eigen::MatrixXd correlation_of(const Eigen::MatrixXd& apart, const std::vector<Row>& rows,
                               double reach_rad, double rough) {
  Eigen::MatrixXd k(apart.rows(), apart.cols());
  for (Eigen::Index a = 0; a < k.rows(); ++a)
    for (Eigen::Index b = 0; b <= a; ++b) {
      const double d = apart(a, b);
      double alike = rough * std::exp(-0.5 * std::pow(d / kSamePlaceRad, 2));  // (29)
      if (rough < 1.0) alike += (1.0 - rough) * std::exp(-d / reach_rad);
      k(a, b) = k(b, a) = alike * rows[static_cast<std::size_t>(a)].along.dot(
                                      rows[static_cast<std::size_t>(b)].along);
    }
  return k;
}

/// All of `touches`, or a sample spread over them together with the nearest neighbour of each:
/// short correlation lengths are visible only in neighbours.
std::vector<std::size_t> some_of(const Problem& problem, const Eigen::MatrixXd& postures,
                                 const std::vector<std::size_t>& touches) {
  std::size_t rows = 0;
  for (const std::size_t i : touches) rows += static_cast<std::size_t>(problem.rows(i));
  if (rows <= kEnoughRows) return touches;
  const std::size_t wanted = kEnoughRows * touches.size() / rows / 2;
  std::vector<bool> taken(problem.touches().size(), false);
  for (std::size_t k = 0; k < wanted; ++k) {
    const std::size_t one = touches[k * touches.size() / wanted];
    taken[one] = true;
    double least = std::numeric_limits<double>::infinity();
    std::size_t nearest = one;
    for (const std::size_t other : touches) {
      const double apart = (postures.col(static_cast<Eigen::Index>(one)) -
                            postures.col(static_cast<Eigen::Index>(other)))
                               .squaredNorm();
      if (taken[other] || apart >= least) continue;
      least = apart;
      nearest = other;
    }
    taken[nearest] = true;
  }
  std::vector<std::size_t> some;
  for (const std::size_t i : touches)
    if (taken[i]) some.push_back(i);
  return some;
}

std::vector<std::size_t> touches_in(const Linearisation& linear) {
  std::vector<std::size_t> touches;
  for (const auto& [touch, row] : linear.touch_row) touches.push_back(touch);
  return touches;
}

std::vector<bool> only(const std::vector<std::size_t>& touches, std::size_t count) {
  std::vector<bool> use(count, false);
  for (const std::size_t i : touches) use[i] = true;
  return use;
}

/// Rows of the touches without whitening, in metres.
struct Measured {
  RowMajor jacobian;
  Eigen::VectorXd residual_m;
};
Measured in_metres(const Problem& problem, const Eigen::VectorXd& u,
                   const std::vector<std::size_t>& touches) {
  const Linearisation linear = linearise(problem, u, only(touches, problem.touches().size()));
  Measured m{linear.jacobian.topRows(linear.length_row), linear.residual.head(linear.length_row)};
  for (const auto& [touch, row] : linear.touch_row)
    for (int k = row; k < row + problem.rows(touch); ++k) {
      m.jacobian.row(k) *= problem.sigma_m(touch);
      m.residual_m[k] *= problem.sigma_m(touch);
    }
  return m;
}

/// Sizes of field and noise.
struct Sizes {
  double field_m = 0.0, noise_factor = 1.0, reach_rad = 0.0, rough = 1.0;
  double freedom = 0.0;  ///< degrees of freedom of the field's variance
};

/// Restricted likelihood over a grid of sizes; mean of the variances, and most likely reach.
Sizes sizes_of(const Problem& problem, const Eigen::VectorXd& u, const Eigen::MatrixXd& postures,
               const std::vector<std::size_t>& touches, bool noise_is_known) {
  constexpr double kOfScatter[] = {0.0, 0.15, 0.3, 0.45, 0.6, 0.75, 0.9,
                                   1.1, 1.4,  1.8, 2.4,  3.2, 4.3,  5.7};
  constexpr double kNoise[] = {0.1, 0.2, 0.35, 0.6, 1.0, 1.7, 3.0, 6.0, 10.0};
  constexpr double kNoiseSigma = 0.7;  // of the logarithm of the factor to the stated noise
  const std::vector<Row> rows = rows_of(problem, u, touches);
  const Measured m = in_metres(problem, u, touches);
  const Eigen::MatrixXd apart = distances(postures, rows);
  const auto n = static_cast<Eigen::Index>(rows.size());
  const IntegratedRows integrated(problem, u, m.jacobian, m.residual_m);
  Eigen::VectorXd own(n);
  for (Eigen::Index k = 0; k < n; ++k)
    own[k] = std::pow(problem.own_sigma_m(rows[static_cast<std::size_t>(k)].touch), 2);
  const double scatter_m = std::sqrt(m.residual_m.squaredNorm() / static_cast<double>(n));

  struct Tried {
    Sizes sizes;
    double log_likelihood;
  };
  std::vector<Tried> tried;
  for (const double rough : kRough)
    for (const double reach : kReachesRad) {
      if (rough == 1.0 && reach != kReachesRad[0]) continue;  // no smooth part
      const Eigen::MatrixXd k = correlation_of(apart, rows, reach, rough);
      for (const double factor : kNoise) {
        if (noise_is_known && factor != 1.0) continue;
        Eigen::MatrixXd without = integrated.by_unknowns;
        without.diagonal() += factor * factor * own;
        for (const double share : kOfScatter) {
          poll_cancelled();
          const double field = share * scatter_m;
          const Cholesky v(without + field * field * k);  // (31)
          if (!v.positive()) continue;
          const Eigen::VectorXd w = v.whitened(integrated.y);
          tried.push_back({{field, factor, rough == 1.0 ? 0.0 : reach, rough},
                           -0.5 * w.squaredNorm() - 0.5 * v.log_det() -
                               0.5 * std::pow(std::log(factor) / kNoiseSigma, 2)});
        }
      }
    }
  if (tried.empty()) return {};
  const double best =
      std::max_element(tried.begin(), tried.end(), [](const Tried& a, const Tried& b) {
        return a.log_likelihood < b.log_likelihood;
      })->log_likelihood;
  Sizes mean{0.0, 0.0, 0.0, 1.0};
  double sum = 0.0, most = 0.0, own_kernel = 0.0, second = 0.0, fourth = 0.0, noise_second = 0.0;
  for (std::size_t i = 0; i < tried.size(); ++i) {
    const double weight = std::exp(tried[i].log_likelihood - best);
    const Sizes& s = tried[i].sizes;
    sum += weight;
    second += weight * s.field_m * s.field_m;
    fourth += weight * std::pow(s.field_m, 4);
    noise_second += weight * s.noise_factor * s.noise_factor;
    const bool new_kernel = i == 0 || s.reach_rad != tried[i - 1].sizes.reach_rad ||
                            s.rough != tried[i - 1].sizes.rough;
    own_kernel = weight + (new_kernel ? 0.0 : own_kernel);
    if (own_kernel <= most) continue;
    most = own_kernel;
    mean.reach_rad = s.reach_rad;
    mean.rough = s.rough;
  }
  const double variance = second / sum, spread = fourth / sum - variance * variance;
  mean.field_m = std::sqrt(variance);
  mean.freedom = spread > 0.0 ? 2.0 * variance * variance / spread : 0.0;  // (31a)
  mean.noise_factor = std::sqrt(noise_second / sum);
  return mean;
}

/// L with L L' = correlation of the touch errors, noise and field together.
Eigen::MatrixXd together(const Problem& problem, const Eigen::VectorXd& u,
                         const Eigen::MatrixXd& postures, const std::vector<std::size_t>& touches,
                         const Sizes& sizes) {
  const std::vector<Row> rows = rows_of(problem, u, touches);
  Eigen::MatrixXd v = sizes.field_m * sizes.field_m *
                      correlation_of(distances(postures, rows), rows, sizes.reach_rad, sizes.rough);
  Eigen::VectorXd weight(v.rows());
  for (Eigen::Index k = 0; k < v.rows(); ++k) {
    const std::size_t touch = rows[static_cast<std::size_t>(k)].touch;
    v(k, k) += std::pow(problem.own_sigma_m(touch), 2);
    weight[k] = 1.0 / problem.sigma_m(touch);
  }
  v = weight.asDiagonal() * v * weight.asDiagonal();  // (32)
  const Cholesky factor(v);
  if (!factor.positive())
    throw IdentifyError(IdentifyError::Kind::kNotSolved,
                        "model discrepancy and noise cannot be separated");
  return factor.lower();
}

std::vector<std::size_t> spread_over(const std::vector<bool>& use) {
  std::vector<std::size_t> all, some;
  for (std::size_t i = 0; i < use.size(); ++i)
    if (use[i]) all.push_back(i);
  if (all.size() <= kMostTouchesOfField) return all;
  for (std::size_t k = 0; k < kMostTouchesOfField; ++k)
    some.push_back(all[k * all.size() / kMostTouchesOfField]);
  return some;
}

std::vector<ModelLevel> levels_without_ripple() {
  std::vector<ModelLevel> levels = usual_levels();
  std::erase_if(levels, [](const ModelLevel& level) { return level.ripple_rad > 0.0; });
  return levels;
}

/// Gauss-Newton steps of all levels with correlated rows until the estimate no longer changes.
void solve_together(const Problem& problem, const Eigen::MatrixXd& postures, const Sizes& sizes,
                    Estimate& e) {
  constexpr int kRounds = 12;
  constexpr double kStep = 1e-2;  // as in refine()
  const std::vector<ModelLevel> levels = levels_without_ripple();
  const std::vector<std::size_t> touches = spread_over(e.use);
  const std::vector<bool> use = only(touches, problem.touches().size());
  Posterior& p = e.posterior;
  p.together = together(problem, e.u, postures, touches, sizes);
  const auto linearise_whitened = [&] {
    linearise(problem, e.u, use, p.linear);
    const auto lower = p.together.triangularView<Eigen::Lower>();
    auto rows = p.linear.jacobian.topRows(p.linear.length_row);
    rows = lower.solve(RowMajor(rows));
    auto residual = p.linear.residual.head(p.linear.length_row);
    residual = lower.solve(Eigen::VectorXd(residual));
  };
  for (int round = 0; round < kRounds; ++round) {
    poll_cancelled();
    linearise_whitened();
    e.levels = mean_over_levels(problem, e.u, p.linear, levels);
    const double step = (e.levels.u - e.u).lpNorm<Eigen::Infinity>();
    e.u = e.levels.u;
    if (step < kStep) break;
  }
  linearise_whitened();
  p.covariance_u = e.levels.covariance_u;
  p.leverage = leverage_of(p.linear.jacobian, p.covariance_u);
}

/// Selects the touches within the gate of their own sigma, field included. Returns true if the
/// selection changed.
bool select_alone(const Problem& problem, Estimate& e) {
  Estimate alone = e;
  linearise(problem, e.u, e.use, alone.posterior.linear);
  alone.posterior.leverage =
      leverage_of(alone.posterior.linear.jacobian, alone.posterior.covariance_u);
  std::vector<bool> inliers = select_inliers(problem, alone);
  e.gate = alone.gate;
  std::swap(e.use, inliers);
  return e.use != inliers;
}

/// Removes touches in use that contradict the prediction from all others, with which they share the
/// field: half a millimetre may be due to the field, but not next to a repeat without it. With V_w
/// = V_c + J P^-1 J', the covariance of the whitened touches before the fit, (V_w^-1 r_mu)_i /
/// sqrt((V_w^-1)_ii) is the studentised leave-one-out residual. Only the worst are removed at a
/// time, since they affect their neighbours. Returns true if any was removed.
bool reject_by_others(const Problem& problem, Estimate& e) {
  constexpr double kOfWorst = 0.7;
  const Posterior& p = e.posterior;
  const Eigen::Index n = p.linear.length_row;
  const auto lower = p.together.triangularView<Eigen::Lower>();
  const Eigen::MatrixXd inverse = lower.solve(Eigen::MatrixXd::Identity(n, n));
  const Eigen::MatrixXd by_unknowns = product(inverse.transpose(), p.linear.jacobian.topRows(n));
  const Eigen::VectorXd pull = inverse.transpose() * p.linear.residual.head(n);
  const Eigen::VectorXd information =
      inverse.colwise().squaredNorm().transpose() -
      product(by_unknowns, p.covariance_u).cwiseProduct(by_unknowns).rowwise().sum();
  constexpr double kLeast = 1e-9;
  std::vector<double> off;
  for (const auto& [touch, row] : p.linear.touch_row) {
    off.push_back(0.0);
    for (int k = row; k < row + problem.rows(touch); ++k)
      if (information[k] > kLeast)
        off.back() =  // (32a)
            std::max(off.back(), std::abs(pull[k]) / std::sqrt(information[k]));
  }
  if (off.empty()) return false;
  const double gate = kOutlierSigma * std::max(1.0, median(off) / kNormalMedian);
  const double worst = *std::max_element(off.begin(), off.end());
  if (worst <= gate) return false;
  for (std::size_t k = 0; k < off.size(); ++k)
    if (off[k] > gate && off[k] >= kOfWorst * worst) e.use[p.linear.touch_row[k].first] = false;
  return true;
}

}  // namespace

Eigen::MatrixXd left_by_fit(const Eigen::Ref<const RowMajor>& jacobian,
                            const Eigen::MatrixXd& covariance_u) {
  Eigen::MatrixXd left = -product(product(jacobian, covariance_u), jacobian.transpose());
  left.diagonal().array() += 1.0;
  return left;
}

double correlation_sigmas(const Eigen::VectorXd& r, const Eigen::MatrixXd& k,
                          const Eigen::MatrixXd& left, double scatter) {
  const Eigen::MatrixXd through = product(k, left);
  const double variance = 2.0 * through.cwiseProduct(through.transpose()).sum();
  if (!(variance > 0.0)) return 0.0;
  return (r.dot(k * r) / scatter - through.trace()) / std::sqrt(variance);  // (30)
}

IntegratedRows::IntegratedRows(const Problem& problem, const Eigen::VectorXd& u,
                               const RowMajor& jacobian, const Eigen::VectorXd& residual_m) {
  constexpr double kAnywhere = 10.0;
  Eigen::VectorXd prior(problem.size()), off(problem.size());
  for (int i = 0; i < problem.size(); ++i) {
    const Unknown& unknown = problem.unknowns()[static_cast<std::size_t>(i)];
    const bool stated = unknown.prior_weight > 0.0;
    prior[i] = std::min(kAnywhere, stated ? 1.0 / unknown.prior_weight : kAnywhere);
    off[i] = stated ? unknown.prior_mean_u - u[i] : 0.0;
  }
  y = residual_m + jacobian * off;
  const Eigen::MatrixXd reached = jacobian * prior.asDiagonal();
  by_unknowns = product(reached, reached.transpose());
}

double alike_sigmas(const Problem& problem, const Estimate& e, double chi2_per_dof) {
  const Eigen::MatrixXd postures = postures_of(problem);
  const auto touches =
      some_of(problem, postures, touches_in(mean_rows(problem, e.posterior.linear).linear));
  if (touches.size() < 3 || !(chi2_per_dof > 0.0)) return 0.0;
  const std::vector<Row> rows = rows_of(problem, e.u, touches);
  std::vector<bool> places(e.use.size(), false), with_repeats = e.use;
  for (const std::size_t i : touches) places[problem.first_of_place(i)] = true;
  for (std::size_t i = 0; i < e.use.size(); ++i)
    if (!places[problem.first_of_place(i)]) with_repeats[i] = false;
  const Linearisation linear = mean_rows(problem, linearise(problem, e.u, with_repeats)).linear;
  const Eigen::VectorXd r = linear.residual.head(linear.length_row);
  const Eigen::MatrixXd left =
      left_by_fit(linear.jacobian.topRows(linear.length_row), e.posterior.covariance_u);
  const Eigen::MatrixXd apart = distances(postures, rows);
  double most = 0.0;
  for (const double reach : kReachesRad) {
    poll_cancelled();
    Eigen::MatrixXd k = correlation_of(apart, rows, reach, 0.0);
    for (Eigen::Index a = 0; a < k.rows(); ++a)
      for (Eigen::Index b = 0; b < k.cols(); ++b)
        if (apart(a, b) < kSamePlaceRad) k(a, b) = 0.0;
    most = std::max(most, correlation_sigmas(r, k, left, chi2_per_dof));
  }
  return most;
}

UndetectedErrors undetected_errors(const Problem& problem, const Estimate& e,
                                   const Repeats& repeats) {
  const MeanRows mean = mean_rows(problem, e.posterior.linear);
  const bool measured = repeats.degrees_of_freedom >= kEnoughRepeats;
  const double measured_m =
      std::max(repeats.used_degrees > 0.0 ? repeats.used_m : 0.0, repeats.scatter_m);
  double scatter = 0.0, ripple = 0.0, noise = 0.0, count = 0.0, postures = 0.0, freedom = 0.0;
  for (const auto& [touch, row] : mean.linear.touch_row) {
    const Target& target =
        problem.cell().targets[problem.cell().target_index(problem.touches()[touch].target)];
    const double usual_m = target.kind == TargetKind::kTracker ? kUsualTrackerNoiseM : kUsualNoiseM;
    const double times = mean.times[touch];
    for (int k = 0; k < problem.place_rows(touch); ++k) {
      scatter += std::pow(mean.linear.residual[row + k] * problem.sigma_m(touch), 2) / times;
      freedom += 1.0;
    }
    ripple +=
        std::pow(e.levels.ripple_rad * problem.joint_lever_m(touch), 2) / repeats.times[touch];
    noise += std::pow(measured ? measured_m : usual_m, 2) / times;
    count += 1.0;
    postures += times / repeats.times[touch];
  }
  for (const auto& [touch, row] : e.posterior.linear.touch_row)
    for (int k = 0; k < problem.place_rows(touch); ++k) freedom -= e.posterior.leverage[row + k];
  UndetectedErrors errors;
  if (count == 0.0) return errors;
  freedom = std::max(freedom, 1.0);
  noise /= count;
  ripple /= count;
  const double rest = scatter / freedom - ripple - noise;  // (33)
  // A remainder below this share of the noise variance may be chance.
  constexpr double kChance = 0.5;
  if (rest > kChance * noise) errors.field_m = std::sqrt(rest);
  // Reflectors read in one posture share its error.
  const double by_chance = 2.0 * std::sqrt(2.0 * count / (freedom * postures)) * noise;
  errors.shared_m = std::sqrt(std::max(rest, by_chance) + ripple);
  return errors;
}

SharedErrors shared_errors(const Problem& problem, const Estimate& e) {
  constexpr double kReachRad = 12.0 * kRadPerDeg;
  constexpr int kHighestOrder = 30;
  constexpr double kMostAbsorbed = 4.0;  ///< more would make the bounds of a few poses useless
  const MeanRows mean = mean_rows(problem, e.posterior.linear);
  const Eigen::Index rows = mean.linear.length_row;
  const Eigen::MatrixXd jacobian = mean.linear.jacobian.topRows(rows);
  const Eigen::MatrixXd by_rows =
      product(e.posterior.covariance_u, Eigen::MatrixXd(jacobian.transpose()));
  double wanted = 0.0, lever2 = 0.0, whole = 0.0, left = 0.0;
  for (const auto& [touch, row] : mean.linear.touch_row)
    wanted +=
        problem.place_rows(touch) * mean.times[touch] * std::pow(1.0 / problem.sigma_m(touch), 2);
  const std::vector<double> shares = function_shares(kReachRad, 1, kHighestOrder);
  Eigen::VectorXd sigma(2 * kHighestOrder);
  for (Eigen::Index k = 0; k < sigma.size(); ++k)
    sigma[k] = shares[static_cast<std::size_t>(k / 2)];
  Eigen::MatrixXd added = Eigen::MatrixXd::Zero(problem.size(), problem.size());
  for (const RowsOfJoint& one : rows_by_joint(problem, e.u, mean)) {
    lever2 += one.lever.squaredNorm();
    Eigen::MatrixXd waves = waves_of(one, 1, kHighestOrder) * sigma.asDiagonal();
    if (e.posterior.together.size() > 0)
      e.posterior.together.triangularView<Eigen::Lower>().solveInPlace(waves);
    const Eigen::MatrixXd moved = product(by_rows, waves);
    add_product(1.0, moved, moved.transpose(), added);
    whole += waves.squaredNorm();
    left += (waves - product(jacobian, moved)).squaredNorm();
  }
  if (!(lever2 > 0.0)) return {added};
  // The residuals lack what the fit absorbed: of smooth errors more than of independent ones.
  const double absorbed =
      (1.0 - by_rows.cwiseProduct(jacobian.transpose()).sum() / static_cast<double>(rows)) * whole /
      std::max(left, 1e-9 * whole);
  return {wanted / lever2 * added,
          std::clamp(std::sqrt(std::max(0.0, absorbed)), 1.0, kMostAbsorbed)};
}

Discrepancy estimate_together(Problem& problem, const IdentifyOptions& options,
                              const Repeats& repeats, Estimate& e) {
  constexpr int kRounds = 8;
  problem.set_ripple(0.0);
  const Eigen::MatrixXd postures = postures_of(problem);
  const bool measured = repeats.used_degrees >= kEnoughRepeats;
  std::vector<std::size_t> used;
  double noise_factor = 1.0;
  Sizes sizes;
  const auto size = [&] {
    used.clear();
    for (std::size_t i = 0; i < e.use.size(); ++i)
      if (e.use[i]) used.push_back(i);
    problem.set_field(0.0, 1.0 / noise_factor);
    sizes = sizes_of(problem, e.u, postures, some_of(problem, postures, used), measured);
    noise_factor = sizes.noise_factor;
    problem.set_field(sizes.field_m, noise_factor);
  };
  size();
  for (int round = 0;; ++round) {
    solve_together(problem, postures, sizes, e);
    if (round + 1 == kRounds || !options.reject_outliers) break;
    if (round < 2 && select_alone(problem, e)) continue;
    if (!reject_by_others(problem, e)) break;
    size();  // a gross error changes the size of the field
  }
  Discrepancy found;
  found.estimated = true;
  found.sigma_m = sizes.field_m;
  found.reach_rad = sizes.reach_rad;
  found.degrees_of_freedom = sizes.freedom;
  double square = 0.0;
  for (const std::size_t i : used) square += std::pow(problem.own_sigma_m(i), 2);
  found.noise_m = std::sqrt(square / static_cast<double>(std::max<std::size_t>(1, used.size())));
  return found;
}

}  // namespace cellcal::calib
