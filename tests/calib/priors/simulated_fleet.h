#pragma once
// Calibrations of arms with known spreads, as exact posteriors of touches to first order in the errors.

#include <vector>

#include "calib/model/linear.h"
#include "calib/model/robot.h"
#include "calib/priors/learn.h"
#include "calib/result/calibration.h"

namespace cellcal::calib::testing {

/// The demo's arm.
Robot drawn_robot();

/// Factors on the robot file's values, per joint; 1 if not listed.
struct Truth {
  std::vector<double> length, angle;
  double gear = 1.0;
};
/// The demo's arm with some joints tighter and some wider.
Truth uneven();

/// Touches of four spheres with unknown places. `stated`: the arm with the priors of its file; `drawn`: the arm whose
/// sigmas the truth's factors refer to.
Calibration calibration_of(const Robot& drawn, const Robot& stated, const Truth& truth, int touches,
                           Random& random);

std::vector<Calibration> fleet_of(int arms, const Truth& truth, int touches = 40,
                                  unsigned seed = 1);

/// Named "arm 000.json" and so on; those without evidence are omitted.
std::vector<ArmEvidence> evidence_of_all(const std::vector<Calibration>& calibrations);

/// The calibration with every error times this.
Calibration times(Calibration c, double factor);

const Spread& spread(const Learned& learned, std::size_t joint, SpreadKind kind);

}  // namespace cellcal::calib::testing
