#include "calib/consistency/suspected_moves.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>

#include "calib/consistency/session_order.h"

namespace cellcal::calib {

namespace {

/// Touches of one target on either side of a move, at least: three for where it is, and two more.
constexpr std::size_t kLeastBeforeAndBehind = 5;
/// So many places of a target's sequence are tried; a move between two of them is seen by both.
constexpr std::size_t kSplits = 7;
/// Squared sigmas of a shift, three degrees of freedom, that are worth a closer look.
constexpr double kSuspect = 16.0;
/// At most so many closer looks, each of which costs an identification.
constexpr std::size_t kLooks = 3;
/// So many touches of one target left out are no gross errors any more: it may have moved so far
/// that all from there on were. Fewer cannot speak for a move; gross errors would find one.
constexpr std::size_t kManyLeftOut = 3;
/// And where: two rates have to be likelier than one by this much (e^10). Five of 67 do if they are
/// the last ones; three of the last five and one before do not.
constexpr double kNoChance = 10.0;

using ThreeRows = Eigen::Matrix<double, 3, Eigen::Dynamic>;

/// What some rows say about a shift delta of their target, all other unknowns left free: with J_d its
/// columns, information J_d'J_d - J_d'J S J'J_d and pull J_d'r.
struct Said {
  Eigen::Matrix3d square = Eigen::Matrix3d::Zero();  ///< J_d'J_d
  ThreeRows by_all;                                  ///< J_d'J
  Eigen::Vector3d pull = Eigen::Vector3d::Zero();    ///< J_d'r

  explicit Said(Eigen::Index unknowns) : by_all(ThreeRows::Zero(3, unknowns)) {}

  void add(const Linearisation& linear, int row, int rows, int first) {
    for (int k = row; k < row + rows; ++k) {
      const Eigen::Vector3d g = linear.jacobian.row(k).segment<3>(first).transpose();
      square += g * g.transpose();
      by_all.noalias() += g * linear.jacobian.row(k);
      pull += linear.residual[k] * g;
    }
  }

  /// By which the shift differs from none.
  double squared_sigmas(const Eigen::MatrixXd& covariance_u, double usual_u) const {
    Eigen::Matrix3d information = square - by_all * covariance_u * by_all.transpose();  // (50)
    information.diagonal().array() += 1.0 / (usual_u * usual_u);
    const Eigen::LDLT<Eigen::Matrix3d> factor(information);
    return factor.isPositive() ? pull.dot(factor.solve(pull)) : 0.0;
  }
};

struct Split {
  std::size_t at = 0;  ///< first touch behind it
  double squared_sigmas = 0.0;
};

/// The split of a target's touches in use that speaks most for a move.
Split loudest_split(const Problem& problem, const Estimate& e, const std::vector<int>& row_of,
                    const TargetBlock& block, const std::vector<std::size_t>& used) {
  Split best;
  const double usual_u =
      kUsualMoveM / problem.unknowns()[static_cast<std::size_t>(block.first)].scale;
  const auto scan = [&](std::size_t first, std::size_t last, std::size_t step) {
    // From the last touch back, so that what the later ones say is summed up once.
    Said later(problem.size());
    for (std::size_t k = used.size(); k-- > first;) {
      later.add(e.posterior.linear, row_of[used[k]], problem.rows(used[k]), block.first);
      if (k > last || (k - first) % step != 0) continue;
      const double said = later.squared_sigmas(e.posterior.covariance_u, usual_u);
      if (said > best.squared_sigmas) best = {k, said};
    }
  };
  const std::size_t first = kLeastBeforeAndBehind, last = used.size() - kLeastBeforeAndBehind;
  const std::size_t step = std::max<std::size_t>(1, used.size() / (kSplits + 1));
  scan(first, last, step);
  if (best.squared_sigmas > kSuspect && step > 1)
    scan(best.at > first + step ? best.at - step : first, std::min(best.at + step, last), 1);
  return best;
}

/// Where touches begin or cease to be left out: the split for which two rates explain best which
/// ones are; none where gross errors that fall together by chance would do.
std::optional<std::size_t> split_of_left_out(const std::vector<std::size_t>& own,
                                             const std::vector<bool>& use) {
  const auto log_likelihood = [](double out, double of) {
    const double in = of - out;
    return (out > 0.0 ? out * std::log(out / of) : 0.0) + (in > 0.0 ? in * std::log(in / of) : 0.0);
  };
  double all = 0.0, before = 0.0;
  for (const std::size_t i : own) all += use[i] ? 0.0 : 1.0;
  std::size_t best = kLeastBeforeAndBehind;
  double most = -1e300;
  for (std::size_t k = 0; k + kLeastBeforeAndBehind <= own.size(); ++k) {
    if (k >= kLeastBeforeAndBehind) {
      const auto behind = static_cast<double>(own.size() - k);
      const double likelihood =
          log_likelihood(before, static_cast<double>(k)) + log_likelihood(all - before, behind);
      if (likelihood > most) {
        most = likelihood;
        best = k;
      }
    }
    before += use[own[k]] ? 0.0 : 1.0;
  }
  const double at_random = log_likelihood(all, static_cast<double>(own.size()));
  return most - at_random > kNoChance ? std::optional(best) : std::nullopt;
}

}  // namespace

std::vector<MovedTarget> suspected_moves(const Problem& problem, const Estimate& e,
                                         double chi2_per_dof) {
  std::vector<int> row_of(problem.touches().size(), -1);
  for (const auto& [touch, row] : e.posterior.linear.touch_row) row_of[touch] = row;
  std::vector<std::vector<std::size_t>> sequence(problem.blocks().size());
  for (const std::size_t i : in_order(problem.touches()))
    if (problem.touches()[i].set == TouchSet::kFit)
      sequence[static_cast<std::size_t>(problem.block_of(i))].push_back(i);
  std::vector<MovedTarget> suspects;
  for (std::size_t b = 0; b < sequence.size(); ++b) {
    const std::vector<std::size_t>& own = sequence[b];
    const TargetBlock& block = problem.blocks()[b];
    if (!has_a_centre(problem.cell().targets[block.target].kind)) continue;
    if (own.size() < 2 * kLeastBeforeAndBehind) continue;
    MovedTarget suspect;
    suspect.target = problem.cell().targets[block.target].id;
    std::vector<std::size_t> used;
    for (const std::size_t i : own)
      if (row_of[i] >= 0) used.push_back(i);
    if (used.size() >= 2 * kLeastBeforeAndBehind) {
      const Split split = loudest_split(problem, e, row_of, block, used);
      suspect.squared_sigmas = split.squared_sigmas / std::max(1.0, chi2_per_dof);
      if (suspect.squared_sigmas > kSuspect) {
        suspect.after_touch = used[split.at - 1];
        suspects.push_back(suspect);
      }
    }
    if (own.size() - used.size() < kManyLeftOut) continue;
    if (const auto split = split_of_left_out(own, e.use)) {
      suspect.after_touch = own[*split - 1];
      // Before all others: what is left out is far off.
      constexpr double kFarOff = 1e6;
      suspect.squared_sigmas += kFarOff;
      suspects.push_back(suspect);
    }
  }
  std::stable_sort(suspects.begin(), suspects.end(),
                   [](const MovedTarget& a, const MovedTarget& b) {
                     return a.squared_sigmas > b.squared_sigmas;
                   });
  if (suspects.size() > kLooks) suspects.resize(kLooks);
  return suspects;
}

}  // namespace cellcal::calib
