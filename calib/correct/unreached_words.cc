#include <fmt/format.h>

#include "calib/correct/corrector.h"
#include "calib/model/units.h"

namespace cellcal::calib {

std::string words(const NotReached& reason, const Robot& robot) {
  const auto joint = [&]() -> const Joint& {
    return robot.joints[static_cast<std::size_t>(reason.joint)];
  };
  switch (reason.why) {
    case Unreached::kNotANumber:
      return "not all numbers are finite";
    case Unreached::kTooFar:
      return "out of reach in this configuration, whatever the limits";
    case Unreached::kBeyondLimit: {
      const double limit = reason.joint_rad < joint().min_rad ? joint().min_rad : joint().max_rad;
      return fmt::format("{} would have to turn to {:.3f} deg, beyond its limit of {:.3f} deg",
                         joint().name, reason.joint_rad * kDegPerRad, limit * kDegPerRad);
    }
    case Unreached::kNearSingularity:
      return fmt::format(
          "near a singularity: {} would have to turn by {:.1f} deg to correct it. Move the point, "
          "or turn the tool",
          joint().name, reason.joint_rad * kDegPerRad);
  }
  return {};
}

std::string words(const FarCorrection& far) {
  return fmt::format(
      "{:.3f} {} correction of {}, at most {:.4g} {} with its tolerance of {:.3g} {}",
      far.correction, far.unit, far.parameter, far.most, far.unit, far.sigma, far.unit);
}

}  // namespace cellcal::calib
