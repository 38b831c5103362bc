#pragma once
// A way-point that need not be visited.

namespace cellcal::calib {

/// Shares of the leg that leads to a way-point and of the one that leads on. Between the points on
/// the legs that are this far from it and the way-point itself (their triangle, in joint space) the
/// arm may go as it likes. 0: it has to go to the way-point.
struct Corner {
  double in_share = 0.0, out_share = 0.0;
};
inline constexpr double kMostCornerShare = 0.5;

}  // namespace cellcal::calib
