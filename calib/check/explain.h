#pragma once
// Likelihood of each change given the touches, for sizes from microns to centimetres.

#include <vector>

#include "calib/check/foresight.h"
#include "calib/check/tcp_check.h"
#include "calib/estimate/problem.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/result/tcp_check.h"

namespace cellcal::calib {

/// Estimated size of a change, and the likelihood of the touches under it.
struct Fitted {
  Eigen::VectorXd size;
  Eigen::MatrixXd covariance;
  double log_likelihood = 0.0;  ///< relative to no change
};

/// `usual`: prior 1 sigma of each component. `covariance`: of the residuals in an unchanged cell.
Fitted fit(const PossibleChange& change, double usual, const std::vector<ForeseenContact>& contacts,
           const Cholesky& covariance);

/// A touch without contact: end of its search, and the sigma of the distance from there to the surface.
struct Unmet {
  std::size_t planned = 0;
  ForeseenContact at_end;
  double sigma_m = 0.0;
};

/// Marginalised over all sizes considered, including the probability of the missed contacts.
Explanation explain(const PossibleChange& change, const std::vector<ForeseenContact>& contacts,
                    const Cholesky& covariance, const std::vector<Unmet>& unmet);
/// 1 sigma of v's length, or of its first component where it has none.
double sigma_along(const Eigen::Matrix3d& covariance, const Eigen::Vector3d& v);
/// Size of the change with its uncertainty: of one, three, or six components, of which three turn.
void put_size(const Eigen::VectorXd& size, const Eigen::MatrixXd& covariance,
              Explanation& explanation);
/// Normalises the probabilities of all explanations, the most likely first; `weight`: their prior weights.
void share_out(std::vector<Explanation>& explanations, const std::vector<double>& weight);
/// Log probability of the missed contacts in an unchanged cell.
double log_unmet(const std::vector<Unmet>& unmet);

// The estimator's own equations for touches of spheres, at and near the values of a calibration.

class KnownTouches {
 public:
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  /// Throws IdentifyError for a touch of a target that is not a sphere, or of a sphere whose centre the
  /// calibration lacks.
  KnownTouches(const Calibration& calibration, const std::vector<Touch>& touches);
  KnownTouches(const KnownTouches&) = delete;  // members refer to each other

  const std::vector<Unknown>& unknowns() const { return problem_.unknowns(); }
  const Problem& problem() const { return problem_; }
  /// Values of the calibration, SI.
  const Eigen::VectorXd& x() const { return x_; }

  /// Distance of each tip outside its surface [m].
  Eigen::VectorXd off_m(const Eigen::VectorXd& x) const;
  /// Derivatives of off_m() by all unknowns, SI.
  RowMajor rows(const Eigen::VectorXd& x) const;
  /// Contact foreseen by the calibration.
  ForeseenContact contact(std::size_t touch) const;

 private:
  void add_carriers(const ArmChain& chain, int carriers, ForeseenContact& contact) const;

  std::vector<Touch> touches_;
  Cell cell_;
  ArmModel arm_;
  Problem problem_;
  Eigen::VectorXd x_;
};

}  // namespace cellcal::calib
