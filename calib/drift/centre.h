#pragma once
// Where the TCP has been, and how far off the next check is of that: innovations that are standard normal and
// independent while nothing changes.

#include <Eigen/Core>

#include "calib/result/drift_chart.h"

namespace cellcal::calib {

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

}  // namespace cellcal::calib
