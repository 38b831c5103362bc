#pragma once
// Joint angles that bring the real TCP to a pose, by a calibration.
//
// Starts from the nominal arm's closed-form solution in the seed's posture and turns, followed by
// Newton's method on the calibrated arm with compliance, transmission and the bent tool. The result
// is verified by the calibrated forward kinematics to 1e-6 mm and 1e-7 deg; otherwise the reason is
// returned.
//
// Assumes that the calibrated arm is near the nominal one: no joint changes by more than kMostTurn,
// and the posture is the same. Poses near a singularity violate this.

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <variant>

#include "calib/model/hidden.h"
#include "calib/model/joint_vector.h"
#include "calib/model/robot.h"
#include "calib/result/calibration.h"
#include "calib/words/phrase.h"

namespace cellcal::calib {

/// Reason why a pose is not reached.
enum class Unreached {
  kNotANumber,
  kTooFar,           ///< no joint angles in this posture, regardless of limits
  kBeyondLimit,      ///< the named joint would exceed its limit
  kNearSingularity,  ///< the correction would turn a joint far, or change the posture
};

struct NotReached {
  Unreached why = Unreached::kTooFar;
  int joint = -1;          ///< kBeyondLimit, kNearSingularity: index of the joint
  double joint_rad = 0.0;  ///< required angle; kNearSingularity: required change
};

struct Reached {
  JointVector joint_rad;
  double off_m = 0.0, off_rad = 0.0;  ///< deviation of the real TCP from the pose
};

using Reach = std::variant<Reached, NotReached>;

/// "A3 would have to turn to 158.20 deg, beyond its limit of 158.00 deg"
Phrase phrase(const NotReached& reason, const Robot& robot);
/// In English, as in files.
std::string words(const NotReached& reason, const Robot& robot);

/// A correction beyond what the tolerances of robot and cell allow for any arm: the file was altered or belongs
/// to another arm.
struct FarCorrection {
  std::string parameter;  ///< as parameter_name() returns it
  std::string unit;
  double correction = 0.0, most = 0.0, sigma = 0.0;  ///< in `unit`; sigma: the tolerance
};
/// The largest of them, relative to its tolerance. In an update, joints may have been remastered and the tip knocked
/// since the tolerances were stated.
std::optional<FarCorrection> far_correction(const Calibration& calibration);
/// "29.412 mm correction of A3.d, at most 7 mm with its tolerance of 0.7 mm"
std::string words(const FarCorrection& far);

/// The calibration with another tool in place of the cell's first. The tool is taken as stiff and
/// exact as stated; the joints bear its load.
Calibration with_tool(Calibration calibration, const Tool& tool);

/// The calibration with that one of its cell's tools as the first, with what was found of it. Throws
/// std::out_of_range naming an unknown one.
Calibration with_tool(Calibration calibration, const std::string& id);

/// Everything on the flange: tool, and what it holds.
struct FlangeLoad {
  double mass_kg = 0.0;
  Eigen::Vector3d com_m = Eigen::Vector3d::Zero();  ///< flange frame
};
/// All tools of the cell together.
FlangeLoad load_of_tools(const Cell& cell);
/// The calibration with this load on the flange, in place of its tools' masses. TCP and bending of
/// the tools stay; the joints bear the load, and its bounds follow from those of their compliance.
Calibration with_load(Calibration calibration, const FlangeLoad& load);
/// The calibration with what the tools hold in this state of the cell file; empty: nothing. Throws
/// std::out_of_range naming an unknown one.
Calibration with_load(Calibration calibration, const std::string& state);

/// Owns its data. Thread-safe.
class Corrector {
 public:
  /// Maximum change of a joint from the nominal angles in Newton's method [rad].
  static constexpr double kMostTurn = 0.18;

  explicit Corrector(const Calibration& calibration);

  /// `tcp`: in the base frame. Returns the joint angles nearest to `seed` in whole turns, in its
  /// posture; for an arm without closed form the solution of Newton's method from the seed. A linear
  /// unit stays where the seed has it.
  Reach joints(const Eigen::Isometry3d& tcp, const JointVector& seed) const;
  /// Without a seed posture: the solution within the limits, over all postures, nearest to `near`
  /// in the sum of squares, its linear unit where `near` has it.
  Reach nearest(const Eigen::Isometry3d& tcp, const JointVector& near) const;
  /// Middle of the joint ranges.
  JointVector middle() const;

 private:
  struct Impl;
  Hidden<Impl> impl_;
};

}  // namespace cellcal::calib
