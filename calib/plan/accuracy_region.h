#pragma once
// Region of interest: where accuracy is optimised by the choice of touches.

#include <Eigen/Core>
#include <string_view>
#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib {

struct AccuracyRegion {
  enum class Kind {
    kWorkspace,  ///< the whole workspace (region.h)
    kBox,        ///< tips inside a box along the base's axes
    kTargets,    ///< tips within 150 mm of a target, in postures similar to the touches'
    kTool,       ///< the tip relative to the flange, anywhere
    kPostures    ///< stated postures, as of a program's points
  };
  Kind kind = Kind::kWorkspace;
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero(), high_m = Eigen::Vector3d::Zero();  ///< box
  std::vector<JointVector> postures = {};  ///< of kPostures, at least kFewestPostures

  static constexpr std::size_t kFewestPostures = 3;
};

/// "workspace", "targets", "tcp", or "box:X,Y,Z,X,Y,Z" with two opposite corners in mm. Throws
/// PlanError with the reason.
AccuracyRegion parse_accuracy_region(std::string_view text);

/// About `count` postures of the region; `touches`: feasible touches. Throws PlanError if the arm
/// reaches almost none of the region.
std::vector<JointVector> accuracy_region_postures(const AccuracyRegion& region, const ArmModel& arm,
                                                  const std::vector<JointVector>& touches,
                                                  const std::vector<Eigen::Vector3d>& centres_m,
                                                  double limit_margin_rad, int count);

}  // namespace cellcal::calib
