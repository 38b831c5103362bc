#pragma once
// True state of the emulated cell. Drawn once from a seed; identical on every platform.

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/model/robot.h"

namespace cellcal::sim {

// Distance before the surface at which the circuit closes. Real contacts scatter (film, roughness,
// spatter), and occasionally a chip lies between tip and sphere.
//
// The scatter is drawn for every closing. A chip exists for one visit of the tip, from its approach
// until it has left. Half of the chips stay for all contacts of the visit, half fall off at the
// first one.

struct ContactScatter {
  double noise_m = 0.0;    ///< 1 sigma of each closing
  double bad_share = 0.0;  ///< of the visits, with a chip of 0.3 to 1 mm
};

/// Larger noise would extend from one closing into the next: searches back off by 0.6 mm.
inline constexpr double kMostContactNoiseM = 1e-4;

class EarlyContact {
 public:
  EarlyContact(const ContactScatter& scatter, std::uint64_t seed);

  /// The circuit is closed at gaps up to this [m]. Negative: late.
  double closing_gap_m() const { return noise_m_ + chip_m_; }
  /// Current gap of the tip, and state of the circuit.
  void update(double gap_m, bool closed);

 private:
  double noise();
  void begin_visit();

  ContactScatter scatter_;
  calib::Random random_;
  double noise_m_ = 0.0, chip_m_ = 0.0;
  bool falls_off_ = false;
  bool near_ = true;      ///< this visit's chip is drawn after the tip was away
  bool touched_ = false;  ///< closed since the last draw of the noise
};

struct TruthOptions {
  std::uint64_t seed = 1;
  double geometry_scale = 1.0;  ///< scale of the robot file's tolerances for drawing errors
  double deflection = -1.0;     ///< c_t [1/(N m^2)]; negative: drawn from its prior
  double gear_arcsec = 0.0;     ///< 1 sigma of each of two harmonics per joint
  /// Six waves of random orders from 5 to 35 per turn of each joint, as strain-wave gears have; rms of all, 1 sigma.
  double wave_arcsec = 0.0;
  /// 1 sigma of each joint's compliance; 0: the robot file's. If the file states no masses the
  /// links get some (physical_cell.h).
  double compliance_rad_per_nm = 0.0;
  double play_arcsec = 0.0;   ///< half of the play, in the direction of the load; 1 sigma
  double tip_offset_m = 0.0;  ///< maximum deviation from the cell file's tip, per component
  /// Shift of the tip on the flange after the spheres' places were taught: a knock.
  Eigen::Vector3d tool_shift_m = Eigen::Vector3d::Zero();
  std::optional<calib::Load> held{};  ///< by the tools, once the spheres' places were taught
  double growth = 0.0;                ///< relative growth of all the arm's lengths, warmed up
  double warm_up_s = 60.0;            ///< time constant of the warm-up
  ContactScatter contacts{};
  /// Deviation of the artefact from its taught place, as a rigid body, 1 sigma.
  double placement_m = 0.001;
  double placement_rad = 0.001;
};

/// Face of a plate: the cell's planes with stated extent.
struct TrueFace {
  Eigen::Vector3d middle_m, normal;  ///< true base frame, towards the tips
  double reach_m = 0.0;              ///< radius of the plate
  double tip_radius_m = 0.0;
};

struct Truth {
  calib::ArmModel arm;     ///< with gears added if requested
  Eigen::VectorXd errors;  ///< true values of arm.parameters()
  /// Per target of the cell, in the true frame of the positioner's axis that carries it, else the
  /// true base frame.
  std::vector<Eigen::Vector3d> centre_m;
  std::vector<double> radius_m;  ///< true radius of each sphere plus tip; 0 for other kinds
  std::vector<TrueFace> faces{};
  std::vector<int> carried_by{};  ///< calib::Target::carried_by of each
  std::optional<calib::Load> held{};
  double growth = 0.0, warm_up_s = 60.0;  ///< as in TruthOptions; `errors` are the cold arm's
  ContactScatter contacts{};
  std::uint64_t contact_seed = 0;

  /// Warm-up state at this time after power on: 0 to 1.
  double warm_at(double seconds) const;
};

/// The cell file's centres are taught by an installer with the tip at a sphere: correct for the arm
/// including its errors. The artefact is therefore placed, as one rigid body, where the real arm
/// arrives when commanded to them. A sphere without a centre is anywhere in its box. Throws
/// std::runtime_error if a centre is out of reach. What a positioner's axis carries is one more rigid body,
/// taught with its axes at 0 or as near as their limits allow.
Truth draw_truth(const calib::Cell& cell, const TruthOptions& options);

/// The robot file with the true, cold lengths and angles: what KUKA measures and gives to a
/// controller for absolute accuracy.
calib::Robot measured_robot(const Truth& truth);

/// The posture with the carriage of a linear unit opposite to the place [m, base], and the arm's first
/// axis towards it, inside the limits.
calib::JointVector facing(const calib::Robot& robot, calib::JointVector posture,
                          const Eigen::Vector3d& place_m);

}  // namespace cellcal::sim
