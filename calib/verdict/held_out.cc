#include "calib/verdict/held_out.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "calib/estimate/solve.h"
#include "calib/model/error.h"
#include "calib/model/linear.h"
#include "calib/model/long_work.h"
#include "calib/verdict/residuals.h"

namespace cellcal::calib {

namespace {

/// Gross errors among the check touches, too: one, or one in this many if there are enough, farther
/// off than this many predicted sigmas.
constexpr std::size_t kEnoughChecks = 8, kOneGrossOf = 10;
constexpr double kGrossCheck = 4.0;

using Eigen::MatrixXd;
using Eigen::VectorXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Minimum redundancy of a place: five touches of a sphere leave two rows, less their information
/// on its diameter.
constexpr double kLeastFree = 1.5;

std::vector<std::size_t> touches_of(const Problem& problem, std::size_t target) {
  std::vector<std::size_t> own;
  for (std::size_t i = 0; i < problem.touches().size(); ++i)
    if (problem.touches()[i].target == problem.cell().targets[target].id) own.push_back(i);
  return own;
}

/// Check touches of one target, as a problem with only its place unknown.
class Sighting {
 public:
  /// `of`: indices in the fitted problem.
  Sighting(const Problem& fitted, const VectorXd& x_si, const Calibration& c,
           const std::vector<std::size_t>& of)
      : of_(of),
        touches_(as_fit(fitted, of_)),
        problem_(fitted.cell(), fitted.arm(), touches_,
                 starting_places(fitted.cell(), fitted.arm(), touches_)) {
    const double usual_m = c.repeats.used_m > 0.0 ? c.repeats.used_m : fitted.cell().touch_sigma_m;
    problem_.set_noise(usual_m);
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

  /// True if the touches are redundant for the place.
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

  /// Adds each touch with the calibration's prediction for it.
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

  /// Fills in the residuals for a known place.
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
  /// A row that alone determines its place has no redundancy.
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

  /// Whitened rows at x, and the covariance of the place's unknowns in prior units.
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
  std::vector<int> shared_;  ///< index of each shared unknown in the fitted problem, or -1
  std::vector<Eigen::Index> first_;
  VectorXd residual_;
  MatrixXd by_shared_, by_place_, covariance_, held_;
  Eigen::ArrayXd free_;
};

/// Reason for touches that determine no place.
UnseenTarget::NotJudged not_judged_for(IdentifyError::Kind kind) {
  switch (kind) {
    case IdentifyError::Kind::kTouches: return UnseenTarget::NotJudged::kUnusable;
    case IdentifyError::Kind::kCell: return UnseenTarget::NotJudged::kOtherNormal;
    default: return UnseenTarget::NotJudged::kNoPlace;
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

/// With a perfect arm a target's touches determine its place to sigma / sqrt(n lambda), lambda the
/// smallest eigenvalue of the mean outer product of their derivatives by it. Above this limit they
/// carry more information on the target's place than on the arm.
constexpr double kPlaceSigmaM = 0.3e-3;
/// Lever of a target's rotation: the region that counts as near it.
constexpr double kPlaceLeverM = 0.150;
/// A tracker measures lengths itself, and so does a wire. Their touches determine the scale if,
/// with a perfect arm, they would determine it to this; a tracker's from at least this many places.
constexpr double kScaleSigma = 1e-4;
constexpr int kScalePlaces = 4;

/// Fit touches of a block in use.
std::vector<std::size_t> used_touches(const Problem& problem, const Calibration& c, int block) {
  std::vector<std::size_t> used;
  for (const TouchResidual& r : c.residuals)
    if (problem.block_of(r.touch) == block && !r.outlier &&
        problem.touches()[r.touch].set == TouchSet::kFit)
      used.push_back(r.touch);
  return used;
}

/// Smallest eigenvalue of the information of these touches on the place of their target [1/m^2].
double least_information(const Problem& problem, const Eigen::VectorXd& x, const TargetBlock& block,
                         const std::vector<std::size_t>& touches) {
  const TargetKind kind = problem.cell().targets[block.target].kind;
  Eigen::VectorXd lever = Eigen::VectorXd::Ones(block.place);
  if (kind == TargetKind::kPlane) lever.head<2>().setConstant(kPlaceLeverM);
  if (kind == TargetKind::kTracker) lever.tail<3>().setConstant(kPlaceLeverM);
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(block.place, block.place);
  const Problem::At at = problem.at(x.data());
  double r[Problem::kMostRows], by_target[Problem::kMostRows * TargetBlock::kMost];
  for (const std::size_t i : touches) {
    problem.residual_m(i, at, r, nullptr, by_target);
    const Eigen::MatrixXd j =
        Eigen::Map<const RowMajor>(by_target, problem.place_rows(i), block.size())
            .leftCols(block.place) *
        lever.cwiseInverse().asDiagonal();
    information += j.transpose() * j / std::pow(problem.sigma_m(i), 2);
  }
  return eigenpairs(information).values[0];  // (56)
}

/// True if the wires' readings determine the scale; one as short as a sphere's radius does not.
bool wire_holds_scale(const Problem& problem, const std::vector<std::size_t>& touches) {
  double information = 0.0;
  for (const std::size_t i : touches)
    if (const double length_m = problem.touches()[i].radius_m; length_m > kPlaceLeverM)
      information += std::pow(length_m / problem.sigma_m(i), 2);  // (55)
  return information * kScaleSigma * kScaleSigma > 1.0;
}

bool tracker_holds_scale(const Problem& problem, const std::vector<std::size_t>& touches) {
  std::vector<Eigen::Vector3d> readings;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const std::size_t i : touches) {
    const double* m = problem.touches()[i].tracker_m;
    const Eigen::Vector3d reading(m[0], m[1], m[2]);
    // A repeated place does not count again.
    if (std::none_of(readings.begin(), readings.end(), [&](const Eigen::Vector3d& other) {
          return (other - reading).norm() < kPlaceLeverM;
        }))
      readings.push_back(reading);
    middle += reading / static_cast<double>(touches.size());
  }
  if (static_cast<int>(readings.size()) < kScalePlaces) return false;
  double information = 0.0;
  for (const std::size_t i : touches)
    information +=  // (55)
        (Eigen::Map<const Eigen::Vector3d>(problem.touches()[i].tracker_m) - middle).squaredNorm() /
        std::pow(problem.sigma_m(i), 2);
  return information * kScaleSigma * kScaleSigma > 1.0;
}

}  // namespace

std::vector<HeldOut> held_out(const Problem& problem, const Calibration& c) {
  if (c.covariance.rows() != problem.size()) return {};
  const Eigen::VectorXd x = first_values(c, problem.size());
  const Problem::At at = problem.at(x.data());
  std::vector<HeldOut> all;
  for (std::size_t t = 0; t < problem.touches().size(); ++t) {
    if (problem.touches()[t].set != TouchSet::kCheck || problem.block_of(t) < 0) continue;
    const TargetBlock& block = problem.blocks()[problem.block_of(t)];
    const int rows = problem.rows(t), shared = problem.shared_size();
    Eigen::VectorXd residual(rows);
    RowMajor by_shared(rows, shared), by_target(rows, block.size());
    problem.residual_m(t, at, residual.data(), by_shared.data(), by_target.data());
    RowMajor j = RowMajor::Zero(rows, problem.size());
    j.leftCols(shared) = by_shared;
    j.middleCols(block.first, block.size()) = by_target;
    const Eigen::VectorXd variance = (j * c.covariance).cwiseProduct(j).rowwise().sum().array() +
                                     std::pow(problem.sigma_m(t), 2);
    all.push_back(
        // (58)
        {t, residual.cwiseAbs2().cwiseQuotient(variance).sum(), static_cast<double>(rows)});
  }
  return all;
}

double rms_of(std::span<const HeldOut> touches) {
  double sum = 0.0, rows = 0.0;
  for (const HeldOut& one : touches) {
    sum += one.square;
    rows += one.rows;
  }
  return rows == 0.0 ? 0.0 : std::sqrt(sum / rows);
}

std::vector<std::size_t> gross_check_touches(const Problem& problem, const Calibration& c) {
  std::vector<HeldOut> all = held_out(problem, c);
  if (all.size() < kEnoughChecks) return {};
  std::ranges::stable_sort(all, std::greater{},
                           [](const HeldOut& one) { return one.square / one.rows; });
  const std::size_t most = std::max<std::size_t>(1, all.size() / kOneGrossOf);
  std::size_t aside = 0;
  while (rms_of(std::span(all).subspan(aside)) > kCheckRatio) {
    if (aside == most || all[aside].square < kGrossCheck * kGrossCheck * all[aside].rows) return {};
    ++aside;
  }
  std::vector<std::size_t> touches;
  for (std::size_t k = 0; k < aside; ++k) touches.push_back(all[k].touch);
  return touches;
}

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

HeldPlaces judge_places(const Problem& problem, const Calibration& c, Verdict& verdict) {
  const Eigen::VectorXd x = first_values(c, problem.size());
  HeldPlaces held;
  for (std::size_t b = 0; b < problem.blocks().size(); ++b) {
    const TargetBlock& block = problem.blocks()[b];
    const Target& target = problem.cell().targets[block.target];
    if (target.kind == TargetKind::kPoint) continue;  // one touch determines all three directions
    const auto used = used_touches(problem, c, static_cast<int>(b));
    if (target.kind == TargetKind::kTracker && tracker_holds_scale(problem, used)) {
      held.rule = &target;
      ++held.trackers;
    }
    if (target.kind == TargetKind::kWire && wire_holds_scale(problem, used)) {
      held.rule = &target;
      ++held.wires;
    }
    if (least_information(problem, x, block, used) * kPlaceSigmaM * kPlaceSigmaM > 1.0) continue;
    held.loose.push_back(static_cast<int>(b));
    verdict.add({used.empty() ? FindingKind::kAllLeftOut : FindingKind::kTooFewDirections,
                 Severity::kWithholds,
                 about_target(target),
                 {{"touches", used.size()}}});
  }
  return held;
}

}  // namespace cellcal::calib
