#pragma once
// A true linear unit: a carriage on four wagons and two rails, with a form other than the
// estimator's.

#include <Eigen/Geometry>
#include <vector>

#include "calib/model/linear.h"
#include "calib/model/robot.h"

namespace cellcal::experiments {

struct TrackErrors {
  double scale = 0.3e-3;           ///< of the rack, of random sign
  double pitch_rad_m = 0.5e-3;     ///< of random sign
  double straightness_m = 0.2e-3;  ///< farthest of each rail from its straight line, both ways
  double direction_rad = 2e-3;     ///< 1 sigma: of the arm's foot against the travel
  double pinion_m = 0.01e-3;       ///< amplitude, once per turn of the pinion
};

class TrueTrack {
 public:
  TrueTrack(const calib::Joint& joint, const TrackErrors& errors, calib::Random& random);

  /// From the arm's foot to the base, at this position of the controller [m].
  Eigen::Isometry3d carriage(double position_m) const;

 private:
  /// Waves, and rails joined at an angle; [m] over [m].
  struct Rail {
    struct Wave {
      double amplitude, length, phase;
    };
    std::vector<Wave> waves;
    double joint = 0.0, bend = 0.0, level = 0.0, slope = 0.0, scale = 1.0;
    double raw(double s) const;
    double at(double s) const { return scale * (raw(s) - level - slope * s); }
  };
  static Rail make_rail(double least, double most, double straightness_m, calib::Random& random);

  Eigen::Matrix3d axes_;  ///< along, across, above
  double middle_, scale_, pitch_rad_m_, across_rad_, above_rad_, pinion_m_, pinion_phase_;
  Rail side_, left_, right_;
};

}  // namespace cellcal::experiments
