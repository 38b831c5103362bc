#pragma once
// When a check is an alarm. Residuals of a cell in which nothing changed are Gaussian with the covariance
// that the calibration foresees; so how often any number that is made of them exceeds a threshold by chance
// can be drawn, and the threshold for one false alarm in a thousand read off.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/check/foresight.h"
#include "calib/model/linear.h"
#include "calib/result/tcp_check.h"

namespace cellcal::calib {

// What may have changed since a calibration, one thing at a time, and what it does to a touch.

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

/// Share of checks with nothing changed that are told not to hold.
inline constexpr double kFalseAlarms = 1e-3;

class Alarm {
 public:
  /// `covariance_m2`: of the contacts' residuals, nothing changed.
  Alarm(const std::vector<PossibleChange>& changes, const std::vector<ForeseenContact>& contacts,
        const Eigen::MatrixXd& covariance_m2);

  const Cholesky& covariance() const { return covariance_; }
  /// That anything changed over that nothing did, natural logarithm; of whitened residuals of small changes.
  double log_odds(const Eigen::VectorXd& whitened) const;
  double threshold() const { return threshold_; }
  /// Share of shifts of the tool by so much, in any direction, that raise the alarm.
  double found(double shift_m) const;

 private:
  struct Part {  ///< one change
    Eigen::Index first, size;
    double weight;
    std::vector<double> usual;
  };
  Eigen::VectorXd log_odds_of(const Eigen::MatrixXd& whitened) const;

  Cholesky covariance_;
  Eigen::MatrixXd directions_;  ///< orthonormal within each change, one column each
  Eigen::VectorXd square_;      ///< of what one SI unit along each moves the whitened residuals
  std::vector<Part> parts_;
  Eigen::MatrixXd by_tool_;  ///< whitened residuals by its shift
  double threshold_ = 0.0;
};

}  // namespace cellcal::calib
