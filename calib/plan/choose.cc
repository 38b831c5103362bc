#include "calib/plan/choose.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "calib/estimate/predict.h"
#include "calib/estimate/region.h"
#include "calib/model/linear.h"
#include "calib/model/long_work.h"
#include "calib/plan/online.h"

namespace cellcal::calib {

namespace {

/// Smallest eigenvalue of a target's sum of d d' over its touches, d the unit direction of a touch
/// of a sphere, for its place to be well constrained (the verdict withholds results only far below
/// that).
constexpr double kSpread = 0.5;
/// The last touches reserved for a sphere are placed where it is constrained least.
constexpr int kForSpread = 2;
/// Minimum relative gain of a round of exchanges for another round.
constexpr double kWorthIt = 1e-3;
/// Weight of a radian of posture relative to touch direction in an even choice.
constexpr double kPostureWeight = 0.3;
/// Share of picking in the time of a choice; the rest are exchanges.
constexpr double kPickingShare = 0.3;

/// Directions in which a target was touched so far; for a plane (x, y, 1) of the place in its
/// circle, which together constrain tilts and shift.
class Held {
 public:
  void add(const Eigen::Vector3d& direction) { change(direction, 1); }
  void remove(const Eigen::Vector3d& direction) { change(direction, -1); }
  int count() const { return count_; }
  /// Touches remaining for a sphere that requires `least`.
  int owed(int least) const {
    return count_ < least ? least - count_ : least > 0 && least_ < kSpread ? 1 : 0;
  }
  double in_worst(const Eigen::Vector3d& direction) const {
    return std::pow(worst_.dot(direction), 2);
  }

 private:
  void change(const Eigen::Vector3d& direction, int sign) {
    sum_ += sign * direction * direction.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(sum_);
    least_ = solver.eigenvalues()[0];
    worst_ = solver.eigenvectors().col(0);
    count_ += sign;
  }

  Eigen::Matrix3d sum_ = Eigen::Matrix3d::Zero();
  Eigen::Vector3d worst_ = Eigen::Vector3d::UnitZ();
  double least_ = 0.0;
  int count_ = 0;
};

/// Candidates, their target sets, and the feasible ones.
class Choosing {
 public:
  Choosing(const Cell& cell, const std::vector<Candidate>& candidates, const ChooseOptions& options)
      : options_(options),
        candidates_(candidates),
        held_(cell.targets.size()),
        possible_(candidates.size()),
        random_(options.seed),
        problem_(design_problem(cell, candidates, options.region)) {
    for (std::size_t t = 0; t < cell.targets.size(); ++t) {
      if (std::any_of(candidates.begin(), candidates.end(),
                      [t](const Candidate& c) { return c.target == t; }))
        targets_.push_back(t);
    }
    for (const Candidate& c : candidates) {
      const Target& target = cell.targets[c.target];
      const auto carriers =
          std::span(c.positioner_rad).first(static_cast<std::size_t>(target.carried_by));
      constrained_direction_.push_back(
          carriers.empty() ? c.normal
                           : carried_at(cell.robot, carriers).linear().transpose() * c.normal);
      if (target.kind != TargetKind::kPlane) continue;
      // Position in the circle, and 1 for the shift along the normal.
      const Eigen::Vector3d across = target.normal.unitOrthogonal();
      const Eigen::Vector3d place =
          (problem_.arm->nominal_tip_m(c.contact) - target.centre_m) / (target.extent_m / 2.0);
      constrained_direction_.back() = {place.dot(across), place.dot(target.normal.cross(across)),
                                       1.0};
    }
    weighed_m_ = Eigen::MatrixXd::Zero(problem_.moves_m.rows() + problem_.on_table_m.rows(),
                                       problem_.moves_m.cols());
    weighed_m_.topRows(problem_.moves_m.rows()) = problem_.moves_m;
    weighed_m_.bottomLeftCorner(problem_.on_table_m.rows(), problem_.on_table_m.cols()) =
        problem_.on_table_m;
    design_.emplace(std::move(problem_.rows), std::move(problem_.covariance_u), weighed_m_);
  }

  Choice run() {
    design_->take_all(options_.start);
    for (const std::size_t c : options_.start) note(c);
    for (int k = static_cast<int>(picked_.size()); k < options_.count; ++k) {
      poll_cancelled();
      report_progress(kPickingShare * k / options_.count);
      const auto pick = next(options_.count - k);
      if (!pick) break;
      take(*pick);
    }
    if (options_.criterion == Criterion::kI)
      for (int round = 0; round < options_.exchanges; ++round)
        if (exchange(round) < kWorthIt) break;
    Choice choice;
    choice.picked = picked_;
    const Eigen::Index moved = problem_.moves_m.cols(), arm = problem_.arm->size();
    const Eigen::MatrixXd left = design_->covariance_u().topLeftCorner(moved, moved);
    const Eigen::VectorXd ripple_m2 =
        ripple_variance_m2(*problem_.arm, problem_.postures, problem_.ripple_rad);
    choice.predicted_mean_m = predicted_mean_error_m(problem_.moves_m, left, ripple_m2);
    choice.reducible_m = predicted_mean_error_m(problem_.moves_m, left, 0.0 * ripple_m2);
    if (options_.region.kind != AccuracyRegion::Kind::kTool) {
      const auto scale = problem_.scale.asDiagonal();
      const Eigen::MatrixXd own = left.topLeftCorner(arm, arm);
      const PositionBound bound(*problem_.arm, Eigen::VectorXd::Zero(arm), scale * own * scale,
                                ripple_elsewhere_rad(problem_.ripple_rad));
      // The bound is of the arm without functions.
      const double without_m =
          predicted_mean_error_m(problem_.moves_m.leftCols(arm), own, ripple_m2);
      choice.predicted_u95_m =
          bound.mean_u95_m(problem_.postures) * choice.predicted_mean_m / without_m;
      choice.largest =
          largest_part(*problem_.arm, {problem_.postures, problem_.moves_m, design_->covariance_u(),
                                       problem_.keys, problem_.prior_weight, 0.0});
    }
    return choice;
  }

 private:
  bool possible(std::size_t c) {
    if (!possible_[c]) possible_[c] = options_.possible == nullptr || options_.possible(c);
    return *possible_[c];
  }
  bool open(std::size_t c) const {
    return !design_->has(static_cast<Eigen::Index>(c)) && possible_[c].value_or(true);
  }

  void take(std::size_t c) {
    design_->take(static_cast<Eigen::Index>(c));
    note(c);
  }

  void note(std::size_t c) {
    held_[candidates_[c].target].add(constrained_direction_[c]);
    picked_.push_back(c);
  }

  /// The next pick with `left` remaining: the best by the criterion that satisfies the requirements
  /// of the spheres.
  std::optional<std::size_t> next(int left) {
    while (true) {
      int owed = 0, few = 0;
      for (const std::size_t t : targets_) {
        owed += held_[t].owed(options_.least_per_target);
        few += std::max(0, options_.least_per_target - held_[t].count());
      }
      const bool only_few = few > 0 && few >= left, only_owed = owed > 0 && owed >= left;
      double best = -1.0;
      std::optional<std::size_t> pick;
      for (std::size_t c = 0; c < candidates_.size(); ++c) {
        const Held& own = held_[candidates_[c].target];
        if (!open(c) || (only_few && own.count() >= options_.least_per_target) ||
            (only_owed && own.owed(options_.least_per_target) == 0))
          continue;
        double worth = this->worth(c);
        if (only_owed && own.count() >= options_.least_per_target - kForSpread)
          worth *= own.in_worst(constrained_direction_[c]);
        if (worth > best) {
          best = worth;
          pick = c;
        }
      }
      if (!pick && (only_few || only_owed)) {  // an exhausted sphere has no further requirement
        if (options_.least_per_target == 0) return std::nullopt;
        options_.least_per_target = 0;
        continue;
      }
      if (!pick || possible(*pick)) return pick;
    }
  }

  double worth(std::size_t c) {
    const auto index = static_cast<Eigen::Index>(c);
    switch (options_.criterion) {
      case Criterion::kI: return design_->gain(index);
      case Criterion::kD: return design_->unknown(index);
      case Criterion::kEven: return evenness(c);
      case Criterion::kRandom: break;
    }
    return random_.uniform();
  }

  /// Targets in turn; within a target the distance from its nearest touch.
  double evenness(std::size_t c) const {
    double nearest = 10.0;
    for (const std::size_t other : picked_) {
      if (candidates_[other].target != candidates_[c].target) continue;
      double posture = 0.0;
      for (std::size_t i = 0; i < candidates_[c].contact.size(); ++i)
        posture += std::pow(candidates_[c].contact[i] - candidates_[other].contact[i], 2);
      const double turned = std::acos(std::clamp(
          constrained_direction_[c].normalized().dot(constrained_direction_[other].normalized()),
          -1.0, 1.0));
      nearest = std::min(nearest, turned + kPostureWeight * std::sqrt(posture));
    }
    constexpr double kTurn = 100.0;  // above any distance
    return nearest + kTurn * (options_.count - held_[candidates_[c].target].count());
  }

  /// Replaces every pick by the best candidate, possibly itself. Returns the relative reduction of
  /// the variance.
  double exchange(int round) {
    const auto variance = [&] {
      const Eigen::Index arm = weighed_m_.cols();
      return (weighed_m_ * design_->covariance_u().topLeftCorner(arm, arm))
          .cwiseProduct(weighed_m_)
          .sum();
    };
    const double before = variance();
    double done = 0.0;
    for (std::size_t& pick : picked_) {
      poll_cancelled();
      report_progress(kPickingShare + (1.0 - kPickingShare) *
                                          (round + done++ / static_cast<double>(picked_.size())) /
                                          options_.exchanges);
      const std::size_t own = candidates_[pick].target;
      const Eigen::VectorXd gains = design_->gains_without(static_cast<Eigen::Index>(pick));
      const auto gain = [&](std::size_t c) { return gains[static_cast<Eigen::Index>(c)]; };
      Held rest = held_[own];
      rest.remove(constrained_direction_[pick]);
      const bool bound = rest.owed(options_.least_per_target) > 0;
      std::size_t best = pick;
      while (true) {
        best = pick;
        for (std::size_t c = 0; c < candidates_.size(); ++c)
          if (gain(c) > gain(best) && open(c) && !(bound && candidates_[c].target != own)) best = c;
        if (best == pick || possible(best)) break;
      }
      if (best == pick) continue;
      if (bound) {  // its sphere must stay constrained from all sides
        Held with = rest;
        with.add(constrained_direction_[best]);
        if (with.owed(options_.least_per_target) > 0) continue;
      }
      design_->drop(static_cast<Eigen::Index>(pick));
      design_->take(static_cast<Eigen::Index>(best));
      held_[own] = rest;
      held_[candidates_[best].target].add(constrained_direction_[best]);
      pick = best;
    }
    return 1.0 - variance() / before;
  }

  ChooseOptions options_;
  const std::vector<Candidate>& candidates_;
  std::vector<std::size_t> targets_;  ///< that have candidates
  /// Direction that a touch constrains its target in: for a sphere the touch direction.
  std::vector<Eigen::Vector3d> constrained_direction_;
  std::vector<Held> held_;
  std::vector<std::optional<bool>> possible_;
  Random random_;
  Eigen::MatrixXd weighed_m_;  ///< moves whose variances the criterion adds up
  DesignProblem problem_;      ///< rows and covariance are moved into the design
  std::optional<Design> design_;
  std::vector<std::size_t> picked_;
};

/// Touches of each target that a plan to a goal begins with.
constexpr int kFirstToGoal = 10;

/// u95 that a session reaches by these touches, which exclude most model errors.
double foreseen_u95_m(const Choice& choice) { return kBoundOverError * choice.reducible_m; }

/// At least a tenth more than the choice has, unless no more are allowed.
int more_touches(const Choice& choice, const PlanOptions& options) {
  constexpr double kLeastMore = 1.1;
  const std::size_t count = choice.picked.size();
  const double needed = touches_to_goal(count, choice.reducible_m, options.goal_u95_m);
  return static_cast<int>(
      std::min(std::ceil(std::max(needed, kLeastMore * static_cast<double>(count))),
               1.0 * options.fit_touches));
}

constexpr int kExchanges = 2;

/// The candidate with the largest value that is not in the design.
template <typename Worth>
std::optional<Eigen::Index> best(const Design& design, std::vector<bool>& refused,
                                 const std::function<bool(std::size_t)>& possible,
                                 const Worth& worth) {
  while (true) {
    poll_cancelled();
    std::optional<Eigen::Index> found;
    for (Eigen::Index c = 0; c < design.size(); ++c)
      if (!design.has(c) && !refused[static_cast<std::size_t>(c)] &&
          (!found || worth(c) > worth(*found)))
        found = c;
    if (!found || possible(static_cast<std::size_t>(*found))) return found;
    refused[static_cast<std::size_t>(*found)] = true;
  }
}

/// Angles of successive refinements: that many variations of the picks are added and exchanged,
/// until the gain is too small. For 30 touches of four spheres it reduces the predicted error by a
/// fifth, for 50 by an eighth.
constexpr double kByRad[] = {0.5, 0.35, 0.25, 0.17, 0.1, 0.05};
constexpr int kAroundEach = 60;
constexpr int kMostAround = 2000;
constexpr double kIsWorth = 0.01;  // minimum share of the error

}  // namespace

Choice choose(const Cell& cell, const std::vector<Candidate>& candidates,
              const ChooseOptions& options) {
  if (candidates.empty()) return {};
  return Choosing(cell, candidates, options).run();
}

void choose_to_goal(const PlanOptions& options, int targets,
                    const std::function<void(int count)>& choose_of, const Choice& choice) {
  if (!(options.goal_u95_m > 0.0)) return choose_of(options.fit_touches);
  int count = std::min(options.fit_touches, kFirstToGoal * targets);
  choose_of(count);
  while (foreseen_u95_m(choice) > options.goal_u95_m && count < options.fit_touches)
    choose_of(count = more_touches(choice, options));
}

void foresee(const Choice& choice, const PlanOptions& options, Plan& plan) {
  plan.predicted_mean_m = choice.predicted_mean_m;
  plan.predicted_u95_m = choice.predicted_u95_m;
  if (!(options.goal_u95_m > 0.0)) return;
  plan.predicted_u95_m = foreseen_u95_m(choice);
  if (plan.predicted_u95_m > options.goal_u95_m) plan.missing = choice.largest;
}

std::vector<Picked> with_check_touches(const Cell& cell, const std::vector<Candidate>& candidates,
                                       const std::vector<std::size_t>& picked, std::size_t spread,
                                       int targets, const PlanOptions& options,
                                       const std::function<bool(std::size_t)>& possible) {
  std::vector<bool> taken(candidates.size(), false), fitted(cell.targets.size(), false);
  std::vector<Picked> all;
  for (const std::size_t i : picked) {
    taken[i] = true;
    fitted[candidates[i].target] = true;
    all.push_back({i, TouchSet::kFit});
  }
  Random random(options.seed + 1);
  for (int k = 0; k < options.check_touches; ++k) {
    std::vector<std::size_t> free;  // by target, only for those with fit touches
    for (int turn = 0; turn < targets && free.empty(); ++turn)
      for (std::size_t i = 0; i < spread; ++i)
        if (!taken[i] && fitted[candidates[i].target] &&
            static_cast<int>(candidates[i].target) % targets == (k + turn) % targets)
          free.push_back(i);
    if (free.empty())
      throw PlanError(PlanError::Kind::kTooFew,
                      "not enough reachable touches are left for the check. Plan fewer");
    const std::size_t pick = free[random.below(free.size())];
    taken[pick] = true;
    if (!possible(pick)) {
      --k;
      continue;
    }
    all.push_back({pick, TouchSet::kCheck});
  }
  return all;
}

std::vector<std::size_t> choose_together(Design design, int count,
                                         const std::function<bool(std::size_t)>& possible) {
  std::vector<bool> refused(static_cast<std::size_t>(design.size()), false);
  std::vector<std::size_t> picked;
  while (static_cast<int>(picked.size()) < count) {
    const auto next =
        best(design, refused, possible, [&](Eigen::Index c) { return design.gain(c); });
    if (!next) break;
    design.take(*next);
    picked.push_back(static_cast<std::size_t>(*next));
  }
  for (int round = 0; round < kExchanges; ++round)
    for (std::size_t& pick : picked) {
      const auto own = static_cast<Eigen::Index>(pick);
      const Eigen::VectorXd gains = design.gains_without(own);
      const auto other = best(design, refused, possible, [&](Eigen::Index c) { return gains[c]; });
      if (!other || gains[*other] <= gains[own]) continue;
      design.drop(own);
      design.take(*other);
      pick = static_cast<std::size_t>(*other);
    }
  return picked;
}

void add_neighbours(const Cell& cell, Pool& pool, std::size_t spread, ChooseOptions how,
                    Choice& choice) {
  Random random(how.seed + 2);
  constexpr double kRounds = std::size(kByRad);
  double round = 0.0;
  for (const double by_rad : kByRad) {
    const Part part(PlanStep::kChoose, round / kRounds, (round + 1.0) / kRounds);
    round += 1.0;
    choice.picked = pool.forget(spread, std::move(choice.picked));
    pool.vary(choice.picked, std::min(kMostAround, kAroundEach * how.count), by_rad, random);
    how.start = choice.picked;
    const double before_m = choice.reducible_m;
    choice = choose(cell, pool.candidates(), how);
    if (choice.reducible_m > (1.0 - kIsWorth) * before_m) break;
  }
}

}  // namespace cellcal::calib
