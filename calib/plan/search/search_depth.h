#pragma once
// How deep a search for a sphere may go, and how likely it meets it.

#include <Eigen/Core>
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
};

/// The tip may go as far as the shaft stays clear of every sphere that the tip does not surely meet
/// first (by 5 mm: arms are off), as tip and shaft stay clear of every stand of such a sphere, and
/// no farther than there is anything to be met. `radius_m`: of the sphere.
SearchDepth search_depth(const SearchLine& line, const std::vector<Eigen::Vector3d>& places,
                         double radius_m, const SearchStand& stand, const Tool& tool);

}  // namespace cellcal::calib
