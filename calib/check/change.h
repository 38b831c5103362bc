#pragma once
// What may have changed since a calibration, one thing at a time, and what it does to a touch.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/check/foresight.h"
#include "calib/result/tcp_check.h"

namespace cellcal::calib {

struct PossibleChange {
  ChangeKind kind = ChangeKind::kTool;
  std::string name;       ///< as Explanation's
  std::size_t index = 0;  ///< of the joint, of the touch
  int size = 3;           ///< components
  double weight = 1.0;    ///< probability beforehand, among all changes
  /// Sizes that are looked for, each as likely as the others: 1 sigma of each component, SI.
  std::vector<double> usual = {};
};

/// All that these touches could show. The last joint is none of them: its zero moves the tip on the flange
/// as a shift of the tool does, so the tool stands for both.
std::vector<PossibleChange> possible_changes(const Calibration& calibration,
                                             const std::vector<ForeseenContact>& contacts);

/// What the touches would be off by had that changed by `size`, and the derivatives by its components.
struct Changed {
  Eigen::VectorXd off_m;
  Eigen::MatrixXd by_size;
};
Changed changed(const PossibleChange& change, const Eigen::VectorXd& size,
                const std::vector<ForeseenContact>& contacts);
/// The derivatives where nothing has changed yet.
Eigen::MatrixXd columns_of(const PossibleChange& change,
                           const std::vector<ForeseenContact>& contacts);

}  // namespace cellcal::calib
