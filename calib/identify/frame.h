#pragma once
// Directions in parameter space that no touch can tell: the choice of frame, not an error. Found
// numerically: singular directions of the whitened Jacobian of everything that was measured
// (touches, certified lengths, diameters, tip), without the tolerances.

#include <Eigen/Core>
#include <vector>

#include "calib/identify/calibration.h"
#include "calib/identify/problem.h"
#include "calib/identify/solve.h"

namespace cellcal::calib {

struct FrameDirections {
  Eigen::MatrixXd basis_u;  ///< size x k, orthonormal, prior units
  std::vector<UnidentifiableDirection> words;
  Eigen::VectorXd singular_values;  ///< of the measured Jacobian, prior units, ascending
};

FrameDirections find_frame_directions(const Problem& problem, const Linearisation& linear);

}  // namespace cellcal::calib
