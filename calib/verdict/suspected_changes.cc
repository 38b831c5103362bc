#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <string>

#include "calib/model/long_work.h"
#include "calib/model/product.h"
#include "calib/verdict/session_order.h"
#include "calib/verdict/verdict.h"

namespace cellcal::calib {

namespace {

/// Number of places tried in a target's sequence; a move between two of them appears at both.
constexpr std::size_t kSplits = 7;
/// Squared sigmas of a shift, three degrees of freedom, from which it is examined.
constexpr double kSuspect = 16.0;
/// Maximum number of examinations, each of which costs an identification.
constexpr std::size_t kMostExaminations = 3;
/// Number of outliers of one target from which they are not regarded as gross errors: it may have
/// moved so far that all later touches are outliers. Fewer could be gross errors.
constexpr std::size_t kManyLeftOut = 3;
/// Log likelihood ratio of two outlier rates against one (e^10). Five of 67 exceed it if they are
/// the last ones; three of the last five and one before do not.
constexpr double kNoChance = 10.0;

/// Squared sigmas of a jump from which it is examined.
constexpr double kSuspectedJump = 12.0;
/// Number of places of the session tried at first; a jump between two appears at both.
constexpr std::size_t kPlaces = 15;
constexpr std::size_t kMostSuspecting = 4000;

/// First row of each touch; -1 if not in use.
std::vector<int> first_rows(const Problem& problem, const Estimate& e) {
  std::vector<int> row_of(problem.touches().size(), -1);
  for (const auto& [touch, row] : e.posterior.linear.touch_row) row_of[touch] = row;
  return row_of;
}

struct Split {
  std::size_t at = 0;  ///< first touch after it
  double squared_sigmas = 0.0;
};

/// The split of a target's touches in use with the largest evidence of a move.
Split loudest_split(const Problem& problem, const Estimate& e, const std::vector<int>& row_of,
                    const TargetBlock& block, const std::vector<std::size_t>& used) {
  Split best;
  const double usual_u =
      kUsualKnockM / problem.unknowns()[static_cast<std::size_t>(block.first)].scale;
  const Linearisation& linear = e.posterior.linear;
  const auto scan = [&](std::size_t first, std::size_t last, std::size_t step) {
    ChangeScore<3> later(problem.size());
    for (std::size_t k = used.size(); k-- > first;) {
      const int row = row_of[used[k]];
      for (int i = row; i < row + problem.rows(used[k]); ++i)
        later.add(linear.jacobian.row(i).segment<3>(block.first), linear.jacobian.row(i),
                  linear.residual[i]);
      if (k > last || (k - first) % step != 0) continue;
      const Eigen::MatrixXd held = product(e.posterior.covariance_u, later.by_all);
      const double squared = squared_sigmas<3>(later.square - later.by_all.transpose() * held,
                                               later.gradient, usual_u);
      if (squared > best.squared_sigmas) best = {k, squared};
    }
  };
  const std::size_t first = kLeastEachSide, last = used.size() - kLeastEachSide;
  const std::size_t step = std::max<std::size_t>(1, used.size() / (kSplits + 1));
  scan(first, last, step);
  if (best.squared_sigmas > kSuspect && step > 1)
    scan(best.at > first + step ? best.at - step : first, std::min(best.at + step, last), 1);
  return best;
}

/// Start or end of a run of outliers: the split with the best fit of two rates; empty if gross
/// errors can coincide by chance.
std::optional<std::size_t> split_of_left_out(const std::vector<std::size_t>& own,
                                             const std::vector<bool>& use) {
  const auto log_likelihood = [](double out, double of) {
    const double in = of - out;
    return (out > 0.0 ? out * std::log(out / of) : 0.0) + (in > 0.0 ? in * std::log(in / of) : 0.0);
  };
  double all = 0.0, before = 0.0;
  for (const std::size_t i : own) all += use[i] ? 0.0 : 1.0;
  std::size_t best = kLeastEachSide;
  double most = -1e300;
  for (std::size_t k = 0; k + kLeastEachSide <= own.size(); ++k) {
    if (k >= kLeastEachSide) {
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

/// Touches in use in their order; of very many a share of each target's.
std::vector<std::size_t> asked_in_order(const Problem& problem, const std::vector<int>& row_of) {
  std::vector<std::size_t> order = in_order(problem.touches());
  std::erase_if(order, [&](std::size_t i) { return row_of[i] < 0; });
  if (const std::size_t every = (order.size() + kMostSuspecting - 1) / kMostSuspecting; every > 1) {
    std::vector<std::size_t> seen(problem.blocks().size(), 0);
    std::erase_if(order, [&](std::size_t i) {
      return seen[static_cast<std::size_t>(problem.block_of(i))]++ % every != 0;
    });
  }
  return order;
}

/// Scores of all jumps by the touches from each of these places on.
std::vector<ChangeScore<>> scores_at(const Problem& problem, const Estimate& e,
                                     const std::vector<int>& row_of,
                                     const std::vector<std::size_t>& order,
                                     const std::vector<std::size_t>& places) {
  const int columns = jump_columns(problem);
  const Eigen::VectorXd x = problem.to_si(e.u);
  const Problem::At at = problem.at(x.data());
  const Linearisation& linear = e.posterior.linear;
  JumpRows g(Problem::kMostRows, columns);
  ChangeScore<> later(problem.size(), columns);
  std::vector<ChangeScore<>> scores(places.size(), later);
  std::size_t next = places.size();
  for (std::size_t k = order.size(); k-- > 0 && next > 0;) {
    const int row = row_of[order[k]], rows = problem.rows(order[k]);
    by_jumps(problem, at, order[k], g);
    later.add(g.topRows(rows), linear.jacobian.middleRows(row, rows),
              linear.residual.segment(row, rows));
    if (k == places[next - 1]) scores[--next] = later;
  }
  return scores;
}

}  // namespace

std::vector<MovedTarget> suspected_moves(const Problem& problem, const Estimate& e,
                                         double chi2_per_dof) {
  const std::vector<int> row_of = first_rows(problem, e);
  std::vector<std::vector<std::size_t>> sequence(problem.blocks().size());
  for (const std::size_t i : in_order(problem.touches()))
    if (problem.touches()[i].set == TouchSet::kFit)
      sequence[static_cast<std::size_t>(problem.block_of(i))].push_back(i);
  std::vector<MovedTarget> suspects;
  for (std::size_t b = 0; b < sequence.size(); ++b) {
    poll_cancelled();
    const std::vector<std::size_t>& own = sequence[b];
    const TargetBlock& block = problem.blocks()[b];
    if (!has_two_places(problem.cell().targets[block.target].kind)) continue;
    if (own.size() < 2 * kLeastEachSide) continue;
    MovedTarget suspect;
    suspect.target = problem.cell().targets[block.target].id;
    std::vector<std::size_t> used;
    for (const std::size_t i : own)
      if (row_of[i] >= 0) used.push_back(i);
    if (used.size() >= 2 * kLeastEachSide) {
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
      // Larger than all others: outliers are far off.
      constexpr double kFarOff = 1e6;
      suspect.squared_sigmas += kFarOff;
      suspects.push_back(suspect);
    }
  }
  std::ranges::stable_sort(suspects, std::greater{}, &MovedTarget::squared_sigmas);
  if (suspects.size() > kMostExaminations) suspects.resize(kMostExaminations);
  return suspects;
}

std::vector<Jump> suspected_jump(const Problem& problem, const Estimate& e, double chi2_per_dof) {
  const std::vector<int> row_of = first_rows(problem, e);
  const std::vector<std::size_t> order = asked_in_order(problem, row_of);
  if (order.size() < 2 * kLeastEachSide) return {};
  std::vector<std::size_t> places(std::min(kPlaces, order.size() - 2 * kLeastEachSide + 1));
  for (std::size_t k = 0; k < places.size(); ++k)  // first touch after it
    places[k] = kLeastEachSide + k * (order.size() - 2 * kLeastEachSide) /
                                     std::max<std::size_t>(1, places.size() - 1);
  const std::vector<ChangeScore<>> scores = scores_at(problem, e, row_of, order, places);
  const Eigen::Index columns = jump_columns(problem), joints = columns - 3;
  Eigen::MatrixXd all(problem.size(), columns * static_cast<Eigen::Index>(places.size()));
  for (std::size_t p = 0; p < places.size(); ++p)
    all.middleCols(columns * static_cast<Eigen::Index>(p), columns) = scores[p].by_all;
  const Eigen::MatrixXd held =
      product(e.posterior.covariance_u, all);  // of all places at once: faster
  Jump best;
  for (std::size_t p = 0; p < places.size(); ++p) {
    const ChangeScore<>& score = scores[p];
    const auto held_here = held.middleCols(columns * static_cast<Eigen::Index>(p), columns);
    const auto consider = [&](Jump::What what, const std::string& name, Eigen::Index from,
                              Eigen::Index count, double usual) {
      const double squared =
          squared_sigmas<Eigen::Dynamic>(score.square.block(from, from, count, count) -
                                             score.by_all.middleCols(from, count).transpose() *
                                                 held_here.middleCols(from, count),
                                         score.gradient.segment(from, count), usual) /
          std::max(1.0, chi2_per_dof);
      if (squared <= best.squared_sigmas) return;
      best = {what, name, order[places[p] - 1]};
      best.squared_sigmas = squared;
    };
    const auto first = static_cast<Eigen::Index>(problem.arm().robot().first_turning());
    for (Eigen::Index i = first; i < joints; ++i)
      consider(Jump::What::kJoint, problem.arm().robot().joints[static_cast<std::size_t>(i)].name,
               i, 1, kUsualSlipRad);
    consider(Jump::What::kTool, "tool", joints, 3, kUsualKnockM);
  }
  if (best.squared_sigmas < kSuspectedJump) return {};
  return {best};
}

}  // namespace cellcal::calib
