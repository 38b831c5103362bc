#pragma once
// Observability of the geometry by the touches, as the indices that the literature compares plans
// by: O1 to O5 (Borm and Menq; Driels and Pathre; Nahvi, Hollerbach and Hayward; Nahvi and
// Hollerbach; Sun and Hollerbach) and the scaled condition number.
//
// They are functions of the singular values sv of the derivatives of all measurements (touches,
// certified lengths, diameters, tip; no tolerances), each row scaled by its sigma and each column
// by its tolerance. A singular value is thus the change of the measurements, in sigmas, for a step
// of one tolerance along a direction: above 1 the touches are more informative than the tolerance.
//
// Columns are the geometry: link errors, tool and its bending. Target positions are eliminated
// (Schur complement): they are not known beforehand, so that the information they absorb is lost to
// the arm, and their columns would mix lengths of targets and links and penalise plans with more
// targets. The frame directions, which no touch can determine, are projected out. Compliance and
// transmission are held: with them there are more unknowns than a usual number of touches
// determines, their share depends on the actual arm rather than on the plan, and their effect is
// included in the sigma of each parameter.
//
// Plans are compared by `rank` and `determined` first; the indices of the plan that determines more
// directions may be lower, since they include directions that the other does not observe.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calib/estimate/problem.h"
#include "calib/estimate/region.h"
#include "calib/estimate/solve.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Indices and counts from singular values (any order) and the number of measured rows; for tests
/// and for other Jacobians. Singular values at rounding level do not count towards the rank.
Observability indices_of(std::span<const double> singular_values, int rows);

/// Observability of the problem's touches at its linearisation. `frame_basis_u`: orthonormal, one
/// column per frame direction (FrameDirections::basis_u).
Observability observability(const Problem& problem, const Linearisation& linear,
                            const Eigen::MatrixXd& frame_basis_u);

// Unidentifiable directions of the parameter space, found numerically from all measurements
// (touches, certified lengths, diameters, tip) without tolerances, transmission and loads:
// - frame directions, which no touch can determine: they move arm and targets as one body, or
//   nothing at all. A choice of frame, not an error.
// - weak directions, which other touches would determine: there the tolerances dominate, and the
//   bounds include them.

struct FrameDirections {
  Eigen::MatrixXd basis_u;  ///< frame directions, size x k, orthonormal, prior units
  std::vector<UnidentifiableDirection> named;  ///< frame directions first, then weak ones
};

/// `stiff`: moves over the workspace (region.h) with a rigid tool; `moves_m`: aligned(stiff).
FrameDirections find_frame_directions(const Problem& problem, const Linearisation& linear,
                                      const TipMoves& stiff, const Eigen::MatrixXd& moves_m);

}  // namespace cellcal::calib
