// Plans for random cells, checked for collisions independently of the planner. Prints counts,
// reasons and the closest approach; fails on a collision.

#include <fmt/format.h>

#include <chrono>
#include <map>

#include "calib/plan/candidates.h"
#include "calib/plan/clearance.h"
#include "tests/calib/plan/random_cell.h"
#include "tests/command_line/command_line.h"

namespace {

using namespace cellcal::calib;  // NOLINT: an experiment's own file
using testing::Approach;
using testing::Nearest;

/// Guaranteed by the planner during moves; at stops it keeps its full margins.
constexpr double kTipM = kMarginKept * kTipMarginM, kBodyM = kMarginKept * 0.02;

/// Similar refusals are counted together; unexpected ones by their message.
std::string kind_of(const PlanError& refusal) {
  switch (refusal.kind) {
    case PlanError::Kind::kOutOfReach: return "a target is out of reach";
    case PlanError::Kind::kInTheWay:
      return refusal.target.empty() ? "something stands where the arm rests"
                                    : "something is in the way to a target";
    case PlanError::Kind::kTooFew: return "too few touches can be made";
    default: return refusal.what();
  }
}

void print(const char* what, const Nearest& nearest, const std::string& where) {
  fmt::print("closest approach of {:22s} {:6.2f} mm   {} ({})\n", what, nearest.gap_m * 1e3,
             nearest.words, where);
}

}  // namespace

int main(int argc, char** argv) {
  cellcal::CommandLine app{"Plans for random cells and looks whether anything is hit."};
  int cells = 1000, fit = 16, check = 4;
  unsigned seed = 1;
  bool verbose = false;
  app.option("--cells", cells, "Random cells").between(1, 1000000);
  app.option("--touches", fit, "Fit touches of each plan").between(1, 1000);
  app.option("--check", check, "Check touches of each plan").between(0, 1000);
  app.option("--seed", seed, "Of the first cell; the next has the next one");
  app.option("--verbose", verbose, "Print every refusal");
  if (const auto code = app.parse(argc, argv)) return *code;

  std::map<std::string, int> refused;
  Approach closest, wanting;  // wanting: guaranteed minus actual
  std::string tip_at, body_at, self_at;
  int planned = 0, moves = 0, near = 0, hits = 0;
  double planning_s = 0.0;
  for (int k = 0; k < cells; ++k) {
    const testing::RandomCell made =
        testing::random_cell(CELLCAL_ROBOTS_FOLDER, seed + static_cast<unsigned>(k));
    PlanOptions options;
    options.fit_touches = fit;
    options.check_touches = check;
    options.seed = seed + static_cast<unsigned>(k);
    const auto start = std::chrono::steady_clock::now();
    const auto took = [&] {
      return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    };
    Plan plan;
    try {
      plan = make_plan(made.cell, options);
      planning_s += took();
    } catch (const PlanError& error) {
      planning_s += took();
      ++refused[kind_of(error)];
      if (verbose) fmt::print("cell {}: {}: {}\n", seed + k, made.robot, error.what());
      continue;
    }
    ++planned;
    for (const PlannedTouch& touch : plan.touches)
      moves += static_cast<int>(touch.transit.size()) + 2;
    moves += static_cast<int>(plan.home.size());
    const Approach approach = testing::Collisions(made.cell).of(plan);
    const std::string where = fmt::format("cell {}, {}", seed + k, made.robot);
    if (approach.tip.gap_m < closest.tip.gap_m) tip_at = where;
    if (approach.body.gap_m < closest.body.gap_m) body_at = where;
    if (approach.self.gap_m < closest.self.gap_m) self_at = where;
    closest.take(approach);
    near += approach.tip.gap_m < kTipM;
    for (const Nearest* nearest : {&approach.tip, &approach.body, &approach.self})
      if (nearest->gap_m < 0.0) {
        ++hits;
        fmt::print("HIT: {}: {} by {:.2f} mm\n", where, nearest->words, -nearest->gap_m * 1e3);
      }
  }
  fmt::print("{} cells: {} planned ({} motions), {} refused\n", cells, planned, moves,
             cells - planned);
  for (const auto& [words, count] : refused) fmt::print("  {:5d}  {}\n", count, words);
  fmt::print("hits: {}; tip nearer than half its margin: {} plans\n", hits, near);
  if (planned > 0) {
    print("tip and cell", closest.tip, tip_at);
    print("arm, shaft and cell", closest.body, body_at);
    print("hand, tool and own arm", closest.self, self_at);
  }
  fmt::print("planning took {:.3f} s per cell\n", planning_s / cells);
  return hits > 0 ? 1 : 0;
}
