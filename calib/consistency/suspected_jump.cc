#include "calib/consistency/suspected_jump.h"

#include <algorithm>
#include <string>

#include "calib/consistency/jump_sequence.h"
#include "calib/consistency/session_order.h"

namespace cellcal::calib {

namespace {

/// Squared sigmas of a jump that are worth a closer look.
constexpr double kSuspectedJump = 12.0;
/// So many places of the session are tried at first; a jump between two is seen by both.
constexpr std::size_t kPlaces = 15;
constexpr std::size_t kMostSuspecting = 4000;

}  // namespace

std::vector<Jump> suspected_jump(const Problem& problem, const Estimate& e, double chi2_per_dof) {
  std::vector<int> row_of(problem.touches().size(), -1);
  for (const auto& [touch, row] : e.posterior.linear.touch_row) row_of[touch] = row;
  std::vector<std::size_t> order = in_order(problem.touches());
  std::erase_if(order, [&](std::size_t i) { return row_of[i] < 0; });
  if (const std::size_t every = (order.size() + kMostSuspecting - 1) / kMostSuspecting; every > 1) {
    std::vector<std::size_t> seen(problem.blocks().size(), 0);
    std::erase_if(order, [&](std::size_t i) {
      return seen[static_cast<std::size_t>(problem.block_of(i))]++ % every != 0;
    });
  }
  if (order.size() < 2 * kLeastEachSide) return {};
  const std::size_t places = std::min(kPlaces, order.size() - 2 * kLeastEachSide + 1);
  const auto place = [&](std::size_t k) {  // first touch behind it
    return kLeastEachSide +
           k * (order.size() - 2 * kLeastEachSide) / std::max<std::size_t>(1, places - 1);
  };
  const int columns = jump_columns(problem), joints = columns - 3;
  // From the last touch back, so that what the later ones say is summed up once.
  Eigen::MatrixXd square = Eigen::MatrixXd::Zero(columns, columns);
  Eigen::VectorXd pull = Eigen::VectorXd::Zero(columns);
  Eigen::MatrixXd by_all = Eigen::MatrixXd::Zero(problem.size(), columns);
  std::vector<Eigen::MatrixXd> squares(places);
  std::vector<Eigen::VectorXd> pulls(places);
  Eigen::MatrixXd all(problem.size(), columns * static_cast<Eigen::Index>(places));
  const Eigen::VectorXd x = problem.to_si(e.u);
  const Problem::At at = problem.at(x.data());
  const Linearisation& linear = e.posterior.linear;
  JumpRows g(Problem::kMostRows, columns);
  std::size_t next = places;
  for (std::size_t k = order.size(); k-- > 0 && next > 0;) {
    const int row = row_of[order[k]], rows = problem.rows(order[k]);
    by_jumps(problem, at, order[k], g);
    const auto own = g.topRows(rows);
    square.noalias() += own.transpose() * own;
    pull.noalias() += own.transpose() * linear.residual.segment(row, rows);
    by_all.noalias() += linear.jacobian.middleRows(row, rows).transpose() * own;
    if (k != place(next - 1)) continue;
    --next;
    squares[next] = square;
    pulls[next] = pull;
    all.middleCols(columns * static_cast<Eigen::Index>(next), columns) = by_all;
  }
  const Eigen::MatrixXd held = e.posterior.covariance_u * all;
  Jump best;
  for (std::size_t p = 0; p < places; ++p) {
    const Eigen::Index first = columns * static_cast<Eigen::Index>(p);
    const auto consider = [&](Jump::What what, const std::string& name, int from, int count,
                              double usual) {
      const Eigen::MatrixXd information =  // (50)
          squares[p].block(from, from, count, count) -
          all.middleCols(first + from, count).transpose() * held.middleCols(first + from, count);
      const double said = squared_sigmas(information, pulls[p].segment(from, count), usual) /
                          std::max(1.0, chi2_per_dof);
      if (said <= best.squared_sigmas) return;
      best.what = what;
      best.name = name;
      best.after_touch = order[place(p) - 1];
      best.squared_sigmas = said;
    };
    for (int i = 0; i < joints; ++i)
      consider(Jump::What::kJoint, problem.arm().robot().joints[static_cast<std::size_t>(i)].name,
               i, 1, kUsualSlipRad);
    consider(Jump::What::kTool, "tool", joints, 3, kUsualKnockM);
  }
  if (best.squared_sigmas < kSuspectedJump) return {};
  return {best};
}

}  // namespace cellcal::calib
