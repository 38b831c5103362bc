#pragma once
// What the emulated cell is really like. Drawn once from a seed; the same on every machine.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "calib/model/kinematics.h"
#include "sim/cell/early_contact.h"

namespace cellcal::sim {

struct TruthOptions {
  std::uint64_t seed = 1;
  double geometry_scale = 1.0;  ///< errors are drawn from the robot file's tolerances times this
  double deflection = -1.0;     ///< c_t [1/(N m^2)]; negative: drawn from its prior
  double gear_arcsec = 0.0;     ///< 1 sigma of each of two harmonics per joint
  /// 1 sigma of how much each joint gives under its load; 0: the robot file's. Where the file
  /// states no masses the links get some (true_load.h).
  double compliance_rad_per_nm = 0.0;
  double play_arcsec = 0.0;   ///< half of it, to the side that the load presses to; 1 sigma
  double tip_offset_m = 0.0;  ///< from where the cell file has the tip, at most, per component
  /// Of the tip on the flange once the spheres stand and their places are taught: a knock.
  Eigen::Vector3d tool_shift_m = Eigen::Vector3d::Zero();
  double growth = 0.0;        ///< of all lengths of the arm, warmed up
  double warm_up_s = 60.0;  ///< time constant of that
  ContactScatter contacts{};
  /// How far the artefact stands from where its places were taught, as a whole, 1 sigma.
  double placement_m = 0.001;
  double placement_rad = 0.001;
};

/// The face of a plate: the cell's planes whose extent is stated.
struct TrueFace {
  Eigen::Vector3d middle_m, normal;  ///< true base frame, to the side of the tips
  double reach_m = 0.0;              ///< radius of the plate
  double tip_radius_m = 0.0;
};

struct Truth {
  calib::ArmModel arm;                    ///< with gears added where asked for
  Eigen::VectorXd errors;                 ///< true values of arm.parameters()
  std::vector<Eigen::Vector3d> centre_m;  ///< per target of the cell, true base frame
  std::vector<double> radius_m;  ///< true radius of each sphere plus tip; 0 for other kinds
  std::vector<TrueFace> faces{};
  double growth = 0.0, warm_up_s = 60.0;  ///< as in TruthOptions; `errors` are the cold arm's
  ContactScatter contacts{};
  std::uint64_t contact_seed = 0;

  /// How warm the arm is so long after power on: 0 to 1.
  double warm_at(double seconds) const;
};

/// The cell file's centres are what an installer reads off the pendant with the tip at a sphere:
/// true for the arm as it is, errors and all. So the artefact is put, as one rigid body, where the
/// real arm reaches when it is sent to them. A sphere without a centre stands anywhere in its box.
/// Throws std::runtime_error when it cannot reach one.
Truth draw_truth(const calib::Cell& cell, const TruthOptions& options);

}  // namespace cellcal::sim
