#include "calib/identify/evidence.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/files/error.h"

namespace cellcal::calib {

namespace {

constexpr double kRadPerArcsec = std::numbers::pi / 180.0 / 3600.0;

struct Prior {
  double value, probability;
};
/// Smooth transmission error relative to the usual: a factor of two either way is common.
constexpr Prior kTransmission[] = {{0.0, 0.25}, {0.5, 0.20}, {1.0, 0.25}, {2.0, 0.20}, {4.0, 0.10}};
constexpr Prior kRipple[] = {{0.0, 0.45}, {5.0 * kRadPerArcsec, 0.45}, {15.0 * kRadPerArcsec, 0.1}};
/// The robot file's is the largest that one would expect; a third of it is as usual.
constexpr Prior kCompliance[] = {{0.0, 0.1}, {0.3, 0.5}, {1.0, 0.4}};
/// A level this much less likely than the best (e^-12) has no say.
constexpr double kHopeless = 12.0;
/// Precision of unknowns without a prior: a hair, so that every level stays solvable, and the same
/// in every level, so that it cancels.
constexpr double kFlat = 1e-8;

double log_prior(const ModelLevel& level) {
  double sum = 0.0;
  for (const Prior& p : kCompliance)
    if (p.value == level.compliance) sum += std::log(p.probability);
  for (const Prior& p : kTransmission)
    if (p.value == level.transmission) sum += std::log(p.probability);
  for (const Prior& p : kRipple)
    if (p.value == level.ripple_rad) sum += std::log(p.probability);
  return sum;
}

/// What all levels of one ripple share: J'WJ, the gradient of the touches at u, and the misfit.
struct Gathered {
  double ripple_rad = 0.0;
  Eigen::MatrixXd gram;
  Eigen::VectorXd gradient;
  double square = 0.0, log_weight = 0.0;
};

Gathered gather(const Problem& problem, const Linearisation& at, double ripple_rad) {
  Gathered g;
  g.ripple_rad = ripple_rad;
  Eigen::VectorXd root = Eigen::VectorXd::Ones(at.residual.size());
  if (ripple_rad > 0.0)
    for (const auto& [touch, row] : at.touch_row)
      root.segment(row, problem.rows(touch))
          .setConstant(1.0 / std::hypot(1.0, ripple_rad * problem.joint_lever_m(touch) /
                                                 problem.sigma_m(touch)));
  const RowMajor weighted = root.asDiagonal() * at.jacobian;
  const Eigen::VectorXd residual = root.cwiseProduct(at.residual);
  g.gram = Eigen::MatrixXd::Zero(problem.size(), problem.size());
  g.gram.selfadjointView<Eigen::Lower>().rankUpdate(weighted.transpose());
  g.gradient = weighted.transpose() * residual;
  g.square = residual.squaredNorm();
  g.log_weight = 2.0 * root.array().log().sum();
  return g;
}

/// One level's Gauss-Newton step from u and its evidence.
struct Step {
  std::vector<int> kept;  ///< unknowns that the level has
  Eigen::VectorXd step;   ///< of the kept ones
  Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> information;
  Eigen::VectorXd u;  ///< of all; 0 for those that it has not
  double log_evidence = 0.0;
};

class Levels {
 public:
  Levels(const Problem& problem, const Eigen::VectorXd& u) : problem_(problem), u_(u) {
    const int n = problem.size();
    precision_.resize(n);
    mean_.resize(n);
    gives_.assign(static_cast<std::size_t>(n), false);
    wobbles_.assign(static_cast<std::size_t>(n), false);
    for (int i = 0; i < n; ++i) {
      const Unknown& unknown = problem.unknowns()[i];
      precision_[i] = unknown.prior_weight > 0.0 ? std::pow(unknown.prior_weight, 2) : kFlat;
      mean_[i] = unknown.prior_mean_u;
      if (i >= problem.arm_size()) continue;
      const ArmParameterKind kind = problem.arm().parameters()[i].kind;
      gives_[i] = kind == ArmParameterKind::kCompliance || kind == ArmParameterKind::kLoad;
      wobbles_[i] = kind == ArmParameterKind::kCosine || kind == ArmParameterKind::kSine;
    }
  }

  /// False: not solvable.
  bool solve(const Gathered& g, const ModelLevel& level, Step& out) const {
    out.kept.clear();
    const int n = problem_.size();
    Eigen::VectorXd precision(n);
    for (int i = 0; i < n; ++i) {
      if ((wobbles_[i] && level.transmission <= 0.0) || (gives_[i] && level.compliance <= 0.0))
        continue;
      const double scale = wobbles_[i] ? level.transmission : gives_[i] ? level.compliance : 1.0;
      precision[i] = precision_[i] / (scale * scale);
      out.kept.push_back(i);
    }
    // An unknown that the level has not goes to 0: that step is not the level's to choose.
    Eigen::VectorXd forced = Eigen::VectorXd::Zero(n);
    std::vector<bool> has(static_cast<std::size_t>(n), false);
    for (const int i : out.kept) has[i] = true;
    bool any = false;
    for (int i = 0; i < n; ++i)
      if (!has[i]) {
        forced[i] = -u_[i];
        any = any || forced[i] != 0.0;
      }
    Eigen::VectorXd gradient = g.gradient;
    double square = g.square;
    if (any) {
      const Eigen::VectorXd pulled = g.gram.selfadjointView<Eigen::Lower>() * forced;
      square += 2.0 * g.gradient.dot(forced) + forced.dot(pulled);
      gradient += pulled;
    }
    const auto m = static_cast<Eigen::Index>(out.kept.size());
    Eigen::MatrixXd information(m, m);
    Eigen::VectorXd right(m);
    double log_precision = 0.0;
    for (Eigen::Index c = 0; c < m; ++c) {
      const int i = out.kept[static_cast<std::size_t>(c)];
      for (Eigen::Index r = c; r < m; ++r)
        information(r, c) = g.gram(out.kept[static_cast<std::size_t>(r)], i);
      information(c, c) += precision[i];
      // A centre without prior that turns with the frame: a hair of information keeps it finite.
      constexpr double kHair = 1e-12;
      information(c, c) *= 1.0 + kHair;
      const double off = u_[i] - mean_[i];
      right[c] = -gradient[i] - precision[i] * off;
      square += precision[i] * off * off;
      log_precision += std::log(precision[i]);
    }
    out.information.compute(information);
    if (out.information.info() != Eigen::Success) return false;
    out.step = out.information.solve(right);
    out.u = u_ + forced;
    for (Eigen::Index c = 0; c < m; ++c)
      out.u[out.kept[static_cast<std::size_t>(c)]] += out.step[c];
    const double log_det = 2.0 * out.information.matrixLLT().diagonal().array().log().sum();
    out.log_evidence =
        0.5 * (g.log_weight - (square - right.dot(out.step)) - log_det + log_precision) +
        log_prior(level);
    return true;
  }

 private:
  const Problem& problem_;
  const Eigen::VectorXd& u_;
  Eigen::VectorXd precision_, mean_;
  std::vector<bool> gives_, wobbles_;
};

}  // namespace

std::vector<ModelLevel> usual_levels() {
  std::vector<ModelLevel> levels;
  for (const Prior& ripple : kRipple)
    for (const Prior& compliance : kCompliance)
      for (const Prior& transmission : kTransmission)
        levels.push_back({compliance.value, transmission.value, ripple.value});
  return levels;
}

LevelMean mean_over_levels(const Problem& problem, const Eigen::VectorXd& u,
                           const Linearisation& at, std::span<const ModelLevel> levels) {
  const Levels solver(problem, u);
  std::vector<Gathered> gathered;
  std::vector<Step> steps(levels.size());
  std::vector<std::size_t> solved;
  for (std::size_t k = 0; k < levels.size(); ++k) {
    auto g = std::find_if(gathered.begin(), gathered.end(), [&](const Gathered& other) {
      return other.ripple_rad == levels[k].ripple_rad;
    });
    if (g == gathered.end())
      g = gathered.insert(gathered.end(), gather(problem, at, levels[k].ripple_rad));
    if (solver.solve(*g, levels[k], steps[k])) solved.push_back(k);
  }
  if (solved.empty())
    throw IdentifyError(
        "the touches and priors do not determine the unknowns; give the targets a "
        "centre_sigma_mm and the joints tolerances");
  std::stable_sort(solved.begin(), solved.end(), [&](std::size_t a, std::size_t b) {
    return steps[a].log_evidence > steps[b].log_evidence;
  });
  const double best = steps[solved.front()].log_evidence;
  double sum = 0.0;
  for (const std::size_t k : solved) sum += std::exp(steps[k].log_evidence - best);

  LevelMean result;
  result.u = Eigen::VectorXd::Zero(u.size());
  for (const std::size_t k : solved) {
    const double p = std::exp(steps[k].log_evidence - best) / sum;
    result.levels.push_back({levels[k], steps[k].log_evidence, p});
    if (best - steps[k].log_evidence > kHopeless) continue;
    result.u += p * steps[k].u;
    result.ripple_rad += p * std::pow(levels[k].ripple_rad, 2);
    result.transmission += p * std::pow(levels[k].transmission, 2);
  }
  result.ripple_rad = std::sqrt(result.ripple_rad);
  result.transmission = std::sqrt(result.transmission);
  // Within the levels, and between them.
  result.covariance_u = Eigen::MatrixXd::Zero(u.size(), u.size());
  for (std::size_t rank = 0; rank < solved.size(); ++rank) {
    const Step& s = steps[solved[rank]];
    if (best - s.log_evidence > kHopeless) break;
    const double p = result.levels[rank].probability;
    const auto m = static_cast<Eigen::Index>(s.kept.size());
    const Eigen::MatrixXd inverse = s.information.solve(Eigen::MatrixXd::Identity(m, m));
    for (Eigen::Index c = 0; c < m; ++c)
      for (Eigen::Index r = 0; r < m; ++r)
        result.covariance_u(s.kept[static_cast<std::size_t>(r)],
                            s.kept[static_cast<std::size_t>(c)]) += p * inverse(r, c);
    const Eigen::VectorXd off = s.u - result.u;
    result.covariance_u += p * off * off.transpose();
  }
  return result;
}

}  // namespace cellcal::calib
