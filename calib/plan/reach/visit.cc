#include "calib/plan/reach/visit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "calib/model/long_work.h"
#include "calib/plan/reach/corners.h"
#include "calib/plan/reach/duration.h"
#include "calib/plan/reach/order.h"
#include "calib/plan/reach/pool.h"
#include "calib/plan/reach/reasons.h"

namespace cellcal::calib {

namespace {

/// What changing over is taken to cost beyond the direct move as long as nobody has looked: the tip
/// has to rise above a sphere to get round it, and another sphere is farther.
constexpr double kSameSphereS = 0.2, kOtherSphereS = 0.5;
/// Where no way leads.
constexpr double kNoWayS = 1e3;
/// Fewer orders are looked at of many visits: each takes the square of their number.
constexpr int kMostVisitsTimesOrders = 4000;
/// Of the time that visits take to plan; the rest are the corners of their ways.
constexpr double kOrderingShare = 0.7;

using Way = std::optional<std::vector<JointVector>>;

/// The ways between the visits, looked for when an order has need of them.
class Ways {
 public:
  Ways(const Robot& robot, const Router& router, const std::vector<ToVisit>& todo,
       const JointVector& start, const Candidate* leaving)
      : robot_(robot), router_(router), todo_(todo), start_(start), leaving_(leaving) {
    const auto count = static_cast<Eigen::Index>(todo.size());
    between_s_ = Eigen::MatrixXd::Zero(count, count);
    from_start_s_.resize(count);
    for (std::size_t j = 0; j < todo.size(); ++j) {
      poll_cancelled();
      const Candidate& to = todo[j].candidate;
      seconds(kStart, j) = move_s(robot, start, to.standoff, pace_) + changing_s(leaving, to);
      for (std::size_t i = 0; i < todo.size(); ++i) {
        const Candidate& from = todo[i].candidate;
        seconds(i, j) = move_s(robot, from.clear, to.standoff, pace_) + changing_s(&from, to);
      }
    }
  }

  static constexpr std::size_t kStart = std::numeric_limits<std::size_t>::max();

  /// From behind the visit `from`, or from the start, to the stand-off of `to`.
  const Way& way(std::size_t from, std::size_t to) {
    const auto [found, is_new] = known_.try_emplace({from, to});
    Way& way = found->second;
    if (!is_new) return way;
    const Candidate* leaving = from == kStart ? leaving_ : &todo_[from].candidate;
    const JointVector& at = from == kStart ? start_ : leaving->clear;
    way = router_.to_standoff(at, leaving, todo_[to].candidate);
    seconds(from, to) = way ? way_s(robot_, at, *way, pace_) : kNoWayS;
    return way;
  }

  /// The order that takes the least time of those that were looked at. An order stands on times
  /// that are guessed where no order before it went; its own ways are looked for, and the next
  /// order stands on their times. `share`: of the part in hand that this is.
  std::vector<std::size_t> shortest_order(int most, double share) {
    const auto visits = static_cast<int>(todo_.size());
    const int orders = std::clamp(kMostVisitsTimesOrders / std::max(1, visits), 1, most);
    std::vector<std::size_t> best;
    double least_s = std::numeric_limits<double>::max();
    for (int k = 0; k < orders; ++k) {
      poll_cancelled();
      const std::vector<std::size_t> order = short_order(between_s_, from_start_s_);
      const std::size_t before = known_.size();
      double sum_s = 0.0;
      std::size_t from = kStart;
      std::size_t led = 0;
      for (const std::size_t to : order) {
        way(from, to);
        // The first order has most ways to look for, each further one about half of those before it.
        tell_done(share * (1.0 - std::pow(0.5, k + static_cast<double>(++led) / visits)));
        sum_s += seconds(from, to);
        from = to;
      }
      if (sum_s < least_s) {
        least_s = sum_s;
        best = order;
      }
      if (known_.size() == before) break;
    }
    return best;
  }

 private:
  static double changing_s(const Candidate* leaving, const Candidate& to) {
    if (leaving == nullptr) return 0.0;
    return leaving->target == to.target ? kSameSphereS : kOtherSphereS;
  }
  double& seconds(std::size_t from, std::size_t to) {
    const auto j = static_cast<Eigen::Index>(to);
    return from == kStart ? from_start_s_[j] : between_s_(static_cast<Eigen::Index>(from), j);
  }

  const Robot& robot_;
  const Router& router_;
  const std::vector<ToVisit>& todo_;
  const JointVector& start_;
  const Candidate* leaving_;
  const Pace pace_;
  Eigen::MatrixXd between_s_;
  Eigen::VectorXd from_start_s_;
  std::map<std::pair<std::size_t, std::size_t>, Way> known_;
};

}  // namespace

std::vector<std::size_t> order_by_ways(const Robot& robot, const Router& router,
                                       const std::vector<ToVisit>& todo, const JointVector& start,
                                       const Candidate* leaving, int most_orders) {
  return Ways(robot, router, todo, start, leaving).shortest_order(most_orders, 1.0);
}

Plan visit(const Cell& cell, const PlanOptions& options, const Clearance& clearance,
           const Router& router, std::vector<ToVisit> todo, const JointVector& start,
           const Aim& aim) {
  Ways ways(cell.robot, router, todo, start, nullptr);
  Plan plan;
  plan.start = start;
  JointVector at = start;
  std::size_t last = Ways::kStart;
  const Candidate* leaving = nullptr;
  for (const std::size_t next : ways.shortest_order(kMostOrders, kOrderingShare)) {
    poll_cancelled();
    tell_done(kOrderingShare + (1.0 - kOrderingShare) * static_cast<double>(plan.touches.size()) /
                                   static_cast<double>(todo.size()));
    const Candidate& to = todo[next].candidate;
    const Way& way = ways.way(last, next);
    if (!way)
      throw PlanError(
          PlanError::Kind::kInTheWay, cell.targets[to.target].id,
          fmt::format("{}: no clear way to its touch from direction {}: {}. Move it or what is "
                      "in the way, or start from another posture",
                      cell.targets[to.target].id, direction_words(to.normal),
                      words_or(clearance.hit(at, to.standoff, kTipMarginM), kBlockedAround)));
    plan.touches.push_back(to_planned(cell, to, todo[next].set, options));
    plan.touches.back().transit = *way;
    if (aim) aim(to, plan.touches.back());
    round_corners(clearance, leaving != nullptr ? leaving->end : JointVector{}, at,
                  plan.touches.back());
    leaving = &to;
    at = to.clear;
    last = next;
  }
  if (leaving != nullptr) {
    const auto back = router.away(*leaving, start);
    if (back) plan.home = *back;  // else the arm stays at the clear point, which is free
  }
  return plan;
}

}  // namespace cellcal::calib
