#include "calib/consistency/unseen.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/consistency/residuals.h"
#include "calib/linear/cholesky.h"
#include "calib/model/error.h"
#include "calib/model/long_work.h"

namespace cellcal::calib {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Rows that have to be left over, or the place would explain anything: five touches of a sphere
/// leave two, less what they say of its diameter.
constexpr double kLeastFree = 1.5;

std::vector<std::size_t> touches_of(const Problem& problem, std::size_t target) {
  std::vector<std::size_t> own;
  for (std::size_t i = 0; i < problem.touches().size(); ++i)
    if (problem.touches()[i].target == problem.cell().targets[target].id) own.push_back(i);
  return own;
}

/// The check touches of one target, as a problem of their own in which its place alone is unknown.
class Sighting {
 public:
  /// `of`: their indices in the fitted problem.
  Sighting(const Problem& fitted, const VectorXd& x_si, const Calibration& c,
           const std::vector<std::size_t>& of)
      : of_(of),
        touches_(as_fit(fitted, of_)),
        problem_(fitted.cell(), fitted.arm(), touches_,
                 starting_places(fitted.cell(), fitted.arm(), touches_)) {
    const double usual_m = c.repeats.used_m > 0.0 ? c.repeats.used_m : fitted.cell().touch_sigma_m;
    problem_.set_repeats(std::vector<int>(of_.size(), 1), usual_m);
    problem_.set_ripple(c.level.ripple_rad);
    x_ = problem_.to_si(VectorXd::Zero(problem_.size()));
    x_.head(problem_.arm_size()) = x_si.head(problem_.arm_size());
    shared_.assign(static_cast<std::size_t>(problem_.shared_size()), -1);
    for (int i = 0; i < problem_.arm_size(); ++i) shared_[static_cast<std::size_t>(i)] = i;
    for (int tool = 0; tool < problem_.arm().tool_count(); ++tool) {
      if (problem_.rho(tool) < 0 || fitted.rho(tool) < 0) continue;
      x_[problem_.rho(tool)] = x_si[fitted.rho(tool)];
      shared_[static_cast<std::size_t>(problem_.rho(tool))] = fitted.rho(tool);
    }
    if (problem_.delay() >= 0 && fitted.delay() >= 0) {
      x_[problem_.delay()] = x_si[fitted.delay()];
      shared_[static_cast<std::size_t>(problem_.delay())] = fitted.delay();
    }
  }

  /// Whether the touches say more than where it is.
  bool fit() {
    constexpr int kSteps = 20;
    constexpr double kSettled = 1e-9;  // in prior units
    const TargetBlock& block = problem_.blocks().front();
    for (int step = 0; step < kSteps; ++step) {
      poll_cancelled();
      linearise();
      VectorXd pull = -by_place_.transpose() * residual_;
      for (int k = 0; k < block.size(); ++k) {
        const Unknown& unknown = unknown_of(k);
        const double u = (x_[block.first + k] - unknown.origin) / unknown.scale;
        pull[k] -= unknown.prior_weight * unknown.prior_weight * (u - unknown.prior_mean_u);
      }
      const VectorXd change = covariance_ * pull;
      if (!change.allFinite()) return false;
      for (int k = 0; k < block.size(); ++k) x_[block.first + k] += unknown_of(k).scale * change[k];
      if (change.lpNorm<Eigen::Infinity>() < kSettled) break;
    }
    linearise();
    held_ = by_place_ * covariance_ * by_place_.transpose();  // (53)
    free_ = (1.0 - held_.diagonal().array()).cwiseMax(0.0);
    return free_.sum() >= kLeastFree;
  }

  double degrees_of_freedom() const { return free_.sum(); }

  /// Per touch, with what the calibration foresees for it.
  void judge(const MatrixXd& covariance_si, std::vector<HeldOut>& all) const {
    const Eigen::Index rows = residual_.size();
    MatrixXd by_fit = MatrixXd::Zero(rows, covariance_si.cols());
    for (std::size_t k = 0; k < shared_.size(); ++k)
      if (shared_[k] >= 0) by_fit.col(shared_[k]) = by_shared_.col(static_cast<Eigen::Index>(k));
    const MatrixXd rest = MatrixXd::Identity(rows, rows) - held_;
    const MatrixXd foreseen =  // (53)
        rest * (MatrixXd::Identity(rows, rows) + by_fit * covariance_si * by_fit.transpose()) *
        rest.transpose();
    for (std::size_t i = 0; i < of_.size(); ++i) {
      HeldOut one{of_[i], 0.0, 0.0};
      for (Eigen::Index r = first_[i]; r < first_[i] + problem_.rows(i); ++r) {
        if (!(free_[r] > kHeldAlone)) continue;
        one.square += free_[r] * residual_[r] * residual_[r] / foreseen(r, r);
        one.rows += free_[r];
      }
      if (one.rows > 0.0) all.push_back(one);
    }
  }

  /// The residuals as they would be were the place known.
  void fill(Calibration& calibration) const {
    VectorXd nominal = problem_.to_si(VectorXd::Zero(problem_.size()));
    const TargetBlock& block = problem_.blocks().front();
    nominal.segment(block.first, block.place) =
        place_seen_by_nominal_arm(problem_, 0, std::vector<bool>(touches_.size(), false));
    const Problem::At before = problem_.at(nominal.data()), after = problem_.at(x_.data());
    for (std::size_t i = 0; i < of_.size(); ++i) {
      TouchResidual& entry = calibration.residuals[of_[i]];
      const int rows = problem_.place_rows(i);
      const double left = free_.segment(first_[i], rows).mean();
      const double scale = left > kHeldAlone ? 1.0 / std::sqrt(left) : 0.0;
      const auto size = [&](const Problem::At& at, Eigen::Vector3d* direction) {
        double r[Problem::kMostRows];
        problem_.residual_m(i, at, r, nullptr, nullptr, direction);
        return scale * (rows == 1 ? r[0] : Eigen::Map<const VectorXd>(r, rows).norm());
      };
      entry.before_m = size(before, nullptr);
      entry.after_m = size(after, &entry.direction);
      entry.whitened = entry.after_m / problem_.sigma_m(i);
    }
  }

 private:
  /// A row that holds its own place says nothing.
  static constexpr double kHeldAlone = 1e-6;

  static std::vector<Touch> as_fit(const Problem& fitted, const std::vector<std::size_t>& which) {
    std::vector<Touch> own;
    for (const std::size_t i : which) {
      own.push_back(fitted.touches()[i]);
      own.back().set = TouchSet::kFit;
    }
    return own;
  }

  const Unknown& unknown_of(int k) const {
    return problem_.unknowns()[static_cast<std::size_t>(problem_.blocks().front().first + k)];
  }

  /// Whitened rows at x, and the covariance of the place's own unknowns in prior units.
  void linearise() {
    const TargetBlock& block = problem_.blocks().front();
    first_.clear();
    Eigen::Index count = 0;
    for (std::size_t i = 0; i < of_.size(); ++i) {
      first_.push_back(count);
      count += problem_.rows(i);
    }
    residual_.resize(count);
    by_shared_.resize(count, problem_.shared_size());
    by_place_.resize(count, block.size());
    const Problem::At at = problem_.at(x_.data());
    for (std::size_t i = 0; i < of_.size(); ++i) {
      const int rows = problem_.rows(i);
      RowMajor shared(rows, problem_.shared_size()), place(rows, block.size());
      problem_.residual_m(i, at, residual_.data() + first_[i], shared.data(), place.data());
      const double sigma = problem_.sigma_m(i);
      residual_.segment(first_[i], rows) /= sigma;
      by_shared_.middleRows(first_[i], rows) = shared / sigma;
      by_place_.middleRows(first_[i], rows) = place / sigma;
    }
    MatrixXd information = MatrixXd::Zero(block.size(), block.size());
    for (int k = 0; k < block.size(); ++k) {
      by_place_.col(k) *= unknown_of(k).scale;
      information(k, k) = std::pow(unknown_of(k).prior_weight, 2);
    }
    information += by_place_.transpose() * by_place_;
    covariance_ = Cholesky(information).inverse();
  }

  std::vector<std::size_t> of_;  ///< indices of its touches in the fitted problem
  std::vector<Touch> touches_;
  Problem problem_;
  VectorXd x_;
  std::vector<int> shared_;  ///< per shared unknown its index in the fitted problem, or -1
  std::vector<Eigen::Index> first_;
  VectorXd residual_;
  MatrixXd by_shared_, by_place_, covariance_, held_;
  Eigen::ArrayXd free_;
};

/// Of touches that give no place to fit from.
UnseenTarget::NotJudged not_judged_for(IdentifyError::Kind kind) {
  switch (kind) {
    case IdentifyError::Kind::kTouches:
      return UnseenTarget::NotJudged::kUnusable;
    case IdentifyError::Kind::kCell:
      return UnseenTarget::NotJudged::kOtherNormal;
    default:
      return UnseenTarget::NotJudged::kNoPlace;
  }
}

UnseenTarget judge_one(const Problem& problem, const VectorXd& x_si, std::size_t target,
                       Calibration& c, std::vector<HeldOut>& all) {
  UnseenTarget result;
  result.target = problem.cell().targets[target].id;
  const std::vector<std::size_t> touches = touches_of(problem, target);
  result.touches = touches.size();
  try {
    Sighting sighting(problem, x_si, c, touches);
    if (!sighting.fit()) {
      result.not_judged = UnseenTarget::NotJudged::kPlaceAlone;
      return result;
    }
    result.degrees_of_freedom = sighting.degrees_of_freedom();
    sighting.fill(c);
    if (c.covariance.rows() == problem.size()) sighting.judge(c.covariance, all);
    double sum = 0.0;
    for (const std::size_t i : touches) sum += std::pow(c.residuals[i].after_m, 2);
    result.rms_m = std::sqrt(sum / static_cast<double>(result.touches));
  } catch (const IdentifyError& error) {
    result.not_judged = not_judged_for(error.kind);
  }
  return result;
}

}  // namespace

UnseenChecks judge_unseen(const Problem& problem, const VectorXd& x_si, Calibration& c) {
  std::vector<bool> unseen(problem.cell().targets.size(), false);
  for (std::size_t i = 0; i < problem.touches().size(); ++i)
    if (problem.block_of(i) < 0)
      unseen[problem.cell().target_index(problem.touches()[i].target)] = true;
  UnseenChecks result;
  for (std::size_t t = 0; t < unseen.size(); ++t)
    if (unseen[t]) result.targets.push_back(judge_one(problem, x_si, t, c, result.held_out));
  return result;
}

}  // namespace cellcal::calib
