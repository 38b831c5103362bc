#include "calib/plan/reach/detour.h"

#include <ompl/base/MotionValidator.h>
#include <ompl/base/ProblemDefinition.h>
#include <ompl/base/SpaceInformation.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/datastructures/NearestNeighborsLinear.h>
#include <ompl/geometric/PathGeometric.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>

#include <algorithm>
#include <limits>
#include <memory>

#include "calib/model/long_work.h"
#include "calib/model/random.h"
#include "calib/plan/reach/candidates.h"

namespace cellcal::calib {

namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;
using Values = ob::RealVectorStateSpace::StateType;

// What Eigen allocates here OMPL frees, and the other way round.
static_assert(
    EIGEN_MALLOC_ALREADY_ALIGNED == 1,
    "Eigen would align memory otherwise than the OMPL of the distribution was built with; "
    "build without -march and -mavx");

/// Longest step of a tree in joint space: a sixth of a turn of one joint.
constexpr double kStepRad = 1.0;
constexpr double kLeastRangeRad = 1e-9;  // of a joint that is held: OMPL wants some
/// Attempts to cut a corner, per waypoint.
constexpr int kCuts = 40;

JointVector joints_of(const ob::State* state, unsigned count) {
  const double* values = state->as<Values>()->values;
  return {values, values + count};
}

/// Draws by this project's own generator: OMPL's can be seeded only once in a process.
class Sampler final : public ob::StateSampler {
 public:
  Sampler(const ob::StateSpace* space, Random& random) : ob::StateSampler(space), random_(random) {}
  void sampleUniform(ob::State* state) override {
    const auto* space = space_->as<ob::RealVectorStateSpace>();
    const ob::RealVectorBounds& bounds = space->getBounds();
    for (unsigned i = 0; i < space->getDimension(); ++i)
      state->as<Values>()->values[i] = random_.uniform(bounds.low[i], bounds.high[i]);
  }
  // Of planners that sample about a state; this one does not.
  void sampleUniformNear(ob::State* state, const ob::State*, double) override {
    sampleUniform(state);
  }
  void sampleGaussian(ob::State* state, const ob::State*, double) override { sampleUniform(state); }

 private:
  Random& random_;
};

class Moves final : public ob::MotionValidator {
 public:
  Moves(ob::SpaceInformation* space, const Clearance& clearance, double margin_m)
      : ob::MotionValidator(space), clearance_(clearance), margin_m_(margin_m) {}
  bool checkMotion(const ob::State* from, const ob::State* to) const override {
    const unsigned n = si_->getStateDimension();
    return clearance_.clear(joints_of(from, n), joints_of(to, n), margin_m_);
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
  double margin_m_;
};

JointVector on_the_way(const JointVector& a, const JointVector& b, double share) {
  JointVector q(a.size());
  for (std::size_t i = 0; i < q.size(); ++i) q[i] = a[i] + share * (b[i] - a[i]);
  return q;
}

/// Cuts corners: a clear move between two places on the way, drawn at random, replaces what lies
/// between them. `way` begins with where it starts.
void shorten(std::vector<JointVector>& way, const Clearance& clearance, double margin_m,
             Random& random) {
  const std::size_t cuts = kCuts * way.size();
  for (std::size_t k = 0; k < cuts && way.size() > 2; ++k) {
    poll_cancelled();
    const double last = static_cast<double>(way.size() - 1);
    double a = random.uniform(0.0, last), b = random.uniform(0.0, last);
    if (a > b) std::swap(a, b);
    const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
    if (i == j) continue;  // on one move already
    const JointVector from = on_the_way(way[i], way[i + 1], a - static_cast<double>(i));
    const JointVector to =
        j + 1 < way.size() ? on_the_way(way[j], way[j + 1], b - static_cast<double>(j)) : way[j];
    if (!clearance.clear(way[i], from, margin_m) || !clearance.clear(from, to, margin_m) ||
        (j + 1 < way.size() && !clearance.clear(to, way[j + 1], margin_m)))
      continue;
    std::vector<JointVector> shorter(way.begin(), way.begin() + static_cast<std::ptrdiff_t>(i) + 1);
    shorter.push_back(from);
    shorter.push_back(to);
    shorter.insert(shorter.end(), way.begin() + static_cast<std::ptrdiff_t>(j) + 1, way.end());
    way = std::move(shorter);
  }
  // Waypoints that a straight move leaves out.
  for (std::size_t i = 1; i + 1 < way.size();) {
    if (clearance.clear(way[i - 1], way[i + 1], margin_m))
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
    const double most = i < kFirstWristJoint ? std::numeric_limits<double>::max() : kWristRad;
    bounds.low[i] = std::min(std::max(joint.min_rad + options.limit_margin_rad, -most), low);
    bounds.high[i] = std::max(std::min(joint.max_rad - options.limit_margin_rad, most), high);
    bounds.high[i] = std::max(bounds.high[i], bounds.low[i] + kLeastRangeRad);
  }
  space->setBounds(bounds);
  space->setStateSamplerAllocator(
      [&random](const ob::StateSpace* of) { return std::make_shared<Sampler>(of, random); });
  auto information = std::make_shared<ob::SpaceInformation>(space);
  information->setStateValidityChecker([&](const ob::State* state) {
    return clearance.clear(joints_of(state, n), options.tip_margin_m);
  });
  information->setMotionValidator(
      std::make_shared<Moves>(information.get(), clearance, options.tip_margin_m));
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
  // Others choose their pivots with OMPL's own generator.
  planner.setNearestNeighbors<ompl::NearestNeighborsLinear>();
  planner.setup();
  Detour detour;
  planner.solve(ob::PlannerTerminationCondition(
      // By count: no clock comes in. Nothing is thrown through OMPL.
      [&] { return ++detour.steps > options.most_steps || is_cancelled(); }));
  poll_cancelled();
  if (!problem->hasExactSolution()) return detour;
  std::vector<JointVector> way;
  for (const ob::State* state : problem->getSolutionPath()->as<og::PathGeometric>()->getStates())
    way.push_back(joints_of(state, n));
  shorten(way, clearance, options.tip_margin_m, random);
  // Each move once more, whoever made it.
  for (std::size_t i = 1; i < way.size(); ++i)
    if (!clearance.clear(way[i - 1], way[i], options.tip_margin_m)) return detour;
  way.erase(way.begin());
  detour.way = std::move(way);
  return detour;
}

}  // namespace cellcal::calib
