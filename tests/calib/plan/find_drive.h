#pragma once
// Executes the searches of a Finder with a true arm.

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

/// A KR 10 R1100 on a table, with a slender tool and four spheres of 38.1 mm.
const Cell& small_cell();

/// Errors of the cell file as large as its sigma states, in every direction; values beyond 2.7
/// sigma, one in 15, are redrawn.
Cell as_rough_as_stated(Cell cell, double sigma_m, unsigned seed);

/// First contact of the true arm along the search line, if any: in steps, then bisected.
std::optional<Touch> search(const Cell& cell, const sim::Truth& truth, const PlannedTouch& line);

/// Distances of tip and shaft from the true spheres [m]; the tip's excludes the sphere searched
/// for.
struct SphereGaps {
  double tip_m = 1.0, shaft_m = 1.0;
};

/// During a straight move; the sphere `meant` may be touched by the tip.
void record_gaps(const Cell& cell, const sim::Truth& truth, const JointVector& from,
                 const JointVector& to, std::optional<std::size_t> meant, SphereGaps& nearest,
                 const std::vector<double>& positioner_rad = {});

struct Found {
  SphereGaps nearest;
  int touches = 0, misses = 0;
  bool done = false;          ///< all requested spheres are found
  bool began_inside = false;  ///< a search began inside its sphere
  /// At each search: number made, and predicted total.
  std::vector<std::pair<int, int>> progress{};
  std::vector<Touch> made{};
  Cell cell{};  ///< as located
};

/// Until the first `spheres` of the cell are found, with the positioner at these angles. Throws PlanError if
/// one is not.
Found drive(const Cell& cell, const sim::Truth& truth, bool all, std::size_t spheres,
            const std::vector<double>& positioner_rad = {});

}  // namespace cellcal::calib::testing
