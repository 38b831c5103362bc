#pragma once
// How well each change explains touches, whatever its size: centimetres as well as microns.

#include <vector>

#include "calib/check/foresight.h"
#include "calib/check/tcp_check.h"
#include "calib/estimate/problem.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/result/tcp_check.h"

namespace cellcal::calib {

/// A change's size by the touches, and how likely they are.
struct Fitted {
  Eigen::VectorXd size;
  Eigen::MatrixXd covariance;
  double log_likelihood = 0.0;  ///< over that of nothing
};

/// `usual`: 1 sigma of each component beforehand. `covariance`: of the residuals, nothing changed.
Fitted fit(const PossibleChange& change, double usual, const std::vector<ForeseenContact>& contacts,
           const Cholesky& covariance);

/// A touch that met nothing: where its search ended, and the sigma of how far that is from the surface.
struct Unmet {
  std::size_t planned = 0;
  ForeseenContact at_end;
  double sigma_m = 0.0;
};

/// Over all sizes that are looked for; of what met nothing, that it would.
Explanation explain(const PossibleChange& change, const std::vector<ForeseenContact>& contacts,
                    const Cholesky& covariance, const std::vector<Unmet>& unmet);
/// Of nothing: how likely it is that a search that should have met its sphere did not.
double log_unmet(const std::vector<Unmet>& unmet);

// The estimator's own equations of touches of spheres, at the values of a calibration and near them.

class KnownTouches {
 public:
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// Throws IdentifyError of a touch of what is no sphere, or of a sphere that the calibration has no place of.
  KnownTouches(const Calibration& calibration, const std::vector<Touch>& touches);
  KnownTouches(const KnownTouches&) = delete;  // parts refer to each other

  const std::vector<Unknown>& unknowns() const { return problem_.unknowns(); }
  const Problem& problem() const { return problem_; }
  /// By the calibration, SI.
  const Eigen::VectorXd& x() const { return x_; }

  /// How far outside of its surface each tip is [m].
  Eigen::VectorXd off_m(const Eigen::VectorXd& x) const;
  /// Derivatives of that by all unknowns, SI.
  RowMajor rows(const Eigen::VectorXd& x) const;
  /// By the calibration.
  ForeseenContact contact(std::size_t touch) const;

 private:
  std::vector<Touch> touches_;
  Cell cell_;
  ArmModel arm_;
  Problem problem_;
  Eigen::VectorXd x_;
};

}  // namespace cellcal::calib
