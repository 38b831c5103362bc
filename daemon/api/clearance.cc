#include "daemon/api/clearance.h"

#include <utility>

namespace cellcal::daemon {

void Clearance::acknowledge(const std::string& name) {
  const std::lock_guard lock(mutex_);
  taken_.reset();
  acknowledged_ = Acknowledgement{name, clock_() + kClearanceLasts};
}

bool Clearance::take(const std::string& name) {
  const std::lock_guard lock(mutex_);
  if (!acknowledged_ || acknowledged_->name != name || clock_() >= acknowledged_->until)
    return false;
  taken_ = std::exchange(acknowledged_, std::nullopt);
  return true;
}

void Clearance::put_back(const std::string& name) {
  const std::lock_guard lock(mutex_);
  if (taken_ && taken_->name == name && !acknowledged_)
    acknowledged_ = std::exchange(taken_, std::nullopt);
}

void Clearance::forget() {
  const std::lock_guard lock(mutex_);
  acknowledged_.reset();
  taken_.reset();
}

void Clearance::look(const Status& status) {
  // kIdle and kDone leave the confirmation unchanged; kDone never occurs without a session under way.
  if (status.phase != Phase::kIdle && status.phase != Phase::kDone) forget();
}

}  // namespace cellcal::daemon
