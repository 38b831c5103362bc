#pragma once
// How well the touches tell the geometry, in the numbers that the field compares plans by: the
// observability indices O1 to O5 (Borm and Menq; Driels and Pathre; Nahvi, Hollerbach and Hayward;
// Nahvi and Hollerbach; Sun and Hollerbach) and the scaled condition number.
//
// They are functions of the singular values sv of the derivatives of everything that was measured
// (touches, certified lengths, diameters, tip; no tolerances), each row in its own sigmas and each
// column in its own tolerance. So sv is how many sigmas the measurements change by for a step of one
// tolerance along a direction: above 1 the touches know better than the tolerance does.
//
// Columns are the geometry: link errors, tool and its bending. Where the targets are is eliminated
// (Schur complement), not kept: no touch knows it beforehand, so that what it takes up is lost to
// the arm, and keeping its columns would mix millimetres of a stand with those of a link and make
// plans with more targets look worse. The frame directions, which no touch anywhere could tell, are
// projected out. Compliance and transmission are held: with them there are more unknowns than any
// usual number of touches can tell, their share hangs on what the arm turns out to be and not on
// the plan, and what they cost is in every parameter's sigma.
//
// Two plans are compared by `rank` and `determined` first; the indices of the one that sees more
// directions may be the lower, for they count directions that the other does not see at all.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calib/estimate/problem.h"
#include "calib/estimate/region.h"
#include "calib/estimate/solve.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Indices and counts from singular values (any order) and the number of rows measured; for tests
/// and for other Jacobians. Values that are nothing but rounding are not counted in the rank.
Observability indices_of(std::span<const double> singular_values, int rows);

/// Of a problem's touches at its linearisation. `frame_basis_u`: orthonormal, one column per frame
/// direction (FrameDirections::basis_u).
Observability observability(const Problem& problem, const Linearisation& linear,
                            const Eigen::MatrixXd& frame_basis_u);

// Directions in parameter space that no touch can tell, found numerically from everything that was
// measured (touches, certified lengths, diameters, tip) without the tolerances, transmission and
// loads aside:
// - frame directions, which no touch anywhere could tell: they move the arm and the targets as one
//   body, or nothing at all. A choice of frame, not an error.
// - weak directions, which these touches do not tell but others would: there the tolerances decide,
//   and the bounds say so.

struct FrameDirections {
  Eigen::MatrixXd basis_u;  ///< frame directions, size x k, orthonormal, prior units
  std::vector<UnidentifiableDirection> named;  ///< frame directions first, then weak ones
};

/// `stiff`: over the workspace (region.h), with a tool that does not bend; `moves_m`:
/// aligned(stiff).
FrameDirections find_frame_directions(const Problem& problem, const Linearisation& linear,
                                      const TipMoves& stiff, const Eigen::MatrixXd& moves_m);

}  // namespace cellcal::calib
