#pragma once
// A real arm, computed without any of the estimator's code: 4 x 4 matrices, torques on the true
// geometry, gears as functions of the axis angle.

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <vector>

#include "calib/model/linear.h"
#include "calib/model/robot.h"
#include "tests/experiments/true_track.h"

namespace cellcal::experiments {

enum class Gears {
  kNone,
  kHarmonics,  ///< orders 1 and 2 of the axis angle
  kSpectrum,   ///< orders 1 to 5 falling off, one fast order per joint, and load-dependent backlash
  kWaves,      ///< of strain-wave gears: six waves of 5 to 35 periods per turn and two slow ones
  kMixed,      ///< per joint: nothing, waves, one with flat halves, or one that decays from a spot
};

struct TruthSettings {
  double length_sigma_m = 0.7e-3;
  double angle_sigma_rad = 0.6e-3;
  /// Factors on both, per joint; empty: 1.
  std::vector<double> length_factor = {}, angle_factor = {};
  double compliance_rad_per_nm = 1e-5;  ///< 1 sigma of |k| at the three loaded joints; 0: stiff
  Gears gears = Gears::kHarmonics;
  double gear_arcsec = 10.0;     ///< rms per joint over a revolution
  double tip_offset_m = 0.5e-3;  ///< at most, per component; not in the cell file
  double growth = 25e-6;         ///< of all lengths over the session (2 K of aluminium and steel)
  /// Play of the three loaded joints, to the side of the load; it yields over some 100 N m.
  double play_arcsec = 0.0;
  /// Largest torque of a gas spring between column and link arm, compressed when the link arm leans;
  /// 0: none.
  double spring_nm = 0.0;
  /// The three loaded gears: additional compliance at low load, 1 sigma.
  double soft_rad = 0.0;
  /// A tip error that no joint explains: smooth in the posture, rms of each component, and its
  /// correlation length (in each of the first three axes; three times that in the wrist's).
  double field_m = 0.0, field_reach_rad = 0.6;
  TrackErrors track = {};  ///< of the linear unit that carries the arm, if any
};

/// Amplitude [rad] times the sine of order q + phase.
struct GearWave {
  double order, amplitude, phase;
};

class TrueArm {
 public:
  TrueArm(const calib::Cell& cell, const TruthSettings& settings, calib::Random& random);

  /// TCP [m, base]; `warm` from 0 (begin of the session) to 1 (end).
  Eigen::Vector3d tip(const std::vector<double>& q, double warm = 0.5) const;

  /// Waves of a joint's gear, except for Gears::kMixed.
  const std::vector<GearWave>& waves(std::size_t joint) const { return waves_[joint]; }

  // Later changes.
  void knock(const Eigen::Vector3d& shift_m) { tcp_ += shift_m; }  ///< the tool; flange frame
  void slip(std::size_t joint, double by_rad) {
    joints_[joint].offset += joints_[joint].sign * by_rad;
  }
  /// Everything on the flange.
  void carry(double mass_kg, const Eigen::Vector3d& com_m) {
    c_t_ *= mass_kg > 0.0 ? tool_mass_ / mass_kg : 0.0;  // the tool bends by its own mass
    tool_mass_ = mass_kg;
    tool_com_ = com_m;
  }
  void grow(double share) { grown_ += share; }  ///< of all lengths

 private:
  Eigen::Matrix4d link(std::size_t i, double theta, double warm) const;
  /// In the frame of the foot.
  Eigen::Vector3d tip_from_foot(const std::vector<double>& q, const Eigen::Vector3d& gravity,
                                double warm) const;

  struct Joint {
    double sign, offset, d, a, alpha, beta, stiffness, mass;
    Eigen::Vector3d com;
    std::function<double(double q, double torque)> gear;
    std::function<double(double q)> spring_nm;
  };
  struct Wave {  ///< of the field
    Eigen::Vector3d along;
    std::vector<double> by_axis;
    double phase;
  };
  std::vector<Joint> joints_;
  std::vector<std::vector<GearWave>> waves_;
  std::vector<Wave> field_;
  std::optional<TrueTrack> track_;
  Eigen::Vector3d tcp_, tool_com_, gravity_;
  double tool_mass_, tool_length_, c_t_, growth_, grown_ = 0.0;
};

}  // namespace cellcal::experiments
