// Touches chosen one by one; why they end, the number first, then the remedy.

#include "calib/plan/online.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>

#include "calib/estimate/budget.h"
#include "calib/estimate/incremental_estimate.h"
#include "calib/model/linear.h"
#include "calib/model/long_work.h"
#include "calib/model/units.h"
#include "calib/plan/aim.h"
#include "calib/plan/choose.h"
#include "calib/plan/duration.h"
#include "calib/plan/forecast.h"
#include "calib/plan/pool.h"
#include "calib/plan/route.h"
#include "calib/plan/track.h"
#include "calib/plan/visit.h"
#include "calib/words/phrase.h"

namespace cellcal::calib {

namespace {

constexpr int kCandidatesPerTarget = 400;
constexpr Kinds kKinds = Kinds::kSpheresAndPlanes;
/// Maximum rounds of exchange, of the plan.
constexpr int kExchangesAhead = 6;
constexpr int kAhead = 10;  ///< touches whose joint gain is evaluated
/// Touches chosen together after the plan; chosen again after this many.
constexpr int kMostTogether = 100;
constexpr int kUntilChosenAgain = 12;
/// Orders evaluated for the touches after the first ones, and for those chosen again while the arm
/// may be waiting. More have no visible effect.
constexpr int kOrdersBehind = 8, kOrdersAgain = 4;
/// Angles of variations added around each choice.
constexpr double kAroundRad[] = {0.3, 0.12};
constexpr int kAroundEach = 12;

using Way = std::optional<std::vector<JointVector>>;

Phrase end_of(const Progress& progress, const Goal& goal) {
  const double u95_mm = progress.u95_m * kMmPerM, goal_mm = goal.u95_m * kMmPerM;
  const bool has_goal = goal_mm > 0.0;
  const PhraseValue n{"n", progress.touches}, percent{"percent", 100.0 * goal.worth_it};
  const PhraseValue u95{
      "u95", has_goal ? Phrase("say.ended.u95.goal", {{"u95", u95_mm}, {"goal", goal_mm}})
                      : Phrase("say.ended.u95", {{"u95", u95_mm}})};
  switch (*progress.ended) {
    case Ended::kGoal: return {"say.ended.goal", {u95}};
    case Ended::kMostTouches:
      return {has_goal ? "say.ended.most.goal" : "say.ended.most", {n, u95}};
    case Ended::kNoGain: return {"say.ended.no_gain", {n, percent, u95}};
    case Ended::kNoEstimate: return "say.ended.no_estimate";
    case Ended::kAllReachable: return {"say.ended.all_reachable", {n, u95}};
  }
  return {};
}

}  // namespace

struct Online::Impl {
  Cell cell;
  PlanOptions options;
  Goal goal;
  Pool pool;
  std::size_t spread;               ///< initial candidates, distributed over the targets
  std::vector<bool> gone;           ///< per candidate: touched, failed, or unreachable
  int least = kFirstTouches;        ///< touches of each sphere before the first estimate
  std::vector<std::size_t> seeds;   ///< for the first estimate, in order
  std::vector<std::size_t> agenda;  ///< chosen together, in order after the seeds
  int until_reselected = 0;         ///< touches
  int unsettled = 0;                ///< number of failed estimates
  Random random;
  std::vector<std::size_t> failed;  ///< failed candidates
  std::vector<std::size_t> checks;  ///< remaining, made after the fit touches
  std::vector<Touch> touches;
  std::optional<IncrementalEstimate> estimate;
  Eigen::MatrixXd moves;              ///< of the region, at the estimate
  std::vector<JointVector> postures;  ///< of the region
  std::optional<Design> design;
  std::optional<std::size_t> offered;
  std::optional<PlannedTouch> planned;  ///< the touch offered, with its path from
  JointVector planned_from;             ///< this position; a different start needs a different path
  std::optional<std::size_t> last;      ///< candidate at whose clear point the arm is
  Progress progress;
  std::vector<std::pair<int, double>> bounds;  ///< u95 [m] after so many touches

  Impl(const Cell& stated, const PlanOptions& how, const Goal& wanted,
       const std::vector<Touch>& made)
      : cell(stated),
        options(with_tolerances(how, stated)),
        goal(wanted),
        pool(cell, options, kCandidatesPerTarget, kKinds),
        spread(pool.candidates().size()),
        gone(spread, false),
        random(options.seed + 1) {
    progress.touches_left = goal.most_touches;
    progress.checks_left = options.check_touches;
    for (const Touch& touch : made) {
      if (touch.set == TouchSet::kFit)
        touches.push_back(touch);
      else
        --progress.checks_left;
      constexpr double kSameRad = 0.05;
      forget_like(cell.target_index(touch.target), touch.joint_rad, kSameRad);
    }
    progress.touches = static_cast<int>(touches.size());
    progress.touches_left -= progress.touches;
    if (!touches.empty() && seeded())
      begin();
    else
      plan_ahead();
  }

  /// The touches predicted for the goal by (92), on nominal geometry: first those needed for an
  /// estimate, then the others.
  void plan_ahead() {
    const auto targets =
        static_cast<int>(std::count_if(cell.targets.begin(), cell.targets.end(),
                                       [](const Target& t) { return is_planned(t, kKinds); }));
    const int fewest = kFirstTouches * targets, most = std::max(fewest, progress.touches_left);
    ChooseOptions how;
    how.region = options.region;
    how.seed = options.seed;
    how.possible = [this](std::size_t c) {
      return (c >= gone.size() || !gone[c]) && pool.connected(c);
    };
    how.exchanges = kExchangesAhead;
    // Half of them are distributed evenly, as in every plan.
    const auto choose_some = [&](int count) {
      how.count = count;
      how.least_per_target = std::max(kFirstTouches, count / (2 * targets));
      const Part part(PlanStep::kChoose, kReachShare, kChosenShare);
      return choose(cell, pool.candidates(), how);
    };
    Choice choice = choose_some(goal.u95_m > 0.0 ? std::min(most, 2 * fewest) : most);
    if (goal.u95_m > 0.0) {
      const double needed =
          touches_to_goal(static_cast<std::size_t>(how.count), choice.reducible_m, goal.u95_m);
      choice = choose_some(static_cast<int>(std::clamp(needed, 1.0 * fewest, 1.0 * most)));
    }
    if (how.count > fewest) {
      const Part part(PlanStep::kChoose, kChosenShare, kRefinedShare);
      add_neighbours(cell, pool, spread, how, choice);
    }
    const Part part(PlanStep::kWays, kRefinedShare, 1.0);
    choice.picked = pool.forget(spread, std::move(choice.picked));
    gone.resize(pool.candidates().size(), false);
    std::map<std::size_t, int> of_target;
    for (const std::size_t c : choice.picked)
      (++of_target[pool.candidates()[c].target] <= kFirstTouches ? seeds : agenda).push_back(c);
    seeds = in_short_order(seeds, pool.middle(), {}, kMostOrders);
    if (!seeds.empty()) {
      const std::size_t behind = seeds.back();
      agenda = in_short_order(agenda, pool.candidates()[behind].clear, behind, kOrdersBehind);
    }
    until_reselected = static_cast<int>(choice.picked.size());
    progress.touches_left = static_cast<int>(choice.picked.size());
  }

  /// Withdraws candidates of the target within this angle of the contact in every axis.
  void forget_like(std::size_t target, const JointVector& contact, double within_rad) {
    for (std::size_t c = 0; c < gone.size(); ++c) {
      const Candidate& candidate = pool.candidates()[c];
      double off = candidate.target == target ? 0.0 : within_rad;
      for (std::size_t i = 0; i < contact.size(); ++i)
        off = std::max(off, std::abs(candidate.contact[i] - contact[i]));
      if (off < within_rad) gone[c] = true;
    }
  }

  /// The obstacle of a failed touch also affects its neighbours.
  void forget_failed() {
    constexpr double kBesideRad = 0.15;
    for (const std::size_t c : failed)
      forget_like(pool.candidates()[c].target, pool.candidates()[c].contact, kBesideRad);
  }

  int made(std::size_t target) const {
    return static_cast<int>(std::count_if(touches.begin(), touches.end(), [&](const Touch& touch) {
      return cell.target_index(touch.target) == target;
    }));
  }

  /// In an order of short duration from here; `which` without withdrawn candidates.
  std::vector<std::size_t> in_short_order(const std::vector<std::size_t>& which,
                                          const JointVector& from,
                                          const std::optional<std::size_t>& leaving,
                                          int most_orders) const {
    std::vector<ToVisit> todo;
    for (const std::size_t c : which) todo.push_back({pool.candidates()[c], TouchSet::kFit});
    const Candidate* left = leaving ? &pool.candidates()[*leaving] : nullptr;
    std::vector<std::size_t> ordered;
    for (const std::size_t k :
         order_by_ways(cell.robot, pool.router(), todo, from, left, most_orders))
      ordered.push_back(which[k]);
    return ordered;
  }

  /// Target by target; a seed lost to a failure is replaced.
  bool seeded() const {
    for (std::size_t t = 0; t < cell.targets.size(); ++t)
      if (is_planned(cell.targets[t], kKinds) && made(t) < least) return false;
    return true;
  }

  /// Every target has its first touches: from here on touches are chosen by the estimate.
  void begin() {
    seeds.clear();
    settle([this] { estimate.emplace(cell, touches); });
  }

  /// Few touches of an inaccurate arm may not converge; retried with more.
  void settle(const std::function<void()>& fit) {
    try {
      fit();
      update();
    } catch (const IdentifyError&) {
      constexpr int kMostTries = 10;
      if (++unsettled > kMostTries) throw;
      estimate.reset();
      design.reset();
      least = std::numeric_limits<int>::max();
      for (std::size_t t = 0; t < cell.targets.size(); ++t)
        if (is_planned(cell.targets[t], kKinds)) least = std::min(least, made(t) + 1);
    }
  }

  /// Includes a touch in the estimate, and updates the prediction.
  void learn(const Touch& touch) {
    if (touch.set == TouchSet::kCheck) {
      --progress.checks_left;
      progress.done = progress.checks_left == 0;
      return;
    }
    touches.push_back(touch);
    ++progress.touches;
    if (estimate) {
      settle([&] { estimate->add(touch); });
    } else if (seeded()) {
      begin();
    }
  }

  /// Updates the arm's estimate and its distance from the goal.
  void update() {
    see();
    bounds.emplace_back(progress.touches, progress.u95_m);
    judge();
  }

  /// Updates candidates and region under the estimate.
  void see() {
    RemainingUncertainty seen = remaining_uncertainty(cell, pool, options, *estimate);
    design = std::move(seen.design);
    moves = std::move(seen.moves);
    postures = std::move(seen.postures);
    progress.mean_m = seen.mean_m;
    progress.u95_m = seen.u95_m;
  }

  /// Chooses the remaining touches under the current estimate, in order.
  void choose_ahead(const JointVector& from) {
    const int count = std::clamp(progress.touches_left, 1, kMostTogether);
    const auto possible = [this](std::size_t c) { return !gone[c] && pool.connected(c); };
    forget_around();
    see();
    std::vector<std::size_t> picked = choose_together(*design, count, possible);
    for (const double by_rad : kAroundRad) {
      pool.vary(picked, kAroundEach * static_cast<int>(picked.size()), by_rad, random);
      gone.resize(pool.candidates().size(), false);
      forget_failed();
      see();
      picked = choose_together(*design, count, possible);
    }
    agenda = in_short_order(picked, from, last, kOrdersAgain);
    until_reselected = kUntilChosenAgain;
  }

  /// Removes variations of earlier choices, except those still in use.
  void forget_around() {
    std::vector<std::size_t> kept = failed;
    kept.insert(kept.end(), agenda.begin(), agenda.end());
    if (last) kept.push_back(*last);
    std::sort(kept.begin(), kept.end());
    kept.erase(std::unique(kept.begin(), kept.end()), kept.end());
    const std::vector<std::size_t> now = pool.forget(spread, kept);
    std::map<std::size_t, std::size_t> place;
    std::vector<bool> gone_now(gone.begin(), gone.begin() + static_cast<std::ptrdiff_t>(spread));
    gone_now.resize(pool.candidates().size(), false);
    for (std::size_t k = 0; k < kept.size(); ++k) {
      place[kept[k]] = now[k];
      gone_now[now[k]] = gone[kept[k]];
    }
    gone = std::move(gone_now);
    for (std::size_t& c : failed) c = place.at(c);
    if (last) last = place.at(*last);
    agenda.clear();
  }

  double variance() const {
    const Eigen::Index n = moves.cols();
    return (moves * design->covariance_u().topLeftCorner(n, n)).cwiseProduct(moves).sum();
  }

  /// Largest contribution to u95 above the goal, under the current estimate.
  Missing missing() const {
    const Problem& problem = estimate->problem();
    std::vector<ParameterKey> keys;
    Eigen::VectorXd prior_weight(problem.size());
    for (const Unknown& unknown : problem.unknowns()) {
      const double sigma_u = prior_sigma_u(unknown, estimate->levels()).value_or(0.0);
      prior_weight[static_cast<Eigen::Index>(keys.size())] = sigma_u > 0.0 ? 1.0 / sigma_u : 0.0;
      keys.push_back(unknown.key);
    }
    return largest_part(problem.arm(), {postures, moves, estimate->covariance_u(), keys,
                                        prior_weight, estimate->levels().ripple_rad});
  }

  void finish(Ended why) {
    progress.fitted = true;
    progress.touches_left = 0;
    progress.ended = why;
    if (why != Ended::kGoal && goal.u95_m > 0.0 && estimate && !postures.empty())
      progress.missing = missing();
    if (!estimate) progress.checks_left = 0;
    for (int k = 0; k < progress.checks_left; ++k) draw_check(static_cast<std::size_t>(k));
    progress.checks_left = static_cast<int>(checks.size());
    progress.done = checks.empty();
  }

  /// One more check touch, of the target whose turn it is, or the next with a candidate left.
  void draw_check(std::size_t turn) {
    const std::size_t targets = cell.targets.size();
    for (std::size_t k = 0; k < targets; ++k) {
      std::vector<std::size_t> free;
      for (std::size_t c = 0; c < spread; ++c)
        if (!gone[c] && pool.candidates()[c].target == (turn + k) % targets) free.push_back(c);
      while (!free.empty()) {
        std::swap(free[random.below(free.size())], free.back());
        const std::size_t c = free.back();
        free.pop_back();
        gone[c] = true;  // for the fit and for further draws
        if (!pool.connected(c)) continue;
        checks.push_back(c);
        return;
      }
    }
  }

  /// The check with the shortest path.
  std::optional<std::size_t> pick_check(const JointVector& from) {
    if (checks.empty()) return std::nullopt;
    const auto to = [&](std::size_t c) {
      return move_s(cell.robot, from, pool.candidates()[c].standoff, {});
    };
    const auto nearest = std::min_element(
        checks.begin(), checks.end(), [&](std::size_t a, std::size_t b) { return to(a) < to(b); });
    const std::size_t c = *nearest;
    checks.erase(nearest);
    return c;
  }

  /// Decides whether to continue, and predicts the remaining touches by taking the best ones in
  /// turn as if they were made.
  void judge() {
    if (progress.u95_m <= goal.u95_m) return finish(Ended::kGoal);
    const int most = goal.most_touches - progress.touches;
    if (most <= 0) return finish(Ended::kMostTouches);
    const double before = variance();
    double left = before;
    Design ahead = *design;
    int k = 0;
    for (; k < most && std::sqrt(left / before) * progress.u95_m > goal.u95_m; ++k) {
      poll_cancelled();
      Eigen::Index best = -1;
      for (Eigen::Index r = 0; r < ahead.size(); ++r)
        if (!gone[static_cast<std::size_t>(r)] && !ahead.has(r) &&
            (best < 0 || ahead.gain(r) > ahead.gain(best)))
          best = r;
      if (best < 0) break;
      left -= ahead.gain(best);
      ahead.take(best);
      if (k + 1 == kAhead && std::sqrt(left / before) > 1.0 - goal.worth_it)
        return finish(Ended::kNoGain);
    }
    progress.touches_left = std::min(k, touches_by_trend(bounds, goal.u95_m, most));
  }

  Way way_to(std::size_t c, const JointVector& from) const {
    const Candidate* leaving = last ? &pool.candidates()[*last] : nullptr;
    return pool.router().to_standoff(from, leaving, pool.candidates()[c]);
  }

  /// For the first estimate: targets with too few touches, planned ones first.
  std::optional<std::size_t> next_first() {
    const auto wanted = [this](std::size_t c) {
      return !gone[c] && made(pool.candidates()[c].target) < least && pool.connected(c);
    };
    for (const auto* planned_ahead : {&seeds, &agenda}) {
      const auto found = std::find_if(planned_ahead->begin(), planned_ahead->end(), wanted);
      if (found != planned_ahead->end()) return *found;
    }
    for (std::size_t c = 0; c < gone.size(); ++c)
      if (wanted(c)) return c;
    return std::nullopt;
  }

  /// The first on the agenda with a path from here; reports the reason if there is none.
  std::optional<std::size_t> next_ahead(const JointVector& from) {
    std::erase_if(agenda, [this](std::size_t c) { return gone[c]; });
    if (agenda.empty() || until_reselected <= 0) choose_ahead(from);
    for (const std::size_t c : agenda)
      if (way_to(c, from)) return c;
    return agenda.empty() ? std::nullopt : std::optional(agenda.front());
  }

  void remove_candidate() {
    if (!offered) return;
    gone[*offered] = true;
    --until_reselected;
    last = offered;
    offered.reset();
    planned.reset();
  }

  std::optional<std::size_t> pick(const JointVector& from) {
    if (estimate) return next_ahead(from);
    const auto first = next_first();
    if (!first) finish(Ended::kNoEstimate);
    return first;
  }

  /// The touch with its path from the current position.
  PlannedTouch planned_to(std::size_t c, TouchSet set, const JointVector& from) const {
    const Candidate& to = pool.candidates()[c];
    PlannedTouch touch = to_planned(cell, to, set, options);
    const Candidate* leaving = last ? &pool.candidates()[*last] : nullptr;
    Way way = way_to(c, from);
    if (!way)  // not specific to this touch: it is connected
      throw PlanError(
          PlanError::Kind::kArmStands,
          fmt::format("no clear way from the arm's position: on the way to its resting posture {}. "
                      "Jog it free",
                      words_or(pool.clearance().hit(from, pool.middle()),
                               "it would hit its surroundings")));
    touch.transit = std::move(*way);
    if (estimate) {
      const double unknown = design->unknown(static_cast<Eigen::Index>(c));
      aim({pool, *estimate, options, cell.touch_sigma_m * std::sqrt(1.0 + unknown)}, to, touch);
    }
    const bool behind_touch = leaving != nullptr && leaving->clear == from;
    round_corners(pool.clearance(), behind_touch ? leaving->end : JointVector{}, from, touch);
    return touch;
  }
};

Online::Online(const Cell& cell, const PlanOptions& options, const Goal& goal,
               const std::vector<Touch>& made)
    : impl_(make_hidden<Impl>(cell, options, goal, made)) {}

std::optional<PlannedTouch> Online::next(const JointVector& where) {
  Impl& me = *impl_;
  const JointVector& from = where.empty() ? me.pool.middle() : where;
  if (me.planned && me.planned_from == from) return me.planned;
  while (!me.progress.done) {
    const bool fitted = me.progress.fitted;
    const auto c = me.offered ? me.offered : fitted ? me.pick_check(from) : me.pick(from);
    if (!c && fitted) {
      me.progress.checks_left = 0;
      me.progress.done = true;
      break;
    }
    if (!c) {
      if (!me.progress.fitted) me.finish(Ended::kAllReachable);
      continue;
    }
    me.offered = c;
    me.planned = me.planned_to(*c, fitted ? TouchSet::kCheck : TouchSet::kFit, from);
    me.planned_from = from;
    return me.planned;
  }
  return std::nullopt;
}

void Online::touched(const Touch& touch) {
  impl_->remove_candidate();  // is not offered again
  impl_->learn(touch);
}

void Online::failed() {
  const auto offered = impl_->offered;
  impl_->remove_candidate();
  if (offered) {
    impl_->failed.push_back(*offered);
    impl_->forget_failed();
  }
  if (offered && impl_->progress.fitted)
    impl_->draw_check(impl_->pool.candidates()[*offered].target);
}

std::vector<JointVector> Online::way_home(const JointVector& from) const {
  const Impl& me = *impl_;
  if (!me.last) return {};
  const Candidate& leaving = me.pool.candidates()[*me.last];
  if (!is_at(leaving.clear, from)) return {};
  return me.pool.router().away(leaving, me.pool.middle()).value_or(std::vector<JointVector>{});
}

const Progress& Online::progress() const { return impl_->progress; }
const std::vector<Touch>& Online::touches() const { return impl_->touches; }

double touches_to_goal(std::size_t count, double reducible_m, double goal_u95_m) {
  constexpr double kErrorPower = 0.55;  // of the decrease of the error with the number of touches
  return static_cast<double>(count) *
         std::pow(kBoundOverError * reducible_m / goal_u95_m, 1.0 / kErrorPower);  // (92)
}

Phrase why_ended(const Progress& progress, const Goal& goal) {
  if (!progress.ended) return {};
  const Phrase end = end_of(progress, goal);
  if (!progress.missing) return end;
  return {"say.ended.missing", {{"end", end}, {"missing", phrase_of(*progress.missing)}}};
}

}  // namespace cellcal::calib
