#include "calib/drift/charts.h"

#include <algorithm>
#include <cmath>

namespace cellcal::calib {

namespace {

constexpr double kLambda = 0.1;  ///< weight of the newest in the EWMA
/// Of each check, taken off the CUSUM: finds steps of 2 sigma best.
constexpr double kAllowed = 1.0;

/// Beyond all limits. No knock, however large, is remembered for longer than some ten checks.
constexpr double kMost = 8.0;

void keep_below(Eigen::Vector3d& v, double most) {
  if (const double length = v.norm(); length > most) v *= most / length;
}

}  // namespace

Charts::Statistics Charts::take(const CheckSeen& check) {
  Statistics at;
  if (centre_.known()) {
    const Eigen::Vector3d u = centre_.against(check).standard / scatter_.factor();  // (96)
    ewma_ = (1.0 - kLambda) * ewma_ + kLambda * u;                                  // (97)
    forgotten_ *= (1.0 - kLambda) * (1.0 - kLambda);
    const double sigma = std::sqrt(kLambda / (2.0 - kLambda) * (1.0 - forgotten_));
    keep_below(ewma_, kMost * sigma);
    at.ewma = ewma_.norm() / sigma;
    cusum_ += u;  // (98)
    const double length = cusum_.norm();
    cusum_ *= length > kAllowed ? 1.0 - kAllowed / length : 0.0;
    keep_below(cusum_, kMost);
    at.cusum = cusum_.norm();
  }
  if (before_) {
    const auto slope = centre_.per_kelvin_m();
    Eigen::Vector3d by_warmth_m = Eigen::Vector3d::Zero();
    if (slope && check.temperature_c && before_->temperature_c)
      by_warmth_m = (*check.temperature_c - *before_->temperature_c) * *slope;
    scatter_.learn(*before_, check, by_warmth_m);
  }
  before_ = check;
  return at;
}

}  // namespace cellcal::calib
