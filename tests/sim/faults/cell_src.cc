#include "tests/sim/faults/cell_src.h"

#include <utility>

namespace cellcal::sim {

CellSrc::CellSrc(Programs programs, drivers::Duration brake_test)
    : programs_(std::move(programs)), brake_test_(brake_test) {}

void CellSrc::start() { runs_ = Runs::kAsks; }
void CellSrc::leave() { runs_ = Runs::kNothing; }

bool CellSrc::number(int pgno, drivers::TimePoint now) {
  if (!asks()) return false;
  if (pgno == kCellcal) {
    runs_ = Runs::kCellcal;
    programs_.call();
    return true;
  }
  if (pgno != kBrakeTest) return false;
  runs_ = Runs::kBrakeTest;
  until_ = now + brake_test_;
  return true;
}

void CellSrc::tick(drivers::TimePoint now) {
  if (runs_ == Runs::kCellcal && programs_.stands()) runs_ = Runs::kNothing;
  if (runs_ == Runs::kCellcal && programs_.returned()) runs_ = Runs::kAsks;
  if (runs_ != Runs::kBrakeTest || now < until_) return;
  programs_.test_arm();
  ++tests_;
  requested_ = false;
  programs_.request(false);
  runs_ = Runs::kAsks;
}

void CellSrc::request_brake_test() {
  requested_ = true;
  programs_.request(true);
}

}  // namespace cellcal::sim
