#pragma once
// Share of the step of a fixed-point iteration that is taken (Aitken 1926; Irons and Tuck 1969): all of
// it, but where steps turn back without becoming small. Gauss-Newton steps do along curved directions
// that the touches hardly determine, such as the place of a reflector on a hand that hardly turns.

#include <Eigen/Core>
#include <algorithm>

namespace cellcal::calib {

class Relaxation {
 public:
  double share_of(const Eigen::VectorXd& step) {
    constexpr double kTurnsBack = -0.25, kLeast = 0.1;
    double share = 1.0;
    if (last_.size() == step.size() && step.dot(last_) < kTurnsBack * last_.squaredNorm()) {
      const Eigen::VectorXd change = step - last_;
      share = std::clamp(-share_ * last_.dot(change) / change.squaredNorm(), kLeast, 1.0);
    }
    last_ = step;
    return share_ = share;
  }

  /// The iteration is of another problem from here on.
  void forget() { last_.resize(0); }

 private:
  Eigen::VectorXd last_;
  double share_ = 1.0;
};

}  // namespace cellcal::calib
