#include "calib/plan/reach/order.h"

#include <algorithm>
#include <limits>

#include "calib/model/long_work.h"

namespace cellcal::calib {

namespace {

constexpr double kWorthIt = 1e-9;
constexpr int kRounds = 50;  // each goes over all pairs; ten are the rule
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

  /// Turns a stretch of the path round where that is shorter. Costs may differ with the direction,
  /// so that the stretch's own count both ways.
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

  /// Moves a few visits that follow one another to another place.
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
  /// What putting `run` before `place` of `rest` adds.
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
