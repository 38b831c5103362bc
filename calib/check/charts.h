#pragma once
// The two control charts, check after check.

#include <Eigen/Core>

#include "calib/result/drift_chart.h"

namespace cellcal::calib {

// Where the TCP has been, and how far off the next check is of that: innovations that are standard normal and
// independent while nothing changes.

/// What a kelvin may do beforehand, 1 sigma: 12 to 24 um per metre, of an arm of a metre or two.
inline constexpr double kPerKelvinM = 0.03e-3;

/// As long as temperatures are not known, a centre alone.
class Centre {
 public:
  struct Innovation {
    Eigen::Vector3d off_m, standard;
  };
  /// Of no check before the first. `reference_c`: temp_0, where temperatures are known.
  explicit Centre(std::optional<double> reference_c) : reference_c_(reference_c) {}

  bool known() const { return known_; }
  Innovation against(const CheckSeen& check) const;
  void learn(const CheckSeen& check);

  std::optional<Eigen::Vector3d> per_kelvin_m() const;

 private:
  using State = Eigen::Matrix<double, 6, 1>;
  double warmer(const CheckSeen& check) const;

  std::optional<double> reference_c_;
  bool known_ = false;
  State state_ = State::Zero();  ///< centre [m], per_K [m/K]
  Eigen::Matrix<double, 6, 6> covariance_ = Eigen::Matrix<double, 6, 6>::Zero();
};

/// How much checks scatter beyond what is stated, by neighbours: a creep does not move it.
class Scatter {
 public:
  void learn(const CheckSeen& before, const CheckSeen& check, const Eigen::Vector3d& by_warmth_m);
  double factor() const;  ///< of a sigma

 private:
  double squares_ = 0.0, freedom_ = 0.0;
};

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

// The control limits. Worked out by 'tests/experiments/drift --limits': the charts over checks in which nothing but
// their scatter is another, 20 000 times; both charts alarm as often as each other.

inline constexpr ControlLimits kWarnLimits{.ewma = 3.456, .cusum = 4.059, .run_length = 200.0};
inline constexpr ControlLimits kAlarmLimits{.ewma = 3.984, .cusum = 5.091, .run_length = 1000.0};

/// Checks before anything is said: five share their centre's error by four.
inline constexpr std::size_t kLeastChecks = 5;

/// Days without a check that decided something, behind which 'in control' says nothing of now: in two weeks a creep of
/// 0.1 mm/month is what a check sees.
inline constexpr double kMostDays = 14.0;

}  // namespace cellcal::calib
