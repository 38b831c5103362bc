#pragma once
// The obstacle between the predicted uncertainty and a goal: the source of the largest part of it, and for
// transmission errors the joint and the range of its angles.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"
#include "calib/model/parameter_key.h"
#include "calib/result/calibration.h"
#include "calib/words/phrase.h"

namespace cellcal::calib {

struct Missing {
  UncertaintySource source = UncertaintySource::kTouches;
  double share = 0.0;  ///< of the variance of the tip, mean over the region
  /// kTransmission: the joint with the largest part of it; kPlaces: the positioner's axis with most of it.
  std::string joint = {};
  double from_rad = 0.0, to_rad = 0.0;  ///< of its angles in the region, those with most of it
};

/// State of an estimate or a design after its touches, over a region.
struct Remainder {
  const std::vector<JointVector>& postures;  ///< of the region, at least one
  const Eigen::MatrixXd& moves_m;            ///< 3 postures x the first unknowns, per prior unit
  const Eigen::MatrixXd& covariance_u;       ///< of all unknowns, in prior units
  const std::vector<ParameterKey>& keys;     ///< of all unknowns
  const Eigen::VectorXd& prior_weight;       ///< likewise, 1 / prior sigma in prior units; 0: none
  double ripple_rad;                         ///< of every joint
};
Missing largest_part(const ArmModel& arm, const Remainder& left);

/// "31 % of what remains: transmission error of A3 from -20 to 35 deg, ..."
Phrase phrase_of(const Missing& missing);

}  // namespace cellcal::calib
