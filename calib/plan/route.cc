#include "calib/plan/route.h"

#include <ompl/base/MotionValidator.h>
#include <ompl/base/ProblemDefinition.h>
#include <ompl/base/SpaceInformation.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/datastructures/NearestNeighborsLinear.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "calib/model/inverse.h"
#include "calib/model/linear.h"
#include "calib/model/long_work.h"
#include "calib/plan/duration.h"

namespace cellcal::calib {

namespace {

constexpr double kHeightsM[] = {0.035, 0.06, 0.12, 0.25};  // above the top of the sphere
/// Around a sphere, halfway between two of its touches: distance of the tip from the centre,
/// relative to the clear points.
constexpr double kRound[] = {1.1, 1.35, 1.7};
/// Passes over all way-points of a path that pull them towards the straight one, and bisections of
/// each.
constexpr int kPulls = 2, kHalvings = 5;
/// Number of destinations tried for a pulled way-point.
constexpr int kPlaces = 16;
/// Consecutive failures of sampling before a target is given up.
constexpr int kMostFailed = 4;
/// Paths kept per target; more would be similar.
constexpr std::size_t kMostKept = 6;
constexpr std::size_t kLastStops = 2;  ///< of such a path, from which other touches are tried

std::vector<JointVector> joined(std::vector<JointVector> a, const std::vector<JointVector>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace

bool is_at(const JointVector& place, const JointVector& arm) {
  constexpr double kNear = 1e-4;
  return std::ranges::equal(place, arm,
                            [](double a, double b) { return std::abs(a - b) <= kNear; });
}

std::optional<JointVector> Router::above(const Candidate& candidate, double height_m,
                                         const JointVector& seed) const {
  const Target& target = cell_.targets[candidate.target];
  const Eigen::Vector3d up =
      target.kind == TargetKind::kPlane ? target.normal : stand_up(cell_.robot, target);
  Eigen::Isometry3d pose(candidate.orientation);
  pose.translation() = target.centre_m + (target.diameter_m / 2.0 + height_m) * up;
  return inverse(arm_, pose, seed, margin_rad_);
}

std::optional<JointVector> Router::around(const Candidate& leaving, const Candidate& to,
                                          double times) const {
  const Target& target = cell_.targets[to.target];
  const Eigen::Vector3d between = leaving.normal + to.normal;
  constexpr double kOpposite = 0.35;  // beyond 160 deg halfway is undefined
  if (between.norm() < kOpposite) return std::nullopt;
  const double clear_m = (arm_.nominal_tip_m(to.clear) - target.centre_m).norm();
  Eigen::Isometry3d pose(Eigen::Quaterniond(leaving.orientation)
                             .slerp(0.5, Eigen::Quaterniond(to.orientation))
                             .toRotationMatrix());
  pose.translation() = target.centre_m + times * clear_m * between.normalized();
  JointVector middle(to.clear);
  for (std::size_t i = 0; i < middle.size(); ++i)
    middle[i] = 0.5 * (leaving.clear[i] + to.clear[i]);
  return inverse(arm_, pose, middle, margin_rad_);
}

std::vector<JointVector> Router::shortened(const JointVector& from,
                                           std::vector<JointVector> way) const {
  for (int pull = 0; pull < kPulls; ++pull)
    for (std::size_t k = 0; k + 1 < way.size();) {
      poll_cancelled();
      const JointVector& before = k == 0 ? from : way[k - 1];
      const JointVector& behind = way[k + 1];
      if (clearance_.clear(before, behind)) {
        way.erase(way.begin() + static_cast<std::ptrdiff_t>(k));
        continue;
      }
      JointVector nearest = before;
      for (int i = 1; i <= kPlaces; ++i) {
        const JointVector at = interpolated(before, behind, static_cast<double>(i) / kPlaces);
        if (move_s(cell_.robot, way[k], at, {}) < move_s(cell_.robot, way[k], nearest, {}))
          nearest = at;
      }
      double clear = 0.0, too_far = 1.0;
      for (int i = 0; i < kHalvings; ++i) {
        const double middle = 0.5 * (clear + too_far);
        const JointVector at = interpolated(way[k], nearest, middle);
        (clear_chain(before, {at, behind}) ? clear : too_far) = middle;
      }
      way[k] = interpolated(way[k], nearest, clear);
      ++k;
    }
  return way;
}

bool Router::clear_chain(const JointVector& from, const std::vector<JointVector>& chain,
                         Known* known) const {
  const auto is_clear = [&](const JointVector& at, const JointVector& next) {
    poll_cancelled();
    if (known == nullptr) return clearance_.clear(at, next);
    for (const auto& one : *known)
      if (one.from == at && one.to == next) return one.clear;
    known->push_back({at, next, clearance_.clear(at, next)});
    return known->back().clear;
  };
  const JointVector* last = &from;
  for (const JointVector& next : chain) {
    if (!is_clear(*last, next)) return false;
    last = &next;
  }
  return true;
}

std::optional<std::vector<JointVector>> Router::simple_way(const JointVector& from,
                                                           const Candidate* leaving,
                                                           const Candidate& to) const {
  // Paths away from one sphere and towards the next.
  std::vector<std::vector<JointVector>> out = {{}}, in = {{to.standoff}};
  for (const double height : kHeightsM) {
    if (leaving != nullptr)
      if (const auto over = above(*leaving, height, from)) out.push_back({*over});
    if (const auto over = above(to, height, to.standoff)) {
      in.push_back({*over, to.standoff});
      in.push_back({*over, to.clear, to.standoff});
    }
  }
  std::vector<std::vector<JointVector>> ways;
  if (leaving != nullptr && leaving->target == to.target && from == leaving->clear)
    for (const double times : kRound)
      if (const auto round = around(*leaving, to, times)) {
        ways.push_back({*round, to.standoff});
        ways.push_back({*round, to.clear, to.standoff});
      }
  for (const auto& first : out)
    for (const auto& last : in) ways.push_back(joined(first, last));
  std::vector<std::pair<double, std::size_t>> fastest;
  for (std::size_t k = 0; k < ways.size(); ++k)
    fastest.emplace_back(way_s(cell_.robot, from, ways[k], {}), k);
  std::sort(fastest.begin(), fastest.end());
  Known known;  // paths share most of their moves
  for (const auto& [_, k] : fastest)
    if (clear_chain(from, ways[k], &known)) return ways[k];
  return std::nullopt;
}

std::optional<std::vector<JointVector>> Router::to_standoff(const JointVector& from,
                                                            const Candidate* leaving,
                                                            const Candidate& to) const {
  auto way = any_way(from, leaving, to);
  if (way) *way = shortened(from, std::move(*way));
  return way;
}

std::optional<std::vector<JointVector>> Router::any_way(const JointVector& from,
                                                        const Candidate* leaving,
                                                        const Candidate& to) const {
  if (auto way = simple_way(from, leaving, to)) return way;
  if (to.from_rest.empty()) return std::nullopt;
  // Via the resting posture: long, but known to be clear. Its first move is known to be clear from
  // the clear point only; the arm may be next to it.
  if (leaving != nullptr && !leaving->to_rest.empty() &&
      clearance_.clear(from, leaving->to_rest.front()))
    return joined(leaving->to_rest, to.from_rest);
  if (clearance_.clear(from, rest_)) return joined({rest_}, to.from_rest);
  if (!clearance_.clear(from)) return std::nullopt;
  if (!back_ || back_->from != from) back_ = Back{from, detour(from, rest_)};
  if (back_->way.empty()) return std::nullopt;
  return joined(back_->way, to.from_rest);
}

std::vector<JointVector> Router::detour(const JointVector& from, const JointVector& to) const {
  return find_detour(cell_.robot, clearance_, from, to, {.limit_margin_rad = margin_rad_}).way;
}

std::optional<std::vector<JointVector>> Router::sampled_way(const Candidate& to) const {
  Hard& hard = hard_[to.target];
  if (!hard.allowed) return std::nullopt;
  // Along a path to another touch of the same target, almost to its end: the remainder is short.
  for (const auto& known : hard.found)
    for (std::size_t stop = known.size(), tried = 0; stop-- > 0 && tried < kLastStops; ++tried) {
      const auto rest_of_way = simple_way(known[stop], nullptr, to);
      if (!rest_of_way) continue;
      return joined({known.begin(), known.begin() + static_cast<std::ptrdiff_t>(stop) + 1},
                    *rest_of_way);
    }
  if (hard.failed >= kMostFailed) return std::nullopt;
  auto way = detour(rest_, to.standoff);
  if (way.empty()) {
    ++hard.failed;
    return std::nullopt;
  }
  hard.failed = 0;
  if (hard.found.size() < kMostKept) hard.found.push_back(way);
  return way;
}

bool Router::connect(Candidate& candidate) const {
  auto in = simple_way(rest_, nullptr, candidate);
  if (!in) in = sampled_way(candidate);
  if (!in) return false;
  auto out = away(candidate, rest_);
  if (!out && clearance_.clear(candidate.clear, candidate.standoff)) {
    // Reverse of the approach.
    out = std::vector<JointVector>(in->rbegin(), in->rend());
    out->push_back(rest_);
  }
  if (!out) return false;
  candidate.from_rest = std::move(*in);
  candidate.to_rest = std::move(*out);
  return true;
}

std::optional<std::vector<JointVector>> Router::away(const Candidate& leaving,
                                                     const JointVector& to) const {
  std::vector<JointVector> chain = {to};
  if (clear_chain(leaving.clear, chain)) return chain;
  for (const double height : kHeightsM) {
    const auto over = above(leaving, height, leaving.clear);
    if (!over) continue;
    chain = {*over, to};
    if (clear_chain(leaving.clear, chain)) return chain;
  }
  if (leaving.to_rest.empty()) return std::nullopt;
  if (to == rest_) return leaving.to_rest;
  if (clearance_.clear(rest_, to)) return joined(leaving.to_rest, {to});
  return std::nullopt;
}

std::optional<std::vector<JointVector>> Router::to_rest(const Candidate& leaving) const {
  if (auto way = away(leaving, rest_)) return way;
  std::vector<JointVector> way = detour(leaving.clear, rest_);
  return way.empty() ? std::nullopt : std::optional(std::move(way));
}

namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;
using Values = ob::RealVectorStateSpace::StateType;

// Memory allocated by Eigen here is freed by OMPL, and vice versa.
static_assert(
    EIGEN_MALLOC_ALREADY_ALIGNED == 1,
    "Eigen would align memory otherwise than the OMPL of the distribution was built with; "
    "build without -march and -mavx");

/// Longest step of a tree in joint space: a sixth of a turn of one joint.
constexpr double kStepRad = 1.0;
constexpr double kLeastRangeRad = 1e-9;  // of a fixed joint: OMPL requires a positive range
/// Attempts to cut a corner, per waypoint.
constexpr int kCuts = 40;

JointVector joints_of(const ob::State* state, unsigned count) {
  const double* values = state->as<Values>()->values;
  return {values, values + count};
}

/// Uses this project's own generator: OMPL's can be seeded only once per process.
class Sampler final : public ob::StateSampler {
 public:
  Sampler(const ob::StateSpace* space, Random& random) : ob::StateSampler(space), random_(random) {}
  void sampleUniform(ob::State* state) override {
    const auto* space = space_->as<ob::RealVectorStateSpace>();
    const ob::RealVectorBounds& bounds = space->getBounds();
    for (unsigned i = 0; i < space->getDimension(); ++i)
      state->as<Values>()->values[i] = random_.uniform(bounds.low[i], bounds.high[i]);
  }
  // Required by planners that sample near a state; not used by this one.
  void sampleUniformNear(ob::State* state, const ob::State*, double) override {
    sampleUniform(state);
  }
  void sampleGaussian(ob::State* state, const ob::State*, double) override { sampleUniform(state); }

 private:
  Random& random_;
};

class Moves final : public ob::MotionValidator {
 public:
  Moves(ob::SpaceInformation* space, const Clearance& clearance)
      : ob::MotionValidator(space), clearance_(clearance) {}
  bool checkMotion(const ob::State* from, const ob::State* to) const override {
    const unsigned n = si_->getStateDimension();
    return clearance_.clear(joints_of(from, n), joints_of(to, n));
  }
  bool checkMotion(const ob::State* from, const ob::State* to,
                   std::pair<ob::State*, double>& last) const override {
    if (checkMotion(from, to)) return true;
    last.second = 0.0;
    if (last.first != nullptr) si_->copyState(last.first, from);
    return false;
  }

 private:
  const Clearance& clearance_;
};

/// Cuts corners: a clear move between two random points of the path replaces what lies between
/// them. `way` begins with its start.
void shorten(std::vector<JointVector>& way, const Clearance& clearance, Random& random) {
  const std::size_t cuts = kCuts * way.size();
  for (std::size_t k = 0; k < cuts && way.size() > 2; ++k) {
    poll_cancelled();
    const double last = static_cast<double>(way.size() - 1);
    double a = random.uniform(0.0, last), b = random.uniform(0.0, last);
    if (a > b) std::swap(a, b);
    const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
    if (i == j) continue;  // on the same move
    const JointVector from = interpolated(way[i], way[i + 1], a - static_cast<double>(i));
    const JointVector to =
        j + 1 < way.size() ? interpolated(way[j], way[j + 1], b - static_cast<double>(j)) : way[j];
    if (!clearance.clear(way[i], from) || !clearance.clear(from, to) ||
        (j + 1 < way.size() && !clearance.clear(to, way[j + 1])))
      continue;
    std::vector<JointVector> shorter(way.begin(), way.begin() + static_cast<std::ptrdiff_t>(i) + 1);
    shorter.push_back(from);
    shorter.push_back(to);
    shorter.insert(shorter.end(), way.begin() + static_cast<std::ptrdiff_t>(j) + 1, way.end());
    way = std::move(shorter);
  }
  // Removes waypoints that a straight move can skip.
  for (std::size_t i = 1; i + 1 < way.size();) {
    if (clearance.clear(way[i - 1], way[i + 1]))
      way.erase(way.begin() + static_cast<std::ptrdiff_t>(i));
    else
      ++i;
  }
}

}  // namespace

Detour find_detour(const Robot& robot, const Clearance& clearance, const JointVector& from,
                   const JointVector& to, const DetourOptions& options) {
  ompl::msg::setLogLevel(ompl::msg::LOG_NONE);
  Random random(options.seed);
  const auto n = static_cast<unsigned>(from.size());
  auto space = std::make_shared<ob::RealVectorStateSpace>(n);
  ob::RealVectorBounds bounds(n);
  for (unsigned i = 0; i < n; ++i) {
    const Joint& joint = robot.joints[i];
    const auto [low, high] = std::minmax(from[i], to[i]);
    const double most =
        i < first_wrist_joint(robot) ? std::numeric_limits<double>::max() : kWristRad;
    bounds.low[i] = std::min(std::max(joint.min_rad + options.limit_margin_rad, -most), low);
    bounds.high[i] = std::max(std::min(joint.max_rad - options.limit_margin_rad, most), high);
    bounds.high[i] = std::max(bounds.high[i], bounds.low[i] + kLeastRangeRad);
  }
  space->setBounds(bounds);
  space->setStateSamplerAllocator(
      [&random](const ob::StateSpace* of) { return std::make_shared<Sampler>(of, random); });
  auto information = std::make_shared<ob::SpaceInformation>(space);
  information->setStateValidityChecker(
      [&](const ob::State* state) { return clearance.clear(joints_of(state, n)); });
  information->setMotionValidator(std::make_shared<Moves>(information.get(), clearance));
  information->setup();

  auto problem = std::make_shared<ob::ProblemDefinition>(information);
  ob::ScopedState<ob::RealVectorStateSpace> start(space), goal(space);
  for (unsigned i = 0; i < n; ++i) {
    start[i] = from[i];
    goal[i] = to[i];
  }
  problem->setStartAndGoalStates(start, goal);
  og::RRTConnect planner(information);
  planner.setProblemDefinition(problem);
  planner.setRange(kStepRad);
  // Other structures choose their pivots with OMPL's own generator.
  planner.setNearestNeighbors<ompl::NearestNeighborsLinear>();
  planner.setup();
  Detour detour;
  planner.solve(ob::PlannerTerminationCondition(
      // Terminates by count, independent of any clock. Exceptions must not pass through OMPL.
      [&] { return ++detour.steps > options.most_steps || is_cancelled(); }));
  poll_cancelled();
  if (!problem->hasExactSolution()) return detour;
  std::vector<JointVector> way;
  for (const ob::State* state : problem->getSolutionPath()->as<og::PathGeometric>()->getStates())
    way.push_back(joints_of(state, n));
  shorten(way, clearance, random);
  // Verifies each move again, independent of its origin.
  for (std::size_t i = 1; i < way.size(); ++i)
    if (!clearance.clear(way[i - 1], way[i])) return detour;
  way.erase(way.begin());
  detour.way = std::move(way);
  return detour;
}

void round_corners(const Clearance& clearance, const JointVector& before, const JointVector& from,
                   PlannedTouch& touch) {
  touch.leaving = {};
  touch.corners.clear();
  if (touch.transit.empty()) return;
  if (!before.empty()) touch.leaving = clearance.corner(before, from, touch.transit.front());
  for (std::size_t i = 0; i < touch.transit.size(); ++i) {
    poll_cancelled();
    const JointVector& last = i == 0 ? from : touch.transit[i - 1];
    const JointVector& next = i + 1 < touch.transit.size() ? touch.transit[i + 1] : touch.end;
    touch.corners.push_back(clearance.corner(last, touch.transit[i], next));
  }
}

}  // namespace cellcal::calib
