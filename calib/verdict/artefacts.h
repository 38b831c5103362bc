#pragma once
// Common residuals of the touches of a sphere or the readings of a wire beyond the model: a
// diameter that differs from the cell file, an encoder zeroed elsewhere. The estimate compensates
// for them by a few tenths of a millimetre of arm and target, chi^2 hardly rises, and no other test
// detects them.

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "calib/estimate/estimate.h"
#include "calib/estimate/problem.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

// Information of touches and tolerances on all unknowns, for predicting one statement of the cell
// file by all others (artefacts.h).

/// Normal equations at an estimate, in prior units.
struct NormalEquations {
  Eigen::MatrixXd information;  ///< lower triangle
  Eigen::VectorXd gradient;     ///< gradient of half the sum of squares
};

/// Normal equations of the touches in use, without the certified lengths. At the fullest level
/// instead of the mean over all: a single length is so certain that differences between levels
/// would appear as a contradiction by the others. With wider tolerances: an arm that exceeds them
/// is reported separately and must not affect this test.
NormalEquations normal_equations_without_lengths(const Problem& problem, const Estimate& estimate);

// Redundancy of each touch: the reliability of geodetic networks (Baarda 1968).

/// The touch in use whose largest error within the gate shifts the tip the most, in the mean over
/// the poses of `moves` (aligned_moves(), metres per prior sigma of each arm parameter). Empty if
/// each is determined at least half by the others: then no undetected error has a large effect.
UncheckedTouch least_checked_touch(const Problem& problem, const Estimate& e,
                                   const Eigen::Ref<const Eigen::MatrixXd>& moves);

/// Correction of the radius, or of the readings, of each sphere and wire with touches in use, in
/// the order of the problem's blocks, by all touches, certified lengths and tolerances; and of all
/// wires together, if there are several, which belong to one instrument. From the linearisation,
/// without another solution. `chi2`, `dof`: of the touches; excess scatter reduces their weight.
std::vector<ArtefactBias> artefact_biases(const Problem& problem, const Estimate& estimate,
                                          const NormalEquations& touches, double chi2, double dof);

/// Deviation from the cell file's value in sigmas.
double contradiction(const ArtefactBias& bias);
/// The most contradicted one of those beyond chance and model errors; null: none.
const ArtefactBias* worst_contradicted(const std::vector<ArtefactBias>& biases);

/// The session with that bias corrected.
struct PutRight {
  Cell cell;
  std::vector<Touch> touches;
};
PutRight put_right(const Cell& cell, const std::vector<Touch>& touches, const ArtefactBias& bias);

bool is_of_sphere(const Cell& cell, const ArtefactBias& bias);

// Prediction of each certified length by touches, tolerances and the other lengths, without that
// length itself. A length certified to microns is always fitted, so that its own residual carries
// no information; the prediction by the others does (Baarda's data snooping).

/// All lengths with both ends touched, in the order of the cell file; lengths between the same two
/// ends are left out together, except for a check length, which nothing was fitted to. From the linearisation. `chi2`, `dof`: of the touches; excess
/// scatter reduces the weight of the others.
std::vector<LengthResult> leave_one_out_lengths(const Problem& problem, const Estimate& estimate,
                                                const NormalEquations& touches, double chi2,
                                                double dof);

/// Contradiction of a length by the others, in sigmas of both.
double contradiction(const LengthResult& length);
/// By more than five sigmas: beyond chance and model errors.
bool is_contradicted(const LengthResult& length);
/// Smallest error of a length that the others would contradict [m].
double least_seen_error_m(const LengthResult& length);
/// Between the same two targets, in either order.
bool same_ends(const LengthResult& a, const LengthResult& b);
/// The most contradicted one; null: none.
const LengthResult* worst_contradicted(const std::vector<LengthResult>& lengths);

bool same_ends(const CertifiedLength& a, const CertifiedLength& b);
bool is_of(const LengthResult& result, const CertifiedLength& length);
/// The cell with these lengths, or all, without weight: their predictions are still computed.
Cell silenced(Cell cell, const std::function<bool(const CertifiedLength&)>& which = {});

}  // namespace cellcal::calib
