#pragma once
// How well each change explains touches, whatever its size: centimetres as well as microns.

#include <vector>

#include "calib/check/change.h"
#include "calib/linear/cholesky.h"
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

}  // namespace cellcal::calib
