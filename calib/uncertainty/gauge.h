#pragma once
// Directions in parameter space that no touch can tell, found numerically from everything that was
// measured (touches, certified lengths, diameters, tip) without the tolerances, transmission and
// loads aside:
// - frame directions, which no touch anywhere could tell: they move the arm and the targets as one
//   body, or nothing at all. A choice of frame, not an error.
// - weak directions, which these touches do not tell but others would: there the tolerances decide,
//   and the bounds say so.

#include <Eigen/Core>
#include <vector>

#include "calib/problem/problem.h"
#include "calib/problem/solve.h"
#include "calib/result/calibration.h"
#include "calib/uncertainty/region.h"

namespace cellcal::calib {

struct FrameDirections {
  Eigen::MatrixXd basis_u;  ///< frame directions, size x k, orthonormal, prior units
  std::vector<UnidentifiableDirection> named;  ///< frame directions first, then weak ones
};

/// `stiff`: over the workspace (region.h), with a tool that does not bend; `moves_m`:
/// aligned(stiff).
FrameDirections find_frame_directions(const Problem& problem, const Linearisation& linear,
                                      const TipMoves& stiff, const Eigen::MatrixXd& moves_m);

}  // namespace cellcal::calib
