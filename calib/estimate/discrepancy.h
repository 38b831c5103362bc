#pragma once
// Model discrepancy: systematic position error of the arm that the model does not describe and that
// repeats do not reveal, such as play, friction and unmodelled compliance. It is the same on each
// return to a posture and similar in neighbouring postures, so that all touches share it and it
// does not average out with their number, unlike touch noise.
//
// It is modelled as a random field over the postures: a tip error with three independent
// components, one standard deviation everywhere and the correlation
//     w_f exp(-D_ij^2 / (2 (5 mrad)^2)) + (1 - w_f) exp(-D_ij / reach)
//     D_ij^2 = sum_k (lam_k / lam_max)^2 (q_ik - q_jk)^2,
// lam_k: rms tip motion per radian of joint k. A touch measures one component of it (points and
// trackers: three). The exponential is rough enough for play that changes sides.
//
// Assumptions: the same standard deviation all over the workspace, and no part that is common to
// all touches, which would be geometry or base. Failure case: an error that grows outside the
// touched postures.

#include "calib/estimate/estimate.h"
#include "calib/estimate/repeats.h"

namespace cellcal::calib {

/// Threshold of alike_sigmas() above which the residuals show a field; arms with the worst
/// published gears give 2.
constexpr double kFieldSigmas = 4.0;
/// Touch noise [m] below which correlation is ignored: the solver's last step leaves that much with
/// noise-free touches.
constexpr double kNothingM = 2e-6;
/// Most touches that the estimate with a field takes; further touches of similar postures add little information. The
/// evidence of more is no longer comparable with that of an estimate of all.
constexpr std::size_t kMostTouchesOfField = 1500;

/// Covariance of the whitened residuals of independent errors: 1 - J S J', less what the fit absorbs.
Eigen::MatrixXd left_by_fit(const Eigen::Ref<const RowMajor>& jacobian,
                            const Eigen::MatrixXd& covariance_u);
/// (30): correlation, in standard deviations, of whitened residuals `r` in rows that `k` correlates,
/// for errors of variance `scatter`; `left`: of left_by_fit(). 0 where `k` correlates none.
double correlation_sigmas(const Eigen::VectorXd& r, const Eigen::MatrixXd& k,
                          const Eigen::MatrixXd& left, double scatter);

/// Rows in metres with all unknowns integrated out over their priors; unknowns without a prior are
/// known to ten of their scales.
struct IntegratedRows {
  IntegratedRows(const Problem& problem, const Eigen::VectorXd& u, const RowMajor& jacobian,
                 const Eigen::VectorXd& residual_m);
  Eigen::VectorXd y;            ///< residuals at the priors' means
  Eigen::MatrixXd by_unknowns;  ///< their covariance by the unknowns
};

/// Spatial correlation of the residuals in standard deviations (Moran's I, largest of three
/// reaches), less what the fit itself causes with independent errors. Repeats are not counted.
double alike_sigmas(const Problem& problem, const Estimate& e, double chi2_per_dof);

/// Errors of the arm (1 sigma per component, m) that residuals without a field leave possible. Noise is that of the
/// repeats if measured, otherwise the usual noise of the kind of target; repeats count by their mean.
struct UndetectedErrors {
  double field_m = 0.0;   ///< (33): neither ripple nor noise
  double shared_m = 0.0;  ///< of (33a): that, or what chance may hide, and ripple
};
UndetectedErrors undetected_errors(const Problem& problem, const Estimate& e,
                                   const Repeats& repeats);

/// (33a): errors which touches share where they share a joint's angle. Errors that remain undetected may be such: as
/// independent ones they would average out in the geometry, and with it at joint angles that no touch had.
struct SharedErrors {
  Eigen::MatrixXd covariance_u;  ///< of the estimate, for an rms of 1 m
  double absorbed = 1.0;         ///< factor of the variance for what the fit absorbed of them
};
SharedErrors shared_errors(const Problem& problem, const Estimate& e);

/// Estimates the sizes of field and noise by restricted maximum likelihood (all unknowns integrated
/// out over their priors), then repeats the estimate `e` with correlated touch errors. `e` has been
/// estimated without field. Sets field and noise factor of `problem`, and its ripple to 0, which
/// the field replaces.
Discrepancy estimate_together(Problem& problem, const IdentifyOptions& options,
                              const Repeats& repeats, Estimate& e);

}  // namespace cellcal::calib
