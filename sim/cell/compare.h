#pragma once
// A calibration compared with the hidden truth, in the figures of the method (section 5). The true
// arm is warmed up, as at the end of a session and afterwards.

#include "calib/model/joint_vector.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"
#include "sim/cell/truth.h"

namespace cellcal::sim {

/// Number of poses for the nominal model: large enough for the sampling error to be negligible.
inline constexpr int kNominalPoses = 5000;

struct RegionFigures {
  int poses = 0;
  double mean_m = 0.0, max_m = 0.0, rms_m = 0.0;  ///< 3-D, after a 6-DoF alignment
  /// Nominal model, aligned likewise, over more poses of the same region.
  double nominal_mean_m = 0.0, nominal_max_m = 0.0;
  double covered = 0.0;  ///< share of true errors within the stated u95: M4
};

struct TruthFigures {
  RegionFigures local;      ///< within 150 mm of the targets: M2
  RegionFigures workspace;  ///< random poses of the whole workspace: M3
};

/// Distances of the latched contacts from the true surfaces.
struct SurfaceFigures {
  double mean_m = 0.0, max_m = 0.0;
  int bad = 0;  ///< above kBadM: not explained by noise
};
inline constexpr double kBadM = 0.2e-3;

/// With the arm's warm-up starting at the first touch, since a file of touches does not contain the
/// power-on time.
SurfaceFigures surface_figures(const Truth& truth, const std::vector<calib::Touch>& touches);

/// `around`: the touches' joint angles, near which local poses are sampled.
TruthFigures truth_figures(const Truth& truth, const calib::Calibration& calibration,
                           const std::vector<calib::JointVector>& around);

}  // namespace cellcal::sim
