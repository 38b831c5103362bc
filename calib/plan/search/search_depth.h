#pragma once
// How deep a search for a sphere may go, and how likely it meets it.

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "calib/model/robot.h"

namespace cellcal::calib {

struct SearchLine {
  Eigen::Vector3d aim_m;   ///< a point that the line goes through, base frame
  Eigen::Vector3d normal;  ///< unit, against the direction of search
  Eigen::Vector3d shaft;   ///< unit, from the shaft's end to the tip
};

/// What the sphere stands on: a post straight below its centre, however long.
struct SearchStand {
  Eigen::Vector3d up;     ///< unit
  double radius_m = 0.0;  ///< 0: none
};

struct SearchDepth {
  double end_m = 0.0;  ///< of the tip, from the aim along the normal; negative: behind it
  double share = 0.0;  ///< of the places whose sphere the tip meets before
  /// Of each place, where the tip meets it, from the aim along the normal; kNeverM: not before the
  /// end.
  std::vector<double> met_m{};
};

inline constexpr double kNeverM = -std::numeric_limits<double>::max();

/// The tip may go as far as the shaft stays clear of every sphere that the tip does not surely meet
/// first (by 5 mm: arms are off), as tip and shaft stay clear of every stand of such a sphere, and
/// no farther than there is anything to be met. `radius_m`: of the sphere.
SearchDepth search_depth(const SearchLine& line, const std::vector<Eigen::Vector3d>& places,
                         double radius_m, const SearchStand& stand, const Tool& tool);

/// How much of the variance of the centre [m^2, sum of three components] the outcome of the search
/// is expected to take away, contact and its depth or none, where depths are off by `sigma_m`.
double told_m2(const SearchDepth& depth, const std::vector<Eigen::Vector3d>& places,
               double sigma_m);

}  // namespace cellcal::calib
