#pragma once
// EWMA and CUSUM control charts over the checks.

#include <Eigen/Core>

#include "calib/result/drift_chart.h"

namespace cellcal::calib {

// Estimate of the TCP's centre, and the innovation of the next check: standard normal and independent while
// nothing changes.

/// Prior 1 sigma of the TCP's shift per kelvin: 12 to 24 um per metre, for an arm of 1 to 2 m.
inline constexpr double kPerKelvinM = 0.03e-3;

/// Estimates the centre, and its temperature coefficient once temperatures are known.
class Centre {
 public:
  struct Innovation {
    Eigen::Vector3d off_m, standard;
  };
  /// State before the first check. `reference_c`: temp_0, if temperatures are known.
  explicit Centre(std::optional<double> reference_c) : reference_c_(reference_c) {}

  bool known() const { return known_; }
  Innovation against(const CheckMeasurement& check) const;
  void learn(const CheckMeasurement& check);

  std::optional<Eigen::Vector3d> per_kelvin_m() const;

 private:
  using State = Eigen::Matrix<double, 6, 1>;
  double warmer(const CheckMeasurement& check) const;

  std::optional<double> reference_c_;
  bool known_ = false;
  State state_ = State::Zero();  ///< centre [m], per_K [m/K]
  Eigen::Matrix<double, 6, 6> covariance_ = Eigen::Matrix<double, 6, 6>::Zero();
};

/// Scatter of the checks relative to the stated one, from differences of neighbours, so that a
/// creep does not change it.
class Scatter {
 public:
  void learn(const CheckMeasurement& before, const CheckMeasurement& check,
             const Eigen::Vector3d& by_warmth_m);
  double factor() const;  ///< factor on sigma

 private:
  double squares_ = 0.0, freedom_ = 0.0;
};

class Charts {
 public:
  explicit Charts(std::optional<double> reference_c) : centre_(reference_c) {}

  struct Statistics {
    double ewma = 0.0, cusum = 0.0;
  };
  /// Statistics of the next check relative to all checks learned so far.
  Statistics take(const CheckMeasurement& check);
  /// Includes the check in the centre.
  void learn(const CheckMeasurement& check) { centre_.learn(check); }
  /// Replaces the centre; the statistics continue.
  void refer_to(const Centre& centre) { centre_ = centre; }

  const Centre& centre() const { return centre_; }
  double scatter() const { return scatter_.factor(); }

 private:
  Centre centre_;
  Scatter scatter_;
  std::optional<CheckMeasurement> before_;
  Eigen::Vector3d ewma_ = Eigen::Vector3d::Zero(), cusum_ = Eigen::Vector3d::Zero();
  double forgotten_ = 1.0;  ///< 0.9^(2 n_chart)
};

// Control limits, computed by 'tests/experiments/run drift --limits': the charts over 20 000 series of checks with
// scatter only, at equal alarm rates of both charts.

inline constexpr ControlLimits kWarnLimits{.ewma = 3.456, .cusum = 4.059, .run_length = 200.0};
inline constexpr ControlLimits kAlarmLimits{.ewma = 3.984, .cusum = 5.091, .run_length = 1000.0};

/// Minimum number of checks for a statement; five checks reduce the variance of the centre to a
/// fifth.
inline constexpr std::size_t kLeastChecks = 5;

/// Days without a decided check after which 'in control' no longer applies: in two weeks a creep of 0.1 mm/month
/// reaches the resolution of a check.
inline constexpr double kMostDays = 14.0;

}  // namespace cellcal::calib
