#include "calib/plan/choice/check_choice.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "calib/check/change.h"
#include "calib/linear/cholesky.h"
#include "calib/model/long_work.h"

namespace cellcal::calib {

namespace {

/// What everything but the tool may have changed by, at the tip.
constexpr double kElseM = 0.1e-3;
/// Of a shift of the tool beforehand: it keeps the first touches' information from being singular.
constexpr double kToolM = 1e-3;
/// A shift that looks like another change's is found all the same, but named wrongly.
constexpr double kDistinctionWeight = 0.3;
constexpr int kRounds = 3;  ///< of exchange

/// Rows of all candidates, from which those of any set are taken.
class CheckDesign {
 public:
  CheckDesign(const Calibration& calibration, const std::vector<Candidate>& candidates) {
    std::vector<Touch> touches;
    for (const Candidate& candidate : candidates) {
      touches.emplace_back();
      touches.back().joint_rad = candidate.contact;
      touches.back().target = calibration.cell.targets[candidate.target].id;
    }
    const Foresight foresight = foresee(calibration, touches);
    alone_ = foresight.covariance_m2();
    beside_ = foresight.passing_m2;  // as checks are once others have gone before
    for (const PossibleChange& change : possible_changes(calibration, foresight.contacts)) {
      if (change.kind == ChangeKind::kTouch) continue;
      const Eigen::MatrixXd by = columns_of(change, foresight.contacts);
      if (change.kind == ChangeKind::kTool) {
        tool_ = by;
        continue;
      }
      const double size = kElseM / std::sqrt(by.rowwise().squaredNorm().maxCoeff());
      beside_.noalias() += size * size * by * by.transpose();
    }
  }

  /// What the set leaves unknown of the tool [m^2].
  double unknown(const std::vector<std::size_t>& set) const {
    return left(set, alone_) + kDistinctionWeight * left(set, beside_);
  }

 private:
  double left(const std::vector<std::size_t>& set, const Eigen::MatrixXd& covariance) const {
    const auto n = static_cast<Eigen::Index>(set.size());
    Eigen::MatrixXd v(n, n), g(n, 3);
    for (Eigen::Index a = 0; a < n; ++a) {
      const auto row = static_cast<Eigen::Index>(set[static_cast<std::size_t>(a)]);
      g.row(a) = tool_.row(row);
      for (Eigen::Index b = 0; b <= a; ++b)
        v(a, b) = covariance(row, static_cast<Eigen::Index>(set[static_cast<std::size_t>(b)]));
    }
    const Eigen::MatrixXd by = Cholesky(v).whitened(g);
    Eigen::Matrix3d information = by.transpose() * by;
    information.diagonal().array() += 1.0 / (kToolM * kToolM);
    return information.inverse().trace();
  }

  Eigen::MatrixXd alone_, beside_, tool_;
};

class Picker {
 public:
  Picker(const std::vector<Candidate>& candidates, const CheckDesign& design,
         const std::function<bool(std::size_t)>& possible)
      : candidates_(candidates), design_(design), possible_(possible) {}

  /// The possible one that beside the others leaves least unknown; of a target that they leave untouched, where
  /// they do.
  std::optional<std::size_t> best_beside(const std::vector<std::size_t>& others) const {
    std::set<std::size_t> touched, all;
    for (const Candidate& one : candidates_) all.insert(one.target);
    for (const std::size_t c : others) touched.insert(candidates_[c].target);
    std::vector<std::pair<double, std::size_t>> by_unknown;
    std::vector<std::size_t> set = others;
    set.push_back(0);
    for (std::size_t c = 0; c < candidates_.size(); ++c) {
      poll_cancelled();
      if (std::ranges::find(others, c) != others.end()) continue;
      if (touched.size() < all.size() && touched.contains(candidates_[c].target)) continue;
      set.back() = c;
      by_unknown.emplace_back(design_.unknown(set), c);
    }
    std::ranges::sort(by_unknown);
    for (const auto& [unknown, c] : by_unknown)
      if (possible_(c)) return c;
    return std::nullopt;
  }

 private:
  const std::vector<Candidate>& candidates_;
  const CheckDesign& design_;
  const std::function<bool(std::size_t)>& possible_;
};

}  // namespace

std::vector<std::size_t> choose_check(const Calibration& calibration,
                                      const std::vector<Candidate>& candidates, int count,
                                      const std::function<bool(std::size_t)>& possible) {
  const CheckDesign design(calibration, candidates);
  const Picker picker(candidates, design, possible);
  std::vector<std::size_t> picked;
  while (static_cast<int>(picked.size()) < count) {
    const auto next = picker.best_beside(picked);
    if (!next) return picked;
    picked.push_back(*next);
  }
  for (int round = 0; round < kRounds; ++round)
    for (std::size_t& place : picked) {
      std::vector<std::size_t> others;
      for (const std::size_t& one : picked)
        if (&one != &place) others.push_back(one);
      place = picker.best_beside(others).value_or(place);
    }
  return picked;
}

}  // namespace cellcal::calib
