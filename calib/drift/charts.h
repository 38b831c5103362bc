#pragma once
// The two control charts, check after check.

#include "calib/drift/centre.h"

namespace cellcal::calib {

class Charts {
 public:
  explicit Charts(std::optional<double> reference_c) : centre_(reference_c) {}

  struct Statistics {
    double ewma = 0.0, cusum = 0.0;
  };
  /// Of the next check, against all that were learnt.
  Statistics take(const CheckSeen& check);
  /// It becomes part of the centre.
  void learn(const CheckSeen& check) { centre_.learn(check); }
  /// The centre is another from now on; the statistics go on.
  void refer_to(const Centre& centre) { centre_ = centre; }

  const Centre& centre() const { return centre_; }
  double scatter() const { return scatter_.factor(); }

 private:
  Centre centre_;
  Scatter scatter_;
  std::optional<CheckSeen> before_;
  Eigen::Vector3d ewma_ = Eigen::Vector3d::Zero(), cusum_ = Eigen::Vector3d::Zero();
  double forgotten_ = 1.0;  ///< 0.9^(2 n_chart)
};

}  // namespace cellcal::calib
