#include "calib/plan/online.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "calib/estimate/incremental_estimate.h"
#include "calib/model/random.h"
#include "calib/plan/choice/aim.h"
#include "calib/plan/choice/choose.h"
#include "calib/plan/choice/forecast.h"
#include "calib/plan/choice/remaining_uncertainty.h"
#include "calib/plan/reach/corners.h"
#include "calib/plan/reach/order.h"
#include "calib/plan/reach/pool.h"

namespace cellcal::calib {

namespace {

constexpr int kCandidatesPerTarget = 400;
constexpr Kinds kKinds = Kinds::kSpheresAndPlanes;
constexpr int kAhead = 10;  ///< touches that have to be worth it together
/// Before each choice, candidates like the one that was best by then, turned by one of these.
constexpr double kLookAroundRad[] = {0.3, 0.12};
constexpr int kAround = 24;
constexpr std::size_t kMostAround = 3000;  ///< of all that are added
/// Of so many that are foremost by a guess the way is looked for before one is chosen.
constexpr int kLookedAt = 8;

using Way = std::optional<std::vector<JointVector>>;

}  // namespace

struct Online::Impl {
  Cell cell;
  PlanOptions options;
  Goal goal;
  JointVector start;
  Pace pace;
  Pool pool;
  std::size_t spread;              ///< candidates in the beginning, all over the targets
  std::vector<bool> gone;          ///< per candidate: touched, failed, or without a way
  std::vector<std::size_t> seeds;  ///< still to be made, in order
  int least = kFirstTouches;       ///< touches of each sphere before there is an estimate
  int unsettled = 0;               ///< times that there was none
  Random random;
  std::vector<std::size_t> failed;  ///< candidates that could not be touched
  std::vector<std::size_t> checks;  ///< still to be made, once the fit touches are
  std::vector<Touch> touches;
  std::optional<IncrementalEstimate> estimate;
  Eigen::MatrixXd moves;  ///< of the region, at the estimate
  std::optional<Design> design;
  std::optional<std::size_t> offered;
  std::optional<PlannedTouch> planned;  ///< the touch offered, on its way from
  JointVector planned_from;             ///< here: from elsewhere it is another way
  std::optional<std::size_t> last;      ///< candidate that the arm stands at
  Progress progress;
  std::vector<std::pair<int, double>> bounds;  ///< u95 [m] after so many touches

  Impl(const Cell& stated, const PlanOptions& how, const Goal& wanted, JointVector from,
       const Pace& at, const std::vector<Touch>& made)
      : cell(stated),
        options(how),
        goal(wanted),
        start(std::move(from)),
        pace(at),
        pool(cell, options, kCandidatesPerTarget, kKinds),
        spread(pool.candidates().size()),
        gone(spread, false),
        random(options.seed + 1) {
    if (start.empty()) start = pool.middle();
    if (const auto what = pool.clearance().hit(start, kTipMarginM))
      throw PlanError("the arm is too close to something to start: " + words(*what) +
                      ". Jog it free");
    ChooseOptions first;
    first.count = kFirstTouches * static_cast<int>(std::count_if(
                                      cell.targets.begin(), cell.targets.end(),
                                      [](const Target& t) { return is_planned(t, kKinds); }));
    first.least_per_target = kFirstTouches;
    first.region = options.region;
    first.possible = [this](std::size_t c) { return pool.connected(c); };
    seeds = choose(cell, pool.candidates(), first).picked;
    order_seeds();
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
    if (!touches.empty() && seeded()) begin();
  }

  /// Candidates of the target with no axis further from this contact are not offered again.
  void forget_like(std::size_t target, const JointVector& contact, double within_rad) {
    for (std::size_t c = 0; c < gone.size(); ++c) {
      const Candidate& candidate = pool.candidates()[c];
      double off = candidate.target == target ? 0.0 : within_rad;
      for (std::size_t i = 0; i < contact.size(); ++i)
        off = std::max(off, std::abs(candidate.contact[i] - contact[i]));
      if (off < within_rad) gone[c] = true;
    }
  }

  /// What was in the way of one touch is in the way of those beside it, too.
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

  /// Few, and all of them have to be made: in the order that costs least time.
  void order_seeds() {
    const auto count = static_cast<Eigen::Index>(seeds.size());
    Eigen::MatrixXd cost(count, count);
    Eigen::VectorXd from_start(count);
    for (Eigen::Index j = 0; j < count; ++j) {
      from_start[j] = seconds(seeds[static_cast<std::size_t>(j)], start);
      for (Eigen::Index i = 0; i < count; ++i) {
        last = seeds[static_cast<std::size_t>(i)];
        cost(i, j) = seconds(seeds[static_cast<std::size_t>(j)], pool.candidates()[*last].clear);
      }
    }
    last.reset();
    std::vector<std::size_t> ordered;
    for (const std::size_t k : short_order(cost, from_start)) ordered.push_back(seeds[k]);
    seeds = std::move(ordered);
  }

  /// Target by target; one that lost a seed to a failure gets another.
  bool seeded() const {
    for (std::size_t t = 0; t < cell.targets.size(); ++t)
      if (is_planned(cell.targets[t], kKinds) && made(t) < least) return false;
    return true;
  }

  /// Every target has its first touches: from here on the estimate says where to go.
  void begin() {
    seeds.clear();
    settle([this] { estimate.emplace(cell, touches); });
  }

  /// Few touches of an arm far off may not lead to an estimate; with some more they do.
  void settle(const std::function<void()>& fit) {
    try {
      fit();
      look();
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

  /// Takes a touch into the estimate, and says where that leads.
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

  /// More candidates like the best.
  void look_around() {
    if (!design || pool.candidates().size() > spread + kMostAround) return;
    const JointVector& from = last ? pool.candidates()[*last].clear : start;
    const auto best = most_worth(from);
    if (!best) return;
    for (const double by_rad : kLookAroundRad)
      pool.vary({*best}, kAround / static_cast<int>(std::size(kLookAroundRad)), by_rad, random);
    gone.resize(pool.candidates().size(), false);
    forget_failed();
  }

  /// Candidates and region as the estimate sees them.
  void look() {
    look_around();
    RemainingUncertainty seen = remaining_uncertainty(cell, pool, options, *estimate);
    design = std::move(seen.design);
    moves = std::move(seen.moves);
    progress.mean_m = seen.mean_m;
    progress.u95_m = seen.u95_m;
    bounds.emplace_back(progress.touches, progress.u95_m);
    judge();
  }

  double variance() const {
    const Eigen::Index n = moves.cols();
    return (moves * design->covariance_u().topLeftCorner(n, n)).cwiseProduct(moves).sum();
  }

  void finish(std::string why) {
    progress.fitted = true;
    progress.touches_left = 0;
    progress.why = std::move(why);
    if (!estimate) progress.checks_left = 0;
    for (int k = 0; k < progress.checks_left; ++k) draw_check(static_cast<std::size_t>(k));
    progress.checks_left = static_cast<int>(checks.size());
    progress.done = checks.empty();
  }

  /// One more check touch, of the target whose turn it is, or of the next that has one left.
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
        gone[c] = true;  // for the fit, and for another draw
        if (!pool.connected(c)) continue;
        checks.push_back(c);
        return;
      }
    }
  }

  /// The check that is reached soonest.
  std::optional<std::size_t> pick_check(const JointVector& from) {
    if (checks.empty()) return std::nullopt;
    const auto nearest = std::min_element(
        checks.begin(), checks.end(),
        [&](std::size_t a, std::size_t b) { return seconds(a, from) < seconds(b, from); });
    const std::size_t c = *nearest;
    checks.erase(nearest);
    return c;
  }

  /// Whether to go on, and how long still: the best touches are taken one after the other as if
  /// each were made.
  void judge() {
    constexpr double kMm = 1e3;
    if (progress.u95_m <= goal.u95_m)
      return finish(fmt::format("goal reached: u95 {:.3f} mm, goal {:.3f} mm", progress.u95_m * kMm,
                                goal.u95_m * kMm));
    const int most = goal.most_touches - progress.touches;
    if (most <= 0)
      return finish(fmt::format(
          "all {} touches made; u95 {:.3f} mm{}", progress.touches, progress.u95_m * kMm,
          goal.u95_m > 0.0 ? fmt::format(", goal {:.3f} mm", goal.u95_m * kMm) : ""));
    const double before = variance();
    double left = before;
    Design ahead = *design;
    int k = 0;
    for (; k < most && std::sqrt(left / before) * progress.u95_m > goal.u95_m; ++k) {
      Eigen::Index best = -1;
      for (Eigen::Index r = 0; r < ahead.size(); ++r)
        if (!gone[static_cast<std::size_t>(r)] && !ahead.has(r) &&
            (best < 0 || ahead.gain(r) > ahead.gain(best)))
          best = r;
      if (best < 0) break;
      left -= ahead.gain(best);
      ahead.take(best);
      if (k + 1 == kAhead && std::sqrt(left / before) > 1.0 - goal.worth_it)
        return finish(fmt::format(
            "ten more touches would reduce the error by less than {:.0f} %; u95 {:.3f} mm, goal "
            "{:.3f} mm. Certified lengths, more spheres or other postures help more",
            100.0 * goal.worth_it, progress.u95_m * kMm, goal.u95_m * kMm));
    }
    progress.touches_left = std::min(k, touches_by_trend(bounds, goal.u95_m, most));
  }

  /// A touch from there, the way to it guessed.
  double seconds(std::size_t c, const JointVector& from) const {
    const Candidate& to = pool.candidates()[c];
    const bool same = last && pool.candidates()[*last].target == to.target;
    constexpr double kSameSphereS = 0.2, kOtherSphereS = 0.5;
    return at_place_s() + (same ? kSameSphereS : kOtherSphereS) +
           move_s(cell.robot, from, to.standoff, pace);
  }
  double at_place_s() const {
    constexpr double kRetreatS = 0.45;
    return touch_s(pace.foretold_m, pace) + kRetreatS;
  }

  Way way_to(std::size_t c, const JointVector& from) const {
    const Candidate* leaving = last ? &pool.candidates()[*last] : nullptr;
    return pool.router().to_standoff(from, leaving, pool.candidates()[c]);
  }

  /// Per candidate, what it takes off the error per second; of those that are gone nothing.
  std::vector<double> worths(const JointVector& from) const {
    std::vector<double> worths(static_cast<std::size_t>(design->size()), 0.0);
    for (std::size_t c = 0; c < worths.size(); ++c)
      if (!gone[c]) worths[c] = design->gain(static_cast<Eigen::Index>(c)) / seconds(c, from);
    return worths;
  }

  std::optional<std::size_t> most_worth(const JointVector& from) const {
    const std::vector<double> worth = worths(from);
    const auto best = std::max_element(worth.begin(), worth.end());
    if (best == worth.end() || *best <= 0.0) return std::nullopt;
    return static_cast<std::size_t>(best - worth.begin());
  }

  /// The candidate that takes most off the error per second by its way, of those that are foremost
  /// by a guess; with that way.
  std::optional<std::size_t> most_worth_by_way(const JointVector& from) {
    std::vector<double> worth = worths(from);
    double most = 0.0;
    std::optional<std::size_t> found;
    for (int looked_at = 0; looked_at < kLookedAt;) {
      const auto next = std::max_element(worth.begin(), worth.end());
      if (next == worth.end() || *next <= 0.0) break;
      const auto c = static_cast<std::size_t>(next - worth.begin());
      *next = 0.0;
      if (!pool.connected(c)) {
        gone[c] = true;
        continue;
      }
      ++looked_at;
      Way way = way_to(c, from);
      if (!way) continue;
      const double s = at_place_s() + way_s(cell.robot, from, *way, pace);
      const double by_way = design->gain(static_cast<Eigen::Index>(c)) / s;
      if (by_way <= most) continue;
      most = by_way;
      found = c;
    }
    return found;
  }

  void put_away() {
    if (!offered) return;
    gone[*offered] = true;
    last = offered;
    offered.reset();
    planned.reset();
  }

  std::optional<std::size_t> pick(const JointVector& from) {
    while (!seeds.empty()) {
      const std::size_t c = seeds.front();
      if (!gone[c] && made(pool.candidates()[c].target) < least) return c;
      seeds.erase(seeds.begin());
    }
    if (!estimate) {  // a seed failed: any other touch of a target that has too few
      for (std::size_t c = 0; c < gone.size(); ++c)
        if (!gone[c] && made(pool.candidates()[c].target) < least && pool.connected(c)) return c;
      finish("some targets cannot be touched often enough for a first estimate");
      return std::nullopt;
    }
    if (const auto found = most_worth_by_way(from)) return found;
    return most_worth(from);  // no way leads from here: who plans it says so
  }

  /// The touch with its way from where the arm is.
  PlannedTouch planned_to(std::size_t c, TouchSet set, const JointVector& from) const {
    const Candidate& to = pool.candidates()[c];
    PlannedTouch touch = to_planned(cell, to, set, options);
    const Candidate* leaving = last ? &pool.candidates()[*last] : nullptr;
    Way way = way_to(c, from);
    if (!way)  // not for want of a way to this touch: it is connected
      throw PlanError(fmt::format(
          "no clear way from where the arm stands: on the way to its resting posture {}. "
          "Jog it free",
          words_or(pool.clearance().hit(from, pool.middle(), kTipMarginM),
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
               const JointVector& start, const Pace& pace, const std::vector<Touch>& made)
    : impl_(new Impl(cell, options, goal, start, pace, made)) {}
Online::~Online() = default;
Online::Online(Online&&) noexcept = default;
Online& Online::operator=(Online&&) noexcept = default;

std::optional<PlannedTouch> Online::next(const JointVector& where) {
  Impl& me = *impl_;
  const JointVector& from = where.empty() ? me.start : where;
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
      if (!me.progress.fitted) me.finish("every reachable touch was made");
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
  impl_->put_away();  // is not offered again either
  impl_->learn(touch);
}

void Online::failed() {
  const auto offered = impl_->offered;
  impl_->put_away();
  if (offered) {
    impl_->failed.push_back(*offered);
    impl_->forget_failed();
  }
  if (offered && impl_->progress.fitted)
    impl_->draw_check(impl_->pool.candidates()[*offered].target);
}

std::vector<JointVector> Online::way_home() const {
  const Impl& me = *impl_;
  if (!me.last) return {};
  return me.pool.router()
      .away(me.pool.candidates()[*me.last], me.start)
      .value_or(std::vector<JointVector>{});
}

const Progress& Online::progress() const { return impl_->progress; }
const std::vector<Touch>& Online::touches() const { return impl_->touches; }

}  // namespace cellcal::calib
