#pragma once
// The controller's own model of the arm, compared with the robot file's.
//
// A controller states its TCP together with the joint angles: R_k = B^-1 F(q_k) T, with the flange F
// by the controller's model, and constant $TOOL T and $BASE B. F is replaced by the nominal chain of
// the robot file, and T and B by those known, otherwise by least squares over the postures: what
// then differs from posture to posture is the model's, since no tool and no base does.
//
// Assumption: the arm is at rest, and the angles are the measured ones of the same instant. A few
// postures let T and B absorb a part of the difference: it is then stated too small, never too
// large.

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <span>

#include "calib/model/robot.h"
#include "calib/result/finding.h"
#include "calib/words/phrase.h"

namespace cellcal::calib {

struct StatedPose {
  JointVector joint_rad;
  Eigen::Isometry3d tcp = Eigen::Isometry3d::Identity();  ///< in the controller's $BASE
};

/// $TOOL (flange to TCP) and $BASE (in the robot's root), as far as they are known.
struct StatedFrames {
  std::optional<Eigen::Isometry3d> tool, base;
};

/// Three decimals of six angles are 0.05 mm at 2 m, and set-point and position at rest differ by up
/// to 0.005 deg. KUKA's measured models differ from the nominal one by half a millimetre and more.
inline constexpr double kModelLimitM = 0.3e-3;

struct ControllerModel {
  enum class Outcome {
    kNotStated,    ///< no posture with a TCP
    kUndecided,    ///< too few or too similar postures to tell a tool or base from the model
    kAgrees,       ///< within kModelLimitM
    kOtherFrames,  ///< the model agrees, $TOOL or $BASE is not the known one
    kDiffers
  };
  Outcome outcome = Outcome::kNotStated;
  std::size_t postures = 0;
  /// Largest distance of the TCPs, with T and B estimated. With the known ones instead where these
  /// agree, or nothing is decided; 0 if one of them is not known then.
  double worst_m = 0.0;
  JointVector worst_rad = {};                              ///< its posture
  std::optional<double> tool_off_m = {}, base_off_m = {};  ///< kOtherFrames: from the known ones
};

/// Throws std::invalid_argument if a posture has another number of joints.
ControllerModel compare_controller_model(const Robot& robot, std::span<const StatedPose> poses,
                                         const StatedFrames& known);

/// The figure first; what to do where it does not agree.
Phrase phrase(const ControllerModel& model, const Robot& robot);

/// Warning of a model that differs; none for all other outcomes.
std::optional<Finding> finding_of(const ControllerModel& model, const Robot& robot);

}  // namespace cellcal::calib
