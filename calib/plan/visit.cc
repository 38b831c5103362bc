#include "calib/plan/visit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "calib/model/long_work.h"
#include "calib/plan/duration.h"
#include "calib/plan/pool.h"

namespace cellcal::calib {

namespace {

/// Estimated extra cost of a change beyond the direct move before its path is planned: the tip has
/// to rise above a sphere, and another sphere is farther.
constexpr double kSameSphereS = 0.2, kOtherSphereS = 0.5;
/// Cost without a path.
constexpr double kNoWayS = 1e3;
/// Limits the number of orders for many visits: each costs the square of their number.
constexpr int kMostVisitsTimesOrders = 4000;
/// Share of ordering in the planning time of visits; the rest is for corners.
constexpr double kOrderingShare = 0.7;

using Way = std::optional<std::vector<JointVector>>;

/// Paths between the visits, planned when an order needs them.
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

  /// From the end of the visit `from`, or from the start, to the stand-off of `to`.
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

  /// The fastest of the orders evaluated. An order is based on estimated times for paths not used
  /// before; its own paths are planned, and the next order uses their times. `share`: of the
  /// current part of the computation.
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
        // The first order plans most paths, each further one about half as many.
        report_progress(share * (1.0 - std::pow(0.5, k + static_cast<double>(++led) / visits)));
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

constexpr double kWorthIt = 1e-9;
constexpr int kRounds = 50;  // over all pairs; typically ten are used
constexpr std::size_t kLongestRun = 3;

/// The path with its costs; place 0 is the first after the start.
class Path {
 public:
  Path(const Eigen::MatrixXd& cost, const Eigen::VectorXd& from_start)
      : cost_(cost), from_start_(from_start) {
    const auto n = static_cast<std::size_t>(cost.rows());
    std::vector<bool> seen(n, false);
    for (std::size_t k = 0; k < n; ++k) {
      std::size_t nearest = n;
      for (std::size_t i = 0; i < n; ++i)
        if (!seen[i] && (nearest == n || step(order_, i) < step(order_, nearest))) nearest = i;
      seen[nearest] = true;
      order_.push_back(nearest);
    }
  }

  /// Reverses a section of the path if that is shorter. Costs may depend on the direction, so the
  /// section's own costs are included both ways.
  bool turn_stretches() {
    bool better = false;
    const std::size_t n = order_.size();
    for (std::size_t a = 0; a + 1 < n; ++a) {
      double forth = 0.0, back = 0.0;
      for (std::size_t b = a + 1; b < n; ++b) {
        forth += between(order_[b - 1], order_[b]);
        back += between(order_[b], order_[b - 1]);
        const double now = into(a, order_[a]) + forth + out_of(b, order_[b]);
        const double turned = into(a, order_[b]) + back + out_of(b, order_[a]);
        if (turned > now - kWorthIt) continue;
        std::reverse(order_.begin() + static_cast<std::ptrdiff_t>(a),
                     order_.begin() + static_cast<std::ptrdiff_t>(b) + 1);
        std::swap(forth, back);
        better = true;
      }
    }
    return better;
  }

  /// Moves a few consecutive visits to another place.
  bool move_runs() {
    bool better = false;
    for (std::size_t length = 1; length <= kLongestRun; ++length)
      for (std::size_t from = 0; from + length <= order_.size(); ++from) {
        const auto first = order_.begin() + static_cast<std::ptrdiff_t>(from);
        const std::vector<std::size_t> run(first, first + static_cast<std::ptrdiff_t>(length));
        std::vector<std::size_t> rest = order_;
        rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(from),
                   rest.begin() + static_cast<std::ptrdiff_t>(from + length));
        double least = gap(rest, from, run) - kWorthIt;
        std::size_t best = from;
        for (std::size_t to = 0; to <= rest.size(); ++to)
          if (const double cost = gap(rest, to, run); cost < least) {
            least = cost;
            best = to;
          }
        if (best == from) continue;
        rest.insert(rest.begin() + static_cast<std::ptrdiff_t>(best), run.begin(), run.end());
        order_ = std::move(rest);
        better = true;
      }
    return better;
  }

  const std::vector<std::size_t>& order() const { return order_; }

 private:
  double between(std::size_t i, std::size_t j) const {
    return cost_(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  }
  double step(const std::vector<std::size_t>& path, std::size_t to) const {
    return path.empty() ? from_start_[static_cast<Eigen::Index>(to)] : between(path.back(), to);
  }
  double into(std::size_t place, std::size_t visit) const {
    return place == 0 ? from_start_[static_cast<Eigen::Index>(visit)]
                      : between(order_[place - 1], visit);
  }
  double out_of(std::size_t place, std::size_t visit) const {
    return place + 1 == order_.size() ? 0.0 : between(visit, order_[place + 1]);
  }
  /// Cost added by inserting `run` before `place` of `rest`.
  double gap(const std::vector<std::size_t>& rest, std::size_t place,
             const std::vector<std::size_t>& run) const {
    const double in = place == 0 ? from_start_[static_cast<Eigen::Index>(run.front())]
                                 : between(rest[place - 1], run.front());
    if (place == rest.size()) return in;
    const double across = place == 0 ? from_start_[static_cast<Eigen::Index>(rest[0])]
                                     : between(rest[place - 1], rest[place]);
    return in + between(run.back(), rest[place]) - across;
  }

  const Eigen::MatrixXd& cost_;
  const Eigen::VectorXd& from_start_;
  std::vector<std::size_t> order_;
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
    report_progress(kOrderingShare + (1.0 - kOrderingShare) *
                                         static_cast<double>(plan.touches.size()) /
                                         static_cast<double>(todo.size()));
    const Candidate& to = todo[next].candidate;
    const Way& way = ways.way(last, next);
    if (!way)
      throw PlanError(
          PlanError::Kind::kInTheWay, cell.targets[to.target].id,
          fmt::format("{}: no clear way to its touch from direction {}: {}. Move it or what is "
                      "in the way, or start from another posture",
                      cell.targets[to.target].id, direction_words(to.normal),
                      words_or(clearance.hit(at, to.standoff), kBlockedAround)));
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
    if (back) plan.home = *back;  // otherwise the arm stays at the clear point, which is free
  }
  return plan;
}

std::vector<std::size_t> short_order(const Eigen::MatrixXd& cost,
                                     const Eigen::VectorXd& from_start) {
  Path path(cost, from_start);
  for (int round = 0; round < kRounds; ++round) {
    poll_cancelled();
    const bool turned = path.turn_stretches(), moved = path.move_runs();
    if (!turned && !moved) break;
  }
  return path.order();
}

}  // namespace cellcal::calib
