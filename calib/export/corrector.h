#pragma once
// Joint angles that bring the real TCP to a pose, by a calibration.
//
// The nominal arm's angles in closed form, in the seed's posture and turns; from there Newton on the
// calibrated arm, with compliance, transmission and the bent tool in it. What is returned was put
// into the calibrated arm once more: the TCP is there to 1e-6 mm and 1e-7 deg, or it is said why not.
//
// Assumes that the calibrated arm is near the nominal one: no joint is turned by more than
// kMostTurn, and the posture stays. Where it is not, the pose lies by a singularity.

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "calib/model/joint_vector.h"
#include "calib/model/robot.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Why a pose is not reached.
enum class Unreached {
  kNotANumber,
  kTooFar,           ///< no joint angles whatever their limits, in this posture
  kBeyondLimit,      ///< the joint that is named had to turn beyond its limit
  kNearSingularity,  ///< the correction would turn a joint far, or change the posture
};

struct NotReached {
  Unreached why = Unreached::kTooFar;
  int joint = -1;          ///< kBeyondLimit, kNearSingularity: which
  double joint_rad = 0.0;  ///< how far it had to turn to; kNearSingularity: by how much
};

struct Reached {
  JointVector joint_rad;
  double off_m = 0.0, off_rad = 0.0;  ///< of the real TCP from the pose, forward
};

using Reach = std::variant<Reached, NotReached>;

/// "A3 would have to turn to 158.20 deg, beyond its limit of 158.00 deg"
std::string words(const NotReached& reason, const Robot& robot);

/// A correction that the tolerances of robot and cell do not let one expect of any arm: of an altered file, or of
/// another arm.
struct FarCorrection {
  std::string parameter;  ///< as parameter_name() has it
  std::string unit;
  double correction = 0.0, most = 0.0, sigma = 0.0;  ///< in `unit`; sigma: the tolerance
};
/// The farthest of them. Of an update joints may have been mastered and the tip been knocked since the tolerances were
/// stated.
std::optional<FarCorrection> far_correction(const Calibration& calibration);
/// "29.412 mm correction of A3.d, at most 7 mm with its tolerance of 0.7 mm"
std::string words(const FarCorrection& far);

/// The calibration with another tool in place of the cell's first, which is taken as stiff and as
/// exact as it is stated; what the joints bear is its.
Calibration with_tool(Calibration calibration, const Tool& tool);

/// Holds its own copies. Safe to share among threads.
class Corrector {
 public:
  /// Newton does not turn a joint further than this from the nominal angles [rad].
  static constexpr double kMostTurn = 0.18;

  explicit Corrector(const Calibration& calibration);
  ~Corrector();
  Corrector(Corrector&&) noexcept;

  /// `tcp`: in the base frame. The joints that are nearest to `seed` in whole turns, in its posture;
  /// of an arm without closed form those that Newton finds from it.
  Reach joints(const Eigen::Isometry3d& tcp, const JointVector& seed) const;
  /// Without a seed: of all postures inside the limits the one that is nearest to `near` in the sum
  /// of squares.
  Reach nearest(const Eigen::Isometry3d& tcp, const JointVector& near) const;
  /// The middle of all joints' ranges.
  JointVector middle() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::calib
