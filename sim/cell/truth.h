#pragma once
// What the emulated cell is really like. Drawn once from a seed; the same on every machine.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "calib/model/kinematics.h"

namespace cellcal::sim {

struct TruthOptions {
  std::uint64_t seed = 1;
  double geometry_scale = 1.0;  ///< errors are drawn from the robot file's tolerances times this
  double deflection = -1.0;     ///< c_t [1/(N m^2)]; negative: drawn from its prior
  double gear_arcsec = 0.0;     ///< 1 sigma of each of two harmonics per joint
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
};

/// The cell file's centres are what an installer reads off the pendant with the tip at a sphere:
/// true for the arm as it is, errors and all. So the artefact is put, as one rigid body, where the
/// real arm reaches when it is sent to them. A sphere without a centre stands anywhere in its box.
/// Throws std::runtime_error when it cannot reach one.
Truth draw_truth(const calib::Cell& cell, const TruthOptions& options);

}  // namespace cellcal::sim
