#pragma once
// How the estimate is reached: from zero errors, coarse to exact, robust first, outliers named and
// left out, and then the mean over the model levels.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "calib/estimate/evidence.h"
#include "calib/estimate/options.h"
#include "calib/estimate/problem.h"
#include "calib/estimate/solve.h"

namespace cellcal::calib {

/// What is known at an estimate.
struct Posterior {
  Linearisation linear;
  Eigen::MatrixXd covariance_u;  ///< in prior units
  Eigen::VectorXd leverage;      ///< per row of the linearisation: j S j', how far it holds itself
  /// Where the touches' errors go together (discrepancy.h): L with L L' their correlation, of whose
  /// inverse the linearisation's rows have been multiplied. Empty: they do not.
  Eigen::MatrixXd together;
};

struct Estimate {
  Eigen::VectorXd u;
  std::vector<bool> use;  ///< per touch: fit touches that are no outliers
  Posterior posterior;
  LevelMean levels;
  double gate = 0.0;  ///< studentised residual beyond which a touch is an outlier
};

/// Mean over `levels`. `problem` is at the fullest level and without ripple; it is left with the
/// mean's. Throws IdentifyError where touches and priors determine nothing.
Estimate estimate(Problem& problem, const IdentifyOptions& options, std::vector<ModelLevel> levels);

/// The last part of it, from an estimate that is near: steps of all levels and outliers in turn
/// until neither changes. `e.posterior.linear` is at e.u.
void refine(Problem& problem, const IdentifyOptions& options, std::vector<ModelLevel> levels,
            Estimate& e);

// Which fit touches are outliers: those whose studentised residual is beyond the gate. They are left
// out of the estimate, judged again with each step, and may come back.

/// Of every touch whether it is a fit touch.
std::vector<bool> fit_touches(const Problem& problem);

/// How far a touch is off, in what it is expected to be: |r| / sigma with its own pull on the fit
/// taken out (studentised), for used touches; with the fit's uncertainty added, for the others.
struct Studentised {
  double sigmas = 0.0;
  /// Of one left out: how far it would hold its own place, j S j' / (1 + j S j'). Near 1 nobody
  /// else tells of it, and that it is not off says nothing.
  double own = 0.0;
};

/// The fit touches that agree with the estimate; those left out by it, too. Sets its gate.
std::vector<bool> select_inliers(const Problem& problem, const IdentifyOptions& options,
                                 Estimate& e);

/// Names outliers until nothing changes.
///
/// Of touches of one target that nobody else tells about one comes back at a time, and the others
/// are judged by it: together they would come back whatever they say.
///
/// A touch that has its place nearly to itself may look wrong while it is used and right while it
/// is not; when it comes back for the second time, it is settled for good by what the others say of
/// it. In doubt it stays out: a gross error that is let in does more harm than an honest touch that
/// is missing.
class OutlierRejection {
 public:
  OutlierRejection(const Problem& problem, const IdentifyOptions& options);

  /// Whether e.use changed. `near`: the estimate is near enough for its word to be the last.
  bool changed(const Problem& problem, Estimate& e, bool near);

 private:
  /// Of each target the least off of those left out that nobody else tells about.
  std::vector<std::size_t> first_undetermined(const Problem& problem, const Estimate& e,
                                              const std::vector<Studentised>& off,
                                              double own) const;

  const IdentifyOptions& options_;
  std::vector<bool> fit_, came_back_, settled_;
};

// Play that the load closes: asked for behind the estimate without it.

/// The estimate of `played`, an arm that has play, from that of `plain`, the same arm without, at
/// which `e` is: true and `e` moved there, where the touches make play likelier than it was
/// beforehand; else nothing changes. Touches repeat as weigh_repeats() has said of both.
bool estimate_with_play(const Problem& plain, Problem& played, const IdentifyOptions& options,
                        Estimate& e);

}  // namespace cellcal::calib
