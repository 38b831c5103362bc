#pragma once
// A cell as in its file and as it really is: a true arm, spheres at unmeasured positions, and the
// result of a touch.

#include <optional>
#include <vector>

#include "calib/model/linear.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/plan/plan.h"
#include "tests/experiments/true_arm.h"

namespace cellcal::experiments {

struct Stage {
  int spheres = 4;
  double touch_sigma_m = 0.03e-3;  ///< as in the cell file
  double noise_m = 0.03e-3;        ///< true value
  bool lengths = true;             ///< certified distances between all spheres,
  double longest_m = 1e3;          ///< no farther apart than this
  double rho_sigma_m = 0.3e-3;     ///< effective radius; 0: no prior either
  double outlier_share = 0.02;     ///< of the fit touches, off by 0.2 to 3 mm
  bool outliers_dropped = false;   ///< instead of being reported
  bool masses_stated = true;       ///< of the links, and how far the joints give, in the robot file
  double size = 1.0;               ///< of the cell, and of the tool's mass
  bool heavy_stated = true;        ///< counterbalance and stiffening gears, in the robot file
  TruthSettings truth;
};

/// Up to six spheres around the front of the arm, each cell slightly different.
calib::Cell make_cell(const calib::Robot& robot, const Stage& stage, calib::Random& random);

/// The cell as stated by the files.
calib::Cell as_filed(calib::Cell cell, const Stage& stage);

struct World {
  World(const calib::Cell& nominal, const Stage& stage, calib::Random& random);

  /// Empty if the search line misses the sphere. `beyond`: shares of the search line that are
  /// searched before its beginning and after its end. `moved_m`: displacement of the sphere.
  std::optional<calib::Touch> touch(const calib::PlannedTouch& planned, double warm, double beyond,
                                    calib::Random& random,
                                    const Eigen::Vector3d& moved_m = Eigen::Vector3d::Zero()) const;

  calib::Cell cell;  ///< as in its file
  TrueArm arm;
  std::vector<Eigen::Vector3d> centre_m;  ///< true; modified to move a sphere
  double rho_m = 0.0;

 private:
  Stage stage_;
};

/// Wider than a session's window, since the arms here are arbitrary.
inline constexpr double kBeyond = 0.5;

}  // namespace cellcal::experiments
