#pragma once
// A calibration against the hidden truth, in the figures of the method (section 5). True is the arm
// warmed up, as it is at the end of a session and afterwards.

#include "calib/model/joint_vector.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"
#include "sim/cell/truth.h"

namespace cellcal::sim {

/// Over which the nominal model is judged: so many that their draw says nothing.
inline constexpr int kNominalPoses = 5000;

struct RegionFigures {
  int poses = 0;
  double mean_m = 0.0, max_m = 0.0, rms_m = 0.0;  ///< 3-D, after a 6-DoF alignment
  /// The nominal model, aligned likewise, over more poses of the same region.
  double nominal_mean_m = 0.0, nominal_max_m = 0.0;
  double covered = 0.0;  ///< share of true errors within the stated u95: M4
};

struct TruthFigures {
  RegionFigures local;      ///< within 150 mm of the targets: M2
  RegionFigures workspace;  ///< random poses of the whole workspace: M3
};

/// How far the latched contacts are from the true surfaces.
struct SurfaceFigures {
  double mean_m = 0.0, max_m = 0.0;
  int bad = 0;  ///< by more than kBadM: no noise makes that
};
inline constexpr double kBadM = 0.2e-3;

/// Of the arm as warm as it was: it began to warm up with the first touch, since a file of touches
/// does not say when power came on.
SurfaceFigures surface_figures(const Truth& truth, const std::vector<calib::Touch>& touches);

/// `around`: joint angles near which local poses are taken, the touches'.
TruthFigures truth_figures(const Truth& truth, const calib::Calibration& calibration,
                           const std::vector<calib::JointVector>& around);

}  // namespace cellcal::sim
