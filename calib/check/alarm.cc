#include "calib/check/alarm.h"

#include <algorithm>
#include <cmath>

#include "calib/model/linear.h"
#include "calib/model/random.h"

namespace cellcal::calib {

namespace {

/// Of them 200 lie above the threshold, which leaves it wrong by a fourteenth of the false alarms.
constexpr Eigen::Index kDraws = 200'000;
constexpr Eigen::Index kFindDraws = 4000;
constexpr Eigen::Index kBlock = 1000;  ///< drawn at once
constexpr unsigned kSeed = 20251122;

Eigen::MatrixXd drawn(Eigen::Index rows, Eigen::Index columns, Random& random) {
  Eigen::MatrixXd draws(rows, columns);
  for (double& one : draws.reshaped()) one = random.normal();
  return draws;
}

}  // namespace

Alarm::Alarm(const std::vector<PossibleChange>& changes,
             const std::vector<ForeseenContact>& contacts, const Eigen::MatrixXd& covariance_m2)
    : covariance_(covariance_m2) {
  const Eigen::Index n = covariance_m2.rows();
  Eigen::Index all = 0;
  for (const PossibleChange& change : changes) all += change.size;
  directions_.resize(n, all);
  square_.resize(all);
  Eigen::Index first = 0;
  for (const PossibleChange& change : changes) {
    const Eigen::MatrixXd by = covariance_.whitened(columns_of(change, contacts));
    if (change.kind == ChangeKind::kTool) by_tool_ = by;
    const Eigenpairs pairs = eigenpairs(by.transpose() * by);
    for (Eigen::Index k = 0; k < change.size; ++k) {
      const double square = std::max(0.0, pairs.values[k]);
      const Eigen::VectorXd moved = by * pairs.vectors.col(k);
      square_[first + k] = square;
      directions_.col(first + k) =
          square > 0.0 ? Eigen::VectorXd(moved / std::sqrt(square)) : Eigen::VectorXd::Zero(n);
    }
    parts_.push_back({first, change.size, change.weight, change.usual});
    first += change.size;
  }
  Random random(kSeed);
  std::vector<double> odds;
  for (Eigen::Index k = 0; k < kDraws; k += kBlock) {
    const Eigen::VectorXd block = log_odds_of(drawn(n, kBlock, random));
    odds.insert(odds.end(), block.begin(), block.end());
  }
  const auto at = static_cast<std::ptrdiff_t>((1.0 - kFalseAlarms) * static_cast<double>(kDraws));
  std::nth_element(odds.begin(), odds.begin() + at, odds.end());
  threshold_ = odds[static_cast<std::size_t>(at)];
}

Eigen::VectorXd Alarm::log_odds_of(const Eigen::MatrixXd& whitened) const {
  const Eigen::MatrixXd along = (directions_.transpose() * whitened).array().square();
  Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(whitened.cols());
  for (const Part& part : parts_)
    for (const double usual : part.usual) {
      const Eigen::ArrayXd gain = usual * usual * square_.segment(part.first, part.size).array();
      const Eigen::ArrayXd share = 0.5 * gain / (1.0 + gain);
      const double volume = 0.5 * (1.0 + gain).log().sum();
      const Eigen::ArrayXd exponent =
          (share.matrix().transpose() * along.middleRows(part.first, part.size))
              .transpose()
              .array() -
          volume;
      constexpr double kMost = 600.0;  // beyond any threshold, and a number yet
      sum += part.weight / static_cast<double>(part.usual.size()) * exponent.min(kMost).exp();
    }
  return sum.log();
}

double Alarm::log_odds(const Eigen::VectorXd& whitened) const { return log_odds_of(whitened)[0]; }

double Alarm::found(double shift_m) const {
  Random random(kSeed + 1);
  Eigen::MatrixXd whitened = drawn(by_tool_.rows(), kFindDraws, random);
  Eigen::MatrixXd shifts = drawn(3, kFindDraws, random);
  shifts.colwise().normalize();
  whitened += shift_m * by_tool_ * shifts;
  const auto above = (log_odds_of(whitened).array() > threshold_).count();
  return static_cast<double>(above) / static_cast<double>(kFindDraws);
}

}  // namespace cellcal::calib
