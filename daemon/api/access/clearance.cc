#include "daemon/api/access/clearance.h"

#include <utility>

namespace cellcal::daemon {

void Clearance::acknowledge(const std::string& name) {
  const std::lock_guard lock(mutex_);
  taken_.reset();
  said_ = Said{name, clock_() + kClearanceLasts};
}

bool Clearance::take(const std::string& name) {
  const std::lock_guard lock(mutex_);
  if (!said_ || said_->name != name || clock_() >= said_->until) return false;
  taken_ = std::exchange(said_, std::nullopt);
  return true;
}

void Clearance::put_back(const std::string& name) {
  const std::lock_guard lock(mutex_);
  if (taken_ && taken_->name == name && !said_) said_ = std::exchange(taken_, std::nullopt);
}

void Clearance::forget() {
  const std::lock_guard lock(mutex_);
  said_.reset();
  taken_.reset();
}

void Clearance::look(const Status& status) {
  // Idle and done leave what was said as it is. Done cannot come without a session under way.
  if (status.phase != Phase::kIdle && status.phase != Phase::kDone) forget();
}

}  // namespace cellcal::daemon
