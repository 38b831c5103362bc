#pragma once
// Touches of a simulated cell with a known truth.

#include <vector>

#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/plan/planned_touch.h"
#include "sim/cell/truth.h"

namespace cellcal::calib::testing {

/// The demo cell: a KR 5 and four spheres with certified lengths.
const Cell& demo_cell();
/// The demo cell with its first sphere only.
const Cell& one_sphere_cell();
/// The demo cell with tracker "T1" in place of its spheres.
Cell tracker_cell(double sigma_m = demo_cell().touch_sigma_m);

struct Making {
  int fit = 60;
  int check = 0;               ///< approximate number, distributed evenly over the targets
  double noise_m = 3e-5;       ///< 1 sigma along the normal (per component for points)
  double rho_m = 0.0;          ///< distance outside the surface at which the circuit closes
  double outlier_share = 0.0;  ///< of the fit touches, off by 0.5 to 20 mm in either direction
  double widest_rad = 3.2;     ///< largest angle of touch normals to vertical
  double cone_rad = 0.7;       ///< largest angle of the tool's shaft to the inward normal
  /// Latch delay, by which a touch of a sphere reads too deep, times its speed.
  double delay_s = 0.0;
  double speed_m_s = 0.0;       ///< stated with each touch; 0: not
  double slow_speed_m_s = 0.0;  ///< of every eighth touch, for each target in turn; 0: none
  unsigned seed = 1;
};

struct Made {
  std::vector<Touch> touches;  ///< fit and check touches mixed, targets in turn
  std::vector<std::size_t> outliers;
};

/// Throws std::runtime_error when a target is out of reach.
Made make_touches(const Cell& cell, const sim::Truth& truth, const Making& making);

/// Touches of a plan, whose postures the true arm takes to the true spheres. Of `making` count noise, rho, outliers and
/// seed. Throws std::runtime_error for a touch out of reach, and for a target that is no sphere.
Made make_touches(const Cell& cell, const sim::Truth& truth, const Plan& plan,
                  const Making& making);

/// Truth of a cell whose file is exact except for the estimated values.
sim::Truth plain_truth(const Cell& cell, std::uint64_t seed);

/// Value of the true arm's parameter, 0 where it has none.
double true_value(const sim::Truth& truth, const ParameterKey& key);

}  // namespace cellcal::calib::testing
