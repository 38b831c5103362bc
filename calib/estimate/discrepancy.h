#pragma once
// What the model does not explain and repeats do not show: play, friction, links that give in ways
// nobody drew. It is the same whenever the arm comes back to a posture and much the same in
// postures near by, so it does not average away like the noise of a touch: however many touches
// there are, they share it.
//
// It is taken for a field over the postures: an error of the tip whose three components are
// independent, of one sigma everywhere and correlated by
//     w_f exp(-D_ij^2 / (2 (5 mrad)^2)) + (1 - w_f) exp(-D_ij / reach)
//     D_ij^2 = sum_k (lam_k / lam_max)^2 (q_ik - q_jk)^2,
// lam_k how far joint k moves the tip. A touch sees one direction of it. The exponential is rough
// enough for play that changes sides.
//
// Assumption: of one size all over the workspace, and no part of it common to all touches; that
// would be geometry, or the base. Failure case: an error that grows out of the postures touched.

#include "calib/estimate/estimate.h"
#include "calib/estimate/repeats.h"

namespace cellcal::calib {

/// Residuals this much alike (alike_sigmas) show a field; arms whose gears are as bad as published
/// leave 2.
constexpr double kFieldSigmas = 4.0;
/// Of touches free of noise what the solver's last step leaves is alike.
constexpr double kNothingM = 2e-6;

/// By how many sigmas the residuals of like postures are alike (Moran's I, largest of three
/// reaches), given what the fit itself makes of independent errors. Repeats do not count.
double alike_sigmas(const Problem& problem, const Estimate& e, double chi2_per_dof);

/// 1 sigma per component of what may lie in scatter that no repeats show to be noise, where the
/// residuals show no field: `scatter_m` rms, beside what noise is known or usual.
double undetected_field_m(const Problem& problem, const Estimate& e, const Repeats& repeats,
                          double scatter_m);

/// Sizes of field and noise by restricted maximum likelihood (all unknowns integrated out over
/// their priors), then the estimate anew with the touches' correlation. `e` is settled without it.
/// The problem is left with them and without ripple, whose place the field takes.
Discrepancy estimate_together(Problem& problem, const IdentifyOptions& options,
                              const Repeats& repeats, Estimate& e);

}  // namespace cellcal::calib
