#pragma once
// Spheres found by a true arm: the searches of a Finder, made.

#include <optional>
#include <vector>

#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/plan/planned_touch.h"
#include "sim/cell/truth.h"

namespace cellcal::calib::testing {

/// A KR 16 R1610-2 with a probe of 300 mm above a table, and four spheres, the `first`, modulo four,
/// in front.
Cell table_cell(double diameter_m, double tip_radius_m, std::size_t first);

/// The cell file wrong by as much as its sigma says, in every direction; what lies beyond its
/// 2.7-fold, one in 15, is drawn again.
Cell honestly_rough(Cell cell, double sigma_m, unsigned seed);

/// Along the search line, what the true arm meets first, if anything: in steps, then halved.
std::optional<Touch> search(const Cell& cell, const sim::Truth& truth, const PlannedTouch& line);

/// How near tip and shaft come to the true spheres [m]; the tip not to the one that it searches.
struct SphereGaps {
  double tip_m = 1.0, shaft_m = 1.0;
};

/// On a straight move; the sphere `meant` may be touched by the tip.
void look(const Cell& cell, const sim::Truth& truth, const JointVector& from, const JointVector& to,
          std::optional<std::size_t> meant, SphereGaps& nearest);

struct Found {
  SphereGaps nearest;
  int touches = 0, misses = 0;
  bool done = false;          ///< all that were to be found are
  bool began_inside = false;  ///< a search began inside its sphere
  /// At each search: made so far, and foreseen in all.
  std::vector<std::pair<int, int>> progress{};
  Cell cell{};  ///< as located
};

/// Until the first `spheres` of the cell are found. Throws PlanError where one is not.
Found drive(const Cell& cell, const sim::Truth& truth, bool all, std::size_t spheres);

}  // namespace cellcal::calib::testing
